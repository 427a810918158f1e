"""The points of a sweep over one inertia as tables of numbers, for the compiled kernel.

There is a table for each part of the system, and a point is one row of each table. Parts that
depend on axes along the same dimensions are built together, with ``replace``, once for each
combination of the values along these dimensions; the product of all dimensions is never built.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from wedgebrake.analysis.driveline_motion.part_tables import CHOICE, Tables, tables_of
from wedgebrake.errors import InputError
from wedgebrake.model.system import BrakedDriveline
from wedgebrake.solvers.smooth.laws import brake_law
from wedgebrake.sweeps.grid import Axis

# Number of rows of a part that are kept for the next chunk.
_KEPT_ROWS = 200_000

Row = tuple[Any, ...]


def _friction(system: BrakedDriveline) -> Row:
    friction: Any = system.friction
    speeds, kinetic = zip(*friction.nodes(), strict=True)
    return friction.breakaway, speeds, kinetic


# The numbers of each part, as ``tables_of`` takes them.
_NUMBERS: dict[str, Callable[[BrakedDriveline], Row]] = {
    "driveline": lambda system: (
        system.driveline.inertia, system.driveline.damping, system.driveline.stiffness,
        system.driveline.constant_speed,
    ),
    "brake": lambda system: (system.brake.radius, *brake_law(system.brake)[1]),
    "friction": _friction,
    "actuation": lambda system: (
        system.actuation.initial_force, system.actuation.slope, float(system.actuation.release),
    ),
    "excitation": lambda system: (
        system.excitation.amplitude, system.excitation.angular_frequency,
    ),
}  # fmt: skip


class PartRows:
    """The parts of the systems that the axes make of a base system.

    law : of the brakes, compiled

    Raises ``InputError`` for a brake whose law cannot be compiled.
    """

    def __init__(self, system: Any, line: BrakedDriveline, axes: tuple[Axis, ...]) -> None:
        self.system, self.axes, self.law = system, axes, brake_law(line.brake)[0]
        names = {name for axis in axes for name in axis.parameters}
        affecting = {part: system.affecting(part, names) for part in _NUMBERS}
        moving = {
            part: [axis for axis in axes if found.intersection(axis.parameters)]
            for part, found in affecting.items()
        }
        groups: dict[frozenset[str], list[str]] = {}
        for part, own in moving.items():
            groups.setdefault(frozenset(axis.dim for axis in own), []).append(part)
        moved = {axis.name for own in moving.values() for axis in own}
        self._groups = [
            (parts, [i for i, axis in enumerate(axes) if axis.dim in dims and axis.name in moved])
            for dims, parts in groups.items()
        ]
        self._rows: list[dict[tuple[int, ...], tuple[Row, ...] | None]] = [{} for _ in groups]

    def tables(
        self, indices: tuple[NDArray[np.int64], ...]
    ) -> tuple[Tables, NDArray[np.record], NDArray[np.bool_]]:
        """Return the tables for some points, the rows of each point, and which points have them.

        indices : for each axis, (points,) numbers of its values
        """
        rows: dict[str, list[Row | None]] = {}
        count = indices[0].size
        choices, complete = np.zeros(count, dtype=CHOICE), np.ones(count, bool)
        for number, (parts, affecting) in enumerate(self._groups):
            chosen = np.zeros(count, np.int64)
            combinations: list[list[int]] = [[]]
            if affecting:
                own = np.stack([indices[i] for i in affecting], axis=1)
                unique, inverse = np.unique(own, axis=0, return_inverse=True)
                chosen, combinations = inverse.ravel(), unique.tolist()
            found = [self._rows_of(number, tuple(one)) for one in combinations]
            for place, part in enumerate(parts):
                rows[part] = [None if one is None else one[place] for one in found]
                choices[part] = chosen
            complete &= np.array([one is not None for one in found])[chosen]
        return tables_of(rows), choices, complete

    def _rows_of(self, group: int, numbers: tuple[int, ...]) -> tuple[Row, ...] | None:
        """Return the rows of the parts of a group for some values of the axes that affect them.

        None if the values are not valid, or if the kernel cannot compute the system.
        """
        rows, (parts, affecting) = self._rows[group], self._groups[group]
        if numbers not in rows:
            if len(rows) >= _KEPT_ROWS:
                rows.clear()
            changes = {
                name: float(self.axes[i].values[number])
                for i, number in zip(affecting, numbers, strict=True)
                for name in self.axes[i].parameters
            }
            try:
                line = self.system.replace(**changes).one_inertia
                rows[numbers] = (
                    None if line is None else tuple(_NUMBERS[part](line) for part in parts)
                )
            except InputError:
                rows[numbers] = None
        return rows[numbers]
