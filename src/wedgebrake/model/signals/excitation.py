"""The torque on the driveline."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, ClassVar

import numpy as np
from pydantic import field_validator

from wedgebrake.arrays import FloatArray
from wedgebrake.model.part import SMALLEST, parameter
from wedgebrake.model.signals import signal_calculus as calculus
from wedgebrake.model.signals.signals import Constant, Harmonic, Order, Signal, Sum
from wedgebrake.model.validation import NotAllowedError


class HarmonicTorque(Signal):
    """T(t) = amplitude [sin(2 pi frequency t) + sum of r sin(n 2 pi frequency t + phase)].

    The frequency also fixes the period of Poincare sections if the amplitude is zero.

    orders : (n, r, phase [rad]) of each further order: its number, which may be a fraction, its
             amplitude relative to the first order, and its phase
    """

    table: ClassVar[str] = "excitation"
    kind: ClassVar[str] = "harmonic_torque"
    later: ClassVar[frozenset[str]] = frozenset(("orders",))

    amplitude: float = parameter(
        "torque amplitude T_e", symbol="T_e", unit="N m", example=500.0, ge=0, le=1e15
    )
    frequency: float = parameter(
        "torque frequency f_e", symbol="f_e", unit="Hz", example=10.03, gt=0, ge=1e-9, le=1e9
    )
    orders: tuple[Order, ...] = parameter(
        "(order, relative amplitude, phase [rad]) of each further order", unit="-",
        columns=("1", "1", "rad"),
        example=[[2.0, 0.5, 0.0]], default=(), max_length=10_000, strict=False,
    )  # fmt: skip

    if TYPE_CHECKING:

        def __init__(
            self, amplitude: float, frequency: float, orders: Sequence[Sequence[float]] = ()
        ) -> None: ...

    @field_validator("orders")
    @classmethod
    def _not_low(cls, value: tuple[Order, ...]) -> tuple[Order, ...]:
        if any(row[0] < 1e-6 for row in value):
            raise NotAllowedError("rows with orders of at least 1e-6")
        return value

    def primitive(self) -> Signal:
        """The sine, or the sum of all orders; none of an amplitude that has no effect."""
        if abs(self.amplitude) < SMALLEST:
            return Constant(0.0)
        first = Harmonic(self.amplitude, self.frequency)
        if not self.orders:
            return first
        others = (
            Harmonic(self.amplitude * share, n * self.frequency, phase)
            for n, share, phase in self.orders
        )
        return Sum(signals=(first, *others))

    def torque(self, time: FloatArray) -> FloatArray:
        """Torque T [N m] at an array of ``time`` [s]."""
        if self.orders:
            return self(time)
        return np.asarray(self.amplitude * np.sin(self.angular_frequency * time))

    @property
    def angular_frequency(self) -> float:
        """2 pi f_e [rad/s]."""
        return 2.0 * math.pi * self.frequency

    @property
    def period(self) -> float | None:
        """The period 1/f_e or the common period of all orders [s]; None if there is none.

        It does not depend on the amplitude, which may be zero.
        """
        if not self.orders:
            return 1.0 / self.frequency
        others = (n * self.frequency for n, share, _ in self.orders if share != 0.0)
        return calculus.common_period((self.frequency, *others))
