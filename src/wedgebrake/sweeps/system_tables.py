"""The systems of a sweep as tables of numbers, one for each part of the machine.

A point of a sweep is a row of each of the five tables. A part is built, by
``BrakedDriveline.replace``, once for each combination of the swept values that affect it; the
product of all axes is never built.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from wedgebrake.errors import InputError
from wedgebrake.model.friction import SetValuedFriction
from wedgebrake.model.groups import SETTERS
from wedgebrake.model.sweep_settings import INITIAL
from wedgebrake.model.system import BrakedDriveline
from wedgebrake.solvers.smooth.laws import brake_law
from wedgebrake.sweeps.grid import Axis

FloatArray = NDArray[np.float64]
# Number of rows of a part that are kept for the next chunk.
_KEPT_ROWS = 200_000


class PartTables(NamedTuple):
    """Tables of the parts for some points.

    driveline ... excitation : a row for each different part; one that begins with nan is invalid
    node_speeds : (rows of friction, most nodes) sliding speeds [m/s] at which the law bends, nan
                  beyond the last
    rows        : (points, 5) row of each point in the tables
    """

    driveline: FloatArray
    brake: FloatArray
    friction: FloatArray
    actuation: FloatArray
    excitation: FloatArray
    node_speeds: FloatArray
    rows: NDArray[np.int64]


def _friction(system: BrakedDriveline) -> tuple[float, ...]:
    """Return the static coefficient, the kinetic ones at the nodes, and the speeds of those."""
    friction = system.friction
    assert isinstance(friction, SetValuedFriction)  # noqa: S101 - checked by choose_method
    speeds, coefficients = zip(*friction.nodes(), strict=True)
    return friction.breakaway, *coefficients, *speeds


# The numbers of each part, in the order of the columns of ``PartTables.rows``.
_NUMBERS: dict[str, Callable[[BrakedDriveline], tuple[float, ...]]] = {
    "driveline": lambda system: (
        system.driveline.inertia, system.driveline.damping, system.driveline.stiffness,
        system.driveline.drive_speed,
    ),
    "brake": lambda system: (system.brake.radius, *brake_law(system.brake)[1]),
    "friction": _friction,
    "actuation": lambda system: (
        system.actuation.initial_force, system.actuation.slope, system.actuation.release_speed,
    ),
    "excitation": lambda system: (
        system.excitation.amplitude, system.excitation.angular_frequency,
    ),
}  # fmt: skip
FRICTION = list(_NUMBERS).index("friction")


class Parts:
    """The parts of the systems that the axes make of a base system."""

    def __init__(self, system: BrakedDriveline, axes: tuple[Axis, ...]) -> None:
        self.system, self.axes = system, axes
        self._affecting = {part: _affecting(system, axes, part) for part in _NUMBERS}
        self._rows: dict[str, dict[tuple[int, ...], tuple[float, ...]]] = {
            part: {} for part in _NUMBERS
        }

    def tables(self, indices: tuple[NDArray[np.int64], ...]) -> PartTables:
        """Return the tables for some points.

        indices : for each axis, (points,) numbers of its values
        """
        tables: dict[str, list[tuple[float, ...]]] = {}
        rows = np.zeros((indices[0].size, len(_NUMBERS)), dtype=np.int64)
        for column, part in enumerate(_NUMBERS):
            affecting = self._affecting[part]
            combinations: list[list[int]] = [[]]
            if affecting:
                own = np.stack([indices[i] for i in affecting], axis=1)
                unique, inverse = np.unique(own, axis=0, return_inverse=True)
                rows[:, column], combinations = inverse.ravel(), unique.tolist()
            tables[part] = [self._row(part, tuple(one)) for one in combinations]
        # Laws may differ in their number of nodes.
        law = tables.pop("friction")
        nodes = [len(one) // 2 for one in law]
        coefficients = np.full((len(law), max(nodes) + 1), math.nan)
        speeds = np.full((len(law), max(nodes)), math.nan)
        for i, (one, count) in enumerate(zip(law, nodes, strict=True)):
            coefficients[i, : count + 1], speeds[i, :count] = one[: count + 1], one[count + 1 :]
        arrays = {part: np.array(table) for part, table in tables.items()}
        return PartTables(friction=coefficients, node_speeds=speeds, rows=rows, **arrays)

    def _row(self, part: str, numbers: tuple[int, ...]) -> tuple[float, ...]:
        """Return the numbers of a part for some values of the axes that affect it; nan: invalid."""
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
                rows[numbers] = (math.nan,) * len(_NUMBERS[part](self.system))
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
