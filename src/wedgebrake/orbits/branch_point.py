"""A point of a branch: an orbit with its multipliers, and its bifurcation if it is one."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from wedgebrake.model.display import Result
from wedgebrake.orbits.bifurcation_types import Bifurcation
from wedgebrake.orbits.curves import OrbitSolution
from wedgebrake.orbits.equations import multipliers
from wedgebrake.orbits.orbit import order_name
from wedgebrake.orbits.section import FloatArray


@dataclass(frozen=True, eq=False, repr=False)
class BranchPoint(Result, OrbitSolution):
    """A periodic orbit on a branch.

    Besides the attributes below it has the ``value`` of the parameter, ``order``, ``stable``,
    ``sequence``, the Poincare ``points``, ``measures`` (amplitudes, sticks, peak torque), and its
    ``system``; ``wb.orbit(point.system, point.order, initial=tuple(point.points[0]))`` finds it
    again.

    problem     : the system and the parameters that vary along the branch
    values      : of the parameters
    equations, unknowns : what it solves
    multipliers : Floquet multipliers (larger, smaller modulus)
    direction   : of the branch, in scaled unknowns
    arclength   : from the start of the branch, in scaled unknowns
    bifurcation : its bifurcation, if it is one
    """

    multipliers: tuple[complex, complex]
    direction: FloatArray
    arclength: float = 0.0
    bifurcation: Bifurcation | None = None

    @classmethod
    def of(
        cls,
        solution: OrbitSolution,
        direction: FloatArray,
        arclength: float = 0.0,
        bifurcation: Bifurcation | None = None,
    ) -> BranchPoint:
        """Return the point of a branch for a solution of its equations.

        solution             : orbit at a value of the parameter
        direction, arclength : of the branch at the solution
        bifurcation          : None for an ordinary point
        """
        found = multipliers(*solution.invariants)
        return cls(
            solution.problem, solution.values, solution.equations, solution.unknowns, found,
            direction, arclength, bifurcation,
        )  # fmt: skip

    @property
    def value(self) -> float:
        """Value of the first parameter."""
        return self.values[0]

    @property
    def can_be_followed(self) -> bool:
        """True for a bifurcation that ``wb.boundary`` can follow over a second parameter."""
        found = self.bifurcation
        if found is None or not found.kind.can_be_followed(self.problem.method):
            return False
        # The onset of permanent sticking has no margin that vanishes.
        return not found.kind.of_friction or bool(found.margins)

    @property
    def stable(self) -> bool:
        """True if small deviations decay."""
        return abs(self.multipliers[0]) < 1.0

    @property
    def sequence(self) -> str:
        """The segments of the orbit, as in "+ 0 -": forwards, rest, backwards."""
        return self.equations.sequence

    def _parameters(self) -> Iterator[tuple[str, float]]:
        return zip(self.problem.names, self.values, strict=True)

    def _headline(self) -> str:
        at = ", ".join(f"{name} = {value:.9g}" for name, value in self._parameters())
        if self.bifurcation is not None:  # where an orbit is neither stable nor unstable
            return f"{at}: {self.bifurcation.kind.value} of a {order_name(self.order)} orbit"
        return f"{at}: {order_name(self.order)} orbit, {'stable' if self.stable else 'unstable'}"

    def _rows(self) -> Iterator[tuple[str, Any, str]]:
        for name, value in self._parameters():
            yield name, f"{value:.9g}", ""
        yield "order", self.order, ""
        if self.bifurcation is None:
            yield "stable", self.stable, ""
        yield "multipliers", self.multipliers, ""
        if self.sequence:
            yield "sequence", self.sequence, ""
        if self.bifurcation is not None:
            yield "bifurcation", self.bifurcation, ""
