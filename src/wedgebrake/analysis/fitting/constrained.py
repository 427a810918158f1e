"""Least squares under constraints: a damped Gauss-Newton method that eliminates the constraints."""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property
from typing import NamedTuple

import numpy as np
from scipy.linalg import qr, solve_triangular

from wedgebrake.arrays import FloatArray

# Changes of the unknowns, in their units, that are rounding, and below which rounding may prevent
# smaller ones; the largest constraint of a solution.
_ROUNDING, _SMALL, _CLOSED = 1e-13, 1e-8, 1e-9
# Share of the sum of squares by which a change must reduce it.
_LEAST_DECREASE = 1e-16
# Singular values of the derivatives, in shares of the largest, along which nothing changes.
_UNDETERMINED = 1e-8
_MOST_CHANGES, _LEAST_FACTOR = 100, 1e-4


class Linear(NamedTuple):
    """Residuals and constraints at some unknowns x (n,), with their derivatives.

    rows : for each group of residuals the k unknowns on which it depends, and (r, k + 1) their
           derivatives and, as last column, the residuals
    gaps : (g, n + 1) derivatives of the constraints with respect to all unknowns and, as last
           column, their values, which must become 0
    """

    rows: list[tuple[list[int], FloatArray]]
    gaps: FloatArray

    @property
    def residuals(self) -> FloatArray:
        """All residuals."""
        return np.concatenate([rows[:, -1] for _, rows in self.rows])


class Reduced:
    """Linear least squares over the changes of the unknowns that satisfy the constraints.

    scale : (n,) units of the changes
    fixed : unknowns whose changes are constraints too

    basis    : (n, q) orthonormal directions in which no constraint changes
    jacobian : (r, q) derivatives of the residuals in these directions
    """

    def __init__(self, linear: Linear, scale: FloatArray, fixed: list[int]) -> None:
        self._rows = [(at, rows[:, :-1] * scale[at]) for at, rows in linear.rows]
        constraints = np.vstack([linear.gaps[:, :-1] * scale, np.eye(scale.size)[fixed]])
        count = len(constraints)
        q, r = qr(constraints.T)
        self._range, self._triangle, self.basis = q[:, :count], r[:count], q[:, count:]
        self.jacobian = self._along(self.basis)

    def _along(self, changes: FloatArray) -> FloatArray:
        """Changes of the residuals with changes (n, ...) of the unknowns."""
        return np.concatenate([rows @ changes[at] for at, rows in self._rows])

    @cached_property
    def _inverse(self) -> FloatArray:
        return np.asarray(np.linalg.pinv(self.jacobian, rcond=_UNDETERMINED))

    def change(self, residuals: FloatArray, constraints: FloatArray) -> FloatArray:
        """The change (n,) with least squares of the residuals that leads the constraints to 0.

        constraints : (g + fixed,) values
        """
        closing = self._range @ solve_triangular(self._triangle, -constraints, trans="T")
        return np.asarray(
            closing - self.basis @ (self._inverse @ (residuals + self._along(closing)))
        )

    def decrease(self, change: FloatArray) -> float:
        """The decrease of the sum of squares by a change that no constraint demands."""
        return float(np.sum((self.jacobian @ (self.basis.T @ change)) ** 2))


class Solution(NamedTuple):
    """Unknowns, whether they are a solution, and why the method ends."""

    x: FloatArray
    converged: bool
    message: str


def gauss_newton(
    of: Callable[[FloatArray], Linear | None],
    x: FloatArray,
    scale: FloatArray,
    bounds: tuple[FloatArray, FloatArray],
) -> Solution:
    """Least squares under constraints and bounds, from unknowns x (n,) near the solution.

    Each change solves the linear problem at x. It is shortened until the next one, still with the
    derivatives at x, is smaller: this measure of progress does not depend on the scales of the
    residuals and constraints, and allows long changes along curved constraints.

    of    : residuals and constraints at some unknowns; None if they do not exist there
    scale : (n,) units of the unknowns, in which changes are measured
    """
    here = of(x)
    if here is None:
        return Solution(x, False, "The motion does not exist for the unknowns.")
    for _ in range(_MOST_CHANGES):
        reduced, change, ends = _within_bounds(here, x, scale, bounds)
        size, squares = float(np.linalg.norm(change)), float(np.sum(here.residuals**2))
        closed = bool(np.all(np.abs(here.gaps[:, -1]) <= _CLOSED))
        if closed and size <= _ROUNDING:
            return Solution(x, True, "The changes of the unknowns are rounding.")
        if closed and reduced.decrease(change) <= _LEAST_DECREASE * squares:
            return Solution(x, True, "The sum of squares does not decrease.")
        factor = 1.0
        while factor >= _LEAST_FACTOR:
            near = np.clip(x + factor * scale * change, *bounds)
            there = of(near)
            if there is not None:
                values = np.append(there.gaps[:, -1], (factor - 1.0) * ends)
                following = np.linalg.norm(reduced.change(there.residuals, values))
                if following <= (1.0 - 0.25 * factor) * size:
                    x, here = near, there
                    break
            if closed and size <= _SMALL:
                return Solution(x, True, "The changes of the unknowns become no smaller.")
            factor *= 0.5
        else:
            break
    gap = float(np.abs(here.gaps[:, -1]).max(initial=0.0))
    message = (
        f"The largest gap between segments is {gap:.2g} of the size of the motion. Use more"
        " segments, or initial values nearer to the solution."
    )
    return Solution(x, False, message)


def _within_bounds(
    here: Linear, x: FloatArray, scale: FloatArray, bounds: tuple[FloatArray, FloatArray]
) -> tuple[Reduced, FloatArray, FloatArray]:
    """The change of the unknowns; those that it would lead beyond their bounds are fixed there.

    Returns also the changes to these bounds.
    """
    low, high = ((bound - x) / scale for bound in bounds)
    fixed, ends = list[int](), list[float]()
    while True:
        reduced = Reduced(here, scale, fixed)
        change = reduced.change(here.residuals, np.append(here.gaps[:, -1], np.negative(ends)))
        beyond = np.maximum(low - change, change - high)
        beyond[fixed] = 0.0
        worst = int(np.argmax(beyond))
        if beyond[worst] <= _ROUNDING:
            return reduced, change, np.array(ends)
        fixed.append(worst)
        ends.append(float(np.clip(change[worst], low[worst], high[worst])))
