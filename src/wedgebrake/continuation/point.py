"""A point of a branch: an orbit, and which bifurcation it is, if it is one."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import Any

from wedgebrake.continuation.bifurcation_types import Kind, Scenario
from wedgebrake.continuation.discontinuity_induced import Margin
from wedgebrake.continuation.equations import Equations, FloatArray, Measures
from wedgebrake.continuation.orbit import word
from wedgebrake.continuation.problem import Family
from wedgebrake.model.display import Result
from wedgebrake.model.system import BrakedDriveline


@dataclass(frozen=True, repr=False)
class Bifurcation(Result):
    """What happens at a point of a branch.

    effect   : what of the motion begins or ends there, in words; empty if nothing does
    scenario : of a bifurcation of friction, how the orbits on both sides lie
    change   : which jump of the multipliers passes the unit circle, in words
    ends     : the margins that vanish
    """

    kind: Kind
    effect: str = ""
    scenario: Scenario = Scenario.NONE
    change: str = ""
    ends: tuple[Margin, ...] = ()

    @property
    def sentence(self) -> str:
        """The bifurcation in a sentence."""
        text = f"{self.kind.value}: {self.kind.meaning}"
        for more in (self.effect, self.scenario.value, self.change):
            text += f"; {more}" if more else ""
        return f"{text}."

    def _headline(self) -> str:
        return self.sentence


@dataclass(frozen=True, eq=False, repr=False)
class BranchPoint(Result):
    """A periodic orbit on a branch.

    Beside what is below: ``value`` of the parameter, ``order``, ``stable``, ``sequence``, the
    Poincare ``points``, ``measures`` (amplitudes, sticks, peak torque), and its ``system``;
    ``wb.orbit(point.system, point.order, initial=tuple(point.points[0]))`` is it again.

    family      : the system and the parameters that vary along the branch
    values      : of the parameters
    equations, unknowns : what it solves
    multipliers : (larger, smaller modulus)
    direction   : of the branch, in scaled unknowns
    arclength   : from the start of the branch, in scaled unknowns
    bifurcation : which one it is, if it is one
    """

    family: Family
    values: tuple[float, ...]
    equations: Equations
    unknowns: FloatArray
    multipliers: tuple[complex, complex]
    direction: FloatArray
    arclength: float = 0.0
    bifurcation: Bifurcation | None = None

    @property
    def value(self) -> float:
        """Of the first parameter."""
        return self.values[0]

    @property
    def can_be_followed(self) -> bool:
        """Whether it is a bifurcation that ``wb.boundary`` can follow in a second parameter."""
        found = self.bifurcation
        if found is None or not found.kind.can_be_followed(self.family.method):
            return False
        # The onset of permanent sticking is no end of a chain.
        return not found.kind.of_friction or bool(found.ends)

    @property
    def stable(self) -> bool:
        """Whether small deviations die out."""
        return abs(self.multipliers[0]) < 1.0

    @property
    def order(self) -> int:
        """Periods of the torque in the orbit."""
        return self.equations.order

    @property
    def sequence(self) -> str:
        """The pieces of the orbit, as in "+ 0 -": forwards, rest, backwards."""
        return self.equations.sequence

    @cached_property
    def measures(self) -> Measures:
        """What the orbit does."""
        problem = self.family.problem(self.values)
        return self.equations.measures(self.unknowns, problem, self.system)

    @cached_property
    def points(self) -> FloatArray:
        """(order, 2) Poincare points at t = 0, T, ...: angle [rad] and velocity [rad/s]."""
        return self.equations.points(self.unknowns, self.family.problem(self.values))

    @property
    def system(self) -> BrakedDriveline:
        """The system that it is an orbit of."""
        return self.family.system(self.values)

    def _parameters(self) -> Iterator[tuple[str, float]]:
        return zip(self.family.names, self.values, strict=True)

    def _headline(self) -> str:
        at = ", ".join(f"{name} = {value:.9g}" for name, value in self._parameters())
        if self.bifurcation is not None:  # where an orbit is neither stable nor unstable
            return f"{at}: {self.bifurcation.kind.value} of a {word(self.order)} orbit"
        return f"{at}: {word(self.order)} orbit, {'stable' if self.stable else 'unstable'}"

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
