"""Basins of attraction: which initial state leads to which steady motion."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from wedgebrake.figures.data import basins as data_of
from wedgebrake.figures.data import caption
from wedgebrake.figures.data.basins import Basins
from wedgebrake.figures.matplotlib import point_labels, style
from wedgebrake.figures.matplotlib.class_map import draw_map
from wedgebrake.figures.matplotlib.layout import HIGHEST, page
from wedgebrake.figures.matplotlib.legend import marker_options

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

# Width of the white ring about a point [pt].
_RING = 1.8


def basins(dataset: xr.Dataset, *, width: float = style.COLUMN) -> Figure:
    """Basins over the angle [rad] and velocity [rad/s] at the start: a new figure.

    dataset : as ``wb.basins`` gives it
    width   : of the figure [inch]; a journal's column is 3.5, its page 7.2

    Attractors are numbered as in the dataset and coloured by their share of all initial states.
    Circles are their Poincare points: states at the same phase of the torque as the initial
    state. The legend states the period of each motion. Beyond the twentieth, attractors share
    one colour.

    Raises ``InputError`` for a dataset that has no basins.
    """
    data = data_of.of_dataset(dataset)
    sentences = caption.sentences(dataset, [data.x.name, data.y.name])
    rows = [min(0.75 * width, HIGHEST)]
    with style.use(), page(width, rows, [("", data.legend)], sentences) as (figure, grid):
        _draw(figure.add_subplot(grid[0]), data)
    return figure


def draw(axes: Axes, dataset: xr.Dataset) -> None:
    """Draw the basins on given axes, without legend."""
    _draw(axes, data_of.of_dataset(dataset))


def _draw(axes: Axes, data: Basins) -> None:
    draw_map(axes, data)
    for one in data.marks:
        # Ringed in white: an attractor lies in its own basin, of the same colour.
        ring = replace(one.marker, size=one.marker.size + _RING, face="white", edge="white")
        for marker in (ring, one.marker):
            axes.plot(*one.points.T, **marker_options(marker), zorder=4.0)
    labels = [(str(one.number), one.points) for one in data.marks]
    point_labels.draw(axes, labels, (), force=True)
