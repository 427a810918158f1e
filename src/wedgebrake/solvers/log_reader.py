"""The answer of a kernel for one inertia, with events, returns and sticks from its log."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from wedgebrake.arrays import FloatArray
from wedgebrake.dynamics.actuator import forces
from wedgebrake.dynamics.enums import EventKind, Outcome
from wedgebrake.dynamics.segment_log import REST, empty_log
from wedgebrake.model.system import BrakedDriveline
from wedgebrake.solvers.layout import sides_of
from wedgebrake.solvers.machine.final_state import FinalState
from wedgebrake.solvers.solution import Events, PeriodClock, RecordedStates, Sticks, Trajectory
from wedgebrake.solvers.status import Status

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


def log_times(log: Log, clock: PeriodClock, end: float) -> FloatArray:
    """Times of a log's rows [s]; ascending up to the end, also where a period's is rounded."""
    times = clock.join(log["period"], log["time"])
    return np.asarray(np.minimum(np.maximum.accumulate(times), end))


def one_inertia(
    system: BrakedDriveline,
    states: tuple[FloatArray, FloatArray, FloatArray, FloatArray],
    sticks: Sticks,
    log: Log,
    end: tuple[float, float, float],
    ended: tuple[Status, str, int],
    clock: PeriodClock,
) -> Trajectory:
    """The answer of a kernel for one inertia.

    states : (k,) times, angles, velocities and torques of the brake
    end    : time [s], angle and velocity at the end
    ended  : status, details on it, and work
    """
    times, angle, velocity, torque = states
    sliding = np.abs(velocity + system.driveline.constant_speed)
    (now, *last), (status, detail, work) = end, ended
    name = system.machine.inertias[0].name
    happened = (log["kind"] >= EventKind.STICK) & (log["kind"] < EventKind.END)
    rows, event_times = log[happened], log_times(log, clock, now)[happened]
    # The start is recorded if it is at a whole period.
    at_start = (log["kind"] == EventKind.START) & (log["time"] == 0.0)
    returns = log[(log["kind"] == EventKind.RETURN) | at_start]
    return Trajectory(
        times=times,
        angle=angle[:, None],
        velocity=velocity[:, None],
        brake_torque=torque[:, None],
        force=forces(system.actuation.law, sliding)[:, None],
        sticking=within(times, sticks)[:, None],
        events=_events_of(rows, event_times, system.driveline.constant_speed),
        sticks=sticks,
        status=status,
        message=" ".join(filter(None, (status.sentence, detail))),
        final=FinalState(now, {name: last[0]}, {name: last[1]}, held=((),)),
        at_events=_recorded(rows, event_times),
        periods=returns["period"].copy(),
        at_periods=_recorded(returns, returns["period"] / system.excitation.frequency),
        creeps=True,
        work=work,
    )


def _recorded(rows: Log, times: FloatArray) -> RecordedStates:
    return RecordedStates(times, rows["angle"].copy()[:, None], rows["velocity"].copy()[:, None])


def _events_of(rows: Log, times: FloatArray, drive_speed: float) -> Events:
    """Events from the rows of a log."""
    kind, side = rows["kind"].astype(np.int8), rows["side"].astype(np.int8)
    sliding = rows["velocity"] + drive_speed
    contact = np.zeros(kind.size, np.int64)
    return Events(times, kind, contact, *sides_of(kind, side, sliding), side)


def sticks_at_rest(log: Log, clock: PeriodClock, end: float) -> Sticks:
    """Runs of rows at rest, with the side of the slip before and after."""
    resting = log["mode"] == REST
    before = np.concatenate(([False], resting[:-1]))
    return _sticks(log, clock, end, resting & ~before, before & ~resting)


def sticks_in_band(log: Log, clock: PeriodClock, end: float) -> Sticks:
    """Passages through the stick band that last; shorter ones are reversals.

    A smooth law never rests, it creeps or passes.
    """
    kind = log["kind"]
    found = _sticks(log, clock, end, kind == EventKind.BAND_ENTERED, kind == EventKind.BAND_LEFT)
    long = found.end - found.start > SHORTEST_STICK * clock.period
    columns = (found.start, found.end, found.contact, found.entry, found.exit)
    some: list[Any] = [one[long] for one in columns]
    return Sticks(*some)


def _sticks(log: Log, clock: PeriodClock, end: float, entered: Mask, left: Mask) -> Sticks:
    """Intervals between rows that begin and end rest; the last may be open."""
    times, side = log_times(log, clock, end), log["side"]
    sliding = np.isin(log["kind"], (EventKind.STICK, EventKind.BAND_ENTERED))
    start, entry = times[entered], np.where(sliding, side, 0.0)[entered]
    stop, exit_ = times[left], side[left]
    if stop.size < start.size:
        stop, exit_ = np.append(stop, end), np.append(exit_, 0.0)
    contact = np.zeros(start.size, np.int64)
    return Sticks(start, stop, contact, entry.astype(np.int8), exit_.astype(np.int8))


def within(times: FloatArray, sticks: Sticks) -> Mask:
    """Return True for each time [s] in an interval of rest, its ends included."""
    begun = np.searchsorted(sticks.start, times, side="right")
    ended = np.searchsorted(sticks.end, times, side="left")
    return np.asarray(begun > ended)
