"""The points of a sweep over one inertia as tables of numbers, for the compiled kernel.

There is a table for each part of the system, and a point is a row of each of them. A part is built,
by ``replace``, once for each combination of the swept values that affect it; the product of all
axes is never built.
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
        system.driveline.drive_speed,
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
        self._affecting = {
            part: [i for i, axis in enumerate(axes) if found.intersection(axis.parameters)]
            for part, found in affecting.items()
        }
        self._rows: dict[str, dict[tuple[int, ...], Row | None]] = {part: {} for part in _NUMBERS}

    def tables(
        self, indices: tuple[NDArray[np.int64], ...]
    ) -> tuple[Tables, NDArray[np.record], NDArray[np.bool_]]:
        """Return the tables for some points, the rows of each point, and which points have them.

        indices : for each axis, (points,) numbers of its values
        """
        rows: dict[str, list[Row | None]] = {}
        count = indices[0].size
        choices, complete = np.zeros(count, dtype=CHOICE), np.ones(count, bool)
        for part, affecting in self._affecting.items():
            combinations: list[list[int]] = [[]]
            if affecting:
                own = np.stack([indices[i] for i in affecting], axis=1)
                unique, inverse = np.unique(own, axis=0, return_inverse=True)
                choices[part], combinations = inverse.ravel(), unique.tolist()
            rows[part] = [self._row(part, tuple(one)) for one in combinations]
            complete &= np.array([row is not None for row in rows[part]])[choices[part]]
        return tables_of(rows), choices, complete

    def _row(self, part: str, numbers: tuple[int, ...]) -> Row | None:
        """Return a part for some values of the axes that affect it; None if it has no numbers."""
        rows = self._rows[part]
        if numbers not in rows:
            if len(rows) >= _KEPT_ROWS:
                rows.clear()
            changes = {
                name: float(self.axes[i].values[number])
                for i, number in zip(self._affecting[part], numbers, strict=True)
                for name in self.axes[i].parameters
            }
            try:
                line = self.system.replace(**changes).one_inertia
                rows[numbers] = None if line is None else _NUMBERS[part](line)
            except InputError:
                rows[numbers] = None
        return rows[numbers]
