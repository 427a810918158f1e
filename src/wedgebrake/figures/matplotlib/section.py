"""The Poincare section: the state once in every period of the torque."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from wedgebrake.analysis.spectrum import frequencies, is_driven
from wedgebrake.analysis.sticking import steady_start
from wedgebrake.errors import InputError
from wedgebrake.figures.data import caption
from wedgebrake.figures.matplotlib import style
from wedgebrake.figures.matplotlib.layout import write_caption

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

# The picture shows at least this share of the motion, or rounding would look like scatter.
_LEAST = 0.05


def section(points: xr.Dataset, start: float | None = None) -> Figure:
    """Poincare points, velocity [rad/s] against angle [rad]: a new figure.

    points : a response (its section at n / f_e) or what ``wb.poincare`` gives
    start  : of a response: time of the first point [s]; default its last fifth

    Where no torque acts, the picture says at which period the points are taken all the same:
    they then show where the motion passes, not whether it repeats.

    Raises ``InputError`` for a dataset that is neither.
    """
    with style.use():
        figure = style.new_figure()
        draw(figure.add_subplot(), points, start)
        write_caption(figure, caption.of_response(points))
        return figure


def draw(axes: Axes, points: xr.Dataset, start: float | None = None) -> None:
    """The same on axes of your own."""
    angle, velocity, numbers, least = _points(points, start)
    axes.set_xlabel(style.SECTION["angle"])
    axes.set_ylabel(style.SECTION["velocity"])
    if not angle.size:
        style.say(axes, "no section in this time span")
        return
    for values, room, limit in (
        (angle, least[0], axes.set_xlim),
        (velocity, least[1], axes.set_ylim),
    ):
        limit(*style.margins(float(np.min(values)), float(np.max(values)), room, share=0.1))
    axes.plot(
        angle,
        velocity,
        linestyle="none",
        marker="o",
        markersize=_size(angle.size),
        markeredgewidth=0.0,
        color=style.MOTION,
        rasterized=angle.size > style.RASTER_FROM,
    )
    style.few_ticks(axes)
    words = (
        f"{numbers.size} points, $n$ = {numbers[0]} to {numbers[-1]}"
        if numbers.size > 1
        else f"1 point, $n$ = {numbers[0]}"
    )
    axes.annotate(
        words if is_driven(points) else f"{_absent(points)}\n{words}",
        (1.0, 1.02),
        xycoords="axes fraction",
        ha="right",
        va="bottom",
        fontsize=style.SMALL,
    )


def _absent(points: xr.Dataset) -> str:
    """What the section is, where no torque acts."""
    period = 1.0 / frequencies(points)["forcing_frequency"]
    return f"no torque acts; points once in the period stated for it, ${style.number(period)}$ s"


def _size(count: int) -> float:
    """Size of a point [pt]: smaller for more of them, so that they stay apart."""
    return float(np.clip(4.0 * (30.0 / max(count, 1)) ** 0.4, 0.5, 4.0))


def _points(
    points: xr.Dataset, start: float | None
) -> tuple[np.ndarray, np.ndarray, np.ndarray, tuple[float, float]]:
    """Angle, velocity and number of the points, and the least width and height of the picture."""
    names = getattr(points, "data_vars", {})
    if "poincare_angle" in names:
        low = steady_start(points) if start is None else start
        shown = points["poincare_time"].to_numpy() >= low - 1e-9 * abs(low)
        angle = points["poincare_angle"].to_numpy()[shown]
        velocity = points["poincare_velocity"].to_numpy()[shown]
        numbers = points["period"].to_numpy()[shown]
        motion = [points[name].to_numpy() for name in ("angle", "velocity")]
    elif "angle" in names and points["angle"].dims == ("period",):
        angle, velocity = points["angle"].to_numpy(), points["velocity"].to_numpy()
        numbers = points["period"].to_numpy()
        motion = [np.append(angle, 0.0), np.append(velocity, 0.0)]
    else:
        raise InputError(
            f"points = {type(points).__name__}: must be the result of wb.simulate(...) or of"
            " wb.poincare(...)."
        )
    if motion[0].size == 0:
        return angle, velocity, numbers, (0.0, 0.0)
    least = _LEAST * float(np.ptp(motion[0])), _LEAST * float(np.ptp(motion[1]))
    return angle, velocity, numbers, least
