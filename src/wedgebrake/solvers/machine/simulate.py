"""``wb.simulate`` for machines."""

from __future__ import annotations

import dataclasses
import math
from typing import TYPE_CHECKING, Any, NamedTuple, cast

import numpy as np
from numpy.typing import ArrayLike

from wedgebrake.errors import InputError
from wedgebrake.model.machine import Machine
from wedgebrake.model.signals.signals import Orders
from wedgebrake.model.studies.study_run import METHODS
from wedgebrake.model.validation import (
    check_choice,
    check_instance,
    check_number,
    check_whole,
    wrong,
)
from wedgebrake.solvers.interrupts import interruptible
from wedgebrake.solvers.machine.final_state import FinalState
from wedgebrake.solvers.times import (
    MOST_BY_DEFAULT,
    MOST_SAMPLES,
    needed_samples,
    sampling_note,
    wanted_times,
)

if TYPE_CHECKING:
    import xarray as xr

    from wedgebrake.solvers.machine.solve import MachineAnswer, MachineTask

_LEAST_SAMPLES = 2000
_LONGEST = 1e12
_MOST_EVENTS = 10**12
_MOST_PERIODS = 5_000_000


class EndAtRest(NamedTuple):
    """End of a run until rest: its time [s], whether rest was reached, and the message on it."""

    time: float
    at_rest: bool
    message: str


def end_at_rest(
    machine: Machine, span: tuple[float, float], method: str, max_events: int
) -> EndAtRest:
    """Find where a run until rest ends; raises ``InputError`` like ``simulate_machine``.

    span : times of the start and of the latest end [s]
    """
    from wedgebrake.solvers.machine.response import message_of
    from wedgebrake.solvers.machine.solve import MachineTask

    machine.check_times(*span)
    task = MachineTask(*span, np.empty(0), None, True, max_events, method)
    answer = solved(machine, task)
    return EndAtRest(answer.final.time, answer.at_rest, message_of(task, answer))


def in_seconds(
    machine: Machine,
    duration: float | None,
    periods: int | None,
    samples: int | None,
    samples_per_period: int | None,
) -> tuple[float | None, int | None]:
    """Duration [s] and number of samples, which may be given in periods of the signals.

    Raises ``InputError`` for a machine without a period, and for a duration that is given twice.
    """
    given = {"periods": periods, "samples_per_period": samples_per_period}
    for name, value in given.items():
        if value is not None and not machine.period:
            none = "no signal of the machine varies"
            why = none if machine.period == 0.0 else "the signals have no common period"
            raise wrong(
                name, value, f"left out, as {why}",
                "Give duration, in seconds." if name == "periods" else "Give samples or times.",
            )  # fmt: skip
    period = machine.period or math.nan
    if periods is not None:
        if duration is not None:
            raise wrong("periods", periods, f"left out with duration = {duration!r}")
        duration = check_whole("periods", periods, 1, _MOST_PERIODS) * period
    if samples_per_period is not None and duration is not None:
        check_number("duration", duration, 0.0, _LONGEST)
        most = max(1, int(MOST_SAMPLES / max(1.0, math.ceil(duration / period))) - 1)
        check_whole("samples_per_period", samples_per_period, 1, most)
        samples = 1 + max(1, math.ceil(duration / period * samples_per_period - 1e-6))
    return duration, samples


def simulate_machine(
    machine: Machine,
    duration: float | None,
    *,
    times: ArrayLike | None,
    samples: int | None,
    initial: tuple[float, float] | FinalState | None,
    start_time: float,
    until: str | None,
    method: str | None,
    max_events: int,
) -> xr.Dataset:
    """The response of a machine; see ``wb.simulate``."""
    state = None
    if initial is not None:
        allowed = "a final state, as returned by wb.final_state"
        check_instance("initial", initial, FinalState, allowed)
        state = cast("FinalState", initial)
        start_time = state.time
    check_number("start_time", start_time, -_LONGEST, _LONGEST)
    if until is not None:
        check_choice("until", until, ["rest"])
    method = machine_method(method, machine)
    if duration is None:
        raise InputError(
            "duration = None: must be a number of seconds for a machine, the maximum with"
            " until='rest'. Give for example duration=5.0."
        )
    end = start_time + check_number("duration", duration, 0.0, _LONGEST)
    check_whole("max_events", max_events, 1, _MOST_EVENTS)
    machine.check_times(start_time, end)
    if samples is not None:
        check_whole("samples", samples, 2, MOST_SAMPLES)
    wanted = np.empty(0) if times is None else wanted_times(times, start_time, end)

    from wedgebrake.solvers.machine.solve import MachineTask

    task = MachineTask(start_time, end, wanted, state, until == "rest", max_events, method)
    note = ""
    if times is None:
        stop = end if until is None else solved(machine, task).final.time
        needed = 0 if samples is not None else needed_samples(machine, start_time, stop)
        count = samples or min(max(needed, _LEAST_SAMPLES), MOST_BY_DEFAULT)
        task = dataclasses.replace(task, times=np.linspace(start_time, stop, count))
        note = sampling_note(needed, count)
    answer = solved(machine, task)

    from wedgebrake.solvers.machine.response import dataset

    found = dataset(machine, task, answer)
    found.attrs["message"] += note + _stopped_orders(machine, answer.final.time)
    return found


def _stopped_orders(machine: Machine, time: float) -> str:
    """Sentences, each after a space, on orders that keep a value as their speed has come to 0."""
    return "".join(
        f" {name}: the speed of its orders has come to 0, so that it keeps its last value,"
        f" {float(one(time)):.4g}."
        for name, one in machine.signals().items()
        if isinstance(one, Orders) and one.speed.varies
        if float(one.speed(time)) == 0.0 and float(one(time)) != 0.0
    )


def machine_method(method: str | None, machine: Machine) -> str:
    """Return the checked method; by default "exact" if it can solve all contacts, or "smooth"."""
    if method is not None:
        return check_choice("method", method, METHODS)
    return "exact" if all(one.piecewise_linear for one in machine.contacts) else "smooth"


def solved(machine: Machine, task: MachineTask, **options: Any) -> MachineAnswer:
    """The answer of the solver; Ctrl-C stops it."""
    from wedgebrake.solvers.machine.solve import solve_machine

    return interruptible(
        lambda: solve_machine(machine, task, **options), stop=lambda: task.stop.fill(True)
    )


def task_of(response: xr.Dataset) -> MachineTask:
    """The task that led to a response, without samples."""
    from wedgebrake.solvers.machine.solve import MachineTask

    text = response.attrs.get("initial_state")
    initial = None if text is None else FinalState.from_json(text)
    start, end = response.attrs["start_time"], response.attrs["final_time"]
    method = response.attrs["method"]
    return MachineTask(start, end, np.empty(0), initial, False, _MOST_EVENTS, method)
