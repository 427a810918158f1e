"""Signals: torques, actuation forces and speeds as functions of time.

A signal is a constant, a sine, a table, a ramp, a sum of orders of a speed, or a sum or product of
these. ``Table`` and ``Ramp`` are in ``signal_tables``, ``Orders`` in ``signal_orders``.
"""

from __future__ import annotations

import math
from abc import abstractmethod
from typing import TYPE_CHECKING, Annotated, Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike
from pydantic import BeforeValidator, Field, GetCoreSchemaHandler, SerializeAsAny
from pydantic_core import CoreSchema, core_schema

from wedgebrake.model import signal_calculus as calculus
from wedgebrake.model.part import Chosen, Positional, parameter
from wedgebrake.model.signal_calculus import FloatArray
from wedgebrake.model.validation import is_number, plain, wrong

LARGEST = 1e15
"""Largest magnitude of the values of a signal."""
_ALLOWED = "a number or a signal, for example wb.Harmonic(500.0, 10.03)"


class Signal(Positional, Chosen):
    """A function of time, in the unit of what it drives.

    Signals and numbers can be added, subtracted and multiplied. To add a kind of signal, write a
    class that states

    - its parameters, and ``kind``, its name in study files;
    - ``primitive()``: the same signal made of ``Constant``, ``Harmonic``, ``Table``, ``Orders``,
      ``Sum`` and ``Product`` alone.

    Its values, integral, derivative, period and series follow from that.
    """

    table: ClassVar[str] = "signal"
    kinds: ClassVar[dict[str, type[Signal]]] = {}
    # NumPy leaves the product of a scalar of its own and a signal to the signal.
    __array_ufunc__: ClassVar[None] = None

    @abstractmethod
    def primitive(self) -> Signal:
        """The signal made of the kinds that the solver knows."""

    def __call__(self, time: ArrayLike) -> FloatArray:
        """Values at an array of times [s]; after the jump at the time of a jump.

        Raises ``InputError`` for a time at which the signal is not known.
        """
        return self._values(self._known(time))

    def integral(self, time: ArrayLike) -> FloatArray:
        """Integral from time 0 to an array of times [s].

        Raises ``InputError`` if the signal is not known all the way from time 0.
        """
        self._known(0.0)
        return self._integral(self._known(time))

    def derivative(self) -> Signal:
        """The rate of change per second, between the jumps."""
        return self.primitive().derivative()

    @property
    def span(self) -> tuple[float, float]:
        """First and last time for which the signal is known [s]; -inf and inf if always."""
        return self.primitive().span

    @property
    def varies(self) -> bool:
        """Return True if the signal changes in time."""
        return self.primitive().varies

    @property
    def period(self) -> float | None:
        """The period [s]; None if the signal has none, 0 if it does not vary.

        Parts of a signal have a common period where the ratios of their frequencies are fractions
        with denominators up to 64.
        """
        return calculus.common_period(self.frequencies())

    @property
    def bound(self) -> float:
        """A bound on the magnitude of the values."""
        return self.primitive().bound

    @property
    def rate(self) -> float:
        """A bound on the angular frequencies between the knots [rad/s]."""
        return self.primitive().rate

    def frequencies(self) -> tuple[float, ...] | None:
        """Frequencies that the signal is made of [Hz]; None where it does not repeat."""
        return self.primitive().frequencies()

    def knots(self, first: float, last: float) -> FloatArray:
        """Times in (first, last) at which the signal is not analytic [s], ascending."""
        return self.primitive().knots(first, last)

    def __add__(self, other: Signal | float) -> Signal:
        return _joined(Sum, self, other)

    def __radd__(self, other: Signal | float) -> Signal:
        return _joined(Sum, other, self)

    def __mul__(self, other: Signal | float) -> Signal:
        return _joined(Product, self, other)

    def __rmul__(self, other: Signal | float) -> Signal:
        return _joined(Product, other, self)

    def __neg__(self) -> Signal:
        return _joined(Product, -1.0, self)

    def __sub__(self, other: Signal | float) -> Signal:
        return _joined(Sum, self, _joined(Product, -1.0, other))

    def __rsub__(self, other: Signal | float) -> Signal:
        return _joined(Sum, other, -self)

    def _values(self, time: FloatArray) -> FloatArray:
        """``__call__`` for known times."""
        return self.primitive()._values(time)

    def _integral(self, time: FloatArray) -> FloatArray:
        """``integral`` for known times."""
        return self.primitive()._integral(time)

    def _known(self, time: ArrayLike) -> FloatArray:
        """Times as an array, in the span; beyond it by rounding alone they move to its end."""
        times = np.asarray(time, dtype=float)
        first, last = self.span
        if math.isinf(first) and math.isinf(last):
            return times
        inside: FloatArray = np.clip(times, first, last)
        beyond = np.abs(times - inside) > 1e-12 * np.maximum(np.abs(times), np.abs(inside))
        if np.any(beyond):
            raise wrong(
                "time", float(times[beyond].flat[0]), f"in [{first:.17g}, {last:.17g}] s",
                f"The {type(self).__name__} is known there alone; let a table go on with"
                " after='hold' or after='zero', or repeat it with periodic=True.",
            )  # fmt: skip
        return inside


