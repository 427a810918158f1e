"""The motion between the states of a response: velocity and brake torque along its segments.

A torque law maps sliding velocities (n, m) [rad/s], one row for each of n segments, and their
directions (n, 1), forwards or not, to torques R F_mu (n, m) [N m]. It is the law of the system
where the response contains it, and otherwise interpolates the recorded samples.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from copy import copy
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from wedgebrake.analysis.responses.segments import NODES, WEIGHTS, ResponseSystem, Segments
from wedgebrake.arrays import FloatArray
from wedgebrake.model.system import BrakedDriveline

if TYPE_CHECKING:
    import xarray as xr

Forward = NDArray[np.bool_]
TorqueLaw = Callable[[FloatArray, Forward], FloatArray]

# Interval, in time constants, over which six nodes integrate a product of two velocities to
# rounding.
_INTERVAL = 0.5
# Number of time constants after which an exponential is below rounding.
_DECAYED = 40.0
_BY_SEGMENT = (
    "local_time", "sticking", "at_rest", "forward", "piece", "first", "last", "exponent", "mismatch"
)  # fmt: skip


class DenseMotion:
    """Motion along n segments, evaluated at fractions x of each segment, (m,) or (n, m).

    It is known in closed form for "exact" responses with a known law; otherwise the velocity is
    interpolated.

    local_time  : (n,) start of the segments within a period of the torque [s], as in the solvers,
                  so that the phase stays exact in long runs
    sticking    : (n,) the brake sticks
    at_rest     : (n,) the sliding velocity is zero; with smooth friction a sticking brake creeps
    first, last : (n,) one-sided accelerations at both ends [rad/s^2]
    """

    def __init__(self, response: xr.Dataset, given: ResponseSystem, segments: Segments) -> None:
        self.given, self.segments = given, segments
        exact = response.attrs.get("method") == "exact"
        period = 2.0 * math.pi / given.excitation.angular_frequency
        self.local_time = segments.start - np.floor(segments.middle / period) * period
        entered = np.searchsorted(response["stick_start"].to_numpy(), segments.middle)
        left = np.searchsorted(response["stick_end"].to_numpy(), segments.middle)
        self.sticking = entered > left
        self.at_rest = self.sticking & given.set_valued
        inside = segments.inner_velocity + given.driveline.constant_speed
        self.forward, self.piece = inside > 0.0, np.zeros(inside.size, dtype=np.intp)
        # Torque that the brake holds at rest [N m].
        self.holding = -math.inf, math.inf
        if given.system is not None and given.set_valued:
            law = given.system.characteristic
            first, piece = law.first_forward, law.piece(inside)
            # A sliding direction in which a self-locking brake cannot slide is a rounding error.
            self.forward = self.forward == np.isfinite(law.offsets[piece])
            self.piece = np.where(
                self.forward, np.maximum(piece, first), np.minimum(piece, first - 1)
            )
            self.holding = law.holding
            if response.attrs.get("method") == "ode14x":
                # The stick band ends at the kinetic torques, eqs. (17) and (18).
                self.holding = float(law.offsets[first - 1]), float(law.offsets[first])
        self._law = _torque_law(response, given)
        self.first, self.last = self._accelerations()
        self.exponent, self.mismatch = np.zeros((2, inside.size))
        self.closed_form = False
        if exact and given.system is not None:
            self._set_closed_form(given.system)

    def _set_closed_form(self, system: BrakedDriveline) -> None:
        """Prepare the evaluation of linear pieces of the torque and of rest.

        ``exponent`` is that of the faster of two real roots over each segment: negative if that
        part of the motion decays, 0 if the roots are complex or the brake is at rest. ``mismatch``
        is the recorded velocity at the end of a segment minus that of the closed form [rad/s]:
        rounding, unless the response does not belong to the system that it describes.
        """
        from wedgebrake.dynamics.segment_log import REST
        from wedgebrake.solvers.event_driven.solve import problem

        self.closed_form, self.problem = True, problem(system)
        pieces = self.problem.brake.pieces
        w2, decay = pieces["stiffness"], 0.5 * pieces["damping"]
        split = np.sqrt(np.maximum(decay * decay - w2, 0.0))
        fast = np.where(split > 0.0, -decay - np.copysign(split, decay), 0.0)
        self.exponent = np.where(self.at_rest, 0.0, fast[self.piece] * self.segments.duration)
        self.piece = np.where(self.at_rest, REST, self.piece)
        self.mismatch = self.segments.end_velocity - self._velocity(np.ones(1))[:, 0]

    def select(self, rows: slice | NDArray[np.intp]) -> DenseMotion:
        """Return the motion along some of the segments."""
        some = copy(self)
        some.segments = self.segments.select(rows)
        for name in _BY_SEGMENT:
            setattr(some, name, getattr(self, name)[rows])
        return some

    def quadrature_groups(self) -> list[NDArray[np.intp]]:
        """Group the segments that share a quadrature rule.

        The exponents of a group differ by a factor of two at most.
        """
        size = np.maximum(np.abs(self.exponent) / _INTERVAL, 1.0)
        group = np.sign(self.exponent) * np.ceil(np.log2(size))
        return [np.flatnonzero(group == one) for one in np.unique(group)]

    def quadrature(self) -> tuple[FloatArray, FloatArray]:
        """Return nodes and weights (m,) for the segments of one of ``quadrature_groups``.

        In closed form they integrate to rounding, by a composite Gauss-Legendre rule whose
        intervals match the time scales of the motion. For a fast real root the intervals grow
        while its part of the motion decays.
        """
        if not self.closed_form:
            return NODES, WEIGHTS
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

    def excitation(self, x: FloatArray) -> FloatArray:
        """Return the torque T on the driveline [N m], (n, m)."""
        time = self.local_time[:, None] + x * self.segments.duration[:, None]
        return self.given.excitation.torque(time)

    def law(self, v: FloatArray) -> FloatArray:
        """Return the torque of the sliding brake [N m] at sliding velocities, (n, m)."""
        return self._law(v, self.forward[:, None])

    def _accelerations(self) -> tuple[FloatArray, FloatArray]:
        """Accelerations at both ends from the equation of motion (eq. 1)."""
        segments, line = self.segments, self.given.driveline
        velocity = np.column_stack((segments.start_velocity, segments.end_velocity))
        angle = np.column_stack((segments.angle, segments.angle + segments.rotation))
        external = self.excitation(np.array([0.0, 1.0]))
        external = external - line.damping * velocity - line.stiffness * angle
        brake = self.law(velocity + line.constant_speed)
        first, last = ((external - brake) / line.inertia).T
        return first, last

    def _velocity(self, x: FloatArray) -> FloatArray:
        """Velocity [rad/s], (n, m); it equals the recorded one at both ends."""
        from wedgebrake.solvers.event_driven.trajectory import velocities

        segments = self.segments
        if not self.closed_form:
            return segments.velocity(x, self.first, self.last)
        tau = np.ascontiguousarray(x * segments.duration[:, None])
        found = np.empty(tau.shape)
        starts = (self.local_time, segments.angle, segments.start_velocity)
        states = (np.ascontiguousarray(start) for start in starts)
        velocities(self.problem, self.piece, *states, tau, found)
        return found + x * self.mismatch[:, None]

    def _torque(self, x: FloatArray, sliding: FloatArray) -> FloatArray:
        """Torque of the sliding brake [N m], (n, m).

        An interpolated velocity may pass the speed at which a self-locking brake locks, where the
        torque is infinite: the torque at the nearer end of the segment then replaces it.
        """
        torque = self.law(sliding)
        infinite = ~np.isfinite(torque)
        if not np.any(infinite):
            return torque
        ends = np.column_stack((self.segments.start_velocity, self.segments.end_velocity))
        at_ends = self.law(ends + self.given.driveline.constant_speed)
        nearer = np.where(x < 0.5, at_ends[:, :1], at_ends[:, 1:])
        return np.where(infinite, nearer, torque)

    def state(self, x: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return velocity, sliding velocity [rad/s] and brake torque [N m], (n, m) each."""
        segments, line = self.segments, self.given.driveline
        velocity = self._velocity(x)
        sliding = velocity + line.constant_speed
        torque = self._torque(x, sliding)
        if not np.any(self.at_rest):
            return velocity, sliding, torque
        rest = self.at_rest[:, None]
        velocity = np.where(rest, (segments.rotation / segments.duration)[:, None], velocity)
        # At rest the brake torque follows from equilibrium; rounding, or a fixed step, may exceed
        # the limits.
        angle = segments.angle[:, None] + x * segments.rotation[:, None]
        held = self.excitation(x) - line.damping * velocity - line.stiffness * angle
        held = np.clip(held, *self.holding)
        return velocity, np.where(rest, 0.0, sliding), np.where(rest, held, torque)


