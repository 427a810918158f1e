"""Diagrams over one parameter, with bands of the classes of motion and of stick-slip below."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import numpy as np

from wedgebrake.figures.data import class_styles as classes
from wedgebrake.figures.data.axes import SweptAxis, runs
from wedgebrake.figures.data.bifurcation import SweepBranch, SweepDiagram
from wedgebrake.figures.matplotlib import style
from wedgebrake.figures.matplotlib.layout import page
from wedgebrake.figures.matplotlib.maps import draw_classes, draw_hatching, set_axes

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

MARGINS = 0.85
"""Width beside the axes, on both sides together [inch]."""
# Heights of the label and ticks of the parameter with what lies between panels, and of a band of
# classes for each branch [inch].
_BETWEEN, _BAND = 0.75, 0.13
_PADS = MappingProxyType({"h_pad": 0.028, "hspace": 0.0})
# Smallest width of a run of one motion for each character of its name inside the band [pt].
_CHARACTER = 4.6


@contextmanager
def diagram(
    data: SweepDiagram,
    heights: Sequence[float],
    legends: Sequence[tuple[str, list[classes.LegendEntry]]],
    sentences: Sequence[str],
    width: float,
) -> Iterator[tuple[Figure, list[Axes]]]:
    """A new figure of a width, and axes of given heights [inch] above the bands of classes."""
    rows = [*heights, *[_BAND * len(data.branches)] * 2]
    sizes: Any = {"beside": MARGINS, "more": _BETWEEN}
    with page(width, rows, legends, sentences, **sizes, pads=_PADS) as (figure, grid):
        axes = [figure.add_subplot(grid[0])]
        axes += [figure.add_subplot(grid[row], sharex=axes[0]) for row in range(1, len(rows))]
        set_axes(axes[0], data.x)
        yield figure, axes[:-2]
        for one in axes[:-1]:
            one.set_xlabel("")
            one.tick_params(axis="x", labelbottom=False)
        motions, sticks = axes[-2:]
        _draw_bands(motions, data.x, data.branches, data.motions, classes.MOTIONS, "motion")
        _name_motions(motions, data.x, data.motions, data.orders, 72.0 * (width - MARGINS))
        _draw_bands(sticks, data.x, data.branches, data.sticks, classes.STICK_CLASSES, "sticks")
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
    y = SweptAxis.from_edges(np.arange(rows + 1.0))
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
            look: Any = {"ha": "center", "va": "center", "zorder": 4}
            look["fontsize"] = style.points(5.5)
            colour = style.text_colour(classes.MOTIONS[codes[first]].colour)
            axes.text(middle, len(motions) - branch - 0.54, name, color=colour, **look)
