"""The grid of a sweep: swept parameters with their values, chunks and batches of points."""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from wedgebrake.arrays import FloatArray
from wedgebrake.errors import InputError, nearest
from wedgebrake.model.machine import Machine
from wedgebrake.model.studies.sweep_settings import (
    MOST_VALUES,
    dimension_of,
    refuse_doubled,
    sweepable,
    tied_names,
    untied,
)
from wedgebrake.model.system import INITIAL, BrakedDriveline
from wedgebrake.model.units import with_unit
from wedgebrake.model.validation import shown
from wedgebrake.sweeps.results import VARIABLES

BRANCH = "branch"
BRANCHES = ("up", "down")

# Number of values of an axis, and of combinations of values, that are tried on a system.
_TRIED_VALUES, _TRIED_COMBINATIONS = 200, 2000

ChunkIndex = tuple[int, ...]


@dataclass(frozen=True, eq=False)
class Axis:
    """A swept parameter, or several tied ones: (n,) values in the order given, unit and meaning.

    label : name of its coordinate in the result. It is the name, except "brake_angle" for the
            angle of the brake, because ``angle`` is a result
    dim   : dimension of the coordinate: the label in a grid; axes that change together share one
    """

    name: str
    label: str
    dim: str
    values: FloatArray
    unit: str
    meaning: str

    @property
    def parameters(self) -> tuple[str, ...]:
        """Names of the parameters that have these values, usually one."""
        return untied(self.name)

    @property
    def size(self) -> int:
        """Number of values."""
        return int(self.values.size)

    def attributes(self) -> dict[str, str]:
        """Return the attributes of the coordinate of a dataset."""
        return {"units": self.unit, "long_name": self.meaning}


@dataclass(frozen=True)
class Chunks:
    """Division of the points of a sweep into chunks of equal shape, except at the ends.

    sizes   : points along each dimension
    lengths : points of a chunk along each dimension
    """

    sizes: Mapping[str, int]
    lengths: Mapping[str, int]

    def indices(self) -> list[ChunkIndex]:
        """Return the chunks, each by its number along every dimension, the last fastest."""
        counts = [math.ceil(size / self.lengths[dim]) for dim, size in self.sizes.items()]
        return list(itertools.product(*map(range, counts)))

    def slices(self, index: ChunkIndex) -> dict[str, slice]:
        """Return the points of a chunk as a slice of each dimension."""
        return {
            dim: slice(number * self.lengths[dim], min((number + 1) * self.lengths[dim], size))
            for (dim, size), number in zip(self.sizes.items(), index, strict=True)
        }

    def points(self, index: ChunkIndex) -> int:
        """Return the number of points of a chunk."""
        return math.prod(one.stop - one.start for one in self.slices(index).values())


