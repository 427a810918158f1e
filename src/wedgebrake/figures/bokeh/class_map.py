"""Maps of classes over two parameters: cells, stability limit, marks of attractors."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from bokeh.models import BoxAnnotation, Image, MultiLine, Scatter

from wedgebrake.figures.bokeh.canvas import (
    BOXES,
    HATCHING,
    IMAGE,
    Canvas,
    invisible_boxes,
    outlined,
    palette,
    put_image,
    ring,
)
from wedgebrake.figures.bokeh.chart import update_model, update_source
from wedgebrake.figures.data.basins import Basins
from wedgebrake.figures.data.level_lines import columns
from wedgebrake.figures.data.parameter_axis import ParameterAxis
from wedgebrake.figures.data.partial import PartialMap

# Pixels of one typographic point in the size of markers.
_PIXELS = 2.0


class MapPlot(Canvas):
    """Cells of classes over two parameters, with a cross at the current values."""

    def __init__(self) -> None:
        super().__init__()
        drawn = self.figure
        self._hatching = BoxAnnotation(
            fill_color=None, line_color=None, level="underlay", visible=False, **HATCHING
        )
        drawn.add_layout(self._hatching)
        self._cells = self.source(*IMAGE)
        self._colours = palette(["#FFFFFF00"])
        drawn.add_glyph(self._cells, _image(color_mapper=self._colours))
        self._boxes = self.source(*BOXES, "text")
        self.hover(drawn.add_glyph(self._boxes, invisible_boxes()), "mouse")
        self._limit, self._points = self.source("xs", "ys"), self.source("x", "y", "size", "colour")
        for options, dashes in zip(outlined(1.4), ([], [6, 3]), strict=True):
            drawn.add_glyph(self._limit, MultiLine(xs="xs", ys="ys", line_dash=dashes, **options))
        # Ringed in white: an attractor lies in its own basin, of the same colour.
        for options in ({"line_color": "#FFFFFF", "line_width": 4.0}, outlined(1.0)[1]):
            dots = Scatter(x="x", y="y", size="size", fill_color="colour", **options)
            drawn.add_glyph(self._points, dots)
        self._cross = self.source("x", "y")
        for options in outlined(2.0):
            drawn.add_glyph(self._cross, ring(11, **options), level="overlay")

    def show(self, picture: PartialMap) -> None:
        """Draw a map."""
        data, (x, y) = picture.data, picture.axes
        self.set_axes(picture.axes)
        colours = [one.rgba for one in data.styles]
        update_model(self._colours, palette=colours, high=len(colours) - 0.5)
        put_image(self._cells, data.codes.astype(np.uint8), x.ends, y.ends)
        if picture.hover is not None:
            texts = {one: getattr(picture.hover, one) for one in (*BOXES, "text")}
            update_source(self._boxes, **texts)
        self._limit.data = columns(data.limit)
        if isinstance(data, Basins):
            self._mark_attractors(data)
        update_model(self._hatching, visible=True)
        self.explain("")

    def mark(self, axes: Sequence[ParameterAxis], values: Sequence[Any]) -> list[float | None]:
        """Mark a value of each parameter, with a ring where they meet."""
        places = super().mark(axes, values)
        known = None not in places
        update_source(self._cross, x=[places[0]] if known else [], y=[places[1]] if known else [])
        return places

    def say(self, sentence: str) -> None:
        """Show nothing but a sentence."""
        super().say(sentence)
        update_model(self._hatching, visible=False)

    def _mark_attractors(self, data: Basins) -> None:
        points = np.concatenate([*(one.points for one in data.marks), np.empty((0, 2))])
        repeated = [(one.marker, len(one.points)) for one in data.marks]
        update_source(
            self._points, x=points[:, 0], y=points[:, 1],
            size=[_PIXELS * marker.size for marker, count in repeated for _ in range(count)],
            colour=[marker.face for marker, count in repeated for _ in range(count)],
        )  # fmt: skip


def _image(**options: Any) -> Image:
    return Image(**{one: one for one in IMAGE}, **options)
