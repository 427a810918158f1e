"""Damping of small vibration about steady sliding: the definition used in the whole package.

On a turning shaft the brake slides steadily at the speed of the shaft, otherwise near rest in
both directions. With smooth friction, near rest means at the end of the steep part of the law.
The damping about sliding at the velocity v is

    d = c + d(R F_mu)/dv,

which includes the slope of the friction law and the release of the actuator.
"""

from __future__ import annotations

import math
from bisect import bisect_right
from itertools import pairwise
from operator import itemgetter
from typing import NamedTuple, cast

import numpy as np

from wedgebrake.analysis.linear_stability.sliding_contact import FLAT, one_sided_slopes
from wedgebrake.dynamics import piecewise_linear
from wedgebrake.errors import InputError
from wedgebrake.model.actuation import Actuation
from wedgebrake.model.friction import Friction, SetValuedFriction, SmoothFriction
from wedgebrake.model.system import BrakedDriveline
from wedgebrake.model.validation import check_number


class Sliding(NamedTuple):
    """Steady sliding in a direction (+1 or -1) at a speed [rad/s].

    near_rest : the limit near rest, in which the actuation does not differ from that at rest; the
                speed is 0, or with smooth friction the end of the steep part of the law
    """

    direction: int
    speed: float
    near_rest: bool = False

    @property
    def actuated(self) -> float:
        """Speed at which the actuation is evaluated [rad/s]."""
        return 0.0 if self.near_rest else self.speed


class DampingLine(NamedTuple):
    """Damping as a function of the actuation slope: ``at_zero + gradient slope`` in (low, high)."""

    low: float
    high: float
    at_zero: float
    gradient: float


def damping_at(system: BrakedDriveline, speed: float) -> float:
    """Damping of small vibration about sliding at one velocity: c + d(R F_mu)/dv [N m s/rad].

    At a corner of the torque, the smaller of the two one-sided values.

    speed : sliding velocity of the driveline [rad/s], signed, not 0

    Returns inf if the brake locks itself at that speed. Raises ``InputError`` if the speed is 0
    or not a finite number.
    """
    allowed = "a finite number other than 0, the sliding velocity in rad/s; at rest the brake holds"
    if check_number("speed", speed, allowed=allowed) == 0.0:
        raise InputError(f"speed = {speed!r}: must be {allowed}.")
    at = Sliding(1 if speed > 0.0 else -1, abs(speed))
    return damping_of(system, at)


def sliding_damping(system: BrakedDriveline) -> float:
    """Smallest damping of steady sliding [N m s/rad], equal to ``stability(system).damping``."""
    both = (damping_of(system, at) for at in (steady(system, 1), steady(system, -1)) if at)
    return min(both, default=math.inf)


def damping_of(system: BrakedDriveline, at: Sliding) -> float:
    """Damping about one case of steady sliding [N m s/rad]; inf if the brake locks itself."""
    return system.driveline.damping + _torque_slope(system, system.actuation, at)


def steady(system: BrakedDriveline, direction: int) -> Sliding | None:
    """Steady sliding in one direction; None if the shaft turns in the opposite direction."""
    drive = system.driveline.drive_speed
    if drive != 0.0:
        return Sliding(direction, abs(drive)) if drive * direction > 0.0 else None
    friction = system.friction
    if isinstance(friction, SmoothFriction):
        return Sliding(direction, friction.layer(FLAT) / system.brake.radius, near_rest=True)
    return Sliding(direction, 0.0, near_rest=True)


def is_constant(friction: Friction, speed: float) -> bool:
    """Return True if friction is constant about a sliding speed [m/s] (0: near rest)."""
    steep = friction.layer(FLAT) if isinstance(friction, SmoothFriction) else 0.0
    return friction.constant and (speed == 0.0 or speed > 0.999 * steep)


