"""The exact flow over periods of the torque, with its derivative: what chains are made from."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from wedgebrake.analysis import saltation
from wedgebrake.continuation.equations import FloatArray, NoOrbitError
from wedgebrake.dynamics import enums
from wedgebrake.solvers.event_driven import trajectory

# Rows of the log for each period that is asked for, at first.
_ROWS = 32
_MOST_EVENTS = 100_000
_NO_POINTS = np.empty((0, 2))


class Run(NamedTuple):
    """A run of some periods from phase 0: its log, where it ends, and the derivative of that."""

    log: FloatArray
    end: FloatArray
    matrix: FloatArray


def run(problem: Any, state: FloatArray, periods: int) -> Run:
    """The run from (angle, velocity); raises ``NoOrbitError`` where it does not last."""
    rows = 16 + _ROWS * periods
    while True:
        log = trajectory.empty_log(rows)
        outcome, _, _, angle, velocity, _, used, _ = trajectory.run(
            *problem, 0, 0.0, state[0], state[1], periods, 0.0, _MOST_EVENTS, log, _NO_POINTS
        )
        if outcome != enums.LOG_FULL:
            break
        rows *= 4
    if outcome != enums.COMPLETED:
        raise NoOrbitError
    x1, y1, x2, y2, _, _, scale = saltation.carry(
        *saltation.split(problem), log, used, 1.0, 0.0, 0.0, 1.0, np.empty(0), 0
    )
    matrix = math.exp(min(scale, 700.0)) * np.array([[x1, x2], [y1, y2]])
    return Run(log[:used], np.array([angle, velocity]), matrix)
