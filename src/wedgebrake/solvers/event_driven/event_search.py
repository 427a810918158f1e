"""The first event inside one linear piece, found safely and then to rounding."""

import math

from wedgebrake.dynamics.jit import compiled
from wedgebrake.dynamics.linear_flow import (
    CELL,
    G2,
    NOISE,
    acceleration,
    entry,
    jerk,
    snap,
    state_at,
)
from wedgebrake.solvers.event_driven.root_exclusion import bound, safe_step

# What ended the search.
REACHED_END, HIT_LOW, HIT_HIGH, OUT_OF_PATIENCE = 0, 1, 2, 3


@compiled
def _departs(u, u1, u2, noise):
    """Whether a state on (or, by rounding, beyond) a boundary goes out through it."""
    if u1 < -noise:
        return True
    return u1 <= noise and u2 < 0.0 and u <= 0.0


@compiled
def _is_simple(step, a, j, s_bound, rate):
    """Whether one simple root follows the safe step, near enough for a Taylor polynomial.

    Within a tenth of a radian of the fastest rate the ninth-order remainder is below
    rounding, and where the acceleration hardly changes there is no second root.
    """
    return rate * step <= 0.1 and (abs(j) + s_bound * step) * step <= 0.25 * abs(a)


@compiled
def _polish(row, w2, f, omega, target, w, a, j, s, sine, cosine, step):
    """Time and angle gained until w = target, by Newton on the ninth-order polynomial.

    ``step`` is the safe step to start from. Returns (time, angle).
    """
    g2 = row[G2]
    force = -f * omega * omega * omega
    c4 = force * cosine - g2 * s - w2 * j
    force *= omega
    c5 = -force * sine - g2 * c4 - w2 * s
    force *= omega
    c6 = -force * cosine - g2 * c5 - w2 * c4
    force *= omega
    c7 = force * sine - g2 * c6 - w2 * c5
    force *= omega
    c8 = force * cosine - g2 * c7 - w2 * c6
    p2, p3, p4, p5 = j / 2.0, s / 6.0, c4 / 24.0, c5 / 120.0
    p6, p7, p8 = c6 / 720.0, c7 / 5040.0, c8 / 40320.0
    x = step
    gap = w - target
    for _ in range(3):
        value = p4 + x * (p5 + x * (p6 + x * (p7 + x * p8)))
        value = gap + x * (a + x * (p2 + x * (p3 + x * value)))
        slope = 5.0 * p5 + x * (6.0 * p6 + x * (7.0 * p7 + x * 8.0 * p8))
        slope = a + x * (2.0 * p2 + x * (3.0 * p3 + x * (4.0 * p4 + x * slope)))
        x -= value / slope
    x = max(x, 0.0)
    angle = p4 / 5.0 + x * (p5 / 6.0 + x * (p6 / 7.0 + x * (p7 / 8.0 + x * p8 / 9.0)))
    return x, x * (w + x * (a / 2.0 + x * (p2 / 3.0 + x * (p3 / 4.0 + x * angle))))


@compiled
def _turn(sine, cosine, x):
    """Sine and cosine of a phase advanced by a small x."""
    y = x * x
    c = 1.0 - y / 2.0 * (1.0 - y / 12.0 * (1.0 - y / 30.0 * (1.0 - y / 56.0)))
    s = x * (1.0 - y / 6.0 * (1.0 - y / 20.0 * (1.0 - y / 42.0 * (1.0 - y / 72.0))))
    return sine * c + cosine * s, cosine * c - sine * s


@compiled
def slip(row, w2, f, omega, low, high, t, t_end, sine, cosine, theta, w, a, patience):
    """Move inside the piece ``row`` until ``w`` leaves (low, high) or ``t_end`` comes.

    t, t_end       time inside the period [s]
    sine, cosine   of the torque's phase omega t at entry
    theta, w, a    state and acceleration at entry; a is given, not computed, because at
                   the end of a stick it is known exactly where a difference is rounding
    patience       evaluations after which to give up, as in periods of very many vibrations

    Returns (what, t, sine, cosine, theta, w, a, evaluations). On a hit ``w`` is the
    boundary itself.
    """
    t0, sin0, cos0, theta0, w0 = t, sine, cosine, theta, w
    coefficients = entry(row, w2, omega, theta0, w0, sin0, cos0)
    cell, noise = row[CELL], row[NOISE]
    forcing = f * omega * omega * omega
    growth = max(-row[G2], 0.0)
    rate = max(3.0 / cell, abs(row[G2]))
    tick = 2.0**-52 * (t_end + 1.0 / omega)
    j = jerk(row, w2, f, omega, w, a, cosine)
    evaluations = 0
    while True:
        s = snap(row, w2, f, omega, a, j, sine)
        e = math.sqrt(s * s + w2 * j * j)
        remaining = t_end - t
        step, what = min(cell, remaining), REACHED_END
        # The boundary ahead first: its step makes the one behind a mere check.
        for look in range(2):
            if (look == 0) == (a < 0.0):
                if low > -math.inf:
                    u = w - low
                    if u <= 0.0 and _departs(u, a, j, noise):
                        return HIT_LOW, t, sine, cosine, theta, low, a, evaluations
                    d = safe_step(u, a, j, e, forcing, growth, step)
                    if d < step:
                        step, what = d, HIT_LOW
            elif high < math.inf:
                u = high - w
                if u <= 0.0 and _departs(u, -a, -j, noise):
                    return HIT_HIGH, t, sine, cosine, theta, high, a, evaluations
                d = safe_step(u, -a, -j, e, forcing, growth, step)
                if d < step:
                    step, what = d, HIT_HIGH
        if what != REACHED_END:
            if _is_simple(step, a, j, bound(e, forcing, growth, step), rate):
                boundary = low if what == HIT_LOW else high
                root, angle = _polish(row, w2, f, omega, boundary, w, a, j, s, sine, cosine, step)
                if root <= remaining:
                    theta += angle
                    t += root
                    sine, cosine = _turn(sine, cosine, omega * root)
                    a = acceleration(row, w2, f, theta, boundary, sine)
                    return what, t, sine, cosine, theta, boundary, a, evaluations
                step = remaining
            # Rounding must not stop the clock, nor a corner that the state rests in.
            step = max(step, 4.0 * tick)
            if abs(a) <= noise:
                step = max(step, 1e-7 * cell)
            step = min(step, remaining)
        t = t + step if step < remaining else t_end
        sine = math.sin(omega * t)
        cosine = math.cos(omega * t)
        theta, w = state_at(
            row, w2, f, omega, theta0, w0, sin0, cos0, coefficients, t - t0, sine, cosine
        )
        a = acceleration(row, w2, f, theta, w, sine)
        evaluations += 1
        if t >= t_end or not math.isfinite(w):
            return REACHED_END, t, sine, cosine, theta, w, a, evaluations
        if evaluations >= patience:
            return OUT_OF_PATIENCE, t, sine, cosine, theta, w, a, evaluations
        j = jerk(row, w2, f, omega, w, a, cosine)
