"""One step of the Dormand-Prince 8(5,3) pair for theta' = w, w' = a(t, theta, w).

Hairer, Norsett and Wanner, Solving Ordinary Differential Equations I, section II.10; the
coefficients come from the caller. The continuous extension (degree 7) is written in the
Bernstein basis, where "no coefficient below the boundary" proves that the polynomial does
not cross it, and the convex hull gives a safe lower bound of its first root.
"""

import math

import numpy as np

from .compiling import compiled
from .torque import brake_torque

STAGES = 12
ROWS = 16  # stages, the derivative at the end of the step, three more for the extension
DEGREE = 7


def bernstein_matrix():
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
def acceleration(plant, laws, numbers, t, theta, w):
    """Theta'' with the smooth brake torque (eq. 1)."""
    inertia, damping, stiffness, amplitude, omega, w_rest = plant
    friction, friction_shape, brake, brake_shape = laws
    radius, initial_force, slope, release = numbers
    torque = brake_torque(
        friction,
        friction_shape,
        brake,
        brake_shape,
        radius,
        initial_force,
        slope,
        release,
        w - w_rest,
    )
    drive = amplitude * math.sin(omega * t)
    return (drive - damping * w - stiffness * theta - torque) / inertia


@compiled
def step(plant, laws, numbers, a_matrix, b, c, e3, e5, t, theta, w, a, h, rate, accel):
    """One step: (theta, w, a, error5, error3, lowest w, highest w) at its end.

    rate, accel : (ROWS,) receive theta' and w' of the stages. The errors are those of w
    and theta together with unit weights removed by the caller: each is a pair.
    """
    rate[0], accel[0] = w, a
    lowest, highest = w, w
    for i in range(1, STAGES):
        dt, dw = 0.0, 0.0
        for j in range(i):
            dt += a_matrix[i, j] * rate[j]
            dw += a_matrix[i, j] * accel[j]
        stage = w + h * dw
        lowest, highest = min(lowest, stage), max(highest, stage)
        rate[i] = stage
        accel[i] = acceleration(plant, laws, numbers, t + c[i] * h, theta + h * dt, stage)
    dt, dw = 0.0, 0.0
    for j in range(STAGES):
        dt += b[j] * rate[j]
        dw += b[j] * accel[j]
    theta1, w1 = theta + h * dt, w + h * dw
    a1 = acceleration(plant, laws, numbers, t + h, theta1, w1)
    rate[STAGES], accel[STAGES] = w1, a1
    t5, t3, w5, w3 = 0.0, 0.0, 0.0, 0.0
    for j in range(STAGES + 1):
        t5 += e5[j] * rate[j]
        t3 += e3[j] * rate[j]
        w5 += e5[j] * accel[j]
        w3 += e3[j] * accel[j]
    lowest, highest = min(lowest, w1), max(highest, w1)
    return theta1, w1, a1, (t5, t3, w5, w3), lowest, highest


@compiled
def error_norm(errors, h, scale_theta, scale_w):
    """Scaled error of the step; accept at most 1."""
    t5, t3, w5, w3 = errors
    t5, t3 = t5 / scale_theta, t3 / scale_theta
    w5, w3 = w5 / scale_w, w3 / scale_w
    five = t5 * t5 + w5 * w5
    three = t3 * t3 + w3 * w3
    if five == 0.0 and three == 0.0:
        return 0.0
    return h * five / math.sqrt(2.0 * (five + 0.01 * three))


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
        accel[n] = acceleration(
            plant, laws, numbers, t + c_extra[i] * h, theta + h * dt, w + h * dw
        )


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
def value(b, x):
    """The polynomial with Bernstein coefficients b at x in [0, 1]."""
    y = 1.0 - x
    total, power, binomial = b[0], 1.0, 1.0
    for k in range(1, DEGREE + 1):
        power *= x
        binomial *= (DEGREE - k + 1.0) / k
        total = total * y + binomial * power * b[k]
    return total


@compiled
def first_root(b, on_boundary):
    """First root in (0, 1] of a polynomial that starts at or above zero; 2 if there is none.

    b : (8,) Bernstein coefficients, overwritten. ``on_boundary``: it starts at zero and that
    root does not count; it is divided out, twice if the slope is zero there too.
    """
    n = DEGREE
    if on_boundary:
        b[0] = 0.0
    while b[0] == 0.0 and on_boundary and n > 1:
        for k in range(n):
            b[k] = b[k + 1] * n / (k + 1.0)
        n -= 1
    start = 0.0
    for _ in range(200):
        if b[0] <= 0.0:
            return start
        # The control polygon's convex hull: no root before its first crossing.
        cut = 2.0
        for k in range(1, n + 1):
            if b[k] < 0.0:
                cut = min(cut, k / n * b[0] / (b[0] - b[k]))
        if cut > 1.0:
            return 1.0 if b[n] == 0.0 else 2.0
        if cut * (1.0 - start) < 1e-15:
            return start
        # De Casteljau: keep the part from the cut on.
        for r in range(n):
            for k in range(n - r):
                b[k] += cut * (b[k + 1] - b[k])
        start += cut * (1.0 - start)
    return start
