"""Bifurcations between two points of a branch, located to rounding."""

from __future__ import annotations

from collections.abc import Callable
from typing import Generic, TypeVar

import numpy as np
from scipy.optimize import brentq

from wedgebrake.orbits.bifurcation_types import Kind, Margin
from wedgebrake.orbits.curves import OrbitCurve
from wedgebrake.orbits.palc import Curve, CurvePoint, NotConvergedError, corrected
from wedgebrake.orbits.section import FloatArray

# A margin that jumps through zero has no root there.
_ROOT = 1e-6
# Between points so near (as a share of the step) a solution may be interpolated.
_NARROW = 0.5
# A multiplier that goes through infinity, as where the end of a rest becomes tangent, is no root.
_POLE = 1e-6
# Functions larger than this at both ends of a step are not expected to vanish twice between.
_FAR = 0.1
# Margins that vanish within this share of a step vanish together.
_TOGETHER = 1e-6


AnyCurve = TypeVar("AnyCurve", bound=Curve)


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
        """A point between its neighbours, where branches meet and the equations are singular."""
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
        except (RuntimeError, ValueError):  # no change of sign after all, or one without a root
            raise NotConvergedError from None
        return float(found)


def tests(curve: OrbitCurve, y: FloatArray) -> dict[str, float]:
    """Test functions, which vanish where a multiplier is 1, -1, or a pair has modulus 1."""
    trace, determinant = curve.solution(y).invariants
    return {
        "one": 1.0 - trace + determinant,
        "minus one": 1.0 + trace + determinant,
        "torus": determinant - 1.0,
    }


def smooth_bifurcations(step: Step[OrbitCurve], until: float) -> list[tuple[float, Kind]]:
    """Bifurcations of the orbit's derivative, (s, kind), in order of s up to ``until``."""
    first, last = tests(step.curve, step.start.y), tests(step.curve, step.at(until).y)
    found: list[tuple[float, Kind]] = []
    for name in first:

        def value(at: CurvePoint, name: str = name) -> float:
            return tests(step.curve, at.y)[name]

        size = max(abs(first[name]), abs(last[name]), 1.0)
        for begin, end in _sign_changes(step, value, until, (first[name], last[name])):
            s = step.root(value, end, begin)
            kind = _kind(name, step, s, (begin, end))
            if kind is not None and abs(value(step.at(s))) <= _POLE * size:
                found.append((s, kind))
    return sorted(found, key=lambda one: one[0])


def _sign_changes(
    step: Step[OrbitCurve],
    value: Callable[[CurvePoint], float],
    until: float,
    ends: tuple[float, float],
) -> list[tuple[float, float]]:
    """Intervals of s in each of which a function changes sign: two if it does so twice."""
    first, last = ends
    if first * last < 0.0:
        return [(0.0, until)]
    if min(abs(first), abs(last)) > _FAR:
        return []
    half = 0.5 * until
    middle = value(step.at(half))
    turn = half
    if middle * first > 0.0:
        # The extreme of the parabola through the three.
        bend = first - 2.0 * middle + last
        turn = half + 0.25 * until * (first - last) / bend if bend != 0.0 else half
        if not 0.0 < turn < until or middle * bend < 0.0:
            return []
        middle = value(step.at(turn))
    return [(0.0, turn), (turn, until)] if middle * first < 0.0 else []


def _kind(name: str, step: Step[OrbitCurve], s: float, ends: tuple[float, float]) -> Kind | None:
    """The bifurcation at s, between the ends, where a test function vanishes; None: none."""
    if name == "minus one":
        return Kind.PERIOD_DOUBLING
    if name == "torus":
        trace, _ = step.curve.solution(step.at(s).y).invariants
        # Two real multipliers, one the inverse of the other, are no torus.
        return Kind.NEIMARK_SACKER if abs(trace) < 2.0 else None
    begin, end = (step.at(one).direction[-1] for one in ends)
    return Kind.FOLD if begin * end < 0.0 else Kind.BRANCH_POINT


def first_vanishing(
    step: Step[OrbitCurve], candidates: list[Margin]
) -> tuple[float, list[Margin]] | None:
    """Where the first of some margins vanishes, and those that vanish with it; None: none does."""
    roots: list[tuple[float, Margin]] = []
    for margin in candidates:

        def value(at: CurvePoint, margin: Margin = margin) -> float:
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
