"""Closed form of the motion between the recorded states of an exact response."""

from __future__ import annotations

import math
from copy import copy

import numpy as np
from numpy.typing import NDArray

from wedgebrake.analysis.segments import NODES, WEIGHTS, Segments
from wedgebrake.analysis.system_from_response import ResponseSystem, pieces_of

FloatArray = NDArray[np.float64]

# Interval, in time constants, over which six nodes integrate a product of two velocities to
# rounding.
_INTERVAL = 0.5
# Number of time constants after which an exponential is below rounding.
_DECAYED = 40.0


class ClosedForm:
    """Closed-form velocity along n segments, each in one linear piece of the torque or at rest.

    exponent : (n,) exponent of the faster of two real roots over each segment: negative if that
               part of the motion decays, 0 if the roots are complex or the brake is at rest
    mismatch : (n,) recorded velocity at the end of a segment minus that of the closed form [rad/s]:
               rounding, unless the response does not belong to the system that it describes
    """

    def __init__(
        self,
        given: ResponseSystem,
        segments: Segments,
        local_time: FloatArray,
        rest: NDArray[np.bool_],
    ) -> None:
        from wedgebrake.dynamics.segment_log import REST
        from wedgebrake.solvers.event_driven.solve import problem

        assert given.system is not None  # noqa: S101 - a closed form needs a known system
        self.problem = problem(given.system)
        self.segments, self.local_time = segments, local_time
        self.piece = np.where(rest, REST, pieces_of(given, segments))
        pieces = self.problem.brake.pieces
        w2, decay = pieces["stiffness"], 0.5 * pieces["damping"]
        split = np.sqrt(np.maximum(decay * decay - w2, 0.0))
        fast = np.where(split > 0.0, -decay - np.copysign(split, decay), 0.0)
        self.exponent = np.where(rest, 0.0, fast[self.piece] * segments.duration)
        self.mismatch = np.zeros(self.exponent.size)
        self.mismatch = segments.end_velocity - self.velocity(np.ones(1))[:, 0]

    def select(self, rows: slice | NDArray[np.intp]) -> ClosedForm:
        """Return the closed form of some of the segments."""
        some = copy(self)
        some.segments = self.segments.select(rows)
        for name in ("local_time", "piece", "exponent", "mismatch"):
            setattr(some, name, getattr(self, name)[rows])
        return some

    def velocity(self, x: FloatArray) -> FloatArray:
        """Return the velocity [rad/s] at fractions ``x`` of each segment, (n, m).

        It equals the recorded velocity at both ends. ``x`` is (m,) or (n, m).
        """
        from wedgebrake.solvers.event_driven.trajectory import velocities

        segments = self.segments
        tau = np.ascontiguousarray(x * segments.duration[:, None])
        found = np.empty(tau.shape)
        starts = (self.local_time, segments.angle, segments.start_velocity)
        states = (np.ascontiguousarray(start) for start in starts)
        velocities(self.problem, self.piece, *states, tau, found)
        return found + x * self.mismatch[:, None]

    def quadrature_groups(self) -> list[NDArray[np.intp]]:
        """Group the segments so that the exponents of a group differ by a factor of two at most."""
        size = np.maximum(np.abs(self.exponent) / _INTERVAL, 1.0)
        group = np.sign(self.exponent) * np.ceil(np.log2(size))
        return [np.flatnonzero(group == one) for one in np.unique(group)]

    def quadrature(self) -> tuple[FloatArray, FloatArray]:
        """Return nodes and weights (m,) that integrate over each segment of a group to rounding.

        The rule is a composite Gauss-Legendre rule whose intervals match the time scales of the
        motion. For a fast real root the intervals grow while its part of the motion decays.
        """
        line, torque = self.problem.driveline, self.problem.torque
        fastest = max(torque.angular_frequency, math.sqrt(line.stiffness / line.inertia))
        slow = float(np.max(self.segments.duration)) * fastest
        cuts = np.linspace(0.0, 1.0, max(int(np.ceil(slow / _INTERVAL)), 1) + 1)
        exponent = self.exponent[np.argmax(np.abs(self.exponent))]
        if abs(exponent) > _INTERVAL:
            ends = [0.0]
            while ends[-1] < min(abs(exponent), 2.0 * _DECAYED):
                ends.append(ends[-1] + _INTERVAL * float(np.exp(ends[-1] / 24.0)))
            early = np.minimum(np.array(ends) / abs(exponent), 1.0)
            cuts = np.unique(np.concatenate((cuts, early if exponent < 0.0 else 1.0 - early)))
        size = np.diff(cuts)[:, None]
        return (cuts[:-1, None] + size * NODES).ravel(), (size * WEIGHTS).ravel()