@dataclass(frozen=True, eq=False)
class Grid:
    """Axes, and the dimension along which each point starts from its neighbour, if any.

    Axes of different dimensions span a grid; those of one dimension change together.
    """

    axes: tuple[Axis, ...]
    follow: str | None = None

    @property
    def sizes(self) -> dict[str, int]:
        """Number of points along each dimension; with ``follow`` the first is "branch"."""
        sizes = {axis.dim: axis.size for axis in self.axes}
        return sizes if self.follow is None else {BRANCH: len(BRANCHES), **sizes}

    @property
    def points(self) -> int:
        """Number of points."""
        return math.prod(self.sizes.values())

    def chunks(self, target: int) -> Chunks:
        """Divide into chunks of at most about ``target`` points, without cutting followed lines."""
        sizes = self.sizes
        lengths, left = dict.fromkeys(sizes, 1), max(1, target)
        whole = () if self.follow is None else (BRANCH, self.follow)
        for dim in (*whole, *(dim for dim in reversed(sizes) if dim not in whole)):
            lengths[dim] = sizes[dim] if dim in whole else min(sizes[dim], left)
            left = max(1, left // lengths[dim])
        return Chunks(sizes, lengths)


def batches(sizes: Mapping[str, int], follow: str | None, most: int) -> list[NDArray[np.int64]]:
    """Divide the points of a chunk into batches: flat numbers within the chunk.

    Without ``follow`` a batch has at most ``most`` points. With it, a batch is one line, in the
    order in which its points follow each other.
    """
    numbers = np.arange(math.prod(sizes.values())).reshape(tuple(sizes.values()))
    if follow is None:
        flat = numbers.ravel()
        return [flat[i : i + most] for i in range(0, flat.size, most)]
    lines = np.moveaxis(numbers, list(sizes).index(follow), -1)
    up, down = (one.reshape(-1, lines.shape[-1]) for one in lines)
    return [*up, *down[:, ::-1]]


def make_axes(
    system: BrakedDriveline | Machine, given: dict[str, Any], dim: str | None = None
) -> tuple[Axis, ...]:
    """Return the axes of a sweep, in the order given; a tuple of names has tied values.

    dim : dimension that all of them share, which then have as many values; default: each its own

    Raises ``InputError`` for an unknown name, values that are not finite numbers, a group
    together with the parameter that it sets, or an axis none of whose values is valid.
    """
    if not given:
        raise InputError(
            "sweep: nothing to sweep. Give at least one parameter with its values, for example"
            " eta=np.linspace(-60, 12, 400)."
        )
    given = tied_names(given)
    axes = tuple(_axis(system, name, values, dim) for name, values in given.items())
    for name in given:
        refuse_doubled(name, given)
    _check_valid(system, axes, together=dim is not None)
    return axes


def _axis(system: BrakedDriveline | Machine, name: str, given: ArrayLike, dim: str | None) -> Axis:
    allowed = sweepable(system, [name])
    if name not in allowed:
        raise InputError(
            f"{name}: cannot be swept. {nearest(name, allowed)}",
            name=name, value=given, allowed=tuple(allowed),
        )  # fmt: skip
    values = _numbers(name, with_unit(name, given, allowed[name][0]))
    if name in INITIAL and np.max(np.abs(values)) > 1e12:
        raise InputError(
            f"{name}: must lie in [-1e12, 1e12].",
            name=name, value=values, allowed="values in [-1e12, 1e12]",
        )  # fmt: skip
    label = dimension_of(system, name, VARIABLES)
    return Axis(name, label, dim or label, values, *allowed[name])


def _numbers(name: str, given: ArrayLike) -> FloatArray:
    example = f"Give a list or an array, for example {name}=np.linspace(0.1, 1.0, 100)"
    if np.ma.is_masked(given):
        text = f"{name}: has masked values. Leave them out: {name}.compressed()."
        raise _refused(name, given, text)
    try:
        values = np.asarray(given)
        if values.dtype.kind not in "iuf" and values.size:
            raise TypeError
        values = np.array(values, dtype=float)
    except (TypeError, ValueError):
        text = f"{name} = {shown(given)}: must be numbers. {example}."
        raise _refused(name, given, text) from None
    if values.ndim != 1 or values.size == 0:
        text = f"{name} = {shown(given)}: must be a list of values, at least one. {example}; for"
        text += f" one value use system.replace({name}=...)."
        raise _refused(name, given, text)
    if values.size > MOST_VALUES:
        raise _refused(name, given, f"{name}: has {values.size} values, at most {MOST_VALUES}.")
    bad = np.flatnonzero(~np.isfinite(values))
    if bad.size:
        text = f"{name}[{bad[0]}] = {values[bad[0]]}: must be a finite number."
        raise _refused(name, given, text)
    return values


def _refused(name: str, given: Any, text: str) -> InputError:
    """The error for values that are no axis."""
    allowed = f"a list of finite numbers, 1 to {MOST_VALUES}"
    return InputError(text, name=name, value=given, allowed=allowed)


def _check_valid(
    system: BrakedDriveline | Machine, axes: tuple[Axis, ...], *, together: bool
) -> None:
    """Raise an error for an axis of which no value is valid; single invalid points are allowed.

    A value that is not valid alone may be valid together with those of other axes.

    together : whether the axes change together
    """
    samples = {axis.name: _sample(axis) for axis in axes if axis.name not in INITIAL}
    names = {name: untied(name) for name in samples}
    refused: dict[str, InputError] = {}
    for name, values in samples.items():
        error = _first_error(system, (dict.fromkeys(names[name], value) for value in values))
        if error is not None:
            refused[name] = error
    if not refused:
        return
    combined = (
        zip(*samples.values(), strict=True) if together else itertools.product(*samples.values())
    )
    combinations = (
        {each: value for name, value in zip(samples, one, strict=True) for each in names[name]}
        for one in itertools.islice(combined, _TRIED_COMBINATIONS)
    )
    if _first_error(system, combinations):
        name, error = next(iter(refused.items()))
        raise InputError(
            f"{name}: no value can be taken. {error}",
            name=name, value=samples[name], allowed=error.allowed,
        )  # fmt: skip


def _sample(axis: Axis) -> list[float]:
    """Return values that represent an axis: the ends first, then all or some of the others."""
    values = axis.values
    inner = values[1:-1][:: max(1, values.size // _TRIED_VALUES)]
    return [float(one) for one in (values[0], values[-1], *inner)]


def _first_error(system: BrakedDriveline | Machine, trials: Any) -> InputError | None:
    """Return the first error if no trial is valid, else None."""
    first: InputError | None = None
    for changes in trials:
        try:
            system.replace(**changes)
        except InputError as error:
            first = error if first is None else first
        else:
            return None
    return first
