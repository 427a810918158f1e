"""``boundary`` and ``boundaries``: bifurcations followed over two parameters."""

from __future__ import annotations

import json
import math
import warnings
from collections.abc import Callable, Collection
from typing import TYPE_CHECKING, Any

import numpy as np

from wedgebrake.analysis.responses.datasets import labelled
from wedgebrake.arrays import FloatArray
from wedgebrake.errors import InputError, nearest
from wedgebrake.model.system import BrakedDriveline
from wedgebrake.model.system_base import own_names
from wedgebrake.model.validation import shown, wrong
from wedgebrake.orbits.bifurcation_types import Bifurcation, Kind
from wedgebrake.orbits.branches.branch import COLLAPSED, MEETS, NOTHING_FURTHER, Branch
from wedgebrake.orbits.continuation import POINTS, STEP, check_step
from wedgebrake.orbits.curves import BifurcationCurve, OrbitCurve, OrbitSolution
from wedgebrake.orbits.diagram import SWITCH, first_orbit, follow, multiplier_columns
from wedgebrake.orbits.equations.equations import NoOrbitError
from wedgebrake.orbits.equations.segment_orbit import violated
from wedgebrake.orbits.friction_bifurcations.discontinuity_induced import (
    leading_quantity,
    transition,
)
from wedgebrake.orbits.friction_bifurcations.friction_condition import at_bifurcation, departs
from wedgebrake.orbits.friction_bifurcations.mode_sequence import ModeSequence
from wedgebrake.orbits.orbit import BranchPoint
from wedgebrake.orbits.palc import (
    FAILED,
    Curve,
    CurvePoint,
    NotConvergedError,
    Step,
    StepLength,
    corrected,
    null_directions,
)
from wedgebrake.orbits.problems.choose_problem import orbit_problem
from wedgebrake.orbits.problems.problem import OrbitProblem
from wedgebrake.orbits.ranges import Range, check_ranges, make_ranges

if TYPE_CHECKING:
    import xarray as xr

    from wedgebrake.model.machine import Machine
    from wedgebrake.solvers.machine.final_state import FinalState

_TESTS = {
    Kind.FOLD: "one",
    Kind.SYMMETRY_BREAKING: "symmetry",
    Kind.PERIOD_DOUBLING: "minus one",
    Kind.NEIMARK_SACKER: "torus",
}
# Shortest step; steps below which the direction may turn by any amount, and below which the end
# of the curve is near enough; all as shares of the longest. Least cosine of a turn.
_SHORTEST, _ANY_TURN, _NEAR_END = 1e-5, 1e-2, 1e-3
_TURN = 0.95
# Largest magnitude below zero of a margin that vanishes everywhere on a curve.
_VANISHING = 1e-7
# Parameters (scaled) and orbits (as shares of their size) nearer than this are equal.
_SAME = 1e-5
# Largest distance of a multiplier from its value at the bifurcation, if the flow is exact and if it
# is computed to a tolerance; and rounding, as a share of the growth of deviations.
_AT_BIFURCATION, _TO_TOLERANCE, _ROUNDING = 1e-9, 1e-7, 1e-13
# Distances ahead of the end of a curve, in scaled unknowns, at which events are compared.
_AHEAD = (3e-6, 3e-5, 3e-4)
_CLOSED, _FRICTION = "the curve has closed", "it meets a bifurcation of friction"


