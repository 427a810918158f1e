"""The style of Matplotlib pictures: the common style, its settings, and elements of all axes."""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import contextmanager
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import numpy as np

from wedgebrake.figures.data.axes import round_values_log
from wedgebrake.figures.data.limits import thinned
from wedgebrake.figures.style import *  # noqa: F403 - extended here
from wedgebrake.figures.style import GREY, LABELS, MOST_ACROSS, RASTER_FROM, SMALL, TICKS, number

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.axis import Axis

_RC: Any = {
    "font.family": "sans-serif",
    "font.sans-serif": ["DejaVu Sans"],  # part of Matplotlib: the same everywhere
    "mathtext.fontset": "dejavusans",
    "font.size": LABELS,
    "axes.labelsize": LABELS,
    "xtick.labelsize": TICKS,
    "ytick.labelsize": TICKS,
    "legend.fontsize": SMALL,
    "figure.titlesize": LABELS,
    "figure.facecolor": "white",
    "axes.facecolor": "white",
    "axes.linewidth": 0.6,
    "axes.formatter.limits": (-3, 4),
    "axes.formatter.use_mathtext": True,
    "axes.axisbelow": True,
    "xtick.direction": "in",
    "ytick.direction": "in",
    "xtick.major.width": 0.6,
    "ytick.major.width": 0.6,
    "xtick.minor.width": 0.4,
    "ytick.minor.width": 0.4,
    "lines.linewidth": 0.9,
    "lines.solid_joinstyle": "round",
    "legend.frameon": False,
    "legend.handlelength": 1.3,
    "legend.handletextpad": 0.5,
    "legend.columnspacing": 1.1,
    "legend.borderaxespad": 0.0,
    "svg.fonttype": "none",
    "svg.hashsalt": "wedgebrake",  # the same picture gives the same file
    "path.simplify": True,
    "agg.path.chunksize": 20_000,
    "hatch.linewidth": 0.45,
}
PAINTED: Any = MappingProxyType(_RC)
"""Settings while a figure is drawn."""
WRITTEN: Any = MappingProxyType({**_RC, "pdf.fonttype": 42, "ps.fonttype": 42})
"""Settings while a figure is written to a file: TrueType fonts."""


@contextmanager
def use() -> Iterator[None]:
    """Draw in this style inside the block; Matplotlib's own settings are restored after it."""
    import matplotlib as mpl

    with mpl.rc_context():
        mpl.rcdefaults()
        mpl.rcParams.update(WRITTEN)
        yield


def show_message(axes: Axes, words: str) -> None:
    """Write a sentence in the middle of axes that have nothing to show."""
    look: Any = {"ha": "center", "va": "center", "color": GREY, "wrap": True}
    axes.text(0.5, 0.5, words, transform=axes.transAxes, **look)
    axes.set_xticks([])
    axes.set_yticks([])


def few_ticks(axes: Axes, x: int = 5, y: int = 6) -> None:
    """Set about ``x`` and ``y`` round ticks on linear axes, so that labels stay apart."""
    from matplotlib.ticker import MaxNLocator

    for axis, count in ((axes.xaxis, x), (axes.yaxis, y)):
        if axis.get_scale() == "linear":
            axis.set_major_locator(MaxNLocator(count, steps=[1, 2, 5, 10], min_n_ticks=3))


def letter(axes: Axes, word: str) -> None:
    """Write the letter of a panel above its upper left corner."""
    look = {"ha": "right", "va": "bottom", "fontsize": 9.0, "fontweight": "bold"}
    write(axes, word, (0.0, 1.0), (-20.0, 5.0), **look)


def write(
    axes: Axes,
    words: str,
    at: tuple[float, float],
    shift: tuple[float, float] = (0.0, 0.0),
    where: Any = "axes fraction",
    **look: Any,
) -> Any:
    """Write small words at a point of the axes, by default in axes fractions, shifted [pt]."""
    given = {"xytext": shift, "xycoords": where, "textcoords": "offset points", "fontsize": SMALL}
    return axes.annotate(words, at, **{**given, **look})


def round_ticks(axis: Axis, low: float, high: float) -> None:
    """Set labelled ticks at round numbers of a logarithmic axis from ``low`` to ``high``."""
    from matplotlib.ticker import FixedLocator, FuncFormatter, NullLocator

    ticks = [tick for tick in round_values_log(low, high, 7) if low <= tick <= high]
    axis.set_major_locator(FixedLocator(ticks))
    axis.set_minor_locator(NullLocator())
    axis.set_major_formatter(FuncFormatter(lambda value, _position: number(value)))


def plot_line(axes: Axes, x: Any, y: Any, **look: Any) -> None:
    """Draw a line; one of very many points as pixels inside vector files.

    Of a curve over ascending ``x`` with more points than pixels, the envelope is drawn: the
    smallest and the largest value in each column of pixels.
    """
    if len(x) > MOST_ACROSS and np.all(np.diff(x) > 0.0):
        shown = thinned(y, MOST_ACROSS)
        x, y = x[shown], y[shown]
    axes.plot(x, y, rasterized=len(x) > RASTER_FROM, **look)


def plot_points(axes: Axes, x: Any, y: Any, size: float, **look: Any) -> list[Any]:
    """Draw round points of a size [pt]; very many as pixels inside vector files."""
    dots = {"linestyle": "none", "marker": "o", "markersize": size, "markeredgewidth": 0.0}
    return axes.plot(x, y, **{"rasterized": len(x) > RASTER_FROM, **dots, **look})


def shade(axes: Axes, start: Any, end: Any, colour: str, alpha: float, label: str = "") -> Any:
    """Shade intervals across the whole height of axes."""
    spans = list(zip(start, end - start, strict=True))
    look: Any = {"facecolor": colour, "edgecolor": "none", "alpha": alpha, "zorder": 1}
    across = axes.get_xaxis_transform()
    return axes.broken_barh(spans, (0.0, 1.0), transform=across, label=label, **look)


def logarithmic_beyond(
    axes: Axes, linear: float, limits: tuple[float, float], ticks: int = 3
) -> None:
    """Set a vertical scale that is linear up to ``linear`` from 0 and logarithmic beyond."""
    from matplotlib.ticker import FixedLocator, NullLocator

    axes.set_yscale("symlog", linthresh=linear, linscale=0.7)
    axes.set_ylim(*limits)
    decades = math.ceil(math.log10(max(*map(abs, limits), 10.0 * linear) / linear))
    stride = math.ceil(decades / ticks)
    first = 0 if stride == 1 else stride
    powers = [linear * 10.0**n for n in range(first, decades, stride)]
    axes.yaxis.set_major_locator(FixedLocator([*(-p for p in powers[::-1]), 0.0, *powers]))
    axes.yaxis.set_minor_locator(NullLocator())


def legend_above(axes: Axes, handles: list[Any], columns: int = 4) -> None:
    """Add a legend in one row above the axes, at the right."""
    if handles:
        axes.legend(handles=handles, loc="lower right", bbox_to_anchor=(1.0, 1.02), ncols=columns)


def inches_wide(axes: Axes) -> float:
    """Approximate width of axes [inch]."""
    figure: Any = axes.figure
    return float(figure.get_figwidth() * axes.get_position().width)
