"""The complete definition of a sweep, and its chunks, which are computed in batches.

The definition is sent to workers, and compared when a store is resumed.
"""

from __future__ import annotations

import hashlib
import json
import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from types import CodeType
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from wedgebrake._version import __version__
from wedgebrake.analysis.run_settings import Protocol
from wedgebrake.errors import InputError
from wedgebrake.model.friction import CustomFriction
from wedgebrake.model.system import INITIAL
from wedgebrake.sweeps.grid import BRANCH, BRANCHES, Grid, batches
from wedgebrake.sweeps.results import RETURN, Variable

if TYPE_CHECKING:
    import xarray as xr

PERIOD, CROSSING = "period", "crossing"
# Packages whose classes their version identifies.
_KNOWN = ("wedgebrake", "pydantic", "builtins", "abc")


@dataclass(frozen=True, eq=False)
class Plan(ABC):
    """A system, the grid swept on it, and how the motion of each point is evaluated.

    What differs between drivelines and machines is a method of a subclass: ``driveline_plan``,
    ``machine_plan``.

    initial     : (angle [rad], velocity [rad/s]) of a driveline, unless swept
    keep_points : whether the Poincare points are part of the result
    kind        : "sweep", "bifurcation", "regime_map" or "basins"
    """

    system: Any
    grid: Grid
    protocol: Protocol
    method: str
    initial: tuple[float, float]
    keep_points: bool
    kind: str

    @abstractmethod
    def chunk_maker(self) -> Callable[[Mapping[str, slice]], Chunk]:
        """The function that makes a chunk, from a slice of each dimension of the points."""

    @abstractmethod
    def _table(self) -> dict[str, Variable]:
        """Variables of the result, also those that are not kept."""

    @abstractmethod
    def _parts(self) -> Mapping[str, Any]:
        """Parts of the system, and signals, that may contain functions of the user."""

    @property
    def returns(self) -> str:
        """Dimension of the recorded returns."""
        return PERIOD

    @property
    def chunk_points(self) -> tuple[int, int]:
        """Fewest and most points of a chunk."""
        return 16, 256

    def _names(self) -> dict[str, list[str]]:
        """Names along the dimensions over parts of the system."""
        return {}

    @property
    def variables(self) -> tuple[Variable, ...]:
        """Variables of the result."""
        kept = self._table().values()
        return tuple(one for one in kept if self.keep_points or RETURN not in one.over)

    @property
    def record_size(self) -> int:
        """Number of Poincare points of each point of the grid; 0 if they are not kept."""
        return self.protocol.recorded + 1 if self.keep_points else 0

    @property
    def inner_sizes(self) -> dict[str, int]:
        """Sizes of the dimensions of variables beside those of the points."""
        names = self._names()
        return {RETURN: self.record_size, **{dim: len(one) for dim, one in names.items()}}

    def width(self, variable: Variable) -> int:
        """Number of values of a variable at each point."""
        return math.prod(self.inner_sizes[dim] for dim in variable.over)

    def shape(self, variable: Variable) -> tuple[int, ...]:
        """Shape of a variable at each point."""
        return tuple(self.inner_sizes[dim] for dim in variable.over)

    def dims(self, variable: Variable) -> tuple[str, ...]:
        """Return the dimensions of a variable."""
        inner = (self.returns if dim == RETURN else dim for dim in variable.over)
        return (*self.grid.sizes, *inner)

    def coordinates(self) -> dict[str, tuple[NDArray[Any], dict[str, Any]]]:
        """Return the values and attributes of each coordinate."""
        coords: dict[str, tuple[NDArray[Any], dict[str, Any]]] = {
            axis.dim: (axis.values, axis.attributes()) for axis in self.grid.axes
        }
        if self.grid.follow is not None:
            meaning = f"direction in which {self.grid.follow} was followed"
            coords[BRANCH] = (np.array(BRANCHES), {"long_name": meaning})
        if self.keep_points:
            meaning = "number of periods" if self.returns == PERIOD else "number of crossings"
            meaning += " after settling" if self.protocol.automatic else ""
            numbers = np.arange(self.record_size) + self.protocol.first
            coords[self.returns] = (numbers, {"units": "1", "long_name": meaning})
        for dim, names in self._names().items():
            coords[dim] = (np.array(names), {"long_name": dim})
        return coords

    def attributes(self) -> dict[str, Any]:
        """Return the attributes of the result."""
        protocol = {
            "periods": self.protocol.first + self.protocol.recorded,
            "follow": self.grid.follow,
            **self._settings(),
            **self.protocol.as_dict(),
        }
        groups = self.system.groups
        return {
            "kind": self.kind,
            "wedgebrake_version": __version__,
            "method": self.method,
            "system": json.dumps(self.system.as_dict()),
            **({"groups": json.dumps(groups.as_dict())} if groups.defined else {}),
            "protocol": json.dumps(protocol),
            "axes": json.dumps([axis.dim for axis in self.grid.axes]),
        }

    def _settings(self) -> dict[str, Any]:
        """Settings of the run that only some kinds of plans have."""
        return {"returns": self.returns}

    def identity(self) -> dict[str, Any]:
        """Return everything on which the results depend, as values that JSON can represent."""
        return {
            "wedgebrake_version": __version__,
            "kind": self.kind,
            "method": self.method,
            "system": self.system.as_dict(),
            "laws": self._laws(),
            "axes": {axis.name: axis.values.tolist() for axis in self.grid.axes},
            "follow": self.grid.follow,
            "initial": list(self.initial),
            "keep_points": self.keep_points,
            "protocol": self.protocol.as_dict(),
        }

    def _laws(self) -> dict[str, str]:
        """Fingerprints of user-defined laws, whose names do not reveal a change."""
        own = {name: _own_functions(part) for name, part in self._parts().items()}
        return {name: "-".join(map(fingerprint, laws)) for name, laws in own.items() if laws}

    def empty_arrays(self) -> dict[str, NDArray[Any]]:
        """Return an array for each variable, with the values of points that are not computed."""
        points = tuple(self.grid.sizes.values())
        return {
            one.name: np.full((*points, *self.shape(one)), one.fill, one.dtype)
            for one in self.variables
        }

    def dataset(self, arrays: Mapping[str, Any]) -> xr.Dataset:
        """Return the labelled result of an array for each variable."""
        import xarray as xr

        return xr.Dataset(
            {
                one.name: (self.dims(one), arrays[one.name], one.attributes())
                for one in self.variables
            },
            coords={name: (name, *one) for name, one in self.coordinates().items()},
            attrs=self.attributes(),
        )


