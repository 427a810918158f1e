"""The identification: assumptions against statements, which hold."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from wedgebrake.figures.matplotlib import style

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from wedgebrake.paper.identification import Row

_HOLDS, _FAILS, _UNTOLD = style.BLUE, style.PALE_GREY, "white"


def draw(rows: Sequence[Row]) -> Figure:
    """A cell per combination and statement: filled where it holds; the best on top."""
    from matplotlib.patches import Patch

    names = list(rows[0].scores)
    with style.use():
        figure = style.new_figure(style.PAGE, 0.6 + 0.135 * len(rows))
        axes = figure.add_subplot()
        for y, row in enumerate(rows):
            colours = [_colour(row.scores[name]) for name in names]
            axes.barh(
                [y] * len(names), [0.94] * len(names), left=[x - 0.47 for x in range(len(names))],
                height=0.84, color=colours,
            )  # fmt: skip
        axes.set_yticks(range(len(rows)), [_label(row) for row in rows], fontsize=6.0)
        axes.set_xticks(range(len(names)), names)
        axes.xaxis.tick_top()
        axes.tick_params(length=0)
        axes.set_xlim(-0.6, len(names) - 0.4)
        axes.set_ylim(len(rows) - 0.4, -0.6)
        right = axes.secondary_yaxis("right")
        right.set_yticks(range(len(rows)), [f"{row.held} of {row.told}" for row in rows])
        right.tick_params(length=0, labelsize=6.0)
        for side in (*axes.spines.values(), *right.spines.values()):
            side.set_visible(False)
        figure.legend(
            handles=[
                Patch(color=_HOLDS, label="holds"),
                Patch(color=_FAILS, label="does not hold"),
            ],
            loc="outside lower right",
            ncols=2,
        )
        return figure


def _colour(holds: bool | None) -> str:
    if holds is None:
        return _UNTOLD
    return _HOLDS if holds else _FAILS


def _label(row: Row) -> str:
    one = row.assumptions
    speed = r"$|\dot\theta|$" if one.slope_on == "shaft" else "$|v_r|$"
    released = "release" if one.release else "no release"
    return rf"$c={one.damping:g}$, $\mu_s={one.static:.2f}$, {released}, {speed}"
