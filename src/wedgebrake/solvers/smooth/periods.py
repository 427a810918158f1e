"""A smooth motion period by period, with its derivative and with what it adds up to."""

import math
from functools import cache

import numpy as np
from numba import types

from wedgebrake.dynamics.brake_torque import LAWS, SHAPES
from wedgebrake.dynamics.enums import Outcome
from wedgebrake.dynamics.jit import array_of, compiled, compiled_for
from wedgebrake.dynamics.linear_flow import PIECE
from wedgebrake.dynamics.segment_log import SEGMENT
from wedgebrake.solvers.smooth import dense_output
from wedgebrake.solvers.smooth.accumulators import add, passages
from wedgebrake.solvers.smooth.runge_kutta import SUMS
from wedgebrake.solvers.smooth.trajectory import SCRATCH_ROWS, TRAIL_COLUMNS, run
from wedgebrake.solvers.smooth.variational import carry

# Rows of the log and of the trail of a period; most motions need a tenth.
_ROOM = 512


def _advance(
    plant, given, series, edges, kinks, linear, table, rest_edge, band, w_diverged, tolerances,
    h_max, theta, w, max_steps, points, matrices, sums, begin, shortest,
):  # fmt: skip
    """Advance periods of the torque from the phase 0, as many as ``points`` has room for.

    given    : None, or (laws of friction and brake, their shapes, numbers, tableau, poles); the
               laws as a list, because a function costs more to pass than a period to solve
    plant ... h_max : as for ``smooth.run``
    points   : (n + 1, 2) receives (theta, w) at the beginning of each period, and at the end
    matrices : (n, 2, 2) receives the derivative over each period; no rows: not wanted
    sums     : None, or (smooth_tally.ENTRIES,) to go on with, from the time ``begin`` [s]
    shortest : the shortest stick [s]

    Returns (outcome, periods done, theta, w, steps).
    """
    pair = None
    if given is not None:
        functions, shapes, numbers, tableau, poles = given
        pair = ((functions[0], shapes[0], functions[1], shapes[1]), numbers, tableau, poles)
    number, time, none = np.empty(0, np.int64), np.empty(0), np.empty((0, 2))
    work = np.empty((SCRATCH_ROWS, SUMS))
    count, length = points.shape[0] - 1, 2.0 * math.pi / plant[4]
    trailing = matrices.shape[0] > 0
    if sums is not None:
        trailing = True
    room, steps = _ROOM, 0
    log, trail = np.empty(room, SEGMENT), np.empty((room if trailing else 0, TRAIL_COLUMNS))
    record = np.empty(
        (dense_output.room_for(trail.shape[0]), dense_output.OUTPUTS, dense_output.WIDTH)
    )
    points[0, 0], points[0, 1] = theta, w
    matrices[:] = math.nan
    for done in range(count):
        while True:
            outcome, _, _, theta1, w1, spent, rows, _, left = run(
                plant, pair, series, edges, kinks, linear, table, rest_edge, band, w_diverged,
                tolerances, h_max, 0, 0.0, theta, w, 1, 0.0, max_steps - steps, log, number, time,
                none, work, trail, None,
            )  # fmt: skip
            if outcome != Outcome.LOG_FULL:
                break
            room *= 4
            log = np.empty(room, SEGMENT)
            trail = np.empty((room if trailing else 0, TRAIL_COLUMNS))
            record = np.empty(
                (dense_output.room_for(trail.shape[0]), dense_output.OUTPUTS, dense_output.WIDTH)
            )
        theta, w = theta1, w1
        steps += spent
        if sums is not None:
            passages(log, rows, begin + done * length, shortest, sums)
        if outcome != Outcome.COMPLETED:
            return outcome, done, theta, w, steps
        points[done + 1, 0], points[done + 1, 1] = theta, w
        # Numba leaves out a branch whose argument is None.
        seen, law_seen = None, None
        if series is not None:
            if trailing:
                dense_output.see(plant, series, kinks, linear, trail, left, record)
            seen, law_seen = record, (series, record)
        if sums is not None:
            add(plant, pair, seen, linear, table, trail, left, sums)
        if matrices.shape[0] > 0:
            matrix = matrices[done]
            matrix[0, 0] = matrix[1, 1] = 1.0
            matrix[0, 1] = matrix[1, 0] = 0.0
            carry(
                plant, pair, law_seen, tolerances[0], kinks, linear, table, trail, left, matrix,
            )  # fmt: skip
    return Outcome.COMPLETED, count, theta, w, steps


def _signature(sums):
    real, whole = types.float64, types.int64
    vector, matrix = types.Array(real, 1, "C"), types.Array(real, 2, "C")
    numbers = types.Tuple((real, real, real, types.boolean))
    tableau = types.Tuple((matrix, vector, matrix, vector, matrix, matrix))
    given = types.Tuple((LAWS, SHAPES, numbers, tableau, matrix))
    return (
        types.UniTuple(real, 6), given, types.none, vector, matrix,
        types.Array(types.boolean, 1, "C"), array_of(PIECE), whole, real, real,
        types.UniTuple(real, 3),
        real, real, real, whole, matrix, types.Array(real, 3, "C"), sums, real, real,
    )  # fmt: skip


advance_series = compiled(_advance)


@cache
def advance_pair(summed):
    """``_advance`` for any laws, with sums or without, compiled when first asked for."""
    sums = types.Array(types.float64, 1, "C") if summed else types.none
    return compiled_for(_signature(sums))(_advance)
