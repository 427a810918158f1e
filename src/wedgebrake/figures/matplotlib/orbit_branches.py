"""Branches of periodic orbits against a parameter, stable and unstable, with bifurcations."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from wedgebrake.figures.data import caption
from wedgebrake.figures.data.class_styles import BIFURCATIONS
from wedgebrake.figures.data.orbit_branches import OrbitBranches
from wedgebrake.figures.data.parts import with_one_part
from wedgebrake.figures.matplotlib import point_labels, style
from wedgebrake.figures.matplotlib.bifurcation import draw_density
from wedgebrake.figures.matplotlib.layout import line_options, marker_options, page, settle

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

# Width beside the axes, largest height of the axes [inch].
_MARGINS, _HIGHEST = 0.6, 3.5
# Number of bifurcations above which symbols are smaller [pt].
_MANY, _SIZE, _SMALLER = 40, 4.0, 3.3


def orbits(
    dataset: xr.Dataset,
    quantity: str | None = None,
    *,
    beneath: xr.Dataset | None = None,
    inertia: str | None = None,
    width: float = style.PAGE,
) -> Figure:
    """Branches of periodic orbits against their parameter: a new figure.

    dataset  : as returned by ``wb.branches``
    quantity : "velocity" [rad/s] or "angle" [rad] of the Poincare points, a curve for each
               period of the torque that an orbit takes; or a result of the whole orbit,
               "velocity_amplitude" [rad/s], "angle_amplitude" [rad] (half ranges),
               "stick_share" or "largest_exponent" [1/s]. Default: "velocity", for limit
               cycles "velocity_amplitude"
    beneath  : a sweep over the same parameter with its Poincare points, as
               returned by ``wb.bifurcation``: drawn in grey
    inertia  : inertia of a machine whose Poincare points are drawn; None for the first. Results
               of the whole orbit are the largest of all inertias or contacts
    width    : of the figure [inch]; a journal's column is 3.5, its page 7.2

    Stable orbits are solid and unstable ones dashed, in a colour for each period. Each kind
    of bifurcation has a symbol, full for those of smooth systems and hollow for those of
    friction, and letters where there is room for them. A branch that leaves the heights of
    all others is cut off.

    Raises ``InputError`` for a dataset that holds no orbits, another quantity, or a sweep
    beneath that has no such points over the same parameter.
    """
    data = OrbitBranches.of(dataset, quantity, beneath, inertia)
    shown = with_one_part(dataset, inertia) if data.quantity in style.SECTION else dataset
    sentences = caption.sentences(shown, [data.parameter])
    # The axis label does not say which of several inertias or contacts is shown.
    whose = str(dataset[data.quantity].attrs.get("long_name", "")).partition(", ")[2]
    if whose and data.quantity not in style.SECTION:
        sentences.append(f"Shown: {whose}")
    if beneath is not None:
        sentences.append(f"Grey: {caption.method_and_settings(beneath, [data.parameter])}")
    height = min(0.72 * width, _HIGHEST)
    with page(width, [height], data.legends(), sentences, beside=_MARGINS) as (figure, grid):
        axes = figure.add_subplot(grid[0])
        _set_axes(axes, data)
        if data.simulated is not None:
            size = 72.0 * (width - _MARGINS), 72.0 * height
            for points in data.simulated.points:
                draw_density(axes, data.simulated.x, points, data.ylim, style.DENSITY_BENEATH, size)
        _draw_curves(axes, data)
        _draw_symbols(axes, data)
    # Labels need the axes at their final position.
    settle(figure)
    with style.use():
        curves = [np.stack((curve.x, curve.y), axis=1) for curve in data.curves]
        point_labels.draw(axes, data.letters(), curves)
    return figure


def _set_axes(axes: Axes, data: OrbitBranches) -> None:
    axes.set_xlabel(data.labels[0])
    axes.set_ylabel(data.labels[1])
    if not data.curves:
        style.show_message(axes, "no orbits")
        return
    log = data.simulated is not None and data.simulated.x.log
    if log:
        axes.set_xscale("log")
    axes.set_xlim(data.xlim)
    axes.set_ylim(data.ylim)
    style.few_ticks(axes)
    if log:
        style.round_ticks(axes.xaxis, *data.xlim)
    if data.quantity == "largest_exponent":
        axes.axhline(0.0, color=style.GREY, linewidth=0.5, zorder=1.5)


def _draw_curves(axes: Axes, data: OrbitBranches) -> None:
    """Draw stable pieces solid, unstable ones dashed and behind them."""
    for curve in data.curves:
        axes.plot(
            curve.x,
            curve.y,
            **line_options(curve.line),
            # A branch with one point is drawn as a point.
            marker="o" if curve.x.size == 1 else "",
            markersize=2.0,
            zorder=3.1 if curve.stable else 3.0,
            rasterized=curve.x.size > style.RASTER_FROM,
        )


def _draw_symbols(axes: Axes, data: OrbitBranches) -> None:
    """Draw the symbols of all bifurcations, those of smooth systems in front."""
    every = [data.points(kind) for kind in BIFURCATIONS]
    size = _SMALLER if sum(map(len, every)) > _MANY else _SIZE
    for place, (points, one) in enumerate(zip(every, BIFURCATIONS.values(), strict=True)):
        if points.size:
            axes.plot(*points.T, **marker_options(one.marker(size)), zorder=4.5 - 0.01 * place)