def _torque_law(response: xr.Dataset, given: ResponseSystem) -> TorqueLaw:
    """Torque law of the sliding brake."""
    if given.system is None:
        return _recorded(response, given)
    system = given.system

    def in_direction(v: FloatArray, forward: Forward) -> FloatArray:
        """Clip velocities to the direction of their segment; beyond it they are rounding."""
        return np.where(forward, np.maximum(v, 0.0), np.minimum(v, 0.0))

    def lines(v: FloatArray, forward: Forward) -> FloatArray:
        law, v = system.characteristic, in_direction(v, forward)
        piece, first = law.piece(v), law.first_forward
        piece = np.where(forward, np.maximum(piece, first), np.minimum(piece, first - 1))
        return np.asarray(law.offsets[piece] + law.slopes[piece] * v)

    def curve(v: FloatArray, forward: Forward) -> FloatArray:
        from wedgebrake.solvers.smooth.solve import torque_at

        return torque_at(system, in_direction(v, forward).ravel()).reshape(v.shape)

    return lines if given.set_valued else curve


def _recorded(response: xr.Dataset, given: ResponseSystem) -> TorqueLaw:
    """Torque law R F_a r(v), whose ratio r = F_mu/F_a is interpolated between the samples."""
    sliding = response["velocity"].to_numpy() + given.driveline.constant_speed
    force = given.force(sliding)
    usable = (force != 0.0) & np.isfinite(response["brake_torque"].to_numpy())
    if given.set_valued:
        usable &= (sliding != 0.0) & (response["sticking"].to_numpy() == 0)
    sliding, torques = sliding[usable], response["brake_torque"].to_numpy()[usable]
    ratio = torques / (given.radius * force[usable])
    if not given.set_valued:  # a smooth law vanishes at rest
        sliding, ratio = np.append(sliding, 0.0), np.append(ratio, 0.0)
    order = np.argsort(sliding, kind="stable")
    sliding, ratio = sliding[order], ratio[order]
    tables = [(sliding[mine], ratio[mine]) for mine in (sliding <= 0.0, sliding >= 0.0)]

    def torque(v: FloatArray, forward: Forward) -> FloatArray:
        backward, forwards = (
            np.interp(v, *table) if table[0].size else np.zeros(v.shape) for table in tables
        )
        return np.asarray(given.radius * given.force(v) * np.where(forward, forwards, backward))

    return torque
