"""The snapshot is what wb.simulate, wb.motion and the other measures say, and never raises."""

from __future__ import annotations

import math
import time
from dataclasses import fields

import numpy as np
import pytest

import wedgebrake as wb
from wedgebrake.analysis.torque import brake_torque
from wedgebrake.explorer.core.limits import MOST_EVENTS, SAMPLES_PER_PERIOD
from wedgebrake.explorer.core.snapshot import Snapshot, take_snapshot
from wedgebrake.explorer.core.state import PageState, new_state
from wedgebrake.model.study import Run


@pytest.fixture
def state() -> PageState:
    return new_state(wb.paper.system(eta=-24, f=0.63, F0=0.036, alpha=1.18))


def simulated(state: PageState, periods: int, samples: int = SAMPLES_PER_PERIOD):
    """The response over the last periods of the run, from the front door."""
    frequency = state.system.excitation.frequency
    last = state.periods
    times = np.linspace((last - periods) / frequency, last / frequency, periods * samples + 1)
    times = np.clip(times, 0.0, state.periods / frequency)
    return wb.simulate(state.system, periods=last, times=times)


def check_sizes(snapshot: Snapshot) -> None:
    count = snapshot.figures.history.time.size
    assert count != 1
    for name in ("angle", "velocity", "brake_torque", "drive_torque", "sticking"):
        assert getattr(snapshot.figures.history, name).shape == (count,)
    assert snapshot.figures.section.angle.shape == snapshot.figures.section.velocity.shape
    assert snapshot.figures.spectrum.frequency.shape == snapshot.figures.spectrum.amplitude.shape
    assert np.all(np.isfinite(snapshot.figures.history.velocity))
    assert snapshot.message


class TestAgainstTheFrontDoor:
    def test_samples_are_those_of_simulate(self, state):
        snapshot = take_snapshot(state)
        response = simulated(state, 12)
        assert snapshot.status == "completed"
        assert snapshot.figures.history.time.size == 12 * SAMPLES_PER_PERIOD + 1
        history = snapshot.figures.history
        for name in ("time", "angle", "velocity", "brake_torque", "drive_torque"):
            expected = response[name].to_numpy()
            scale = np.max(np.abs(expected))
            np.testing.assert_allclose(getattr(history, name), expected, atol=1e-9 * scale)
        sticks = wb.sticks(response, history.time[0])
        np.testing.assert_allclose(history.sticks.side, sticks["entry"])
        np.testing.assert_allclose(history.sticks.start[1:-1], sticks["start"][1:-1], rtol=1e-12)
        np.testing.assert_allclose(history.sticks.end[1:-1], sticks["end"][1:-1], rtol=1e-12)
        assert history.time[0] <= history.sticks.start[0]
        assert history.sticks.end[-1] <= history.time[-1]

    @pytest.mark.parametrize("friction", ["coulomb", "smoothed", "tabulated"])
    def test_the_motion_is_that_of_wb_motion(self, state, friction):
        state = state.edited(friction=friction)
        snapshot = take_snapshot(state)
        expected = wb.motion(state.system, state.periods, transient=state.transient)
        if friction != "smoothed":
            assert repr(snapshot.motion.as_dict()) == repr(expected.as_dict())
            return
        # Samples end no step of the solver's, but its periods do.
        for field in fields(expected):
            found, right = (getattr(one, field.name) for one in (snapshot.motion, expected))
            if isinstance(right, float):
                assert found == pytest.approx(right, rel=1e-5, nan_ok=True), field.name
            else:
                assert found == right, field.name

    def test_a_settled_motion_is_judged_with_its_transient(self, state):
        snapshot = take_snapshot(state, settle=True)
        assert repr(snapshot.motion.as_dict()) == repr(
            wb.motion(state.system, state.recorded).as_dict()
        )
        assert snapshot.motion.settling == 147

    def test_spectrum_and_section_are_of_the_recorded_periods(self, state):
        snapshot = take_snapshot(state)
        response = simulated(state, state.recorded)
        lines = wb.spectrum(response)
        count = snapshot.figures.spectrum.frequency.size
        np.testing.assert_allclose(
            snapshot.figures.spectrum.frequency, lines["frequency"][:count], rtol=1e-9
        )
        np.testing.assert_allclose(
            snapshot.figures.spectrum.amplitude, lines["amplitude"][:count], atol=1e-9
        )
        highest = 6.0 * snapshot.figures.spectrum.natural
        assert lines["frequency"][count - 1] <= highest < lines["frequency"][count]
        points = wb.poincare(state.system, state.periods, transient=state.transient)
        np.testing.assert_allclose(snapshot.figures.section.angle, points["angle"], atol=1e-12)
        np.testing.assert_allclose(
            snapshot.figures.section.velocity, points["velocity"], atol=1e-10
        )
        assert snapshot.figures.spectrum.forcing == state.system.excitation.frequency
        assert snapshot.braking.peak == pytest.approx(brake_torque(response).peak)

    def test_more_periods_may_be_shown_than_are_recorded(self, state):
        narrow, wide = take_snapshot(state), take_snapshot(state.edited(shown=100))
        assert wide.figures.history.time.size == 100 * SAMPLES_PER_PERIOD + 1
        np.testing.assert_allclose(
            wide.figures.spectrum.frequency, narrow.figures.spectrum.frequency, rtol=1e-12
        )
        np.testing.assert_allclose(
            wide.figures.spectrum.amplitude, narrow.figures.spectrum.amplitude, atol=1e-9
        )
        assert wide.figures.section.angle.size == narrow.figures.section.angle.size
        assert wide.braking.mean == pytest.approx(narrow.braking.mean, abs=1e-9)

    def test_no_more_is_shown_than_was_run(self, state):
        snapshot = take_snapshot(state.edited(periods=20, shown=100))
        assert snapshot.figures.history.time[0] == 0.0
        assert snapshot.figures.history.time.size == 20 * SAMPLES_PER_PERIOD + 1

    def test_a_later_start_keeps_the_phase_of_the_torque(self, state):
        quarter = 0.25 / state.system.excitation.frequency
        later = PageState.of(state.study.changed(start_time=quarter))
        response = wb.simulate(state.system, periods=250, start_time=quarter)
        snapshot = take_snapshot(later)
        np.testing.assert_allclose(
            snapshot.figures.history.velocity[-1], response["velocity"][-1], atol=1e-8
        )
        assert snapshot.motion.order == 6

    def test_a_slow_torque_is_sampled_by_the_natural_period(self, state):
        snapshot = take_snapshot(state.edited(frequency=1.0))
        assert (
            snapshot.figures.history.time[1] - snapshot.figures.history.time[0]
            <= 0.05 / snapshot.figures.spectrum.natural
        )
        assert snapshot.figures.spectrum.frequency[-1] == pytest.approx(
            6.0 * snapshot.figures.spectrum.natural, rel=0.01
        )

    def test_a_much_slower_torque_has_no_spectrum(self, state):
        snapshot = take_snapshot(state.edited(frequency=0.1))
        assert snapshot.status == "completed"
        assert snapshot.figures.spectrum.frequency.size == 0


