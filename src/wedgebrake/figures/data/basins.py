"""Basins of attraction: which initial state leads to which steady motion."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from wedgebrake.errors import InputError
from wedgebrake.figures.data import class_styles as classes
from wedgebrake.figures.data.axes import SweptAxis, arranged, require_swept, swept_axes
from wedgebrake.figures.data.class_map import ClassMap, Marks
from wedgebrake.sweeps.results import INERTIA

if TYPE_CHECKING:
    import xarray as xr

FloatArray = NDArray[np.float64]
Codes = NDArray[np.int64]

# Initial conditions of a driveline; those of a machine are "disc.angle" and "disc.speed".
_INITIAL = {"initial_angle": "angle", "initial_velocity": "velocity"}
PARAMETERS = tuple(_INITIAL)
_ENDINGS = {"angle": "angle", "speed": "velocity"}
# Styles of initial states without an attractor, by the numbers -1, -2, ... of ``wb.basins``.
_OUTCOMES = tuple(
    classes.MOTION_STYLES[name] for name in ("undecided", "diverged", "self_locked", "not_computed")
)
MOST = len(classes.ATTRACTOR_COLOURS)
"""Number of attractors that have a colour of their own."""
# Number of points above which an attractor is drawn with smaller points [pt].
_MANY, _SIZE, _SMALLER = 16, 3.2, 1.6
_NEEDED = (
    "attractor",
    *(f"attractor_{one}" for one in ("kind", "order", "share", "angle", "velocity")),
)


@dataclass(frozen=True, eq=False)
class Attractor:
    """One attractor.

    share  : of all initial states
    points : of its Poincare section, as values of both initial conditions, (n, 2)
    """

    number: int
    motion: int
    order: int
    share: float
    points: FloatArray


def of_dataset(dataset: xr.Dataset) -> ClassMap:
    """The basins of a result of ``wb.basins``.

    Raises ``InputError`` for anything else.
    """
    _check(dataset)
    x, y = swept_axes(dataset)
    motions, orders, shares = (dataset[name].to_numpy() for name in _NEEDED[1:4])
    across, up = (_points(dataset, axis.name) for axis in (x, y))
    attractors = []
    for number in range(motions.size):
        points = np.column_stack((across[number], up[number]))
        known = points[np.isfinite(points).all(axis=1)]
        numbers = int(motions[number]), int(orders[number]), float(shares[number])
        attractors.append(Attractor(number, *numbers, known))
    return basins(x, y, arranged(dataset["attractor"], x, y), attractors)


def basins(
    x: SweptAxis,
    y: SweptAxis,
    numbers: Codes,
    attractors: Sequence[Attractor],
    *,
    known: NDArray[np.bool_] | None = None,
    numbered: bool = True,
) -> ClassMap:
    """Basins of attractors, in colours from the largest share to the smallest, with their points.

    numbers  : of the attractor of each cell, (y, x); below 0 as ``wb.basins`` gives them
    known    : cells that count for the shares in the legend; None for all
    numbered : name attractors by their numbers too
    """
    ranked = sorted(attractors, key=lambda one: -one.share)  # stable
    coloured = list(zip(ranked, classes.ATTRACTOR_COLOURS, strict=False))
    styles = [
        classes.ClassStyle(
            f"{one.number}: " * numbered + classes.motion_label(one.motion, one.order), colour
        )
        for one, colour in coloured
    ]
    others = len(ranked) - MOST
    if others > 0:
        styles.append(classes.ClassStyle(f"{others} others", classes.OTHER_ATTRACTORS))
    first = len(styles)
    codes = np.full(numbers.shape, first, dtype=np.int64)  # undecided, for any other number
    for place, one in enumerate(ranked):
        codes[numbers == one.number] = min(place, MOST)
    for place in range(len(_OUTCOMES)):
        codes[numbers == -1 - place] = first + place
    table = (*styles, *_OUTCOMES)
    legend = classes.class_entries(codes if known is None else codes[known], table, shares=True)
    if ranked:
        hollow = classes.MarkerStyle("o", _SIZE, "white", "black", 0.6)
        legend.append(classes.LegendEntry("points of attractors", hollow))
    low, high = ([axis.edges[end] for axis in (x, y)] for end in (0, -1))
    visible = {}
    for one in ranked:
        points = one.points
        visible[one.number] = points[np.all((points >= low) & (points <= high), axis=1)]
    marks = tuple(
        Marks(
            str(one.number),
            visible[one.number],
            classes.MarkerStyle(
                "o", _SMALLER if len(one.points) > _MANY else _SIZE, colour, "black", 0.5
            ),
        )
        for one, colour in coloured
    )
    return ClassMap(x, y, codes, table, legend, marks=marks)


def _check(dataset: Any) -> None:
    names = require_swept(dataset, 2)
    missing = [name for name in _NEEDED if name not in dataset.data_vars]
    if missing:
        raise InputError(
            f"dataset: has no {missing[0]}, so there are no basins to draw. Use the result of"
            " wb.basins(...); for another sweep over two parameters use"
            " wedgebrake.figures.matplotlib.maps.regime_map."
        )
    if not all(_place(dataset, name) for name in names):
        raise InputError(
            f"dataset: is swept over {', '.join(names)}, but basins need two initial conditions,"
            " such as initial_angle and initial_velocity. Use the result of wb.basins(...)."
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
