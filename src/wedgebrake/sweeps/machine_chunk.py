"""Computation of a chunk of a sweep of machines, or of drivelines solved as machines."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from wedgebrake.analysis.machine_motion.classify_machine import Classifier
from wedgebrake.analysis.machine_motion.result import MachineResult
from wedgebrake.dynamics.enums import Outcome
from wedgebrake.solvers.machine.final_state import FinalState
from wedgebrake.sweeps.plan import Chunk
from wedgebrake.sweeps.results import PointStatus

# Points of a batch: a fraction of a second, so that interrupts take effect soon.
_BATCH = 8


class MachineChunk(Chunk):
    """Points that are computed one by one, with the solver of machines.

    plan : of ``machine_plan``
    """

    def __init__(self, plan: Any, where: Mapping[str, slice]) -> None:
        super().__init__(plan, where)
        self._values_of, self._machine_at_point = plan.values_of, plan.machine_at_point
        self._results = {
            one.name: np.full((self.count, *plan.shape(one)), one.fill, one.dtype)
            for one in plan.variables
        }

    def _batch_size(self) -> int:
        return _BATCH

    def results(self) -> dict[str, Any]:
        """Return the variables of the chunk after all batches have been computed."""
        return {name: self.shaped(values) for name, values in self._results.items()}

    def _run(self, numbers: NDArray[np.int64]) -> None:
        """Compute a batch, point by point; with ``follow`` each from the previous final state."""
        before: FinalState | None = None
        classifier = Classifier(self.plan.protocol, self.plan.method)
        for number in map(int, numbers):
            system = self.system(number)
            if system is None:
                self._results["status"][number] = PointStatus.INVALID
                before = None
                continue
            machine = self._machine_at_point(system, self.state(number))
            start = before if self.plan.grid.follow is not None else None
            result = classifier.result(machine, start)
            before = result.final if result.outcome == Outcome.COMPLETED else None
            values = self._values_of(system, result, self._of_parts(result))
            for name, value in (values | _of_motion(result)).items():
                self._results[name][number] = value

    def _of_parts(self, result: MachineResult) -> dict[str, Any]:
        """Return values over contacts or inertias, in the last dimension."""
        n, found = len(result.final.speeds) if result.final else 0, result.contacts
        points, unknown = self._returns(result), np.full(1, np.nan)
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

    def _returns(self, result: MachineResult) -> NDArray[np.float64]:
        """Return the recorded returns, (record, states), padded with nan; nothing without any."""
        size = self.plan.record_size
        if not size or not result.points.size:
            return np.empty((0, 0))
        points = np.full((size, result.points.shape[1]), np.nan)
        count = min(len(result.points), size)
        points[:count] = result.points[:count]
        return points


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
