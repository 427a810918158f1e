"""One branch of periodic orbits, point by point (docs/numerics.md, "Branches")."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from wedgebrake.arrays import FloatArray
from wedgebrake.model.display import Result
from wedgebrake.orbits.bifurcation_types import (
    Bifurcation,
    Kind,
    OrbitMargin,
    Scenario,
    multiplier_change,
)
from wedgebrake.orbits.branches.branch_switching import CLOSED, Mark, reached, way
from wedgebrake.orbits.branches.hopf_start import hopf_value
from wedgebrake.orbits.curves import OrbitCurve, OrbitSolution
from wedgebrake.orbits.equations.equations import NoOrbitError
from wedgebrake.orbits.equations.segment_orbit import violated
from wedgebrake.orbits.friction_bifurcations.discontinuity_induced import (
    ALL_SLIP_ENDS,
    PERMANENT,
    onset_of_permanent_sticking,
    restart,
)
from wedgebrake.orbits.friction_bifurcations.event_changes import (
    SLIPS,
    bifurcation_of,
    change_between,
    corner,
    first_change,
    grazes,
    onward,
    scenario_of,
    turned,
)
from wedgebrake.orbits.friction_bifurcations.friction_condition import refined
from wedgebrake.orbits.friction_bifurcations.permanent_sticking import (
    begins_to_hold,
    onset_in_machine,
)
from wedgebrake.orbits.orbit import BranchPoint
from wedgebrake.orbits.palc import (
    FAILED,
    CurvePoint,
    NotConvergedError,
    Step,
    StepLength,
    corrected,
    ends_on_root,
    first_vanishing,
    smooth_bifurcations,
    tangent,
)
from wedgebrake.orbits.problems.machine_problem import MachineOrbitProblem

# Shortest step, as a share of the longest.
_SHORTEST = 1e-6
# Largest turn of the direction in a step (cosine); steps of this share of the longest may
# turn by any amount, as at the corner of a fold.
_TURN, _ANY_TURN = 0.95, 1e-3
# Smooth bifurcations are detected up to this share of the way to a discontinuity-induced one.
_SHORT_OF = 1.0 - 1e-6
# Scales that have changed by this factor are renewed.
_OUTGROWN = 1.5
# Share of its largest size below which an orbit is a point.
_POINT = 1e-4
# Where branches meet, distances of orbits as shares of their size, below which they may be
# equal; are equal; are equal if no orbit is found further on.
MEETS, COLLAPSED, _NEARLY = 1e-4, 1e-8, 1e-3
NOTHING_FURTHER = "no orbit was found further on"


@dataclass(repr=False)
class Branch(Result, Iterator[BranchPoint]):
    """A branch of orbits as an iterator: each ``next`` gives one more point of it.

    Its state can be read: ``points`` and ``bifurcations`` so far, the length ``step`` of the
    next step, and after it has ended the reason ``end``. ``stop`` ends it.

    start     : an orbit; its direction may be empty
    bounds    : of the parameter, (least, largest)
    rising    : whether the parameter grows at first
    largest   : longest step, in scaled unknowns; ``branch_from`` computes it from a share of the
                range of the parameter
    most      : number of points after which it ends
    points    : those found so far; given points come before the start
    met       : whether it has ended where it branches off another branch
    marks     : ends of other branches, which it does not retrace
    """

    start: BranchPoint
    bounds: tuple[float, float]
    rising: bool
    largest: float
    most: int
    points: list[BranchPoint] = field(default_factory=list)
    end: str = ""
    met: bool = False
    marks: list[Mark] = field(default_factory=list)

    def __post_init__(self) -> None:
        self._queue: deque[BranchPoint] = deque()
        # Reason why the branch ends once its queue is empty, and obstacle of the present step.
        self._next_end = self._obstacle = ""
        self._length = StepLength(self.largest)
        start = self.start
        self._curve = OrbitCurve(start)
        y = self._curve.scaled(start)
        if start.direction.size:
            self._now = corrected(self._curve, y, start.direction)
        else:
            self._now = corrected(self._curve, y, np.eye(y.size)[-1] * (1 if self.rising else -1))
            # Exactly the value of the orbit, to the last bit.
            self._now.y[-1] = start.values[-1] / self._curve.scales[-1]
        # If a system is symmetric at one value only, symmetric orbits there have no parent.
        self._odd = all(start.problem.has_odd_symmetry((bound,)) for bound in self.bounds)
        # A symmetric orbit, or an orbit of one period, meets no parent.
        self._has_parent = True
        self._has_parent = not self._parent_of(self._now, COLLAPSED)
        self._arclength = start.arclength
        first = self._point(self._now)
        if start.bifurcation is not None:
            # The Hopf point itself, which is more accurate than the smallest orbit near it.
            first = replace(first, values=start.values, bifurcation=start.bifurcation)
            if not self.bounds[0] <= self._at(self._now).values[0] <= self.bounds[1]:
                self._next_end = self._left(first)
        self._queue.append(first)

    @property
    def step(self) -> float:
        """Length of the next step, in scaled unknowns."""
        return self._length.length

    @property
    def bifurcations(self) -> list[BranchPoint]:
        """The points so far that are bifurcations."""
        return [point for point in self.points if point.bifurcation is not None]

    @property
    def jumps(self) -> bool:
        """True if the motion jumps beyond its last point."""
        last = self.points[-1].bifurcation if len(self.points) > 1 else None
        return last is not None and last.scenario is Scenario.JUMP

    def stop(self, why: str = "stopped by the user") -> None:
        """End the branch with the points found so far; ``end`` is then ``why``."""
        self._queue.clear()
        self.end = why

    def _headline(self) -> str:
        text = f"branch over {self.start.problem.names[0]}: {len(self.points)} points"
        if self.points:
            text += f" from {self.points[0].value:.6g} to {self.points[-1].value:.6g}"
        return f"{text}; bifurcations: {len(self.bifurcations)}; {self.end or 'goes on'}"

    def _rows(self) -> Iterator[tuple[str, Any, str]]:
        for point in self.bifurcations:
            yield f"{point.problem.names[0]} = {point.value:.9g}", point.bifurcation, ""

    def __next__(self) -> BranchPoint:
        while not self._queue:
            if not self.end and self._next_end:
                self.end = self._next_end
            elif not self.end and len(self.points) >= self.most:
                self.end = f"stopped after {self.most} points"
            if self.end:
                raise StopIteration
            self._advance()
        point = self._queue.popleft()
        mark = self._mark_before(point)
        if mark is not None:
            point, self._next_end = mark
            self._queue.clear()
            self.met = False
        self.points.append(point)
        return point

    def _mark_before(self, point: BranchPoint) -> tuple[BranchPoint, str] | None:
        """The start of the branch, or the end of another, if it comes before the next point."""
        if not self.points:
            return None
        marks = self.marks
        if len(self.points) > 1:
            begin, then = self.points[:2]
            marks = [Mark(begin, way(begin, then), CLOSED), *marks]
        return reached(self.points[-1], point, marks)

    def _at(self, at: CurvePoint) -> OrbitSolution:
        """The orbit at a point of the curve."""
        return self._curve.solution(at.y)

    def _point(
        self, at: CurvePoint, bifurcation: Bifurcation | None = None, length: float = 0.0
    ) -> BranchPoint:
        return BranchPoint.of(self._at(at), at.direction, self._arclength + length, bifurcation)

    def _advance(self) -> None:
        """Make one step and queue its points."""
        self._obstacle = ""
        imposes = self.start.problem.imposes
        if imposes and not self._length.exceeds(_ANY_TURN) and self._end_at_rest():
            return
        if self._length.attempt(self._try, _SHORTEST) or self._end_at_rest():
            return
        if self._turn_at_change():
            return
        parent = self._parent_of(self._now, _NEARLY)
        self.met = bool(parent)
        end = self._obstacle or NOTHING_FURTHER
        if self._curve.has_shrunk(self._now.y, _POINT):
            name, value = self.start.problem.names[0], self._at(self._now).values[0]
            end = f"the orbit has shrunk almost to a point at {name} = {value:g}"
        self._next_end = parent or end

    def _try(self) -> bool:
        """Attempt a step and return True if it succeeded."""
        before = self._now
        after, leaves = self._predict_and_correct()
        if after is None:
            return False
        turn = float(after.direction @ before.direction)
        if turn < _TURN and self._length.exceeds(_ANY_TURN):
            return False
        step = Step(self._curve, before, after)
        lacking = violated(self._at(after).margins)
        if lacking:
            return self._restart_beyond(step, lacking)
        if not self._at(after).follows_flow:
            return False
        if self._at(after).sides != self._at(before).sides:
            return self._pass_change(step)
        if self._end_at_parent(step, step.length):
            return True
        lands = not leaves and self._length.exceeds(_ANY_TURN) and ends_on_root(step)
        if lands or self._parent_of(after, COLLAPSED):
            # A shorter step ends beside the bifurcation, and the next one passes it; or the step
            # has ended on the branch that this one meets, which turns there.
            return False
        if self._curve.has_shrunk(after.y, _POINT) and self._at(after).slides_on:
            if self._length.exceeds(_ANY_TURN):
                # Equilibria solve the equations too: a long step ends on them.
                return False
            self._queue.append(self._hopf_point(self._point(before, Bifurcation(Kind.HOPF))))
            self._next_end = "the orbit shrinks to steady sliding"
            return True
        passed = self._smooth_bifurcations(step, step.length)
        self._arclength += float(np.linalg.norm(after.y - before.y))
        self._now = after
        self._queue.extend([*passed, self._point(after)])
        if leaves:
            self._next_end = self._left(self._at(after))
        if turn > 0.5 * (1.0 + _TURN):
            self._length.grow()
        self._rescale()
        return True

    def _hopf_point(self, smallest: BranchPoint) -> BranchPoint:
        """The Hopf point itself, which is more accurate than the smallest orbit near it."""
        problem, start = smallest.problem, smallest.initial
        assert isinstance(problem, MachineOrbitProblem)  # noqa: S101 - only machines slide steadily
        frequency = smallest.order / smallest.period
        try:
            found = hopf_value(problem, smallest.value, frequency, self.bounds, start)
        except NoOrbitError:
            found = None
        return smallest if found is None else replace(smallest, values=(found,))

    def _predict_and_correct(self) -> tuple[CurvePoint | None, bool]:
        """The next point, and whether it is at the end of the range; None if outside."""
        before = self._now
        low, high = (bound / self._curve.scales[-1] for bound in self.bounds)
        guess = before.y + self.step * before.direction
        if low <= guess[-1] <= high:
            after = corrected(self._curve, guess, before.direction)
            return (after if low <= after.y[-1] <= high else None), False
        # Not beyond the end of the range, where the system may not exist.
        bound = low if guess[-1] < low else high
        share = (bound - before.y[-1]) / before.direction[-1]
        guess = before.y + share * before.direction
        guess[-1] = bound
        after = corrected(self._curve, guess, np.eye(guess.size)[-1], before.direction)
        after.y[-1] = bound
        return after, True

    def _left(self, last: OrbitSolution) -> str:
        return f"left the range at {self.start.problem.names[0]} = {last.values[0]:g}"

    def _rescale(self) -> None:
        """Take the scales of the present orbit if they differ much from those of the branch."""
        here = self._at(self._now)
        curve = OrbitCurve(here)
        ratio = curve.scales / self._curve.scales
        # Scales are kept while an orbit shrinks, so that its end is reached in few steps.
        shrinks = here.problem.self_excited and np.all(ratio <= 1.0)
        if shrinks or (np.all(ratio < _OUTGROWN) and np.all(ratio * _OUTGROWN > 1.0)):
            return
        direction = self._now.direction / ratio
        direction /= np.linalg.norm(direction)
        self._now = CurvePoint(curve.scaled(here), self._now.matrix * ratio, direction)
        self._curve = curve

    def _end_at_parent(self, step: Step[OrbitCurve], until: float) -> bool:
        """Return True if it has met the branch that it branches off, and then retraces itself.

        It turns there, and the halves of the orbit change places. A turn alone may be a fold, and
        a turn and a fold in the same step cancel. The equations are singular
        where branches meet, and points between may be on the other one: no root is located, but
        steps are shortened until one of their ends is near enough.
        """
        if not self._has_parent:
            return False
        after = step.at(until)
        turned = step.start.direction[-1] * after.direction[-1] < 0.0
        halves = self._half_difference(step.start) * self._half_difference(after)
        changed = float(np.sum(halves)) < 0.0
        if not turned and not changed:
            return False
        ends = [(one, self._parent_of(one)) for one in (step.start, after)]
        near = [(one, parent) for one, parent in ends if parent]
        if not near:
            if changed:
                raise NotConvergedError
            return False
        at, parent = near[0]
        if at is not step.start:
            # A multiplier only touches 1 where the branch turns.
            passed = self._smooth_bifurcations(step, until, (Kind.FOLD, Kind.BRANCH_POINT))
            length = float(np.linalg.norm(at.y - step.start.y))
            self._queue.extend([*passed, self._point(at, length=length)])
        self.met, self._next_end = True, parent
        return True

    def _half_difference(self, at: CurvePoint) -> FloatArray:
        """Difference of the orbit's halves, or to its mirror image; it vanishes on a parent."""
        solution = self._at(at)
        if solution.order % 2 == 0:
            return solution.section.half_difference(solution.points)
        return solution.mirror_difference(MEETS) if self._odd else np.zeros(0)

    def _parent_of(self, at: CurvePoint, tolerance: float = MEETS) -> str:
        """The bifurcation where an orbit repeats after fewer returns, or is symmetric."""
        if not self._has_parent:
            return ""
        solution = self._at(at)
        fewer = solution.prime_order(tolerance)
        if fewer < solution.order:
            return solution.problem.doubling_of(fewer)
        if self._odd and solution.is_symmetric(tolerance):
            return "symmetry breaking of a symmetric orbit"
        return ""

    def _end_at_rest(self) -> bool:
        """Queue the onset of permanent sticking as the last point, if it is close."""
        if self.start.problem.imposes:
            return self._end_as_held(self._now)
        found = onset_of_permanent_sticking(self._curve, self._now)
        if found is None:
            return False
        last = replace(
            self._point(self._now), values=found.values, unknowns=found.unknowns,
            bifurcation=Bifurcation(Kind.ADDING_SLIDING, ALL_SLIP_ENDS),
        )  # fmt: skip
        self._queue.append(last)
        self._next_end = PERMANENT
        return True

    def _end_as_held(self, last: CurvePoint, beyond: CurvePoint | None = None) -> bool:
        """Queue the onset of permanent sticking of a contact of a machine, if it is close.

        beyond : a point just behind a change of the events
        """
        here = self._at(last)
        onset = onset_in_machine(here)
        if onset is None or (onset[1] - here.values[0]) * last.direction[-1] < 0.0:
            held = None if beyond is None else begins_to_hold(here, self._at(beyond))
            if held is None:
                return False
            onset = held, here.values[0]
        name = here.system.machine.contacts[onset[0]].name
        effect = f"all slip of {name} ends, permanent sticking begins"
        point = self._point(last, Bifurcation(Kind.ADDING_SLIDING, effect))
        self._queue.append(point.moved((onset[1],)))
        self._next_end = f"permanent sticking of {name}: the angle that it holds is arbitrary"
        return True

    def _smooth_bifurcations(
        self, step: Step[OrbitCurve], until: float, excluded: tuple[Kind, ...] = ()
    ) -> list[BranchPoint]:
        """The bifurcations inside a step beyond which the branch is smooth, without some kinds."""
        found = [*smooth_bifurcations(step, until), *grazes(step, until)]
        points = []
        for s, one in sorted(found, key=lambda one: one[0]):
            if one.kind not in excluded:
                at = step.at(s)
                length = float(np.linalg.norm(at.y - step.start.y))
                points.append(refined(self._point(at, one, length)))
        return points

    def _pass_change(self, step: Step[OrbitCurve]) -> bool:
        """Queue the bifurcation at which events change within a step, and continue behind it."""
        low, high = first_change(step, SLIPS, (0.0, step.length))
        if self._end_at_parent(step, low):
            return True
        at, beyond = step.at(low), step.at(high)
        beyond = onward(step.curve, self._on_own_side(beyond.y, step.start.direction))
        passed = self._smooth_bifurcations(step, low) if low > 0.0 else []
        self._arclength += float(np.linalg.norm(beyond.y - step.start.y))
        self._queue.extend(passed)
        if self._end_as_held(at, beyond):
            return True
        scenario = scenario_of(at, beyond)
        found = change_between(self._at(at), self._at(beyond), scenario)
        if found is not None:
            self._queue.append(refined(self._point(at, found)))
        if scenario is Scenario.FOLD:
            # The steps have become short in front of it.
            self._length = StepLength(self.largest)
        self._now = beyond
        self._queue.append(self._point(beyond))
        self._rescale()
        return True

    def _on_own_side(self, y: FloatArray, along: FloatArray) -> CurvePoint:
        """Return the point at y with the matrix of its own side of a change of events.

        The matrix of the last step of Newton's method may belong to the other side.
        """
        matrix = self._curve.linearize(y)[1]
        return CurvePoint(y, matrix, tangent(matrix, along))

    def _turn_at_change(self) -> bool:
        """Queue a non-smooth fold or a jump where events change, if it is here."""
        if not self._at(self._now).sides:
            return False
        try:
            self._now = self._on_own_side(self._now.y, self._now.direction)
        except FAILED:
            return False
        found = turned(self._curve, self._now)
        if found is None:
            return False
        point, segments = found
        here = self._at(self._now)
        if point is None:
            names = here.system.coords.get("contact", ())
            known = bifurcation_of(here.segments, segments, names, Scenario.JUMP)
            if known is None:
                return False
            self._queue.append(refined(self._point(self._now, known)))
            self._next_end = f"{known.kind.value}, beyond which the motion jumps"
            return True
        known = change_between(here, self._at(point), scenario_of(self._now, point))
        if known is not None:
            y = corner(self._now, point)
            there = replace(self._point(self._now, known), values=self._curve.solution(y).values)
            self._queue.append(refined(there))
        self._arclength += float(np.linalg.norm(point.y - self._now.y))
        self._now, self._length = point, StepLength(self.largest)
        self._queue.append(self._point(point))
        return True

    def _restart_beyond(self, step: Step[OrbitCurve], lacking: list[OrbitMargin]) -> bool:
        """Queue a discontinuity-induced bifurcation and continue with the segments beyond."""
        found = first_vanishing(step, lacking)
        if found is None:
            return False
        s, margins = found
        at = step.at(s)
        if self._end_at_parent(step, s):
            return True
        came = float(at.y[-1] - step.start.y[-1])
        beyond = restart(self._curve, came, at, margins, self.largest)
        if beyond is None:
            if not self._length.exceeds(_ANY_TURN):
                # A shorter step may still succeed.
                self._obstacle = "a change of the sequence of segments that is not known"
            return False
        # Excludes poles that multipliers may have there.
        passed = self._smooth_bifurcations(step, _SHORT_OF * s)
        self._arclength += float(np.linalg.norm(at.y - step.start.y))
        point = self._point(at, beyond.bifurcation)
        self._queue.extend(passed)
        if beyond.curve is None or beyond.point is None:
            self._queue.append(point)
            self._next_end = beyond.why
            return True
        self._curve, self._now = beyond.curve, beyond.point
        change = multiplier_change(point.tests, self._at(self._now).tests)
        located = replace(point, bifurcation=replace(beyond.bifurcation, change=change))
        self._queue.extend([located, self._point(self._now)])
        self._length = StepLength(self.largest)
        return True
