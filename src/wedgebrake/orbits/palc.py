"""A curve of solutions F(y) = 0 with one unknown more than equations, and bifurcations on it.

Pseudo-arclength continuation: H. B. Keller, Numerical solution of bifurcation and nonlinear
eigenvalue problems, in Applications of Bifurcation Theory (1977), 359-384.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable
from typing import Generic, NamedTuple, Protocol, TypeVar

import numpy as np
from scipy.optimize import brentq

from wedgebrake.arrays import FloatArray
from wedgebrake.orbits.bifurcation_types import Bifurcation, Kind, OrbitMargin, Scenario
from wedgebrake.orbits.curves import OrbitCurve
from wedgebrake.orbits.equations.equations import NoOrbitError

# Newton's method ends when its next step would be rounding, and fails if the steps do not shrink.
_CONVERGED, _ACCEPTED = 1e-13, 1e-9
_MOST_STEPS = 12
# The first step as a share of the longest, and how steps grow and shrink.
_FIRST, _GROW, _SHRINK = 0.1, 1.5, 0.5
# A curve creeps if so many steps together are no longer than so many of the longest.
_MANY, _FEW = 200, 2.0
# A margin that jumps across zero has no root there.
_ROOT = 1e-6
# Distance of points (share of the step) below which a solution may be interpolated.
_NARROW = 0.5
# A multiplier that goes through infinity, as where the end of a rest becomes tangent, is no root.
_POLE = 1e-6
# Functions smaller than this have no sign: along a family of orbits at a single value of the
# parameter, for example, a multiplier remains 1.
_WITHOUT_SIGN = 1e-9
# Test functions larger than the first number at both ends of a step are not expected to vanish
# twice within it; nor are those whose parabola through three values stays above the second, a share
# of these, or has its extremum further outside the step than the third, a share of the step.
_FAR, _LOW, _OUTSIDE = 0.1, 0.5, 0.5
# The slope of a function is a difference over the first share of a step. Extrema nearer to the ends
# than the second are not sought: a function that touches zero there has no sign at the end.
_SLOPE, _EDGE = 1e-3, 1e-4
# Largest magnitude of a function, and distance of multipliers, at which it touches zero: with an
# exact flow, with one computed to a tolerance; and what is added per growth of deviations.
_TOUCHES, _TO_TOLERANCE, _ROUNDING = 1e-8, 1e-7, 1e-13
# Distance, as a share of a step, at which a function is compared on both sides of its extremum, and
# largest ratio of the two values: next to a jump one of them is much larger.
_BESIDE, _JUMPS = 0.05, 8.0
# Where two folds meet, the parameter's component of the direction vanishes quadratically: a tenth
# of the way to the end of the step it is a hundredth of its value at the end.
_WAY, _TURNS = 0.1, 0.1
# Two folds in a step are sought where the slope of the parameter may fall below this share of that
# at both ends, in parts of parts down to a depth.
_FLATTER, _DEEPEST = 0.5, 3
# Margins that vanish within this share of a step vanish together.
_TOGETHER = 1e-6


class Curve(Protocol):
    """F: R^(m+1) -> R^m, in unknowns that are scaled so that changes of 1 are large."""

    def linearize(self, y: FloatArray) -> tuple[FloatArray, FloatArray]:
        """F(y), (m,), and its derivative, (m, m + 1); raises ``NoOrbitError``."""


AnyCurve = TypeVar("AnyCurve", bound=Curve)


class NotConvergedError(ArithmeticError):
    """Newton's method found no solution near its guess."""


# Exceptions of a step that a shorter step may avoid.
FAILED = (NotConvergedError, NoOrbitError)


class CurvePoint(NamedTuple):
    """A point of a curve.

    y         : scaled unknowns
    matrix    : (m, m + 1) derivative of F
    direction : unit tangent
    """

    y: FloatArray
    matrix: FloatArray
    direction: FloatArray


class StepLength:
    """Length of the steps along a curve, halved until one succeeds and grown afterwards.

    longest : in scaled unknowns
    """

    def __init__(self, longest: float) -> None:
        self.longest, self.length = longest, _FIRST * longest
        self._last: deque[float] = deque(maxlen=_MANY)

    @property
    def creeps(self) -> bool:
        """True if many steps have led almost nowhere, so that more of them would not either."""
        return len(self._last) == _MANY and sum(self._last) <= _FEW * self.longest

    def exceeds(self, share: float) -> bool:
        """Return True if a step is longer than a share of the longest."""
        return self.length > share * self.longest

    def attempt(self, step: Callable[[], bool], shortest: float) -> bool:
        """Try a step, each time of half the length, until one succeeds.

        shortest : length below which none is tried, as a share of the longest
        """
        while self.length >= shortest * self.longest:
            try:
                taken = self.length
                if step():
                    self._last.append(taken)
                    return True
            except FAILED:
                pass
            self.length *= _SHRINK
        return False

    def grow(self) -> None:
        """Increase the next step."""
        self.length = min(self.longest, _GROW * self.length)


