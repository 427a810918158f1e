"""The style of Matplotlib pictures: the common style, its settings, and elements of all axes."""

from __future__ import annotations

import math
import threading
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import numpy as np

from wedgebrake.errors import nearest
from wedgebrake.figures.data.axes import round_values_log
from wedgebrake.figures.data.limits import thinned
from wedgebrake.figures.style import *  # noqa: F403 - extended here
from wedgebrake.figures.style import GREY, LABELS, MOST_ACROSS, RASTER_FROM, SMALL, TICKS, number
from wedgebrake.model.validation import wrong

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.axis import Axis

# Sizes of type [pt], in proportion to that of the font.
_SIZES = {
    "axes.labelsize": LABELS,
    "xtick.labelsize": TICKS,
    "ytick.labelsize": TICKS,
    "legend.fontsize": SMALL,
    "figure.titlesize": LABELS,
}
# Width for the label of a tick [inch].
_TICK = 0.4
# Settings of files: TrueType fonts.
_FILES = {"pdf.fonttype": 42, "ps.fonttype": 42}
_RC: Any = {
    "font.family": "sans-serif",
    "font.sans-serif": ["DejaVu Sans"],  # part of Matplotlib: the same everywhere
    "mathtext.fontset": "dejavusans",
    "font.size": LABELS,
    **_SIZES,
    "figure.facecolor": "white",
    "axes.facecolor": "white",
    "axes.linewidth": 0.6,
    "axes.formatter.limits": (-3, 4),
    "axes.formatter.use_mathtext": True,
    "axes.axisbelow": True,
    "xtick.direction": "in",
    "xtick.major.pad": 4.7,  # more than half the height of a label: both may be in one corner
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


@dataclass(frozen=True)
class Look:
    """How pictures are drawn.

    settings : of Matplotlib
    axes     : the user's, in which the picture is drawn; () for a new figure
    """

    settings: Any
    axes: tuple[Axes, ...] = ()

    @property
    def painted(self) -> Any:
        """The settings while a figure is drawn, without those of files."""
        return {key: value for key, value in self.settings.items() if key not in _FILES}


_OWN = Look(MappingProxyType({**_RC, **_FILES}))
_LOOK: ContextVar[Look] = ContextVar("look", default=_OWN)


def look() -> Look:
    """How pictures are drawn now."""
    return _LOOK.get()


_DRAWING = threading.RLock()


@contextmanager
def use() -> Iterator[None]:
    """Draw in the present look inside the block; Matplotlib's own settings are restored after it.

    Axes of the user are drawn with the current settings of Matplotlib, changed by those of the
    look. One thread draws at a time: Matplotlib's settings and its parser of formulas are shared.
    """
    import matplotlib as mpl

    with _DRAWING, mpl.rc_context():
        if not look().axes:
            mpl.rcdefaults()
        mpl.rcParams.update(look().settings)
        yield


@contextmanager
def drawn(style: Any, axes: tuple[Axes, ...]) -> Iterator[None]:
    """Draw pictures inside the block in a Matplotlib style, and in axes of the user, if any.

    style : as for ``matplotlib.style.use``, or None for no changes

    Raises ``InputError`` for a style that Matplotlib does not accept.
    """
    token = _LOOK.set(Look({} if axes else look().settings, axes))
    try:
        if style is not None:
            _LOOK.set(Look({**look().settings, **_changes(style)}, axes))
        yield
    finally:
        _LOOK.reset(token)


def _changes(style: Any) -> Any:
    """The settings that a Matplotlib style changes. Sizes of type follow that of its font."""
    import matplotlib as mpl
    from matplotlib.style import available
    from matplotlib.style import use as use_style

    stated = dict(dict.items(style)) if isinstance(style, dict) else {}
    with use():
        # Plain items: reading the backend of ``rcParams`` would choose one.
        settings: Any = mpl.rcParams
        before = dict(dict.items(settings))
        try:
            with warnings.catch_warnings():
                warnings.filterwarnings("ignore", "Style includes a parameter")
                use_style(stated or style)  # ``style`` may be ``rcParams``, which ``use`` changes
        except (OSError, KeyError, TypeError, ValueError) as error:
            allowed = "the name of a Matplotlib style, a dict of its rcParams, or a list of these"
            named = isinstance(style, str)
            why = nearest(style, [*available, "default"]) if named else str(error).strip("'\"")
            raise wrong("style", style, allowed, why) from None
        changes = {key: value for key, value in dict.items(settings) if value != before[key]}
        if not look().axes:
            known = {*changes, *stated}
            changes |= {key: points(size) for key, size in _SIZES.items() if key not in known}
    return changes


def points(size: float) -> float:
    """A size in proportion to that of the font, which is ``LABELS`` in the style of wedgebrake."""
    import matplotlib as mpl

    return size * float(mpl.rcParams["font.size"]) / LABELS


def show_message(axes: Axes, words: str) -> None:
    """Write a sentence in the middle of axes that have nothing to show."""
    middle: Any = {"ha": "center", "va": "center", "color": GREY, "wrap": True}
    axes.text(0.5, 0.5, words, transform=axes.transAxes, **middle)
    axes.set_xticks([])
    axes.set_yticks([])


def few_ticks(axes: Axes, x: int = 5, y: int = 6) -> None:
    """Set about ``x`` and ``y`` round ticks on linear axes, fewer where labels would touch."""
    import matplotlib as mpl
    from matplotlib.ticker import MaxNLocator, ScalarFormatter

    from wedgebrake.figures.matplotlib.tick_labels import PlainNumbers

    plain = not (look().axes or mpl.rcParams["text.usetex"])
    room = int(inches_wide(axes) / points(_TICK))
    for axis, count, least in (
        (axes.xaxis, min(x, room), 3 if room > x else 2),
        (axes.yaxis, y, 3),
    ):
        if axis.get_scale() == "linear":
            locator = MaxNLocator(max(count, 1), steps=[1, 2, 5, 10], min_n_ticks=least)
            axis.set_major_locator(locator)
            if plain and type(axis.get_major_formatter()) is ScalarFormatter:
                axis.set_major_formatter(PlainNumbers())


def letter(axes: Axes, word: str) -> None:
    """Write the letter of a panel above its upper left corner."""
    bold = {"ha": "right", "va": "bottom", "fontsize": points(9.0), "fontweight": "bold"}
    write_above(axes, word, 0.0, (-20.0, 5.0), **bold)


def write_above(
    axes: Axes, words: str, x: float, shift: tuple[float, float], where: Any = None, **more: Any
) -> None:
    """Write small words above axes, where those of the user have their title: not above these."""
    if not look().axes:
        write(axes, words, (x, 1.0), shift, where or "axes fraction", **more)


def write(
    axes: Axes,
    words: str,
    at: tuple[float, float],
    shift: tuple[float, float] = (0.0, 0.0),
    where: Any = "axes fraction",
    **more: Any,
) -> Any:
    """Write small words at a point of the axes, by default in axes fractions, shifted [pt]."""
    place = {"xytext": shift, "xycoords": where, "textcoords": "offset points"}
    return axes.annotate(words, at, **{**place, "fontsize": points(SMALL), **more})


def round_ticks(axis: Axis, low: float, high: float) -> None:
    """Set labelled ticks at round numbers of a logarithmic axis from ``low`` to ``high``."""
    from matplotlib.ticker import FixedLocator, FuncFormatter, NullLocator

    ticks = [tick for tick in round_values_log(low, high, 7) if low <= tick <= high]
    axis.set_major_locator(FixedLocator(ticks))
    axis.set_minor_locator(NullLocator())
    axis.set_major_formatter(FuncFormatter(lambda value, _position: number(value)))


def plot_line(axes: Axes, x: Any, y: Any, **more: Any) -> None:
    """Draw a line; one of very many points as pixels inside vector files.

    Of a curve over ascending ``x`` with more points than pixels, the envelope is drawn: the
    smallest and the largest value in each column of pixels.
    """
    if len(x) > MOST_ACROSS and np.all(np.diff(x) > 0.0):
        shown = thinned(y, MOST_ACROSS)
        x, y = x[shown], y[shown]
    axes.plot(x, y, rasterized=len(x) > RASTER_FROM, **more)


def plot_points(axes: Axes, x: Any, y: Any, markersize: float, **more: Any) -> list[Any]:
    """Draw round points of a size [pt]; very many as pixels inside vector files."""
    dots = {"linestyle": "none", "marker": "o", "markersize": markersize, "markeredgewidth": 0.0}
    return axes.plot(x, y, **{"rasterized": len(x) > RASTER_FROM, **dots, **more})


def shade(axes: Axes, start: Any, end: Any, colour: str, alpha: float, label: str = "") -> Any:
    """Shade intervals across the whole height of axes."""
    spans = list(zip(start, end - start, strict=True))
    fill: Any = {"facecolor": colour, "edgecolor": "none", "alpha": alpha, "zorder": 1}
    across = axes.get_xaxis_transform()
    return axes.broken_barh(spans, (0.0, 1.0), transform=across, label=label, **fill)


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
    """Add a legend in one row above the axes, at the right; to axes of the user, inside."""
    if handles and look().axes:
        axes.legend(handles=handles)
    elif handles:
        axes.legend(handles=handles, loc="lower right", bbox_to_anchor=(1.0, 1.02), ncols=columns)


def inches_wide(axes: Axes) -> float:
    """Approximate width of axes [inch]."""
    figure: Any = axes.figure
    return float(axes.get_window_extent().width / figure.dpi)
