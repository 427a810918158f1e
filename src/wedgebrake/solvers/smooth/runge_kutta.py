"""One step of the Dormand-Prince 8(5,3) pair for theta' = w, w' = a(t, theta, w).

Hairer, Norsett and Wanner, Solving Ordinary Differential Equations I, section II.10; the
coefficients come from the caller. The continuous extension (degree 7) is written in the
Bernstein basis, where "no coefficient below the boundary" proves that the polynomial does
not cross it, and the convex hull gives a safe lower bound of its first root.
"""

import math

import numpy as np
from numpy.typing import NDArray

from wedgebrake.dynamics.brake_torque import brake_torque, smooth_brake
from wedgebrake.dynamics.jit import compiled

Array = NDArray[np.float64]

STAGES = 12
ROWS = 16  # stages, the derivative at the end of the step, three more for the extension
DEGREE = 7

# What the stages add up to: the later stages, the end of the step, its error estimates.
_END, _ERROR3, _ERROR5, _ERROR6 = range(STAGES, STAGES + 4)
SUMS = 2 * ROWS
# The stages with full order: any quadrature over them is a Runge-Kutta method of its order.
_EXACT = [0, 5, 6, 7, 8, 9, 10]


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


def columns(a_matrix: Array, b: Array, c: Array, e3: Array, e5: Array) -> Array:
    """(12, 32) weights of each stage's acceleration: in the sums for w, then for theta.

    As theta' = w, the sums for theta over the stages' w are sums over their accelerations
    with the square of the matrix (Nystrom's form). By columns, one stage adds to all later
    sums at once, in vector instructions.
    """
    rows = np.zeros((ROWS, STAGES), dtype=np.longdouble)
    rows[:STAGES], rows[_END], rows[_ERROR3], rows[_ERROR5] = a_matrix, b, e3, e5
    rows[_ERROR6] = _difference(c, float(np.linalg.norm(e5)))
    return np.ascontiguousarray(np.vstack((rows, rows @ rows[:STAGES])).T, dtype=float)


def bernstein_matrix() -> Array:
    """(8, 7) matrix from the extension's coefficients F to Bernstein coefficients.

    The extension is y0 + sum F_i x^a (1-x)^b with a = i//2 + 1, b = (i+1)//2, and
    x^a (1-x)^b has the Bernstein coefficients C(7-a-b, k-a)/C(7, k).
    """
    matrix = np.zeros((DEGREE + 1, DEGREE))
    for i in range(DEGREE):
        a, b = i // 2 + 1, (i + 1) // 2
        for k in range(a, DEGREE - b + 1):
            matrix[k, i] = math.comb(DEGREE - a - b, k - a) / math.comb(DEGREE, k)
    return matrix


@compiled
def acceleration(plant, laws, numbers, drive, theta, w):
    """Theta'' with the smooth brake torque, under the driving torque ``drive`` (eq. 1)."""
    inertia, damping, stiffness, _, _, w_rest = plant
    torque = brake_torque(smooth_brake(laws, numbers), w - w_rest)
    # A product: the division leaves the loop over the stages.
    return (drive - damping * w - stiffness * theta - torque) * (1.0 / inertia)


@compiled
def room(poles, w):
    """Distance from ``w`` to the nearest pole of the law, in the sum norm.

    poles : (n, 2) real part of each pole in theta' and distance from the real axis
    """
    least = math.inf
    for i in range(poles.shape[0]):
        least = min(least, abs(w - poles[i, 0]) + poles[i, 1])
    return least


@compiled
def drive_at(plant, t):
    """The driving torque at the time t."""
    return plant[3] * math.sin(plant[4] * t)


@compiled
def _drives(plant, c, t, h, drive):
    """The driving torque at the times t + c h of the stages."""
    amplitude, phase, turn = plant[3], plant[4] * t, plant[4] * h
    if turn > 0.25:
        for i in range(c.size):
            drive[i] = amplitude * math.sin(phase + c[i] * turn)
        return
    # Taylor polynomials about t, to rounding; in vector instructions.
    sine, cosine = amplitude * math.sin(phase), amplitude * math.cos(phase)
    for i in range(c.size):
        x = c[i] * turn
        y = x * x
        even = 1 / 24 - y * (1 / 720 - y * (1 / 40320 - y / 3628800))
        odd = 1 / 6 - y * (1 / 120 - y * (1 / 5040 - y * (1 / 362880 - y / 39916800)))
        drive[i] = sine * (1.0 - y * (0.5 - y * even)) + cosine * (x - x * y * odd)


