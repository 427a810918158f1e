"""Nonlinear least squares: values, their covariance, and what is determined."""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Generic, NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from wedgebrake.analysis.fitting.model import Linearised, Model, Simulated
from wedgebrake.arrays import FloatArray
from wedgebrake.errors import InputError

# Singular values of the relative derivatives, in shares of the largest, that are rounding: the
# derivatives are exact to about 1e-9.
_ROUNDING = 1e-7
# Share of a direction from which a parameter takes part in it.
_PART = 0.1
# Least scale of a value whose range contains 0, as a share of the width of the range.
_LEAST_SCALE = 1e-4
# Shares of the trace that are fitted one after another, so that phases do not slip by a period.
_SHARES = (1 / 32, 1 / 16, 1 / 8, 1 / 4, 1 / 2)
_FEWEST, ROUGH, _TIGHT = 24, 1e-4, 1e-14
# Weight of the distance from the start of a share, in ranges, beside residuals in sigmas.
_PULL = 1e-2
# Rows of each block of a QR decomposition, so that it fits into the processor's cache.
_BLOCK = 512

Computed = TypeVar("Computed")

# Losses of squares z and their derivatives, as scipy.optimize.least_squares defines them.
_LOSSES: dict[str, Callable[[FloatArray], tuple[FloatArray, FloatArray]]] = {
    "soft_l1": lambda z: (2.0 * z / (np.sqrt(1.0 + z) + 1.0), 1.0 / np.sqrt(1.0 + z)),
    "huber": lambda z: (
        np.where(z <= 1.0, z, 2.0 * np.sqrt(z) - 1.0),
        1.0 / np.sqrt(np.maximum(z, 1.0)),
    ),
    "cauchy": lambda z: (np.log1p(z), 1.0 / (1.0 + z)),
    "arctan": lambda z: (np.arctan(z), 1.0 / (1.0 + z**2)),
}


class Loss(NamedTuple):
    """A loss of scipy.optimize.least_squares, and the residual at which it begins to bend."""

    name: str = "linear"
    scale: float = 1.0

    def bent(self, rows: FloatArray) -> FloatArray:
        """Derivatives and, as last column, residuals whose squares are the loss of the given ones.

        rows : (r, n + 1)
        """
        if self.name == "linear":
            return rows
        z = (rows[:, -1] / self.scale) ** 2 + np.finfo(float).tiny
        value, slope = _LOSSES[self.name](z)
        ratio = np.sqrt(value / z)
        found = rows * (slope / ratio)[:, None]
        found[:, -1] = rows[:, -1] * ratio
        return found


class _Stage(NamedTuple):
    """Least squares over the first samples.

    size : number of samples, at most all
    most : largest number of steps
    """

    size: int
    most: int = 20
    tolerance: float = ROUGH


_CONVERGED = _Stage(sys.maxsize, 200, _TIGHT)


