"""The straight lines of a brake's torque over the sliding speed (eqs. 3 to 5, 22).

Plain Python, compiled by ``assemble``, so that single brakes and sweeps use the same lines.
"""

import math
from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from wedgebrake.arrays import FloatArray
from wedgebrake.dynamics.actuator import Actuator
from wedgebrake.dynamics.records import record

Law = Callable[[float, Sequence[float]], float]

# Relative distance from a corner within which a speed is at the corner.
CORNER = 1e-9

# One line of torque against |v|, with its start speed.
LINE = record("start offset slope")


def half(
    law: Law,
    shape: Sequence[float],
    radius: float,
    speeds: FloatArray,
    coefficients: FloatArray,
    actuator: Actuator,
    release: float,
    side: float,
    lines: NDArray[np.record],
) -> int:
    """Compute the lines of one direction of sliding, starting at rest, and return their number.

    law, shape  : g(m) = law(m, shape)
    speeds      : (n,) |v| of the table of coefficients [rad/s], starting at 0
    coefficients: (n,) kinetic coefficients
    release     : release speed [rad/s]; inf if there is none
    side        : +1 forwards, -1 backwards
    lines       : (n + 1,) of dtype ``LINE``, receives the result
    """
    force, slope = actuator.initial_force, actuator.slope
    count = 0
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
        line = lines[count]
        line.start, line.slope = start, 0.0
        if math.isinf(gain0) or math.isinf(gain1):
            pressed = force > 0.0 or slope > 0.0
            line.offset = math.inf if pressed else 0.0
        elif gain0 == gain1:
            line.offset, line.slope = gain0 * force, gain0 * slope
        else:
            torque0, torque1 = gain0 * (force + slope * start), gain1 * (force + slope * end)
            line.slope = (torque1 - torque0) / (end - start)
            line.offset = torque0 - line.slope * start
        count += 1
    if not math.isinf(release):
        line = lines[count]
        line.start, line.offset, line.slope = release, 0.0, 0.0
        count += 1
    return count


def pieces_about(breakpoints: FloatArray, at: float, near: float) -> tuple[int, int]:
    """First and last piece between ascending breakpoints that contain ``at``, within ``near``."""
    first, last = 0, 0
    for breakpoint_ in breakpoints:
        first += breakpoint_ < at - near
        last += breakpoint_ < at + near
    return first, last


def holding(
    law: Law,
    shape: Sequence[float],
    radius: float,
    breakaway: float,
    actuator: Actuator,
    side: float,
) -> float:
    """One end of the torque interval at rest, R F_a0 g(+-mu_s) (eq. 5, corrected)."""
    gain = radius * law(side * breakaway, shape)
    if not math.isinf(gain):
        return gain * actuator.initial_force
    # A self-locking brake holds any torque, unless it is never pressed.
    return math.inf if actuator.initial_force > 0.0 or actuator.slope > 0.0 else 0.0
