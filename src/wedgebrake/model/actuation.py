"""The actuation force and its control law (eq. 3)."""

from __future__ import annotations

import math
from typing import ClassVar

from wedgebrake.model.part import Member, parameter


class Actuation(Member):
    """F_a = F_a0 + slope |v|  (eq. 3), and never negative where ``release`` is on.

    A brake pushed by a negative force has lost contact. ``release=False`` is the law as
    the paper prints it, with which every case of its section 4 below eta = -6 diverges.
    """

    table: ClassVar[str] = "actuation"

    initial_force: float = parameter(
        "actuation force at rest F_a0", symbol="F_a0", unit="N", example=300.0, ge=0, le=1e12
    )
    slope: float = parameter(
        "slope of the actuation force against speed", symbol="delta", unit="N s/rad",
        example=-40.0, default=0.0, ge=-1e12, le=1e12,
    )  # fmt: skip
    release: bool = parameter(
        "whether a force below zero releases the brake", symbol="-", unit="1", example=True,
        default=True,
    )  # fmt: skip

    def force(self, speed: float) -> float:
        """Actuation force [N] at the sliding speed |v| [rad/s]."""
        value = self.initial_force + self.slope * abs(speed)
        return max(value, 0.0) if self.release else value

    @property
    def release_speed(self) -> float:
        """Speed beyond which the brake is released [rad/s]; inf if there is none."""
        if not self.release or self.slope >= 0.0:
            return math.inf
        return self.initial_force / -self.slope
