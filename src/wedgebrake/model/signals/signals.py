"""Signals: torques, actuation forces and speeds as functions of time.

A signal is a constant, a harmonic, a table, a ramp, orders of a speed, or a sum or product of
these. ``Table``, ``Ramp`` and ``Chirp`` are in ``signal_tables``.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from wedgebrake.arrays import FloatArray
from wedgebrake.errors import InputError
from wedgebrake.model.part import parameter
from wedgebrake.model.signals import signal_calculus as calculus
from wedgebrake.model.signals.signal_base import (
    A_SIGNAL,
    LARGEST,
    Order,
    OrSignal,
    Signal,
    SignalField,
    as_signal,
    number_of,
)
from wedgebrake.model.units import SIGNAL

__all__ = [
    "A_SIGNAL", "LARGEST", "Constant", "Exponential", "Harmonic", "OrSignal", "Order", "Orders",
    "Product", "Signal", "SignalField", "Sum", "as_signal", "check_known", "check_repeat",
    "number_of",
]  # fmt: skip


LONGEST = 2.0**40
"""Time up to which derivatives of signals are known [s]."""


class _Primitive(Signal):
    """A signal that the solvers know, at all times."""

    def primitive(self) -> Signal:
        """The signal itself."""
        return self

    @property
    def span(self) -> tuple[float, float]:
        """Always."""
        return (-math.inf, math.inf)

    def knots(self, first: float, last: float) -> FloatArray:  # noqa: ARG002 - it has none
        """No times."""
        return np.empty(0)


class Constant(_Primitive):
    """A signal that does not change."""

    kind: ClassVar[str] = "constant"

    value: float = parameter("value", symbol="u", example=300.0, ge=-LARGEST, le=LARGEST)

    if TYPE_CHECKING:

        def __init__(self, value: float) -> None: ...

    @property
    def varies(self) -> bool:
        """Always False."""
        return False

    @property
    def bound(self) -> float:
        """The magnitude of the value."""
        return abs(self.value)

    @property
    def rate(self) -> float:
        """Zero."""
        return 0.0

    def frequencies(self) -> tuple[float, ...] | None:
        """An empty tuple."""
        return ()

    def _values(self, time: FloatArray) -> FloatArray:
        return np.full_like(time, self.value)

    def _integral(self, time: FloatArray) -> FloatArray:
        return self.value * time


class Harmonic(_Primitive):
    """The sine amplitude sin(2 pi frequency t + phase)."""

    kind: ClassVar[str] = "harmonic"

    amplitude: float = parameter("amplitude", symbol="a", example=500.0, ge=-LARGEST, le=LARGEST)
    frequency: float = parameter("frequency", symbol="f", unit="Hz", example=10.03, ge=1e-9, le=1e9)
    phase: float = parameter(
        "phase", symbol="phi", unit="rad", example=0.5, default=0.0, ge=-1e6, le=1e6
    )

    if TYPE_CHECKING:

        def __init__(self, amplitude: float, frequency: float, phase: float = 0.0) -> None: ...

    @property
    def varies(self) -> bool:
        """True, unless the amplitude is zero."""
        return self.amplitude != 0.0

    @property
    def bound(self) -> float:
        """The magnitude of the amplitude."""
        return abs(self.amplitude)

    @property
    def rate(self) -> float:
        """2 pi frequency [rad/s]."""
        return 2.0 * math.pi * self.frequency

    def frequencies(self) -> tuple[float, ...] | None:
        """The frequency [Hz]."""
        return (self.frequency,) if self.varies else ()

    def _values(self, time: FloatArray) -> FloatArray:
        angle = 2.0 * math.pi * calculus.turns(self.frequency, time) + self.phase
        return np.asarray(self.amplitude * np.sin(angle))

    def _integral(self, time: FloatArray) -> FloatArray:
        # A difference of two cosines would lose digits at short times.
        half = 2.0 * math.pi * calculus.turns(0.5 * self.frequency, time)
        area = np.sin(half + self.phase) * np.sin(half) / (math.pi * self.frequency)
        return np.asarray(self.amplitude * area)


class Exponential(_Primitive):
    """The exponential value exp(growth (t - begin)), with an exponent of magnitude 700 at most.

    It is a part of a ``Ramp`` with the law "log". Beyond this exponent it is constant, so that a
    product with 0 is 0.
    """

    value: float = parameter("value at the beginning", symbol="u_0", example=80.0)
    growth: float = parameter("exponent per second", symbol="a", unit="1/s", example=0.5)
    begin: float = parameter("time at which it begins", symbol="t_0", unit="s", example=0.0)
    largest: float = parameter("largest magnitude where it is used", symbol="-", example=300.0)

    @property
    def varies(self) -> bool:
        """Always True."""
        return True

    @property
    def bound(self) -> float:
        """The largest magnitude where it is used."""
        return self.largest

    @property
    def rate(self) -> float:
        """The magnitude of the growth [1/s]."""
        return abs(self.growth)

    def frequencies(self) -> tuple[float, ...] | None:
        """None: it does not repeat."""
        return None

    def _values(self, time: FloatArray) -> FloatArray:
        exponent = self.growth * (time - self.begin)
        return np.asarray(self.value * np.exp(np.clip(exponent, -700.0, 700.0)))

    def _integral(self, time: FloatArray) -> FloatArray:
        return calculus.quadrature(self, time)


class _Combined(Signal):
    """A sum or product of signals."""

    signals: tuple[SignalField, ...] = parameter(
        "signals to combine", unit="-", example=[300.0, 20.0], min_length=1, max_length=10_000,
        strict=False,
    )  # fmt: skip

    def primitive(self) -> Signal:
        """The same combination of the primitive signals."""
        return type(self)(signals=tuple(one.primitive() for one in self.signals))

    @property
    def span(self) -> tuple[float, float]:
        """First and last time for which all signals are known [s]."""
        spans = [one.span for one in self.signals]
        return (max(first for first, _ in spans), min(last for _, last in spans))

    def knots(self, first: float, last: float) -> FloatArray:
        """Times in (first, last) at which one of the signals is not analytic [s]."""
        return np.unique(np.concatenate([one.knots(first, last) for one in self.signals]))

    def frequencies(self) -> tuple[float, ...] | None:
        """Frequencies of all signals [Hz]; None if one of them is not periodic."""
        if not self.varies:
            return ()
        parts = [one.frequencies() for one in self.signals]
        known = [part for part in parts if part is not None]
        return (
            None if len(known) < len(parts) else tuple(sorted({f for part in known for f in part}))
        )


class Sum(_Combined):
    """Sum of signals."""

    kind: ClassVar[str] = "sum"

    @property
    def varies(self) -> bool:
        """True if one of the signals varies."""
        return any(one.varies for one in self.signals)

    @property
    def bound(self) -> float:
        """Sum of the bounds."""
        return sum(one.bound for one in self.signals)

    @property
    def rate(self) -> float:
        """The largest of the rates [rad/s]."""
        return max(one.rate for one in self.signals)

    def _values(self, time: FloatArray) -> FloatArray:
        return np.asarray(np.sum([one._values(time) for one in self.signals], axis=0))

    def _integral(self, time: FloatArray) -> FloatArray:
        return np.asarray(np.sum([one._integral(time) for one in self.signals], axis=0))


class Product(_Combined):
    """Product of signals."""

    kind: ClassVar[str] = "product"

    def __neg__(self) -> Signal:
        """The signal of which this is the negative, or its negative."""
        first, *others = self.signals
        if len(others) == 1 and not first.varies and float(first(0.0)) == -1.0:
            return others[0]
        return super().__neg__()

    @property
    def varies(self) -> bool:
        """True if one of the signals varies and none is zero."""
        return any(one.varies for one in self.signals) and self.bound != 0.0

    @property
    def bound(self) -> float:
        """Product of the bounds."""
        return math.prod(one.bound for one in self.signals)

    @property
    def rate(self) -> float:
        """Sum of the rates [rad/s]."""
        return sum(one.rate for one in self.signals)

    def _values(self, time: FloatArray) -> FloatArray:
        return np.asarray(np.prod([one._values(time) for one in self.signals], axis=0))

    def _integral(self, time: FloatArray) -> FloatArray:
        factor = 1.0
        varying = []
        for one in self.signals:
            value = number_of(one)
            if value is None:
                varying.append(one)
            else:
                factor *= value
        if factor == 0.0 or not varying:
            return factor * time
        if len(varying) == 1:
            return factor * varying[0]._integral(time)
        return factor * calculus.quadrature(Product(signals=tuple(varying)), time)


class Orders(Signal):
    """Sum of amplitude sin(order theta + phase), where theta is the integral of a speed.

    The integral begins at time 0. Where the speed is 0, theta and with it the sum keep their value:
    a torque whose speed has come to 0 remains at its last value.

    speed  : a number or a signal [rad/s]
    orders : (order, amplitude, phase [rad]) of each term; an order may be a fraction
    """

    kind: ClassVar[str] = "orders"

    speed: SignalField = parameter(
        "speed that the orders follow [rad/s]", symbol="omega", unit="rad/s", example=100.0
    )
    orders: tuple[Order, ...] = parameter(
        "(order, amplitude, phase [rad]) of each term", unit="-", example=[[2.0, 1.0, 0.0]],
        columns=("1", SIGNAL, "rad"), min_length=1, max_length=10_000, strict=False,
    )  # fmt: skip

    if TYPE_CHECKING:

        def __init__(self, speed: Signal | float, orders: Sequence[Sequence[float]]) -> None: ...

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


class Integral(Signal):
    """The integral of a speed from time 0 on, which is the angle that ``Orders`` follow.

    It occurs in derivatives of signals only.
    """

    speed: SignalField = parameter(
        "speed that is integrated [rad/s]", symbol="omega", unit="rad/s", example=100.0
    )

    def primitive(self) -> Signal:
        """The integral of the primitive speed."""
        return Integral(speed=self.speed.primitive())

    @property
    def span(self) -> tuple[float, float]:
        """The span of the speed."""
        return self.speed.span

    @property
    def varies(self) -> bool:
        """True, unless the speed is zero."""
        return self.speed.bound > 0.0

    @property
    def bound(self) -> float:
        """A bound at times up to ``LONGEST``."""
        return self.speed.bound * LONGEST

    @property
    def rate(self) -> float:
        """The rate of the speed [rad/s]."""
        return self.speed.rate

    def frequencies(self) -> tuple[float, ...] | None:
        """None: it does not repeat."""
        return None

    def knots(self, first: float, last: float) -> FloatArray:
        """The knots of the speed [s]."""
        return self.speed.knots(first, last)

    def _values(self, time: FloatArray) -> FloatArray:
        return np.asarray(self.speed.integral(time))

    def _integral(self, time: FloatArray) -> FloatArray:
        return calculus.quadrature(self, time)


def order_values(angle: FloatArray, orders: Sequence[Order]) -> FloatArray:
    """Sum of amplitude sin(order angle + phase) at an array of angles [rad]."""
    terms = [size * np.sin(n * angle + phase) for n, size, phase in orders]
    return np.asarray(np.sum(terms, axis=0))


def check_repeat(signals: Mapping[str, Signal]) -> None:
    """Raise ``InputError`` if one of the named signals neither repeats nor is constant."""
    for name, signal in signals.items():
        if signal.frequencies() is None:
            raise InputError(
                f"{name} = {type(signal).__name__}: must be constant or repeat, as the class of a"
                " motion is that of its steady state. Use wb.simulate, or a periodic signal.",
                name=name, value=signal, allowed="a constant or a signal that repeats",
            )  # fmt: skip


def check_known(signals: Mapping[str, Signal], first: float, last: float) -> None:
    """Raise ``InputError`` unless the named signals are known from first to last [s].

    ``value`` of the error is the time at which the signal is unknown.
    """
    for name, signal in signals.items():
        begin, end = signal.span
        for time, limit, run, table in (
            (first, begin, "begins at", "begins at"),
            (last, end, "goes to", "ends at"),
        ):
            if begin <= time <= end:
                continue
            digits = next(n for n in (9, 17) if f"{time:.{n}g}" != f"{limit:.{n}g}")
            raise InputError(
                f"{name}: the run {run} {time:.{digits}g} s, the signal {table}"
                f" {limit:.{digits}g} s. Shorten the run, or continue the table with after='hold',"
                " after='zero' or periodic=True.",
                name=name, value=time, allowed=f"in [{begin:.17g}, {end:.17g}] s",
            )  # fmt: skip
