"""Bifurcations at which the events of an orbit change, where the equations are the flow itself.

The return map is continuous there, unless a static peak makes the motion jump; its derivative
jumps. So the branch goes on, or turns back (a non-smooth fold), with another direction.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from wedgebrake.orbits.bifurcation_types import Bifurcation, Kind, Scenario
from wedgebrake.orbits.curves import OrbitCurve
from wedgebrake.orbits.palc import FAILED, CurvePoint, NotConvergedError, Step, corrected

# Directions of the slips of a contact, and 0 for sticks, in cyclic order, the least first.
Sides = tuple[int, ...]

# Shares of a step within which a change is located, and within which its sides are neighbours.
_LOCATED, _NEIGHBOURS = 1e-12, 1e-3
# Distances beyond a point where events change, and of the first point there, in scaled unknowns:
# more than the steps of differences.
_BEYOND, _STEPS = (3e-6, 3e-5, 3e-4), (1e-5, 1e-4, 1e-3)
# Largest number of segments that begin or end at once.
_MOST = 4


def first_change(step: Step[OrbitCurve]) -> tuple[float, float]:
    """Positions just before and behind the first change of the events within a step.

    Raises ``NotConvergedError`` where the points there are not neighbours: where a branch turns
    back, Newton's method may find either side of it.
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
    before: Sequence[Sides], after: Sequence[Sides], names: Sequence[str], scenario: Scenario
) -> Bifurcation | None:
    """The bifurcation by the events on both sides; None if it has no name."""
    for name, old, new in zip(names, before, after, strict=True):
        if old == new:
            continue
        kind = _kind(*sorted((old, new), key=len))
        if kind is not None:
            lost = len(new) < len(old)
            what = "a slip" if kind in (Kind.ADDING_SLIDING, Kind.SWITCHING_SLIDING) else "a stick"
            effect = f"{what} {'ends' if lost else 'begins'}"
            where = f" in {name}" if len(names) > 1 else ""
            return Bifurcation(kind, effect + where, scenario)
    return None


def _kind(short: Sides, long: Sides) -> Kind | None:
    """The bifurcation at which segments of length zero are inserted."""
    level = [(long, None)]
    for _ in range(_MOST):
        level = [
            (rest, kind) for one, first in level for rest, kind in _removals(one)
            if first in (None, kind)
        ]  # fmt: skip
        for rest, kind in level:
            if rest == short:
                return kind
        level = level[:64]
    return None


def _removals(sides: Sides) -> Iterator[tuple[Sides, Kind]]:
    """What is left without one segment of length zero, and the bifurcation there."""
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
        gone = {i, (i + 1) % count} if before == after and count > 2 else {i}
        rest = tuple(one for k, one in enumerate(sides) if k not in gone)
        yield least(rest), kind


def least(sides: Sides) -> Sides:
    """The least of all cyclic shifts."""
    return min(sides[k:] + sides[:k] for k in range(len(sides)))


def turned(curve: OrbitCurve, at: CurvePoint) -> tuple[CurvePoint | None, list[Sides]] | None:
    """The branch beyond a corner where its events change and it turns back.

    Returns its first point and the events there; no point if the motion jumps. None if the events
    do not change near the point.
    """
    before = curve.solution(at.y).sides
    for reach in _BEYOND:
        guess = at.y + reach * at.direction
        try:
            beyond = curve.solution(guess).sides
            if beyond == before:
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
                        return point, curve.solution(point.y).sides
                except FAILED:
                    continue
        return None, beyond
    return None


def corner(at: CurvePoint, beyond: CurvePoint) -> np.ndarray:
    """Where the tangents of a branch on both sides of a corner are nearest to each other."""
    lines = np.column_stack((at.direction, -beyond.direction))
    shares = np.linalg.lstsq(lines, beyond.y - at.y, rcond=None)[0]
    return np.asarray(at.y + shares[0] * at.direction)
