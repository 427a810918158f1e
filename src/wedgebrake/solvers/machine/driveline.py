"""A braked driveline with signals, an actuator with a lag or sampling, or friction that is a curve.

The driveline is solved as a machine with one inertia; the result has the form of other solvers.
"""

from __future__ import annotations

import dataclasses

import numpy as np

from wedgebrake.arrays import FloatArray
from wedgebrake.dynamics.enums import EventKind
from wedgebrake.model.machine import Machine
from wedgebrake.model.signals.signals import check_known
from wedgebrake.model.system import BrakedDriveline
from wedgebrake.solvers.machine.solve import MachineAnswer, MachineTask, solve_machine
from wedgebrake.solvers.machine.sticks import stick_rows
from wedgebrake.solvers.solution import Events, Returns, Sticks, Task, Trajectory
from wedgebrake.solvers.status import Status


def solve(
    system: BrakedDriveline, task: Task, *, max_events: int, method: str = "exact"
) -> Trajectory:
    """Simulate a braked driveline through its machine.

    Raises ``InputError`` for a run beyond a recorded signal, and for what the method cannot solve.
    """
    machine = system.machine_at(task.angle, task.velocity)
    start, end = task.span
    check_known(system.signals(), start, end)
    first = MachineTask(start, end, np.empty(0), None, False, max_events, method, task.stop)
    found = solve_machine(machine, first)
    end = found.final.time
    period = system.excitation.period or 0.0
    numbers = np.empty(0)
    if period:
        numbers = np.arange(np.ceil(start / period), np.floor(end / period) + 1)
    wanted = [task.times[task.times <= end], numbers * period, found.events["time"]]
    answer, parts = _sampled(machine, first, wanted)
    at, sections, events = parts
    angle, velocity = answer.observer.states[:, 0], answer.observer.states[:, 1]
    sticks = stick_rows(answer)
    return Trajectory(
        times=wanted[0],
        angle=angle[at],
        velocity=velocity[at],
        brake_torque=0.0 - answer.observer.torque[at, 0],
        sticking=answer.observer.side[at, 0] == 0,
        returns=Returns(numbers.astype(np.int64), angle[sections], velocity[sections]),
        events=_events(answer, angle[events], velocity[events]),
        sticks=Sticks(*(sticks[name].copy() for name in ("start", "end", "entry", "exit"))),
        status=Status.of(answer.outcome),
        final=(end, answer.final.angles["driveline"], answer.final.speeds["driveline"]),
        work=answer.cells,
    )


def _sampled(
    machine: Machine, task: MachineTask, wanted: list[FloatArray]
) -> tuple[MachineAnswer, list[FloatArray]]:
    """The answer with samples at several lists of times, and the places of the samples of each."""
    times = np.concatenate(wanted)
    order = np.argsort(times, kind="stable")
    places = np.empty_like(order)
    places[order] = np.arange(order.size)
    answer = solve_machine(machine, dataclasses.replace(task, times=times[order]))
    return answer, np.split(places, np.cumsum([one.size for one in wanted])[:-1])


def _events(answer: MachineAnswer, angle: FloatArray, velocity: FloatArray) -> Events:
    """The events as those of the other solvers."""
    events = answer.events
    side = np.where(events["kind"] == EventKind.STICK, events["before"], events["after"])
    return Events(
        time=events["time"].copy(), kind=events["kind"].astype(np.int8), angle=angle,
        velocity=velocity, side=side.astype(np.int8),
    )  # fmt: skip
