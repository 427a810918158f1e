"""The bifurcation diagram: Poincare points, classes and exponents over one parameter."""

from __future__ import annotations

from dataclasses import dataclass
from operator import itemgetter
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from wedgebrake.arrays import FloatArray
from wedgebrake.errors import InputError
from wedgebrake.figures import style
from wedgebrake.figures.data import caption
from wedgebrake.figures.data import class_styles as classes
from wedgebrake.figures.data.axes import SweptAxis, require_swept
from wedgebrake.figures.data.limits import Codes, limits_of_points
from wedgebrake.figures.data.parts import with_one_part

if TYPE_CHECKING:
    import xarray as xr


# Smallest difference of periodic motions on two branches, as a share of the picture's height.
_DIFFERS = 0.02


@dataclass(frozen=True, eq=False)
class SweepBranch:
    """One branch, or a whole sweep without branches.

    name      : "up" or "down"; empty for the whole
    direction : which parameter increases or decreases; empty for the whole
    dataset   : its points
    """

    name: str
    direction: str
    dataset: xr.Dataset

    @property
    def shades(self) -> tuple[str, ...]:
        """The colours of its points, from few to many."""
        return style.DENSITY_DOWN if self.name == "down" else style.DENSITY

    @property
    def colour(self) -> str:
        """The colour of its lines."""
        return style.VERMILLION if self.name == "down" else style.BLUE


def split(dataset: xr.Dataset) -> list[SweepBranch]:
    """The branches of a dataset: several, a selected branch, or the whole dataset."""
    if "branch" not in dataset.coords:
        return [SweepBranch("", "", dataset)]
    parts = [dataset]
    if "branch" in dataset.dims:
        parts = [dataset.isel(branch=place) for place in range(dataset.sizes["branch"])]
    names = [str(part["branch"].item()) for part in parts]
    return [
        SweepBranch(name, caption.direction(part, name), part)
        for name, part in zip(names, parts, strict=True)
    ]


@dataclass(frozen=True, eq=False)
class SweepDiagram:
    """A sweep over one parameter, in ascending order of it, with the classes of its motions.

    motions, sticks : codes of the classes, (branch, n)
    orders          : (branch, n)
    """

    x: SweptAxis
    branches: list[SweepBranch]
    motions: Codes
    orders: Codes
    sticks: Codes

    @classmethod
    def read(cls, dataset: xr.Dataset) -> SweepDiagram:
        """The diagram of a dataset; of a machine, with one inertia and one contact.

        Raises ``InputError`` for a dataset that is not a sweep over one parameter.
        """
        dataset = with_one_part(dataset)
        (name,) = require_swept(dataset, 1)
        branches = split(dataset.sortby(name))
        motions, sticks, orders = (
            np.stack([values(one.dataset).to_numpy() for one in branches]).astype(np.int64)
            for values in (classes.motion_codes, classes.stick_codes, itemgetter("order"))
        )
        return SweepDiagram(SweptAxis.of(dataset, name), branches, motions, orders, sticks)

    def rows(self, name: str) -> FloatArray:
        """A result over the branches and the parameter, and further dimensions."""
        found = [one.dataset[name].transpose(self.x.name, ...) for one in self.branches]
        return np.stack([one.to_numpy() for one in found]).astype(float)

    def class_legends(self) -> list[tuple[str, list[classes.LegendEntry]]]:
        """Legends of the bands of classes, with their headings."""
        return [
            ("motion", classes.class_entries(self.motions, classes.MOTIONS, shares=False)),
            ("sticks", classes.class_entries(self.sticks, classes.STICK_CLASSES, shares=False)),
        ]


