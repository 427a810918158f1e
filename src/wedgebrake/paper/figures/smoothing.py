"""Smoothed friction tends to Coulomb friction: responses, limits and creep over xi."""

from __future__ import annotations

from typing import TYPE_CHECKING

from wedgebrake.figures.matplotlib import style

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from wedgebrake.paper.smoothing import Smoothing

_COLOURS = (style.BLUE, style.VERMILLION, style.GREEN)
_MARKS = ("o", "s", "^")


def draw(found: Smoothing) -> Figure:
    """Three panels over the steepness xi."""
    from wedgebrake.paper.smoothing import PAPER_STEEPNESS, REGULAR, STEEPNESS

    with style.use():
        figure = style.new_figure(style.PAGE, 2.6)
        left, middle, right = figure.subplots(1, 3)
        for case, row, colour, mark in zip(REGULAR, found.errors, _COLOURS, _MARKS, strict=True):
            label = rf"$\eta={case.eta:g}$, $F_0={case.F0:g}$"
            left.plot(STEEPNESS, 100.0 * row, mark + "-", color=colour, markersize=3, label=label)
        left.set_ylabel("velocity, rms difference  [%]")
        left.set_yscale("log")
        left.set_ylim(top=100.0)
        for (name, row, exact), colour, mark in zip(found.limits, _COLOURS, _MARKS, strict=False):
            middle.plot(STEEPNESS, row, mark + "-", color=colour, markersize=3, label=name)
            middle.axhline(exact, color=colour, linestyle=style.DASHES, linewidth=0.7)
        middle.set_ylabel("limit in $F_0$  [1]  (dashed: Coulomb)")
        right.plot(STEEPNESS, found.creep, "o-", color=style.BLUE, markersize=3)
        right.set_ylabel("largest speed of creep  [rad/s]")
        right.set_yscale("log")
        for axes, letter in zip((left, middle, right), "abc", strict=True):
            _steepness(axes, PAPER_STEEPNESS)
            style.letter(axes, letter)
        left.legend(loc="upper right")
        middle.legend(loc="center right")
        return figure


def _steepness(axes: Axes, paper: float) -> None:
    axes.set_xscale("log")
    axes.set_xlabel(r"steepness $\xi$  [s/m]")
    axes.axvline(paper, color=style.GREY, linewidth=0.6, zorder=0.5)
    axes.annotate(
        "the paper's", (paper, 1.0), xycoords=("data", "axes fraction"), xytext=(0, 3),
        textcoords="offset points", ha="center", fontsize=style.SMALL, color=style.GREY,
    )  # fmt: skip
