"""The bifurcation diagram: Poincare points over one parameter, by class of motion."""

from __future__ import annotations

from collections.abc import Hashable, Iterator

import numpy as np

from wedgebrake.explorer.core.axis import parameter_axis
from wedgebrake.explorer.core.limits import COARSE_POINTS, FINE_POINTS
from wedgebrake.explorer.core.machine import new_sweep, slow, sweep_key
from wedgebrake.explorer.core.progressive_sweep import STEP
from wedgebrake.explorer.core.state import Desk, axes
from wedgebrake.figures.data.bifurcation import BifurcationDiagram
from wedgebrake.figures.data.partial import PartialDiagram

# Time of the first step [s]: enough for all coarse points, except of a slow solver.
_FIRST_STEP = 0.25


def parameter(desk: Desk) -> str:
    """The parameter of the diagram: the selected one, or another that the machine has."""
    possible = axes(desk.system)
    return desk.view.axis if desk.view.axis in possible else possible[-1]


def parameters(desk: Desk) -> tuple[str]:
    """The parameter of the diagram."""
    return (parameter(desk),)


def key(desk: Desk) -> Hashable:
    """All inputs of the diagram; of its own parameter the ends of the axis alone."""
    return sweep_key(desk, parameters(desk))


def work(desk: Desk) -> Iterator[PartialDiagram]:
    """Compute the diagram, coarse points first.

    Raises ``InputError`` where no value of the parameter can be taken.
    """
    axis = parameter_axis(desk, parameter(desk))
    few = slow(desk)
    levels = [(COARSE_POINTS,)] if few else [(COARSE_POINTS,), (FINE_POINTS,)]
    sweep = new_sweep(desk, [axis], levels)
    for _ in sweep.steps(_FIRST_STEP, 2.0 * STEP if few else STEP):
        known = np.flatnonzero(sweep.known)
        dataset = sweep.dataset().isel({axis.name: known})
        data = {name: BifurcationDiagram.of(dataset, name) for name in ("velocity", "angle")}
        yield PartialDiagram.of(axis, known, sweep.known.size, data)
