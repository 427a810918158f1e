"""Figures over parameters: axes, cursors at the current values, texts at the pointer."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from bokeh.models import (
    CustomJS,
    CustomJSTicker,
    CustomJSTickFormatter,
    GlyphRenderer,
    HoverTool,
    PanTool,
    Range1d,
    ResetTool,
    WheelZoomTool,
)

from wedgebrake.figures.bokeh import chart
from wedgebrake.figures.data.axes import ParameterAxis

TOOLTIP = f"font:12px {chart.FONT};color:{chart.INK}"
"""CSS of the text at the pointer."""
FOLLOWING = {"point_policy": "follow_mouse", "show_arrow": False}
"""Options of texts at the pointer."""
_TICKS = 11, 6
# Round values in the part of an axis that a zoom shows: multiples of 1, 2 or 5 times a power of
# ten; on a logarithmic axis as many of 1, 2, 3, 5 in each decade as fit.
_PLACES = """
const {start, end} = cb_data.range, places = []
const round = (low, high, most) => {
  const least = (high - low) / most, power = 10 ** Math.floor(Math.log10(least))
  const step = power * [1, 2, 5, 10].find(x => x * power >= 0.999 * least)
  const values = []
  const last = Math.floor(high / step + 1e-6)
  for (let k = Math.ceil(low / step - 1e-6); k <= last; k++) values.push(k * step)
  return values
}
if (!log) return round(start, end, most)
for (const shares of [[1, 2, 3, 5], [1, 2, 5], [1, 3], [1]]) {
  const values = []
  for (let power = Math.floor(start); power <= end; power++) {
    for (const share of shares) values.push(power + Math.log10(share))
  }
  const inside = values.filter(x => start - 1e-3 <= x && x <= end + 1e-3)
  if (inside.length < 2) {
    return round(10 ** start, 10 ** end, most).filter(x => x > 0).map(x => Math.log10(x))
  }
  if (inside.length <= most) return inside
}
return round(start, end, most)
"""
_VALUE = "tick = log ? 10 ** tick : tick\n" + chart.TICK
# Beyond this share of the picture, a label at the cursor is written to its left.
_TURN = 0.85
_SHARE = "share.setv({start: 0, end: 1}, {sync: false})"


class Canvas(chart.Chart):
    """A figure over one or two parameters, whose coordinates are positions along their axes.

    labelled : one parameter across, with a label at its cursor
    """

    def __init__(self, *, labelled: bool = False) -> None:
        # The wheel zooms, dragging moves, and a button shows the whole again.
        wheel = WheelZoomTool(visible=False)
        drawn = chart.chart("", "", "", [PanTool(visible=False), wheel, ResetTool()])
        drawn.toolbar.active_scroll = wheel
        super().__init__(drawn)
        self._axes: list[ParameterAxis | None] = [None] * (1 if labelled else 2)
        # These models are kept: replacing one makes Bokeh search the whole page.
        for way in range(len(self._axes)):
            self.scale_axis(way)
        drawn.title.visible = False
        drawn.min_border = 4
        drawn.styles = {"cursor": "crosshair"}
        share = Range1d(0.0, 1.0)
        # A zoom moves all ranges of a figure, but shares of its height stay where they are.
        for end in ("start", "end"):
            share.js_on_change(end, CustomJS(args={"share": share}, code=_SHARE))
        drawn.extra_y_ranges = {"share": share}
        self._grid = labelled  # maps fill the plane
        label = {"y": 0.98, "y_range_name": "share", "background_fill_alpha": 0.9, "padding": 3}
        label |= {"border_line_color": chart.FRAME, "border_radius": 3, "level": "overlay"}
        look = {"line_color": chart.INK, "line_width": 1.4 if labelled else 1.0, "line_alpha": 0.8}
        self._cursors = [
            chart.MarkedLine(
                drawn, dimension, label if labelled else None, level="annotation", **look
            )
            for dimension in ("height", "width")[: len(self._axes)]
        ]
        self.show_overlay("Computing …")

    def scale_axis(self, way: int) -> None:
        """Give an axis, across (0) or up (1), the ticks of a linear or logarithmic scale."""
        axis = self.figure.axis[way]
        args = {"log": False, "most": _TICKS[way]}
        axis.ticker = CustomJSTicker(major_code=_PLACES, args=args)
        axis.formatter = CustomJSTickFormatter(code=_VALUE, args={"log": False})

    def set_log(self, way: int, log: bool) -> None:
        """Say whether positions along an axis are logarithms to the base 10."""
        axis = self.figure.axis[way]
        for model in (axis.ticker, axis.formatter):
            chart.update_model(model, args={**model.args, "log": log})

    def set_axes(self, axes: Sequence[ParameterAxis]) -> None:
        """Set the parameters across and, if there is a second one, up."""
        for way, axis in enumerate(axes):
            if self._axes[way] == axis:
                continue
            self._axes[way] = axis
            chart.set_range((self.figure.x_range, self.figure.y_range)[way], *axis.ends)
            self.figure.axis[way].axis_label = axis.title
            self.set_log(way, axis.log)

    def mark(self, axes: Sequence[ParameterAxis], values: Sequence[Any]) -> list[float | None]:
        """Mark a value of each parameter; returns their positions, None outside the picture."""
        places: list[float | None] = []
        for cursor, drawn, axis, value in zip(self._cursors, self._axes, axes, values, strict=True):
            at = axis.position(value) if isinstance(value, float | int) else np.nan
            places.append(at if drawn == axis and axis.contains(at) else None)
            low, high = axis.ends
            turned = at > low + _TURN * (high - low)
            side: Any = {
                "text_align": "right" if turned else "left",
                "x_offset": -5 if turned else 5,
            }
            cursor.show(places[-1], axis.text(at) if places[-1] is not None else "", **side)
        return places

    def show_overlay(self, sentence: str) -> None:
        """Show a sentence in place of the axes; an empty sentence restores axes and grid."""
        super().show_overlay(sentence.strip())
        for axis in (self.figure.xaxis[0], self.figure.yaxis[0]):
            chart.update_model(axis, visible=not sentence)
        for grid in self.figure.grid:
            chart.update_model(grid, visible=not sentence and self._grid)

    def hover(self, renderer: GlyphRenderer, mode: str) -> None:
        """Show the column ``text`` of a renderer at the pointer."""
        tip = f'<div style="{TOOLTIP}">@text</div>'
        tool = HoverTool(renderers=[renderer], mode=mode, tooltips=tip, visible=False, **FOLLOWING)
        self.figure.add_tools(tool)
