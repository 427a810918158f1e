"""Exact evaluation of one machine: run, settle, record, classify. The unit of work of sweeps.

No memory is allocated: the caller provides the arrays, one set for each thread.
"""

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from wedgebrake.analysis import accumulators
from wedgebrake.analysis.classify import (
    FIRST_WINDOW,
    LONGEST,
    UNKNOWN,
    Verdict,
    Window,
    classify,
    conclude,
    is_final,
    next_window,
    settling_of,
)
from wedgebrake.analysis.saltation import propagate
from wedgebrake.analysis.vibration import (
    SERIES,
    VIBRATION,
    add_vibration,
    clear_vibration,
    report_vibration,
)
from wedgebrake.dynamics.deviations import Deviations
from wedgebrake.dynamics.enums import FlowForm, MotionClass, Outcome, StickClass
from wedgebrake.dynamics.jit import compiled
from wedgebrake.dynamics.motion_sums import SUMS, clear
from wedgebrake.dynamics.piecewise_linear import CORNER, pieces_about
from wedgebrake.dynamics.problem import ANGLE, VELOCITY, Instant, State, angle_weight
from wedgebrake.dynamics.records import record
from wedgebrake.dynamics.section import return_time
from wedgebrake.dynamics.segment_log import SEGMENT
from wedgebrake.solvers.event_driven.trajectory import run

_pieces_about = compiled(pieces_about)

# Results at a point. Numbers of sticks and periods refer to returns to the section.
RESULT = record(
    fields=[
        ("outcome", np.int64),  # an ``Outcome``; -1: no valid machine
        ("motion", np.int64),  # a ``MotionClass``
        ("order", np.int64),
        ("stick_class", np.int64),  # a ``StickClass``
        ("transient", np.int64),  # periods before the record
        ("judged", np.int64),  # periods that decided the class
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
        ("lowest_velocity", np.float64),  # [rad/s]
        ("highest_velocity", np.float64),
        ("rms_velocity", np.float64),
        ("rms_acceleration", np.float64),  # [rad/s^2]
        ("peak_acceleration", np.float64),
        ("rms_jerk", np.float64),  # [rad/s^3]
        ("peak_jerk", np.float64),
        ("rms_torque", np.float64),  # [N m]
        ("sliding_damping", np.float64),  # [N m s/rad]
        ("final_angle", np.float64),  # [rad]
        ("final_velocity", np.float64),  # [rad/s]
    ]
)
EMPTY = np.zeros(1, dtype=RESULT)
"""The record of an invalid machine, to be copied before a run."""
for _name in RESULT.names or ():
    if RESULT[_name] == np.float64:
        EMPTY[_name] = math.nan
EMPTY["outcome"] = EMPTY["motion"] = EMPTY["stick_class"] = -1


class Settings(NamedTuple):
    """Settings of a run, in periods between returns.

    transient  : periods before the record; negative: as many as it takes to settle
    recorded   : periods of the record
    limit      : largest number of periods to wait for a motion to settle
    max_events : events after which the run is stopped
    """

    transient: int
    recorded: int
    limit: int
    max_events: int


class Arrays(NamedTuple):
    """Arrays for ``evaluate``.

    log    : rows of the segment log, at least two
    points : (n, 2) Poincare points, by number of return;  growth : (n,)
    sums   : (2,) of the window or record, and of one orbit
    vibration, series : (1,) of the record or of one orbit, and (``SERIES``,)
    scale  : (2,) see ``Window``
    """

    log: Any
    points: NDArray[np.float64]
    growth: NDArray[np.float64]
    sums: Any
    vibration: Any
    series: NDArray[np.float64]
    scale: NDArray[np.float64]


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
        np.empty(rows, SEGMENT),
        np.empty((longest, 2)),
        np.empty(longest),
        np.empty(2, SUMS),
        np.empty(1, VIBRATION),
        np.empty(SERIES),
        np.ones(2),
    )


