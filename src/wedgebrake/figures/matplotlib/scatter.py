"""Picture of the result of ``scatter``: probabilities, Sobol indices, samples by class."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from wedgebrake.figures.data.class_styles import class_entries
from wedgebrake.figures.data.scatter import Scatter
from wedgebrake.figures.matplotlib import style
from wedgebrake.figures.matplotlib.layout import marker_options, page, patch_options

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

# Height of a row of bars, least height of bars, and height of the samples [inch].
_BAR, _LEAST, _SAMPLES = 0.24, 0.9, 2.6
_BIN_COUNT = 30
# Sizes of points, and of those in the legend [pt].
_DOT, _SYMBOL = 2.2, 4.0
_TOTAL, _FIRST = style.BLUE, "#9FC0FF"


def scatter(
    dataset: xr.Dataset,
    x: str | None = None,
    y: str | None = None,
    effect: str | None = None,
    *,
    width: float = style.PAGE,
) -> Figure:
    """Draw the probabilities, Sobol indices and samples of ``wb.scatter`` in a new figure.

    dataset : as returned by ``wb.scatter``
    x, y    : parameters over which the samples are drawn; default: those with the largest total
              Sobol indices, or the first two
    effect  : quantity or outcome whose Sobol indices are drawn; default: the first that has them
    width   : of the figure [inch]

    Panels: the probability of each outcome with its 95 % interval; with indices, the total and
    first-order Sobol indices of each parameter with their intervals; the samples over two
    parameters, or a histogram over one, coloured by class. Samples whose class is undecided are
    crosses, or hatched in the histogram.
    """
    data = Scatter.of(dataset, x, y, effect)
    bars = [max(_LEAST, _BAR * (1 + len(data.probabilities)))]
    if data.influences:
        bars.append(max(_LEAST, 1.6 * _BAR * (1 + len(data.influences))))
    size = None if data.y is None else _SYMBOL
    entries = class_entries(data.codes, data.styles, shares=True, size=size)
    rows = [*bars, _SAMPLES]
    with page(width, rows, [("", entries)], data.sentences, beside=1.3, more=1.3) as (figure, grid):
        panels = [figure.add_subplot(grid[i, 0]) for i in range(len(rows))]
        _draw_probabilities(panels[0], data)
        if data.influences:
            _draw_influences(panels[1], data)
        _draw_samples(panels[-1], data)
    return figure


def _draw_probabilities(axes: Axes, data: Scatter) -> None:
    places = np.arange(len(data.probabilities))[::-1]
    for place, one in zip(places, data.probabilities, strict=True):
        axes.plot([one.low, one.high], [place, place], color=style.BLUE, linewidth=2.0)
        style.plot_points(axes, [one.value], [place], 4.0, color=style.BLACK, zorder=3.0)
        right = one.high < 0.6
        style.write(
            axes, one.words, (one.high if right else one.low, float(place)),
            (4.0 if right else -4.0, 0.0), "data", ha="left" if right else "right", va="center",
        )  # fmt: skip
    axes.set_yticks(places, [one.outcome.replace("_", " ") for one in data.probabilities])
    axes.set_ylim(-0.6, len(places) - 0.4)
    axes.set_xlim(-0.02, 1.02)
    axes.set_xlabel("probability  [1]")


def _draw_influences(axes: Axes, data: Scatter) -> None:
    places = np.arange(len(data.influences))
    for shift, colour, label, row in (
        (
            0.18,
            _TOTAL,
            "total index $S_T$",
            [(one.total, one.total_conf) for one in data.influences],
        ),
        (
            -0.18,
            _FIRST,
            "first-order index $S_1$",
            [(one.first, one.first_conf) for one in data.influences],
        ),
    ):
        values, errors = np.array(row).T
        axes.barh(places + shift, values, 0.34, color=colour, label=label)
        axes.errorbar(
            values, places + shift, xerr=errors, fmt="none", ecolor=style.BLACK, elinewidth=0.7
        )
    axes.axvline(0.0, color=style.GREY, linewidth=0.5)
    axes.set_yticks(places, [one.parameter for one in data.influences])
    axes.set_ylim(-0.6, len(places) - 0.4)
    axes.set_xlabel(f"share of the variance of {data.effect.replace('_', ' ')}  [1]")
    style.legend_above(axes, axes.get_legend_handles_labels()[0])


def _draw_samples(axes: Axes, data: Scatter) -> None:
    axes.set_xlabel(data.labels[0])
    present = [code for code in range(len(data.styles)) if np.any(data.codes == code)]
    if data.y is None:
        edges = np.histogram_bin_edges(data.x, _BIN_COUNT)
        below = np.zeros(_BIN_COUNT)
        for code in present:
            counts = np.histogram(data.x[data.codes == code], edges)[0]
            box = patch_options(data.styles[code])
            axes.bar(edges[:-1], counts, np.diff(edges), below, align="edge", **box)
            below += counts
        axes.set_ylim(0.0, 1.05 * below.max())
        axes.set_ylabel("samples")
        return
    axes.set_ylabel(data.labels[1])
    for code in present:
        chosen = data.codes == code
        look = marker_options(data.styles[code].marker(_DOT))
        style.plot_points(axes, data.x[chosen], data.y[chosen], **look)
    style.few_ticks(axes)
