"""Picture of a stop: speeds, judder and jerk."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from wedgebrake.figures.data.stopping import StopCurves
from wedgebrake.figures.matplotlib import style
from wedgebrake.figures.matplotlib.layout import captioned
from wedgebrake.figures.matplotlib.panels import draw_panel

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

# Height of a row of panels, width of a panel [inch].
_ROW, _PANEL = 2.15, 3.0
# Colours of the phases, and the width of the bars of an inertia.
_PHASES = (style.BLUE, style.VERMILLION)
_BARS = 0.7


def stopping(dataset: xr.Dataset, *, width: float = style.PAGE) -> Figure:
    """Draw a stop in a new figure.

    dataset : as returned by ``wb.stopping``
    width   : of the figure [inch]

    Panels: mean speed over time; judder, the amplitude of the speed and of the torque about a
    straight line in each window, over the mean speed; largest jerk of each inertia while braking
    and in the ring-down, with its root mean square as a line across the bar.
    """
    data = StopCurves.of(dataset)
    across = 2 if width >= 2.0 * _PANEL else 1
    down = 4 // across
    with captioned(width, down * _ROW + 0.1, data.sentences) as figure:
        grid = figure.subplots(down, across, squeeze=False).ravel()
        for axes, panel in zip(grid, data.panels, strict=False):
            draw_panel(axes, panel)
        draw_jerk(grid[-1], data)
    return figure


def draw_jerk(axes: Axes, data: StopCurves) -> None:
    """Draw the jerk of each inertia as bars."""
    axes.set_ylabel("jerk  [rad/s³]")
    places = np.arange(len(data.inertias))
    each = _BARS / max(len(data.jerks), 1)
    for i, jerk in enumerate(data.jerks):
        x = places + (i - 0.5 * (len(data.jerks) - 1)) * each
        axes.bar(x, jerk.peak, 0.9 * each, color=_PHASES[i], label=jerk.phase)
        axes.hlines(jerk.rms, x - 0.45 * each, x + 0.45 * each, color="white", linewidth=1.0)
    highest = max((float(np.nanmax(jerk.peak, initial=0.0)) for jerk in data.jerks), default=0.0)
    axes.set_ylim(0.0, 1.08 * highest or 1.0)
    axes.set_xticks(places, data.inertias)
    handles, _ = axes.get_legend_handles_labels()
    style.legend_above(axes, handles)
