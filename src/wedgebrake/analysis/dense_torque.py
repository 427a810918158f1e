"""What happens along the arcs of a response: velocity and torque between its states."""

from __future__ import annotations

import math
from copy import copy
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from wedgebrake.analysis.closed_form_energy import Closed
from wedgebrake.analysis.segments import NODES, WEIGHTS, Arcs
from wedgebrake.analysis.system_from_response import Law, Machine, holding, law_along

if TYPE_CHECKING:
    import xarray as xr

FloatArray = NDArray[np.float64]


class Along:
    """The motion along arcs, each (n,); functions of it take shares x of the arcs, (m,) or (n, m).

    local : start times of the arcs within a period of the torque [s], as used by the solvers:
            the phase keeps its digits in long runs
    stuck : whether the brake sticks
    rest  : whether it rests; under a smooth law it sticks, but creeps
    first, last : accelerations at both ends, on their side of a jump [rad/s^2]
    closed : closed form of the motion, for a response of "exact" with a known law; otherwise
             None, and the velocity is interpolated
    """

    def __init__(self, response: xr.Dataset, given: Machine, along: Arcs) -> None:
        self.response, self.given, self.along = response, given, along
        period = 2.0 * math.pi / given.excitation.angular_frequency
        self.local = along.start - np.floor(along.middle / period) * period
        begun = np.searchsorted(response["stick_start"].to_numpy(), along.middle)
        ended = np.searchsorted(response["stick_end"].to_numpy(), along.middle)
        self.stuck = begun > ended
        self.rest = self.stuck & given.set_valued
        self.law: Law = law_along(response, given, along)
        self.holding = holding(given, response.attrs.get("method", ""))
        self.first, self.last = self._accelerations()
        self.closed: Closed | None = None
        if response.attrs.get("method") == "exact" and given.system is not None:
            self.closed = Closed(given, along, self.local, self.rest)

    def rows(self, rows: slice | NDArray[np.intp]) -> Along:
        """Some of the arcs."""
        some = copy(self)
        some.along = self.along.block(rows)
        for name in ("local", "stuck", "rest", "first", "last"):
            setattr(some, name, getattr(self, name)[rows])
        some.law = law_along(self.response, self.given, some.along)
        some.closed = None if self.closed is None else self.closed.rows(rows)
        return some

    def alike(self) -> list[NDArray[np.intp]]:
        """Groups of arcs that share a quadrature ``rule``."""
        return [np.arange(self.local.size)] if self.closed is None else self.closed.alike()

    def rule(self) -> tuple[FloatArray, FloatArray]:
        """Nodes and weights (m,) of the quadrature over each arc of a group of ``alike``."""
        return (NODES, WEIGHTS) if self.closed is None else self.closed.rule()

    def drive(self, x: FloatArray) -> FloatArray:
        """The torque T [N m], (n, m)."""
        time = self.local[:, None] + x * self.along.length[:, None]
        return self.given.excitation.torque(time)

    def _accelerations(self) -> tuple[FloatArray, FloatArray]:
        """By eq. (1)."""
        along, line = self.along, self.given.driveline
        velocity = np.column_stack((along.before, along.after))
        angle = np.column_stack((along.angle, along.angle + along.rise))
        pull = self.drive(np.array([0.0, 1.0])) - line.damping * velocity - line.stiffness * angle
        brake = self.law(velocity + line.drive_speed)
        first, last = ((pull - brake) / line.inertia).T
        return first, last

    def state(self, x: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """(velocity, sliding velocity [rad/s], brake torque [N m]), (n, m) each."""
        along, line = self.along, self.given.driveline
        if self.closed is None:
            velocity = along.velocity(x, self.first, self.last)
        else:
            velocity = self.closed.velocity(x)
        sliding = velocity + line.drive_speed
        torque = self.law(sliding)
        if not np.any(self.rest):
            return velocity, sliding, torque
        rest = self.rest[:, None]
        velocity = np.where(rest, (along.rise / along.length)[:, None], velocity)
        # At rest the brake holds what equilibrium demands.
        angle = along.angle[:, None] + x * along.rise[:, None]
        held = self.drive(x) - line.damping * velocity - line.stiffness * angle
        held = np.clip(held, *self.holding)  # beyond it by rounding, or by a fixed step
        return velocity, np.where(rest, 0.0, sliding), np.where(rest, held, torque)
