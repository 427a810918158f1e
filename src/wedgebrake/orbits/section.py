"""The section at which orbits are sampled, and orbits compared by their points on it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from wedgebrake.model.system import BrakedDriveline

FloatArray = NDArray[np.float64]
# Of a structured type, as the margins of an orbit.
Records = NDArray[np.record]

# Points of an orbit nearer than this share of its size are one.
SAME = 1e-6
_TINY = 1e-300


@dataclass(frozen=True, eq=False)
class Section:
    """Stroboscopic section: the states at t = 0, T, 2 T, ..., T being the period of the torque.

    This class alone knows that orbits are sampled once in a period of the torque; all others ask
    it for the time between returns, for the scales of states, and whether two orbits agree.
    Points of an orbit are given as an array (order, n) of its successive returns.

    period  : time between two returns [s]
    weights : (n,) factors that turn the parts of a state into velocities. Either of angle and
              velocity may vanish at the section.
    """

    period: float
    weights: FloatArray

    @classmethod
    def of(cls, system: BrakedDriveline) -> Section:
        """Section of a system."""
        torque = system.excitation
        return cls(1.0 / torque.frequency, np.array([torque.angular_frequency, 1.0]))

    def duration(self, order: int) -> float:
        """Duration of an orbit of so many returns [s]."""
        return order * self.period

    def prime_order(self, points: FloatArray, tolerance: float = SAME) -> int:
        """Fewest returns after which an orbit repeats, to a share of its size."""
        order = int(points.shape[0])
        scaled = points * self.weights
        size = float(np.max(np.abs(scaled))) + _TINY
        for fewer in range(1, order):
            if order % fewer == 0:
                apart = np.abs(scaled - np.roll(scaled, fewer, axis=0))
                if np.all(apart <= tolerance * size):
                    return fewer
        return order

    def half_difference(self, points: FloatArray) -> FloatArray:
        """Difference of each point to that half an orbit before; empty for an odd order.

        It vanishes where an orbit repeats after half its returns. A branch that goes through such
        an orbit retraces its own orbits, half an orbit later: the difference then changes sign.
        """
        order = int(points.shape[0])
        if order % 2:
            return np.zeros(0)
        states = points * self.weights
        return np.asarray(states - np.roll(states, order // 2, axis=0))

    def same_orbit(self, one: FloatArray, other: FloatArray, tolerance: float) -> bool:
        """Return True if two orbits of one order agree at some shift by whole returns."""
        first, second = one * self.weights, other * self.weights
        size = float(np.max(np.abs(second))) + _TINY
        return any(
            bool(np.all(np.abs(np.roll(first, shift, axis=0) - second) <= tolerance * size))
            for shift in range(first.shape[0])
        )
