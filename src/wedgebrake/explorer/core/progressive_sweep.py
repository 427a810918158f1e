"""A sweep whose points are computed in steps, a coarse grid first.

Each point is bitwise identical to that of ``wb.sweep`` for the same system; only the order of
computation differs.
"""

from __future__ import annotations

import time
from collections.abc import Iterator, Mapping, Sequence
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from wedgebrake.model.machine import Machine
from wedgebrake.model.system import BrakedDriveline
from wedgebrake.sweeps.executor import compute
from wedgebrake.sweeps.plan import Plan
from wedgebrake.sweeps.sweep import make_plan

if TYPE_CHECKING:
    import xarray as xr

Places = NDArray[np.int64]

STEP = 0.08
"""Duration of a step [s]."""
# Number of points computed before their speed is known; growth of that number from batch to batch.
_PROBE, _GROWTH = 4, 8


class ProgressiveSweep:
    """Points of a sweep over one or two parameters, complete or in part.

    dims    : names of the parameters' dimensions
    known   : over the parameters, bool
    results : name of a result -> values over the parameters in ascending order
    level   : points along each parameter of the finest grid that is complete; zeros before
    """

    def __init__(
        self,
        system: BrakedDriveline | Machine,
        parameters: Mapping[str, NDArray[np.float64]],
        levels: Sequence[tuple[int, ...]],
        **settings: Any,
    ) -> None:
        """Raises ``InputError`` as ``wb.sweep``.

        parameters : ascending values by name
        levels     : points along each parameter of successive grids, each of them part of the
                     next; the last has all
        """
        self._values = [np.asarray(one) for one in parameters.values()]
        sizes = [one.size for one in self._values]
        self._levels = list(levels)
        self._orders = [
            refinement_order(size, [level[i] for level in levels]) for i, size in enumerate(sizes)
        ]
        shuffled = {
            name: values[places]
            for (name, values), places in zip(parameters.items(), self._orders, strict=True)
        }
        self.plan: Plan = make_plan("sweep", system, shuffled, **settings)
        self._chunk = self.plan.chunk_maker()
        self.dims = list(self.plan.grid.sizes)
        self.results: dict[str, NDArray[Any]] = self.plan.empty_arrays()
        self.known = np.zeros(sizes, dtype=bool)
        self.level: tuple[int, ...] = (0,) * len(sizes)

    def steps(self, first: float = STEP, step: float = STEP) -> Iterator[None]:
        """Compute all points, in steps of a duration [s]; no step spans two levels."""
        batch, rate = _PROBE if self.plan.method == "exact" else 1, 0.0
        end = time.perf_counter() + first
        for runs, level in zip(self._runs(), self._levels, strict=True):
            for fixed, start, stop in runs:
                while start < stop:
                    begin = time.perf_counter()
                    if begin >= end:
                        yield
                        begin = time.perf_counter()
                        end = begin + step
                    # As many points as fit into the rest of the step, at least one.
                    fit = max(int(rate * (end - begin)), 1) if rate else batch
                    count = min(fit, batch, stop - start)
                    self._compute((*fixed, slice(start, start + count)))
                    rate = count / max(time.perf_counter() - begin, 1e-6)
                    start, batch = start + count, _GROWTH * count
            self.level = level
            yield
            end = time.perf_counter() + step

    def dataset(self) -> xr.Dataset:
        """The dataset of ``wb.sweep``, with status NOT_COMPUTED at points that are not known."""
        dataset = self.plan.dataset({name: one.copy() for name, one in self.results.items()})
        return dataset.assign_coords(
            {
                dim: (dim, values, dataset[dim].attrs)
                for dim, values in zip(self.dims, self._values, strict=True)
            }
        )

    def complete_places(self) -> list[Places]:
        """Indices along each parameter of the finest grid that is complete."""
        return [np.sort(one[:count]) for one, count in zip(self._orders, self.level, strict=True)]

    def _runs(self) -> Iterator[list[tuple[tuple[slice, ...], int, int]]]:
        """The points of each level in runs along the last parameter: (others, from, to)."""
        for before, after in pairwise([(0,) * len(self.dims), *self._levels]):
            if len(after) == 1:
                yield [((), before[0], after[0])]
                continue
            yield [
                ((slice(row, row + 1),), before[1] if row < before[0] else 0, after[1])
                for row in range(after[0])
            ]

    def _compute(self, where: tuple[slice, ...]) -> None:
        """Compute some points, and store them in ascending order of the parameters."""
        chunk = self._chunk(dict(zip(self.dims, where, strict=True)))
        for work in chunk.work:
            work()
        places = np.ix_(*(one[part] for one, part in zip(self._orders, where, strict=True)))
        for name, values in chunk.results().items():
            self.results[name][places] = values
        self.known[places] = True


def refinement_order(count: int, levels: Sequence[int]) -> Places:
    """The order in which the points 0 ... count - 1 are computed, (count,).

    The first ``levels[i]`` of them are evenly spaced, for each i; those that a level adds are
    spread evenly at any time.
    """
    offset = count // levels[0] // 2
    taken: list[int] = []
    for level in levels:
        stride = count // level
        new = [one for one in range(offset % stride, count, stride) if one not in set(taken)]
        bits = max(1, (len(new) - 1).bit_length())
        ranks = np.argsort([int(f"{rank:0{bits}b}"[::-1], 2) for rank in range(len(new))])
        taken += [new[rank] for rank in ranks]
    return np.array(taken, dtype=np.int64)


def followed(
    system: BrakedDriveline | Machine, parameters: dict[str, Any], **settings: Any
) -> xr.Dataset:
    """The sweep up and down one parameter, in which each value starts where its neighbour ended.

    Raises ``InputError`` as ``wb.bifurcation``.
    """
    (name,) = parameters
    plan = make_plan("bifurcation", system, parameters, follow=name, **settings)
    everything = {dim: slice(0, size) for dim, size in plan.grid.sizes.items()}
    return plan.dataset(compute(plan, everything))
