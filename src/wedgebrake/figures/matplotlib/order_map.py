"""Picture of an order map."""

from __future__ import annotations

from typing import TYPE_CHECKING

from wedgebrake.figures.data.order_map import OrderMap
from wedgebrake.figures.matplotlib import style
from wedgebrake.figures.matplotlib.layout import captioned
from wedgebrake.figures.matplotlib.maps import draw_cells, set_axes

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

# Height over width, smallest shown share of an amplitude.
_SHARE, _RANGE = 0.75, 1e-3


def order_map(dataset: xr.Dataset, *, width: float = style.COLUMN) -> Figure:
    """Draw amplitudes over speed (right) and order (up) in a new figure, on a logarithmic scale.

    dataset : as returned by ``wb.order_map``
    width   : of the figure [inch]

    The scale spans three decades below the largest amplitude; orders below 0.5 are left out, as
    they hold the mean and its trend.

    Raises ``InputError`` for a map of a single speed or order.
    """
    from matplotlib.colors import LogNorm, Normalize

    data = OrderMap.of(dataset)
    with captioned(width, _SHARE * width, data.sentences) as figure:
        axes = figure.subplots()
        most = float(data.amplitude.max())
        norm = LogNorm(_RANGE * most, most, clip=True) if most > 0.0 else Normalize(0.0, 1.0)
        set_axes(axes, data.speed, data.order)
        mesh = draw_cells(axes, data.speed, data.order, data.amplitude, norm=norm, cmap=style.SIZES)
        figure.colorbar(mesh, ax=axes, label=data.label)
    return figure
