"""The derivative of the flow with smooth friction (docs/numerics.md, "Derivative of the flow").

A small deviation (x, y) of angle and velocity obeys the variational equation

    J y' + (c + M'(v)) y + k x = 0,  x' = y

along the motion, M' the slope of the brake torque over the sliding velocity v. The torque is
continuous where the law bends, and a step ends there: the deviation does not jump.

In a numeric step the derivative is that of the same series, or of the same Runge-Kutta step
(Hairer, Norsett and Wanner, Solving Ordinary Differential Equations I, section I.14); where
the torque is linear, the closed form. The error control sees the motion only, and where that
creeps in a steep layer, it lets steps grow until deviations in speed would no longer decay:
such a step is repeated in parts.
"""

import numpy as np

from wedgebrake.dynamics.brake_torque import brake_torque
from wedgebrake.dynamics.deviations import Deviations, through_piece
from wedgebrake.dynamics.jit import chosen_by_class, compiled
from wedgebrake.dynamics.problem import angle_weight
from wedgebrake.solvers.smooth.continuous_extension import ROWS, STAGES
from wedgebrake.solvers.smooth.dense_output import SeriesRecord, propagate_step
from wedgebrake.solvers.smooth.runge_kutta import (
    NODES,
    SUMS,
    WEIGHTS,
    RungeKutta,
    acceleration_at,
    pole_distance,
    step,
)

# Arm of the difference that stands for M', as a share of the way to the nearest pole of the
# law: what the fourth order leaves out and the rounding of the torque are then alike, 1e-12.
ARM = 2e-4
# Largest product z of a step and the decay rate (c + M')/J. The method takes exp(-z) right to
# 0.005 up to here, but makes it -0.5 at z = 6 and -12 at z = 8.
_STIFF = 4.0


@compiled
def torque_slope(brake, v, low, high, arm):
    """M'(v) [N m s/rad] by a difference of fourth order that stays between two kinks.

    A stage may lie beyond the kink that its step ends at; it has the slope of the kink.
    """
    v = min(max(v, low), high)
    if v - 2.0 * arm < low or v + 2.0 * arm > high:
        d = arm if v - 2.0 * arm < low else -arm
        near = -25.0 * brake_torque(brake, v) + 48.0 * brake_torque(brake, v + d)
        far = 16.0 * brake_torque(brake, v + 3.0 * d) - 3.0 * brake_torque(brake, v + 4.0 * d)
        return (near - 36.0 * brake_torque(brake, v + 2.0 * d) + far) / (12.0 * d)
    near = brake_torque(brake, v + arm) - brake_torque(brake, v - arm)
    far = brake_torque(brake, v + 2.0 * arm) - brake_torque(brake, v - 2.0 * arm)
    return (8.0 * near - far) / (12.0 * arm)


@compiled
def _torque_slopes(method, stretch, slopes):
    """Store M' at the velocities of the stages of the last step in ``slopes``."""
    rest = method.driveline.rest_velocity
    low, high = stretch.kink_below - rest, stretch.kink_above - rest
    for i in range(STAGES):
        velocity = method.stages[i].velocity
        arm = min(ARM * pole_distance(method.poles, velocity), 0.125 * (high - low))
        slopes[i] = torque_slope(method.brake, velocity - rest, low, high, arm)


@compiled
def _deviation_after(method, h, slopes, sums, x, y):
    """A deviation after a Runge-Kutta step of size h in whose stages M' has the ``slopes``."""
    driveline = method.driveline
    damping, stiffness, inertia = driveline.damping, driveline.stiffness, driveline.inertia
    push = -((damping + slopes[0]) * y + stiffness * x) / inertia
    for k in range(sums.size):
        sums[k] = WEIGHTS[0, k] * push
    for i in range(1, STAGES):
        speed = y + h * sums[i]
        angle = x + h * (NODES[i] * y + h * sums[ROWS + i])
        push = -((damping + slopes[i]) * speed + stiffness * angle) / inertia
        for k in range(sums.size):
            sums[k] += WEIGHTS[i, k] * push
    return x + h * (y + h * sums[ROWS + STAGES]), y + h * sums[STAGES]


@compiled
def _through_runge_kutta(method, problem, row, number, deviations):  # noqa: ARG001 - one signature
    """Deviations after the Runge-Kutta step of a ``row`` of the trail."""
    stretch, driveline = problem.stretches[row.stretch], method.driveline
    slopes, sums = np.empty(STAGES), np.empty(SUMS)
    begin = acceleration_at(method, row.time, row.angle, row.velocity)
    parts = 1
    while True:
        h, time, angle, velocity = row.duration / parts, row.time, row.angle, row.velocity
        a, after = begin, deviations
        for _ in range(parts):
            end = step(method, time, angle, velocity, a, h)
            time, angle, velocity, a = time + h, end.angle, end.velocity, end.acceleration
            _torque_slopes(method, stretch, slopes)
            x1, y1 = _deviation_after(method, h, slopes, sums, after.angle1, after.velocity1)
            x2, y2 = _deviation_after(method, h, slopes, sums, after.angle2, after.velocity2)
            after = Deviations(x1, y1, x2, y2)
        fastest = (driveline.damping + slopes.max()) / driveline.inertia
        needed = 1 + int(row.duration * fastest / _STIFF)
        if parts > 1 or needed == 1:
            return after
        parts = needed


_through_numeric = chosen_by_class({SeriesRecord: propagate_step, RungeKutta: _through_runge_kutta})


@compiled
def propagate(record, problem, trail, left):
    """Derivative of the flow along a trail of ``left`` rows, as ``Deviations`` of unit begin.

    record : what ``dense_output.expand_trail`` made of the trail
    """
    deviations = Deviations(1.0, 0.0, 0.0, 1.0)
    weight = angle_weight(problem.driveline, problem.torque)
    number = 0
    for row in trail[:left]:
        if problem.stretches[row.stretch].linear:
            piece = problem.pieces[row.stretch]
            deviations, _ = through_piece(piece, row.duration, weight, deviations)
        else:
            deviations = _through_numeric(record, problem, row, number, deviations)
            number += 1
    return deviations
