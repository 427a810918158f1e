"""Passages of a machine: returns, the derivative of the flow, and sums."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from scipy.linalg import expm

import wedgebrake as wb
from cases import CASES
from differences import jacobian
from machine_digits import DIGITS, Exact, line_of, mp
from machines import contact, numbers, pressed, single, with_numbers
from wedgebrake.analysis.driveline_motion import saltation
from wedgebrake.dynamics.enums import Outcome
from wedgebrake.dynamics.problem import Instant, State
from wedgebrake.dynamics.segment_log import empty_log
from wedgebrake.errors import InputError
from wedgebrake.solvers.event_driven import trajectory
from wedgebrake.solvers.event_driven.solve import problem
from wedgebrake.solvers.machine.final_state import FinalState
from wedgebrake.solvers.machine.passage import Course, Crossing, Every, Record


def oscillator(*contacts: Any, **more: Any) -> Any:
    """One inertia of 1 kg m^2 on a shaft of 4 N m/rad."""
    return single(*contacts, stiffness=4.0, **more)


def belt(**more: Any) -> Any:
    """The oscillator with a brake on a belt, which sticks and slips for ever."""
    brake = pressed(static=1.5, base_speed=1.0)
    return oscillator(brake, **more)


def differences(machine: Any, state: FinalState, section: Any) -> Any:
    """Derivative of the state at the first return, by differences."""

    def returned(values: Any) -> Any:
        course = Course(machine, with_numbers(state, values))
        return course.advance(section, 1, duration=1e3).states[0]

    return jacobian(returned, numbers(state), 1e-5)


# Returns.


def test_crossings_of_a_free_oscillator_are_at_known_times():
    machine = oscillator(angle=0.3, speed=1.0)
    size, phase, level = math.hypot(0.3, 0.5), math.atan2(0.3, 0.5), 0.1
    found = Course(machine).advance(Crossing((1.0, 0.0), level), 200, duration=1e4)
    first = math.asin(level / size) - phase
    expected = (first + 2.0 * math.pi * np.arange(1, 201)) / 2.0
    np.testing.assert_allclose(found.times, expected, rtol=1e-13)
    np.testing.assert_allclose(found.states[:, 0], level, atol=1e-14)
    assert np.all(found.states[:, 1] > 0.0)


def test_a_return_is_no_return_of_the_next_passage():
    course = Course(oscillator(angle=0.3, speed=1.0))
    section = Crossing((1.0, 0.0), 0.1)
    times = [course.advance(section, 1, duration=100.0).times[0] for _ in range(50)]
    np.testing.assert_allclose(np.diff(times), math.pi, rtol=1e-12)
    restarted = Course(course.machine, course.advance(section, 1, duration=100.0).final)
    found = restarted.advance(section, 1, duration=100.0)
    assert found.duration == pytest.approx(math.pi, rel=1e-12)


def test_a_start_on_the_section_is_no_return():
    found = Course(oscillator(speed=1.0)).advance(Crossing((1.0, 0.0), 0.0), 2, duration=100.0)
    np.testing.assert_allclose(found.times, [math.pi, 2.0 * math.pi], rtol=1e-13)


def test_a_speed_that_stays_at_the_level_in_a_stick_is_one_return():
    """The speed relative to the belt comes to 0 from below once in a period."""
    section = Crossing((0.0, 1.0), 1.0)
    course = Course(belt(speed=0.0, angle=0.0))
    course.advance(None, duration=20.0)
    found = course.advance(section, 6, duration=1e3)
    sticks = wb.simulate(belt(), duration=60.0)["stick_start"].values
    each = [np.min(np.abs(sticks - time)) for time in found.times]
    np.testing.assert_allclose(each, 0.0, atol=1e-11)
    one = [course.advance(section, 1, duration=1e3).duration for _ in range(6)]
    np.testing.assert_allclose([*np.diff(found.times), *one], one[-1], rtol=1e-11)


def test_returns_in_a_duration_may_be_many():
    whole = Course(oscillator(speed=1.0)).advance(Crossing((1.0, 0.0), 0.0), duration=500.0)
    assert whole.outcome == Outcome.COMPLETED
    assert whole.duration == 500.0
    np.testing.assert_allclose(whole.times, math.pi * np.arange(1, 160), rtol=1e-12)
    found = Course(oscillator(speed=1.0)).advance(
        Every(0.25), duration=50.0, record=Record.DERIVATIVES
    )
    np.testing.assert_array_equal(found.times, 0.25 * np.arange(1, 201))
    assert found.matrices.shape == (200, 2, 2)


@pytest.mark.parametrize(
    "case",
    [(None, 3, 1.0), (None, 0, math.inf), (Every(0.0), 1, 1.0), (Crossing((1.0,), 0.0), 1, 1.0)],
)
def test_what_has_no_end_or_no_section_is_refused(case):
    section, returns, duration = case
    course = Course(oscillator())
    with pytest.raises(InputError):
        course.advance(section, returns, duration=duration)


# Continuation and sums.

PAPER = wb.paper.system(eta=-60.0, F0=0.036).machine


def chain(*contacts: Any) -> Any:
    """Four inertias in a row, by default with two static peaks, one of them with a lag."""
    inertias = zip("abcd", (1.0,) * 4, (0.0,) * 4, (1.0, 0.5, -0.25, 0.375), strict=True)
    return wb.Machine(
        inertias=[wb.Inertia(*one) for one in inertias],
        shafts=[
            wb.Shaft("a", "b", stiffness=40.0, damping=0.125),
            wb.Shaft("b", "c", stiffness=60.0),
            wb.Shaft("c", "d", stiffness=50.0, damping=0.25),
            wb.Shaft("d", "ground", stiffness=30.0),
        ],
        contacts=contacts or [
            pressed("a", force=2.0, static=1.25, slope=-0.5, lag=0.05),
            pressed("c", "d", static=1.2, name="clutch"),
        ],
        torques=[wb.Torque("b", wb.Harmonic(9.0, 0.7), name="engine")],
    )  # fmt: skip


@pytest.mark.parametrize("machine", [PAPER, chain()], ids=["paper", "chain"])
def test_pieces_are_one_run(machine):
    period = machine.period
    course, record = Course(machine), Record.DERIVATIVES | Record.DETAILS
    whole = Course(machine).advance(Every(period), 12, record=record)
    some = (1, 2, 1, 5, 3)
    parts = [
        course.advance(Every(period), k, record=Record.DERIVATIVES | Record.DETAILS) for k in some
    ]
    for name in ("times", "states", "matrices"):
        joined = np.concatenate([getattr(part, name) for part in parts])
        np.testing.assert_array_equal(joined, getattr(whole, name))
    np.testing.assert_array_equal(sum(part.sticks for part in parts), whole.sticks)
    assert sum(part.events for part in parts) == whole.events
    np.testing.assert_allclose(sum(part.heat for part in parts), whole.heat, rtol=1e-9, atol=1e-12)
    np.testing.assert_array_equal(np.max([part.high for part in parts], axis=0), whole.high)


@pytest.mark.parametrize("machine", [PAPER, chain()], ids=["paper", "chain"])
@pytest.mark.parametrize("record", list(Record))
def test_the_motion_does_not_depend_on_what_is_recorded(machine, record):
    section, course = Every(machine.period), Course(machine)
    whole = Course(machine).advance(section, 9)
    first = course.advance(section, 4, record=record)
    second = course.advance(section, 5)
    for name in ("times", "states"):
        joined = np.concatenate([getattr(first, name), getattr(second, name)])
        size = np.abs(getattr(whole, name)).max(axis=0)
        np.testing.assert_allclose(joined / size, getattr(whole, name) / size, atol=1e-11)
    assert first.events + second.events == whole.events
    again = Course(machine)
    again.advance(section, 4)
    np.testing.assert_array_equal(second.sticks, again.advance(section, 5).sticks)


@pytest.mark.parametrize("machine", [PAPER, chain(), belt()], ids=["paper", "chain", "belt"])
def test_sums_are_those_of_the_response(machine):
    duration = 2.5 * (machine.period or 4.0)
    found = Course(machine).advance(None, duration=duration, record=Record.DETAILS)
    response = wb.simulate(machine, duration, times=np.linspace(0.0, duration, 40_001))
    assert found.events == response.sizes["event"]
    begin, end = response["stick_start"].values, response["stick_end"].values
    which, entry = response["stick_contact"].values, response["stick_entry"].values
    for j in range(len(machine.contacts)):
        rest = np.sum((end - begin)[which == j])
        assert found.stick_time[j] == pytest.approx(rest, rel=1e-12, abs=1e-13)
        entered = [np.sum((which == j) & (entry == side)) for side in (1, -1)]
        assert entered == found.sticks[j].tolist()
    n = len(machine.inertias)
    motion = np.hstack([response["angle"].values, response["velocity"].values])
    span = motion.max(axis=0) - motion.min(axis=0)
    # Samples fall short of the extremes by at most what the motion bends between two of them.
    assert np.all(found.high[: 2 * n] >= motion.max(axis=0) - 1e-12 * span)
    assert np.all(found.low[: 2 * n] <= motion.min(axis=0) + 1e-12 * span)
    np.testing.assert_allclose(found.high[: 2 * n], motion.max(axis=0), atol=1e-3 * span.max())
    torque = np.abs(response["brake_torque"].values).max(axis=0)
    np.testing.assert_allclose(found.peak_torque, torque, rtol=1e-3)
    heat = wb.energy(response)["friction_heat"].values
    np.testing.assert_allclose(found.heat, heat, rtol=1e-11, atol=1e-13)


def test_extremes_lie_within_cells():
    """A free vibration of amplitude hypot(0.3, 1/2)."""
    found = Course(oscillator(angle=0.3, speed=1.0)).advance(None, duration=10.0)
    size = math.hypot(0.3, 0.5)
    np.testing.assert_allclose(found.high, [size, 2.0 * size], rtol=1e-14)
    np.testing.assert_allclose(found.low, [-size, -2.0 * size], rtol=1e-14)


# The derivative of the flow.


def by_closed_forms(system: Any, state: Any) -> Any:
    """Derivative over a period by the closed forms of one inertia; None if there is none."""
    log, start = empty_log(4000), State(0, 0.0, *state)
    found = trajectory.run(
        problem(system, *state), start, Instant(1, 0.0), 10**5, log, np.empty((0, 2))
    )
    identity = saltation.Deviations(1.0, 0.0, 0.0, 1.0)
    there = saltation.propagate(problem(system, *state), log, found.rows, identity, np.empty(0), 0)
    x1, y1, x2, y2 = there.deviations
    return math.exp(there.log_scale) * np.array([[x1, x2], [y1, y2]])


@pytest.mark.parametrize("name", CASES)
def test_matrices_of_one_inertia_are_those_of_the_closed_forms(name):
    system, (angle, speed) = CASES[name]
    machine = system.machine.replace({"driveline.angle": angle, "driveline.speed": speed})
    period = 1.0 / system.excitation.frequency
    found = Course(machine).advance(Every(period), 12, record=Record.DERIVATIVES)
    for state, matrix in zip(found.states[:-1], found.matrices[1:], strict=True):
        # A contact at rest has the speed of the base only up to rounding.
        at_rest = abs(state[1] + system.driveline.drive_speed) < 1e-12
        speed = -system.driveline.drive_speed if at_rest else state[1]
        expected = by_closed_forms(system, (state[0], speed))
        scale = max(1.0, float(np.abs(expected).max()))
        np.testing.assert_allclose(matrix, expected, rtol=0, atol=1e-9 * scale)


def test_matrices_of_four_inertias_agree_with_50_digits():
    brake = pressed("a", force=4.0, static=1.25)
    machine = chain(brake, pressed("c", "d", static=1.125, name="clutch"))
    duration = 1.0
    record = Record.DERIVATIVES | Record.EXTREMES
    found = Course(machine).advance(Every(duration), 1, record=record)
    assert np.all(found.sticks.sum(axis=1) > 0)
    changes = np.random.default_rng(1).normal(size=(2, 8))
    step, ends = mp.mpf(10) ** -18, []
    with mp.workdps(DIGITS):
        for change in (np.zeros(8), *changes):
            run = Exact(line_of(machine), duration)
            for i in range(8):
                run.z[i] += step * mp.mpf(float(change[i]))
            ends.append(run.run().z)
        expected = [[float((end[k] - ends[0][k]) / step) for k in range(8)] for end in ends[1:]]
    np.testing.assert_allclose(changes @ found.matrices[0].T, expected, rtol=0, atol=1e-10)


CONTROLLED: dict[str, Any] = {"slope": -0.3, "sample_time": 0.05, "delay": 2}


@pytest.mark.parametrize(
    "more",
    [
        {"slope": -0.5, "lag": 0.05},
        {"slope": 0.7, "frequency": 3.0, "damping_ratio": 0.4},
        {"slope": 0.7, "limits": (0.4, 1.2)},
        {"slope": -0.7, "base_speed": wb.Harmonic(0.5, 0.4)},
        {"slope": -0.3, "sample_time": 0.05},
        CONTROLLED,
        CONTROLLED | {"lag": 0.1, "limits": (0.2, 1.1)},
    ],
)
def test_matrices_agree_with_differences(more):
    """Lags, limits, a moving base and controllers, over a passage with sticks and slips."""
    machine = oscillator(
        pressed(static=1.1, **more),
        torque=wb.Harmonic(6.0, 0.4), damping=0.1, speed=1.0,
    )  # fmt: skip
    state = Course(machine).advance(None, duration=1.03).final
    section = Every(5.0, state.time)
    found = Course(machine, state).advance(section, 1, record=Record.DERIVATIVES)
    assert found.events >= 4
    size = numbers(state).size
    expected = differences(machine, state, section)
    scale = max(1.0, float(np.abs(expected).max()))
    np.testing.assert_allclose(found.matrices[0][:size, :size], expected, rtol=0, atol=1e-8 * scale)


def test_memory_of_a_controller_belongs_to_the_state():
    """The product of the matrices over two intervals is the matrix over both."""
    machine = oscillator(pressed(**CONTROLLED), torque=wb.Harmonic(6.0, 0.4), speed=1.0)
    once = Course(machine).advance(Every(2.21), 1, record=Record.DERIVATIVES).matrices
    parts = Course(machine).advance(Every(2.21 / 17), 17, record=Record.DERIVATIVES).matrices
    assert parts.shape == (17, 5, 5)
    product = np.linalg.multi_dot(parts[::-1])
    np.testing.assert_allclose(product, once[0], rtol=0, atol=1e-11)


def test_between_events_volumes_grow_by_the_trace():
    machine = oscillator(
        pressed(slope=0.5, lag=0.2), torque=wb.Harmonic(1.0, 0.4), damping=0.3,
        speed=20.0,
    )  # fmt: skip
    found = Course(machine).advance(Every(0.4), 1, record=Record.DERIVATIVES)
    assert found.events == 0
    rates = np.array([[0.0, 1.0, 0.0], [-4.0, -0.3, -1.0], [0.0, 0.5 / 0.2, -1.0 / 0.2]])
    np.testing.assert_allclose(found.matrices[0], expm(0.4 * rates), rtol=1e-12, atol=1e-13)
    growth = np.linalg.det(found.matrices[0])
    assert growth == pytest.approx(math.exp(0.4 * np.trace(rates)), rel=1e-12)


def test_the_map_of_a_section_annihilates_the_flow_and_stays_on_the_section():
    """x'' + 4x = 0: the flow at the section returns to itself."""
    machine = oscillator(angle=0.3, speed=1.0)
    section = Crossing((1.0, 0.0), 0.1)
    course = Course(machine)
    course.advance(section, 1, duration=100.0)
    found = course.advance(section, 5, duration=100.0, record=Record.DERIVATIVES)
    for state, matrix in zip(found.states, found.matrices, strict=True):
        flow = np.array([state[1], -4.0 * state[0]])
        np.testing.assert_allclose(matrix @ flow, 0.0, atol=1e-13)
        np.testing.assert_allclose(matrix[0], 0.0, atol=1e-14)
        np.testing.assert_allclose(matrix[1, 1], 1.0, rtol=1e-12)


def test_the_map_of_a_section_agrees_with_differences():
    """A brake with a lag on a belt, whose limit cycle sticks and slips."""
    brake = pressed(static=1.5, base_speed=1.0, slope=-0.2, lag=0.3)
    machine = oscillator(brake, damping=0.1)
    section = Crossing((1.0, 0.0, 0.0), 0.2)
    course = Course(machine)
    course.advance(section, 3, duration=100.0)
    state = course.advance(None, duration=0.1).final
    found = Course(machine, state).advance(section, 1, duration=100.0, record=Record.DERIVATIVES)
    assert found.outcome == Outcome.COMPLETED
    side = state.modes[0][0]
    expected = differences(machine, state, section)
    which = [0, 1, 2] if side != 0 else [0, 2]
    np.testing.assert_allclose(found.matrices[0][:, which], expected[:, which], atol=1e-8)


def test_a_stick_takes_the_rank():
    """From a stick to a stick, a neighbour's sliding speed is lost."""
    course = Course(belt())
    course.advance(None, duration=20.0)
    found = course.advance(Crossing((0.0, 1.0), 1.0), 3, duration=1e3, record=Record.DERIVATIVES)
    for matrix in found.matrices[1:]:
        assert np.linalg.matrix_rank(matrix, tol=1e-9) <= 1