def boundary(
    point: BranchPoint,
    *,
    step: float = STEP,
    points: int = POINTS,
    **parameters: tuple[float, float],
) -> xr.Dataset:
    """A bifurcation followed over two parameters (docs/numerics.md, "In two parameters").

    Parameters
    ----------
    point : BranchPoint
        A bifurcation: an element of ``Branch.bifurcations``.
    step : float
        Longest step along the curve, as a share of the ranges.
    points : int
        Largest number of points in each of the two directions.
    **parameters : (float, float)
        Two parameters with their ends, for example ``eta=(-60, 12), F0=(0.01, 0.1)``: the
        parameter of the branch and a second one.

    Returns
    -------
    xarray.Dataset
        Over ``point``, from one end of the curve to the other: both parameters, the multipliers of
        the orbit, and its first Poincare point, as angle [rad] and velocity [rad/s], of a machine
        those of the first inertia. ``attrs``: the kind of bifurcation, and why the curve ends at
        its ``begin`` and at its ``end``.

    Raises ``InputError`` for invalid arguments; for a branch point and a Hopf point, where branches
    cross and the equations are singular; for the onset of permanent sticking, which is known in
    closed form; and for a second parameter that breaks the symmetry which the bifurcation requires.
    If an event coincides with a sampling, the curve is a single point.
    """
    curve, ranges = boundary_curve(point, step, points, parameters)
    return curve.dataset(ranges)


def boundary_curve(
    point: BranchPoint, step: float, points: int, parameters: dict[str, tuple[float, float]]
) -> tuple[BoundaryCurve, list[Range]]:
    """The curve of ``boundary`` before it is followed, and the ranges in the order given."""
    bifurcation = point.bifurcation if isinstance(point, BranchPoint) else None
    if bifurcation is None:
        raise wrong("point", point, "a bifurcation, one of Branch.bifurcations")
    if not point.can_be_followed:
        kinds = point.problem.followed_kinds
        raise InputError(
            f"point: the {_not_followed(point.problem, bifurcation.kind)} cannot be followed over"
            f" two parameters. Follow one of: {', '.join(kinds)}.",
            name="point", value=bifurcation.kind.value, allowed=tuple(kinds),
        )  # fmt: skip
    check_step(step, points)
    ranges = make_ranges(point.problem.base, parameters, 2)
    names = [one.name for one in ranges]
    own = point.problem.names[0]
    if own not in names:
        allowed = f"{own}, over which the bifurcation was found, and another parameter"
        raise wrong("parameters", tuple(names), allowed)
    check_ranges(point.problem, ranges)
    first, second = sorted(ranges, key=lambda one: one.name != own)
    return BoundaryCurve(point, bifurcation, (first, second), float(step), int(points)), ranges


def boundaries(
    system: BrakedDriveline | Machine,
    *,
    kinds: Collection[str] | None = None,
    order: int | None = None,
    initial: tuple[float, float] | FinalState | None = None,
    method: str | None = None,
    rtol: float = 1e-10,
    switch: int = SWITCH,
    opposite: bool = True,
    step: float = STEP,
    points: int = POINTS,
    progress: Callable[[Branch], None] | None = None,
    **parameters: tuple[float, float],
) -> list[xr.Dataset]:
    """Curves over two parameters of all bifurcations found over the first (see ``wb.boundary``).

    Parameters
    ----------
    system : BrakedDriveline or Machine
        System whose parameters vary. The second keeps its own value while branches are followed
        over the first.
    kinds : collection of str
        Kinds to follow, for example ``["period doubling", "grazing-sliding"]``. Default: all that
        can be followed.
    order, initial, method, rtol, switch, opposite, step, points, progress
        As for ``wb.branches``.
    **parameters : (float, float)
        Two parameters with their ends; the branches begin at the first end of the first. Names
        with a dot, as for a machine, are given as ``**{"brake.slope": (0.0, -60.0)}``.

    Returns
    -------
    list of xarray.Dataset
        One for each bifurcation, as from ``wb.boundary``; ``wb.plot(regimes, boundaries=...)``
        draws them over ``regimes``, a result of ``wb.regime_map``.

    Raises ``InputError`` as ``wb.branches``, and for kinds that cannot be followed. Bifurcations
    that were found but cannot be followed are left out with a ``UserWarning`` that names them.
    """
    with own_names(system):
        problem = orbit_problem(system, method, rtol, parameters)
    allowed = problem.followed_kinds
    if kinds is not None and (isinstance(kinds, str) or not isinstance(kinds, Collection)):
        raise wrong("kinds", kinds, "a list of kinds, for example ['fold']")
    for kind in kinds or ():
        if kind not in allowed:
            exists = kind in [one.value for one in Kind]
            what = f"the {_not_followed(problem, Kind(kind))}" if exists else shown(kind)
            raise InputError(
                f"kinds: {what} cannot be followed over two parameters."
                f" {nearest(str(kind), allowed)}",
                name="kinds", value=kind, allowed=tuple(allowed),
            )  # fmt: skip
    settings: Any = {"switch": switch, "opposite": opposite, "step": step, "points": points}
    over, second = make_ranges(problem.base, parameters, 2)
    value, (low, high) = problem.base.value(second.name), second.bounds
    if not low <= value <= high:
        expected = f"a range that contains {value:g}, the value of the system"
        raise wrong(second.name, (second.first, second.last), expected, "Widen the range.")
    with own_names(system):
        first = first_orbit(problem, over, order, initial)
        followed = follow(first, over, **settings, progress=progress)
    found = [
        (point, point.bifurcation)
        for one in followed
        for point in one.branch.bifurcations
        if point.bifurcation is not None and (not kinds or point.bifurcation.kind.value in kinds)
    ]
    left = [
        f"{one.kind.value} at {over.name} = {point.value:.6g}"
        + (f" ({one.effect})" if one.effect else "")
        for point, one in found
        if not point.can_be_followed
    ]
    if left:
        warnings.warn(
            f"Left out, as they cannot be followed over two parameters: {'; '.join(left)}. Compute"
            f" the branch at several values of {second.name}.",
            UserWarning,
            stacklevel=2,
        )
    return [
        boundary(point, step=step, points=points, **parameters)
        for point, _ in found
        if point.can_be_followed
    ]


