"""The event-driven trajectory: closed forms joined at events (docs/equations.md, "Closed form").

The brake is known here only by its characteristic over the driveline velocity: breakpoints,
the pieces between them, and the torque interval that it can hold at rest. One row of the log
is one event; the motion until the next row follows from the row itself, in closed form.
"""

import math
from typing import NamedTuple

from wedgebrake.dynamics.enums import EventKind, FlowForm, Outcome, SearchEnd
from wedgebrake.dynamics.harmonic import phase_at, second_rate
from wedgebrake.dynamics.jit import borrowing, compiled, embedded
from wedgebrake.dynamics.linear_flow import acceleration, enter, forcing_of, state_at
from wedgebrake.dynamics.problem import (
    ANGLE,
    VELOCITY,
    State,
    demanded_torque,
    slip_acceleration,
    torque_at_rest,
    torque_rate_at_rest,
)
from wedgebrake.dynamics.section import phase_at_return, return_time
from wedgebrake.dynamics.segment_log import REST, write
from wedgebrake.solvers.event_driven.event_search import MotionState, hold, passes, slip

# Share of the torques that the torque at rest is the sum of, within which it is at a limit of the
# holding interval and the brake holds. It covers the rounding at one instant. It is small, as a
# torque that exceeds its limit by less causes no slip. Where nothing excites the driveline, it
# covers that of all swings before: no motion on which anything depends begins with a torque as
# small.
_TIE, _UNEXCITED_TIE = 2.0**-45, 2.0**-40
# What must be exceeded to end rest, and the rounding of the torque at one instant, over the above.
_SLACK, _ROUNDING = 2.0, 2.0**-5
# Decisions about rest that follow each other within this share of the fastest rate's radian
# pass no time.
_STANDSTILL = 1e-7


class RunEnd(NamedTuple):
    """End of a run: its outcome and state, events and rows of the log, and evaluations spent."""

    outcome: Outcome
    state: State
    events: int
    rows: int
    evaluations: int


class _Decision(NamedTuple):
    """The last decision about rest: when, how often without time passing, and its tolerance.

    The tolerance of the holding condition [N m] covers rounding. It grows while decisions
    follow each other without time passing, as where the motion creeps into the equilibrium
    of slip.
    """

    period: int
    time: float
    repeats: float
    tolerance: float


class _Event(NamedTuple):
    """An event: its kind, the mode in which the motion goes on, and the direction."""

    kind: EventKind
    mode: int
    side: float


@embedded
def _mode_of(brake, forcing, motion):
    """(piece, acceleration) of a state in motion.

    On a breakpoint, the piece that the acceleration points to; the torque is continuous
    there, so that both pieces give the same acceleration.
    """
    theta, w, phase = motion.angle, motion.velocity, motion.phase
    breakpoints, piece = brake.breakpoints, 0
    while piece < breakpoints.size and w > breakpoints[piece]:
        piece += 1
    if brake.pieces[piece].form == FlowForm.BLOCKED:
        return piece, 0.0
    a = acceleration(brake.pieces[piece], forcing, theta, w, phase)
    if piece < breakpoints.size and w == breakpoints[piece] and a > 0.0:
        piece += 1
    return piece, a


@embedded
def _winds_for_ever(problem, theta):
    """Return True if a stick on a turning shaft never ends.

    The spring torque -k theta moves towards the infinite limit of a self-locking brake, and is
    beyond the finite limit by more than the amplitude of the excitation.
    """
    driveline, brake = problem.driveline, problem.brake
    rate = -driveline.stiffness * driveline.rest_velocity
    mean, amplitude = demanded_torque(driveline, 0.0, theta), problem.torque.amplitude
    if rate > 0.0:
        return brake.upper == math.inf and mean - amplitude > brake.lower
    return rate < 0.0 and brake.lower == -math.inf and mean + amplitude < brake.upper


@embedded
def _tolerance(problem, last, period, t, theta):
    """``_Decision`` about rest at a time, after the last one."""
    driveline, torque = problem.driveline, problem.torque
    natural = math.sqrt(driveline.stiffness / driveline.inertia)
    elapsed = (period - last.period) * return_time(torque) + t - last.time
    standstill = _STANDSTILL / max(torque.angular_frequency, natural)
    repeats = 4.0 * last.repeats if elapsed < standstill else 1.0
    torques = torque.amplitude + abs(driveline.damping * driveline.rest_velocity)
    torques += abs(driveline.stiffness * theta)
    excited = torque.amplitude != 0.0 or driveline.rest_velocity != 0.0
    return _Decision(period, t, repeats, repeats * (_TIE if excited else _UNEXCITED_TIE) * torques)


