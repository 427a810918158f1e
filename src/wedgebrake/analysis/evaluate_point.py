"""One machine evaluated exactly: run, settle, record, classify. The unit of work of every sweep.

No allocation: the caller lends the arrays, one set for each thread.
"""

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from wedgebrake.analysis import accumulators
from wedgebrake.analysis.classify import (
    LONGEST,
    Verdict,
    Window,
    classify,
    conclude,
    next_window,
    settling_of,
)
from wedgebrake.analysis.saltation import propagate
from wedgebrake.dynamics.deviations import Deviations
from wedgebrake.dynamics.enums import FlowForm, MotionClass, Outcome, StickClass
from wedgebrake.dynamics.jit import compiled
from wedgebrake.dynamics.motion_sums import SUMS
from wedgebrake.dynamics.motion_sums import clear as clear_sums
from wedgebrake.dynamics.piecewise_linear import CORNER, pieces_about
from wedgebrake.dynamics.problem import ANGLE, VELOCITY, Instant, State, angle_weight
from wedgebrake.dynamics.records import record
from wedgebrake.dynamics.section import return_time
from wedgebrake.dynamics.segment_log import SEGMENT
from wedgebrake.solvers.event_driven.trajectory import run

_pieces_about = compiled(pieces_about)

# What is known of a point. Numbers of sticks, and of periods, count returns to the section.
RESULT = record(
    fields=[
        ("outcome", np.int64),  # an ``Outcome``; -1: no valid machine
        ("motion", np.int64),  # a ``MotionClass``
        ("order", np.int64),
        ("stick_class", np.int64),  # a ``StickClass``
        ("transient", np.int64),  # periods before the record
        ("judged", np.int64),  # periods on which the class was decided
        ("events", np.int64),
        ("sticks_forward", np.float64),  # in a period
        ("sticks_backward", np.float64),
        ("stick_share", np.float64),
        ("largest_exponent", np.float64),  # [1/s]
        ("second_exponent", np.float64),
        ("exponent_error", np.float64),
        ("return_distance", np.float64),
        ("size", np.float64),  # see ``Window`` [rad/s]
        ("settling", np.float64),  # periods until the motion stayed at its final orbit
        ("peak_torque", np.float64),  # [N m]
        ("friction_power", np.float64),  # [W]
        ("sliding_damping", np.float64),  # [N m s/rad]
        ("final_angle", np.float64),  # [rad]
        ("final_velocity", np.float64),  # [rad/s]
    ]
)


class Settings(NamedTuple):
    """Settings of a run, in periods between returns.

    transient  : periods before the record; negative: as many as it takes to settle
    recorded   : periods of the record
    limit      : most periods to wait for a motion to settle
    max_events : events after which to give up
    """

    transient: int
    recorded: int
    limit: int
    max_events: int


class Arrays(NamedTuple):
    """Arrays lent to ``evaluate``.

    log    : rows of the segment log, at least two
    points : (n, 2) Poincare points, by number of return;  growth : (n,)
    sums   : (2,) of the window or record, and of one orbit
    """

    log: Any
    points: NDArray[np.float64]
    growth: NDArray[np.float64]
    sums: Any


class _Passage(NamedTuple):
    """Some periods of a motion: outcome, state and events, and the derivative of the flow."""

    outcome: Outcome
    state: State
    events: int
    deviations: Deviations
    log_determinant: float
    full_rank: bool
    log_scale: float


@compiled
def arrays_for(settings, rows):
    """Arrays for runs with some settings, with a log of some rows."""
    transient = settings.limit if settings.transient < 0 else settings.transient
    longest = transient + settings.recorded + LONGEST + 1
    return Arrays(
        np.empty(rows, SEGMENT), np.empty((longest, 2)), np.empty(longest), np.empty(2, SUMS)
    )


