"""Empty Bokeh figures, text over them, and updates that send only changes."""

from __future__ import annotations

import html
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Generic, TypeVar

import numpy as np
from bokeh.events import DoubleTap
from bokeh.models import (
    AllIndices,
    AllLabels,
    BasicTicker,
    CDSView,
    ColumnDataSource,
    CustomJS,
    CustomJSTickFormatter,
    GlyphRenderer,
    Grid,
    Label,
    LinearAxis,
    LinearScale,
    LogAxis,
    LogScale,
    LogTicker,
    Plot,
    Range1d,
    Selection,
    Span,
    Title,
    Tool,
    Toolbar,
    UnionRenderers,
)
from bokeh.models.dom import HTML
from numpy.typing import NDArray

if TYPE_CHECKING:
    from wedgebrake.figures.data.axes import ParameterAxis

Picture = TypeVar("Picture")

INK, MUTED, GRID, FRAME = "#1B2430", "#5B6675", "#ECEFF3", "#C9D0D8"
FONT = 'system-ui, -apple-system, "Segoe UI", Roboto, "DejaVu Sans", sans-serif'

# Numbers at ticks: with as few digits as possible and a true minus sign.
TICK = """
const x = Number(tick.toPrecision(9)), size = Math.abs(x)
const text = x && (size < 1e-3 || size >= 1e6) ? x.toExponential() : String(x)
return text.replaceAll("-", "\u2212").replace("e+", "e")
"""


def chart(
    title: str,
    across: str,
    up: str,
    tools: Sequence[Tool],
    *,
    ranges: tuple[Range1d, Range1d] | None = None,
    log: bool = False,
) -> Plot:
    """An empty figure with a title and the labels of its axes.

    tools  : the first one is used for dragging
    ranges : horizontal and vertical
    log    : True if the vertical scale is logarithmic

    ``bokeh.plotting.figure`` would take several times as long, because it resolves names and
    creates models that are not needed here.
    """
    linear, labels = LinearScale(), AllLabels()
    look = {
        "axis_label_text_font": FONT, "major_label_text_font": FONT,
        "axis_label_text_font_size": "11px", "major_label_text_font_size": "11px",
        "axis_label_text_font_style": "normal", "axis_label_text_color": MUTED,
        "major_label_text_color": MUTED, "axis_line_color": FRAME, "major_tick_line_color": FRAME,
        "minor_tick_line_color": None, "axis_label_standoff": 2, "major_label_standoff": 3,
        "major_tick_in": 0, "major_tick_out": 4, "major_label_policy": labels,
    }  # fmt: skip
    formatter = CustomJSTickFormatter(code=TICK)
    below = LinearAxis(
        axis_label=across, ticker=BasicTicker(desired_num_ticks=8), formatter=formatter, **look
    )
    left = (
        LogAxis(axis_label=up, ticker=LogTicker(desired_num_ticks=5), **look)
        if log
        else LinearAxis(
            axis_label=up, ticker=BasicTicker(desired_num_ticks=5), formatter=formatter, **look
        )
    )
    grids = [Grid(dimension=way, axis=axis, grid_line_color=GRID)
             for way, axis in enumerate((below, left))]  # fmt: skip
    x_range, y_range = ranges or (Range1d(0.0, 1.0), Range1d(-1.0, 1.0))
    drawn = Plot(
        title=Title(
            text=title, text_font=FONT, text_font_size="12px", text_color=INK,
            text_font_style="bold", standoff=4, offset=-4,
        ),
        x_range=x_range, y_range=y_range, x_scale=linear, y_scale=LogScale() if log else linear,
        below=[below], left=[left], center=grids,
        toolbar=Toolbar(tools=[*tools], active_drag=tools[0], autohide=True, logo=None),
        toolbar_location="right", toolbar_inner=True, sizing_mode="stretch_both", min_border=6,
        min_border_left=54, outline_line_color=FRAME, background_fill_color="#FFFFFF",
        border_fill_color="#FFFFFF", output_backend="canvas", lod_threshold=None,
    )  # fmt: skip
    drawn.js_on_event(DoubleTap, CustomJS(args={"drawn": drawn}, code="drawn.reset.emit()"))
    return drawn


class Chart:
    """A figure with a key beside its title, and sources that ``show_message`` empties."""

    def __init__(self, drawn: Plot) -> None:
        self.figure = drawn
        self._sources: list[ColumnDataSource] = []
        # Nothing is selected or filtered: sources and glyphs share one model of each kind.
        self._unselected = {"selected": Selection(), "selection_policy": UnionRenderers()}
        self._all = AllIndices()
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
        made = self.fixed_source({column: [] for column in columns}, name)
        self._sources.append(made)
        return made

    def fixed_source(self, data: dict[str, Any], name: str | None = None) -> ColumnDataSource:
        """Create a source that ``show_message`` leaves unchanged."""
        return ColumnDataSource(data, name=name, **self._unselected)

    def draw(self, source: ColumnDataSource, glyph: Any, **options: Any) -> GlyphRenderer:
        """Draw a glyph for each row of a source."""
        view = CDSView(filter=self._all)
        return self.figure.add_glyph(source, glyph, view=view, **options)

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

    def choose(self, quantity: str) -> None:
        """Select the quantity, where a picture has several."""

    def mark(self, axes: Sequence[ParameterAxis], values: Sequence[Any]) -> list[float | None]:
        """Mark a value of each parameter; returns their positions, None outside the picture."""
        return [None for _ in zip(axes, values, strict=True)]


class QuantityChart(Chart, Generic[Picture]):
    """A chart that shows one of several quantities of a picture."""

    _quantity = ""
    _picture: Picture | None = None

    def choose(self, quantity: str) -> None:
        """Show a quantity."""
        if quantity != self._quantity:
            self._quantity = quantity
            if self._picture is not None:
                self._draw_quantity(self._picture)

    def show_message(self, sentence: str) -> None:
        """Show only a sentence."""
        self._picture = None
        super().show_message(sentence)

    def _draw_quantity(self, picture: Picture) -> None:
        """Draw what depends on the quantity."""
        raise NotImplementedError


class MarkedLine:
    """A line at a value, hidden at first.

    dimension : "height" or "width", the direction of the line
    label     : options of the label beside it; None: no label
    """

    def __init__(
        self, drawn: Plot, dimension: str, label: dict[str, Any] | None = None, **look: Any
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
