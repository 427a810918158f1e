"""A smooth motion period by period, with its derivative and sums over it."""

import math
from typing import NamedTuple

import numpy as np

from wedgebrake.dynamics.enums import Outcome
from wedgebrake.dynamics.jit import compiled
from wedgebrake.dynamics.problem import Instant, State
from wedgebrake.dynamics.section import return_time
from wedgebrake.dynamics.segment_log import SEGMENT
from wedgebrake.solvers.smooth.accumulators import add, count_passages
from wedgebrake.solvers.smooth.dense_output import empty_record, expand_trail
from wedgebrake.solvers.smooth.problem import Samples
from wedgebrake.solvers.smooth.steps import open_method
from wedgebrake.solvers.smooth.trajectory import STEP, run
from wedgebrake.solvers.smooth.variational import propagate

# Rows of the log and of the trail of a period; most motions need a tenth.
_ROWS = 512


class Advanced(NamedTuple):
    """End of a run over periods: its outcome, completed periods, state, and steps spent."""

    outcome: int
    completed: int
    angle: float
    velocity: float
    steps: int


@compiled
def advance(functions, problem, max_steps, points, matrices, sums, begin, shortest):
    """Advance periods of the torque from the phase 0, as many as ``points`` has room for.

    functions, problem : as in ``Assembled``
    points   : (n + 1, 2) states at the begin of each period, and at the end; the first is given
    matrices : (n, 2, 2) receives the derivative over each period; no rows: not wanted
    sums     : None, or a record of ``motion_sums.SUMS`` to go on with, from the time ``begin`` [s]
    shortest : the shortest stick [s]

    Returns ``Advanced``.
    """
    samples = Samples(np.empty(0, np.int64), np.empty(0), np.empty((0, 2)))
    method = open_method(problem.law, functions, problem)
    count, length = points.shape[0] - 1, return_time(problem.torque)
    trailing = matrices.shape[0] > 0
    if sums is not None:
        trailing = True
    room, steps = _ROWS, 0
    log, trail = np.empty(room, SEGMENT), np.empty(room if trailing else 0, STEP)
    record = empty_record(method, problem, trail.size)
    angle, velocity = points[0, 0], points[0, 1]
    matrices[:] = math.nan
    for done in range(count):
        start, end = State(0, 0.0, angle, velocity), Instant(1, 0.0)
        ended = run(functions, problem, start, end, max_steps - steps, samples, log, trail, None)
        while ended.outcome == Outcome.LOG_FULL:
            room *= 4
            log, trail = np.empty(room, SEGMENT), np.empty(room if trailing else 0, STEP)
            record = empty_record(method, problem, trail.size)
            ended = run(
                functions, problem, start, end, max_steps - steps, samples, log, trail, None
            )
        angle, velocity = ended.state.angle, ended.state.velocity
        steps += ended.steps
        if sums is not None:
            count_passages(log, ended.rows, begin + done * length, shortest, sums)
        if ended.outcome != Outcome.COMPLETED:
            return Advanced(ended.outcome, done, angle, velocity, steps)
        points[done + 1, 0], points[done + 1, 1] = angle, velocity
        if trailing:
            expand_trail(record, problem, trail, ended.trail)
        if sums is not None:
            add(record, problem, trail, ended.trail, sums)
        if matrices.shape[0] > 0:
            deviations = propagate(record, problem, trail, ended.trail)
            matrix = matrices[done]
            matrix[0, 0], matrix[1, 0] = deviations.angle1, deviations.velocity1
            matrix[0, 1], matrix[1, 1] = deviations.angle2, deviations.velocity2
    return Advanced(Outcome.COMPLETED, count, angle, velocity, steps)
