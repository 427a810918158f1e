"""Cells of Taylor series, linear quantities on them, and the first zero of such a quantity.

A series is an array of Taylor coefficients. A row contains the factors of the states, the inputs
and 1 in a linear quantity. The number of terms is a multiple of four, so that a polynomial is
evaluated as four independent ones; loops over all ``TERMS``, without those that are not used, are
unrolled.
"""

import math

import numpy as np

from wedgebrake.dynamics.jit import borrowing, embedded
from wedgebrake.dynamics.signals import TERMS

# Share of its change in a cell below which a value that has just been zero is zero.
_FRESH = 1e-7
_FEWEST = 6  # so that products of two tables are exact
# Terms that a series needs to reach rounding, by 16 times the product of cell and growth: the
# largest term left out, product^n/n!, is below 1e-18.
_NEEDED = np.array(
    [_FEWEST] + [
        next(
            n for n in range(_FEWEST, 200)
            if n * math.log(q / 16) - math.lgamma(n + 1) < math.log(1e-18)
        )
        for q in range(1, 33)
    ]
)  # fmt: skip


SHARES = 1.0 / np.arange(1, TERMS)
# Factors of the coefficients in the third derivative.
_THIRD = np.array([k * (k - 1.0) * (k - 2.0) for k in range(TERMS)])


