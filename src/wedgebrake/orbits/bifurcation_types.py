"""Bifurcations by name (docs/numerics.md, "Bifurcations"), and stable intervals between them."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from wedgebrake.model.display import Result

if TYPE_CHECKING:
    from wedgebrake.solvers.machine.events.modes import GuardKind


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
    HOPF = "Hopf"
    GRAZING_SLIDING = "grazing-sliding"
    CROSSING_SLIDING = "crossing-sliding"
    SWITCHING_SLIDING = "switching-sliding"
    ADDING_SLIDING = "adding-sliding"
    GRAZING = "grazing"

    @property
    def of_friction(self) -> bool:
        """True if it is discontinuity-induced: smooth systems do not have it."""
        return self.value == "grazing" or self.value.endswith("-sliding")

    @property
    def noun(self) -> str:
        """The kind as a noun, as in "a Hopf point"."""
        if self is Kind.HOPF:
            return "Hopf point"
        adjective = self.of_friction or self is Kind.NEIMARK_SACKER
        return f"{self.value} bifurcation" if adjective else self.value

    @property
    def meaning(self) -> str:
        """Description of the scenario, a sentence without full stop."""
        return _MEANINGS[self]


_MEANINGS = {
    Kind.FOLD: "two orbits meet and vanish (multiplier 1)",
    Kind.PERIOD_DOUBLING: "an orbit of twice the period branches off (multiplier -1)",
    Kind.NEIMARK_SACKER: "a second frequency sets in: a torus branches off (complex"
    " multipliers of modulus 1)",
    Kind.SYMMETRY_BREAKING: "two orbits that are each other's mirror image branch off",
    Kind.BRANCH_POINT: "two branches cross (multiplier 1)",
    Kind.HOPF: "the orbit shrinks to steady sliding, whose stability changes",
    Kind.GRAZING_SLIDING: "a slip just touches zero sliding velocity: a stick begins or ends there",
    Kind.CROSSING_SLIDING: "a reversal meets the limit of the holding torque: a short stick begins"
    " or ends there",
    Kind.SWITCHING_SLIDING: "the onset of a stick meets the limit of the holding torque: a short"
    " slip begins or ends there",
    Kind.ADDING_SLIDING: "during a stick the torque just touches the limit of the holding torque: a"
    " short slip begins or ends there",
    Kind.GRAZING: "the motion just touches a breakpoint, such as the release speed of a brake, the"
    " end of a gap or stage, or a point of a torque over a speed or an angle; or an actuation force"
    " or the output of a continuous controller just touches one of its limits",
}


_TOUCHED = (
    "two bifurcations of this kind meet: a multiplier, or a pair, reaches the unit circle and"
    " returns"
)


class Scenario(Enum):
    """What a bifurcation changes: orbits on both sides, or multipliers that only touch."""

    NONE = ""
    PERSISTENCE = "persistence"
    FOLD = "non-smooth fold"
    JUMP = "jump"
    """The motion jumps: no nearby orbit continues."""
    TOUCH = "touched"
    """A multiplier reaches the unit circle and returns: the stability does not change."""


class OrbitMargin(NamedTuple):
    """One margin of an orbit: the number of its segment, and its quantity.

    quantity : field of ``segment_orbit.MARGINS``
    """

    segment: int
    quantity: str


class Limit(NamedTuple):
    """A linear condition of a contact, which is positive as long as none of its events occurs.

    guard : its quantity: the sliding speed, the holding torque, a line of the torque, the force
    sign  : of a slip its direction; of a holding torque 1 for the upper limit, -1 for the lower
            one; otherwise 1 where the level is exceeded, -1 where it is not
    level : of lines and forces, as in ``levels_of``
    """

    contact: int
    guard: GuardKind
    sign: int
    level: int = 0


class Changed(NamedTuple):
    """A contact of a machine whose slips, sticks or breakpoints change at a bifurcation.

    contact : its number
    sides   : slips and sticks of each contact, as of ``Segments``, without those that begin or end
    limit   : the breakpoint that the contact touches; None if a slip or stick begins or ends
    """

    contact: int
    sides: tuple[tuple[int, ...], ...]
    limit: Limit | None = None


@dataclass(frozen=True, repr=False)
class Bifurcation(Result):
    """A bifurcation at a point of a branch.

    effect   : part of the motion that begins or ends there; empty if none
    scenario : orbits on both sides, if it is discontinuity-induced; ``Scenario.TOUCH`` where two
               bifurcations of the same kind meet
    change   : multipliers that jump across the unit circle
    margins  : those that vanish there, of a driveline
    changed  : contact of a machine whose segments change there
    """

    kind: Kind
    effect: str = ""
    scenario: Scenario = Scenario.NONE
    change: str = ""
    margins: tuple[OrbitMargin, ...] = ()
    changed: Changed | None = None

    @property
    def sentence(self) -> str:
        """The bifurcation in a sentence."""
        if self.scenario is Scenario.TOUCH:
            return f"{self.kind.value}, touched: {_TOUCHED}."
        text = f"{self.kind.value}: {self.kind.meaning}"
        for more in (self.effect, self.scenario.value, self.change):
            text += f"; {more}" if more else ""
        return f"{text}."

    def _headline(self) -> str:
        return self.sentence


class StabilityInterval(NamedTuple):
    """Points ``first`` to ``last`` of a branch of one stability; neighbours share a point."""

    first: int
    last: int
    stable: bool


def stability_intervals(
    stable: NDArray[np.bool_], marginal: NDArray[np.bool_]
) -> list[StabilityInterval]:
    """Divide a branch where its stability changes.

    stable   : (n,) of each point
    marginal : (n,) where a multiplier is on the unit circle up to rounding, as at a
               bifurcation: there the neighbours decide
    """
    if stable.size < 2:
        return [StabilityInterval(0, 0, bool(stable[0]))] if stable.size else []
    first, last = stable[:-1], stable[1:]
    steps = np.where(
        marginal[:-1] == marginal[1:], first & last, np.where(marginal[:-1], last, first)
    )
    edges = (np.flatnonzero(np.diff(steps)) + 1).tolist()
    ends = zip([0, *edges], [*edges, steps.size], strict=True)
    return [StabilityInterval(a, b, bool(steps[a])) for a, b in ends]


def multiplier_change(before: dict[str, float], after: dict[str, float]) -> str:
    """Words for a jump of the multipliers across the unit circle."""
    words = {
        "minus one": "a multiplier jumps across -1: a period doubling by a border collision",
        "one": "a multiplier jumps across 1",
        "symmetry": "a multiplier jumps across 1",
        "torus": "a pair of multipliers jumps across modulus 1",
    }
    changed = [
        word for name, word in words.items() if before.get(name, 0.0) * after.get(name, 0.0) < 0.0
    ]
    return "; ".join(dict.fromkeys(changed))
