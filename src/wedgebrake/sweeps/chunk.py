"""Some points of a sweep, computed in batches."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from wedgebrake.errors import InputError
from wedgebrake.model.system import INITIAL
from wedgebrake.sweeps.grid import batches
from wedgebrake.sweeps.plan import Plan


class Chunk(ABC):
    """Points of a plan, numbered from 0, in batches that threads may compute in any order.

    where : slice of each dimension of the points, by name

    sizes   : points along each dimension;  count : all of them
    indices : for each axis of the plan, (count,) indices of its values
    states  : (count, 2) initial angle [rad] and velocity [rad/s] of a driveline
    work    : one function for each batch
    """

    def __init__(self, plan: Plan, where: Mapping[str, slice]) -> None:
        self.plan = plan
        self.sizes = {dim: one.stop - one.start for dim, one in where.items()}
        self.count = math.prod(self.sizes.values())
        places = dict(zip(where, np.indices(tuple(self.sizes.values())), strict=True))
        self.indices = tuple(
            (places[axis.dim].ravel() + where[axis.dim].start).astype(np.int64)
            for axis in plan.grid.axes
        )
        self.states = np.empty((self.count, 2))
        self.states[:] = plan.initial
        for axis, numbers in zip(plan.grid.axes, self.indices, strict=True):
            if axis.name in INITIAL:
                self.states[:, list(INITIAL).index(axis.name)] = axis.values[numbers]
        self.work: list[Callable[[], None]] = [
            partial(self._run, numbers)
            for numbers in batches(self.sizes, plan.grid.follow, self._batch_size())
        ]

    @abstractmethod
    def _batch_size(self) -> int:
        """Number of points of a batch."""

    @abstractmethod
    def _run(self, numbers: NDArray[np.int64]) -> None:
        """Compute a batch; with ``follow`` each point starts from the previous final state."""

    @abstractmethod
    def results(self) -> dict[str, Any]:
        """Return the variables over the chunk, once all its work is done."""

    def system(self, number: int) -> Any:
        """The system of a point; None if it is not valid."""
        changes = {
            axis.name: float(axis.values[numbers[number]])
            for axis, numbers in zip(self.plan.grid.axes, self.indices, strict=True)
            if axis.name not in INITIAL
        }
        try:
            return self.plan.system.replace(**changes)
        except InputError:
            return None

    def state(self, number: int) -> tuple[float, float]:
        """Initial angle and velocity of a driveline at a point."""
        return float(self.states[number, 0]), float(self.states[number, 1])

    def shaped(self, values: NDArray[Any]) -> NDArray[Any]:
        """Reshape values of all points, (count, ...), to the dimensions of the chunk."""
        return values.reshape(*self.sizes.values(), *values.shape[1:])
