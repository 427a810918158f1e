"""The derivative of the flow along a trajectory (docs/numerics.md, "Derivative of the flow").

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
from typing import NamedTuple

from wedgebrake.dynamics.deviations import Deviations, larger_norm, scaled, through_piece
from wedgebrake.dynamics.enums import EventKind
from wedgebrake.dynamics.harmonic import phase_at
from wedgebrake.dynamics.jit import borrowing
from wedgebrake.dynamics.linear_flow import acceleration, forcing_of
from wedgebrake.dynamics.problem import angle_weight, slip_acceleration, torque_rate_at_rest
from wedgebrake.dynamics.section import return_time
from wedgebrake.dynamics.segment_log import REST, duration


class Variation(NamedTuple):
    """Derivative of a flow on two deviations.

    log_determinant : logarithm of the growth of areas in slip
    full_rank       : no stick has reduced the rank
    log_scale       : logarithm of the factor by which both deviations are to be multiplied
    """

    deviations: Deviations
    log_determinant: float
    full_rank: bool
    log_scale: float


@borrowing
def _jump(problem, forcing, before, after):
    """(factor of y, factor of x in y) by which an event changes a deviation.

    before : mode that ends;  after : row of the log with the event
    """
    driveline, brake = problem.driveline, problem.brake
    phase = phase_at(forcing, after.time)
    if after.kind == EventKind.STICK:
        return 0.0, 0.0
    if after.kind == EventKind.REVERSAL:
        theta, w = after.angle, after.velocity
        a0 = acceleration(brake.pieces[before], forcing, theta, w, phase)
        a1 = acceleration(brake.pieces[after.mode], forcing, theta, w, phase)
        return a1 / a0 if a0 != 0.0 else 0.0, 0.0
    if after.kind == EventKind.SLIP and before == REST:
        limit = brake.upper if after.side > 0.0 else brake.lower
        a = slip_acceleration(driveline, brake.pieces[after.mode], limit)
        rate = torque_rate_at_rest(driveline, problem.torque, phase)
        # The end of a rest at which the torque only touches the limit has no derivative.
        return 0.0, -a * driveline.stiffness / rate if rate != 0.0 else 0.0
    return 1.0, 0.0


@borrowing
def propagate(problem, log, rows, deviations, growth, first):
    """Propagate two deviations along the first ``rows`` rows of a log.

    growth : (n,) receives, for each return, the logarithm by which the first deviation has
             grown since the previous return (the norm weighs the angle, see ``angle_weight``); the
             deviation is then scaled back. Empty: both are scaled together, so that nothing
             vanishes.
    first  : period number that growth[0] belongs to

    Returns a ``Variation``.
    """
    forcing = forcing_of(problem.driveline, problem.torque)
    # A brake without holding torque causes no jump.
    holds = problem.brake.upper > problem.brake.lower
    interval = return_time(problem.torque)
    weight = angle_weight(problem.driveline, problem.torque)
    determinant, full_rank, scale = 0.0, True, 0.0
    for i in range(rows - 1):
        before, after = log[i], log[i + 1]
        if before.mode == REST:
            if holds:
                deviations = Deviations(deviations.angle1, 0.0, deviations.angle2, 0.0)
                full_rank = False
        else:
            piece, tau = problem.brake.pieces[before.mode], duration(before, after, interval)
            deviations, grown = through_piece(piece, tau, weight, deviations)
            scale += grown
            determinant -= piece.damping * tau
        kind = after.kind
        if holds and EventKind.STICK <= kind <= EventKind.REVERSAL:
            own, mixed = _jump(problem, forcing, before.mode, after)
            x1, y1, x2, y2 = deviations
            deviations = Deviations(x1, own * y1 + mixed * x1, x2, own * y2 + mixed * x2)
            if kind == EventKind.REVERSAL and own > 0.0:
                determinant += math.log(own)
            elif kind != EventKind.SLIP:
                full_rank = False
        if after.period == before.period:
            continue
        if growth.size == 0:
            deviations, grown = scaled(deviations, larger_norm(deviations, weight))
            scale += grown
        index = after.period - first - 1
        if 0 <= index < growth.size:
            x1, y1, x2, y2 = deviations
            norm = math.hypot(weight * x1, y1)
            growth[index] = math.log(norm) + scale if norm > 0.0 else -math.inf
            scale = 0.0
            if norm > 0.0:
                deviations = Deviations(x1 / norm, y1 / norm, x2, y2)
            else:
                deviations = Deviations(1.0 / weight, 0.0, x2, y2)
    return Variation(deviations, determinant, full_rank, scale)
