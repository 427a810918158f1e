"""Maps over two parameters: cells of classes, stability limit, margins, marks of attractors."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from bokeh.core.properties import value
from bokeh.models import BoxAnnotation, ColumnDataSource, HoverTool, MultiLine, Scatter, Text

from wedgebrake.figures import style
from wedgebrake.figures.bokeh import canvas, chart, glyphs
from wedgebrake.figures.data.axes import ParameterAxis
from wedgebrake.figures.data.class_map import LEVEL_LINE
from wedgebrake.figures.data.partial import PartialMap

# Pixels of one typographic point in the size of markers.
_PIXELS = 2.0


class MapPlot(canvas.Canvas):
    """Cells of classes over two parameters, with a cross at the current values."""

    def __init__(self) -> None:
        super().__init__()
        drawn = self.figure
        look = {"fill_color": None, "line_color": None, "level": "underlay", **glyphs.HATCHING}
        self._hatching = BoxAnnotation(visible=False, **look)
        drawn.add_layout(self._hatching)
        self._cells, self._margins = self.source(*glyphs.IMAGE), self.source(*glyphs.IMAGE)
        self._colours = glyphs.palette(["#FFFFFF00"])
        self.draw(self._cells, glyphs.image(color_mapper=self._colours))
        # Invisible, but used for the text at the pointer.
        margins = self.draw(self._margins, glyphs.image(global_alpha=0.0))
        self._tip = HoverTool(renderers=[margins], tooltips=None, visible=False, **canvas.FOLLOWING)
        drawn.add_tools(self._tip)
        self._boxes = self.source(*glyphs.BOXES, "text")
        self.hover(self.draw(self._boxes, glyphs.invisible_boxes()), "mouse")
        self._limit, self._levels = self.source("xs", "ys"), self.source("xs", "ys")
        self._texts = self.source("x", "y", "text")
        self._points, self._cross = self.source("x", "y", "size", "colour"), self.source("x", "y")
        for options, dashes in zip(_outlined(1.4), ([], [6, 3]), strict=True):
            self.draw(self._limit, MultiLine(xs="xs", ys="ys", line_dash=dashes, **options))
        thin = {"line_color": LEVEL_LINE.colour, "line_width": 0.8}
        self.draw(self._levels, MultiLine(xs="xs", ys="ys", **thin))
        words = Text(
            x="x", y="y", text="text", text_font=value(chart.FONT), text_font_size="10px",
            text_color=chart.MUTED, text_align="center", text_baseline="middle",
            background_fill_color="#FFFFFF", background_fill_alpha=0.75, padding=1,
        )  # fmt: skip
        self.draw(self._texts, words)
        # With a white ring: an attractor lies in its own basin, which has the same colour.
        for options in ({"line_color": "#FFFFFF", "line_width": 4.0}, _outlined(1.0)[1]):
            dots = Scatter(x="x", y="y", size="size", fill_color="colour", **options)
            self.draw(self._points, dots)
        for options in _outlined(2.0):
            ring = Scatter(x="x", y="y", size=11, fill_color=None, **options)
            self.draw(self._cross, ring, level="overlay")

    def show(self, picture: PartialMap) -> None:
        """Draw a map."""
        data, (x, y) = picture.data, picture.axes
        self.set_axes(picture.axes)
        colours = [one.rgba for one in data.styles]
        chart.update_model(self._colours, palette=colours, high=len(colours) - 0.5)
        glyphs.put_image(self._cells, data.codes.astype(np.uint8), x.ends, y.ends)
        if picture.hover is not None:
            chart.update_source(self._boxes, **picture.hover._asdict())
        if data.margin is not None:
            self._tip.tooltips = (
                f'<div style="{canvas.TOOLTIP}">margin in η: @image{{0.00}}<br>'
                f"{x.symbol} = $x{{0.00}}, {y.symbol} = $y{{0.000}}</div>"
            )
            glyphs.put_image(self._margins, chart.float32(data.margin), x.ends, y.ends)
        _put_lines(self._limit, data.limit)
        _put_lines(self._levels, [line for _, line in data.levels])
        chart.update_source(
            self._texts,
            text=[style.signed(level) for level, _ in data.levels],
            x=[line[len(line) // 2, 0] for _, line in data.levels],
            y=[line[len(line) // 2, 1] for _, line in data.levels],
        )
        across, up = np.concatenate([*(one.points for one in data.marks), np.empty((0, 2))]).T
        markers = [one.marker for one in data.marks for _ in one.points]
        sizes, colours = [_PIXELS * one.size for one in markers], [one.face for one in markers]
        chart.update_source(self._points, x=across, y=up, size=sizes, colour=colours)
        chart.update_model(self._hatching, visible=True)
        self.show_overlay("")

    def mark(self, axes: Sequence[ParameterAxis], values: Sequence[Any]) -> list[float | None]:
        """Mark a value of each parameter, with a ring where they meet."""
        places = super().mark(axes, values)
        x, y = ([], []) if None in places else ([one] for one in places)
        chart.update_source(self._cross, x=x, y=y)
        return places

    def show_message(self, sentence: str) -> None:
        """Show only a sentence."""
        super().show_message(sentence)
        chart.update_model(self._hatching, visible=False)


def _put_lines(source: ColumnDataSource, lines: Sequence[np.ndarray]) -> None:
    source.data = {"xs": [one[:, 0] for one in lines], "ys": [one[:, 1] for one in lines]}


def _outlined(width: float) -> list[dict[str, Any]]:
    return [{"line_color": "#FFFFFF", "line_width": 2.25 * width},
            {"line_color": chart.INK, "line_width": width}]  # fmt: skip
