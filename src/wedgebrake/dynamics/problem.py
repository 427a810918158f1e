"""The machine as numbers: the input of every kernel.

State layout: angle [rad] and velocity [rad/s] of the driveline, columns ``ANGLE`` and
``VELOCITY`` of arrays of states. Velocities are those of the driveline; the brake slides at
``velocity - rest_velocity``.
"""

import math
from typing import Any, NamedTuple

from wedgebrake.dynamics.harmonic import Sine, rate, value
from wedgebrake.dynamics.jit import compiled
from wedgebrake.dynamics.linear_flow import LinearDriveline

ANGLE, VELOCITY = 0, 1


class PiecewiseLinearBrake(NamedTuple):
    """A brake torque that is linear in the velocity between breakpoints, and held at rest.

    breakpoints   : (pieces-1,) velocities [rad/s], ascending, the rest velocity among them
    pieces        : (pieces,) of dtype ``linear_flow.PIECE``
    first_forward : index of the piece just above the rest velocity
    lower, upper  : torque interval that the brake holds at rest [N m], may be infinite
    """

    breakpoints: Any
    pieces: Any
    first_forward: int
    lower: float
    upper: float


class Problem(NamedTuple):
    """A machine with set-valued friction, in the form of the exact solver.

    divergence_velocity : speed beyond which growth counts as divergence [rad/s]
    """

    driveline: LinearDriveline
    torque: Sine
    brake: PiecewiseLinearBrake
    divergence_velocity: float


class State(NamedTuple):
    """A state at a time: number of returns, time since the last one [s], angle, velocity."""

    period: int
    time: float
    angle: float
    velocity: float


class Instant(NamedTuple):
    """A time as a number of returns and the time since the last one [s]."""

    period: int
    time: float


@compiled
def angle_weight(driveline, torque):
    """Factor [1/s] that makes an angle comparable to a velocity: natural or torque's frequency."""
    stiffness = driveline.stiffness / driveline.inertia
    return math.sqrt(stiffness) if stiffness > 0.0 else torque.angular_frequency


@compiled
def demanded_torque(driveline, drive, angle):
    """Torque [N m] for equilibrium at rest relative to the brake, under a driving torque."""
    return drive - driveline.damping * driveline.rest_velocity - driveline.stiffness * angle


@compiled
def torque_at_rest(driveline, torque, phase, angle):
    """Torque [N m] that the brake must hold at a phase of the driving torque."""
    return demanded_torque(driveline, value(torque, phase), angle)


@compiled
def torque_rate_at_rest(driveline, torque, phase):
    """Time derivative [N m/s] of ``torque_at_rest``."""
    return rate(torque, phase) - driveline.stiffness * driveline.rest_velocity


@compiled
def slip_acceleration(driveline, piece, limit):
    """Acceleration [rad/s^2] at the start of slip in a piece, where rest ends at a torque limit.

    It is the step from static to kinetic torque, known without rounding.
    """
    return (limit - piece.offset - piece.slope * driveline.rest_velocity) / driveline.inertia
