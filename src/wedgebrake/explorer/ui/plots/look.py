"""Names of ``figures.bokeh.chart`` as the pictures over parameters import them."""

from wedgebrake.figures.bokeh.chart import (
    FONT,
    FRAME,
    GRID,
    INK,
    MUTED,
    chart,
)
from wedgebrake.figures.bokeh.chart import Overlay as Words
from wedgebrake.figures.bokeh.chart import float32 as single
from wedgebrake.figures.bokeh.chart import set_range as span
from wedgebrake.figures.bokeh.chart import update_source as put
from wedgebrake.figures.data.limits import about

__all__ = ["FONT", "FRAME", "GRID", "INK", "MUTED", "Words", "about", "chart", "put", "single",
           "span"]  # fmt: skip
