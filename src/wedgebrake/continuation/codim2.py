"""A bifurcation followed in a second parameter: the boundary of a kind of motion."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Collection
from typing import TYPE_CHECKING

import numpy as np

from wedgebrake._version import __version__
from wedgebrake.continuation.bifurcation_detection import Solution, Step, tests
from wedgebrake.continuation.bifurcation_types import Kind
from wedgebrake.continuation.branches import begun
from wedgebrake.continuation.continuation import POINTS, STEP, check_step
from wedgebrake.continuation.curves import BifurcationCurve, OrbitCurve
from wedgebrake.continuation.dataset import multiplier_columns
from wedgebrake.continuation.diagram import SWITCH, follow
from wedgebrake.continuation.discontinuity_induced import Margin, transition, violated
from wedgebrake.continuation.equations import FloatArray, NoOrbitError, multipliers
from wedgebrake.continuation.palc import NotConvergedError, newton, tangent
from wedgebrake.continuation.point import BranchPoint
from wedgebrake.continuation.problem import Family
from wedgebrake.continuation.ranges import Range, exact_scale, make_ranges, value_of
from wedgebrake.continuation.segment_bvp import Chain
from wedgebrake.continuation.shooting import check
from wedgebrake.continuation.symmetry import alike, between_halves, is_odd, met, prime_order
from wedgebrake.errors import InputError, nearest
from wedgebrake.model.system import BrakedDriveline
from wedgebrake.model.validation import shown

if TYPE_CHECKING:
    import xarray as xr

    from wedgebrake.continuation.branch import Branch

_TESTS = {
    Kind.FOLD: "one",
    Kind.SYMMETRY_BREAKING: "one",
    Kind.PERIOD_DOUBLING: "minus one",
    Kind.NEIMARK_SACKER: "torus",
}
# Steps as shares of the longest, and what is too small to go on with.
_FIRST, _SMALLEST, _GROW, _TURN = 0.1, 1e-5, 1.5, 0.95
# A margin that vanishes all along a curve is no more than this below zero.
_VANISHING = 1e-7
# Relative distances of orbits: below the first two curves meet; below the second the orbit is on
# the other curve, where the equations hold as well.
_MEETS, _COLLAPSED = 1e-4, 1e-8
# Parameters (scaled) and orbits (as shares of their size) nearer than this are the same.
_SAME = 1e-5
_CLOSED = "the curve has closed"


def boundary(
    point: BranchPoint,
    *,
    step: float = STEP,
    points: int = POINTS,
    **parameters: tuple[float, float],
) -> xr.Dataset:
    """A bifurcation followed over two parameters (docs/theory.md, section 13).

    Parameters
    ----------
    point : BranchPoint
        A bifurcation, of ``Branch.bifurcations``.
    step : float
        Longest step along the curve, as a share of the ranges.
    points : int
        Most points in each of the two directions.
    **parameters : (float, float)
        Two of them with their ends, for example ``eta=(-60, 12), F0=(0.01, 0.1)``: that of the
        branch and a second one.

    Returns
    -------
    xarray.Dataset
        Over ``point``, from one end to the other: both parameters, the multipliers of the
        orbit, and its Poincare point at t = 0. ``attrs`` say the kind and why it ends.

    Raises ``InputError`` for arguments that are wrong, for a branch point and for a symmetry
    breaking of an orbit with smooth friction, where branches cross and the equations are
    singular, and for the onset of permanent sticking, which is known in closed form.
    """
    bifurcation = point.bifurcation if isinstance(point, BranchPoint) else None
    if bifurcation is None:
        raise InputError(
            f"point = {shown(point)}: must be a bifurcation, one of Branch.bifurcations."
        )
    if not point.can_be_followed:
        onset = bifurcation.kind.of_friction and not bifurcation.ends
        what = "onset of permanent sticking" if onset else bifurcation.kind.value
        raise InputError(
            f"point: is a {what}, which cannot be followed with method {point.family.method!r}."
            " Follow a fold, a period doubling, a Neimark-Sacker bifurcation or one of friction."
        )
    check_step(step, points)
    ranges = make_ranges(point.family.base, parameters, 2)
    names = [one.name for one in ranges]
    own = point.family.names[0]
    if own not in names:
        raise InputError(
            f"{', '.join(names)}: must hold {own}, which the bifurcation was found over. Give"
            f" {own}=(from, to) and one more."
        )
    first, second = sorted(ranges, key=lambda one: one.name != own)
    return _Boundary(point, first, second, float(step), int(points)).dataset(ranges)


def boundaries(
    system: BrakedDriveline,
    *,
    kinds: Collection[str] | None = None,
    order: int | None = None,
    initial: tuple[float, float] | None = None,
    method: str | None = None,
    rtol: float = 1e-10,
    switch: int = SWITCH,
    opposite: bool = True,
    step: float = STEP,
    points: int = POINTS,
    progress: Callable[[Branch], None] | None = None,
    **parameters: tuple[float, float],
) -> list[xr.Dataset]:
    """The boundaries over two parameters of all that bifurcates over the first.

    Parameters
    ----------
    system : BrakedDriveline
        What is changed. Its own second parameter is held while the first is followed.
    kinds : collection of str
        Which ones, for example ``["period doubling", "grazing-sliding"]``. Default: all that
        can be followed.
    order, initial, method, rtol, switch, opposite, step, points, progress
        As for ``wb.branches``.
    **parameters : (float, float)
        Two of them with their ends; the branches begin at the first end of the first.

    Returns
    -------
    list of xarray.Dataset
        One for each bifurcation, as ``wb.boundary`` gives it; ``wb.plot(map, boundaries=...)``
        draws them over a map of ``wb.regime_map``.

    Raises ``InputError`` as ``wb.branches``.
    """
    chosen = check(system, order, method, rtol)
    allowed = [kind.value for kind in Kind if kind.can_be_followed(chosen)]
    if isinstance(kinds, str):
        raise InputError(f"kinds = {shown(kinds)}: must be a list of kinds, as [{shown(kinds)}].")
    for kind in kinds or ():
        if kind not in allowed:
            raise InputError(
                f"kinds: {shown(kind)} cannot be followed. {nearest(str(kind), allowed)}"
            )
    over, _ = make_ranges(system, parameters, 2)
    first = begun(system, over, order=order, initial=initial, method=method, rtol=rtol)
    followed = follow(
        first, over, switch=switch, opposite=opposite, step=step, points=points, progress=progress
    )
    found = [point for one in followed for point in one.branch.bifurcations]
    wanted = [
        point
        for point in found
        if point.bifurcation is not None
        and point.bifurcation.kind.value in (kinds or allowed)
        and point.can_be_followed
    ]
    return [boundary(point, step=step, points=points, **parameters) for point in wanted]


class _Boundary:
    """The curve of a bifurcation, followed both ways from where it was found."""

    def __init__(
        self, point: BranchPoint, first: Range, second: Range, step: float, points: int
    ) -> None:
        assert point.bifurcation is not None  # noqa: S101 - checked by the caller
        ends = {first.name: first.last, second.name: second.last}
        if point.equations is not point.equations.whole(point.unknowns)[0] and not is_odd(
            point.family.base.replace(**ends)
        ):
            raise InputError(
                f"{second.name}: takes the symmetry from the system, which the bifurcation has."
                " Follow it over another parameter."
            )
        self.bifurcation, self.equations = point.bifurcation, point.equations
        self.first, self.second, self.largest, self.most = first, second, step, points
        base = point.family.base
        self.family = Family(
            base, (first.name, second.name), (exact_scale(first), exact_scale(second)),
            method=point.family.method, rtol=point.family.rtol,
        )  # fmt: skip
        values = (point.value, value_of(point.system, second.name))
        self.orbits = OrbitCurve.through(point.equations, self.family, point.unknowns, values)
        self.curve = BifurcationCurve(self.orbits, self._condition)
        for one, value in zip((first, second), values, strict=True):
            if not one.bounds[0] <= value <= one.bounds[1]:
                raise InputError(
                    f"{one.name} = ({one.first:g}, {one.last:g}): must contain {value:g}, where the"
                    " bifurcation is. Widen the range."
                )
        self.start = self.orbits.scaled(point.unknowns, values)

    def _condition(self, y: FloatArray) -> float:
        """What vanishes on the curve."""
        if self.bifurcation.kind in _TESTS:
            return tests(self.orbits, y)[_TESTS[self.bifurcation.kind]]
        # Of several that vanish together that of what is short, as in ``transition``.
        end = min(self.bifurcation.ends, key=lambda one: one.column)
        return float(self.orbits.margins(y)[end.piece, end.column])

    def dataset(self, ranges: list[Range]) -> xr.Dataset:
        """Both halves as one."""
        import xarray as xr

        size = self.start.size
        try:
            across = np.zeros((2, size))
            across[0, -2], across[1, -1] = 1.0, 1.0
            y, matrix = self._begun(across)
            direction = tangent(matrix, across[1])
        except (NotConvergedError, NoOrbitError):
            halves = [([self._solution(self.start)], "the curve has no direction here")] * 2
        else:
            halves = self._both(Solution(y, matrix, direction))
        back, on = halves
        every = [*reversed(back[0][1:]), *on[0]]
        points = [self._point(at) for at in every]
        section = np.array([point.points[0] for point in points])
        values = {
            one.name: np.array([point.values[i] for point in points])
            for i, one in enumerate((self.first, self.second))
        }
        return xr.Dataset(
            {
                **multiplier_columns(points),
                "angle": ("point", section[:, 0], {"units": "rad", "long_name": "angle at t = 0"}),
                "velocity": (
                    "point", section[:, 1], {"units": "rad/s", "long_name": "velocity at t = 0"},
                ),
            },
            coords={one.dim: ("point", values[one.name], one.attributes()) for one in ranges},
            attrs={
                "kind": "boundary",
                "bifurcation": self.bifurcation.kind.value,
                "effect": self.bifurcation.effect,
                "order": self.equations.order,
                "sequence": self.equations.sequence,
                "parameters": [one.dim for one in ranges],
                "ranges": json.dumps([one.bounds for one in ranges]),
                "begin": back[1],
                "end": on[1],
                "method": self.family.method,
                "system": json.dumps(self.family.base.as_dict()),
                "groups": json.dumps(self.family.base.groups.as_dict()),
                "wedgebrake": __version__,
            },
        )  # fmt: skip

    def _begun(self, across: FloatArray) -> tuple[FloatArray, FloatArray]:
        """The first point, solved with either parameter held."""
        try:
            return newton(self.curve, self.start, across[1])
        except NotConvergedError:
            return newton(self.curve, self.start, across[0])

    def _solution(self, y: FloatArray) -> Solution:
        return Solution(y, np.empty((0, 0)), np.zeros(y.size))

    def _point(self, at: Solution) -> BranchPoint:
        unknowns, values = self.orbits.unscaled(at.y)
        found = multipliers(*self.orbits.invariants(at.y))
        return BranchPoint(self.family, values, self.equations, unknowns, found, at.direction)

    def _both(self, start: Solution) -> list[tuple[list[Solution], str]]:
        """The curve against its direction, and along it."""
        on = self._half(start, start)
        if on[1] == _CLOSED:
            # One way round is all of it.
            return [([start], _CLOSED), on]
        # Of a curve that has not quite closed what is left to the other's end.
        return [self._half(_turned(start), _turned(on[0][-1])), on]

    def _half(self, start: Solution, goal: Solution) -> tuple[list[Solution], str]:
        """The curve in one direction, and why it ends.

        goal : of the curve, with the direction in which it closes there
        """
        found, step = [start], _FIRST * self.largest
        while len(found) <= self.most:
            if step < _SMALLEST * self.largest:
                return found, "no orbit was found further on"
            now = found[-1]
            try:
                y, matrix = newton(self.curve, now.y + step * now.direction, now.direction)
                after = Solution(y, matrix, tangent(matrix, now.direction))
            except (NotConvergedError, NoOrbitError):
                step *= 0.5
                continue
            if after.direction @ now.direction < _TURN and step > 1e-2 * self.largest:
                step *= 0.5
                continue
            why = self._left(after)
            if why and step > 1e-3 * self.largest:
                # Near to where it ends.
                step *= 0.5
                continue
            if why:
                # The curve ends where the orbit is almost one of fewer periods.
                whole = self._prime(after, _COLLAPSED) == self.equations.order
                at_end = whole and why == met(self._prime(after))
                return [*found, after] if at_end else found, why
            try:
                last = self._last(Step(self.curve, now, after), after, goal)
            except (NotConvergedError, NoOrbitError):
                step *= 0.5
                continue
            if last is not None:
                return [*found, last[0]], last[1]
            found.append(after)
            step = min(self.largest, _GROW * step)
        return found, f"stopped after {self.most} points"

    def _last(
        self, step: Step[BifurcationCurve], after: Solution, goal: Solution
    ) -> tuple[Solution, str] | None:
        """Where the curve would go over its own points beyond, and why; None: nowhere in a step."""

        def beyond_goal(there: Solution) -> float:
            return float(goal.direction[-2:] @ (there.y - goal.y)[-2:])

        if float(np.sum(self._gap(step.start) * self._gap(after))) < 0.0:
            # The halves of the orbit have changed places: the curve has passed through an orbit of
            # half the periods and retraces its own points, half an orbit later. No root is located,
            # because points between may be on the curve of that orbit; the step is shortened until
            # its end is near enough.
            raise NotConvergedError
        if beyond_goal(step.start) < 0.0 <= beyond_goal(after):
            at = step.at(step.root(beyond_goal))
            if self._is_same(at, goal):
                return at, _CLOSED
        return None

    def _is_same(self, one: Solution, other: Solution) -> bool:
        """Whether two points are one orbit, at any shift by whole periods."""
        if np.linalg.norm((one.y - other.y)[-2:]) > _SAME:
            return False
        first, second = self._point(one), self._point(other)
        omega = second.system.excitation.angular_frequency
        return alike(first.points, second.points, omega, _SAME)

    def _gap(self, at: Solution) -> FloatArray:
        """From half an orbit to the other, which vanishes where they are the same."""
        there = self._point(at)
        return between_halves(there.points, there.system.excitation.angular_frequency)

    def _prime(self, at: Solution, tolerance: float = _MEETS) -> int:
        """The fewest periods after which an orbit repeats."""
        there = self._point(at)
        return prime_order(there.points, there.system.excitation.angular_frequency, tolerance)

    def _left(self, at: Solution) -> str:
        """Why a point belongs to the curve no more; empty where it does."""
        _, values = self.orbits.unscaled(at.y)
        for one, value in zip((self.first, self.second), values, strict=True):
            if not one.bounds[0] <= value <= one.bounds[1]:
                return f"left the range of {one.name}"
        others = self._lacking(at)
        if others:
            return self._met(at, others)
        fewer = self._prime(at)
        if fewer < self.equations.order:
            return met(fewer)
        trace, _ = self.orbits.invariants(at.y)
        if self.bifurcation.kind is Kind.NEIMARK_SACKER and not abs(trace) < 2.0:
            return "both multipliers are real: a resonance 1:1 or 1:2"
        return "" if math.isfinite(trace) else "the multipliers are infinite"

    def _met(self, at: Solution, ends: list[Margin]) -> str:
        """Words for the bifurcation of friction that ends the chain of pieces."""
        unknowns, values = self.orbits.unscaled(at.y)
        found = None
        if isinstance(self.equations, Chain):
            problem = self.family.problem(values)
            found = transition(self.equations, unknowns, problem, ends)
        name = "a bifurcation of friction" if found is None else found.kind.value
        return f"it meets {name}"

    def _lacking(self, at: Solution) -> list[Margin]:
        """The margins that are missed, but those that vanish all along."""
        margins = self.orbits.margins(at.y)
        return [end for end in violated(margins) if not margins[end] >= -_VANISHING]


def _turned(at: Solution) -> Solution:
    """A point of a curve that is gone through the other way."""
    return at._replace(direction=-at.direction)
