"""The moment is what wb.simulate, wb.motion and the other measures say, and never raises."""

from __future__ import annotations

import math
from dataclasses import fields

import numpy as np
import pytest

import wedgebrake as wb
from wedgebrake.analysis.torque import brake_torque
from wedgebrake.explorer.core.limits import MOST_EVENTS, SAMPLES_PER_PERIOD
from wedgebrake.explorer.core.snapshot import look
from wedgebrake.explorer.core.state import Desk, new_desk
from wedgebrake.model.study import Run


@pytest.fixture
def desk() -> Desk:
    return new_desk(wb.paper.system(eta=-24, f=0.63, F0=0.036, alpha=1.18))


def simulated(desk: Desk, periods: int):
    """The response over the last periods of the run, from the front door."""
    frequency, last = desk.system.excitation.frequency, desk.periods
    count = periods * SAMPLES_PER_PERIOD + 1
    times = np.linspace((last - periods) / frequency, last / frequency, count)
    return wb.simulate(desk.system, periods=last, times=times)


class TestAgainstTheFrontDoor:
    def test_samples_are_those_of_simulate(self, desk):
        moment, response = look(desk), simulated(desk, 12)
        history = moment.figures.history
        assert moment.status == "completed"
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
    def test_the_motion_is_that_of_wb_motion(self, desk, friction):
        desk = desk.edited(friction=friction)
        moment = look(desk)
        expected = wb.motion(desk.system, desk.periods, transient=desk.transient)
        if friction != "smoothed":
            assert repr(moment.motion.as_dict()) == repr(expected.as_dict())
            return
        # Samples end no step of the solver's, but its periods do.
        for field in fields(expected):
            found, right = (getattr(one, field.name) for one in (moment.motion, expected))
            if isinstance(right, float):
                assert found == pytest.approx(right, rel=1e-5, nan_ok=True), field.name
            else:
                assert found == right, field.name

    def test_a_settled_motion_is_judged_with_its_transient(self, desk):
        moment = look(desk, settle=True)
        assert repr(moment.motion.as_dict()) == repr(
            wb.motion(desk.system, desk.recorded).as_dict()
        )
        assert moment.motion.settling == 147

    def test_spectrum_and_section_are_of_the_recorded_periods(self, desk):
        moment, response = look(desk), simulated(desk, desk.recorded)
        lines, found = wb.spectrum(response), moment.figures.spectrum
        count = found.frequency.size
        np.testing.assert_allclose(found.frequency, lines["frequency"][:count], rtol=1e-9)
        np.testing.assert_allclose(found.amplitude, lines["amplitude"][:count], atol=1e-9)
        assert lines["frequency"][count - 1] <= 6.0 * found.natural < lines["frequency"][count]
        assert found.forcing == desk.system.excitation.frequency
        section = moment.figures.section
        points = wb.poincare(desk.system, desk.periods, transient=desk.transient)
        np.testing.assert_allclose(section.angle, points["angle"], atol=1e-12)
        np.testing.assert_allclose(section.velocity, points["velocity"], atol=1e-10)
        assert moment.braking.peak == pytest.approx(brake_torque(response).peak)

    def test_more_periods_may_be_shown_than_are_recorded(self, desk):
        narrow, wide = look(desk), look(desk.edited(shown=100))
        assert wide.figures.history.time.size == 100 * SAMPLES_PER_PERIOD + 1
        there, here = wide.figures.spectrum, narrow.figures.spectrum
        np.testing.assert_allclose(there.frequency, here.frequency, rtol=1e-12)
        np.testing.assert_allclose(there.amplitude, here.amplitude, atol=1e-9)
        assert wide.figures.section.angle.size == narrow.figures.section.angle.size
        assert wide.braking.mean == pytest.approx(narrow.braking.mean, abs=1e-9)

    def test_no_more_is_shown_than_was_run(self, desk):
        moment = look(desk.edited(periods=20, shown=100))
        assert moment.figures.history.time[0] == 0.0
        assert moment.figures.history.time.size == 20 * SAMPLES_PER_PERIOD + 1

    def test_a_later_start_keeps_the_phase_of_the_torque(self, desk):
        quarter = 0.25 / desk.system.excitation.frequency
        later = Desk.of(desk.study.changed(start_time=quarter))
        response = wb.simulate(desk.system, periods=250, start_time=quarter)
        moment = look(later)
        np.testing.assert_allclose(
            moment.figures.history.velocity[-1], response["velocity"][-1], atol=1e-8
        )
        assert moment.motion.order == 6

    def test_a_slow_torque_is_sampled_by_the_natural_period(self, desk):
        figures = look(desk.edited(frequency=1.0)).figures
        time, natural = figures.history.time, figures.spectrum.natural
        assert time[1] - time[0] <= 0.05 / natural
        assert figures.spectrum.frequency[-1] == pytest.approx(6.0 * natural, rel=0.01)
        # A much slower one has no spectrum.
        moment = look(desk.edited(frequency=0.1))
        assert moment.status == "completed"
        assert moment.figures.spectrum.frequency.size == 0


