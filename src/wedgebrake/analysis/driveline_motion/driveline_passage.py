"""Runs of one driveline over some returns: its measures and the derivative of the flow.

No memory is allocated: the caller provides the arrays, one set for each thread.
"""

import math
from enum import IntEnum
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from wedgebrake.analysis.classify import LONGEST, ROUNDING
from wedgebrake.analysis.driveline_motion import accumulators
from wedgebrake.analysis.driveline_motion.saltation import propagate
from wedgebrake.analysis.driveline_motion.vibration import (
    VIBRATION,
    Scratch,
    add_vibration,
    clear_vibration,
    empty_scratch,
)
from wedgebrake.dynamics.deviations import Deviations
from wedgebrake.dynamics.enums import Outcome
from wedgebrake.dynamics.jit import compiled
from wedgebrake.dynamics.motion_sums import SUMS, clear
from wedgebrake.dynamics.problem import ANGLE, Instant, State, angle_weight
from wedgebrake.dynamics.segment_log import SEGMENT
from wedgebrake.solvers.event_driven.trajectory import run

# Largest number of steps of Newton's method, and largest ratio of successive steps that converge.
_NEWTON_STEPS, _NEWTON_RATIO = 8, 0.1
# Largest deviation from the observed approach: of the distance (factor) and of the rate (share).
_SAME_DISTANCE, _SAME_RATE = 3.0, 0.1


class Measures(IntEnum):
    """Quantities measured in a run, each a bit of a number.

    The range of the motion, always; the derivative of the flow; all sums; the vibration.
    """

    RANGE = 0
    GROWTH = 1
    SUMS = 2
    VIBRATION = 4


class Arrays(NamedTuple):
    """Arrays for ``evaluate``.

    log    : rows of the segment log, at least two
    points : (n, 2) Poincare points, by number of return;  growth : (n,)
    sums   : (2,) of the window or record, and of one orbit
    vibration : (1,) of the record or of one orbit;  scratch : for its cells
    scale  : (2,) see ``Window``
    """

    log: Any
    points: NDArray[np.float64]
    growth: NDArray[np.float64]
    sums: Any
    vibration: Any
    scratch: Scratch
    scale: NDArray[np.float64]


class DrivelinePassage(NamedTuple):
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
    """Arrays for runs with given settings, and a log with a given number of rows."""
    transient = settings.limit if settings.transient < 0 else settings.transient
    longest = transient + settings.recorded + LONGEST + 1
    return Arrays(
        np.empty(rows, SEGMENT),
        np.empty((longest, 2)),
        np.empty(longest),
        np.empty(2, SUMS),
        np.empty(1, VIBRATION),
        empty_scratch(),
        np.ones(2),
    )


@compiled
def pass_window(problem, state, last, max_events, arrays, measures):
    """Pass to the return number ``last``, with the growth of a deviation if measured."""
    weight = angle_weight(problem.driveline, problem.torque)
    deviation = Deviations(math.sqrt(0.5) / weight, math.sqrt(0.5), 0.0, 0.0)
    return _advance(
        problem, state, last, max_events, arrays, arrays.sums[0], measures, deviation, arrays.growth
    )


@compiled
def _advance(problem, state, last, max_events, arrays, sums, measures, deviations, growth):
    """Run to the return number ``last``, with new sums: a ``DrivelinePassage``.

    measures : sum of ``Measures``
    growth   : as for ``propagate``, counted from the state's period; nan if not measured
    """
    clear(sums)
    growth[: last - state.period] = math.nan
    if measures & Measures.VIBRATION:
        clear_vibration(arrays.vibration[0])
    first = state.period
    log, points = arrays.log, arrays.points
    determinant, full_rank, scale, events = 0.0, True, 0.0, 0
    while True:
        returns = points[state.period + 1 : last + 1]
        found = run(problem, state, Instant(last, 0.0), max_events - events, log, returns)
        state = found.state
        events += found.events
        accumulators.add(problem, log, found.rows, sums, measures & Measures.SUMS > 0)
        if measures & Measures.VIBRATION:
            add_vibration(problem, log, found.rows, arrays.scratch, arrays.vibration[0])
        if measures & Measures.GROWTH:
            there = propagate(problem, log, found.rows, deviations, growth, first)
            deviations = there.deviations
            determinant += there.log_determinant
            scale += there.log_scale
            full_rank = full_rank and there.full_rank
        if found.outcome != Outcome.LOG_FULL:
            return DrivelinePassage(
                found.outcome, state, events, deviations, determinant, full_rank, scale
            )


