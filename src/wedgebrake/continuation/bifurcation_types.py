"""The bifurcations by name, and what becomes of an orbit there (docs/theory.md, section 13)."""

from __future__ import annotations

from enum import Enum


class Kind(Enum):
    """A bifurcation of periodic orbits.

    The last five are discontinuity-induced: M. di Bernardo, C. J. Budd, A. R. Champneys and
    P. Kowalczyk, Piecewise-smooth Dynamical Systems (2008), chapters 7 and 8.
    """

    FOLD = "fold"
    PERIOD_DOUBLING = "period doubling"
    NEIMARK_SACKER = "Neimark-Sacker"
    SYMMETRY_BREAKING = "symmetry breaking"
    BRANCH_POINT = "branch point"
    GRAZING_SLIDING = "grazing-sliding"
    CROSSING_SLIDING = "crossing-sliding"
    SWITCHING_SLIDING = "switching-sliding"
    ADDING_SLIDING = "adding-sliding"
    GRAZING = "grazing"

    @property
    def of_friction(self) -> bool:
        """Whether a smooth system has no such bifurcation."""
        return self.value == "grazing" or self.value.endswith("-sliding")

    def can_be_followed(self, method: str) -> bool:
        """Whether one condition more describes it, so that it has a curve in two parameters.

        Where branches cross the equations are singular; half the orbit's are not, where it is
        its own mirror image, but only the exact ones are stated for half an orbit.
        """
        if self is Kind.SYMMETRY_BREAKING:
            return method == "exact"
        return self is not Kind.BRANCH_POINT

    @property
    def meaning(self) -> str:
        """What happens, in a sentence without its stop."""
        return _MEANINGS[self]


_MEANINGS = {
    Kind.FOLD: "two orbits meet and vanish (multiplier 1)",
    Kind.PERIOD_DOUBLING: "an orbit of twice the period branches off (multiplier -1)",
    Kind.NEIMARK_SACKER: "a second frequency sets in: a torus branches off (complex"
    " multipliers of modulus 1)",
    Kind.SYMMETRY_BREAKING: "two orbits that are each other's mirror image branch off",
    Kind.BRANCH_POINT: "two branches cross (multiplier 1)",
    Kind.GRAZING_SLIDING: "a slip just touches zero sliding velocity: there a stick begins or ends",
    Kind.CROSSING_SLIDING: "a reversal meets the end of what the brake holds: there a short stick"
    " begins or ends",
    Kind.SWITCHING_SLIDING: "the begin of a stick meets the end of what the brake holds: there a"
    " short slip begins or ends",
    Kind.ADDING_SLIDING: "in a stick the torque just touches what the brake holds: there a short"
    " slip begins or ends",
    Kind.GRAZING: "a slip just touches a breakpoint of the brake's law, such as the release speed",
}


class Scenario(Enum):
    """How the orbits on both sides of a bifurcation of friction lie."""

    NONE = ""
    PERSISTENCE = "persistence"
    FOLD = "non-smooth fold"
    JUMP = "jump"
    """The law jumps: no orbit near by goes on."""
