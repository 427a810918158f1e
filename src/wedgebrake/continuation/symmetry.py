"""Orbits that are their own mirror image, or repeat, before their time is over."""

from __future__ import annotations

import numpy as np

from wedgebrake.continuation.equations import Equations, FloatArray
from wedgebrake.continuation.problem import Family
from wedgebrake.model.system import BrakedDriveline

# Points of an orbit nearer than this share of its size are one.
_SAME = 1e-6


def is_symmetric(
    equations: Equations,
    unknowns: FloatArray,
    family: Family,
    values: tuple[float, ...],
    tolerance: float = _SAME,
) -> bool:
    """Whether theta(t + nT/2) = -theta(t), for n odd, on a brake without a preferred direction."""
    system = family.system(values)
    if equations.order % 2 == 0 or not is_odd(system):
        return False
    gap = equations.from_mirror(unknowns, system, tolerance)
    return bool(gap.size > 0 and np.max(np.abs(gap)) <= tolerance)


def is_odd(system: BrakedDriveline) -> bool:
    """Whether both directions are alike: a brake that amplifies so, on a shaft that rests."""
    gain = system.brake.amplification
    alike = all(gain(m) == -gain(-m) for m in (0.05, 0.2, 0.4))
    return alike and system.driveline.drive_speed == 0.0


def prime_order(points: FloatArray, omega: float, tolerance: float = _SAME) -> int:
    """The fewest periods after which an orbit repeats.

    points    : (order, 2) Poincare points;  omega : of the torque [rad/s]
    tolerance : as a share of the orbit's size, in velocities. Angle or velocity alone may vanish
                at the section.
    """
    order = int(points.shape[0])
    scaled = points * [omega, 1.0]
    size = float(np.max(np.abs(scaled))) + 1e-300
    for fewer in range(1, order):
        if order % fewer == 0:
            apart = np.abs(scaled - np.roll(scaled, fewer, axis=0))
            if np.all(apart <= tolerance * size):
                return fewer
    return order


def between_halves(points: FloatArray, omega: float) -> FloatArray:
    """From each Poincare point to that half an orbit before; empty for an odd order.

    It vanishes where an orbit repeats after half its periods. A branch that goes through such an
    orbit comes back over its own orbits, half an orbit later: this has changed its sign then.
    """
    order = int(points.shape[0])
    if order % 2:
        return np.zeros(0)
    states = points * [omega, 1.0]
    return np.asarray(states - np.roll(states, order // 2, axis=0))


def alike(one: FloatArray, other: FloatArray, omega: float, tolerance: float) -> bool:
    """Whether two orbits of one order are the same, at any shift by whole periods."""
    first, second = one * [omega, 1.0], other * [omega, 1.0]
    size = float(np.max(np.abs(second))) + 1e-300
    return any(
        bool(np.all(np.abs(np.roll(first, turn, axis=0) - second) <= tolerance * size))
        for turn in range(first.shape[0])
    )


def met(fewer: int) -> str:
    """Words for the end of a branch whose orbit repeats after fewer periods there."""
    of = "the synchronous orbit" if fewer == 1 else f"an orbit of {fewer} periods"
    return f"period doubling of {of}"
