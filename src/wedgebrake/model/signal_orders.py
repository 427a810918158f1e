"""Signals whose frequencies are proportional to a speed: the orders of an engine or a gear."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, ClassVar

import numpy as np
from pydantic import Field, field_validator

from wedgebrake.model import signal_calculus as calculus
from wedgebrake.model.signal_calculus import FloatArray
from wedgebrake.model.signals import LARGEST, Signal, SignalField, number_of
from wedgebrake.model.validation import shown

Order = tuple[float, float, float]


class Orders(Signal):
    """Sum of amplitude sin(order theta + phase), where theta is the integral of a speed.

    The integral begins at time 0.

    speed  : a number or a signal [rad/s]
    orders : (order, amplitude, phase [rad]) of each term; an order may be a fraction
    """

    kind: ClassVar[str] = "orders"

    speed: SignalField = Field(
        description="speed that the orders follow [rad/s]",
        json_schema_extra={"symbol": "omega", "unit": "rad/s", "example": 100.0},
    )
    orders: tuple[Order, ...] = Field(
        description="(order, amplitude, phase [rad]) of each term", min_length=1, max_length=10_000,
        json_schema_extra={"symbol": "-", "unit": "-", "example": [[2.0, 1.0, 0.0]]}, strict=False,
    )  # fmt: skip

    if TYPE_CHECKING:

        def __init__(self, speed: Signal | float, orders: Sequence[Sequence[float]]) -> None: ...

    @field_validator("orders", mode="before")
    @classmethod
    def _tuples(cls, value: object) -> object:
        return checked_orders(value)

    def primitive(self) -> Signal:
        """The same orders of the primitive speed."""
        return Orders(self.speed.primitive(), self.orders)

    @property
    def span(self) -> tuple[float, float]:
        """The span of the speed."""
        return self.speed.span

    @property
    def varies(self) -> bool:
        """True, unless the speed or all orders or amplitudes are zero."""
        return self.speed.bound > 0.0 and any(
            n != 0.0 and size != 0.0 for n, size, _ in self.orders
        )

    @property
    def bound(self) -> float:
        """Sum of the magnitudes of the amplitudes."""
        return sum(abs(size) for _, size, _ in self.orders)

    @property
    def rate(self) -> float:
        """The highest order times a bound on the speed, and the rate of the speed [rad/s]."""
        return self.speed.rate + self.speed.bound * max(abs(n) for n, _, _ in self.orders)

    def frequencies(self) -> tuple[float, ...] | None:
        """Frequencies of the speed, and of each order at the mean speed [Hz]."""
        if not self.varies:
            return ()
        speed = number_of(self.speed)
        period = self.speed.period
        if speed is not None:
            own: tuple[float, ...] = ()
        elif period:
            own = (1.0 / period,)
            speed = float(self.speed.integral(period)) / period
        else:
            return None
        mean = abs(speed) / (2.0 * math.pi)
        each = (abs(n) * mean for n, size, _ in self.orders if size != 0.0)
        return tuple(sorted({*own, *(one for one in each if one > 0.0)}))

    def knots(self, first: float, last: float) -> FloatArray:
        """The knots of the speed [s]."""
        return self.speed.knots(first, last)

    def _values(self, time: FloatArray) -> FloatArray:
        return order_values(self.speed.integral(time), self.orders)

    def _integral(self, time: FloatArray) -> FloatArray:
        return calculus.quadrature(self, time)


def order_values(angle: FloatArray, orders: Sequence[Order]) -> FloatArray:
    """Sum of amplitude sin(order angle + phase) at an array of angles [rad]."""
    terms = [size * np.sin(n * angle + phase) for n, size, phase in orders]
    return np.asarray(np.sum(terms, axis=0))


def checked_orders(value: object) -> object:
    """Orders as tuples; raises ``ValueError`` for values out of range."""
    if isinstance(value, np.ndarray):
        value = value.tolist()
    if not isinstance(value, list | tuple):
        return value
    rows = tuple(tuple(one) if isinstance(one, list) else one for one in value)
    for row in rows:
        if not isinstance(row, tuple) or len(row) != 3:
            raise ValueError("must be a list of (order, amplitude, phase).")
        for one, most in zip(row, (1e6, LARGEST, 1e6), strict=True):
            if isinstance(one, float) and abs(one) > most:
                raise ValueError(f"must have orders and phases up to 1e6, not {shown(row)}.")
    return rows
