"""Brake torque against sliding velocity: all that the exact solver sees of a brake."""

from __future__ import annotations

import math
from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from wedgebrake.arrays import FloatArray
from wedgebrake.dynamics import piecewise_linear
from wedgebrake.errors import InputError
from wedgebrake.model.actuation import Actuation
from wedgebrake.model.brakes import Brake
from wedgebrake.model.friction import Friction, SetValuedFriction, SmoothFriction


@dataclass(frozen=True, eq=False)
class Characteristic:
    """A piecewise-linear brake torque with an interval at rest.

    Between two neighbouring breakpoints the torque is ``offset + slope * v``; it is
    continuous everywhere but at v = 0, where it may take any value in ``holding``.

    breakpoints : (n-1,) sliding velocities [rad/s], ascending, one of them 0
    slopes      : (n,) [N m s/rad]
    offsets     : (n,) [N m]; infinite where no sliding is possible (self-locking)
    holding     : (lower, upper) torque that the brake holds at rest [N m], may be infinite

    Raises ``InputError`` where these do not fit together.
    """

    breakpoints: FloatArray
    slopes: FloatArray
    offsets: FloatArray
    holding: tuple[float, float]

    def __post_init__(self) -> None:
        for name in ("breakpoints", "slopes", "offsets"):
            values = np.array(getattr(self, name), dtype=float)
            values.setflags(write=False)
            object.__setattr__(self, name, values)
        n = self.slopes.size
        if self.offsets.size != n or self.breakpoints.size != n - 1:
            raise InputError(
                f"characteristic: {n} slopes, {self.offsets.size} offsets and"
                f" {self.breakpoints.size} breakpoints: must be n, n and n - 1."
            )
        if np.any(np.diff(self.breakpoints) <= 0.0) or 0.0 not in self.breakpoints:
            raise InputError.of(
                "characteristic.breakpoints", self.breakpoints.tolist(), "must ascend and contain"
                " 0, the velocity of rest.",
            )  # fmt: skip
        for i, v in enumerate(self.breakpoints):
            left = self.offsets[i] + self.slopes[i] * v
            right = self.offsets[i + 1] + self.slopes[i + 1] * v
            scale = abs(self.offsets[i]) + abs(self.offsets[i + 1]) + abs(left) + 1e-300
            if v != 0.0:
                both = math.isfinite(left) and math.isfinite(right)
                if both and abs(left - right) > 1e-9 * scale:
                    raise InputError(
                        f"characteristic: torque jumps from {left:g} to {right:g} N m at"
                        f" {v:g} rad/s: must be continuous except at 0."
                    )
                continue
            lower, upper = self.holding
            room = 1e-12 * scale
            if not (lower <= left + room and right <= upper + room and lower <= upper):
                raise InputError.of(
                    "characteristic.holding", (lower, upper), "must contain the torque on both"
                    f" sides of rest, {left:g} and {right:g} N m.",
                    said=f"({lower:g}, {upper:g}) N m",
                )  # fmt: skip

    @property
    def first_forward(self) -> int:
        """Index of the piece just above rest."""
        return int(np.searchsorted(self.breakpoints, 0.0)) + 1

    def piece(self, velocity: ArrayLike) -> NDArray[np.intp]:
        """Index of the piece at each sliding velocity [rad/s]; on a breakpoint, the lower."""
        return np.searchsorted(self.breakpoints, np.asarray(velocity, dtype=float), side="left")

    def torque(self, velocity: ArrayLike) -> FloatArray:
        """Torque [N m] at each sliding velocity [rad/s] other than 0; nan at 0."""
        v = np.asarray(velocity, dtype=float)
        index = self.piece(v)
        value = self.offsets[index] + self.slopes[index] * v
        return np.where(v == 0.0, np.nan, value)


def characteristic(
    brake: Brake, friction: SetValuedFriction, actuation: Actuation
) -> Characteristic:
    """Torque R F_a(|v|) g(m) of a brake with set-valued friction (eqs. 3 to 5, 22).

    Exact for Coulomb friction. For a table of coefficients, linear in torque between the
    points of the table and the release speed.
    """
    speeds = np.array([speed / brake.radius for speed, _ in friction.nodes()])
    coefficients = np.array([m for _, m in friction.nodes()])
    halves = []
    for side in (-1.0, 1.0):
        # Plain objects: an attribute of a record of NumPy takes ten times as long.
        lines: Any = [SimpleNamespace() for _ in range(speeds.size + 1)]
        count = piecewise_linear.half(
            brake.law, brake.shape(), brake.radius, speeds, coefficients, actuation.law,
            actuation.release_speed, side, lines,
        )  # fmt: skip
        halves.append(lines[:count])
    backward, forward = halves[0][::-1], halves[1]
    holding = [
        float(
            piecewise_linear.holding(
                brake.law, brake.shape(), brake.radius, friction.breakaway, actuation.law, side
            )
        )
        for side in (-1.0, 1.0)
    ]
    return Characteristic(
        breakpoints=np.array([-one.start for one in backward[:-1]] + [o.start for o in forward]),
        slopes=np.array([-one.slope for one in backward] + [one.slope for one in forward]),
        offsets=np.array([one.offset for one in backward + forward]),
        holding=(holding[0], holding[1]),
    )


def has_straight_lines(name: str, friction: Friction, actuation: Actuation, instead: str) -> bool:
    """Return True if friction varies with the speed, so that the method exact needs straight lines.

    name    : of the contact
    instead : name of the method that takes any friction

    Raises ``InputError`` for friction that the method exact does not support.
    """
    if isinstance(friction, SmoothFriction):
        raise InputError(
            f"{name}.friction = {type(friction).__name__}: is a smooth law, which"
            f" the method 'exact' cannot solve. Use method={instead!r}, or CoulombFriction.",
            name="method", value="exact", allowed=repr(instead),
        )  # fmt: skip
    if friction.constant or not isinstance(friction, SetValuedFriction):
        return False
    if not (friction.has_nodes and actuation.straight):
        raise InputError(
            f"{name}.friction = {type(friction).__name__}: varies with the sliding speed,"
            " so that the method 'exact' needs a law with straight lines, nodes(), and an actuation"
            " force that depends on this speed alone, without lag, limits, sampling or a signal"
            " that varies, and that is not below zero at rest and above it at higher speeds. Use"
            f" method={instead!r}, or CoulombFriction.",
            name=f"{name}.friction", value=type(friction).__name__,
            allowed="a law with nodes(), and a force that depends on the sliding speed alone",
        )  # fmt: skip
    # A force at its lower limit at all speeds acts as with Coulomb friction.
    return not actuation.begins_released
