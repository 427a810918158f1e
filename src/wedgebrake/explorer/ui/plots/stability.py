"""The map of linear stability, drawn."""

from __future__ import annotations

from collections.abc import Hashable, Iterator

import numpy as np
from bokeh.core.properties import value
from bokeh.models import ColumnDataSource, HoverTool, Image, MultiLine, Text

from wedgebrake.explorer.core import legend, stability
from wedgebrake.explorer.core.axis import Axis, picked
from wedgebrake.explorer.core.stability import StabilityMap
from wedgebrake.explorer.core.state import Desk
from wedgebrake.explorer.ui.plots import look
from wedgebrake.explorer.ui.plots.canvas import BOX, Canvas, Cross, palette, put_image

_LINE = "#8A94A0"


class StabilityPlate:
    """Where sliding is linearly stable, by how much, and where the brake locks itself."""

    name = "stability"

    def __init__(self) -> None:
        self._canvas = Canvas()
        self.figure = drawn = self._canvas.figure
        self._canvas.without_grid()
        self._regions, self._margins = (ColumnDataSource({one: [] for one in BOX}) for _ in "ab")
        drawn.add_glyph(self._regions, Image(**BOX, color_mapper=palette(stability.COLOURS)))
        # Not seen, but felt by the pointer.
        felt = drawn.add_glyph(self._margins, Image(**BOX, global_alpha=0.0))
        self._hover = HoverTool(renderers=[felt], point_policy="follow_mouse", show_arrow=False)
        drawn.add_tools(self._hover)
        self._limit, self._levels = (ColumnDataSource({"xs": [], "ys": []}) for _ in "ab")
        drawn.add_glyph(self._levels, MultiLine(xs="xs", ys="ys", line_color=_LINE, line_width=0.8))
        drawn.add_glyph(
            self._limit, MultiLine(xs="xs", ys="ys", line_color=look.INK, line_width=1.6)
        )
        self._texts = ColumnDataSource({"x": [], "y": [], "text": []})
        words = Text(
            x="x", y="y", text="text", text_font=value(look.FONT), text_font_size="10px",
            text_color=look.MUTED, text_align="center", text_baseline="middle",
            background_fill_color="#FFFFFF", background_fill_alpha=0.75, padding=1,
        )  # fmt: skip
        drawn.add_glyph(self._texts, words)
        self._cross = Cross(self._canvas)

    def key(self, desk: Desk) -> Hashable:
        """All that the picture depends on, but the present values of its parameters."""
        return stability.key(desk)

    def work(self, desk: Desk) -> Iterator[StabilityMap]:
        """The whole picture."""
        return stability.work(desk)

    def show(self, picture: StabilityMap) -> None:
        """Draw a picture."""
        x, y = picture.x, picture.y
        self._canvas.set_axis(0, x)
        self._canvas.set_axis(1, y)
        self._hover.tooltips = (
            f'<div style="font:12px {look.FONT};color:{look.INK}">margin in η: @image{{0.00}}<br>'
            f"{x.symbol} = $x{{0.00}}, {y.symbol} = $y{{0.000}}</div>"
        )
        put_image(self._regions, picture.codes.astype(np.uint8), x.ends, y.ends)
        put_image(self._margins, look.single(picture.margin), x.ends, y.ends)
        self._limit.data = _lines(picture.limit)
        self._levels.data = _lines([line for _, line in picture.levels])
        middles = [(text, *_middle(line)) for text, line in picture.levels]
        self._texts.data = {
            "text": [one[0] for one in middles],
            "x": [one[1] for one in middles],
            "y": [one[2] for one in middles],
        }
        self._canvas.say("")

    def mark(self, desk: Desk) -> None:
        """Mark the present values."""
        x, y = (Axis.of(desk, name) for name in stability.parameters(desk))
        self._cross.mark(x, y, (desk.value(x.name), desk.value(y.name)))

    def pick(self, desk: Desk, x: float, y: float) -> dict[str, float]:
        """The values of both groups at a place."""
        return picked([Axis.of(desk, name) for name in stability.parameters(desk)], (x, y))

    def say(self, sentence: str) -> None:
        """Show nothing but a sentence."""
        for source in (self._regions, self._margins, self._limit, self._levels, self._texts):
            source.data = {name: [] for name in source.data}
        self._canvas.say(sentence)

    def legend(self, picture: StabilityMap) -> list[legend.Chip]:
        """The regions that occur."""
        return picture.legend

    def progress(self, picture: StabilityMap) -> str:
        """How much is known."""
        return picture.progress


def _lines(lines: list[tuple[list[float], list[float]]]) -> dict[str, list[list[float]]]:
    return {"xs": [one for one, _ in lines], "ys": [one for _, one in lines]}


def _middle(line: tuple[list[float], list[float]]) -> tuple[float, float]:
    """A place in the middle of a line."""
    half = len(line[0]) // 2
    return line[0][half], line[1][half]
