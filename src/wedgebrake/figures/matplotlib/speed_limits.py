"""Pictures of the linear stability of a machine over its speed or one parameter."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from wedgebrake.figures.data import speed_limits as data_of
from wedgebrake.figures.data.class_map import REGIONS, STABLE, UNSTABLE
from wedgebrake.figures.data.panels import Panel
from wedgebrake.figures.data.speed_limits import ParameterLines
from wedgebrake.figures.matplotlib import style
from wedgebrake.figures.matplotlib.layout import captioned
from wedgebrake.figures.matplotlib.maps import set_axes
from wedgebrake.figures.matplotlib.panels import draw_panel

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

# Height of a panel, and of the parameter's axis [inch].
_ROW, _AXIS = 1.45, 0.35


def stability_limits(dataset: xr.Dataset, *, width: float = style.PAGE) -> Figure:
    """Damping ratios of the modes and stability limits over the sliding speed: a new figure.

    dataset : as returned by ``wb.stability_limits``
    width   : of the figure [inch]

    Speeds at which sliding is unstable are shaded red. In a panel with a single parameter its
    stable values are shaded green. Dashed lines are the present values.
    """
    return _figure(data_of.of_limits(dataset), width)


def stability_lines(dataset: xr.Dataset, *, width: float = style.PAGE) -> Figure:
    """Properties of the least damped mode over one parameter: a new figure.

    dataset : as returned by ``wb.stability_map`` for a machine and one parameter
    width   : of the figure [inch]

    The panels show damping ratio, growth rate and frequency. Values at which steady sliding is
    unstable, or does not exist, are shaded red.
    """
    (name,) = map(str, dataset["growth_rate"].dims)
    return _figure(data_of.of_map(dataset, name), width)


def _figure(data: ParameterLines, width: float) -> Figure:
    rows = len(data.panels)
    with captioned(width, rows * _ROW + _AXIS, data.sentences) as figure:
        grid = figure.subplots(rows, 1, squeeze=False, sharex=True)[:, 0]
        for axes, panel in zip(grid, data.panels, strict=True):
            set_axes(axes, data.x)
            draw_panel(axes, panel)
            _shade(axes, data, panel)
            if data.own is not None:
                axes.axvline(data.own, color=style.GREY, linewidth=0.6, linestyle=(0, (1.0, 1.5)))
        for axes in grid[:-1]:
            axes.set_xlabel("")
            axes.tick_params(axis="x", labelbottom=False)
    return figure


def _shade(axes: Axes, data: ParameterLines, panel: Panel) -> None:
    """Shade unstable values of the parameter, or stable values of the panel's only curve."""
    red: Any = {"color": REGIONS[UNSTABLE].colour, "linewidth": 0.0, "zorder": 0.2}
    if panel.filled is None:
        for low, high in data.shaded:
            axes.axvspan(low, high, **red)
        return
    low, high = axes.get_ylim()
    lower, upper = np.clip(panel.filled.T, low, high)
    axes.fill_between(data.x.values, low, high, **red)
    green: Any = {**red, "color": REGIONS[STABLE].colour, "zorder": 0.4}
    axes.fill_between(data.x.values, lower, upper, **green)
