"""Bifurcations of a machine at which the events of an orbit change.

Its equations are the flow itself; for one inertia see ``discontinuity_induced``.

The return map is continuous there, unless a static peak makes the motion jump; its derivative
jumps. The branch therefore continues, or turns back (a non-smooth fold), in another direction.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from wedgebrake.arrays import FloatArray
from wedgebrake.model.elements import Element, elements, event_parts
from wedgebrake.orbits.bifurcation_types import (
    Bifurcation,
    Changed,
    Kind,
    Limit,
    Scenario,
    multiplier_change,
)
from wedgebrake.orbits.curves import OrbitCurve, OrbitSolution
from wedgebrake.orbits.equations.segments import (
    KindOf,
    OrbitSegments,
    Removal,
    of_levels,
    of_slips,
    removal,
)
from wedgebrake.orbits.palc import FAILED, CurvePoint, NotConvergedError, Step, corrected
from wedgebrake.solvers.machine.events.modes import GuardKind

# Shares of a step within which a change is located, and within which its sides are neighbours.
_LOCATED, _NEIGHBOURS = 1e-12, 1e-3
# Attempts within which the interval around a change is at least halved, and share of the distance
# to an expected change by which the first one may lie beside it.
_TRIES, _BESIDE = 3, 0.05
# Distances beyond a point where events change, and of the first point there, in scaled unknowns:
# more than the steps of differences.
_BEYOND, _STEPS = (3e-6, 3e-5, 3e-4), (1e-5, 1e-4, 1e-3)
# Share of a step within which grazings are at one place, and largest number of such places.
_TOGETHER, _MOST_GRAZES = 1e-9, 64
# Size of a component of a direction that is rounding.
_LEVEL = 1e-8
# Change of the scaled equations within ``_LOCATED`` that is no rounding.
_JUMP = 1e-6


class ChangingEvents(NamedTuple):
    """Events of an orbit of a machine that change along a branch.

    of      : the segments between them, of each contact
    kind_of : bifurcation at which a segment between two others has zero duration
    """

    of: Callable[[OrbitSolution], list[OrbitSegments]]
    kind_of: KindOf


SLIPS = ChangingEvents(lambda solution: solution.segments, of_slips)
LEVELS = ChangingEvents(lambda solution: solution.levels, of_levels)


def first_change(
    step: Step[OrbitCurve], events: ChangingEvents, ends: tuple[float, float]
) -> tuple[float, float]:
    """Positions just before and beyond the first change of the events between two positions.

    Raises ``NotConvergedError`` if the points there are not neighbours: where a branch turns back,
    Newton's method may converge to either side.
    """
    search = _Search(step, events, ends)
    while search.high - search.low > _LOCATED * step.length:
        if not search.low < 0.5 * (search.low + search.high) < search.high:
            break
        search.shrink()
    low, high = search.low, search.high
    apart = np.linalg.norm(step.at(high).y - step.at(low).y)
    if apart > _NEIGHBOURS * step.length:
        raise NotConvergedError
    return low, high


class _Search:
    """Search for the first change of the events within a step, between ``low`` and ``high``.

    Bisection, with trial points extrapolated from the duration of the segments that vanish. The
    duration is linear in the position for slips and sticks at the end of others; otherwise its
    square is, because it is proportional to the distance of an extreme from its limit.

    before, beyond : positions on either side with the segments there, the nearest one last
    """

    def __init__(
        self, step: Step[OrbitCurve], events: ChangingEvents, ends: tuple[float, float]
    ) -> None:
        self.step, self.events = step, events
        self.low, self.high = ends
        self.before = [(self.low, self._segments(self.low))]
        self.beyond = [(self.high, self._segments(self.high))]
        self._root = math.nan
        # Widths of the interval before the last attempts.
        self._widths: list[float] = []

    def _segments(self, s: float) -> list[OrbitSegments]:
        return self.events.of(self.step.curve.solution(self.step.at(s).y))

    def shrink(self) -> None:
        """Make the interval smaller by one more point of the branch."""
        width = self.high - self.low
        self._widths.append(width)
        slow = len(self._widths) > _TRIES and width > 0.5 * self._widths[-1 - _TRIES]
        guess = math.nan if slow else self._guess()
        if not self.low < guess < self.high:
            guess = 0.5 * (self.low + self.high)
            self._widths.clear()
        found = self._segments(guess)
        if sides_of(found) == sides_of(self.before[-1][1]):
            self.low = guess
            self.before.append((guess, found))
            return
        self.high = guess
        if sides_of(found) != sides_of(self.beyond[-1][1]):
            self.beyond.clear()
        self.beyond.append((guess, found))

    def _guess(self) -> float:
        """A position slightly beside the expected one, on the side that is known less well, or nan.

        The size of the segments that vanish is extrapolated from the two nearest positions.
        """
        for number, (old, new) in enumerate(
            zip(self.before[-1][1], self.beyond[-1][1], strict=True)
        ):
            if old.sides != new.sides:
                longer = len(old.sides) > len(new.sides)
                given, short = (self.before, new) if longer else (self.beyond, old)
                known = [(s, self._size(short, one[number])) for s, one in given[-2:]]
                return self._beside_root(*known) if len(known) == 2 else math.nan
        return math.nan

    def _size(self, short: OrbitSegments, long: OrbitSegments) -> float:
        """Size of the additional segments of the longer sequence; nan if they are not known."""
        found = removal(short, long, self.events.kind_of)
        return math.nan if found is None else found.size

    def _beside_root(self, one: tuple[float, float], other: tuple[float, float]) -> float:
        """A position beside the root of the line through two positions with sizes."""
        (first, old), (last, new) = one, other
        if old == new:
            return math.nan
        root = last - new * (last - first) / (new - old)
        apart = abs(root - self._root)
        if not math.isfinite(apart):
            apart = _BESIDE * abs(root - last)
        self._root = root
        apart = max(apart, 0.25 * _LOCATED * self.step.length)
        below = root - self.low > self.high - root
        return float(root - apart if below else root + apart)


def bifurcation_of(
    before: Sequence[OrbitSegments],
    after: Sequence[OrbitSegments],
    names: Sequence[str],
    scenario: Scenario,
) -> Bifurcation | None:
    """Classify a bifurcation by the events on both sides; None if it has no name."""
    for number, change, found in _removals(before, after, of_slips):
        kind = found.kind
        if kind is not None:
            slip = kind in (Kind.ADDING_SLIDING, Kind.SWITCHING_SLIDING)
            where = f" in {names[number]}" if len(names) > 1 else ""
            effect = f"a {'slip' if slip else 'stick'} {change}{where}"
            fewest = (
                min(pair, key=len) for pair in zip(sides_of(before), sides_of(after), strict=True)
            )
            changed = Changed(number, tuple(fewest))
            return Bifurcation(kind, effect, scenario, changed=changed)
    return None


def change_between(
    before: OrbitSolution, after: OrbitSolution, scenario: Scenario
) -> Bifurcation | None:
    """The bifurcation between two orbits with different events."""
    names = before.system.coords.get("contact", ())
    found = bifurcation_of(before.segments, after.segments, names, scenario)
    change = multiplier_change(before.tests, after.tests)
    return None if found is None else replace(found, change=change)


def _removals(
    before: Sequence[OrbitSegments], after: Sequence[OrbitSegments], kind_of: KindOf
) -> Iterator[tuple[int, str, Removal]]:
    """Places at which segments differ: number, "begins" or "ends", and what is removed there."""
    for number, (old, new) in enumerate(zip(before, after, strict=True)):
        if old.sides != new.sides:
            short, long = sorted((old, new), key=lambda one: len(one.sides))
            found = removal(short, long, kind_of)
            if found is not None:
                yield number, "ends" if new is short else "begins", found


def grazes(step: Step[OrbitCurve], until: float) -> list[tuple[float, Bifurcation]]:
    """Positions up to ``until`` at which the orbit just touches a breakpoint or a limit."""
    found: list[tuple[float, Bifurcation]] = []
    begin, solution = 0.0, step.curve.solution
    at_end = sides_of(solution(step.at(until).y).levels)
    for _ in range(_MOST_GRAZES):
        if sides_of(solution(step.at(begin).y).levels) == at_end:
            break
        low, high = first_change(step, LEVELS, (begin, until))
        # Rounding decides about the order of grazings at one place.
        begin = min(high + _TOGETHER * step.length, until)
        pair = solution(step.at(low).y), solution(step.at(begin).y)
        found += [(low, one) for one in _grazings(*pair)]
    return found


def _grazings(before: OrbitSolution, after: OrbitSolution) -> Iterator[Bifurcation]:
    """Yield the grazings between two orbits, one of each part."""
    for place, change, known in _removals(before.levels, after.levels, of_levels):
        yield _grazing(before, place, change, known.gone)


def _grazing(
    before: OrbitSolution, place: int, change: str, gone: Sequence[tuple[int, int]]
) -> Bifurcation:
    """The grazing at which segments begin or end; of a symmetric orbit there are two of them.

    place : number of the part, as in ``levels_of``
    gone  : of each segment the level outside it, and its own
    """
    machine, (outside, level) = before.system.machine, gone[-1]
    contacts = machine.contacts
    if place >= 2 * len(contacts):
        number = place - 2 * len(contacts)
        name = event_parts(machine)[len(contacts) + number]
        every = {_breakpoint_of(elements(machine), number, one) for one in gone}
        effect = f"a crossing of {' and of '.join(sorted(every))} {change} in {name}"
        return Bifurcation(Kind.GRAZING, effect, Scenario.PERSISTENCE)
    number, guard = place // 2, GuardKind.FORCE_LIMIT if place % 2 else GuardKind.NEXT_LINE
    exceeds = abs(level) > abs(outside)
    limit = Limit(number, guard, -1 if exceeds else 1, level if exceeds else outside)
    what = before.kernel_problem.breakpoints[number].name_of(limit)
    part = f"a {what}" if exceeds else f"an interruption of a {what}"
    where = f" in {contacts[number].name}" if len(contacts) > 1 else ""
    changed = Changed(number, tuple(sides_of(before.segments)), limit)
    effect = f"{part} {change}{where}"
    return Bifurcation(Kind.GRAZING, effect, Scenario.PERSISTENCE, changed=changed)


def _breakpoint_of(given: Sequence[Element], number: int, levels: tuple[int, int]) -> str:
    """Words for the breakpoint of an element, or the limit of a controller, between two levels."""
    if number >= len(given):
        return f"the {'upper' if sum(levels) > 0 else 'lower'} limit"
    corners, unit = given[number].law.corners, "rad/s" if given[number].of_speed else "rad"
    return f"the breakpoint at {corners[min(*levels, len(corners) - 1)]:.6g} {unit}"


def sides_of(segments: Sequence[OrbitSegments]) -> list[tuple[int, ...]]:
    """Sides of the segments of each contact."""
    return [one.sides for one in segments]


def scenario_of(at: CurvePoint, beyond: CurvePoint) -> Scenario:
    """Whether the parameter turns back at a change of the events."""
    came, goes = at.direction[-1], beyond.direction[-1]
    # If the parameter is constant along a family of orbits, the sign of its change is rounding.
    turns = came * goes < 0.0 and min(abs(came), abs(goes)) > _LEVEL
    return Scenario.FOLD if turns else Scenario.PERSISTENCE


def onward(curve: OrbitCurve, beyond: CurvePoint) -> CurvePoint:
    """A point just beyond a change of the events, with the direction that leads away from it.

    At a non-smooth fold the tangent that continues the former direction may lead back. Newton's
    method finds the branch beyond such a fold if a step ends within rounding of it.
    """
    after = curve.solution(beyond.y).sides

    def stays(way: FloatArray) -> bool:
        try:
            there = corrected(curve, beyond.y + _STEPS[0] * way, way)
            return curve.solution(there.y).sides == after
        except FAILED:
            return False

    if not stays(beyond.direction) and stays(-beyond.direction):
        return CurvePoint(beyond.y, beyond.matrix, -beyond.direction)
    return beyond


def turned(
    curve: OrbitCurve, at: CurvePoint
) -> tuple[CurvePoint | None, list[OrbitSegments]] | None:
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
            if _jumps(curve, at.y, guess):
                return None, beyond.segments
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


def _jumps(curve: OrbitCurve, y: FloatArray, beyond: FloatArray) -> bool:
    """Return True if the equations jump where the events between two points change.

    Newton's method beyond a jump may converge to another branch nearby.
    """
    before = curve.solution(y).sides
    try:
        while np.linalg.norm(beyond - y) > _LOCATED:
            middle = 0.5 * (y + beyond)
            if curve.solution(middle).sides == before:
                y = middle
            else:
                beyond = middle
        change = curve.residual(beyond) - curve.residual(y)
    except FAILED:  # rounding decides about a stick there
        return False
    return bool(np.linalg.norm(change / curve.scales[: change.size]) > _JUMP)


def corner(at: CurvePoint, beyond: CurvePoint) -> FloatArray:
    """Point at which the tangents on both sides of a corner are nearest to each other."""
    lines = np.column_stack((at.direction, -beyond.direction))
    shares = np.linalg.lstsq(lines, beyond.y - at.y, rcond=None)[0]
    return np.asarray(at.y + shares[0] * at.direction)
