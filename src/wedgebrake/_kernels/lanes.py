"""Several smooth motions side by side: series steps in vector lanes, one system in each.

What ``smooth.run`` does with series, for a transient: no log, no looking. The lanes are
independent; a lane's numbers depend on nothing in the others. A lane that leaves the steep
layer goes on alone, in closed form, until it is back; then all step together again.
"""

import math

import numpy as np

from .codes import COMPLETED, DIVERGED, NO_SLIDING, STEP_LIMIT
from .compiling import compiled
from .flow import BLOCKED, G2, KIND
from .flow import acceleration as linear_acceleration
from .series import ORDER, SERIES_A, SERIES_ROWS, acceleration, crossing, series_numbers, state
from .slip import HIT_HIGH, HIT_LOW, OUT_OF_PATIENCE, REACHED_END, slip
from .smooth import POLE, SERIES_SHARE, stretch_at
from .trace import traced

WIDTH = 8

# Rows of the numbers of a lane. First those of its system, as ``series_numbers`` gives them,
# then those of its state: theta, w, driving torque over the inertia and its rate, the last
# step, the longest one, how far w may go, and the tolerances of angle and velocity.
(_THETA, _W, _DRIVE, _RATE, _LAST, _LONGEST, _REACH, _TOL_THETA, _TOL_W) = range(13, 22)
_INPUTS = 22
# Rows of what a step gives: its size, the state after it, the way of w, the driving torque and
# its rate, then the series of theta and of w.
(_SIZE, _THETA1, _W1, _A1, _WAY, _DRIVE1, _RATE1, _SERIES) = range(8)
_OUTPUTS = _SERIES + 2 * (ORDER + 1)


def _step(maths, get):
    """The outputs of one step from the inputs, see above; ``get(row)`` gives an input."""
    damping, stiffness, force, slope, omega2, w_rest, kappa = (get(row) for row in range(7))
    top, gap, lever, rise, bend, lean = (get(row) for row in range(7, 13))
    theta, w = get(_THETA), get(_W)
    v = w - w_rest
    # Gain and its slope, as in ``series``.
    x = kappa * v
    e = maths.exp(-2.0 * maths.absolute(x))
    over = 1.0 / (1.0 + e)
    tanh = maths.signed((1.0 - e) * over, x)
    part = 1.0 / (gap - lever * tanh)
    gain, rate = top * tanh * part, rise * e * over * over * part * part
    lean = lean + 2.0 * bend * gain
    pressed = force + slope * v
    drag = damping + slope * gain
    drive = [get(_DRIVE), get(_RATE)]
    accel = drive[0] - damping * w - stiffness * theta - pressed * gain
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
        known = drive[n] - stiffness * thetas[n] - slope * moved
        now = (known - drag * ws[n]) - pressed * gains[n]
        change = bend * square + lean * gains[n]
        accels.append(now)
        rates.append(change)
        ws.append(now * share)
        thetas.append(ws[n] * share)
        gains.append(((turned + accel * change) + rate * now) * share)
    h = _size(maths, get, thetas, ws)
    furthest = get(_REACH) / (maths.absolute(accel) + 1e-300)
    h = maths.smaller(maths.smaller(h, get(_LONGEST)), furthest)
    theta1, w1, a1, way = thetas[ORDER], ws[ORDER], accels[ORDER - 1], maths.absolute(ws[ORDER])
    drive1, rate1 = drive[ORDER], ORDER * drive[ORDER]
    for n in range(ORDER - 1, -1, -1):
        theta1, w1 = theta1 * h + thetas[n], w1 * h + ws[n]
        drive1 = drive1 * h + drive[n]
        if n > 0:
            way = way * h + maths.absolute(ws[n])
            a1 = a1 * h + accels[n - 1]
            rate1 = rate1 * h + n * drive[n]
    return [h, theta1, w1, a1, way * h, drive1, rate1, *thetas, *ws]


def _size(maths, get, thetas, ws):
    """The step that the last two terms allow, by roots of a power of two from the last step."""
    s = get(_LAST)
    fourth = (s * s) * (s * s)
    power = fourth * fourth * fourth * (s * s) * s
    terms = []
    for n in (ORDER - 1, ORDER):
        angle, speed = maths.absolute(thetas[n]) / get(_TOL_THETA), maths.absolute(ws[n])
        term = maths.larger(angle, speed / get(_TOL_W)) * power * (s if n == ORDER else 1.0)
        root = maths.sqrt(maths.sqrt(maths.sqrt(maths.sqrt(term + 1e-290))))
        if n < ORDER:
            # The sixteenth root for the fifteenth: beyond 1 a bound of what is missing.
            root = root * (1.0 + maths.larger(root - 1.0, 0.0) * (1.0 / n))
        terms.append(root)
    return s / maths.larger(*terms)


