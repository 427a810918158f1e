"""Cells of Taylor series, linear quantities on them, and the first zero of such a quantity."""

import math

import numpy as np

from wedgebrake.dynamics.jit import borrowing, inlined
from wedgebrake.solvers.machine.problem import TERMS

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


@borrowing
def terms_for(product):
    """Number of terms for a cell, from its length times the growth of the series, at most 2."""
    place = math.ceil(16.0 * product - 1e-9)
    return min(_NEEDED[min(max(place, 0), 32)] + 1, TERMS)


@borrowing
def expand_states(rates, half, states, z, terms):
    """Store the Taylor coefficients of the states in z[1:terms], from z[0] and the inputs."""
    for k in range(terms - 1):
        next_coefficient(rates, half, states, z, k)


@inlined
def next_coefficient(rates, half, states, z, k):
    """Store the Taylor coefficients of the states in z[k + 1], from z[k]."""
    share = 1.0 / (k + 1.0)
    for i in range(half):
        z[k + 1, i] = z[k, half + i] * share
    for i in range(half, states):
        total = 0.0
        for j in range(z.shape[1]):
            total += rates[i, j] * z[k, j]
        z[k + 1, i] = total * share


@borrowing
def combine(row, z, terms, result):
    """Store the series of a row; returns the sum of the sizes of what its value is made of."""
    scale = 0.0
    for k in range(terms):
        result[k] = 0.0
    for j in range(row.size):
        factor = row[j]
        if factor != 0.0:
            scale += abs(factor * z[0, j])
            for k in range(terms):
                result[k] += factor * z[k, j]
    return scale


@borrowing
def value(row, z):
    """Value of a row at the beginning of a cell."""
    total = 0.0
    for j in range(row.size):
        if row[j] != 0.0:
            total += row[j] * z[0, j]
    return total


@borrowing
def size(row, z):
    """Sum of the sizes of what the value of a row is made of."""
    total = 0.0
    for j in range(row.size):
        total += abs(row[j] * z[0, j])
    return total


@inlined
def polynomial(coefficients, terms, tau):
    """Value of a series at tau."""
    total = 0.0
    for k in range(terms - 1, -1, -1):
        total = total * tau + coefficients[k]
    return total


@borrowing
def advance_states(z, states, terms, tau):
    """Advance the states z[0] by tau."""
    for i in range(states):
        z[0, i] = polynomial(z[:, i], terms, tau)


@borrowing
def first_zero(g, terms, h, room, fresh, flat):
    """First zero of the polynomial g in [0, h]; inf: there is none.

    Each step is one within which a bound of the second derivative excludes a zero (Newton's step
    from the safe side).

    room  : size of an initial value that is rounding error
    fresh : True if g has just been zero, so that a small initial value is zero
    flat  : True if the same holds for its derivative
    """
    reach = 0.0
    for k in range(terms - 1, 0, -1):
        reach = (reach + abs(g[k])) * h
    small = room + (_FRESH * reach if fresh else 0.0)
    zero = abs(g[0]) <= small or (fresh and reach == 0.0 and h > 0.0)
    offset = g[0] if zero else 0.0
    start = g[0] - offset
    if start > reach:
        return math.inf
    third = 0.0
    for k in range(terms - 1, 2, -1):
        third = third * h + k * (k - 1.0) * (k - 2.0) * abs(g[k])
    tau = 0.0
    if zero:
        tau = _first_step(0.0 if flat else g[1], g[2], third / 6.0, h)
        if tau < 0.0 or tau >= h:
            return 0.0 if tau < 0.0 else math.inf
    elif start <= 0.0:
        return 0.0
    tick = 1e-16 * h
    for _ in range(400):
        u, du, ddu = _derivatives(g, terms, tau)
        u -= offset
        if u <= 0.0:
            return tau
        rest = h - tau
        bound = max(-ddu, 0.0) + third * rest
        d = _safe_step(u, du, bound, rest)
        if d >= rest:
            return math.inf
        # A tighter bound within twice the step, as the third derivative acts there alone.
        longer = _safe_step(u, du, max(-ddu, 0.0) + third * 2.0 * d, rest)
        d = max(d, min(longer, 2.0 * d))
        if d >= rest:
            return math.inf
        tau += d
        if d <= tick:
            return tau
    return tau


@inlined
def _derivatives(g, terms, tau):
    """Value, first and second derivative of a polynomial."""
    u, du, ddu = 0.0, 0.0, 0.0
    for k in range(terms - 1, -1, -1):
        ddu = ddu * tau + du
        du = du * tau + u
        u = u * tau + g[k]
    return u, du, 2.0 * ddu


@inlined
def _first_step(slope, curve, third, h):
    """Step within which a polynomial that begins at zero is positive; negative: it is not.

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


@inlined
def _safe_step(u, du, bound, rest):
    """Step within which u + du d - bound d^2/2 stays positive."""
    if bound == 0.0:
        return rest if du >= 0.0 else -u / du
    root = math.sqrt(du * du + 2.0 * bound * u)
    return (du + root) / bound if du >= 0.0 else 2.0 * u / (root - du)
