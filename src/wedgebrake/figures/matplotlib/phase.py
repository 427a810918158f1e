"""The phase portrait: velocity against angle."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from wedgebrake.analysis.sticking import steady_start, sticks
from wedgebrake.figures.data import caption
from wedgebrake.figures.matplotlib import style
from wedgebrake.figures.matplotlib.layout import write_caption
from wedgebrake.model.system import BrakedDriveline

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

# The picture may be this many times as high as the motion, to show the switching line.
_FARTHEST = 3.0


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
    """The same on axes of your own."""
    low = steady_start(response) if start is None else start
    found = sticks(response, low)
    times = response["time"].to_numpy()
    shown = times >= low
    angle = response["angle"].to_numpy()[shown]
    velocity = response["velocity"].to_numpy()[shown]
    axes.set_xlabel(style.STATE["angle"])
    axes.set_ylabel(style.STATE["velocity"])
    if not angle.size:
        style.say(axes, "no samples in this time span")
        return
    everything = response["angle"].to_numpy(), response["velocity"].to_numpy()
    limits = [
        style.margins(float(np.min(part)), float(np.max(part)), 0.05 * float(np.ptp(whole)))
        for part, whole in zip((angle, velocity), everything, strict=True)
    ]
    axes.plot(
        angle,
        velocity,
        color=style.MOTION,
        linewidth=_thin(angle.size),
        zorder=2,
        rasterized=angle.size > style.RASTER_FROM,
    )
    axes.set_xlim(*limits[0])
    axes.set_ylim(*limits[1])
    _reach(axes, -system.driveline.drive_speed)
    handles = _draw_sticks(axes, response, found)
    handles += _draw_lines(axes, system)
    style.few_ticks(axes)
    style.legend_above(axes, handles)


def _thin(samples: int) -> float:
    """Width of a line: thinner for more turns, so that they stay apart."""
    return float(np.clip(0.9 * (1000.0 / max(samples, 1)) ** 0.35, 0.25, 0.9))


def _reach(axes: Axes, speed: float) -> None:
    """Widen the picture to the switching line, unless the motion would become too small."""
    low, high = axes.get_ylim()
    reach = min(low, speed), max(high, speed)
    if reach[1] - reach[0] <= _FARTHEST * (high - low):
        wide = style.margins(*reach, 0.0)
        axes.set_ylim(wide if reach != (low, high) else reach)


def _draw_lines(axes: Axes, system: BrakedDriveline) -> list[Any]:
    """Switching line and release speeds, those inside the picture."""
    drive = system.driveline.drive_speed
    release = system.actuation.release_speed
    low, high = axes.get_ylim()
    handles: list[Any] = []
    name = r"$\dot\theta=-\Omega$" if drive else r"$\dot\theta=0$"
    for speed, colour, dashes, word in (
        (-drive, style.SWITCHING, (0, ()), name),
        (release - drive, style.RELEASE, (0, (5, 2)), "release"),
        (-release - drive, style.RELEASE, (0, (5, 2)), "release"),
    ):
        if low <= speed <= high:
            line = axes.axhline(
                speed, color=colour, linewidth=0.6, linestyle=dashes, zorder=1.5, label=word
            )
            # Of the two speeds of release one may lie outside: the first inside is named.
            if word not in [handle.get_label() for handle in handles]:
                handles.append(line)
    return handles


def _draw_sticks(axes: Axes, response: xr.Dataset, found: xr.Dataset) -> list[Any]:
    """The sticks, thick, between the angles where they begin and end."""
    from matplotlib.collections import LineCollection

    times, angles = response["time"].to_numpy(), response["angle"].to_numpy()
    velocities = response["velocity"].to_numpy()
    limits = max(found.attrs["window_start"], float(times[0])), float(times[-1])
    ends = [np.clip(found[name].to_numpy(), *limits) for name in ("start", "end")]
    x = np.array([np.interp(end, times, angles) for end in ends])
    y = np.array([np.interp(end, times, velocities) for end in ends])
    width = 2.4
    handles: list[Any] = []
    for side, (colour, word) in style.STICKS.items():
        these = found["entry"].to_numpy() == side
        if not np.any(these):
            continue
        segments = list(np.stack((x[:, these].T, y[:, these].T), axis=-1))
        axes.add_collection(
            LineCollection(segments, colors=colour, linewidths=width, zorder=3), autolim=False
        )
        # A rest is a point unless the shaft turns; a line of no length would not be drawn.
        handles += axes.plot(
            x[:, these].ravel(),
            y[:, these].ravel(),
            linestyle="none",
            marker="o",
            markersize=width,
            markeredgewidth=0.0,
            color=colour,
            label=word,
            zorder=3,
            rasterized=len(segments) > style.RASTER_FROM,
        )
    return handles
