"""The curves that are followed: orbits over a parameter, bifurcations over two."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from wedgebrake.continuation.equations import Equations, FloatArray, NoOrbitError
from wedgebrake.continuation.problem import Family
from wedgebrake.errors import InputError

# Step of differences in scaled unknowns: its square, and rounding over it, are both small.
_DIFFERENCE = 1e-6


@dataclass(frozen=True, eq=False)
class OrbitCurve:
    """Orbits of a family of one or more parameters, F(u, p) = 0.

    Scaled unknowns are y = (u / scales / sqrt(size), p / family.scales): so that an orbit of
    many events counts no more than one of few.
    """

    equations: Equations
    family: Family
    scales: FloatArray

    @classmethod
    def through(
        cls,
        equations: Equations,
        family: Family,
        unknowns: FloatArray,
        values: tuple[float, ...],
    ) -> OrbitCurve:
        """The curve in the scales of one of its orbits; raises ``NoOrbitError``."""
        sizes = equations.scales(unknowns, family.problem(values))
        scales = sizes * np.sqrt(equations.size)
        return cls(equations, family, np.concatenate((scales, family.scales)))

    def scaled(self, unknowns: FloatArray, values: tuple[float, ...]) -> FloatArray:
        """Y of an orbit."""
        return np.concatenate((unknowns, values)) / self.scales

    def unscaled(self, y: FloatArray) -> tuple[FloatArray, tuple[float, ...]]:
        """(u, p)."""
        size = self.equations.size
        whole = y * self.scales
        return whole[:size], tuple(float(value) for value in whole[size:])

    def problem(self, y: FloatArray) -> object:
        """The arguments of the kernels; raises ``NoOrbitError`` where there is no such system."""
        try:
            return self.family.problem(self.unscaled(y)[1])
        except InputError as error:
            raise NoOrbitError(str(error)) from None

    def residual(self, y: FloatArray) -> FloatArray:
        """F(y)."""
        return self.equations.residual(self.unscaled(y)[0], self.problem(y))

    def linearize(self, y: FloatArray) -> tuple[FloatArray, FloatArray]:
        """F(y) and its derivative; by the parameters from differences."""
        size = self.equations.size
        values, matrix = self.equations.linearize(self.unscaled(y)[0], self.problem(y))
        columns = [matrix * self.scales[:size]]
        columns += [
            difference(self.residual, y, size + i)[:, None] for i in range(len(self.family.names))
        ]
        return values, np.hstack(columns)

    def invariants(self, y: FloatArray) -> tuple[float, float]:
        """Trace and determinant of the derivative of the orbit's return."""
        return self.equations.invariants(self.unscaled(y)[0], self.problem(y))

    def margins(self, y: FloatArray) -> FloatArray:
        """Distances from what the equations do not see, (n, chain.COLUMNS)."""
        return self.equations.margins(self.unscaled(y)[0], self.problem(y))


@dataclass(frozen=True, eq=False)
class BifurcationCurve:
    """Orbits on which a function vanishes, over two parameters: F(u, p, q) = 0 and g = 0."""

    orbits: OrbitCurve
    condition: Callable[[FloatArray], float]

    def linearize(self, y: FloatArray) -> tuple[FloatArray, FloatArray]:
        """(F, g) and its derivative, that of g from differences."""
        values, matrix = self.orbits.linearize(y)
        gradient = [
            difference(lambda there: np.array([self.condition(there)]), y, i)[0]
            for i in range(y.size)
        ]
        return np.append(values, self.condition(y)), np.vstack((matrix, gradient))


def difference(
    function: Callable[[FloatArray], FloatArray], y: FloatArray, column: int
) -> FloatArray:
    """The derivative by one unknown, from both sides; from one where the other has none."""
    ends, steps = [], []
    for sign in (1.0, -1.0):
        there = y.copy()
        there[column] += sign * _DIFFERENCE
        try:
            ends.append(function(there))
        except NoOrbitError:
            ends.append(function(y))
            steps.append(0.0)
        else:
            steps.append(_DIFFERENCE)
    if sum(steps) == 0.0 or not all(np.all(np.isfinite(end)) for end in ends):
        raise NoOrbitError
    return np.asarray((ends[0] - ends[1]) / sum(steps))
