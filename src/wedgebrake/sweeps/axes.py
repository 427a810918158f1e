"""The axes of a sweep: each swept parameter with its values, checked on the system."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from wedgebrake.errors import InputError, nearest
from wedgebrake.model.part import shown
from wedgebrake.model.swept import INITIAL, MOST_VALUES, refuse_doubled, sweepable
from wedgebrake.model.system import PARTS, BrakedDriveline
from wedgebrake.sweeps.results import VARIABLES

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Axis:
    """One swept parameter: (n,) values in their order, their unit, and what they mean.

    dim : its dimension in the result: its name, but "brake_angle" for the angle of the
          brake, since ``angle`` there is that of the driveline
    """

    name: str
    dim: str
    values: FloatArray
    unit: str
    meaning: str

    @property
    def size(self) -> int:
        """Number of values."""
        return int(self.values.size)

    def attributes(self) -> dict[str, str]:
        """For the coordinate of a dataset."""
        return {"units": self.unit, "long_name": self.meaning}


def make_axes(system: BrakedDriveline, given: dict[str, Any]) -> tuple[Axis, ...]:
    """The axes of a sweep, in the order given.

    Raises ``InputError`` for an unknown name, values that are no finite numbers, a group
    beside the parameter that it sets, or an axis none of whose values the system takes.
    """
    if not given:
        raise InputError(
            "sweep: nothing to sweep. Give at least one parameter with its values, for example"
            " eta=np.linspace(-60, 12, 400)."
        )
    axes = tuple(_axis(system, name, values) for name, values in given.items())
    for name in given:
        refuse_doubled(name, given)
    return axes


def _axis(system: BrakedDriveline, name: str, given: ArrayLike) -> Axis:
    allowed = sweepable(system)
    if name not in allowed:
        raise InputError(f"{name}: cannot be swept. {nearest(name, allowed)}")
    values = _numbers(name, given)
    if name not in INITIAL:
        _check_taken(system, name, values)
    elif np.max(np.abs(values)) > 1e12:
        raise InputError(f"{name}: must lie in [-1e12, 1e12].")
    unit, meaning = allowed[name]
    return Axis(name, _dim(system, name), values, unit, meaning)


def _dim(system: BrakedDriveline, name: str) -> str:
    if name not in VARIABLES:
        return name
    owner = next(part for part in PARTS if name in type(getattr(system, part)).model_fields)
    return f"{owner}_{name}"


def _numbers(name: str, given: ArrayLike) -> FloatArray:
    example = f"Give a list or an array, for example {name}=np.linspace(0.1, 1.0, 100)"
    try:
        values = np.array(given, dtype=float)
    except (TypeError, ValueError):
        raise InputError(f"{name} = {shown(given)}: must be numbers. {example}.") from None
    if values.ndim != 1 or values.size == 0:
        raise InputError(
            f"{name} = {shown(given)}: must be a list of values, at least one. {example}; for one"
            f" value use system.replace({name}=...)."
        )
    if values.size > MOST_VALUES:
        raise InputError(f"{name}: has {values.size} values, at most {MOST_VALUES}.")
    bad = np.flatnonzero(~np.isfinite(values))
    if bad.size:
        raise InputError(f"{name}[{bad[0]}] = {values[bad[0]]}: must be a finite number.")
    return values


def _check_taken(system: BrakedDriveline, name: str, values: FloatArray) -> None:
    """Refuse an axis that the system takes no value of; single bad points are no error."""
    first: InputError | None = None
    for value in (values[0], values[-1], values[values.size // 2], *values):
        try:
            system.replace(**{name: float(value)})
        except InputError as error:
            first = error if first is None else first
        else:
            return
    raise InputError(f"{name}: no value can be taken. {first}")
