"""The Poincaré section: the state once in every period of the torque."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from wedgebrake.figures.data import caption
from wedgebrake.figures.data.limits import extent
from wedgebrake.figures.data.section import Section
from wedgebrake.figures.matplotlib import style
from wedgebrake.figures.matplotlib.layout import write_caption

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


def section(points: xr.Dataset, start: float | None = None) -> Figure:
    """Poincaré points, velocity [rad/s] against angle [rad]: a new figure.

    points : a response (its section at n / f_e) or what ``wb.poincare`` gives
    start  : of a response: time of the first point [s]; default its last fifth

    Where no torque acts, the picture states the period at which the points are taken: they
    then show where the motion passes, not whether it repeats.

    Raises ``InputError`` for a dataset that is neither.
    """
    with style.use():
        figure = style.new_figure()
        draw(figure.add_subplot(), points, start)
        write_caption(figure, caption.of_response(points))
        return figure


def draw(axes: Axes, points: xr.Dataset, start: float | None = None) -> None:
    """Draw the same on existing axes."""
    data = Section.of(points, start)
    axes.set_xlabel(style.SECTION["angle"])
    axes.set_ylabel(style.SECTION["velocity"])
    if not data.angle.size:
        style.say(axes, "no section in this time span")
        return
    axes.set_xlim(*style.margins(*extent(data.angle), data.least[0], share=0.1))
    axes.set_ylim(*style.margins(*extent(data.velocity), data.least[1], share=0.1))
    style.plot_points(axes, data.angle, data.velocity, _size(data.angle.size), color=style.MOTION)
    style.few_ticks(axes)
    axes.annotate(
        _description(data),
        (1.0, 1.02),
        xycoords="axes fraction",
        ha="right",
        va="bottom",
        fontsize=style.SMALL,
    )


def _description(data: Section) -> str:
    """Number of points; where no torque acts, the period at which they are taken too."""
    first, last, count = data.period[0], data.period[-1], data.period.size
    words = f"{count} points, $n$ = {first} to {last}" if count > 1 else f"1 point, $n$ = {first}"
    if data.stated_period is None:
        return words
    period = style.number(data.stated_period)
    return f"no torque acts; points once in the period stated for it, ${period}$ s\n{words}"


def _size(count: int) -> float:
    """Size of a point [pt]: smaller for more of them, so that they stay apart."""
    return float(np.clip(4.0 * (30.0 / max(count, 1)) ** 0.4, 0.5, 4.0))
