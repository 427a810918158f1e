"""Panels at fixed positions, their ticks and labels, the title and what it says."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

from wedgebrake.figures.data import caption
from wedgebrake.figures.matplotlib import style
from wedgebrake.figures.matplotlib.layout import caption_lines
from wedgebrake.model.paper_machines import DURATION, HERTZ, PRINTED_F0, WEDGE, Assumptions, Case
from wedgebrake.paper.laboratory import METHOD_WORDS, STEADY, Laboratory

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

# Of the title: size [pt], height of a line [inch], and space above [inch].
_TITLE = 6.2
_LINE, _ABOVE = 0.125, 0.06
# Width of a letter of tick labels [inch].
_LETTER = 0.068
# Margins of the panels [inch]. Text is not measured for the layout: that takes longer than drawing.
_RIGHT, _BOTTOM = 0.14, 0.36

GROUPS = ("eta", "f", "F0", "alpha")
SECTION = rf"$t = {STEADY:g}\,\mathrm{{s}} + n/f_e$ up to {DURATION:g} s"


def sheet(
    sentences: Sequence[str],
    heights: Sequence[float],
    shares: Sequence[float],
    *,
    width: float = style.PAGE,
    left: float = 0.55,
    top: float = 0.22,
    across: float = 0.42,
    between: float = 0.2,
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
    height = above + sum(heights) + between * (len(heights) - 1) + _BOTTOM
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
    room = width - left - _RIGHT - across * (len(shares) - 1)
    panels = []
    y = height - above
    for tall in heights:
        y -= tall
        row, x = [], left
        for share in shares:
            wide = room * share / sum(shares)
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
        if axis is axes.xaxis and sum(len(style.number(v)) + 1 for v in values) > room:
            values = [values[0], values[-1]]
        axis.set_major_locator(FixedLocator(values))
        axis.set_major_formatter(FuncFormatter(lambda value, _place: style.number(value)))


def zero_lines(axes: Axes, *, vertical: bool = False) -> None:
    """Draw a thin line at zero, upright too if ``vertical``."""
    for draw in (axes.axhline, axes.axvline)[: 1 + vertical]:
        draw(0.0, color=style.GREY, linewidth=0.4, zorder=1)


def head(axes: Axes, words: str, *, raised: float = 3.0) -> None:
    """Write above the axes, ``raised`` points, from their left end on."""
    style.write(axes, words, (0.0, 1.0), (0.0, raised), ha="left", va="bottom")


def row_label(axes: Axes, words: str, *, away: float = 30.0) -> None:
    """Write at the left of a row, upwards, ``away`` points from its first axes."""
    look = {"ha": "right", "va": "center", "multialignment": "center", "rotation": 90}
    style.write(axes, words, (0.0, 0.5), (-away, 0.0), **look)


def note(axes: Axes, words: str, side: str, colour: str) -> None:
    """Write small text above the axes, at their left or right end."""
    place = 0.0 if side == "left" else 1.0
    look = {"ha": side, "va": "bottom", "color": colour, "fontsize": 6.0}
    style.write(axes, words, (place, 1.0), (0.0, 1.5), **look)


def groups(case: Case, names: tuple[str, ...] = GROUPS) -> str:
    """Groups of a case as equations; the wedge angle of wedge brakes only."""
    shown = {name: getattr(case, name) for name in names}
    if case.brake != WEDGE:
        shown.pop("alpha", None)
    return caption.equations(shown)


def fixed(number: int, case: Case, varied: Sequence[str]) -> str:
    """Groups that a figure does not vary, with the printed F_0 where that differs."""
    text = groups(case, tuple(name for name in GROUPS if name not in varied))
    if number not in (14, 15, 16) or case.F0 == PRINTED_F0:
        return text
    return f"{text} (printed: {groups(case.at(F0=PRINTED_F0), ('F0',))})"


def row(case: Case, varied: tuple[str, ...]) -> str:
    """Groups in which the rows of a figure differ, one per line, with whole hertz."""
    lines = [groups(case, (name,)) for name in varied]
    hertz = case.f / HERTZ
    if varied == ("f",) and math.isclose(hertz, round(hertz)):
        lines.append(f"({round(hertz)} Hz)")
    return "\n".join(lines)


def assumptions(chosen: Assumptions) -> str:
    """Assumptions as formulas."""
    words = f"Assumed: {chosen.words()}."
    for plain, formula in (
        ("c =", "$c$ ="),
        ("μ_s", r"$\mu_s$"),
        ("|θ'|", r"$|\dot\theta|$"),
        ("|v_r|", "$|v_r|$"),
    ):
        words = words.replace(plain, formula)
    return words


def both(laboratories: Sequence[Laboratory]) -> str:
    """Methods with their colours."""
    return " ".join(
        f"{colour}: {METHOD_WORDS[one.method]}."
        for colour, one in zip(("Blue", "Orange"), laboratories, strict=False)
    )


def compared(laboratory: Laboratory) -> list[Laboratory]:
    """Laboratories to compare: the given one and, unless it is that, the exact solution."""
    exact = laboratory.method == "exact"
    return [laboratory] if exact else [laboratory, laboratory.like(method="exact")]