@embedded
def _slips(problem, decision, side, motion):
    """Return True if a motion at the rest velocity slips to a side.

    The torque exceeds the limit by more than the tolerance, or it is on the limit and about to.
    """
    driveline, torque, phase = problem.driveline, problem.torque, motion.phase
    limit = problem.brake.upper if side > 0.0 else -problem.brake.lower
    excess = side * torque_at_rest(driveline, torque, phase, motion.angle) - limit
    if excess > decision.tolerance:
        return True
    if decision.repeats > 1.0 or excess < -_ROUNDING * decision.tolerance:
        return False
    rate = torque_rate_at_rest(driveline, torque, phase)
    second = second_rate(torque, phase)
    return passes(side * rate, side * second, _SLACK * decision.tolerance)


@embedded
def _hold_or_slip(problem, forcing, event, decision, motion):
    """(event, acceleration) of a motion at the rest velocity: it holds, or slips as pulled.

    event : with the side of the slip before it; a stick that does not hold is a reversal
    """
    brake, theta, w, phase = problem.brake, motion.angle, motion.velocity, motion.phase
    forward = _slips(problem, decision, 1.0, motion)
    if not (forward or _slips(problem, decision, -1.0, motion)):
        return _Event(event.kind, REST, event.side), motion.acceleration
    mode = brake.first_forward if forward else brake.first_forward - 1
    a = motion.acceleration
    if brake.pieces[mode].form != FlowForm.BLOCKED:
        a = acceleration(brake.pieces[mode], forcing, theta, w, phase)
        # The direction is decided; rounding must not turn it round.
        a = max(a, 0.0) if forward else min(a, 0.0)
    if event.kind == EventKind.STICK:
        return _Event(EventKind.REVERSAL, mode, 1.0 if forward else -1.0), a
    return _Event(event.kind, mode, 0.0), a


@embedded
def _break_away(problem, end, decision, motion):
    """(event, motion) where rest ends at a limit of the holding interval."""
    driveline, brake = problem.driveline, problem.brake
    # The acceleration is the step from static to kinetic torque, known without rounding, and
    # the tolerance beyond rounding where rest was not left at the first try.
    excess = decision.tolerance if decision.repeats > 1.0 else 0.0
    forward = end == SearchEnd.HIT_HIGH
    mode = brake.first_forward if forward else brake.first_forward - 1
    limit = brake.upper + excess if forward else brake.lower - excess
    a = slip_acceleration(driveline, brake.pieces[mode], limit)
    a = max(a, 0.0) if forward else min(a, 0.0)
    event = _Event(EventKind.SLIP, mode, 1.0 if forward else -1.0)
    t, phase, theta, _, _ = motion
    return event, MotionState(t, phase, theta, driveline.rest_velocity, a)


@embedded
def _search(problem, forcing, mode, tolerance, motion, t_end, work_limit):
    """The end of the segment that begins with ``motion`` in a mode that can go on."""
    brake = problem.brake
    if mode == REST:
        slack = _SLACK * tolerance
        return hold(
            problem.driveline, problem.torque, brake.lower, brake.upper, slack, motion, t_end
        )
    piece, top = brake.pieces[mode], brake.breakpoints.size
    low = brake.breakpoints[mode - 1] if mode > 0 else -math.inf
    high = brake.breakpoints[mode] if mode < top else math.inf
    if piece.damping < 0.0:
        # Only an unbounded piece with negative damping can run away.
        low = max(low, -problem.divergence_velocity)
        high = min(high, problem.divergence_velocity)
    return slip(piece, forcing, low, high, motion, t_end, work_limit)


@embedded
def _can_go_on(problem, mode, theta):
    """Return True if there is a motion in a mode: the brake neither locks nor holds for ever."""
    if mode == REST:
        return not _winds_for_ever(problem, theta)
    return problem.brake.pieces[mode].form != FlowForm.BLOCKED


@embedded
def _ended(mode, top, found):
    """Outcome of a search that ends the run; COMPLETED if the run goes on."""
    if found.end == SearchEnd.WORK_LIMIT:
        return Outcome.EVENT_LIMIT
    low = found.end == SearchEnd.HIT_LOW and mode == 0
    high = found.end == SearchEnd.HIT_HIGH and mode == top
    if low or high or not math.isfinite(found.motion.velocity):
        return Outcome.DIVERGED
    return Outcome.COMPLETED


