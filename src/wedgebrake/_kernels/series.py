"""One step by a Taylor series, for friction mu tanh and brakes whose g is a fraction.

With m = mu tanh(kappa v) and g = a m/(b - m d), the torque per force G = R g obeys

    dG/dt = Q(G) dv/dt,  Q = p0 + p1 G + p2 G^2                (docs/theory.md, section 7)

so that all coefficients of theta, w and G follow from each other by products of series
(Jorba and Zou, Experimental Mathematics 14 (2005) 99): one exponential a step, no
rejected steps, and the motion inside the step as a polynomial as exact as the step itself,
on which the kinks of the law are found without missing one.

Law numbers: (kappa, mu, a, b, d, R, F_0, slope); v = w - w_rest is the sliding velocity.
"""

import math

import numpy as np

from .compiling import compiled
from .slip import HIT_HIGH, HIT_LOW, REACHED_END

# Coefficients kept: of theta and w up to this power of the time.
ORDER = 16
# Rows of the scratch array: theta, w, w' as series; the driving torque over the inertia; G, Q;
# and for deviations the slope of the torque, and angle and velocity of both of them.
_THETA, _W, SERIES_A, _DRIVE, _G, _Q, _SLOPE, _X, _Y = range(9)
SERIES_ROWS = 11

_OVER = 1.0 / np.arange(1.0, ORDER + 2.0)
# A start on a kink is no crossing, nor is what rounding makes of this share of a step.
_ON_KINK = 1e-6


@compiled
def _tanh(x):
    """(tanh x, 1 - tanh^2 x), the latter without cancellation."""
    e = math.exp(-2.0 * abs(x))
    if abs(x) < 0.05:
        # Below, 1 - e would lose digits (error below 1e-16).
        y = x * x
        size = x * (1.0 - y * (1 / 3 - y * (2 / 15 - y * (17 / 315 - y * 62 / 2835))))
    else:
        size = math.copysign((1.0 - e) / (1.0 + e), x)
    return size, 4.0 * e / ((1.0 + e) * (1.0 + e))


@compiled
def _gain(law, v):
    """(G, dG/dv) at the sliding velocity v."""
    kappa, mu, a, b, d, radius, _, _ = law
    tanh, slope = _tanh(kappa * v)
    gap = b - mu * d * tanh
    return radius * a * mu * tanh / gap, radius * a * b * mu * kappa * slope / (gap * gap)


@compiled
def brake_torque_at(law, side, v):
    """Torque of the brake sliding to ``side`` with the velocity v [N m]."""
    gain, _ = _gain(law, v)
    return (law[6] + law[7] * side * v) * gain


@compiled
def acceleration(plant, law, side, drive, theta, w):
    """Theta'' sliding to ``side``, under the driving torque ``drive`` (eq. 1)."""
    torque = brake_torque_at(law, side, w - plant[5])
    return (drive - plant[1] * w - plant[2] * theta - torque) * (1.0 / plant[0])


@compiled
def series_numbers(plant, law, numbers):
    """What steps in lanes need of a system, into ``numbers`` (13,); the slope for v > 0."""
    inertia, damping, stiffness, _, omega, w_rest = plant
    kappa, mu, a, b, d, radius, force, slope = law
    numbers[0], numbers[1] = damping / inertia, stiffness / inertia
    numbers[2], numbers[3] = force / inertia, slope / inertia
    numbers[4], numbers[5], numbers[6] = omega * omega, w_rest, kappa
    # The gain is top tanh/(gap - lever tanh), its slope rise e/(1 + e)^2/(...)^2.
    numbers[7], numbers[8], numbers[9] = radius * a * mu, b, d * mu
    numbers[10] = 4.0 * radius * a * b * mu * kappa
    numbers[11] = kappa * (mu * d * d - b * b / mu) / (a * b * radius)
    numbers[12] = 2.0 * kappa * mu * d / b


