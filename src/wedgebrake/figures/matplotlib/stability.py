"""Map of linear stability over two groups: where sliding is stable, and by how much."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from wedgebrake.figures.data import caption
from wedgebrake.figures.data import stability as data_of
from wedgebrake.figures.data.stability import LEVEL_LINE, StabilityMap
from wedgebrake.figures.matplotlib import style
from wedgebrake.figures.matplotlib.class_map import draw_map
from wedgebrake.figures.matplotlib.layout import HIGHEST, page

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


def stability_map(dataset: xr.Dataset, *, width: float = style.COLUMN) -> Figure:
    """Linear stability over two groups, the first to the right and the second upwards.

    dataset : as ``wb.stability_map`` gives it
    width   : of the figure [inch]; a journal's column is 3.5, its page 7.2

    The dashed line is the linear stability limit; thin lines are those of equal margin in eta.
    Returns a new figure.

    Raises ``InputError`` for anything but such a map over two groups, of two values each or
    more.
    """
    data = data_of.stability_map(dataset)
    sentences = [
        caption.of_stability(dataset, [data.x.name, data.y.name]),
        "Linear stability of sliding in both directions.",
        r"Numbers: margin, $\eta$ less the critical $\eta$ of the worse direction.",
    ]
    rows = [min(0.72 * width, HIGHEST)]
    with style.use(), page(width, rows, [("", data.legend)], sentences) as (figure, grid):
        _draw(figure.add_subplot(grid[0]), data)
    return figure


def draw(axes: Axes, dataset: xr.Dataset) -> None:
    """Draw the map on given axes, without legend."""
    _draw(axes, data_of.stability_map(dataset))


def _draw(axes: Axes, data: StabilityMap) -> None:
    draw_map(axes, data)
    if not data.levels:
        return
    thin: Any = {"colors": LEVEL_LINE.colour, "linewidths": LEVEL_LINE.width, "linestyles": "-"}
    known = np.ma.masked_invalid(data.known)
    lines = axes.contour(data.x.values, data.y.values, known, levels=list(data.levels), **thin)
    axes.clabel(lines, fontsize=style.SMALL, fmt=lambda value: f"${value:+g}$")
