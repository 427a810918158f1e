"""The bifurcation diagram, drawn."""

from __future__ import annotations

from collections.abc import Hashable, Iterator
from typing import Any

import numpy as np
from bokeh.models import ColumnDataSource, Image, Quad, Scatter, Segment
from bokeh.transform import transform

from wedgebrake.explorer.core import diagram, legend
from wedgebrake.explorer.core.axis import Axis, number, picked
from wedgebrake.explorer.core.diagram import Diagram
from wedgebrake.explorer.core.state import Desk
from wedgebrake.explorer.ui.plots import look
from wedgebrake.explorer.ui.plots.canvas import (
    BOX,
    HATCHING,
    Canvas,
    Cursor,
    palette,
    put_image,
    unseen,
)
from wedgebrake.figures.matplotlib.class_styles import MOTION_LOOKS

_LABELS = {"velocity": "velocity at the section  [rad/s]", "angle": "angle at the section  [rad]"}
# The strip of classes takes so much of the height, and points keep off it.
_STRIP, _ABOVE = 0.055, 0.09
# Sizes of points [px]: of a few values, of many.
_LARGE, _SMALL, _MANY = 3.2, 2.4, 250


class DiagramPlate:
    """Poincare points over a parameter, and below them the class of motion of each value."""

    name = "diagram"

    def __init__(self) -> None:
        self._canvas = Canvas(ways=1)
        self.figure = drawn = self._canvas.figure
        self._quantity: str = "velocity"
        self._picture: Diagram | None = None
        boxes = ("left", "right", "bottom", "top")
        self._gaps, self._probes, self._points, self._limits = (
            ColumnDataSource({name: [] for name in names})
            for names in (boxes, (*boxes, "said"), ("x", "y", "code"), ("x",))
        )
        self._strip = ColumnDataSource({name: [] for name in (*BOX, "right")})
        share = {"y_range_name": "share"}
        self._dots = Scatter(
            x="x", y="y", marker="square", line_color=None, size=_LARGE,
            fill_color=transform("code", palette([legend.ink(one) for one in MOTION_LOOKS])),
        )  # fmt: skip
        colours = palette([legend.rgba(one) for one in MOTION_LOOKS])
        limit = {"line_color": look.INK, "line_dash": [6, 3]}
        drawn.add_glyph(self._gaps, _hatched(boxes, "#F3F4F6"), **share)
        drawn.add_glyph(self._points, self._dots)
        drawn.add_glyph(self._strip, _hatched(("x", "right", "y", "dh"), "#FFFFFF"), **share)
        drawn.add_glyph(self._strip, Image(**BOX, color_mapper=colours), **share)
        drawn.add_glyph(self._limits, Segment(x0="x", y0=0.0, x1="x", y1=1.0, **limit), **share)
        self._canvas.hover(drawn.add_glyph(self._probes, unseen(), **share), "vline")
        self._cursor = Cursor(self._canvas, 0, labelled=True)

    def key(self, desk: Desk) -> Hashable:
        """All that the picture depends on, but the present value of its parameter."""
        return diagram.key(desk)

    def work(self, desk: Desk) -> Iterator[Diagram]:
        """Pictures, coarse before fine."""
        return diagram.work(desk)

    def show(self, picture: Diagram) -> None:
        """Draw a picture."""
        self._picture = picture
        self._canvas.set_axis(0, picture.axis)
        first, last = picture.axis.ends
        edges = np.linspace(first, last, picture.strip.size + 1)
        middles = picture.middles
        between = np.concatenate(([first], 0.5 * (middles[1:] + middles[:-1]), [last]))
        _boxes(self._probes, between[:-1], between[1:], said=picture.said)
        gaps = np.array(picture.gaps).reshape(-1, 2)
        _boxes(self._gaps, gaps[:, 0], gaps[:, 1])
        put_image(
            self._strip, picture.strip[None].astype(np.uint8), (edges[0], edges[-1]),
            (0.0, _STRIP), right=[last],
        )  # fmt: skip
        look.put(self._limits, x=[place for place, _ in picture.limits])
        self._draw_points(picture)
        empty = picture.place.size == 0
        self._canvas.say(_emptiness(picture) if empty else "")

    def mark(self, desk: Desk) -> None:
        """Mark the present value, and show the quantity that is wished."""
        name = diagram.parameter(desk)
        if desk.view.quantity != self._quantity:
            self._quantity = desk.view.quantity
            if self._picture is not None:
                self._draw_points(self._picture)
        self._cursor.mark(Axis.of(desk, name), desk.value(name))

    def pick(self, desk: Desk, x: float, _y: float) -> dict[str, float]:
        """The value of the parameter at a place."""
        return picked([Axis.of(desk, diagram.parameter(desk))], [x])

    def say(self, sentence: str) -> None:
        """Show nothing but a sentence."""
        self._picture = None
        for source in (self._gaps, self._probes, self._points, self._limits, self._strip):
            source.data = {name: [] for name in source.data}
        self._canvas.say(sentence)

    def legend(self, picture: Diagram) -> list[legend.Chip]:
        """The classes that occur."""
        return picture.legend

    def progress(self, picture: Diagram) -> str:
        """How much is known."""
        return picture.progress

    def _draw_points(self, picture: Diagram) -> None:
        low, high = picture.spans[self._quantity]
        if low == high:  # all at rest
            low, high = look.about(low, high)
        look.span(self.figure.y_range, low - _ABOVE * (high - low), high)
        self.figure.yaxis.axis_label = _LABELS[self._quantity]
        outside = picture.outside[self._quantity]
        self._canvas.note(f"points up to {number(outside)} lie outside" if outside else "")
        look.put(
            self._points, x=look.single(picture.place),
            y=look.single(picture.points[self._quantity]),
            code=picture.code.astype(np.uint8),
        )  # fmt: skip
        self._dots.size = _LARGE if picture.known < _MANY else _SMALL


def _hatched(columns: tuple[str, ...], colour: str) -> Quad:
    """Hatched boxes, from the columns of their left, right, bottom and top."""
    places = dict(zip(("left", "right", "bottom", "top"), columns, strict=True))
    return Quad(**places, fill_color=colour, line_color=None, **HATCHING)


def _boxes(source: ColumnDataSource, left: Any, right: Any, **more: Any) -> None:
    """Boxes over the whole height."""
    count = len(left)
    look.put(source, left=left, right=right, bottom=np.zeros(count), top=np.ones(count), **more)


def _emptiness(picture: Diagram) -> str:
    """Why there are no points."""
    words = {legend.words(MOTION_LOOKS[code]) for code in np.unique(picture.codes)}
    return f"No settled motion at any value: {', '.join(sorted(words))}."
