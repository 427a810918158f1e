"""The derivative of the flow along a logged trajectory (docs/theory.md, section 9).

A small deviation (x, y) = (d theta, d w) obeys, inside a piece, the free equation of that
piece. At an event the two trajectories switch at different times, and the deviation jumps
(saltation; Leine and Nijmeijer, Dynamics and Bifurcations of Non-Smooth Mechanical Systems,
2004, ch. 8):

reversal      y -> y a+/a-: the acceleration jumps, the velocity does not
stick         y -> 0: trajectories merge onto w = w_rest; the rank is lost
slip          rest ends a time k x/(T' - k w_rest) later, so that y -> -a+ times that
breakpoint    none: the torque is continuous there
"""

import math

from wedgebrake.dynamics.enums import REVERSAL, SLIP, STICK
from wedgebrake.dynamics.jit import compiled
from wedgebrake.dynamics.linear_flow import G2, acceleration, impulse
from wedgebrake.solvers.event_driven.trajectory import (
    LOG_KIND,
    LOG_PERIOD,
    LOG_PIECE,
    LOG_SIDE,
    LOG_THETA,
    LOG_TIME,
    LOG_W,
    REST,
)

# Logarithm of a growth or decay that doubles hold with room to spare.
_REACH = 300.0


@compiled
def split(problem):
    """The arguments of ``exact.run`` as (plant, laws): what ``carry`` and the tally take."""
    inertia, damping, stiffness, amplitude, omega, _, offsets, table, _, lower, upper, rest, _ = (
        problem
    )
    return (inertia, damping, stiffness, amplitude, omega, rest), (offsets, table, lower, upper)


@compiled
def _jump(plant, laws, before, after, kind):
    """(factor of y, factor of x in y) by which an event changes a deviation.

    before : piece that ends;  after : row of the log that tells the event
    """
    inertia, damping, stiffness, amplitude, omega, w_rest = plant
    offsets, table, lower, upper = laws
    w2, f = stiffness / inertia, amplitude / inertia
    piece = int(after[LOG_PIECE])
    phase = omega * after[LOG_TIME]
    if kind == STICK:
        return 0.0, 0.0
    if kind == REVERSAL:
        sine = math.sin(phase)
        theta, w = after[LOG_THETA], after[LOG_W]
        a0 = acceleration(table[before], w2, f, theta, w, sine)
        a1 = acceleration(table[piece], w2, f, theta, w, sine)
        return a1 / a0 if a0 != 0.0 else 0.0, 0.0
    if kind == SLIP and before == REST:
        limit = upper if after[LOG_SIDE] > 0.0 else lower
        slope = table[piece, G2] * inertia - damping
        a = (limit - offsets[piece] - slope * w_rest) / inertia
        rate = amplitude * omega * math.cos(phase) - stiffness * w_rest
        # A rest that ends where the torque only touches the limit has no derivative.
        return 0.0, -a * stiffness / rate if rate != 0.0 else 0.0
    return 1.0, 0.0


@compiled
def carry(plant, laws, log, rows, x1, y1, x2, y2, growth, first):
    """Carry two deviations along the first ``rows`` rows of a log.

    plant  : (inertia, damping, stiffness, amplitude, omega, w_rest)
    laws   : (offsets, table, lower, upper), as for ``exact.run``
    growth : (n,) receives, for each period that ends, the logarithm by which the first
             deviation has grown since the last one (the norm weighs the angle with the
             natural frequency, or with omega without a spring); the deviation is then
             scaled back.
    first  : period number that growth[0] belongs to

    Returns (x1, y1, x2, y2, logdet, ranked, scale): logdet the logarithm of the area's growth
    in slip, ranked whether no stick has reduced the rank, scale the logarithm by which both
    deviations are to be multiplied: without room for a growth they are scaled together, so
    that nothing vanishes.
    """
    inertia, _, stiffness, _, omega, _ = plant
    table, lower, upper = laws[1], laws[2], laws[3]
    # A brake that holds nothing at rest is no brake there: nothing jumps.
    holds = upper > lower
    w2 = stiffness / inertia
    length = 2.0 * math.pi / omega
    weight = math.sqrt(w2) if w2 > 0.0 else omega
    logdet, ranked, scale = 0.0, True, 0.0
    for i in range(rows - 1):
        after = log[i + 1]
        piece = int(log[i, LOG_PIECE])
        if piece == REST:
            if holds:
                y1 = y2 = 0.0
                ranked = False
        else:
            tau = (after[LOG_PERIOD] - log[i, LOG_PERIOD]) * length
            tau += after[LOG_TIME] - log[i, LOG_TIME]
            g2 = table[piece, G2]
            # In parts where it shrinks or grows so much that a double would not hold it.
            parts = 1 + int(abs(g2) * tau / _REACH)
            h, rate = impulse(table[piece], w2, tau / parts)
            top = rate + g2 * h
            for _ in range(parts):
                x1, y1 = top * x1 + h * y1, rate * y1 - w2 * h * x1
                x2, y2 = top * x2 + h * y2, rate * y2 - w2 * h * x2
                if parts > 1:
                    norm = max(math.hypot(weight * x1, y1), math.hypot(weight * x2, y2))
                    if norm > 0.0:
                        x1, y1, x2, y2 = x1 / norm, y1 / norm, x2 / norm, y2 / norm
                        scale += math.log(norm)
            logdet -= g2 * tau
        kind = int(after[LOG_KIND])
        if holds and kind in (STICK, REVERSAL, SLIP):
            own, mixed = _jump(plant, laws, piece, after, kind)
            y1, y2 = own * y1 + mixed * x1, own * y2 + mixed * x2
            if kind == REVERSAL and own > 0.0:
                logdet += math.log(own)
            elif kind != SLIP:
                ranked = False
        if growth.size == 0 and after[LOG_PERIOD] > log[i, LOG_PERIOD]:
            norm = max(math.hypot(weight * x1, y1), math.hypot(weight * x2, y2))
            if norm > 0.0:
                x1, y1, x2, y2 = x1 / norm, y1 / norm, x2 / norm, y2 / norm
                scale += math.log(norm)
        index = int(after[LOG_PERIOD]) - first - 1
        if 0 <= index < growth.size and after[LOG_PERIOD] > log[i, LOG_PERIOD]:
            norm = math.hypot(weight * x1, y1)
            growth[index] = math.log(norm) + scale if norm > 0.0 else -math.inf
            scale = 0.0
            if norm > 0.0:
                x1, y1 = x1 / norm, y1 / norm
            else:
                x1, y1 = 1.0 / weight, 0.0
    return x1, y1, x2, y2, logdet, ranked, scale
