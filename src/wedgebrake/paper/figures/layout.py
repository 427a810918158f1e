"""Panels in rows and columns at fixed positions, their ticks and labels, and the title."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from wedgebrake.figures.matplotlib import style
from wedgebrake.figures.matplotlib.layout import caption_lines

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

# Of the title: size [pt], height of a line [inch], and space above [inch].
_TITLE = 6.2
_LINE, _ABOVE = 0.125, 0.06

# Width of a letter of tick labels [inch].
_LETTER = 0.068

# Margins of the panels, and the space between columns and rows [inch]. Text is not
# measured for the layout: that takes longer than drawing.
LEFT, RIGHT, BOTTOM, TOP = 0.55, 0.14, 0.36, 0.22
ACROSS, BETWEEN = 0.42, 0.2


def sheet(
    sentences: Sequence[str],
    heights: Sequence[float],
    shares: Sequence[float] = (1.0,),
    *,
    width: float = style.PAGE,
    left: float = LEFT,
    top: float = TOP,
    across: float = ACROSS,
    between: float = BETWEEN,
) -> tuple[Figure, list[list[Axes]]]:
    """Create a figure with its title, and its panels, row by row.

    sentences : of the title
    heights   : of the rows [inch]
    shares    : of the columns in the width
    left, top : margins [inch]; across, between : space between columns and rows [inch]
    """
    from wedgebrake.figures.matplotlib.figure import Picture

    lines = caption_lines(sentences, width)
    above = _ABOVE + _LINE * len(lines) + top
    height = above + sum(heights) + between * (len(heights) - 1) + BOTTOM
    figure = Picture(figsize=(width, height))
    figure.suptitle(
        "\n".join(lines),
        x=0.06 / width,
        y=1.0 - _ABOVE / height,
        ha="left",
        va="top",
        fontsize=_TITLE,
        linespacing=1.3,
    )
    room = width - left - RIGHT - across * (len(shares) - 1)
    widths = [room * share / sum(shares) for share in shares]
    panels = []
    y = height - above
    for tall in heights:
        y -= tall
        row, x = [], left
        for wide in widths:
            row.append(figure.add_axes((x / width, y / height, wide / width, tall / height)))
            x += wide + across
        panels.append(row)
        y -= between
    return figure, panels


def inches(axes: Axes) -> tuple[float, float]:
    """Width and height of axes."""
    dpi = axes.figure.dpi
    return axes.bbox.width / dpi, axes.bbox.height / dpi


def ticks(axes: Axes, x: int, y: int) -> None:
    """Set about ``x`` and ``y`` round ticks on linear axes; 0 leaves an axis as it is."""
    from matplotlib.ticker import FixedLocator, FuncFormatter, MaxNLocator

    room = inches(axes)[0] / _LETTER
    for axis, number in ((axes.xaxis, x), (axes.yaxis, y)):
        if number == 0 or axis.get_scale() != "linear":
            continue
        low, high = sorted(axis.get_view_interval())
        locator = MaxNLocator(number, steps=[1, 2, 5, 10], min_n_ticks=2)
        values = [float(v) for v in locator.tick_values(low, high) if low <= v <= high]
        if axis is axes.xaxis and sum(len(_figures(v)) + 1 for v in values) > room:
            values = [values[0], values[-1]]
        axis.set_major_locator(FixedLocator(values))
        axis.set_major_formatter(FuncFormatter(lambda value, _place: _figures(value)))


def _figures(value: float) -> str:
    return f"{value:g}".replace("e+0", "e").replace("e+", "e").replace("-", "\N{MINUS SIGN}")


def zero_lines(axes: Axes, *, vertical: bool = False) -> None:
    """Draw a thin line at zero, upright too if ``vertical``."""
    axes.axhline(0.0, color=style.GREY, linewidth=0.4, zorder=1)
    if vertical:
        axes.axvline(0.0, color=style.GREY, linewidth=0.4, zorder=1)


def bare(axes: Axes) -> None:
    """Remove the tick labels below: another row has them."""
    axes.tick_params(axis="x", labelbottom=False)


def head(axes: Axes, words: str, *, raised: float = 3.0) -> None:
    """Write above the axes, ``raised`` points, from their left end on."""
    _beside(axes, words, (0.0, 1.0), (0.0, raised), ha="left", va="bottom")


def row_label(axes: Axes, words: str, *, away: float = 30.0) -> None:
    """Write at the left of a row, upwards, ``away`` points from its first axes."""
    _beside(axes, words, (0.0, 0.5), (-away, 0.0), ha="right", va="center", rotation=90)


def note(axes: Axes, words: str, side: str, colour: str) -> None:
    """Write small text above the axes, at their left or right end."""
    place = 0.0 if side == "left" else 1.0
    _beside(axes, words, (place, 1.0), (0.0, 1.5), ha=side, va="bottom", color=colour, fontsize=6.0)


def _beside(
    axes: Axes, words: str, place: tuple[float, float], shift: tuple[float, float], **look: Any
) -> None:
    axes.annotate(
        words,
        place,
        xytext=shift,
        xycoords="axes fraction",
        textcoords="offset points",
        **{"fontsize": style.SMALL, "multialignment": "center", **look},
    )
