"""The regime map: the class of motion over two parameters."""

from __future__ import annotations

from collections.abc import Hashable, Iterator
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from wedgebrake.explorer.core.axis import parameter_axis
from wedgebrake.explorer.core.machine import map_levels, new_sweep, slow, sweep_key
from wedgebrake.explorer.core.progressive_sweep import STEP
from wedgebrake.explorer.core.state import Desk, axes
from wedgebrake.figures.data.axes import SweptAxis, arranged
from wedgebrake.figures.data.class_map import ClassMap
from wedgebrake.figures.data.class_styles import LIMIT_ENTRY, MOTIONS, class_entries, motion_codes
from wedgebrake.figures.data.partial import PartialMap, hover_boxes, nearest_known
from wedgebrake.figures.data.stability_limit import limit_lines

if TYPE_CHECKING:
    import xarray as xr

# Steps of a slow solver are longer by this factor.
_SLOW = 2.5


def parameters(desk: Desk) -> tuple[str, str]:
    """The parameters of the map, across and up: the selected ones, or others of the machine."""
    possible = axes(desk.system)
    across = desk.view.across if desk.view.across in possible else possible[-1]
    up = desk.view.up if desk.view.up in possible and desk.view.up != across else None
    others = [one for one in ("F0", "eta", *possible) if one in possible and one != across]
    return across, up or others[0]


def key(desk: Desk) -> Hashable:
    """All inputs of the map; of its own parameters the ends of the axes alone."""
    return sweep_key(desk, parameters(desk))


def work(desk: Desk) -> Iterator[PartialMap]:
    """Compute the map, coarse cells first.

    Raises ``InputError`` for two parameters of which one sets the other, and where no value of
    one can be taken.
    """
    x, y = (parameter_axis(desk, name) for name in parameters(desk))
    sweep = new_sweep(desk, (y, x), map_levels(slow(desk)), keep_points=False)
    step = STEP * (_SLOW if slow(desk) else 1.0)
    limit: list[NDArray[np.float64]] = []
    level = sweep.level
    for _ in sweep.steps(step, step):
        dataset = sweep.dataset()
        if sweep.level != level:
            level = sweep.level
            up, across = sweep.complete_places()
            complete = dataset.isel({y.name: up, x.name: across})
            limit = limit_lines(complete, *_axes(complete))
        columns, rows = _axes(dataset)
        found = arranged(motion_codes(dataset), columns, rows).astype(np.int64)
        legend = class_entries(found[sweep.known], MOTIONS, shares=True)
        legend += [LIMIT_ENTRY] if limit else []
        codes = nearest_known(found, sweep.known)
        data = ClassMap(columns, rows, codes, MOTIONS, legend, limit)
        known, whole = int(sweep.known.sum()), sweep.known.size
        yield PartialMap((x, y), data, hover_boxes((x, y), data), known, whole)


def _axes(dataset: xr.Dataset) -> tuple[SweptAxis, SweptAxis]:
    """Axes across and up: the second and the first dimension."""
    y, x = (SweptAxis.of(dataset, str(name)) for name in dataset["motion"].dims)
    return x, y
