"""The phase portrait: velocity against angle."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from wedgebrake.figures.data import caption
from wedgebrake.figures.data.limits import extent
from wedgebrake.figures.data.phase import Phase
from wedgebrake.figures.matplotlib import style
from wedgebrake.figures.matplotlib.layout import write_caption
from wedgebrake.model.system import BrakedDriveline

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

# Width of a stick's line and of its points [pt].
_STICK = 2.4


def phase(system: BrakedDriveline, response: xr.Dataset, start: float | None = None) -> Figure:
    """Phase portrait, velocity [rad/s] against angle [rad]: a new figure.

    Shows the switching line theta' = -drive_speed, where the brake may stick, the speeds
    beyond which it is released, and the sticks (points, as the angle rests; lines with a
    turning shaft).

    start : beginning of the time span [s]; default the last fifth of the response

    Raises ``InputError`` for a dataset that is no response or a start outside it.
    """
    with style.use():
        figure = style.new_figure()
        draw(figure.add_subplot(), system, response, start)
        write_caption(figure, caption.of_response(response))
        return figure


def draw(
    axes: Axes, system: BrakedDriveline, response: xr.Dataset, start: float | None = None
) -> None:
    """Draw the same on existing axes."""
    data = Phase.of(system, response, start)
    angle, velocity = data.history.angle, data.history.velocity
    axes.set_xlabel(style.STATE["angle"])
    axes.set_ylabel(style.STATE["velocity"])
    if not angle.size:
        style.say(axes, "no samples in this time span")
        return
    width = float(np.clip(0.9 * (1000.0 / angle.size) ** 0.35, 0.25, 0.9))
    style.plot_line(axes, angle, velocity, color=style.MOTION, linewidth=width, zorder=2)
    axes.set_xlim(*style.margins(*extent(angle), data.least[0]))
    motion = style.margins(*extent(velocity), data.least[1])
    reach = data.reaching(*motion)
    axes.set_ylim(*(motion if reach == motion else style.margins(*reach, 0.0)))
    handles = _draw_sticks(axes, data)
    handles += _draw_levels(axes, data)
    style.few_ticks(axes)
    style.legend_above(axes, handles)


def _draw_levels(axes: Axes, data: Phase) -> list[Any]:
    """Draw the switching line and the release speeds inside the picture."""
    low, high = axes.get_ylim()
    name = r"$\dot\theta=-\Omega$" if data.drive_speed else r"$\dot\theta=0$"
    handles: list[Any] = []
    for speeds, colour, dashes, label in (
        ((data.switching,), style.SWITCHING, (0, ()), name),
        (data.releases, style.RELEASE, (0, (5, 2)), "release"),
    ):
        lines = [
            axes.axhline(
                speed, color=colour, linewidth=0.6, linestyle=dashes, zorder=1.5, label=label
            )
            for speed in speeds
            if low <= speed <= high
        ]
        handles += lines[:1]
    return handles


def _draw_sticks(axes: Axes, data: Phase) -> list[Any]:
    """Draw the sticks, thick, between the angles where they begin and end."""
    from matplotlib.collections import LineCollection

    handles: list[Any] = []
    for side, sticks in data.history.sticks.by_side().items():
        colour, label = style.STICKS[side]
        ends = data.segments(sticks)
        lines = list(np.stack((ends.angle.T, ends.velocity.T), axis=-1))
        axes.add_collection(
            LineCollection(lines, colors=colour, linewidths=_STICK, zorder=3), autolim=False
        )
        # A stick is a point unless the shaft turns; a line of no length would not be drawn.
        handles += style.plot_points(
            axes,
            ends.angle.ravel(),
            ends.velocity.ravel(),
            _STICK,
            color=colour,
            label=label,
            zorder=3,
        )
    return handles
