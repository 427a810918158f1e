"""Equations of a bifurcation of the friction of a machine, derived from an orbit at it."""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import groupby
from typing import NamedTuple

import numpy as np

from wedgebrake.arrays import FloatArray
from wedgebrake.dynamics.enums import EventKind
from wedgebrake.orbits.bifurcation_types import Changed, Kind, Limit
from wedgebrake.orbits.curves import OrbitCurve, OrbitSolution
from wedgebrake.orbits.equations.machine_flow import MachineFlow
from wedgebrake.orbits.equations.return_map import segments_as_text
from wedgebrake.orbits.equations.segments import OrbitSegments, of_slips
from wedgebrake.orbits.friction_bifurcations.imposed_run import ImposedRun, Sides
from wedgebrake.orbits.friction_bifurcations.mode_sequence import (
    Condition,
    ModeSequence,
    Route,
    Stop,
)
from wedgebrake.orbits.orbit import BranchPoint
from wedgebrake.orbits.palc import FAILED, CurvePoint, newton
from wedgebrake.solvers.machine.events.modes import GuardKind
from wedgebrake.solvers.machine.passage import Crossing

# Samples of each part of an orbit in which a condition may have its least value.
_SAMPLES = 48
# Share of its largest value below which a condition vanishes at an event.
_VANISHES = 1e-4
# Duration of a segment, as a share of the period, that is rounding; and largest ratio of the
# durations of segments that end together.
_ROUNDING, _ALIKE = 1e-6, 10.0
# Largest time between a segment that ends and the place where the condition vanishes, as a share of
# the period.
_NEAR = 0.02
# Distance, in scaled unknowns, at which the events of the flow are compared.
_BESIDE = 1e-6
# Largest scaled change of the parameter by which a bifurcation is refined.
_REFINED = 1e-4


class _Event(NamedTuple):
    """A change of the side of a contact.

    time  : since the return [s]
    total : since the beginning of the orbit [s]
    """

    route: int
    time: float
    total: float
    contact: int
    before: int
    after: int

    @property
    def limit(self) -> Limit:
        """The condition that vanishes there, unless another condition has caused the event."""
        guard = GuardKind.ZERO_SPEED if self.before else GuardKind.HOLDING_LIMIT
        return Limit(self.contact, guard, self.before or -self.after)


class _Part(NamedTuple):
    """A part of a route between events: its end since the return [s], and the events there."""

    sides: Sides
    end: float
    events: list[_Event]


class _Sample(NamedTuple):
    """A condition at an instant of a part of an orbit, in the mode with given sides.

    row : factors of the states and inputs
    """

    route: int
    part: int
    time: float
    limit: Limit
    sides: Sides
    row: FloatArray
    value: float
    rate: float


class _Place(NamedTuple):
    """A place at which a condition may vanish.

    stop : number of the stop there, or of the one inserted at ``time``
    sign : as in ``Condition``
    """

    sample: _Sample
    value: float
    stop: int
    time: float | None = None
    sign: int = 1

    def total(self, begins: list[float]) -> float:
        """Time since the beginning of the orbit [s], from those of its routes."""
        return begins[self.sample.route] + (self.sample.time if self.time is None else self.time)