@dataclass(frozen=True)
class FitProblem:
    """A fit: a model, free parameters with their bounds, and the scale of each column.

    free   : lower and upper limit by name
    sigmas : of each observation, in its unit
    known  : whether ``sigmas`` are the deviations of the measurement, so that the covariance is not
             scaled with the residuals
    """

    model: Model
    free: Mapping[str, tuple[float, float]]
    sigmas: tuple[float, ...]
    known: bool
    loss: Loss

    @cached_property
    def measured(self) -> list[FloatArray]:
        """The measured columns."""
        trace = self.model.trace
        return [trace.columns[one.column] for one in self.model.observations]

    @property
    def size(self) -> float:
        """Norm of the residuals of a model that predicts only the mean of each column."""
        each = zip(self.measured, self.sigmas, strict=True)
        squares = [np.isfinite(one).sum() * np.nanvar(one) / sigma**2 for one, sigma in each]
        return float(np.sqrt(sum(squares))) or 1.0

    @property
    def start(self) -> dict[str, float]:
        """The values from which the fit starts, in their ranges."""
        found = {name: self._within(name, self.model.value(name)) for name in self.free}
        for name, value in self.model.measured_start(found).items():
            found[name] = self._within(name, value)
        return found

    def _within(self, name: str, value: float) -> float:
        """The value of a parameter, or the middle of its range if it lies outside."""
        low, high = self.free[name]
        return value if low <= value <= high else 0.5 * (low + high)

    def linearised(self, values: Mapping[str, float], count: int) -> FloatArray:
        """Derivatives of the residuals, and as last column the residuals themselves, in sigmas.

        Returns (residuals, parameters + 1), for the first samples that were measured and, if these
        are all samples, for the measured numbers. A residual is model minus measurement; it is nan
        if the system cannot have the values or if its run stops.
        """
        model, p = self.model, len(values)
        numbers = model.numbers if count == model.trace.time.size else None
        found = missing = Linearised.missing(model.observations, p, count)
        near, by = np.full(len(model.numbers_each), np.nan), np.zeros((len(model.numbers_each), p))
        try:
            if model.observations:
                found = model.linearised(values, count)
            if numbers is not None:
                near, by = model.numbers_at(values)
        except InputError:
            if model.simulate(values, count).responses:  # it has no derivative
                raise
            found = missing
        parts = self.rows_of(found.columns, found.changes, slice(count))
        if numbers is not None:
            by[np.isnan(by)] = 0.0
            rows = np.column_stack([by, near - numbers.measured])
            parts.append(rows / numbers.sigmas[:, None])
        return np.concatenate(parts)

    def rows_of(
        self, columns: list[FloatArray], changes: list[FloatArray], samples: slice
    ) -> list[FloatArray]:
        """Derivatives and residuals of some samples of each column, where these were measured."""
        parts = []
        each = zip(columns, changes, self.measured, self.sigmas, strict=True)
        for column, by, measured, sigma in each:
            # Where a guard is only grazed there is no derivative: the step ignores these samples.
            by[np.isnan(by)] = 0.0
            rows = np.column_stack([by, column - measured[samples]])
            rows /= sigma
            parts.append(rows[np.isfinite(measured[samples])])
        return parts

    def pull(self, count: int) -> FloatArray:
        """Weights of the distances from the start while some of ``count`` samples are fitted."""
        low, high = np.array([*self.free.values()], float).reshape(-1, 2).T
        return np.asarray(_PULL * np.sqrt(count) / (high - low))

    def simulated(
        self,
        values: Mapping[str, float],
        starts: FloatArray | None = None,  # noqa: ARG002 - it has no segments
    ) -> Simulated:
        """Simulate the whole trace.

        starts : of its segments, see ``Estimate``; None: those from which a fit starts
        """
        return self.model.simulate(values, self.model.trace.time.size)

    def cost(self, found: Estimate) -> float:
        """The sum that a fit minimises, of squares or of their losses; inf if the run stops."""
        rows = self.loss.bent(found.residuals[:, None])
        total = product(rows[:, -1], rows[:, -1])
        return total if np.isfinite(total) else np.inf

    def named(self, x: FloatArray) -> dict[str, float]:
        """Values by name."""
        return dict(zip(self.free, map(float, x), strict=True))

    def solve(self, start: Mapping[str, float]) -> Estimate:
        """Fit growing shares of the trace, then all of it."""
        return self._through(start, [*self._shares, _CONVERGED])

    def approached(self, start: Mapping[str, float]) -> Estimate:
        """As ``solve``, but with few steps, as a choice among many starts needs."""
        return self._through(start, [*self._shares, _Stage(self.model.trace.time.size)])

    def refined(self, found: Estimate) -> Estimate:
        """The minimum near what is ``approached``."""
        return self._through(found.values, [_CONVERGED])

    @property
    def _shares(self) -> list[_Stage]:
        size = self.model.trace.time.size
        counts = sorted({int(share * size) for share in _SHARES if share * size >= _FEWEST})
        return [_Stage(count) for count in counts]

    def _through(self, start: Mapping[str, float], stages: list[_Stage]) -> Estimate:
        """Fit in stages, each from the values of the one before."""
        size = self.model.trace.time.size
        if not self.free:
            rows = self.linearised({}, size)
            return Estimate(
                {}, rows[:, -1], rows[:, :-1], np.zeros(0), 1, True, "Nothing is free.", self.known
            )  # fmt: skip
        low, high = np.array(list(self.free.values()), float).T
        inner = 1e-9 * (high - low)
        x, runs = np.array([start[name] for name in self.free]), 0
        for stage in stages:
            count = min(stage.size, size)
            # A beginning may not determine all parameters: these stay where they are.
            pull = np.zeros(0) if count == size else self.pull(count)
            objective = self._objective(count, pull, x)
            found = least_squares(
                objective.residuals, np.clip(x, low + inner, high - inner), objective.jacobian,
                bounds=(low, high), x_scale=high - low,
                loss=self.loss.name, f_scale=self.loss.scale, max_nfev=stage.most,
                **dict.fromkeys(("ftol", "xtol", "gtol"), stage.tolerance),
            )  # fmt: skip
            x, runs = found.x, runs + int(found.nfev)
        rows = objective.at(x)
        ends = np.cumsum([*map(np.count_nonzero, map(np.isfinite, self.measured))])
        return Estimate(
            self.named(x), rows[:, -1].copy(), rows[:, :-1], scales(x, low, high), runs,
            int(found.status) > 0, str(found.message), self.known, ends=tuple(ends.tolist()),
        )  # fmt: skip

    def _objective(self, count: int, pull: FloatArray, at: FloatArray) -> Objective[FloatArray]:
        """Residuals of the first samples, followed by the weighted distances from some values.

        pull : weights of these distances; empty if there are none
        """

        def table(x: FloatArray, rows: FloatArray) -> FloatArray:
            if self.loss.name == "linear":
                rows = triangular(rows)
            if pull.size:
                pulls = np.column_stack([np.diag(pull), pull * (x - at)])
                rows = np.vstack([rows, pulls])
            return rows

        return Objective(lambda x: self.linearised(self.named(x), count), table)