def _not_followed(problem: OrbitProblem, kind: Kind) -> str:
    """Name of a bifurcation that cannot be followed, with the kind of system if it matters."""
    if not problem.can_follow(kind):
        return f"{kind.noun} of {problem.subject}"
    if kind is Kind.GRAZING:
        return "grazing of a shaft, torque or controller, unlike that of a contact,"
    return "onset of permanent sticking"


class BoundaryCurve:
    """Curve of a bifurcation, followed in both directions from its first point."""

    def __init__(
        self,
        point: BranchPoint,
        bifurcation: Bifurcation,
        ranges: tuple[Range, Range],
        step: float,
        points: int,
    ) -> None:
        first, second = ranges
        problem = point.problem.over(
            (first.name, second.name), (first.exact_scale, second.exact_scale)
        )
        equations, unknowns = point.equations, point.unknowns
        if equations.half and not problem.has_odd_symmetry((first.last, second.last)):
            if bifurcation.margins or bifurcation.kind is Kind.SYMMETRY_BREAKING:
                raise wrong(
                    second.name, (second.first, second.last),
                    "a range of a parameter that preserves the symmetry of the bifurcation",
                )  # fmt: skip
            equations, unknowns = equations.whole(unknowns)
        self.bifurcation = bifurcation
        self.ranges, self.step, self.most = ranges, step, points
        values = (point.value, point.system.value(second.name))
        for one, value in zip(self.ranges, values, strict=True):
            if not one.bounds[0] <= value <= one.bounds[1]:
                allowed = f"a range that contains {value:g}, where the bifurcation is"
                raise wrong(one.name, (one.first, one.last), allowed, "Widen the range.")
        start = OrbitSolution(problem, values, equations, unknowns)
        changed = bifurcation.changed
        if changed is not None:
            start = at_bifurcation(start, bifurcation.kind, changed)
        self.orbits = OrbitCurve(start)
        self.curve: Curve = self.orbits
        if not isinstance(start.equations, ModeSequence):
            self.curve = BifurcationCurve(self.orbits, self._condition)
        self.start = self.orbits.scaled(start)

    def _condition(self, y: FloatArray) -> float:
        """The function that vanishes on the curve."""
        if self.bifurcation.kind in _TESTS:
            return self.orbits.solution(y).tests[_TESTS[self.bifurcation.kind]]
        if not self.bifurcation.margins:
            raise NoOrbitError
        quantity = leading_quantity(self.bifurcation.margins)
        margin = next(one for one in self.bifurcation.margins if one.quantity == quantity)
        return float(self.orbits.solution(y).margins[margin.segment][quantity])

    def _vanishes(self, at: CurvePoint) -> bool:
        """Return True if multipliers are those of the bifurcation.

        Newton's method may also converge to a point where they jump.
        """
        kind, orbit = self.bifurcation.kind, self.orbits.solution(at.y)
        if kind not in _TESTS:
            return True
        allowed = _AT_BIFURCATION if orbit.equations.to_rounding else _TO_TOLERANCE
        allowed += _ROUNDING * orbit.floquet.growth
        # Equal multipliers are accurate to the square root of rounding, their product to rounding.
        return (
            orbit.floquet.distance(_TESTS[kind]) <= allowed
            or abs(self._condition(at.y)) <= _ROUNDING
        )

    def _obstacle(self, at: CurvePoint) -> str:
        """Reason why no point was found beyond the last one of a curve."""
        here = self.orbits.solution(at.y).sides
        for reach in _AHEAD:
            try:
                if self.orbits.solution(at.y + reach * at.direction).sides != here:
                    return _FRICTION
            except NoOrbitError:
                continue
        return NOTHING_FURTHER

    def dataset(self, ranges: list[Range]) -> xr.Dataset:
        """Both halves as one curve, with the parameters in the order of ``ranges``."""
        import xarray as xr

        points, begin, end = self.followed()
        section = np.array([point.points[0] for point in points])
        values = np.array([point.values for point in points])
        columns = {one.name: column for one, column in zip(self.ranges, values.T, strict=True)}
        equations, problem = self.orbits.equations, self.orbits.problem
        # Of a machine, those of its first inertia.
        angle, velocity = (one.reshape(len(one), -1)[:, 0] for one in problem.kinematics(section))
        return xr.Dataset(
            {
                **multiplier_columns(points),
                "angle": labelled("point", angle, "rad", "angle at t = 0"),
                "velocity": labelled("point", velocity, "rad/s", "velocity at t = 0"),
            },
            coords={one.dim: ("point", columns[one.name], one.attributes()) for one in ranges},
            attrs={
                "kind": "boundary",
                "bifurcation": self.bifurcation.kind.value,
                "effect": self.bifurcation.effect,
                "order": equations.order,
                "sequence": points[0].sequence,
                "parameters": [one.dim for one in ranges],
                "ranges": json.dumps([one.bounds for one in ranges]),
                "begin": begin,
                "end": end,
                **problem.attributes(problem.base),
            },
        )  # fmt: skip

    def followed(self) -> tuple[list[BranchPoint], str, str]:
        """The points of both halves as one curve, and why it ends at its beginning and end."""
        (back, begin), (on, end) = self._halves()
        every = [*reversed(back[1:]), *on]
        points = [BranchPoint.of(self.orbits.solution(at.y), at.direction) for at in every]
        return points, begin, end

    def _halves(self) -> list[tuple[list[CurvePoint], str]]:
        """The curve against its direction and along it, and why each half ends."""
        try:
            start = self._first_point()
        except FAILED:
            alone = CurvePoint(self.start, np.empty((0, 0)), np.zeros(self.start.size))
            return [([alone], self._without_direction())] * 2
        on = self._half(start, start)
        if on[1] == _CLOSED:
            # One direction covers all of it.
            return [([start], _CLOSED), on]
        # If the curve has not quite closed, continue only to the end of the other half.
        begin, goal = (at._replace(direction=-at.direction) for at in (start, on[0][-1]))
        return [self._half(begin, goal), on]

    def _first_point(self) -> CurvePoint:
        """The first point, with either parameter held; at a cusp both are stationary."""
        *_, first, second = np.eye(self.start.size)
        for normal in (second, first):
            try:
                return corrected(self.curve, self.start, normal, second)
            except NotConvergedError:
                continue
        along = null_directions(self.curve.linearize(self.start)[1])[-1]
        return corrected(self.curve, self.start, along)

    def _without_direction(self) -> str:
        """Reason why no curve goes through the first point."""
        orbit = self.orbits.solution(self.start)
        equations = orbit.equations
        if isinstance(equations, ModeSequence) and equations.meets_sampling(
            orbit.unknowns, orbit.kernel_problem
        ):
            return "an event coincides with a sampling"
        return "the curve has no direction here"

    def _half(self, start: CurvePoint, goal: CurvePoint) -> tuple[list[CurvePoint], str]:
        """The curve in one direction, and the reason why it ends.

        goal : point at which the curve closes, with its direction
        """
        found, length, end = [start], StepLength(self.step), ""

        def step() -> bool:
            nonlocal end
            now = found[-1]
            after = corrected(self.curve, now.y + length.length * now.direction, now.direction)
            if after.direction @ now.direction < _TURN and length.exceeds(_ANY_TURN):
                return False
            if not self._vanishes(after):
                return False
            why = self._end_at(after)
            if why and length.exceeds(_NEAR_END):
                return False
            if why:
                # Keep the point where the orbit almost repeats after fewer returns.
                orbit = self.orbits.solution(after.y)
                whole = orbit.prime_order(COLLAPSED) == orbit.order
                if whole and why == orbit.problem.doubling_of(orbit.prime_order(MEETS)):
                    found.append(after)
                end = why
                return True
            closed = self._closes(Step(self.curve, now, after), after, goal)
            found.append(after if closed is None else closed)
            end = "" if closed is None else _CLOSED
            length.grow()
            return True

        while len(found) <= self.most:
            if not length.attempt(step, _SHORTEST):
                return found, self._obstacle(found[-1])
            if end:
                return found, end
            if length.creeps:
                share = length.length / self.step
                return found, f"its steps have become too short, {share:.1g} of the longest"
        return found, f"stopped after {self.most} points"

    def _closes(self, step: Step[Curve], after: CurvePoint, goal: CurvePoint) -> CurvePoint | None:
        """The point at which the curve closes inside a step; None if it does not."""

        def beyond_goal(there: CurvePoint) -> float:
            return float(goal.direction[-2:] @ (there.y - goal.y)[-2:])

        begin, end, last = (self.orbits.solution(at.y) for at in (step.start, after, goal))
        halves = [one.section.half_difference(one.points) for one in (begin, end)]
        if np.sum(halves[0] * halves[1]) < 0.0:
            # The halves of the orbit have changed places: the curve has passed through an orbit of
            # half the periods and retraces its own points, half an orbit later. No root is located,
            # because points between may be on the curve of that orbit; the step is shortened until
            # its end is near enough.
            raise NotConvergedError
        if beyond_goal(step.start) < 0.0 <= beyond_goal(after):
            at = step.at(step.root(beyond_goal))
            points, apart = self.orbits.solution(at.y).points, (at.y - goal.y)[-2:]
            same = last.section.same_orbit(points, last.points, _SAME)
            if same and np.linalg.norm(apart) <= _SAME:
                return at
        return None

    def _end_at(self, at: CurvePoint) -> str:
        """Reason why a point is not on the curve; empty if it is."""
        orbit = self.orbits.solution(at.y)
        for one, value in zip(self.ranges, orbit.values, strict=True):
            if not one.bounds[0] <= value <= one.bounds[1]:
                return f"left the range of {one.name}"
        # Without the margins that vanish everywhere on the curve.
        others = [
            one
            for one in violated(orbit.margins)
            if not orbit.margins[one.segment][one.quantity] >= -_VANISHING
        ]
        if others:
            found = transition(orbit, others)
            return f"it meets {'a bifurcation of friction' if found is None else found.kind.value}"
        if self.curve is self.orbits and departs(self.orbits, at):
            return _FRICTION
        fewer = orbit.prime_order(MEETS)
        if fewer < orbit.order:
            return orbit.problem.doubling_of(fewer)
        floquet = orbit.floquet
        if self.bifurcation.kind is Kind.NEIMARK_SACKER and not floquet.oscillates:
            return "both multipliers are real: a resonance 1:1 or 1:2"
        return "" if math.isfinite(floquet.growth) else "the multipliers are infinite"
