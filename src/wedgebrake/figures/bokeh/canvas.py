"""Figures over parameters: axes, cursors at the current values, texts at the pointer."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from bokeh.models import FixedTicker, GlyphRenderer, HoverTool, Range1d

from wedgebrake.figures.bokeh import chart
from wedgebrake.figures.data.axes import ParameterAxis

TOOLTIP = f"font:12px {chart.FONT};color:{chart.INK}"
"""CSS of the text at the pointer."""
FOLLOWING = {"point_policy": "follow_mouse", "show_arrow": False}
"""Options of texts at the pointer."""
_TICKS_X, _TICKS_Y = 11, 6
# Beyond this share of the picture, a label at the cursor is written to its left.
_TURN = 0.85


class Canvas(chart.Chart):
    """A figure over one or two parameters, whose coordinates are positions along their axes.

    labelled : one parameter across, with a label at its cursor
    """

    def __init__(self, *, labelled: bool = False) -> None:
        drawn = chart.chart("", "", "", tools="")
        super().__init__(drawn)
        # These models are kept: replacing one makes Bokeh search the whole page.
        self._tickers = [FixedTicker() for _ in range(1 if labelled else 2)]
        for axis, ticker in zip(drawn.axis, self._tickers, strict=False):
            axis.ticker = ticker
        drawn.title.visible = False
        drawn.toolbar_location = None
        drawn.min_border = 4
        drawn.styles = {"cursor": "crosshair"}
        drawn.extra_y_ranges = {"share": Range1d(0.0, 1.0)}
        self._axes: list[ParameterAxis | None] = [None] * len(self._tickers)
        self._grid = labelled  # maps fill the plane
        label = {"y": 0.98, "y_range_name": "share", "background_fill_alpha": 0.9, "padding": 3}
        label |= {"border_line_color": chart.FRAME, "border_radius": 3, "level": "overlay"}
        look = {"line_color": chart.INK, "line_width": 1.4 if labelled else 1.0, "line_alpha": 0.8}
        self._cursors = [
            chart.MarkedLine(
                drawn, dimension, label if labelled else None, level="annotation", **look
            )
            for dimension in ("height", "width")[: len(self._tickers)]
        ]
        self.show_overlay("Computing …")

    def set_axes(self, axes: Sequence[ParameterAxis]) -> None:
        """Set the parameters across and, if there is a second one, up."""
        for way, axis in enumerate(axes):
            if self._axes[way] == axis:
                continue
            self._axes[way] = axis
            chart.set_range((self.figure.x_range, self.figure.y_range)[way], *axis.ends)
            ticks = axis.ticks((_TICKS_X, _TICKS_Y)[way])
            self._tickers[way].ticks = list(ticks)
            drawn = self.figure.axis[way]
            drawn.axis_label, drawn.major_label_overrides = axis.title, dict(ticks)

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

    def choose(self, quantity: str) -> None:
        """Select the quantity, where a picture has several."""

    def show_overlay(self, sentence: str) -> None:
        """Show a sentence in place of the axes; an empty sentence restores axes and grid."""
        super().show_overlay(sentence.strip())
        for axis in (self.figure.xaxis[0], self.figure.yaxis[0]):
            chart.update_model(axis, visible=not sentence)
        for grid in self.figure.grid:
            chart.update_model(grid, visible=not sentence and self._grid)

    def note(self, words: str) -> None:
        """Write a remark in the upper right corner."""
        self.set_key(*([("", chart.MUTED, words)] if words else []))

    def hover(self, renderer: GlyphRenderer, mode: str) -> None:
        """Show the column ``text`` of a renderer at the pointer."""
        tip = f'<div style="{TOOLTIP}">@text</div>'
        tool = HoverTool(renderers=[renderer], mode=mode, tooltips=tip, **FOLLOWING)
        self.figure.add_tools(tool)
