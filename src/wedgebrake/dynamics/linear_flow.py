"""Closed-form motion of one linear piece (docs/theory.md, section 5; eqs. 1 and 8 to 12).

Inside a piece the brake torque is ``offset + slope * w`` and the driveline obeys

    theta'' + g2 theta' + w2 theta = f sin(omega t) + q
    g2 = (c + slope)/J,  w2 = k/J,  f = T_e/J,  q = -offset/J

Three ways to write its solution are kept, each where it loses no digits:

UNDERDAMPED, OVERDAMPED   forced part plus homogeneous part, the fast ones
CONFLUENT                 response from the entry state by divided differences of exp over
                          the roots and i*omega: critical damping, resonance and a free
                          driveline (k = 0) are then no special cases
BLOCKED                   no sliding is possible in this piece (self-locking)
"""

import cmath
import math

import numpy as np
from numpy.typing import NDArray

from wedgebrake.dynamics.jit import compiled

UNDERDAMPED, OVERDAMPED, CONFLUENT, BLOCKED = 0, 1, 2, 3

# Columns of the table of piece constants.
(
    KIND,  # one of the four above
    G2,  # (c + slope)/J [1/s]
    Q,  # constant acceleration -offset/J [rad/s^2]
    RATE1,  # underdamped: decay rate g2/2; overdamped: slow root [1/s]
    RATE2,  # underdamped: damped frequency; overdamped: fast root [1/s]
    FORCED_SIN,  # forced angle = FORCED_SIN sin + FORCED_COS cos + CENTRE [rad]
    FORCED_COS,
    CENTRE,
    CELL,  # longest search step [s]
    NOISE,  # rounding of an acceleration in equilibrium [rad/s^2]
) = range(10)
COLUMNS = 10

# A forced part further than this from resonance (relative to omega), a spring stiffer than
# this (relative to the forcing, as a ratio of squared frequencies) and roots further apart
# than this (relative to g2/2) cost at most three digits of the forced-plus-homogeneous form.
_RESONANCE_MARGIN = 1e-2
_STIFFNESS_MARGIN = 1e-4
_ROOT_MARGIN = 0.1


@compiled
def prepare(inertia, damping, stiffness, amplitude, omega, slopes, offsets, table):
    """Fill ``table`` (pieces, COLUMNS) with the constants of each piece."""
    w2 = stiffness / inertia
    f = amplitude / inertia
    for piece in range(slopes.size):
        row = table[piece]
        row[:] = 0.0
        if math.isinf(offsets[piece]):
            row[KIND] = BLOCKED
            continue
        g2 = (damping + slopes[piece]) / inertia
        q = -offsets[piece] / inertia
        decay = 0.5 * g2
        split = decay * decay - w2
        row[G2] = g2
        row[Q] = q
        row[NOISE] = 1e-15 * (f + abs(q))
        fastest = max(math.sqrt(w2), omega)
        row[CELL] = 3.0 / max(fastest, -3.0 * g2)
        detuning = w2 - omega * omega
        row[KIND] = CONFLUENT
        spring_ok = w2 > _STIFFNESS_MARGIN * omega * omega
        if split < 0.0:
            damped = math.sqrt(-split)
            if spring_ok and math.hypot(decay, damped - omega) > _RESONANCE_MARGIN * omega:
                row[KIND] = UNDERDAMPED
                row[RATE1] = decay
                row[RATE2] = damped
        elif math.sqrt(split) > _ROOT_MARGIN * abs(decay) and spring_ok:
            far = -decay - math.copysign(math.sqrt(split), decay)
            near = w2 / far
            if abs(near) > 1e-3 * omega:
                row[KIND] = OVERDAMPED
                row[RATE1] = near
                row[RATE2] = far
        if row[KIND] != CONFLUENT:
            gain = f / (detuning * detuning + g2 * g2 * omega * omega)
            row[FORCED_SIN] = gain * detuning
            row[FORCED_COS] = -gain * g2 * omega
            row[CENTRE] = q / w2


@compiled
def _phi1(z):
    """(exp(z) - 1)/z for complex z with Re z <= 0, without cancellation."""
    if abs(z.real) + abs(z.imag) < 1e-8:
        return 1.0 + 0.5 * z
    half = math.sin(0.5 * z.imag)
    real = math.expm1(z.real) * math.cos(z.imag) - 2.0 * half * half
    return complex(real, math.exp(z.real) * math.sin(z.imag)) / z


@compiled
def _exp_difference(a, b):
    """First divided difference exp[a, b], stable for near and for far nodes."""
    if a.real >= b.real:
        return cmath.exp(a) * _phi1(b - a)
    return cmath.exp(b) * _phi1(a - b)


@compiled
def _exp_difference2(a, b, c):
    """Second divided difference exp[a, b, c] of complex nodes."""
    ab, bc, ca = abs(a - b), abs(b - c), abs(c - a)
    widest = max(ab, bc, ca)
    if widest >= 1.0:
        # Divide by the widest gap: the numerator then loses at most one digit.
        if ab == widest:
            return (_exp_difference(a, c) - _exp_difference(c, b)) / (a - b)
        if bc == widest:
            return (_exp_difference(b, a) - _exp_difference(a, c)) / (b - c)
        return (_exp_difference(c, b) - _exp_difference(b, a)) / (c - a)
    # Power series about the mean node: complete symmetric polynomials over factorials.
    mean = (a + b + c) / 3.0
    a, b, c = a - mean, b - mean, c - mean
    e2 = a * b + b * c + c * a
    e3 = a * b * c
    h0, h1, h2 = complex(1.0), complex(0.0), -e2
    total = 0.5 + h2 / 24.0
    factorial = 24.0
    for n in range(3, 22):
        h0, h1, h2 = h1, h2, -e2 * h1 + e3 * h0
        factorial *= n + 2.0
        total += h2 / factorial
    return cmath.exp(mean) * total