@compiled
def expand(plant, law, side, t, theta, w, work):
    """Fill ``work`` (6 rows of ORDER + 1) with the series of the motion from (t, theta, w).

    side : +-1, direction of sliding, in which the step has to stay
    """
    inertia, damping, stiffness, amplitude, omega, w_rest = plant
    kappa, mu, a, b, d, radius, force, slope = law
    thetas, ws, accels = work[_THETA], work[_W], work[SERIES_A]
    drive, gains, rates = work[_DRIVE], work[_G], work[_Q]
    over = 1.0 / inertia
    damping, stiffness, force, slope = (
        damping * over, stiffness * over, force * over, side * slope * over,
    )  # fmt: skip
    v = w - w_rest
    gain, rate = _gain(law, v)
    # Q(G) = p0 + p1 G + p2 G^2; its slope at G.
    bend = kappa * (mu * d * d - b * b / mu) / (a * b * radius)
    lean = 2.0 * (kappa * mu * d / b + bend * gain)
    pressed = force + slope * v
    drive[0] = amplitude * over * math.sin(omega * t)
    drive[1] = amplitude * over * omega * math.cos(omega * t)
    thetas[0], thetas[1] = theta, w
    accel = drive[0] - damping * w - stiffness * theta - pressed * gain
    ws[0], ws[1], accels[0] = w, accel, accel
    gains[0], gains[1], rates[0] = gain, rate * accel, rate
    for n in range(1, ORDER):
        # The products without their first and last terms, in two sums each: a processor
        # adds to one while it waits for the other.
        square, moved, turned = 0.0, 0.0, 0.0
        square2, moved2, turned2 = 0.0, 0.0, 0.0
        for j in range(1, n - 1, 2):
            square += gains[j] * gains[n - j]
            moved += ws[j] * gains[n - j]
            turned += rates[j] * accels[n - j]
            square2 += gains[j + 1] * gains[n - j - 1]
            moved2 += ws[j + 1] * gains[n - j - 1]
            turned2 += rates[j + 1] * accels[n - j - 1]
        if n % 2 == 0:
            square += gains[n - 1] * gains[1]
            moved += ws[n - 1] * gains[1]
            turned += rates[n - 1] * accels[1]
        share = _OVER[n]
        drive[n + 1] = -omega * omega * drive[n - 1] * share * _OVER[n - 1]
        # What hangs on the newest term comes last: the next one waits for it.
        known = drive[n] - stiffness * thetas[n] - slope * (moved + moved2)
        now = (known - (damping + slope * gain) * ws[n]) - pressed * gains[n]
        change = bend * (square + square2) + lean * gains[n]
        accels[n], rates[n] = now, change
        ws[n + 1] = now * share
        thetas[n + 1] = ws[n] * share
        turned = (turned + turned2) * share
        gains[n + 1] = (turned + (accel * share) * change) + (rate * share) * now


@compiled
def longest(work, per_theta, per_w):
    """The step that the last two terms allow; per_*: one over the tolerances of the step."""
    last = max(abs(work[_W, ORDER]) * per_w, abs(work[_THETA, ORDER]) * per_theta)
    before = max(abs(work[_W, ORDER - 1]) * per_w, abs(work[_THETA, ORDER - 1]) * per_theta)
    size = max(math.log(last + 1e-300) / ORDER, math.log(before + 1e-300) / (ORDER - 1))
    return math.exp(-size)


@compiled
def state(work, tau):
    """(theta, w, w', bound of the way that w has gone) a time tau after the series begins."""
    theta, w, a = work[_THETA, ORDER], work[_W, ORDER], work[SERIES_A, ORDER - 1]
    way = abs(w)
    for n in range(ORDER - 1, 0, -1):
        theta = theta * tau + work[_THETA, n]
        w = w * tau + work[_W, n]
        way = way * tau + abs(work[_W, n])
        a = a * tau + work[SERIES_A, n - 1]
    return theta * tau + work[_THETA, 0], w * tau + work[_W, 0], a, way * tau


@compiled
def _bounds(work, h):
    """Bounds of |w''| and |w'''| within a time h."""
    two, three = 0.0, 0.0
    for n in range(ORDER, 1, -1):
        term = n * (n - 1.0) * abs(work[_W, n])
        two = two * h + term
        if n > 2:
            three = three * h + term * (n - 2.0)
    return two, three


