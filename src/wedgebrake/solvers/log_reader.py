"""Events, returns and sticks, read from the segment log of any solver."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from wedgebrake.arrays import FloatArray
from wedgebrake.dynamics.enums import EventKind, Outcome
from wedgebrake.dynamics.segment_log import REST, empty_log
from wedgebrake.solvers.solution import Clock, Events, Returns, Sticks

SHORTEST_STICK = 0.01
"""Rest shorter than this share of a torque period is a passage through the stick band."""

Log = NDArray[np.record]
Mask = NDArray[np.bool_]


def logged(rows: int, run: Callable[[Log], Any]) -> tuple[Log, Any]:
    """The log of a kernel and what it returns, with more room whenever ``rows`` do not suffice."""
    while True:
        log = empty_log(rows)
        ended = run(log)
        if ended.outcome != Outcome.LOG_FULL:
            return log[: ended.rows].copy(), ended
        rows *= 4


def log_times(log: Log, clock: Clock, end: float) -> FloatArray:
    """Times of a log's rows [s]; ascending up to the end, also where a period's is rounded."""
    times = clock.join(log["period"], log["time"])
    return np.asarray(np.minimum(np.maximum.accumulate(times), end))


def events_of(log: Log, clock: Clock, end: float) -> Events:
    """Events of a run that ended at a time [s]."""
    real = (log["kind"] >= EventKind.STICK) & (log["kind"] < EventKind.END)
    rows = log[real]
    return Events(
        time=log_times(log, clock, end)[real],
        kind=rows["kind"].astype(np.int8),
        angle=rows["angle"].copy(),
        velocity=rows["velocity"].copy(),
        side=rows["side"].astype(np.int8),
    )


def returns_of(log: Log) -> Returns:
    """Returns to the section, and the start if it is on the section."""
    at_start = (log["kind"] == EventKind.START) & (log["time"] == 0.0)
    rows = log[(log["kind"] == EventKind.RETURN) | at_start]
    return Returns(rows["period"].copy(), rows["angle"].copy(), rows["velocity"].copy())


def sticks_at_rest(log: Log, clock: Clock, end: float) -> Sticks:
    """Runs of rows at rest, with the side of the slip before and after."""
    resting = log["mode"] == REST
    before = np.concatenate(([False], resting[:-1]))
    return _sticks(log, clock, end, resting & ~before, before & ~resting)


def sticks_in_band(log: Log, clock: Clock, end: float) -> Sticks:
    """Passages through the stick band that last; shorter ones are reversals.

    A smooth law never rests, it creeps or passes.
    """
    kind = log["kind"]
    found = _sticks(log, clock, end, kind == EventKind.BAND_ENTERED, kind == EventKind.BAND_LEFT)
    long = found.end - found.start > SHORTEST_STICK * clock.period
    return Sticks(found.start[long], found.end[long], found.entry[long], found.exit[long])


def _sticks(log: Log, clock: Clock, end: float, entered: Mask, left: Mask) -> Sticks:
    """Intervals between rows that begin and end rest; the last may be open."""
    times, side = log_times(log, clock, end), log["side"]
    sliding = np.isin(log["kind"], (EventKind.STICK, EventKind.BAND_ENTERED))
    start, entry = times[entered], np.where(sliding, side, 0.0)[entered]
    stop, exit_ = times[left], side[left]
    if stop.size < start.size:
        stop, exit_ = np.append(stop, end), np.append(exit_, 0.0)
    return Sticks(start, stop, entry.astype(np.int8), exit_.astype(np.int8))


def within(times: FloatArray, sticks: Sticks) -> Mask:
    """Return True for each time [s] in an interval of rest, its ends included."""
    begun = np.searchsorted(sticks.start, times, side="right")
    ended = np.searchsorted(sticks.end, times, side="left")
    return np.asarray(begun > ended)
