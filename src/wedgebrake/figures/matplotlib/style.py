"""Colours, sizes and type of every picture."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from contextlib import contextmanager
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.axis import Axis
    from matplotlib.figure import Figure

# Okabe and Ito's palette, told apart by the colour-blind (jfly.uni-koeln.de/color, 2002).
BLACK = "#000000"
ORANGE = "#E69F00"
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

# Two more depths of blue, so that periods doubled, T, 2T, 4T, deepen in colour; and greys.
PALE_BLUE = "#9FC0FF"
NAVY = "#1A0F7A"
PALE_GREY = "#D4D4D4"
DARK_GREY = "#565656"

# Colour scales: many points (a single one stays visible on white), sizes, signs.
DENSITY = ("#8AB4E0", "#3F83C4", "#184C86", "#04142E")
DENSITY_DOWN = ("#F0AC7C", "#D8661E", "#8F3A08", "#2E1003")
DENSITY_BENEATH = ("#C8C8C8", "#BEBEBE", "#B3B3B3", "#A8A8A8")
SIGNS = ("#0A2A52", BLUE, "#F7F7F7", VERMILLION, "#571C00")
SIZES = "viridis"

# The linear stability limit.
LIMIT = BLACK
DASHES: Any = (0, (4.0, 1.5))
# Unstable orbits.
UNSTABLE: Any = (0, (3.2, 1.6))

# Labels of the state's axes: in time, and at the points of a section.
STATE = {
    "angle": r"angle $\theta$  [rad]",
    "velocity": r"velocity $\dot\theta$  [rad/s]",
}
SECTION = {
    "angle": r"angle $\theta_n$  [rad]",
    "velocity": r"velocity $\dot\theta_n$  [rad/s]",
}
# Words where a dataset has a formula instead.
MEANINGS = {
    "eta": "slope of the actuation force",
    "f": "forcing frequency",
    "F0": "initial actuation force",
    "alpha": "relative wedge angle",
    "peak_torque": "brake torque",
    "return_distance": "return distance",
}
# Symbols in mathtext, by the name of a parameter, group or result in a dataset.
SYMBOLS = {
    "eta": r"\eta",
    "f": "f",
    "F0": "F_0",
    "alpha": r"\alpha",
    "loss_factor": r"c/\sqrt{kJ}",
    "static_ratio": r"\mu_s/\mu_k",
    "drive": r"\Omega\sqrt{kJ}/T_e",
    "inertia": "J",
    "damping": "c",
    "stiffness": "k",
    "drive_speed": r"\Omega",
    "radius": "R",
    "brake_angle": r"\alpha_w",
    "wrap_angle": r"\beta",
    "actuation_arm": "a",
    "normal_arm": "b",
    "friction_arm": "d",
    "kinetic": r"\mu_k",
    "static": r"\mu_s",
    "decay": r"\varsigma",
    "steepness": r"\xi",
    "width": "v_0",
    "initial_force": "F_{a0}",
    "slope": r"\delta",
    "amplitude": "T_e",
    "frequency": "f_e",
    "initial_angle": r"\theta(0)",
    "initial_velocity": r"\dot\theta(0)",
    "angle": r"\theta",
    "velocity": r"\dot\theta",
    "brake_torque": r"RF_\mu",
    "drive_torque": "T",
    "largest_exponent": r"\lambda_1",
    "second_exponent": r"\lambda_2",
    "peak_torque": r"\max\,|RF_\mu|",
}

# Widths of a journal's single and double column, 89 and 183 mm, in inches.
COLUMN = 3.5
PAGE = 7.2

# Sizes of type [pt].
LABELS = 7.5
TICKS = 7.0
SMALL = 6.5

# Lines and points beyond this number are drawn as pixels inside vector files.
RASTER_FROM = 20_000

_RC: Any = {
    "font.family": "sans-serif",
    "font.sans-serif": ["DejaVu Sans"],  # comes with Matplotlib: the same everywhere
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
    """Draw in this style inside the block; outside, Matplotlib's settings stay untouched."""
    import matplotlib as mpl

    with mpl.rc_context():
        mpl.rcdefaults()
        mpl.rcParams.update(WRITTEN)
        yield


def new_figure(width: float = COLUMN, height: float | None = None) -> Figure:
    """An empty figure of a width and height [inch], without pyplot."""
    from wedgebrake.figures.matplotlib.figure import Picture

    figure = Picture(figsize=(width, 0.75 * width if height is None else height))
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


def named(name: str, meaning: str, unit: str) -> str:
    """The label of an axis: meaning, symbol where there is a usual one, unit.

    Of a long meaning, what stands before its first comma, semicolon or bracket.
    """
    words = re.split(r"[,;]| \(", meaning)[0].strip()
    if not words or re.search(r"[_/=`]", words):
        words = MEANINGS.get(name, words or name.replace("_", " "))
    symbol = SYMBOLS.get(name)
    unit = unit.replace("^2", "²")
    return words + (f" ${symbol}$" if symbol else "") + f"  [{unit or '1'}]"


def short(name: str) -> str:
    """The symbol of a parameter for running text, or its name."""
    return f"${SYMBOLS[name]}$" if name in SYMBOLS else name.replace("_", " ")


def round_ticks(axis: Axis, low: float, high: float) -> None:
    """Labelled ticks at round numbers of a logarithmic axis from ``low`` to ``high``."""
    from matplotlib.ticker import FixedLocator, FuncFormatter, MaxNLocator, NullLocator

    first, last = math.floor(math.log10(low)), math.ceil(math.log10(high))
    decades = math.log10(high / low)
    steps = (1, 2, 5) if decades < 2.5 else (1,)
    stride = max(1, math.ceil(decades / 6.0)) if decades >= 2.5 else 1
    ticks = [m * 10.0**n for n in range(first, last + 1, stride) for m in steps]
    if sum(low <= tick <= high for tick in ticks) < 2:
        ticks = list(MaxNLocator(4, steps=[1, 2, 5, 10]).tick_values(low, high))
    axis.set_major_locator(FixedLocator([tick for tick in ticks if low <= tick <= high]))
    axis.set_minor_locator(NullLocator())
    axis.set_major_formatter(FuncFormatter(lambda value, _position: f"${number(value)}$"))


def ink(colour: Any) -> str:
    """Black or white, whichever is easier to read on a colour (relative luminance, WCAG 2)."""
    from matplotlib.colors import to_rgb

    linear = [c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4 for c in to_rgb(colour)]
    luminance = 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]
    return "black" if luminance > 0.18 else "white"


def percent(share: float) -> str:
    """A share in percent; never 0 for what is there, never 100 for less than all."""
    if 0.0 < share < 0.001:
        return "<0.1 %"
    if 0.995 <= share < 1.0:
        return f"{math.floor(1000.0 * share) / 10.0:.1f} %"
    return f"{100.0 * share:.1f} %" if share < 0.1 else f"{100.0 * share:.0f} %"


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
