"""The snapshot is what wb.simulate, wb.motion and the other measures say, and never raises."""

from __future__ import annotations

import math
from dataclasses import fields

import numpy as np
import pytest
from states import new_state

import wedgebrake as wb
from wedgebrake.analysis.responses.torque import brake_torque
from wedgebrake.explorer.core.limits import MOST_EVENTS, SAMPLES_PER_PERIOD
from wedgebrake.explorer.core.snapshot import take_snapshot
from wedgebrake.explorer.core.state import PageState
from wedgebrake.model.studies.study import RunSettings


@pytest.fixture
def state() -> PageState:
    return new_state(wb.paper.system(eta=-24, f=0.63, F0=0.036, alpha=1.18))


def simulated(state: PageState, periods: int):
    """The response over the last periods of the run, from the front door."""
    frequency, last = state.system.excitation.frequency, state.periods
    count = periods * SAMPLES_PER_PERIOD + 1
    times = np.linspace((last - periods) / frequency, last / frequency, count)
    return wb.simulate(state.system, periods=last, times=times)


class TestAgainstTheFrontDoor:
    def test_samples_are_those_of_simulate(self, state):
        snapshot, response = take_snapshot(state), simulated(state, 12)
        history = snapshot.figures.history
        assert snapshot.status == "completed"
        assert history.time.size == 12 * SAMPLES_PER_PERIOD + 1
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
        for motion, right in ((snapshot.motion, expected),
                              (snapshot.motion.contacts[0], expected.contacts[0])):  # fmt: skip
            for field in fields(right):
                found, value = getattr(motion, field.name), getattr(right, field.name)
                if isinstance(value, float) or field.name == "exponents":
                    assert found == pytest.approx(value, rel=1e-5, nan_ok=True), field.name
                elif field.name != "contacts":
                    assert found == value, field.name

    def test_a_settled_motion_is_judged_with_its_transient(self, state):
        snapshot = take_snapshot(state, settle=True)
        assert repr(snapshot.motion.as_dict()) == repr(
            wb.motion(state.system, state.recorded).as_dict()
        )

    def test_spectrum_and_section_are_of_the_recorded_periods(self, state):
        snapshot, response = take_snapshot(state), simulated(state, state.recorded)
        lines, found = wb.spectrum(response), snapshot.figures.spectrum
        count = found.frequency.size
        np.testing.assert_allclose(found.frequency, lines["frequency"][:count], rtol=1e-9)
        np.testing.assert_allclose(found.amplitude, lines["amplitude"][:count], atol=1e-9)
        assert lines["frequency"][count - 1] <= 6.0 * found.natural < lines["frequency"][count]
        assert found.forcing == state.system.excitation.frequency
        section = snapshot.figures.section
        points = wb.poincare(state.system, state.periods, transient=state.transient)
        np.testing.assert_allclose(section.angle, points["angle"], atol=1e-12)
        np.testing.assert_allclose(section.velocity, points["velocity"], atol=1e-10)
        assert snapshot.braking.peak == pytest.approx(brake_torque(response).peak)

    def test_a_later_start_keeps_the_phase_of_the_torque(self, state):
        quarter = 0.25 / state.system.excitation.frequency
        later = PageState.of(state.study.changed(start_time=quarter))
        response = wb.simulate(state.system, periods=250, start_time=quarter)
        snapshot = take_snapshot(later)
        np.testing.assert_allclose(
            snapshot.figures.history.velocity[-1], response["velocity"][-1], atol=1e-8
        )
        assert snapshot.motion.order == 6


def test_the_comparison_is_the_same_system_with_a_conventional_brake(state):
    comparison = take_snapshot(state.edited(comparison=True)).comparison
    brake = wb.ConventionalBrake(radius=state.system.brake.radius)
    expected = take_snapshot(new_state(state.system.replace(brake=brake)))
    here, there = comparison.figures, expected.figures
    np.testing.assert_array_equal(here.history.velocity, there.history.velocity)
    np.testing.assert_array_equal(here.spectrum.amplitude, there.spectrum.amplitude)
    assert repr(comparison.motion.as_dict()) == repr(expected.motion.as_dict())
    assert comparison.comparison is None
    # Of a conventional brake there is none.
    assert take_snapshot(state).comparison is None
    assert take_snapshot(state.edited(brake="conventional", comparison=True)).comparison is None


class TestEarlyEnds:
    def test_a_diverging_motion_is_shown_where_it_went(self):
        state = new_state(wb.paper.system(eta=-24, release=False, damping=1.0))
        snapshot = take_snapshot(state)
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
            PageState.of(wb.Study(system, RunSettings(initial=(0.0, 5.0), periods=50)))
        )
        assert snapshot.status == "no_forward_solution"
        assert snapshot.motion.kind == "self-locked"
        assert "locked" in snapshot.message


def test_what_stops_at_a_limit_shows_its_beginning(state):
    state = state.edited(stiffness=1e15)
    snapshot = take_snapshot(state)
    time = snapshot.figures.history.time
    assert snapshot.status == "event_limit"
    assert time[0] == 0.0
    assert time.size > 500
    assert snapshot.motion.kind == "undecided"
    whole = wb.simulate(state.system, periods=250, times=(), max_events=MOST_EVENTS)
    assert time[-1] == pytest.approx(0.1 * whole.attrs["final_time"])
