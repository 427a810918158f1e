"""From the numbers of a machine to the ``Problem`` of the exact solver."""

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from wedgebrake.dynamics import actuator, piecewise_linear
from wedgebrake.dynamics.actuator import Actuator
from wedgebrake.dynamics.harmonic import Sine
from wedgebrake.dynamics.jit import compiled
from wedgebrake.dynamics.linear_flow import PIECE, LinearDriveline, prepare
from wedgebrake.dynamics.piecewise_linear import LINE
from wedgebrake.dynamics.problem import PiecewiseLinearBrake, Problem

half = compiled(piecewise_linear.half)
holding = compiled(piecewise_linear.holding)
release_speed = compiled(actuator.release_speed)

_FLOAT = NDArray[np.float64]


class DrivelineNumbers(NamedTuple):
    """The numbers of one machine with set-valued friction.

    shape     : the parameters of the brake's law g(m, shape)
    breakaway : static coefficient of friction
    speeds, kinetic : (n,) sliding speeds [m/s] of the table of friction, and its coefficients;
                points at infinite speeds do not count
    """

    driveline: LinearDriveline
    torque: Sine
    radius: float
    shape: tuple[float, float, float, float]
    breakaway: float
    speeds: _FLOAT
    kinetic: _FLOAT
    actuator: Actuator


class Workspace(NamedTuple):
    """Arrays of a ``Problem``, filled anew for each machine."""

    breakpoints: _FLOAT
    slopes: _FLOAT
    offsets: _FLOAT
    pieces: Any
    lines: Any
    speeds: _FLOAT


@compiled
def workspace(nodes):
    """Arrays for machines with a table of friction of up to ``nodes`` points."""
    most = 2 * nodes + 2
    return Workspace(
        np.empty(most - 1), np.empty(most), np.empty(most), np.empty(most, PIECE),
        np.empty(nodes + 1, LINE), np.empty(nodes),
    )  # fmt: skip


@compiled
def velocity_scale(driveline, torque, breakpoints, offsets, angle, velocity):
    """Velocity scale [rad/s] of a motion without growth, for tolerances.

    breakpoints : (n-1,) over the sliding velocity [rad/s];  offsets : (n,) [N m]
    angle, velocity : a state of the motion
    """
    natural = math.sqrt(driveline.stiffness / driveline.inertia)
    push, farthest = 0.0, 0.0
    for offset in offsets:
        if not math.isinf(offset):
            push = max(push, abs(offset))
    for breakpoint_ in breakpoints:
        farthest = max(farthest, abs(breakpoint_))
    scale = abs(velocity) + natural * abs(angle) + abs(driveline.rest_velocity) + farthest
    fastest = max(natural, torque.angular_frequency)
    scale += (torque.amplitude + push) / (driveline.inertia * fastest)
    return scale if scale > 0.0 else 1.0


@compiled
def problem_of(driveline, torque, work, count, first_forward, limits, divergence_velocity):
    """``Problem`` from ``count`` lines of torque over the sliding velocity, in ``work``.

    limits : (lower, upper) torque that the brake holds at rest [N m]
    """
    breakpoints, offsets = work.breakpoints[: count - 1], work.offsets[:count]
    slopes, pieces = work.slopes[:count], work.pieces[:count]
    for i in range(count - 1):
        breakpoints[i] += driveline.rest_velocity
    for i in range(count):
        if slopes[i] != 0.0:
            offsets[i] -= slopes[i] * driveline.rest_velocity
    prepare(driveline, torque, slopes, offsets, pieces)
    brake = PiecewiseLinearBrake(breakpoints, pieces, first_forward, limits[0], limits[1])
    return Problem(driveline, torque, brake, divergence_velocity)


@compiled
def assemble(law, machine, angle, velocity, divergence_factor, work):
    """``Problem`` of a machine.

    law      : g(m, shape) of the brake, compiled
    angle, velocity : a state of the motion
    divergence_factor : multiple of the motion's velocity scale that counts as divergence
    work     : a ``Workspace``, which the problem refers to
    """
    shape, radius, given = machine.shape, machine.radius, machine.actuator
    release = release_speed(given)
    nodes = 0
    while nodes < machine.speeds.size and machine.speeds[nodes] < math.inf:
        work.speeds[nodes] = machine.speeds[nodes] / radius
        nodes += 1
    speeds, kinetic = work.speeds[:nodes], machine.kinetic[:nodes]
    backward = half(law, shape, radius, speeds, kinetic, given, release, -1.0, work.lines)
    for i in range(backward):
        # From the fastest backward line to rest; a line starts where its mirror image ends.
        line = work.lines[backward - 1 - i]
        work.offsets[i], work.slopes[i] = line.offset, -line.slope
        if i < backward - 1:
            work.breakpoints[i] = -line.start
    forward = half(law, shape, radius, speeds, kinetic, given, release, 1.0, work.lines)
    for i in range(forward):
        line = work.lines[i]
        work.offsets[backward + i], work.slopes[backward + i] = line.offset, line.slope
        work.breakpoints[backward - 1 + i] = line.start
    count = backward + forward
    scale = velocity_scale(
        machine.driveline, machine.torque, work.breakpoints[: count - 1], work.offsets[:count],
        angle, velocity,
    )  # fmt: skip
    least = holding(law, shape, radius, machine.breakaway, given, -1.0)
    largest = holding(law, shape, radius, machine.breakaway, given, 1.0)
    return problem_of(
        machine.driveline, machine.torque, work, count, backward, (least, largest),
        divergence_factor * scale,
    )  # fmt: skip
