"""Exact evaluation of one driveline at a point of a sweep: run, settle, record, classify.

No memory is allocated: the caller provides the arrays, one set for each thread.
"""

import math
from typing import NamedTuple

import numpy as np

from wedgebrake.analysis.classify import (
    FEWEST_OF_TORUS,
    ROUNDING,
    UNKNOWN,
    Verdict,
    Window,
    classify,
    conclude,
    order_of,
    rounding_of,
)
from wedgebrake.analysis.driveline_motion.driveline_passage import (
    LimitPoint,
    Measures,
    limit_point,
    log_multipliers,
    measure_vibration,
    orbit_step,
    pass_orbit,
    pass_window,
    size_of,
)
from wedgebrake.analysis.driveline_motion.vibration import report_vibration
from wedgebrake.analysis.settling import (
    FIRST_WINDOW,
    NO_APPROACH,
    Approach,
    judge,
    next_window,
    settled_distance,
    settling_of,
)
from wedgebrake.dynamics.enums import FlowForm, MotionClass, Outcome, StickClass
from wedgebrake.dynamics.jit import compiled
from wedgebrake.dynamics.piecewise_linear import CORNER, pieces_about
from wedgebrake.dynamics.problem import ANGLE, VELOCITY, Instant, State, angle_weight
from wedgebrake.dynamics.records import record
from wedgebrake.dynamics.section import return_time
from wedgebrake.solvers.event_driven.trajectory import run

_pieces_about = compiled(pieces_about)

