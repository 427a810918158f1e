"""One step of a motion: by Runge-Kutta, by series, or in closed form.

Every step ends at the first kink that it would cross, and returns an ``Advance``. A method of
numeric steps is a named tuple; the functions that depend on it are at the end of this file.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from wedgebrake.dynamics.enums import FlowForm, Outcome, SearchEnd
from wedgebrake.dynamics.harmonic import Sine, phase_at
from wedgebrake.dynamics.jit import chosen_by_class, compiled, inlined
from wedgebrake.dynamics.linear_flow import acceleration, forcing_of
from wedgebrake.solvers.event_driven.event_search import MotionState, slip
from wedgebrake.solvers.smooth import taylor as series
from wedgebrake.solvers.smooth.continuous_extension import STAGES, crossing_share
from wedgebrake.solvers.smooth.problem import AnyLaw, TanhLaw, Tolerances
from wedgebrake.solvers.smooth.runge_kutta import (
    RungeKutta,
    acceleration_at,
    error_norm,
    extend,
    open_runge_kutta,
    pole_distance,
)
from wedgebrake.solvers.smooth.runge_kutta import step as runge_kutta_stages
from wedgebrake.solvers.smooth.taylor import INPUT, INPUT_ROWS, OUTPUT_ROWS

# A Runge-Kutta step may cover this share of the way to the nearest pole of the law.
_POLE_SHARE = 0.4
# Share of the tolerance that the second-order term of Newton's last move to a kink may have.
_CLOSE = 1e-2
# First step by series, as a share of the longest one.
FIRST_STEP = 1e-2


class Point(NamedTuple):
    """A state at a time since the last return, with its acceleration."""

    time: float
    angle: float
    velocity: float
    acceleration: float


class Limits(NamedTuple):
    """Bounds of a step.

    end       : latest time at its end [s]
    low, high : velocities of the nearest kinks
    tiny      : smallest size [s]
    stalled   : whether the last step had no length; a kink met at once is then rounding
    """

    end: float
    low: float
    high: float
    tiny: float
    stalled: bool


class Advance(NamedTuple):
    """A step that was made.

    point    : its end
    size     : [s]; 0: a kink was met at once
    proposal : size of the next Runge-Kutta step [s]
    hit      : ``SearchEnd``
    work     : steps and evaluations spent
    outcome  : ``Outcome``; COMPLETED: the motion can go on
    """

    point: Point
    size: float
    proposal: float
    hit: int
    work: int
    outcome: int


class Taylor(NamedTuple):
    """Steps by series for one machine.

    forcing : torque over the inertia;  slope : of the actuation force over the inertia
    inputs, outputs : (rows, 1) lanes of ``taylor``
    """

    forcing: Sine
    slope: float
    band: float
    longest_step: float
    tolerances: Tolerances
    inputs: NDArray[np.float64]
    outputs: NDArray[np.float64]


@compiled
def _open_taylor(law, functions, problem):  # noqa: ARG001 - one signature
    """``Taylor`` for a ``TanhLaw``."""
    driveline, torque = problem.driveline, problem.torque
    inputs, outputs = np.zeros((INPUT_ROWS, 1)), np.empty((OUTPUT_ROWS, 1))
    series.load(driveline, torque, law, inputs, 0)
    inputs[INPUT.last_size, 0] = FIRST_STEP * problem.longest_step
    return Taylor(
        forcing_of(driveline, torque), law.actuator.slope / driveline.inertia, problem.band,
        problem.longest_step, problem.tolerances, inputs, outputs,
    )  # fmt: skip


@inlined
def arrived(time, size, limits):
    """Time after a step; the very end where only rounding is left to it."""
    return limits.end if limits.end - time - size <= 0.4 * limits.tiny else time + size


@compiled
def linear_step(stretch, piece, forcing, point, end, divergence_velocity, work_limit):
    """``Advance`` in closed form to the end of a linear stretch, or to the time ``end``."""
    if piece.form == FlowForm.BLOCKED:
        return Advance(point, 0.0, 0.0, SearchEnd.TIME, 0, Outcome.NO_FORWARD_SOLUTION)
    low, high = stretch.low, stretch.high
    if piece.damping < 0.0:
        low, high = max(low, -divergence_velocity), min(high, divergence_velocity)
    phase = phase_at(forcing, point.time)
    a = acceleration(piece, forcing, point.angle, point.velocity, phase)
    motion = MotionState(point.time, phase, point.angle, point.velocity, a)
    found = slip(piece, forcing, low, high, motion, end, work_limit)
    there = found.motion
    reached = Point(there.time, there.angle, there.velocity, there.acceleration)
    limited = found.end == SearchEnd.WORK_LIMIT
    outcome = Outcome.STEP_LIMIT if limited else Outcome.COMPLETED
    # Steps without length count too, so that a run of only such steps ends.
    work = max(found.evaluations, 1)
    return Advance(reached, there.time - point.time, math.inf, found.end, work, outcome)


@compiled
def _series_point(taylor, point):
    """The point with its acceleration."""
    side = 1.0 if point.velocity >= taylor.inputs[INPUT.rest_velocity, 0] else -1.0
    series.aim(taylor.inputs, 0, side * taylor.slope, taylor.forcing, point)
    a = series.acceleration(taylor.inputs, 0)
    return Point(point.time, point.angle, point.velocity, a)


@compiled
def _runge_kutta_point(method, point):
    """The point with its acceleration."""
    a = acceleration_at(method, point.time, point.angle, point.velocity)
    return Point(point.time, point.angle, point.velocity, a)


@inlined
def _series_step(taylor, point, h, limits):  # noqa: ARG001 - one signature
    """``Advance`` by one step by series; ``taylor.outputs`` holds it."""
    inputs, outputs = taylor.inputs, taylor.outputs
    side = 1.0 if limits.low >= inputs[INPUT.rest_velocity, 0] else -1.0
    series.aim(inputs, 0, side * taylor.slope, taylor.forcing, point)
    longest = min(taylor.longest_step, limits.end - point.time)
    series.limit(inputs, 0, taylor.tolerances, longest, taylor.band)
    series.step(inputs, outputs)
    size, hit, a = series.accept(inputs, outputs, 0, limits)
    if size < 0.0:
        return Advance(point, 0.0, 0.0, hit, 1, Outcome.STEP_LIMIT)
    time = arrived(point.time, size, limits)
    end = Point(time, inputs[INPUT.angle, 0], inputs[INPUT.velocity, 0], a)
    return Advance(end, size, 0.0, hit, 1, Outcome.COMPLETED)


@compiled
def _attempt(method, point, h):
    """(``StepEnd``, scaled error) of a Runge-Kutta step; the error is nan beyond a wall."""
    end = runge_kutta_stages(method, point.time, point.angle, point.velocity, point.acceleration, h)
    relative, angle, velocity = method.tolerances
    angle += max(abs(point.angle), abs(end.angle))
    velocity += max(abs(point.velocity), abs(end.velocity))
    norm = error_norm(method.sums, h, relative * angle, relative * velocity)
    return end, norm if math.isfinite(end.acceleration) else math.nan


@compiled
def _first_kink(method, point, end, h, limits):
    """(share of the step, end) of the first kink that a step crosses."""
    met = method.stages["velocity"][: STAGES + 1]
    margin = 0.5 * (met.max() - met.min())
    low = limits.low if met.min() - margin <= limits.low else -math.inf
    high = limits.high if met.max() + margin >= limits.high else math.inf
    if math.isinf(low) and math.isinf(high):
        return 2.0, SearchEnd.TIME
    extend(method, point.time, point.angle, point.velocity, h)
    stages, w0, w1 = method.stages, point.velocity, end.velocity
    first_low = crossing_share(stages, w0, w1, h, low, 1.0)
    first_high = crossing_share(stages, w0, w1, h, high, -1.0)
    if min(first_low, first_high) > 1.0:
        return 2.0, SearchEnd.TIME
    if first_low <= first_high:
        return first_low, SearchEnd.HIT_LOW
    return first_high, SearchEnd.HIT_HIGH


@compiled
def _runge_kutta_step(method, point, h, limits):
    """``Advance`` by one accepted Runge-Kutta step; ``method`` holds its stages."""
    a = point.acceleration
    left = limits.end - point.time
    work = 0
    walled = not math.isfinite(a)
    # In a longer step the error estimate could miss a steep part.
    furthest = _POLE_SHARE * pole_distance(method.poles, point.velocity)
    if abs(a) * h > furthest:
        h = furthest / abs(a)
    while h >= limits.tiny:
        work += 1
        size = min(h, left)
        end, norm = _attempt(method, point, size)
        if not math.isfinite(norm):
            # Beyond the wall of a self-locking brake: never step there.
            walled = True
            h = 0.25 * size
            continue
        eighth_root = math.sqrt(math.sqrt(math.sqrt(norm)))
        factor = min(6.0, max(0.2, 0.9 / eighth_root))
        if norm > 1.0:
            h = size * min(factor, 0.9)
            continue
        proposal = size * factor if size == h else max(h, size * factor)
        share, hit = _first_kink(method, point, end, size, limits)
        if hit == SearchEnd.TIME or (limits.stalled and share * size <= limits.tiny):
            time = arrived(point.time, size, limits)
            reached = Point(time, end.angle, end.velocity, end.acceleration)
            return Advance(reached, size, proposal, SearchEnd.TIME, work, Outcome.COMPLETED)
        edge = limits.low if hit == SearchEnd.HIT_LOW else limits.high
        cut = share * size
        if cut <= limits.tiny:
            reached = Point(point.time, point.angle, edge, a)
            return Advance(reached, 0.0, h, hit, work, Outcome.COMPLETED)
        reached, cut, attempts, found = _step_to_kink(method, point, cut, edge, limits)
        work += attempts
        if found:
            return Advance(reached, cut, max(h, cut), hit, work, Outcome.COMPLETED)
        h = 0.5 * min(cut, size)
    outcome = Outcome.NO_FORWARD_SOLUTION if walled else Outcome.STEP_LIMIT
    return Advance(point, 0.0, 0.0, SearchEnd.TIME, work, outcome)


@compiled
def _step_to_kink(method, point, cut, edge, limits):
    """Step again, to a kink and no further: the continuous extension was bent by it.

    In the end Newton closes a gap whose square is far below the tolerance. Returns (point,
    size, attempts, whether it succeeded).
    """
    tolerances = method.tolerances
    close = _CLOSE * tolerances.relative * (tolerances.velocity + abs(edge))
    attempts = 0
    for _ in range(4):
        attempts += 1
        end, norm = _attempt(method, point, cut)
        gap = edge - end.velocity
        if not norm <= 1.0:
            break
        late = gap / end.acceleration if gap != 0.0 else 0.0
        bend = late / cut * late * (end.acceleration - point.acceleration)
        if abs(late) <= 0.1 * cut and abs(bend) <= close:
            time = arrived(point.time, cut + late, limits)
            reached = Point(time, end.angle + end.velocity * late, edge, end.acceleration)
            return reached, cut + late, attempts, True
        cut = min(max(cut + late, 0.5 * cut), 1.5 * cut)
    return point, cut, attempts, False


@compiled
def _inside_runge_kutta(method, point, tau):
    """(angle, velocity) by a shorter step: more exact than the continuous extension."""
    a = point.acceleration
    end = runge_kutta_stages(method, point.time, point.angle, point.velocity, a, tau)
    return end.angle, end.velocity


@compiled
def _inside_series(taylor, point, tau):  # noqa: ARG001 - one signature
    """(angle, velocity) from the series."""
    angle, velocity, _ = series.state(taylor.outputs, 0, tau)
    return angle, velocity


@compiled
def _crossing_time_linear(method, before, after, level):  # noqa: ARG001 - one signature
    """Time at which the velocity passed a level, interpolated linearly."""
    share = (before.velocity - level) / (before.velocity - after.velocity)
    return before.time + (after.time - before.time) * share


@compiled
def _crossing_time_series(taylor, before, after, level):
    """Time at which the velocity passed a level, from the series."""
    h, sign = after.time - before.time, 1.0 if before.velocity > after.velocity else -1.0
    found = series.first_crossing(taylor.outputs, 0, h, level, sign, 1e-12 * h)
    return before.time + min(found, h)


open_method = chosen_by_class({TanhLaw: _open_taylor, AnyLaw: open_runge_kutta})
"""(law, functions, problem) -> method."""

numeric_step = chosen_by_class({Taylor: _series_step, RungeKutta: _runge_kutta_step})
"""(method, point, h, limits) -> ``Advance`` by a step of size h at most."""

first_point = chosen_by_class({Taylor: _series_point, RungeKutta: _runge_kutta_point})
"""(method, point) -> point with the acceleration that a numeric step begins with."""

inside_numeric = chosen_by_class({Taylor: _inside_series, RungeKutta: _inside_runge_kutta})
"""(method, point, tau) -> (angle, velocity) a time tau after the point, in the last step."""

crossing_time = chosen_by_class({Taylor: _crossing_time_series, RungeKutta: _crossing_time_linear})
"""(method, before, after, level) -> time at which the velocity passed a level in the last step."""
