"""Linear stability over any parameters."""

from __future__ import annotations

import itertools
import json
import math
from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from wedgebrake.analysis.linear_stability.machine_stability import (
    Stability,
    machine_stability,
)
from wedgebrake.analysis.linear_stability.sliding_contact import Method
from wedgebrake.analysis.responses.datasets import labelled
from wedgebrake.arrays import FloatArray
from wedgebrake.errors import InputError
from wedgebrake.model.machine import Machine
from wedgebrake.model.studies.sweep_settings import sweepable, tied_names, untied
from wedgebrake.model.system import BrakedDriveline
from wedgebrake.model.units import with_unit
from wedgebrake.model.validation import wrong

if TYPE_CHECKING:
    import xarray as xr

_VARIABLES = {
    "growth_rate": ("1/s", "largest growth rate"),
    "damping_ratio": ("1", "smallest damping ratio"),
    "frequency": ("Hz", "frequency of the mode with the smallest damping ratio"),
    "stable": ("1", "whether sliding exists and small vibration decays"),
    "locked": ("1", "whether a contact locks itself in a direction"),
    "released": ("1", "whether no contact is pressed"),
}


def parameter_map(
    system: BrakedDriveline | Machine, axes: Mapping[str, Any], method: Method
) -> xr.Dataset:
    """``stability_map`` over parameters, point by point."""
    import xarray as xr

    if not axes:
        raise InputError(
            "axes: none given. Give at least one parameter with its values, for example"
            ' {"brake.base_speed": np.linspace(1, 50, 100)}.'
        )
    axes = tied_names(axes)
    allowed = sweepable(system, axes)
    for name in axes:
        if name not in allowed:
            raise InputError(
                f"{name}: not a number of this system. {system.hint(name, list(allowed))}",
                name=name, value=axes[name], allowed=tuple(allowed),
            )  # fmt: skip
    values = {name: axis_values(name, given, allowed[name][0]) for name, given in axes.items()}
    found = [
        _point(machine_stability(system.replace(**_changes(values, point)).machine, method=method))
        for point in itertools.product(*(one.tolist() for one in values.values()))
    ]
    shape = tuple(one.size for one in values.values())
    columns = zip(*found, strict=True)
    return xr.Dataset(
        {
            name: labelled(tuple(values), np.array(column).reshape(shape), *words)
            for (name, words), column in zip(_VARIABLES.items(), columns, strict=True)
        },
        coords={name: labelled(name, one, *allowed[name]) for name, one in values.items()},
        attrs={"system": json.dumps(system.as_dict())},
    )


def _changes(names: Iterable[str], point: Iterable[float]) -> dict[str, float]:
    """Values of the parameters at a point of the map, also of tied ones."""
    return {one: value for name, value in zip(names, point, strict=True) for one in untied(name)}


def _point(found: Stability) -> tuple[float | bool, ...]:
    """Values of ``_VARIABLES`` at a point: the worst over the directions of sliding."""
    modes = [
        mode for case in found.cases if not case.locked for mode in case.modes if not mode.rigid
    ]
    least = min(modes, key=lambda mode: mode.damping_ratio, default=None)
    ratio, frequency = (
        (math.nan, math.nan) if least is None else (least.damping_ratio, least.frequency)
    )
    growth, *verdict = of_all_cases(found)
    return growth, ratio, frequency, *verdict


def of_all_cases(found: Stability) -> tuple[float, bool, bool, bool]:
    """The largest growth rate [1/s], and whether sliding is stable, locked, and released."""
    growth = math.nan if found.growth_rate is None else found.growth_rate
    contacts = () if found.critical is None else found.critical.contacts
    released = bool(contacts) and all(one.released for one in contacts)
    return growth, found.stable, any(case.locked for case in found.cases), released


def axis_values(name: str, given: Any, unit: str = "1") -> FloatArray:
    """The values of an axis of a map, (k,); ``InputError`` for what is no list of numbers."""
    try:
        values = np.atleast_1d(np.asarray(with_unit(name, given, unit), dtype=float))
    except (TypeError, ValueError):
        raise wrong(name, given, "an array of numbers") from None
    if values.ndim != 1 or values.size == 0 or not np.all(np.isfinite(values)):
        raise wrong(name, given, "one-dimensional, finite and not empty")
    return values
