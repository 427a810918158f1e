"""Sweep of a machine, or of a driveline that is solved as a machine."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

import numpy as np

from wedgebrake.analysis.linear_stability import method_of, sliding_damping
from wedgebrake.analysis.machine_motion.result import MachineResult
from wedgebrake.model.machine import Machine
from wedgebrake.model.signals.signals import Signal
from wedgebrake.model.system import BrakedDriveline
from wedgebrake.sweeps.driveline_plan import DrivelinePlan
from wedgebrake.sweeps.machine_chunk import MachineChunk
from wedgebrake.sweeps.plan import CROSSING, PERIOD, Chunk, Plan
from wedgebrake.sweeps.results import CONTACT, EXPONENT, INERTIA, MACHINE_VARIABLES, Variable


class _SolvedAsMachine(Plan):
    """Sweep whose points the solver of machines computes."""

    def chunk_maker(self) -> Callable[[Mapping[str, slice]], Chunk]:
        """The function that makes a chunk."""
        return partial(MachineChunk, self)

    @property
    def returns(self) -> str:
        """Dimension of the recorded returns."""
        return CROSSING if self.system.machine.autonomous else PERIOD


class MachinePlan(_SolvedAsMachine):
    """Sweep of a machine."""

    def machine_at_point(self, system: Machine, _state: tuple[float, float]) -> Machine:
        """The machine of a point, with its initial state."""
        return system

    def values_of(
        self, _system: Machine, result: MachineResult, parts: dict[str, Any]
    ) -> dict[str, Any]:
        """Variables of a point that only machines have, and those over its parts."""
        exponents = np.full(self.inner_sizes[EXPONENT], math.nan)
        known = result.exponents[: exponents.size]
        exponents[: known.size] = known
        return {**parts, "exponents": exponents}

    def _table(self) -> dict[str, Variable]:
        return MACHINE_VARIABLES

    def _parts(self) -> Mapping[str, Any]:
        laws = {
            f"{one.name}.{kind}": getattr(one, kind)
            for one in self.system.contacts
            for kind in ("brake", "friction")
        }
        return {**laws, **self.system.signals()}

    @property
    def inner_sizes(self) -> dict[str, int]:
        """Sizes of the dimensions of variables beside those of the points."""
        contacts = self.system.contacts
        states = 2 * len(self.system.inertias) + sum(one.actuation.order for one in contacts)
        return {**super().inner_sizes, EXPONENT: states}

    def _names(self) -> dict[str, list[str]]:
        return {dim: list(self.system.coords[dim]) for dim in (INERTIA, CONTACT)}


class DrivelineAsMachinePlan(_SolvedAsMachine, DrivelinePlan):
    """Sweep of a driveline that is solved as a machine, see ``analysis.solved_as``."""

    def machine_at_point(self, system: BrakedDriveline, state: tuple[float, float]) -> Machine:
        """The machine of a point, with its initial state."""
        return system.machine.started_at(*state)

    def values_of(
        self, system: BrakedDriveline, result: MachineResult, parts: dict[str, Any]
    ) -> dict[str, Any]:
        """Variables of a point that only drivelines have, and those of its only part."""
        values = {name: one[..., 0] for name, one in parts.items()}
        largest, second = [*result.exponents, math.nan][:2]
        values |= {"largest_exponent": largest, "second_exponent": second}
        if result.final is not None:
            values["final_angle"] = result.final.angles["driveline"]
            values["final_velocity"] = result.final.speeds["driveline"]
        # With a lag the damping alone does not decide on stability; with signals it varies.
        if system.actuation.immediate and not isinstance(system.driveline.drive_speed, Signal):
            values["sliding_damping"] = sliding_damping(system, method_of(self.method))
        return values

    def _parts(self) -> Mapping[str, Any]:
        return {**super()._parts(), **self.system.machine.signals()}

    def _table(self) -> dict[str, Variable]:
        return {**super()._table(), "motion_period": MACHINE_VARIABLES["motion_period"]}

    def _settings(self) -> dict[str, Any]:
        return {**super()._settings(), "returns": self.returns}
