"""From the numbers of a brake and a driveline to the arguments of ``exact.run``."""

import math

from wedgebrake.dynamics import piecewise_linear
from wedgebrake.dynamics.jit import compiled
from wedgebrake.dynamics.linear_flow import prepare

_half = compiled(piecewise_linear.half)
_holding = compiled(piecewise_linear.holding)


@compiled
def velocity_scale(
    inertia, stiffness, amplitude, omega, drive_speed, breakpoints, offsets, angle, velocity
):
    """A velocity [rad/s] that the motion has where nothing grows: for tolerances.

    breakpoints : (n-1,) over the sliding velocity [rad/s];  offsets : (n,) [N m]
    angle, velocity : a state that the motion passes
    """
    natural = math.sqrt(stiffness / inertia)
    push, farthest = 0.0, 0.0
    for offset in offsets:
        if not math.isinf(offset):
            push = max(push, abs(offset))
    for breakpoint_ in breakpoints:
        farthest = max(farthest, abs(breakpoint_))
    scale = abs(velocity) + natural * abs(angle) + abs(drive_speed)
    scale += (amplitude + push) / (inertia * max(natural, omega))
    scale += farthest
    return scale if scale > 0.0 else 1.0


@compiled
def assemble(law, line, brake, friction, speeds, action, torque, angle, velocity, diverged, room):
    """The first thirteen arguments of ``exact.run``.

    law      : g(m, shape) of the brake, compiled
    line     : (inertia, damping, stiffness, drive speed)
    brake    : (radius, the four numbers of its shape)
    friction : (static coefficient, kinetic coefficients at ``speeds``)
    speeds   : (n,) [m/s]
    action   : (force at rest, slope, release speed)
    torque   : (amplitude, omega)
    angle, velocity, diverged : a state, and how many times its scale is divergence
    room     : (breakpoints (2n+1,), slopes (2n+2,), offsets (2n+2,), table (2n+2, COLUMNS),
               bounds (2n+1,), halves (n+1, 3), speeds (n,)), to be filled
    """
    inertia, damping, stiffness, drive_speed = line[0], line[1], line[2], line[3]
    amplitude, omega = torque[0], torque[1]
    breakpoints, slopes, offsets, table, bounds, rows, turning = room
    radius = brake[0]
    shape = (brake[1], brake[2], brake[3], brake[4])
    force, slope, release = action[0], action[1], action[2]
    for i in range(speeds.size):
        turning[i] = speeds[i] / radius
    coefficients = friction[1:]
    count = _half(law, shape, radius, turning, coefficients, force, slope, release, -1.0, rows)
    for i in range(count):
        # From the fastest backwards to rest; the start speed of a piece ends its mirror image.
        row = rows[count - 1 - i]
        offsets[i], slopes[i] = row[1], -row[2]
        if i < count - 1:
            breakpoints[i] = -row[0]
    zero = count
    count = _half(law, shape, radius, turning, coefficients, force, slope, release, 1.0, rows)
    for i in range(count):
        offsets[zero + i], slopes[zero + i] = rows[i, 1], rows[i, 2]
        breakpoints[zero - 1 + i] = rows[i, 0]
    count += zero
    w_diverged = diverged * velocity_scale(
        inertia, stiffness, amplitude, omega, drive_speed, breakpoints[: count - 1],
        offsets[:count], angle, velocity,
    )  # fmt: skip
    for i in range(count - 1):
        bounds[i] = breakpoints[i] - drive_speed
    for i in range(count):
        if slopes[i] != 0.0:
            offsets[i] += slopes[i] * drive_speed
    prepare(
        inertia, damping, stiffness, amplitude, omega, slopes[:count], offsets[:count],
        table[:count],
    )  # fmt: skip
    lower = _holding(law, shape, radius, friction[0], force, slope, -1.0)
    upper = _holding(law, shape, radius, friction[0], force, slope, 1.0)
    return (
        inertia, damping, stiffness, amplitude, omega, bounds[: count - 1], offsets[:count],
        table[:count], zero, lower, upper, 0.0 - drive_speed, w_diverged,
    )  # fmt: skip
