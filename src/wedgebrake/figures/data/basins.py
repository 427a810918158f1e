"""Basins of attraction: which initial state leads to which steady motion."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from wedgebrake.arrays import FloatArray
from wedgebrake.errors import InputError
from wedgebrake.figures.data import class_styles as classes
from wedgebrake.figures.data.axes import SweptAxis, grid_values, require_swept, swept_axes
from wedgebrake.figures.data.class_map import ClassMap, Marks
from wedgebrake.figures.data.limits import Codes
from wedgebrake.sweeps.results import INERTIA, NO_ATTRACTOR

if TYPE_CHECKING:
    import xarray as xr


# Initial conditions of a driveline; those of a machine are "disc.angle" and "disc.speed".
_INITIAL = {"initial_angle": "angle", "initial_velocity": "velocity"}
PARAMETERS = tuple(_INITIAL)
_ENDINGS = {"angle": "angle", "speed": "velocity"}
# Styles of initial states without an attractor, whose numbers are -1, -2, ...
_OUTCOMES = tuple(classes.MOTION_STYLES[name] for name in NO_ATTRACTOR)
MOST = len(classes.ATTRACTOR_COLOURS)
"""Number of attractors that have a colour of their own."""
# Number of points above which an attractor is drawn with smaller points [pt].
_MANY, _SIZE, _SMALLER = 16, 3.2, 1.6
_NEEDED = (
    "attractor",
    *(f"attractor_{one}" for one in ("kind", "order", "share", "angle", "velocity")),
)


def of_dataset(
    dataset: xr.Dataset, known: NDArray[np.bool_] | None = None, *, numbered: bool = True
) -> ClassMap:
    """The basins of a result of ``wb.basins``, in colours from the largest to the smallest.

    known    : (y, x) computed cells; others have the colour of the nearest one. None for all
    numbered : name attractors by their numbers too

    Raises ``InputError`` for anything else.
    """
    _check(dataset)
    x, y = swept_axes(dataset)
    numbers = grid_values(dataset["attractor"], x, y)
    counted = numbers if known is None else numbers[known]
    numbers = numbers if known is None else nearest_known(numbers, known)
    motions, orders, shares = (dataset[name].to_numpy() for name in _NEEDED[1:4])
    ranked = np.argsort(-shares, kind="stable")
    names = [
        f"{one}: " * numbered + classes.motion_label(int(motions[one]), int(orders[one]))
        for one in ranked
    ]
    pairs = zip(names, classes.ATTRACTOR_COLOURS, strict=False)
    styles = [classes.ClassStyle(name, colour) for name, colour in pairs]
    others = len(names) - len(styles)
    if others > 0:
        styles.append(classes.ClassStyle(f"{others} others", classes.OTHER_ATTRACTORS))
    table = (*styles, *_OUTCOMES)

    def coded(given: NDArray[Any]) -> Codes:
        """Positions in the table: of attractors, and of the numbers -1, -2, ..."""
        places = np.argsort(ranked)[np.maximum(given, 0)] if ranked.size else 0 * given
        return np.where(given >= 0, np.minimum(places, MOST), len(styles) - 1 - given)

    legend = classes.class_entries(coded(counted), table, shares=True)
    if names:
        hollow = classes.MarkerStyle("o", _SIZE, "white", "black", 0.6)
        legend.append(classes.LegendEntry("points of attractors", hollow))
    across, up = (_points(dataset, axis.name) for axis in (x, y))
    marks = tuple(
        _marks(number, np.column_stack((across[number], up[number])), x, y, style.colour)
        for number, style in zip(ranked, styles[:MOST], strict=False)
    )
    return ClassMap(x, y, coded(numbers), table, legend, marks=marks)


def _marks(number: int, points: FloatArray, x: SweptAxis, y: SweptAxis, colour: str) -> Marks:
    """The points of an attractor inside the picture; smaller ones where there are many."""
    points = points[np.isfinite(points).all(axis=1)]
    size = _SMALLER if len(points) > _MANY else _SIZE
    low, high = ([axis.edges[end] for axis in (x, y)] for end in (0, -1))
    inside = np.all((points >= low) & (points <= high), axis=1)
    return Marks(str(number), points[inside], classes.MarkerStyle("o", size, colour, "black", 0.5))


def nearest_known(values: Codes, known: NDArray[np.bool_]) -> Codes:
    """Values over (y, x), with the value of the nearest known cell where a cell is not known."""
    from scipy.ndimage import distance_transform_edt

    if known.all():
        return values
    nearest: Any = distance_transform_edt(~known, return_distances=False, return_indices=True)
    found: Codes = values[tuple(nearest)]
    return found


def _check(dataset: Any) -> None:
    names = require_swept(dataset, 2)
    complete = all(name in dataset.data_vars for name in _NEEDED)
    if not complete or not all(_place(dataset, name) for name in names):
        raise InputError(
            f"dataset: is swept over {', '.join(names)}, without attractors of initial conditions."
            " Use the result of wb.basins(...); for another sweep over two parameters use"
            " wedgebrake.figures.matplotlib.maps.regime_map."
        )


def _place(dataset: xr.Dataset, name: str) -> tuple[str, str | None] | None:
    """Where an initial condition is among the points: "angle" or "velocity", and the inertia."""
    if INERTIA not in dataset.dims:
        return (_INITIAL[name], None) if name in _INITIAL else None
    inertia, _, ending = name.rpartition(".")
    known = inertia in dataset[INERTIA].to_numpy() and ending in _ENDINGS
    return (_ENDINGS[ending], inertia) if known else None


def _points(dataset: xr.Dataset, name: str) -> FloatArray:
    """(attractor, point) an initial condition at the points of the attractors."""
    place = _place(dataset, name)
    assert place is not None  # noqa: S101 - checked before
    quantity, inertia = place
    values = dataset[f"attractor_{quantity}"]
    values = values if inertia is None else values.sel({INERTIA: inertia})
    return np.asarray(values.transpose("attractor_id", "orbit_point").to_numpy(), dtype=float)