@borrowing
def terms_for(product):
    """Number of terms for a cell, from its length times the growth of the series, at most 2."""
    place = math.ceil(16.0 * product - 1e-9)
    return min((_NEEDED[min(max(place, 0), 32)] + 4) // 4 * 4, TERMS)


@embedded
def expand_states(rates, lead, z, terms):
    """Store the Taylor coefficients of the states in z[:, 1:terms], from z[:, 0] and the inputs.

    lead : (n,) inertia whose speed an inertia shares, see ``Systems``
    """
    half = lead.size
    add_inputs(rates, half, z)
    if rates.shape[0] == 2:
        _expand_one_inertia(rates, z, terms)
        return
    if rates.shape[0] == 4 and half == 2:
        _expand_two_inertias(rates, lead, z, terms)
        return
    if not _has_feedback(rates, half):
        _integrate_inputs(rates.shape[0], half, z, terms)
        return
    for k in range(terms - 1):
        next_coefficient(rates, lead, z, k)


@embedded
def add_inputs(rates, half, z):
    """Store the contributions of the inputs to the rates, for ``next_coefficient``.

    The last input is constant.
    """
    states, last = rates.shape[0], rates.shape[1] - 1
    for i in range(half, states):
        for k in range(2, TERMS):
            z[i, k] = 0.0
        z[i, 1] = rates[i, last] * z[last, 0]
        for j in range(states, last):
            factor = rates[i, j]
            if factor != 0.0:
                for k in range(TERMS - 1):
                    z[i, k + 1] += factor * z[j, k]


@embedded
def _expand_one_inertia(rates, z, terms):
    """``expand_states`` after ``add_inputs`` for two states, which stay in registers."""
    by_angle, by_speed = rates[1, 0], rates[1, 1]
    angle, speed = z[0, 0], z[1, 0]
    for k in range(terms - 1):
        share = SHARES[k]
        others = share * z[1, k + 1] + (share * by_angle) * angle
        angle = share * speed
        speed = others + (share * by_speed) * speed
        z[0, k + 1], z[1, k + 1] = angle, speed


@embedded
def _expand_two_inertias(rates, lead, z, terms):
    """``expand_states`` after ``add_inputs`` for four states, as ``_expand_one_inertia``."""
    by_a, by_b, va, vb = rates[2], rates[3], z[2, 0], z[3, 0]
    a, b, joined = z[0, 0], z[1, 0], lead[0] == lead[1]
    for k in range(terms - 1):
        share = SHARES[k]
        # The last speeds last: the sums need not wait for them.
        one = (z[2, k + 1] + by_a[0] * a + by_a[1] * b) + by_a[2] * va + by_a[3] * vb
        two = (z[3, k + 1] + by_b[0] * a + by_b[1] * b) + by_b[2] * va + by_b[3] * vb
        a, b = share * va, share * vb
        va = share * one
        vb = va if joined else share * two
        z[0, k + 1], z[1, k + 1], z[2, k + 1], z[3, k + 1] = a, b, va, vb


@embedded
def _has_feedback(rates, half):
    """Return True if the rate of a speed or an actuator depends on a state."""
    for i in range(half, rates.shape[0]):
        for j in range(rates.shape[0]):
            if rates[i, j] != 0.0:
                return True
    return False


@embedded
def _integrate_inputs(states, half, z, terms):
    """``expand_states`` after ``add_inputs`` where no rate depends on a state."""
    for i in range(half, states):
        for k in range(terms - 1):
            z[i, k + 1] *= SHARES[k]
    for i in range(half):
        for k in range(terms - 1):
            z[i, k + 1] = SHARES[k] * z[half + i, k]


@embedded
def next_coefficient(rates, lead, z, k):
    """Store the Taylor coefficients of the states in z[:, k + 1], from z[:, k].

    In the rows of speeds and actuators, z[:, k + 1] must contain the contribution of the inputs.
    Inertias that share a speed have the same coefficients, to the last bit.
    """
    share, states, half = SHARES[k], rates.shape[0], lead.size
    rows, series = rates[half:], z[half:states]
    whole = rows.shape[0] // 4
    for number in range(whole):  # four rows at a time, as each sum waits for its last addition
        i = 4 * number
        one, two, three, four = rows[i], rows[i + 1], rows[i + 2], rows[i + 3]
        a, b = series[i, k + 1], series[i + 1, k + 1]
        c, d = series[i + 2, k + 1], series[i + 3, k + 1]
        for j in range(states):
            now = z[j, k]
            a += one[j] * now
            b += two[j] * now
            c += three[j] * now
            d += four[j] * now
        series[i, k + 1], series[i + 1, k + 1] = a * share, b * share
        series[i + 2, k + 1], series[i + 3, k + 1] = c * share, d * share
    for i in range(4 * whole, rows.shape[0]):
        total, row = series[i, k + 1], rows[i]
        for j in range(states):
            total += row[j] * z[j, k]
        series[i, k + 1] = total * share
    i = 0
    while i < half:  # a range would be compiled for the case of many inertias
        series[i, k + 1] = series[lead[i], k + 1]
        z[i, k + 1] = series[i, k] * share
        i += 1


@embedded
def combine(row, z, result):
    """Store the series of a row; returns the sum of the magnitudes of the terms of its value."""
    last = row.size - 1
    for k in range(1, TERMS):
        result[k] = 0.0
    result[0] = row[last] * z[last, 0]
    scale = abs(result[0])
    for j in range(last):
        factor = row[j]
        if factor != 0.0:
            scale += abs(factor * z[j, 0])
            for k in range(TERMS):
                result[k] += factor * z[j, k]
    return scale


@borrowing
def value(row, z):
    """Value of a row at the beginning of a cell."""
    total = 0.0
    for j in range(row.size):
        if row[j] != 0.0:
            total += row[j] * z[j, 0]
    return total


@borrowing
def size(row, z):
    """Sum of the magnitudes of the terms in the value of a row."""
    total = 0.0
    for j in range(row.size):
        total += abs(row[j] * z[j, 0])
    return total


@embedded
def polynomial(series, terms, tau):
    """Value of a series at tau."""
    square = tau * tau
    fourth = square * square
    a, b, c, d = 0.0, 0.0, 0.0, 0.0
    for k in range(TERMS - 4, -1, -4):
        if k < terms:
            a = a * fourth + series[k]
            b = b * fourth + series[k + 1]
            c = c * fourth + series[k + 2]
            d = d * fourth + series[k + 3]
    return (a + b * tau) + (c + d * tau) * square


@embedded
def advance_states(z, states, terms, tau):
    """Advance the states z[:, 0] by tau."""
    for i in range(states):
        z[i, 0] = polynomial(z[i], terms, tau)


@borrowing
def largest_change(g, terms, h):
    """Bound of the change of a series on [0, h]: the sum of the magnitudes of its terms."""
    square = h * h
    fourth = square * square
    a, b, c, d = 0.0, 0.0, 0.0, 0.0
    for k in range(TERMS - 4, 0, -4):
        if k < terms:
            a = a * fourth + abs(g[k])
            b = b * fourth + abs(g[k + 1])
            c = c * fourth + abs(g[k + 2])
            d = d * fourth + abs(g[k + 3])
    a, b, c, d = a * fourth, b * fourth + abs(g[1]), c * fourth + abs(g[2]), d * fourth + abs(g[3])
    return (a + b * h) + (c + d * h) * square


@embedded
def _third(g, terms, h):
    """Bound of the third derivative on [0, h] of the terms of fourth and higher order."""
    square = h * h
    fourth = square * square
    a, b, c, d = 0.0, 0.0, 0.0, 0.0
    for k in range(TERMS - 4, 0, -4):
        if k < terms:
            a = a * fourth + _THIRD[k] * abs(g[k])
            b = b * fourth + _THIRD[k + 1] * abs(g[k + 1])
            c = c * fourth + _THIRD[k + 2] * abs(g[k + 2])
            d = d * fourth + _THIRD[k + 3] * abs(g[k + 3])
    return ((a + b * h) + (c + d * h) * square) * h


@borrowing
def first_zero(g, terms, h, tolerance, fresh):
    """First zero of the polynomial g in [0, h]; inf: there is none.

    A bound of the third derivative excludes a zero within each step. The steps converge to a simple
    zero from the left, at least as fast as Newton's method.

    tolerance : magnitude up to which the initial value is rounding error
    fresh     : True if g has just been zero, so that a small initial value counts as zero
    """
    change = largest_change(g, terms, h)
    small = tolerance + (_FRESH * change if fresh else 0.0)
    zero = abs(g[0]) <= small or (fresh and change == 0.0 and h > 0.0)
    offset = g[0] if zero else 0.0
    start = g[0] - offset
    if start > change:
        return math.inf
    others = _third(g, terms, h)
    # Lower bound of the third derivative, with the opposite sign.
    third = max(others - 6.0 * g[3], 0.0)
    tau = 0.0
    if zero:
        tau = _first_step(g[1], g[2], third / 6.0, h)
        if tau < 0.0 or tau >= h:
            return 0.0 if tau < 0.0 else math.inf
    elif start <= 0.0:
        return 0.0
    tick, largest, third = 1e-16 * h, others + 6.0 * abs(g[3]), third / 3.0
    u, du, ddu = start, g[1], 2.0 * g[2]
    for _ in range(400):
        if tau > 0.0:
            u, du, ddu = _derivatives(g, terms, tau)
            u -= offset
        if u <= 0.0:
            return tau
        remaining = h - tau
        # Over a part of the remainder, up to twice the zero of the tangent, the bound is smaller.
        part = remaining if du >= 0.0 else min(remaining, -2.0 * u / du)
        d = min(_safe_step(u, du, third * part - ddu, part), part)
        if du >= 0.0 and d < part:
            d = max(d, min(_safe_step(u, du, third * 2.0 * d - ddu, remaining), 2.0 * d))
        if d >= remaining:
            return math.inf
        tau += d
        # After the step, g is at most largest d^3/2.
        if d <= tick or (d < part and largest * d * d * d <= tick * abs(du + ddu * d)):
            return tau
    return tau


@borrowing
def zero_before(g, terms, tau):
    """The simple zero of a polynomial just before tau, where it is negative by rounding only.

    tau itself if there is none.
    """
    at = tau
    for _ in range(3):
        u, du, _ = _derivatives(g, terms, at)
        if du >= 0.0:
            return tau
        at -= u / du
        if not 0.0 <= at <= tau:
            return tau
    return at


@embedded
def _derivatives(g, terms, tau):
    """Value, first and second derivative of a polynomial.

    Every fourth term is a polynomial of tau^4: a, b, c and d, with their first derivatives and half
    their second ones, by Horner's rule.
    """
    square = tau * tau
    fourth = square * square
    a, b, c, d = 0.0, 0.0, 0.0, 0.0
    a1, b1, c1, d1 = 0.0, 0.0, 0.0, 0.0
    a2, b2, c2, d2 = 0.0, 0.0, 0.0, 0.0
    for k in range(TERMS - 4, -1, -4):
        if k < terms:
            a2, b2 = a2 * fourth + a1, b2 * fourth + b1
            c2, d2 = c2 * fourth + c1, d2 * fourth + d1
            a1, b1 = a1 * fourth + a, b1 * fourth + b
            c1, d1 = c1 * fourth + c, d1 * fourth + d
            a, b = a * fourth + g[k], b * fourth + g[k + 1]
            c, d = c * fourth + g[k + 2], d * fourth + g[k + 3]
    cube = square * tau
    change = (a1 + b1 * tau) + (c1 + d1 * tau) * square
    first = (b + 2.0 * tau * c) + 3.0 * square * d + 4.0 * cube * change
    second = (12.0 * a1 + 20.0 * tau * b1) + (28.0 * c1 + 36.0 * tau * d1) * square
    second += 32.0 * fourth * ((a2 + b2 * tau) + (c2 + d2 * tau) * square)
    return (a + b * tau) + (c + d * tau) * square, first, 2.0 * c + 6.0 * tau * d + second * square


@embedded
def _first_step(slope, curve, third, h):
    """Step within which a polynomial that begins at zero is positive; negative if there is none.

    At least 1e-9 h: zeros nearer to the first one count as one with it.

    g = tau (slope + curve tau + ...), and slope + curve d - third d^2 > 0 excludes a zero of the
    bracket.
    """
    if slope < 0.0 or (slope == 0.0 and curve < 0.0):
        return -1.0
    if third == 0.0:
        step = h if curve >= 0.0 else min(h, -slope / curve)
    else:
        step = (curve + math.sqrt(curve * curve + 4.0 * third * slope)) / (2.0 * third)
    return max(step, 1e-9 * h)


@embedded
def _safe_step(u, du, bound, remaining):
    """Step within which u + du d - bound d^2/2 stays positive; ``remaining`` or inf: always."""
    if bound == 0.0:
        return remaining if du >= 0.0 else -u / du
    square = du * du + 2.0 * bound * u
    if square < 0.0 or (bound < 0.0 and du >= 0.0):
        return remaining
    root = math.sqrt(square)
    return (du + root) / bound if du >= 0.0 else 2.0 * u / (root - du)