# Results at a point. Numbers of sticks and periods refer to returns to the section.
RESULT = record(
    fields=[
        ("outcome", np.int64),  # an ``Outcome``; -1: no valid system
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
        ("settling", np.float64),  # periods until the motion stays near its final orbit
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
"""The record of an invalid system, to be copied before a run."""
for _name in RESULT.names or ():
    if RESULT[_name] == np.float64:
        EMPTY[_name] = math.nan
EMPTY["outcome"] = EMPTY["motion"] = EMPTY["stick_class"] = -1


class Settings(NamedTuple):
    """Settings of a run, in periods between returns.

    transient  : periods before the record; negative: until the motion has settled
    recorded   : periods of the record
    limit      : largest number of periods to wait for a motion to settle
    max_events : events after which the run is stopped
    """

    transient: int
    recorded: int
    limit: int
    max_events: int


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
    """A ``Judgement`` on the periods from ``begin`` to the end of a passage."""
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
        return judge(window, verdict)
    order = max(verdict.order, 1)
    weight = angle_weight(problem.driveline, problem.torque)
    # The second sums become those of one orbit.
    orbit = pass_orbit(problem, there.state, order, max_events, arrays, Measures.SUMS)
    first, second = log_multipliers(orbit, weight)
    whole = return_time(problem.torque) * (1.0 - 1e-12)
    if resting or (order == 1 and lasting and arrays.sums[1].rest_time >= whole):
        # Every angle that the brake holds is an equilibrium; deviations of speed vanish at once.
        verdict = Verdict(
            MotionClass.AT_REST, np.int64(0), verdict.return_distance, 0.0, 0.0, -math.inf
        )
    else:
        step = orbit_step(orbit, there.state, weight)
        apart = math.hypot(weight * step.angle, step.velocity)
        verdict = conclude(window, verdict, first, second, apart)
    return judge(window, verdict)


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
def _store(points, state):
    """Store a state as the Poincare point of its period."""
    points[state.period, ANGLE], points[state.period, VELOCITY] = state.angle, state.velocity


@compiled
def _has_settled(verdict):
    return verdict.motion == MotionClass.AT_REST or verdict.order > 0


@compiled
def _seems_settled(arrays, state, recorded):
    """Return True if the last returns of a transient, at most ``recorded``, repeat."""
    points = arrays.points[max(0, state.period - recorded) : state.period + 1]
    # The size of the motion is not known yet: that of its states.
    size = rounding_of(points, arrays.scale, 0.0) / ROUNDING
    return order_of(points, arrays.scale, size)[0] > 0


@compiled
def _settle(problem, state, settings, arrays, result):
    """Run windows, each as long as all before it, until the motion has settled.

    If it approaches an orbit steadily, the next window begins on this orbit.

    Returns (outcome, state, verdict).
    """
    limit, max_events, sums = settings.limit, settings.max_events, arrays.sums[0]
    verdict, approach, before, target = UNKNOWN, NO_APPROACH, state, LimitPoint(state, 0.0, 0.0)
    extrapolates = arrays.scale[ANGLE] > 0.0
    while True:
        begin = state.period
        last = next_window(begin, limit, FIRST_WINDOW, approach.waits)
        # Growths distinguish aperiodic motions, which end a transient only after long windows.
        early = last - begin < FEWEST_OF_TORUS and last < limit
        measures = Measures.RANGE if early else Measures.GROWTH
        there = pass_window(problem, state, last, max_events - result.events, arrays, measures)
        state = there.state
        result.events += there.events
        if there.outcome != Outcome.COMPLETED:
            return there.outcome, state, verdict
        judgement = _judge(problem, there, begin, max_events, arrays)
        verdict, approach = judgement.verdict, judgement.approach
        settled, size = _has_settled(verdict), size_of(sums, arrays.scale)
        result.judged, result.settling = state.period - begin, begin
        points = arrays.points[: state.period + 1]
        if settled and target.rate > 0.0:
            apart = target.distance / settled_distance(points, arrays.scale, size)
            result.settling += math.ceil(math.log(max(apart, 1.0)) / target.rate)
        elif verdict.motion == MotionClass.AT_REST:
            result.settling = max(0.0, math.ceil(sums.last_slip))
        elif settled:
            result.settling = settling_of(points, verdict.order, arrays.scale, size)
        elif target.rate > 0.0:
            # The orbit does not attract the motion: continue from the last state of the motion.
            state, extrapolates, target = before, False, LimitPoint(before, 0.0, 0.0)
            _store(arrays.points, state)
            continue
        if judgement.final or state.period >= limit:
            return there.outcome, state, verdict
        last = state.period + 4 * approach.order + FIRST_WINDOW
        if extrapolates and approach.order > 0 and last < limit:
            target = limit_point(problem, state, approach, size, max_events, arrays)
        if target.rate > 0.0:
            before, state = state, target.state
            _store(arrays.points, state)
            approach = Approach(approach.order, 0.0, 0.0, 3.0 * approach.order)


@compiled
def evaluate(problem, angle, velocity, settings, arrays, result):
    """Run one driveline from a state at t = 0, and evaluate its motion.

    With an automatic transient, the run continues until the motion has settled; the record follows.

    arrays : as from ``arrays_for``;  result : a copy of ``EMPTY``

    Returns (begin, end): ``arrays.points[begin:end]`` is the record.
    """
    automatic, max_events, sums = settings.transient < 0, settings.max_events, arrays.sums[0]
    # Without a spring the angle has no effect.
    weight = angle_weight(problem.driveline, problem.torque)
    arrays.scale[ANGLE] = weight if problem.driveline.stiffness > 0.0 else 0.0
    # A plain 0 has a different type and would cause a second compilation.
    state, verdict = State(np.int64(0), 0.0, angle, velocity), UNKNOWN
    _store(arrays.points, state)
    if automatic:
        outcome, state, verdict = _settle(problem, state, settings, arrays, result)
    else:
        returns = arrays.points[1 : settings.transient + 1]
        found = run(
            problem, state, Instant(settings.transient, 0.0), max_events, arrays.log[:0], returns
        )
        outcome, state, result.events = found.outcome, found.state, found.events
    start, settled = state, _has_settled(verdict)
    # The vibration of a settled motion is measured over its orbit, below. This guess whether it has
    # settled saves a second run.
    over_orbit = settled if automatic else _seems_settled(arrays, state, settings.recorded)
    if outcome == Outcome.COMPLETED:
        last = start.period + settings.recorded
        measures = Measures.SUMS | (Measures.RANGE if over_orbit else Measures.VIBRATION)
        # After a fixed transient the record decides the class.
        measures |= Measures.RANGE if automatic else Measures.GROWTH
        there = pass_window(problem, start, last, max_events - result.events, arrays, measures)
        outcome, state = there.outcome, there.state
        result.events += there.events
        if outcome == Outcome.COMPLETED and not automatic:
            verdict = _judge(problem, there, start.period, max_events, arrays).verdict
            settled, result.judged = _has_settled(verdict), settings.recorded
        elif outcome == Outcome.COMPLETED and settled:
            # Measure the final orbit, or rest.
            order = max(verdict.order, 1)
            measures = Measures.SUMS | Measures.VIBRATION
            orbit = pass_orbit(problem, state, order, max_events, arrays, measures)
            first, second = log_multipliers(orbit, weight)
            if verdict.order > 0:
                verdict = Verdict(
                    verdict.motion, order, verdict.return_distance, first / order, 0.0,
                    second / order,
                )  # fmt: skip
    interval = return_time(problem.torque)
    result.transient = start.period
    if result.settling > start.period:
        # The record is that of the orbit, at which the motion itself arrives later.
        order = max(verdict.order, 1)
        result.transient += order * math.ceil((result.settling - start.period) / order)
    result.sliding_damping = _sliding_damping(problem)
    result.final_angle, result.final_velocity = state.angle, state.velocity
    report(result, outcome, verdict, interval)
    if outcome != Outcome.COMPLETED:
        return start.period, state.period + (state.period > start.period)
    # Sums over one whole orbit if settled, since the record may end within an orbit.
    row, periods = (1, max(verdict.order, 1)) if settled else (0, settings.recorded)
    report_sums(result, arrays.sums[row], periods, interval, verdict.motion == MotionClass.AT_REST)
    if not automatic and (settled or over_orbit):
        begun = state if settled else start
        measure_vibration(problem, begun, begun.period + periods, max_events, arrays)
    report_vibration(result, arrays.vibration[0])
    result.size = size_of(sums, arrays.scale)
    return start.period, state.period + 1
