"""Small deviations from a motion, and their growth in a piece where the torque is linear."""

import math
from typing import NamedTuple

from wedgebrake.dynamics.jit import compiled
from wedgebrake.dynamics.linear_flow import impulse

# Logarithm of a growth or decay that is well within the range of doubles.
_REACH = 300.0


class Deviations(NamedTuple):
    """Two small deviations of angle and velocity."""

    angle1: float
    velocity1: float
    angle2: float
    velocity2: float


@compiled
def larger_norm(deviations, weight):
    """The larger norm of two deviations, with the angle weighted."""
    x1, y1, x2, y2 = deviations
    return max(math.hypot(weight * x1, y1), math.hypot(weight * x2, y2))


@compiled
def scaled(deviations, norm):
    """(deviations over a norm, logarithm of the norm); unchanged if the norm is zero."""
    if not norm > 0.0:
        return deviations, 0.0
    x1, y1, x2, y2 = deviations
    return Deviations(x1 / norm, y1 / norm, x2 / norm, y2 / norm), math.log(norm)


@compiled
def through_piece(piece, tau, weight, deviations):
    """(deviations, logarithm of their scale) after a time ``tau`` in a piece."""
    g2, w2, scale = piece.damping, piece.stiffness, 0.0
    # In parts, if it shrinks or grows beyond the range of a double.
    parts = 1 + int(abs(g2) * tau / _REACH)
    h, rate = impulse(piece, tau / parts)
    top = rate + g2 * h
    for _ in range(parts):
        x1, y1, x2, y2 = deviations
        deviations = Deviations(
            top * x1 + h * y1, rate * y1 - w2 * h * x1, top * x2 + h * y2, rate * y2 - w2 * h * x2
        )
        if parts > 1:
            deviations, grown = scaled(deviations, larger_norm(deviations, weight))
            scale += grown
    return deviations, scale
