"""Picture of a stop: speeds, judder and jerk."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from wedgebrake.figures.data.stopping import LinePanel, Stop
from wedgebrake.figures.matplotlib import style
from wedgebrake.figures.matplotlib.layout import caption_lines, write_caption

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

# Heights of a row of panels and of a line of the caption, width of a panel [inch].
_ROW, _CAPTION, _PANEL = 2.15, 0.125, 3.0
# Colours of the phases, and the width of the bars of an inertia.
_PHASES = (style.BLUE, style.VERMILLION)
_BARS = 0.7
# Largest number of names in a legend.
_NAMED = 6


def stop(stopping: xr.Dataset, *, width: float = style.PAGE) -> Figure:
    """Draw a stop in a new figure.

    stopping : as returned by ``wb.stopping``
    width    : of the figure [inch]

    Panels: mean speed over time; judder, the amplitude of the speed and of the torque about a
    straight line in each window, over the mean speed; largest jerk of each inertia while braking
    and in the ring-down, with its root mean square as a line across the bar.
    """
    data = Stop.of(stopping)
    across = 2 if width >= 2.0 * _PANEL else 1
    down = 4 // across
    caption = _CAPTION * len(caption_lines(data.sentences, width))
    with style.use():
        figure = style.new_figure(width, down * _ROW + caption + 0.1)
        grid = figure.subplots(down, across, squeeze=False).ravel()
        for axes, panel in zip(grid, data.panels, strict=False):
            draw_lines(axes, panel)
        draw_jerk(grid[-1], data)
        write_caption(figure, data.sentences)
        return figure


def draw_lines(axes: Axes, panel: LinePanel) -> None:
    """Draw curves with a point for each window."""
    for line in panel.lines:
        look: Any = {"color": line.colour, "linestyle": (0, line.dashes), "label": line.name}
        axes.plot(line.x, line.y, marker=".", markersize=3.0, **look)
    axes.set_xlabel(panel.x_label)
    axes.set_ylabel(panel.y_label)
    axes.set_ylim(bottom=min(0.0, *(float(np.min(line.y)) for line in panel.lines)))
    style.few_ticks(axes)
    if len(panel.lines) <= _NAMED:
        handles, _ = axes.get_legend_handles_labels()
        style.legend_above(axes, handles, 3)


def draw_jerk(axes: Axes, data: Stop) -> None:
    """Draw the jerk of each inertia as bars."""
    axes.set_ylabel("jerk  [rad/s³]")
    places = np.arange(len(data.inertias))
    each = _BARS / max(len(data.jerks), 1)
    for i, jerk in enumerate(data.jerks):
        x = places + (i - 0.5 * (len(data.jerks) - 1)) * each
        axes.bar(x, jerk.peak, 0.9 * each, color=_PHASES[i], label=jerk.phase)
        axes.hlines(jerk.rms, x - 0.45 * each, x + 0.45 * each, color="white", linewidth=1.0)
    axes.set_xticks(places, data.inertias)
    handles, _ = axes.get_legend_handles_labels()
    style.legend_above(axes, handles)
