"""Section at which orbits are sampled, and the distance of orbits there."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from wedgebrake.arrays import FloatArray

if TYPE_CHECKING:
    from wedgebrake.model.system import BrakedDriveline

# Points of an orbit nearer than this share of its size count as one.
SAME = 1e-6
_TINY = 1e-300


@dataclass(frozen=True, eq=False)
class Section:
    """Section at which orbits are sampled, and the distance of orbits there.

    A driven system is sampled at t = 0, T, 2 T, ..., T being the period of the torque or the common
    period of the signals; a self-excited one where a speed, or the rate of an angle, rises through
    a level. The points of an orbit, one for each return, are an array (order, n).

    to : (p, n) scaled coordinates of a state, which are velocities
    """

    to: FloatArray

    @classmethod
    def of_driveline(cls, system: BrakedDriveline) -> Section:
        """Section of a driveline. Either of angle and velocity may vanish there."""
        return cls(np.diag([system.excitation.angular_frequency, 1.0]))

    def scaled(self, points: FloatArray) -> FloatArray:
        """Scaled coordinates of states, (..., p)."""
        return np.asarray(points @ self.to.T)

    def prime_order(self, points: FloatArray, tolerance: float = SAME) -> int:
        """Fewest returns after which an orbit repeats, to a share of its size."""
        order = len(points)
        for fewer in range(1, order):
            if order % fewer == 0 and self._agree(np.roll(points, fewer, 0), points, tolerance):
                return fewer
        return order

    def half_difference(self, points: FloatArray) -> FloatArray:
        """Difference of each point to that half an orbit before; empty for an odd order.

        It vanishes where an orbit repeats after half its returns. A branch that goes through such
        an orbit retraces its own orbits, half an orbit later: the difference then changes sign.
        """
        order = len(points)
        if order % 2:
            return np.zeros(0)
        states = self.scaled(points)
        return np.asarray(states - np.roll(states, order // 2, axis=0))

    def same_orbit(self, one: FloatArray, other: FloatArray, tolerance: float) -> bool:
        """Return True if two orbits of one order agree at some shift by whole returns."""
        return any(self._agree(np.roll(one, k, axis=0), other, tolerance) for k in range(len(one)))

    def _agree(self, one: FloatArray, other: FloatArray, tolerance: float) -> bool:
        first, second = self.scaled(one), self.scaled(other)
        size = float(np.max(np.abs(second))) + _TINY
        return bool(np.all(np.abs(first - second) <= tolerance * size))
