"""The law of an actuator (eq. 3) and its lag, for model, kernels and measures.

Limits and sampling: see ``solvers/machine/events/modes.py``.

Plain Python; kernels compile the law. ``piecewise_linear.half`` makes the release speed a
breakpoint of the brake torque, beyond which the torque is zero: the exact solver never clips a
force.
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


class Lag(NamedTuple):
    """A lag between command F_c and force: x' = rates x + command F_c, where x[0] is the force.

    rates   : (n, n) of a system that does not grow
    command : (n,)
    norm    : (n, n) symmetric and positive definite: x^T norm x never grows where F_c = 0
    """

    rates: NDArray[np.float64]
    command: NDArray[np.float64]
    norm: NDArray[np.float64]

    @property
    def steady(self) -> NDArray[np.float64]:
        """States at rest, (n,), for a command of 1."""
        found = np.linalg.solve(self.rates, -self.command)
        return np.asarray(found + 0.0, float)  # without -0.0


NO_LAG = Lag(np.empty((0, 0)), np.empty(0), np.empty((0, 0)))
"""The force is the command."""


def first_order(time: float) -> Lag:
    """Lag of first order with a time constant [s]."""
    rate = 1.0 / time
    return Lag(np.array([[-rate]]), np.array([rate]), np.eye(1))


def second_order(frequency: float, damping_ratio: float) -> Lag:
    """Lag of second order with a natural frequency [rad/s] and a damping ratio."""
    square = frequency * frequency
    rates = np.array([[0.0, 1.0], [-square, -2.0 * damping_ratio * frequency]])
    return Lag(rates, np.array([0.0, square]), np.diag([1.0, 1.0 / square]))


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
