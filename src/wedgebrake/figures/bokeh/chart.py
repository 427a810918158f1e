"""Empty Bokeh figures, text over them, and updates that send only changes."""

from __future__ import annotations

import html
from typing import Any

import numpy as np
from bokeh.events import DoubleTap
from bokeh.models import ColumnDataSource, CustomJS, CustomJSTickFormatter, Label, Range1d, Span
from bokeh.models.dom import HTML
from bokeh.plotting import figure
from numpy.typing import NDArray

INK, MUTED, GRID, FRAME = "#1B2430", "#5B6675", "#ECEFF3", "#C9D0D8"
FONT = 'system-ui, -apple-system, "Segoe UI", Roboto, "DejaVu Sans", sans-serif'

# Numbers at ticks: with as few digits as possible and a true minus sign.
TICK = """
const x = Number(tick.toPrecision(9)), size = Math.abs(x)
const text = x && (size < 1e-3 || size >= 1e6) ? x.toExponential() : String(x)
return text.replaceAll("-", "\u2212").replace("e+", "e")
"""


def chart(title: str, across: str, up: str, **options: Any) -> figure:
    """An empty figure with a title and the labels of its axes; its ranges are of type Range1d.

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
            axis.formatter = CustomJSTickFormatter(code=TICK)
    drawn.xaxis.ticker.desired_num_ticks = 8
    drawn.yaxis.ticker.desired_num_ticks = 5
    drawn.grid.grid_line_color = GRID
    drawn.js_on_event(DoubleTap, CustomJS(args={"drawn": drawn}, code="drawn.reset.emit()"))
    return drawn


class Chart:
    """A figure with a key beside its title, and sources that ``show_message`` empties."""

    def __init__(self, drawn: figure) -> None:
        self.figure = drawn
        self._sources: list[ColumnDataSource] = []
        place = {"position": "absolute", "font-family": FONT, "pointer-events": "none"}
        # Beside the title: in two lines where one is too long.
        key = {
            "right": "10px", "top": "0", "height": "20px", "max-width": "calc(100% - 160px)",
            "display": "flex", "flex-wrap": "wrap", "justify-content": "flex-end",
            "align-content": "center", "column-gap": "11px", "line-height": "10px",
            "font-size": "11px", "color": MUTED,
        }  # fmt: skip
        middle = {
            "left": "22%", "right": "12%", "top": "38%", "text-align": "center",
            "font-size": "12.5px", "color": MUTED,
        }  # fmt: skip
        self._key = HTML(html="", style={**place, **key, "white-space": "nowrap"})
        self._middle = HTML(html="", style={**place, **middle})
        drawn.elements = [self._key, self._middle]

    def source(self, *columns: str, name: str | None = None) -> ColumnDataSource:
        """Create an empty source of this chart."""
        made = ColumnDataSource({column: [] for column in columns}, name=name)
        self._sources.append(made)
        return made

    def set_key(self, *items: tuple[str, str, str]) -> None:
        """Show a row of (symbol, colour, label) as the key."""
        text = "".join(
            f'<span><span style="color:{colour}">{symbol}</span> {html.escape(label)}</span>'
            for symbol, colour, label in items
        )
        update_model(self._key, html=text)

    def show_overlay(self, sentence: str) -> None:
        """Show a sentence in the middle; an empty sentence removes it."""
        text = html.escape(sentence)
        if text:
            text = f'<span style="background:#FFFFFFD9;padding:3px 8px">{text}</span>'
        update_model(self._middle, html=text)

    def show_message(self, sentence: str) -> None:
        """Show only a sentence."""
        for source in self._sources:
            clear_source(source)
        self.set_key()
        self.show_overlay(sentence)


class MarkedLine:
    """A line at a value, hidden at first.

    dimension : "height" or "width", the direction of the line
    label     : options of the label beside it; None: no label
    """

    def __init__(
        self, drawn: figure, dimension: str, label: dict[str, Any] | None = None, **look: Any
    ) -> None:
        self.line = Span(dimension=dimension, location=0.0, visible=False, **look)
        given = {"text_color": INK, "background_fill_alpha": 0.8, **(label or {}), "text": ""}
        self.label = Label(
            x=0.0, text_font=FONT, text_font_size="11px", text_baseline="top",
            background_fill_color="#FFFFFF", visible=False, **{"y": 0.0, **given},
        )  # fmt: skip
        drawn.add_layout(self.line)
        if label is not None:
            drawn.add_layout(self.label)

    def show(self, at: float | None, text: str = "", **label: Any) -> None:
        """Move to a value with a text and options of the label; None hides the line."""
        update_model(self.line, visible=at is not None)
        update_model(self.label, visible=at is not None)
        if at is not None:
            update_model(self.line, location=at)
            update_model(self.label, x=at, text=text, **label)


def update_model(model: Any, **values: Any) -> None:
    """Set the attributes of a model that change, since each assignment is sent."""
    for name, value in values.items():
        if getattr(model, name) != value:
            setattr(model, name, value)


def clear_source(source: ColumnDataSource) -> None:
    """Empty all columns of a source."""
    update_source(source, **{name: [] for name in source.data})


def update_source(source: ColumnDataSource, **columns: Any) -> None:
    """Replace the columns of a source; unchanged ones are not sent again."""
    old = source.data
    same = set(old) == set(columns) and all(
        len(old[name]) == len(new) and np.array_equal(old[name], new)
        for name, new in columns.items()
    )
    if not same:
        # Lists stay lists: an empty list of colours would become an array of numbers.
        source.data = columns


def float32(values: NDArray[np.float64]) -> NDArray[np.float32]:
    """Values in single precision, as a browser draws them, in half the bytes."""
    with np.errstate(over="ignore"):  # values beyond single precision are not drawn
        return values.astype(np.float32)


def set_range(range_: Range1d, low: float, high: float) -> None:
    """Set the ends of a range and of its reset; a zoom within the same ends is kept."""
    if (range_.reset_start, range_.reset_end) == (low, high):
        return
    range_.update(start=low, end=high, reset_start=low, reset_end=high)
