"""The exact flow over periods of the torque, with its derivative: what chains are made from."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from wedgebrake.analysis import saltation
from wedgebrake.continuation.equations import FloatArray, NoOrbitError
from wedgebrake.dynamics.enums import Outcome
from wedgebrake.dynamics.problem import Instant, State
from wedgebrake.dynamics.segment_log import empty_log
from wedgebrake.solvers.event_driven import trajectory

# Rows of the log for each period that is asked for, at first.
_ROWS = 32
_MOST_EVENTS = 100_000
_NO_POINTS = np.empty((0, 2))


class Run(NamedTuple):
    """A run of some periods from phase 0: its log, where it ends, and the derivative of that."""

    log: NDArray[np.record]
    end: FloatArray
    matrix: FloatArray


def run(problem: Any, state: FloatArray, periods: int) -> Run:
    """The run from (angle, velocity); raises ``NoOrbitError`` where it does not last."""
    rows = 16 + _ROWS * periods
    while True:
        log, start = empty_log(rows), State(0, 0.0, state[0], state[1])
        found = trajectory.run(problem, start, Instant(periods, 0.0), _MOST_EVENTS, log, _NO_POINTS)
        if found.outcome != Outcome.LOG_FULL:
            break
        rows *= 4
    if found.outcome != Outcome.COMPLETED:
        raise NoOrbitError
    identity = saltation.Deviations(1.0, 0.0, 0.0, 1.0)
    there = saltation.propagate(problem, log, found.rows, identity, np.empty(0), 0)
    x1, y1, x2, y2 = there.deviations
    matrix = math.exp(min(there.log_scale, 700.0)) * np.array([[x1, x2], [y1, y2]])
    return Run(log[: found.rows], np.array([found.state.angle, found.state.velocity]), matrix)