class _Survey:
    """Samples of an orbit.

    inside  : conditions that may vanish at the bifurcation, in all parts
    ends    : those of events at the ends of parts, in the mode before them, by (route, part)
    held    : at reversals of the contact: the limit that keeps it from sticking
    largest : largest magnitude of each state and input
    """

    def __init__(
        self, flow: MachineFlow, points: FloatArray, routes: list[list[_Part]], changed: Changed
    ) -> None:
        self.changed = changed
        self.inside: list[_Sample] = []
        self.ends: dict[tuple[int, int], list[_Sample]] = {}
        self.held: list[_Sample] = []
        self.largest = np.zeros(len(flow.imposed.state.z))
        for r, parts in enumerate(routes):
            run, begin = ImposedRun(flow, points[r], points.shape[1]), 0.0
            for k, part in enumerate(parts):
                run.enter(part.sides)
                self._sample(run, (r, k), part.sides)
                for time in np.linspace(begin, part.end, _SAMPLES + 1)[1:]:
                    run.advance(float(time))
                    self._sample(run, (r, k), part.sides)
                self._end(run, (r, k), parts[k : k + 2])
                begin = part.end

    def share(self, one: _Sample, value: float) -> float:
        """Magnitude of a value as a share of the largest one that its condition can have."""
        return abs(value) / float(np.abs(one.row) @ self.largest)

    def _sample(self, run: ImposedRun, at: tuple[int, int], sides: Sides) -> None:
        self.largest = np.maximum(self.largest, np.abs(run.z[:, 0]))
        for limit in self._limits(sides[self.changed.contact]):
            self.inside.extend(_sampled(run, at, limit, sides, run.row(limit)))

    def _limits(self, side: int) -> list[Limit]:
        """Conditions of the contact that may vanish where it slides in a direction or sticks."""
        number, touched = self.changed.contact, self.changed.limit
        if touched is not None:
            backwards = touched.guard == GuardKind.NEXT_LINE and side * touched.level <= 0
            return [] if backwards else [touched]
        if side != 0:
            return [Limit(number, GuardKind.ZERO_SPEED, side)]
        return [Limit(number, GuardKind.HOLDING_LIMIT, sign) for sign in (1, -1)]

    def _end(self, run: ImposedRun, at: tuple[int, int], parts: list[_Part]) -> None:
        part, following, number = parts[0], parts[-1].sides, self.changed.contact
        self.ends[at] = [
            sample
            for event in part.events
            for sample in _sampled(run, at, event.limit, part.sides, run.row(event.limit))
        ]
        for event in part.events:
            if event.contact == number and event.after == -event.before:
                limit = Limit(number, GuardKind.HOLDING_LIMIT, event.before)
                # Others may begin or end a slip at the same instant.
                for other in {part.sides, following}:
                    sides = tuple(0 if k == number else side for k, side in enumerate(other))
                    self.held.extend(_sampled(run, at, limit, sides, run.row_in(limit, sides)))


def _sampled(
    run: ImposedRun, at: tuple[int, int], limit: Limit, sides: Sides, row: FloatArray
) -> Iterator[_Sample]:
    """Yield the sample of a condition now; none if a self-locking contact has no limit."""
    if np.all(np.isfinite(row)):
        value, rate = (float(row @ run.z[:, k]) for k in (0, 1))
        yield _Sample(*at, run.time, limit, sides, row, value, rate)


def at_bifurcation(solution: OrbitSolution, kind: Kind, changed: Changed) -> OrbitSolution:
    """The orbit at a bifurcation of friction, as a solution of equations with its condition.

    Returns the given solution if no such condition is found.
    """
    flow, number = solution.kernel_problem, changed.contact
    points = solution.equations.whole(solution.unknowns)[1].reshape(solution.order, -1)
    passages = [flow.next_return(one, derivative=False) for one in points]
    durations = [one.duration for one in passages]
    begins = [0.0, *np.cumsum(durations).tolist()]
    events = [
        _Event(r, float(one["time"]), float(one["time"]) + begins[r], int(one["contact"]),
               int(one["before"]), int(one["after"]))
        for r, passage in enumerate(passages)
        for one in passage.log
        if one["kind"] != EventKind.BREAKPOINT
    ]  # fmt: skip
    at_end = [mode[0] for mode in passages[-1].final.modes]
    near: list[float] = []
    for one, sides in enumerate(changed.sides):
        changes = _segments(events, at_end, begins[-1])[one].sides != sides
        own = kind if one == number else None
        short = _short(events, own, one, begins[-1], changes=changes)
        if one == number:
            near = [begin.total for begin, _ in short]
        events = _without(events, short)
    routes = _parts(events, durations, at_end)
    survey = _Survey(flow, points, routes, changed)
    places = [
        one for one in _places(survey, routes, kind)
        if not near or min(_apart(one.total(begins), at, begins[-1]) for at in near) < _NEAR
    ]  # fmt: skip
    if not places:
        return solution
    found = min(places, key=lambda one: survey.share(one.sample, one.value))
    ways: list[Route] = []
    times: list[float] = []
    for r, parts in enumerate(routes):
        stops = [_stop(survey, flow, r, k, part.end) for k, part in enumerate(parts[:-1])]
        between, ends = [part.sides for part in parts], [part.end for part in parts]
        if isinstance(flow.section, Crossing):
            stops.append(Stop(None))
        else:
            ends.pop()
        if found.time is not None and found.sample.route == r:
            between.insert(found.stop, between[found.stop])
            stops.insert(found.stop, Stop(found.sample.limit, extreme=True))
            ends.insert(found.stop, found.time)
        ways.append(Route(tuple(between), tuple(stops)))
        times.extend(ends)
    at = found.sample
    condition = Condition(at.route, found.stop, at.limit, at.sides, found.sign)
    text = segments_as_text(_segments(events, at_end, begins[-1]), flow.machine)
    equations = ModeSequence(solution.order, points.shape[1], tuple(ways), condition, text)
    unknowns = np.append(points, times)
    return OrbitSolution(solution.problem, solution.values, equations, unknowns)


