"""The straight lines of a brake's torque over the sliding speed (eqs. 3 to 5, 22).

Plain Python, compiled by ``assemble``: one brake and a million of them are the same lines.
"""

import math
from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
Law = Callable[[float, Sequence[float]], float]

# Relative distance from a corner within which a speed is at the corner.
CORNER = 1e-9


def half(
    law: Law,
    shape: Sequence[float],
    radius: float,
    speeds: FloatArray,
    coefficients: FloatArray,
    force: float,
    slope: float,
    release: float,
    side: float,
    out: FloatArray,
) -> int:
    """Pieces of one direction of sliding, from rest on; how many there are.

    law, shape  : g(m) = law(m, shape)
    speeds      : (n,) |v| of the table of coefficients [rad/s], from 0 on
    coefficients: (n,) kinetic coefficients
    force, slope: actuation F_a = force + slope |v|
    release     : speed from which on nothing presses [rad/s]; inf if there is none
    side        : +1 forwards, -1 backwards
    out         : (n + 1, 3) receives start speed, offset and slope against |v|
    """
    pieces = 0
    for i in range(speeds.size):
        start = speeds[i]
        if start >= release:
            break
        end, gain0 = release, radius * law(side * coefficients[i], shape)
        gain1 = gain0
        if i + 1 < speeds.size:
            end = min(speeds[i + 1], release)
            share = (end - start) / (speeds[i + 1] - start)
            m = coefficients[i] + share * (coefficients[i + 1] - coefficients[i])
            gain1 = radius * law(side * m, shape)
        out[pieces, 0], out[pieces, 2] = start, 0.0
        if math.isinf(gain0) or math.isinf(gain1):
            pressed = force > 0.0 or slope > 0.0
            out[pieces, 1] = math.inf if pressed else 0.0
        elif gain0 == gain1:
            out[pieces, 1], out[pieces, 2] = gain0 * force, gain0 * slope
        else:
            torque0, torque1 = gain0 * (force + slope * start), gain1 * (force + slope * end)
            out[pieces, 2] = (torque1 - torque0) / (end - start)
            out[pieces, 1] = torque0 - out[pieces, 2] * start
        pieces += 1
    if not math.isinf(release):
        out[pieces, 0], out[pieces, 1], out[pieces, 2] = release, 0.0, 0.0
        pieces += 1
    return pieces


def pieces_about(bounds: FloatArray, at: float, near: float) -> tuple[int, int]:
    """First and last piece between ascending ``bounds`` that contain ``at``, within ``near``."""
    first, last = 0, 0
    for bound in bounds:
        first += bound < at - near
        last += bound < at + near
    return first, last


def holding(
    law: Law,
    shape: Sequence[float],
    radius: float,
    breakaway: float,
    force: float,
    slope: float,
    side: float,
) -> float:
    """One end of the torque interval at rest, R F_a0 g(+-mu_s) (eq. 5, corrected)."""
    gain = radius * law(side * breakaway, shape)
    if not math.isinf(gain):
        return gain * force
    # A self-locking brake holds anything, unless nothing ever presses it.
    return math.inf if force > 0.0 or slope > 0.0 else 0.0
