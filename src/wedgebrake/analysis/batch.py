"""Many systems, one after another: the loop of every sweep, without Python in it."""

import math

import numpy as np
from numba import types

from wedgebrake.analysis.accumulators import ENTRIES
from wedgebrake.analysis.classify import LONGEST
from wedgebrake.analysis.evaluate_point import COLUMNS, FINAL_THETA, FINAL_W, OUTCOME, judge
from wedgebrake.dynamics.assemble import assemble
from wedgebrake.dynamics.brake_torque import LAW
from wedgebrake.dynamics.enums import COMPLETED
from wedgebrake.dynamics.jit import compiled_for
from wedgebrake.dynamics.linear_flow import COLUMNS as FLOW_COLUMNS
from wedgebrake.solvers.event_driven.trajectory import LOG_COLUMNS

# Rows of the log that is worked through at once: it stays in the fastest cache.
_ROWS = 256


def _run(
    law, speeds, lines, brakes, frictions, actions, torques, chosen, states, follow, transient,
    periods, limit, max_events, diverged, answers, record,
):  # fmt: skip
    """Judge every point of a batch, in order.

    law, speeds : of ``assemble``
    lines ... torques : tables of the parts of the systems, a row each; a row that begins
                with nan is no valid part
    chosen      : (points, 5) rows of the five tables
    states      : (points, 2) angle and velocity at t = 0
    follow      : each point starts where the one before it ended, if it ran to its end
    transient ... max_events : of ``point.judge``
    diverged    : of ``assemble``
    answers     : (points, point.COLUMNS); an outcome nan: not valid
    record      : (points, periods + 1, 2) receives the Poincare points that are reached;
                no rows: not wanted
    """
    nodes = speeds.size
    room = (
        np.empty(2 * nodes + 1), np.empty(2 * nodes + 2), np.empty(2 * nodes + 2),
        np.empty((2 * nodes + 2, FLOW_COLUMNS)), np.empty(2 * nodes + 1),
        np.empty((nodes + 1, 3)), np.empty(nodes),
    )  # fmt: skip
    longest = max(transient, 0 if transient >= 0 else limit) + periods + LONGEST + 1
    log = np.empty((_ROWS, LOG_COLUMNS))
    points, growth = np.empty((longest, 2)), np.empty(longest)
    tallies = np.zeros((2, ENTRIES))
    theta, w = 0.0, 0.0
    for i in range(chosen.shape[0]):
        line, brake, friction = lines[chosen[i, 0]], brakes[chosen[i, 1]], frictions[chosen[i, 2]]
        action, torque = actions[chosen[i, 3]], torques[chosen[i, 4]]
        for column in range(COLUMNS):
            answers[i, column] = math.nan
        if math.isnan(line[0] + brake[0] + friction[0] + action[0] + torque[0]):
            continue
        goes_on = follow and i > 0 and answers[i - 1, OUTCOME] == COMPLETED
        if not goes_on:
            theta, w = states[i, 0], states[i, 1]
        problem = assemble(
            law, line, brake, friction, speeds, action, torque, theta, w, diverged, room
        )
        begin, end = judge(
            problem, theta, w, transient, periods, limit, max_events, log, points, growth,
            tallies, answers[i],
        )  # fmt: skip
        theta, w = answers[i, FINAL_THETA], answers[i, FINAL_W]
        if i < record.shape[0]:
            for k in range(begin, end):
                record[i, k - begin, 0] = points[k, 0]
                record[i, k - begin, 1] = points[k, 1]


def _signature():
    """One signature, so that the cache serves all brakes."""
    real, whole = types.float64, types.int64
    vector, matrix = types.Array(real, 1, "C"), types.Array(real, 2, "C")
    return (
        LAW, vector, matrix, matrix, matrix, matrix, matrix, types.Array(whole, 2, "C"), matrix,
        types.boolean, whole, whole, whole, whole, real, matrix, types.Array(real, 3, "C"),
    )  # fmt: skip


run = compiled_for(_signature())(_run)
