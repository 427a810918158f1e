"""The systems of a sweep as tables of numbers, one for each part of the machine.

A point of a sweep is five rows: of driveline, brake, friction, actuation and excitation.
A part is built, by ``BrakedDriveline.replace``, once for each combination of the swept
values that reach it; the product of all axes is never built.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from wedgebrake.errors import InputError
from wedgebrake.model.friction import SetValuedFriction
from wedgebrake.model.groups import SETTERS
from wedgebrake.model.sweep_settings import INITIAL
from wedgebrake.model.system import PARTS, BrakedDriveline
from wedgebrake.solvers.smooth.laws import brake_law
from wedgebrake.sweeps.axes import Axis

FloatArray = NDArray[np.float64]
# Rows that are remembered for the next chunk.
_REMEMBERED = 200_000


def _driveline(system: BrakedDriveline) -> tuple[float, ...]:
    line = system.driveline
    return line.inertia, line.damping, line.stiffness, line.drive_speed


def _brake(system: BrakedDriveline) -> tuple[float, ...]:
    return system.brake.radius, *brake_law(system.brake)[1]


def _friction(system: BrakedDriveline) -> tuple[float, ...]:
    friction = system.friction
    assert isinstance(friction, SetValuedFriction)  # noqa: S101 - the front door has checked it
    return friction.breakaway, *(m for _, m in friction.nodes())


def _actuation(system: BrakedDriveline) -> tuple[float, ...]:
    force = system.actuation
    return force.initial_force, force.slope, force.release_speed


def _excitation(system: BrakedDriveline) -> tuple[float, ...]:
    return system.excitation.amplitude, system.excitation.angular_frequency


# In the order in which the kernel takes them.
_NUMBERS: dict[str, Callable[[BrakedDriveline], tuple[float, ...]]] = {
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
        self._rows: dict[str, dict[tuple[int, ...], tuple[float, ...]]] = {
            part: {} for part in PARTS
        }

    def tables(
        self, indices: tuple[NDArray[np.int64], ...]
    ) -> tuple[list[FloatArray], NDArray[np.int64]]:
        """The five tables for some points, and the rows of each point, (points, 5).

        indices : for each axis, (points,) numbers of its values
        """
        tables: list[FloatArray] = []
        chosen = np.zeros((indices[0].size, len(PARTS)), dtype=np.int64)
        for column, part in enumerate(PARTS):
            reach = self._reach[part]
            if not reach:
                tables.append(np.array([self._row(part, ())]))
                continue
            own = np.stack([indices[i] for i in reach], axis=1)
            combinations, inverse = np.unique(own, axis=0, return_inverse=True)
            chosen[:, column] = inverse.ravel()
            tables.append(np.array([self._row(part, tuple(one)) for one in combinations.tolist()]))
        return tables, chosen

    def _row(self, part: str, numbers: tuple[int, ...]) -> tuple[float, ...]:
        """The numbers of a part for some values of the axes that reach it; nan if invalid."""
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
                rows[numbers] = (math.nan,) * len(_NUMBERS[part](self.system))
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
