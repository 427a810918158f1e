"""Multiple shooting: least squares over segments of a trace, each of which continues the last."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy.linalg import qr
from scipy.optimize import OptimizeResult, least_squares

from wedgebrake.analysis.fitting.estimate import (
    ROUGH,
    TIGHT,
    Estimate,
    FitProblem,
    Objective,
    triangular,
)
from wedgebrake.analysis.fitting.model import Simulated
from wedgebrake.analysis.fitting.segments import Segment, SegmentedModel, StateSpace
from wedgebrake.arrays import FloatArray
from wedgebrake.errors import InputError

# Weights of the gaps between segments, and of the distances of the measured states from those at
# the start of the step, one after another. With weight 1, a gap or distance as large as the motion
# counts as much as residuals as large as the motion in all samples of a segment.
_STEPS = ((0.1, 10.0), (0.1, 1.0), (1.0, 0.1), (10.0, 0.0), (100.0, 0.0), (1e3, 0.0))
_LAST = 1e4
# Gaps in sizes of the motion: those that are rounding, and the largest of a fit that has converged.
_ROUNDING, _CLOSED = 1e-14, 1e-9
# Largest number of fits with other multipliers, and the share of the gaps that one may leave.
_MULTIPLIERS, _LEFT = 8, 0.3


@dataclass(frozen=True)
class Shooting(FitProblem):
    """A fit in segments, whose states at the start are unknowns too, except of the first one.

    Each segment must begin in the state in which the one before it ends. These constraints are
    satisfied by the method of multipliers: least squares of the residuals and of the weighted gaps
    between segments, first with small weights, in the end with a large weight and multipliers.
    """

    model: SegmentedModel

    def simulated(self, values: Mapping[str, float], starts: FloatArray | None = None) -> Simulated:
        """Simulate the whole trace, in segments."""
        return self.model.simulated(values, starts)

    def solve(self, start: Mapping[str, float]) -> Estimate:
        """Fit with gaps between the segments that become smaller, then without gaps."""
        shooter = _Shooter(self, start)
        x, before = shooter.start, np.inf
        for weight, hold in _STEPS:
            x = shooter.fitted(x, weight, shooter.pulls(hold)).x
        for _ in range(_MULTIPLIERS):
            found = shooter.fitted(x, _LAST)
            x, largest = found.x, shooter.adapt(found.x)
            if largest <= _ROUNDING or not largest <= _LEFT * before:
                break
            before = largest
        message, closed = str(found.message), largest <= _CLOSED
        if not closed:
            message += (
                " The segments do not continue each other: gaps between them are up to"
                f" {largest:.2g} of the size of the motion."
            )
        return shooter.estimate(x, int(found.status) > 0 and closed, message)


class _Shooter:
    """The least-squares problem of a fit in segments.

    Its unknowns x (n,) are the free parameters and the states at the starts of all segments but
    the first.

    start : unknowns from which the fit starts
    """

    def __init__(self, problem: Shooting, start: Mapping[str, float]) -> None:
        self._problem, self._model, self._p = problem, problem.model, len(start)
        guess = self._model.guess(start)
        self.start, self._shape = np.append([*start.values()], guess), guess.shape
        segments = self._model.linearised_segments(start, guess)
        machine = self._model.system.machine
        self._free = StateSpace.of(machine, segments[0].states.shape[1]).free
        self._sizes = _sizes(np.concatenate([one.states[:-1, self._free] for one in segments]))
        self._multipliers, self._runs, self._count = np.zeros(guess.size), 1, 0
        self._unit = problem.size / np.sqrt(len(segments))
        self._low, self._high = np.array([*problem.free.values()], float).reshape(-1, 2).T
        self._objective: Objective[list[Segment]] | None = None

    def pulls(self, hold: float) -> FloatArray:
        """Weights of the distances from the unknowns at the start of a step, (n, n).

        While gaps are allowed, the trace may not determine all parameters, and states at the starts
        of segments could compensate for wrong ones.

        hold : weight of the distances of the measured states, or of the changes from one segment to
               the next if the angle is the integral of a measured speed, see ``_STEPS``
        """
        (count, s), p, measured = self._shape, self._p, self._model.measured
        n = len(self._model.system.machine.inertias)
        known = np.array([row in measured for row in self._free])
        integrated = ~known & np.array([row + n in measured for row in self._free])
        distances = np.kron(np.eye(count), np.diag(known / self._sizes))
        changes = np.kron(np.eye(count) - np.eye(count, k=-1), np.diag(integrated / self._sizes))
        found = np.zeros((p + count * s, p + count * s))
        found[:p, :p] = np.diag(self._problem.pull(self._model.trace.time.size))
        found[p:, p:] = hold * self._unit * (distances + changes)
        return found

    def fitted(
        self, x: FloatArray, weight: float, pulls: FloatArray | None = None
    ) -> OptimizeResult:
        """Least squares of the residuals and of the gaps with a weight, from some unknowns on.

        pulls : from ``pulls``, in a step; None in the end
        """
        p, loss, reach = self._p, self._problem.loss, self._high - self._low
        at, last = x.copy(), pulls is None
        robust = last and loss.name != "linear"
        at[:p] = np.clip(at[:p], self._low + 1e-9 * reach, self._high - 1e-9 * reach)
        size = weight * self._unit

        def table(x: FloatArray, segments: list[Segment]) -> FloatArray:
            if not segments:  # one does not reach its end
                return np.full((self._count, x.size + 1), np.nan)
            parts = [
                self._placed(rows if robust else triangular(rows), number)
                for number, rows in enumerate(self._rows(segments))
            ]
            parts.append(size * self._gaps(x, segments))
            parts[-1][:, -1] += self._multipliers / size
            if pulls is not None:
                parts.append(np.column_stack([pulls, pulls @ (x - at)]))
            found = np.concatenate(parts)
            self._count = len(found)
            return found

        self._objective = Objective(self._segments, table)
        more = np.full(x.size - p, np.inf)
        found = least_squares(
            self._objective.residuals, at, self._objective.jacobian,
            bounds=(np.append(self._low, -more), np.append(self._high, more)),
            x_scale=np.append(reach, np.resize(self._sizes, more.size)),
            loss=loss.name if robust else "linear", f_scale=loss.scale,
            max_nfev=200 if last else 20,
            **dict.fromkeys(("ftol", "xtol", "gtol"), TIGHT if last else ROUGH),
        )  # fmt: skip
        self._runs += int(found.nfev)
        return found

    def adapt(self, x: FloatArray) -> float:
        """Adapt the multipliers to the gaps that the last fit has left; returns the largest gap."""
        gaps = self._gaps(x, self._segments_at(x))[:, -1]
        self._multipliers += (_LAST * self._unit) ** 2 * gaps
        return float(np.abs(gaps).max(initial=0.0))

    def estimate(self, x: FloatArray, converged: bool, message: str) -> Estimate:
        """The values, with derivatives of the residuals over all changes that leave no gaps."""
        segments, p = self._segments_at(x), self._p
        sizes = np.append(np.abs(x[:p]), np.resize(self._sizes, x.size - p))
        sizes[sizes == 0.0] = 1.0
        gaps = self._gaps(x, segments)[:, :-1] * sizes
        # Directions of the unknowns, in their sizes: in chaotic motion, parameters hardly change.
        basis = qr(gaps.T)[0][:, len(gaps) :]
        rows = self._rows(segments)
        places = [self._places(number) for number in range(len(rows))]
        jacobian = [
            (one[:, : len(at)] * sizes[at]) @ basis[at]
            for one, at in zip(rows, places, strict=True)
        ]
        return Estimate(
            self._problem.named(x[:p]), np.concatenate([one[:, -1] for one in rows]),
            np.concatenate(jacobian), self._runs, converged, message, self._problem.known,
            self._starts(x), basis[:p],
        )  # fmt: skip

    def _starts(self, x: FloatArray) -> FloatArray:
        return x[self._p :].reshape(self._shape)

    def _segments_at(self, x: FloatArray) -> list[Segment]:
        """The segments that the last fit has computed."""
        return self._segments(x) if self._objective is None else self._objective.at(x)

    def _segments(self, x: FloatArray) -> list[Segment]:
        """The segments; none if one does not reach its end, or if the system cannot have x."""
        values, starts = self._problem.named(x[: self._p]), self._starts(x)
        try:
            return self._model.linearised_segments(values, starts)
        except InputError:
            if self._model.simulated(values, starts).responses:  # it has no derivative
                raise
            return []

    def _rows(self, segments: list[Segment]) -> list[FloatArray]:
        """Of each segment the derivatives (r, p + s) and, as last column, residuals in sigmas."""
        ends = [*self._model.firsts[1:], None]
        return [
            np.concatenate(self._problem.rows_of(one.columns, one.changes, slice(first, end)))
            for one, first, end in zip(segments, self._model.firsts, ends, strict=True)
        ]

    def _places(self, number: int) -> list[int]:
        """Unknowns on which a segment depends: the parameters, and its state at the start."""
        first = self._p + (number - 1) * self._shape[1]
        state = range(first, first + self._shape[1]) if number else ()
        return [*range(self._p), *state]

    def _placed(self, rows: FloatArray, number: int) -> FloatArray:
        """Rows of a segment over all unknowns, and their last column."""
        at, found = self._places(number), np.zeros((len(rows), self.start.size + 1))
        found[:, at], found[:, -1] = rows[:, : len(at)], rows[:, -1]
        return found

    def _gaps(self, x: FloatArray, segments: list[Segment]) -> FloatArray:
        """Derivatives (gaps, n) of the gaps and, as last column, gaps in sizes of the motion."""
        found, starts = [np.empty((0, x.size + 1))], self._starts(x)
        for number, (one, start) in enumerate(zip(segments, starts, strict=False)):
            ends = np.nan_to_num(one.ends[self._free])
            gaps = self._placed(np.column_stack([ends, one.states[-1, self._free] - start]), number)
            gaps[:, self._places(number + 1)[self._p :]] = -np.eye(start.size)
            found.append(gaps / self._sizes[:, None])
        return np.concatenate(found)


def _sizes(states: FloatArray) -> FloatArray:
    """Sizes of the motion in some states (k, s): deviations from straight lines; 1 if at rest."""
    line = np.vander(np.linspace(-1.0, 1.0, len(states)), 2)
    apart = states - line @ np.linalg.lstsq(line, states, rcond=None)[0]
    sizes = np.asarray(apart.std(axis=0))
    return np.where(sizes > 1e-9 * np.abs(states).max(axis=0), sizes, 1.0)
