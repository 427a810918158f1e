"""What a sweep computes, whole: sent to workers, and compared when a store is resumed."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable
from dataclasses import dataclass
from types import CodeType
from typing import Any

import numpy as np

from wedgebrake._version import __version__
from wedgebrake.analysis.run_settings import Protocol
from wedgebrake.model.friction import CustomFriction
from wedgebrake.model.system import BrakedDriveline
from wedgebrake.sweeps.grid import BRANCH, BRANCHES, Grid
from wedgebrake.sweeps.results import VARIABLES, Variable
from wedgebrake.sweeps.store_layout import Layout


@dataclass(frozen=True, eq=False)
class Plan:
    """A system, the grid swept on it, and how each point is judged.

    initial     : (angle [rad], velocity [rad/s]) where the grid does not say otherwise
    keep_points : whether the Poincare points are part of the result
    kind        : "sweep", "bifurcation", "regime_map" or "basins"
    """

    system: BrakedDriveline
    grid: Grid
    protocol: Protocol
    method: str
    initial: tuple[float, float] = (0.0, 0.0)
    keep_points: bool = True
    kind: str = "sweep"

    @property
    def variables(self) -> tuple[Variable, ...]:
        """What is computed."""
        kept = VARIABLES.values()
        return tuple(one for one in kept if self.keep_points or not one.per_period)

    def layout(self, target: int) -> Layout:
        """How the result is laid out, in chunks of about ``target`` points."""
        dims = dict(self.grid.sizes)
        coords: dict[str, tuple[Any, dict[str, Any]]] = {
            axis.dim: (axis.values, axis.attributes()) for axis in self.grid.axes
        }
        if self.grid.follow is not None:
            way = f"direction in which {self.grid.follow} was followed"
            coords[BRANCH] = (np.array(BRANCHES), {"long_name": way})
        if self.keep_points:
            dims["period"] = self.protocol.recorded + 1
            automatic = self.protocol.automatic
            coords["period"] = (
                np.arange(dims["period"]) + self.protocol.first,
                {
                    "units": "1",
                    "long_name": "number of periods" + (" after settling" if automatic else ""),
                },
            )
        return Layout(
            dims=dims,
            variables=[(one, self.dims(one)) for one in self.variables],
            coords=coords,
            chunks=self.grid.chunk_shape(target),
            attrs=self.attributes(),
        )

    def dims(self, variable: Variable) -> tuple[str, ...]:
        """Dimensions of a variable of the result."""
        return (*self.grid.sizes, "period") if variable.per_period else tuple(self.grid.sizes)

    def attributes(self) -> dict[str, Any]:
        """Attributes of the result."""
        protocol = {
            "periods": self.protocol.first + self.protocol.recorded,
            "initial": list(self.initial),
            "follow": self.grid.follow,
            **self.protocol.as_dict(),
        }
        return {
            "kind": self.kind,
            "wedgebrake_version": __version__,
            "method": self.method,
            "system": json.dumps(self.system.as_dict()),
            "groups": json.dumps(self.system.groups.as_dict()),
            "protocol": json.dumps(protocol),
            "axes": json.dumps([axis.dim for axis in self.grid.axes]),
        }

    def identity(self) -> dict[str, Any]:
        """Everything that the results depend on, as plain values."""
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


def _laws(system: BrakedDriveline) -> dict[str, str]:
    """Fingerprints of the laws that a user wrote: their names would not tell a change."""
    laws: dict[str, Any] = {}
    if not system.brake.kind:
        laws["brake"], laws["shape"] = type(system.brake).law, type(system.brake).shape
    if isinstance(system.friction, CustomFriction):
        laws["friction"] = system.friction.law
    return {part: _fingerprint(law) for part, law in laws.items()}


def _fingerprint(law: Callable[..., Any]) -> str:
    """What a function does, as a short text that is the same in every process."""
    return hashlib.sha256(repr(_told(law, [])).encode()).hexdigest()[:16]


def _told(value: Any, known: list[Any]) -> Any:
    """A value in words; of a function its code, and the values that it uses."""
    function = getattr(value, "py_func", value)
    code = getattr(function, "__code__", None)
    if isinstance(value, np.ndarray):
        return value.tolist()
    if code is None:
        # Of an object, what it is; its address would differ from process to process.
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
        [(name, _told(one, [*known, function])) for name, one in used],
    )


def _codes(code: CodeType) -> list[CodeType]:
    """A code and those inside it."""
    inner = [one for one in code.co_consts if isinstance(one, CodeType)]
    return [code, *(deeper for one in inner for deeper in _codes(one))]


def _constant(value: Any) -> str:
    return value.co_name if isinstance(value, CodeType) else repr(value)
