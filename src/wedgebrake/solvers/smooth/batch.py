"""Several smooth motions at once, in vector lanes: what the transients of a sweep are."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from wedgebrake.dynamics.linear_flow import PIECE
from wedgebrake.solvers.smooth import simd_batch
from wedgebrake.solvers.smooth.solve import Problem
from wedgebrake.solvers.smooth.solve_periods import Passed
from wedgebrake.solvers.solution import FloatArray

WIDTH = simd_batch.WIDTH
"""Motions that are worked on at once."""


def fits(given: Problem) -> bool:
    """Whether a problem can be solved in lanes: its law has a series."""
    return given.series is not None


def advance_together(
    given: Sequence[Problem], states: FloatArray, periods: int, max_steps: int
) -> list[Passed]:
    """Advance up to ``WIDTH`` motions by some periods of the torque from its phase 0.

    Each comes to where ``smooth_periods.advance`` brings it, to about rtol; what it comes to
    does not depend on the others. A motion may end before it is done.

    states : (n, 2) angle [rad] and velocity [rad/s] of each
    """
    count, most = len(given), max(one.edges.size for one in given)
    # Lanes without a motion of their own repeat the first.
    chosen = [given[lane] if lane < count else given[0] for lane in range(WIDTH)]
    begin = np.array([states[lane if lane < count else 0] for lane in range(WIDTH)], dtype=float)
    edges = np.full((WIDTH, most), math.inf)
    kinks, linear = np.zeros((WIDTH, most + 1, 2)), np.zeros((WIDTH, most + 1), dtype=np.bool_)
    table = np.zeros((WIDTH, most + 1), dtype=PIECE)
    for lane, one in enumerate(chosen):
        own = one.edges.size
        edges[lane, :own], kinks[lane, : own + 1] = one.edges, one.kinks
        linear[lane, : own + 1], table[lane, : own + 1] = one.linear, one.table
    points = np.empty((WIDTH, periods + 1, 2))
    outcomes, done, steps = (np.zeros(WIDTH, dtype=np.int64) for _ in range(3))
    simd_batch.run(
        *(np.array([getattr(one, name) for one in chosen]) for name in ("plant", "series")),
        edges, kinks, linear, table,
        *(np.array([getattr(one, name) for one in chosen])
          for name in ("band", "w_diverged", "tolerances", "h_max")),
        begin, max_steps, points, outcomes, done, steps,
    )  # fmt: skip
    none = np.empty((0, 2, 2))
    return [
        Passed(
            outcome=int(outcomes[lane]),
            points=points[lane, : done[lane] + 1],
            state=(float(begin[lane, 0]), float(begin[lane, 1])),
            steps=int(steps[lane]),
            matrices=none,
        )
        for lane in range(count)
    ]
