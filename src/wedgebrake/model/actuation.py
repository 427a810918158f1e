"""The actuation force and its control law (eq. 3)."""

from __future__ import annotations

from typing import ClassVar

from wedgebrake.dynamics import actuator
from wedgebrake.dynamics.actuator import Actuator
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

    @property
    def law(self) -> Actuator:
        """The numbers of the law, as the kernels take them."""
        return Actuator(self.initial_force, self.slope, self.release)

    def force(self, speed: float) -> float:
        """Actuation force [N] at the sliding speed |v| [rad/s]."""
        return actuator.force(self.law, abs(speed))

    @property
    def release_speed(self) -> float:
        """Speed beyond which the brake is released [rad/s]; inf if there is none."""
        return actuator.release_speed(self.law)
