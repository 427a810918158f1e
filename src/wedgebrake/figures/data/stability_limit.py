"""The limit of linear stability over two parameters: where the damping of sliding changes sign."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any, cast

import numpy as np
from numpy.typing import NDArray

from wedgebrake.analysis.linear_stability import DrivelineStability, linearisation_of, stability
from wedgebrake.arrays import FloatArray
from wedgebrake.errors import InputError
from wedgebrake.figures.data import caption
from wedgebrake.figures.data.axes import SweptAxis, grid_values
from wedgebrake.model.studies.study import parse_study
from wedgebrake.model.system import INITIAL

if TYPE_CHECKING:
    import xarray as xr

    from wedgebrake.model.system import BrakedDriveline


def limit_lines(dataset: xr.Dataset, x: SweptAxis, y: SweptAxis) -> list[FloatArray]:
    """Lines of the limit of linear stability, (n, 2) each, as positions along x and y.

    They reach to the edges of the outer cells. Where the dataset states its machine, they end
    where the brake locks itself. Sweeps of machines have none.
    """
    if "sliding_damping" not in dataset:
        return []
    values = grid_values(dataset["sliding_damping"], x, y)
    evaluate = _stability_at(dataset, x, y)
    if evaluate is not None:
        values = _margins(values, lambda up, across: evaluate(x.values[across], y.values[up]))
    if not np.any(_beside_changes(values)):
        return []
    # Continue to the edges of the outer cells, as level lines end at the last points.
    for axis, along in ((y, 0), (x, 1)):
        values = _extrapolated(values, axis, along)
    xs, ys = (np.concatenate((a.edges[:1], a.values, a.edges[-1:])) for a in (x, y))
    return [
        np.column_stack((x.positions(line[:, 0]), y.positions(line[:, 1])))
        for line in level_lines(xs, ys, values, 0.0)
    ]


def _margins(
    damping: FloatArray, stability_at: Callable[[int, int], DrivelineStability | None]
) -> FloatArray:
    """The margin in the slope near changes of the damping's sign, nan elsewhere.

    stability_at : linear stability at a row and a column, None where there is none

    Towards self-locking the damping grows without bound, and the smaller of both directions has a
    kink; the margin has the same sign and is smooth. Where the brake locks itself both jump to
    those of backward sliding, without a zero: nan there. The damping itself is used if one of the
    points has no margin, for example if the brake is released at the speed of the shaft.
    """
    from scipy.ndimage import binary_dilation

    # Their neighbours too, including diagonal ones.
    chosen = binary_dilation(_beside_changes(damping), np.ones((3, 3))) & np.isfinite(damping)
    sliding, found = damping.copy(), np.full(damping.shape, np.nan)
    for place in np.argwhere(chosen):
        up, across = int(place[0]), int(place[1])
        one = stability_at(up, across)
        if one is not None and one.forward.locked:
            sliding[up, across] = np.nan
        elif one is not None and one.margin_slope is not None:
            found[up, across] = one.margin_slope
    chosen &= np.isfinite(sliding)
    alike = np.isfinite(found) & ((found > 0.0) == (sliding > 0.0))
    return found if np.all(alike[chosen]) else sliding


def _beside_changes(values: FloatArray) -> NDArray[np.bool_]:
    """Mask of the points with a neighbour of the other sign along either parameter."""
    from scipy.ndimage import binary_dilation

    stable, unstable = values > 0.0, values <= 0.0
    beside: NDArray[np.bool_] = stable & binary_dilation(unstable)
    beside |= unstable & binary_dilation(stable)
    return beside


def _extrapolated(values: FloatArray, axis: SweptAxis, along: int) -> FloatArray:
    """Values continued linearly from the outer points to the outermost edges of an axis."""
    places, edges = axis.positions(axis.values), axis.positions(axis.edges)
    values = np.moveaxis(values, along, 0)
    ends = []
    for end, inner in ((0, 1), (-1, -2)):
        step = places[inner] - places[end] if places.size > 1 else 0.0
        share = (edges[end] - places[end]) / step if step else 0.0
        ends.append(values[end] + share * (values[inner] - values[end]) if share else values[end])
    return np.moveaxis(np.concatenate((ends[0][None], values, ends[1][None])), 0, along)


def _stability_at(
    dataset: xr.Dataset, x: SweptAxis, y: SweptAxis
) -> Callable[[float, float], DrivelineStability | None] | None:
    """Linear stability as a function of x and y; None if the dataset does not state its machine."""
    try:
        tables = dict(json.loads(dataset.attrs["system"]))
        # Sliding does not depend on static friction; without it, it follows kinetic friction.
        friction = {key: one for key, one in tables["friction"].items() if key != "static"}
        system = cast("BrakedDriveline", parse_study({**tables, "friction": friction}).system)
    except (AttributeError, KeyError, TypeError, ValueError):  # an InputError is a ValueError
        return None
    method = linearisation_of(dataset.attrs.get("method", "exact"))
    fixed = {name: float(dataset[name]) for name in caption.fixed_parameters(dataset)}

    def evaluate(across: float, up: float) -> DrivelineStability | None:
        values = {**fixed, x.name: across, y.name: up}
        changes = {caption.swept_name(n): value for n, value in values.items() if n not in INITIAL}
        try:
            return stability(system.replace(**changes), method=method)
        except InputError:
            return None

    return evaluate


def level_lines(x: FloatArray, y: FloatArray, values: FloatArray, level: float) -> list[FloatArray]:
    """Lines, (n, 2) each, along which values over (y, x) have a level; NaN interrupts them."""
    from contourpy import contour_generator

    if min(values.shape) < 2 or not np.isfinite(values).any():
        return []
    found: Sequence[Any] = contour_generator(x, y, np.ma.masked_invalid(values)).lines(level)
    return list(found)
