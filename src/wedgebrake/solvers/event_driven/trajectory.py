"""The event-driven trajectory: closed forms joined at events (docs/theory.md, section 5).

The brake is known here only by its characteristic over the driveline velocity ``w``:
breakpoints, an offset and a slope for each piece between them, and the torque interval
that it can hold at rest. One row of the log is one event; the motion until the next row
follows from the row itself, in closed form.
"""

import math

import numpy as np
from numpy.typing import NDArray

from wedgebrake.dynamics.enums import (
    BREAKPOINT,
    COMPLETED,
    DIVERGED,
    END,
    EVENT_LIMIT,
    LOG_FULL,
    NO_SLIDING,
    PERIOD,
    REVERSAL,
    SLIP,
    START,
    STICK,
)
from wedgebrake.dynamics.jit import compiled
from wedgebrake.dynamics.linear_flow import BLOCKED, G2, KIND, acceleration, entry, state_at
from wedgebrake.solvers.event_driven.event_search import (
    HIT_HIGH,
    HIT_LOW,
    OUT_OF_PATIENCE,
    REACHED_END,
    slip,
)
from wedgebrake.solvers.event_driven.stick_phase import HELD, LEFT_UP, hold

# Rounding of the torque at rest, as a share of the torques it is the sum of.
_ROOM = 2.0**-50

# The piece number that stands for rest.
REST = -1

# Columns of the log.
LOG_KIND, LOG_PERIOD, LOG_TIME, LOG_THETA, LOG_W, LOG_PIECE, LOG_SIDE = range(7)
LOG_COLUMNS = 7


@compiled
def _start(bounds, table, w2, f, theta, w, sine):
    """(piece, acceleration) of a state in motion.

    On a breakpoint, the piece that the acceleration points to; the torque is continuous
    there, so that both pieces give the same acceleration.
    """
    piece = 0
    while piece < bounds.size and w > bounds[piece]:
        piece += 1
    if table[piece, KIND] == BLOCKED:
        return piece, 0.0
    a = acceleration(table[piece], w2, f, theta, w, sine)
    if piece < bounds.size and w == bounds[piece] and a > 0.0:
        piece += 1
    return piece, a


@compiled
def _winds_for_ever(amplitude, stiffness, damping, lower, upper, theta, w_rest):
    """Return True if a stick on a turning shaft never ends.

    The spring torque -k theta moves towards the infinite limit of a self-locking brake, and is
    beyond the finite limit by more than the amplitude of the excitation.
    """
    rate = -stiffness * w_rest
    pull = -damping * w_rest - stiffness * theta
    if rate > 0.0:
        return upper == math.inf and pull - amplitude > lower
    return rate < 0.0 and lower == -math.inf and pull + amplitude < upper


