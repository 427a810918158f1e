"""Brakes. They differ in one signed function, the amplification g.

The brake turns the actuation force F_a into the friction force F_mu = F_a g(m), with
m = mu sign(v) the signed friction coefficient. To add a brake, write one class that states

- its parameters, among them ``radius``, and ``kind``, its name in study files;
- ``shape()``: the numbers that its law needs;
- ``law(m, shape)``: g(m), with ``math`` functions only (it is compiled for the smooth
  solver), returning ``math.inf`` where the brake locks itself and cannot slide.

If g follows from one balance of forces or moments, derive the brake from ``LeverBrake`` and
state the arms alone: smoothed friction is then solved several times as fast.
"""

from __future__ import annotations

import math
from abc import abstractmethod
from collections.abc import Sequence
from typing import ClassVar, Self

from pydantic import model_validator

from wedgebrake.errors import InputError
from wedgebrake.model.part import Chosen, parameter


class Brake(Chosen):
    """A brake: an amplification g and a radius."""

    table: ClassVar[str] = "brake"
    kinds: ClassVar[dict[str, type[Brake]]] = {}
    schematic: ClassVar[str] = ""
    """Drawing of the brake on the explorer's page; empty: a plain block with its kind."""

    radius: float = parameter(
        "equivalent radius R of the friction force", symbol="R", unit="m", example=0.2,
        gt=0, le=1e3,
    )  # fmt: skip

    def shape(self) -> tuple[float, ...]:
        """The numbers that ``law`` needs, in its order."""
        return ()

    @staticmethod
    @abstractmethod
    def law(m: float, shape: Sequence[float]) -> float:
        """Amplification g(m) at the signed friction coefficient m; inf where it locks.

        shape : what ``shape()`` gives
        m     : [1]
        """

    @model_validator(mode="after")
    def _brakes(self) -> Self:
        try:
            for m in (-0.1, 0.0, 0.1):
                self.amplification(m)
        except (ArithmeticError, LookupError):
            pass  # a law that cannot be evaluated raises where it is used
        return self

    def amplification(self, m: float) -> float:
        """F_mu/F_a at the signed friction coefficient m [1]; inf where the brake locks.

        Raises ``InputError`` if it has not the sign of m.
        """
        factor = self.law(float(m), self.shape())
        if not (factor * m >= 0.0 if m != 0.0 else factor == 0.0):
            name, allowed = f"{self.table}.law", "a number with the sign of m, 0 for m = 0"
            raise InputError(
                f"{name}: law({m!r}, shape) of {type(self).__name__} is {factor!r}: must be"
                f" {allowed}. The friction force opposes sliding; return inf where the brake locks"
                " itself.",
                name=name, value=factor, allowed=allowed,
            )  # fmt: skip
        return factor

    def locks(self, m: float) -> bool:
        """Return True if the brake cannot slide at the signed friction coefficient m."""
        return math.isinf(self.amplification(m))


# Relative differences of the arms below this value are rounding, as of tan(atan(mu)) from mu.
_GAP = 2.0**-50


class LeverBrake(Brake):
    """A normal force from a balance of moments or forces: g(m) = m a/(b - m d).

    The actuation force acts at the arm a, the normal force at b, the friction force at d,
    which ``shape`` states. It locks itself where m d >= b.
    """

    @abstractmethod
    def shape(self) -> tuple[float, float, float]:
        """The three arms a, b > 0 and d, in one unit."""

    @staticmethod
    def law(m: float, shape: Sequence[float]) -> float:
        """Amplification g(m) = m a/(b - m d)."""
        gap = shape[1] - m * shape[2]
        return m * shape[0] / gap if gap > _GAP * shape[1] else math.inf


class ConventionalBrake(LeverBrake):
    """The actuation force presses directly: g(m) = m  (eq. 22)."""

    kind: ClassVar[str] = "conventional"
    schematic: ClassVar[str] = "conventional"

    def shape(self) -> tuple[float, float, float]:
        """No arm of the friction force."""
        return (1.0, 1.0, 0.0)


class WedgeBrake(LeverBrake):
    """A wedge pressed along its short side: g(m) = m/(tan(angle) - m)  (eqs. 2, 4, 5).

    It locks itself, forwards, where tan(angle) <= mu.
    """

    kind: ClassVar[str] = "wedge"
    schematic: ClassVar[str] = "wedge"

    angle: float = parameter(
        "wedge angle", symbol="alpha_w", unit="rad", example=0.34, gt=0, lt=math.pi / 2
    )

    def shape(self) -> tuple[float, float, float]:
        """The balance of forces along the wedge: tan(angle) for the normal force."""
        return (1.0, math.tan(self.angle), 1.0)


class BandBrake(Brake):
    """A band round a drum, pulled at its slack end: g(m) = exp(m wrap_angle) - 1.

    The capstan equation; it amplifies but never locks.
    """

    kind: ClassVar[str] = "band"
    schematic: ClassVar[str] = "band"

    wrap_angle: float = parameter(
        "wrap angle of the band", symbol="beta", unit="rad", example=4.0, gt=0, le=100
    )

    def shape(self) -> tuple[float, ...]:
        """The wrap angle."""
        return (self.wrap_angle,)

    @staticmethod
    def law(m: float, shape: Sequence[float]) -> float:
        """Amplification g(m) = exp(m wrap_angle) - 1."""
        return math.expm1(m * shape[0])


class LeadingShoeBrake(LeverBrake):
    """A pivoted shoe led by the drum: g(m) = m a/(b - m d).

    Moments about the pivot: the actuation acts at the arm ``a``, the normal force at ``b``,
    the friction force at ``d``. It locks itself where m d >= b.
    """

    kind: ClassVar[str] = "leading-shoe"
    schematic: ClassVar[str] = "leading-shoe"

    actuation_arm: float = parameter(
        "arm of the actuation force", symbol="a", unit="m", example=0.2, gt=0, le=1e3
    )
    normal_arm: float = parameter(
        "arm of the normal force", symbol="b", unit="m", example=0.1, gt=0, le=1e3
    )
    friction_arm: float = parameter(
        "arm of the friction force", symbol="d", unit="m", example=0.08, ge=0, le=1e3
    )

    def shape(self) -> tuple[float, float, float]:
        """The three arms a, b, d."""
        return (self.actuation_arm, self.normal_arm, self.friction_arm)