_together = traced(_step, WIDTH)


@compiled
def step_lanes(inputs, outputs):
    """One step of all lanes."""
    _together(inputs, outputs)


@compiled
def _column(outputs, lane, work):
    """The series of a lane, as ``series`` has them."""
    for n in range(ORDER + 1):
        work[0, n] = outputs[_SERIES + n, lane]
        work[1, n] = outputs[_SERIES + ORDER + 1 + n, lane]
        if n > 0:
            work[SERIES_A, n - 1] = n * work[1, n]


@compiled
def _alone(plant, edges, row, stretch, w_diverged, inputs, lane, t, t_end, max_steps):
    """A lane through a linear stretch, in closed form: (what, t, a, steps); its w is changed."""
    inertia, _, stiffness, amplitude, omega, _ = plant
    w2, f = stiffness / inertia, amplitude / inertia
    theta, w = inputs[_THETA, lane], inputs[_W, lane]
    low = edges[stretch - 1] if stretch > 0 else -math.inf
    high = edges[stretch] if stretch < edges.size else math.inf
    if row[G2] < 0.0:
        low, high = max(low, -w_diverged), min(high, w_diverged)
    sine, cosine = math.sin(omega * t), math.cos(omega * t)
    a = linear_acceleration(row, w2, f, theta, w, sine)
    hit, t, sine, cosine, theta, w, a, spent = slip(
        row, w2, f, omega, low, high, t, t_end, sine, cosine, theta, w, a, max_steps
    )
    inputs[_THETA, lane], inputs[_W, lane] = theta, w
    inputs[_DRIVE, lane], inputs[_RATE, lane] = f * sine, f * omega * cosine
    return hit, t, a, spent


@compiled
def _stepped(plants, lane, low, high, outputs, tiny, stalled, work, inputs, t):
    """A lane after a step in lanes, cut at a kink: (what, size, a); its state is changed.

    size : negative where the step was below ``tiny``
    """
    h, w, way = outputs[_SIZE, lane], inputs[_W, lane], outputs[_WAY, lane]
    if not h >= min(tiny, inputs[_LONGEST, lane]) or h == 0.0:
        return REACHED_END, -1.0, 0.0
    size, hit = h, REACHED_END
    if w - low <= way or high - w <= way:
        _column(outputs, lane, work)
        size, hit = crossing(work, h, way, low, high, tiny)
    if hit == REACHED_END or (stalled and size <= tiny):
        inputs[_THETA, lane], inputs[_W, lane] = outputs[_THETA1, lane], outputs[_W1, lane]
        inputs[_DRIVE, lane], inputs[_RATE, lane] = outputs[_DRIVE1, lane], outputs[_RATE1, lane]
        inputs[_LAST, lane] = max(h, 1e-3 * inputs[_LAST, lane])
        return REACHED_END, h, outputs[_A1, lane]
    inputs[_W, lane] = low if hit == HIT_LOW else high
    if size <= tiny:
        return hit, 0.0, work[SERIES_A, 0]
    theta, _, a, _ = state(work, size)
    inputs[_THETA, lane] = theta
    f, omega = plants[lane, 3] / plants[lane, 0], plants[lane, 4]
    inputs[_DRIVE, lane] = f * math.sin(omega * (t + size))
    inputs[_RATE, lane] = f * omega * math.cos(omega * (t + size))
    return hit, size, a


@compiled
def _begin(plant, law, edges, h_max, state_, inputs, lane):
    """Load a system and its state at the phase 0 into a lane: the stretch that it is in."""
    series_numbers(plant, law, inputs[:, lane])
    inputs[_THETA, lane], inputs[_W, lane] = state_[0], state_[1]
    f, omega, w2 = plant[3] / plant[0], plant[4], plant[2] / plant[0]
    inputs[_DRIVE, lane], inputs[_RATE, lane] = 0.0, f * omega
    inputs[_LAST, lane] = 1e-2 * h_max
    side = 1.0 if state_[1] >= plant[5] else -1.0
    a = acceleration(plant, law, side, 0.0, state_[0], state_[1])
    rising = a > 0.0 or (a == 0.0 and f * omega > w2 * state_[1])
    return stretch_at(edges, state_[1], rising)