@compiled
def _advance(problem, state, last, max_events, arrays, sums, deviations, growth):
    """Run to the return number ``last``, with new sums: a ``_Passage``.

    growth : as for ``propagate``, counted from the state's period
    """
    clear(sums)
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
def _orbit(problem, state, order, max_events, arrays):
    """Logarithms of the moduli of both multipliers of a periodic orbit; -inf: rank lost.

    The second sums are those of one orbit.
    """
    weight = angle_weight(problem.driveline, problem.torque)
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
    # A double multiplier splits by the square root of its rounding.
    if split <= 1e-13 * (half * half + determinant):
        return 0.5 * there.log_determinant, 0.5 * there.log_determinant
    first = math.log(abs(half) + math.sqrt(split)) + there.log_scale
    return first, there.log_determinant - first


@compiled
def _vibration(problem, state, last, max_events, arrays):
    """Record the vibration from a state to the return number ``last``."""
    clear_vibration(arrays.vibration[0])
    while True:
        found = run(problem, state, Instant(last, 0.0), max_events, arrays.log, arrays.points[:0])
        add_vibration(problem, arrays.log, found.rows, arrays.series, arrays.vibration[0])
        state = found.state
        if found.outcome != Outcome.LOG_FULL:
            return


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
    """(``Verdict``, whether it is final) on the periods from ``begin`` to the end of a passage."""
    driveline, sums, end = problem.driveline, arrays.sums[0], there.state.period
    count = end - begin
    area = there.log_determinant / count if there.full_rank else -math.inf
    # On a turning shaft the spring ends every rest.
    lasting = driveline.rest_velocity == 0.0 or driveline.stiffness == 0.0
    resting = lasting and sums.last_slip <= end - 1.0
    window = Window(
        arrays.points[begin : end + 1], arrays.scale, size_of(sums, arrays.scale),
        arrays.growth[:count], area, resting,
    )  # fmt: skip
    verdict = classify(window)
    if not resting and verdict.order == 0:
        return verdict, is_final(window, verdict)
    order = max(verdict.order, 1)
    first, second = _orbit(problem, there.state, order, max_events, arrays)
    whole = return_time(problem.torque) * (1.0 - 1e-12)
    if resting or (order == 1 and lasting and arrays.sums[1].rest_time >= whole):
        # Every angle that the brake holds is an equilibrium; deviations of speed vanish at once.
        verdict = Verdict(
            MotionClass.AT_REST, np.int64(0), verdict.return_distance, 0.0, 0.0, -math.inf
        )
    else:
        verdict = conclude(window, verdict, first, second)
    return verdict, is_final(window, verdict)


@compiled
def size_of(sums, scale):
    """Half the range of velocity and scaled angle together [rad/s]."""
    width = sums.greatest_velocity - sums.least_velocity
    return 0.5 * (width + scale[ANGLE] * (sums.greatest_angle - sums.least_angle))


@compiled
def report(result, outcome, verdict, interval):
    """Write outcome, class, order and exponents into a result; ``interval`` between returns [s]."""
    result.outcome, result.motion = outcome, verdict.motion
    if outcome != Outcome.COMPLETED:
        result.motion, result.settling = MotionClass.UNDECIDED, math.nan
        if outcome == Outcome.DIVERGED:
            result.motion = MotionClass.DIVERGED
        elif outcome == Outcome.NO_FORWARD_SOLUTION:
            result.motion = MotionClass.SELF_LOCKED
        return
    result.order, result.return_distance = verdict.order, verdict.return_distance
    result.largest_exponent = verdict.largest / interval
    result.second_exponent = verdict.second / interval
    if verdict.error < math.inf:
        result.exponent_error = verdict.error / interval


@compiled
def report_sums(result, sums, periods, interval, resting):
    """Write sticks, torque and power from the sums over some periods into a result."""
    forward, backward = sums.sticks_forward > 0.0, sums.sticks_backward > 0.0
    result.stick_class = StickClass.NON_STICK_SLIP + forward + backward
    if resting:
        result.stick_class = StickClass.AT_REST
    result.sticks_forward = sums.sticks_forward / periods
    result.sticks_backward = sums.sticks_backward / periods
    result.stick_share = min(1.0, sums.rest_time / (periods * interval))
    result.peak_torque = sums.peak_torque
    result.friction_power = sums.heat / (periods * interval)


