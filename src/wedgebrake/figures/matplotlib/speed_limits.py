"""Pictures of the linear stability of a machine over its speed or one parameter."""

from __future__ import annotations

from typing import TYPE_CHECKING

from wedgebrake.figures.data import speed_limits as data
from wedgebrake.figures.matplotlib import style
from wedgebrake.figures.matplotlib.parameter_lines import draw_figure

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure


def stability_limits(dataset: xr.Dataset, *, width: float = style.PAGE) -> Figure:
    """Damping ratios of the modes and stability limits over the sliding speed: a new figure.

    dataset : as returned by ``wb.stability_limits``
    width   : of the figure [inch]

    Speeds at which sliding is unstable are shaded red. In a panel with a single parameter its
    stable values are shaded green. Dashed lines are the present values.
    """
    return draw_figure(data.of_limits(dataset), width)


def stability_lines(dataset: xr.Dataset, *, width: float = style.PAGE) -> Figure:
    """Properties of the least damped mode over one parameter: a new figure.

    dataset : as returned by ``wb.stability_map`` for a machine and one parameter
    width   : of the figure [inch]

    The panels show damping ratio, growth rate and frequency. Values at which steady sliding is
    unstable, or does not exist, are shaded red.
    """
    (name,) = map(str, dataset["growth_rate"].dims)
    return draw_figure(data.of_map(dataset, name), width)