def test_the_ghost_is_the_same_machine_with_a_conventional_brake(desk):
    ghost = look(desk.edited(ghost=True)).ghost
    brake = wb.ConventionalBrake(radius=desk.system.brake.radius)
    expected = look(new_desk(desk.system.replace(brake=brake)))
    here, there = ghost.figures, expected.figures
    np.testing.assert_array_equal(here.history.velocity, there.history.velocity)
    np.testing.assert_array_equal(here.spectrum.amplitude, there.spectrum.amplitude)
    assert repr(ghost.motion.as_dict()) == repr(expected.motion.as_dict())
    assert ghost.ghost is None
    # Of a conventional brake there is none.
    assert look(desk).ghost is None
    assert look(desk.edited(brake="conventional", ghost=True)).ghost is None


class TestEarlyEnds:
    def test_a_diverging_motion_is_shown_where_it_went(self):
        desk = new_desk(wb.paper.system(eta=-24, release=False, damping=1.0))
        moment = look(desk)
        assert (moment.status, moment.motion.kind) == ("diverged", "diverged")
        assert moment.figures.history.time.size > 500
        assert np.max(np.abs(moment.figures.history.velocity)) > 1e6
        assert moment.figures.spectrum.frequency.size == 0
        assert math.isnan(moment.braking.mean)
        assert repr(look(desk, settle=True).motion.as_dict()) == repr(moment.motion.as_dict())

    def test_a_brake_that_locks_while_sliding(self):
        system = wb.paper.system(eta=-1.0).replace(kinetic=0.4, static=0.4)
        moment = look(Desk.of(wb.Study(system, Run(initial=(0.0, 5.0), periods=50))))
        assert moment.status == "no_forward_solution"
        assert moment.motion.kind == "self-locked"
        assert "locked" in moment.message

    @pytest.mark.parametrize("friction", ["coulomb", "smoothed"])
    def test_at_rest(self, desk, friction):
        moment = look(desk.edited(amplitude=0.0).edited(friction=friction))
        assert moment.motion.kind == "at rest"
        np.testing.assert_allclose(moment.figures.history.velocity, 0.0, atol=1e-12)
        assert moment.figures.spectrum.amplitude.size > 0


def test_what_stops_at_a_limit_shows_its_beginning(desk):
    desk = desk.edited(stiffness=1e15)
    moment = look(desk)
    time = moment.figures.history.time
    assert moment.status == "event_limit"
    assert time[0] == 0.0
    assert time.size > 500
    assert moment.motion.kind == "undecided"
    whole = wb.simulate(desk.system, periods=250, times=(), max_events=MOST_EVENTS)
    assert time[-1] == pytest.approx(0.1 * whole.attrs["final_time"])
