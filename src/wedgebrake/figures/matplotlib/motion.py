"""Pictures of one response: history, phase portrait, Poincaré section, spectrum; all on a page."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

import numpy as np

from wedgebrake.analysis.responses.spectrum import is_driven
from wedgebrake.analysis.responses.spectrum import spectrum as spectrum_of
from wedgebrake.analysis.responses.sticking import span, steady_start
from wedgebrake.errors import InputError
from wedgebrake.figures.data import caption
from wedgebrake.figures.data.limits import extent
from wedgebrake.figures.data.motion import (
    History,
    PhaseCurve,
    PoincarePicture,
    SpectrumLines,
    last_periods,
    window,
    with_section,
)
from wedgebrake.figures.data.panels import Level
from wedgebrake.figures.data.parts import of_one_part
from wedgebrake.figures.data.time_panels import end_message
from wedgebrake.figures.matplotlib import style
from wedgebrake.figures.matplotlib.layout import captioned
from wedgebrake.model.signals.signals import as_signal

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from wedgebrake.model.machine import Machine
    from wedgebrake.model.system import BrakedDriveline

PERIODS = 12.0
"""Torque periods in the history."""

# Width of a stick's line and of its points in the phase plane [pt].
_STICK = 2.4
# Decades shown below the highest line of a spectrum.
_DECADES = 7.0
# A vibration fades if its last fifth is smaller than this share of it.
_FADED = 0.5


def history(
    response: xr.Dataset, periods: float | None = PERIODS, *, torque: bool = True
) -> Figure:
    """Velocity [rad/s] and drive torque [N m] against time [s]: a new figure.

    response : as returned by ``simulate``
    periods  : number of torque periods shown, the last ones; None: all
    torque   : whether to draw the drive torque, on an axis of its own at the right

    Raises ``InputError`` for a dataset that is not a response, or periods not above 0.
    """
    with _single(response, style.PAGE, 2.6) as figure:
        draw_history(figure.gca(), response, periods, torque=torque)
    return figure


def phase(
    system: BrakedDriveline | Machine, response: xr.Dataset, start: float | None = None
) -> Figure:
    """Phase portrait, velocity [rad/s] against angle [rad]: a new figure.

    Shows the switching line theta' = -drive_speed, where the brake may stick, the speeds
    beyond which it is released, and the sticks (points, as the angle rests; lines with a
    turning shaft).

    start : beginning of the time span [s]; default the last fifth of the response

    Raises ``InputError`` for a dataset that is not a response or a start outside it.
    """
    with _single(response) as figure:
        draw_phase(figure.gca(), system, response, start)
    return figure


def section(points: xr.Dataset, start: float | None = None) -> Figure:
    """Poincaré points, velocity [rad/s] against angle [rad]: a new figure.

    points : a response (its section at n / f_e) or the result of ``wb.poincare``
    start  : of a response: time of the first point [s]; default its last fifth

    The section of a response without a torque has the states at which the velocity crosses the
    middle of its range upwards.

    Raises ``InputError`` for a dataset that is neither.
    """
    with _single(points) as figure:
        draw_section(figure.gca(), points, start)
    return figure


def spectrum(lines: xr.Dataset, largest: float | None = None, *, hertz: bool = False) -> Figure:
    """Amplitude against frequency, logarithmic: a new figure.

    lines   : the result of ``wb.spectrum``
    largest : highest frequency shown [Hz]; default 4 times the larger of f_e and f_n
    hertz   : frequencies in Hz instead of f/f_n (also where there is no natural frequency)

    f_e is marked where a torque acts, f_n where there is stiffness.

    Raises ``InputError`` for a dataset that is not a spectrum.
    """
    with _single(lines) as figure:
        draw_spectrum(figure.gca(), lines, largest, hertz=hertz)
    return figure


def overview(
    system: BrakedDriveline | Machine,
    response: xr.Dataset,
    verdict: str = "",
    *,
    inertia: str | None = None,
    contact: str | None = None,
    start: float | None = None,
    stop: float | None = None,
) -> Figure:
    """History, phase portrait, Poincare section and spectrum of a response: a new figure.

    system, response : the system, and its response by ``simulate``
    verdict          : a sentence for the title, for example on stability
    inertia, contact : names of those shown; default: the only ones
    start, stop      : first and last time shown [s]. Default: the history has the last 12 periods
                       of the torque, the others the last fifth of the response; of a free
                       vibration, which no torque and no turning shaft sustains, all show all.

    Raises ``InputError`` for a dataset that is not a response or times outside it.
    """
    response = with_section(of_one_part(response, inertia, contact), response)
    chosen = start is not None or stop is not None
    if chosen:
        response = window(response, start, stop)
    whole = chosen or _is_free(system, response)
    periods = None if whole else PERIODS
    low = span(response)[0] if whole else steady_start(response)
    sentences = [*caption.of_response(response), _spans(response, low, periods)]
    ended = end_message(response)
    sentences += ["" if ended in verdict else ended, verdict]
    with captioned(style.PAGE, None, list(filter(None, sentences))) as figure:
        grid = figure.subplots(2, 2)
        draw_history(grid[0, 0], response, periods)
        draw_phase(grid[0, 1], system, response, low)
        draw_section(grid[1, 0], response, low)
        try:
            # The initial transient would appear as a broad floor between the lines.
            draw_spectrum(grid[1, 1], spectrum_of(response, start=low))
        except InputError:
            why = "no spectrum: fewer than two samples in\nthis time span, or not equally spaced"
            style.show_message(grid[1, 1], why)
        for word, axes in zip("abcd", grid.flat, strict=True):
            style.letter(axes, word)
    return figure


@contextmanager
def _single(
    dataset: xr.Dataset, width: float = style.COLUMN, height: float | None = None
) -> Iterator[Figure]:
    with captioned(width, height, caption.of_response(dataset)) as figure:
        figure.subplots()
        yield figure


def draw_history(
    axes: Axes, response: xr.Dataset, periods: float | None = PERIODS, *, torque: bool = True
) -> None:
    """Draw a history on existing axes."""
    data = History.last(response, periods)
    axes.set_xlabel("time $t$  [s]")
    axes.set_ylabel(style.STATE["velocity"], color=style.MOTION)
    if not data.time.size:
        style.show_message(axes, "no samples in this time span")
        return
    linear = data.linear_up_to
    low, high = extent(data.velocity)
    if linear is None:
        largest = max(-low, high)
        axes.set_ylim(*style.margins(-largest, largest, 0.0))
    else:
        limits = 3.0 * min(low, -linear), 3.0 * max(high, linear)
        style.logarithmic_beyond(axes, linear, limits, ticks=4)
        axes.set_ylabel(style.STATE["velocity"] + f"\n(logarithmic beyond {linear:g})")
    handles = []
    for side, sticks in data.sticks.by_side().items():
        colour, label = style.STICKS[side]
        handles.append(style.shade(axes, sticks.start, sticks.end, colour, 0.4, label))
    axes.axhline(0.0, color=style.GREY, linewidth=0.4, zorder=1.5)
    style.plot_line(axes, data.time, data.velocity, color=style.MOTION, zorder=3)
    axes.set_xlim(*style.margins(data.begin, data.end, 0.0, share=0.0))
    if torque and linear is None:
        _draw_torque(axes, data)
    style.few_ticks(axes, x=8)
    style.legend_above(axes, handles)


def _draw_torque(axes: Axes, data: History) -> None:
    """Draw the drive torque as a thin line behind, with its zero at that of the velocity."""
    largest = float(np.max(np.abs(data.drive_torque)))
    if largest == 0.0:
        return
    right = axes.twinx()
    right.set_zorder(axes.get_zorder() - 1)
    axes.patch.set_visible(False)  # it would hide the torque behind it
    style.plot_line(right, data.time, data.drive_torque, color=style.TORQUE, linewidth=0.6)
    # Smaller than the velocity, which stays visible.
    right.set_ylim(-1.5 * largest, 1.5 * largest)
    right.set_ylabel("drive torque $T$  [N m]", color=style.TORQUE)
    right.tick_params(axis="y", colors=style.TORQUE, direction="out")
    style.few_ticks(right)


def draw_phase(
    axes: Axes, system: BrakedDriveline | Machine, response: xr.Dataset, start: float | None = None
) -> None:
    """Draw a phase portrait on existing axes."""
    data = PhaseCurve.of(system, response, start)
    angle, velocity = data.history.angle, data.history.velocity
    axes.set_xlabel(style.STATE["angle"])
    axes.set_ylabel(style.STATE["velocity"])
    if not angle.size:
        style.show_message(axes, "no samples in this time span")
        return
    width = float(np.clip(0.9 * (1000.0 / angle.size) ** 0.35, 0.25, 0.9))
    style.plot_line(axes, angle, velocity, color=style.MOTION, linewidth=width, zorder=2)
    axes.set_xlim(*style.margins(*extent(angle), data.least[0]))
    motion = style.margins(*extent(velocity), data.least[1])
    reach = data.reaching(*motion)
    low, high = motion if reach == motion else style.margins(*reach, 0.0)
    axes.set_ylim(low, high)
    handles = _draw_sticks(axes, data)
    visible = [level for level in data.levels if low <= level.value <= high]
    lines = _draw_levels(axes.axhline, visible, linewidth=0.6, zorder=1.5)
    handles += {line.get_label(): line for line in lines}.values()
    style.few_ticks(axes)
    style.legend_above(axes, handles)


def _draw_sticks(axes: Axes, data: PhaseCurve) -> list[Any]:
    """Draw the sticks, thick, with points where they begin and end."""
    from matplotlib.collections import LineCollection

    handles: list[Any] = []
    for side, sticks in data.history.sticks.by_side().items():
        look: Any = {"color": style.STICKS[side][0], "zorder": 3}
        lines = [np.column_stack(path) for path in data.paths(sticks)]
        axes.add_collection(LineCollection(lines, linewidths=_STICK, **look), autolim=False)
        # A stick is a point unless the shaft turns; a line of no length would not be drawn.
        look["label"] = style.STICKS[side][1]
        angle, velocity = np.concatenate([line[[0, -1]] for line in lines]).T
        handles += style.plot_points(axes, angle, velocity, _STICK, **look)
    return handles


def _draw_levels(line: Any, levels: Sequence[Level], unit: float = 1.0, **look: Any) -> list[Any]:
    """Draw each level by ``axhline`` or ``axvline``, in a unit."""
    return [
        line(
            level.value / unit,
            color=level.colour,
            linestyle=(0, level.dashes),
            label=level.label,
            **look,
        )
        for level in levels
    ]


def draw_section(axes: Axes, points: xr.Dataset, start: float | None = None) -> None:
    """Draw a Poincaré section on existing axes."""
    data = PoincarePicture.of(points, start)
    axes.set_xlabel(style.SECTION["angle"])
    axes.set_ylabel(style.SECTION["velocity"])
    if not data.angle.size:
        style.show_message(axes, "no section in this time span")
        return
    axes.set_xlim(*style.margins(*extent(data.angle), data.least[0], share=0.1))
    axes.set_ylim(*style.margins(*extent(data.velocity), data.least[1], share=0.1))
    # More points are smaller [pt], so that they stay apart.
    size = float(np.clip(4.0 * (30.0 / data.angle.size) ** 0.4, 0.5, 4.0))
    style.plot_points(axes, data.angle, data.velocity, size, color=style.MOTION)
    style.few_ticks(axes)
    first, last, count = data.number[0], data.number[-1], data.number.size
    words = f"{count} points, $n$ = {first} to {last}" if count > 1 else f"1 point, $n$ = {first}"
    if data.crossed is not None:
        crossings = "1 upward crossing" if count == 1 else f"{count} upward crossings"
        words = f"{crossings} of {style.number(data.crossed)} rad/s"
    style.write_above(axes, words, 1.0, (0.0, 2.5), ha="right", va="bottom")


def draw_spectrum(
    axes: Axes, lines: xr.Dataset, largest: float | None = None, *, hertz: bool = False
) -> None:
    """Draw a spectrum on existing axes."""
    data = SpectrumLines.of(lines, largest)
    unit = 1.0 if hertz or data.natural == 0.0 else data.natural
    axes.set_xlabel("frequency $f$  [Hz]" if unit == 1.0 else "frequency $f/f_n$  [1]")
    axes.set_ylabel(f"amplitude of {style.symbol(data.quantity)}  [{data.unit}]")
    if data.top == 0.0:
        style.show_message(axes, "no motion in this time span")
        return
    floor = data.top * 10.0**-_DECADES
    low = max(floor, float(np.min(data.amplitude[data.amplitude > 0.0])))
    axes.set_yscale("log")
    axes.set_xlim(0.0, data.highest / unit)
    axes.set_ylim(0.5 * min(low, 0.1 * data.top), 3.0 * data.top)
    amplitude, look = np.maximum(data.amplitude, 1e-3 * floor), {"linewidth": 0.7, "zorder": 3}
    style.plot_line(axes, data.frequency / unit, amplitude, color=style.MOTION, **look)
    style.few_ticks(axes)
    marked = [level for level in data.levels if level.value > 0.0]
    handles = _draw_levels(axes.axvline, marked, unit, linewidth=0.9, zorder=2)
    style.legend_above(axes, handles)


def _is_free(system: BrakedDriveline | Machine, response: xr.Dataset) -> bool:
    if is_driven(response):
        return False
    if not any(as_signal(one.base_speed).bound for one in system.machine.contacts):
        return True
    velocity = response["velocity"].to_numpy()
    late = velocity[response["time"].to_numpy() >= steady_start(response)]
    return not late.size or bool(np.ptp(late) <= _FADED * np.ptp(velocity))


def _spans(response: xr.Dataset, low: float, periods: float | None) -> str:
    begin, end = span(response)
    seen, _ = last_periods(response, periods)
    times = [style.time_text(time, end - begin) for time in (begin, end, seen, low)]
    parts = "" if seen == low == begin else f"; a: from {times[2]} s; b, c, d: from {times[3]} s"
    return f"{times[0]} to {times[1]} s{parts}"
