"""The law of an actuator without lag (eq. 3), for model, kernels and measures.

Lag, limits and sampling are part of machines: see ``solvers/machine/events/modes.py``.

Plain Python; kernels compile it. ``piecewise_linear.half`` makes the release speed a breakpoint of
the brake torque, beyond which the torque is zero: the exact solver never clips a force.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray


class Actuator(NamedTuple):
    """F_a = initial_force + slope |v| [N], never below zero if ``release`` is on."""

    initial_force: float
    slope: float
    release: bool


def commanded_force(initial_force, slope, speed):
    """Force [N] at the sliding speed |v| [rad/s] before release; for numbers and arrays."""
    return initial_force + slope * speed


def force(actuator: Actuator, speed: float) -> float:
    """Actuation force [N] at the sliding speed |v| [rad/s]."""
    value = actuator.initial_force + actuator.slope * speed
    if actuator.release and value < 0.0:
        return 0.0
    return value


def forces(actuator: Actuator, speeds: NDArray[np.float64]) -> NDArray[np.float64]:
    """``force`` at sliding speeds (n,)."""
    values: NDArray[np.float64] = commanded_force(actuator.initial_force, actuator.slope, speeds)
    return np.maximum(values, 0.0) if actuator.release else values


def release_speed(actuator: Actuator) -> float:
    """Release speed [rad/s]; inf if there is none."""
    if not actuator.release or actuator.slope >= 0.0:
        return math.inf
    return actuator.initial_force / -actuator.slope
