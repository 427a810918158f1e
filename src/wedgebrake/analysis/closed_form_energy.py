"""Closed form of the motion between the recorded states of an exact response."""

from __future__ import annotations

from copy import copy

import numpy as np
from numpy.typing import NDArray

from wedgebrake.analysis.segments import NODES, WEIGHTS, Arcs
from wedgebrake.analysis.system_from_response import Machine, piece_of

FloatArray = NDArray[np.float64]

# Interval, in time constants, over which six nodes integrate a product of two velocities exactly
# to rounding.
_STRETCH = 0.5
# Number of time constants after which a part of the motion is below rounding.
_GONE = 40.0


class Closed:
    """Velocities along n arcs, each in one linear piece of the torque or at rest.

    pace   : (n,) lengths of the arcs in time constants of the faster of two real roots: negative
             if that part of the motion decays, 0 if the roots are complex or the arc is at rest
    missed : (n,) recorded velocity at the end of an arc minus that of the closed form [rad/s]:
             rounding, unless the response does not belong to the machine that it describes
    """

    def __init__(
        self, given: Machine, along: Arcs, local: FloatArray, rest: NDArray[np.bool_]
    ) -> None:
        from wedgebrake.dynamics.segment_log import REST
        from wedgebrake.solvers.event_driven.solve import problem

        assert given.system is not None  # noqa: S101 - a closed form needs a known system
        self.problem = problem(given.system)
        self.along, self.local = along, local
        self.piece = np.where(rest, REST, piece_of(given, along))
        pieces = self.problem.brake.pieces
        w2, decay = pieces["stiffness"], 0.5 * pieces["damping"]
        split = np.sqrt(np.maximum(decay * decay - w2, 0.0))
        fast = np.where(split > 0.0, -decay - np.copysign(split, decay), 0.0)
        self.pace = np.where(rest, 0.0, fast[self.piece] * along.length)
        self.missed = np.zeros(self.pace.size)
        self.missed = along.after - self.velocity(np.ones(1))[:, 0]

    def rows(self, rows: slice | NDArray[np.intp]) -> Closed:
        """Some of the arcs."""
        some = copy(self)
        some.along = self.along.block(rows)
        for name in ("local", "piece", "pace", "missed"):
            setattr(some, name, getattr(self, name)[rows])
        return some

    def velocity(self, x: FloatArray) -> FloatArray:
        """Velocity [rad/s] at the shares ``x`` of each arc, (n, m); x is (m,) or (n, m).

        At both ends it equals the recorded velocity.
        """
        from wedgebrake.solvers.smooth.torque_along import velocities

        along = self.along
        tau = np.ascontiguousarray(x * along.length[:, None])
        found = np.empty(tau.shape)
        starts = (self.local, along.angle, along.before)
        states = (np.ascontiguousarray(start) for start in starts)
        velocities(self.problem, self.piece, *states, tau, found)
        return found + x * self.missed[:, None]

    def alike(self) -> list[NDArray[np.intp]]:
        """Groups of arcs whose paces differ by a factor of two at most."""
        size = np.maximum(np.abs(self.pace) / _STRETCH, 1.0)
        group = np.sign(self.pace) * np.ceil(np.log2(size))
        return [np.flatnonzero(group == one) for one in np.unique(group)]

    def rule(self) -> tuple[FloatArray, FloatArray]:
        """Nodes and weights (m,) that integrate over each arc of a group, exact to rounding.

        A composite Gauss-Legendre rule whose intervals match the time scales of the motion. For
        a fast real root the intervals grow while its part decays, until it is below rounding.
        """
        line, omega = self.problem.driveline, self.problem.torque.angular_frequency
        natural = float(np.sqrt(line.stiffness / line.inertia))
        slow = float(np.max(self.along.length)) * max(omega, natural)
        cuts = np.linspace(0.0, 1.0, max(int(np.ceil(slow / _STRETCH)), 1) + 1)
        pace = self.pace[np.argmax(np.abs(self.pace))]
        if abs(pace) > _STRETCH:
            ends = [0.0]
            while ends[-1] < min(abs(pace), 2.0 * _GONE):
                ends.append(ends[-1] + _STRETCH * float(np.exp(ends[-1] / 24.0)))
            early = np.minimum(np.array(ends) / abs(pace), 1.0)
            cuts = np.unique(np.concatenate((cuts, early if pace < 0.0 else 1.0 - early)))
        size = np.diff(cuts)[:, None]
        return (cuts[:-1, None] + size * NODES).ravel(), (size * WEIGHTS).ravel()
