"""Floquet multipliers of an orbit, and test functions for crossings of the unit circle."""

from __future__ import annotations

import math
from itertools import combinations
from typing import NamedTuple

import numpy as np

from wedgebrake.arrays import FloatArray

# Size of a multiplier that is rounding.
_LOST = 1e-12


class Floquet(NamedTuple):
    """Linear stability of an orbit.

    multipliers : largest modulus first; without the multiplier 1 of a shift in time
    tests       : functions that vanish where a multiplier is 1 or -1, or a pair has the product 1;
                  of an orbit that is its own mirror image half an orbit later "one" and "symmetry",
                  where a multiplier of its half, followed by the mirror image, is 1 or -1
    growth      : factor by which deviations grow in one orbit
    oscillates  : whether the pair whose product is nearest to 1 is complex
    """

    multipliers: tuple[complex, ...]
    tests: dict[str, float]
    growth: float
    oscillates: bool

    def distance(self, test: str) -> float:
        """Least distance of a multiplier, or product of two, from a test function's root."""
        values = list(self.multipliers)
        if test == "torus":
            values = [one * other for one, other in combinations(values, 2)]
        where = -1.0 if test == "minus one" else 1.0
        return min((abs(one - where) for one in values), default=math.inf)

    @classmethod
    def of_plane(cls, trace: float, determinant: float, *, half: bool = False) -> Floquet:
        """Linear stability from the trace and determinant of a 2 x 2 monodromy matrix.

        half : whether it is that of half the orbit, followed by the mirror image
        """
        tests = {"one": 1.0 - trace + determinant}
        if half:
            tests["symmetry"] = 1.0 + trace + determinant
            trace, determinant = trace * trace - 2.0 * determinant, determinant * determinant
        tests |= {"minus one": 1.0 + trace + determinant, "torus": determinant - 1.0}
        return cls(_multipliers(trace, determinant), tests, abs(trace), abs(trace) < 2.0)

    @classmethod
    def of_matrices(cls, matrices: list[FloatArray], *, half: bool = False) -> Floquet:
        """Linear stability from the derivatives from return to return, in the order of time.

        half : whether their product is that of half the orbit, followed by the mirror image

        Factors of the test functions are limited to about 1, so that large multipliers do not hide
        the change of another one.
        """
        whole = np.eye(len(matrices[0]))
        for matrix in matrices:
            whole = matrix @ whole
        values = np.linalg.eigvals(whole).astype(complex) + 0.0
        # What a stick or the section removes is rounding.
        values[np.abs(values) <= _LOST * max(float(np.linalg.norm(whole)), 1.0)] = 0.0
        tests = {"one": float(np.prod((1.0 - values) / (1.0 + np.abs(values))).real)}
        if half:
            tests["symmetry"] = float(np.prod((1.0 + values) / (1.0 + np.abs(values))).real)
            values, whole = values * values + 0.0, whole @ whole
        # The largest first, and of a complex pair the one with the positive imaginary part.
        values = values[np.lexsort((-values.imag, -np.abs(values)))]
        sizes = 1.0 + np.abs(values)
        pairs = list(combinations(values, 2))
        gaps = np.array([first * second - 1.0 for first, second in pairs])
        products = gaps / np.array([1.0 + abs(first * second) for first, second in pairs])
        tests["minus one"] = float(np.prod((1.0 + values) / sizes).real)
        oscillates = False
        if pairs:
            tests["torus"] = float(np.prod(products).real)
            oscillates = bool(pairs[int(np.abs(gaps).argmin())][0].imag != 0.0)
        found = tuple(complex(one) for one in values)
        return cls(found, tests, float(np.linalg.norm(whole)), oscillates)


def _multipliers(trace: float, determinant: float) -> tuple[complex, complex]:
    """Eigenvalues of a 2 x 2 monodromy matrix, the larger modulus first."""
    half = 0.5 * trace
    split = half * half - determinant
    if split < 0.0:
        root = complex(half, (-split) ** 0.5)
        return root, root.conjugate()
    # The smaller eigenvalue as a quotient: a difference would cancel.
    first = half + (split**0.5 if half >= 0.0 else -(split**0.5))
    # Adding zero makes negative zeros positive.
    return complex(first + 0.0), complex((determinant / first if first != 0.0 else 0.0) + 0.0)
