"""Maps of linear stability, over the normalised groups of a driveline or over parameters."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, cast

import numpy as np
from numpy.typing import ArrayLike

from wedgebrake.analysis.linear_stability.one_inertia import (
    driveline_stability,
    has_closed_form,
)
from wedgebrake.analysis.linear_stability.parameter_map import (
    axis_values,
    of_all_cases,
    parameter_map,
)
from wedgebrake.analysis.linear_stability.sliding_contact import (
    CURVE,
    Method,
    check_method,
    frozen,
)
from wedgebrake.arrays import FloatArray
from wedgebrake.errors import InputError
from wedgebrake.model.brakes import WedgeBrake
from wedgebrake.model.machine import Machine
from wedgebrake.model.studies.sweep_settings import joined
from wedgebrake.model.system import BrakedDriveline
from wedgebrake.model.validation import check_instance, wrong

if TYPE_CHECKING:
    import xarray as xr


AXES = ("eta", "alpha", "kinetic", "loss_factor")
"""Groups over which a map is one of margins: all that linear stability depends on."""


def stability_map(
    system: BrakedDriveline | Machine, over: Mapping[str, ArrayLike] | None = None, *,
    method: Method = CURVE, **axes: ArrayLike,
) -> xr.Dataset:  # fmt: skip
    """Linear stability over a grid of groups or parameters, as ``stability`` for each point.

    system : the system whose groups or parameters are varied
    over   : the axes as a mapping, instead of keywords, for dotted names such as
             {"brake.base_speed": np.linspace(1, 50, 100)}
    axes   : any parameters, each with an array of values in the unit of its field; the dimensions
             of the result are in this order. Over groups of a driveline alone, which are eta, alpha
             (wedge brake), kinetic and loss_factor, it is a map of margins; all other groups, the
             drive speed and the actuation are those of the system
    method : how varying friction is linearised, as for ``wb.stability``

    Returns a dataset with these variables over those dimensions, over groups: ``margin``
    (smallest margin in eta [1]; nan if the brake is released at the speed of the shaft),
    ``stable``, ``growth`` (largest real part divided by the natural frequency [1]), ``locked``
    (the brake locks itself in a direction, so that only the other one counts) and ``released``
    (the brake is not pressed at the speed of the shaft: the verdict is that of the shaft alone).

    Over other parameters: ``growth_rate`` (largest [1/s]; nan if no sliding exists),
    ``damping_ratio`` (smallest of all modes that are not rigid, negative where one grows),
    ``frequency`` (of that mode [Hz]), ``stable``, ``locked`` (a contact locks itself in a
    direction) and ``released`` (no contact is pressed), each over all directions of sliding that
    are possible at the initial speeds.

    With constant friction and a force that acts at once, the whole grid of a driveline is computed
    in one step; otherwise point by point, at some thousands of points per second.

    Raises ``InputError`` for any other system, for unknown axes, and for empty, invalid or
    non-finite values.
    """
    axes = joined(over, axes)
    chosen = check_method(method)
    check_instance("system", system, BrakedDriveline | Machine, "a BrakedDriveline or a Machine")
    if "eta" not in system.names() or not all(name in AXES for name in axes):
        return parameter_map(system, axes, chosen)
    return _group_map(cast("BrakedDriveline", system), axes, chosen)


def _group_map(line: BrakedDriveline, axes: dict[str, ArrayLike], method: Method) -> xr.Dataset:
    """Map of margins over groups of a driveline."""
    import xarray as xr

    values = _grid(line, axes)
    found = _map_at_once(line, values) if has_closed_form(line) else _map(line, values, method)
    shape = np.broadcast_shapes(*(np.shape(v) for v in values.values()))
    return xr.Dataset(
        {name: (tuple(axes), np.broadcast_to(array, shape)) for name, array in found.items()},
        coords={name: np.ravel(values[name]) for name in axes},
        attrs={
            "brake": line.brake.kind,
            "system": json.dumps(line.as_dict()),
            "groups": json.dumps(line.groups.as_dict()),
        },
    )


def _grid(system: BrakedDriveline, axes: dict[str, ArrayLike]) -> dict[str, FloatArray]:
    """Values of the groups, to be broadcast: arrays for the axes, scalars of the system."""
    if not axes:
        raise InputError(f"axes: none given. Give at least one of {', '.join(AXES)}.")
    arrays = np.meshgrid(*map(_axis, axes, axes.values()), indexing="ij", sparse=True)
    values: dict[str, FloatArray] = dict(zip(axes, arrays, strict=True))
    if "alpha" in values and not isinstance(system.brake, WedgeBrake):
        raise InputError("alpha: an axis of wedge brakes only. Use kinetic or eta.")
    for name in ("eta", "kinetic", "loss_factor"):
        if name not in values:
            stated = getattr(system.groups, name)
            if stated is None:
                raise InputError(
                    f"groups.{name}: not defined for this system, so that a map over"
                    f" {', '.join(axes)} has no meaning. Give {name} as an axis."
                )
            values[name] = np.asarray(stated)
    return values


def _map_at_once(system: BrakedDriveline, values: dict[str, FloatArray]) -> dict[str, FloatArray]:
    """Variables of a map with constant friction, whose damping is c (1 + eta/D)."""
    line = system.driveline
    eta, kinetic, loss = (values[name] for name in ("eta", "kinetic", "loss_factor"))
    drive, first = frozen(line.drive_speed), frozen(system.actuation.initial_force)
    forward, backward = _widths(system, values)
    damping = loss * math.sqrt(line.stiffness * line.inertia)
    slope = eta * damping / (system.brake.radius * kinetic)
    force = first + slope * abs(drive)
    limit = (force == 0.0) & (slope > 0.0) & (drive == 0.0)  # pressed next to rest
    pressed = (force > 0.0) | limit | (not system.actuation.release)
    ways = [
        np.where(~(one > 0.0) & pressed, np.nan, one)
        for one, side in ((forward, 1.0), (backward, -1.0))
        if drive * side >= 0.0
    ]
    widths = np.broadcast_arrays(*ways)
    growth = [_growth(loss, np.where(pressed, eta, 0.0), width) for width in widths]
    margin = np.where(pressed, eta + np.fmin.reduce(widths), np.nan)
    return {
        "margin": margin,
        # Without a spring a damping in multiples of sqrt(kJ) is zero.
        "stable": np.where(pressed, margin > 0.0, True) & (line.stiffness > 0.0),
        "growth": np.fmax.reduce(growth),
        "locked": np.any(np.isnan(widths), axis=0),
        "released": ~pressed,
    }


def _map(
    system: BrakedDriveline, values: dict[str, FloatArray], method: Method
) -> dict[str, FloatArray]:
    """Variables of a map, point by point."""
    grid = np.broadcast_arrays(*values.values())
    line, ratio = system.driveline, system.groups.static_ratio
    impedance = math.sqrt(line.stiffness * line.inertia)
    natural = line.natural_frequency or math.nan
    found = []
    for numbers in zip(*(one.ravel().tolist() for one in grid), strict=True):
        point = dict(zip(values, numbers, strict=True))
        changes: dict[str, Any] = {k: point[k] for k in ("eta", "alpha") if k in point}
        changes["damping"] = point["loss_factor"] * impedance
        if point["kinetic"] != system.friction.reference:
            changes["kinetic"] = point["kinetic"]
            if ratio is not None and "static" in type(system.friction).model_fields:
                changes["static"] = ratio * point["kinetic"]
        one = driveline_stability(system.replace(**changes), method)
        margin = math.nan if one.margin_eta is None else one.margin_eta
        growth, stable, locked, released = of_all_cases(one)
        found.append((margin, stable, growth / natural, locked, released))
    names = ("margin", "stable", "growth", "locked", "released")
    columns = zip(names, zip(*found, strict=True), strict=True)
    return {name: np.array(one).reshape(grid[0].shape) for name, one in columns}


def _axis(name: str, given: ArrayLike) -> FloatArray:
    array = axis_values(name, given)
    if name != "eta" and array.min() <= 0.0:
        raise wrong(name, float(array.min()), "greater than 0 at all its values")
    return array


def _widths(system: BrakedDriveline, values: dict[str, Any]) -> tuple[FloatArray, FloatArray]:
    """D of both directions; zero or negative if the brake locks itself."""
    kinetic = values["kinetic"]
    if isinstance(system.brake, WedgeBrake):
        tangent = values["alpha"] * kinetic if "alpha" in values else math.tan(system.brake.angle)
        return tangent - kinetic, tangent + kinetic
    gain = np.vectorize(system.brake.amplification, otypes=[float])
    return kinetic / gain(kinetic), kinetic / -gain(-kinetic)


def _growth(loss: FloatArray, eta: FloatArray, width: FloatArray) -> FloatArray:
    """Largest real part of h +- sqrt(h^2 - 1), h over the natural frequency."""
    h = -0.5 * loss * (1.0 + eta / width)
    with np.errstate(divide="ignore", over="ignore"):
        root = np.sqrt(np.maximum(h * h - 1.0, 0.0))
        # h + root, written as 1/(h - root) where the sum of real roots would cancel.
        return np.asarray(np.where((root > 0.0) & (h < 0.0), 1.0 / (h - root), h + root))
