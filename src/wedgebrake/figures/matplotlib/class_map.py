"""Cells of colour over two axes, with the lines over them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from wedgebrake.figures.data.class_map import ClassMap
from wedgebrake.figures.data.class_styles import HATCH, STABILITY_LIMIT, ClassStyle
from wedgebrake.figures.data.swept_axis import SweptAxis
from wedgebrake.figures.matplotlib import style
from wedgebrake.figures.matplotlib.legend import HATCHES, line_options

if TYPE_CHECKING:
    from matplotlib.axes import Axes


def draw_map(axes: Axes, data: ClassMap) -> None:
    """Draw axes, cells and the stability limit."""
    draw_hatching(axes)
    set_axes(axes, data.x, data.y)
    draw_classes(axes, data.x, data.y, data.codes, data.styles)
    for line in data.limit:
        across, up = data.x.at(line[:, 0]), data.y.at(line[:, 1])
        axes.plot(across, up, **line_options(STABILITY_LIMIT), zorder=3.0)


def set_axes(axes: Axes, x: SweptAxis | None, y: SweptAxis | None) -> None:
    """Set labels, scales, limits and ticks of parameters."""
    for one, way in ((x, "x"), (y, "y")):
        if one is None:
            continue
        matplotlib_axis = getattr(axes, f"{way}axis")
        getattr(axes, f"set_{way}label")(one.label)
        if one.log:
            getattr(axes, f"set_{way}scale")("log")
            style.round_ticks(matplotlib_axis, one.edges[0], one.edges[-1])
        elif one.values.size == 1:
            matplotlib_axis.set_ticks(one.values, labels=[f"${style.number(one.values[0])}$"])
        getattr(axes, f"set_{way}lim")(one.edges[0], one.edges[-1])
    if all(one is None or one.log or one.values.size > 1 for one in (x, y)):
        style.few_ticks(axes)


def draw_hatching(axes: Axes) -> None:
    """Hatch all of the axes, behind everything: visible where cells are not opaque."""
    from matplotlib.patches import Rectangle

    axes.add_patch(
        Rectangle(
            (0.0, 0.0),
            1.0,
            1.0,
            transform=axes.transAxes,
            facecolor="white",
            edgecolor=HATCH,
            hatch=HATCHES,
            linewidth=0.0,
            zorder=0.1,
        )
    )


def draw_classes(
    axes: Axes, x: SweptAxis, y: SweptAxis, codes: np.ndarray, styles: Sequence[ClassStyle]
) -> None:
    """Draw cells in the colours of their classes; none where a code is below 0."""
    from matplotlib.colors import ListedColormap, to_rgba

    if np.all(codes < 0):
        return
    colours = ListedColormap([to_rgba(one.colour, one.opacity) for one in styles])
    options = {"cmap": colours, "vmin": -0.5, "vmax": len(styles) - 0.5}
    draw_cells(axes, x, y, np.ma.masked_less(codes, 0), **options)


def draw_cells(axes: Axes, x: SweptAxis, y: SweptAxis, values: np.ndarray, **options: Any) -> Any:
    """Draw cells of colour, values (y, x). Returns the artist, for a colour bar."""
    if not (x.even and y.even):
        # On logarithmic axes too: releases of Matplotlib disagree on what an image is there.
        return axes.pcolormesh(x.edges, y.edges, values, rasterized=True, zorder=1.0, **options)
    extent = (x.edges[0], x.edges[-1], y.edges[0], y.edges[-1])
    limits = axes.get_xlim(), axes.get_ylim()
    image = axes.imshow(
        values,
        origin="lower",
        extent=extent,
        aspect="auto",
        interpolation="nearest",
        zorder=1.0,
        **options,
    )
    axes.set_xlim(limits[0])
    axes.set_ylim(limits[1])
    return image
