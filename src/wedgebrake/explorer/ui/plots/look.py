"""The look of the charts, and what they share: figures, ranges, sentences in place."""

from __future__ import annotations

import html
import math
from typing import Any

import numpy as np
from bokeh.events import DoubleTap
from bokeh.models import (
    ColumnDataSource,
    CustomJS,
    CustomJSTickFormatter,
    Range1d,
    Scatter,
)
from bokeh.models.dom import HTML
from bokeh.plotting import figure
from numpy.typing import NDArray

from wedgebrake.explorer.core.snapshot import Moment
from wedgebrake.figures.matplotlib import style

FloatArray = NDArray[np.float64]

INK, MUTED, GRID, FRAME = "#1B2430", "#5B6675", "#ECEFF3", "#C9D0D8"
FONT = 'system-ui, -apple-system, "Segoe UI", Roboto, "DejaVu Sans", sans-serif'
MOTION, GHOST = style.MOTION, "#A9B2BD"
STICKS = {side: colour for side, (colour, _) in style.STICKS.items()} | {0: "#AEB6C0"}
STICK_WORDS = {1: "stick from v > 0", -1: "stick from v < 0", 0: "rest from the start"}

MOST_POINTS = 3000
"""Points of a line, so that a page is drawn in time without a graphics card."""
# Numbers at ticks: no more digits than they need, and a true minus.
_TICK = """
const x = Number(tick.toPrecision(9)), size = Math.abs(x)
const text = x && (size < 1e-3 || size >= 1e6) ? x.toExponential() : String(x)
return text.replaceAll("-", "\u2212").replace("e+", "e")
"""
# Rests nearer to each other than this share of the picture are drawn as one.
_APART = 1e-3
# Sentences for a run that ended early.
_ENDS = {
    "diverged": "The motion grows without bound.",
    "no_forward_solution": "The brake locked itself.",
    "event_limit": "Stopped at a limit of the explorer: the beginning.",
    "step_limit": "Stopped at a limit of the explorer: the beginning.",
}


def chart(title: str, across: str, up: str, **options: Any) -> figure:
    """An empty figure with a title and the words of its axes; ranges are of the kind Range1d.

    Glyphs are added with ``add_glyph``: methods such as ``line`` and ``scatter`` also create models
    for selection, which are not needed and slow down every page.
    """
    drawn = figure(
        title=title,
        x_axis_label=across,
        y_axis_label=up,
        **{"x_range": Range1d(0.0, 1.0), "y_range": Range1d(-1.0, 1.0), **options},
        sizing_mode="stretch_both",
        toolbar_location="right",
        toolbar_inner=True,
        min_border=6,
        min_border_left=54,
        outline_line_color=FRAME,
        background_fill_color="#FFFFFF",
        border_fill_color="#FFFFFF",
        output_backend="canvas",
        lod_threshold=None,
    )
    drawn.toolbar.autohide = True
    drawn.toolbar.logo = None
    title_ = drawn.title
    title_.text_font, title_.text_font_size, title_.text_color = FONT, "12px", INK
    title_.text_font_style, title_.standoff, title_.offset = "bold", 4, -4
    for axis in drawn.axis:
        axis.axis_label_text_font = axis.major_label_text_font = FONT
        axis.axis_label_text_font_size = axis.major_label_text_font_size = "11px"
        axis.axis_label_text_font_style = "normal"
        axis.axis_label_text_color = axis.major_label_text_color = MUTED
        axis.axis_line_color = axis.major_tick_line_color = FRAME
        axis.minor_tick_line_color = None
        axis.axis_label_standoff, axis.major_label_standoff = 2, 3
        axis.major_tick_in, axis.major_tick_out = 0, 4
    for axis in (drawn.xaxis, drawn.yaxis):
        if options.get("y_axis_type") != "log" or axis is drawn.xaxis:
            axis.formatter = CustomJSTickFormatter(code=_TICK)
    drawn.xaxis.ticker.desired_num_ticks = 8
    drawn.yaxis.ticker.desired_num_ticks = 5
    drawn.grid.grid_line_color = GRID
    drawn.js_on_event(DoubleTap, CustomJS(args={"drawn": drawn}, code="drawn.reset.emit()"))
    return drawn


def point() -> Scatter:
    """Marker of the current position in a motion."""
    return Scatter(x="x", y="y", size=8, fill_color=style.ORANGE, line_color=INK)


