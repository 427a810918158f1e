"""Computation of a chunk of a sweep: its points in batches that threads compute in any order."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from wedgebrake.analysis.driveline_motion.evaluate_point import RESULT
from wedgebrake.analysis.evaluate import Evaluator
from wedgebrake.analysis.linear_stability import linearisation_of, sliding_damping
from wedgebrake.analysis.machine_motion.result import MachineResult, with_free_angle
from wedgebrake.dynamics.enums import Outcome
from wedgebrake.errors import InputError
from wedgebrake.model.machine import Machine
from wedgebrake.model.machine_parts import speed_at
from wedgebrake.model.signals.signals import Signal
from wedgebrake.solvers.machine.final_state import FinalState, carried
from wedgebrake.solvers.status import DIVERGED_FACTOR
from wedgebrake.sweeps.grid import batches
from wedgebrake.sweeps.part_rows import PartRows
from wedgebrake.sweeps.plan import Plan
from wedgebrake.sweeps.results import PointStatus

# Periods of a batch of the compiled kernel: some 50 ms, so that interrupts take effect soon and
# threads seldom wait for the interpreter; and fewest batches of a chunk, so that threads finish
# at about the same time.
_BATCH_PERIODS, _FEWEST_BATCHES = 20_000, 2
# Estimate of the periods in which a point settles.
_SETTLING_PERIODS = 400
# Points of a batch that series solve: a fraction of a second.
_BATCH = 8
# The status of a point by its outcome.
_STATUS = np.full(max(Outcome) + 1, PointStatus.INVALID, np.int8)
for _outcome in Outcome:
    if _outcome.name in PointStatus.__members__:
        _STATUS[_outcome] = PointStatus[_outcome.name]


class Chunk:
    """Points of a plan, numbered from 0, in batches that threads may compute in any order.

    rows  : tables of the points, if they have the closed form of one inertia
    where : slice of each dimension of the points, by name

    sizes   : points along each dimension;  count : all of them
    indices : for each axis of the plan, (count,) indices of its values
    work    : one function for each batch
    """

    def __init__(self, plan: Plan, rows: PartRows | None, where: Mapping[str, slice]) -> None:
        self.plan, self._rows = plan, rows
        self.sizes = {dim: one.stop - one.start for dim, one in where.items()}
        self.count: int = math.prod(self.sizes.values())
        places = dict(zip(where, np.indices(tuple(self.sizes.values())), strict=True))
        self.indices = tuple(
            (places[axis.dim].ravel() + where[axis.dim].start).astype(np.int64)
            for axis in plan.grid.axes
        )
        # Shape of each variable at a point.
        self._shapes = {one.name: plan.shape(one) for one in plan.variables}
        self._results = {
            one.name: np.full((self.count, *self._shapes[one.name]), one.fill, one.dtype)
            for one in plan.variables
        }
        self._complete = np.zeros(self.count, bool)
        # Those of finished batches, with what they have prepared.
        self._idle: list[Evaluator] = []
        # The points that the compiled kernel has computed, and its results.
        self._compiled = np.zeros(self.count, bool)
        if rows is not None:
            self._points = np.empty(self.count, RESULT)
            self._record = np.full((self.count, plan.record_size, 2), np.nan)
            self._tables, self._choices, self._complete = rows.tables(self.indices)
            self._states = self._initial_states()
        self.work: list[Callable[[], None]] = [
            partial(self._run, numbers)
            for numbers in batches(self.sizes, plan.grid.follow, self._batch_size())
        ]

    def results(self) -> dict[str, Any]:
        """Return the variables over the chunk, once all its work is done."""
        self._set_compiled()
        sizes = self.sizes.values()
        return {name: one.reshape(*sizes, *one.shape[1:]) for name, one in self._results.items()}

    def _batch_size(self) -> int:
        """Number of points of a batch."""
        protocol, follow = self.plan.protocol, self.plan.grid.follow
        if self._rows is not None:
            wait = _SETTLING_PERIODS if protocol.automatic else protocol.first
            most = max(1, _BATCH_PERIODS // (wait + protocol.recorded))
            return min(most, -(-self.count // _FEWEST_BATCHES))
        if self.plan.line is None or follow is not None:
            return _BATCH
        if self.plan.method == "exact" or not protocol.first:
            return 1
        from wedgebrake.solvers.smooth.simd_batch import WIDTH

        return WIDTH  # of which the transients are computed side by side

    def _initial_states(self) -> NDArray[np.float64]:
        """Initial angle [rad] and velocity [rad/s] of one inertia at each point, (count, 2)."""
        plan, states = self.plan, np.empty((self.count, 2))
        (inertia,) = plan.system.machine_at({}, plan.initial).inertias
        states[:] = inertia.angle, speed_at(inertia, 0.0)
        for axis, numbers in zip(plan.grid.axes, self.indices, strict=True):
            for column, name in enumerate(plan.system.initial_conditions):
                if axis.name == name:
                    states[:, column] = axis.values[numbers]
        return states

    def _run(self, numbers: NDArray[np.int64]) -> None:
        """Compute a batch; with ``follow`` each point starts from the previous final state."""
        complete = self._complete[numbers]
        if self.plan.grid.follow is not None and not complete.all():
            complete[:] = False
        if complete.any():
            self._run_compiled(numbers[complete])
        if not complete.all():
            evaluator = self._evaluator()
            self._run_each(numbers[~complete], evaluator)
            self._idle.append(evaluator)

    def _run_compiled(self, numbers: NDArray[np.int64]) -> None:
        """Compute a batch with the compiled kernel, which releases Python's lock."""
        from wedgebrake.analysis.driveline_motion import batch as kernel

        plan, rows = self.plan, self._rows
        assert rows is not None  # noqa: S101 - the batch has rows
        points = np.empty(numbers.size, dtype=RESULT)
        kept = numbers if plan.keep_points else numbers[:0]
        record = self._record[kept]
        follow = plan.grid.follow is not None
        kernel.run(
            rows.law, self._tables, self._choices[numbers], self._states[numbers], follow,
            plan.protocol.settings, DIVERGED_FACTOR, points, record,
        )  # fmt: skip
        self._points[numbers], self._record[kept] = points, record
        self._compiled[numbers] = True

    def _set_compiled(self) -> None:
        """Set the results of the points that the compiled kernel has computed."""
        numbers = np.flatnonzero(self._compiled)
        if not numbers.size:
            return
        points, record = self._points[numbers], self._record[numbers]
        values = {name: points[name] for name in RESULT.names or ()}
        values |= {"angle": record[..., 0], "velocity": record[..., 1]}
        values["status"] = _STATUS[points["outcome"]]
        choices, tables = self._choices[numbers], self._tables
        period = 2.0 * math.pi / tables.excitation["angular_frequency"][choices["excitation"]]
        values["motion_period"] = np.where(points["order"], points["order"] * period, math.nan)
        if "exponents" in self._shapes:
            free = tables.driveline["stiffness"][choices["driveline"]] == 0.0
            values["exponents"] = _exponents(points, free)
        for name, shape in self._shapes.items():
            self._results[name][numbers] = values[name].reshape(numbers.size, *shape)

    def _evaluator(self) -> Evaluator:
        """One that no thread uses now."""
        try:
            return self._idle.pop()
        except IndexError:
            return Evaluator(self.plan.protocol, self.plan.method)

    def _run_each(self, numbers: NDArray[np.int64], evaluator: Evaluator) -> None:
        """Compute a batch point by point."""
        machines = {int(number): self._machine(int(number)) for number in numbers}
        valid = {number: one for number, one in machines.items() if one is not None}
        for number in machines.keys() - valid.keys():
            self._results["status"][number] = PointStatus.INVALID
        if self.plan.grid.follow is None:
            results = evaluator.results(list(valid.values()))
            for (number, machine), result in zip(valid.items(), results, strict=True):
                self._store(number, machine, result)
            return
        before: FinalState | None = None
        for number, one in machines.items():
            if one is None:
                before = None
                continue
            result = evaluator.result(one, None if before is None else carried(before, one))
            before = result.final if result.outcome == Outcome.COMPLETED else None
            self._store(number, one, result)

    def _machine(self, number: int) -> Machine | None:
        """The machine of a point; None if it is not valid."""
        values = {
            name: float(axis.values[numbers[number]])
            for axis, numbers in zip(self.plan.grid.axes, self.indices, strict=True)
            for name in axis.parameters
        }
        try:
            machine: Machine = self.plan.system.machine_at(values, self.plan.initial)
        except InputError:
            return None
        return machine

    def _store(self, number: int, machine: Machine, result: MachineResult) -> None:
        """Store the result of a point, in the shapes of the view of the system."""
        values = _of_motion(result) | _of_parts(result, self.plan.record_size)
        if "exponents" in self._shapes:
            exponents = self._results["exponents"][number]
            known = result.exponents[: exponents.size]
            exponents[: known.size] = known
        else:
            values |= _of_one_inertia(machine, result, self.plan.method)
        for name, value in values.items():
            if name in self._shapes:
                self._results[name][number] = np.reshape(value, self._shapes[name])


