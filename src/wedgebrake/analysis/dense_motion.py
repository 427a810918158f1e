"""The motion between the states of a response: velocity and brake torque along its segments."""

from __future__ import annotations

import math
from copy import copy
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from wedgebrake.analysis.closed_form import ClosedForm
from wedgebrake.analysis.segments import NODES, WEIGHTS, Segments
from wedgebrake.analysis.system_from_response import (
    ResponseSystem,
    TorqueLaw,
    holding_interval,
    torque_law,
)

if TYPE_CHECKING:
    import xarray as xr

FloatArray = NDArray[np.float64]


class DenseMotion:
    """Motion along n segments, evaluated at fractions x of each segment, (m,) or (n, m).

    local_time  : (n,) start of the segments within a period of the torque [s], as in the solvers,
                  so that the phase stays exact in long runs
    sticking    : (n,) the brake sticks
    at_rest     : (n,) the sliding velocity is zero; with smooth friction a sticking brake creeps
    first, last : (n,) one-sided accelerations at both ends [rad/s^2]
    closed_form : closed form of the motion, for "exact" responses with a known law; if None, the
                  velocity is interpolated
    """

    def __init__(self, response: xr.Dataset, given: ResponseSystem, segments: Segments) -> None:
        self.response, self.given, self.segments = response, given, segments
        period = 2.0 * math.pi / given.excitation.angular_frequency
        self.local_time = segments.start - np.floor(segments.middle / period) * period
        entered = np.searchsorted(response["stick_start"].to_numpy(), segments.middle)
        left = np.searchsorted(response["stick_end"].to_numpy(), segments.middle)
        self.sticking = entered > left
        self.at_rest = self.sticking & given.set_valued
        self.law: TorqueLaw = torque_law(response, given, segments)
        self.holding = holding_interval(given, response.attrs.get("method", ""))
        self.first, self.last = self._accelerations()
        self.closed_form: ClosedForm | None = None
        if response.attrs.get("method") == "exact" and given.system is not None:
            self.closed_form = ClosedForm(given, segments, self.local_time, self.at_rest)

    def select(self, rows: slice | NDArray[np.intp]) -> DenseMotion:
        """Return the motion along some of the segments."""
        some = copy(self)
        some.segments = self.segments.select(rows)
        for name in ("local_time", "sticking", "at_rest", "first", "last"):
            setattr(some, name, getattr(self, name)[rows])
        some.law = torque_law(self.response, self.given, some.segments)
        some.closed_form = None if self.closed_form is None else self.closed_form.select(rows)
        return some

    def quadrature_groups(self) -> list[NDArray[np.intp]]:
        """Group the segments that share a quadrature rule."""
        if self.closed_form is None:
            return [np.arange(self.local_time.size)]
        return self.closed_form.quadrature_groups()

    def quadrature(self) -> tuple[FloatArray, FloatArray]:
        """Return nodes and weights (m,) for the segments of one of ``quadrature_groups``."""
        return (NODES, WEIGHTS) if self.closed_form is None else self.closed_form.quadrature()

    def excitation(self, x: FloatArray) -> FloatArray:
        """Return the torque T on the driveline [N m], (n, m)."""
        time = self.local_time[:, None] + x * self.segments.duration[:, None]
        return self.given.excitation.torque(time)

    def _accelerations(self) -> tuple[FloatArray, FloatArray]:
        """Accelerations at both ends from the equation of motion (eq. 1)."""
        segments, line = self.segments, self.given.driveline
        velocity = np.column_stack((segments.start_velocity, segments.end_velocity))
        angle = np.column_stack((segments.angle, segments.angle + segments.rotation))
        external = self.excitation(np.array([0.0, 1.0]))
        external = external - line.damping * velocity - line.stiffness * angle
        brake = self.law(velocity + line.drive_speed)
        first, last = ((external - brake) / line.inertia).T
        return first, last

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
        at_ends = self.law(ends + self.given.driveline.drive_speed)
        nearer = np.where(x < 0.5, at_ends[:, :1], at_ends[:, 1:])
        return np.where(infinite, nearer, torque)

    def state(self, x: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return velocity, sliding velocity [rad/s] and brake torque [N m], (n, m) each."""
        segments, line = self.segments, self.given.driveline
        if self.closed_form is None:
            velocity = segments.velocity(x, self.first, self.last)
        else:
            velocity = self.closed_form.velocity(x)
        sliding = velocity + line.drive_speed
        torque = self._torque(x, sliding)
        if not np.any(self.at_rest):
            return velocity, sliding, torque
        rest = self.at_rest[:, None]
        velocity = np.where(rest, (segments.rotation / segments.duration)[:, None], velocity)
        # At rest the brake holds what equilibrium demands.
        angle = segments.angle[:, None] + x * segments.rotation[:, None]
        held = self.excitation(x) - line.damping * velocity - line.stiffness * angle
        # Rounding, or a fixed step, may exceed the limits.
        held = np.clip(held, *self.holding)
        return velocity, np.where(rest, 0.0, sliding), np.where(rest, held, torque)
