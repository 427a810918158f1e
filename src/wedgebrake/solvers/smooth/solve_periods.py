"""Smooth motions period by period, where no response is wanted: orbits and classes of motion."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from wedgebrake.dynamics.linear_flow import PIECE, forcing_of
from wedgebrake.dynamics.section import return_time
from wedgebrake.solvers.log_reader import SHORTEST_STICK
from wedgebrake.solvers.smooth import periods as kernel
from wedgebrake.solvers.smooth import simd_batch, taylor
from wedgebrake.solvers.smooth.problem import STRETCH, Assembled, TanhLaw
from wedgebrake.solvers.smooth.simd_batch import LANE, WIDTH
from wedgebrake.solvers.solution import FloatArray


class Passed(NamedTuple):
    """Some periods of a motion.

    outcome  : ``Outcome``
    points   : (m + 1, 2) angle [rad] and velocity [rad/s] at the begin of each of m completed
               periods, and at the end of the last
    state    : where the run ended
    steps    : spent
    matrices : (m, 2, 2) derivatives over each period; no rows where not wanted
    """

    outcome: int
    points: FloatArray
    state: tuple[float, float]
    steps: int
    matrices: FloatArray


class PeriodMap(NamedTuple):
    """The state after a period of the torque, and its derivative by the state before it.

    outcome : ``Outcome``
    angle, velocity : where the run ended [rad], [rad/s]
    matrix  : (2, 2) d(angle, velocity)/d(angle, velocity before), nan if the period was not
              completed; (0, 2) where it was not wanted
    """

    outcome: int
    angle: float
    velocity: float
    matrix: FloatArray


def advance(
    given: Assembled,
    state: tuple[float, float],
    periods: int,
    max_steps: int,
    *,
    derivative: bool = False,
    sums: Any = None,
    begin: float = 0.0,
) -> Passed:
    """Advance some periods of the torque from its phase 0.

    The states are exact to about rtol, the matrices to rtol times the ratio of the fastest
    sliding speed to the half width of the steep layer.

    sums : ``motion_sums.SUMS`` to go on with, from the time ``begin`` [s]
    """
    points = np.empty((periods + 1, 2))
    points[0] = state
    matrices = np.empty((periods if derivative else 0, 2, 2))
    shortest = SHORTEST_STICK * return_time(given.problem.torque)
    outcome, done, angle, velocity, steps = kernel.advance(
        *given, max_steps, points, matrices, sums, begin, shortest
    )
    return Passed(outcome, points[: done + 1], (angle, velocity), steps, matrices[:done])


def period_map(
    given: Assembled,
    angle: float,
    velocity: float,
    max_steps: int,
    *,
    derivative: bool = True,
) -> PeriodMap:
    """Advance one period of the torque from its phase 0; see ``advance``."""
    there = advance(given, (angle, velocity), 1, max_steps, derivative=derivative)
    matrix = np.empty((0, 2))
    if derivative:
        matrix = there.matrices[0] if there.matrices.size else np.full((2, 2), math.nan)
    return PeriodMap(there.outcome, *there.state, matrix)


def fits_lanes(given: Assembled) -> bool:
    """Return True if a problem can be solved in lanes: its law has a series."""
    return isinstance(given.problem.law, TanhLaw)


def advance_together(
    given: Sequence[Assembled], states: FloatArray, periods: int, max_steps: int
) -> list[Passed]:
    """Advance up to ``WIDTH`` motions by some periods of the torque from its phase 0.

    Each reaches the state to which ``advance`` brings it, to about rtol, independently of the
    others. A motion may end before it has completed the periods.

    states : (n, 2) angle [rad] and velocity [rad/s] of each
    """
    problems = [one.problem for one in given]
    count, most = len(problems), max(one.stretches.size for one in problems)
    lanes, inputs = np.zeros(WIDTH, dtype=LANE), np.zeros((taylor.INPUT_ROWS, WIDTH))
    stretches, pieces = np.zeros((WIDTH, most), STRETCH), np.zeros((WIDTH, most), PIECE)
    for lane in range(WIDTH):
        # Lanes without a motion of their own repeat the first.
        number = lane if lane < count else 0
        one, inertia = problems[number], problems[number].driveline.inertia
        law = one.law
        assert isinstance(law, TanhLaw)  # noqa: S101 - asked by ``fits_lanes``
        taylor.load(one.driveline, one.torque, law, inputs, lane)
        inputs[[taylor.INPUT.angle, taylor.INPUT.velocity], lane] = states[number]
        here, tolerances = lanes[lane], one.tolerances
        here.forcing, here.angular_frequency = forcing_of(one.driveline, one.torque)
        here.period, here.slope = return_time(one.torque), law.actuator.slope / inertia
        here.stiffness = one.driveline.stiffness / inertia
        here.rest_velocity, here.band = one.driveline.rest_velocity, one.band
        here.divergence_velocity, here.longest_step = one.divergence_velocity, one.longest_step
        here.relative_tolerance = tolerances.relative
        here.angle_tolerance, here.velocity_tolerance = tolerances.angle, tolerances.velocity
        stretches[lane, : one.stretches.size] = one.stretches
        pieces[lane, : one.pieces.size] = one.pieces
    points = np.empty((WIDTH, periods + 1, 2))
    simd_batch.run(lanes, stretches, pieces, inputs, max_steps, points)
    angles, velocities = inputs[taylor.INPUT.angle], inputs[taylor.INPUT.velocity]
    return [
        Passed(
            outcome=int(lanes["outcome"][lane]),
            points=points[lane, : lanes["completed"][lane] + 1],
            state=(float(angles[lane]), float(velocities[lane])),
            steps=int(lanes["steps"][lane]),
            matrices=np.empty((0, 2, 2)),
        )
        for lane in range(count)
    ]
