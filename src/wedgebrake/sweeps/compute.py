"""Results of some points of a sweep, which depend on nothing but the plan."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from wedgebrake.analysis import batch as kernel
from wedgebrake.analysis import evaluate_point
from wedgebrake.dynamics import enums
from wedgebrake.errors import InputError
from wedgebrake.model.sweep_settings import INITIAL
from wedgebrake.model.system import BrakedDriveline
from wedgebrake.solvers.smooth.laws import brake_law
from wedgebrake.solvers.status import DIVERGED_FACTOR
from wedgebrake.sweeps.grid import batches
from wedgebrake.sweeps.plan import Plan
from wedgebrake.sweeps.results import VARIABLES, PointStatus
from wedgebrake.sweeps.system_tables import FRICTION, Parts, system_at

FloatArray = NDArray[np.float64]

# Periods of a batch: some milliseconds, so that threads finish together and interrupts take
# effect soon. The points of a slow solver are computed one by one.
_BATCH_PERIODS = 4000
# Estimate of the periods in which a point settles.
_SETTLING_PERIODS = 1000

_COLUMNS = {
    "motion": evaluate_point.CLASS,
    "order": evaluate_point.ORDER,
    "stick_class": evaluate_point.STICK_CLASS,
    "sticks_forward": evaluate_point.STICKS_FORWARD,
    "sticks_backward": evaluate_point.STICKS_BACKWARD,
    "stick_share": evaluate_point.STICK_SHARE,
    "largest_exponent": evaluate_point.LARGEST_EXPONENT,
    "second_exponent": evaluate_point.SECOND_EXPONENT,
    "exponent_error": evaluate_point.EXPONENT_ERROR,
    "return_distance": evaluate_point.RETURN_DISTANCE,
    "size": evaluate_point.SIZE,
    "transient": evaluate_point.TRANSIENT,
    "settling": evaluate_point.SETTLING,
    "peak_torque": evaluate_point.PEAK_TORQUE,
    "friction_power": evaluate_point.FRICTION_POWER,
    "sliding_damping": evaluate_point.SLIDING_DAMPING,
    "events": evaluate_point.EVENTS,
    "final_angle": evaluate_point.FINAL_THETA,
    "final_velocity": evaluate_point.FINAL_W,
}
_STATUS = {
    enums.COMPLETED: PointStatus.COMPLETED,
    enums.DIVERGED: PointStatus.DIVERGED,
    enums.NO_SLIDING: PointStatus.NO_FORWARD_SOLUTION,
    enums.EVENT_LIMIT: PointStatus.EVENT_LIMIT,
    enums.STEP_LIMIT: PointStatus.STEP_LIMIT,
}


_FINAL = [evaluate_point.FINAL_THETA, evaluate_point.FINAL_W]


class Chunk:
    """Some points of a plan, divided into batches that threads may compute in any order.

    where : dimension of the points -> slice of it
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
        self._answers = np.empty((count, evaluate_point.COLUMNS))
        self._record = np.full(
            (count if plan.keep_points else 0, plan.protocol.recorded + 1, 2), np.nan
        )
        self._states = self._initial_states(count)
        if plan.method == "exact":
            self._tables = parts.tables(self._indices)
        self.work: list[Callable[[], None]] = [
            self._task(numbers)
            for numbers in batches(self._sizes, plan.grid.follow, self._points_at_once())
        ]

    def results(self) -> dict[str, Any]:
        """Return the variables over the chunk, once all its work is done."""
        shape = tuple(self._sizes.values())
        results: dict[str, Any] = {}
        for name, column in _COLUMNS.items():
            variable = VARIABLES[name]
            values = self._answers[:, column]
            if np.dtype(variable.dtype).kind == "i":
                values = np.where(np.isnan(values), variable.fill, values)
            results[name] = values.astype(variable.dtype).reshape(shape)
        outcome = self._answers[:, evaluate_point.OUTCOME]
        status = np.full(outcome.size, PointStatus.INVALID, dtype=np.int8)
        for code, meaning in _STATUS.items():
            status[outcome == code] = meaning
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
        """Return how many transients of a slow solver are computed side by side."""
        plan = self._plan
        if plan.method != "smooth" or plan.grid.follow is not None or not plan.protocol.first:
            return 1
        from wedgebrake.solvers.smooth.batch import WIDTH

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
        """Compute a batch with the compiled kernel, which releases Python's lock."""
        plan, protocol, tables = self._plan, self._plan.protocol, self._tables
        answers = np.empty((numbers.size, evaluate_point.COLUMNS))
        record = self._record[numbers if plan.keep_points else numbers[:0]]
        states = self._states[numbers]
        for part, speeds in self._equal_node_speeds(numbers):
            start = part.start
            if plan.grid.follow is not None and start and _completed(answers[start - 1]):
                states[start] = answers[start - 1, _FINAL]
            kernel.run(
                brake_law(plan.system.brake)[0],
                speeds,
                tables.driveline,
                tables.brake,
                np.ascontiguousarray(tables.friction[:, : speeds.size + 1]),
                tables.actuation,
                tables.excitation,
                tables.rows[numbers[part]],
                states[part],
                plan.grid.follow is not None,
                -1 if protocol.automatic else protocol.first,
                protocol.recorded,
                protocol.limit,
                protocol.max_events,
                DIVERGED_FACTOR,
                answers[part],
                record[part],
            )
        self._answers[numbers] = answers
        if plan.keep_points:
            self._record[numbers] = record

    def _equal_node_speeds(self, numbers: NDArray[np.int64]) -> Iterator[tuple[slice, FloatArray]]:
        """Iterate over runs of points whose friction laws bend at equal speeds."""
        rows = self._tables.rows[numbers, FRICTION]
        speeds = self._tables.node_speeds
        changed = (rows[1:] != rows[:-1]) & _differ(speeds[rows[1:]], speeds[rows[:-1]])
        ends = [0, *(np.flatnonzero(changed) + 1).tolist(), numbers.size]
        for start, stop in pairwise(ends):
            own = speeds[rows[start]]
            yield slice(start, stop), own[~np.isnan(own)]

    def _run_simulated(self, numbers: NDArray[np.int64]) -> None:
        """Compute a batch point by point, with any solver."""
        from wedgebrake.analysis.classify_run import judge

        plan = self._plan
        systems = {number: self._system(number) for number in numbers}
        transients = self._transients({n: one for n, one in systems.items() if one is not None})
        before: FloatArray | None = None
        for number, system in systems.items():
            initial = self._state(number)
            if plan.grid.follow is not None and before is not None:
                initial = float(before[_FINAL][0]), float(before[_FINAL][1])
            if system is None:
                self._answers[number], before = np.nan, None
                continue
            answer, record = judge(
                system, initial, plan.method, plan.protocol, transients.get(number)
            )
            self._answers[number] = answer
            before = answer if _completed(answer) else None
            if plan.keep_points:
                self._record[number, : record.shape[0]] = record

    def _system(self, number: int) -> BrakedDriveline | None:
        """Return the system of a point; None if it is not valid."""
        place = tuple(int(one[number]) for one in self._indices)
        try:
            return system_at(self._plan.system, self._plan.grid.axes, place)
        except InputError:
            return None

    def _state(self, number: int) -> tuple[float, float]:
        return float(self._states[number, 0]), float(self._states[number, 1])

    def _transients(self, systems: dict[int, BrakedDriveline]) -> dict[int, Any]:
        """Return the ends of transients that are computed side by side."""
        protocol = self._plan.protocol
        if self._lanes() == 1:
            return {}
        from wedgebrake.solvers.smooth.batch import advance_together, fits
        from wedgebrake.solvers.smooth.solve import problem

        given = {
            number: problem(system, protocol.rtol, *self._state(number))
            for number, system in systems.items()
        }
        given = {number: one for number, one in given.items() if fits(one)}
        if not given:
            return {}
        states = self._states[list(given)]
        passed = advance_together(list(given.values()), states, protocol.first, protocol.max_steps)
        return dict(zip(given, passed, strict=True))


def _completed(answer: FloatArray) -> bool:
    return bool(answer[evaluate_point.OUTCOME] == enums.COMPLETED)


def _differ(speeds: FloatArray, others: FloatArray) -> NDArray[np.bool_]:
    """Return for each row whether it differs; two rows of nan belong to invalid laws."""
    equal = (speeds == others) | (np.isnan(speeds) & np.isnan(others))
    return np.asarray(~equal.all(axis=1))


def compute(plan: Plan, where: dict[str, slice]) -> dict[str, Any]:
    """Return the results of a chunk, computed in this thread as by a worker of a cluster."""
    chunk = Chunk(plan, Parts(plan.system, plan.grid.axes), where)
    for work in chunk.work:
        work()
    return chunk.results()
