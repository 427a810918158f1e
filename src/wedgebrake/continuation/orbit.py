"""One periodic orbit: what is told of it."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from enum import Enum
from typing import Any

import numpy as np

from wedgebrake.continuation.equations import Equations, FloatArray, Measures
from wedgebrake.continuation.problem import Family
from wedgebrake.model.display import Result
from wedgebrake.model.system import BrakedDriveline

# Pieces of an orbit that are named one by one, and those that its equations may have.
_FEW_PIECES, MOST_PIECES = 24, 600


class OrbitStatus(Enum):
    """Whether an orbit was found, with the sentence that tells it to a person."""

    FOUND = "found"
    NOT_CONVERGED = "not_converged"
    OF_LOWER_ORDER = "of_lower_order"
    AT_REST = "at_rest"
    NO_RUN = "no_run"
    NOT_PERIODIC = "not_periodic"
    NOT_SETTLED = "not_settled"
    NOT_ISOLATED = "not_isolated"
    TOO_LONG = "too_long"

    @property
    def sentence(self) -> str:
        """What the status means and what can be done."""
        return _SENTENCES[self]


_SENTENCES = {
    OrbitStatus.FOUND: "A periodic orbit was found.",
    OrbitStatus.NOT_CONVERGED: (
        "Newton's method found no periodic orbit near the guess. Give initial near a point of the"
        " orbit at t = 0, or another order."
    ),
    OrbitStatus.OF_LOWER_ORDER: (
        "The only orbits found repeat after fewer periods than order says. Give initial near a"
        " point of the wanted orbit, or a lower order."
    ),
    OrbitStatus.AT_REST: (
        "Nothing slips: every angle that the brake holds is an equilibrium, none is an isolated"
        " orbit. Lower the initial force or raise the torque."
    ),
    OrbitStatus.NO_RUN: (
        "The motion from which an orbit was looked for does not last: it diverges, locks, or stops"
        " at a limit; a simulation says which. Give initial, or change the system."
    ),
    OrbitStatus.NOT_PERIODIC: (
        "The motion settles to no periodic orbit: it is chaotic, or a second frequency is in it."
        " Give order, as order 1 for the synchronous orbit, which is unstable then, or begin"
        " elsewhere."
    ),
    OrbitStatus.NOT_SETTLED: (
        "The motion has not settled within limit periods. Raise limit, or give order, the number"
        " of periods of the torque in the wanted orbit."
    ),
    OrbitStatus.NOT_ISOLATED: (
        "Without a torque, or without a spring, an orbit is one of many, moved in time or in angle:"
        " none is isolated, as must be what is looked for. Give the driveline a spring, and the"
        " excitation an amplitude."
    ),
    OrbitStatus.TOO_LONG: (
        f"The orbit has more than {MOST_PIECES} pieces, too many for its equations. Look for one of"
        " a lower order, or of a slower driveline."
    ),
}


@dataclass(frozen=True, repr=False)
class Orbit(Result):
    """A periodic orbit, stable or not, and how it was found.

    system, method : of which it is an orbit, and the solver
    status        : whether it was found; without, the numbers below are nan
    rtol          : tolerance of "smooth"
    order         : periods of the torque in the orbit
    angle, velocity : its state at t = 0 [rad], [rad/s]
    multipliers   : Floquet multipliers over the orbit, the larger modulus first; of deviations
                    that keep a rest, where mu_s > mu_k would free the brake at any push
    sequence      : its pieces in their order, "+" forwards, "-" backwards, "0" rest, "+1" the
                    next piece of the brake's law (as after release); empty for smooth laws
    points        : (order, 2) angle and velocity at t = 0, T, 2 T, ...
    velocity_amplitude, angle_amplitude : half the range [rad/s], [rad]
    stick_share   : share of time at rest relative to the brake
    sticks_forward, sticks_backward, events : in a period of the torque
    peak_torque   : largest |R F_mu| [N m]
    steps         : lengths of the last steps of Newton's method, relative
    """

    system: BrakedDriveline
    method: str
    rtol: float
    status: OrbitStatus
    order: int
    angle: float = math.nan
    velocity: float = math.nan
    multipliers: tuple[complex, complex] = (complex(math.nan), complex(math.nan))
    sequence: str = ""
    points: FloatArray = field(default_factory=lambda: np.empty((0, 2)), compare=False)
    velocity_amplitude: float = math.nan
    angle_amplitude: float = math.nan
    stick_share: float = math.nan
    sticks_forward: float = math.nan
    sticks_backward: float = math.nan
    events: float = math.nan
    peak_torque: float = math.nan
    steps: tuple[float, ...] = ()
    _solved: tuple[Equations, FloatArray] | None = field(default=None, repr=False, compare=False)

    @property
    def found(self) -> bool:
        """Whether there is an orbit."""
        return self.status is OrbitStatus.FOUND

    @property
    def message(self) -> str:
        """The status in a sentence, and what can be done."""
        return self.status.sentence

    @property
    def stable(self) -> bool:
        """Whether small deviations die out."""
        return abs(self.multipliers[0]) < 1.0

    @property
    def exponents(self) -> tuple[float, float]:
        """Lyapunov exponents [1/s], from the multipliers; -inf where a stick forgets all."""
        first, second = self.multipliers
        return self._exponent(first), self._exponent(second)

    def _exponent(self, multiplier: complex) -> float:
        if multiplier == 0.0:
            return -math.inf
        if not self.found:
            return math.nan
        return math.log(abs(multiplier)) * self.system.excitation.frequency / self.order

    @property
    def verdict(self) -> str:
        """The orbit in a sentence."""
        if not self.found:
            return self.message
        sizes = " and ".join(_shown(one) for one in self.multipliers)
        text = f"{word(self.order)} orbit, {'stable' if self.stable else 'unstable'}"
        text += f": multipliers {sizes}"
        if not self.sequence:
            return f"{text}."
        count = len(self.sequence.split())
        pieces = f"pieces {self.sequence}" if count <= _FEW_PIECES else f"{count} pieces"
        return f"{text}; {pieces}."

    def as_dict(self) -> dict[str, Any]:
        """Plain values, for JSON."""
        return {
            "status": self.status.value, "message": self.message, "order": self.order,
            "method": self.method, "angle": self.angle, "velocity": self.velocity,
            "stable": self.stable,
            "multipliers": [[one.real, one.imag] for one in self.multipliers],
            "exponents": list(self.exponents), "sequence": self.sequence,
            "points": self.points.tolist(), "velocity_amplitude": self.velocity_amplitude,
            "angle_amplitude": self.angle_amplitude, "stick_share": self.stick_share,
            "sticks_forward": self.sticks_forward, "sticks_backward": self.sticks_backward,
            "events": self.events, "peak_torque": self.peak_torque, "verdict": self.verdict,
        }  # fmt: skip


def word(order: int) -> str:
    """Name of an order: "synchronous", "2T-periodic"."""
    return "synchronous" if order == 1 else f"{order}T-periodic"


def _shown(one: complex) -> str:
    if one.imag == 0.0:
        return f"{one.real:.6g}"
    return f"{one.real:.6g}{one.imag:+.6g}i"


def told(
    family: Family,
    equations: Equations,
    unknowns: FloatArray,
    multipliers: tuple[complex, complex],
    points: FloatArray,
    measures: Measures,
    steps: list[float],
) -> Orbit:
    """The orbit that solves its equations."""
    angle, velocity = (float(one) for one in points[0])
    return Orbit(
        system=family.base, method=family.method, rtol=family.rtol, status=OrbitStatus.FOUND,
        order=equations.order, angle=angle, velocity=velocity, multipliers=multipliers,
        sequence=equations.sequence,
        points=points, velocity_amplitude=measures.velocity_amplitude,
        angle_amplitude=measures.angle_amplitude, stick_share=measures.stick_share,
        sticks_forward=measures.sticks_forward, sticks_backward=measures.sticks_backward,
        events=measures.events, peak_torque=measures.peak_torque, steps=tuple(steps),
        _solved=(equations, unknowns),
    )  # fmt: skip
