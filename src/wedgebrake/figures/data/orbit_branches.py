"""Branches of periodic orbits over a parameter, stable and unstable, with their bifurcations."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from wedgebrake.arrays import FloatArray
from wedgebrake.errors import InputError
from wedgebrake.figures import style
from wedgebrake.figures.data import class_styles as classes
from wedgebrake.figures.data.axes import label, runs, swept_parameters
from wedgebrake.figures.data.bifurcation import BifurcationDiagram
from wedgebrake.figures.data.limits import limits_of_points
from wedgebrake.figures.data.parts import with_one_part
from wedgebrake.model.validation import check_choice, wrong
from wedgebrake.orbits.bifurcation_types import stability_intervals
from wedgebrake.sweeps.results import INERTIA

if TYPE_CHECKING:
    import xarray as xr


QUANTITIES = (
    *style.SECTION,
    "velocity_amplitude",
    "angle_amplitude",
    "stick_share",
    "largest_exponent",
)
# The height leaves out this share of the parameter at either end, except for values that
# add no more than this multiple of the height.
_OUTLIERS, _BEYOND = 0.01, 0.5
# Bifurcations closer than this share of the picture's width get one label.
_TOGETHER = 0.003


@dataclass(frozen=True, eq=False)
class BranchLine:
    """One line: points of one branch, stable or not, at one of its returns; x, y : (n,)."""

    x: FloatArray
    y: FloatArray
    order: int
    stable: bool
    branch: int

    @property
    def line(self) -> classes.LineStyle:
        """The line in the colour of its period."""
        return orbit_line(classes.orbit_colour(self.order), stable=self.stable)


@dataclass(frozen=True, eq=False)
class OrbitBranches:
    """Branches of orbits over a parameter.

    labels     : of the parameter and of the quantity
    values     : of the parameter, (point,)
    heights    : of the quantity, (point, return); (point, 1) for results of the whole orbit
    curves     : lines, in pieces where stability changes
    kinds, at  : of the bifurcations, and their places among the points
    simulated  : Poincare points of a sweep over the same parameter, or None
    xlim, ylim : of the picture
    """

    parameter: str
    quantity: str
    labels: tuple[str, str]
    values: FloatArray
    heights: FloatArray
    curves: list[BranchLine]
    kinds: NDArray[np.str_]
    at: NDArray[np.int64]
    simulated: BifurcationDiagram | None
    xlim: tuple[float, float]
    ylim: tuple[float, float]

    @classmethod
    def of(
        cls,
        dataset: xr.Dataset,
        quantity: str | None = None,
        beneath: xr.Dataset | None = None,
        inertia: str | None = None,
    ) -> OrbitBranches:
        """The branches of a result of ``wb.branches``.

        inertia : inertia of a machine whose Poincare points are drawn; None for the first

        Raises ``InputError`` for a dataset that holds no orbits, another quantity, or a sweep
        that has no Poincare points over the same parameter.
        """
        if getattr(dataset, "attrs", {}).get("kind") != "orbits":
            raise wrong("dataset", dataset, "the result of wb.branches(...)")
        if quantity is None:
            # The section of limit cycles is a level of a speed: its points show no amplitude.
            crosses = dataset.attrs.get("section") == "crossing"
            quantity = "velocity_amplitude" if crosses else "velocity"
        check_choice("quantity", quantity, QUANTITIES)
        parameter = str(dataset.attrs["parameter"])
        if beneath is not None:
            beneath = with_one_part(beneath, inertia if INERTIA in beneath.dims else None)
        simulated = None if beneath is None else _simulated(beneath, parameter, quantity)
        values = dataset[parameter].to_numpy().astype(float)
        shown = with_one_part(dataset, inertia)[quantity]
        if inertia is not None and INERTIA not in dataset[quantity].dims:
            raise wrong(
                "inertia", inertia, f"None for the quantity {quantity!r}",
                "It belongs to the whole machine; give quantity='velocity' or 'angle'.",
            )  # fmt: skip
        found = shown.transpose("point", ...).to_numpy().astype(float)
        found = found[:, None] if found.ndim == 1 else found
        heights = np.where(np.isfinite(found), found, np.nan)
        at = dataset["bifurcation_point"].to_numpy().astype(int)
        curves = list(stability_pieces(dataset, values, heights, at))
        labels = label(dataset[parameter]), style.SECTION.get(quantity) or label(dataset[quantity])
        kinds = dataset["bifurcation_kind"].to_numpy().astype(str)
        limits = _width(values, simulated), _height(curves, simulated)
        return cls(
            parameter, quantity, labels, values, heights, curves, kinds, at, simulated, *limits
        )

    def points(self, kind: str) -> FloatArray:
        """Points at which bifurcations of a kind are marked, (n, 2)."""
        return self._marked(self.at[self.kinds == kind])

    def letters(self) -> list[tuple[str, FloatArray]]:
        """Letters of the bifurcations, and their possible points, (n, 2).

        Those of one kind at one value of the parameter get one label.
        """
        together = _TOGETHER * (self.xlim[1] - self.xlim[0])
        found = []
        for kind, one in classes.BIFURCATIONS.items():
            left = self.at[self.kinds == kind]
            while left.size:
                near = np.abs(self.values[left] - self.values[left[0]]) <= together
                found.append((one.letters, self._marked(left[near])))
                left = left[~near]
        return found

    def legends(self) -> list[tuple[str, list[classes.LegendEntry]]]:
        """Legends: colours, kinds of line and simulated points; symbols."""
        periods: dict[str, list[str]] = {}
        for order in sorted({curve.order for curve in self.curves}):
            colour = classes.orbit_colour(order)
            periods.setdefault(colour, []).append(classes.period(order))
        rows = [(", ".join(words), colour, True) for colour, words in periods.items()]
        present = sorted({curve.stable for curve in self.curves}, reverse=True)
        rows += [("stable" if one else "unstable", style.BLACK, one) for one in present]
        lines = [
            classes.LegendEntry(word, orbit_line(one, stable=holds)) for word, one, holds in rows
        ]
        if self.simulated is not None:
            grey = style.DENSITY_BENEATH[1]
            lines.append(classes.class_entry(classes.ClassStyle("simulated points", grey)))
        symbols = [
            classes.LegendEntry(f"{one.letters}: {kind}", one.marker())
            for kind, one in classes.BIFURCATIONS.items()
            if kind in self.kinds
        ]
        return [("", lines), ("", symbols)]

    def _marked(self, places: NDArray[np.int64]) -> FloatArray:
        """All returns of some points, (n, 2), without the padding of shorter orbits."""
        across = np.broadcast_to(self.values[places][:, None], self.heights[places].shape)
        points = np.stack((across.ravel(), self.heights[places].ravel()), axis=1)
        known: FloatArray = points[np.isfinite(points[:, 1])]
        return known


def orbit_line(colour: str, *, stable: bool) -> classes.LineStyle:
    """The line of stable or unstable orbits."""
    return (
        classes.LineStyle(colour, 1.1) if stable else classes.LineStyle(colour, 0.8, style.UNSTABLE)
    )


def _simulated(dataset: xr.Dataset, parameter: str, quantity: str) -> BifurcationDiagram:
    if quantity not in style.SECTION:
        raise InputError(
            f"beneath: a sweep has no curve of {quantity} to compare with. Leave it out,"
            f" or choose the quantity {' or '.join(map(repr, style.SECTION))}."
        )
    swept = swept_parameters(dataset)
    if swept != [parameter]:
        what = f"is swept over {', '.join(swept)}" if swept else "is not a sweep"
        raise InputError.of(
            "beneath", dataset, f"{what}, but the orbits were followed over {parameter}. Give the"
            f" result of wb.bifurcation(..., {parameter}=...).",
            allowed=f"the result of a sweep over {parameter}",
        )  # fmt: skip
    return BifurcationDiagram.of(dataset, quantity)


def stability_pieces(
    dataset: xr.Dataset, values: FloatArray, heights: FloatArray, at: NDArray[np.int64]
) -> Iterator[BranchLine]:
    """The lines of all branches, stable and unstable pieces apart."""
    stable, branch = (dataset[name].to_numpy() for name in ("stable", "branch"))
    order, origin = (dataset[f"branch_{name}"].to_numpy() for name in ("order", "origin"))
    marginal = np.zeros(values.size, dtype=bool)
    marginal[at] = True
    for first, last in runs(branch) if branch.size else []:
        own = slice(first, last + 1)
        # A branch that was switched to begins at a bifurcation of another branch.
        marginal[first] |= origin[branch[first]] >= 0
        for begin, end, holds in stability_intervals(stable[own], marginal[own]):
            piece = slice(begin, end + 1)
            for height in heights[own][piece].T:
                if np.any(np.isfinite(height)):
                    yield BranchLine(
                        values[own][piece], height, int(order[branch[first]]), holds,
                        int(branch[first]),
                    )  # fmt: skip


def _width(values: FloatArray, simulated: BifurcationDiagram | None) -> tuple[float, float]:
    every = values if simulated is None else np.concatenate((values, simulated.x.edges))
    if not every.size:
        return 0.0, 1.0
    low, high = float(every.min()), float(every.max())
    return (low, high) if low < high else style.margins(low, high, 0.1 * abs(low))


def _height(curves: list[BranchLine], simulated: BifurcationDiagram | None) -> tuple[float, float]:
    """Limits of the quantity: of all simulated points, and of curves except for outliers."""
    if not curves:
        return 0.0, 1.0
    known = np.concatenate([curve.y for curve in curves])
    weight = np.concatenate([_weights(curve) for curve in curves])
    known, weight = known[np.isfinite(known)], weight[np.isfinite(known)]
    ascending = np.argsort(known)
    # The weight of a value is the length of parameter about it.
    share = np.cumsum(weight[ascending]) / np.sum(weight)
    at = np.searchsorted(share, (_OUTLIERS, 1.0 - _OUTLIERS)).clip(max=known.size - 1)
    low, high = known[ascending][at].tolist()
    if simulated is not None and not np.all(simulated.empty):
        low, high = min(low, simulated.low), max(high, simulated.high)
    beyond = _BEYOND * (high - low)
    low = min(low, max(float(np.min(known)), low - beyond))
    high = max(high, min(float(np.max(known)), high + beyond))
    return limits_of_points(low, high)


def _weights(curve: BranchLine) -> FloatArray:
    """The length of parameter about each point; never zero."""
    steps = np.abs(np.diff(curve.x))
    least = 1e-12 * (1.0 + np.abs(curve.x))
    weights: FloatArray = np.maximum(np.append(steps, 0.0) + np.append(0.0, steps), least)
    return weights
