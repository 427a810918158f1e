"""The map of regimes, drawn."""

from __future__ import annotations

from collections.abc import Hashable, Iterator

from wedgebrake.explorer.core import legend, regimes
from wedgebrake.explorer.core.axis import Axis, picked
from wedgebrake.explorer.core.regimes import Regimes
from wedgebrake.explorer.core.state import Desk
from wedgebrake.explorer.ui.plots.canvas import Map
from wedgebrake.figures.matplotlib.class_styles import MOTION_LOOKS


class RegimesPlate:
    """The class of motion over two parameters, and the limit of linear stability."""

    name = "regimes"

    def __init__(self) -> None:
        self._map = Map(MOTION_LOOKS)
        self.figure = self._map.canvas.figure

    def key(self, desk: Desk) -> Hashable:
        """All that the picture depends on, but the present values of its parameters."""
        return regimes.key(desk)

    def work(self, desk: Desk) -> Iterator[Regimes]:
        """Pictures, coarse before fine."""
        return regimes.work(desk)

    def show(self, picture: Regimes) -> None:
        """Draw a picture."""
        self._map.show(picture.x, picture.y, picture.codes, picture.shown, picture.limit)

    def mark(self, desk: Desk) -> None:
        """Mark the present values."""
        x, y = (Axis.of(desk, name) for name in regimes.parameters(desk))
        self._map.cross.mark(x, y, (desk.value(x.name), desk.value(y.name)))

    def pick(self, desk: Desk, x: float, y: float) -> dict[str, float]:
        """The values of both parameters at a place."""
        return picked([Axis.of(desk, name) for name in regimes.parameters(desk)], (x, y))

    def say(self, sentence: str) -> None:
        """Show nothing but a sentence."""
        self._map.say(sentence)

    def legend(self, picture: Regimes) -> list[legend.Chip]:
        """The classes that occur."""
        return picture.legend

    def progress(self, picture: Regimes) -> str:
        """How much is known."""
        return picture.progress
