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
        self._states = self._points.initial_states()
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
        return changed.machine_at(*self._states[number].tolist())

    def _store(self, number: int, result: MachineResult) -> None:
        """Store the result of a run."""
        values = self._of_parts(result)
        if isinstance(self._plan.system, Machine):
            exponents = np.full(self._results["exponents"].shape[1], math.nan)
            count = min(exponents.size, result.exponents.size)
            exponents[:count] = result.exponents[:count]
            values["exponents"] = exponents
        else:
            values = {name: one[..., 0] for name, one in values.items()}
            values |= self._of_driveline(result)
        values |= {
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

    def _of_parts(self, result: MachineResult) -> dict[str, Any]:
        """Return values over contacts or inertias, in the last dimension."""
        n, found = len(result.final.speeds) if result.final else 0, result.contacts
        points, unknown = self._returns(result), np.full(1, math.nan)
        return {
            "stick_class": found.stick_class,
            "sticks_forward": found.sticks[:, 0],
            "sticks_backward": found.sticks[:, 1],
            "stick_share": found.stick_share,
            "peak_torque": found.peak_torque,
            "friction_power": found.friction_power,
            "lowest_velocity": result.low[n : 2 * n] if result.low.size else unknown,
            "highest_velocity": result.high[n : 2 * n] if result.low.size else unknown,
            **result.vibration._asdict(),
            **({"angle": points[:, :n], "velocity": points[:, n : 2 * n]} if points.size else {}),
        }

    def _of_driveline(self, result: MachineResult) -> dict[str, Any]:
        """Return exponents and the final state of a driveline."""
        largest, second = [*result.exponents, math.nan][:2]
        final = result.final
        return {
            "largest_exponent": largest,
            "second_exponent": second,
            "final_angle": final.angles["driveline"] if final else math.nan,
            "final_velocity": final.speeds["driveline"] if final else math.nan,
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
