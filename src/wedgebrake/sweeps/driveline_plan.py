"""Sweep of a driveline, with the solvers of one inertia."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

from wedgebrake.sweeps.driveline_chunk import ExactChunk, Parts, SimulatedChunk
from wedgebrake.sweeps.plan import Chunk, Plan
from wedgebrake.sweeps.results import VARIABLES, Variable


class DrivelinePlan(Plan):
    """Sweep of a driveline."""

    def chunk_maker(self) -> Callable[[Mapping[str, slice]], Chunk]:
        """The function that makes a chunk."""
        if self.method == "exact":
            return partial(ExactChunk, self, Parts(self.system, self.grid.axes))
        return partial(SimulatedChunk, self)

    @property
    def chunk_points(self) -> tuple[int, int]:
        """Fewest and most points of a chunk: more where a point takes a millisecond or less."""
        if self.method != "exact":
            return super().chunk_points
        return 64, 256 if self.protocol.automatic else 4096

    def _table(self) -> dict[str, Variable]:
        return VARIABLES

    def _parts(self) -> Mapping[str, Any]:
        return {"brake": self.system.brake, "friction": self.system.friction}

    def _settings(self) -> dict[str, Any]:
        return {"initial": list(self.initial)}
