"""One step of the Dormand-Prince 8(5,3) pair for theta' = w, w' = a(t, theta, w).

Hairer, Norsett and Wanner, Solving Ordinary Differential Equations I, section II.10, with the
coefficients of SciPy. ``continuous_extension`` gives the motion inside the step.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import DOP853

from wedgebrake.dynamics.brake_torque import SmoothBrake, brake_torque
from wedgebrake.dynamics.harmonic import Sine, phase_at, value
from wedgebrake.dynamics.jit import compiled
from wedgebrake.dynamics.linear_flow import LinearDriveline
from wedgebrake.dynamics.records import record
from wedgebrake.solvers.smooth.continuous_extension import ROWS, STAGES
from wedgebrake.solvers.smooth.problem import Tolerances, joined

Array = NDArray[np.float64]

# What the stages add up to: the later stages, the end of the step, its error estimates; for
# the velocity, then for the angle.
_END, _ERROR3, _ERROR5, _ERROR6 = range(STAGES, STAGES + 4)
SUMS = 2 * ROWS
# The stages with full order: any quadrature over them is a Runge-Kutta method of its order.
_EXACT = [0, 5, 6, 7, 8, 9, 10]


# A stage of a step.
STAGE = record("velocity acceleration")


class RungeKutta(NamedTuple):
    """Runge-Kutta steps for one machine, with scratch.

    poles  : as in ``AnyLaw``
    stages : (ROWS,) of dtype ``STAGE``;  drives : (ROWS,) driving torque at the stages
    sums   : (SUMS,) weighted sums of the stages' accelerations
    """

    driveline: LinearDriveline
    torque: Sine
    brake: SmoothBrake
    poles: Array
    tolerances: Tolerances
    stages: NDArray[np.record]
    drives: Array
    sums: Array


class StepEnd(NamedTuple):
    """End of a step."""

    angle: float
    velocity: float
    acceleration: float


def _difference(c: Array, size: float) -> Array:
    """(12,) weights of norm ``size`` of the sixth divided difference over the exact stages.

    An error estimate of order 6. The pair's own estimates vanish by chance at some step
    sizes, and steps wrong by 500 tolerances were then accepted; this one does not vanish
    together with them.
    """
    weights = np.zeros(STAGES)
    for i in _EXACT:
        weights[i] = 1.0 / np.prod([c[i] - c[j] for j in _EXACT if j != i])
    return weights * (size / np.linalg.norm(weights))


def _columns(a_matrix: Array, b: Array, c: Array, e3: Array, e5: Array) -> Array:
    """(12, 32) weights of each stage's acceleration: in the sums for w, then for theta.

    As theta' = w, the sums for theta over the stages' w are sums over their accelerations
    with the square of the matrix (Nystrom's form). By columns, one stage adds to all later
    sums at once, in vector instructions.
    """
    rows = np.zeros((ROWS, STAGES), dtype=np.longdouble)
    rows[:STAGES], rows[_END], rows[_ERROR3], rows[_ERROR5] = a_matrix, b, e3, e5
    rows[_ERROR6] = _difference(c, float(np.linalg.norm(e5)))
    return np.vstack((rows, rows @ rows[:STAGES])).T


# (12, 32) weights of the stages, (12,) their times; (3, 16) and (3,) those of the extension.
WEIGHTS = np.ascontiguousarray(
    _columns(DOP853.A, DOP853.B, DOP853.C, DOP853.E3[:-1], DOP853.E5[:-1]), dtype=float
)
NODES = np.ascontiguousarray(DOP853.C, dtype=float)
_EXTRA_WEIGHTS = np.ascontiguousarray(DOP853.A_EXTRA, dtype=float)
_EXTRA_NODES = np.ascontiguousarray(DOP853.C_EXTRA, dtype=float)


@compiled
def open_runge_kutta(law, functions, problem):
    """``RungeKutta`` for an ``AnyLaw``."""
    return RungeKutta(
        problem.driveline, problem.torque, joined(functions, law.numbers), law.poles,
        problem.tolerances, np.empty(ROWS, STAGE), np.empty(ROWS), np.empty(SUMS),
    )  # fmt: skip


@compiled
def acceleration(driveline, brake, drive, angle, velocity):
    """Theta'' with a smooth brake, under the driving torque ``drive`` (eq. 1)."""
    torque = brake_torque(brake, velocity - driveline.rest_velocity)
    # A product: the division leaves the loop over the stages.
    push = drive - driveline.damping * velocity - driveline.stiffness * angle - torque
    return push * (1.0 / driveline.inertia)


@compiled
def acceleration_at(method, t, angle, velocity):
    """Theta'' at the time t."""
    drive = value(method.torque, phase_at(method.torque, t))
    return acceleration(method.driveline, method.brake, drive, angle, velocity)


@compiled
def pole_distance(poles, velocity):
    """Distance from a velocity to the nearest pole of the law, in the sum norm.

    poles : (n, 2) velocity of each pole and distance from the real axis
    """
    least = math.inf
    for i in range(poles.shape[0]):
        least = min(least, abs(velocity - poles[i, 0]) + poles[i, 1])
    return least


@compiled
def _drives(torque, t, h, drives):
    """Store the driving torque at the times of the stages."""
    turn = torque.angular_frequency * h
    if turn > 0.25:
        for i in range(NODES.size):
            drives[i] = value(torque, phase_at(torque, t + NODES[i] * h))
        return
    # Taylor polynomials about t, to rounding; in vector instructions.
    phase = phase_at(torque, t)
    sine, cosine = torque.amplitude * phase.sine, torque.amplitude * phase.cosine
    for i in range(NODES.size):
        x = NODES[i] * turn
        y = x * x
        even = 1 / 24 - y * (1 / 720 - y * (1 / 40320 - y / 3628800))
        odd = 1 / 6 - y * (1 / 120 - y * (1 / 5040 - y * (1 / 362880 - y / 39916800)))
        drives[i] = sine * (1.0 - y * (0.5 - y * even)) + cosine * (x - x * y * odd)


@compiled
def step(method, t, angle, velocity, a, h):
    """``StepEnd`` of one step of size h; ``method`` receives its stages and sums."""
    driveline, brake = method.driveline, method.brake
    stages, drives, sums = method.stages, method.drives, method.sums
    _drives(method.torque, t, h, drives)
    stages[0].velocity, stages[0].acceleration = velocity, a
    for k in range(sums.size):
        sums[k] = WEIGHTS[0, k] * a
    for i in range(1, STAGES):
        stage = velocity + h * sums[i]
        stage_angle = angle + h * (NODES[i] * velocity + h * sums[ROWS + i])
        push = acceleration(driveline, brake, drives[i], stage_angle, stage)
        stages[i].velocity, stages[i].acceleration = stage, push
        for k in range(sums.size):
            sums[k] += WEIGHTS[i, k] * push
    angle1 = angle + h * (velocity + h * sums[ROWS + _END])
    velocity1 = velocity + h * sums[_END]
    # The last stage too is at the end of the step.
    a1 = acceleration(driveline, brake, drives[STAGES - 1], angle1, velocity1)
    stages[STAGES].velocity, stages[STAGES].acceleration = velocity1, a1
    return StepEnd(angle1, velocity1, a1)


@compiled
def error_norm(sums, h, angle_scale, velocity_scale):
    """Scaled error of the step whose sums are given; accept at most 1."""
    per_angle, per_velocity = h * h / angle_scale, h / velocity_scale
    three = (sums[_ERROR3] * per_velocity) ** 2 + (sums[ROWS + _ERROR3] * per_angle) ** 2
    five = (sums[_ERROR5] * per_velocity) ** 2 + (sums[ROWS + _ERROR5] * per_angle) ** 2
    six = (sums[_ERROR6] * per_velocity) ** 2 + (sums[ROWS + _ERROR6] * per_angle) ** 2
    if five > 0.0:
        five *= five / (five + 0.01 * three)
    return math.sqrt(0.5 * max(five, six))


@compiled
def extend(method, t, angle, velocity, h):
    """Compute the three further stages that the continuous extension needs."""
    stages = method.stages
    for i in range(3):
        n = STAGES + 1 + i
        dt, dw = 0.0, 0.0
        for j in range(n):
            dt += _EXTRA_WEIGHTS[i, j] * stages[j].velocity
            dw += _EXTRA_WEIGHTS[i, j] * stages[j].acceleration
        stage, time = velocity + h * dw, t + _EXTRA_NODES[i] * h
        stages[n].velocity = stage
        stages[n].acceleration = acceleration_at(method, time, angle + h * dt, stage)
