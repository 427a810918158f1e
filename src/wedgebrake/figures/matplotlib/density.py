"""Poincare points of a sweep over one parameter, shaded by how many of them lie where."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from wedgebrake.figures.data.swept_axis import SweptAxis
from wedgebrake.figures.matplotlib import style
from wedgebrake.figures.matplotlib.class_map import draw_cells

if TYPE_CHECKING:
    from matplotlib.axes import Axes

# Height of a cell [pt]. Values closer than the second size are drawn as cells, others as marks of
# at most the third size.
_CELL, _CLOSE, _MARK = 0.7, 2.2, 1.9


def draw(
    axes: Axes,
    x: SweptAxis,
    points: np.ndarray,
    span: tuple[float, float],
    shades: Sequence[str],
    size: tuple[float, float],
) -> None:
    """Draw cells of colour, or marks where values of the parameter are few.

    points : (n, period); NaN where there is none
    span   : lowest and highest value shown
    shades : colours from the share of one point to all, on a logarithmic scale
    size   : width and height of the axes [pt]
    """
    from matplotlib.colors import LinearSegmentedColormap, LogNorm

    rows = max(8, int(size[1] / _CELL))
    columns, edges = _columns(x, int(size[0] / _CELL))
    share = _shares(points, columns, edges.size - 1, rows, span)
    options: dict[str, Any] = {
        "cmap": LinearSegmentedColormap.from_list("density", shades),
        "norm": LogNorm(1.0 / max(2, points.shape[1]), 1.0, clip=True),
    }
    spacing = size[0] / x.values.size
    if spacing > _CLOSE:
        _draw_marks(axes, x, share, span, min(_MARK, max(_CELL, 0.6 * spacing)), options)
        return
    up = SweptAxis.between(np.linspace(*span, rows + 1))
    draw_cells(
        axes, SweptAxis.between(edges, log=x.log), up, np.ma.masked_equal(share.T, 0.0), **options
    )


def _draw_marks(
    axes: Axes,
    x: SweptAxis,
    share: np.ndarray,
    span: tuple[float, float],
    size: float,
    options: dict[str, Any],
) -> None:
    """Draw a mark [pt] in the middle of each cell with points, the darkest in front."""
    column, row = np.nonzero(share)
    order = np.argsort(share[column, row], kind="stable")
    column, row = column[order], row[order]
    height = (span[1] - span[0]) / share.shape[1]
    axes.scatter(
        x.values[column],
        span[0] + (row + 0.5) * height,
        c=share[column, row],
        s=size**2,
        linewidths=0.0,
        zorder=2.0,
        rasterized=column.size > style.RASTER_FROM,
        **options,
    )


def _columns(x: SweptAxis, most: int) -> tuple[np.ndarray, np.ndarray]:
    """The column of each value and the edges of the columns: one cell, or one for several."""
    if x.values.size <= most:
        return np.arange(x.values.size), x.edges
    first, last = x.ends()
    edges = np.linspace(first, last, most + 1)
    column = np.searchsorted(edges, x.positions(x.values), side="right") - 1
    return np.clip(column, 0, most - 1), x.at(edges)


def _shares(
    points: np.ndarray,
    columns: np.ndarray,
    number: int,
    rows: int,
    span: tuple[float, float],
) -> np.ndarray:
    """Share of the points of a column in each of its cells, (column, row)."""
    row = (points - span[0]) * (rows / (span[1] - span[0]))
    with np.errstate(invalid="ignore"):
        inside = (row >= 0.0) & (row < rows)
    cell = columns[:, None] * rows + np.where(inside, row, 0.0).astype(np.int64)
    counts = np.bincount(cell[inside], minlength=number * rows).reshape(number, rows)
    recorded = np.bincount(
        np.broadcast_to(columns[:, None], points.shape)[np.isfinite(points)], minlength=number
    )
    share: np.ndarray = counts / np.maximum(recorded, 1)[:, None]
    return share
