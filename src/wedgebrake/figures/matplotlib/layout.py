"""Figures with panels, legends below them and a caption above them; lines and markers."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

from wedgebrake.figures.data.class_styles import HATCH, LegendEntry, LineStyle, MarkerStyle
from wedgebrake.figures.matplotlib import style

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.gridspec import GridSpec

HATCHES = "/////////"
# Width of a line with the casing on both sides of it, over that of the line [pt].
_CASING = 1.4
# Size of captions [pt] and height of their lines [inch]; height of a line of a legend, and space
# above a legend [inch].
_CAPTION, _CAPTION_LINE = 6.0, 0.121
_LINE = 0.135
_ABOVE = 0.06


@contextmanager
def captioned(width: float, height: float | None, sentences: Sequence[str]) -> Iterator[Figure]:
    """A new figure of a width [inch], drawn in the style of wedgebrake, below a caption.

    height : without the caption [inch]; None: three quarters of the width, with the caption
    """
    lines = caption_lines(sentences, width)
    if height is not None:
        height += _CAPTION_LINE * len(lines)
    with style.use():
        from wedgebrake.figures.matplotlib.figure import new_figure

        figure = new_figure(width, height)
        yield figure
        figure.suptitle("\n".join(lines), x=0.01, ha="left", fontsize=_CAPTION, linespacing=1.35)


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
) -> Iterator[tuple[Figure, GridSpec]]:
    """A new figure and its grid of ``rows`` times ``across`` panels.

    width, rows  : of the figure, and the heights of its panels [inch]
    legends      : heading and entries of each
    sentences    : of the caption
    beside, more : width beside legends, height of labels and ticks [inch]
    across       : number of panels in a row
    """
    inside = width - beside
    legends = [one for one in legends if one[1]]
    below = [
        math.ceil(len(entries) / _columns(entries, inside)) * _LINE + _ABOVE
        for _, entries in legends
    ]
    heights = [*rows, *below]
    with captioned(width, sum(heights) + more, sentences) as figure:
        grid = figure.add_gridspec(len(heights), across, height_ratios=heights)
        yield figure, grid
        for row, (heading, entries) in enumerate(legends, start=len(rows)):
            _draw_legend(figure.add_subplot(grid[row, :]), entries, inside, heading)


def caption_lines(sentences: Sequence[str], width: float) -> list[str]:
    """The sentences broken into lines of a width [inch]; each begins a line."""
    longest = 72.0 * width / _CAPTION - 2.0
    lines: list[str] = []
    for sentence in sentences:
        line = ""
        # A formula is one word; other white space does not end a word.
        for word in re.findall(r"(?:\$[^$]*\$|[^ $])+", style.minus_signs(sentence)):
            longer = f"{line} {word}".strip()
            if line and _length(longer) > longest:
                lines.append(line)
                longer = word
            line = longer
        lines.append(line)
    return lines


def _columns(entries: Sequence[LegendEntry], width: float) -> int:
    """The number of columns of a legend that fit in a width [inch]."""
    words = [one.label for one in entries]
    available = width / (style.SMALL / 72.0)
    for columns in range(len(words), 1, -1):
        longest = [max(map(_length, words[start::columns])) for start in range(columns)]
        if sum(longest) + columns * 3.0 <= available:
            return columns
    return 1


def _length(words: str) -> float:
    """Approximate length of words with formulas [em]."""
    seen = re.sub(r"\\[a-zA-Z]+|[\^]", "x", words)
    return 0.58 * len(re.sub(r"[${}_\\]", "", seen))


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
    rows = math.ceil(len(entries) / columns)
    shift = -3.5, 72.0 * _LINE * (rows - 0.5) - 2.2
    look = {"ha": "right", "va": "center", "fontsize": style.TICKS}
    title = style.write(axes, heading, (0.0, 0.0), shift, **look)
    # These axes are for legends only; legends must not move the other axes.
    for artist in (legend, title):
        artist.set_in_layout(False)


def _handle(entry: LegendEntry) -> Any:
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    look = entry.style
    if isinstance(look, MarkerStyle):
        return Line2D([], [], label=entry.label, **marker_options(look))
    if isinstance(look, LineStyle):
        return Line2D([], [], label=entry.label, **line_options(look))
    hatched: Any = {"edgecolor": look.over(HATCH), "hatch": HATCHES}
    edge = {"edgecolor": "#808080"} if look.opacity == 1.0 else hatched
    return Patch(facecolor=look.over(), linewidth=0.3, label=entry.label, **edge)


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