def as_signal(value: Any) -> Any:
    """Convert a number to a constant signal; return a signal as it is.

    Raises ``ValueError`` for anything else.
    """
    if is_number(value):
        return Constant(value=plain(value))
    if not isinstance(value, Signal):
        raise ValueError(f"must be {_ALLOWED}.")
    return value


def number_of(value: float | Signal) -> float | None:
    """The value of a number, or of a signal that does not vary; None for one that varies."""
    if not isinstance(value, Signal):
        return value
    return None if value.varies else float(value(max(0.0, value.span[0])))


def _joined(kind: type[Sum | Product], first: Any, second: Any) -> Signal:
    """Sum or product; those of sums are one sum."""
    parts: tuple[Signal, ...] = ()
    for one in (first, second):
        if not isinstance(one, Signal) and not is_number(plain(one)):
            return NotImplemented  # type: ignore[no-any-return]
        parts += one.signals if type(one) is kind else (as_signal(one),)
    return kind(signals=parts)


SignalField = Annotated[SerializeAsAny[Signal], BeforeValidator(as_signal)]
"""Annotation of a field that holds a signal; numbers are converted."""


class OrSignal:
    """Annotation of a field that holds a number in a range, or a signal; numbers stay numbers."""

    def __init__(self, ge: float = -LARGEST, le: float = LARGEST) -> None:
        self.ge, self.le = ge, le

    def __get_pydantic_core_schema__(self, _: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        number = handler.generate_schema(Annotated[float, Field(ge=self.ge, le=self.le)])
        return core_schema.no_info_wrap_validator_function(
            lambda value, check: value if isinstance(value, Signal) else check(value),
            number,
            serialization=core_schema.plain_serializer_function_ser_schema(
                lambda value: value.model_dump() if isinstance(value, Signal) else value
            ),
        )


class Constant(Signal):
    """A signal that does not change."""

    kind: ClassVar[str] = "constant"

    value: float = parameter("value", symbol="u", example=300.0, ge=-LARGEST, le=LARGEST)

    if TYPE_CHECKING:

        def __init__(self, value: float) -> None: ...

    def primitive(self) -> Signal:
        """The signal itself."""
        return self

    def derivative(self) -> Signal:
        """Zero."""
        return Constant(value=0.0)

    @property
    def span(self) -> tuple[float, float]:
        """Always."""
        return (-math.inf, math.inf)

    @property
    def varies(self) -> bool:
        """False."""
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
        """None at all, an empty tuple."""
        return ()

    def knots(self, first: float, last: float) -> FloatArray:  # noqa: ARG002 - it has none
        """No times."""
        return np.empty(0)

    def _values(self, time: FloatArray) -> FloatArray:
        return np.full_like(time, self.value)

    def _integral(self, time: FloatArray) -> FloatArray:
        return self.value * time


class Harmonic(Signal):
    """amplitude sin(2 pi frequency t + phase)."""

    kind: ClassVar[str] = "harmonic"

    amplitude: float = parameter("amplitude", symbol="a", example=500.0, ge=-LARGEST, le=LARGEST)
    frequency: float = parameter("frequency", symbol="f", unit="Hz", example=10.03, ge=1e-9, le=1e9)
    phase: float = parameter(
        "phase", symbol="phi", unit="rad", example=0.5, default=0.0, ge=-1e6, le=1e6
    )

    if TYPE_CHECKING:

        def __init__(self, amplitude: float, frequency: float, phase: float = 0.0) -> None: ...

    def primitive(self) -> Signal:
        """The signal itself."""
        return self

    def derivative(self) -> Signal:
        """2 pi frequency amplitude cos(2 pi frequency t + phase)."""
        factor = 2.0 * math.pi * self.frequency
        ahead = Harmonic(self.amplitude, self.frequency, self.phase + 0.5 * math.pi)
        return Product(signals=(Constant(value=factor), ahead))

    @property
    def span(self) -> tuple[float, float]:
        """Always."""
        return (-math.inf, math.inf)

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

    signals: tuple[SignalField, ...] = Field(
        description="signals to combine", min_length=1, max_length=10_000, strict=False
    )

    def primitive(self) -> Signal:
        """The same of the primitive signals."""
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
        """Frequencies of all signals [Hz]; None if one does not repeat."""
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

    def derivative(self) -> Signal:
        """Sum of the derivatives."""
        return Sum(signals=tuple(one.derivative() for one in self.signals))

    @property
    def varies(self) -> bool:
        """Return True if one of the signals does."""
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

    def derivative(self) -> Signal:
        """Sum over the signals, each with the derivative of that one."""
        terms = []
        for i, one in enumerate(self.signals):
            others = self.signals[:i] + self.signals[i + 1 :]
            terms.append(Product(signals=(one.derivative(), *others)))
        return Sum(signals=tuple(terms))

    @property
    def varies(self) -> bool:
        """Return True if one of the signals varies, and none is zero."""
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
