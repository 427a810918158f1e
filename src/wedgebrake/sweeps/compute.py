"""Results of some points of a sweep, which depend on nothing but the plan.

The systems of a sweep are tables of numbers, one for each part of the system, and a point is a row
of each of them. A part is built, by ``BrakedDriveline.replace``, once for each combination of the
swept values that affect it; the product of all axes is never built.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from wedgebrake.analysis import batch as kernel
from wedgebrake.analysis.batch import CHOICE, Tables, tables_of
from wedgebrake.analysis.evaluate_point import EMPTY, RESULT
from wedgebrake.dynamics.enums import Outcome
from wedgebrake.errors import InputError
from wedgebrake.model.friction import SetValuedFriction
from wedgebrake.model.groups import SETTERS
from wedgebrake.model.machine import Machine
from wedgebrake.model.system import BrakedDriveline
from wedgebrake.solvers.smooth.laws import brake_law
from wedgebrake.solvers.status import DIVERGED_FACTOR
from wedgebrake.sweeps.chunk_points import ChunkPoints
from wedgebrake.sweeps.grid import Axis, batches
from wedgebrake.sweeps.machine_chunk import MachineChunk
from wedgebrake.sweeps.plan import Plan
from wedgebrake.sweeps.results import PointStatus

# Periods of a batch: some milliseconds, so that threads finish together and interrupts take
# effect soon. The points of a slow solver are computed one by one.
_BATCH_PERIODS = 4000
# Estimate of the periods in which a point settles.
_SETTLING_PERIODS = 1000
# Number of rows of a part that are kept for the next chunk.
_KEPT_ROWS = 200_000

Row = tuple[Any, ...]


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


class Chunk:
    """Some points of a plan, divided into batches that threads may compute in any order.

    where : dimension of the points -> slice of it
    """

    def __init__(self, plan: Plan, parts: Parts, where: Mapping[str, slice]) -> None:
        assert isinstance(plan.system, BrakedDriveline)  # noqa: S101 - machines have other chunks
        self._plan, self._base = plan, plan.system
        self._grid = ChunkPoints(plan, where)
        count = self._grid.count
        self._points = np.empty(count, dtype=RESULT)
        record = plan.protocol.recorded + 1
        self._record = np.full((count if plan.keep_points else 0, record, 2), np.nan)
        self._states = self._grid.initial_states()
        if plan.method == "exact":
            self._tables, self._choices = parts.tables(self._grid.indices)
        run = self._run_exactly if plan.method == "exact" else self._run_simulated
        self.work: list[Callable[[], None]] = [
            partial(run, numbers)
            for numbers in batches(self._grid.sizes, plan.grid.follow, self._batch_size())
        ]

    def results(self) -> dict[str, Any]:
        """Return the variables over the chunk, once all its work is done."""
        shape = tuple(self._grid.sizes.values())
        results: dict[str, Any] = {
            one.name: self._points[one.name].astype(one.dtype).reshape(shape)
            for one in self._plan.variables
            if one.name in (RESULT.names or ())
        }
        results["transient"][results["motion"] < 0] = np.nan
        status = np.full(self._points.size, PointStatus.INVALID, dtype=np.int8)
        for outcome in Outcome:
            if outcome.name in PointStatus.__members__:
                status[self._points["outcome"] == outcome] = PointStatus[outcome.name]
        results["status"] = status.reshape(shape)
        if self._plan.keep_points:
            for i, name in enumerate(("angle", "velocity")):
                results[name] = np.ascontiguousarray(self._record[:, :, i]).reshape(*shape, -1)
        return results

    def _batch_size(self) -> int:
        """Return the number of points of a batch."""
        protocol = self._plan.protocol
        if self._plan.method != "exact":
            return self._lanes()
        wait = _SETTLING_PERIODS if protocol.automatic else protocol.first
        return max(1, _BATCH_PERIODS // (wait + protocol.recorded))

    def _lanes(self) -> int:
        """Return how many transients of a slow solver are computed side by side."""
        plan = self._plan
        if plan.method != "smooth" or plan.grid.follow is not None or not plan.protocol.first:
            return 1
        from wedgebrake.solvers.smooth.simd_batch import WIDTH

        return WIDTH

    def _run_exactly(self, numbers: NDArray[np.int64]) -> None:
        """Compute a batch with the compiled kernel, which releases Python's lock."""
        plan = self._plan
        points = np.empty(numbers.size, dtype=RESULT)
        kept = numbers if plan.keep_points else numbers[:0]
        record = self._record[kept]
        kernel.run(
            brake_law(self._base.brake)[0],
            self._tables,
            self._choices[numbers],
            self._states[numbers],
            plan.grid.follow is not None,
            plan.protocol.settings,
            DIVERGED_FACTOR,
            points,
            record,
        )
        self._points[numbers] = points
        self._record[kept] = record

    def _run_simulated(self, numbers: NDArray[np.int64]) -> None:
        """Compute a batch point by point, with any solver."""
        from wedgebrake.analysis.classify_driveline import classify_driveline

        plan = self._plan
        systems = {int(number): self._system(int(number)) for number in numbers}
        transients = self._transients({n: one for n, one in systems.items() if one is not None})
        before: tuple[float, float] | None = None
        for number, system in systems.items():
            initial = self._state(number)
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

    def _system(self, number: int) -> BrakedDriveline | None:
        """Return the system of a point; None if it is not valid."""
        system = self._grid.system(number)
        assert not isinstance(system, Machine)  # noqa: S101 - machines have other chunks
        return system

    def _state(self, number: int) -> tuple[float, float]:
        return float(self._states[number, 0]), float(self._states[number, 1])

    def _transients(self, systems: Mapping[int, BrakedDriveline]) -> dict[int, Any]:
        """Return the ends of transients that are computed side by side."""
        protocol = self._plan.protocol
        if self._lanes() == 1:
            return {}
        from wedgebrake.solvers.smooth.assemble import problem
        from wedgebrake.solvers.smooth.solve_periods import advance_together, fits_lanes

        given = {
            number: problem(system, protocol.rtol, *self._state(number))
            for number, system in systems.items()
        }
        given = {number: one for number, one in given.items() if fits_lanes(one)}
        if not given:
            return {}
        states = self._states[list(given)]
        passed = advance_together(list(given.values()), states, protocol.first, protocol.max_steps)
        return dict(zip(given, passed, strict=True))


def chunks_of(plan: Plan) -> Callable[[Mapping[str, slice]], Chunk | MachineChunk]:
    """Return the function that divides off a chunk of a plan: dimension of the points -> slice."""
    if plan.as_machine:
        return partial(MachineChunk, plan)
    assert isinstance(plan.system, BrakedDriveline)  # noqa: S101 - machines are solved as such
    return partial(Chunk, plan, Parts(plan.system, plan.grid.axes))


def compute(plan: Plan, where: Mapping[str, slice]) -> dict[str, Any]:
    """Return the results of a chunk, computed in this thread as by a worker of a cluster."""
    chunk = chunks_of(plan)(where)
    for work in chunk.work:
        work()
    return chunk.results()
