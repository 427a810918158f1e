"""Smooth motions period by period, where no response is asked for: orbits, classes of motion."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from wedgebrake.solvers.log_reader import SHORTEST_STICK
from wedgebrake.solvers.smooth import accumulators
from wedgebrake.solvers.smooth import periods as kernel
from wedgebrake.solvers.smooth.laws import gathered
from wedgebrake.solvers.smooth.solve import Problem
from wedgebrake.solvers.solution import FloatArray


class Passed(NamedTuple):
    """Some periods of a motion.

    outcome  : code of ``wedgebrake.dynamics.enums``
    points   : (m + 1, 2) angle [rad] and velocity [rad/s] at the beginning of each of m
               completed periods, and at the end of the last
    state    : where the run ended
    steps    : spent
    matrices : (m, 2, 2) derivatives over each period; no rows where not asked for
    """

    outcome: int
    points: FloatArray
    state: tuple[float, float]
    steps: int
    matrices: FloatArray


class PeriodMap(NamedTuple):
    """The state after a period of the torque, and its derivative by the state before it.

    outcome : code of ``wedgebrake.dynamics.enums``
    angle, velocity : where the run ended [rad], [rad/s]
    matrix  : (2, 2) d(angle, velocity)/d(angle, velocity before), nan if the period was not
              completed; (0, 2) where it was not asked for
    """

    outcome: int
    angle: float
    velocity: float
    matrix: FloatArray


def advance(
    given: Problem,
    state: tuple[float, float],
    periods: int,
    max_steps: int,
    *,
    derivative: bool = False,
    sums: FloatArray | None = None,
    begin: float = 0.0,
) -> Passed:
    """Advance some periods of the torque from its phase 0.

    The states are exact to about rtol, the matrices to rtol times the ratio of the fastest
    sliding speed to the half width of the steep layer.

    sums  : entries of ``accumulators`` to go on with, from the time ``begin`` [s]
    """
    points = np.empty((periods + 1, 2))
    matrices = np.empty((periods if derivative else 0, 2, 2))
    length = 2.0 * math.pi / given.plant[4]
    rest = (*given[3:], *state, max_steps, points, matrices, sums, begin, SHORTEST_STICK * length)
    if given.pair is None:
        run = kernel.advance_series(given.plant, None, given.series, *rest)
    else:
        (friction, friction_shape, brake, brake_shape), *others = given.pair
        laws = (gathered(friction, brake), (friction_shape, brake_shape), *others)
        run = kernel.advance_pair(sums is not None)(given.plant, laws, None, *rest)
    outcome, done, angle, velocity, steps = run
    return Passed(outcome, points[: done + 1], (angle, velocity), steps, matrices[:done])


def period_map(
    given: Problem, angle: float, velocity: float, max_steps: int, *, derivative: bool = True
) -> PeriodMap:
    """Advance one period of the torque from its phase 0; see ``advance``."""
    there = advance(given, (angle, velocity), 1, max_steps, derivative=derivative)
    matrix = np.empty((0, 2))
    if derivative:
        matrix = there.matrices[0] if there.matrices.size else np.full((2, 2), math.nan)
    return PeriodMap(there.outcome, *there.state, matrix)


def no_sums() -> FloatArray:
    """Sums to begin with."""
    sums = np.empty(accumulators.ENTRIES)
    accumulators.clear(sums)
    return sums
