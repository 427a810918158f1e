"""Lengths of the windows in which a run waits for its motion to settle.

Each window is as long as all before it, so that every transient ends in one of them. If a motion
approaches an orbit at a constant rate, the window ends when the motion will have settled.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from wedgebrake.analysis import settling
from wedgebrake.analysis.classify import FEWEST_OF_TORUS
from wedgebrake.arrays import FloatArray

# Returns in the first window.
FIRST_WINDOW = 16


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
    end = int(settling.next_window(done, limit, FIRST_WINDOW, waits))
    shown = done + waits > limit and end - done >= FEWEST_OF_TORUS
    return Plan(end, end == limit or shown)


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
