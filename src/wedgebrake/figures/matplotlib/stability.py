"""Map of linear stability over two groups: where sliding is stable, and by how much."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from wedgebrake.errors import InputError
from wedgebrake.figures.matplotlib import caption, class_styles, heatmap, style
from wedgebrake.figures.matplotlib.class_styles import Look
from wedgebrake.figures.matplotlib.layout import HIGHEST, page

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

VARIABLES = ("margin", "stable", "growth", "locked")
"""What ``wb.stability_map`` gives."""

_UNSTABLE, _STABLE, _LOCKED = range(3)
_LOOKS = (
    Look("unstable: small vibration about sliding grows", "#F7E3D8"),
    Look("stable: it decays", "#DBEDE4"),
    Look("locks itself: no forward sliding", "#B4BCC4"),
)
# About so many lines of equal margin.
_LINES = 7


def stability_map(dataset: xr.Dataset, *, width: float = style.COLUMN) -> Figure:
    """Linear stability over two groups, the first to the right and the second upwards.

    dataset : as ``wb.stability_map`` gives it
    width   : of the figure [inch]; a journal's column is 3.5, its page 7.2

    The dashed line without edges is the linear stability limit; thin lines are those of equal
    margin in eta. Gives a new figure.

    Raises ``InputError`` for anything but such a map over two groups, of two values each or
    more.
    """
    _check(dataset)
    with style.use():
        codes = _codes(dataset)
        entries = class_styles.present(codes, _LOOKS, shares=False)
        if {_STABLE, _UNSTABLE} <= set(np.unique(codes)):
            entries.append(class_styles.limit_entry())
        legends = [("", entries)]
        words = [
            caption.of_stability(dataset, [str(name) for name in dataset["margin"].dims]),
            "Linear stability of sliding in both directions.",
            r"Numbers: margin, $\eta$ less the critical $\eta$ of the worse direction.",
        ]
        rows = [min(0.72 * width, HIGHEST)]
        with page(width, rows, legends, words) as (figure, grid):
            draw(figure.add_subplot(grid[0]), dataset)
        return figure


def draw(axes: Axes, dataset: xr.Dataset) -> None:
    """The same on axes of your own, without legend."""
    _check(dataset)
    x, y = (heatmap.axis(dataset, str(name)) for name in dataset["margin"].dims)
    codes = dataset["stable"].copy(data=_codes(dataset))
    heatmap.draw_classes(axes, x, y, heatmap.arranged(codes, x, y), _LOOKS)
    heatmap.set_axes(axes, x, y)
    margin = heatmap.arranged(dataset["margin"].where(~dataset["locked"]), x, y)
    known = np.ma.masked_invalid(margin)
    if known.count() and np.ptp(known.compressed()) > 0.0:
        _draw_lines(axes, x.values, y.values, known)


def _draw_lines(axes: Axes, x: np.ndarray, y: np.ndarray, margin: Any) -> None:
    from matplotlib.ticker import MaxNLocator

    locator = MaxNLocator(_LINES, steps=[1, 2, 5, 10])
    low, high = float(margin.min()), float(margin.max())
    levels = [one for one in locator.tick_values(low, high) if low < one < high]
    others = [one for one in levels if abs(one) > 1e-9 * (high - low)]
    if others:
        lines = axes.contour(
            x, y, margin, levels=others, colors=style.GREY, linewidths=0.5, linestyles="-"
        )
        axes.clabel(lines, fontsize=style.SMALL, fmt=lambda value: f"${value:+g}$")
    if low < 0.0 < high:
        line = axes.contour(x, y, margin, levels=[0.0], colors=style.LIMIT, linewidths=1.1)
        line.set_linestyle(style.DASHES)


def _codes(dataset: xr.Dataset) -> np.ndarray:
    """The class of each cell, in the order of the dataset."""
    codes = np.where(dataset["stable"].to_numpy(), _STABLE, _UNSTABLE)
    return np.where(dataset["locked"].to_numpy(), _LOCKED, codes)


def _check(dataset: xr.Dataset) -> None:
    known = getattr(dataset, "data_vars", {})
    if any(name not in known for name in VARIABLES):
        raise InputError(
            f"dataset = {type(dataset).__name__}: must be the result of wb.stability_map(...)."
        )
    sizes = dict(dataset["margin"].sizes)
    if len(sizes) != 2 or min(sizes.values()) < 2:
        said = ", ".join(f"{size} of {name}" for name, size in sizes.items()) or "one point"
        raise InputError(
            f"dataset: holds {said}; there are pictures of linear stability over two groups, of two"
            " values each or more. Give wb.stability_map such axes, for example"
            " eta=np.linspace(-2, 1, 100), alpha=np.linspace(1.1, 2, 100)."
        )
