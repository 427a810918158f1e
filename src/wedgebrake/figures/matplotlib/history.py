"""Velocity and torque against time, with the sticks shaded."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from wedgebrake.analysis.spectrum import frequencies
from wedgebrake.analysis.sticking import span, sticks
from wedgebrake.errors import InputError
from wedgebrake.figures.data import caption
from wedgebrake.figures.matplotlib import style
from wedgebrake.figures.matplotlib.layout import write_caption

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

# Motion that grows this many times beyond its median is shown on a logarithmic scale.
_RUNAWAY = 1e3


def history(response: xr.Dataset, periods: float | None = 12.0, *, torque: bool = True) -> Figure:
    """Velocity [rad/s] and drive torque [N m] against time [s]: a new figure.

    response : as ``simulate`` gives it
    periods  : how many torque periods, the last ones; None: all
    torque   : whether to draw the drive torque, on an axis of its own at the right

    Raises ``InputError`` for a dataset that is no response, or periods not above 0.
    """
    with style.use():
        figure = style.new_figure(style.PAGE, 2.6)
        draw(figure.add_subplot(), response, periods, torque=torque)
        write_caption(figure, caption.of_response(response))
        return figure


def draw(
    axes: Axes, response: xr.Dataset, periods: float | None = 12.0, *, torque: bool = True
) -> None:
    """The same on axes of your own."""
    low, high = window(response, periods)
    times = response["time"].to_numpy()
    shown = (times >= low) & (times <= high)
    times, velocity = times[shown], response["velocity"].to_numpy()[shown]
    axes.set_xlabel("time $t$  [s]")
    axes.set_ylabel(style.STATE["velocity"], color=style.MOTION)
    if not times.size:
        style.say(axes, "no samples in this time span")
        return
    largest = float(np.max(np.abs(velocity)))
    runaway = largest > _RUNAWAY * max(float(np.median(np.abs(velocity))), 1e-300)
    grown = runaway and response.attrs.get("status") == "diverged"
    if grown:
        _logarithmic(axes, velocity, largest)
    else:
        axes.set_ylim(*style.margins(-largest, largest, 0.0))
    handles = _shade_sticks(axes, response, low, high)
    axes.axhline(0.0, color=style.GREY, linewidth=0.4, zorder=1.5)
    axes.plot(
        times,
        velocity,
        color=style.MOTION,
        zorder=3,
        rasterized=times.size > style.RASTER_FROM,
    )
    axes.set_xlim(*style.margins(low, high, 0.0, share=0.0))
    if torque and not grown:
        _draw_torque(axes, times, response["drive_torque"].to_numpy()[shown])
    style.few_ticks(axes, x=8)
    style.legend_above(axes, handles)


def window(response: xr.Dataset, periods: float | None) -> tuple[float, float]:
    """(first, last) time [s] of the last ``periods`` torque periods of a response."""
    begin, end = span(response)
    if periods is None:
        return begin, end
    if not isinstance(periods, int | float) or not periods > 0:
        raise InputError(f"periods = {periods!r}: must be a number above 0, or None for all.")
    forcing = frequencies(response).get("forcing_frequency", 0.0)
    return (max(begin, end - periods / forcing) if forcing > 0.0 else begin), end


def _logarithmic(axes: Axes, velocity: np.ndarray, largest: float) -> None:
    """A scale that is linear about 0 and logarithmic beyond, for motion that runs away."""
    from matplotlib.ticker import NullLocator

    moving = np.abs(velocity[velocity != 0.0])
    linear = max(float(np.min(moving)), 1e-6 * largest)
    linear = 10.0 ** np.ceil(np.log10(linear))
    axes.set_yscale("symlog", linthresh=linear, linscale=0.6)
    stride = max(1.0, np.ceil(np.log10(largest / linear) / 4.0))
    powers = linear * 10.0 ** np.arange(stride, 300.0, stride)
    axes.set_yticks([*-powers[powers < 10.0 * largest], 0.0, *powers[powers < 10.0 * largest]])
    axes.yaxis.set_minor_locator(NullLocator())
    low, high = float(np.min(velocity)), float(np.max(velocity))
    axes.set_ylim(3.0 * min(low, -linear), 3.0 * max(high, linear))
    axes.set_ylabel(style.STATE["velocity"] + f"\n(logarithmic beyond {linear:g})")


def _shade_sticks(axes: Axes, response: xr.Dataset, low: float, high: float) -> list[Any]:
    """Bands over the time of rest, by the side from which rest was entered."""
    found = sticks(response, low)
    handles: list[Any] = []
    for side, (colour, word) in style.STICKS.items():
        these = found["entry"].to_numpy() == side
        starts = np.maximum(found["start"].to_numpy()[these], low)
        lengths = np.minimum(found["end"].to_numpy()[these], high) - starts
        if starts.size:
            handles.append(
                axes.broken_barh(
                    list(zip(starts, lengths, strict=True)),
                    (0.0, 1.0),
                    transform=axes.get_xaxis_transform(),
                    facecolor=colour,
                    edgecolor="none",
                    alpha=0.4,
                    label=word,
                    zorder=1,
                )
            )
    return handles


def _draw_torque(axes: Axes, times: np.ndarray, torque: np.ndarray) -> None:
    """The drive torque as a thin line behind, its zero level with that of the velocity."""
    largest = float(np.max(np.abs(torque), initial=0.0))
    if largest == 0.0:
        return
    right = axes.twinx()
    right.set_zorder(axes.get_zorder() - 1)
    axes.patch.set_visible(False)  # or it would hide the torque behind it
    right.plot(times, torque, color=style.TORQUE, linewidth=0.6)
    # Lower than the velocity, which it shall not hide.
    right.set_ylim(-1.5 * largest, 1.5 * largest)
    right.set_ylabel("drive torque $T$  [N m]", color=style.TORQUE)
    right.tick_params(axis="y", colors=style.TORQUE, direction="out")
    style.few_ticks(right)