def newton(
    curve: Curve,
    guess: FloatArray,
    normal: FloatArray | None,
    sizes: list[float] | None = None,
    *,
    rank: float = 0.0,
) -> tuple[FloatArray, FloatArray]:
    """The solution on the plane through the guess with normal ``normal``: (y, derivative there).

    normal : None for as many unknowns as equations
    sizes  : receives the length of each step of Newton's method
    rank   : without a normal: relative size below which singular values count as zero. The steps
             are then those of least length, which lead to the nearest of a family of solutions

    Raises ``NotConvergedError`` and the exceptions of the curve.
    """
    y = guess.copy()
    last = np.inf
    for _ in range(_MOST_STEPS):
        values, matrix = curve.linearize(y)
        if normal is None:
            step = least_norm(matrix, -values, rank) if rank else _solved(matrix, -values)
        else:
            whole = np.vstack((matrix, normal))
            step = _solved(whole, np.append(-values, normal @ (guess - y)))
        size = float(np.linalg.norm(step))
        if sizes is not None:
            sizes.append(size)
        if not np.isfinite(size) or (size > 0.5 * last and size > _ACCEPTED) or size > 10.0:
            break
        y = y + step
        # The next step is smaller by at least the same factor, usually by its square.
        ends = size * size <= _CONVERGED * last if np.isfinite(last) else size <= _CONVERGED
        if ends or (size > 0.5 * last and size <= _ACCEPTED):
            return y, matrix
        last = size
    raise NotConvergedError


def corrected(
    curve: Curve, guess: FloatArray, normal: FloatArray, along: FloatArray | None = None
) -> CurvePoint:
    """The point of a curve on the plane through a guess with normal ``normal``.

    along : side on which its direction lies; default ``normal``
    """
    y, matrix = newton(curve, guess, normal)
    return CurvePoint(y, matrix, tangent(matrix, normal if along is None else along))


def tangent(matrix: FloatArray, along: FloatArray) -> FloatArray:
    """The direction of the curve, of length one, on the same side as ``along``.

    matrix : (m, m + 1) derivative of F
    """
    value = np.zeros(along.size)
    value[-1] = 1.0
    direction = _solved(np.vstack((matrix, along)), value)
    size = float(np.linalg.norm(direction))
    if not np.isfinite(size):
        raise NotConvergedError
    return direction / size


def null_directions(matrix: FloatArray) -> FloatArray:
    """Orthonormal rows; the matrix maps the last of them nearest to zero."""
    sizes = np.max(np.abs(matrix), axis=1)
    _, _, rows = np.linalg.svd(matrix / np.where(sizes > 0.0, sizes, 1.0)[:, None])
    return rows


def _solved(matrix: FloatArray, values: FloatArray) -> FloatArray:
    """The solution of a square system whose rows are radians, velocities and torques."""
    sizes = np.max(np.abs(matrix), axis=1)
    if not np.all(np.isfinite(sizes)) or not np.all(np.isfinite(values)):
        raise NotConvergedError
    sizes[sizes == 0.0] = 1.0
    try:
        return np.linalg.solve(matrix / sizes[:, None], values / sizes)
    except np.linalg.LinAlgError:
        raise NotConvergedError from None


def least_norm(matrix: FloatArray, values: FloatArray, rank: float) -> FloatArray:
    """The shortest solution, without the singular values below a share of the largest."""
    if not np.all(np.isfinite(matrix)) or not np.all(np.isfinite(values)):
        raise NotConvergedError
    return np.asarray(np.linalg.lstsq(matrix, values, rcond=rank)[0])


