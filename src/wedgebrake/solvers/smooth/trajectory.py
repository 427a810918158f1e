"""A motion with a smooth friction law: numeric near zero speed, else in closed form.

The velocity axis is cut into stretches, at two kinds of edge:

kinks     zero sliding velocity and the release of the actuation, where the law bends: a step
          ends exactly there, and no crossing is missed;
borders   of the steep layer and of the velocities from which the law is constant to well below
          the tolerance: there only the method of solution changes.

A step is a Taylor series where the law is known to be mu tanh and the brake a fraction, a
Runge-Kutta step for any other law, and the exact solver's closed form and event search where
the torque is linear (``steps``).
"""

import math
from typing import NamedTuple

from wedgebrake.dynamics.enums import EventKind, Outcome, SearchEnd
from wedgebrake.dynamics.harmonic import phase_at, rate
from wedgebrake.dynamics.jit import compiled
from wedgebrake.dynamics.linear_flow import enter, forcing_of, state_at
from wedgebrake.dynamics.problem import State
from wedgebrake.dynamics.records import record
from wedgebrake.dynamics.section import return_time
from wedgebrake.dynamics.segment_log import write
from wedgebrake.solvers.smooth.problem import stretch_at
from wedgebrake.solvers.smooth.steps import (
    Advance,
    Limits,
    Point,
    crossing_time,
    first_point,
    inside_numeric,
    linear_step,
    numeric_step,
    open_method,
)

# The trail has a row for each step: the stretch, the state at its begin, its duration.
STEP = record("time angle velocity duration", whole="stretch")

# First Runge-Kutta step, as a share of the longest one.
_FIRST_STEP = 1e-3
# After a linear stretch, share of the time to zero sliding velocity at the present rate.
_TOWARDS_REST = 0.3
# A step counts as too small below this share of a period.
TINY = 1e-15
# The loop may log so many rows at once.
_ROWS_AT_ONCE = 4


class StepperEnd(NamedTuple):
    """End of a run: why, where, and steps, rows, samples and rows of the trail so far."""

    outcome: int
    state: State
    steps: int
    rows: int
    samples: int
    trail: int


@compiled
def _due(samples, number, period, time):
    """Return True if a sample is wanted up to a time."""
    if number >= samples.time.size:
        return False
    wanted = samples.period[number]
    return wanted < period or (wanted == period and samples.time[number] <= time)


@compiled
def _sample(method, forcing, piece, linear, before, tau):
    """(angle, velocity) a time tau after the beginning of the last step."""
    # Not from the last step, which may have ended here.
    if tau <= 0.0:
        return before.angle, before.velocity
    if not linear:
        return inside_numeric(method, before, tau)
    begin = phase_at(forcing, before.time)
    entry = enter(piece, forcing, before.angle, before.velocity, begin)
    return state_at(piece, forcing, entry, tau, phase_at(forcing, before.time + tau))


@compiled
def _begin(method, problem, state):
    """(point, stretch) of a state; on an edge, the stretch that the motion enters."""
    point = first_point(method, Point(state.time, state.angle, state.velocity, 0.0))
    falling = stretch_at(problem.stretches, state.velocity, False)
    rising = stretch_at(problem.stretches, state.velocity, True)
    if falling != rising:
        a = point.acceleration
        push = rate(problem.torque, phase_at(problem.torque, state.time))
        if a < 0.0 or (a == 0.0 and push <= problem.driveline.stiffness * state.velocity):
            return point, falling
    return point, rising


