"""Intervals of rest from the crossings of a band about zero sliding speed."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from wedgebrake.solvers.solution import FloatArray, Sticks

SHORTEST_STICK = 0.01
"""Rest shorter than this share of a torque period is a passage through the band."""


def sticks_from_layer(
    enter_time: FloatArray,
    enter_side: NDArray[np.int8] | FloatArray,
    leave_time: FloatArray,
    leave_side: NDArray[np.int8] | FloatArray,
    minimum: float,
) -> Sticks:
    """Passages through the band that last longer than ``minimum`` [s].

    Shorter ones are reversals: a smooth law never rests, it creeps or passes. The four
    arrays have one entry a passage, in order; side 0 where the run begins or ends inside.
    """
    long = leave_time - enter_time > minimum
    return Sticks(
        start=enter_time[long],
        end=leave_time[long],
        entry=enter_side[long].astype(np.int8),
        exit=leave_side[long].astype(np.int8),
    )


def within(times: FloatArray, sticks: Sticks) -> NDArray[np.bool_]:
    """Whether each time [s] lies in an interval of rest, its ends included."""
    begun = np.searchsorted(sticks.start, times, side="right")
    ended = np.searchsorted(sticks.end, times, side="left")
    return np.asarray(begun > ended)
