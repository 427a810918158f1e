"""The segment log: written by every solver, and read by the analysis.

A row is the start of a segment of motion: the kind of event, time, state, the mode in
which the motion continues, and direction. The motion until the next row follows from the row.
"""

import numpy as np
from numpy.typing import NDArray

from wedgebrake.dynamics.jit import compiled
from wedgebrake.dynamics.records import record

REST = -1
"""The mode of rest relative to the brake; other modes are pieces of the brake's law."""

SEGMENT = record(
    fields=[
        ("kind", np.int64),  # an ``EventKind``
        ("period", np.int64),  # number of returns to the section
        ("time", np.float64),  # since the last return [s]
        ("angle", np.float64),  # [rad]
        ("velocity", np.float64),  # [rad/s]
        ("mode", np.int64),  # piece of the brake's law, or REST
        # Sign of the sliding velocity: before a stick, else after the event; 0: none.
        ("side", np.float64),
    ]
)


@compiled
def write(log, rows, kind, period, time, angle, velocity, mode, side):
    """Write one row and return the number of rows; the caller ensures that there is room."""
    row = log[rows]
    row.kind = kind
    row.period = period
    row.time = time
    row.angle = angle
    row.velocity = velocity
    row.mode = mode
    row.side = side
    return rows + 1


@compiled
def duration(before, after, return_time):
    """Time [s] between two rows."""
    return (after.period - before.period) * return_time + after.time - before.time


def empty_log(rows: int) -> NDArray[np.record]:
    """A log with room for ``rows`` rows."""
    return np.empty(rows, dtype=SEGMENT)
