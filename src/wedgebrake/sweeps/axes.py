"""The axes of a sweep: each swept parameter with its values, checked on the system."""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from wedgebrake.errors import InputError, nearest
from wedgebrake.model.sweep_settings import INITIAL, MOST_VALUES, refuse_doubled, sweepable
from wedgebrake.model.system import BrakedDriveline
from wedgebrake.model.validation import shown
from wedgebrake.sweeps.results import VARIABLES

# Values of an axis, and combinations of them, that are tried on a system.
_FEW, _MOST_TRIED = 200, 2000

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
    _check_taken(system, axes)
    return axes


def _axis(system: BrakedDriveline, name: str, given: ArrayLike) -> Axis:
    allowed = sweepable(system)
    if name not in allowed:
        raise InputError(f"{name}: cannot be swept. {nearest(name, allowed)}")
    values = _numbers(name, given)
    if name in INITIAL and np.max(np.abs(values)) > 1e12:
        raise InputError(f"{name}: must lie in [-1e12, 1e12].")
    unit, meaning = allowed[name]
    return Axis(name, _dim(system, name), values, unit, meaning)


def _dim(system: BrakedDriveline, name: str) -> str:
    if name not in VARIABLES:
        return name
    return f"{system.owner(name)}_{name}"


def _numbers(name: str, given: ArrayLike) -> FloatArray:
    example = f"Give a list or an array, for example {name}=np.linspace(0.1, 1.0, 100)"
    if np.ma.is_masked(given):
        raise InputError(f"{name}: has masked values. Leave them out: {name}.compressed().")
    try:
        values = np.asarray(given)
        if values.dtype.kind not in "iuf" and values.size:
            raise TypeError
        values = np.array(values, dtype=float)
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


def _check_taken(system: BrakedDriveline, axes: tuple[Axis, ...]) -> None:
    """Refuse an axis that the system takes no value of; single bad points are no error.

    A value that does not fit the system alone may fit it with those of other axes.
    """
    refused: dict[str, InputError] = {}
    for axis in axes:
        if axis.name not in INITIAL:
            error = _first_error(system, [{axis.name: value} for value in _looked_at(axis)])
            if error is not None:
                refused[axis.name] = error
    if not refused:
        return
    swept = [axis for axis in axes if axis.name not in INITIAL]
    together = itertools.islice(itertools.product(*map(_looked_at, swept)), _MOST_TRIED)
    names = [axis.name for axis in swept]
    if _first_error(system, [dict(zip(names, one, strict=True)) for one in together]):
        name, error = next(iter(refused.items()))
        raise InputError(f"{name}: no value can be taken. {error}")


def _looked_at(axis: Axis) -> list[float]:
    """Values that stand for an axis: the ends first, then all between, or some of many."""
    values = axis.values
    between = values[1:-1][:: max(1, values.size // _FEW)]
    return [float(one) for one in (values[0], values[-1], *between)]


def _first_error(system: BrakedDriveline, trials: list[dict[str, float]]) -> InputError | None:
    """The first error, if there is no trial that the system takes."""
    first: InputError | None = None
    for changes in trials:
        try:
            system.replace(**changes)
        except InputError as error:
            first = error if first is None else first
        else:
            return None
    return first
