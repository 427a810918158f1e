"""One branch of periodic orbits, point by point (docs/theory.md, section 13)."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from wedgebrake.continuation.bifurcation_detection import (
    Solution,
    Step,
    first_end,
    smooth_bifurcations,
    tests,
)
from wedgebrake.continuation.bifurcation_types import Kind, Scenario
from wedgebrake.continuation.branch_restart import ALL_SLIP_ENDS, PERMANENT, go_beyond
from wedgebrake.continuation.curves import OrbitCurve
from wedgebrake.continuation.deduplication import CLOSED, Mark, reached, way
from wedgebrake.continuation.discontinuity_induced import Margin, violated
from wedgebrake.continuation.equations import FloatArray, NoOrbitError, multipliers
from wedgebrake.continuation.onset import onset
from wedgebrake.continuation.palc import NotConvergedError, newton, tangent
from wedgebrake.continuation.point import Bifurcation, BranchPoint
from wedgebrake.continuation.segment_bvp import Chain, goes_through
from wedgebrake.continuation.symmetry import between_halves, is_odd, is_symmetric, met, prime_order
from wedgebrake.model.display import Result

# Steps as shares of the largest: the first one, and the one that is too small to go on with.
_FIRST, _SMALLEST = 0.1, 1e-6
_GROW, _SHRINK = 1.5, 0.5
# The direction may turn by so much in a step (cosine); steps of this share of the largest may
# turn as they like, as at the corner of a fold.
_TURN, _ANY_TURN = 0.95, 1e-3
# Bifurcations of the derivative are looked for up to this share of the way to one of friction.
_SHORT_OF = 1.0 - 1e-6
# Scales that have changed by this factor are renewed.
_OUTGROWN = 1.5
# Where branches meet, orbits nearer than this share of their size may be one; nearer than the
# second, they are; nearer than the third, where nothing is found further on.
_MEETS, _COLLAPSED, _NEARLY = 1e-4, 1e-8, 1e-3
_STOPPED = (NotConvergedError, NoOrbitError)


@dataclass(repr=False)
class Branch(Result, Iterator[BranchPoint]):
    """A branch of orbits as an iterator: each ``next`` gives one more point of it.

    Its state can be watched: ``points`` and ``bifurcations`` so far, the ``step`` that comes
    next, and, once it has ended, ``end``, which says why. ``stop`` ends it.

    start     : an orbit, as a point without direction
    bounds    : of the parameter, (least, greatest)
    rising    : whether the parameter grows at first
    largest   : longest step, in scaled unknowns (a share of the range of the parameter)
    most      : points, after which it ends
    points    : what is there already, before the start
    met       : whether it has ended where it branches off another one
    marks     : ends of other branches, which it does not go over
    """

    start: BranchPoint
    bounds: tuple[float, float]
    rising: bool
    largest: float = 0.02
    most: int = 5000
    points: list[BranchPoint] = field(default_factory=list)
    end: str = ""
    met: bool = False
    marks: list[Mark] = field(default_factory=list)

    def __post_init__(self) -> None:
        self._queue: deque[BranchPoint] = deque()
        # Why the branch ends once its points are given out, and what held up the present step.
        self._ahead = self._hindrance = ""
        self.step = _FIRST * self.largest
        start = self.start
        self._equations = start.equations
        self._curve = OrbitCurve.through(
            start.equations, start.family, start.unknowns, start.values
        )
        y = self._curve.scaled(start.unknowns, start.values)
        held = np.zeros(y.size)
        held[-1] = 1.0 if self.rising else -1.0
        along = start.direction if start.direction.size else held
        y, matrix = newton(self._curve, y, along)
        # Not by the last bit off the value that it is an orbit of.
        y[-1] = start.values[-1] / self._curve.scales[-1] if not start.direction.size else y[-1]
        self._now = Solution(y, matrix, tangent(matrix, along))
        # At the one value where a system is symmetric its orbits are; that is no meeting.
        self._odd = all(is_odd(start.family.system((bound,))) for bound in self.bounds)
        # Of an orbit that is symmetric, or of one period, nothing is met.
        self._leaves = True
        self._leaves = not self._parent_of(self._now, _COLLAPSED)
        self._length = self.start.arclength
        self._queue.append(self._point(self._now))

    @property
    def bifurcations(self) -> list[BranchPoint]:
        """The points so far that are bifurcations."""
        return [point for point in self.points if point.bifurcation is not None]

    @property
    def jumps(self) -> bool:
        """Whether its last point is one beyond which the motion jumps."""
        told = self.points[-1].bifurcation if len(self.points) > 1 else None
        return told is not None and told.scenario is Scenario.JUMP

    def stop(self, why: str = "stopped by the user") -> None:
        """No point comes after those that are there; ``end`` then says ``why``."""
        self._queue.clear()
        self.end = why

    def _headline(self) -> str:
        text = f"branch over {self.start.family.names[0]}: {len(self.points)} points"
        if self.points:
            text += f" from {self.points[0].value:.6g} to {self.points[-1].value:.6g}"
        return f"{text}; bifurcations: {len(self.bifurcations)}; {self.end or 'goes on'}"

    def _rows(self) -> Iterator[tuple[str, Any, str]]:
        for point in self.bifurcations:
            yield f"{point.family.names[0]} = {point.value:.9g}", point.bifurcation, ""

    def __next__(self) -> BranchPoint:
        while not self._queue:
            if self.end:
                raise StopIteration
            if self._ahead:
                self.end = self._ahead
                raise StopIteration
            if len(self.points) >= self.most:
                self.end = f"stopped after {self.most} points"
                raise StopIteration
            self._advance()
        point = self._queue.popleft()
        over = self._goes_over(point)
        if over is not None:
            point, self._ahead = over
            self._queue.clear()
            self.met = False
        self.points.append(point)
        return point

    def _goes_over(self, point: BranchPoint) -> tuple[BranchPoint, str] | None:
        """Where it comes, before the next point, to its own begin or the end of another branch."""
        if not self.points:
            return None
        ahead = self.marks
        if len(self.points) > 1:
            begin, then = self.points[:2]
            ahead = [Mark(begin, way(begin, then), CLOSED), *ahead]
        return reached(self.points[-1], point, ahead)

    def _point(
        self, at: Solution, bifurcation: Bifurcation | None = None, length: float = 0.0
    ) -> BranchPoint:
        unknowns, values = self._curve.unscaled(at.y)
        trace, determinant = self._curve.invariants(at.y)
        return BranchPoint(
            family=self.start.family,
            values=values,
            equations=self._equations,
            unknowns=unknowns,
            multipliers=multipliers(trace, determinant),
            direction=at.direction,
            arclength=self._length + length,
            bifurcation=bifurcation,
        )

    def _advance(self) -> None:
        """One step: its points go into the queue."""
        self._hindrance = ""
        while self.step >= _SMALLEST * self.largest:
            try:
                done = self._try()
            except _STOPPED:
                done = False
            if done:
                return
            self.step *= _SHRINK
        if self._comes_to_rest():
            return
        where = self._parent_of(self._now, _NEARLY)
        self.met = bool(where)
        self._ahead = where or self._hindrance or "no orbit was found further on"

    def _try(self) -> bool:
        """One attempt at a step; whether it led on."""
        before = self._now
        low, high = (bound / self._curve.scales[-1] for bound in self.bounds)
        guess = before.y + self.step * before.direction
        outside = not low <= guess[-1] <= high
        if outside:
            # To the end of the range and no further: beyond, there may be no such system.
            bound = low if guess[-1] < low else high
            share = (bound - before.y[-1]) / before.direction[-1]
            guess, held = before.y + share * before.direction, np.zeros(guess.size)
            held[-1] = 1.0
            guess[-1] = bound
            y, matrix = newton(self._curve, guess, held)
            y[-1] = bound
        else:
            y, matrix = newton(self._curve, guess, before.direction)
            if not low <= y[-1] <= high:
                return False
        after = Solution(y, matrix, tangent(matrix, before.direction))
        turn = float(after.direction @ before.direction)
        if turn < _TURN and self.step > _ANY_TURN * self.largest:
            return False
        step = Step(self._curve, before, after)
        lacking = violated(self._curve.margins(after.y))
        if lacking:
            return self._end_of_chain(step, lacking)
        if isinstance(self._equations, Chain):
            unknowns, values = self._curve.unscaled(after.y)
            problem = self.start.family.problem(values)
            if not goes_through(self._equations, unknowns, problem):
                return False
        if self._meets_parent(step, step.length):
            return True
        if self._parent_of(after, _COLLAPSED):
            # Over to the branch that this one meets: it turns there, in a shorter step.
            return False
        passed = self._passed(step, step.length)
        self._length += float(np.linalg.norm(after.y - before.y))
        self._now = after
        self._queue.extend([*passed, self._point(after)])
        if outside:
            self._ahead = f"left the range at {self.start.family.names[0]} = {self._value(after):g}"
        grown = _GROW if turn > 0.5 * (1.0 + _TURN) else 1.0
        self.step = min(self.largest, grown * self.step)
        self._rescale()
        return True

    def _rescale(self) -> None:
        """Measure in the scales of the present orbit, if it has outgrown those of the branch."""
        unknowns, values = self._curve.unscaled(self._now.y)
        curve = OrbitCurve.through(self._equations, self.start.family, unknowns, values)
        ratio = curve.scales / self._curve.scales
        if np.all(ratio < _OUTGROWN) and np.all(ratio * _OUTGROWN > 1.0):
            return
        direction = self._now.direction / ratio
        direction /= np.linalg.norm(direction)
        self._now = Solution(curve.scaled(unknowns, values), self._now.matrix * ratio, direction)
        self._curve = curve

    def _meets_parent(self, step: Step[OrbitCurve], until: float) -> bool:
        """Whether it goes through where it branches off another, and beyond back as it came.

        It turns there, and the halves of the orbit change places. A turn alone may be a fold, and
        with a fold in the same step there is none from end to end. The equations are singular
        where branches meet, and points between may be on the other one: no root is looked for,
        but steps are shortened until one of their ends is near enough.
        """
        if not self._leaves:
            return False
        after = step.at(until)
        turned = step.start.direction[-1] * after.direction[-1] < 0.0
        changed = float(np.sum(self._gap(step.start) * self._gap(after))) < 0.0
        if not turned and not changed:
            return False
        ends = [(one, self._parent_of(one)) for one in (step.start, after)]
        near = [(one, where) for one, where in ends if where]
        if not near:
            if changed:
                raise NotConvergedError
            return False
        at, where = near[0]
        if at is not step.start:
            # A multiplier just comes to 1 where it turns.
            passed = self._passed(step, until, (Kind.FOLD, Kind.BRANCH_POINT))
            length = float(np.linalg.norm(at.y - step.start.y))
            self._queue.extend([*passed, self._point(at, length=length)])
        self.met, self._ahead = True, where
        return True

    def _gap(self, at: Solution) -> FloatArray:
        """From half an orbit to the other, or to its mirror image; it vanishes on a parent."""
        unknowns, values = self._curve.unscaled(at.y)
        family, equations = self.start.family, self._equations
        system = family.system(values)
        if equations.order % 2 == 0:
            points = equations.points(unknowns, family.problem(values))
            return between_halves(points, system.excitation.angular_frequency)
        return equations.from_mirror(unknowns, system, _MEETS) if self._odd else np.zeros(0)

    def _parent_of(self, at: Solution, tolerance: float = _MEETS) -> str:
        """Where a solution is one of fewer periods, or symmetric: which bifurcation is met."""
        if not self._leaves:
            return ""
        unknowns, values = self._curve.unscaled(at.y)
        family = self.start.family
        points = self._equations.points(unknowns, family.problem(values))
        omega = family.system(values).excitation.angular_frequency
        fewer = prime_order(points, omega, tolerance)
        if fewer < self._equations.order:
            return met(fewer)
        if self._odd and is_symmetric(
            self._equations, unknowns, self.start.family, values, tolerance
        ):
            return "symmetry breaking of a symmetric orbit"
        return ""

    def _comes_to_rest(self) -> bool:
        """Whether permanent sticking begins just ahead: then its onset is the last point."""
        found = onset(self._curve, self._now)
        if found is None:
            return False
        unknowns, value = found
        last = self._point(self._now)
        bifurcation = Bifurcation(Kind.ADDING_SLIDING, ALL_SLIP_ENDS)
        self._queue.append(
            replace(last, values=(value,), unknowns=unknowns, bifurcation=bifurcation)
        )
        self._ahead = PERMANENT
        return True

    def _value(self, at: Solution) -> float:
        return self._curve.unscaled(at.y)[1][0]

    def _passed(
        self, step: Step[OrbitCurve], until: float, but: tuple[Kind, ...] = ()
    ) -> list[BranchPoint]:
        """The bifurcations of the derivative inside a step, but those of some kinds."""
        points = []
        for s, kind in smooth_bifurcations(step, until):
            if kind in but:
                continue
            at = step.at(s)
            found = kind
            if kind is Kind.BRANCH_POINT:
                unknowns, values = self._curve.unscaled(at.y)
                if is_symmetric(self._equations, unknowns, self.start.family, values):
                    found = Kind.SYMMETRY_BREAKING
            length = float(np.linalg.norm(at.y - step.start.y))
            points.append(self._point(at, Bifurcation(found), length))
        return points

    def _end_of_chain(self, step: Step[OrbitCurve], lacking: list[Margin]) -> bool:
        """A bifurcation of friction: to its point, and on with the chain beyond."""
        found = first_end(step, lacking)
        if found is None:
            return False
        s, ends = found
        at = step.at(s)
        assert isinstance(self._equations, Chain)  # noqa: S101 - others have no margins
        if self._meets_parent(step, s):
            return True
        came = float(at.y[-1] - step.start.y[-1])
        beyond = go_beyond(self._curve, self._equations, came, at, ends, self.largest)
        if beyond is None:
            if self.step > _ANY_TURN * self.largest:
                return False
            # A shorter step may yet lead on.
            self._hindrance = "a change of the chain of pieces that is not known"
            return False
        # Not the poles that multipliers may have there.
        passed = self._passed(step, _SHORT_OF * s)
        self._length += float(np.linalg.norm(at.y - step.start.y))
        point = self._point(at, Bifurcation(beyond.kind, beyond.effect, beyond.scenario))
        self._queue.extend(passed)
        if beyond.curve is None or beyond.equations is None or beyond.solution is None:
            self._queue.append(_with(point, ends, ""))
            self._ahead = beyond.why
            return True
        here = tests(self._curve, at.y)
        self._equations, self._curve, self._now = beyond.equations, beyond.curve, beyond.solution
        change = _change(here, tests(self._curve, self._now.y))
        self._queue.extend([_with(point, ends, change), self._point(self._now)])
        self.step = max(_FIRST * self.largest, 2.0 * _ANY_TURN * self.largest)
        return True


def _with(point: BranchPoint, ends: list[Margin], change: str) -> BranchPoint:
    """The point, with which margins vanish there and what the multipliers do."""
    assert point.bifurcation is not None  # noqa: S101 - it is one
    told = replace(point.bifurcation, ends=tuple(ends), change=change)
    return replace(point, bifurcation=told)


def _change(before: dict[str, float], after: dict[str, float]) -> str:
    """What a jump of the multipliers does, in words."""
    words = {
        "minus one": "a multiplier jumps across -1: a period doubling by a border collision",
        "one": "a multiplier jumps across 1",
        "torus": "a pair of multipliers jumps across modulus 1",
    }
    return "; ".join(word for name, word in words.items() if before[name] * after[name] < 0.0)
