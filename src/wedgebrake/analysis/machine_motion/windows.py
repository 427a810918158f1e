"""Lengths of the windows in which a run waits for its motion to settle.

Each window is as long as all before it, so that every transient ends in one of them. If a motion
approaches an orbit at a constant rate, the window ends when the motion will have settled.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from wedgebrake.analysis import classify
from wedgebrake.analysis.classify import SETTLED, Window

FloatArray = NDArray[np.float64]
# Returns in the first window.
FIRST_WINDOW = 16
# Change of the mean logarithm of the distance of a return, from half to half of a window, that
# shows a steady approach, and excludes a torus.
_FALLING = -0.35
# Factor for distances that vary about their exponential decay, on either side of the limit.
_VARIES = 3.0
# Fewest returns from which the class of a motion that does not repeat can follow.
_APERIODIC = 200
# Returns that show that a motion has settled, and the least share of the run in a window.
_SHOWN, _SHARE = 16, 16


class Plan(NamedTuple):
    """The next window.

    end         : number of returns at its end
    derivatives : whether the growth of deviations is needed to classify it
    """

    end: int
    derivatives: bool


def next_window(done: int, limit: int, waits: float) -> Plan:
    """The window after ``done`` returns.

    limit : largest number of returns
    waits : estimate of the returns until the motion has settled; infinite if it is not known
    """
    end = classify.next_window(done, limit, FIRST_WINDOW)
    if math.isinf(waits):
        return Plan(end, end == limit or end - done >= _APERIODIC)
    settled = done + max(math.ceil(waits) + _SHOWN, done // _SHARE)
    return Plan(min(settled, end), settled >= limit)


def returns_to_settle(window: Window, distance: float) -> float:
    """Number of returns until a motion that approaches an orbit has settled; infinite if not known.

    distance : of its best return, as a share of the size of the motion
    """
    count = len(window.points) - 1
    if count < FIRST_WINDOW or not 0.0 < distance < math.inf:
        return math.inf
    change = classify.trend(window.points, window.scale)
    if not change < _FALLING:
        return math.inf
    rate = -2.0 * change / count
    size = _VARIES * distance / -math.expm1(-rate * _best_return(window.points))
    return float(max(math.log(size / SETTLED), 0.0) / rate)


def _best_return(points: FloatArray) -> int:
    """Number of returns after which the last points have returned best."""
    last = len(points) - 1
    numbers = np.arange(1, last // 4 + 1)
    apart = [points[last - k] - points[last - k - numbers] for k in range(4)]
    distances = np.linalg.norm(apart, axis=2).max(axis=0)
    return int(numbers[distances.argmin()])


def distance_to_orbit(matrices: FloatArray, change: FloatArray) -> float:
    """Distance of a point to the orbit that it approaches, by a step of Newton's method.

    matrices : (n, p, p) derivatives from return to return along the orbit
    change   : (p,) of the point over the last orbit
    """
    whole = np.eye(change.size)
    for matrix in matrices[:, : change.size, : change.size]:
        whole = matrix @ whole
    try:
        return float(np.linalg.norm(np.linalg.solve(np.eye(change.size) - whole, change)))
    except np.linalg.LinAlgError:
        return math.inf
