"""What the pictures over parameters share when they are drawn: axes, cursor, hatching, hover."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from bokeh.models import (
    BoxAnnotation,
    ColumnDataSource,
    FixedTicker,
    GlyphRenderer,
    HoverTool,
    Image,
    Label,
    LinearColorMapper,
    MultiLine,
    Quad,
    Range1d,
    Scatter,
    Span,
)

from wedgebrake.explorer.core import cells, legend
from wedgebrake.explorer.core.axis import Axis
from wedgebrake.explorer.ui.plots import look
from wedgebrake.figures.matplotlib.class_styles import Look

HATCHING = {
    "hatch_pattern": "/", "hatch_color": legend.HATCH, "hatch_alpha": 0.4, "hatch_scale": 9.0,
    "hatch_weight": 0.6,
}  # fmt: skip
BOX = {one: one for one in ("image", "x", "y", "dw", "dh")}
"""Columns of an image."""
_TIP = f'<div style="font:12px {look.FONT};color:{look.INK}">@said</div>'
_TICKS_X, _TICKS_Y = 11, 6
# A label at the cursor turns to the other side beyond this share of the picture.
_TURN = 0.85


class Canvas:
    """A figure whose places along its axes are those of an ``Axis``.

    ways : 1 for a parameter across alone, 2 for another one up
    """

    def __init__(self, ways: int = 2) -> None:
        self.figure = look.chart("", "", "", tools="")
        # For good: a model that is replaced makes Bokeh look through the whole page.
        self._tickers = [FixedTicker() for _ in range(ways)]
        for drawn, ticker in zip(self.figure.axis, self._tickers, strict=False):
            drawn.ticker = ticker
        self.figure.title.visible = False
        self.figure.toolbar_location = None
        self.figure.min_border = 4
        self.figure.styles = {"cursor": "crosshair"}
        self.figure.extra_y_ranges = {"share": Range1d(0.0, 1.0)}
        self._words = look.Words(self.figure)
        self._axes: dict[int, Axis | None] = {0: None, 1: None}
        self._grid = True
        self.say(" ")

    def set_axis(self, way: int, axis: Axis) -> None:
        """Put a parameter along an axis: 0 across, 1 up."""
        if self._axes[way] == axis:
            return
        self._axes[way] = axis
        drawn = self.figure.axis[way]
        look.span((self.figure.x_range, self.figure.y_range)[way], *axis.ends)
        drawn.axis_label = axis.title
        ticks = axis.ticks((_TICKS_X, _TICKS_Y)[way])
        self._tickers[way].ticks = list(ticks)
        drawn.major_label_overrides = dict(ticks)

    def axis(self, way: int) -> Axis | None:
        """The parameter along an axis; None before there is one."""
        return self._axes[way]

    def say(self, sentence: str) -> None:
        """Say a sentence in place of a picture; an empty one brings axes and grid back."""
        _set(self.figure.xaxis[0], visible=not sentence)
        _set(self.figure.yaxis[0], visible=not sentence)
        for grid in self.figure.grid:
            _set(grid, visible=not sentence and self._grid)
        self._words.say(sentence.strip())
        if sentence:
            self.note("")

    def without_grid(self) -> None:
        """No grid, for pictures that fill the plane."""
        self._grid = False

    def note(self, words: str) -> None:
        """A remark in the upper right corner."""
        self._words.key(*([("", look.MUTED, words)] if words else []))

    def hover(self, renderer: GlyphRenderer, mode: str) -> None:
        """Say the column ``said`` of what the pointer is on."""
        self.figure.add_tools(
            HoverTool(
                renderers=[renderer], mode=mode, tooltips=_TIP, point_policy="follow_mouse",
                show_arrow=False,
            )
        )  # fmt: skip


class Cursor:
    """The present value along one axis: a line, and a label at its top where wanted."""

    def __init__(self, canvas: Canvas, way: int, *, labelled: bool = False) -> None:
        self._canvas, self._way = canvas, way
        self._line = Span(
            dimension="width" if way else "height", location=0.0, line_color=look.INK,
            line_width=1.4 if labelled else 1.0, line_alpha=0.8, visible=False, level="annotation",
        )  # fmt: skip
        canvas.figure.add_layout(self._line)
        self._label = Label(
            x=0.0, y=0.98, y_range_name="share", text="", text_font=look.FONT,
            text_font_size="11px", text_color=look.INK, text_baseline="top",
            background_fill_color="#FFFFFF", background_fill_alpha=0.9,
            border_line_color=look.FRAME, border_radius=3, padding=3, visible=False,
            level="overlay",
        )  # fmt: skip
        if labelled:
            canvas.figure.add_layout(self._label)

    def mark(self, axis: Axis, value: Any) -> float | None:
        """Mark a value of the axis; its place, or None where it lies outside the picture."""
        drawn = self._canvas.axis(self._way)
        place = axis.place(value) if isinstance(value, float | int) else np.nan
        low, high = axis.ends
        inside = drawn == axis and low <= place <= high
        _set(self._line, visible=inside)
        _set(self._label, visible=inside)
        if not inside:
            return None
        _set(self._line, location=place)
        turned = place > low + _TURN * (high - low)
        _set(
            self._label, x=place, text=axis.said(place), text_align="right" if turned else "left",
            x_offset=-5 if turned else 5,
        )  # fmt: skip
        return place


class Map:
    """Cells of classes over two parameters, with lines over them and a cross at the present."""

    def __init__(self, table: Sequence[Look]) -> None:
        self.canvas = Canvas()
        drawn = self.canvas.figure
        self.canvas.without_grid()
        self._behind = BoxAnnotation(
            fill_color=None, line_color=None, level="underlay", visible=False, **HATCHING
        )
        drawn.add_layout(self._behind)
        self._image = ColumnDataSource({one: [] for one in BOX})
        colours = palette([legend.rgba(one) for one in table])
        drawn.add_glyph(self._image, Image(**BOX, color_mapper=colours))
        self._rows = ColumnDataSource(
            {name: [] for name in ("left", "right", "bottom", "top", "said")}
        )
        self.canvas.hover(drawn.add_glyph(self._rows, unseen()), "mouse")
        self._lines = ColumnDataSource({"xs": [], "ys": []})
        for looks in (
            {"line_color": "#FFFFFF", "line_width": 3.2},
            {"line_color": look.INK, "line_width": 1.4, "line_dash": [6, 3]},
        ):
            drawn.add_glyph(self._lines, MultiLine(xs="xs", ys="ys", **looks))
        self.cross = Cross(self.canvas)

    def show(
        self, x: Axis, y: Axis, codes: cells.Codes, rows: cells.Runs, lines: Sequence[cells.Line]
    ) -> None:
        """Draw cells, (rows up, columns across), what is said of them, and lines."""
        self.canvas.set_axis(0, x)
        self.canvas.set_axis(1, y)
        look.put(
            self._rows, left=rows.left, right=rows.right, bottom=rows.bottom, top=rows.top,
            said=rows.said,
        )  # fmt: skip
        put_image(self._image, codes.astype(np.uint8), x.ends, y.ends)
        self._lines.data = {"xs": [one for one, _ in lines], "ys": [one for _, one in lines]}
        _set(self._behind, visible=True)
        self.canvas.say("")

    def say(self, sentence: str) -> None:
        """Show nothing but a sentence."""
        _set(self._behind, visible=False)
        for source in (self._image, self._rows, self._lines):
            source.data = {name: [] for name in source.data}
        self.canvas.say(sentence)


class Cross:
    """The present values along both axes: thin lines, and a ring where they meet."""

    def __init__(self, canvas: Canvas) -> None:
        self._cursors = Cursor(canvas, 0), Cursor(canvas, 1)
        self._source = ColumnDataSource({"x": [], "y": []})
        for size, colour, width in ((11, "#FFFFFF", 4.5), (11, look.INK, 2.0)):
            ring = Scatter(
                x="x", y="y", size=size, fill_color=None, line_color=colour, line_width=width
            )
            canvas.figure.add_glyph(self._source, ring, level="overlay")

    def mark(self, x: Axis, y: Axis, values: tuple[Any, Any]) -> None:
        """Mark a value of each axis."""
        places = [
            cursor.mark(axis, value)
            for cursor, axis, value in zip(self._cursors, (x, y), values, strict=True)
        ]
        known = None not in places
        look.put(self._source, x=[places[0]] if known else [], y=[places[1]] if known else [])


def unseen() -> Quad:
    """Transparent boxes that react to the pointer."""
    return Quad(
        left="left", right="right", top="top", bottom="bottom", fill_alpha=0.0, line_alpha=0.0
    )


def palette(colours: Sequence[str]) -> LinearColorMapper:
    """Colours of whole numbers from 0 on."""
    return LinearColorMapper(palette=list(colours), low=-0.5, high=len(colours) - 0.5)


def put_image(
    source: ColumnDataSource,
    values: np.ndarray,
    across: tuple[float, float],
    up: tuple[float, float],
    **more: Any,
) -> None:
    """Put cells, (rows up, columns across), between places."""
    old = source.data["image"]
    box = {
        "x": [across[0]], "y": [up[0]], "dw": [across[1] - across[0]], "dh": [up[1] - up[0]],
    }  # fmt: skip
    same = len(old) and np.array_equal(old[0], values)
    if not (same and all(source.data[name] == one for name, one in box.items())):
        source.data = {"image": [values], **box, **more}


def _set(model: Any, **values: Any) -> None:
    for name, value in values.items():
        if getattr(model, name) != value:
            setattr(model, name, value)
