"""The motion of a response as arcs between the states that it holds.

Samples, events and Poincare points are merged, so that every arc is smooth: the torque of
the brake jumps or bends only where two arcs meet.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    import xarray as xr

FloatArray = NDArray[np.float64]

# (time, angle, velocity) of every kind of state that a response holds.
_STATES = (
    ("time", "angle", "velocity"),
    ("event_time", "event_angle", "event_velocity"),
    ("poincare_time", "poincare_angle", "poincare_velocity"),
)
_FINAL = ("final_time", "final_angle", "final_velocity")

# Gauss and Legendre's nodes and weights on (0, 1), exact to order 12: the square of a quartic
# velocity needs nine, a torque that bends the rest.
_X, _WEIGHT = np.polynomial.legendre.leggauss(6)
NODES: FloatArray = 0.5 * (1.0 + _X)
WEIGHTS: FloatArray = 0.5 * _WEIGHT


@dataclass(frozen=True)
class Arcs:
    """Stretches of motion, one after the other, each (n,).

    start, length : beginning and duration [s]
    angle, rise   : angle at the beginning, and what is gained [rad]
    before, after : velocity of the driveline at both ends [rad/s]
    """

    start: FloatArray
    length: FloatArray
    angle: FloatArray
    rise: FloatArray
    before: FloatArray
    after: FloatArray

    def block(self, rows: slice | NDArray[np.intp]) -> Arcs:
        """Some of the arcs."""
        return Arcs(*(getattr(self, field.name)[rows] for field in fields(self)))

    @property
    def middle(self) -> FloatArray:
        """Time of the middle [s]."""
        return self.start + 0.5 * self.length

    @property
    def inner_velocity(self) -> FloatArray:
        """A velocity [rad/s] between the smallest and largest of an arc, for any motion."""
        return 0.5 * self.rise / self.length + 0.25 * (self.before + self.after)

    def velocity(self, x: FloatArray, first: FloatArray, last: FloatArray) -> FloatArray:
        """Velocity [rad/s] at the shares ``x`` of each arc, (n, m); x is (m,) or (n, m).

        The angle is the polynomial of fifth order through angle, velocity and acceleration
        at both ends; ``first``, ``last`` are the accelerations there [rad/s^2].
        """
        h, w0, w1 = self.length[:, None], self.before[:, None], self.after[:, None]
        a0, a1 = first[:, None], last[:, None]
        y = 1.0 - x
        gain = w1 - w0
        missed = self.rise[:, None] / h - 0.5 * (w0 + w1) - h * (a0 - a1) / 12.0
        bow = y * (h * a0 - gain) - x * (h * a1 - gain) + 30.0 * missed * x * y
        return np.asarray(w0 + x * gain + x * y * bow)


def arcs(response: xr.Dataset, low: float, high: float, shortest: float) -> Arcs:
    """The arcs of a response between two times at which it holds a state [s].

    States closer to each other than ``shortest`` [s] are one state.
    """
    columns = []
    for names, final in zip(zip(*_STATES, strict=True), _FINAL, strict=True):
        found = [response[name].to_numpy() for name in names]
        columns.append(np.concatenate([*found, [response.attrs[final]]]).astype(float))
    table = np.array(columns)
    table = table[:, np.argsort(table[0], kind="stable")]
    table = table[:, (table[0] >= low - shortest) & (table[0] <= high + shortest)]
    at, to = table[:, :-1], table[:, 1:]
    long = to[0] - at[0] > shortest
    at, to = at[:, long], to[:, long]
    return Arcs(at[0], to[0] - at[0], at[1], to[1] - at[1], at[2], to[2])
