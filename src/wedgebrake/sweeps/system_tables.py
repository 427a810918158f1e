"""The systems of a sweep as tables of numbers, one for each part of the machine.

A point of a sweep is five rows: of driveline, brake, friction, actuation and excitation.
A part is built, by ``BrakedDriveline.replace``, once for each combination of the swept
values that reach it; the product of all axes is never built.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from wedgebrake.errors import InputError
from wedgebrake.model.friction import SetValuedFriction
from wedgebrake.model.groups import SETTERS
from wedgebrake.model.sweep_settings import INITIAL
from wedgebrake.model.system import PARTS, BrakedDriveline
from wedgebrake.solvers.smooth.laws import brake_law
from wedgebrake.sweeps.axes import Axis

if TYPE_CHECKING:
    from wedgebrake.analysis.batch import Tables

# Rows that are remembered for the next chunk.
_REMEMBERED = 200_000


Row = tuple[Any, ...]


def _driveline(system: BrakedDriveline) -> Row:
    line = system.driveline
    return line.inertia, line.damping, line.stiffness, line.drive_speed


def _brake(system: BrakedDriveline) -> Row:
    return system.brake.radius, *brake_law(system.brake)[1]


def _friction(system: BrakedDriveline) -> Row:
    friction = system.friction
    assert isinstance(friction, SetValuedFriction)  # noqa: S101 - the front door has checked it
    speeds, kinetic = zip(*friction.nodes(), strict=True)
    return friction.breakaway, speeds, kinetic


def _actuation(system: BrakedDriveline) -> Row:
    force = system.actuation
    return force.initial_force, force.slope, float(force.release)


def _excitation(system: BrakedDriveline) -> Row:
    return system.excitation.amplitude, system.excitation.angular_frequency


# In the order in which the kernel takes them.
_NUMBERS: dict[str, Callable[[BrakedDriveline], Row]] = {
    "driveline": _driveline,
    "brake": _brake,
    "friction": _friction,
    "actuation": _actuation,
    "excitation": _excitation,
}


class Parts:
    """The part tables of a system and the axes swept on it."""

    def __init__(self, system: BrakedDriveline, axes: tuple[Axis, ...]) -> None:
        self.system, self.axes = system, axes
        self._reach = {part: _reaching(system, axes, part) for part in PARTS}
        self._rows: dict[str, dict[tuple[int, ...], Row | None]] = {part: {} for part in PARTS}

    def tables(self, indices: tuple[NDArray[np.int64], ...]) -> tuple[Tables, NDArray[np.record]]:
        """The tables for some points, and the rows of each point.

        indices : for each axis, (points,) numbers of its values
        """
        from wedgebrake.analysis.batch import CHOICE, tables_of

        rows: dict[str, list[Row | None]] = {}
        choices = np.zeros(indices[0].size, dtype=CHOICE)
        for part in PARTS:
            reach = self._reach[part]
            if not reach:
                rows[part] = [self._row(part, ())]
                continue
            own = np.stack([indices[i] for i in reach], axis=1)
            combinations, inverse = np.unique(own, axis=0, return_inverse=True)
            choices[part] = inverse.ravel()
            rows[part] = [self._row(part, tuple(one)) for one in combinations.tolist()]
        return tables_of(rows), choices

    def _row(self, part: str, numbers: tuple[int, ...]) -> Row | None:
        """The numbers of a part for some values of the axes that reach it; None if invalid."""
        rows = self._rows[part]
        if numbers not in rows:
            if len(rows) >= _REMEMBERED:
                rows.clear()
            changes = {
                self.axes[i].name: float(self.axes[i].values[number])
                for i, number in zip(self._reach[part], numbers, strict=True)
            }
            try:
                rows[numbers] = _NUMBERS[part](self.system.replace(**changes))
            except InputError:
                rows[numbers] = None
        return rows[numbers]


def system_at(
    system: BrakedDriveline, axes: tuple[Axis, ...], numbers: tuple[int, ...]
) -> BrakedDriveline:
    """The system at one point; raises ``InputError`` where there is none."""
    changes: dict[str, Any] = {
        axis.name: float(axis.values[number])
        for axis, number in zip(axes, numbers, strict=True)
        if axis.name not in INITIAL
    }
    return system.replace(**changes)


def _reaching(system: BrakedDriveline, axes: tuple[Axis, ...], part: str) -> list[int]:
    """Numbers of the axes that can change a part: its own, and what its groups read."""
    own = set(type(getattr(system, part)).model_fields)
    wanted = set(own)
    for axis in axes:
        if axis.name in SETTERS and SETTERS[axis.name].target in own:
            wanted |= {axis.name, *SETTERS[axis.name].reads}
    if "kinetic" in wanted:
        wanted.add("static")  # the one is no valid value without the other
    return [i for i, axis in enumerate(axes) if axis.name in wanted]
