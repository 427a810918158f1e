"""Signals: torques, actuation forces and speeds as functions of time.

A signal is a constant, a sine, a table, a ramp, a sum of orders of a speed, or a sum or product of
these. The exact solver takes its Taylor series between the knots of its tables.
"""

from __future__ import annotations

import math
from abc import abstractmethod
from collections.abc import Iterator
from typing import Annotated, Any, ClassVar, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray
from pydantic import BeforeValidator, Field, SerializeAsAny, field_validator, model_validator

from wedgebrake.model.part import Chosen, parameter
from wedgebrake.model.validation import is_number

FloatArray = NDArray[np.float64]


class Signal(Chosen):
    """A function of time, in the unit of what it drives.

    Signals and numbers can be added and multiplied.
    """

    table: ClassVar[str] = "signal"
    kinds: ClassVar[dict[str, type[Signal]]] = {}

    def __call__(self, time: ArrayLike) -> FloatArray:
        """Values at an array of times [s]; after a jump at the time of a jump."""
        return self._values(np.asarray(time, dtype=float))

    @abstractmethod
    def _values(self, time: FloatArray) -> FloatArray:
        """``__call__`` for an array."""

    def __add__(self, other: Signal | float) -> Signal:
        return Sum(signals=(self, as_signal(other)))

    def __mul__(self, other: Signal | float) -> Signal:
        return Product(signals=(self, as_signal(other)))

    __radd__, __rmul__ = __add__, __mul__

    def parts(self) -> Iterator[Signal]:
        """Iterate over the signal and those that it is made of."""
        yield self

    @property
    def varies(self) -> bool:
        """Return True if the signal may change in time."""
        return True

    @property
    def end(self) -> float:
        """Time [s] up to which the signal is known; inf if it is for ever."""
        return min((one.end for one in self.parts() if one is not self), default=math.inf)


def as_signal(value: Any) -> Any:
    """Convert a number to a constant signal; leave anything else to validation."""
    return Constant(value=value) if is_number(value) else value


SignalField = Annotated[SerializeAsAny[Signal], BeforeValidator(as_signal)]


class Constant(Signal):
    """A signal that does not change."""

    kind: ClassVar[str] = "constant"

    value: float = parameter("value", symbol="u", unit="1", example=300.0, ge=-1e15, le=1e15)

    def _values(self, time: FloatArray) -> FloatArray:
        return np.full_like(time, self.value)

    @property
    def varies(self) -> bool:
        """False."""
        return False


class Harmonic(Signal):
    """amplitude sin(2 pi frequency t + phase)."""

    kind: ClassVar[str] = "harmonic"

    amplitude: float = parameter("amplitude", symbol="a", unit="1", example=500.0, ge=0, le=1e15)
    frequency: float = parameter("frequency", symbol="f", unit="Hz", example=10.03, ge=1e-9, le=1e9)
    phase: float = parameter("phase", symbol="phi", unit="rad", example=0.0, default=0.0)

    def _values(self, time: FloatArray) -> FloatArray:
        values: FloatArray = self.amplitude * np.sin(
            2.0 * math.pi * self.frequency * time + self.phase
        )
        return values

    @property
    def varies(self) -> bool:
        """True, unless its amplitude is zero."""
        return self.amplitude > 0.0


