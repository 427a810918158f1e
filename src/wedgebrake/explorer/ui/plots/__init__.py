"""Pictures over parameters: what each computes, step by step, and how it is drawn.

diagram, regimes, stability, basins : a plate each: its key, its work, its picture
machine, axis, filling              : the machine, parameters and sweeps that they compute with
cells, limit, attractors            : maps, lines on them, motions told apart
chips                               : classes as colours and words for a legend
*_figure, canvas                    : the same drawn with Bokeh, which no other file imports

A plate's work gives complete pictures, coarse before fine, and a caller who has had enough asks
for no more.
"""

from __future__ import annotations

from typing import Any


def new_plate(name: str) -> Any:
    """Create a plate, by its name, for one page."""
    from wedgebrake.explorer.ui.plots.basins import BasinsPlate
    from wedgebrake.explorer.ui.plots.diagram import DiagramPlate
    from wedgebrake.explorer.ui.plots.regimes import RegimesPlate
    from wedgebrake.explorer.ui.plots.stability import StabilityPlate

    kinds: list[Any] = [DiagramPlate, RegimesPlate, StabilityPlate, BasinsPlate]
    return next(kind() for kind in kinds if kind.name == name)