@compiled
def run(
    plants, laws, edges, kinks, linear, table, bands, w_diverged, tolerances, h_max, states,
    max_steps, points, outcomes, done, steps,
):  # fmt: skip
    """Advance WIDTH systems, each as many periods as ``points`` has room for.

    plants (WIDTH, 6), laws (WIDTH, 8), edges (WIDTH, n - 1), kinks (WIDTH, n, 2),
    linear (WIDTH, n), table (WIDTH, n, flow.COLUMNS), bands, w_diverged, h_max (WIDTH,),
    tolerances (WIDTH, 3): as for ``smooth.run``; edges that a system lacks are inf
    states   : (WIDTH, 2) at the phase 0, receives those at the end
    points   : (WIDTH, periods + 1, 2) receives the states at the beginnings of the periods
    outcomes, done, steps : (WIDTH,) receive the codes, completed periods, steps
    """
    inputs, outputs = np.zeros((_INPUTS, WIDTH)), np.zeros((_OUTPUTS, WIDTH))
    work = np.empty((SERIES_ROWS, ORDER + 1))
    t, stretch, going = np.zeros(WIDTH), np.zeros(WIDTH, np.int64), np.ones(WIDTH, np.bool_)
    stalled = np.zeros(WIDTH, np.bool_)
    count = points.shape[1] - 1
    for lane in range(WIDTH):
        stretch[lane] = _begin(
            plants[lane], laws[lane], edges[lane], h_max[lane], states[lane], inputs, lane
        )  # fmt: skip
        points[lane, 0, 0], points[lane, 0, 1] = states[lane, 0], states[lane, 1]
        outcomes[lane], done[lane], steps[lane] = COMPLETED, 0, 0
    together = WIDTH
    while together > 0:
        together = 0
        for lane in range(WIDTH):
            # By numbers, not by slices, which cost more than what is done with them.
            rest, length = plants[lane, 5], 2.0 * math.pi / plants[lane, 4]
            tiny = 1e-15 * length
            # What came of the step in lanes, and then alone until the next one.
            fresh = steps[lane] > 0 and going[lane]
            while going[lane]:
                here = stretch[lane]
                t0 = t[lane]
                hit, a = REACHED_END, 0.0
                if not linear[lane, here]:
                    if not fresh:
                        break
                    hit, size, a = _stepped(
                        plants, lane, kinks[lane, here, 0], kinks[lane, here, 1], outputs, tiny,
                        stalled[lane], work, inputs, t0,
                    )  # fmt: skip
                    stalled[lane] = size == 0.0
                    if size < 0.0:
                        outcomes[lane], going[lane] = STEP_LIMIT, False
                        break
                    t[lane] = length if length - t0 - size <= 4e-16 * length else t0 + size
                else:
                    row = table[lane, here]
                    if row[KIND] == BLOCKED:
                        outcomes[lane], going[lane] = NO_SLIDING, False
                        break
                    hit, t[lane], a, spent = _alone(
                        plants[lane], edges[lane], row, here, w_diverged[lane], inputs, lane, t0,
                        length, max_steps - steps[lane],
                    )  # fmt: skip
                    steps[lane] += spent
                fresh = False
                w = inputs[_W, lane]
                if hit == OUT_OF_PATIENCE or steps[lane] > max_steps:
                    outcomes[lane], going[lane] = STEP_LIMIT, False
                elif not math.isfinite(w) or abs(w - rest) >= w_diverged[lane]:
                    outcomes[lane], going[lane] = DIVERGED, False
                elif hit != REACHED_END:
                    stretch[lane] = stretch_at(edges[lane], w, hit == HIT_HIGH)
                elif not linear[lane, here]:
                    inside = here == 0 or w > edges[lane, here - 1]
                    if not (inside and (here == edges.shape[1] or w < edges[lane, here])):
                        stretch[lane] = stretch_at(edges[lane], w, a > 0.0)
                if going[lane] and t[lane] >= length:
                    done[lane] += 1
                    t[lane], inputs[_DRIVE, lane] = 0.0, 0.0
                    inputs[_RATE, lane] = plants[lane, 3] / plants[lane, 0] * plants[lane, 4]
                    points[lane, done[lane], 0] = inputs[_THETA, lane]
                    points[lane, done[lane], 1] = w
                    going[lane] = done[lane] < count
            if going[lane]:
                w, here = inputs[_W, lane], stretch[lane]
                side = 1.0 if kinks[lane, here, 0] >= rest else -1.0
                inputs[3, lane] = side * laws[lane, 7] / plants[lane, 0]
                inputs[_LONGEST, lane] = min(h_max[lane], length - t[lane])
                inputs[_REACH, lane] = SERIES_SHARE * (abs(w - rest) + POLE * bands[lane])
                rtol, size = tolerances[lane, 0], abs(inputs[_THETA, lane])
                inputs[_TOL_THETA, lane] = rtol * (tolerances[lane, 1] + size)
                inputs[_TOL_W, lane] = rtol * (tolerances[lane, 2] + abs(w))
                steps[lane] += 1
                together += 1
        if together > 0:
            step_lanes(inputs, outputs)
    for lane in range(WIDTH):
        states[lane, 0], states[lane, 1] = inputs[_THETA, lane], inputs[_W, lane]
