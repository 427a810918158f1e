"""The complete definition of a sweep: sent to workers, and compared when a store is resumed."""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import CodeType
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from wedgebrake._version import __version__
from wedgebrake.analysis.run_settings import Protocol
from wedgebrake.model.friction import CustomFriction
from wedgebrake.model.machine import Machine
from wedgebrake.model.part import Chosen
from wedgebrake.model.system import BrakedDriveline
from wedgebrake.sweeps.grid import BRANCH, BRANCHES, Grid
from wedgebrake.sweeps.results import (
    CONTACT,
    EXPONENT,
    INERTIA,
    MACHINE_VARIABLES,
    RETURN,
    VARIABLES,
    Variable,
)

if TYPE_CHECKING:
    import xarray as xr

PERIOD, CROSSING = "period", "crossing"
# Packages whose classes their version identifies.
_KNOWN = ("wedgebrake", "pydantic", "builtins", "abc")


@dataclass(frozen=True, eq=False)
class Plan:
    """A system, the grid swept on it, and how the motion of each point is evaluated.

    initial     : (angle [rad], velocity [rad/s]) of a driveline, unless swept
    keep_points : whether the Poincare points are part of the result
    kind        : "sweep", "bifurcation", "regime_map" or "basins"
    as_machine  : whether the points are solved as machines
    """

    system: BrakedDriveline | Machine
    grid: Grid
    protocol: Protocol
    method: str
    initial: tuple[float, float]
    keep_points: bool
    kind: str
    as_machine: bool

    @property
    def variables(self) -> tuple[Variable, ...]:
        """Variables of the result."""
        table = MACHINE_VARIABLES if isinstance(self.system, Machine) else VARIABLES
        if self.as_machine:
            table = {**table, "motion_period": MACHINE_VARIABLES["motion_period"]}
        return tuple(one for one in table.values() if self.keep_points or RETURN not in one.over)

    @property
    def record_size(self) -> int:
        """Number of Poincare points of each point of the grid; 0 if they are not kept."""
        return self.protocol.recorded + 1 if self.keep_points else 0

    @property
    def returns(self) -> str:
        """Dimension of the recorded returns."""
        if not self.as_machine:
            return PERIOD
        system = self.system
        machine = system if isinstance(system, Machine) else system.machine
        return CROSSING if machine.autonomous else PERIOD

    @property
    def inner_sizes(self) -> dict[str, int]:
        """Sizes of the dimensions of variables beside those of the points."""
        sizes = {RETURN: self.record_size}
        if isinstance(self.system, Machine):
            contacts = self.system.contacts
            states = 2 * len(self.system.inertias) + sum(one.actuation.order for one in contacts)
            sizes |= {INERTIA: len(self.system.inertias), CONTACT: len(contacts), EXPONENT: states}
        return sizes

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
        if isinstance(self.system, Machine):
            for dim, parts in ((INERTIA, self.system.inertias), (CONTACT, self.system.contacts)):
                coords[dim] = (np.array([one.name for one in parts]), {"long_name": dim})
        return coords

    def attributes(self) -> dict[str, Any]:
        """Return the attributes of the result."""
        protocol = {
            "periods": self.protocol.first + self.protocol.recorded,
            **({} if isinstance(self.system, Machine) else {"initial": list(self.initial)}),
            "follow": self.grid.follow,
            **({"returns": self.returns} if self.as_machine else {}),
            **self.protocol.as_dict(),
        }
        return {
            "kind": self.kind,
            "wedgebrake_version": __version__,
            "method": self.method,
            "system": json.dumps(self.system.as_dict()),
            **self._groups(),
            "protocol": json.dumps(protocol),
            "axes": json.dumps([axis.dim for axis in self.grid.axes]),
        }

    def _groups(self) -> dict[str, str]:
        """The normalised groups of a driveline, as an attribute."""
        if isinstance(self.system, Machine):
            return {}
        return {"groups": json.dumps(self.system.groups.as_dict())}

    def identity(self) -> dict[str, Any]:
        """Return everything on which the results depend, as values that JSON can represent."""
        return {
            "wedgebrake_version": __version__,
            "kind": self.kind,
            "method": self.method,
            "system": self.system.as_dict(),
            "laws": _laws(self.system),
            "axes": {axis.name: axis.values.tolist() for axis in self.grid.axes},
            "follow": self.grid.follow,
            "initial": list(self.initial),
            "keep_points": self.keep_points,
            "protocol": self.protocol.as_dict(),
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
            coords={name: (name, *one) for name, one in self.coordinates().items()},
            attrs=self.attributes(),
        )


def _laws(system: BrakedDriveline | Machine) -> dict[str, str]:
    """Return fingerprints of user-defined laws, whose names do not reveal a change."""
    if isinstance(system, Machine):
        own: dict[str, list[Callable[..., Any]]] = {}
        for one in system.contacts:
            own[f"{one.name}.brake"] = _own_functions(one.brake)
            own[f"{one.name}.friction"] = _own_functions(one.friction)
        for name, signal in system.signals().items():
            own[name] = _own_functions(signal)
    else:
        own = {"brake": _own_functions(system.brake), "friction": _own_functions(system.friction)}
        if isinstance(system.friction, CustomFriction):
            own["friction"].append(system.friction.law)
    return {part: "-".join(map(fingerprint, laws)) for part, laws in own.items() if laws}


def _own_functions(part: Chosen) -> list[Callable[..., Any]]:
    """Return the functions of a part's class that wedgebrake does not define."""
    classes = (one for one in type(part).__mro__ if one.__module__.partition(".")[0] not in _KNOWN)
    members = [value for one in classes for _, value in sorted(vars(one).items())]
    found = [getattr(one, "__func__", getattr(one, "fget", one)) for one in members]
    return [one for one in found if hasattr(one, "__code__")]


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
