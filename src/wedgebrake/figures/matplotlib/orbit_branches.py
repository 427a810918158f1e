"""Branches of periodic orbits against a parameter, stable and unstable, with bifurcations."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from wedgebrake.errors import InputError, nearest
from wedgebrake.figures.matplotlib import (
    caption,
    class_styles,
    density,
    heatmap,
    point_labels,
    style,
)
from wedgebrake.figures.matplotlib.layout import page
from wedgebrake.figures.matplotlib.sweep_record import Record
from wedgebrake.orbits.stability_intervals import stability_intervals

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_QUANTITIES = (
    *style.SECTION,
    "velocity_amplitude",
    "angle_amplitude",
    "stick_share",
    "largest_exponent",
)
# Width beside the axes, height of the axes at most [inch].
_MARGINS, _HIGHEST = 0.6, 3.5
# The height shows all but this share of the parameter at either end, and beyond it all that
# adds no more than so many times the height.
_OUTLIERS, _BEYOND = 0.01, 0.5
# The picture's height is at least this share of the largest value: rounding is no change.
_LEAST = 0.02
# Points of bifurcations closer than this share of the picture's width get one label.
_TOGETHER = 0.003
# Symbols of bifurcations, and of many [pt]; those of thin arms are larger by a factor.
_SIZE, _SMALLER, _MANY = 4.0, 3.3, 40
_LARGER, _THIN = 1.5, "*PX"


@dataclass(frozen=True)
class _Curve:
    """One line: points of one branch, stable or not, at one of its returns.

    x, y : (n,)
    """

    x: np.ndarray
    y: np.ndarray
    order: int
    stable: bool


@dataclass(frozen=True)
class _Branches:
    """What is drawn of a dataset of orbits.

    values  : of the parameter, (point,)
    heights : of the quantity, (point, return); (point, 1) for results of the whole orbit
    curves  : lines, in pieces where stability changes
    kinds   : of the bifurcations
    at      : their places among the points
    """

    parameter: str
    quantity: str
    values: np.ndarray
    heights: np.ndarray
    curves: list[_Curve]
    kinds: np.ndarray
    at: np.ndarray

    @classmethod
    def of(cls, dataset: xr.Dataset, quantity: str) -> _Branches:
        """The branches of a dataset.

        Raises ``InputError`` for a dataset that holds no orbits, or another quantity.
        """
        if getattr(dataset, "attrs", {}).get("kind") != "orbits":
            raise InputError(
                f"dataset = {type(dataset).__name__}: must be the result of wb.branches(...)."
            )
        if quantity not in _QUANTITIES:
            raise InputError(f"quantity = {quantity!r}: {nearest(str(quantity), _QUANTITIES)}")
        parameter = str(dataset.attrs["parameter"])
        values = dataset[parameter].to_numpy().astype(float)
        found = dataset[quantity].transpose("point", ...).to_numpy().astype(float)
        found = found[:, None] if found.ndim == 1 else found
        heights = np.where(np.isfinite(found), found, np.nan)
        at = dataset["bifurcation_point"].to_numpy().astype(int)
        return cls(
            parameter=parameter,
            quantity=quantity,
            values=values,
            heights=heights,
            curves=list(_curves(dataset, values, heights, at)),
            kinds=dataset["bifurcation_kind"].to_numpy().astype(str),
            at=at,
        )

    def points(self, kind: str) -> np.ndarray:
        """Where bifurcations of a kind are marked, (n, 2)."""
        return self._marked(self.at[self.kinds == kind])

    def labels(self, width: float) -> list[tuple[str, np.ndarray]]:
        """Letters of the bifurcations, and the points where they may stand.

        width : of the picture, in the parameter; those of one kind at one value get one label
        """
        found = []
        for kind, mark in class_styles.BIFURCATIONS.items():
            left = self.at[self.kinds == kind]
            while left.size:
                near = np.abs(self.values[left] - self.values[left[0]]) <= _TOGETHER * width
                found.append((mark.letters, self._marked(left[near])))
                left = left[~near]
        return found

    def _marked(self, places: np.ndarray) -> np.ndarray:
        """All returns of some points, (n, 2), without the padding of shorter orbits."""
        across = np.broadcast_to(self.values[places][:, None], self.heights[places].shape)
        points = np.stack((across.ravel(), self.heights[places].ravel()), axis=1)
        known: np.ndarray = points[np.isfinite(points[:, 1])]
        return known


def orbits(
    dataset: xr.Dataset,
    quantity: str = "velocity",
    *,
    beneath: xr.Dataset | None = None,
    width: float = style.PAGE,
) -> Figure:
    """Branches of periodic orbits against their parameter: a new figure.

    dataset  : as ``wb.branches`` gives it
    quantity : "velocity" [rad/s] or "angle" [rad] of the Poincare points, a curve for each
               period of the torque that an orbit takes; or a result of the whole orbit,
               "velocity_amplitude" [rad/s], "angle_amplitude" [rad] (half ranges),
               "stick_share" or "largest_exponent" [1/s]
    beneath  : a sweep over the same parameter with its Poincare points, as
               ``wb.bifurcation`` gives it: drawn in grey, the more points the darker
    width    : of the figure [inch]; a journal's column is 3.5, its page 7.2

    Stable orbits are solid and unstable ones dashed, in a colour for each period. Each kind
    of bifurcation has a symbol, full for those of smooth systems and hollow for those of
    friction, and letters where there is room for them. A branch that leaves the heights of
    all others is cut off.

    Raises ``InputError`` for a dataset that holds no orbits, another quantity, or a sweep
    beneath that has no such points over the same parameter.
    """
    branches = _Branches.of(dataset, quantity)
    below = None if beneath is None else _beneath(beneath, branches)
    sentences = caption.about(dataset, [branches.parameter])
    if beneath is not None:
        sentences.append(f"Grey: {caption.how(beneath, [branches.parameter])}")
    with style.use():
        height = min(0.72 * width, _HIGHEST)
        with page(width, [height], _legends(branches, below), sentences, beside=_MARGINS) as (
            figure,
            grid,
        ):
            axes = figure.add_subplot(grid[0])
            _set_axes(axes, dataset, branches, below)
            if below is not None:
                _draw_beneath(axes, below, (72.0 * (width - _MARGINS), 72.0 * height))
            _draw_curves(axes, branches)
            _draw_symbols(axes, branches)
        # Labels need the axes where they will be.
        engine: Any = figure.get_layout_engine()
        engine.execute(figure)
        curves = [np.stack((curve.x, curve.y), axis=1) for curve in branches.curves]
        point_labels.draw(axes, branches.labels(float(np.ptp(axes.get_xlim()))), curves)
    return figure


def _beneath(dataset: xr.Dataset, branches: _Branches) -> Record:
    """The points of a sweep over the parameter of the branches."""
    if branches.quantity not in style.SECTION:
        raise InputError(
            f"beneath: a sweep has no curve of {branches.quantity} to compare with. Leave it out,"
            f" or choose the quantity {' or '.join(map(repr, style.SECTION))}."
        )
    swept = heatmap.axes_of(dataset)
    if swept != [branches.parameter]:
        what = f"is swept over {', '.join(swept)}" if swept else "is no sweep"
        raise InputError(
            f"beneath = {type(dataset).__name__}: {what}, but the orbits were followed over"
            f" {branches.parameter}. Give the result of wb.bifurcation(..., {branches.parameter}"
            "=...)."
        )
    return Record.of(dataset, branches.quantity)


def _curves(
    dataset: xr.Dataset, values: np.ndarray, heights: np.ndarray, at: np.ndarray
) -> Iterator[_Curve]:
    """The lines of all branches."""
    stable, branch = (dataset[name].to_numpy() for name in ("stable", "branch"))
    order, origin = (dataset[f"branch_{name}"].to_numpy() for name in ("order", "origin"))
    marginal = np.zeros(values.size, dtype=bool)
    marginal[at] = True
    for first, last in heatmap.runs(branch) if branch.size else []:
        own = slice(first, last + 1)
        # A branch that another one was left for begins at the bifurcation of that one.
        marginal[first] |= origin[branch[first]] >= 0
        for begin, end, holds in stability_intervals(stable[own], marginal[own]):
            piece = slice(begin, end + 1)
            for height in heights[own][piece].T:
                if np.any(np.isfinite(height)):
                    yield _Curve(values[own][piece], height, int(order[branch[first]]), holds)


def _set_axes(axes: Axes, dataset: xr.Dataset, branches: _Branches, below: Record | None) -> None:
    """Labels and limits: what the curves and the points beneath take up."""
    quantity = branches.quantity
    axes.set_xlabel(heatmap.label(dataset[branches.parameter]))
    axes.set_ylabel(style.SECTION.get(quantity) or heatmap.label(dataset[quantity]))
    if not branches.curves:
        style.say(axes, "no orbits")
        return
    ends = [branches.values]
    if below is not None:
        if below.x.log:
            axes.set_xscale("log")
        ends.append(below.x.edges)
    low, high = (float(end(np.concatenate(ends))) for end in (np.min, np.max))
    axes.set_xlim((low, high) if low < high else style.margins(low, high, 0.1 * abs(low)))
    axes.set_ylim(_span(branches, below))
    style.few_ticks(axes)
    if below is not None and below.x.log:
        style.round_ticks(axes.xaxis, low, high)
    if quantity == "largest_exponent":
        axes.axhline(0.0, color=style.GREY, linewidth=0.5, zorder=1.5)


def _span(branches: _Branches, below: Record | None) -> tuple[float, float]:
    """Lowest and highest value shown: of all points beneath, and of curves but for outliers."""
    known = np.concatenate([curve.y for curve in branches.curves])
    weight = np.concatenate([_weights(curve) for curve in branches.curves])
    known, weight = known[np.isfinite(known)], weight[np.isfinite(known)]
    ascending = np.argsort(known)
    # Each value counts for the length of parameter about it.
    share = np.cumsum(weight[ascending]) / np.sum(weight)
    low, high = (
        float(known[ascending][np.searchsorted(share, at).clip(max=known.size - 1)])
        for at in (_OUTLIERS, 1.0 - _OUTLIERS)
    )
    if below is not None and not np.all(below.empty):
        low, high = min(low, below.low), max(high, below.high)
    beyond = _BEYOND * (high - low)
    low = min(low, max(float(np.min(known)), low - beyond))
    high = max(high, min(float(np.max(known)), high + beyond))
    return style.margins(low, high, _LEAST * max(abs(low), abs(high)), share=0.04)


def _weights(curve: _Curve) -> np.ndarray:
    """The length of parameter about each point; never zero."""
    steps = np.abs(np.diff(curve.x))
    least = 1e-12 * (1.0 + np.abs(curve.x))
    weights: np.ndarray = np.maximum(np.append(steps, 0.0) + np.append(0.0, steps), least)
    return weights


def _draw_beneath(axes: Axes, below: Record, size: tuple[float, float]) -> None:
    """The points of a sweep in grey, on axes of a width and height [pt]."""
    low, high = axes.get_ylim()
    for points, empty in zip(below.points, below.empty, strict=True):
        if not np.all(empty):
            density.draw(axes, below.x, points, (low, high), style.DENSITY_BENEATH, size)


def _draw_curves(axes: Axes, branches: _Branches) -> None:
    """Stable pieces solid, unstable ones dashed and behind them."""
    for curve in branches.curves:
        axes.plot(
            curve.x,
            curve.y,
            color=class_styles.orbit(curve.order).colour,
            **_line(curve.stable),
            # A branch of one point is a point.
            marker="o" if curve.x.size == 1 else "",
            markersize=2.0,
            zorder=3.1 if curve.stable else 3.0,
            rasterized=curve.x.size > style.RASTER_FROM,
        )


def _line(stable: bool) -> dict[str, Any]:
    """How lines of stable orbits and of unstable ones are drawn."""
    if stable:
        return {"linestyle": "-", "linewidth": 1.1}
    return {"linestyle": style.UNSTABLE, "linewidth": 0.8, "dash_capstyle": "butt"}


def _draw_symbols(axes: Axes, branches: _Branches) -> None:
    """The symbols of all bifurcations, those of smooth systems in front."""
    every = [branches.points(kind) for kind in class_styles.BIFURCATIONS]
    size = _SMALLER if sum(map(len, every)) > _MANY else _SIZE
    for place, (points, mark) in enumerate(
        zip(every, class_styles.BIFURCATIONS.values(), strict=True)
    ):
        if points.size:
            axes.plot(*points.T, **_symbol(mark, size), zorder=4.5 - 0.01 * place)


def _symbol(mark: class_styles.Mark, size: float = _SIZE) -> dict[str, Any]:
    """How the symbol of a kind of bifurcation is drawn."""
    return {
        "linestyle": "none",
        "marker": mark.symbol,
        "markersize": size * (_LARGER if mark.symbol in _THIN else 1.0),
        "markerfacecolor": "white" if mark.friction else "black",
        "markeredgecolor": "black" if mark.friction else "white",
        "markeredgewidth": 0.7 if mark.friction else 0.35,
    }


def _legends(branches: _Branches, below: Record | None) -> list[tuple[str, list[Any]]]:
    """Legends: colours, kinds of line and the points beneath; symbols."""
    from matplotlib.lines import Line2D

    lines = [
        Line2D([], [], color=colour, linewidth=1.1, label=", ".join(words))
        for colour, words in _periods(branches).items()
    ]
    held = {curve.stable for curve in branches.curves}
    lines += [
        Line2D([], [], color=style.BLACK, label=word, **_line(stable))
        for stable, word in ((True, "stable"), (False, "unstable"))
        if stable in held
    ]
    if below is not None:
        lines.append(
            class_styles.swatch(class_styles.Look("simulated points", style.DENSITY_BENEATH[1]))
        )
    symbols = [
        Line2D([], [], label=f"{mark.letters}: {kind}", **_symbol(mark))
        for kind, mark in class_styles.BIFURCATIONS.items()
        if kind in branches.kinds
    ]
    return [("", lines), ("", symbols)]


def _periods(branches: _Branches) -> dict[str, list[str]]:
    """Periods of the orbits that are there, by their colours."""
    words: dict[str, list[str]] = {}
    for order in sorted({curve.order for curve in branches.curves}):
        words.setdefault(class_styles.orbit(order).colour, []).append(class_styles.period(order))
    return words
