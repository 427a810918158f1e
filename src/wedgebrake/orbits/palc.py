"""A curve of solutions F(y) = 0 with one unknown more than equations, step by step.

Pseudo-arclength continuation: H. B. Keller, Numerical solution of bifurcation and nonlinear
eigenvalue problems, in Applications of Bifurcation Theory (1977), 359-384.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple, Protocol

import numpy as np

from wedgebrake.orbits.equations import NoOrbitError
from wedgebrake.orbits.section import FloatArray

# Newton's method ends where its step is rounding, and is given up where it does not shrink.
_CONVERGED, _ACCEPTED = 1e-13, 1e-9
_MOST_STEPS = 12
# The first step as a share of the longest, and how steps grow and shrink.
_FIRST, _GROW, _SHRINK = 0.1, 1.5, 0.5


class Curve(Protocol):
    """F: R^(m+1) -> R^m, in unknowns that are scaled so that changes of 1 are large."""

    def linearize(self, y: FloatArray) -> tuple[FloatArray, FloatArray]:
        """F(y), (m,), and its derivative, (m, m + 1); raises ``NoOrbitError``."""


class NotConvergedError(ArithmeticError):
    """Newton's method found no solution near its guess."""


# What a step may raise that a shorter one may not.
FAILED = (NotConvergedError, NoOrbitError)


class CurvePoint(NamedTuple):
    """A point of a curve.

    y         : scaled unknowns
    matrix    : (m, m + 1) derivative of F
    direction : unit tangent
    """

    y: FloatArray
    matrix: FloatArray
    direction: FloatArray


class StepLength:
    """Length of the steps along a curve, halved until one succeeds and grown afterwards.

    longest : in scaled unknowns
    """

    def __init__(self, longest: float) -> None:
        self.longest, self.length = longest, _FIRST * longest

    def exceeds(self, share: float) -> bool:
        """Return True if a step is longer than a share of the longest."""
        return self.length > share * self.longest

    def attempt(self, step: Callable[[], bool], shortest: float) -> bool:
        """Try a step, each time of half the length, until one succeeds.

        shortest : length below which none is tried, as a share of the longest
        """
        while self.length >= shortest * self.longest:
            try:
                if step():
                    return True
            except FAILED:
                pass
            self.length *= _SHRINK
        return False

    def grow(self) -> None:
        """Make the next step longer."""
        self.length = min(self.longest, _GROW * self.length)


def newton(
    curve: Curve,
    guess: FloatArray,
    normal: FloatArray | None,
    sizes: list[float] | None = None,
) -> tuple[FloatArray, FloatArray]:
    """The solution on the plane through the guess, square to ``normal``: (y, derivative there).

    normal : None for as many unknowns as equations
    sizes  : receives the length of each step of Newton's method

    Raises ``NotConvergedError``, and what the curve raises.
    """
    y = guess.copy()
    last = np.inf
    for _ in range(_MOST_STEPS):
        values, matrix = curve.linearize(y)
        if normal is None:
            step = _solved(matrix, -values)
        else:
            whole = np.vstack((matrix, normal))
            step = _solved(whole, np.append(-values, normal @ (guess - y)))
        size = float(np.linalg.norm(step))
        if sizes is not None:
            sizes.append(size)
        if not np.isfinite(size) or (size > 0.5 * last and size > _ACCEPTED) or size > 10.0:
            break
        y = y + step
        # Below the root of rounding the next step, its square, is none.
        if size <= _CONVERGED or (size > 0.5 * last and size <= _ACCEPTED):
            return y, matrix
        last = size
    raise NotConvergedError


def corrected(
    curve: Curve, guess: FloatArray, normal: FloatArray, along: FloatArray | None = None
) -> CurvePoint:
    """The point of a curve on the plane through a guess, square to ``normal``.

    along : side on which its direction lies; default ``normal``
    """
    y, matrix = newton(curve, guess, normal)
    return CurvePoint(y, matrix, tangent(matrix, normal if along is None else along))


def tangent(matrix: FloatArray, along: FloatArray) -> FloatArray:
    """The direction of the curve, of length one, on the same side as ``along``.

    matrix : (m, m + 1) derivative of F
    """
    value = np.zeros(along.size)
    value[-1] = 1.0
    direction = _solved(np.vstack((matrix, along)), value)
    size = float(np.linalg.norm(direction))
    if not np.isfinite(size):
        raise NotConvergedError
    return direction / size


def _solved(matrix: FloatArray, values: FloatArray) -> FloatArray:
    """The solution of a square system whose rows are radians, velocities and torques."""
    sizes = np.max(np.abs(matrix), axis=1)
    if not np.all(np.isfinite(sizes)) or not np.all(np.isfinite(values)):
        raise NotConvergedError
    sizes[sizes == 0.0] = 1.0
    try:
        return np.linalg.solve(matrix / sizes[:, None], values / sizes)
    except np.linalg.LinAlgError:
        raise NotConvergedError from None
