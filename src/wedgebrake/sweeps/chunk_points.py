"""The points of a chunk of a sweep: positions on the grid, values and systems."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from wedgebrake.errors import InputError
from wedgebrake.model.machine import Machine
from wedgebrake.model.sweep_settings import INITIAL
from wedgebrake.model.system import BrakedDriveline
from wedgebrake.sweeps.plan import Plan


class ChunkPoints:
    """Points of a chunk of a plan, by their flat numbers.

    where : slice of each dimension of the points, by name

    sizes   : points along each dimension;  count : all of them
    indices : for each axis of the plan, (count,) indices of its values
    """

    def __init__(self, plan: Plan, where: Mapping[str, slice]) -> None:
        self._plan = plan
        self.sizes = {dim: one.stop - one.start for dim, one in where.items()}
        self.count = math.prod(self.sizes.values())
        places = dict(zip(where, np.indices(tuple(self.sizes.values())), strict=True))
        self.indices = tuple(
            (places[axis.dim].ravel() + where[axis.dim].start).astype(np.int64)
            for axis in plan.grid.axes
        )

    def system(self, number: int) -> BrakedDriveline | Machine | None:
        """The system of a point; None if it is not valid."""
        changes = {
            axis.name: float(axis.values[numbers[number]])
            for axis, numbers in zip(self._plan.grid.axes, self.indices, strict=True)
            if axis.name not in INITIAL
        }
        try:
            return self._plan.system.replace(**changes)
        except InputError:
            return None

    def initial_states(self) -> NDArray[np.float64]:
        """Initial states of a driveline, (count, 2): angles [rad] and velocities [rad/s]."""
        states = np.empty((self.count, 2))
        states[:] = self._plan.initial
        for axis, numbers in zip(self._plan.grid.axes, self.indices, strict=True):
            if axis.name in INITIAL:
                states[:, list(INITIAL).index(axis.name)] = axis.values[numbers]
        return states

    def shaped(self, values: NDArray[Any]) -> NDArray[Any]:
        """Reshape values of all points, (count, ...), to the dimensions of the chunk."""
        return values.reshape(*self.sizes.values(), *values.shape[1:])