class Objective(Generic[Computed]):
    """Residuals and their derivatives for ``least_squares``, both from one computation.

    of    : what is computed for some unknowns
    table : its derivatives and, as last column, residuals, as the method takes them
    """

    def __init__(
        self, of: Callable[[FloatArray], Computed],
        table: Callable[[FloatArray, Computed], FloatArray],
    ) -> None:  # fmt: skip
        self._of, self._table_of = of, table
        self._known: tuple[FloatArray, Computed, FloatArray] | None = None

    def at(self, x: FloatArray) -> Computed:
        """What is computed for some unknowns; the last one is kept."""
        return self._move(x)[0]

    def residuals(self, x: FloatArray) -> FloatArray:
        """Residuals."""
        return self._move(x)[1][:, -1]

    def jacobian(self, x: FloatArray) -> FloatArray:
        """Derivatives of what ``residuals`` returns."""
        return self._move(x)[1][:, :-1]

    def _move(self, x: FloatArray) -> tuple[Computed, FloatArray]:
        if self._known is None or not np.array_equal(x, self._known[0]):
            found = self._of(x)
            self._known = x.copy(), found, self._table_of(x, found)
        return self._known[1:]


def product(one: FloatArray, other: FloatArray) -> float:
    """Return the sum of products over samples.

    This does not use BLAS, whose threads occupy processors after the sum while they wait for work.
    """
    return float(np.einsum("i,i", one, other))


def triangular(rows: FloatArray) -> FloatArray:
    """Return the triangular factor R of a QR decomposition, computed by blocks of rows.

    rows : (m, n), with m much larger than n

    The sum of squares, its gradient and the steps to its minimum are the same for R, so that the
    least-squares method need not process every sample.
    """
    n = rows.shape[1]
    while len(rows) > 2 * _BLOCK:
        count = len(rows) // _BLOCK
        blocks = rows[: count * _BLOCK].reshape(count, _BLOCK, n)
        reduced = np.asarray(np.linalg.qr(blocks, mode="r")).reshape(-1, n)
        rows = np.vstack([reduced, rows[count * _BLOCK :]])
    return np.asarray(np.linalg.qr(rows, mode="r"))


