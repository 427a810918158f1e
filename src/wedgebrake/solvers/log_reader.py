"""Events, returns and sticks, read from the segment log of any solver."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from wedgebrake.dynamics.enums import EventKind, Outcome
from wedgebrake.dynamics.segment_log import REST, empty_log
from wedgebrake.solvers.solution import Clock, Events, FloatArray, Returns, Sticks

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
    entered = resting & ~before
    side = np.where(log["kind"] == EventKind.STICK, log["side"], 0.0)
    return _sticks(
        log_times(log, clock, end), (entered, side), (before & ~resting, log["side"]), end
    )


def sticks_in_band(log: Log, clock: Clock, end: float) -> Sticks:
    """Passages through the stick band that last; shorter ones are reversals.

    A smooth law never rests, it creeps or passes.
    """
    entered, left = (log["kind"] == kind for kind in (EventKind.BAND_ENTERED, EventKind.BAND_LEFT))
    times, side = log_times(log, clock, end), log["side"]
    sticks = _sticks(times, (entered, side), (left, side), end)
    long = sticks.end - sticks.start > SHORTEST_STICK * clock.period
    return Sticks(sticks.start[long], sticks.end[long], sticks.entry[long], sticks.exit[long])


def _sticks(
    times: FloatArray, entered: tuple[Mask, FloatArray], left: tuple[Mask, FloatArray], end: float
) -> Sticks:
    """Intervals between rows that begin and end rest, with their sides; the last may be open."""
    start, stop = times[entered[0]], times[left[0]]
    exit_ = left[1][left[0]]
    if stop.size < start.size:
        stop, exit_ = np.append(stop, end), np.append(exit_, 0.0)
    return Sticks(start, stop, entered[1][entered[0]].astype(np.int8), exit_.astype(np.int8))


def within(times: FloatArray, sticks: Sticks) -> Mask:
    """Return True for each time [s] in an interval of rest, its ends included."""
    begun = np.searchsorted(sticks.start, times, side="right")
    ended = np.searchsorted(sticks.end, times, side="left")
    return np.asarray(begun > ended)
