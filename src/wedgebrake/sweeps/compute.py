"""The results of some points of a sweep. What a chunk gives depends on nothing but the plan."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from wedgebrake.analysis import batch as kernel
from wedgebrake.analysis.evaluate_point import RESULT, clear
from wedgebrake.dynamics.enums import Outcome
from wedgebrake.errors import InputError
from wedgebrake.model.sweep_settings import INITIAL
from wedgebrake.model.system import BrakedDriveline
from wedgebrake.solvers.smooth.laws import brake_law
from wedgebrake.solvers.status import DIVERGED_FACTOR
from wedgebrake.sweeps.grid import batches
from wedgebrake.sweeps.plan import Plan
from wedgebrake.sweeps.results import VARIABLES, PointStatus
from wedgebrake.sweeps.system_tables import Parts, system_at

FloatArray = NDArray[np.float64]

# Periods that are worked on at once: some milliseconds, so that threads finish together and
# an interrupt is heard; a slow solver's points are worked on one by one.
_BATCH_PERIODS = 4000
# What a point that is given time to settle may take.
_SETTLING_PERIODS = 1000


class Chunk:
    """Some points of a plan, cut into batches that any threads may work on in any order.

    where : dim of the points -> slice of it
    """

    def __init__(self, plan: Plan, parts: Parts, where: dict[str, slice]) -> None:
        self._plan = plan
        self._sizes = {name: one.stop - one.start for name, one in where.items()}
        count = math.prod(self._sizes.values())
        offsets = [where[axis.dim].start for axis in plan.grid.axes]
        shape = [one.stop - one.start for one in where.values()]
        grid = np.indices(shape).reshape(len(shape), -1)[-len(offsets) :]
        self._indices = tuple(
            (one + offset).astype(np.int64) for one, offset in zip(grid, offsets, strict=True)
        )
        self._points = np.empty(count, dtype=RESULT)
        self._record = np.full(
            (count if plan.keep_points else 0, plan.protocol.recorded + 1, 2), np.nan
        )
        self._states = self._initial_states(count)
        if plan.method == "exact":
            self._tables, self._choices = parts.tables(self._indices)
        self.work: list[Callable[[], None]] = [
            self._task(numbers)
            for numbers in batches(self._sizes, plan.grid.follow, self._points_at_once())
        ]

    def results(self) -> dict[str, Any]:
        """The variables over the chunk, once all its work is done."""
        shape = tuple(self._sizes.values())
        results: dict[str, Any] = {}
        for name, variable in VARIABLES.items():
            if name in RESULT.names:
                results[name] = self._points[name].astype(variable.dtype).reshape(shape)
        results["transient"][results["motion"] < 0] = np.nan
        outcome = self._points["outcome"]
        status = np.full(outcome.size, PointStatus.INVALID, dtype=np.int8)
        for meaning in PointStatus:
            if meaning.name in Outcome.__members__:
                status[outcome == Outcome[meaning.name]] = meaning
        results["status"] = status.reshape(shape)
        if self._plan.keep_points:
            for i, name in enumerate(("angle", "velocity")):
                results[name] = np.ascontiguousarray(self._record[:, :, i]).reshape(*shape, -1)
        return results

    def _points_at_once(self) -> int:
        protocol = self._plan.protocol
        if self._plan.method != "exact":
            return self._lanes()
        wait = _SETTLING_PERIODS if protocol.automatic else protocol.first
        return max(1, _BATCH_PERIODS // (wait + protocol.recorded))

    def _lanes(self) -> int:
        """Points of a slow solver that are worked on at once: transients go side by side."""
        plan = self._plan
        if plan.method != "smooth" or plan.grid.follow is not None or not plan.protocol.first:
            return 1
        from wedgebrake.solvers.smooth.simd_batch import WIDTH

        return WIDTH

    def _initial_states(self, count: int) -> FloatArray:
        states = np.empty((count, 2))
        states[:] = self._plan.initial
        for column, name in enumerate(INITIAL):
            for axis, numbers in zip(self._plan.grid.axes, self._indices, strict=True):
                if axis.name == name:
                    states[:, column] = axis.values[numbers]
        return states

    def _task(self, numbers: NDArray[np.int64]) -> Callable[[], None]:
        run = self._run_exactly if self._plan.method == "exact" else self._run_simulated
        return lambda: run(numbers)

    def _run_exactly(self, numbers: NDArray[np.int64]) -> None:
        """A batch in one call of the kernel, which needs no Python and releases its lock."""
        plan, protocol = self._plan, self._plan.protocol
        points = np.empty(numbers.size, dtype=RESULT)
        kept = numbers if plan.keep_points else numbers[:0]
        record = self._record[kept]
        kernel.run(
            brake_law(plan.system.brake)[0],
            self._tables,
            self._choices[numbers],
            self._states[numbers],
            plan.grid.follow is not None,
            protocol.settings,
            DIVERGED_FACTOR,
            points,
            record,
        )
        self._points[numbers] = points
        self._record[kept] = record

    def _run_simulated(self, numbers: NDArray[np.int64]) -> None:
        """Point by point, by any solver."""
        from wedgebrake.analysis.classify_run import classify_run

        plan = self._plan
        systems = {number: self._system(number) for number in numbers}
        begun = self._begun({n: one for n, one in systems.items() if one is not None})
        before: tuple[float, float] | None = None
        for number, system in systems.items():
            initial = self._state(number)
            if plan.grid.follow is not None and before is not None:
                initial = before
            before = None
            if system is None:
                clear(self._points[number])
                continue
            result, record = classify_run(
                system, initial, plan.method, plan.protocol, begun.get(number)
            )
            self._points[number] = result
            if result.outcome == Outcome.COMPLETED:
                before = (float(result.final_angle), float(result.final_velocity))
            if plan.keep_points:
                self._record[number, : record.shape[0]] = record

    def _system(self, number: int) -> BrakedDriveline | None:
        """The system of a point; None where there is none."""
        place = tuple(int(one[number]) for one in self._indices)
        try:
            return system_at(self._plan.system, self._plan.grid.axes, place)
        except InputError:
            return None

    def _state(self, number: int) -> tuple[float, float]:
        return float(self._states[number, 0]), float(self._states[number, 1])

    def _begun(self, systems: dict[int, BrakedDriveline]) -> dict[int, Any]:
        """Transients that were run side by side."""
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


def compute(plan: Plan, where: dict[str, slice]) -> dict[str, Any]:
    """The results of a chunk, in this thread: what a worker of a cluster does."""
    chunk = Chunk(plan, Parts(plan.system, plan.grid.axes), where)
    for work in chunk.work:
        work()
    return chunk.results()