@compiled
def evaluate(problem, angle, velocity, settings, arrays, result):
    """Run one machine from a state at t = 0, and evaluate its motion.

    With an automatic transient, windows run, each as long as all before it, until the motion has
    settled; then the record.

    arrays : as from ``arrays_for``;  result : a copy of ``EMPTY``

    Returns (begin, end): ``arrays.points[begin:end]`` is the record.
    """
    automatic, max_events, sums = settings.transient < 0, settings.max_events, arrays.sums[0]
    weight = angle_weight(problem.driveline, problem.torque)
    # Without a spring the angle does not matter.
    arrays.scale[ANGLE] = weight if problem.driveline.stiffness > 0.0 else 0.0
    arrays.points[0, ANGLE], arrays.points[0, VELOCITY] = angle, velocity
    # A plain 0 has a different type and would cause a second compilation.
    start = state = State(np.int64(0), 0.0, angle, velocity)
    outcome, verdict, recording, settled = Outcome.COMPLETED, UNKNOWN, not automatic, False
    final = False
    if not automatic:
        returns = arrays.points[1 : settings.transient + 1]
        found = run(
            problem, state, Instant(settings.transient, 0.0), max_events, arrays.log[:0], returns
        )
        outcome, state, result.events = found.outcome, found.state, found.events
    begin = state.period
    while outcome == Outcome.COMPLETED:
        begin = state.period
        last = (
            begin + settings.recorded
            if recording
            else next_window(begin, settings.limit, FIRST_WINDOW)
        )
        start = state
        deviation = Deviations(math.sqrt(0.5) / weight, math.sqrt(0.5), 0.0, 0.0)
        there = _advance(
            problem, state, last, max_events - result.events, arrays, sums,
            deviation, arrays.growth,
        )  # fmt: skip
        outcome, state = there.outcome, there.state
        result.events += there.events
        if outcome != Outcome.COMPLETED:
            break
        if not recording or not automatic:
            verdict, final = _judge(problem, there, begin, max_events, arrays)
            settled = verdict.motion == MotionClass.AT_REST or verdict.order > 0
            result.judged = state.period - begin
        elif settled:
            # Of the final orbit, or of rest.
            order = max(verdict.order, 1)
            first, second = _orbit(problem, state, order, max_events, arrays)
            if verdict.order > 0:
                verdict = Verdict(
                    verdict.motion, order, verdict.return_distance, first / order, 0.0,
                    second / order,
                )  # fmt: skip
        if recording:
            break
        result.settling = begin
        if verdict.motion == MotionClass.AT_REST:
            result.settling = max(0.0, math.ceil(sums.last_slip))
        elif settled:
            size = size_of(sums, arrays.scale)
            result.settling = settling_of(
                arrays.points, verdict.order, state.period, arrays.scale, size
            )
        recording = final or state.period >= settings.limit
    if not recording:
        begin = state.period
    interval = return_time(problem.torque)
    result.transient = begin
    result.sliding_damping = _sliding_damping(problem)
    result.final_angle, result.final_velocity = state.angle, state.velocity
    report(result, outcome, verdict, interval)
    if outcome != Outcome.COMPLETED:
        return begin, state.period + 1 if state.period > begin else begin
    # Sums over one whole orbit if settled, since the record may end within an orbit.
    row, periods = (1, max(verdict.order, 1)) if settled else (0, settings.recorded)
    report_sums(result, arrays.sums[row], periods, interval, verdict.motion == MotionClass.AT_REST)
    # Only now is it known which periods to measure.
    begun = state if settled else start
    _vibration(problem, begun, begun.period + periods, max_events, arrays)
    report_vibration(result, arrays.vibration[0])
    result.size = size_of(sums, arrays.scale)
    return begin, state.period + 1
