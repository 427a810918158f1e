"""Computation of a chunk of a sweep of machines, or of drivelines solved as machines."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from wedgebrake.analysis.linear_stability import sliding_damping
from wedgebrake.analysis.machine_motion.classify_machine import Classifier
from wedgebrake.analysis.machine_motion.result import MachineResult
from wedgebrake.dynamics.enums import Outcome
from wedgebrake.model.machine import Machine
from wedgebrake.model.system import BrakedDriveline
from wedgebrake.solvers.machine.final_state import FinalState
from wedgebrake.sweeps.chunk_points import ChunkPoints
from wedgebrake.sweeps.grid import batches
from wedgebrake.sweeps.plan import Plan
from wedgebrake.sweeps.results import PointStatus

# Points of a batch: a fraction of a second, so that interrupts take effect soon.
_BATCH = 8


class MachineChunk:
    """Points of a plan, divided into batches that threads may compute in any order.

    where : slice of each dimension of the points, by name
    """

    def __init__(self, plan: Plan, where: Mapping[str, slice]) -> None:
        self._plan, self._points = plan, ChunkPoints(plan, where)
        self._results = {
            one.name: np.full((self._points.count, *plan.shape(one)), one.fill, one.dtype)
            for one in plan.variables
        }
        self.work: list[Callable[[], None]] = [
            partial(self._run, numbers)
            for numbers in batches(self._points.sizes, plan.grid.follow, _BATCH)
        ]

    def results(self) -> dict[str, Any]:
        """Return the variables of the chunk after all batches have been computed."""
        return {name: self._points.shaped(values) for name, values in self._results.items()}

    def _run(self, numbers: NDArray[np.int64]) -> None:
        """Compute a batch, point by point; with ``follow`` each from the previous final state."""
        before: FinalState | None = None
        classifier = Classifier(self._plan.protocol, self._plan.method)
        for number in numbers:
            changed = self._points.system(int(number))
            if changed is None:
                self._results["status"][number] = PointStatus.INVALID
                before = None
                continue
            machine = self._machine(int(number), changed)
            start = before if self._plan.grid.follow is not None else None
            result = classifier.result(machine, start)
            before = result.final if result.outcome == Outcome.COMPLETED else None
            self._store(int(number), result)
            if isinstance(changed, BrakedDriveline) and changed.plain:
                self._results["sliding_damping"][number] = sliding_damping(changed)

    def _machine(self, number: int, changed: BrakedDriveline | Machine) -> Machine:
        """Return the machine of a point with its initial state."""
        if isinstance(changed, Machine):
            return changed
        return changed.machine_at(*self._points.initial(number))

    def _store(self, number: int, result: MachineResult) -> None:
        """Store the result of a run."""
        own = isinstance(self._plan.system, Machine)
        values = {
            **(self._of_machine(result) if own else self._of_driveline(result)),
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
        for name, value in values.items():
            self._results[name][number] = value

    def _of_machine(self, result: MachineResult) -> dict[str, Any]:
        """Return values over inertias, contacts and exponents."""
        n, found = len(result.final.speeds) if result.final else 0, result.contacts
        points = self._returns(result)
        exponents = np.full(self._results["exponents"].shape[1], math.nan)
        count = min(exponents.size, result.exponents.size)
        exponents[:count] = result.exponents[:count]
        return {
            "stick_class": found.stick_class,
            "sticks_forward": found.sticks[:, 0],
            "sticks_backward": found.sticks[:, 1],
            "stick_share": found.stick_share,
            "peak_torque": found.peak_torque,
            "friction_power": found.friction_power,
            "lowest_velocity": result.low[n : 2 * n] if result.low.size else math.nan,
            "highest_velocity": result.high[n : 2 * n] if result.low.size else math.nan,
            **result.vibration._asdict(),
            "exponents": exponents,
            **({"angle": points[:, :n], "velocity": points[:, n : 2 * n]} if points.size else {}),
        }

    def _of_driveline(self, result: MachineResult) -> dict[str, Any]:
        """Return values of a driveline, which has one contact and one inertia."""
        found, exponents = result.contacts, [*result.exponents, math.nan][:2]
        points = self._returns(result)
        final = result.final
        return {
            "stick_class": found.stick_class[0],
            "sticks_forward": found.sticks[0, 0],
            "sticks_backward": found.sticks[0, 1],
            "stick_share": found.stick_share[0],
            "peak_torque": found.peak_torque[0],
            "friction_power": found.friction_power[0],
            "lowest_velocity": result.low[1] if result.low.size else math.nan,
            "highest_velocity": result.high[1] if result.low.size else math.nan,
            **{name: one[0] for name, one in result.vibration._asdict().items()},
            "largest_exponent": exponents[0],
            "second_exponent": exponents[1],
            "final_angle": final.angles["driveline"] if final else math.nan,
            "final_velocity": final.speeds["driveline"] if final else math.nan,
            **({"angle": points[:, 0], "velocity": points[:, 1]} if points.size else {}),
        }

    def _returns(self, result: MachineResult) -> NDArray[np.float64]:
        """Return the recorded returns, (record, states), padded with nan; nothing without any."""
        size = self._plan.record_size
        if not size or not result.points.size:
            return np.empty((0, 0))
        points = np.full((size, result.points.shape[1]), math.nan)
        count = min(len(result.points), size)
        points[:count] = result.points[:count]
        return points
