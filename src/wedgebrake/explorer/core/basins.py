"""Basins of attraction: the steady motion that each initial state leads to."""

from __future__ import annotations

from collections.abc import Hashable, Iterator

import numpy as np

from wedgebrake.explorer.core.attractors import AttractorSet
from wedgebrake.explorer.core.axis import parameter_axis
from wedgebrake.explorer.core.machine import map_levels, new_sweep, slow, sweep_key
from wedgebrake.explorer.core.progressive_sweep import STEP
from wedgebrake.explorer.core.state import Desk
from wedgebrake.figures.data.axes import SweptAxis
from wedgebrake.figures.data.basins import PARAMETERS, basins
from wedgebrake.figures.data.partial import PartialMap, hover_boxes, nearest_known

# Steps are shorter by this factor, for the time it takes to tell attractors apart; those of a slow
# solver are longer.
_SHARE, _SLOW = 0.7, 2.5


def parameters(_desk: Desk) -> tuple[str, str]:
    """The parameters of the map, across and up."""
    return PARAMETERS


def key(desk: Desk) -> Hashable:
    """All inputs of the basins; not the initial state of the run."""
    return sweep_key(desk, PARAMETERS, initial=False)


def work(desk: Desk) -> Iterator[PartialMap]:
    """Compute the basins, coarse cells first.

    Raises ``InputError`` for a method that does not fit the friction law.
    """
    x, y = (parameter_axis(desk, name) for name in PARAMETERS)
    sweep = new_sweep(desk, (y, x), map_levels(slow(desk)))
    attractors = AttractorSet(sweep.plan.attributes())
    numbers = np.zeros(sweep.known.shape, dtype=np.int64)
    labelled = np.zeros(sweep.known.shape, dtype=bool)
    columns, rows = (SweptAxis.of(sweep.dataset(), one.name) for one in (x, y))
    step = STEP * (_SLOW if slow(desk) else _SHARE)
    for _ in sweep.steps(step, step):
        new = sweep.known & ~labelled
        found, merged = attractors.add({name: one[new] for name, one in sweep.results.items()})
        for one, other in merged.items():
            numbers[numbers == one] = other
        numbers[new] = found
        labelled |= new
        given = attractors.found(numbers[labelled])
        shown = nearest_known(numbers, labelled)
        data = basins(columns, rows, shown, given, known=labelled, numbered=False)
        boxes = hover_boxes((x, y), data)
        yield PartialMap((x, y), data, boxes, int(labelled.sum()), labelled.size, "starts")
