"""The equations of a periodic orbit, however they are stated."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Protocol

from wedgebrake.model.display import Tabular
from wedgebrake.model.system import BrakedDriveline
from wedgebrake.orbits.section import FloatArray, Records


class NoOrbitError(ArithmeticError):
    """The equations have no value: the run does not last, or the brake lacks a segment."""


@dataclass(frozen=True)
class Measures(Tabular):
    """Amplitudes, sticking, events and torque of an orbit.

    velocity_amplitude, angle_amplitude : half the range [rad/s], [rad]
    stick_share : share of time at rest relative to the brake
    sticks_forward, sticks_backward, events : in a period of the torque
    peak_torque : largest |R F_mu| [N m]
    """

    velocity_amplitude: float
    angle_amplitude: float
    stick_share: float
    sticks_forward: float
    sticks_backward: float
    events: float
    peak_torque: float


class Equations(Protocol):
    """Equations F(u) = 0 of an orbit of ``order`` returns to the section.

    ``problem`` is always the system as ``OrbitProblem.kernel_problem`` gives it.
    """

    order: int

    @property
    def size(self) -> int:
        """Number of unknowns, and of equations."""

    @property
    def sequence(self) -> str:
        """The segments in their order, as signs; empty where the equations do not know them."""

    def scales(self, unknowns: FloatArray, problem: Any) -> FloatArray:
        """(size,) a considerable change of each unknown."""

    def residual(self, unknowns: FloatArray, problem: Any) -> FloatArray:
        """F(u), (size,); raises ``NoOrbitError``."""

    def linearize(self, unknowns: FloatArray, problem: Any) -> tuple[FloatArray, FloatArray]:
        """F(u) and its derivative, (size,) and (size, size); raises ``NoOrbitError``."""

    def invariants(self, unknowns: FloatArray, problem: Any) -> tuple[float, float]:
        """Trace and determinant of the monodromy matrix."""

    def margins(self, unknowns: FloatArray, problem: Any) -> Records:
        """Distances from where a solution is no orbit: a row of ``MARGINS`` for each segment."""

    def follows_flow(self, unknowns: FloatArray, problem: Any, growth: float) -> bool:
        """Return True if the flow from a solution passes through it and returns.

        growth : of a small deviation, for what must be allowed to rounding
        """

    def points(self, unknowns: FloatArray, problem: Any) -> FloatArray:
        """(order, n) states at the section."""

    def measures(self, unknowns: FloatArray, problem: Any, system: BrakedDriveline) -> Measures:
        """Amplitudes, sticking, events and torque."""

    def mirror_difference(
        self, unknowns: FloatArray, system: BrakedDriveline, tolerance: float
    ) -> FloatArray:
        """Difference to the mirror image half an orbit later, in shares of the orbit's size.

        tolerance : accuracy required

        Empty where the segments of the two differ.
        """

    def halved(self, unknowns: FloatArray) -> tuple[Equations, FloatArray]:
        """Equations of half the orbit, which must be its own mirror image."""

    def whole(self, unknowns: FloatArray) -> tuple[Equations, FloatArray]:
        """Equations that do not assume the orbit to be its own mirror image."""

    def doubled(self, unknowns: FloatArray) -> tuple[Equations, FloatArray]:
        """Equations of the same orbit traversed twice."""


def multipliers(trace: float, determinant: float) -> tuple[complex, complex]:
    """Eigenvalues of a 2 x 2 monodromy matrix, the larger modulus first."""
    half = 0.5 * trace
    split = half * half - determinant
    if split < 0.0:
        root = complex(half, (-split) ** 0.5)
        return root, root.conjugate()
    # The smaller one as a quotient: a difference would lose its digits.
    first = half + (split**0.5 if half >= 0.0 else -(split**0.5))
    # Plus zero, so that no zero is negative.
    return complex(first + 0.0), complex((determinant / first if first != 0.0 else 0.0) + 0.0)
