"""Figures with panels, legends below them and a caption above them; lines and markers."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

from wedgebrake.figures.data.class_styles import (
    HATCH,
    ClassStyle,
    LegendEntry,
    LineStyle,
    MarkerStyle,
)
from wedgebrake.figures.matplotlib import style
from wedgebrake.figures.matplotlib.given import GivenAxes

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.gridspec import GridSpec
    from matplotlib.text import Text

HATCHES = "/////////"
# Width of a line with the casing on both sides of it, over that of the line [pt].
_CASING = 1.4
# Size of captions [pt] and height of their lines [inch]; height of a line of a legend, and space
# above a legend [inch].
_CAPTION, _CAPTION_LINE = 6.0, 0.121
_LINE = 0.135
# Width of a handle in a legend with the space about it [em].
_HANDLE = 3.0
# Length of labels, as a share of the axes before their layout, that calls for a closer look.
_NEARLY = 0.8
_ABOVE = 0.06


@contextmanager
def captioned(width: float, height: float | None, sentences: Sequence[str]) -> Iterator[Figure]:
    """A new figure of a width [inch], drawn in the present look, below a caption.

    Axes of the user take its place, if there are any, without a caption.

    height : without the caption [inch]; None: three quarters of the width, with the caption
    """
    with style.use():
        if style.look().axes:
            given: Any = GivenAxes(style.look().axes)
            yield given
            _wrap_labels(given)
            return
        from wedgebrake.figures.matplotlib.figure import new_figure

        size = style.points(_CAPTION)
        lines = caption_lines(sentences, width, size)
        if height is not None:
            height += style.points(_CAPTION_LINE) * len(lines)
        figure = new_figure(width, height)
        yield figure
        figure.suptitle("\n".join(lines), x=0.01, ha="left", fontsize=size, linespacing=1.35)
        _wrap_labels(figure)


@contextmanager
def page(
    width: float,
    rows: Sequence[float],
    legends: Sequence[tuple[str, list[LegendEntry]]],
    sentences: Sequence[str],
    *,
    beside: float = 0.2,
    more: float = 0.5,
    across: int = 1,
    pads: Mapping[str, float] = MappingProxyType({}),
) -> Iterator[tuple[Figure, GridSpec]]:
    """A new figure and its grid of ``rows`` times ``across`` panels.

    width, rows  : of the figure, and the heights of its panels [inch]
    legends      : heading and entries of each
    sentences    : of the caption
    beside, more : width beside legends, height of labels and ticks [inch]
    across       : number of panels in a row
    pads         : of the constrained layout, where they differ

    Axes of the user have one ordinary legend instead: beside the first, or in it if a colour bar is
    beside it.
    """
    inside = width - beside
    with style.use():
        legends = [(heading, _wrapped(those, inside)) for heading, those in legends if those]
        below = [style.points(_LINE) * _lines(those, inside) + _ABOVE for _, those in legends]
    heights = [*rows, *below]
    with captioned(width, sum(heights) + more, sentences) as figure:
        if isinstance(figure, GivenAxes):
            grid = figure.add_gridspec(len(rows), across)
            yield figure, grid
            _add_legend(figure, legends)
            return
        engine: Any = figure.get_layout_engine()
        engine.set(**pads)
        grid = figure.add_gridspec(len(heights), across, height_ratios=heights)
        yield figure, grid
        for row, (heading, entries) in enumerate(legends, start=len(rows)):
            _draw_legend(figure.add_subplot(grid[row, :]), entries, inside, heading)


def settle(figure: Figure) -> None:
    """Move the axes of a figure to their final position."""
    with style.use():
        if isinstance(figure, GivenAxes):
            figure.root.draw_without_rendering()
            return
        engine: Any = figure.get_layout_engine()
        engine.execute(figure)


def caption_lines(sentences: Sequence[str], width: float, size: float = _CAPTION) -> list[str]:
    """The sentences broken into lines of a width [inch] in a size [pt]; each begins a line."""
    longest = 72.0 * width / size - 2.0
    return [line for one in sentences for line in _broken(style.minus_signs(one), longest)]


def _broken(words: str, longest: float) -> list[str]:
    """Words broken into lines of a length [em]."""
    lines, line = [], ""
    # A formula and a unit are one word; other white space does not end a word.
    for word in re.findall(r"(?:\$[^$]*\$|\[[^\]]*\]|[^ $\[])+", words):
        longer = f"{line} {word}".strip()
        if line and _length(longer) > longest:
            lines.append(line)
            longer = word
        line = longer
    return [*lines, line]


def _wrap_labels(figure: Figure) -> None:
    """Break labels that are longer than their axis."""
    # The layout, which takes time, decides only where a label is about as long as its axis.
    if not any(_excess(label, axes, way) > _NEARLY for label, axes, way in _labels(figure)):
        return
    settle(figure)
    for label, axes, way in _labels(figure):
        excess = _excess(label, axes, way)
        if excess > 1.0:
            lines = label.get_text().split("\n")
            longest = max(map(_length, lines)) / excess
            label.set_text("\n".join(part for line in lines for part in _broken(line, longest)))


def _labels(figure: Figure) -> Iterator[tuple[Text, Axes, int]]:
    """Labels of axes in use, with their axes, 0 for across and 1 for up."""
    for axes in figure.axes:
        labels = (axes.xaxis.label, axes.yaxis.label) if axes.axison else ()
        yield from ((label, axes, way) for way, label in enumerate(labels) if label.get_text())


def _excess(label: Text, axes: Axes, way: int) -> float:
    """Length of a label over that of its axis."""
    return float(label.get_window_extent().size[way] / axes.bbox.size[way])


def _wrapped(entries: Sequence[LegendEntry], width: float) -> list[LegendEntry]:
    """Entries of a legend whose labels are broken into lines of a width [inch]."""
    longest = width / (style.points(style.SMALL) / 72.0) - _HANDLE
    return [replace(one, label="\n".join(_broken(one.label, longest))) for one in entries]


def _lines(entries: Sequence[LegendEntry], width: float) -> int:
    """The number of lines of a legend of a width [inch]."""
    columns = _columns(entries, width)
    heights = [one.label.count("\n") + 1 for one in entries]
    return sum(max(heights[row : row + columns]) for row in range(0, len(heights), columns))


def _columns(entries: Sequence[LegendEntry], width: float) -> int:
    """The number of columns of a legend that fit in a width [inch]."""
    words = [one.label for one in entries]
    available = width / (style.points(style.SMALL) / 72.0)
    for columns in range(len(words), 1, -1):
        longest = [max(map(_length, words[start::columns])) for start in range(columns)]
        if sum(longest) + columns * _HANDLE <= available:
            return columns
    return 1


def _length(words: str) -> float:
    """Approximate length of words with formulas [em]."""
    seen = re.sub(r"\\[a-zA-Z]+|[\^]", "x", words)
    lines = re.sub(r"[${}_\\]", "", seen).split("\n")
    return 0.58 * max(map(len, lines))


def _draw_legend(axes: Axes, entries: list[LegendEntry], width: float, heading: str) -> None:
    """Draw a legend of a width [inch] row by row in its own axes, its heading at the left."""
    axes.set_axis_off()
    columns = _columns(entries, width)
    legend = axes.legend(
        handles=[_handle(one) for start in range(columns) for one in entries[start::columns]],
        loc="lower left",
        bbox_to_anchor=(0.0, 0.0),
        ncols=columns,
        borderpad=0.0,
        labelspacing=_LINE * 72.0 / style.SMALL - 1.0,
        handleheight=0.8,
    )
    rows = _lines(entries, width)
    shift = -3.5, 72.0 * style.points(_LINE) * (rows - 0.5) - 2.2
    look = {"ha": "right", "va": "center", "fontsize": style.points(style.TICKS)}
    title = style.write(axes, heading, (0.0, 0.0), shift, **look)
    # These axes are for legends only; legends must not move the other axes.
    for artist in (legend, title):
        artist.set_in_layout(False)


def _add_legend(given: GivenAxes, legends: Sequence[tuple[str, list[LegendEntry]]]) -> None:
    """Add the entries of all legends, below their headings, to given axes."""
    from matplotlib.lines import Line2D

    handles: list[Any] = []
    for heading, entries in legends:
        handles += [Line2D([], [], linestyle="none", label=heading)] if heading else []
        handles += [_handle(one) for one in entries]
    if handles:
        beside: Any = {"loc": "upper left", "bbox_to_anchor": (1.02, 1.0), "borderaxespad": 0.0}
        given.gca().legend(handles=handles, **({} if given.added else beside))


def _handle(entry: LegendEntry) -> Any:
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    look = entry.style
    if isinstance(look, MarkerStyle):
        return Line2D([], [], label=entry.label, **marker_options(look))
    if isinstance(look, LineStyle):
        return Line2D([], [], label=entry.label, **line_options(look))
    return Patch(label=entry.label, **patch_options(look))


def patch_options(look: ClassStyle) -> dict[str, Any]:
    """Options of a patch in the colour of a class, hatched where it is not opaque."""
    hatched = {"edgecolor": look.over(HATCH), "hatch": HATCHES}
    edge = {"edgecolor": "#808080"} if look.opacity == 1.0 else hatched
    return {"facecolor": look.over(), "linewidth": 0.3, **edge}


def line_options(style: LineStyle) -> dict[str, Any]:
    """Options of ``plot`` for a line."""
    from matplotlib.patheffects import Normal, Stroke

    options = {
        "color": style.colour,
        "linewidth": style.width,
        "linestyle": style.dashes,
        "dash_capstyle": "butt",
    }
    if not style.casing:
        return options
    unbroken = {"dash_offset": 0.0, "dash_list": None}
    casing = Stroke(linewidth=style.width + _CASING, foreground=style.casing, dashes=unbroken)
    return {**options, "solid_capstyle": "butt", "path_effects": [casing, Normal()]}


def marker_options(style: MarkerStyle) -> dict[str, Any]:
    """Options of ``plot`` for points."""
    return {
        "linestyle": "none",
        "marker": style.symbol,
        "markersize": style.size,
        "markerfacecolor": style.face,
        "markeredgecolor": style.edge,
        "markeredgewidth": style.edge_width,
    }