@compiled
def _roots(g2, w2):
    """The two roots of r^2 + g2 r + w2."""
    decay = 0.5 * g2
    split = decay * decay - w2
    if split >= 0.0:
        far = -decay - math.copysign(math.sqrt(split), decay)
        return complex(far), complex(w2 / far if far != 0.0 else 0.0)
    damped = math.sqrt(-split)
    return complex(-decay, damped), complex(-decay, -damped)


@compiled
def _unit_impulse(root1, root2, tau):
    """(theta, w) of the free motion a time ``tau`` after a unit velocity, for any roots."""
    a, b = root1 * tau, root2 * tau
    theta = tau * _exp_difference(a, b).real
    # Equal to exp(root2 t) + root1 theta, which would cancel for a large root1.
    return theta, (cmath.exp(a) + root2 * theta).real


@compiled
def impulse(row, w2, tau):
    """(h, h') of the free motion of a piece a time ``tau`` after a unit velocity.

    The fundamental matrix of the piece is [[h' + g2 h, h], [-w2 h, h']].
    """
    kind = row[KIND]
    if kind == UNDERDAMPED:
        decay, damped = row[RATE1], row[RATE2]
        shrink = math.exp(-decay * tau)
        h = shrink * math.sin(damped * tau) / damped
        return h, shrink * math.cos(damped * tau) - decay * h
    if kind == OVERDAMPED:
        near, far = row[RATE1], row[RATE2]
        first, second = math.exp(near * tau), math.exp(far * tau)
        return (first - second) / (near - far), (near * first - far * second) / (near - far)
    root1, root2 = _roots(row[G2], w2)
    return _unit_impulse(root1, root2, tau)


@compiled
def _confluent(g2, q, w2, f, omega, theta0, w0, sin0, cos0, tau):
    """State after ``tau`` from the entry state, for pieces where nothing may be divided."""
    root1, root2 = _roots(g2, w2)
    a, b = root1 * tau, root2 * tau
    impulse, impulse_rate = _unit_impulse(root1, root2, tau)
    step = tau * tau * _exp_difference2(a, b, complex(0.0)).real
    forced = tau * tau * _exp_difference2(a, b, complex(0.0, omega * tau))
    forced_rate = impulse + complex(0.0, omega) * forced
    phase = complex(cos0, sin0)
    pull = q - w2 * theta0
    theta = theta0 + w0 * impulse + pull * step + f * (phase * forced).imag
    w = w0 * impulse_rate + pull * impulse + f * (phase * forced_rate).imag
    return theta, w


@compiled
def entry(row, w2, omega, theta0, w0, sin0, cos0):
    """Coefficients (y1, y2, v1, v2) of the homogeneous part that starts at (theta0, w0).

    ``sin0, cos0`` are those of the torque's phase at entry. Unused where the form is
    CONFLUENT, which starts from the entry state itself.
    """
    ps, pc = row[FORCED_SIN], row[FORCED_COS]
    y = theta0 - row[CENTRE] - (ps * sin0 + pc * cos0)
    yd = w0 - omega * (ps * cos0 - pc * sin0)
    if row[KIND] == UNDERDAMPED:
        decay, damped = row[RATE1], row[RATE2]
        return y, (yd + decay * y) / damped, yd, -(decay * yd + w2 * y) / damped
    near, far = row[RATE1], row[RATE2]
    slow, fast = (yd - far * y) / (near - far), (near * y - yd) / (near - far)
    return slow, fast, near * slow, far * fast


@compiled
def state_at(row, w2, f, omega, theta0, w0, sin0, cos0, coefficients, tau, sin1, cos1):
    """(theta, w) a time ``tau`` after entry at (theta0, w0).

    ``sin0, cos0`` are those of the torque's phase at entry, ``sin1, cos1`` at tau;
    ``coefficients`` come from ``entry``.
    """
    kind = row[KIND]
    if kind == CONFLUENT:
        return _confluent(row[G2], row[Q], w2, f, omega, theta0, w0, sin0, cos0, tau)
    y1, y2, v1, v2 = coefficients
    ps, pc = row[FORCED_SIN], row[FORCED_COS]
    if kind == UNDERDAMPED:
        shrink = math.exp(-row[RATE1] * tau)
        angle = row[RATE2] * tau
        first, second = shrink * math.cos(angle), shrink * math.sin(angle)
    else:
        first, second = math.exp(row[RATE1] * tau), math.exp(row[RATE2] * tau)
    theta = row[CENTRE] + ps * sin1 + pc * cos1 + y1 * first + y2 * second
    w = omega * (ps * cos1 - pc * sin1) + v1 * first + v2 * second
    return theta, w


@compiled
def acceleration(row, w2, f, theta, w, sine):
    """Theta'' from the equation of motion."""
    return f * sine - row[G2] * w - w2 * theta + row[Q]


@compiled
def jerk(row, w2, f, omega, w, a, cosine):
    """Theta''' from the differentiated equation of motion."""
    return f * omega * cosine - row[G2] * a - w2 * w


@compiled
def snap(row, w2, f, omega, a, j, sine):
    """Theta'''' likewise."""
    return -f * omega * omega * sine - row[G2] * j - w2 * a


def constants(
    inertia: float,
    damping: float,
    stiffness: float,
    amplitude: float,
    omega: float,
    slopes: NDArray[np.float64],
    offsets: NDArray[np.float64],
) -> NDArray[np.float64]:
    """Allocate and fill the table of piece constants, shape (pieces, COLUMNS)."""
    table = np.empty((slopes.size, COLUMNS))
    prepare(inertia, damping, stiffness, amplitude, omega, slopes, offsets, table)
    return table
