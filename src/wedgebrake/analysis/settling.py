"""The end of an automatic transient: final verdicts, and the time to wait for other motions.

The conditions are explained in docs/numerics.md, "Classes of motion".
"""

import math
from typing import NamedTuple

from wedgebrake.analysis.classify import (
    GROWN,
    LONGEST,
    SETTLED,
    Verdict,
    best_return,
    distance,
    rounding_of,
    trend,
)
from wedgebrake.dynamics.enums import MotionClass
from wedgebrake.dynamics.jit import compiled

# A torus nearly returns if the return distance (share of the motion's size) times the longest
# tested period is less than this; that period as a share of the returns.
_NEAR, _TESTED = 0.15, 0.6
# Largest growth of a deviation (logarithm) over a window on an attracting torus.
_TORUS_GROWTH = 1.5
# Change of the mean logarithm of the distance of a return, from the first half of a window to the
# second, that shows a steady approach, and excludes a torus.
_APPROACH = -0.35
# Factor for distances that vary about their exponential decay, on either side of the limit.
_VARIES = 3.0
# Fewest returns that show a steady approach.
_STEADY = 16
# Returns that show that a motion has settled; a window has at least 1/_SHARE of the returns before.
_SHOWN, _SHARE = 16, 16
FIRST_WINDOW = 64
"""Returns in the first window of an automatic transient; each window doubles the length."""


class Approach(NamedTuple):
    """Approach of a motion to an orbit at a constant rate.

    order    : returns in the orbit
    rate     : decay of the distance in a return (logarithm)
    distance : to the orbit, as a share of the size of the motion
    waits    : returns until the motion has settled; infinite if it does not approach steadily
    """

    order: int
    rate: float
    distance: float
    waits: float


class Judgement(NamedTuple):
    """A verdict, whether it ends an automatic transient, and the approach if it does not."""

    verdict: Verdict
    final: bool
    approach: Approach


NO_APPROACH = Approach(0, 0.0, math.inf, math.inf)


@compiled
def nearly_returns(window):
    """Return True if a torus nearly returns, and may be a resonance of high order."""
    points, last = window.points, window.points.shape[0] - 1
    longest, closest = min(LONGEST, int(_TESTED * last)), math.inf
    for n in range(1, longest + 1):
        closest = min(closest, distance(points, last, last - n, window.scale))
    return closest * longest < _NEAR * window.size


@compiled
def is_final(window, verdict):
    """Return True if a verdict ends an automatic transient.

    Chaos may be transient. A torus about which areas have not shrunk may not be an attractor. If
    deviations grow, the motion may be weakly chaotic.
    """
    if verdict.order > 0 or verdict.motion == MotionClass.AT_REST:
        return True
    if verdict.motion != MotionClass.QUASI_PERIODIC:
        return False
    grown = verdict.largest * window.growth.size
    return grown + verdict.second * window.growth.size < -GROWN and grown <= _TORUS_GROWTH


@compiled
def settled_distance(points, scale, size):
    """Distance from its orbit [rad/s] within which a motion has reached it."""
    return 10.0 * (SETTLED * size + rounding_of(points, scale, size))


@compiled
def settling_of(points, order, scale, size):
    """Number of returns after which the motion stays near its final orbit."""
    last, tolerance = points.shape[0] - 1, settled_distance(points, scale, size)
    for k in range(last - order, -1, -1):
        if distance(points, k, last - (last - k) % order, scale) > tolerance:
            return k + 1
    return 0


@compiled
def approach_of(window, returned):
    """Return the ``Approach`` of a motion to an orbit; ``NO_APPROACH`` if it is not steady.

    returned : distance of its closest return, as a share of the size of the motion
    """
    points, scale = window.points, window.scale
    count = points.shape[0] - 1
    if count < _STEADY or not 0.0 < returned < math.inf:
        return NO_APPROACH
    order = best_return(points, scale)
    change = trend(points, order, scale)
    if not change < _APPROACH:
        return NO_APPROACH
    rate = -2.0 * change / count
    distance = returned / -math.expm1(-rate * order)
    return Approach(order, rate, distance, max(math.log(_VARIES * distance / SETTLED), 0.0) / rate)


@compiled
def judge(window, verdict):
    """Return the ``Judgement`` on a verdict."""
    if is_final(window, verdict):
        return Judgement(verdict, True, NO_APPROACH)
    return Judgement(verdict, False, approach_of(window, verdict.return_distance))


@compiled
def next_window(done, limit, first, waits):
    """End of the window after ``done`` returns; the last window is the second half of the run.

    first : returns in the first window
    waits : estimate of the returns until the motion has settled; infinite if it is not known
    """
    target = max(2 * done, first)
    end = limit if 2 * target > limit else target
    if waits > end - done:
        return end
    return min(end, done + max(math.ceil(waits) + _SHOWN, done // _SHARE))
