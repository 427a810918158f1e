"""The solver of machines as a kernel of ``simulate``: any inertias, contacts, signals and laws."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
from numpy.typing import NDArray

from wedgebrake.arrays import FloatArray
from wedgebrake.dynamics.enums import EventKind, Outcome
from wedgebrake.model.elements import event_parts
from wedgebrake.model.machine import Machine
from wedgebrake.model.signals.signals import Orders
from wedgebrake.model.torque_contacts import OneWayClutch
from wedgebrake.solvers.machine.final_state import FinalState
from wedgebrake.solvers.machine.shares import least_shares
from wedgebrake.solvers.machine.solve import MachineAnswer, MachineTask, solve_machine
from wedgebrake.solvers.machine.sticks import sticks_of
from wedgebrake.solvers.solution import Events, RecordedStates, Task, Trajectory
from wedgebrake.solvers.status import Status


def solve(machine: Machine, task: Task) -> Trajectory:
    """Simulate a machine.

    Raises ``InputError`` for a run beyond a recorded signal, and for what the method cannot solve.
    """
    state = task.initial
    if isinstance(state, tuple):
        machine, state = machine.started_at(*state), None
    given = machine_task(task, state)
    numbers, lists = np.empty(0), [task.times]
    if task.recorded is not None:  # at events, whose times a first run finds
        first = solve_machine(machine, dataclasses.replace(given, times=np.empty(0)))
        end, period = first.final.time, task.recorded
        if period:
            numbers = np.arange(np.ceil(given.start / period), np.floor(end / period) + 1)
        lists = [task.times[task.times <= end], numbers * period, first.events["time"]]
    answer, places = _sampled(machine, given, lists)
    n, observer = len(machine.inertias), answer.observer
    states = [
        RecordedStates(observer.times[at], observer.states[at, :n], observer.states[at, n : 2 * n])
        for at in places
    ]
    at, events = places[0], answer.events
    sticking, force = observer.side[at] == 0, observer.force[at]
    recorded: dict[str, Any] = {}
    side = None
    if len(states) > 1:
        entries = events["kind"] == EventKind.STICK
        side = np.where(entries, events["before"], events["after"]).astype(np.int8)
        recorded = {
            "periods": numbers.astype(np.int64), "at_periods": states[1], "at_events": states[2],
        }  # fmt: skip
    return Trajectory(
        times=observer.times[at],
        angle=states[0].angle,
        velocity=states[0].velocity,
        brake_torque=0.0 - least_shares(machine, observer.torque[at], force, sticking),
        force=force,
        sticking=sticking,
        events=Events(
            events["time"].copy(), events["kind"].astype(np.int8),
            np.where(events["contact"] < len(machine.contacts), events["contact"], -1),
            events["before"].astype(np.int8), events["after"].astype(np.int8), side,
            _parts_of(machine, events["contact"]),
        ),
        sticks=sticks_of(answer),
        status=Status.of(answer.outcome),
        message=(_blocked_clutches(machine, answer) or message_of(given, answer))
        + _stopped_orders(machine, answer.final.time),
        final=answer.final,
        control=observer.control[at] if machine.controllers else None,
        integral=_integrals(answer, at) if machine.controllers else None,
        at_rest=answer.at_rest,
        work=answer.cells,
        **recorded,
    )  # fmt: skip


def _integrals(answer: MachineAnswer, at: NDArray[np.intp]) -> FloatArray:
    """Integral parts of the outputs of controllers, (k, c); 0 of those without one."""
    places = answer.assembled.problem.controllers.records["sum"]
    return np.where(places >= 0, answer.observer.states[np.ix_(at, places)], 0.0)


def _parts_of(machine: Machine, numbers: NDArray[np.int64]) -> NDArray[np.str_] | None:
    """The names of the parts of events; None if only contacts have events."""
    names = event_parts(machine)
    return np.array(names, str)[numbers] if len(names) > len(machine.contacts) else None


def machine_task(task: Task, initial: FinalState | None) -> MachineTask:
    """The task as the solver of machines takes it."""
    return MachineTask(
        *task.span, task.times, initial, task.until_rest, task.limits["max_events"], task.method,
        task.stop,
    )  # fmt: skip


def _sampled(
    machine: Machine, task: MachineTask, wanted: list[FloatArray]
) -> tuple[MachineAnswer, list[NDArray[np.intp]]]:
    """The answer with samples at several lists of times, and the places of the samples of each."""
    if len(wanted) == 1:
        answer = solve_machine(machine, task)
        return answer, [np.arange(int(answer.observer.at[0]))]
    times = np.concatenate(wanted)
    order = np.argsort(times, kind="stable")
    places = np.empty_like(order)
    places[order] = np.arange(order.size)
    answer = solve_machine(machine, dataclasses.replace(task, times=times[order]))
    return answer, np.split(places, np.cumsum([one.size for one in wanted])[:-1])


def _blocked_clutches(machine: Machine, answer: MachineAnswer) -> str:
    """Sentences if one-way clutches would have to stop what turns too fast, by an impact."""
    if answer.outcome != Outcome.NO_FORWARD_SOLUTION:
        return ""
    names = [
        one.name
        for one, (side, *_) in zip(machine.contacts, answer.final.modes, strict=True)
        if isinstance(one, OneWayClutch) and side * one.direction > 0.0 and one.brake.locks(side)
    ]
    if not names:
        return ""
    return (
        f"{', '.join(names)}: slides in the direction in which this one-way clutch transmits any"
        f" torque, so that only an impact could stop it. Stopped at t = {answer.final.time:.6g} s."
        " Give speeds at which the clutch is engaged or overruns, or a capacity."
    )


def _stopped_orders(machine: Machine, time: float) -> str:
    """Sentences, each after a space, on orders that keep a value as their speed has come to 0."""
    return "".join(
        f" {name}: the speed of its orders has come to 0, so that it keeps its last value,"
        f" {float(one(time)):.4g}."
        for name, one in machine.signals().items()
        if isinstance(one, Orders) and one.speed.varies
        if float(one.speed(time)) == 0.0 and float(one(time)) != 0.0
    )


def message_of(task: MachineTask, answer: MachineAnswer) -> str:
    """How the run ended, in a sentence or two."""
    status = Status.of(answer.outcome)
    end = f"t = {answer.final.time:.6g} s"
    if answer.at_rest:
        rest = max(sticks_of(answer).start, default=answer.start)
        return (
            f"All contacts are at rest from t = {rest:.6g} s on and stay so, which is proved at"
            f" {end}. Inertias may still swing."
        )
    if answer.outcome == Outcome.COMPLETED and task.until_rest:
        duration = f"{task.end - task.start:g} s"
        if any(side != 0 for side, *_ in answer.final.modes):
            return (
                f"Rest was not reached within the duration of {duration}: a contact still slides."
                " Give a longer duration if its sliding speed decreases."
            )
        return (
            f"All contacts are at rest after the duration of {duration}, but it is not proved that"
            " none will slip again. The proof requires that there are no controllers, that bases"
            " and driven bodies turn at constant speeds and wind up no shaft, that scales of"
            " torques become constant, and that all signals become constant or sums of sines, which"
            " the contacts can hold. Give a longer duration if signals still change or vibration"
            " still decays."
        )
    if answer.outcome == Outcome.COMPLETED:
        return status.sentence
    several = ""
    if answer.outcome == Outcome.NO_FORWARD_SOLUTION and answer.sides.size > 1:
        several = (
            " If no brake can lock itself, the solver found no consistent set of sticks and slips"
            " of the contacts at this instant."
        )
    return f"{status.sentence} Stopped at {end}.{several}"
