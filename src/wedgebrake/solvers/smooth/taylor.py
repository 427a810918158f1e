"""Steps by Taylor series, for friction mu tanh and brakes whose g is a fraction.

With m = mu tanh(kappa v) and g = a m/(b - m d), the torque per force G = R g obeys

    dG/dt = Q(G) dv/dt,  Q = p0 + p1 G + p2 G^2                (docs/theory.md, section 7)

so that all coefficients of theta, w and G follow from each other by products of series
(Jorba and Zou, Experimental Mathematics 14 (2005) 99): one exponential a step, no
rejected steps, and the motion inside the step as a polynomial as exact as the step itself,
on which the kinks of the law are found without missing one.

A step is one formula, compiled for one system and for several side by side (``trace``). Its
inputs and outputs are columns of arrays, one column for each system (lane).
"""

import math

from wedgebrake.dynamics.enums import SearchEnd
from wedgebrake.dynamics.jit import compiled
from wedgebrake.solvers.smooth.simd_codegen import traced

# Coefficients kept: of theta and w up to this power of the time.
ORDER = 16

# Numbers of a system, from (kappa, mu, a, b, d, R, F_0, slope) and the driveline: over the
# inertia the damping, stiffness, initial force and slope of the force (times the direction of
# sliding); omega^2, w_rest, kappa; the gain is TOP tanh/(GAP - LEVER tanh), its slope
# RISE e/(1 + e)^2/(...)^2; BEND is p2, LEAN p1.
(
    DAMPING, STIFFNESS, FORCE, SLOPE, _OMEGA2, REST, _KAPPA, _TOP, _GAP, _LEVER, _RISE, _BEND,
    _LEAN,
) = range(13)  # fmt: skip
# And of a step: the state, the driving torque over the inertia and its rate; the last step, the
# longest one allowed, how far w may go, the tolerances of angle and velocity.
THETA, W, DRIVE, RATE, LAST, LONGEST, REACH, TOL_THETA, TOL_W = range(13, 22)
INPUTS = 22
# What a step gives: its size; at its end the state, w', how far w went at most, the driving
# torque and its rate; then the series of theta, w and w'.
SIZE, THETA1, W1, A1, WAY, DRIVE1, RATE1 = range(7)
THETAS, WS, ACCELS = (7 + row * (ORDER + 1) for row in range(3))
OUTPUTS = ACCELS + ORDER

# The last terms may have this share of the tolerance: what is left out adds up over the steps,
# and a hundredth costs a third more of them.
_SHARE = 0.01
# Largest product of a step and the decay rate of small deviations: the sum of 16 terms of exp(-z)
# has an error of a tenth at 6, and the wrong sign beyond. The last terms do not show this error for
# a motion far below the tolerance, as near rest: its velocity would change sign at every step.
_FADES = 6.0
# A start on a kink is no crossing, nor is what rounding makes of this share of a step.
_ON_KINK = 1e-6