def _exponents(points: NDArray[Any], free: NDArray[np.bool_]) -> NDArray[np.float64]:
    """Exponents of compiled points, (count, 2); without that of a free angle, which is 0."""
    both = np.stack([points["largest_exponent"], points["second_exponent"]], axis=1)
    dropped = free & (np.abs(both[:, 0]) <= np.abs(both[:, 1]))
    both[dropped] = both[dropped][:, ::-1]
    both[free, 1] = math.nan
    return both


def _of_motion(result: MachineResult) -> dict[str, Any]:
    """Return the values of a motion as a whole."""
    return {
        "motion": result.motion,
        "order": result.order,
        "motion_period": result.period,
        "exponent_error": result.exponent_error,
        "return_distance": result.return_distance,
        "size": result.size,
        "transient": result.transient,
        "settling": result.settling,
        "events": result.events,
        "status": PointStatus[result.outcome.name],
    }


def _of_parts(result: MachineResult, record_size: int) -> dict[str, Any]:
    """Return values over contacts or inertias, in the last dimension."""
    n, found = result.vibration.rms_velocity.size, result.contacts
    values = {
        "stick_class": found.stick_class,
        "sticks_forward": found.sticks[:, 0],
        "sticks_backward": found.sticks[:, 1],
        "stick_share": found.stick_share,
        "peak_torque": found.peak_torque,
        "friction_power": found.friction_power,
        **result.vibration._asdict(),
    }
    if result.low.size:
        values["lowest_velocity"] = result.low[n : 2 * n]
        values["highest_velocity"] = result.high[n : 2 * n]
    if record_size and result.points.size:
        points = np.full((record_size, result.points.shape[1]), np.nan)
        count = min(len(result.points), record_size)
        points[:count] = result.points[:count]
        values["angle"], values["velocity"] = points[:, :n], points[:, n : 2 * n]
    return values


def _of_one_inertia(machine: Machine, result: MachineResult, method: str) -> dict[str, Any]:
    """Return values that need one inertia with one contact."""
    largest, second = [*with_free_angle(result.exponents), math.nan][:2]
    values = {"largest_exponent": largest, "second_exponent": second}
    if result.final is not None:
        (values["final_angle"],) = result.final.angles.values()
        (values["final_velocity"],) = result.final.speeds.values()
    (contact,) = machine.contacts
    # With a lag the damping alone does not decide on stability; with signals it varies.
    if contact.actuation.immediate and not isinstance(contact.base_speed, Signal):
        values["sliding_damping"] = sliding_damping(machine, linearisation_of(method))
    return values
