"""Every preset is a state that does what its title says."""

from __future__ import annotations

import itertools
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


def simulated(name: str):
    state = preset(name).state()
    run = state.study.run
    return state, wb.simulate(state.system, periods=state.periods, initial=run.initial)


@pytest.mark.parametrize("name", PRESETS)
def test_each_is_a_state_a_study_and_has_a_motion(name):
    one = preset(name)
    state = one.state()
    assert one.name == name
    assert one.group in GROUPS
    assert state.view.axis in axes(state.system)
    low, high = span(state, state.view.axis)
    assert low < high
    assert 20 <= state.periods <= MOST_PERIODS
    assert one.state() == state
    assert wb.read_study(state.study.to_toml()) == state.study
    assert take_snapshot(state).status in ("completed", "diverged")
    # Those of the paper run as long as its cases.
    frequency = state.system.excitation.frequency
    if name.startswith("fig"):
        assert 25.0 <= state.periods / frequency + 1e-9 < 25.0 + 1.0 / frequency


def test_the_list_begins_where_one_starts_and_has_a_heading_for_each_group():
    assert next(iter(PRESETS)) == START
    state = preset(START).state()
    assert state.system == wb.paper.system()
    assert state.system.stated == {"eta": -24.0, "f": 0.63, "F0": 0.036, "alpha": 1.18}
    assert [key for key, _ in itertools.groupby(one.group for one in PRESETS.values())] == [*GROUPS]


def test_titles_differ_and_say_what_varies():
    assert len({one.title for one in PRESETS.values()}) == len(PRESETS)
    assert preset("fig9c").title == "Fig. 9 c: wedge, η = −30"
    assert preset("fig6c").title == "Fig. 6 c: wedge, f = 1.89, F₀ = 0.114"
    assert preset("fig16d").title == "Fig. 16 d: conventional, f = 1.3 (20 Hz)"
    assert preset("fig18a").title == "Fig. 18 a: wedge, angle 0.2 rad"
    assert preset("fig8b").title == "Fig. 8 b: conventional over η, −120 to 12"


@pytest.mark.parametrize("name", ["fig9x", "", None, 3, "FIG9C"])
def test_an_unknown_name(name):
    with pytest.raises(wb.InputError, match=r"^preset = .*: not known\. (Did|Allowed)"):
        preset(name)


def test_all_cases_of_the_paper_in_the_order_of_its_rows():
    printed = {
        f"fig{number}{letter}": CORRECTED.system(case, "coulomb")
        for number, rows in RESPONSES.items()
        for letter, case in zip("abcdef", rows.cases, strict=False)
    }
    found = {name for name, one in PRESETS.items() if one.group == GROUPS[0]}
    assert found - {START, "as-printed"} == set(printed)
    for name, system in printed.items():
        assert preset(name).state().system == system
    # 63 rad/s and the like are of the paper; its cases run at 5, 10, ... Hz.
    hertz = [preset(f"fig15{one}").state().system.excitation.frequency for one in "abcde"]
    assert hertz == pytest.approx([5.0, 10.0, 16.0, 20.0, 33.0], rel=1e-12)


@pytest.mark.parametrize("name", DIAGRAMS)
def test_all_diagrams_of_the_paper(name):
    plan, state = DIAGRAMS[name], preset(f"fig{name}").state()
    assert state.view.plot == "diagram"
    assert state.view.axis == plan.name
    assert span(state, plan.name) == (plan.low, plan.high)
    assert state.system == CORRECTED.system(plan.base, "coulomb")
    assert state.system.brake.kind == {"a": WEDGE, "b": CONVENTIONAL}.get(name[-1], WEDGE)


def test_as_printed_diverges_and_chaos_is_where_the_paper_has_it():
    state, response = simulated("as-printed")
    assert response.attrs["status"] == "diverged"
    assert (state.system.driveline.damping, state.system.friction.static) == (1.0, 0.33)
    assert not state.system.actuation.release
    assert wb.motion(preset("fig9c").state().system, max_events=MOST_EVENTS).kind == "chaotic"


@pytest.mark.parametrize("name", ["band", "falling-friction"])
def test_stick_and_slip_about_the_drive_speed(name):
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


def test_falling_friction_is_what_drives_it():
    """Friction constant in speed lets the same start decay."""
    state = preset("falling-friction").state()
    speeds, coefficients = zip(*state.system.friction.nodes(), strict=True)
    sliding = state.system.brake.radius * state.system.driveline.drive_speed
    level = wb.CoulombFriction(kinetic=float(np.interp(sliding, speeds, coefficients)))
    response = wb.simulate(
        state.system.replace(friction=level), periods=250, initial=state.study.run.initial
    )
    assert wb.sticks(response).attrs["class"] == "non-stick-slip"
    assert float(np.ptp(response["velocity"].to_numpy()[-500:])) < 0.01


def test_the_wedge_locks_itself_and_the_shoe_sticks():
    state, response = simulated("self-locking")
    assert math.tan(state.system.brake.angle) < state.system.friction.kinetic
    assert wb.stability(state.system).self_locking == "kinetic"
    assert float(np.max(response["velocity"])) == 0.0
    assert take_snapshot(state).motion.kind == "at rest"
    state, response = simulated("leading-shoe")
    assert state.system.brake.kind == "leading-shoe"
    assert wb.sticks(response).attrs["class"] == "bidirectional stick-slip"
