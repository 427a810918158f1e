"""The brake torque over the sliding velocity, in both directions."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple, cast

import numpy as np

from wedgebrake.analysis.linear_stability import DirectionStability
from wedgebrake.arrays import FloatArray
from wedgebrake.figures.data.limits import Limits, round_limits
from wedgebrake.model.characteristic import characteristic
from wedgebrake.model.friction import SetValuedFriction, SmoothFriction
from wedgebrake.model.machine_parts import Contact
from wedgebrake.model.signals.signals import number_of
from wedgebrake.model.torque_contacts import TorqueContact

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
        cls,
        contact: Contact | None,
        damping: float = 0.0,
        directions: Sequence[DirectionStability] | None = None,
        speed: float = 0.0,
        torque: float = 0.0,
    ) -> TorqueCurve:
        """The curve of a contact whose force is a number.

        contact    : None for a machine without contacts
        damping    : of the driveline [N m s/rad], for the lines of the limits
        directions : the linear verdict on sliding forwards and backwards; None: no limits
        speed      : largest sliding speed of its motion [rad/s]
        torque     : largest torque of its motion [N m], which the picture contains if the curve
                     has no torque that is finite and not 0
        """
        if contact is None:
            empty = Direction(np.empty(0), np.empty(0), None)
            return cls((empty, empty), (0.0, 0.0), None, False, (-1.0, 1.0), (-1.0, 1.0))
        drive, release = -(number_of(contact.base_speed) or 0.0), contact.actuation.release_speed
        speed = max(speed, abs(drive))
        if release <= _FARTHEST * speed or (not speed and math.isfinite(release)):
            speed = max(speed, release)
        _, reach = round_limits(0.0, _BEYOND * (speed or 1.0))
        forward, backward = (
            _direction(contact, damping, one, side, reach)
            for one, side in zip(directions or (None, None), (1.0, -1.0), strict=True)
        )
        holding = _holding(contact)
        shown = np.concatenate([forward.torque, backward.torque, [0.0, *holding]])
        shown = shown[np.isfinite(shown)]
        if not shown.any():
            shown = np.array([-torque, torque])
        at = float(torques(contact, np.array([drive]))[0]) if drive else math.inf
        return cls(
            (forward, backward), holding, (drive, at) if math.isfinite(at) else None,
            locked=directions is not None and directions[0].locked, across=(-reach, reach),
            up=round_limits(float(shown.min()), float(shown.max()), _LEAST),
        )  # fmt: skip

    @property
    def known(self) -> bool:
        """False for a machine without contacts."""
        return any(one.velocity.size for one in self.directions) or self.holding != (0.0, 0.0)

    @property
    def line(self) -> tuple[FloatArray, FloatArray]:
        """Velocities [rad/s] and torques [N m] of both directions, in ascending order."""
        forward, backward = self.directions
        return (
            np.concatenate([backward.velocity[::-1], forward.velocity]),
            np.concatenate([backward.torque[::-1], forward.torque]),
        )


def _direction(
    contact: Contact, damping: float, sliding: DirectionStability | None, side: float, reach: float
) -> Direction:
    velocity = side * reach * _SPEEDS
    torque = torques(contact, velocity)
    slides = np.isfinite(torque)
    limit = None
    if sliding is not None and sliding.damping is not None:
        speed = sliding.speed or float(_SPEEDS[0]) * reach
        ends = np.array([-1.0 if sliding.speed else 0.0, 1.0]) * side * _LENGTH * reach
        at = torques(contact, np.array([side * speed]))
        falls = at - damping * ends
        limit = side * speed + ends, falls
    return Direction(velocity[slides], torque[slides], limit)


def torques(contact: Contact, velocity: FloatArray) -> FloatArray:
    """Brake torque at sliding velocities other than 0 [rad/s], (n,) [N m]; inf where it locks."""
    friction = contact.friction
    by_torque = isinstance(contact, TorqueContact)
    if isinstance(friction, SetValuedFriction) and friction.has_nodes and not by_torque:
        return characteristic(contact.brake, friction, contact.actuation).torque(
            velocity
        )  # as the exact solver takes it
    return np.array([_torque_at(contact, one) for one in velocity.tolist()])


def _torque_at(contact: Contact, velocity: float) -> float:
    """R F_a(|v|) g(m) of a law that is a curve."""
    brake, friction = contact.brake, contact.friction
    force = contact.actuation.force(abs(velocity))
    if force == 0.0:
        return 0.0
    sliding = brake.radius * velocity
    if isinstance(friction, SetValuedFriction):
        coefficient = math.copysign(friction.kinetic_at(abs(sliding)), velocity)
    else:
        coefficient = cast("SmoothFriction", friction).coefficient(sliding)
    return brake.radius * force * brake.amplification(coefficient)


def _holding(contact: Contact) -> Limits:
    """Lowest and highest torque at rest; (0, 0) for friction that is a function of the speed."""
    if not isinstance(contact.friction, SetValuedFriction):
        return 0.0, 0.0
    brake, static = contact.brake, contact.friction.breakaway
    lever = brake.radius * contact.actuation.force(0.0)
    if lever == 0.0:
        return 0.0, 0.0
    return lever * brake.amplification(-static), lever * brake.amplification(static)