@borrowing
def run(problem, start, end, max_events, log, returns, stop=None):
    """Advance from a ``State`` to an ``Instant``.

    log     : receives rows of the segment log; no rows: nothing is logged
    returns : (n, 2) receives the states at the first n returns to the section
    stop    : None, or (1,): ends the run as a limit does when another thread sets it to True

    Returns a ``RunEnd``. Runs on when called again with the state that it returned, also where the
    log is full: its last row is then written and is where the next log begins.
    """
    driveline, torque, brake = problem.driveline, problem.torque, problem.brake
    forcing, interval = forcing_of(driveline, torque), return_time(torque)
    w_rest, top = driveline.rest_velocity, brake.breakpoints.size
    period = start.period
    events, rows, evaluations = 0, 0, 0
    motion = MotionState(start.time, phase_at(torque, start.time), start.angle, start.velocity, 0.0)
    decision = _Decision(period - 1, 0.0, 1.0, 0.0)
    # On the rest velocity the holding interval decides.
    deciding = motion.velocity == w_rest
    mode, a = REST, 0.0
    if not deciding:
        mode, a = _mode_of(brake, forcing, motion)
    event = _Event(EventKind.START, mode, 0.0)
    while True:
        t, phase, theta, w, _ = motion
        if deciding:
            decision = _tolerance(problem, decision, period, t, theta)
            event, a = _hold_or_slip(problem, forcing, event, decision, motion)
            deciding = False
        motion = MotionState(t, phase, theta, w, a)
        if log.size > 0:
            rows = write(log, rows, event.kind, period, t, theta, w, event.mode, event.side)
        final = period >= end.period
        t_end = end.time if final else interval
        outcome = Outcome.COMPLETED
        if event.kind >= EventKind.STICK:
            events += 1
            if events >= max_events:
                outcome = Outcome.EVENT_LIMIT
                break
        # Numba removes a branch whose argument is None.
        if stop is not None:  # noqa: SIM102 - Numba removes it only if this is the sole condition
            if stop[0]:
                outcome = Outcome.EVENT_LIMIT
                break
        if final and t >= t_end:
            break
        if rows > 0 and rows == log.size:
            outcome = Outcome.LOG_FULL
            break
        if not _can_go_on(problem, event.mode, theta):
            outcome = Outcome.NO_FORWARD_SOLUTION
            break

        limit = 10 * max_events - evaluations
        found = _search(problem, forcing, event.mode, decision.tolerance, motion, t_end, limit)
        motion = found.motion
        evaluations += found.evaluations
        if event.mode != REST:
            outcome = _ended(event.mode, top, found)
            if outcome != Outcome.COMPLETED:
                break
        if found.end == SearchEnd.TIME:
            event = _Event(EventKind.END if final else EventKind.RETURN, event.mode, 0.0)
            if not final:
                period += 1
                motion = MotionState(
                    0.0, phase_at_return(), motion.angle, motion.velocity, motion.acceleration
                )
                index = period - start.period - 1
                if index < returns.shape[0]:
                    returns[index, ANGLE] = motion.angle
                    returns[index, VELOCITY] = motion.velocity
        elif event.mode == REST:
            event, motion = _break_away(problem, found.end, decision, motion)
        else:
            low = found.end == SearchEnd.HIT_LOW
            neighbour = event.mode - 1 if low else event.mode + 1
            zero = brake.first_forward
            deciding = motion.velocity == w_rest and (event.mode == zero or neighbour == zero)
            if deciding:
                event = _Event(EventKind.STICK, REST, 1.0 if low else -1.0)
            else:
                event = _Event(EventKind.BREAKPOINT, neighbour, -1.0 if low else 1.0)
        a = motion.acceleration
    state = State(period, motion.time, motion.angle, motion.velocity)
    return RunEnd(outcome, state, events, rows, evaluations)


@compiled
def evaluate(problem, log, periods, times, states, modes):
    """States at any times, ascending, from the closed form that follows each logged row.

    periods, times   : (n,) number of returns and time since the last one
    states, modes    : (n, 2) and (n,) results
    """
    driveline, torque = problem.driveline, problem.torque
    forcing, interval = forcing_of(driveline, torque), return_time(torque)
    row = 0
    for i in range(times.size):
        n, t = periods[i], times[i]
        while row + 1 < log.size and (
            log[row + 1].period < n or (log[row + 1].period == n and log[row + 1].time <= t)
        ):
            row += 1
        begin = log[row]
        tau = (n - begin.period) * interval + t - begin.time
        modes[i] = begin.mode
        theta, w = begin.angle, begin.velocity
        if begin.mode == REST:
            theta, w = theta + driveline.rest_velocity * tau, driveline.rest_velocity
        elif tau != 0.0:
            piece = problem.brake.pieces[begin.mode]
            entry = enter(piece, forcing, theta, w, phase_at(torque, begin.time))
            theta, w = state_at(piece, forcing, entry, tau, phase_at(torque, t))
        states[i, ANGLE], states[i, VELOCITY] = theta, w


@compiled
def velocities(problem, modes, start, theta, w, tau, out):
    """Store the velocities [rad/s] at the times ``tau`` after given states in ``out``.

    modes    : (n,) piece of each state, negative at rest
    start, theta, w: (n,) time within the period, angle and velocity of each state
    tau, out : (n, m) times after each state [s] and velocities
    """
    forcing = forcing_of(problem.driveline, problem.torque)
    for i in range(modes.size):
        if modes[i] < 0:
            out[i, :] = w[i]
            continue
        piece = problem.brake.pieces[modes[i]]
        entry = enter(piece, forcing, theta[i], w[i], phase_at(forcing, start[i]))
        for j in range(tau.shape[1]):
            phase = phase_at(forcing, start[i] + tau[i, j])
            _, out[i, j] = state_at(piece, forcing, entry, tau[i, j], phase)
