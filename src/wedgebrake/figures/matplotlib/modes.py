"""Picture of the modes of a machine: deflections of its inertias."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from wedgebrake.analysis.linear_stability import Stability
from wedgebrake.figures.data.modes import Modes, ModeShape
from wedgebrake.figures.matplotlib import style
from wedgebrake.figures.matplotlib.layout import captioned

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

# Height of a row of panels, width of a panel [inch].
_ROW, _PANEL = 1.75, 2.4
# Characters of names that fit below a panel in one row, per inch of its width.
_FITS = 9.0


def modes(stability: Stability, *, width: float = style.PAGE) -> Figure:
    """Draw the modes of a machine in a new figure, one panel for each mode.

    stability : as returned by ``wb.stability(machine)``
    width     : of the figure [inch]

    Points are the deflections at the instant at which the largest is 1; the shading is the range
    of the vibration; titles give frequency and damping ratio. Growing modes are red. Rigid modes
    and those of actuators alone are left out.

    Raises ``InputError`` for any other ``stability``.
    """
    data = Modes.of(stability)
    sentences = [data.verdict]
    if not data.shapes:
        sentences.append("No mode vibrates.")
    count = max(len(data.shapes), 1)
    across = 1 if style.look().axes else max(1, min(count, int(width / _PANEL)))
    down = math.ceil(count / across)
    with captioned(width, down * _ROW + 0.1, sentences) as figure:
        grid = figure.subplots(down, across, squeeze=False, sharey=True)
        for axes, shape in zip(grid.flat, data.shapes, strict=False):
            draw_mode(axes, data.inertias, shape, width / across)
        for axes in grid.flat[len(data.shapes) :]:
            axes.set_axis_off()
        for row in grid[:, 0]:
            row.set_ylabel("deflection  [1]")
    return figure


def draw_mode(axes: Axes, inertias: tuple[str, ...], shape: ModeShape, width: float) -> None:
    """Draw a mode on axes with a given width [inch]."""
    colour = style.VERMILLION if shape.grows else style.BLUE
    places = np.arange(len(inertias))
    axes.axhline(0.0, color=style.GREY, linewidth=0.4, zorder=1.5)
    if len(inertias) > 1:
        axes.fill_between(places, -shape.size, shape.size, color=colour, alpha=0.15, linewidth=0.0)
        axes.plot(places, shape.deflection, color=colour, zorder=3)
    axes.vlines(places, -shape.size, shape.size, color=colour, linewidth=0.8, alpha=0.4)
    style.plot_points(axes, places, shape.deflection, 4.0, color=colour, zorder=4)
    axes.set_ylim(-1.15, 1.15)
    axes.set_yticks([-1.0, 0.0, 1.0])
    axes.set_xlim(-0.35, len(inertias) - 0.65)
    crowded = sum(map(len, inertias)) + 2 * len(inertias) > _FITS * width
    look: Any = {"rotation": 35.0, "ha": "right", "rotation_mode": "anchor"} if crowded else {}
    axes.set_xticks(places, inertias, **look)
    axes.set_title("\n".join(filter(None, shape.title)), fontsize=style.points(style.SMALL))