def refined(point: BranchPoint) -> BranchPoint:
    """A bifurcation with the value of the parameter at which its condition vanishes.

    The events of the flow change slightly beyond: a slip or stick is found once its speed exceeds
    rounding. Returns the given point if there is no such condition nearby.
    """
    given = point.bifurcation
    if given is None or given.changed is None:
        return point
    try:
        start = at_bifurcation(point, given.kind, given.changed)
        if not isinstance(start.equations, ModeSequence):
            return point
        curve = OrbitCurve(start)
        begin = curve.scaled(start)
        found = newton(curve, begin, None)[0]
    except FAILED:
        return point
    if abs(found[-1] - begin[-1]) > _REFINED:
        return point
    return point.moved(curve.solution(found).values)


def departs(curve: OrbitCurve, at: CurvePoint) -> bool:
    """Return True if the events of the flow beside a point are not those of its equations.

    They are compared at an orbit a small distance away, on the side where the condition is
    positive.
    """
    step = np.zeros(at.y.size)
    step[-2] = 1.0
    along = np.linalg.solve(np.vstack((at.matrix, at.direction)), step)
    beside = curve.solution(at.y + _BESIDE / np.linalg.norm(along) * along)
    return not beside.equations.follows_events(beside.unknowns, beside.kernel_problem)


def _apart(one: float, other: float, period: float) -> float:
    """Distance of two times on an orbit, as a share of its period."""
    return abs(math.remainder(one - other, period)) / period


def _short(
    events: list[_Event], kind: Kind | None, number: int, period: float, *, changes: bool
) -> list[tuple[_Event, _Event]]:
    """Beginning and end of the segments of a contact that end at a bifurcation.

    kind    : of the bifurcation; None for any
    changes : True if a segment must end; otherwise only those whose duration is rounding are found

    On a symmetric orbit two segments end at once.
    """
    own = [one for one in events if one.contact == number]
    found = [
        ((end.total - begin.total) % period, (begin, end))
        for begin, end in zip(own, [*own[1:], *own[:1]], strict=True)
        if of_slips(begin.before, begin.after, end.after) in ([kind] if kind else list(Kind))
    ]
    longest = _ROUNDING * period
    if changes:
        longest = max(longest, _ALIKE * min((length for length, _ in found), default=0.0))
    return [ends for length, ends in found if length <= longest]


def _without(events: list[_Event], short: list[tuple[_Event, _Event]]) -> list[_Event]:
    """Events without those of some segments."""
    for begin, end in short:
        if begin.before == end.after:
            events = [one for one in events if one not in (begin, end)]
        else:
            joined = begin._replace(after=end.after)
            events = [joined if one == begin else one for one in events if one != end]
    return events