@compiled
def clear(result):
    """Set a record of ``RESULT`` to that of an invalid machine."""
    result.outcome = result.motion = result.stick_class = -1
    result.order = result.transient = result.judged = result.events = 0
    result.sticks_forward = result.sticks_backward = result.stick_share = math.nan
    result.largest_exponent = result.second_exponent = result.exponent_error = math.nan
    result.return_distance = result.size = result.settling = math.nan
    result.peak_torque = result.friction_power = result.sliding_damping = math.nan
    result.final_angle = result.final_velocity = math.nan


@compiled
def _advance(problem, state, last, max_events, arrays, sums, deviations, growth):
    """Run to the return number ``last``, adding up what passes: a ``_Passage``.

    growth : as for ``propagate``, counted from the state's period
    """
    first = state.period
    log, points = arrays.log, arrays.points
    determinant, full_rank, scale, events = 0.0, True, 0.0, 0
    while True:
        returns = points[state.period + 1 : last + 1]
        found = run(problem, state, Instant(last, 0.0), max_events - events, log, returns)
        state = found.state
        events += found.events
        accumulators.add(problem, log, found.rows, sums)
        there = propagate(problem, log, found.rows, deviations, growth, first)
        deviations = there.deviations
        determinant += there.log_determinant
        scale += there.log_scale
        full_rank = full_rank and there.full_rank
        if found.outcome != Outcome.LOG_FULL:
            return _Passage(found.outcome, state, events, deviations, determinant, full_rank, scale)


@compiled
def _record(problem, state, last, max_events, arrays):
    """``_advance`` from fresh sums, with the growth of a deviation in no special direction."""
    weight = angle_weight(problem.driveline, problem.torque)
    clear_sums(arrays.sums[0])
    deviation = Deviations(math.sqrt(0.5) / weight, math.sqrt(0.5), 0.0, 0.0)
    return _advance(
        problem, state, last, max_events, arrays, arrays.sums[0], deviation, arrays.growth
    )


@compiled
def _orbit(problem, state, order, max_events, arrays):
    """Logarithms of the moduli of both multipliers of a periodic orbit; -inf: rank lost.

    The second sums receive what one orbit adds up to.
    """
    weight = angle_weight(problem.driveline, problem.torque)
    clear_sums(arrays.sums[1])
    there = _advance(
        problem, state, state.period + order, max_events, arrays, arrays.sums[1],
        Deviations(1.0, 0.0, 0.0, weight), arrays.growth[:0],
    )  # fmt: skip
    if there.outcome != Outcome.COMPLETED:
        return math.nan, math.nan
    a, d = there.deviations.angle1, there.deviations.velocity2 / weight
    if not there.full_rank:
        return math.log(abs(a + d)) + there.log_scale if a + d != 0.0 else -math.inf, -math.inf
    half = 0.5 * (a + d)
    determinant = math.exp(there.log_determinant - 2.0 * there.log_scale)
    split = half * half - determinant
    # A double multiplier splits by the root of its rounding.
    if split <= 1e-13 * (half * half + determinant):
        return 0.5 * there.log_determinant, 0.5 * there.log_determinant
    first = math.log(abs(half) + math.sqrt(split)) + there.log_scale
    return first, there.log_determinant - first


@compiled
def _distance_weight(problem):
    """Weight of the angle in distances [1/s]: without a spring the angle does not matter."""
    stiff = problem.driveline.stiffness > 0.0
    return angle_weight(problem.driveline, problem.torque) if stiff else 0.0


@compiled
def _size(sums, weight):
    """Half the range of velocity and weighted angle together [rad/s]."""
    width = sums.greatest_velocity - sums.least_velocity
    return 0.5 * (width + weight * (sums.greatest_angle - sums.least_angle))


@compiled
def _rest_lasts(problem):
    """Return True if rest can last: on a turning shaft the spring ends it."""
    driveline = problem.driveline
    return driveline.rest_velocity == 0.0 or driveline.stiffness == 0.0


