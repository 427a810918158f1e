"""Draw panels of curves."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from wedgebrake.figures.data.panels import Panel, StyledLine
from wedgebrake.figures.matplotlib import style

if TYPE_CHECKING:
    from matplotlib.axes import Axes

# Width of a name in a legend [inch].
_NAME = 0.9
# Variation below this share of the values, or below this value, is rounding error.
_ROUNDING = 1e-9
# Space below a zero at the bottom, so that a line along it is seen; share of the largest value.
_BELOW = 0.03


def draw_panel(axes: Axes, panel: Panel, x_ticks: int = 5) -> None:
    """Draw the curves of a panel, its levels and its legend."""
    axes.set_ylabel(panel.label)
    if panel.x_label:
        axes.set_xlabel(panel.x_label)
    for line in panel.lines:
        _draw_line(axes, line)
    values = [line.y for line in panel.lines] + [[one.value for one in panel.levels]]
    known = np.concatenate([np.asarray(one, float) for one in values])
    known = known[np.isfinite(known)]
    known = np.append(known, 0.0) if panel.zero or not known.size else known
    axes.set_ylim(*limits(float(known.min()), float(known.max()), zero=panel.zero))
    style.few_ticks(axes, x=x_ticks, y=6 if panel.x_label else 5 if panel.height > 1.2 else 4)
    for level in panel.levels:
        axes.axhline(level.value, color=level.colour, linewidth=0.6, linestyle=(0, level.dashes))
        if level.label:
            above = level.value < 0.5 * sum(axes.get_ylim())
            look: Any = {"color": level.colour, "ha": "right", "va": "bottom" if above else "top"}
            place, shift = (1.0, level.value), (-3.0, 1.5 if above else -1.5)
            style.write(axes, level.label, place, shift, ("axes fraction", "data"), **look)
    if panel.legend:
        handles, labels = axes.get_legend_handles_labels()
        named = [one for one, label in zip(handles, labels, strict=True) if label]
        style.legend_above(axes, named, legend_columns(style.inches_wide(axes)))


def _draw_line(axes: Axes, line: StyledLine) -> None:
    """Draw a curve, interrupted where it jumps: dotted there."""
    look: Any = {"color": line.colour, "linewidth": line.width, "linestyle": (0, line.dashes)}
    places = np.flatnonzero(() if line.jumps is None else line.jumps) + 1
    x, y = (np.insert(one, places, np.nan) for one in (line.x, line.y))
    style.plot_line(axes, x, y, label=line.name, zorder=3.0, **look)
    if line.points:
        style.plot_points(axes, line.x, line.y, 2.0, color=line.colour, zorder=3.1)
    for place in places:
        ends = slice(place - 1, place + 1)
        thin: Any = {"color": line.colour, "linewidth": 0.5, "linestyle": (0, (1.0, 1.5))}
        axes.plot(line.x[ends], line.y[ends], zorder=2.5, **thin)


def legend_columns(width: float) -> int:
    """The number of names that fit in one row of a width [inch]."""
    return max(1, int(width / _NAME))


def limits(low: float, high: float, *, zero: bool = False) -> tuple[float, float]:
    """Axis limits around low..high, wider around a constant.

    zero : whether zero is at the bottom if no value is negative
    """
    largest = max(abs(low), abs(high))
    if zero and low >= 0.0:
        top = largest if largest > _ROUNDING else 1.0
        return -_BELOW * top, 1.08 * top
    if high - low > _ROUNDING * max(largest, 1.0):
        return style.margins(low, high, 0.0, share=0.08)
    return style.margins(low, high, 0.4 * largest if largest > _ROUNDING else 2.0)
