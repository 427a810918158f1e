"""The task of a kernel, from the arguments of ``simulate``."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from wedgebrake.errors import InputError
from wedgebrake.model.signals.signals import check_known
from wedgebrake.model.validation import check_number, check_whole, wrong
from wedgebrake.solvers.machine.final_state import FinalState, misfit
from wedgebrake.solvers.solution import PeriodClock, Task
from wedgebrake.solvers.times import (
    MOST_BY_DEFAULT,
    MOST_SAMPLES,
    needed_samples,
    sampling_note,
    wanted_times,
)

if TYPE_CHECKING:
    from wedgebrake.model.machine import Machine
    from wedgebrake.model.system import BrakedDriveline

_PER_PERIOD = 200  # samples in each period of a driveline's torque, at least
_LEAST_SAMPLES = 2000  # of a machine
_FARTHEST = 1e12  # of an initial angle [rad] or velocity [rad/s]
_LONGEST = 1e12  # [s]
_MAX_PERIODS = 5_000_000  # half a kilobyte of events in each
_MAX_PHASE = 1e15  # periods before the start that leave the phase some digits


class Given(NamedTuple):
    """Arguments of ``simulate`` on the length of a run and its samples."""

    times: ArrayLike | None
    duration: float | None
    periods: int | None
    start_time: float
    samples: int | None
    samples_per_period: int | None


def task_of(system: BrakedDriveline | Machine, given: Given, initial: Any, *, counts: bool) -> Task:
    """The task of a run, without samples.

    counts : whether its kernel counts periods of the torque

    Raises ``InputError`` for arguments that are wrong.
    """
    _check_one_sampling(given)
    period, start_time = system.period, given.start_time
    duration, periods = given.duration, given.periods
    _check_period(period, given)
    if (duration is None) == (periods is None):
        raise InputError(
            f"duration = {duration!r} and periods = {periods!r}: give exactly one of them,"
            " for example duration=25.0 (seconds) or periods=250 (of the torque).",
            name="periods", value=periods, allowed="left out with a duration, or given without",
        )  # fmt: skip
    state = _initial(system, initial, immediate=counts)
    if isinstance(state, FinalState):
        start_time = state.time
    check_number("start_time", start_time, -_LONGEST, _LONGEST)
    if periods is not None:
        check_whole("periods", periods, 1, _MAX_PERIODS)
    recorded = period or 0.0 if system.view.recorded else None
    clock = PeriodClock(2.0 * math.pi / period) if period else PeriodClock(2.0 * math.pi)
    if not counts:
        duration = periods * period if periods is not None and period else duration
        span = start_time, start_time + check_number("duration", duration, 0.0, _LONGEST)
        check_known(system.signals(), *span)
        origin = (0, 0.0)
        return Task(clock, origin, origin, span, state, np.empty(0), recorded=recorded)
    torque: Any = system.machine.torques[0].signal  # whose period does not depend on its amplitude
    clock = PeriodClock(torque.angular_frequency)
    check_number("start_time", start_time, -_LONGEST, min(_LONGEST, _MAX_PHASE * clock.period))
    number, rest = clock.split(start_time)
    start = (int(number), float(rest))
    end = (start[0] + (periods or 0), start[1])
    if duration is not None:
        check_number(
            "duration", duration, 0.0, _MAX_PERIODS * clock.period,
            why=" It is in seconds, at most 5000000 periods of the torque at once; go on from the"
            " final state with initial and start_time.",
        )  # fmt: skip
        number, rest = clock.split(start_time + duration)
        end = (int(number), float(rest))
    span = start_time, float(clock.join(*end))
    return Task(clock, start, end, span, state, np.empty(0), recorded=recorded)


def _check_one_sampling(given: Given) -> None:
    """Refuse output times that are given in two ways."""
    each = {name: getattr(given, name) for name in ("times", "samples", "samples_per_period")}
    names = [name for name, value in each.items() if value is not None]
    if len(names) > 1:
        raise InputError(
            f"{names[0]} and {names[1]}: both given. Give one of times, samples and"
            " samples_per_period.",
            name=names[1], value=each[names[1]], allowed=f"left out with {names[0]}",
        )  # fmt: skip


def _check_period(period: float | None, given: Given) -> None:
    """Refuse lengths and samples in periods that do not exist."""
    each = {"periods": given.periods, "samples_per_period": given.samples_per_period}
    for name, value in each.items():
        if value is not None and not period:
            why = "no signal varies" if period == 0.0 else "the signals have no common period"
            raise wrong(
                name, value, f"left out, as {why}",
                "Give duration, in seconds." if name == "periods" else "Give samples or times.",
            )  # fmt: skip


def _initial(
    system: BrakedDriveline | Machine, initial: Any, *, immediate: bool
) -> FinalState | tuple[float, float] | None:
    """The checked initial state.

    immediate : whether the forces of the contacts act at once, so that they have no state
    """
    names = system.machine.inertia_names
    if isinstance(initial, FinalState):
        if immediate and (tuple(initial.angles) != names or initial.actuators):
            raise misfit(initial)
        return initial
    if initial is None:
        return None
    if len(names) > 1:
        raise wrong("initial", initial, "a final state, as returned by wb.final_state")
    return check_state("initial", initial)


def sampled(
    system: BrakedDriveline | Machine, task: Task, given: Given, last: float | None = None
) -> Task:
    """The task with the times of its samples.

    last : time of the last one by default [s]; None: the end

    Raises ``InputError`` for those that are wrong.
    """
    samples, per_period = given.samples, given.samples_per_period
    begin, end = task.span
    if given.times is not None:
        return replace(task, times=wanted_times(given.times, begin, end))
    end = end if last is None else last
    if samples is not None:
        check_whole("samples", samples, 2, MOST_SAMPLES)
        return replace(task, times=np.linspace(begin, end, samples))
    note, recorded = "", system.view.recorded
    needed = 0 if per_period is not None else needed_samples(system, begin, end)
    if per_period is None and not recorded:
        samples = min(max(needed, _LEAST_SAMPLES), MOST_BY_DEFAULT)
        note = sampling_note(needed, samples)
        return replace(task, times=np.linspace(begin, end, samples), note=note)
    # Without a period, in tenths of the run.
    period = task.clock.period if system.period else 0.1 * (end - begin) or 1.0
    length = (end - begin) / period
    if per_period is None:
        dense = min(needed, MOST_BY_DEFAULT) / length if length > 0.0 else 0.0
        per_period = max(_PER_PERIOD, math.ceil(min(dense, MOST_SAMPLES)))
        note = sampling_note(needed, math.ceil(per_period * length))
    check_whole("samples_per_period", per_period, 1, MOST_SAMPLES)
    count = max(1, math.ceil(length * per_period - 1e-6))
    if count > MOST_SAMPLES:
        raise InputError(
            f"samples_per_period = {per_period}: would give {count} samples, at most"
            f" {MOST_SAMPLES}. Lower it, shorten the run, or give samples or times.",
            name="samples_per_period", value=per_period, allowed=f"at most {MOST_SAMPLES} samples",
        )  # fmt: skip
    return replace(task, times=np.linspace(begin, end, count + 1), note=note)


def check_state(name: str, state: Any) -> tuple[float, float]:
    """A state as two floats; raises ``InputError`` for anything else."""
    if not isinstance(state, tuple | list) or len(state) != 2:
        raise wrong(name, state, "two numbers, angle [rad] and velocity [rad/s]")
    angle = check_number(f"{name}[0]", state[0], -_FARTHEST, _FARTHEST)
    return angle, check_number(f"{name}[1]", state[1], -_FARTHEST, _FARTHEST)