@compiled
def step(plant, laws, numbers, weights, c, t, theta, w, a, h, rate, accel, drive, sums):
    """One step: (theta, w, a, lowest w, highest w) at its end.

    rate, accel : (ROWS,) receive theta' and w' of the stages
    drive       : (ROWS,) scratch;  sums : (SUMS,) receives the weighted sums
    """
    _drives(plant, c, t, h, drive)
    rate[0], accel[0] = w, a
    for k in range(sums.size):
        sums[k] = weights[0, k] * a
    lowest, highest = w, w
    for i in range(1, STAGES):
        stage = w + h * sums[i]
        lowest, highest = min(lowest, stage), max(highest, stage)
        angle = theta + h * (c[i] * w + h * sums[ROWS + i])
        push = acceleration(plant, laws, numbers, drive[i], angle, stage)
        rate[i], accel[i] = stage, push
        for k in range(sums.size):
            sums[k] += weights[i, k] * push
    theta1, w1 = theta + h * (w + h * sums[ROWS + _END]), w + h * sums[_END]
    # The last stage too is at the end of the step.
    a1 = acceleration(plant, laws, numbers, drive[STAGES - 1], theta1, w1)
    rate[STAGES], accel[STAGES] = w1, a1
    return theta1, w1, a1, min(lowest, w1), max(highest, w1)


@compiled
def error_norm(sums, h, scale_theta, scale_w):
    """Scaled error of the step whose sums are given; accept at most 1."""
    per_theta, per_w = h * h / scale_theta, h / scale_w
    three = (sums[_ERROR3] * per_w) ** 2 + (sums[ROWS + _ERROR3] * per_theta) ** 2
    five = (sums[_ERROR5] * per_w) ** 2 + (sums[ROWS + _ERROR5] * per_theta) ** 2
    six = (sums[_ERROR6] * per_w) ** 2 + (sums[ROWS + _ERROR6] * per_theta) ** 2
    if five > 0.0:
        five *= five / (five + 0.01 * three)
    return math.sqrt(0.5 * max(five, six))


@compiled
def extend(plant, laws, numbers, a_extra, c_extra, t, theta, w, h, rate, accel):
    """The three further stages that the continuous extension needs."""
    for i in range(3):
        n = STAGES + 1 + i
        dt, dw = 0.0, 0.0
        for j in range(n):
            dt += a_extra[i, j] * rate[j]
            dw += a_extra[i, j] * accel[j]
        rate[n] = w + h * dw
        drive = drive_at(plant, t + c_extra[i] * h)
        accel[n] = acceleration(plant, laws, numbers, drive, theta + h * dt, rate[n])


@compiled
def coefficients(d_matrix, bernstein, y0, y1, h, derivative, f, out):
    """Bernstein coefficients (8,) of the continuous extension of one component."""
    delta = y1 - y0
    f[0] = delta
    f[1] = h * derivative[0] - delta
    f[2] = 2.0 * delta - h * (derivative[STAGES] + derivative[0])
    for i in range(4):
        total = 0.0
        for j in range(ROWS):
            total += d_matrix[i, j] * derivative[j]
        f[3 + i] = h * total
    for k in range(DEGREE + 1):
        total = y0
        for i in range(DEGREE):
            total += bernstein[k, i] * f[i]
        out[k] = total
    out[DEGREE] = y1


@compiled
def _keep_from(b, cut):
    """Bernstein coefficients of the part of the polynomial from ``cut`` on (de Casteljau)."""
    for r in range(DEGREE):
        for k in range(DEGREE - r):
            b[k] += cut * (b[k + 1] - b[k])


@compiled
def first_root(b, start):
    """First root in [start, 1] of a polynomial that is not negative before it.

    b : (8,) Bernstein coefficients, overwritten. 2: there is no root; ``start`` where the
    polynomial is negative there.
    """
    if start > 0.0:
        _keep_from(b, start)
        if b[0] == 0.0:
            return 2.0
    for _ in range(200):
        if b[0] <= 0.0:
            return start
        # The control polygon's convex hull: no root before its first crossing.
        cut = 2.0
        for k in range(1, DEGREE + 1):
            if b[k] < 0.0:
                cut = min(cut, k / DEGREE * b[0] / (b[0] - b[k]))
        if cut > 1.0:
            return 1.0 if b[DEGREE] == 0.0 else 2.0
        if cut * (1.0 - start) < 1e-15:
            return start
        _keep_from(b, cut)
        start += cut * (1.0 - start)
    return start
