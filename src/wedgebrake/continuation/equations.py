"""What the equations of a periodic orbit have in common, however they are stated."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from wedgebrake.model.display import Tabular
from wedgebrake.model.system import BrakedDriveline

FloatArray = NDArray[np.float64]


class NoOrbitError(ArithmeticError):
    """The equations have no value here: the run does not last, or the brake lacks a piece."""


@dataclass(frozen=True)
class Measures(Tabular):
    """What an orbit does; sticks and events in a period of the torque."""

    velocity_amplitude: float
    angle_amplitude: float
    stick_share: float
    sticks_forward: float
    sticks_backward: float
    events: float
    peak_torque: float


class Equations(Protocol):
    """Equations F(u) = 0 of an orbit of ``order`` periods of the torque.

    ``problem`` is always what ``Family.problem`` gives.
    """

    order: int

    @property
    def size(self) -> int:
        """Number of unknowns, and of equations."""

    @property
    def sequence(self) -> str:
        """The pieces in their order, in signs; empty where the equations do not know them."""

    def scales(self, unknowns: FloatArray, problem: Any) -> FloatArray:
        """(size,) a change of each unknown that is no small one."""

    def residual(self, unknowns: FloatArray, problem: Any) -> FloatArray:
        """F(u), (size,); raises ``NoOrbitError``."""

    def linearize(self, unknowns: FloatArray, problem: Any) -> tuple[FloatArray, FloatArray]:
        """F(u) and its derivative, (size,) and (size, size); raises ``NoOrbitError``."""

    def invariants(self, unknowns: FloatArray, problem: Any) -> tuple[float, float]:
        """Trace and determinant of the derivative of the orbit's return."""

    def margins(self, unknowns: FloatArray, problem: Any) -> FloatArray:
        """(n, chain.COLUMNS) distances from what the equations do not see."""

    def points(self, unknowns: FloatArray, problem: Any) -> FloatArray:
        """(order, 2) Poincare points at t = 0, T, ...: angle [rad] and velocity [rad/s]."""

    def measures(self, unknowns: FloatArray, problem: Any, system: BrakedDriveline) -> Measures:
        """What the orbit does."""

    def from_mirror(
        self, unknowns: FloatArray, system: BrakedDriveline, tolerance: float
    ) -> FloatArray:
        """From the orbit to its mirror image half an orbit later, as shares of its size.

        tolerance : how well it must be known

        Empty where the pieces of the one are not those of the other.
        """

    def halved(self, unknowns: FloatArray) -> tuple[Equations, FloatArray]:
        """The equations of half the orbit, which is its own mirror image."""

    def whole(self, unknowns: FloatArray) -> tuple[Equations, FloatArray]:
        """The equations without the assumption that the orbit is its own mirror image."""

    def doubled(self, unknowns: FloatArray) -> tuple[Equations, FloatArray]:
        """The same orbit, gone through twice."""


def multipliers(trace: float, determinant: float) -> tuple[complex, complex]:
    """The eigenvalues of a 2 x 2 matrix, the larger modulus first."""
    half = 0.5 * trace
    split = half * half - determinant
    if split < 0.0:
        root = complex(half, (-split) ** 0.5)
        return root, root.conjugate()
    # The smaller one as a quotient: a difference would lose its digits.
    first = half + (split**0.5 if half >= 0.0 else -(split**0.5))
    # Plus zero, so that no zero is negative.
    return complex(first + 0.0), complex((determinant / first if first != 0.0 else 0.0) + 0.0)