class Words:
    """Words over a figure: the key beside its title, and a sentence in its middle."""

    def __init__(self, drawn: figure) -> None:
        place = {"position": "absolute", "font-family": FONT, "pointer-events": "none"}
        key = {"right": "10px", "top": "5px", "font-size": "11px", "color": MUTED}
        middle = {
            "left": "22%", "right": "12%", "top": "38%", "text-align": "center",
            "font-size": "12.5px", "color": MUTED,
        }  # fmt: skip
        self._key = HTML(html="", style={**place, **key, "white-space": "nowrap"})
        self._middle = HTML(html="", style={**place, **middle})
        drawn.elements = [self._key, self._middle]

    def key(self, *items: tuple[str, str, str]) -> None:
        """A row of (sign, colour, word)."""
        text = "&emsp;".join(
            f'<span style="color:{colour}">{sign}</span> {html.escape(word)}'
            for sign, colour, word in items
        )
        _change(self._key, "html", text)

    def say(self, sentence: str) -> None:
        """Say a sentence in the middle; an empty one takes it away."""
        text = html.escape(sentence)
        if text:
            text = f'<span style="background:#FFFFFFD9;padding:3px 8px">{text}</span>'
        _change(self._middle, "html", text)


def _change(model: Any, name: str, value: Any) -> None:
    if getattr(model, name) != value:
        setattr(model, name, value)


def put(source: ColumnDataSource, **columns: Any) -> None:
    """New columns, arrays or lists; nothing is sent where they are as before."""
    old = source.data
    same = set(old) == set(columns) and all(
        len(old[name]) == len(new) and np.array_equal(old[name], new)
        for name, new in columns.items()
    )
    if not same:
        # Lists as they are: an empty one of colours would be an array of numbers.
        source.data = columns


def single(values: FloatArray) -> NDArray[np.float32]:
    """Values as a browser draws them, in half the bytes."""
    with np.errstate(over="ignore"):  # beyond single precision nothing is drawn
        return values.astype(np.float32)


def span(range_: Range1d, low: float, high: float) -> None:
    """New ends of a range, also for its reset; a zoom into the same ends is kept."""
    if (range_.reset_start, range_.reset_end) == (low, high):
        return
    range_.update(start=low, end=high, reset_start=low, reset_end=high)


def round_span(low: float, high: float, least: float = 0.0) -> tuple[float, float]:
    """Ends about low..high with a margin of 5 %, rounded so that they seldom change.

    least : the width is at least this
    """
    if not (math.isfinite(low) and math.isfinite(high)):
        return -1.0, 1.0
    low, high = style.margins(low, high, least, share=0.05)
    rough = (high - low) / 20.0
    step = 10.0 ** math.floor(math.log10(rough))
    step *= next(factor for factor in (1.0, 2.0, 5.0, 10.0) if factor * step >= rough)
    first, last = math.floor(low / step) * step, math.ceil(high / step) * step
    return (first, last) if first < low and last > high else (low, high)


def about(low: float, high: float, scale: float = 0.0) -> tuple[float, float]:
    """Ends of a range of values low..high; of what is constant, a fifth of its size about it.

    scale : a size beside the values' own; so much smaller variation is rounding
    """
    size = max(abs(low), abs(high), scale)
    # Else the scatter of rounding would fill the picture of a motion that rests.
    return round_span(low, high, 0.2 * size if high - low <= 1e-9 * size else 0.0)


def thinned(values: FloatArray, most: int = MOST_POINTS) -> NDArray[np.int64]:
    """Places of at most ``most`` values, (n,), that keep every extreme of a line through all."""
    if values.size <= most:
        return np.arange(values.size)
    width = math.ceil(2 * values.size / (most - 2))
    full = values.size // width * width
    blocks = values[:full].reshape(-1, width)
    first = np.arange(0, full, width)
    found = [first + blocks.argmin(axis=1), first + blocks.argmax(axis=1), [0, values.size - 1]]
    return np.unique(np.concatenate(found))


def fitting(moment: Moment) -> slice:
    """The samples that fit into a picture: of a motion that grows, those before it is too large."""
    size = np.abs(moment.velocity)
    if moment.status != "diverged" or size.size == 0:
        return slice(0, size.size)
    scale = 4.0 * float(np.quantile(size, 0.6))
    outside = np.flatnonzero(size > scale)
    return slice(0, int(outside[0]) + 1 if outside.size else size.size)


def rests(moment: Moment) -> FloatArray:
    """The sticks, (k, 3), those too near to each other for the eye as one."""
    sticks = moment.sticks
    if sticks.shape[0] < 2:
        return sticks
    gap = _APART * (moment.time[-1] - moment.time[0])
    apart = (sticks[1:, 0] - sticks[:-1, 1] > gap) | (sticks[1:, 2] != sticks[:-1, 2])
    # Very many, of both signs: the sign of the first counts.
    if np.count_nonzero(apart) > 1.0 / _APART:
        apart = sticks[1:, 0] - sticks[:-1, 1] > gap
    first = np.concatenate(([True], apart))
    last = np.concatenate((apart, [True]))
    return np.column_stack((sticks[first, 0], sticks[last, 1], sticks[first, 2]))


def ending(moment: Moment) -> str:
    """A sentence for a run that ended early; empty for one that did not."""
    return _ENDS.get(moment.status, "") if moment.status != "completed" else ""
