"""The derivative of the flow with a smooth friction law (docs/theory.md, section 9).

A small deviation (x, y) = (d theta, d w) obeys the variational equation

    J y' + (c + M'(v)) y + k x = 0,  x' = y

along the motion, M' the slope of the brake torque over the sliding velocity v. The torque is
continuous where the law bends, and a step ends there: the deviation does not jump.

In a numeric step the derivative is that of the same series, or of the same Runge-Kutta step
(Hairer, Norsett and Wanner, Solving Ordinary Differential Equations I, section I.14); where
the torque is linear, the closed form. The error control sees the motion only, and where that
creeps in a steep layer, it lets steps grow until deviations in speed would no longer die: such
a step is gone again in parts.
"""

import numpy as np

from wedgebrake.dynamics.brake_torque import brake_torque, smooth_brake
from wedgebrake.dynamics.jit import compiled
from wedgebrake.dynamics.linear_flow import impulse
from wedgebrake.solvers.smooth.dense_output import carry as through_series
from wedgebrake.solvers.smooth.runge_kutta import ROWS, STAGES, SUMS, acceleration, drive_at, room
from wedgebrake.solvers.smooth.runge_kutta import step as advance
from wedgebrake.solvers.smooth.trajectory import (
    TRAIL_SIZE,
    TRAIL_SPEEDS,
    TRAIL_STRETCH,
    TRAIL_THETA,
    TRAIL_TIME,
    TRAIL_W,
)

# Arm of the difference that stands for M', as a share of the way to the nearest pole of the
# law: what the fourth order leaves out and the rounding of the torque are then alike, 1e-12.
_ARM = 2e-4
# Largest product z of a step and the decay rate (c + M')/J. The method takes exp(-z) right to
# 0.005 up to here, but makes it -0.5 at z = 6 and -12 at z = 8.
_STIFF = 4.0


@compiled
def _torque(laws, numbers, v):
    return brake_torque(smooth_brake(laws, numbers), v)


@compiled
def _slope(laws, numbers, v, low, high, arm):
    """M'(v) [N m s/rad] by a difference of fourth order that stays between two kinks.

    A stage may lie beyond the kink that its step ends at; it has the slope of the kink.
    """
    v = min(max(v, low), high)
    if v - 2.0 * arm < low or v + 2.0 * arm > high:
        d = arm if v - 2.0 * arm < low else -arm
        near = -25.0 * _torque(laws, numbers, v) + 48.0 * _torque(laws, numbers, v + d)
        far = 16.0 * _torque(laws, numbers, v + 3.0 * d) - 3.0 * _torque(laws, numbers, v + 4.0 * d)
        return (near - 36.0 * _torque(laws, numbers, v + 2.0 * d) + far) / (12.0 * d)
    near = _torque(laws, numbers, v + arm) - _torque(laws, numbers, v - arm)
    far = _torque(laws, numbers, v + 2.0 * arm) - _torque(laws, numbers, v - 2.0 * arm)
    return (8.0 * near - far) / (12.0 * arm)


@compiled
def _slopes(laws, numbers, poles, speeds, w_rest, low, high, slopes):
    """M' at the ``speeds`` (STAGES,) of a step between the kinks low and high, over theta'."""
    low, high = low - w_rest, high - w_rest
    for i in range(STAGES):
        v = speeds[i] - w_rest
        arm = min(_ARM * room(poles, speeds[i]), 0.125 * (high - low))
        slopes[i] = _slope(laws, numbers, v, low, high, arm)


@compiled
def _numeric(plant, weights, c, h, slopes, sums, matrix):
    """``matrix`` after a Runge-Kutta step of size h in whose stages M' has the ``slopes``."""
    inertia, damping, stiffness, _, _, _ = plant
    for j in range(2):
        x, y = matrix[0, j], matrix[1, j]
        push = -((damping + slopes[0]) * y + stiffness * x) / inertia
        for k in range(sums.size):
            sums[k] = weights[0, k] * push
        for i in range(1, STAGES):
            speed = y + h * sums[i]
            angle = x + h * (c[i] * y + h * sums[ROWS + i])
            push = -((damping + slopes[i]) * speed + stiffness * angle) / inertia
            for k in range(sums.size):
                sums[k] += weights[i, k] * push
        matrix[0, j] = x + h * (y + h * sums[ROWS + STAGES])
        matrix[1, j] = y + h * sums[STAGES]


@compiled
def _linear(piece, tau, matrix):
    """``matrix`` after a time tau in closed form."""
    h, rate = impulse(piece, tau)
    top, w2 = rate + piece.damping * h, piece.stiffness
    for j in range(2):
        x, y = matrix[0, j], matrix[1, j]
        matrix[0, j] = top * x + h * y
        matrix[1, j] = rate * y - w2 * h * x


@compiled
def _through_pair(plant, pair, kinks, row, scratch, matrix):
    """``matrix`` after the Runge-Kutta step of a ``row`` of the trail."""
    laws, numbers, tableau, poles = pair
    weights, c, _, _, _, _ = tableau
    inertia, damping, w_rest = plant[0], plant[1], plant[5]
    slopes, sums = scratch[0, :STAGES], scratch[1]
    stretch, h = int(row[TRAIL_STRETCH]), row[TRAIL_SIZE]
    low, high = kinks[stretch, 0], kinks[stretch, 1]
    _slopes(laws, numbers, poles, row[TRAIL_SPEEDS:], w_rest, low, high, slopes)
    parts = 1 + int(h * (damping + slopes.max()) / inertia / _STIFF)
    if parts == 1:
        _numeric(plant, weights, c, h, slopes, sums, matrix)
        return
    rate, accel, drive = scratch[2, :ROWS], scratch[3, :ROWS], scratch[4, :ROWS]
    t, theta, w = row[TRAIL_TIME], row[TRAIL_THETA], row[TRAIL_W]
    h /= parts
    a = acceleration(plant, laws, numbers, drive_at(plant, t), theta, w)
    for _ in range(parts):
        theta, w, a, _, _ = advance(
            plant, laws, numbers, weights, c, t, theta, w, a, h, rate, accel, drive, sums
        )
        t += h
        _slopes(laws, numbers, poles, rate, w_rest, low, high, slopes)
        _numeric(plant, weights, c, h, slopes, sums, matrix)


@compiled
def carry(plant, pair, past, rtol, kinks, linear, table, trail, left, matrix):
    """Carry the columns of ``matrix`` (2, 2), deviations, along a trail of ``left`` rows.

    plant, pair, kinks, linear, table : as for ``smooth.run``
    past  : None, or (the law's numbers, what ``past.see`` found); one of pair and past is None
    rtol  : share of a deviation that a series may err by
    """
    scratch = np.empty((5, SUMS))
    number = 0
    for row in trail[:left]:
        stretch = int(row[TRAIL_STRETCH])
        if linear[stretch]:
            _linear(table[stretch], row[TRAIL_SIZE], matrix)
            continue
        if pair is not None:
            _through_pair(plant, pair, kinks, row, scratch, matrix)
        if past is not None:
            law, record = past
            through_series(plant, law, rtol, kinks, row, record, number, matrix)
            number += 1
