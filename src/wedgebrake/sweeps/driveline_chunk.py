"""Computation of a chunk of a sweep of drivelines, with the solvers of one inertia.

The systems of a sweep are tables of numbers, one for each part of the system, and a point is a row
of each of them. A part is built, by ``BrakedDriveline.replace``, once for each combination of the
swept values that affect it; the product of all axes is never built.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from wedgebrake.analysis.driveline_motion import batch as kernel
from wedgebrake.analysis.driveline_motion.evaluate_point import EMPTY, RESULT
from wedgebrake.analysis.driveline_motion.part_tables import CHOICE, Tables, tables_of
from wedgebrake.dynamics.enums import Outcome
from wedgebrake.errors import InputError
from wedgebrake.model.groups import SETTERS
from wedgebrake.model.system import BrakedDriveline
from wedgebrake.solvers.smooth.laws import brake_law
from wedgebrake.solvers.status import DIVERGED_FACTOR
from wedgebrake.sweeps.grid import Axis
from wedgebrake.sweeps.plan import Chunk, Plan
from wedgebrake.sweeps.results import PointStatus

# Periods of a batch: some milliseconds, so that threads finish together and interrupts take
# effect soon. The points of a slow solver are computed one by one.
_BATCH_PERIODS = 4000
# Estimate of the periods in which a point settles.
_SETTLING_PERIODS = 400
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


def _affecting(system: BrakedDriveline, axes: tuple[Axis, ...], part: str) -> list[int]:
    """Return the numbers of the axes that can change a part: its own, and what groups read."""
    fields = type(getattr(system, part)).model_fields
    own = {name for name in fields if system.owner(name) == part}
    wanted = set(own)
    for axis in axes:
        if axis.name in SETTERS and SETTERS[axis.name].target in own:
            wanted |= {axis.name, *SETTERS[axis.name].reads}
    if "kinetic" in wanted:  # any parameter of the law may decide on its reference coefficient
        wanted |= set(type(system.friction).model_fields)
    return [i for i, axis in enumerate(axes) if axis.name in wanted]


class DrivelineChunk(Chunk):
    """Points of drivelines with their own solvers, as records of ``evaluate_point.RESULT``."""

    def __init__(self, plan: Plan, where: Mapping[str, slice]) -> None:
        super().__init__(plan, where)
        self._points = np.empty(self.count, dtype=RESULT)
        record = plan.protocol.recorded + 1
        self._record = np.full((self.count if plan.keep_points else 0, record, 2), np.nan)

    def results(self) -> dict[str, Any]:
        """Return the variables over the chunk, once all its work is done."""
        results: dict[str, Any] = {
            one.name: self.shaped(self._points[one.name].astype(one.dtype))
            for one in self.plan.variables
            if one.name in (RESULT.names or ())
        }
        results["transient"][results["motion"] < 0] = np.nan
        status = np.full(self.count, PointStatus.INVALID, dtype=np.int8)
        for outcome in Outcome:
            if outcome.name in PointStatus.__members__:
                status[self._points["outcome"] == outcome] = PointStatus[outcome.name]
        results["status"] = self.shaped(status)
        if self.plan.keep_points:
            for i, name in enumerate(("angle", "velocity")):
                results[name] = self.shaped(np.ascontiguousarray(self._record[:, :, i]))
        return results


class ExactChunk(DrivelineChunk):
    """Points that the compiled kernel computes."""

    def __init__(self, plan: Plan, parts: Parts, where: Mapping[str, slice]) -> None:
        super().__init__(plan, where)
        self._tables, self._choices = parts.tables(self.indices)

    def _batch_size(self) -> int:
        protocol = self.plan.protocol
        wait = _SETTLING_PERIODS if protocol.automatic else protocol.first
        return max(1, _BATCH_PERIODS // (wait + protocol.recorded))

    def _run(self, numbers: NDArray[np.int64]) -> None:
        """Compute a batch with the compiled kernel, which releases Python's lock."""
        plan = self.plan
        points = np.empty(numbers.size, dtype=RESULT)
        kept = numbers if plan.keep_points else numbers[:0]
        record = self._record[kept]
        kernel.run(
            brake_law(plan.system.brake)[0],
            self._tables,
            self._choices[numbers],
            self.states[numbers],
            plan.grid.follow is not None,
            plan.protocol.settings,
            DIVERGED_FACTOR,
            points,
            record,
        )
        self._points[numbers] = points
        self._record[kept] = record


class SimulatedChunk(DrivelineChunk):
    """Points that are computed one by one, with any solver."""

    def _batch_size(self) -> int:
        """Number of transients of a slow solver that are computed side by side."""
        plan = self.plan
        if plan.method != "smooth" or plan.grid.follow is not None or not plan.protocol.first:
            return 1
        from wedgebrake.solvers.smooth.simd_batch import WIDTH

        return WIDTH

    def _run(self, numbers: NDArray[np.int64]) -> None:
        from wedgebrake.analysis.driveline_motion.classify_driveline import classify_driveline

        plan = self.plan
        systems = {int(number): self.system(int(number)) for number in numbers}
        transients = self._transients({n: one for n, one in systems.items() if one is not None})
        before: tuple[float, float] | None = None
        for number, system in systems.items():
            initial = self.state(number)
            if plan.grid.follow is not None and before is not None:
                initial = before
            before = None
            if system is None:
                self._points[number] = EMPTY[0]
                continue
            result, record = classify_driveline(
                system, initial, plan.method, plan.protocol, transients.get(number)
            )
            self._points[number] = result
            if result.outcome == Outcome.COMPLETED:
                before = (float(result.final_angle), float(result.final_velocity))
            if plan.keep_points:
                self._record[number, : record.shape[0]] = record

    def _transients(self, systems: Mapping[int, BrakedDriveline]) -> dict[int, Any]:
        """Return the ends of transients that are computed side by side."""
        protocol = self.plan.protocol
        if self._batch_size() == 1:
            return {}
        from wedgebrake.solvers.smooth.assemble import problem
        from wedgebrake.solvers.smooth.solve_periods import advance_together, fits_lanes

        given = {
            number: problem(system, protocol.rtol, *self.state(number))
            for number, system in systems.items()
        }
        given = {number: one for number, one in given.items() if fits_lanes(one)}
        if not given:
            return {}
        states = self.states[list(given)]
        passed = advance_together(list(given.values()), states, protocol.first, protocol.max_steps)
        return dict(zip(given, passed, strict=True))
