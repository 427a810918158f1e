"""The bifurcation diagram, or amplitudes, with a band of the classes of motion below the points."""

from __future__ import annotations

from typing import Any

import numpy as np
from bokeh.core.properties import value
from bokeh.models import ColumnDataSource, Quad, Scatter, Segment, Text
from bokeh.transform import transform

from wedgebrake.figures.bokeh import canvas, chart, glyphs
from wedgebrake.figures.data.class_styles import MOTIONS, without_result
from wedgebrake.figures.data.limits import round_limits_about
from wedgebrake.figures.data.partial import QUANTITIES, PartialDiagram

# Shares of the height: the band of classes, and the space below the points.
_BAND, _ABOVE = 0.055, 0.09
# Sizes of points [px]: for few values, for many.
_LARGE, _SMALL, _MANY = 3.2, 2.4, 250
# Labels of limits, below that of the cursor: shares of the height, number of rows; beyond the last
# share of the width they are to the left of their lines.
_FIRST, _APART, _ROWS, _TURN = 0.84, 0.1, 4, 0.8


class BifurcationPlot(canvas.Canvas, chart.QuantityChart[PartialDiagram]):
    """Poincare points or amplitudes over a parameter, and below them the class of each value."""

    def __init__(self) -> None:
        super().__init__(labelled=True)
        self._quantity = "velocity"
        self._gaps, self._probes = self.source(*glyphs.BOXES), self.source(*glyphs.BOXES, "text")
        self._points = self.source("x", "y", "code")
        self._limits = self.source("x", "y", "text", "align", "offset")
        self._band = self.source(*glyphs.IMAGE, "right")
        share = {"y_range_name": "share"}
        self._dots = Scatter(
            x="x", y="y", marker="square", line_color=None, size=_LARGE,
            fill_color=transform("code", glyphs.palette([one.on_white for one in MOTIONS])),
        )  # fmt: skip
        cells = glyphs.image(color_mapper=glyphs.palette([one.rgba for one in MOTIONS]))
        limit = Segment(x0="x", y0=0.0, x1="x", y1=1.0, line_color=chart.INK, line_dash=[6, 3])
        self.draw(self._gaps, _hatched(glyphs.BOXES, "#F3F4F6"), **share)
        self.draw(self._points, self._dots)
        self.draw(self._band, _hatched(("x", "right", "y", "dh"), "#FFFFFF"), **share)
        self.draw(self._band, cells, **share)
        self.draw(self._limits, limit, **share)
        words = Text(
            x="x", y="y", text="text", text_align="align", x_offset="offset", text_baseline="top",
            text_font=value(chart.FONT), text_font_size="11px", text_color=chart.INK,
            background_fill_color="#FFFFFF", background_fill_alpha=0.85, padding=2,
        )  # fmt: skip
        self.draw(self._limits, words, **share, level="annotation")
        self.hover(self.draw(self._probes, glyphs.invisible_boxes(), **share), "vline")

    def show(self, picture: PartialDiagram) -> None:
        """Draw a diagram."""
        self._picture = picture
        self.set_axes(picture.axes)
        first, last = picture.axes[0].ends
        middles = picture.positions
        between = np.concatenate(([first], 0.5 * (middles[1:] + middles[:-1]), [last]))
        _put_boxes(self._probes, between[:-1], between[1:], text=picture.text)
        _put_boxes(self._gaps, *picture.gaps.T)
        band = picture.band[None].astype(np.uint8)
        glyphs.put_image(self._band, band, (first, last), (0.0, _BAND), right=[last])
        self._draw_limits(picture)
        self._draw_quantity(picture)

    def _draw_limits(self, picture: PartialDiagram) -> None:
        places, (low, high) = picture.limits, picture.axes[0].ends
        turned = [at > low + _TURN * (high - low) for at in places]
        chart.update_source(
            self._limits, x=places, text=picture.limit_words,
            y=[_FIRST - _APART * (place % _ROWS) for place in range(len(places))],
            align=["right" if one else "left" for one in turned],
            offset=[-4 if one else 4 for one in turned],
        )  # fmt: skip

    def _draw_quantity(self, picture: PartialDiagram) -> None:
        cloud = picture.clouds[self._quantity]
        if not cloud.index.size:
            codes = np.unique(picture.codes)
            words = ", ".join(sorted(MOTIONS[code].plain for code in codes))
            missing = without_result(codes).all()
            self.show_overlay(
                f"No settled motion at any value: {words}."
                if missing
                else "The solver of this law does not measure it."
            )
            chart.clear_source(self._points)
            return
        self.show_overlay("")
        low, high = cloud.span
        if low == high:  # all at rest
            low, high = round_limits_about(low, high)
        chart.set_range(self.figure.y_range, low - _ABOVE * (high - low), high)
        self.figure.yaxis.axis_label = QUANTITIES[self._quantity]
        chart.update_source(
            self._points,
            x=chart.float32(picture.positions[cloud.index]),
            y=chart.float32(cloud.points),
            code=cloud.codes.astype(np.uint8),
        )
        self._dots.size = _LARGE if picture.known.size < _MANY else _SMALL


def _hatched(columns: tuple[str, ...], colour: str) -> Quad:
    """Hatched boxes, from the columns of their left, right, bottom and top."""
    places = dict(zip(glyphs.BOXES, columns, strict=True))
    return Quad(**places, fill_color=colour, line_color=None, **glyphs.HATCHING)


def _put_boxes(source: ColumnDataSource, left: Any, right: Any, **more: Any) -> None:
    ends = np.zeros(len(left)), np.ones(len(left))
    chart.update_source(source, left=left, right=right, bottom=ends[0], top=ends[1], **more)
