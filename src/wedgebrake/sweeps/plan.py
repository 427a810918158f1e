"""The complete definition of a sweep.

The definition is sent to workers, and compared when a store is resumed.
"""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass
from functools import cached_property, partial
from types import CodeType
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from wedgebrake._version import __version__
from wedgebrake.analysis.run_settings import Protocol
from wedgebrake.errors import InputError
from wedgebrake.model.friction import CustomFriction
from wedgebrake.model.system import BrakedDriveline
from wedgebrake.solvers.kernels import kernel_of
from wedgebrake.sweeps.grid import BRANCH, BRANCHES, Grid
from wedgebrake.sweeps.results import CONTACT, EXPONENT, INERTIA, RETURN, Variable, variables

if TYPE_CHECKING:
    import xarray as xr

    from wedgebrake.sweeps.chunk import Chunk

PERIOD, CROSSING = "period", "crossing"
# Packages whose classes their version identifies.
_KNOWN = ("wedgebrake", "pydantic", "builtins", "abc")


@dataclass(frozen=True, eq=False)
class Plan:
    """A system, the grid swept on it, and how the motion of each point is evaluated.

    initial     : (angle [rad], velocity [rad/s]) of a system that holds none, unless swept
    keep_points : whether the Poincare points are part of the result
    kind        : "sweep", "bifurcation", "regime_map", "basins" or "scatter"
    """

    system: Any
    grid: Grid
    protocol: Protocol
    method: str
    initial: tuple[float, float]
    keep_points: bool
    kind: str

    def chunk_maker(self) -> Callable[[Mapping[str, slice]], Chunk]:
        """The function that makes a chunk, from a slice of each dimension of the points."""
        from wedgebrake.sweeps.chunk import Chunk
        from wedgebrake.sweeps.part_rows import PartRows

        rows = None
        if self.line is not None and self.method == "exact":
            # Without tables, points whose brake cannot be compiled are computed one by one.
            with suppress(InputError):
                rows = PartRows(self.system, self.line, self.grid.axes)
        return partial(Chunk, self, rows)

    @cached_property
    def line(self) -> BrakedDriveline | None:
        """The one inertia that its own kernel evaluates; None for the series."""
        return kernel_of(self.system, self.method).line

    @property
    def returns(self) -> str:
        """Dimension of the recorded returns."""
        return CROSSING if self.system.machine.autonomous else PERIOD

    @property
    def chunk_points(self) -> tuple[int, int]:
        """Fewest and most points of a chunk: more where a point takes a millisecond or less."""
        if self.line is None or self.method != "exact":
            return 16, 256
        return 64, 256 if self.protocol.automatic else 4096

    def _names(self) -> dict[str, tuple[str, ...]]:
        """Names along the dimensions over parts of the system."""
        machine = self.system.machine
        names = {INERTIA: machine.inertia_names, CONTACT: machine.contact_names}
        return {dim: own for dim, own in names.items() if dim not in self.system.view.single}

    @property
    def variables(self) -> tuple[Variable, ...]:
        """Variables of the result."""
        kept = variables(self.system.view)
        return tuple(one for one in kept if self.keep_points or RETURN not in one.over)

    @property
    def record_size(self) -> int:
        """Number of Poincare points of each point of the grid; 0 if they are not kept."""
        return self.protocol.recorded + 1 if self.keep_points else 0

    @property
    def inner_sizes(self) -> dict[str, int]:
        """Sizes of the dimensions of variables beside those of the points."""
        names, machine = self._names(), self.system.machine
        states = 2 * len(machine.inertias) + sum(one.actuation.order for one in machine.contacts)
        sizes = {dim: len(one) for dim, one in names.items()}
        return {RETURN: self.record_size, EXPONENT: states, **sizes}

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

    def coordinates(self) -> dict[str, tuple[str, NDArray[Any], dict[str, Any]]]:
        """Return the dimension, values and attributes of each coordinate."""
        coords: dict[str, tuple[str, NDArray[Any], dict[str, Any]]] = {
            axis.label: (axis.dim, axis.values, axis.attributes()) for axis in self.grid.axes
        }
        if self.grid.follow is not None:
            meaning = f"direction in which {self.grid.follow} was followed"
            coords[BRANCH] = (BRANCH, np.array(BRANCHES), {"long_name": meaning})
        if self.keep_points:
            meaning = "number of periods" if self.returns == PERIOD else "number of crossings"
            meaning += " after settling" if self.protocol.automatic else ""
            numbers = np.arange(self.record_size) + self.protocol.first
            coords[self.returns] = (self.returns, numbers, {"units": "1", "long_name": meaning})
        for dim, names in self._names().items():
            coords[dim] = (dim, np.array(names), {"long_name": dim})
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
            "axes": json.dumps([axis.label for axis in self.grid.axes]),
        }

    def _settings(self) -> dict[str, Any]:
        """Settings of the run that only some sweeps have."""
        if self.system.holds_start:
            return {"returns": self.returns}
        found: dict[str, Any] = {"initial": list(self.initial)}
        return found if self.line is not None else {**found, "returns": self.returns}

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
        machine = self.system.machine
        parts = {
            f"{one.name}.{kind}": getattr(one, kind)
            for one in machine.contacts
            for kind in ("brake", "friction")
        }
        own = {name: _own_functions(one) for name, one in {**parts, **machine.signals()}.items()}
        return {
            self.system.own_name(name): "-".join(map(fingerprint, laws))
            for name, laws in own.items()
            if laws
        }

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
            coords=self.coordinates(),
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
