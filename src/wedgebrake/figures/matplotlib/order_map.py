"""Picture of an order map."""

from __future__ import annotations

from typing import TYPE_CHECKING

from wedgebrake.figures.data.order_map import OrderMap
from wedgebrake.figures.matplotlib import style
from wedgebrake.figures.matplotlib.layout import caption_lines, write_caption

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

# Height over width, height of a line of the caption [inch], smallest shown share of an amplitude.
_SHARE, _CAPTION, _RANGE = 0.75, 0.125, 1e-3


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
    caption = _CAPTION * len(caption_lines(data.sentences, width))
    with style.use():
        figure = style.new_figure(width, _SHARE * width + caption)
        axes = figure.subplots()
        most = float(data.amplitude.max())
        norm = LogNorm(_RANGE * most, most, clip=True) if most > 0.0 else Normalize(0.0, 1.0)
        mesh = axes.pcolormesh(
            data.speed_edges, data.order_edges, data.amplitude, norm=norm, cmap=style.SIZES,
            rasterized=True,
        )  # fmt: skip
        figure.colorbar(mesh, ax=axes, label=data.label)
        axes.set_xlabel("speed of the reference  [rad/s]")
        axes.set_ylabel("order  [cycles per turn]")
        style.few_ticks(axes)
        write_caption(figure, data.sentences)
        return figure