class Step(Generic[AnyCurve]):
    """The curve between two of its points, over the distance ``s`` along the first's direction."""

    def __init__(self, curve: AnyCurve, start: CurvePoint, end: CurvePoint) -> None:
        self.curve, self.start = curve, start
        self.length = float(start.direction @ (end.y - start.y))
        self._found: dict[float, CurvePoint] = {0.0: start, self.length: end}

    def at(self, s: float) -> CurvePoint:
        """The point at s; raises ``NotConvergedError`` and ``NoOrbitError``."""
        if s not in self._found:
            direction = self.start.direction
            # From the nearest point known, along its direction.
            near = min(self._found, key=lambda known: abs(known - s))
            base = self._found[near]
            slope = max(float(direction @ base.direction), 0.1)
            guess = base.y + (s - near) / slope * base.direction
            guess += (s - float(direction @ (guess - self.start.y))) * direction
            try:
                self._found[s] = corrected(self.curve, guess, direction, base.direction)
            except NotConvergedError:
                self._found[s] = self._between(s)
        return self._found[s]

    def _between(self, s: float) -> CurvePoint:
        """A point between two others, where branches meet and the equations are singular."""
        below = [known for known in self._found if known < s]
        above = [known for known in self._found if known > s]
        if not below or not above or min(above) - max(below) > _NARROW * self.length:
            raise NotConvergedError
        low, high = max(below), min(above)
        one, other = self._found[low], self._found[high]
        y = one.y + (s - low) / (high - low) * (other.y - one.y)
        return CurvePoint(y, self.curve.linearize(y)[1], one.direction)

    def root(
        self,
        function: Callable[[CurvePoint], float],
        until: float | None = None,
        since: float = 0.0,
    ) -> float:
        """The root of a function that changes sign between the ends."""
        last = self.length if until is None else until
        try:
            found = brentq(
                lambda s: function(self.at(s)), since, last, xtol=1e-15, rtol=1e-14, maxiter=500
            )
        except (RuntimeError, ValueError):  # no change of sign, or no root there
            raise NotConvergedError from None
        return float(found)


def smooth_bifurcations(step: Step[OrbitCurve], until: float) -> list[tuple[float, Bifurcation]]:
    """Bifurcations of the orbit's derivative and their positions, in order up to ``until``."""
    found: list[tuple[float, Bifurcation]] = []
    for name in step.curve.solution(step.start.y).tests:

        def test(at: CurvePoint, name: str = name) -> float:
            return step.curve.solution(at.y).tests[name]

        def value(s: float, test: Callable[[CurvePoint], float] = test) -> float:
            return test(step.at(s))

        first, last = value(0.0), value(until)
        if min(abs(first), abs(last)) <= _WITHOUT_SIGN:
            continue
        size = max(abs(first), abs(last), 1.0)
        intervals = [(0.0, until)]
        if first * last > 0.0:
            turn = _extreme(value, until)
            if turn is None and name == "one":
                turn = _between_folds(step, 0.0, until)
            if turn is None:
                continue
            if _touches(name, step, turn, size) and not _jumps(value, turn, until):
                kind = _touched(name, step, turn, until)
                if kind is not None:
                    found.append((turn, Bifurcation(kind, scenario=Scenario.TOUCH)))
                continue
            crosses = value(turn) * first < 0.0
            intervals = [(0.0, turn), (turn, until)] if crosses else []
        for begin, end in intervals:
            s = step.root(test, end, begin)
            kind = _kind(name, step, s, (begin, end))
            if kind is not None and abs(value(s)) <= _POLE * size:
                found.append((s, Bifurcation(kind)))
    return sorted(found, key=lambda one: one[0])


def ends_on_root(step: Step[OrbitCurve]) -> bool:
    """Return True if a test function vanishes at the end of a step, so that its sign is unknown."""
    before, after = (step.curve.solution(step.at(s).y).tests for s in (0.0, step.length))
    return any(abs(after[name]) <= _WITHOUT_SIGN < abs(one) for name, one in before.items())


def _extreme(value: Callable[[float], float], until: float) -> float | None:
    """Position where a function with equal signs at both ends is nearest to 0; None at an end.

    It may have the other sign there.
    """
    first, last = value(0.0), value(until)
    if min(abs(first), abs(last)) > _FAR:
        return None
    sign = float(np.sign(first))
    half = 0.5 * until
    ends, middle = (sign * first, sign * last), sign * value(half)
    # The parabola through the three, in shares of the half.
    rise, bend = 0.5 * (ends[1] - ends[0]), 0.5 * (ends[0] + ends[1]) - middle
    if bend <= 0.0 or abs(rise) > (1.0 + 2.0 * _OUTSIDE) * 2.0 * bend:
        return None
    if middle - 0.25 * rise * rise / bend > _LOW * max(*ends, middle):
        return None

    def slope(s: float, share: float = 1.0) -> float:
        reach = share * min(_SLOPE * until, s, until - s)
        return sign * (value(s + reach) - value(s - reach)) / (2.0 * reach)

    edges = _EDGE * until, (1.0 - _EDGE) * until
    if not slope(edges[0]) < 0.0 < slope(edges[1]):
        return half if middle < 0.0 else None
    s = float(brentq(slope, *edges, xtol=1e-9 * until))
    # A step of Newton's method with differences of the fourth order.
    reach = min(_SLOPE * until, s, until - s)
    change = sign * (value(s + reach) - 2.0 * value(s) + value(s - reach)) / reach**2
    moved = (4.0 * slope(s, 0.5) - slope(s)) / (3.0 * change) if change > 0.0 else 0.0
    return s - moved if abs(moved) < reach else s