@compiled
def run(
    inertia,
    damping,
    stiffness,
    amplitude,
    omega,
    bounds,
    offsets,
    table,
    zero,
    lower,
    upper,
    w_rest,
    w_diverged,
    period,
    t,
    theta,
    w,
    last_period,
    last_time,
    max_events,
    log,
    poincare,
    stop=None,
):
    """Advance from (period, t, theta, w) to (last_period, last_time).

    bounds           (pieces-1,) breakpoints over w [rad/s], ascending, one of them w_rest
    offsets          (pieces,) torque at w = 0 of each piece's line [N m]
    table            (pieces, flow.COLUMNS) constants of the pieces
    zero             index of the piece just above w_rest
    lower, upper     holding interval [N m]
    w_diverged       speed past which growth is called divergence [rad/s]
    t, last_time     time inside the period, in [0, 2 pi/omega]
    log              (rows, LOG_COLUMNS); no rows: nothing is logged
    poincare         (n, 2) receives (theta, w) at the start of each later period
    stop             None, or (1,): ends the run as a limit does when another thread sets it to True

    Returns (outcome, period, t, theta, w, events, rows, evaluations). Runs on when called
    again with what it returned, also where the log is full: its last row is then written
    and is where the next log begins.
    """
    w2 = stiffness / inertia
    f = amplitude / inertia
    length = 2.0 * math.pi / omega
    top = bounds.size
    first_period = period
    events, rows, evaluations = 0, 0, 0
    sine, cosine = math.sin(omega * t), math.cos(omega * t)
    a = 0.0
    kind, side, came_from = START, 0.0, 0.0
    # Room for rounding in the holding condition; it grows while decisions follow each other
    # without time passing, as where the motion creeps into the equilibrium of slip.
    again, room, rest_period, rest_time = 1.0, 0.0, period - 1, 0.0
    standstill = 1e-7 / max(omega, math.sqrt(w2))

    # On the rest velocity the holding interval decides, below.
    deciding = w == w_rest
    piece = REST
    if not deciding:
        piece, a = _start(bounds, table, w2, f, theta, w, sine)

    while True:
        if deciding:
            # At rest relative to the brake: hold, or slip the way the torque points.
            pull = amplitude * sine - damping * w_rest - stiffness * theta
            elapsed = (period - rest_period) * length + t - rest_time
            again = 4.0 * again if elapsed < standstill else 1.0
            rest_period, rest_time = period, t
            room = again * _ROOM * (amplitude + abs(damping * w_rest) + abs(stiffness * theta))
            if pull > upper + room or pull < lower - room:
                piece = zero if pull > upper else zero - 1
                if kind == STICK:
                    kind = REVERSAL
                    side = 1.0 if piece == zero else -1.0
                if table[piece, KIND] != BLOCKED:
                    a = acceleration(table[piece], w2, f, theta, w, sine)
                    # The direction is decided; rounding must not turn it round.
                    a = max(a, 0.0) if piece == zero else min(a, 0.0)
            else:
                piece = REST
                side = came_from
            deciding = False

        if log.shape[0] > 0:
            log[rows, LOG_KIND] = kind
            log[rows, LOG_PERIOD] = period
            log[rows, LOG_TIME] = t
            log[rows, LOG_THETA] = theta
            log[rows, LOG_W] = w
            log[rows, LOG_PIECE] = piece
            log[rows, LOG_SIDE] = side
            rows += 1
        if kind >= STICK:
            events += 1
            if events >= max_events:
                return EVENT_LIMIT, period, t, theta, w, events, rows, evaluations

        # Numba removes a branch whose argument is None.
        if stop is not None:  # noqa: SIM102 - Numba removes it only if this is the sole condition
            if stop[0]:
                return EVENT_LIMIT, period, t, theta, w, events, rows, evaluations
        final = period >= last_period
        t_end = last_time if final else length
        if final and t >= t_end:
            return COMPLETED, period, t, theta, w, events, rows, evaluations
        if rows > 0 and rows == log.shape[0]:
            return LOG_FULL, period, t, theta, w, events, rows, evaluations

        arrived = False
        if piece == REST:
            if _winds_for_ever(amplitude, stiffness, damping, lower, upper, theta, w_rest):
                return NO_SLIDING, period, t, theta, w, events, rows, evaluations
            what, t, theta = hold(
                amplitude, omega, stiffness, damping, lower - room, upper + room, t, t_end,
                theta, w_rest,
            )  # fmt: skip
            arrived = what == HELD
            sine, cosine = math.sin(omega * t), math.cos(omega * t)
            if not arrived:
                # The side is the end of the interval that was left: the acceleration there
                # is the step from static to kinetic torque, known without rounding, and the
                # room beyond rounding where rest was not left at the first try.
                excess = room if again > 1.0 else 0.0
                kind, w = SLIP, w_rest
                if what == LEFT_UP:
                    piece, side = zero, 1.0
                    limit = upper + excess
                else:
                    piece, side = zero - 1, -1.0
                    limit = lower - excess
                slope = table[piece, G2] * inertia - damping
                a = (limit - offsets[piece] - slope * w_rest) / inertia
                a = max(a, 0.0) if what == LEFT_UP else min(a, 0.0)
        else:
            if table[piece, KIND] == BLOCKED:
                return NO_SLIDING, period, t, theta, w, events, rows, evaluations
            low = bounds[piece - 1] if piece > 0 else -math.inf
            high = bounds[piece] if piece < top else math.inf
            if table[piece, G2] < 0.0:
                # Only an unbounded piece with negative damping can run away.
                low = max(low, -w_diverged)
                high = min(high, w_diverged)
            what, t, sine, cosine, theta, w, a, spent = slip(
                table[piece], w2, f, omega, low, high, t, t_end, sine, cosine, theta, w, a,
                10 * max_events - evaluations,
            )  # fmt: skip
            evaluations += spent
            if what == OUT_OF_PATIENCE:
                return EVENT_LIMIT, period, t, theta, w, events, rows, evaluations
            if not math.isfinite(w):
                return DIVERGED, period, t, theta, w, events, rows, evaluations
            if what != REACHED_END:
                side = -1.0 if what == HIT_LOW else 1.0
                neighbour = piece - 1 if what == HIT_LOW else piece + 1
                if (what == HIT_LOW and piece == 0) or (what == HIT_HIGH and piece == top):
                    return DIVERGED, period, t, theta, w, events, rows, evaluations
                if w == w_rest and (piece == zero or neighbour == zero):
                    kind, deciding = STICK, True
                    came_from = 1.0 if what == HIT_LOW else -1.0
                else:
                    kind, piece = BREAKPOINT, neighbour
            else:
                arrived = True

        if arrived:
            if final:
                kind, side = END, 0.0
            else:
                kind, side = PERIOD, 0.0
                period += 1
                t, sine, cosine = 0.0, 0.0, 1.0
                index = period - first_period - 1
                if index < poincare.shape[0]:
                    poincare[index, 0] = theta
                    poincare[index, 1] = w