@compiled
def _stick_class(sums, resting):
    """Class of stick-slip of what some sums add up."""
    if resting:
        return StickClass.AT_REST
    forward, backward = sums.sticks_forward > 0.0, sums.sticks_backward > 0.0
    if forward and backward:
        return StickClass.BIDIRECTIONAL
    return StickClass.UNIDIRECTIONAL if forward or backward else StickClass.NON_STICK_SLIP


@compiled
def _sliding_damping(problem):
    """Damping of steady sliding as defined in ``linear_stability``; inf if there is none.

    Evaluated at the speed of a turning shaft (w = 0); otherwise near rest, the smaller value of
    both directions.
    """
    brake, driveline = problem.brake, problem.driveline
    turns = driveline.rest_velocity != 0.0
    first, last = brake.first_forward - 1, brake.first_forward
    if turns:
        near = CORNER * abs(driveline.rest_velocity)
        first, last = _pieces_about(brake.breakpoints, 0.0, near)
    least = math.inf
    for i in range(first, last + 1):
        piece = brake.pieces[i]
        if piece.form != FlowForm.BLOCKED:
            least = min(least, piece.damping * driveline.inertia)
        elif turns:
            return math.inf
    return least


@compiled
def _judge(problem, there, begin, max_events, arrays):
    """``Verdict`` on the periods from ``begin`` to the end of a passage."""
    sums, orbit = arrays.sums[0], arrays.sums[1]
    weight, end = _distance_weight(problem), there.state.period
    count = end - begin
    area = there.log_determinant / count if there.full_rank else -math.inf
    resting = _rest_lasts(problem) and sums.last_slip <= end - 1.0
    window = Window(
        arrays.points[begin : end + 1], weight, _size(sums, weight), arrays.growth[:count], area,
        resting,
    )  # fmt: skip
    verdict = classify(window)
    if not resting and verdict.order == 0:
        return verdict
    order = max(verdict.order, 1)
    first, second = _orbit(problem, there.state, order, max_events, arrays)
    whole = return_time(problem.torque) * (1.0 - 1e-12)
    if resting or (order == 1 and _rest_lasts(problem) and orbit.rest_time >= whole):
        # Every angle that the brake holds is an equilibrium; deviations of speed die at once.
        return Verdict(
            MotionClass.AT_REST, np.int64(0), verdict.return_distance, 0.0, 0.0, -math.inf
        )
    return conclude(window, verdict, first, second)


@compiled
def _settle(problem, state, settings, arrays, result):
    """Run windows, each as long as all before it, until the motion has settled in one.

    Returns (outcome, state, verdict); ``result`` receives events, judged periods and settling.
    """
    verdict = Verdict(MotionClass.UNDECIDED, np.int64(0), math.nan, math.nan, math.nan, math.nan)
    outcome, max_events = Outcome.COMPLETED, settings.max_events
    while state.period < settings.limit:
        begin = state.period
        last = next_window(begin, settings.limit)
        there = _record(problem, state, last, max_events - result.events, arrays)
        outcome, state = there.outcome, there.state
        result.events += there.events
        if outcome != Outcome.COMPLETED:
            break
        verdict = _judge(problem, there, begin, max_events, arrays)
        result.judged, result.settling = state.period - begin, begin
        if verdict.motion == MotionClass.AT_REST:
            result.settling = max(0.0, math.ceil(arrays.sums[0].last_slip))
            break
        if verdict.order > 0:
            weight = _distance_weight(problem)
            size = _size(arrays.sums[0], weight)
            result.settling = settling_of(arrays.points, verdict.order, state.period, weight, size)
            break
    return outcome, state, verdict


@compiled
def report(result, verdict, interval):
    """Write class, order and exponents into a result; ``interval`` between returns [s]."""
    result.motion, result.order = verdict.motion, verdict.order
    result.return_distance = verdict.return_distance
    result.largest_exponent = verdict.largest / interval
    result.second_exponent = verdict.second / interval
    if verdict.error < math.inf:
        result.exponent_error = verdict.error / interval


