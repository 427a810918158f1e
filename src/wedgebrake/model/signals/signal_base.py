"""The base class of signals and field types for signals."""

from __future__ import annotations

import math
from abc import abstractmethod
from typing import Annotated, Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike
from pydantic import (
    BeforeValidator,
    Field,
    GetCoreSchemaHandler,
    GetJsonSchemaHandler,
    SerializeAsAny,
    Strict,
    WithJsonSchema,
)
from pydantic_core import CoreSchema, core_schema

from wedgebrake.arrays import FloatArray
from wedgebrake.errors import InputError
from wedgebrake.model.part import Chosen, Positional, of_kind
from wedgebrake.model.signals import signal_calculus as calculus
from wedgebrake.model.units import SIGNAL
from wedgebrake.model.validation import NotAllowedError, is_number, plain, wrong

LARGEST = 1e15
"""Largest magnitude of the values of a signal."""
_ALLOWED = "a number or a signal, for example wb.Harmonic(500.0, 10.03)"


class Signal(Positional, Chosen):
    """A function of time, in the unit of the quantity that it gives.

    Signals and numbers can be added, subtracted and multiplied. To define a kind of signal, write a
    class with

    - its parameters and ``kind``, its name in study files;
    - ``primitive()``, which returns the same signal composed only of ``Constant``, ``Harmonic``,
      ``Table``, ``Orders``, ``Sum`` and ``Product``.

    The values, integral, period and series follow from it.
    """

    table: ClassVar[str] = "signal"
    plain_unit: ClassVar[str] = SIGNAL
    kinds: ClassVar[dict[str, type[Any]]] = {}
    # Makes NumPy leave the product of a NumPy scalar and a signal to the signal.
    __array_ufunc__: ClassVar[None] = None

    @classmethod
    def __pydantic_init_subclass__(cls, **kwargs: Any) -> None:
        super().__pydantic_init_subclass__(**kwargs)
        for name in cls.model_fields:
            if hasattr(Signal, name):
                raise InputError(
                    f"{cls.__name__}.{name}: must have another name, as every signal has {name}."
                    " Rename the parameter.",
                    name=f"{cls.__name__}.{name}", allowed="another name",
                )  # fmt: skip

    @abstractmethod
    def primitive(self) -> Signal:
        """The same signal composed of the kinds that the solver knows."""

    def __call__(self, time: ArrayLike) -> FloatArray:
        """Values at an array of times [s]; at a jump, the value after it.

        Raises ``InputError`` for a time at which the signal is not known.
        """
        return self._values(self._known(time))

    def integral(self, time: ArrayLike) -> FloatArray:
        """Integral from time 0 to an array of times [s].

        Raises ``InputError`` if the signal is not known all the way from time 0.
        """
        self._known(0.0)
        return self._integral(self._known(time))

    @property
    def span(self) -> tuple[float, float]:
        """First and last time for which the signal is known [s]; -inf and inf if always."""
        return self.primitive().span

    @property
    def varies(self) -> bool:
        """True if the signal changes in time."""
        return self.primitive().varies

    @property
    def period(self) -> float | None:
        """The period [s]; None if the signal has none, 0 if it does not vary.

        The terms of a signal have a common period if the ratios of their frequencies are fractions
        with denominators of at most 64.
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
        """Frequencies of the terms of the signal [Hz]; None if it is not periodic."""
        return self.primitive().frequencies()

    def knots(self, first: float, last: float) -> FloatArray:
        """Times in (first, last) at which the signal is not analytic [s], ascending."""
        return self.primitive().knots(first, last)

    def __add__(self, other: Signal | float) -> Signal:
        return _combined("sum", self, other)

    def __radd__(self, other: Signal | float) -> Signal:
        return _combined("sum", other, self)

    def __mul__(self, other: Signal | float) -> Signal:
        return _combined("product", self, other)

    def __rmul__(self, other: Signal | float) -> Signal:
        return _combined("product", other, self)

    def __neg__(self) -> Signal:
        return _combined("product", -1.0, self)

    def __sub__(self, other: Signal | float) -> Signal:
        return self + _combined("product", -1.0, other)

    def __rsub__(self, other: Signal | float) -> Signal:
        return _combined("sum", other, -self)

    def _values(self, time: FloatArray) -> FloatArray:
        """``__call__`` for known times."""
        return self.primitive()._values(time)

    def _integral(self, time: FloatArray) -> FloatArray:
        """``integral`` for known times."""
        return self.primitive()._integral(time)

    def _known(self, time: ArrayLike) -> FloatArray:
        """Times as an array within the span; times beyond it by rounding are moved to its end."""
        times = np.asarray(time, dtype=float)
        first, last = self.span
        if math.isinf(first) and math.isinf(last):
            return times
        inside: FloatArray = np.clip(times, first, last)
        beyond = np.abs(times - inside) > 1e-12 * np.maximum(np.abs(times), np.abs(inside))
        if np.any(beyond):
            raise wrong(
                "time", float(times[beyond].flat[0]), f"in [{first:.17g}, {last:.17g}] s",
                f"The {type(self).__name__} is known only there; continue a table with"
                " after='hold' or after='zero', or repeat it with periodic=True.",
            )  # fmt: skip
        return inside


def _combined(kind: str, first: Any, second: Any) -> Signal:
    """The sum or product of signals and numbers; nested sums or products become one."""
    parts: tuple[Signal, ...] = ()
    for one in (first, second):
        if not isinstance(one, Signal) and not is_number(one):
            return NotImplemented  # type: ignore[no-any-return]
        parts += getattr(one, "signals", ()) if _is(one, kind) else (as_signal(one),)
    found: Signal = Signal.kinds[kind](signals=parts)
    return found


def _is(value: object, kind: str) -> bool:
    return isinstance(value, Signal) and value.kind == kind


def as_signal(value: Any) -> Any:
    """Convert a number to a constant signal, and a table with a kind to a signal of that kind.

    A signal is returned unchanged. Raises ``ValueError`` for anything else.
    """
    if isinstance(value, dict):
        return signal_from(value)
    if is_number(value):
        return Signal.kinds["constant"](value=plain(value))
    if not isinstance(value, Signal):
        raise NotAllowedError(_ALLOWED)
    return value


def signal_from(table: dict[str, Any]) -> Signal:
    """A signal from a table with its kind and its values, as in a study file."""
    found: Signal = of_kind("signal", table, Signal.kinds)
    return found


def number_of(value: float | Signal) -> float | None:
    """The value of a number, or of a signal that does not vary; None for one that varies."""
    if not isinstance(value, Signal):
        return value
    return None if value.varies else float(value(max(0.0, value.span[0])))


_Factor = Annotated[float, Field(ge=-1e6, le=1e6)]
Order = Annotated[
    tuple[_Factor, Annotated[float, Field(ge=-LARGEST, le=LARGEST)], _Factor], Strict(False)
]
"""(order, amplitude, phase [rad]) of a term; a list is accepted too."""

A_SIGNAL = "signal"
"""Title that marks a signal in a schema."""
SignalField = Annotated[
    SerializeAsAny[Signal],
    BeforeValidator(as_signal),
    WithJsonSchema({"title": A_SIGNAL, "type": "object"}),
]
"""Annotation of a field that holds a signal; numbers are converted."""


class OrSignal:
    """Annotation of a field that holds a number in a range, or a signal; numbers stay numbers."""

    def __init__(self, ge: float = -LARGEST, le: float = LARGEST) -> None:
        self.ge, self.le = ge, le

    def __get_pydantic_core_schema__(self, _: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        number = handler.generate_schema(Annotated[float, Field(ge=self.ge, le=self.le)])

        def checked(value: Any, check: Any) -> Any:
            if isinstance(value, Signal | dict):
                return as_signal(value)
            if is_number(value) or isinstance(value, str | bool):
                return check(value)
            raise NotAllowedError("a number or a signal, such as wb.Harmonic(2.0, 10.0)")

        return core_schema.no_info_wrap_validator_function(
            checked,
            number,
            serialization=core_schema.plain_serializer_function_ser_schema(
                lambda value: value.model_dump() if isinstance(value, Signal) else value
            ),
        )

    def __get_pydantic_json_schema__(
        self, _: CoreSchema, handler: GetJsonSchemaHandler
    ) -> dict[str, Any]:
        number = {"type": "number", "minimum": self.ge, "maximum": self.le}
        return {"anyOf": [number, {"title": A_SIGNAL, "type": "object"}]}
