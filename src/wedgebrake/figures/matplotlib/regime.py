"""Maps of a sweep over two parameters: the class of motion, or any other result, by colour."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from wedgebrake.errors import InputError
from wedgebrake.figures.data import caption, codim2
from wedgebrake.figures.data.branches import split
from wedgebrake.figures.data.class_map import RegimeMap, check_quantity
from wedgebrake.figures.data.class_map import regime_map as map_data
from wedgebrake.figures.data.swept_axis import require_swept
from wedgebrake.figures.matplotlib import style
from wedgebrake.figures.matplotlib.class_map import draw_cells, draw_map
from wedgebrake.figures.matplotlib.codim2 import draw_curves
from wedgebrake.figures.matplotlib.layout import HIGHEST, page

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


def regime_map(
    dataset: xr.Dataset,
    quantity: str = "motion",
    *,
    boundaries: Sequence[xr.Dataset] = (),
    width: float = style.COLUMN,
) -> Figure:
    """A sweep over two parameters, the first to the right and the second upwards: a new figure.

    dataset    : as ``wb.regime_map`` or ``wb.sweep`` gives it; with a dimension ``branch``,
                 one map for each branch
    quantity   : "motion" or "stick_class" (a colour for each class), "order",
                 "largest_exponent" (blue below zero, red above) or any other result of a
                 point, such as "peak_torque", "friction_power", "stick_share"
    boundaries : lines of bifurcations over the same two parameters, as ``wb.boundary`` gives
                 them
    width      : of the figure [inch]; a journal's column is 3.5, its page 7.2

    The dashed line is the linear stability limit, where ``sliding_damping`` changes sign; it
    ends where the brake locks itself and no forward sliding exists. Axes are logarithmic where
    values are spaced so. A picture of fewer pixels than the map has cells shows one cell in
    each pixel, never a mixture of colours.

    Raises ``InputError`` for a dataset that is no sweep over two parameters, a quantity that
    it does not have, or boundaries over other parameters.
    """
    names = require_swept(dataset, 2)
    check_quantity(dataset, quantity)
    curves = codim2.curves_over(boundaries, names)
    with style.use():
        branches = split(dataset)
        maps = [map_data(branch.dataset, quantity, whole=dataset) for branch in branches]
        across = len(branches) if width >= 1.5 * style.COLUMN else 1
        rows = [min(0.72 * width / across, HIGHEST)] * (len(branches) // across)
        legends = [("", maps[0].legend), ("", codim2.entries(curves))]
        sentences = caption.sentences(dataset, names)
        with page(width, rows, legends, sentences, across=across) as (figure, grid):
            for place, (branch, data) in enumerate(zip(branches, maps, strict=True)):
                axes = figure.add_subplot(grid[place // across, place % across])
                _draw(axes, data, curves)
                if branch.direction:
                    axes.set_title(branch.direction, fontsize=style.LABELS)
        return figure


def draw(
    axes: Axes,
    dataset: xr.Dataset,
    quantity: str = "motion",
    *,
    boundaries: Sequence[xr.Dataset] = (),
) -> None:
    """Draw the map on given axes, without legend; a colour bar comes beside them.

    Of a dataset with branches, one: ``dataset.sel(branch="up")``.
    """
    names = require_swept(dataset, 2)
    check_quantity(dataset, quantity)
    curves = codim2.curves_over(boundaries, names)
    if "branch" in dataset.dims:
        raise InputError(
            "dataset: has branches, but axes hold one map. Choose one with"
            " dataset.sel(branch='up'), or use regime_map for all."
        )
    _draw(axes, map_data(dataset, quantity), curves)


def _draw(axes: Axes, data: RegimeMap, curves: Sequence[codim2.BifurcationCurve]) -> None:
    draw_map(axes, data)
    if data.values is not None:
        _draw_values(axes, data, data.values)
    draw_curves(axes, curves)


def _draw_values(axes: Axes, data: RegimeMap, values: np.ndarray) -> None:
    """Draw cells in a scale of colours, with its bar."""
    from matplotlib.colors import LinearSegmentedColormap, LogNorm, Normalize

    scale = data.scale
    if scale is None:
        style.say(axes, "no values")
        return
    # Infinite values too get the last colour: just beyond the scale.
    beyond = 0.01 * (scale.high - scale.low)
    lowest = scale.low - beyond if scale.low <= 0.0 else 0.99 * scale.low
    shown = np.ma.masked_invalid(np.clip(values, lowest, scale.high + beyond))
    drawn = draw_cells(
        axes,
        data.x,
        data.y,
        shown,
        cmap=LinearSegmentedColormap.from_list("signs", style.SIGNS)
        if scale.signed
        else style.SIZES,
        norm=(LogNorm if scale.log else Normalize)(scale.low, scale.high),
    )
    figure = axes.figure
    extend = (("neither", "max"), ("min", "both"))[scale.cut[0]][scale.cut[1]]
    bar = figure.colorbar(drawn, ax=axes, extend=extend, pad=0.02, aspect=25)
    bar.set_label(scale.label)
    bar.outline.set_linewidth(0.5)