def _own_functions(part: Any) -> list[Callable[..., Any]]:
    """Return the functions of a part that wedgebrake does not define: of its class, or its law."""
    classes = (one for one in type(part).__mro__ if one.__module__.partition(".")[0] not in _KNOWN)
    members = [value for one in classes for _, value in sorted(vars(one).items())]
    found = [getattr(one, "__func__", getattr(one, "fget", one)) for one in members]
    own = [one for one in found if hasattr(one, "__code__")]
    return [*own, part.law] if isinstance(part, CustomFriction) else own


def fingerprint(law: Callable[..., Any]) -> str:
    """Return a short text that identifies what a function computes, equal in every process."""
    return hashlib.sha256(repr(_content(law, [])).encode()).hexdigest()[:16]


def _content(value: Any, known: list[Any]) -> Any:
    """Return the content of a value; of a function its code and the values that it uses."""
    function = getattr(value, "py_func", value)
    code = getattr(function, "__code__", None)
    if isinstance(value, np.ndarray):
        return value.tolist()
    if code is None:
        # The representation of other objects may contain an address.
        plain = value is None or isinstance(value, int | float | complex | str | bytes | tuple)
        return repr(value) if plain else getattr(value, "__name__", type(value).__name__)
    if function in known:
        return function.__qualname__
    names = [name for one in _codes(code) for name in one.co_names]
    scope = {name: function.__globals__[name] for name in names if name in function.__globals__}
    closed = [cell.cell_contents for cell in function.__closure__ or ()]
    used = [*sorted(scope.items()), *enumerate(closed), ("defaults", function.__defaults__)]
    return (
        [
            (one.co_code, [_constant(c) for c in one.co_consts], one.co_names)
            for one in _codes(code)
        ],
        [(name, _content(one, [*known, function])) for name, one in used],
    )


def _codes(code: CodeType) -> list[CodeType]:
    """Return a code object and those nested in it."""
    inner = [one for one in code.co_consts if isinstance(one, CodeType)]
    return [code, *(deeper for one in inner for deeper in _codes(one))]


def _constant(value: Any) -> str:
    return value.co_name if isinstance(value, CodeType) else repr(value)


class Chunk(ABC):
    """Points of a plan, numbered from 0, in batches that threads may compute in any order.

    where : slice of each dimension of the points, by name

    sizes   : points along each dimension;  count : all of them
    indices : for each axis of the plan, (count,) indices of its values
    states  : (count, 2) initial angle [rad] and velocity [rad/s] of a driveline
    work    : one function for each batch
    """

    def __init__(self, plan: Plan, where: Mapping[str, slice]) -> None:
        self.plan = plan
        self.sizes = {dim: one.stop - one.start for dim, one in where.items()}
        self.count = math.prod(self.sizes.values())
        places = dict(zip(where, np.indices(tuple(self.sizes.values())), strict=True))
        self.indices = tuple(
            (places[axis.dim].ravel() + where[axis.dim].start).astype(np.int64)
            for axis in plan.grid.axes
        )
        self.states = np.empty((self.count, 2))
        self.states[:] = plan.initial
        for axis, numbers in zip(plan.grid.axes, self.indices, strict=True):
            if axis.name in INITIAL:
                self.states[:, list(INITIAL).index(axis.name)] = axis.values[numbers]
        self.work: list[Callable[[], None]] = [
            partial(self._run, numbers)
            for numbers in batches(self.sizes, plan.grid.follow, self._batch_size())
        ]

    @abstractmethod
    def _batch_size(self) -> int:
        """Number of points of a batch."""

    @abstractmethod
    def _run(self, numbers: NDArray[np.int64]) -> None:
        """Compute a batch; with ``follow`` each point starts from the previous final state."""

    @abstractmethod
    def results(self) -> dict[str, Any]:
        """Return the variables over the chunk, once all its work is done."""

    def system(self, number: int) -> Any:
        """The system of a point; None if it is not valid."""
        changes = {
            name: float(axis.values[numbers[number]])
            for axis, numbers in zip(self.plan.grid.axes, self.indices, strict=True)
            for name in axis.parameters
            if name not in INITIAL
        }
        try:
            return self.plan.system.replace(**changes)
        except InputError:
            return None

    def state(self, number: int) -> tuple[float, float]:
        """Initial angle and velocity of a driveline at a point."""
        return float(self.states[number, 0]), float(self.states[number, 1])

    def shaped(self, values: NDArray[Any]) -> NDArray[Any]:
        """Reshape values of all points, (count, ...), to the dimensions of the chunk."""
        return values.reshape(*self.sizes.values(), *values.shape[1:])
