"""Pictures over parameters: each joins what is computed with its Bokeh figure."""

from __future__ import annotations

from collections.abc import Hashable, Iterator
from types import ModuleType
from typing import Any

from wedgebrake.explorer.core import basins, diagram, regimes, stability
from wedgebrake.explorer.core.axis import parameter_axis
from wedgebrake.explorer.core.state import Desk
from wedgebrake.figures.data.axes import ParameterAxis, selected
from wedgebrake.figures.data.partial import PartialDiagram, PartialMap

_COMPUTED: dict[str, ModuleType] = {
    "diagram": diagram, "regimes": regimes, "stability": stability, "basins": basins
}  # fmt: skip


class ParameterPlot:
    """A picture over parameters, by its name, for one page."""

    def __init__(self, name: str) -> None:
        from wedgebrake.figures.bokeh.bifurcation import BifurcationPlot
        from wedgebrake.figures.bokeh.class_map import MapPlot

        self.name = name
        self._computed: Any = _COMPUTED[name]
        self._plot: Any = BifurcationPlot() if name == "diagram" else MapPlot()
        self.figure = self._plot.figure

    def key(self, desk: Desk) -> Hashable:
        """All inputs of the picture, without the current values of its parameters."""
        key: Hashable = self._computed.key(desk)
        return key

    def work(self, desk: Desk) -> Iterator[PartialDiagram | PartialMap]:
        """Compute the picture, coarse before fine; each item is a complete picture."""
        pictures: Iterator[PartialDiagram | PartialMap] = self._computed.work(desk)
        return pictures

    def show(self, picture: PartialDiagram | PartialMap) -> None:
        """Draw a picture."""
        self._plot.show(picture)

    def mark(self, desk: Desk) -> None:
        """Mark the current values, and show the selected quantity."""
        self._plot.choose(desk.view.quantity)
        axes = self._axes(desk)
        self._plot.mark(axes, [desk.value(axis.name) for axis in axes])

    def pick(self, desk: Desk, x: float, y: float) -> dict[str, float]:
        """Values of the parameters at a point; empty for a point outside."""
        axes = self._axes(desk)
        return selected(axes, (x, y)[: len(axes)])

    def say(self, sentence: str) -> None:
        """Show nothing but a sentence."""
        self._plot.say(sentence)

    def legend(self, picture: PartialDiagram | PartialMap) -> list[tuple[str, str]]:
        """CSS backgrounds with their meanings."""
        return [entry.css for entry in picture.legend]

    def progress(self, picture: PartialDiagram | PartialMap) -> str:
        """How much of the picture is computed; empty for all."""
        return picture.progress

    def _axes(self, desk: Desk) -> list[ParameterAxis]:
        return [parameter_axis(desk, name) for name in self._computed.parameters(desk)]