@compiled
def run(functions, problem, start, end, max_steps, samples, log, trail, stop):
    """Advance from the ``State`` start to the ``Instant`` end.

    functions, problem : as in ``Assembled``
    samples : ``Samples``, the times wanted
    log     : of dtype ``segment_log.SEGMENT``; a row for each event, its mode the stretch
    trail   : of dtype ``STEP``; a row for each step that moved; no room: not wanted
    stop    : None, or (1,): ends the run as the limit of steps does when another thread sets it

    Returns ``StepperEnd``.
    """
    driveline, torque, stretches = problem.driveline, problem.torque, problem.stretches
    rest, band = driveline.rest_velocity, problem.band
    forcing, length = forcing_of(driveline, torque), return_time(torque)
    method = open_method(problem.law, functions, problem)
    steps, rows, wanted, left = 0, 0, 0, 0
    period, h, stalled = start.period, _FIRST_STEP * problem.longest_step, False
    point, stretch = _begin(method, problem, start)
    angle, velocity = point.angle, point.velocity
    rows = write(log, rows, EventKind.START, period, point.time, angle, velocity, stretch, 0.0)
    in_band = abs(velocity - rest) <= band
    if in_band:
        kind = EventKind.BAND_ENTERED
        rows = write(log, rows, kind, period, point.time, angle, velocity, stretch, 0.0)

    outcome = Outcome.LOG_FULL
    while rows + _ROWS_AT_ONCE <= log.size and (trail.size == 0 or left < trail.size):
        # Step.
        final = period >= end.period
        t_end = end.time if final else length
        here = stretches[stretch]
        before = point
        made = Advance(point, 0.0, h, SearchEnd.TIME, 0, Outcome.COMPLETED)
        if point.time >= t_end:
            pass
        elif here.linear:
            made = linear_step(
                here, problem.pieces[stretch], forcing, point, t_end, problem.divergence_velocity,
                max_steps - steps,
            )  # fmt: skip
            point = made.point
            h = _TOWARDS_REST * abs((point.velocity - rest) / point.acceleration)
        else:
            limits = Limits(t_end, here.kink_below, here.kink_above, TINY * length, stalled)
            made = numeric_step(method, point, h, limits)
            point, h, stalled = made.point, made.proposal, made.size == 0.0
        h = min(problem.longest_step, h)
        steps += made.work
        if made.outcome != Outcome.COMPLETED:
            outcome = made.outcome
            break
        if trail.size > 0 and made.size > 0.0:
            row = trail[left]
            row.stretch, row.time, row.duration = stretch, before.time, made.size
            row.angle, row.velocity = before.angle, before.velocity
            left += 1
        while _due(samples, wanted, period, before.time + made.size):
            tau = min(made.size, max(0.0, samples.time[wanted] - before.time))
            samples.state[wanted, 0], samples.state[wanted, 1] = _sample(
                method, forcing, problem.pieces[stretch], here.linear, before, tau
            )
            wanted += 1

        # Events.
        velocity = point.velocity
        if (abs(velocity - rest) <= band) != in_band and not here.linear:
            in_band = not in_band
            side = 1.0 if (before.velocity if in_band else velocity) > rest else -1.0
            time = crossing_time(method, before, point, rest + side * band)
            kind = EventKind.BAND_ENTERED if in_band else EventKind.BAND_LEFT
            rows = write(log, rows, kind, period, time, point.angle, velocity, stretch, side)
        given_up = steps > max_steps
        # Numba removes a branch whose argument is None.
        if stop is not None:
            given_up = given_up or stop[0]
        if given_up:
            outcome = Outcome.STEP_LIMIT
            break
        if not math.isfinite(velocity) or abs(velocity - rest) >= problem.divergence_velocity:
            outcome = Outcome.DIVERGED
            break
        if made.hit != SearchEnd.TIME:
            stretch = stretch_at(stretches, velocity, made.hit == SearchEnd.HIT_HIGH)
            kinks = stretches[stretch]
            on_kink = velocity == kinks.kink_below or velocity == kinks.kink_above
            moved = velocity != before.velocity or point.time != before.time
            if moved and (velocity == rest or on_kink):
                kind = EventKind.REVERSAL if velocity == rest else EventKind.BREAKPOINT
                side = -1.0 if made.hit == SearchEnd.HIT_LOW else 1.0
                rows = write(
                    log, rows, kind, period, point.time, point.angle, velocity, stretch, side
                )
        elif not here.linear and not here.low < velocity < here.high:
            stretch = stretch_at(stretches, velocity, point.acceleration > 0.0)
        if here.linear and not stretches[stretch].linear:
            point = first_point(method, point)

        # Return to the section.
        if made.hit == SearchEnd.TIME and point.time >= t_end:
            if final:
                for number in range(wanted, samples.time.size):  # at the end, up to rounding
                    samples.state[number, 0] = point.angle
                    samples.state[number, 1] = velocity
                wanted = samples.time.size
                kind = EventKind.END
                rows = write(log, rows, kind, period, t_end, point.angle, velocity, stretch, 0.0)
                outcome = Outcome.COMPLETED
                break
            period += 1
            point = Point(0.0, point.angle, velocity, point.acceleration)
            kind = EventKind.RETURN
            rows = write(log, rows, kind, period, 0.0, point.angle, velocity, stretch, 0.0)
    state = State(period, point.time, point.angle, point.velocity)
    return StepperEnd(outcome, state, steps, rows, wanted, left)