@dataclass(frozen=True, eq=False)
class BifurcationDiagram(SweepDiagram):
    """Poincare points, or a result, and exponents over one parameter.

    quantity        : "velocity", "angle", or the name of a result
    points          : of the quantity, (branch, n, period), or (branch, n, 1) of a result
    exponent, error : (branch, n)
    differs         : mask of the values at which the branches differ, (n,)
    limits          : values where sliding becomes stable or unstable, True if stable beyond
    low, high       : limits of the quantity's axis
    """

    quantity: str
    points: FloatArray
    exponent: FloatArray
    error: FloatArray
    differs: NDArray[np.bool_]
    limits: list[tuple[float, bool]]
    low: float
    high: float

    @classmethod
    def of(cls, dataset: xr.Dataset, quantity: str) -> BifurcationDiagram:
        """The diagram of a dataset.

        Raises ``InputError`` as ``read``, and for a dataset without points of the quantity.
        """
        swept = SweepDiagram.read(dataset)
        if quantity in style.SECTION:
            _check_points(swept.branches[0].dataset, quantity)
        points = swept.rows(quantity)
        points = points.reshape(*points.shape[:2], -1)
        low, high = _span(points, swept.motions, signed=quantity in style.SECTION)
        return cls(
            **vars(swept),
            quantity=quantity,
            points=points,
            exponent=swept.rows("largest_exponent"),
            error=swept.rows("exponent_error"),
            differs=_differing(points, swept.motions, swept.orders, _DIFFERS * (high - low)),
            limits=_limits(swept),
            low=low,
            high=high,
        )

    @property
    def empty(self) -> NDArray[np.bool_]:
        """Mask of the values without points, (branch, n)."""
        none: NDArray[np.bool_] = ~np.any(np.isfinite(self.points), axis=2)
        return none

    def legends(self, *, exponent: bool) -> list[tuple[str, list[classes.LegendEntry]]]:
        """Legends of the bands of classes, with their headings, and of other marks.

        exponent : True if the exponents are drawn too
        """
        marks = [classes.LIMIT_ENTRY] if self.limits else []
        marks += [classes.class_entry(classes.DIFFER)] if np.any(self.differs) else []
        marks += [classes.class_entry(classes.EMPTY)] if np.any(self.empty) else []
        if exponent and len(self.branches) > 1:
            marks += [
                classes.LegendEntry(
                    f"{one.direction} (exponent)", classes.LineStyle(one.colour, 0.9)
                )
                for one in self.branches
            ]
        return [*self.class_legends(), ("", marks)]


def _check_points(dataset: xr.Dataset, quantity: str) -> None:
    """Raise ``InputError`` unless the dataset has Poincare points of the quantity."""
    if quantity not in dataset.data_vars or "period" not in dataset[quantity].dims:
        raise InputError(
            f"dataset: has no {quantity} over period, so there are no Poincare points to draw."
            " Use wb.bifurcation(...) or wb.sweep(...), which keep them."
        )


def _span(points: FloatArray, motions: Codes, *, signed: bool) -> tuple[float, float]:
    """Lowest and highest value shown: of all points except those of runs that diverged.

    If all are zero, zero is the lowest value shown, unless ``signed``.
    """
    finite = np.isfinite(points)
    kept = points[finite & (motions != classes.CODES["diverged"])[..., None]]
    kept = kept if kept.size else points[finite]
    if not kept.size:
        return -1.0, 1.0
    low, high = float(np.min(kept)), float(np.max(kept))
    return limits_of_points(low, high) if signed or low or high else (0.0, 1.0)


def _differing(
    points: FloatArray, motions: Codes, orders: Codes, least: float
) -> NDArray[np.bool_]:
    """Mask of the values at which two branches are two motions, (n,)."""
    differs = np.zeros(points.shape[1], dtype=bool)
    if points.shape[0] != 2:
        return differs
    for place in range(differs.size):
        one, other = motions[:, place]
        if {one, other} & classes.UNSETTLED:
            continue
        if one != other or orders[0, place] != orders[1, place]:
            differs[place] = True
        elif one in classes.PERIODIC:
            last = -max(1, int(orders[0, place]))
            differs[place] = _distance(points[0, place, last:], points[1, place, last:]) > least
    return differs


def _distance(one: FloatArray, other: FloatArray) -> float:
    """The Hausdorff distance of two sets of numbers; 0 if one is empty."""
    one, other = one[np.isfinite(one)], other[np.isfinite(other)]
    if not (one.size and other.size):
        return 0.0
    distance = np.abs(one[:, None] - other[None, :])
    return float(max(np.max(np.min(distance, axis=0)), np.max(np.min(distance, axis=1))))


def _limits(swept: SweepDiagram) -> list[tuple[float, bool]]:
    """Values where the damping of sliding changes sign, True if it is positive beyond.

    None in a sweep of a machine, which has no such result.
    """
    if "sliding_damping" not in swept.branches[0].dataset:
        return []
    x, damping = swept.x, swept.rows("sliding_damping")[0]
    known = np.isfinite(damping)
    places, values = x.positions(x.values)[known], damping[known]
    stable = values > 0.0
    return [
        (x.at(_zero(places, values, int(i))), bool(stable[i + 1]))
        for i in np.flatnonzero(stable[1:] != stable[:-1])
    ]


def _zero(places: FloatArray, values: FloatArray, i: int) -> float:
    """Position where the smaller of two dampings is zero between the points i and i + 1.

    Each is nearly straight, and the smaller has a kink where they cross: it is zero where the
    later of both lines is, each drawn through the two points on its side.
    """

    def zero(first: int, last: int) -> float:
        share = values[first] / (values[first] - values[last])
        return float(places[first] + share * (places[last] - places[first]))

    zeros = [
        zero(first, last)
        for first, last in ((i - 1, i), (i + 1, i + 2))
        if first >= 0 and last < values.size and values[first] != values[last]
    ]
    inside = [one for one in zeros if places[i] <= one <= places[i + 1]] or [zero(i, i + 1)]
    return max(inside) if values[i + 1] > values[i] else min(inside)
