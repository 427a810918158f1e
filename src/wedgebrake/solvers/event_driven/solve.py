"""Exact solution with set-valued friction: closed forms from event to event."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from wedgebrake.dynamics import enums, linear_flow
from wedgebrake.dynamics.assemble import velocity_scale
from wedgebrake.model.characteristic import Characteristic
from wedgebrake.model.system import BrakedDriveline
from wedgebrake.solvers.event_driven import trajectory as kernel
from wedgebrake.solvers.solution import Clock, Events, FloatArray, Sticks, Task, Trajectory
from wedgebrake.solvers.status import DIVERGED_FACTOR, Status


class Problem(NamedTuple):
    """A system as the kernel takes it, in the order of its arguments."""

    inertia: float
    damping: float
    stiffness: float
    amplitude: float
    omega: float
    bounds: FloatArray
    offsets: FloatArray
    table: FloatArray
    zero: int
    lower: float
    upper: float
    w_rest: float
    w_diverged: float


def problem(
    system: BrakedDriveline,
    angle: float = 0.0,
    velocity: float = 0.0,
    characteristic: Characteristic | None = None,
) -> Problem:
    """The kernel's arguments for a system and an initial state (for the scale of divergence)."""
    line, torque = system.driveline, system.excitation
    law = system.characteristic if characteristic is None else characteristic
    over_w = law.over_driveline_velocity(line.drive_speed)
    omega = torque.angular_frequency
    plant = (line.inertia, line.damping, line.stiffness, torque.amplitude, omega)
    table = linear_flow.constants(*plant, over_w["slopes"], over_w["offsets"])
    scale = velocity_scale(
        line.inertia, line.stiffness, torque.amplitude, omega, line.drive_speed,
        np.array(law.breakpoints), np.array(law.offsets), angle, velocity,
    )  # fmt: skip
    return Problem(
        *plant,
        over_w["bounds"],
        over_w["offsets"],
        table,
        over_w["zero"],
        law.holding[0],
        law.holding[1],
        0.0 - line.drive_speed,  # not -0.0
        DIVERGED_FACTOR * scale,
    )


def solve(
    system: BrakedDriveline,
    task: Task,
    *,
    max_events: int,
    characteristic: Characteristic | None = None,
) -> Trajectory:
    """Simulate a system with set-valued friction exactly (docs/theory.md, section 5)."""
    given = problem(system, task.angle, task.velocity, characteristic)
    law = system.characteristic if characteristic is None else characteristic
    log, outcome, final, work = _run(given, task, max_events)
    end = task.clock.join(*final[:2])
    reached = task.times[task.times <= end + 4e-16 * abs(end)]
    number, rest = task.clock.split(reached)
    angle, velocity = np.empty(reached.size), np.empty(reached.size)
    piece = np.empty(reached.size, dtype=np.int64)
    kernel.evaluate(
        given.inertia, given.stiffness, given.amplitude, given.omega, given.table, given.w_rest,
        log, number, rest, angle, velocity, piece,
    )  # fmt: skip
    torque = _brake_torque(given, law, reached, angle, velocity, piece)
    sticks = _sticks(log, task.clock, float(end))
    marks = (log[:, kernel.LOG_KIND] == enums.PERIOD) | (
        (log[:, kernel.LOG_TIME] == 0.0) & (log[:, kernel.LOG_KIND] == enums.START)
    )
    return Trajectory(
        times=reached,
        angle=angle,
        velocity=velocity,
        brake_torque=torque,
        sticking=piece == kernel.REST,
        period=log[marks, kernel.LOG_PERIOD].astype(np.int64),
        period_angle=log[marks, kernel.LOG_THETA],
        period_velocity=log[marks, kernel.LOG_W],
        events=_events(log, task.clock, float(end)),
        sticks=sticks,
        status=Status.of(outcome),
        final=(float(end), final[2], final[3]),
        detail=_detail(outcome, float(end), given, log, sticks),
        work=work,
    )


