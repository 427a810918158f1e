"""Smooth motions period by period, with derivatives and sums, where no response is wanted."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from wedgebrake.arrays import FloatArray
from wedgebrake.dynamics.enums import Outcome
from wedgebrake.dynamics.jit import compiled
from wedgebrake.dynamics.linear_flow import PIECE, forcing_of
from wedgebrake.dynamics.problem import Instant, State
from wedgebrake.dynamics.section import return_time
from wedgebrake.dynamics.segment_log import SEGMENT
from wedgebrake.solvers.log_reader import SHORTEST_STICK
from wedgebrake.solvers.smooth import simd_batch, taylor
from wedgebrake.solvers.smooth.accumulators import add, count_passages
from wedgebrake.solvers.smooth.dense_output import expand_trail
from wedgebrake.solvers.smooth.problem import STRETCH, Samples, SmoothAssembled, TanhLaw
from wedgebrake.solvers.smooth.simd_batch import LANE, SYSTEM, WIDTH
from wedgebrake.solvers.smooth.steps import open_method
from wedgebrake.solvers.smooth.trajectory import STEP, run
from wedgebrake.solvers.smooth.variational import propagate

# Rows of the log and of the trail of a period; most motions need a tenth.
_ROWS = 512


class Passed(NamedTuple):
    """Some periods of a motion.

    outcome  : ``Outcome``
    points   : (m + 1, 2) angle [rad] and velocity [rad/s] at the beginning of each of m completed
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


@compiled
def _advance(functions, problem, max_steps, points, matrices, sums, begin, shortest, end):
    """Advance periods of the torque from the phase 0, as many as ``points`` has room for.

    points   : (n + 1, 2) receives the states at the end of each period; the first is given
    matrices : (n, 2, 2) receives the derivative over each period; no rows: not wanted
    sums     : None, or as for ``advance``
    shortest : the shortest stick [s]
    end      : of each period, counted from its beginning

    Returns (outcome, completed periods, angle, velocity, steps).
    """
    samples = Samples(np.empty(0, np.int64), np.empty(0), np.empty((0, 2)))
    method = open_method(problem.law, functions, problem)
    length, steps, room = return_time(problem.torque), 0, _ROWS
    trailing = matrices.shape[0] > 0
    if sums is not None:
        trailing = True
    log, trail = np.empty(room, SEGMENT), np.empty(room if trailing else 0, STEP)
    angle, velocity = points[0, 0], points[0, 1]
    for done in range(points.shape[0] - 1):
        start = State(0, 0.0, angle, velocity)
        while True:
            left = max_steps - steps
            ended = run(functions, problem, start, end, left, samples, log, trail, None)
            if ended.outcome != Outcome.LOG_FULL:
                break
            room *= 4
            log, trail = np.empty(room, SEGMENT), np.empty(room if trailing else 0, STEP)
        angle, velocity = ended.state.angle, ended.state.velocity
        steps += ended.steps
        if sums is not None:
            count_passages(log, ended.rows, begin + done * length, shortest, sums)
        if ended.outcome != Outcome.COMPLETED:
            return ended.outcome, done, angle, velocity, steps
        points[done + 1, 0], points[done + 1, 1] = angle, velocity
        if trailing:
            record = expand_trail(method, problem, trail, ended.trail)
            if sums is not None:
                add(record, problem, trail, ended.trail, sums)
            if matrices.shape[0] > 0:
                deviations = propagate(record, problem, trail, ended.trail)
                matrix = matrices[done]
                matrix[0, 0], matrix[1, 0] = deviations.angle1, deviations.velocity1
                matrix[0, 1], matrix[1, 1] = deviations.angle2, deviations.velocity2
    return Outcome.COMPLETED, points.shape[0] - 1, angle, velocity, steps


def advance(
    given: SmoothAssembled,
    state: tuple[float, float],
    periods: int,
    max_steps: int,
    *,
    derivative: bool = False,
    sums: Any = None,
    begin: float = 0.0,
    half: bool = False,
) -> Passed:
    """Advance some periods of the torque from its phase 0.

    The states are exact to about rtol, the matrices to rtol times the ratio of the fastest
    sliding speed to the half width of the steep layer.

    sums : ``motion_sums.SUMS`` to go on with, from the time ``begin`` [s]
    half : whether to advance half a period instead, once
    """
    points = np.empty((periods + 1, 2))
    points[0] = state
    matrices = np.empty((periods if derivative else 0, 2, 2))
    length = return_time(given.problem.torque)
    shortest = SHORTEST_STICK * length
    end = Instant(0, 0.5 * length) if half else Instant(1, 0.0)
    outcome, done, angle, velocity, steps = _advance(
        *given, max_steps, points, matrices, sums, begin, shortest, end
    )
    return Passed(outcome, points[: done + 1], (angle, velocity), steps, matrices[:done])


def fits_lanes(given: SmoothAssembled) -> bool:
    """Return True if a problem can be solved in lanes: its law has a series."""
    return isinstance(given.problem.law, TanhLaw)


def advance_together(
    given: Sequence[SmoothAssembled], states: FloatArray, periods: int, max_steps: int
) -> list[Passed]:
    """Advance up to ``WIDTH`` motions by some periods of the torque from its phase 0.

    Each reaches the state to which ``advance`` brings it, to about rtol, independently of the
    others. A motion may end before it has completed the periods.

    states : (n, 2) angle [rad] and velocity [rad/s] of each
    """
    count, most = len(given), max(one.problem.stretches.size for one in given)
    lanes, inputs = np.zeros(WIDTH, dtype=LANE), np.zeros((taylor.INPUT_ROWS, WIDTH))
    stretches, pieces = np.zeros((WIDTH, most), STRETCH), np.zeros((WIDTH, most), PIECE)
    points = np.empty((WIDTH, periods + 1, 2))
    for lane in range(WIDTH):
        # Lanes without a motion of their own repeat the first.
        number = lane if lane < count else 0
        one = given[number].problem
        assert isinstance(one.law, TanhLaw)  # noqa: S101 - asked by ``fits_lanes``
        taylor.load(one.driveline, one.torque, one.law, inputs, lane)
        inputs[[taylor.INPUT.angle, taylor.INPUT.velocity], lane] = states[number]
        points[lane, 0] = states[number]
        numbers = (
            *forcing_of(one.driveline, one.torque), return_time(one.torque),
            inputs[taylor.INPUT.slope, lane], one.band, one.divergence_velocity,
            *one.tolerances, one.longest_step,
        )  # fmt: skip
        for name, value in zip(SYSTEM.split(), numbers, strict=True):
            lanes[name][lane] = value
        stretches[lane, : one.stretches.size] = one.stretches
        pieces[lane, : one.pieces.size] = one.pieces
    simd_batch.run(lanes, stretches, pieces, inputs, max_steps, points)
    ends = inputs[[taylor.INPUT.angle, taylor.INPUT.velocity]].T
    return [
        Passed(
            outcome=int(lanes["outcome"][lane]),
            points=points[lane, : lanes["completed"][lane] + 1],
            state=(float(ends[lane, 0]), float(ends[lane, 1])),
            steps=int(lanes["steps"][lane]),
            matrices=np.empty((0, 2, 2)),
        )
        for lane in range(count)
    ]
