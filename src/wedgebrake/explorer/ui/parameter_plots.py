"""Plots over parameters: each combines its computation with its Bokeh figure."""

from __future__ import annotations

from typing import Any

from wedgebrake.explorer.core.plots import PARAMETER_PLOTS, Picture
from wedgebrake.explorer.core.state import PageState
from wedgebrake.figures.data.axes import selected


class DrawnPlot:
    """A plot over parameters, by its name, for one page.

    computed : its inputs and their computation
    figure   : Bokeh's
    """

    def __init__(self, name: str) -> None:
        from wedgebrake.figures.bokeh.bifurcation import BifurcationPlot
        from wedgebrake.figures.bokeh.class_map import MapPlot

        self.name, self.computed = name, PARAMETER_PLOTS[name]
        self._plot: Any = BifurcationPlot() if name == "diagram" else MapPlot()
        self.figure = self._plot.figure

    def show(self, picture: Picture) -> None:
        """Draw a picture."""
        self._plot.show(picture)

    def mark(self, state: PageState) -> None:
        """Mark the current values, and show the selected quantity."""
        self._plot.choose(state.view.quantity)
        axes = self.computed.axes(state)
        self._plot.mark(axes, [state.value(axis.name) for axis in axes])

    def pick(self, state: PageState, x: float, y: float) -> dict[str, float]:
        """Values of the parameters at a point; empty for a point outside."""
        axes = self.computed.axes(state)
        return selected(axes, (x, y)[: len(axes)])

    def say(self, sentence: str) -> None:
        """Show only a sentence."""
        self._plot.say(sentence)