class TestGhost:
    def test_is_the_same_machine_with_a_conventional_brake(self, state):
        state = state.edited(comparison=True)
        comparison = take_snapshot(state).comparison
        brake = wb.ConventionalBrake(radius=state.system.brake.radius)
        other = new_state(state.system.replace(brake=brake))
        expected = take_snapshot(other)
        assert comparison is not None
        np.testing.assert_array_equal(
            comparison.figures.history.velocity, expected.figures.history.velocity
        )
        np.testing.assert_array_equal(
            comparison.figures.spectrum.amplitude, expected.figures.spectrum.amplitude
        )
        assert repr(comparison.motion.as_dict()) == repr(expected.motion.as_dict())
        assert comparison.comparison is None

    def test_a_conventional_brake_has_none(self, state):
        assert take_snapshot(state).comparison is None
        assert take_snapshot(state.edited(brake="conventional", comparison=True)).comparison is None


class TestEarlyEnds:
    def test_a_diverging_motion_is_shown_where_it_went(self):
        state = new_state(wb.paper.system(eta=-24, release=False, damping=1.0))
        snapshot = take_snapshot(state)
        check_sizes(snapshot)
        assert (snapshot.status, snapshot.motion.kind) == ("diverged", "diverged")
        assert snapshot.figures.history.time.size > 500
        assert np.max(np.abs(snapshot.figures.history.velocity)) > 1e6
        assert snapshot.figures.spectrum.frequency.size == 0
        assert math.isnan(snapshot.braking.mean)
        assert repr(take_snapshot(state, settle=True).motion.as_dict()) == repr(
            snapshot.motion.as_dict()
        )

    def test_a_brake_that_locks_while_sliding(self):
        system = wb.paper.system(eta=-1.0).replace(kinetic=0.4, static=0.4)
        snapshot = take_snapshot(
            PageState.of(wb.Study(system, Run(initial=(0.0, 5.0), periods=50)))
        )
        check_sizes(snapshot)
        assert snapshot.status == "no_forward_solution"
        assert snapshot.motion.kind == "self-locked"
        assert "locked" in snapshot.message

    @pytest.mark.parametrize("friction", ["coulomb", "smoothed"])
    def test_at_rest(self, state, friction):
        snapshot = take_snapshot(state.edited(amplitude=0.0).edited(friction=friction))
        check_sizes(snapshot)
        assert snapshot.motion.kind == "at rest"
        np.testing.assert_allclose(snapshot.figures.history.velocity, 0.0, atol=1e-12)
        assert snapshot.figures.spectrum.amplitude.size > 0


EXTREMES = [
    {"stiffness": 1e15}, {"stiffness": 0.0}, {"frequency": 1e-9}, {"frequency": 1e6},
    {"stiffness": 1e15, "frequency": 1e-9}, {"inertia": 1e-9}, {"damping": 0.0},
    {"initial_force": 0.0}, {"drive_speed": 1e3}, {"amplitude": 1e9}, {"radius": 1e-6},
]  # fmt: skip


@pytest.mark.parametrize("changes", EXTREMES, ids=str)
@pytest.mark.parametrize("friction", ["coulomb", "smoothed", "tabulated"])
def test_extremes_come_back_in_time(state, friction, changes):
    state = state.edited(friction=friction).edited(**changes)
    take_snapshot(
        new_state(wb.paper.system(friction="smoothed" if friction == "smoothed" else "coulomb"))
    )
    begin = time.perf_counter()
    snapshot = take_snapshot(state)
    spent = time.perf_counter() - begin
    check_sizes(snapshot)
    assert snapshot.status in {status.value for status in wb.Status}
    assert snapshot.motion.status == snapshot.status
    # About one second on an idle machine.
    assert spent < 10.0


def test_what_stops_at_a_limit_shows_its_beginning(state):
    snapshot = take_snapshot(state.edited(stiffness=1e15))
    assert snapshot.status == "event_limit"
    assert snapshot.figures.history.time[0] == 0.0
    assert snapshot.figures.history.time.size > 500
    assert snapshot.motion.kind == "undecided"
    whole = wb.simulate(
        state.edited(stiffness=1e15).system, periods=250, times=(), max_events=MOST_EVENTS
    )
    assert snapshot.figures.history.time[-1] == pytest.approx(0.1 * whole.attrs["final_time"])
