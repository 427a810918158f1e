"""Signals: torques, actuation forces and speeds as functions of time.

A signal is a constant, a harmonic, a table, a ramp, orders of a speed, or a sum or product of
these. ``Table`` and ``Ramp`` are in ``signal_tables``, ``Orders`` in ``signal_orders``.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from wedgebrake.model import signal_calculus as calculus
from wedgebrake.model.part import parameter
from wedgebrake.model.signal_base import (
    A_SIGNAL,
    LARGEST,
    OrSignal,
    Signal,
    SignalField,
    as_signal,
    number_of,
)
from wedgebrake.model.signal_calculus import FloatArray

__all__ = [
    "A_SIGNAL", "LARGEST", "Constant", "Harmonic", "OrSignal", "Product", "Signal", "SignalField",
    "Sum", "as_signal", "number_of",
]  # fmt: skip


class _Primitive(Signal):
    """A signal that the solvers know, at all times."""

    def primitive(self) -> Signal:
        """The signal itself."""
        return self

    @property
    def span(self) -> tuple[float, float]:
        """Always."""
        return (-math.inf, math.inf)


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

    def knots(self, first: float, last: float) -> FloatArray:  # noqa: ARG002 - it has none
        """No times."""
        return np.empty(0)

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

    def knots(self, first: float, last: float) -> FloatArray:  # noqa: ARG002 - it has none
        """No times."""
        return np.empty(0)

    def _values(self, time: FloatArray) -> FloatArray:
        angle = 2.0 * math.pi * calculus.turns(self.frequency, time) + self.phase
        return np.asarray(self.amplitude * np.sin(angle))

    def _integral(self, time: FloatArray) -> FloatArray:
        # A difference of two cosines would lose digits at short times.
        half = 2.0 * math.pi * calculus.turns(0.5 * self.frequency, time)
        area = np.sin(half + self.phase) * np.sin(half) / (math.pi * self.frequency)
        return np.asarray(self.amplitude * area)


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
