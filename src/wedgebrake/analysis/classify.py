"""The class of a motion, from its Poincare points and the growth of small deviations.

The classes and thresholds are explained in docs/numerics.md, "Classes of motion".
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from wedgebrake.analysis.invariant_curve import fills_curve
from wedgebrake.dynamics.enums import MotionClass
from wedgebrake.dynamics.jit import compiled

# Points repeat if they return within this share of the motion's size; a motion has settled if the
# remaining drift is smaller.
SETTLED = 1e-6
# Return distances below this share of the state, or of the motion's size, are rounding.
ROUNDING = 1e-11
# Longest detected period, in periods of the torque.
LONGEST = 512
# Fewest returns from which a period is concluded.
_RETURNS = 4
# Periods without drift that count as settled.
_LONG = 200
# Two points of an orbit may have one limit if their distance is less than this and, in two orbits,
# falls below this share of its earlier value.
_NEAR, _CLOSING = 1e-3, 0.999
# Growth of a deviation (logarithm) in chaos, more than an effect of the norm, and the number of
# standard errors that its mean must exceed.
GROWN, _ERRORS = 8.0, 3.0
_BATCHES = 8
# Largest growth of a chaotic motion itself, from one half of a window to the next, as a share of
# the growth of a deviation: half of the share 1/2 of a vibration that grows without limit.
_OF_MOTION = 0.25
# Fewest periods in which aperiodic classes are distinguished.
_FEWEST = 32
FEWEST_OF_TORUS = 200
"""Fewest periods in which a torus is distinguished from a resonance of high order."""
# Areas that change by less than this (logarithm) over the window are conserved, and lengths
# that do have not grown.
_CONSERVED = 1e-6
# Largest mean growth on a torus, in standard errors.
_SURE = 5.0
# Growth of the logarithm of a deviation in a period of the orbit that exceeds rounding.
_UNSTABLE = 1e-6


class Window(NamedTuple):
    """Part of a motion that decides its class.

    points  : (m + 1, n) Poincare points, states of any machine
    scale   : (n,) factors that turn the states into velocities; 0 for an angle that is free
    size    : half the ranges of the scaled states, added [rad/s]
    growth  : (m,) of a small deviation between returns (logarithm); nan where not known
    area    : mean growth of a small area (logarithm); -inf where the rank is lost
    resting : True if nothing slips between the last two returns
    """

    points: NDArray[np.float64]
    scale: NDArray[np.float64]
    size: float
    growth: NDArray[np.float64]
    area: float
    resting: bool


class Verdict(NamedTuple):
    """Class, order and return distance of a motion, and its growths between returns.

    largest, error, second : logarithmic growth of a deviation, its standard error, and that of
                             the deviation normal to it
    """

    motion: MotionClass
    order: int
    return_distance: float
    largest: float
    error: float
    second: float


UNKNOWN = Verdict(MotionClass.UNDECIDED, 0, math.nan, math.nan, math.nan, math.nan)


@compiled
def distance(points, i, j, scale):
    """Distance of two Poincare points [rad/s]."""
    total = 0.0
    for k in range(scale.size):
        total += (scale[k] * (points[i, k] - points[j, k])) ** 2
    return math.sqrt(total)


@compiled
def rounding_of(points, scale, size):
    """Rounding error of a distance between points [rad/s].

    A state near the origin is a sum of terms as large as the motion, with their rounding errors.
    """
    total = 0.0
    for k in range(scale.size):
        largest = 0.0
        for i in range(points.shape[0]):
            largest = max(largest, abs(points[i, k]))
        total += scale[k] * largest
    return ROUNDING * max(total, size)


@compiled
def _farthest_return(points, n, begin, end, scale):
    """Largest distance of x[k] from x[k - n], begin < k <= end."""
    worst = 0.0
    for k in range(end, begin, -1):
        worst = max(worst, distance(points, k, k - n, scale))
    return worst


@compiled
def _merging(points, n, last, scale, size):
    """(m, distance): points that repeat after n periods still approach an orbit of m periods.

    m = 0 if they do not. With a multiplier near -1 the points alternate between both sides of the
    orbit, and seem to settle on an orbit of twice the period.
    """
    for m in range(1, n // 2 + 1):
        if n % m == 0:
            now = _farthest_return(points, m, last - m, last, scale)
            before = _farthest_return(points, m, last - 2 * n - m, last - 2 * n, scale)
            if now <= _NEAR * size and now < _CLOSING * before:
                return m, now
    return 0, 0.0


@compiled
def _stays(points, n, now, scale, size):
    """Return True if the motion, which returns after n periods to within ``now``, has settled."""
    last, look = points.shape[0] - 1, max(n, _RETURNS)
    # The remaining drift as a geometric series.
    before = _farthest_return(points, n, last - 2 * look, last - look, scale)
    if now < before:
        shrink = (now / before) ** (n / look)
        if now * shrink / (1.0 - shrink) <= SETTLED * size:
            return True
    # Or there is no drift over half of a long window.
    far = n * (last // (2 * n))
    return far > _LONG and _farthest_return(points, far, last - n, last, scale) <= SETTLED * size


@compiled
def _fewest(points, n, last, scale, tolerance):
    """(m, distance): smallest divisor m of n after which it returns to within ``tolerance``.

    Near a focus the distances after one orbit shrink unevenly, so that those after several
    orbits may be the first to meet the criterion.
    """
    look = max(n, _RETURNS)
    for m in range(1, n):
        if n % m == 0:
            apart = _farthest_return(points, m, last - look, last, scale)
            if apart <= tolerance:
                return m, apart
    return n, _farthest_return(points, n, last - look, last, scale)


@compiled
def _share(length, size, rounding):
    """A length divided by the size of the motion, or by that of its state if it hardly moves."""
    return length / (size + rounding / SETTLED) if length > 0.0 else 0.0


@compiled
def order_of(points, scale, size):
    """(n, distance): the motion repeats after n periods, to within ``distance``.

    The distance is a share of the size of the motion. n = 0 if the motion does not repeat; the
    distance is then that of its closest return.
    """
    last = points.shape[0] - 1
    rounding = rounding_of(points, scale, size)
    best = math.inf
    for n in range(1, min(LONGEST, last // 3) + 1):
        look = max(n, _RETURNS)
        if last < n + 2 * look:
            break
        near = _farthest_return(points, n, last - _RETURNS, last, scale)
        best = min(best, near)
        if near > SETTLED * size + rounding:
            continue
        now = _farthest_return(points, n, last - look, last, scale)
        m, apart = _merging(points, n, last, scale, size)
        if m > 0 and apart > SETTLED * size:
            return 0, _share(apart, size, rounding)
        # Points that merge, but are as near as settled points, have one limit already.
        if m > 0 or now <= rounding or _stays(points, n, now, scale, size):
            m, apart = _fewest(points, m or n, last, scale, SETTLED * size + rounding)
            return m, _share(apart, size, rounding)
    return 0, _share(best, size, rounding)


@compiled
def mean_of(values):
    """Mean of an array."""
    total = 0.0
    for value in values:
        total += value
    return total / values.size


@compiled
def mean_growth(growth):
    """(mean, standard error) of a growth per period, the error from batches."""
    count = growth.size
    mean = mean_of(growth)
    if count < 2 * _BATCHES:
        return mean, math.inf
    share = count // _BATCHES
    spread = 0.0
    for batch in range(_BATCHES):
        spread += (mean_of(growth[batch * share : (batch + 1) * share]) - mean) ** 2
    return mean, math.sqrt(spread / (_BATCHES * (_BATCHES - 1)))


@compiled
def best_return(points, scale):
    """Number of returns after which the last points have returned most closely."""
    last = points.shape[0] - 1
    best, order = math.inf, 1
    for n in range(1, max(2, min(LONGEST, last // 4))):
        here = _farthest_return(points, n, last - 4, last, scale)
        if here < best:
            best, order = here, n
    return order


@compiled
def trend(points, order, scale):
    """Change of the mean logarithm of the distance after ``order`` returns, between both halves."""
    last = points.shape[0] - 1
    middle = (last + order) // 2
    early, late = 0.0, 0.0
    for k in range(order, last):
        logarithm = math.log(distance(points, k, k - order, scale) + 1e-300)
        if k < middle:
            early += logarithm
        else:
            late += logarithm
    return late / (last - middle) - early / (middle - order)


@compiled
def _widening(points, scale):
    """Growth of the range of the points (logarithm) from the first half to the second."""
    middle, early, late = points.shape[0] // 2, 0.0, 0.0
    for k in range(scale.size):
        first, second = points[:middle, k], points[middle:, k]
        early += scale[k] * (first.max() - first.min())
        late += scale[k] * (second.max() - second.min())
    return math.log((late + 1e-300) / (early + 1e-300))


@compiled
def _aperiodic_class(window, mean, error):
    """Class of a motion that does not repeat, from the mean growth of a deviation and its error.

    Without growths (nan) aperiodic classes are not distinguished.
    """
    points, count = window.points, window.growth.size
    if count < _FEWEST:
        return MotionClass.UNDECIDED
    if mean * count >= GROWN and mean > _ERRORS * error:
        # A vibration that grows without limit grows as fast as its deviations: from one half of
        # the window to the next by half of their growth over all of it.
        grows = _widening(points, window.scale) > _OF_MOTION * mean * count
        return MotionClass.UNDECIDED if grows else MotionClass.CHAOTIC
    if count < FEWEST_OF_TORUS or not abs(mean) * count <= 3.0 + math.log(count):
        return MotionClass.UNDECIDED
    # Deviations about a focus decay as the square root of areas: the window must be long enough to
    # show this, unless areas are conserved.
    if abs(window.area) * count > _CONSERVED and window.area * count > -4.0:
        return MotionClass.UNDECIDED
    if abs(mean) > max(_SURE * error, _CONSERVED / count) or not fills_curve(points, window.scale):
        return MotionClass.UNDECIDED
    return MotionClass.QUASI_PERIODIC


@compiled
def classify(window):
    """Preliminary ``Verdict`` on a motion from a ``Window``, completed by ``conclude``."""
    mean, error = mean_growth(window.growth)
    class_, order, returned = MotionClass.AT_REST, np.int64(0), 0.0
    if not window.resting:
        order, returned = order_of(window.points, window.scale, window.size)
        class_ = MotionClass.PERIODIC if order > 1 else MotionClass.SYNCHRONOUS
        if order == 0:
            class_ = _aperiodic_class(window, mean, error)
    return Verdict(class_, order, returned, mean, error, window.area - mean)


@compiled
def attracts(first, returned, window):
    """Return True if a motion that returns to within ``returned`` of its size stays on its orbit.

    The remaining drift is a geometric series of the largest multiplier, exp(first), so that a
    slow passage near a vanished orbit, with a multiplier near 1, is not accepted. A return
    to rounding must not be unstable. If the multiplier is unknown (nan), only the return
    counts.
    """
    if math.isnan(first):
        return True
    if returned * window.size <= 10.0 * rounding_of(window.points, window.scale, window.size):
        return not first > _UNSTABLE
    share = math.exp(first)
    return share < 1.0 and returned * share <= SETTLED * (1.0 - share)


@compiled
def conclude(window, verdict, first, second, apart):
    """``Verdict`` on a motion that repeats, from the logarithms of its orbit's multipliers.

    apart : distance of the last point from its orbit, by a step of Newton's method [rad/s]
    """
    order = verdict.order
    near = first < 0.0 and apart <= SETTLED * window.size
    if near or attracts(first, verdict.return_distance, window):
        error = math.nan if math.isnan(first) else 0.0
        return Verdict(
            verdict.motion, order, verdict.return_distance, first / order, error, second / order
        )
    return Verdict(
        MotionClass.UNDECIDED, np.int64(0), verdict.return_distance, verdict.largest,
        verdict.error, verdict.second,
    )  # fmt: skip
