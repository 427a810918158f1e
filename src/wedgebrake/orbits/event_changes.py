"""Bifurcations of a machine at which the events of an orbit change.

Its equations are the flow itself; for drivelines see ``discontinuity_induced``.

The return map is continuous there, unless a static peak makes the motion jump; its derivative
jumps. The branch therefore continues, or turns back (a non-smooth fold), in another direction.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from wedgebrake.orbits.bifurcation_types import Bifurcation, Changed, Kind, Scenario
from wedgebrake.orbits.curves import OrbitCurve
from wedgebrake.orbits.palc import FAILED, CurvePoint, NotConvergedError, Step, corrected
from wedgebrake.orbits.problem import FloatArray

# Shares of a step within which a change is located, and within which its sides are neighbours.
_LOCATED, _NEIGHBOURS = 1e-12, 1e-3
# Distances beyond a point where events change, and of the first point there, in scaled unknowns:
# more than the steps of differences.
_BEYOND, _STEPS = (3e-6, 3e-5, 3e-4), (1e-5, 1e-4, 1e-3)
# Largest number of segments that begin or end at once, and of the ways in which they are tried.
_MOST, _TRIED = 4, 64


class Segments(NamedTuple):
    """Slips and sticks of a contact in an orbit.

    sides     : direction of each slip, 0 for a stick, in cyclic order: the smallest such tuple
    durations : [s]
    """

    sides: tuple[int, ...]
    durations: FloatArray

    @classmethod
    def of(cls, sides: tuple[int, ...], durations: FloatArray) -> Segments:
        """Segments in cyclic order, from a list that may begin with any of them."""
        first = min(range(len(sides)), key=lambda k: sides[k:] + sides[:k])
        return cls(sides[first:] + sides[:first], np.roll(durations, -first))


def first_change(step: Step[OrbitCurve]) -> tuple[float, float]:
    """Positions just before and beyond the first change of the events within a step.

    Raises ``NotConvergedError`` if the points there are not neighbours: where a branch turns back,
    Newton's method may converge to either side.
    """
    begin = step.curve.solution(step.start.y).sides
    low, high = 0.0, step.length
    while high - low > _LOCATED * step.length:
        middle = 0.5 * (low + high)
        if not low < middle < high:
            break
        if step.curve.solution(step.at(middle).y).sides == begin:
            low = middle
        else:
            high = middle
    apart = np.linalg.norm(step.at(high).y - step.at(low).y)
    if apart > _NEIGHBOURS * step.length:
        raise NotConvergedError
    return low, high


def bifurcation_of(
    before: Sequence[Segments], after: Sequence[Segments], names: Sequence[str], scenario: Scenario
) -> Bifurcation | None:
    """Classify a bifurcation by the events on both sides; None if it has no name."""
    for number, (name, old, new) in enumerate(zip(names, before, after, strict=True)):
        if old.sides == new.sides:
            continue
        short, long = sorted((old, new), key=lambda one: len(one.sides))
        kind = _kind(short, long)
        if kind is not None:
            slip = kind in (Kind.ADDING_SLIDING, Kind.SWITCHING_SLIDING)
            change = "ends" if new is short else "begins"
            where = f" in {name}" if len(names) > 1 else ""
            effect = f"a {'slip' if slip else 'stick'} {change}{where}"
            fewest = (
                min(pair, key=len) for pair in zip(_sides(before), _sides(after), strict=True)
            )
            changed = Changed(number, tuple(fewest))
            return Bifurcation(kind, effect, scenario, changed=changed)
    return None


def _sides(segments: Sequence[Segments]) -> list[tuple[int, ...]]:
    return [one.sides for one in segments]


class _Removal(NamedTuple):
    """Remaining segments after some have been removed.

    longest : duration of the longest segment that has been removed [s]
    kind    : bifurcation at which such segments have zero duration
    """

    left: Segments
    longest: float
    kind: Kind | None


def _kind(short: Segments, long: Segments) -> Kind | None:
    """Bifurcation at which the additional segments of the longer sequence have zero duration."""
    level = [_Removal(long, 0.0, None)]
    for _ in range(_MOST):
        level = [
            more for one in level for more in _removals(one) if one.kind in (None, more.kind)
        ]  # fmt: skip
        level = sorted(level, key=lambda one: one.longest)[:_TRIED]
        found = [one for one in level if one.left.sides == short.sides]
        if found:
            return found[0].kind
    return None


def _removals(given: _Removal) -> Iterator[_Removal]:
    """Yield the removals of one more segment."""
    sides, durations = given.left
    count = len(sides)
    for i, side in enumerate(sides):
        before, after = sides[i - 1], sides[(i + 1) % count]
        if count < 2:
            return
        if side == 0:
            kind = Kind.GRAZING_SLIDING if before == after else Kind.CROSSING_SLIDING
        elif before == after == 0:
            kind = Kind.ADDING_SLIDING
        elif after == 0 and before == -side:
            kind = Kind.SWITCHING_SLIDING
        else:
            continue
        left = durations.copy()
        left[i - 1] += left[i]
        gone = [i]
        if before == after and count > 2:
            gone.append((i + 1) % count)
            left[i - 1] += left[gone[1]]
        kept = [k for k in range(count) if k not in gone]
        rest = Segments.of(tuple(sides[k] for k in kept), left[kept])
        yield _Removal(rest, max(given.longest, float(durations[i])), kind)


def turned(curve: OrbitCurve, at: CurvePoint) -> tuple[CurvePoint | None, list[Segments]] | None:
    """Find the branch beyond a corner at which its events change and it turns back.

    Returns the first point of the branch and the events there; no point if the motion jumps. None
    if the events do not change near the point.
    """
    before = curve.solution(at.y).sides
    for reach in _BEYOND:
        guess = at.y + reach * at.direction
        try:
            beyond = curve.solution(guess)
            if beyond.sides == before:
                continue
            matrix = curve.linearize(guess)[1]
        except FAILED:
            continue
        sizes = np.abs(matrix).max(axis=1)
        along = np.linalg.svd(matrix / np.where(sizes > 0.0, sizes, 1.0)[:, None])[2][-1]
        for length in _STEPS:
            for side in (1.0, -1.0):
                way = side * along
                try:
                    point = corrected(curve, at.y + length * way, way)
                    if curve.solution(point.y).sides != before:
                        return point, curve.solution(point.y).segments
                except FAILED:
                    continue
        return None, beyond.segments
    return None


def corner(at: CurvePoint, beyond: CurvePoint) -> FloatArray:
    """Point at which the tangents on both sides of a corner are nearest to each other."""
    lines = np.column_stack((at.direction, -beyond.direction))
    shares = np.linalg.lstsq(lines, beyond.y - at.y, rcond=None)[0]
    return np.asarray(at.y + shares[0] * at.direction)
