"""Picture of a fit: measured and fitted columns over time, and residuals."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from wedgebrake.figures.data.panels import Panel, StyledLine
from wedgebrake.figures.matplotlib import style
from wedgebrake.figures.matplotlib.layout import captioned
from wedgebrake.figures.matplotlib.panels import draw_panel

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from wedgebrake.analysis.fitting.fit import Fit

# Heights of the panels of a column, measured and residual [inch].
_ROW, _LOW = 1.7, 1.0
# Height of a measured number [inch].
_EACH = 0.3


def fit(result: Fit, *, width: float = style.PAGE) -> Figure:
    """Draw the measured and fitted columns of a fit and their residuals in a new figure.

    Without columns, the residuals of measured numbers.

    result : as returned by ``wb.fit``
    width  : of the figure [inch]
    """
    data, sentences = result.data, _sentences(result)
    if not data.sizes["column"]:
        return _of_numbers(result, width, sentences)
    time, heights = data["time"].to_numpy(), [_ROW, _LOW] * data.sizes["column"]
    with captioned(width, sum(heights), sentences) as figure:
        grid = figure.subplots(len(heights), 1, sharex=True, height_ratios=heights)
        for number, (top, low) in enumerate(grid.reshape(-1, 2)):
            one = data.isel(column=number)
            name, unit = str(one["column"].item()), str(one["unit"].item())
            residual = one["residual"].to_numpy()
            lines = (
                StyledLine("measured", time, one["measured"].to_numpy(), style.GREY, width=2.2),
                StyledLine("fitted", time, one["fitted"].to_numpy(), style.BLUE),
            )
            draw_panel(top, Panel(f"{name}  [{unit}]", lines, legend=number == 0))
            rest = (StyledLine("residual", time, residual, style.VERMILLION),)
            draw_panel(low, Panel(f"residual\n[{unit}]", rest, legend=False, zero=True))
        grid[-1].set_xlabel("time $t$  [s]")
        figure.align_ylabels(grid)
    return figure


def _of_numbers(result: Fit, width: float, sentences: list[str]) -> Figure:
    """The residuals of measured numbers, in standard deviations."""
    names = list(result.numbers)
    shares = [one["residual"] / one["sigma"] for one in result.numbers.values()]
    with captioned(width, _LOW + _EACH * len(names), sentences) as figure:
        axes = figure.subplots()
        axes.errorbar(shares, range(len(names)), xerr=1.0, fmt="o", color=style.VERMILLION)
        axes.axvline(0.0, color=style.GREY, linewidth=0.8)
        axes.set_yticks(range(len(names)), names)
        axes.set_ylim(len(names) - 0.5, -0.5)
        axes.set_xlabel("measured − fitted, in standard deviations")
    return figure


def _rounded(value: float, error: float) -> str:
    """A value with an error of two digits, and as many digits of the value."""
    if not 0.0 < error < abs(value):
        return f"{value:.8g} ± {error:.2g}"
    digits = math.floor(math.log10(abs(value))) - math.floor(math.log10(error)) + 2
    return f"{value:#.{min(digits, 15)}g} ± {error:.2g}"


def _sentences(result: Fit) -> list[str]:
    """Values with their confidence intervals, measured numbers, and remarks."""
    found = []
    units = result.covariance["unit"].to_numpy()
    for (name, (_, high)), unit in zip(result.interval().items(), units, strict=True):
        value = result.values[name]
        if not result.converged:
            told = f"{name} = {value:.8g}{'' if unit == '1' else f' {unit}'}"
            found.append(f"{told}, not at a minimum.")
        elif np.isfinite(high):
            told = f"{name} = {_rounded(value, high - value)}"
            found.append(f"{told}{'' if unit == '1' else f' {unit}'} (95 % interval).")
        else:
            found.append(f"{name}: not determined.")
    for name, one in result.numbers.items():
        found.append(
            f"{name} = {one['measured']:.6g} ± {one['sigma']:.2g} {one['unit']} measured,"
            f" {one['fitted']:.6g} fitted."
        )
    if not result.converged:
        found.append(result.outcome)
    return [*found, *result.undetermined, *result.remarks]
