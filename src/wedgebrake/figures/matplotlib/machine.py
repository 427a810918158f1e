"""Picture of the response of a machine: panels over time, with the sticks of its contacts."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from wedgebrake.figures.data.limits import extent
from wedgebrake.figures.data.machine import MachineHistory, Panel
from wedgebrake.figures.matplotlib import style
from wedgebrake.figures.matplotlib.layout import caption_lines, write_caption

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

# Heights [inch]: of a panel, of a contact in the strip of sticks, of labels and ticks below, of the
# space between panels, and of a legend.
_HEIGHT, _STRIP, _BELOW, _BETWEEN, _LEGEND = 0.85, 0.13, 0.45, 0.1, 0.13
# Height of a line of the caption [inch].
_CAPTION = 0.125
# Widths of the first and last curve of a panel [pt]: coinciding curves stay visible.
_WIDTHS = 1.4, 0.8
# Variation below this share of the values, or below this value, is rounding error.
_ROUNDING = 1e-9
# Largest number of contacts whose shading can be distinguished.
_SHADED = 3
# Width of a name in a legend [inch].
_NAME = 1.15


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

    Raises ``InputError`` for a dataset that is not the response of a machine, or times outside it.
    """
    data = MachineHistory.of(response, start, stop)
    heights = [_HEIGHT * panel.height for panel in data.panels]
    if data.rests:
        heights.insert(0, _STRIP * len(data.rests) + 0.02)
    caption = _CAPTION * len(caption_lines(data.sentences, width))
    with style.use():
        legends = [len(one.curves) / _columns(width) for one in data.panels if one.legend]
        gaps = len(data.panels) * _BETWEEN + _LEGEND * sum(map(math.ceil, legends))
        figure = style.new_figure(width, sum(heights) + gaps + _BELOW + caption)
        rows = figure.subplots(len(heights), 1, sharex=True, squeeze=False, height_ratios=heights)[
            :, 0
        ]
        if data.rests:
            draw_rests(rows[0], data)
        panels = rows[1:] if data.rests else rows
        for axes, panel in zip(panels, data.panels, strict=True):
            draw_panel(axes, data, panel)
        rows[-1].set_xlabel("time $t$  [s]")
        rows[-1].set_xlim(*style.margins(data.begin, data.end, 0.0, share=0.0))
        figure.align_ylabels(rows)
        write_caption(figure, data.sentences)
        return figure


def draw_rests(axes: Axes, data: MachineHistory) -> None:
    """Draw the sticks of the contacts, one row for each contact."""
    for row, rests in enumerate(data.rests):
        axes.axhline(row, color=style.PALE_GREY, linewidth=0.5, zorder=1)
        spans = list(zip(rests.start, rests.end - rests.start, strict=True))
        look: Any = {"facecolor": rests.colour, "edgecolor": rests.colour, "linewidth": 0.3}
        axes.broken_barh(spans, (row - 0.36, 0.72), **look)
    axes.set_ylim(len(data.rests) - 0.5, -0.5)
    axes.set_yticks(range(len(data.rests)), [f"{rests.name} sticks" for rests in data.rests])
    axes.tick_params(axis="y", length=0)
    axes.tick_params(axis="x", length=0)
    for side in ("top", "right", "left", "bottom"):
        axes.spines[side].set_visible(False)


def draw_panel(axes: Axes, data: MachineHistory, panel: Panel) -> None:
    """Draw the curves of a panel; the panel of speeds is shaded where contacts stick."""
    axes.set_ylabel(panel.label)
    if not data.time.size:
        style.say(axes, "no samples in this time span")
        return
    if panel.variable == "velocity" and len(data.rests) <= _SHADED:
        _shade(axes, data)
    axes.axhline(0.0, color=style.GREY, linewidth=0.4, zorder=1.5)
    count = len(panel.curves)
    widths = np.linspace(*_WIDTHS, count) if count > 1 else [0.9]
    for curve, width in zip(panel.curves, widths, strict=True):
        look: Any = {"color": curve.colour, "linestyle": (0, curve.dashes), "label": curve.name}
        style.plot_line(axes, data.time, curve.values, linewidth=width, zorder=3, **look)
    low, high = extent(*(curve.values[np.isfinite(curve.values)] for curve in panel.curves))
    axes.set_ylim(*_limits(low, high))
    style.few_ticks(axes, x=8, y=5 if panel.height > 1.2 else 3)
    if panel.legend:
        handles, _ = axes.get_legend_handles_labels()
        style.legend_above(axes, handles, _columns(style.inches_wide(axes)))


def _columns(width: float) -> int:
    """The number of names in one row of the legend of a figure with a given width [inch]."""
    return max(1, int(width / _NAME))


def _limits(low: float, high: float) -> tuple[float, float]:
    """Axis limits around low..high, wider around a constant."""
    largest = max(abs(low), abs(high))
    if high - low > _ROUNDING * max(largest, 1.0):
        return style.margins(low, high, 0.0, share=0.08)
    return style.margins(low, high, 0.4 * largest if largest > _ROUNDING else 1.0)


def _shade(axes: Axes, data: MachineHistory) -> None:
    """Shade the sticks of each contact over the whole height of a panel."""
    whole = axes.get_xaxis_transform()
    for rests in data.rests:
        spans = list(zip(rests.start, rests.end - rests.start, strict=True))
        look: Any = {"facecolor": rests.colour, "edgecolor": "none", "alpha": 0.22, "zorder": 1}
        axes.broken_barh(spans, (0.0, 1.0), transform=whole, **look)
