"""Equations of an orbit of a machine at a bifurcation of its friction.

The directions of sliding of all contacts are imposed from event to event, also where the motion
violates their conditions. The equations are therefore smooth on both sides of the bifurcation, at
which a further segment of zero duration begins or ends.
"""

from __future__ import annotations

import math
from itertools import groupby
from typing import NamedTuple, Self

import numpy as np

from wedgebrake.arrays import FloatArray
from wedgebrake.dynamics.enums import EventKind
from wedgebrake.orbits.bifurcation_types import Limit
from wedgebrake.orbits.equations.floquet import Floquet
from wedgebrake.orbits.equations.machine_flow import MachineFlow
from wedgebrake.orbits.equations.return_map import ReturnMap
from wedgebrake.orbits.equations.segments import OrbitSegments
from wedgebrake.orbits.friction_bifurcations.imposed_run import EventFunction, ImposedRun, Sides
from wedgebrake.solvers.machine.events.modes import GuardKind
from wedgebrake.solvers.machine.passage import Crossing, Passage

# Time between an event and a sampling, as a share of the sample time, that is rounding.
_AT_SAMPLING = 1e-5


class Stop(NamedTuple):
    """The end of a part of an orbit in which no direction of sliding changes.

    limit   : the condition that vanishes there; None at a fixed time or at the section
    extreme : True if its rate vanishes instead
    time    : the fixed time, as a share of the period
    """

    limit: Limit | None
    extreme: bool = False
    time: float = math.nan


class Route(NamedTuple):
    """The course of an orbit from one return to the next: sides of all contacts between stops."""

    sides: tuple[Sides, ...]
    stops: tuple[Stop, ...]


class Condition(NamedTuple):
    """A function that vanishes at the bifurcation and is positive where the orbit has these events.

    route, stop  : numbers of the route and of its stop at which it is evaluated
    limit, sides : the limit, in the mode with these sides
    sign         : -1 if the limit is exceeded where the orbit has these events
    """

    route: int
    stop: int
    limit: Limit
    sides: Sides
    sign: int = 1


class _Way(NamedTuple):
    """Result of a route, with derivatives by the point at its beginning and the times of its stops.

    stops     : values and derivatives of their equations
    condition : the same of the condition; None if it is evaluated in another route
    """

    end: FloatArray
    derivative: FloatArray
    stops: list[EventFunction]
    condition: EventFunction | None


