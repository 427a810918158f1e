"""Colours, sizes and type of every picture."""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

# Okabe and Ito's palette, told apart by the colour-blind (jfly.uni-koeln.de/color, 2002).
BLACK = "#000000"
ORANGE = "#E69F00"
SKY = "#56B4E9"
GREEN = "#009E73"
YELLOW = "#F0E442"
BLUE = "#0072B2"
VERMILLION = "#D55E00"
PURPLE = "#CC79A7"
GREY = "#767676"

# What the colours stand for.
MOTION = BLUE
SWITCHING = BLACK
RELEASE = GREEN
FORCING = VERMILLION
NATURAL = GREEN
TORQUE = "#8A8A8A"
# Sticks, by the sign of the sliding velocity before: colour and words.
STICKS = {
    1: (VERMILLION, "stick from $v>0$"),
    -1: (PURPLE, "stick from $v<0$"),
    0: (GREY, "rest from the start"),
}

# Widths of a journal's single and double column, 89 and 183 mm, in inches.
COLUMN = 3.5
PAGE = 7.2

# Lines and points beyond this number are drawn as pixels inside vector files.
RASTER_FROM = 20_000

_RC: Any = {
    "font.family": "sans-serif",
    "font.sans-serif": ["DejaVu Sans"],  # comes with Matplotlib: the same everywhere
    "mathtext.fontset": "dejavusans",
    "font.size": 7.5,
    "axes.labelsize": 7.5,
    "xtick.labelsize": 7.0,
    "ytick.labelsize": 7.0,
    "legend.fontsize": 6.5,
    "figure.titlesize": 7.5,
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
    "pdf.fonttype": 42,
    "path.simplify": True,
    "agg.path.chunksize": 20_000,
}


@contextmanager
def use() -> Iterator[None]:
    """Draw in this style inside the block; outside, Matplotlib's settings stay untouched."""
    import matplotlib as mpl

    with mpl.rc_context():
        mpl.rcdefaults()
        mpl.rcParams.update(_RC)
        yield


def new_figure(width: float = COLUMN, height: float | None = None) -> Figure:
    """An empty figure of a width and height [inch], without pyplot."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width, 0.75 * width if height is None else height))
    figure.set_layout_engine("constrained", w_pad=0.06, h_pad=0.06, wspace=0.04, hspace=0.04)
    return figure


def say(axes: Axes, words: str) -> None:
    """Words in the middle of axes that have nothing to show."""
    axes.text(
        0.5, 0.5, words, transform=axes.transAxes, ha="center", va="center", color=GREY, wrap=True
    )
    axes.set_xticks([])
    axes.set_yticks([])


def few_ticks(axes: Axes, x: int = 5, y: int = 6) -> None:
    """About ``x`` and ``y`` round numbers on linear axes, so that labels stay apart."""
    from matplotlib.ticker import MaxNLocator

    for axis, scale, number in (
        (axes.xaxis, axes.get_xscale(), x),
        (axes.yaxis, axes.get_yscale(), y),
    ):
        if scale == "linear":
            axis.set_major_locator(MaxNLocator(number, steps=[1, 2, 5, 10], min_n_ticks=3))


def letter(axes: Axes, word: str) -> None:
    """The letter of a panel, above its upper left corner."""
    axes.annotate(
        word,
        (0.0, 1.0),
        xytext=(-20.0, 5.0),
        xycoords="axes fraction",
        textcoords="offset points",
        ha="right",
        va="bottom",
        fontsize=9.0,
        fontweight="bold",
    )


def legend_above(axes: Axes, handles: list[Any], columns: int = 4) -> None:
    """A legend in one row above the axes, at the right, where it hides nothing."""
    if handles:
        axes.legend(handles=handles, loc="lower right", bbox_to_anchor=(1.0, 1.02), ncols=columns)


def number(value: float) -> str:
    """A number for mathtext, four digits."""
    if value != 0.0 and not 1e-4 <= abs(value) < 1e5:
        mantissa, exponent = f"{value:.3e}".split("e")
        return rf"{float(mantissa):g}\times 10^{{{int(exponent)}}}"
    return f"{value:.4g}" if abs(value) < 1e4 else f"{value:.0f}"


def moment(time: float, span: float) -> str:
    """A time [s] with the digits that a span of times [s] needs."""
    digits = 4
    if 0.0 < span < abs(time):
        digits += math.ceil(math.log10(abs(time) / span))
    return f"{time:.{min(digits, 17)}g}"


def margins(low: float, high: float, least: float, share: float = 0.06) -> tuple[float, float]:
    """Limits round low..high with a margin, never narrower than ``least``.

    Without it the scatter of rounding would fill the picture of a motion that is constant.
    """
    middle = 0.5 * (low + high)
    half = max(0.5 * (high - low) * (1.0 + 2.0 * share), 0.5 * least)
    if half == 0.0:
        half = 1.0
    return middle - half, middle + half
