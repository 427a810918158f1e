"""Signals over given times: tables, ramps and chirps."""

from __future__ import annotations

import math
from collections.abc import Iterator
from functools import cached_property
from typing import TYPE_CHECKING, Any, ClassVar, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray
from pydantic import ValidationInfo, field_validator, model_validator

from wedgebrake.arrays import FloatArray
from wedgebrake.model.part import parameter
from wedgebrake.model.signals.signal_calculus import running_sum
from wedgebrake.model.signals.signals import (
    LARGEST,
    Constant,
    Exponential,
    Orders,
    Product,
    Signal,
    Sum,
)
from wedgebrake.model.validation import wrong

_MOST = 10_000_000
FEW = 12
"""Most points of a table that is shown in full."""


class Short(str):
    """A text whose representation has no quotation marks."""

    __slots__ = ()

    def __repr__(self) -> str:
        return str(self)


def _column(description: str, **extra: Any) -> Any:
    return parameter(description, min_length=2, max_length=_MOST, strict=False, **extra)


class Table(Signal):
    """Values over time, linear between the points; a repeated time is a jump.

    ``periodic`` repeats the table, with a jump if its last value differs from the first.
    ``after`` gives the value of a table that is not periodic outside its times: "error" raises an
    error there, "hold" keeps the first and the last value, "zero" is zero.
    """

    kind: ClassVar[str] = "table"

    times: tuple[float, ...] = _column(
        "times [s], ascending; a repeated time is a jump",
        symbol="t",
        unit="s",
        example=[0.0, 1.0],
    )
    values: tuple[float, ...] = _column(
        "values at these times", symbol="u", unit="-", example=[0.0, 300.0]
    )
    periodic: bool = parameter("whether the table repeats", unit="-", example=False, default=False)
    after: Literal["error", "hold", "zero"] = parameter(
        "value outside its times", unit="-", example="hold", default="error"
    )

    if TYPE_CHECKING:

        def __init__(
            self,
            times: ArrayLike,
            values: ArrayLike,
            periodic: bool = False,
            after: Literal["error", "hold", "zero"] = "error",
        ) -> None: ...

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Table) and self._fields() == other._fields()

    def __hash__(self) -> int:
        return self._hash

    @cached_property
    def _hash(self) -> int:
        """Hash of the fields, computed once because records have many points."""
        return hash(self._fields())

    def _fields(self) -> tuple[Any, ...]:
        """The fields that define a table, without the cached arrays."""
        return self.times, self.values, self.periodic, self.after

    def __repr_args__(self) -> Iterator[tuple[str | None, Any]]:
        """Representation in which long tables are given by their number of points."""
        for name, value in super().__repr_args__():
            long = isinstance(value, tuple) and len(value) > FEW
            yield name, Short(f"({len(value)} numbers)") if long else value

    @field_validator("times", "values", mode="before")
    @classmethod
    def _listed(cls, value: Any) -> Any:
        return np.asarray(value).tolist() if hasattr(value, "__array__") else value

    @field_validator("*")
    @classmethod
    def _not_vanishing(cls, value: Any, info: ValidationInfo) -> Any:  # noqa: ARG003
        """Allow very small values, as in a decaying record: no powers of them are formed."""
        return value

    @model_validator(mode="after")
    def _consistent(self) -> Table:
        count, times = len(self.times), np.asarray(self.times)
        if len(self.values) != count:
            raise wrong(
                "signal.values", self.values, f"a list of {count} values, as signal.times is",
                "Give one value for each time.",
            )  # fmt: skip
        for at in np.flatnonzero(np.diff(times) < 0.0)[:1] + 1:
            raise wrong(
                f"signal.times[{at}]", self.times[at],
                f"at least {self.times[at - 1]!r}, the time before it", "Sort the table by time.",
            )  # fmt: skip
        for at in np.flatnonzero(times[2:] == times[:-2])[:1] + 2:
            raise wrong(
                f"signal.times[{at}]", self.times[at], "a time given at most twice",
                "Give only the values before and after a jump.",
            )  # fmt: skip
        if times[0] == times[-1]:
            raise wrong("signal.times", self.times, "two different times at least")
        for i in np.flatnonzero(np.abs(self.values) > LARGEST)[:1]:
            raise wrong(f"signal.values[{i}]", self.values[i], f"at most {LARGEST:g} in magnitude")
        if self.periodic and self.after != "error":
            raise wrong(
                "signal.after", self.after, "left out where periodic = True",
                "A table that repeats has no end.",
            )  # fmt: skip
        return self

    def primitive(self) -> Signal:
        """The signal itself; with after="zero", a table that jumps to zero at both ends."""
        if self.after != "zero" or self.periodic:
            return self
        times, values = list(self.times), list(self.values)
        if times[0] == times[1]:
            del times[0], values[0]
        if times[-1] == times[-2]:
            del times[-1], values[-1]
        times, values = [times[0], *times, times[-1]], [0.0, *values, 0.0]
        return Table(times=times, values=values, after="hold")

    @property
    def span(self) -> tuple[float, float]:
        """First and last time of the table [s]; always if it repeats or continues."""
        if self.periodic or self.after != "error":
            return (-math.inf, math.inf)
        return (self.times[0], self.times[-1])

    @property
    def varies(self) -> bool:
        """True unless all values are the same."""
        ends = self.after == "zero" and self.bound > 0.0
        values = self.points[1]
        return ends or bool(values.min() != values.max())

    @property
    def bound(self) -> float:
        """The largest magnitude of the values."""
        return max(max(self.values), -min(self.values))

    @property
    def rate(self) -> float:
        """Zero: the signal is linear between its knots."""
        return 0.0

    def frequencies(self) -> tuple[float, ...] | None:
        """The frequency of a table that repeats [Hz]."""
        if not self.varies:
            return ()
        return (1.0 / self._length,) if self.periodic else None

    def knots(self, first: float, last: float) -> FloatArray:
        """The times of the table in (first, last) [s], with all repetitions."""
        times = np.unique(self.points[0])
        if self.periodic:
            length, begin = self._length, times[0]
            count = np.arange(math.floor((first - begin) / length),
                              math.ceil((last - begin) / length) + 1)  # fmt: skip
            times = np.unique((times[:-1] + length * count[:, None]).ravel())
        return np.asarray(times[(first < times) & (times < last)])

    def _values(self, time: FloatArray) -> FloatArray:
        times, values = self.points
        local, _ = self._local(time)
        at = self._line(local)
        found = values[at] + self._slopes[at] * (local - times[at])
        # The end of a line has exactly the value given there.
        found = np.where(local == times[at + 1], values[at + 1], found)
        if self.periodic:
            return np.asarray(found)
        outside = (0.0, 0.0) if self.after == "zero" else (values[0], values[-1])
        found = np.where(local < times[0], outside[0], found)
        return np.asarray(np.where(local >= times[-1], outside[1], found))

    def _integral(self, time: FloatArray) -> FloatArray:
        return np.asarray(self._area(time) - self._area(np.zeros(())))

    def _area(self, time: FloatArray) -> FloatArray:
        """Integral from the first time of the table."""
        times, values = self.points
        local, repetitions = self._local(time)
        inside = np.clip(local, times[0], times[-1])
        at = self._line(inside)
        width = inside - times[at]
        area = self._areas[at] + width * (values[at] + 0.5 * self._slopes[at] * width)
        if self.periodic:
            return np.asarray(area + repetitions * self._areas[-1])
        if self.after == "hold":
            area = area + np.where(local < times[0], values[0], values[-1]) * (local - inside)
        return np.asarray(area)

    def _local(self, time: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Time within the first repetition of the table, and the number of repetitions before."""
        if not self.periodic:
            return time, np.zeros_like(time)
        first = self.times[0]
        repetitions = np.floor((time - first) / self._length)
        local = time - repetitions * self._length
        # Rounding may move a time beyond an end of the table.
        late, early = local >= self.times[-1], local < first
        repetitions = repetitions + late - early
        moved = np.where(late, local - self._length, local)
        return np.maximum(moved, first), repetitions

    def _line(self, local: FloatArray) -> NDArray[np.intp]:
        """Index of the line at each time, without jumps; at a jump, the line after it."""
        times = self.points[0]
        at = np.clip(np.searchsorted(times, local, side="right") - 1, 0, times.size - 2)
        return np.asarray(np.where(times[at] == times[at + 1], at - 1, at))

    @property
    def points(self) -> tuple[FloatArray, FloatArray]:
        """Times and values as arrays."""
        return self._points

    @cached_property
    def _points(self) -> tuple[FloatArray, FloatArray]:
        return np.asarray(self.times), np.asarray(self.values)

    @cached_property
    def _slopes(self) -> FloatArray:
        width = np.diff(self.points[0])
        rise = np.diff(self.points[1])
        return np.divide(rise, width, where=width > 0.0, out=np.zeros_like(rise))

    @cached_property
    def _areas(self) -> FloatArray:
        """Integral up to each time of the table."""
        times, values = self.points
        return running_sum(np.diff(times) * (0.5 * values[:-1] + 0.5 * values[1:]))

    @property
    def _length(self) -> float:
        return self.times[-1] - self.times[0]


RampLaw = Literal["linear", "log"]


class Ramp(Signal):
    """A change from ``start`` to ``end``, which begins at ``begin`` and takes ``duration`` seconds.

    The value is ``start`` before and ``end`` after the change. With the law "linear" it changes by
    equal amounts in equal times; with "log" by equal ratios, between two values of the same sign.
    """

    kind: ClassVar[str] = "ramp"

    start: float = parameter("value before", symbol="u_0", example=80.0, ge=-LARGEST, le=LARGEST)
    end: float = parameter("value after", symbol="u_1", example=0.0, ge=-LARGEST, le=LARGEST)
    duration: float = parameter("duration", symbol="T", unit="s", example=4.0, gt=0, le=1e12)
    begin: float = parameter(
        "time at which it begins", symbol="t_0", unit="s", example=0.5, default=0.0,
        ge=-1e12, le=1e12,
    )  # fmt: skip
    law: RampLaw = parameter(
        "equal amounts or equal ratios in equal times", unit="-", example="log", default="linear"
    )

    if TYPE_CHECKING:

        def __init__(
            self,
            start: float,
            end: float,
            duration: float,
            begin: float = 0.0,
            law: RampLaw = "linear",
        ) -> None: ...

    @model_validator(mode="after")
    def _long_enough(self) -> Ramp:
        if self.begin + self.duration == self.begin:
            raise wrong(
                "signal.duration", self.duration, f"longer than rounding at begin = {self.begin!r}",
                "For a jump use a Table with a repeated time.",
            )  # fmt: skip
        if self.law == "log" and not self.start * self.end > 0.0:
            raise wrong(
                "signal.end", self.end, f"of the sign of start = {self.start!r} for law = 'log'",
                "Use law='linear', or two values of the same sign.",
            )  # fmt: skip
        return self

    @property
    def bound(self) -> float:
        """The larger of the magnitudes of start and end."""
        return max(abs(self.start), abs(self.end))

    def primitive(self) -> Signal:
        """A table of two points, or an exponential; a constant if the ends are equal."""
        if self.start == self.end:
            return Constant(value=self.start)
        times = (self.begin, self.begin + self.duration)
        if self.law == "linear":
            return Table(times=times, values=(self.start, self.end), after="hold")
        growth = math.log(self.end / self.start) / self.duration
        between = Exponential(value=self.start, growth=growth, begin=self.begin, largest=self.bound)
        each = (times[0], *times, times[1])
        acts = Table(times=each, values=(0.0, 1.0, 1.0, 0.0), after="hold")
        outside = Table(times=each, values=(self.start, 0.0, 0.0, self.end), after="hold")
        return Sum(signals=(Product(signals=(acts, between)), outside))


class Chirp(Signal):
    """A sine whose frequency changes from ``start`` to ``end`` in ``duration`` seconds.

    The value is amplitude sin(theta), and the change begins at time 0, where theta = 0. In equal
    times the frequency changes by equal amounts ("linear") or equal ratios ("log"); then it remains
    ``end``.
    """

    kind: ClassVar[str] = "chirp"

    amplitude: float = parameter("amplitude", symbol="a", example=500.0, ge=-LARGEST, le=LARGEST)
    start: float = parameter(
        "frequency at the start", symbol="f_0", unit="Hz", example=2.0, ge=1e-9, le=1e9
    )
    end: float = parameter(
        "frequency at the end", symbol="f_1", unit="Hz", example=50.0, ge=1e-9, le=1e9
    )
    duration: float = parameter("duration", symbol="T", unit="s", example=60.0, gt=0, le=1e12)
    law: RampLaw = parameter(
        "equal amounts or equal ratios in equal times", unit="-", example="log", default="linear"
    )

    if TYPE_CHECKING:

        def __init__(
            self,
            amplitude: float,
            start: float,
            end: float,
            duration: float,
            law: RampLaw = "linear",
        ) -> None: ...

    @property
    def speed(self) -> Ramp:
        """The angular frequency as a signal [rad/s]."""
        ends = (2.0 * math.pi * self.start, 2.0 * math.pi * self.end)
        return Ramp(*ends, self.duration, law=self.law)

    def primitive(self) -> Signal:
        """The first order of its angular frequency."""
        return Orders(self.speed, [(1.0, self.amplitude, 0.0)]).primitive()
