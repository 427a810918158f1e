"""What is drawn of a sweep over one parameter: points, classes, exponents, branch by branch."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from wedgebrake.errors import InputError, nearest
from wedgebrake.figures.matplotlib import class_styles, heatmap, style
from wedgebrake.figures.matplotlib.heatmap import Axis
from wedgebrake.figures.matplotlib.sweep_branches import Branch, split

if TYPE_CHECKING:
    import xarray as xr

# Periodic motions on two branches differ from this share of the picture's height on.
_DIFFERS = 0.02
# The picture's height is at least this share of the largest value: rounding is no scatter.
_LEAST = 0.02


@dataclass(frozen=True)
class Record:
    """A sweep over one parameter, in ascending order of it.

    quantity  : "velocity" or "angle"
    points    : of the quantity, (branch, n, period)
    motions, sticks : classes, as places among the looks, (branch, n)
    orders, exponent, error : (branch, n)
    differs   : whether the branches differ, (n,)
    limits    : where the damping of sliding changes sign, and whether it is positive beyond
    low, high : limits of the quantity's axis
    """

    x: Axis
    quantity: str
    branches: list[Branch]
    points: np.ndarray
    motions: np.ndarray
    orders: np.ndarray
    sticks: np.ndarray
    exponent: np.ndarray
    error: np.ndarray
    differs: np.ndarray
    limits: list[tuple[float, bool]]
    low: float
    high: float

    @classmethod
    def of(cls, dataset: xr.Dataset, quantity: str) -> Record:
        """The record of a dataset.

        Raises ``InputError`` for a dataset that is no sweep over one parameter, another
        quantity, or a dataset without its points.
        """
        (name,) = heatmap.swept(dataset, 1)
        _check_quantity(dataset, quantity)
        x = heatmap.axis(dataset, name)
        branches = split(dataset)

        def rows(values: list[xr.DataArray]) -> np.ndarray:
            dims = (name, "period") if "period" in values[0].dims else (name,)
            return np.stack([one.transpose(*dims).to_numpy()[x.order] for one in values])

        def result(of: str) -> np.ndarray:
            return rows([branch.dataset[of] for branch in branches])

        points = result(quantity).astype(float)
        motions = rows([class_styles.classes(branch.dataset) for branch in branches])
        orders = result("order")
        low, high = _span(points, motions)
        return cls(
            x=x,
            quantity=quantity,
            branches=branches,
            points=points,
            motions=motions,
            orders=orders,
            sticks=rows([class_styles.stick_classes(branch.dataset) for branch in branches]),
            exponent=result("largest_exponent").astype(float),
            error=result("exponent_error").astype(float),
            differs=_differing(points, motions, orders, _DIFFERS * (high - low)),
            limits=_crossings(x, result("sliding_damping")[0]),
            low=low,
            high=high,
        )

    @property
    def empty(self) -> np.ndarray:
        """Which parameters have no points, (branch, n)."""
        none: np.ndarray = ~np.any(np.isfinite(self.points), axis=2)
        return none


def _check_quantity(dataset: xr.Dataset, quantity: str) -> None:
    """Refuse what the dataset has no Poincare points of."""
    if quantity not in style.SECTION:
        raise InputError(f"quantity = {quantity!r}: {nearest(str(quantity), style.SECTION)}")
    if quantity not in dataset.data_vars or "period" not in dataset[quantity].dims:
        raise InputError(
            f"dataset: has no {quantity} over period, so there are no Poincare points to draw."
            " Use wb.bifurcation(...) or wb.sweep(...), which keep them."
        )


def _span(points: np.ndarray, motions: np.ndarray) -> tuple[float, float]:
    """Lowest and highest value shown: of all points but those of runs that diverged."""
    kept = points[np.isfinite(points) & (motions != class_styles.DIVERGED)[..., None]]
    if not kept.size:
        kept = points[np.isfinite(points)]
    if not kept.size:
        return -1.0, 1.0
    low, high = float(np.min(kept)), float(np.max(kept))
    return style.margins(low, high, _LEAST * max(abs(low), abs(high)), share=0.04)


def _differing(
    points: np.ndarray, motions: np.ndarray, orders: np.ndarray, least: float
) -> np.ndarray:
    """Where two branches are two motions, (n,)."""
    differs = np.zeros(points.shape[1], dtype=bool)
    if points.shape[0] != 2:
        return differs
    for place in range(differs.size):
        one, other = motions[:, place]
        if {one, other} & class_styles.UNSETTLED:
            continue
        if one != other or orders[0, place] != orders[1, place]:
            differs[place] = True
        elif one in class_styles.PERIODIC:
            last = -max(1, int(orders[0, place]))
            differs[place] = _apart(points[0, place, last:], points[1, place, last:]) > least
    return differs


def _apart(one: np.ndarray, other: np.ndarray) -> float:
    """The Hausdorff distance of two sets of numbers; 0 if one is empty."""
    one, other = one[np.isfinite(one)], other[np.isfinite(other)]
    if not (one.size and other.size):
        return 0.0
    distance = np.abs(one[:, None] - other[None, :])
    return float(max(np.max(np.min(distance, axis=0)), np.max(np.min(distance, axis=1))))


def _crossings(x: Axis, damping: np.ndarray) -> list[tuple[float, bool]]:
    """Where the damping of sliding changes sign, and whether it is positive to the right."""
    known = np.isfinite(damping)
    places, values = x.places(x.values)[known], damping[known]
    stable = values > 0.0
    return [
        (x.at(_zero(places, values, int(i))), bool(stable[i + 1]))
        for i in np.flatnonzero(stable[1:] != stable[:-1])
    ]


def _zero(places: np.ndarray, values: np.ndarray, i: int) -> float:
    """Where the smaller of two dampings passes zero between the points i and i + 1.

    Each is nearly straight, and the smaller has a kink where they cross: it is zero where the
    later of both lines is, each drawn through the two points on its side.
    """
    rising = values[i + 1] > values[i]
    zeros = []
    for first, last in ((i - 1, i), (i + 1, i + 2)):
        if first >= 0 and last < values.size and values[first] != values[last]:
            share = values[first] / (values[first] - values[last])
            zeros.append(float(places[first] + share * (places[last] - places[first])))
    inside = [zero for zero in zeros if places[i] <= zero <= places[i + 1]]
    if inside:
        return max(inside) if rising else min(inside)
    share = values[i] / (values[i] - values[i + 1])
    return float(places[i] + share * (places[i + 1] - places[i]))
