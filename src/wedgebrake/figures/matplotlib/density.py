"""Poincare points of a sweep over one parameter, shaded by how many of them lie where."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from wedgebrake.figures.matplotlib import heatmap, style
from wedgebrake.figures.matplotlib.heatmap import Axis

if TYPE_CHECKING:
    from matplotlib.axes import Axes

# Height of a cell [pt]; parameters closer than the second become cells too, others marks of at
# most the third.
_CELL, _CLOSE, _MARK = 0.7, 2.2, 1.9


def draw(
    axes: Axes,
    x: Axis,
    points: np.ndarray,
    span: tuple[float, float],
    shades: Sequence[str],
    size: tuple[float, float],
) -> None:
    """Cells of colour, or marks where parameters are few.

    points : (n, period); NaN where there is none
    span   : lowest and highest value shown
    shades : colours from the share of one point to all, on a logarithmic scale
    size   : width and height of the axes [pt]
    """
    from matplotlib.colors import LinearSegmentedColormap, LogNorm

    rows = max(8, int(size[1] / _CELL))
    columns, edges = _columns(x, int(size[0] / _CELL))
    share = _shares(points, columns, edges.size - 1, rows, span)
    how: dict[str, Any] = {
        "cmap": LinearSegmentedColormap.from_list("density", shades),
        "norm": LogNorm(1.0 / max(2, points.shape[1]), 1.0, clip=True),
    }
    spacing = size[0] / x.values.size
    if spacing > _CLOSE:
        _draw_marks(axes, x, share, span, min(_MARK, max(_CELL, 0.6 * spacing)), how)
        return
    up = heatmap.between(np.linspace(*span, rows + 1))
    heatmap.draw_cells(
        axes, heatmap.between(edges, log=x.log), up, np.ma.masked_equal(share.T, 0.0), **how
    )


def _draw_marks(
    axes: Axes,
    x: Axis,
    share: np.ndarray,
    span: tuple[float, float],
    size: float,
    how: dict[str, Any],
) -> None:
    """A mark [pt] in the middle of each cell with points, the darkest in front."""
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
        **how,
    )


def _columns(x: Axis, most: int) -> tuple[np.ndarray, np.ndarray]:
    """The column of each parameter and the columns' edges: its cell, or of several one."""
    if x.values.size <= most:
        return np.arange(x.values.size), x.edges
    first, last = x.ends()
    edges = np.linspace(first, last, most + 1)
    column = np.searchsorted(edges, x.places(x.values), side="right") - 1
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
