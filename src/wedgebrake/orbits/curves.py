"""Orbits over parameters, and the curves that continuation follows."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, Self

import numpy as np

from wedgebrake.arrays import FloatArray, Records
from wedgebrake.orbits.equations.equations import NoOrbitError, OrbitMeasures, PartMeasures
from wedgebrake.orbits.equations.segment_orbit import violated
from wedgebrake.orbits.problems.problem import OrbitProblem
from wedgebrake.orbits.section import SAME, Section

# Directions of the slips, 0 for sticks, of each contact of a machine.
Sides = tuple[tuple[int, ...], ...]

if TYPE_CHECKING:
    from wedgebrake.orbits.equations.equations import OrbitEquations
    from wedgebrake.orbits.equations.floquet import Floquet
    from wedgebrake.orbits.equations.segments import OrbitSegments

# Step of differences in scaled unknowns: its square, and rounding over it, are both small. Where a
# function that is exact to rounding bends over this step by more than the share, the shorter one.
_DIFFERENCE, _SHORT, _BENDS = 1e-6, 1e-8, 5e-3
# Distance within which a derivative with respect to the parameters is reused. It is small because
# the equations are singular where branches meet.
_NEAR = 1e-5
# Number of cached solutions of a curve, and of events for which derivatives are cached.
_REMEMBERED = 8


@dataclass(frozen=True, eq=False)
class OrbitSolution:
    """A solution of the equations of an orbit at one value of each parameter.

    problem : the system, and the parameters that vary
    values  : of these parameters
    equations, unknowns : the equations and their solution
    """

    problem: OrbitProblem
    values: tuple[float, ...]
    equations: OrbitEquations
    unknowns: FloatArray

    @cached_property
    def kernel_problem(self) -> Any:
        """The system in the form of the kernels; raises ``NoOrbitError`` where there is none."""
        return self.problem.kernel_problem(self.values)

    @cached_property
    def system(self) -> Any:
        """System of which it is an orbit."""
        return self.problem.system(self.values)

    @cached_property
    def form(self) -> Any:
        """The system as its equations take it."""
        return self.problem.form(self.system)

    @cached_property
    def section(self) -> Section:
        """Section at which the orbit is sampled."""
        return self.problem.section(self.values)

    @property
    def name(self) -> str:
        """Name of the orbit: "synchronous orbit", "2T-periodic orbit", "limit cycle"."""
        return self.problem.name_of_orbit(self.order)

    @property
    def order(self) -> int:
        """Returns to the section in the orbit."""
        return self.equations.order

    @cached_property
    def period(self) -> float:
        """Period of the orbit [s]."""
        return self.equations.duration(self.unknowns, self.kernel_problem)

    @property
    def initial(self) -> Any:
        """Initial state with which ``wb.simulate`` follows the orbit."""
        return self.problem.initial(self.equations.initial(self.unknowns, self.kernel_problem))

    @cached_property
    def segments(self) -> list[OrbitSegments]:
        """The slips and sticks of each contact of a machine."""
        return self.equations.segments(self.unknowns, self.kernel_problem)

    @cached_property
    def levels(self) -> list[OrbitSegments]:
        """The segments of each contact of a machine between breakpoints, see ``breakpoints``."""
        return self.equations.levels(self.unknowns, self.kernel_problem)

    @property
    def sides(self) -> list[tuple[int, ...]]:
        """Directions of slips, 0 for sticks, of each contact of a machine, in cyclic order."""
        return [one.sides for one in self.segments]

    @property
    def slides_on(self) -> bool:
        """True if no contact of a machine comes to rest or reverses."""
        return all(len(sides) == 1 for sides in self.sides)

    @cached_property
    def sequence(self) -> str:
        """The segments of the orbit, as in "+ 0 -": forwards, rest, backwards."""
        return self.equations.sequence(self.unknowns, self.kernel_problem)

    @cached_property
    def points(self) -> FloatArray:
        """(order, n) states at the returns: of a driveline angle [rad] and velocity [rad/s]."""
        return self.equations.points(self.unknowns, self.kernel_problem)

    @cached_property
    def part_measures(self) -> PartMeasures:
        """Amplitudes, sticking and torque of each inertia and contact."""
        return self.equations.measures(self.unknowns, self.kernel_problem, self.form)

    @property
    def measures(self) -> OrbitMeasures:
        """Amplitudes, sticking, events and torque: the largest of all inertias and contacts."""
        return self.part_measures.largest

    @cached_property
    def twists(self) -> dict[str, tuple[float, float]]:
        """Half range and largest magnitude of the twist q_a - ratio q_b of each shaft [rad].

        nan where it grows for ever; empty for a driveline, whose twist is its angle.
        """
        names = self.problem.shafts
        if not names:
            return {}
        found = self.equations.twists(self.unknowns, self.kernel_problem, self.form)
        pairs = np.broadcast_to(np.transpose(found), (len(names), 2)).tolist()
        return {name: (half, peak) for name, (half, peak) in zip(names, pairs, strict=True)}

    @cached_property
    def floquet(self) -> Floquet:
        """Floquet multipliers, and the functions that vanish where they leave the unit circle."""
        return self.equations.floquet(self.unknowns, self.kernel_problem)

    @property
    def tests(self) -> dict[str, float]:
        """Test functions, which vanish where a multiplier is 1, -1, or a pair has modulus 1."""
        return self.floquet.tests

    @cached_property
    def margins(self) -> Records:
        """Margins of the solution as an orbit: a row of ``MARGINS`` for each segment."""
        return self.equations.margins(self.unknowns, self.kernel_problem)

    @property
    def follows_flow(self) -> bool:
        """True if the flow passes through the solution and returns."""
        growth = self.floquet.growth
        return self.equations.follows_flow(self.unknowns, self.kernel_problem, growth)

    @property
    def is_orbit(self) -> bool:
        """True if the solution of the equations is an orbit of the system."""
        return not violated(self.margins) and self.follows_flow

    def moved(self, values: tuple[float, ...]) -> Self:
        """The same orbit at almost equal values, where its events are about to change.

        Its events, multipliers and measures remain those just before.
        """
        found = replace(self, values=values)
        for name in ("segments", "sequence", "floquet", "part_measures"):
            found.__dict__[name] = getattr(self, name)
        return found

    def prime_order(self, tolerance: float = SAME) -> int:
        """Fewest returns after which the orbit repeats."""
        return self.section.prime_order(self.points, tolerance)

    def is_symmetric(self, tolerance: float = SAME) -> bool:
        """Return True if theta(t + nT/2) = -theta(t), n odd, on a system with odd symmetry."""
        if self.order % 2 == 0 or not self.problem.has_odd_symmetry(self.values):
            return False
        gap = self.mirror_difference(tolerance)
        return bool(gap.size > 0 and np.max(np.abs(gap)) <= tolerance)

    def mirror_points(self) -> FloatArray:
        """States at the returns of its mirror image -x(t + T/2), on a system with odd symmetry."""
        return self.equations.mirror_points(
            self.unknowns, self.kernel_problem, self.form, self.problem.method
        )

    def mirror_difference(self, tolerance: float) -> FloatArray:
        """Difference of the orbit to its mirror image half an orbit later."""
        return self.equations.mirror_difference(
            self.unknowns, self.kernel_problem, self.form, tolerance
        )


class OrbitCurve:
    """Orbits over one or more parameters, F(u, p) = 0.

    Scaled unknowns are y = (u / scales / sqrt(size), p / problem.scales), so that an orbit of
    many events counts no more than one of few.

    through : orbit whose size gives the scales; raises ``NoOrbitError``
    """

    def __init__(self, through: OrbitSolution) -> None:
        self.equations, self.problem = through.equations, through.problem
        sizes = self.equations.scales(through.unknowns, through.kernel_problem)
        # A small orbit near a Hopf point has no size of its own.
        sizes = np.maximum(sizes, self.problem.size) * np.sqrt(self.equations.size)
        self.scales: FloatArray = np.concatenate((sizes, self.problem.scales))
        self._solutions: dict[bytes, OrbitSolution] = {}
        self._columns: dict[Sides, tuple[FloatArray, list[FloatArray]]] = {}

    def scaled(self, solution: OrbitSolution) -> FloatArray:
        """Scaled unknowns y of an orbit."""
        return np.concatenate((solution.unknowns, solution.values)) / self.scales

    def solution(self, y: FloatArray) -> OrbitSolution:
        """The orbit at y, cached with its results."""
        key = y.tobytes()
        if key not in self._solutions:
            if len(self._solutions) >= _REMEMBERED:
                del self._solutions[next(iter(self._solutions))]
            unknowns, values = self._unscaled(y)
            self._solutions[key] = OrbitSolution(self.problem, values, self.equations, unknowns)
        return self._solutions[key]

    def _unscaled(self, y: FloatArray) -> tuple[FloatArray, tuple[float, ...]]:
        """Unknowns and parameters."""
        size, unscaled = self.equations.size, y * self.scales
        return unscaled[:size], tuple(unscaled[size:].tolist())

    def has_shrunk(self, y: FloatArray, share: float) -> bool:
        """Return True for an orbit of a self-excited system that is almost a point.

        Near a Hopf point, such an orbit surrounds steady sliding. If contacts come to rest, the
        speed of sliding shrinks with the orbit, for example in proportion to that of a shaft.

        share : largest size of such an orbit, relative to that from which the scales are taken
        """
        here = self.solution(y)
        if not here.problem.self_excited:
            return False
        size = here.equations.scales(here.unknowns, here.kernel_problem)[0]
        return bool(size * np.sqrt(here.equations.size) < share * self.scales[0])

    def residual(self, y: FloatArray) -> FloatArray:
        """F(y)."""
        unknowns, values = self._unscaled(y)
        return self.equations.residual(unknowns, self.problem.kernel_problem(values))

    def linearize(self, y: FloatArray) -> tuple[FloatArray, FloatArray]:
        """F(y) and its derivative."""
        size, (unknowns, values) = self.equations.size, self._unscaled(y)
        problem = self.problem.kernel_problem(values)
        residual, matrix = self.equations.linearize(unknowns, problem)
        columns = self._by_parameters_nearby(y)
        return residual, np.column_stack((matrix * self.scales[:size], *columns))

    def _by_parameters_nearby(self, y: FloatArray) -> list[FloatArray]:
        """Derivatives of F with respect to the parameters, there or nearby with the same events.

        Each new value of a parameter requires a new system, whose preparation takes longer than
        the flow over a period.
        """
        sides = tuple(self.solution(y).sides)
        known = self._columns.get(sides)
        if known is None or np.linalg.norm(y - known[0]) > _NEAR:
            if len(self._columns) >= _REMEMBERED:
                self._columns.clear()
            known = self._columns[sides] = y, self._columns_at(y)
        return known[1]

    def _columns_at(self, y: FloatArray) -> list[FloatArray]:
        """Derivatives of F with respect to the parameters."""
        unknowns, values = self._unscaled(y)
        if not values:
            return []
        if self.equations.differentiable:
            exact = self.problem.by_parameters(self.equations, unknowns, values)
            if exact is not None:
                return list((exact * self.problem.scales).T)
        columns = range(self.equations.size, y.size)
        if self.equations.to_rounding:
            return [self._by_parameter(y, i) for i in columns]
        return [one_sided(self.residual, y, i) for i in columns]

    def _by_parameter(self, y: FloatArray, column: int) -> FloatArray:
        """Derivative of F by a parameter, on the side of y where events change near it."""
        here = self.solution(y).sides

        def on_one_side(there: FloatArray) -> FloatArray:
            unknowns, values = self._unscaled(there)
            beside = OrbitSolution(self.problem, values, self.equations, unknowns)
            if beside.sides != here:
                raise NoOrbitError
            return self.residual(there)

        try:
            return difference(on_one_side, y, column, exact=True)
        except NoOrbitError:
            return difference(self.residual, y, column, exact=True)


@dataclass(frozen=True, eq=False)
class BifurcationCurve:
    """Orbits on which a function vanishes, over two parameters: F(u, p, q) = 0 and g = 0."""

    orbits: OrbitCurve
    condition: Callable[[FloatArray], float]

    def linearize(self, y: FloatArray) -> tuple[FloatArray, FloatArray]:
        """(F, g) and its derivative; the derivative of g from differences.

        The multipliers may jump where the events of an orbit change: g is compared on the side of
        y alone.
        """
        here = self.orbits.solution(y).sides

        def on_one_side(there: FloatArray) -> FloatArray:
            if self.orbits.solution(there).sides != here:
                raise NoOrbitError
            return np.array([self.condition(there)])

        values, matrix = self.orbits.linearize(y)
        exact = self.orbits.equations.to_rounding
        gradient = [difference(on_one_side, y, i, exact=exact)[0] for i in range(y.size)]
        return np.append(values, self.condition(y)), np.vstack((matrix, gradient))


def difference(
    function: Callable[[FloatArray], FloatArray],
    y: FloatArray,
    column: int,
    *,
    exact: bool = False,
) -> FloatArray:
    """Derivative by one unknown: a central difference, one-sided where one side has no value.

    exact : whether the function has no error but rounding, so that a shorter step is possible
    """
    here = function(y)
    found, bend = _difference(function, y, here, column, _DIFFERENCE)
    if exact and bend > _BENDS * float(np.linalg.norm(found)):
        found, _ = _difference(function, y, here, column, _SHORT)
    return found


def _difference(
    function: Callable[[FloatArray], FloatArray],
    y: FloatArray,
    here: FloatArray,
    column: int,
    step: float,
) -> tuple[FloatArray, float]:
    """Derivative from a step, and half the size of its change over the step; here: the value."""
    ends, width = [], 0.0
    for sign in (1.0, -1.0):
        there = y.copy()
        there[column] += sign * step
        try:
            ends.append(function(there))
            width += step
        except NoOrbitError:
            ends.append(here)
    if width == 0.0 or not np.all(np.isfinite(ends)):
        raise NoOrbitError
    bend = float(np.linalg.norm(ends[0] + ends[1] - 2.0 * here)) / width
    return np.asarray((ends[0] - ends[1]) / width), bend


def one_sided(
    function: Callable[[FloatArray], FloatArray], y: FloatArray, column: int
) -> FloatArray:
    """One-sided difference in one unknown, to the side on which the function has a value."""
    here = function(y)
    for step in (_DIFFERENCE, -_DIFFERENCE):
        there = y.copy()
        there[column] += step
        try:
            return np.asarray((function(there) - here) / step)
        except NoOrbitError:
            continue
    raise NoOrbitError