def _parts(events: list[_Event], durations: list[float], at_end: list[int]) -> list[list[_Part]]:
    """The parts of each route. The sides at the beginning are those at the end of the orbit."""
    sides, routes = list(at_end), []
    for r, duration in enumerate(durations):
        parts = []
        own = [one for one in events if one.route == r]
        for time, group in groupby(own, key=lambda one: one.time):
            together = list(group)
            parts.append(_Part(tuple(sides), time, together))
            for one in together:
                sides[one.contact] = one.after
        routes.append([*parts, _Part(tuple(sides), duration, [])])
    return routes


def _segments(events: list[_Event], at_end: list[int], period: float) -> list[OrbitSegments]:
    """Slips and sticks of each contact."""
    return [
        OrbitSegments.between(
            [(one.total, one.after) for one in events if one.contact == number], period, side
        )
        for number, side in enumerate(at_end)
    ]


def _stop(survey: _Survey, flow: MachineFlow, route: int, part: int, end: float) -> Stop:
    """The end of a part: the condition that vanishes there, or the time of a jump."""
    found = min(survey.ends[route, part], key=lambda one: survey.share(one, one.value))
    if survey.share(found, found.value) <= _VANISHES:
        return Stop(found.limit)
    return Stop(None, time=end / flow.period)


def _places(survey: _Survey, routes: list[list[_Part]], kind: Kind) -> Iterator[_Place]:
    """Places at which the condition of a bifurcation may vanish."""
    if kind is Kind.CROSSING_SLIDING:
        for one in survey.held:
            yield _Place(one, one.value, one.part, sign=-1)
        return
    for limit in sorted({one.limit for one in survey.inside}):
        before: _Sample | None = None
        for one in survey.inside:
            if one.limit != limit:
                continue
            parts = routes[one.route]
            if before is not None and (before.route, before.part) == (one.route, one.part):
                if _is_watched(limit, kind) and _turns(before, one, parts):
                    yield _least_between(before, one)
            elif one.part > 0 and _begins(parts[one.part - 1], one, kind):
                yield _Place(one, one.value, one.part - 1)
            before = one


def _turns(one: _Sample, other: _Sample, parts: list[_Part]) -> bool:
    """Return True if the rate of a condition becomes positive between two samples.

    At an event of the contact itself, the sign of the rate may be due to rounding.
    """
    begin, number = one.part - 1, one.limit.contact
    starts = begin >= 0 and one.time == parts[begin].end and _own(parts[begin], number)
    ends = other.time == parts[one.part].end and _own(parts[one.part], number)
    return one.rate < 0.0 <= other.rate and not starts and not ends


def _own(part: _Part, number: int) -> list[_Event]:
    """Events of a contact at the end of a part."""
    return [one for one in part.events if one.contact == number]


def _least_between(one: _Sample, other: _Sample) -> _Place:
    """The least value of a condition whose rate changes its sign between two samples."""
    ahead = (other.time - one.time) * one.rate / (one.rate - other.rate)
    return _Place(one, one.value + 0.5 * one.rate * ahead, one.part, one.time + ahead)


def _begins(before: _Part, first: _Sample, kind: Kind) -> bool:
    """Return True if a condition may vanish at the beginning of a part.

    Either a stick of the contact begins there, and its torque has jumped to the limit; or, at an
    event of another contact, the condition jumps to its least value or its rate becomes positive.
    """
    own = _own(before, first.limit.contact)
    if kind is Kind.SWITCHING_SLIDING:
        return any(one.after == 0 and one.before == first.limit.sign for one in own)
    return not own and first.rate >= 0.0 and _is_watched(first.limit, kind)


def _is_watched(limit: Limit, kind: Kind) -> bool:
    """Return True if a condition vanishes at its least value at a kind of bifurcation."""
    held = limit.guard == GuardKind.HOLDING_LIMIT
    return held == (kind is Kind.ADDING_SLIDING)
