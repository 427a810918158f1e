"""The bifurcation diagram: Poincare points over one parameter, with their classes below."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from wedgebrake.figures.data import caption
from wedgebrake.figures.data import class_styles as classes
from wedgebrake.figures.data.axes import SweptAxis, true_runs
from wedgebrake.figures.data.bifurcation import BifurcationDiagram
from wedgebrake.figures.data.parts import with_one_part
from wedgebrake.figures.matplotlib import style
from wedgebrake.figures.matplotlib.bands import MARGINS, diagram
from wedgebrake.figures.matplotlib.maps import draw_cells
from wedgebrake.figures.matplotlib.response_diagram import response_diagram

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_SHADE = "Shade: share of the points of a parameter, logarithmic."

# Height of the exponents [inch].
_EXPONENT = 0.95
# Share of the exponents that may lie below the axis.
_DEEP = 0.03
# Height of a cell of points [pt]. Values closer than the second size are drawn as cells, others as
# marks of at most the third size.
_CELL, _CLOSE, _MARK = 0.7, 2.2, 1.9


def bifurcation(
    dataset: xr.Dataset,
    quantity: str = "velocity",
    *,
    exponent: bool | None = None,
    inertia: str | None = None,
    contact: str | None = None,
    width: float = style.PAGE,
) -> Figure:
    """Poincare points against the parameter, with their classes of motion: a new figure.

    dataset  : as returned by ``wb.bifurcation`` or ``wb.sweep`` for one parameter
    quantity : "velocity" [rad/s] or "angle" [rad] of the points; "response" or a result of the
               sweep, such as "rms_jerk", draws amplitudes instead (``response_diagram``)
    exponent : whether to draw the largest Lyapunov exponent [1/s], with its standard error;
               None: where the dataset has one. The lowest few percent may lie outside
    inertia, contact : of a machine, whose points and sticks are drawn; None for the first
    width    : of the figure [inch]; a journal's column is 3.5, its page 7.2

    The shade says how many of the points of a parameter lie in one place, on a logarithmic
    scale: a single point is light, a periodic motion dark. Below are the class of motion
    and of stick-slip of every parameter, failed runs included. The dashed line is the
    linear stability limit.

    With a dimension ``branch`` (``follow``) there is one diagram for each direction, and
    intervals where the two differ are shaded: in class of motion, or, both periodic of one
    order, in their points. Two chaotic or undecided motions are not compared.

    Raises ``InputError`` for a dataset that is not a sweep over one parameter, or keeps no
    points.
    """
    if quantity not in style.SECTION:
        return response_diagram(dataset, quantity, inertia=inertia, contact=contact, width=width)
    dataset = with_one_part(dataset, inertia, contact)
    data = BifurcationDiagram.of(dataset, quantity)
    if exponent is None:
        exponent = bool(np.any(np.isfinite(data.exponent)))
    number = len(data.branches)
    height = (0.30 if number > 1 else 0.38) * max(width, 5.5)
    heights = [height] * number + [_EXPONENT] * exponent
    sentences = [*caption.sentences(dataset, [data.x.name]), _SHADE]
    legends = data.legends(exponent=exponent)
    with diagram(data, heights, legends, sentences, width) as (figure, panels):
        for branch in range(number):
            _draw_points(panels[branch], data, branch, (72.0 * (width - MARGINS), 72.0 * height))
        if exponent:
            _draw_exponents(panels[-1], data)
        if len(data.limits) == 1:
            _name_sides(panels[0], *data.limits[0])
    return figure


def _draw_points(
    axes: Axes, data: BifurcationDiagram, branch: int, size: tuple[float, float]
) -> None:
    one, span = data.branches[branch], (data.low, data.high)
    axes.set_ylabel(style.SECTION[data.quantity])
    axes.set_ylim(span)
    _shade(axes, data.x, data.empty[branch], classes.EMPTY.colour)
    _shade(axes, data.x, data.differs, classes.DIFFER.colour)
    if not np.all(data.empty[branch]):
        draw_density(axes, data.x, data.points[branch], span, one.shades, size)
    for value, _ in data.limits:
        axes.axvline(value, color=style.LIMIT, linewidth=0.9, linestyle=style.DASHES, zorder=3)
    if one.direction:
        look: Any = {"rotation": -90, "va": "center", "fontsize": style.points(style.LABELS)}
        style.write(axes, one.direction, (1.0, 0.5), (4.0, 0.0), **look)


def _shade(axes: Axes, x: SweptAxis, chosen: np.ndarray, colour: str) -> None:
    """Fill the cells of chosen values, behind the points."""
    for first, last in true_runs(chosen):
        edges = x.edges[first], x.edges[last + 1]
        axes.axvspan(*edges, facecolor=colour, edgecolor="none", linewidth=0.0, zorder=0.5)


def _draw_exponents(axes: Axes, data: BifurcationDiagram) -> None:
    axes.set_ylabel(r"exponent $\lambda_1$" + "\n[1/s]")
    axes.axhline(0.0, color=style.GREY, linewidth=0.5, zorder=1.5)
    finite = data.exponent[np.isfinite(data.exponent)]
    if not finite.size:
        style.show_message(axes, "no exponents")
        return
    for branch, exponent, error in zip(data.branches, data.exponent, data.error, strict=True):
        values = np.where(np.isfinite(exponent), exponent, np.nan)
        width = np.nan_to_num(error, posinf=0.0)
        band: Any = {"facecolor": branch.colour, "edgecolor": "none", "alpha": 0.3}
        axes.fill_between(data.x.values, values - width, values + width, **band, zorder=2)
        dots: Any = {"marker": "o", "markersize": 0.9, "markeredgewidth": 0.0}
        axes.plot(data.x.values, values, color=branch.colour, linewidth=0.6, **dots, zorder=3)
    # The few lowest belong to motions whose sticks erase the initial state; they are left out.
    top, low = float(np.max(finite)), float(np.quantile(finite, _DEEP))
    axes.set_ylim(*style.margins(min(low, 0.0), max(top, 0.0), 0.0, share=0.1))
    style.few_ticks(axes, y=3)


def _name_sides(axes: Axes, value: float, stable_right: bool) -> None:
    words = ("linearly unstable", "stable") if stable_right else ("linearly stable", "unstable")
    for word, side, shift in zip(words, ("right", "left"), (-3.0, 3.0), strict=True):
        at = ("data", "axes fraction")
        style.write_above(axes, word, value, (shift, 2.5), at, ha=side, va="bottom")


def draw_density(
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
    share, edges = _shares(x, points, int(size[0] / _CELL), np.linspace(*span, rows + 1))
    options: dict[str, Any] = {
        "cmap": LinearSegmentedColormap.from_list("density", shades),
        "norm": LogNorm(1.0 / max(2, points.shape[1]), 1.0, clip=True),
    }
    up = SweptAxis.from_edges(np.linspace(*span, rows + 1))
    spacing = size[0] / x.values.size
    if spacing <= _CLOSE:
        cells = np.ma.masked_equal(share.T, 0.0)
        draw_cells(axes, SweptAxis.from_edges(edges, log=x.log), up, cells, **options)
        return
    # A mark in the middle of each cell with points, the darkest in front.
    column, row = np.nonzero(share)
    order = np.argsort(share[column, row], kind="stable")
    column, row = column[order], row[order]
    options |= {"s": min(_MARK, max(_CELL, 0.6 * spacing)) ** 2, "linewidths": 0.0, "zorder": 2.0}
    options["rasterized"] = column.size > style.RASTER_FROM
    axes.scatter(x.values[column], up.values[row], c=share[column, row], **options)


def _shares(
    x: SweptAxis, points: np.ndarray, most: int, levels: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Share of the points of a column in each of its cells, (column, row); edges of columns.

    A column is that of one value, or of several where there are more than ``most``.
    """
    edges = x.positions(x.edges)
    if x.values.size > most:
        edges = np.linspace(edges[0], edges[-1], most + 1)
    known = np.isfinite(points)
    across = np.broadcast_to(x.positions(x.values)[:, None], points.shape)[known]
    counts = np.histogram2d(across, points[known], bins=(edges, levels))[0]
    recorded = np.histogram(across, edges)[0]
    return counts / np.maximum(recorded, 1)[:, None], x.at(edges)
