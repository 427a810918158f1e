"""Two figures of the report beside those of the paper: identification and smoothing."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from wedgebrake.figures.matplotlib import style

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from wedgebrake.paper.identification import Combination
    from wedgebrake.paper.smoothing import Smoothing

_COLOURS = {True: style.BLUE, False: style.PALE_GREY, None: "white"}
_CURVES = ((style.BLUE, "o"), (style.VERMILLION, "s"), (style.GREEN, "^"))


def identification(rows: Sequence[Combination]) -> Figure:
    """A cell per combination of assumptions and statement: filled where it holds; best on top."""
    from matplotlib.patches import Patch

    from wedgebrake.figures.matplotlib.figure import new_figure

    names, places = list(rows[0].scores), range(len(rows))
    with style.use():
        figure = new_figure(style.PAGE, 0.6 + 0.135 * len(rows))
        axes = figure.add_subplot()
        for y, row in enumerate(rows):
            axes.barh(
                [y] * len(names),
                0.94,
                left=[x - 0.47 for x in range(len(names))],
                height=0.84,
                color=[_COLOURS[row.scores[name]] for name in names],
            )
        axes.set_yticks(places, [_label(row) for row in rows], fontsize=6.0)
        axes.set_xticks(range(len(names)), names)
        axes.xaxis.tick_top()
        axes.tick_params(length=0)
        axes.set_xlim(-0.6, len(names) - 0.4)
        axes.set_ylim(len(rows) - 0.4, -0.6)
        right = axes.secondary_yaxis("right")
        right.set_yticks(places, [f"{row.held} of {row.decided}" for row in rows])
        right.tick_params(length=0, labelsize=6.0)
        for side in (*axes.spines.values(), *right.spines.values()):
            side.set_visible(False)
        words = {True: "holds", False: "does not hold"}
        handles = [Patch(color=_COLOURS[one], label=word) for one, word in words.items()]
        figure.legend(handles=handles, loc="outside lower right", ncols=2)
        return figure


def _label(row: Combination) -> str:
    one = row.assumptions
    speed = r"$|\dot\theta|$" if one.slope_on == "shaft" else "$|v_r|$"
    released = "release" if one.release else "no release"
    return rf"$c={one.damping:g}$, $\mu_s={one.static:.2f}$, {released}, {speed}"


def smoothing(found: Smoothing) -> Figure:
    """Responses, limits and creep over the steepness xi of the smoothed law."""
    from wedgebrake.figures.matplotlib.figure import new_figure
    from wedgebrake.paper.smoothing import PAPER_STEEPNESS, REGULAR, STEEPNESS

    with style.use():
        figure = new_figure(style.PAGE, 2.6)
        left, middle, right = figure.subplots(1, 3)
        for case, row, (colour, mark) in zip(REGULAR, found.errors, _CURVES, strict=True):
            label = rf"$\eta={case.eta:g}$, $F_0={case.F0:g}$"
            left.plot(STEEPNESS, 100.0 * row, mark + "-", color=colour, markersize=3, label=label)
        left.set_ylabel("velocity, rms difference  [%]")
        left.set_yscale("log")
        left.set_ylim(top=100.0)
        for (name, row, exact), (colour, mark) in zip(found.limits, _CURVES, strict=False):
            middle.plot(STEEPNESS, row, mark + "-", color=colour, markersize=3, label=name)
            middle.axhline(exact, color=colour, linestyle=style.DASHES, linewidth=0.7)
        middle.set_ylabel("limit in $F_0$  [1]  (dashed: Coulomb)")
        right.plot(STEEPNESS, found.creep, "o-", color=style.BLUE, markersize=3)
        right.set_ylabel("largest speed of creep  [rad/s]")
        right.set_yscale("log")
        for axes, letter in zip((left, middle, right), "abc", strict=True):
            axes.set_xscale("log")
            axes.set_xlabel(r"steepness $\xi$  [s/m]")
            axes.axvline(PAPER_STEEPNESS, color=style.GREY, linewidth=0.6, zorder=0.5)
            at, look = (PAPER_STEEPNESS, 1.0), {"ha": "center", "color": style.GREY}
            style.write(axes, "the paper's", at, (0.0, 3.0), ("data", "axes fraction"), **look)
            style.letter(axes, letter)
        left.legend(loc="upper right")
        middle.legend(loc="center right")
        return figure
