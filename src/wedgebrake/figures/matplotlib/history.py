"""Velocity and torque against time, with the sticks shaded."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from wedgebrake.figures.data import caption
from wedgebrake.figures.data.history import History
from wedgebrake.figures.matplotlib import style
from wedgebrake.figures.matplotlib.layout import write_caption

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


def history(response: xr.Dataset, periods: float | None = 12.0, *, torque: bool = True) -> Figure:
    """Velocity [rad/s] and drive torque [N m] against time [s]: a new figure.

    response : as ``simulate`` gives it
    periods  : number of torque periods shown, the last ones; None: all
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
    """Draw the same on existing axes."""
    data = History.last(response, periods)
    axes.set_xlabel("time $t$  [s]")
    axes.set_ylabel(style.STATE["velocity"], color=style.MOTION)
    if not data.time.size:
        style.say(axes, "no samples in this time span")
        return
    linear = data.linear_up_to
    low, high = float(np.min(data.velocity)), float(np.max(data.velocity))
    if linear is None:
        largest = max(-low, high)
        axes.set_ylim(*style.margins(-largest, largest, 0.0))
    else:
        limits = 3.0 * min(low, -linear), 3.0 * max(high, linear)
        style.logarithmic_beyond(axes, linear, limits, ticks=4)
        axes.set_ylabel(style.STATE["velocity"] + f"\n(logarithmic beyond {linear:g})")
    handles = _shade_sticks(axes, data)
    axes.axhline(0.0, color=style.GREY, linewidth=0.4, zorder=1.5)
    style.plot_line(axes, data.time, data.velocity, color=style.MOTION, zorder=3)
    axes.set_xlim(*style.margins(data.begin, data.end, 0.0, share=0.0))
    if torque and linear is None:
        _draw_torque(axes, data)
    style.few_ticks(axes, x=8)
    style.legend_above(axes, handles)


def _shade_sticks(axes: Axes, data: History) -> list[Any]:
    """Shade the sticks by the side from which they are entered."""
    handles: list[Any] = []
    for side, sticks in data.sticks.by_side().items():
        colour, label = style.STICKS[side]
        handles.append(
            axes.broken_barh(
                list(zip(sticks.start, sticks.end - sticks.start, strict=True)),
                (0.0, 1.0),
                transform=axes.get_xaxis_transform(),
                facecolor=colour,
                edgecolor="none",
                alpha=0.4,
                label=label,
                zorder=1,
            )
        )
    return handles


def _draw_torque(axes: Axes, data: History) -> None:
    """Draw the drive torque as a thin line behind, its zero at the height of the velocity's."""
    largest = float(np.max(np.abs(data.drive_torque)))
    if largest == 0.0:
        return
    right = axes.twinx()
    right.set_zorder(axes.get_zorder() - 1)
    axes.patch.set_visible(False)  # it would hide the torque behind it
    right.plot(data.time, data.drive_torque, color=style.TORQUE, linewidth=0.6)
    # Not as high as the velocity, which stays visible.
    right.set_ylim(-1.5 * largest, 1.5 * largest)
    right.set_ylabel("drive torque $T$  [N m]", color=style.TORQUE)
    right.tick_params(axis="y", colors=style.TORQUE, direction="out")
    style.few_ticks(right)