class Table(Signal):
    """Values over time, with straight lines between them; a time given twice is a jump.

    ``periodic`` repeats the table; its last value must equal its first one, or is a jump.
    ``after`` states how a table that is not periodic goes on: "error" refuses a run beyond its
    end, "hold" keeps the last value, "zero" is zero. Before its begin the first value holds.
    """

    kind: ClassVar[str] = "table"

    times: tuple[float, ...] = Field(
        description="times [s], ascending; a time may stand twice", min_length=2,
        json_schema_extra={"symbol": "t", "unit": "s", "example": [0.0, 1.0]},
    )  # fmt: skip
    values: tuple[float, ...] = Field(
        description="values at the times", min_length=2,
        json_schema_extra={"symbol": "u", "unit": "1", "example": [0.0, 300.0]},
    )  # fmt: skip
    periodic: bool = parameter(
        "whether the table repeats", symbol="-", unit="1", example=False, default=False
    )
    after: Literal["error", "hold", "zero"] = Field(
        default="error", description="what follows the last time",
        json_schema_extra={"symbol": "-", "unit": "1", "example": "hold"},
    )  # fmt: skip

    @field_validator("times", "values", mode="before")
    @classmethod
    def _tuples(cls, value: Any) -> Any:
        return tuple(value) if isinstance(value, list) else value

    @model_validator(mode="after")
    def _ascending(self) -> Table:
        times = np.asarray(self.times)
        if len(self.times) != len(self.values):
            raise ValueError(
                f"signal.values: {len(self.values)} values for {len(self.times)} times. Give one"
                " value for each time."
            )
        falls = np.flatnonzero(np.diff(times) < 0.0)
        if falls.size:
            at = int(falls[0]) + 1
            raise ValueError(
                f"signal.times[{at}] = {self.times[at]!r}: must be at least"
                f" {self.times[at - 1]!r}, the time before it. Sort the times."
            )
        thrice = np.flatnonzero(times[2:] == times[:-2])
        if thrice.size:
            at = int(thrice[0]) + 2
            raise ValueError(
                f"signal.times[{at}] = {self.times[at]!r}: stands three times. A time may stand"
                " twice, with the values before and after a jump."
            )
        if times[0] == times[-1]:
            raise ValueError("signal.times: all equal. Give a table two times or more.")
        return self

    def _values(self, time: FloatArray) -> FloatArray:
        times, values = np.asarray(self.times), np.asarray(self.values)
        if self.periodic:
            time = times[0] + np.mod(time - times[0], times[-1] - times[0])
        last = np.searchsorted(times, time, side="right") - 1
        at = np.clip(last, 0, times.size - 2)
        width = times[at + 1] - times[at]
        share = np.clip(np.divide(time - times[at], width, where=width > 0.0, out=np.ones_like(time)), 0, 1)
        found: FloatArray = values[at] + share * (values[at + 1] - values[at])
        if self.after == "zero" and not self.periodic:
            found = np.where(time >= times[-1], 0.0, found)
        return found

    @property
    def end(self) -> float:
        """Last time, unless the table goes on."""
        return math.inf if self.periodic or self.after != "error" else self.times[-1]


class Ramp(Signal):
    """From ``start`` to ``end`` in ``duration`` seconds from ``begin`` on, constant elsewhere."""

    kind: ClassVar[str] = "ramp"

    start: float = parameter("value before", symbol="u0", unit="1", example=80.0)
    end_value: float = Field(alias="end", description="value after", json_schema_extra={"symbol": "u1", "unit": "1", "example": 0.0})
    duration: float = parameter("duration", symbol="T", unit="s", example=4.0, gt=0)
    begin: float = parameter("time at which it begins", symbol="t0", unit="s", example=0.0, default=0.0)

    def _values(self, time: FloatArray) -> FloatArray:
        share = np.clip((time - self.begin) / self.duration, 0.0, 1.0)
        values: FloatArray = self.start + share * (self.end_value - self.start)
        return values


class Orders(Signal):
    """Sum of relative amplitudes times sin(order theta + phase), theta the integral of a speed.

    orders : (order, amplitude, phase [rad]) each; an order may be a fraction
    """

    kind: ClassVar[str] = "orders"

    speed: SignalField = Field(description="speed that the orders follow [rad/s]")
    orders: tuple[tuple[float, float, float], ...] = Field(
        description="(order, amplitude, phase) of each order", min_length=1,
        json_schema_extra={"symbol": "-", "unit": "1", "example": [[2.0, 1.0, 0.0]]},
    )  # fmt: skip

    def _values(self, time: FloatArray) -> FloatArray:
        raise NotImplementedError  # needs the integral of the speed


class Sum(Signal):
    """Sum of signals."""

    kind: ClassVar[str] = "sum"
    signals: tuple[SignalField, ...] = Field(description="signals to add", min_length=1)

    def _values(self, time: FloatArray) -> FloatArray:
        return np.sum([one(time) for one in self.signals], axis=0)

    def parts(self) -> Iterator[Signal]:
        """Iterate over the sum and its signals."""
        yield self
        for one in self.signals:
            yield from one.parts()


class Product(Signal):
    """Product of signals."""

    kind: ClassVar[str] = "product"
    signals: tuple[SignalField, ...] = Field(description="signals to multiply", min_length=1)

    def _values(self, time: FloatArray) -> FloatArray:
        return np.prod([one(time) for one in self.signals], axis=0)

    def parts(self) -> Iterator[Signal]:
        """Iterate over the product and its signals."""
        yield self
        for one in self.signals:
            yield from one.parts()
