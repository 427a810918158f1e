"""Exact solution with set-valued friction: closed forms from event to event."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from wedgebrake.arrays import FloatArray
from wedgebrake.dynamics.assemble import Workspace, problem_of, velocity_scale
from wedgebrake.dynamics.enums import Outcome
from wedgebrake.dynamics.harmonic import Sine
from wedgebrake.dynamics.linear_flow import PIECE, LinearDriveline
from wedgebrake.dynamics.piecewise_linear import LINE
from wedgebrake.dynamics.problem import ANGLE, VELOCITY, Instant, Problem, State
from wedgebrake.dynamics.segment_log import REST
from wedgebrake.model.characteristic import Characteristic
from wedgebrake.model.system import BrakedDriveline
from wedgebrake.solvers.event_driven import trajectory as kernel
from wedgebrake.solvers.log_reader import Log, logged, one_inertia, sticks_at_rest
from wedgebrake.solvers.solution import Sticks, Task, Trajectory
from wedgebrake.solvers.status import DIVERGED_FACTOR, Status


def driveline_numbers(system: BrakedDriveline) -> LinearDriveline:
    """The driveline as the kernels take it."""
    line = system.driveline
    # 0.0 - 0.0 is not -0.0.
    return LinearDriveline(line.inertia, line.damping, line.stiffness, 0.0 - line.constant_speed)


def torque_numbers(system: BrakedDriveline) -> Sine:
    """The torque on the driveline as the kernels take it."""
    return Sine(system.excitation.amplitude, system.excitation.angular_frequency)


def problem(system: BrakedDriveline, angle: float = 0.0, velocity: float = 0.0) -> Problem:
    """The kernel's problem for a system and an initial state (for the scale of divergence)."""
    driveline, torque = driveline_numbers(system), torque_numbers(system)
    return problem_for(driveline, system.characteristic, torque, angle, velocity)


def problem_for(
    driveline: LinearDriveline, law: Characteristic, torque: Sine, angle: float, velocity: float
) -> Problem:
    """The kernel's problem, from the numbers of a driveline, its brake torque and excitation."""
    breakpoints, slopes, offsets = map(np.array, (law.breakpoints, law.slopes, law.offsets))
    scale = velocity_scale(driveline, torque, breakpoints, offsets, angle, velocity)
    count = offsets.size
    work = Workspace(
        breakpoints, slopes, offsets, np.empty(count, PIECE), np.empty(0, LINE), np.empty(0)
    )
    limits = (law.holding[0], law.holding[1])
    given: Problem = problem_of(
        driveline, torque, work, count, law.first_forward, limits, DIVERGED_FACTOR * scale
    )
    return given


def solve(system: BrakedDriveline, task: Task) -> Trajectory:
    """Simulate a system with set-valued friction exactly.

    The method: docs/numerics.md, "Exact solution of one inertia".
    """
    given = problem(system, *task.state)
    start, goal = State(*task.start, *task.state), Instant(*task.end)
    log, found = logged(
        64 + 8 * max(1, task.end[0] - task.start[0] + 1),
        lambda log: kernel.run(
            given, start, goal, task.limits["max_events"], log, np.empty((0, 2)), task.stop
        ),
    )
    state = found.state
    end = float(task.clock.join(state.period, state.time))
    reached = task.times[task.times <= end + 4e-16 * abs(end)]
    states, mode = np.empty((reached.size, 2)), np.empty(reached.size, dtype=np.int64)
    kernel.evaluate(given, log, *task.clock.split(reached), states, mode)
    angle, velocity = states[:, ANGLE].copy(), states[:, VELOCITY].copy()
    torque = _brake_torque(system, reached, states, mode)
    sticks = sticks_at_rest(log, task.clock, end)
    detail = _detail(found.outcome, end, given, log, sticks)
    answer = one_inertia(
        system, (reached, angle, velocity, torque), sticks, log, (end, state.angle, state.velocity),
        (Status.of(found.outcome), detail, found.evaluations), task.clock,
    )  # fmt: skip
    return replace(answer, sticking=(mode == REST)[:, None], creeps=False)


def _brake_torque(
    system: BrakedDriveline, times: FloatArray, states: FloatArray, mode: NDArray[np.int64]
) -> FloatArray:
    """R F_mu: the characteristic in motion; at rest what equilibrium demands."""
    line, law = system.driveline, system.characteristic
    angle, velocity = states[:, ANGLE], states[:, VELOCITY]
    piece = np.maximum(mode, 0)
    slope = law.slopes[piece]
    torque = law.offsets[piece] + np.where(
        slope == 0.0, 0.0, slope * (velocity + line.constant_speed)
    )
    rest = mode == REST
    held = system.excitation.torque(times[rest]) - line.damping * velocity[rest]
    torque[rest] = held - line.stiffness * angle[rest]
    return np.asarray(torque)


def _detail(outcome: int, end: float, given: Problem, log: Log, sticks: Sticks) -> str:
    mode = int(log["mode"][-1])
    if outcome == Outcome.DIVERGED:
        rate = -0.5 * given.brake.pieces["damping"][mode]
        natural = math.sqrt(given.driveline.stiffness / given.driveline.inertia)
        if rate > natural:
            rate += math.sqrt(rate - natural) * math.sqrt(rate + natural)
        return f"Diverged at t = {end:.6g} s, growing as exp({rate:.4g} t)."
    if outcome == Outcome.NO_FORWARD_SOLUTION and mode == REST:
        return (
            f"It sticks from t = {sticks.start[-1]:.6g} s on, while the turning shaft winds up the"
            " spring without limit."
        )
    if outcome == Outcome.NO_FORWARD_SOLUTION:
        return f"No sliding solution from t = {end:.6g} s on."
    return f"Stopped at t = {end:.6g} s." if outcome == Outcome.EVENT_LIMIT else ""