def _torque_slope(system: BrakedDriveline, actuation: Actuation, at: Sliding) -> float:
    """d(R F_mu)/dv for an actuation [N m s/rad]; inf if the brake locks itself.

    With set-valued friction the smallest slope of the pieces of the torque that contain the speed.
    """
    brake, friction = system.brake, system.friction
    if isinstance(friction, SmoothFriction):
        return _slope_of_curve(system, friction, actuation, at)
    nodes = cast("SetValuedFriction", friction).nodes()
    near = piecewise_linear.CORNER * at.speed
    # The pieces depend only on the nodes on both sides of the speed.
    first, last = (
        bisect_right(nodes, (at.speed + way * near) * brake.radius, key=itemgetter(0)) + way
        for way in (-1, 1)
    )
    about = np.array(nodes[max(first, 0) : last])
    lines = np.empty(about.shape[0] + 1, dtype=piecewise_linear.LINE)
    count = piecewise_linear.half(
        brake.law, brake.shape(), brake.radius, about[:, 0] / brake.radius, about[:, 1],
        actuation.law, actuation.release_speed, float(at.direction), lines,
    )  # fmt: skip
    low, high = piecewise_linear.pieces_about(lines["start"][1:count], at.speed, near)
    offsets, slopes = (lines[name][low : high + 1] for name in ("offset", "slope"))
    slopes = at.direction * slopes
    return float(slopes.min()) if np.all(np.isfinite(offsets)) else math.inf


def _slope_of_curve(
    system: BrakedDriveline, friction: SmoothFriction, actuation: Actuation, at: Sliding
) -> float:
    """Smaller one-sided slope of the brake torque with a smooth friction law."""
    brake = system.brake
    release, near = actuation.release_speed, piecewise_linear.CORNER * at.speed
    if at.actuated - near > release:
        return 0.0

    def gain(speed: float) -> float:
        coefficient = friction.coefficient(at.direction * brake.radius * speed)
        return abs(brake.amplification(coefficient))

    here, slopes = gain(at.speed), one_sided_slopes(gain, at.speed)
    if not all(map(math.isfinite, (here, *slopes))):
        return math.inf
    rates = [actuation.slope, 0.0] if at.actuated + near >= release else [actuation.slope]
    force = actuation.force(at.actuated)
    return brake.radius * (min(rate * here for rate in rates) + force * min(slopes))


def lines_over_slope(system: BrakedDriveline, at: Sliding) -> list[DampingLine]:
    """Damping as a function of the actuation slope, while the brake is pressed.

    It is piecewise linear; the pieces end at the slopes for which the release speed equals the
    sliding speed or the end of the linear piece of the friction law there.
    """
    actuation, brake, friction = system.actuation, system.brake, system.friction
    edges = [-math.inf, math.inf]
    if actuation.release and at.actuated > 0.0:
        edges[0] = -actuation.law.initial_force / at.actuated
    if not isinstance(friction, SetValuedFriction):
        pass
    elif friction.constant:
        gain = abs(brake.amplification(at.direction * friction.reference))
        if math.isinf(gain):
            return []
        return [DampingLine(edges[0], edges[1], system.driveline.damping, brake.radius * gain)]
    elif actuation.release:
        nodes = (speed / brake.radius for speed, _ in friction.nodes())
        end = next((node for node in nodes if node > at.speed), math.inf)
        edges.insert(1, -actuation.law.initial_force / end)
    found = []
    for low, high in pairwise(edges):
        begin, end = max(low, min(high, 0.0) - 4.0), min(high, max(low, 0.0) + 4.0)
        one, other = (begin + part * (end - begin) for part in (0.25, 0.75))
        if not one < other:
            continue
        slopes = [
            _torque_slope(system, actuation.model_copy(update={"slope": slope}), at)
            for slope in (one, other)
        ]
        gradient = (slopes[1] - slopes[0]) / (other - one)
        at_zero = system.driveline.damping + slopes[0] - gradient * one
        found.append(DampingLine(low, high, at_zero, gradient))
    return found