@compiled
def report_end(result, outcome):
    """Write the outcome of a run into a result, and the class that follows from it."""
    result.outcome, result.motion = outcome, MotionClass.UNDECIDED
    if outcome == Outcome.DIVERGED:
        result.motion = MotionClass.DIVERGED
    elif outcome == Outcome.NO_FORWARD_SOLUTION:
        result.motion = MotionClass.SELF_LOCKED


@compiled
def _report_sums(problem, verdict, recorded, arrays, result):
    """Write what adds up over the record, or over one orbit, into a result."""
    interval = return_time(problem.torque)
    resting = verdict.motion == MotionClass.AT_REST
    sums, counted = arrays.sums[0], recorded
    if verdict.order > 0 or resting:
        # One whole orbit, where the record may hold a broken number of them, or its end.
        sums, counted = arrays.sums[1], max(verdict.order, 1)
    result.stick_class = _stick_class(sums, resting)
    result.sticks_forward = sums.sticks_forward / counted
    result.sticks_backward = sums.sticks_backward / counted
    result.stick_share = min(1.0, sums.rest_time / (counted * interval))
    result.size = _size(arrays.sums[0], _distance_weight(problem))
    result.peak_torque = sums.peak_torque
    result.friction_power = sums.heat / (counted * interval)


@compiled
def evaluate(problem, angle, velocity, settings, arrays, result):
    """Run one machine from a state at t = 0, and evaluate its motion.

    arrays : as from ``arrays_for``;  result : a record of ``RESULT``

    Returns (begin, end): ``arrays.points[begin:end]`` is the record.
    """
    transient, max_events = settings.transient, settings.max_events
    clear(result)
    arrays.points[0, ANGLE], arrays.points[0, VELOCITY] = angle, velocity
    # A plain 0 would be a type of its own, and all that it reaches be compiled once more.
    state = State(np.int64(0), 0.0, angle, velocity)
    verdict = Verdict(MotionClass.UNDECIDED, np.int64(0), math.nan, math.nan, math.nan, math.nan)
    if transient >= 0:
        returns = arrays.points[1 : transient + 1]
        found = run(problem, state, Instant(transient, 0.0), max_events, arrays.log[:0], returns)
        outcome, state, result.events = found.outcome, found.state, found.events
    else:
        outcome, state, verdict = _settle(problem, state, settings, arrays, result)
    begin = state.period
    result.transient = begin
    result.sliding_damping = _sliding_damping(problem)
    if outcome == Outcome.COMPLETED:
        last = begin + settings.recorded
        there = _record(problem, state, last, max_events - result.events, arrays)
        outcome, state = there.outcome, there.state
        result.events += there.events
        if outcome == Outcome.COMPLETED and transient >= 0:
            result.judged = settings.recorded
            verdict = _judge(problem, there, begin, max_events, arrays)
        elif outcome == Outcome.COMPLETED and (
            verdict.motion == MotionClass.AT_REST or verdict.order > 0
        ):
            # Of the orbit, or the rest, as it is in the end.
            order = max(verdict.order, 1)
            first, second = _orbit(problem, state, order, max_events, arrays)
            if verdict.order > 0:
                verdict = Verdict(
                    verdict.motion, order, verdict.return_distance, first / order, 0.0,
                    second / order,
                )  # fmt: skip
    result.final_angle, result.final_velocity = state.angle, state.velocity
    report_end(result, outcome)
    if outcome != Outcome.COMPLETED:
        result.settling = math.nan
        return begin, state.period + 1 if state.period > begin else begin
    report(result, verdict, return_time(problem.torque))
    _report_sums(problem, verdict, settings.recorded, arrays, result)
    return begin, begin + settings.recorded + 1