def expand(maths, get):
    """The series of (drive, theta, w, w', G, Q), from ``get(input)``; for ``formula``."""
    omega2, bend, force, slope = get(_OMEGA2), get(_BEND), get(FORCE), get(SLOPE)
    stiffness, theta, w = get(STIFFNESS), get(THETA), get(W)
    v = w - get(REST)
    x = get(_KAPPA) * v
    e = maths.exp(-2.0 * abs(x))
    over = 1.0 / (1.0 + e)
    # 1 - e cancels near 0, where the first terms of the series bound tanh from both sides.
    size = abs(x)
    square = size * size
    low = size * (1.0 - square * (1.0 / 3.0))
    high = low + size * square * square * (2.0 / 15.0)
    tanh = maths.signed(maths.smaller(maths.larger((1.0 - e) * over, low), high), x)
    part = 1.0 / (get(_GAP) - get(_LEVER) * tanh)
    gain, rate = get(_TOP) * tanh * part, get(_RISE) * e * over * over * part * part
    lean = get(_LEAN) + 2.0 * bend * gain
    pressed, drag = force + slope * v, get(DAMPING) + slope * gain
    drive = [get(DRIVE), get(RATE)]
    accel = drive[0] - get(DAMPING) * w - stiffness * theta - pressed * gain
    thetas, ws, accels, gains, rates = [theta, w], [w, accel], [accel], [gain, rate * accel], [rate]
    for n in range(1, ORDER):
        square, moved, turned = 0.0, 0.0, 0.0
        for j in range(1, n):
            moved = moved + ws[j] * gains[n - j]
            turned = turned + rates[j] * accels[n - j]
            if 2 * j < n:
                square = square + gains[j] * gains[n - j]
        square = 2.0 * square
        if n % 2 == 0:
            square = square + gains[n // 2] * gains[n // 2]
        share = 1.0 / (n + 1.0)
        drive.append(omega2 * drive[n - 1] * (-share / n))
        # What hangs on the newest term comes last: the next one waits for it.
        now = (drive[n] - stiffness * thetas[n] - slope * moved - drag * ws[n]) - pressed * gains[n]
        change = bend * square + lean * gains[n]
        accels.append(now)
        rates.append(change)
        ws.append(now * share)
        thetas.append(ws[n] * share)
        gains.append(((turned + accel * change) + rate * now) * share)
    return drive, thetas, ws, accels, gains, rates


def results(h, drive, thetas, ws, accels):
    """The outputs of a step of size h with these series."""
    theta1, w1, a1, way = thetas[ORDER], ws[ORDER], accels[ORDER - 1], abs(ws[ORDER])
    drive1, rate1 = drive[ORDER], ORDER * drive[ORDER]
    for n in range(ORDER - 1, -1, -1):
        theta1, w1, drive1 = theta1 * h + thetas[n], w1 * h + ws[n], drive1 * h + drive[n]
        if n > 0:
            way = way * h + abs(ws[n])
            a1, rate1 = a1 * h + accels[n - 1], rate1 * h + n * drive[n]
    return [h, theta1, w1, a1, way * h, drive1, rate1, *thetas, *ws, *accels]


def formula(maths, get):
    """All outputs of a step, from ``get(input)``; in plain Python, for ``trace``."""
    drive, thetas, ws, accels, gains, rates = expand(maths, get)
    pressed = get(FORCE) + get(SLOPE) * (ws[0] - get(REST))
    slopes = get(SLOPE) * gains[0] + pressed * rates[0]
    furthest = get(REACH) / (abs(accels[0]) + 1e-300)
    fading = _FADES / (abs(get(DAMPING) + slopes) + 1e-300)
    h = maths.smaller(_longest(maths, get, thetas, ws), maths.smaller(get(LONGEST), furthest))
    h = maths.smaller(h, fading)
    return results(h, drive, thetas, ws, accels)


def _longest(maths, get, thetas, ws):
    """The step that the last two terms allow, by roots of a power of two from the last step."""
    s = get(LAST)
    fourth = (s * s) * (s * s)
    power = fourth * fourth * fourth * (s * s) * s
    largest = 0.0
    for n in (ORDER - 1, ORDER):
        angle, speed = abs(thetas[n]) / get(TOL_THETA), abs(ws[n]) / get(TOL_W)
        term = maths.larger(angle, speed) * power * (s if n == ORDER else 1.0)
        root = maths.sqrt(maths.sqrt(maths.sqrt(maths.sqrt(term + 1e-290))))
        if n < ORDER:
            # The sixteenth root for the fifteenth: beyond 1 a bound of what is missing.
            root = root * (1.0 + maths.larger(root - 1.0, 0.0) * (1.0 / n))
        largest = maths.larger(largest, root)
    return s / largest


_step = traced(formula, 1)


@compiled
def step(inputs, outputs):
    """``formula`` for one system: inputs (INPUTS, 1), outputs (OUTPUTS, 1)."""
    _step(inputs, outputs)


@compiled
def load(plant, law, inputs, lane):
    """The numbers of a system into a column of ``inputs``."""
    inertia, damping, stiffness, _, omega, w_rest = plant
    kappa, mu, a, b, d, radius, force, slope = law
    inputs[DAMPING, lane], inputs[STIFFNESS, lane] = damping / inertia, stiffness / inertia
    inputs[FORCE, lane], inputs[SLOPE, lane] = force / inertia, slope / inertia
    inputs[_OMEGA2, lane], inputs[REST, lane], inputs[_KAPPA, lane] = omega * omega, w_rest, kappa
    inputs[_TOP, lane], inputs[_GAP, lane], inputs[_LEVER, lane] = radius * a * mu, b, d * mu
    inputs[_RISE, lane] = 4.0 * radius * a * b * mu * kappa
    inputs[_BEND, lane] = kappa * (mu * d * d - b * b / mu) / (a * b * radius)
    inputs[_LEAN, lane] = 2.0 * kappa * mu * d / b


@compiled
def aim(plant, law, side, t, theta, w, inputs, lane):
    """The state that the next step begins at, sliding to ``side``."""
    f, omega = plant[3] / plant[0], plant[4]
    inputs[SLOPE, lane] = side * law[7] / plant[0]
    inputs[THETA, lane], inputs[W, lane] = theta, w
    inputs[DRIVE, lane] = f * math.sin(omega * t)
    inputs[RATE, lane] = f * omega * math.cos(omega * t)


@compiled
def limit(tolerances, longest, reach, inputs, lane):
    """The limits of the next step; ``reach``: how far w may go."""
    rtol, scale_theta, scale_w = tolerances
    inputs[LONGEST, lane], inputs[REACH, lane] = longest, reach
    rtol *= _SHARE
    inputs[TOL_THETA, lane] = rtol * (scale_theta + abs(inputs[THETA, lane]))
    inputs[TOL_W, lane] = rtol * (scale_w + abs(inputs[W, lane]))


@compiled
def brake_torque_at(law, side, v):
    """Torque of the brake sliding to ``side`` with the velocity v [N m]."""
    kappa, mu, a, b, d, radius, force, slope = law
    e = math.exp(-2.0 * abs(kappa * v))
    tanh = math.copysign(-math.expm1(-2.0 * abs(kappa * v)) / (1.0 + e), v)
    return (force + slope * side * v) * (radius * a * mu * tanh / (b - mu * d * tanh))


@compiled
def acceleration(plant, law, side, drive, theta, w):
    """Theta'' sliding to ``side``, under the driving torque ``drive`` (eq. 1)."""
    torque = brake_torque_at(law, side, w - plant[5])
    return (drive - plant[1] * w - plant[2] * theta - torque) * (1.0 / plant[0])


@compiled
def state(outputs, lane, tau):
    """(theta, w, w') a time tau after a step begins."""
    theta, w = outputs[THETAS + ORDER, lane], outputs[WS + ORDER, lane]
    a = outputs[ACCELS + ORDER - 1, lane]
    for n in range(ORDER - 1, 0, -1):
        theta = theta * tau + outputs[THETAS + n, lane]
        w = w * tau + outputs[WS + n, lane]
        a = a * tau + outputs[ACCELS + n - 1, lane]
    return theta * tau + outputs[THETAS, lane], w * tau + outputs[WS, lane], a


@compiled
def _bounds(outputs, lane, h):
    """Bounds of |w''| and |w'''| within a time h."""
    two, three = 0.0, 0.0
    for n in range(ORDER, 1, -1):
        term = n * (n - 1.0) * abs(outputs[WS + n, lane])
        two = two * h + term
        if n > 2:
            three = three * h + term * (n - 2.0)
    return two, three


@compiled
def _first(outputs, lane, h, edge, sign, tiny):
    """Time until sign (w - edge) first vanishes, after a start at or above 0; 2h: not within h.

    Each step is one that provably holds no root, from a bound of the second derivative (of
    the third on leaving the edge); near a root these are Newton's, from the safe side.
    """
    two, three = _bounds(outputs, lane, h)
    gap, speed = sign * (outputs[WS, lane] - edge), sign * outputs[ACCELS, lane]
    tau = 0.0
    if gap <= 0.0:
        turn = sign * outputs[ACCELS + 1, lane]
        if speed < 0.0 or (speed == 0.0 and turn < 0.0):
            return 0.0
        # gap >= speed tau + turn tau^2/2 - three tau^3/6
        three = max(three / 6.0, 1e-300)
        tau = (0.5 * turn + math.sqrt(0.25 * turn * turn + 4.0 * speed * three)) / (2.0 * three)
        tau = max(tau, _ON_KINK * h)
        if tau >= h:
            return 2.0 * h
        _, w, a = state(outputs, lane, tau)
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
        _, w, a = state(outputs, lane, tau)
        gap, speed = sign * (w - edge), sign * a
    return tau


@compiled
def crossing(outputs, lane, low, high, tiny):
    """(size of the step, what) up to the first of two edges that w leaves (low, high) by."""
    h, w, way = outputs[SIZE, lane], outputs[WS, lane], outputs[WAY, lane]
    size, what = h, SearchEnd.TIME
    if way == 0.0:
        return size, what
    if w - low <= way:
        found = _first(outputs, lane, h, low, 1.0, tiny)
        if found <= size:
            size, what = found, SearchEnd.HIT_LOW
    if high - w <= way:
        found = _first(outputs, lane, h, high, -1.0, tiny)
        if found <= size:
            size, what = found, SearchEnd.HIT_HIGH
    return size, what


@compiled
def passes(outputs, h, level):
    """When w of one system passes ``level`` within h, known to lie on its other side then."""
    before, after = 0.0, h
    rises = outputs[WS, 0] < level
    tau = 0.5 * h
    for _ in range(60):
        _, w, a = state(outputs, 0, tau)
        if (w < level) == rises:
            before = tau
        else:
            after = tau
        newton = tau + (level - w) / a if a != 0.0 else before
        if abs(newton - tau) <= 1e-12 * h:
            return tau
        tau = newton if before < newton < after else 0.5 * (before + after)
    return tau
