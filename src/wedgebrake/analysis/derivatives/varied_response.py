"""Variables of a response and their derivatives at the samples, computed in one run."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from wedgebrake.analysis.derivatives.varied_values import (
    VariedValues,
    varied_elements,
    varied_shares,
)
from wedgebrake.arrays import FloatArray
from wedgebrake.solvers.interrupts import interruptible
from wedgebrake.solvers.layout import VARIABLES
from wedgebrake.solvers.machine.shares import least_shares
from wedgebrake.solvers.machine.tangents import (
    Neighbourhood,
    TangentAnswer,
    TangentTask,
    differentiate,
)
from wedgebrake.solvers.response import shaft_torques, without_force

VARIED = (
    "angle", "velocity", "shaft_torque", "brake_torque", "actuation_force", "control_output",
)  # fmt: skip
"""The variables of a response that have derivatives."""


class VariedResponse(NamedTuple):
    """A run with its derivatives with respect to p parameters.

    task : its parameters have steps that resolve all numbers of the machine
    """

    task: TangentTask
    found: TangentAnswer

    @property
    def complete(self) -> bool:
        """Whether the run has reached its last sample."""
        return int(self.found.samples.at[0]) == self.task.times.size

    def values(self, variable: str) -> FloatArray:
        """Values of a variable of the machine at the samples, (k, parts)."""
        machine, samples, n = self.task.machine, self.found.samples, self._inertias
        angle, speed = samples.states[:, :n], samples.states[:, n : 2 * n]

        of: dict[str, Callable[[], FloatArray]] = {
            "angle": lambda: angle,
            "velocity": lambda: speed,
            "shaft_torque": lambda: shaft_torques(machine, angle, speed),
            "brake_torque": lambda: (
                0.0 - least_shares(machine, samples.torque, samples.force, samples.side == 0)
            ),
            "actuation_force": lambda: np.where(without_force(machine), np.nan, samples.force),
            "control_output": lambda: np.asarray(samples.control),
        }
        return of[variable]()

    def changes(self, variable: str) -> FloatArray:
        """Derivatives of a variable of the machine at the samples, (p, k, parts)."""
        found, n = self.found, self._inertias
        if variable == "shaft_torque":
            return self._shaft_torques()
        if variable == "brake_torque":
            samples = found.samples
            torque = VariedValues(samples.torque, found.torques)
            force = VariedValues(samples.force, found.forces)
            shared = varied_shares(self.task, torque, force, samples.side == 0)
            return 0.0 - np.moveaxis(shared.changes, -1, 0)
        of = {
            "angle": found.states[:, :n],
            "velocity": found.states[:, n : 2 * n],
            "actuation_force": found.forces,
            "control_output": found.outputs,
        }
        return np.moveaxis(of[variable], -1, 0)

    def place(self, variable: str, part: str) -> int:
        """Index of a part in the last dimension of a variable."""
        along = self.task.machine.parts_along[VARIABLES[variable][0][1]]
        return [one.name for one in along].index(part)

    @property
    def _inertias(self) -> int:
        return len(self.task.machine.inertias)

    def _shaft_torques(self) -> FloatArray:
        angle, speed = (
            VariedValues(self.values(one), np.moveaxis(self.changes(one), 0, -1))
            for one in ("angle", "velocity")
        )
        found = np.moveaxis(varied_elements(self.task, angle, speed).changes, -1, 0)
        return found[..., : len(self.task.machine.shafts)]


def varied_response(task: TangentTask, known: Neighbourhood) -> VariedResponse:
    """Run a machine, and differentiate its response at ``task.times``.

    known : the neighbourhood of another run of the same machine

    Raises ``InputError`` for a parameter without derivative.
    """
    found = interruptible(lambda: differentiate(task, known))
    return VariedResponse(task._replace(parameters=found.parameters), found)
