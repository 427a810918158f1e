"""Basins of attraction, drawn."""

from __future__ import annotations

from collections.abc import Hashable, Iterator

import numpy as np
from bokeh.models import ColumnDataSource, Scatter

from wedgebrake.explorer.core import basins, legend
from wedgebrake.explorer.core.axis import Axis, picked
from wedgebrake.explorer.core.basins import PARAMETERS, Basins
from wedgebrake.explorer.core.state import Desk
from wedgebrake.explorer.ui.plots import look
from wedgebrake.explorer.ui.plots.canvas import Map

# An attractor of more points is drawn in smaller ones [px].
_MANY, _SIZE, _SMALLER = 16, 6.5, 3.5


class BasinsPlate:
    """Which motion each start leads to, and the Poincare points of those motions."""

    name = "basins"

    def __init__(self) -> None:
        self._map = Map(basins.TABLE)
        self.figure = self._map.canvas.figure
        self._orbits = ColumnDataSource({"x": [], "y": [], "size": [], "colour": []})
        # Ringed in white: an attractor lies in its own basin, of the same colour.
        for width, line in ((4.0, "#FFFFFF"), (1.0, look.INK)):
            dots = Scatter(
                x="x", y="y", size="size", fill_color="colour", line_color=line, line_width=width
            )
            self.figure.add_glyph(self._orbits, dots)

    def key(self, desk: Desk) -> Hashable:
        """All that the picture depends on, but the present start."""
        return basins.key(desk)

    def work(self, desk: Desk) -> Iterator[Basins]:
        """Pictures, coarse before fine."""
        return basins.work(desk)

    def show(self, picture: Basins) -> None:
        """Draw a picture."""
        self._map.show(picture.x, picture.y, picture.codes, picture.shown, [])
        points = [one for _, one in picture.orbits]
        sizes = [np.full(len(one), _SIZE if len(one) <= _MANY else _SMALLER) for one in points]
        colours = [[colour] * len(one) for colour, one in picture.orbits]
        both = np.concatenate([*points, np.empty((0, 2))])
        look.put(
            self._orbits, x=both[:, 0], y=both[:, 1], size=np.concatenate([*sizes, []]),
            colour=[one for several in colours for one in several],
        )  # fmt: skip

    def mark(self, desk: Desk) -> None:
        """Mark the present start."""
        x, y = (Axis.of(desk, name) for name in PARAMETERS)
        self._map.cross.mark(x, y, desk.study.run.initial)

    def pick(self, desk: Desk, x: float, y: float) -> dict[str, float]:
        """The start at a place."""
        return picked([Axis.of(desk, name) for name in PARAMETERS], (x, y))

    def say(self, sentence: str) -> None:
        """Show nothing but a sentence."""
        look.put(self._orbits, x=[], y=[], size=[], colour=[])
        self._map.say(sentence)

    def legend(self, picture: Basins) -> list[legend.Chip]:
        """Attractors with their shares, and what else there is."""
        return picture.legend

    def progress(self, picture: Basins) -> str:
        """How much is known."""
        return picture.progress
