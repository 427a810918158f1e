"""Picture of all parts of a response: panels over time, with the sticks of the contacts."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from wedgebrake.figures.data.time_panels import TimePanels
from wedgebrake.figures.matplotlib import style
from wedgebrake.figures.matplotlib.layout import captioned
from wedgebrake.figures.matplotlib.panels import draw_panel, legend_columns

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

# Heights [inch]: of a panel, of a contact in the strip of sticks, of labels and ticks below, of the
# space between panels, and of a legend.
_HEIGHT, _STRIP, _BELOW, _BETWEEN, _LEGEND = 0.85, 0.13, 0.45, 0.1, 0.13
# Largest number of contacts whose shading can be distinguished.
_SHADED = 3


def history(
    response: xr.Dataset,
    start: float | None = None,
    stop: float | None = None,
    *,
    width: float = style.PAGE,
) -> Figure:
    """Draw speeds, sticks, torques and forces of a machine against time in a new figure.

    response    : of a machine, as returned by ``simulate``
    start, stop : first and last time shown [s]; default all
    width       : of the figure [inch]

    The strip at the top shows when each contact sticks. With up to three contacts, the panel of
    speeds is shaded at these times. Panels of parts that the machine does not have are left out.
    Curves of very different size have panels of their own.

    Raises ``InputError`` for a dataset that is not the response of a machine, or times outside it.
    """
    data = TimePanels.of(response, start, stop)
    panels = [panel for those in data.panels.values() for panel in those]
    heights = [_HEIGHT * panel.height for panel in panels]
    if data.sticks:
        heights.insert(0, _STRIP * len(data.sticks) + 0.02)
    legends = [len(one.lines) / legend_columns(0.775 * width) for one in panels if one.legend]
    gaps = len(panels) * _BETWEEN + _LEGEND * sum(map(math.ceil, legends))
    with captioned(width, sum(heights) + gaps + _BELOW, data.sentences) as figure:
        rows = list(
            figure.subplots(len(heights), 1, sharex=True, squeeze=False, height_ratios=heights).flat
        )
        shown = rows[1:] if data.sticks else rows
        if data.sticks:
            draw_sticks(rows[0], data)
        for axes, panel in zip(shown, panels, strict=True):
            axes.axhline(0.0, color=style.GREY, linewidth=0.4, zorder=1.5)
            draw_panel(axes, panel, x_ticks=8)
            if not data.time.size:
                style.show_message(axes, "no samples in this time span")
        if len(data.sticks) <= _SHADED:
            for axes in shown[: len(data.panels["velocity"])]:
                for sticks in data.sticks:
                    style.shade(axes, sticks.start, sticks.end, sticks.colour, 0.22)
        rows[-1].set_xlabel("time $t$  [s]")
        rows[-1].set_xlim(*style.margins(data.begin, data.end, 0.0, share=0.0))
        figure.align_ylabels(rows)
    return figure


def draw_sticks(axes: Axes, data: TimePanels) -> None:
    """Draw the sticks of the contacts, one row for each contact."""
    for row, sticks in enumerate(data.sticks):
        axes.axhline(row, color=style.PALE_GREY, linewidth=0.5, zorder=1)
        spans = list(zip(sticks.start, sticks.end - sticks.start, strict=True))
        look: Any = {"facecolor": sticks.colour, "edgecolor": sticks.colour, "linewidth": 0.3}
        axes.broken_barh(spans, (row - 0.36, 0.72), **look)
    axes.set_ylim(len(data.sticks) - 0.5, -0.5)
    axes.set_yticks(range(len(data.sticks)), [f"{sticks.name} sticks" for sticks in data.sticks])
    axes.tick_params(axis="y", length=0)
    axes.tick_params(axis="x", length=0)
    for side in ("top", "right", "left", "bottom"):
        axes.spines[side].set_visible(False)