@compiled
def _first(work, h, edge, sign, tiny):
    """Time until sign (w - edge) first vanishes, after a start at or above 0; 2h: not within h.

    Each step is one that provably holds no root, from a bound of the second derivative (of
    the third on leaving the edge); near a root these are Newton's, from the safe side.
    """
    two, three = _bounds(work, h)
    gap, speed = sign * (work[_W, 0] - edge), sign * work[SERIES_A, 0]
    tau = 0.0
    if gap <= 0.0:
        turn = sign * work[SERIES_A, 1]
        if speed < 0.0 or (speed == 0.0 and turn < 0.0):
            return 0.0
        # gap >= speed tau + turn tau^2/2 - three tau^3/6
        three = max(three / 6.0, 1e-300)
        tau = (0.5 * turn + math.sqrt(0.25 * turn * turn + 4.0 * speed * three)) / (2.0 * three)
        tau = max(tau, _ON_KINK * h)
        if tau >= h:
            return 2.0 * h
        _, w, a, _ = state(work, tau)
        gap, speed = sign * (w - edge), sign * a
    for _ in range(200):
        if gap < 0.0 or (gap == 0.0 and speed < 0.0):
            return tau
        root = math.sqrt(speed * speed + 2.0 * two * gap)
        ahead = (speed + root) / two if speed >= 0.0 else 2.0 * gap / (root - speed)
        tau += ahead
        if tau >= h:
            return 2.0 * h
        if ahead <= tiny:
            return tau
        _, w, a, _ = state(work, tau)
        gap, speed = sign * (w - edge), sign * a
    return tau


@compiled
def crossing(work, h, way, low, high, tiny):
    """(size of the step, what) up to the first of two edges that w leaves (low, high) by.

    way : bound of the way that w goes in the step
    """
    size, what, w = h, REACHED_END, work[_W, 0]
    if way == 0.0:
        return h, REACHED_END
    if w - low <= way:
        found = _first(work, h, low, 1.0, tiny)
        if found <= size:
            size, what = found, HIT_LOW
    if high - w <= way:
        found = _first(work, h, high, -1.0, tiny)
        if found <= size:
            size, what = found, HIT_HIGH
    return size, what


@compiled
def passes(work, h, level):
    """When w passes ``level`` within h, known to lie on its other side then."""
    before, after = 0.0, h
    rises = work[_W, 0] < level
    tau = 0.5 * h
    for _ in range(60):
        _, w, a, _ = state(work, tau)
        if (w < level) == rises:
            before = tau
        else:
            after = tau
        newton = tau + (level - w) / a if a != 0.0 else before
        if abs(newton - tau) <= 1e-12 * h:
            return tau
        tau = newton if before < newton < after else 0.5 * (before + after)
    return tau


@compiled
def torque_slope(law, side, v):
    """dM/dv of the brake torque M at the sliding velocity v [N m s/rad]."""
    gain, rate = _gain(law, v)
    return side * law[7] * gain + (law[6] + side * law[7] * v) * rate


@compiled
def deviate(plant, law, side, rest, rtol, work, matrix):
    """Carry the columns of ``matrix`` (2, 2), deviations, along the motion expanded in ``work``.

    J y' + (c + dM/dv) y + k x = 0,  x' = y, term by term as the motion itself. Returns the
    time gone, at most ``rest``: less where an error of ``rtol`` asks for it, as the slope of the
    torque varies faster than the torque.
    """
    inertia, damping, stiffness, _, _, w_rest = plant
    slopes, ws, gains, rates = work[_SLOPE], work[_W], work[_G], work[_Q]
    slope = side * law[7]
    pressed = law[6] + slope * (ws[0] - w_rest)
    for n in range(ORDER):
        moved = 0.0
        for j in range(1, n + 1):
            moved += ws[j] * rates[n - j]
        slopes[n] = slope * (gains[n] + moved) + pressed * rates[n]
    slopes[0] += damping
    last, before = 1e-300, 1e-300
    spring = math.sqrt(stiffness / inertia)
    for column in range(2):
        xs, ys = work[_X + 2 * column], work[_Y + 2 * column]
        xs[0], ys[0] = matrix[0, column], matrix[1, column]
        for n in range(ORDER):
            push = stiffness * xs[n]
            for j in range(n + 1):
                push += slopes[j] * ys[n - j]
            ys[n + 1] = -push / inertia * _OVER[n]
            xs[n + 1] = ys[n] * _OVER[n]
        size = abs(ys[0]) + spring * abs(xs[0]) + 1e-300
        last = max(last, abs(ys[ORDER]) / size)
        before = max(before, abs(ys[ORDER - 1]) / size)
    tau = min(rest, (rtol / last) ** (1.0 / ORDER), (rtol / before) ** (1.0 / (ORDER - 1)))
    for column in range(2):
        xs, ys = work[_X + 2 * column], work[_Y + 2 * column]
        x, y = xs[ORDER], ys[ORDER]
        for n in range(ORDER - 1, -1, -1):
            x = x * tau + xs[n]
            y = y * tau + ys[n]
        matrix[0, column], matrix[1, column] = x, y
    return tau