def scales(x: FloatArray, low: FloatArray, high: FloatArray) -> FloatArray:
    """Scales of the changes of values with these ranges: their magnitudes.

    Near 0, a magnitude is no scale: if a range contains 0, its scale is at least a share of it.
    """
    least = np.where(low * high <= 0.0, _LEAST_SCALE * (high - low), 0.0)
    return np.asarray(np.maximum(np.abs(x), least))


def _singular(table: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Singular values, and right singular vectors as rows."""
    _, s, rows = np.linalg.svd(table, full_matrices=False)
    return s, rows


@dataclass(frozen=True)
class Estimate:
    """The minimum of a sum of squares.

    residuals : (r,) in sigmas
    jacobian  : (r, p) their derivatives with respect to the values; with ``basis``, (r, q) with
                respect to q coordinates
    scales    : (p,) of the values, see ``scales``
    starts    : states at the starts of the segments but the first; None without segments
    basis     : (p, q) changes of the values, in their scales, per unit of each coordinate
    ends      : index after the last residual of each column; the residuals of measured numbers
                follow
    """

    values: dict[str, float]
    residuals: FloatArray
    jacobian: FloatArray
    scales: FloatArray
    evaluations: int
    converged: bool
    message: str
    known: bool
    starts: FloatArray | None = None
    basis: FloatArray | None = None
    ends: tuple[int, ...] = ()

    @property
    def freedom(self) -> int:
        """Number of residuals less the number of parameters."""
        return max(self.residuals.size - len(self.values), 1)

    @property
    def variance(self) -> float:
        """Sum of squares per degree of freedom."""
        return product(self.residuals, self.residuals) / self.freedom

    @cached_property
    def _directions(self) -> tuple[FloatArray, FloatArray, NDArray[np.bool_]]:
        """Singular values of the derivatives, directions, and which are determined.

        The directions are changes of the values in their scales.
        """
        table = self.jacobian * self.scales if self.basis is None else self.jacobian
        count, p = table.shape
        if count < p:  # directions without a residual
            table = np.vstack([table, np.zeros((p - count, p))])
        s, rows = _singular(table / self._row_scales(table))
        known = s > _ROUNDING * max(float(s[0]), 1e-300)
        s[known], own = _singular(table @ rows[known].T)
        rows[known] = own @ rows[known]
        if self.basis is not None:
            rows = rows @ self.basis.T
            sizes = np.linalg.norm(rows[~known], axis=1, keepdims=True)
            rows[~known] /= np.maximum(sizes, np.finfo(float).tiny)
        return s, rows, known

    def _row_scales(self, table: FloatArray) -> FloatArray:
        """Largest norm of a row and the rows before it in its column of the trace, (r, 1).

        The rounding errors of derivatives are proportional to it. If deviations grow in time, as in
        chaotic motion, the first samples may determine what rounding hides in the last ones. It is
        1 for a fit in segments.
        """
        if self.basis is not None:
            return np.ones((len(table), 1))
        sizes = np.linalg.norm(table, axis=1)
        for part in np.split(sizes, self.ends)[:-1]:
            np.maximum.accumulate(part, out=part)
        return np.where(sizes > 0.0, sizes, 1.0)[:, None]

    @cached_property
    def covariance(self) -> FloatArray:
        """Covariance of the values, (p, p); inf for what is not determined."""
        s, rows, known = self._directions
        scaled = (rows[known].T / s[known] ** 2) @ rows[known]
        found: FloatArray = scaled * np.outer(self.scales, self.scales)
        found *= 1.0 if self.known else self.variance
        for direction in rows[~known]:
            parts = np.abs(direction) > _PART
            found[parts] = found[:, parts] = np.nan
            found[parts, parts] = np.inf
        return found

    @property
    def undetermined(self) -> list[dict[str, float]]:
        """Directions in which nothing measured changes: relative changes by name."""
        _, rows, known = self._directions
        found = []
        for direction in rows[~known]:
            most = direction[np.argmax(np.abs(direction))]
            named = zip(self.values, direction / most, strict=True)
            found.append({name: float(one) for name, one in named if abs(one) > _PART})
        return found
