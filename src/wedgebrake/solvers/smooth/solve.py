"""Adaptive solution with a smooth friction law, split at its kinks."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from wedgebrake.arrays import FloatArray
from wedgebrake.dynamics.enums import Outcome
from wedgebrake.dynamics.problem import Instant, State
from wedgebrake.model.system import BrakedDriveline
from wedgebrake.solvers.log_reader import logged, one_inertia, sticks_in_band
from wedgebrake.solvers.smooth import assemble, trajectory
from wedgebrake.solvers.smooth.problem import Samples, torques
from wedgebrake.solvers.solution import Task, Trajectory
from wedgebrake.solvers.status import Status

# Number of speeds at which the brake is checked for self-locking.
_SPEEDS = 200


def solve(system: BrakedDriveline, task: Task) -> Trajectory:
    """Simulate a system with a smooth friction law."""
    caught = winds_up(system, task.state[1])
    if caught:
        seen_at_start = task.times[task.times <= task.clock.join(*task.start)]
        task = replace(task, end=task.start, times=seen_at_start)
    given = assemble.problem(system, task.limits["rtol"], *task.state)
    samples = Samples(*task.clock.split(task.times), np.empty((task.times.size, 2)))
    start, goal = State(*task.start, *task.state), Instant(*task.end)
    no_trail = np.empty(0, dtype=trajectory.STEP)
    log, ended = logged(
        64 + 24 * max(1, task.end[0] - task.start[0] + 1),
        lambda log: trajectory.run(
            *given, start, goal, task.limits["max_steps"], samples, log, no_trail, task.stop
        ),
    )
    state = ended.state
    end = float(task.clock.join(state.period, state.time))
    times = task.times[: ended.samples]
    angle, velocity = samples.state[: ended.samples].T.copy()
    outcome = Outcome.NO_FORWARD_SOLUTION if caught else ended.outcome
    detail = "" if outcome == Outcome.COMPLETED else f"Stopped at t = {end:.6g} s."
    if caught:
        detail = (
            f"From t = {end:.6g} s on it cannot pass the speed at which the brake locks, while the"
            " turning shaft winds up the spring without limit."
        )
    torque = torque_at(system, velocity + system.driveline.constant_speed)
    return one_inertia(
        system, (times, angle, velocity, torque), sticks_in_band(log, task.clock, end), log,
        (end, state.angle, state.velocity), (Status.of(outcome), detail, ended.steps), task.clock,
    )  # fmt: skip


def winds_up(system: BrakedDriveline, velocity: float) -> bool:
    """Return True if the brake locks at a speed between that of the start and that of the shaft.

    Sliding cannot pass a speed at which the friction force is infinite, so that the turning shaft
    winds up the spring without limit.
    """
    line, brake, friction = system.driveline, system.brake, assemble.smooth_friction(system)
    drive = line.constant_speed
    if line.stiffness == 0.0:
        return False
    sliding = math.copysign(1.0, drive) * (velocity + drive)
    if sliding >= abs(drive):
        return False
    # More closely spaced in the steep part of the law, where friction rises.
    steep = friction.transition / brake.radius
    near, even = np.geomspace(1e-3, 1e2, _SPEEDS) * steep, np.linspace(0.0, abs(drive), _SPEEDS)
    speeds = np.concatenate((near, even))
    passed = speeds[(speeds > max(sliding, 0.0)) & (speeds < abs(drive))]
    return any(
        brake.locks(friction.coefficient(math.copysign(brake.radius * float(speed), drive)))
        for speed in passed
    )


def torque_at(system: BrakedDriveline, speed: FloatArray) -> FloatArray:
    """R F_mu [N m] at sliding velocities (n,) [rad/s]."""
    torque = np.empty(speed.size)
    torques(*assemble.laws(system), np.ascontiguousarray(speed), torque)
    return torque