def _between_folds(
    step: Step[OrbitCurve], begin: float, end: float, depth: int = _DEEPEST
) -> float | None:
    """Position between two folds, where the parameter goes back; None if there is none.

    The slope of the parameter has the same sign at both ends. Where the cubic through its values
    and slopes at the ends becomes much flatter inside, the slope is computed there, and the parts
    on both sides are examined.
    """

    def slope(s: float) -> float:
        direction = step.at(s).direction
        return float(direction[-1] / (direction @ step.start.direction))

    try:
        first, last = slope(begin), slope(end)
        if first * last <= 0.0:
            return None
        sign, width = math.copysign(1.0, first), end - begin
        a, b = abs(first), abs(last)
        mean = sign * float(step.at(end).y[-1] - step.at(begin).y[-1]) / width
        # The slope of the cubic: a + rise u + bend u^2, with u from 0 to 1.
        bend, rise = 3.0 * (a + b - 2.0 * mean), 6.0 * mean - 4.0 * a - 2.0 * b
        if bend <= 0.0 or not 0.0 < -rise < 2.0 * bend or min(a, b) <= _WITHOUT_SIGN:
            return None
        if a - 0.25 * rise * rise / bend > _FLATTER * min(a, b):
            return None
        flattest = begin - 0.5 * rise / bend * width
        if sign * slope(flattest) < 0.0:
            return flattest
        if depth == 0:
            return None
        parts = ((begin, flattest), (flattest, end))
        found = (_between_folds(step, *one, depth - 1) for one in parts)
        return next((one for one in found if one is not None), None)
    except FAILED:
        return None


def _touches(name: str, step: Step[OrbitCurve], s: float, size: float) -> bool:
    """Return True if a multiplier, or the product of a pair, is at its value of a bifurcation.

    A small function alone is not sufficient: it is a product, and also small if two multipliers
    are near that value, such as a complex pair near 1.
    """
    orbit = step.curve.solution(step.at(s).y)
    rounding = _ROUNDING * orbit.floquet.growth
    allowed = (_TOUCHES if orbit.equations.to_rounding else _TO_TOLERANCE) + rounding
    return abs(orbit.tests[name]) <= allowed * size and orbit.floquet.distance(name) <= allowed


def _jumps(value: Callable[[float], float], s: float, until: float) -> bool:
    """Return True if a function jumps at its extremum instead of turning smoothly."""
    reach = min(_BESIDE * until, s, until - s)
    sizes = sorted(abs(value(one)) for one in (s - reach, s + reach))
    return sizes[1] > _JUMPS * sizes[0]


def _touched(name: str, step: Step[OrbitCurve], s: float, until: float) -> Kind | None:
    """The bifurcation at s, where a test function touches zero; None if there is none."""
    if name != "one":
        return _kind(name, step, s, (0.0, until))
    far = 0.0 if s > 0.5 * until else until
    near, end = (abs(step.at(one).direction[-1]) for one in (s + _WAY * (far - s), far))
    return Kind.FOLD if near < _TURNS * end else Kind.BRANCH_POINT


def _kind(name: str, step: Step[OrbitCurve], s: float, ends: tuple[float, float]) -> Kind | None:
    """The bifurcation at s, between the ends, where a test function vanishes; None: none."""
    if name == "minus one":
        return Kind.PERIOD_DOUBLING
    if name == "symmetry":
        return Kind.SYMMETRY_BREAKING
    if name == "torus":
        # Two real multipliers, one the inverse of the other, do not indicate a torus.
        oscillates = step.curve.solution(step.at(s).y).floquet.oscillates
        return Kind.NEIMARK_SACKER if oscillates else None
    begin, end = (step.at(one).direction[-1] for one in ends)
    return Kind.FOLD if begin * end < 0.0 else Kind.BRANCH_POINT


def first_vanishing(
    step: Step[OrbitCurve], candidates: list[OrbitMargin]
) -> tuple[float, list[OrbitMargin]] | None:
    """Position where the first of some margins vanishes, and those that vanish there; or None."""
    roots: list[tuple[float, OrbitMargin]] = []
    for margin in candidates:

        def value(at: CurvePoint, margin: OrbitMargin = margin) -> float:
            found = step.curve.solution(at.y).margins[margin.segment][margin.quantity]
            return float(min(found, 1.0)) if np.isfinite(found) else 1.0

        if value(step.start) <= 0.0:
            continue
        s = step.root(value)
        if abs(value(step.at(s))) <= _ROOT:
            roots.append((s, margin))
    if not roots:
        return None
    s = min(root for root, _ in roots)
    together = [margin for root, margin in roots if root - s <= _TOGETHER * step.length]
    return s, together