class ModeSequence(ReturnMap):
    """Equations for the points of an orbit on the section and the times of its events.

    There is one more equation than unknowns: the ``condition`` of the bifurcation.

    text : the sequence of segments as text
    """

    differentiable = False

    def __init__(
        self, order: int, dimension: int, routes: tuple[Route, ...], condition: Condition, text: str
    ) -> None:
        super().__init__(order, dimension)
        self.routes, self.condition, self.text = routes, condition, text

    @property
    def size(self) -> int:
        """Number of unknowns: coordinates of the points, and times."""
        return self.order * self.dimension + sum(len(one.stops) for one in self.routes)

    def scales(self, unknowns: FloatArray, problem: MachineFlow) -> FloatArray:
        """Size of the orbit [rad/s], for its points, and time of a return [s], for the times."""
        points = self.order * self.dimension
        of_times = np.full(self.size - points, self.duration(unknowns, problem) / self.order)
        return np.append(super().scales(unknowns, problem)[:points], of_times)

    def residual(self, unknowns: FloatArray, problem: MachineFlow) -> FloatArray:
        """F(u)."""
        return self.linearize(unknowns, problem)[0]

    def linearize(
        self, unknowns: FloatArray, problem: MachineFlow
    ) -> tuple[FloatArray, FloatArray]:
        """F(u) and its derivative, (size + 1,) and (size + 1, size)."""
        values, matrix = np.empty(self.size + 1), np.zeros((self.size + 1, self.size))
        p, first = self.dimension, self.order * self.dimension
        for r in range(self.order):
            way, following = self._way(r, unknowns, problem), (r + 1) % self.order
            own, next_ = slice(r * p, (r + 1) * p), slice(following * p, (following + 1) * p)
            lines = slice(first, first + len(way.stops))
            columns = np.r_[own, lines]
            values[own] = way.end - unknowns[next_]
            matrix[own, columns] = way.derivative
            matrix[own, next_] -= np.eye(p)
            for line, one in zip(range(first, lines.stop), way.stops, strict=True):
                values[line], matrix[line, columns] = one
            if way.condition is not None:
                values[-1], matrix[-1, columns] = way.condition
            first = lines.stop
        return values, matrix

    def _way(self, number: int, unknowns: FloatArray, problem: MachineFlow) -> _Way:
        """The route of a return."""
        route, p, condition = self.routes[number], self.dimension, self.condition
        times, stops, at = self._times(unknowns)[number], [], None
        run = ImposedRun(problem, self._points(unknowns)[number], p + times.size)
        for k, sides in enumerate(route.sides):
            run.enter(sides, p + k - 1 if k else None)
            if k == times.size:
                run.advance(problem.period)
                break
            column = p + k
            run.advance(float(times[k]), column)
            stops.append(_at_stop(run, route.stops[k], problem, column))
            if (condition.route, condition.stop) == (number, k):
                same = sides == condition.sides
                limit = condition.limit
                row = run.row(limit) if same else run.row_in(limit, condition.sides)
                at = run.value(condition.sign * row, column)
        return _Way(*run.end(), stops, at)

    def floquet(self, unknowns: FloatArray, problem: MachineFlow) -> Floquet:
        """Floquet multipliers and test functions of the orbit with these events."""
        p, matrices = self.dimension, []
        for r in range(self.order):
            way = self._way(r, unknowns, problem)
            matrix = way.derivative[:, :p]
            if way.stops:
                stops = np.array([one.derivative for one in way.stops])
                # At the end of a curve, the times of events may not be functions of the point.
                times = np.linalg.lstsq(stops[:, p:], stops[:, :p], rcond=None)[0]
                matrix = matrix - way.derivative[:, p:] @ times
            matrices.append(matrix)
        return Floquet.of_matrices(matrices)

    def duration(self, unknowns: FloatArray, problem: MachineFlow) -> float:
        """Period of the orbit [s]."""
        if not isinstance(problem.section, Crossing):
            return self.order * problem.period
        return float(sum(one[-1] for one in self._times(unknowns)))

    def segments(self, unknowns: FloatArray, problem: MachineFlow) -> list[OrbitSegments]:  # noqa: ARG002
        """None: these equations hold on both sides of a change of the segments."""
        return []

    def levels(self, unknowns: FloatArray, problem: MachineFlow) -> list[OrbitSegments]:  # noqa: ARG002
        """None, for the same reason."""
        return []

    def sequence(self, unknowns: FloatArray, problem: MachineFlow) -> str:  # noqa: ARG002
        """Segments as text."""
        return self.text

    def doubled(self, unknowns: FloatArray) -> tuple[Self, FloatArray]:
        """Not defined: the condition would vanish twice."""
        raise NotImplementedError

    def follows_events(self, unknowns: FloatArray, problem: MachineFlow) -> bool:
        """Return True if the events of the flow are those of the routes, together or apart."""
        for route, point in zip(self.routes, self._points(unknowns), strict=True):
            found = problem.next_return(point, derivative=False)
            if passed_sides(found) != [one for one, _ in groupby(route.sides)]:
                return False
        return True

    def meets_sampling(self, unknowns: FloatArray, problem: MachineFlow) -> bool:
        """Return True if an event, or the kink of a sampled force, coincides with a sampling.

        For equations that have no solution, or no unique one.
        """
        limit = self.condition.limit
        sampled = problem.machine.contacts[limit.contact].actuation.sample_time is not None
        if limit.guard == GuardKind.FORCE_LIMIT and sampled:
            return True
        times = unknowns[self.order * self.dimension :]
        given = [one.actuation.sample_time for one in problem.machine.contacts]
        counts = [times / step for step in given if step]
        return any(bool(np.any(np.abs(n - np.round(n)) <= _AT_SAMPLING)) for n in counts)

    def _points(self, unknowns: FloatArray) -> FloatArray:
        return super()._points(unknowns[: self.order * self.dimension])

    def _times(self, unknowns: FloatArray) -> list[FloatArray]:
        """Times of the stops of each return [s]."""
        ends = np.cumsum([len(one.stops) for one in self.routes])[:-1]
        return np.split(unknowns[self.order * self.dimension :], ends)


def passed_sides(passage: Passage) -> list[Sides]:
    """The sides of all contacts in the parts of a passage between events."""
    log = passage.log[passage.log["kind"] != EventKind.BREAKPOINT]
    sides = [mode[0] for mode in passage.final.modes]
    for one in log[::-1]:
        sides[one["contact"]] = int(one["before"])
    parts = [tuple(sides)]
    for _, events in groupby(log, key=lambda one: one["time"]):
        for one in events:
            sides[one["contact"]] = int(one["after"])
        parts.append(tuple(sides))
    return [one for one, _ in groupby(parts)]


def _at_stop(run: ImposedRun, stop: Stop, flow: MachineFlow, column: int) -> EventFunction:
    """The equation of a stop."""
    if stop.limit is not None:
        return run.value(run.row(stop.limit), column, extreme=stop.extreme)
    derivative = np.zeros(run.matrix.shape[1])
    if isinstance(flow.section, Crossing):
        row = np.zeros(len(run.z))
        row[: run.states], row[-1] = flow.section.row, -flow.section.level
        return run.value(row, column)
    derivative[column] = 1.0
    return EventFunction(run.time - stop.time * flow.period, derivative)
