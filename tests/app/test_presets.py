"""Every preset is a state that does what its title says."""

from __future__ import annotations

import math

import numpy as np
import pytest

import wedgebrake as wb
from wedgebrake.explorer.core.limits import MOST_EVENTS, MOST_PERIODS
from wedgebrake.explorer.core.parameter_ranges import span
from wedgebrake.explorer.core.presets import PRESETS, START, preset
from wedgebrake.explorer.core.snapshot import take_snapshot
from wedgebrake.explorer.core.state import axes
from wedgebrake.model.paper_machines import CONVENTIONAL, CORRECTED, DIAGRAMS, RESPONSES, WEDGE

GROUPS = ("Responses of the paper", "Diagrams of the paper", "Other machines")


def simulated(name: str, **options):
    state = preset(name).state()
    run = state.study.run
    return state, wb.simulate(state.system, periods=state.periods, initial=run.initial, **options)


@pytest.mark.parametrize("name", PRESETS)
class TestEach:
    def test_is_a_desk(self, name):
        one = preset(name)
        state = one.state()
        assert one.name == name
        assert one.group in GROUPS
        assert 10 < len(one.title) <= 60
        assert state.view.axis in axes(state.system)
        low, high = span(state, state.view.axis)
        assert low < high
        assert 20 <= state.periods <= MOST_PERIODS
        assert one.state() == state

    def test_is_a_study(self, name):
        study = preset(name).state().study
        assert wb.read_study(study.to_toml()) == study

    def test_can_be_looked_at(self, name):
        snapshot = take_snapshot(preset(name).state())
        assert snapshot.status in ("completed", "diverged")


class TestList:
    def test_begins_where_one_starts(self):
        assert next(iter(PRESETS)) == START
        state = preset(START).state()
        assert state.system == wb.paper.system()
        assert state.system.stated == {"eta": -24.0, "f": 0.63, "F0": 0.036, "alpha": 1.18}

    def test_groups_are_together(self):
        """One heading each."""
        found = [one.group for one in PRESETS.values()]
        assert [one for i, one in enumerate(found) if i == 0 or found[i - 1] != one] == [*GROUPS]

    def test_titles_differ(self):
        assert len({one.title for one in PRESETS.values()}) == len(PRESETS)

    def test_titles_say_what_varies(self):
        assert preset("fig9c").title == "Fig. 9 c: wedge, η = −30"
        assert preset("fig6c").title == "Fig. 6 c: wedge, f = 1.89, F₀ = 0.114"
        assert preset("fig16d").title == "Fig. 16 d: conventional, f = 1.3 (20 Hz)"
        assert preset("fig18a").title == "Fig. 18 a: wedge, angle 0.2 rad"
        assert preset("fig8b").title == "Fig. 8 b: conventional over η, −120 to 12"

    @pytest.mark.parametrize("name", ["fig9x", "", None, 3, "FIG9C"])
    def test_an_unknown_name(self, name):
        with pytest.raises(wb.InputError, match=r"^preset = .*: not known\. (Did|Allowed)"):
            preset(name)


class TestPaper:
    def test_has_all_printed_cases(self):
        """In the order of the rows."""
        printed = {
            f"fig{number}{letter}": CORRECTED.system(case, "coulomb")
            for number, rows in RESPONSES.items()
            for letter, case in zip("abcdef", rows.cases, strict=False)
        }
        found = {name for name, one in PRESETS.items() if one.group == GROUPS[0]}
        assert found - {START, "as-printed"} == set(printed)
        for name, system in printed.items():
            assert preset(name).state().system == system

    def test_frequencies_are_whole_hertz(self):
        """63 rad/s and the like are of the paper; its cases run at 5, 10, ... Hz."""
        found = [preset(f"fig15{one}").state().system.excitation.frequency for one in "abcde"]
        assert found == pytest.approx([5.0, 10.0, 16.0, 20.0, 33.0], rel=1e-12)

    @pytest.mark.parametrize("name", DIAGRAMS)
    def test_has_all_diagrams(self, name):
        plan, state = DIAGRAMS[name], preset(f"fig{name}").state()
        assert state.view.plot == "diagram"
        assert state.view.axis == plan.name
        assert span(state, plan.name) == (plan.low, plan.high)
        assert state.system == CORRECTED.system(plan.base, "coulomb")
        assert state.system.brake.kind == {"a": WEDGE, "b": CONVENTIONAL}.get(name[-1], WEDGE)

    def test_runs_as_long_as_the_paper(self):
        for name in PRESETS:
            if name.startswith("fig"):
                state = preset(name).state()
                frequency = state.system.excitation.frequency
                assert 25.0 <= state.periods / frequency + 1e-9 < 25.0 + 1.0 / frequency

    def test_as_printed_diverges(self):
        state, response = simulated("as-printed")
        assert response.attrs["status"] == "diverged"
        assert (state.system.driveline.damping, state.system.friction.static) == (1.0, 0.33)
        assert not state.system.actuation.release

    def test_chaos_where_the_paper_has_it(self):
        state = preset("fig9c").state()
        assert wb.motion(state.system, max_events=MOST_EVENTS).kind == "chaotic"


class TestOthers:
    @pytest.mark.parametrize("name", ["band", "falling-friction"])
    def test_stick_and_slip_about_the_drive_speed(self, name):
        """Rest is relative to the drum: the shaft is carried back, and lets go, again and again."""
        state, response = simulated(name)
        speed = state.system.driveline.drive_speed
        sticks = wb.sticks(response)
        assert sticks.attrs["class"] == "unidirectional stick-slip"
        assert sticks.attrs["count"] > 50
        velocity = response["velocity"].to_numpy()[-2000:]
        sticking = response["sticking"].to_numpy()[-2000:] == 1
        assert np.all(velocity[sticking] == -speed)
        assert float(np.max(velocity)) > 0.9 * speed
        assert float(np.min(velocity)) >= -speed * (1.0 + 1e-12)

    def test_falling_friction_is_what_drives_it(self):
        """Friction constant in speed lets the same start decay."""
        state, _ = simulated("falling-friction")
        speeds, coefficients = zip(*state.system.friction.nodes(), strict=True)
        sliding = state.system.brake.radius * state.system.driveline.drive_speed
        level = wb.CoulombFriction(kinetic=float(np.interp(sliding, speeds, coefficients)))
        response = wb.simulate(
            state.system.replace(friction=level), periods=250, initial=state.study.run.initial
        )
        assert wb.sticks(response).attrs["class"] == "non-stick-slip"
        assert float(np.ptp(response["velocity"].to_numpy()[-500:])) < 0.01

    def test_the_wedge_locks_itself(self):
        state, response = simulated("self-locking")
        assert math.tan(state.system.brake.angle) < state.system.friction.kinetic
        assert wb.stability(state.system).self_locking == "kinetic"
        assert float(np.max(response["velocity"])) == 0.0
        assert take_snapshot(state).motion.kind == "at rest"

    def test_the_shoe_sticks(self):
        state, response = simulated("leading-shoe")
        assert state.system.brake.kind == "leading-shoe"
        assert wb.sticks(response).attrs["class"] == "bidirectional stick-slip"