def test_the_inputs_are_known_after_a_restart() -> None:
    machine = wb.Machine(
        inertias=[wb.Inertia("a", 1.0), wb.Inertia("b", 1.0)],
        contacts=[
            contact(name, name=f"on-{name}", base_speed=base)
            for name, base in (("a", 3.0), ("b", 2.0 + wb.Harmonic(1.0, 1.0, np.pi / 6.0)))
        ],
    )
    course = Course(machine)
    course.restart(np.array([0.0, 0.0, 1.0, 4.5]))
    sliding = course.assembled.problem.sliding @ course.state.z[:, 0]
    assert sliding == pytest.approx([-2.0, 2.0])


def test_a_run_returns_to_a_snapshot_to_the_last_bit() -> None:
    """With sampled and delayed forces, tables that repeat, orders and gaps."""
    sampled = {"force": 20.0, "slope": -2.0, "sample_time": 0.03, "delay": 2}
    shake = wb.Table([0.0, 0.3, 1.0], [-4.0, 6.0, -4.0], periodic=True)
    machine = wb.Machine(
        inertias=[wb.Inertia("a", 1.0, speed=1.0), wb.Inertia("b", 0.5)],
        shafts=[
            wb.Shaft("a", "b", stiffness=40.0, damping=0.3, gap=[-0.02, 0.02]),
            wb.Shaft("b", "ground", stiffness=90.0, damping=0.5),
        ],
        contacts=[contact("b", **sampled)],
        torques=[
            wb.Torque("a", shake),
            wb.Torque("b", wb.Orders(wb.Table([0.0, 9.0], [1.0, 30.0]), [(2.0, 3.0, 0.0)])),
        ],
    )
    course, section = Course(machine), Every(0.1)
    course.advance(section, 17, record=Record.RETURNS)
    rewind = course.snapshot()
    first = course.advance(section, 40, record=Record.DERIVATIVES | Record.EXTREMES)
    for _ in range(2):
        rewind()
        again = course.advance(section, 40, record=Record.DERIVATIVES | Record.EXTREMES)
        for name in ("times", "states", "matrices", "low", "high"):
            np.testing.assert_array_equal(getattr(again, name), getattr(first, name))
        assert again.final == first.final
    assert first.events > 20
