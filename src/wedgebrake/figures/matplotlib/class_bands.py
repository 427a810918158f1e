"""Strips below a bifurcation diagram: the class of motion and of stick-slip of each parameter."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from wedgebrake.figures.matplotlib import class_styles, heatmap, style

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from wedgebrake.figures.matplotlib.sweep_record import Record

# Height of a row, one for each branch [inch].
ROW = 0.13
# A motion is named inside the strip where it is so wide [pt] for each character.
_CHARACTER = 4.6


def draw(motion: Axes, sticks: Axes, record: Record, wide: float) -> None:
    """Both strips, on axes of a width [pt]."""
    _draw_strip(motion, record, record.motions, class_styles.MOTION_LOOKS, "motion")
    for branch in range(len(record.branches)):
        _name_motions(motion, record, branch, wide)
    _draw_strip(sticks, record, record.sticks, class_styles.STICK_LOOKS, "sticks")


def _draw_strip(
    axes: Axes, record: Record, codes: np.ndarray, table: Sequence[class_styles.Look], word: str
) -> None:
    """One row of classes for each branch, the first at the top."""
    rows = len(record.branches)
    class_styles.hatching(axes)
    y = heatmap.between(np.arange(rows + 1.0))
    axes.set_ylim(0.0, rows)
    heatmap.draw_classes(axes, record.x, y, codes[::-1], table)
    for edge in y.edges[1:-1]:
        axes.axhline(edge, color="black", linewidth=0.4, zorder=3)
    axes.set_yticks(
        y.values, labels=[f"{word} {branch.word}".strip() for branch in reversed(record.branches)]
    )
    axes.tick_params(axis="y", length=0)


def _name_motions(axes: Axes, record: Record, branch: int, wide: float) -> None:
    """T, 2T, 3T, ... on the runs of one periodic motion that have the room."""
    x, codes = record.x, record.motions[branch]
    edges = x.places(x.edges)
    scale = wide / (edges[-1] - edges[0])
    orders = np.where(np.isin(codes, list(class_styles.PERIODIC)), record.orders[branch], 0)
    orders[codes == class_styles.SYNCHRONOUS] = 1
    for first, last in heatmap.runs(orders):
        name = class_styles.period(orders[first])
        room = scale * (edges[last + 1] - edges[first])
        if orders[first] < 1 or room < _CHARACTER * (len(name) - 1):
            continue
        axes.text(
            x.at(0.5 * (edges[first] + edges[last + 1])),
            len(record.branches) - branch - 0.54,
            name,
            ha="center",
            va="center",
            fontsize=5.5,
            color=style.ink(class_styles.MOTION_LOOKS[codes[first]].colour),
            zorder=4,
        )
