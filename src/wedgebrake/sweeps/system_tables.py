"""The systems of a sweep as tables of numbers, one for each part of the machine.

A point of a sweep is a row of each of the five tables. A part is built, by
``BrakedDriveline.replace``, once for each combination of the swept values that affect it; the
product of all axes is never built.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from wedgebrake.analysis.batch import CHOICE, Tables, tables_of
from wedgebrake.errors import InputError
from wedgebrake.model.friction import SetValuedFriction
from wedgebrake.model.groups import SETTERS
from wedgebrake.model.sweep_settings import INITIAL
from wedgebrake.model.system import BrakedDriveline
from wedgebrake.solvers.smooth.laws import brake_law
from wedgebrake.sweeps.grid import Axis

Row = tuple[Any, ...]
# Number of rows of a part that are kept for the next chunk.
_KEPT_ROWS = 200_000


def _friction(system: BrakedDriveline) -> Row:
    friction = system.friction
    assert isinstance(friction, SetValuedFriction)  # noqa: S101 - checked by choose_method
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


class Parts:
    """The parts of the systems that the axes make of a base system."""

    def __init__(self, system: BrakedDriveline, axes: tuple[Axis, ...]) -> None:
        self.system, self.axes = system, axes
        self._affecting = {part: _affecting(system, axes, part) for part in _NUMBERS}
        self._rows: dict[str, dict[tuple[int, ...], Row | None]] = {part: {} for part in _NUMBERS}

    def tables(self, indices: tuple[NDArray[np.int64], ...]) -> tuple[Tables, NDArray[np.record]]:
        """Return the tables for some points, and the rows of each point.

        indices : for each axis, (points,) numbers of its values
        """
        rows: dict[str, list[Row | None]] = {}
        choices = np.zeros(indices[0].size, dtype=CHOICE)
        for part, affecting in self._affecting.items():
            combinations: list[list[int]] = [[]]
            if affecting:
                own = np.stack([indices[i] for i in affecting], axis=1)
                unique, inverse = np.unique(own, axis=0, return_inverse=True)
                choices[part], combinations = inverse.ravel(), unique.tolist()
            rows[part] = [self._row(part, tuple(one)) for one in combinations]
        return tables_of(rows), choices

    def _row(self, part: str, numbers: tuple[int, ...]) -> Row | None:
        """Return a part for some values of the axes that affect it; None if it is not valid."""
        rows = self._rows[part]
        if numbers not in rows:
            if len(rows) >= _KEPT_ROWS:
                rows.clear()
            changes = {
                self.axes[i].name: float(self.axes[i].values[number])
                for i, number in zip(self._affecting[part], numbers, strict=True)
            }
            try:
                rows[numbers] = _NUMBERS[part](self.system.replace(**changes))
            except InputError:
                rows[numbers] = None
        return rows[numbers]


def system_at(
    system: BrakedDriveline, axes: tuple[Axis, ...], numbers: tuple[int, ...]
) -> BrakedDriveline:
    """Return the system at one point; raise ``InputError`` if it is not valid."""
    changes: dict[str, Any] = {
        axis.name: float(axis.values[number])
        for axis, number in zip(axes, numbers, strict=True)
        if axis.name not in INITIAL
    }
    return system.replace(**changes)


def _affecting(system: BrakedDriveline, axes: tuple[Axis, ...], part: str) -> list[int]:
    """Return the numbers of the axes that can change a part: its own, and what groups read."""
    own = set(type(getattr(system, part)).model_fields)
    wanted = set(own)
    for axis in axes:
        if axis.name in SETTERS and SETTERS[axis.name].target in own:
            wanted |= {axis.name, *SETTERS[axis.name].reads}
    if "kinetic" in wanted:  # any parameter of the law may decide on its reference coefficient
        wanted |= set(type(system.friction).model_fields)
    return [i for i, axis in enumerate(axes) if axis.name in wanted]
