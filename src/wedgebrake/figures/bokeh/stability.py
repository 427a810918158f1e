"""The map of linear stability, with lines of equal margin."""

from __future__ import annotations

from bokeh.core.properties import value
from bokeh.models import HoverTool, Image, MultiLine, Text

from wedgebrake.figures.bokeh.canvas import IMAGE, TOOLTIP, put_image
from wedgebrake.figures.bokeh.chart import FONT, MUTED, float32
from wedgebrake.figures.bokeh.class_map import MapPlot
from wedgebrake.figures.data.level_lines import columns
from wedgebrake.figures.data.parameter_axis import number
from wedgebrake.figures.data.partial import PartialMap
from wedgebrake.figures.data.stability import LEVEL_LINE, StabilityMap


class StabilityPlot(MapPlot):
    """Where sliding is linearly stable, by which margin, and where the brake locks itself."""

    def __init__(self) -> None:
        super().__init__()
        drawn = self.figure
        self._margins, self._levels = self.source(*IMAGE), self.source("xs", "ys")
        self._texts = self.source("x", "y", "text")
        # Invisible, but read by the pointer.
        margins = drawn.add_glyph(
            self._margins, Image(**{one: one for one in IMAGE}, global_alpha=0.0)
        )
        options = {"point_policy": "follow_mouse", "show_arrow": False}
        self._hover = HoverTool(renderers=[margins], **options)
        drawn.add_tools(self._hover)
        thin = {"line_color": LEVEL_LINE.colour, "line_width": 0.8}
        drawn.add_glyph(self._levels, MultiLine(xs="xs", ys="ys", **thin))
        words = Text(
            x="x", y="y", text="text", text_font=value(FONT), text_font_size="10px",
            text_color=MUTED, text_align="center", text_baseline="middle",
            background_fill_color="#FFFFFF", background_fill_alpha=0.75, padding=1,
        )  # fmt: skip
        drawn.add_glyph(self._texts, words)

    def show(self, picture: PartialMap) -> None:
        """Draw a map of linear stability."""
        super().show(picture)
        data, (x, y) = picture.data, picture.axes
        if not isinstance(data, StabilityMap):
            return
        self._hover.tooltips = (
            f'<div style="{TOOLTIP}">margin in η: @image{{0.00}}<br>'
            f"{x.symbol} = $x{{0.00}}, {y.symbol} = $y{{0.000}}</div>"
        )
        put_image(self._margins, float32(data.margin), x.ends, y.ends)
        lines = [(level, line) for level in data.levels for line in data.lines(level)]
        self._levels.data = columns([line for _, line in lines])
        middles = [line[len(line) // 2] for _, line in lines]
        self._texts.data = {
            "text": [("+" if level > 0.0 else "") + number(level) for level, _ in lines],
            "x": [point[0] for point in middles],
            "y": [point[1] for point in middles],
        }