@compiled
def pass_orbit(problem, state, order, max_events, arrays, measures):
    """Pass ``order`` periods with the derivative of the flow; uses the second sums."""
    weight = angle_weight(problem.driveline, problem.torque)
    return _advance(
        problem, state, state.period + order, max_events, arrays, arrays.sums[1],
        measures | Measures.GROWTH, Deviations(1.0, 0.0, 0.0, weight), arrays.growth[:0],
    )  # fmt: skip


@compiled
def log_multipliers(there, weight):
    """Logarithms of the moduli of both multipliers of an orbit; -inf where the rank is reduced.

    there : result of ``pass_orbit``
    """
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
def orbit_step(there, point, weight):
    """Step of Newton's method from a point to its orbit, as a ``State``; inf if there is none.

    there : result of ``pass_orbit`` from the point
    """
    grown = math.exp(there.log_scale)
    a, c = grown * there.deviations.angle1, grown * there.deviations.velocity1
    b, d = grown * there.deviations.angle2 / weight, grown * there.deviations.velocity2 / weight
    determinant = (1.0 - a) * (1.0 - d) - b * c
    if there.outcome != Outcome.COMPLETED or determinant == 0.0:
        return State(point.period, 0.0, math.inf, math.inf)
    angle, velocity = there.state.angle - point.angle, there.state.velocity - point.velocity
    return State(
        point.period, 0.0, ((1.0 - d) * angle + b * velocity) / determinant,
        (c * angle + (1.0 - a) * velocity) / determinant,
    )  # fmt: skip


class LimitPoint(NamedTuple):
    """The point of an orbit that a motion approaches.

    distance : of the motion from it [rad/s]
    rate     : decay of the distance per return (logarithm); 0 if no point was found
    """

    state: State
    distance: float
    rate: float


@compiled
def limit_point(problem, state, approach, size, max_events, arrays):
    """The ``LimitPoint`` of a motion that approaches an orbit steadily, by Newton's method.

    The point is accepted only if the motion approaches at the rate of the orbit's largest
    multiplier. The motion has then passed the orbit at larger distances without leaving it, and is
    expected to reach it; the next window must confirm this.

    approach : ``Approach`` at the state;  size : of the motion [rad/s]
    """
    weight, scale = angle_weight(problem.driveline, problem.torque), arrays.scale[ANGLE]
    none, point, first, last = LimitPoint(state, 0.0, 0.0), state, 0.0, math.inf
    for _ in range(_NEWTON_STEPS):
        there = pass_orbit(problem, point, approach.order, max_events, arrays, Measures.GROWTH)
        step = orbit_step(there, point, weight)
        if step.velocity == math.inf:
            return none
        length = math.hypot(scale * step.angle, step.velocity)
        if length <= ROUNDING * size:
            rate = -log_multipliers(there, weight)[0] / approach.order
            found = abs(rate - approach.rate) <= _SAME_RATE * approach.rate
            return LimitPoint(point, first, rate) if found else none
        first = max(first, length)
        if first > _SAME_DISTANCE * approach.distance * size or length > _NEWTON_RATIO * last:
            return none
        last = length
        point = State(point.period, 0.0, point.angle + step.angle, point.velocity + step.velocity)
    return none


@compiled
def measure_vibration(problem, state, last, max_events, arrays):
    """Record the vibration from a state to the return number ``last``."""
    clear_vibration(arrays.vibration[0])
    while True:
        found = run(problem, state, Instant(last, 0.0), max_events, arrays.log, arrays.points[:0])
        add_vibration(problem, arrays.log, found.rows, arrays.scratch, arrays.vibration[0])
        state = found.state
        if found.outcome != Outcome.LOG_FULL:
            return


@compiled
def size_of(sums, scale):
    """Half the range of velocity and scaled angle together [rad/s]."""
    width = sums.greatest_velocity - sums.least_velocity
    return 0.5 * (width + scale[ANGLE] * (sums.greatest_angle - sums.least_angle))
