"""Bands of classes below a diagram over one parameter."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from wedgebrake.figures.data import class_styles as classes
from wedgebrake.figures.data.axes import SweptAxis, runs
from wedgebrake.figures.data.bifurcation import BifurcationDiagram, SweepBranch
from wedgebrake.figures.data.response_diagram import ResponseDiagram
from wedgebrake.figures.matplotlib import style
from wedgebrake.figures.matplotlib.maps import draw_classes, draw_hatching

if TYPE_CHECKING:
    from matplotlib.axes import Axes

# Smallest width of a run of one motion for each character of its name inside the band [pt].
_CHARACTER = 4.6


def draw_classes_below(
    axes: Sequence[Axes], data: BifurcationDiagram | ResponseDiagram, width: float
) -> None:
    """Draw the classes of motion and of stick-slip on the last two axes, of a width [pt]."""
    motions, sticks = axes[-2:]
    _draw_bands(motions, data.x, data.branches, data.motions, classes.MOTIONS, "motion")
    _name_motions(motions, data.x, data.motions, data.orders, width)
    _draw_bands(sticks, data.x, data.branches, data.sticks, classes.STICK_CLASSES, "sticks")
    for one in axes[:-1]:
        one.tick_params(axis="x", labelbottom=False)
    for one in (motions, sticks):
        one.tick_params(axis="x", direction="out", top=False)
    motions.tick_params(axis="x", bottom=False)
    sticks.set_xlabel(data.x.label)


def _draw_bands(
    axes: Axes,
    x: SweptAxis,
    branches: Sequence[SweepBranch],
    codes: np.ndarray,
    styles: Sequence[classes.ClassStyle],
    word: str,
) -> None:
    """Draw one row of classes for each branch, the first at the top."""
    rows = len(branches)
    draw_hatching(axes)
    y = SweptAxis.between(np.arange(rows + 1.0))
    axes.set_ylim(0.0, rows)
    draw_classes(axes, x, y, codes[::-1], styles)
    for edge in y.edges[1:-1]:
        axes.axhline(edge, color="black", linewidth=0.4, zorder=3)
    labels = [f"{word} {branch.name}".strip() for branch in reversed(branches)]
    axes.set_yticks(y.values, labels=labels)
    axes.tick_params(axis="y", length=0)


def _name_motions(
    axes: Axes, x: SweptAxis, motions: np.ndarray, orders: np.ndarray, width: float
) -> None:
    """Write T, 2T, 3T, ... on runs of one periodic motion, on axes of a width [pt]."""
    edges = x.positions(x.edges)
    scale = width / (edges[-1] - edges[0])
    for branch, codes in enumerate(motions):
        own = np.where(np.isin(codes, list(classes.PERIODIC)), orders[branch], 0)
        own[codes == classes.CODES["period_1"]] = 1
        for first, last in runs(own):
            name = classes.period(own[first])
            available = scale * (edges[last + 1] - edges[first])
            if own[first] < 1 or available < _CHARACTER * (len(name) - 1):
                continue
            middle = x.at(0.5 * (edges[first] + edges[last + 1]))
            look: Any = {"ha": "center", "va": "center", "fontsize": 5.5, "zorder": 4}
            colour = style.ink(classes.MOTIONS[codes[first]].colour)
            axes.text(middle, len(motions) - branch - 0.54, name, color=colour, **look)