def _run(
    given: Problem, task: Task, max_events: int
) -> tuple[FloatArray, int, tuple[int, float, float, float], int]:
    """Run the kernel, with more room for the log whenever it fills up."""
    state: tuple[int, float, float, float] = (*task.start, task.angle, task.velocity)
    rows = 64 + 8 * max(1, task.end[0] - task.start[0] + 1)
    no_points = np.empty((0, 2))
    while True:
        log = kernel.empty_log(rows)
        outcome, *end, _, used, work = kernel.run(
            *given, *state, *task.end, max_events, log, no_points, task.stop
        )
        if outcome != enums.LOG_FULL:
            return log[:used].copy(), outcome, (end[0], end[1], end[2], end[3]), work
        rows *= 4


def _brake_torque(
    given: Problem,
    law: Characteristic,
    times: FloatArray,
    angle: FloatArray,
    velocity: FloatArray,
    piece: NDArray[np.int64],
) -> FloatArray:
    """R F_mu: the characteristic in motion; at rest what equilibrium demands."""
    drive = given.amplitude * np.sin(given.omega * times)
    held = drive - given.damping * velocity - given.stiffness * angle
    safe = np.maximum(piece, 0)
    sliding = velocity - given.w_rest
    slope = law.slopes[safe]
    moving = law.offsets[safe] + np.where(slope == 0.0, 0.0, slope * sliding)
    return np.where(piece == kernel.REST, held, moving)


def _times(log: FloatArray, clock: Clock, end: float) -> FloatArray:
    """Times of the log's rows [s]; ascending up to the end, also where a period's is rounded."""
    times = clock.join(log[:, kernel.LOG_PERIOD].astype(np.int64), log[:, kernel.LOG_TIME])
    return np.asarray(np.minimum(np.maximum.accumulate(times), end))


def _events(log: FloatArray, clock: Clock, end: float) -> Events:
    real = (log[:, kernel.LOG_KIND] >= enums.STICK) & (log[:, kernel.LOG_KIND] != enums.END)
    rows = log[real]
    return Events(
        time=_times(log, clock, end)[real],
        kind=rows[:, kernel.LOG_KIND].astype(np.int8),
        angle=rows[:, kernel.LOG_THETA].copy(),
        velocity=rows[:, kernel.LOG_W].copy(),
        side=rows[:, kernel.LOG_SIDE].astype(np.int8),
    )


def _sticks(log: FloatArray, clock: Clock, end: float) -> Sticks:
    """Runs of rows at rest, with the side of the slip before and after."""
    resting = log[:, kernel.LOG_PIECE] == kernel.REST
    times = _times(log, clock, end)
    before = np.concatenate(([False], resting[:-1]))
    first = np.flatnonzero(resting & ~before)
    last = np.flatnonzero(before & ~resting)
    released = log[last, kernel.LOG_SIDE]
    if last.size < first.size:
        times, last = np.append(times, end), np.append(last, log.shape[0])
        released = np.append(released, 0.0)
    entry = np.where(log[first, kernel.LOG_KIND] == enums.STICK, log[first, kernel.LOG_SIDE], 0.0)
    return Sticks(times[first], times[last], entry.astype(np.int8), released.astype(np.int8))


def _detail(outcome: int, end: float, given: Problem, log: FloatArray, sticks: Sticks) -> str:
    if outcome == enums.DIVERGED:
        rate = -0.5 * given.table[int(log[-1, kernel.LOG_PIECE]), linear_flow.G2]
        natural = math.sqrt(given.stiffness / given.inertia)
        if rate > natural:
            rate += math.sqrt(rate - natural) * math.sqrt(rate + natural)
        return f"Diverged at t = {end:.6g} s, growing as exp({rate:.4g} t)."
    if outcome == enums.NO_SLIDING:
        if log[-1, kernel.LOG_PIECE] == kernel.REST:
            begin = sticks.start[-1]
            return (
                f"It sticks from t = {begin:.6g} s on, while the turning shaft winds up the spring"
                " without limit."
            )
        return f"No sliding solution from t = {end:.6g} s on."
    if outcome == enums.EVENT_LIMIT:
        return f"Stopped at t = {end:.6g} s."
    return ""