@compiled
def evaluate(
    inertia, stiffness, amplitude, omega, table, w_rest, log, periods, times, theta, w, piece
):
    """State at any times, ascending, from the closed form that follows each logged event.

    periods, times   (n,) period number and time inside the period
    theta, w, piece  (n,) results
    """
    w2 = stiffness / inertia
    f = amplitude / inertia
    length = 2.0 * math.pi / omega
    row = 0
    for i in range(times.size):
        n, t = periods[i], times[i]
        while row + 1 < log.shape[0] and (
            log[row + 1, LOG_PERIOD] < n
            or (log[row + 1, LOG_PERIOD] == n and log[row + 1, LOG_TIME] <= t)
        ):
            row += 1
        t0 = log[row, LOG_TIME]
        tau = (n - log[row, LOG_PERIOD]) * length + t - t0
        number = int(log[row, LOG_PIECE])
        piece[i] = number
        if number == REST:
            theta[i] = log[row, LOG_THETA] + w_rest * tau
            w[i] = w_rest
        elif tau == 0.0:
            theta[i] = log[row, LOG_THETA]
            w[i] = log[row, LOG_W]
        else:
            theta0, w0 = log[row, LOG_THETA], log[row, LOG_W]
            sin0, cos0 = math.sin(omega * t0), math.cos(omega * t0)
            sin1, cos1 = math.sin(omega * t), math.cos(omega * t)
            flow = table[number]
            coefficients = entry(flow, w2, omega, theta0, w0, sin0, cos0)
            theta[i], w[i] = state_at(
                flow, w2, f, omega, theta0, w0, sin0, cos0, coefficients, tau, sin1, cos1
            )


def empty_log(rows: int) -> NDArray[np.float64]:
    """Room for ``rows`` events."""
    return np.empty((rows, LOG_COLUMNS))
