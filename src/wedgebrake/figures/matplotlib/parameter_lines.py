"""Pictures of curves over one parameter."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from wedgebrake.figures.data.class_map import REGIONS, STABLE, UNSTABLE
from wedgebrake.figures.data.parameter_lines import Panel, ParameterLines
from wedgebrake.figures.matplotlib import style
from wedgebrake.figures.matplotlib.layout import caption_lines, write_caption
from wedgebrake.figures.matplotlib.maps import set_axes

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

# Height of a panel, of a line of the caption, and of the parameter's axis [inch].
_ROW, _CAPTION, _AXIS = 1.45, 0.125, 0.35
# Largest number of values that are marked with points.
_POINTS = 60


def draw_figure(data: ParameterLines, width: float) -> Figure:
    """Draw panels one above the other in a new figure of a given width [inch]."""
    rows = len(data.panels)
    caption = _CAPTION * len(caption_lines(data.sentences, width))
    with style.use():
        figure = style.new_figure(width, rows * _ROW + _AXIS + caption)
        grid = figure.subplots(rows, 1, squeeze=False, sharex=True)[:, 0]
        for axes, panel in zip(grid, data.panels, strict=True):
            draw_panel(axes, data, panel)
            axes.set_xlabel("")
        for axes in grid[:-1]:
            axes.tick_params(axis="x", labelbottom=False)
        grid[-1].set_xlabel(data.x.label)
        write_caption(figure, data.sentences)
    return figure


def draw_panel(axes: Axes, data: ParameterLines, panel: Panel) -> None:
    """Draw the curves of a panel on axes of the parameter."""
    set_axes(axes, data.x)
    axes.set_ylabel(panel.label)
    for low, high in data.shaded if panel.filled is None else ():
        axes.axvspan(low, high, color=REGIONS[UNSTABLE].colour, linewidth=0.0, zorder=0.2)
    x = data.x.values
    for line in panel.lines:
        look: Any = {"color": line.colour, "linestyle": (0, line.dashes), "label": line.name}
        axes.plot(x, line.values, zorder=3.0, **look)
        if line.points and x.size <= _POINTS:
            style.plot_points(axes, x, line.values, 2.2, color=line.colour, zorder=3.1)
    _set_height(axes, panel)
    if panel.filled is not None:
        low, high = axes.get_ylim()
        lower, upper = np.clip(panel.filled.T, low, high)
        rest: Any = {"color": REGIONS[UNSTABLE].colour, "linewidth": 0.0, "zorder": 0.2}
        axes.fill_between(x, low, high, **rest)
        fill: Any = {"color": REGIONS[STABLE].colour, "linewidth": 0.0, "zorder": 0.4}
        axes.fill_between(x, lower, upper, **fill)
    for level in panel.levels:
        axes.axhline(level.value, color=style.GREY, linewidth=0.6, linestyle=(0, (4.0, 1.5)))
        if level.name:
            bottom, top = axes.get_ylim()
            above = level.value < 0.5 * (bottom + top)
            look = {"ha": "right", "fontsize": style.SMALL, "color": style.GREY}
            look["va"] = "bottom" if above else "top"
            place, shift = (1.0, level.value), (-3.0, 1.5 if above else -1.5)
            style.write(axes, level.name, place, shift, ("axes fraction", "data"), **look)
    if data.own is not None:
        axes.axvline(data.own, color=style.GREY, linewidth=0.6, linestyle=(0, (1.0, 1.5)))
    handles, labels = axes.get_legend_handles_labels()
    named = [one for one, label in zip(handles, labels, strict=True) if label]
    style.legend_above(axes, named, max(len(named), 1))


def _set_height(axes: Axes, panel: Panel) -> None:
    """Set the limits of the vertical axis, such that it contains all curves and lines."""
    parts = [line.values for line in panel.lines] + [[one.value for one in panel.levels]]
    values = np.concatenate([np.asarray(one, float).ravel() for one in parts])
    values = values[np.isfinite(values)]
    if panel.zero:
        values = np.append(values, 0.0)
    if values.size:
        low, high = float(values.min()), float(values.max())
        axes.set_ylim(*style.margins(low, high, 1e-6 * max(abs(low), abs(high)), share=0.08))
    style.few_ticks(axes, y=4)
