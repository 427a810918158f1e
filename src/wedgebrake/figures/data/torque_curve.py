"""The brake torque over the sliding velocity, in both directions."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple, cast

import numpy as np

from wedgebrake.analysis.linear_stability import DirectionStability, DrivelineStability
from wedgebrake.arrays import FloatArray
from wedgebrake.figures.data.limits import Limits, round_limits
from wedgebrake.model.friction import SetValuedFriction, SmoothFriction
from wedgebrake.model.system import BrakedDriveline

# Speeds as shares of the largest: closer near rest, for laws that are steep there.
_SPEEDS = np.append(np.geomspace(1e-5, 0.02, 60, endpoint=False), np.linspace(0.02, 1.0, 240))
# The picture reaches this multiple of the largest speed of interest; a release speed is of interest
# up to the other multiple of the speed of the motion.
_BEYOND, _FARTHEST = 1.15, 2.0
# Least height of the picture [N m].
_LEAST = 1e-9
# Length of the lines of the limits as a share of the picture's half width.
_LENGTH = 0.55


class Direction(NamedTuple):
    """The torque in one direction of sliding.

    velocity, torque : (n,) [rad/s], [N m]; empty where the brake locks itself
    limit            : velocities and torques at the ends of a line with the slope -c through the
                       point of steady sliding, (2,) each; None without steady sliding
    """

    velocity: FloatArray
    torque: FloatArray
    limit: tuple[FloatArray, FloatArray] | None


@dataclass(frozen=True, eq=False)
class TorqueCurve:
    """The brake torque over the sliding velocity.

    Sliding is unstable where the torque falls by more than the damping c of the driveline gives:
    where the curve is steeper than a line of slope -c.

    directions : forwards and backwards
    holding    : (lowest, highest) torque at rest [N m]; infinite where the brake locks itself
    steady     : (sliding velocity, torque) on a turning shaft; None on one that does not turn
    locked     : the brake locks itself: it cannot slide forwards
    across, up : limits of the picture
    """

    directions: tuple[Direction, Direction]
    holding: Limits
    steady: tuple[float, float] | None
    locked: bool
    across: Limits
    up: Limits

    @classmethod
    def of(
        cls, system: BrakedDriveline, stability: DrivelineStability, speed: float
    ) -> TorqueCurve:
        """The curve of a system.

        speed : largest sliding speed of its motion [rad/s]
        """
        drive, release = system.driveline.drive_speed, system.actuation.release_speed
        speed = max(speed, abs(drive))
        if release <= _FARTHEST * speed or (not speed and math.isfinite(release)):
            speed = max(speed, release)
        _, reach = round_limits(0.0, _BEYOND * (speed or 1.0))
        forward, backward = (
            _direction(system, one, side, reach)
            for one, side in ((stability.forward, 1.0), (stability.backward, -1.0))
        )
        holding = _holding(system)
        shown = np.concatenate([forward.torque, backward.torque, [0.0, *holding]])
        shown = shown[np.isfinite(shown)]
        at = float(torques(system, np.array([drive]))[0]) if drive else math.inf
        return cls(
            (forward, backward), holding, (drive, at) if math.isfinite(at) else None,
            locked=stability.forward.locked, across=(-reach, reach),
            up=round_limits(float(shown.min()), float(shown.max()), _LEAST),
        )  # fmt: skip

    @property
    def line(self) -> tuple[FloatArray, FloatArray]:
        """Velocities [rad/s] and torques [N m] of both directions, in ascending order."""
        forward, backward = self.directions
        return (
            np.concatenate([backward.velocity[::-1], forward.velocity]),
            np.concatenate([backward.torque[::-1], forward.torque]),
        )


def _direction(
    system: BrakedDriveline, sliding: DirectionStability, side: float, reach: float
) -> Direction:
    velocity = side * reach * _SPEEDS
    torque = torques(system, velocity)
    slides = np.isfinite(torque)
    limit = None
    if sliding.damping is not None:
        speed = sliding.speed or float(_SPEEDS[0]) * reach
        ends = np.array([-1.0 if sliding.speed else 0.0, 1.0]) * side * _LENGTH * reach
        at = torques(system, np.array([side * speed]))
        falls = at - system.driveline.damping * ends
        limit = side * speed + ends, falls
    return Direction(velocity[slides], torque[slides], limit)


def torques(system: BrakedDriveline, velocity: FloatArray) -> FloatArray:
    """Brake torque at sliding velocities other than 0 [rad/s], (n,) [N m]; inf where it locks."""
    friction = system.friction
    if isinstance(friction, SetValuedFriction) and friction.has_nodes:
        return system.characteristic.torque(velocity)  # as the exact solver takes it
    return np.array([_torque_at(system, one) for one in velocity.tolist()])


def _torque_at(system: BrakedDriveline, velocity: float) -> float:
    """R F_a(|v|) g(m) of a law that is a curve."""
    brake, friction = system.brake, system.friction
    force = system.actuation.force(abs(velocity))
    if force == 0.0:
        return 0.0
    sliding = brake.radius * velocity
    if isinstance(friction, SetValuedFriction):
        coefficient = math.copysign(friction.kinetic_at(abs(sliding)), velocity)
    else:
        coefficient = cast("SmoothFriction", friction).coefficient(sliding)
    return brake.radius * force * brake.amplification(coefficient)


def _holding(system: BrakedDriveline) -> Limits:
    """Lowest and highest torque at rest; (0, 0) for friction that is a function of the speed."""
    if not isinstance(system.friction, SetValuedFriction):
        return 0.0, 0.0
    brake, static = system.brake, system.friction.breakaway
    lever = brake.radius * system.actuation.force(0.0)
    if lever == 0.0:
        return 0.0, 0.0
    return lever * brake.amplification(-static), lever * brake.amplification(static)
