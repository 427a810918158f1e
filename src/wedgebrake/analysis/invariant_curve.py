"""Evidence that returns fill an invariant curve, as those of quasi-periodic motion do.

The conditions and their limits are explained in docs/numerics.md, "Tori and slow transients".
"""

import math

import numpy as np

from wedgebrake.dynamics.jit import compiled

# The inscribed polygon of all points is at most this much longer than those of their halves. On a
# curve the ratio tends to 1; it tends to 2 where the points are not a function of the phase.
_LONGER = 1.1
# Least difference of the rotation number from a fraction p/q, in units of its error, and as a
# multiple of 1/(m q^2) after m returns.
_CERTAIN, _AWAY = 5.0, 10.0
# Orbits of more returns are excluded only as far as returns have passed this share of the way
# from one point to the next.
_LONG, _PASSED = 1000, 0.2


@compiled
def average(values):
    """Weighted Birkhoff average of values at successive returns.

    For quasi-periodic motion it converges faster than any power of their number: S. Das, Y. Saiki,
    E. Sander and J. A. Yorke, Nonlinearity 30 (2017), 4111-4140.
    """
    total, weights = 0.0, 0.0
    for k in range(1, values.size):
        x = k / values.size
        bump = math.exp(-1.0 / (x * (1.0 - x)))
        total += bump * values[k]
        weights += bump
    return total / weights


@compiled
def _angles(points, scale):
    """(m + 1,) angles of the points about their mean [turns].

    In the plane of the two coordinates with the largest ranges.
    """
    first, second, largest, next_largest = 0, 0, -1.0, -1.0
    for k in range(scale.size):
        wide = scale[k] * (points[:, k].max() - points[:, k].min())
        if wide > largest:
            first, second, largest, next_largest = k, first, wide, largest
        elif wide > next_largest:
            second, next_largest = k, wide
    x, y = scale[first] * points[:, first], scale[second] * points[:, second]
    return np.arctan2(y - y.mean(), x - x.mean()) / (2.0 * math.pi)


@compiled
def rotation_number(points, scale):
    """(rho, error): mean rotation about the mean of the points in a return [turns].

    The error is estimated from the values over both halves and over all returns.
    """
    turns = np.diff(_angles(points, scale))
    turns -= np.floor(turns)
    half = turns.size // 2
    early, late, whole = average(turns[:half]), average(turns[half : 2 * half]), average(turns)
    return whole, max(abs(late - early), abs(whole - 0.5 * (early + late)))


@compiled
def _excludes_orbits(rho, error, returns):
    """Return True if a rotation number excludes orbits of q returns as far as the returns show.

    A motion on a curve that contains an orbit of q returns never passes from one of its points to
    the next one. The motion has passed if returns |q rho - p| > 1. The smallest q for which it
    has not must be excluded by the value of rho.
    """
    for q in range(1, returns + 1):
        apart = abs(rho - math.floor(q * rho + 0.5) / q)
        passed = returns * q * apart
        if passed < 1.0:
            if q >= _LONG:
                return passed >= _PASSED
            return apart >= _CERTAIN * error and passed * q >= _AWAY
    return False


@compiled
def _length(points, scale, order, begin, end):
    """Length of the closed polygon through the points begin, ..., end - 1 in a given order."""
    first, last, total = -1, -1, 0.0
    for place in range(order.size + 1):
        this = order[place] if place < order.size else first
        if not begin <= this < end:
            continue
        square = 0.0
        for k in range(scale.size if last >= 0 else 0):
            square += (scale[k] * (points[this, k] - points[last, k])) ** 2
        total += math.sqrt(square)
        last = this
        if first < 0:
            first = this
    return total


@compiled
def fills_curve(points, scale):
    """Return True if returns show that the motion fills an invariant curve.

    points : (m + 1, n) successive returns;  scale : (n,) as in ``Window``
    """
    returns, half = points.shape[0] - 1, points.shape[0] // 2
    rho, error = rotation_number(points, scale)
    if not _excludes_orbits(rho, error, returns):
        return False
    phase = rho * np.arange(2 * half)
    order = np.argsort(phase - np.floor(phase))
    early = _length(points, scale, order, 0, half)
    late = _length(points, scale, order, half, 2 * half)
    return _length(points, scale, order, 0, 2 * half) <= 0.5 * _LONGER * (early + late)
