"""Amplitude and phase over one parameter, a curve for each value of a second one."""

from __future__ import annotations

from typing import TYPE_CHECKING

from wedgebrake.figures.data import caption
from wedgebrake.figures.data.response_curve import FOLD, FOLDS, ResponseCurves
from wedgebrake.figures.matplotlib import style
from wedgebrake.figures.matplotlib.layout import line_options, marker_options, page

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from wedgebrake.figures.data.response_curve import ResponsePanel

# Heights of the first panel and of a second one, as shares of the width, and the largest [inch].
_HEIGHTS, _HIGHEST = (0.4, 0.22), 3.0


def response_curve(
    dataset: xr.Dataset,
    quantity: str | None = None,
    *,
    inertia: str | None = None,
    contact: str | None = None,
    shaft: str | None = None,
    width: float = style.PAGE,
) -> Figure:
    """Amplitude and phase over one parameter at several values of a second one: a new figure.

    dataset  : as returned by ``wb.response_curve``
    quantity : "angle_amplitude", "velocity_amplitude" (half ranges), "angle_fundamental",
               "angle_phase", "twist_fundamental", "twist_phase", "twist_amplitude",
               "friction_heat", "equivalent_damping", "stick_share" or "peak_torque"; default:
               "angle_amplitude" above "angle_phase"
    inertia, contact, shaft : of a machine; None for the first
    width    : of the figure [inch]

    Each level has a colour. Stable orbits are solid and unstable ones dashed; parts of a curve on
    which a contact sticks are shaded. Folds are marked, and joined by a dotted line if they were
    followed. An amplitude with a peak far above its other values has a logarithmic axis.

    Raises ``InputError`` for another dataset, quantity or part.
    """
    data = ResponseCurves.of(dataset, quantity, inertia=inertia, contact=contact, shaft=shaft)
    sentences = caption.sentences(dataset, [data.parameter, data.level])
    heights = [min(share * width, _HIGHEST) for share in _HEIGHTS[: len(data.panels)]]
    with page(width, heights, data.legends(), sentences) as (figure, grid):
        first = figure.add_subplot(grid[0])
        axes = [first, *(figure.add_subplot(grid[k], sharex=first) for k in range(1, len(heights)))]
        for one, panel in zip(axes, data.panels, strict=True):
            _draw(one, panel, data)
        axes[-1].set_xlabel(data.xlabel)
        for one in axes[:-1]:
            one.tick_params(axis="x", labelbottom=False)
    return figure


def _draw(axes: Axes, panel: ResponsePanel, data: ResponseCurves) -> None:
    axes.set_ylabel(panel.label)
    axes.set_xlim(data.xlim)
    if panel.log:
        axes.set_yscale("log")
    axes.set_ylim(panel.ylim)
    style.few_ticks(axes)
    for curve in panel.sticks:
        axes.plot(curve.x, curve.y, **line_options(data.band(curve)), zorder=2.0)
    for points in panel.joined:
        axes.plot(*points.T, **line_options(FOLDS), zorder=2.5)
    for curve in panel.curves:
        axes.plot(
            curve.x, curve.y, **line_options(data.line(curve)), zorder=3.1 if curve.stable else 3.0
        )
    if panel.folds.size:
        axes.plot(*panel.folds.T, **marker_options(FOLD), zorder=4.0)
