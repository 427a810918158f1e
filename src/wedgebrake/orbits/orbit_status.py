"""Outcome of the search for an orbit, with a sentence for each."""

from __future__ import annotations

from enum import Enum

from wedgebrake.dynamics.enums import MotionClass

# Largest number of segments of an orbit in its equations.
MOST_SEGMENTS = 600


class OrbitStatus(Enum):
    """Outcome of the search for an orbit."""

    FOUND = "found"
    NOT_CONVERGED = "not_converged"
    OF_LOWER_ORDER = "of_lower_order"
    AT_REST = "at_rest"
    STEADY_SLIDING = "steady_sliding"
    NO_RUN = "no_run"
    NOT_PERIODIC = "not_periodic"
    NOT_SETTLED = "not_settled"
    NOT_ISOLATED = "not_isolated"
    TOO_LONG = "too_long"

    @classmethod
    def of_irregular(cls, motion: MotionClass) -> OrbitStatus:
        """Why a motion that does not repeat leads to no orbit."""
        return cls.NOT_SETTLED if motion == MotionClass.UNDECIDED else cls.NOT_PERIODIC

    @property
    def sentence(self) -> str:
        """Meaning of the status and a remedy."""
        return _SENTENCES[self]


ONE_OF_A_FAMILY = (
    "The orbit is not isolated: it is one of a family of orbits of the same system, with a"
    " multiplier 1. Which of them is approached depends on the initial state. Add damping, or"
    " change the frequency of the torque, for an orbit that can be followed over a parameter."
)

_SENTENCES = {
    OrbitStatus.FOUND: "A periodic orbit was found.",
    OrbitStatus.NOT_CONVERGED: (
        "Newton's method found no periodic orbit near the guess. Give initial near a point of the"
        " orbit at t = 0, or another order."
    ),
    OrbitStatus.OF_LOWER_ORDER: (
        "The only orbits found repeat after fewer returns than order says. Give initial near a"
        " point of the wanted orbit, or a lower order."
    ),
    OrbitStatus.AT_REST: (
        "Nothing slips: every angle that the brake holds is an equilibrium, none is an isolated"
        " orbit. Lower the initial force or raise the torque."
    ),
    OrbitStatus.STEADY_SLIDING: (
        "The motion settles to steady sliding, without vibration. Give initial, near a point of"
        " the orbit, and order; wb.hopf finds where sliding becomes unstable."
    ),
    OrbitStatus.NO_RUN: (
        "The motion from which an orbit was sought does not last: it diverges, locks, or stops at"
        " a limit. Run a simulation to see which; give initial, or change the system."
    ),
    OrbitStatus.NOT_PERIODIC: (
        "The motion does not settle to a periodic orbit: it is chaotic or quasi-periodic. Give"
        " order, for example order 1 for the synchronous orbit, which is then unstable, or another"
        " initial."
    ),
    OrbitStatus.NOT_SETTLED: (
        "The motion has not settled within limit returns. Raise limit, or give order, the number"
        " of returns in the wanted orbit: of periods, or of crossings if no signal varies."
    ),
    OrbitStatus.NOT_ISOLATED: (
        "Orbits are not isolated if a shift in angle gives another one, or if nothing damps the"
        " vibration: its amplitude is then arbitrary. Give a driveline a spring. If nothing"
        " restrains the mean speed of a machine, add a damper to the ground. If a contact never"
        " slides, the angles that it holds are arbitrary: leave it out, and join its inertias."
    ),
    OrbitStatus.TOO_LONG: (
        f"The orbit has more than {MOST_SEGMENTS} segments, too many for its equations. Look for"
        " one of a lower order, or of a slower driveline."
    ),
}
