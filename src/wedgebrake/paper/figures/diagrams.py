"""Bifurcation diagrams as the paper draws them: dots, and the limits that it states."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from wedgebrake.figures.data import class_styles
from wedgebrake.figures.data.limits import extent
from wedgebrake.figures.matplotlib import style
from wedgebrake.model.paper_machines import DURATION
from wedgebrake.paper.diagrams import PLANS, Diagram, diagram
from wedgebrake.paper.figures import layout
from wedgebrake.paper.laboratory import METHOD_WORDS, Laboratory

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_HEIGHT = 1.75
# Size of a dot [pt].
_DOT = 1.0
# The figure in which one column is far higher than the others, so that a second scale is needed,
# and the speed [rad/s] up to which that scale is linear.
_RESONANCE, _LINEAR = 14, 1.0
# Width of a digit of the limits' numbers [inch], with some space.
_DIGIT = 0.062
# Coordinates of text at a value of the parameter.
_ABOVE = ("data", "axes fraction")


def draw(number: int, laboratory: Laboratory) -> Figure:
    """Draw a figure: a row for the laboratory's method and one for the exact solution.

    With a resonance the first row has a linear axis, the others are logarithmic beyond 1 rad/s.
    """
    plans = [plan for name, plan in PLANS.items() if name.rstrip("ab") == str(number)]
    letters = ("(a) ", "(b) ") if len(plans) > 1 else ("",)
    laboratories = layout.compared(laboratory)
    grid = [
        [diagram(one, plan.base, plan.name, plan.values()) for plan in plans]
        for one in laboratories
    ]
    rows = [(line, one, number == _RESONANCE) for line, one in zip(grid, laboratories, strict=True)]
    if number == _RESONANCE:
        rows.insert(0, (grid[0], laboratory, False))
    base, name = plans[0].base, plans[0].name
    brakes = ", ".join(
        f"{letter}{plan.base.brake} brake" for letter, plan in zip(letters, plans, strict=True)
    )
    lasted = all(column.completed for line in grid for one in line for column in one.columns)
    figure, axes = layout.sheet(
        [
            f"Figure {number}. {brakes.capitalize()}: {layout.fixed(number, base, [name])}.",
            layout.assumptions(laboratory.assumptions),
            (
                f"Rows: {'; '.join(METHOD_WORDS[one.method] for one in laboratories)}."
                f" {DURATION:g} s from rest, {grid[0][0].values.size} values of"
                f" ${style.SYMBOLS[name]}$."
            ),
            (
                f"Points: velocity at {layout.SECTION}. Dashed: limits stated by the paper."
                f"{'' if lasted else ' Grey: the run ended early.'}"
            ),
        ],
        [_HEIGHT] * len(rows),
        [1.0] * len(plans),
        left=0.74,
        top=0.34,
        between=0.12,
    )
    limits = [_limits(column) for column in zip(*grid, strict=True)]
    for line, (diagrams, one, logarithmic) in zip(axes, rows, strict=True):
        label = METHOD_WORDS[one.method].replace(", ", "\n")
        label += logarithmic * f"\nlogarithmic beyond {_LINEAR:g}"
        layout.row_label(line[0], label, away=26.0)
        for panel, shown, plan, ends in zip(line, diagrams, plans, limits, strict=True):
            panel.set_ylim(*ends)
            if logarithmic:
                style.logarithmic_beyond(panel, _LINEAR, ends)
            _draw_points(panel, shown, plan.limits)
            if line is not axes[-1]:
                panel.tick_params(axis="x", labelbottom=False)
    for top, bottom, plan, letter in zip(axes[0], axes[-1], plans, letters, strict=True):
        title = f"{letter}{style.SECTION['velocity']}, {plan.base.brake} brake"
        layout.head(top, title, raised=17.0)
        _number_limits(top, plan.limits)
        bottom.set_xlabel(style.axis_label(plan.name, "", "1"), labelpad=1.5)
    return figure


def _limits(diagrams: Sequence[Diagram]) -> tuple[float, float]:
    found = [column.velocity for one in diagrams for column in one.columns if column.completed]
    return style.margins(*extent(*found), 0.0, share=0.04) if found else (-1.0, 1.0)


def _draw_points(axes: Axes, shown: Diagram, limits: Sequence[float]) -> None:
    """Draw all points of a diagram at once, with the stated limits; shade runs that ended early."""
    values = shown.values
    axes.set_xlim(*style.margins(float(values[0]), float(values[-1]), 0.0, share=0.01))
    low, high = axes.get_xlim()
    lasted = np.array([column.completed for column in shown.columns])
    empty = class_styles.EMPTY.colour
    edges = np.concatenate(([low], 0.5 * (values[1:] + values[:-1]), [high]))
    heights = np.append(~lasted, False).astype(float)
    bands = axes.get_xaxis_transform()
    axes.fill_between(edges, 0.0, heights, step="post", transform=bands, **_band(empty))
    if shown.name == "alpha":  # wedges that lock themselves, tan(alpha_w) <= mu_k
        axes.axvspan(low, 1.0, **_band(style.PALE_GREY))
        look: dict[str, Any] = {"rotation": 90, "ha": "right", "va": "bottom"}
        style.write(axes, "self-locking", (1.0, 0.03), (-1.5, 0.0), _ABOVE, **look)
    for limit in limits:
        axes.axvline(limit, color=style.LIMIT, linewidth=0.6, linestyle=style.DASHES, zorder=2)
    layout.ticks(axes, 6, 6)
    if not lasted.any():
        ends = sorted({column.status.replace("_", " ") for column in shown.columns})
        axes.text(
            *(0.5, 0.5, f"no run lasted {DURATION:g} s: {', '.join(ends)}"),
            transform=axes.transAxes,
            ha="center",
            bbox={"facecolor": empty, "edgecolor": "none"},
        )
        axes.set_yticks([])
    places = np.repeat(values, [column.velocity.size for column in shown.columns])
    velocity = np.concatenate([column.velocity for column in shown.columns])
    look = {"color": style.MOTION, "rasterized": True, "zorder": 3}
    style.plot_points(axes, places, velocity, _DOT, **look)


def _band(colour: str) -> dict[str, Any]:
    return {"facecolor": colour, "edgecolor": "none", "linewidth": 0.0, "zorder": 0.5}


def _number_limits(axes: Axes, limits: Sequence[float]) -> None:
    """Write the limits above their lines, at two heights where they would touch."""
    low, high = axes.get_xlim()
    inch = layout.inches(axes)[0] / (high - low)
    end, level = -math.inf, 0
    look: dict[str, Any] = {"ha": "center", "va": "bottom", "fontsize": 6.0}
    for limit in limits:
        number = style.number(limit)
        half = 0.5 * _DIGIT * len(number)
        level = 1 - level if limit * inch - half < end else 0
        end = limit * inch + half
        style.write(axes, number, (limit, 1.0), (0.0, 1.5 + 7.0 * level), _ABOVE, **look)
