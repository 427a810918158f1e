"""Curves of bifurcations of periodic orbits over two parameters."""

from __future__ import annotations

import json
from collections.abc import Sequence
from typing import TYPE_CHECKING

from wedgebrake.figures.data import caption, class_styles, codim2
from wedgebrake.figures.data.swept_axis import label
from wedgebrake.figures.matplotlib import style
from wedgebrake.figures.matplotlib.layout import HIGHEST, page
from wedgebrake.figures.matplotlib.legend import line_options

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


def boundary(
    dataset: xr.Dataset, *, boundaries: Sequence[xr.Dataset] = (), width: float = style.COLUMN
) -> Figure:
    """A boundary in the plane of its parameters, the first to the right: a new figure.

    dataset    : as ``wb.boundary`` gives it
    boundaries : further ones over the same two parameters, drawn with it
    width      : of the figure [inch]; a journal's column is 3.5, its page 7.2

    Each kind of bifurcation has its line: dark for those of smooth systems, light between
    dark edges for those of friction.

    Raises ``InputError`` for datasets that are no boundaries, or over other parameters.
    """
    names = codim2.parameters(dataset, "dataset")
    curves = codim2.curves_over([dataset], names) + codim2.curves_over(boundaries, names)
    with style.use():
        rows, legends = [min(0.75 * width, HIGHEST)], [("", codim2.entries(curves))]
        with page(width, rows, legends, caption.sentences(dataset, names)) as (figure, grid):
            axes = figure.add_subplot(grid[0])
            for name, way, span in zip(
                names, "xy", json.loads(dataset.attrs["ranges"]), strict=True
            ):
                getattr(axes, f"set_{way}label")(label(dataset[name]))
                getattr(axes, f"set_{way}lim")(span)
            style.few_ticks(axes)
            draw_curves(axes, curves)
        return figure


def draw(axes: Axes, names: Sequence[str], boundaries: Sequence[xr.Dataset]) -> None:
    """Draw boundaries on given axes of two parameters, the first of ``names`` to the right."""
    draw_curves(axes, codim2.curves_over(list(boundaries), names))


def draw_curves(axes: Axes, curves: Sequence[codim2.BifurcationCurve]) -> None:
    """Draw each curve in the line of its kind, on axes of the same two parameters."""
    for one in curves:
        axes.plot(
            *one.points.T, **line_options(class_styles.BIFURCATIONS[one.kind].line), zorder=3.2
        )
