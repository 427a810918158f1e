"""Datasets of derivatives with respect to parameters."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from wedgebrake.analysis.derivatives.measures import MEASURES, Found
from wedgebrake.arrays import FloatArray
from wedgebrake.model.machine import Machine
from wedgebrake.model.system import BrakedDriveline

if TYPE_CHECKING:
    import xarray as xr

    from wedgebrake.solvers.machine.tangents import Parameter

_TIED = (
    "derivatives are nan if two extremes are equal and change differently, if the time of a jump"
    " has no derivative, if a root mean square is 0, or if the measure jumps at this value."
)


def over_parameters(
    system: BrakedDriveline | Machine, parameters: Sequence[Parameter]
) -> dict[str, Any]:
    """Coordinates of the parameters: their names and units."""
    names = [one.name for one in parameters]
    units = [system.quantities()[name].unit for name in names]
    return {"parameter": ("parameter", names), "parameter_unit": ("parameter", units)}


def one_sided(sides: FloatArray) -> Any:
    """Return the variable ``one_sided``: the side of each parameter on which derivatives hold."""
    return (
        ("parameter",), sides.astype(np.int8),
        {"units": "1", "long_name": "side of the derivative", "flag_values": [-1, 0, 1],
         "flag_meanings": "smaller_values both larger_values"},
    )  # fmt: skip


def values_of(parameters: Sequence[Parameter]) -> str:
    """The values of the parameters, as an attribute."""
    return json.dumps({one.name: one.value for one in parameters})


def of_measures(
    system: BrakedDriveline | Machine,
    parameters: Sequence[Parameter],
    found: Mapping[str, Found],
    further: Mapping[str, tuple[str | None, str, str, Found]] | None = None,
) -> tuple[xr.Dataset, str]:
    """Dataset of measures and their derivatives, and a sentence on those without a derivative.

    further : other numbers: dimension, unit, meaning, and values with derivatives
    """
    import xarray as xr

    table = dict(further or {}) | {
        name: (MEASURES[name].dim, MEASURES[name].unit, MEASURES[name].meaning, one)
        for name, one in found.items()
    }
    parts, single = system.machine.parts_along, {**system.view.single}
    if single:
        single["torque"] = ""
    variables: dict[str, Any] = {}
    used: dict[str, Any] = {}
    for name, (dim, unit, meaning, (values, changes)) in table.items():
        dims: tuple[str, ...] = () if dim is None else (dim,)
        by = np.moveaxis(changes, -1, 0)
        if dim in single:
            dims, values, by = (), values.sum(axis=0), by.sum(axis=1)
        elif dim is not None:
            used[dim] = np.array([one.name for one in parts[dim]], str)
        attrs = {"units": unit, "long_name": f"derivative of the {meaning}"}
        variables[name] = (("parameter", *dims), by, attrs)
        variables[f"{name}_value"] = (dims, values, {"units": unit, "long_name": meaning})
    without = [name for name, (*_, (_, by)) in table.items() if not np.all(np.isfinite(by))]
    note = f" {', '.join(without)}: {_TIED}" if without else ""
    return xr.Dataset(variables, over_parameters(system, parameters) | used), note
