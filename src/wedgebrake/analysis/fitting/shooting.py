"""Multiple shooting: least squares over segments, each of which continues the one before it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.optimize import least_squares

from wedgebrake.analysis.fitting.constrained import Linear, Reduced, gauss_newton
from wedgebrake.analysis.fitting.estimate import (
    ROUGH,
    Estimate,
    FitProblem,
    Objective,
    scales,
    triangular,
)
from wedgebrake.analysis.fitting.model import Simulated
from wedgebrake.analysis.fitting.segments import Segment, SegmentedModel, StateSpace
from wedgebrake.arrays import FloatArray
from wedgebrake.errors import InputError


class GapStep(NamedTuple):
    """A first step of a fit in segments, in which gaps between the segments are allowed.

    With weight 1, a gap or distance as large as the motion counts as much as residuals as large as
    the motion in all samples of a segment.

    gaps : weight of the gaps
    hold : weight of the distances of measured states from those at the start of the step
    loss : least scale of the loss, in sizes of the motion
    """

    gaps: float
    hold: float
    loss: float


_GAP_STEPS = (
    GapStep(0.1, 10.0, 1.0), GapStep(0.1, 1.0, 0.3), GapStep(1.0, 0.1, 0.1),
    GapStep(10.0, 0.0, 0.03),
)  # fmt: skip


@dataclass(frozen=True)
class Shooting(FitProblem):
    """A fit in segments; the initial states of all segments but the first are unknowns too.

    Each segment must begin in the state in which the one before it ends. Steps of least squares
    with weighted gaps between the segments approach such a motion; a Gauss-Newton method with the
    continuity as constraints then converges.
    """

    model: SegmentedModel

    def simulated(self, values: Mapping[str, float], starts: FloatArray | None = None) -> Simulated:
        """Simulate the whole trace, in segments."""
        return self.model.simulated(values, starts)

    def solve(self, start: Mapping[str, float]) -> Estimate:
        """Fit with gaps between the segments that become smaller, then without gaps."""
        shooter = _Shooter(self, start)
        x = shooter.start
        for step in _GAP_STEPS:
            x = shooter.approached(x, step)
        return shooter.converged(x)

    def approached(self, start: Mapping[str, float]) -> Estimate:
        """The solution: before that, the gaps differ."""
        return self.solve(start)

    def refined(self, found: Estimate) -> Estimate:
        """What is approached."""
        return found


class _Shooter:
    """The least-squares problem of a fit in segments.

    Its unknowns x (n,) are the free parameters and the states at the starts of all segments but
    the first.

    start : unknowns from which the fit starts
    """

    def __init__(self, problem: Shooting, start: Mapping[str, float]) -> None:
        self._problem, self._model, self._p = problem, problem.model, len(start)
        self._guess = self._model.guess(start)
        starts = np.array(self._guess.states)
        self.start, self._shape = np.append([*start.values()], starts), starts.shape
        segments = self._model.linearised_segments(start, starts)
        machine = self._model.system.machine
        self._free = StateSpace.of(machine, segments[0].states.shape[1]).free
        self._sizes = _sizes(np.concatenate([one.states[:-1, self._free] for one in segments]))
        self._unit = problem.size / np.sqrt(len(segments))
        self._low, self._high = np.array([*problem.free.values()], float).reshape(-1, 2).T
        self._scale = np.append(self._high - self._low, np.resize(self._sizes, starts.size))
        self._runs = self._count = 0

    def approached(self, x: FloatArray, step: GapStep) -> FloatArray:
        """Unknowns nearer to the solution, by a step of least squares with gaps."""
        p, margin = self._p, 1e-9 * (self._high - self._low)
        at, pulls = x.copy(), self._pulls(step.hold)
        at[:p] = np.clip(at[:p], self._low + margin, self._high - margin)
        loss, samples = self._problem.loss, self._model.trace.time.size
        least = step.loss * self._problem.size / np.sqrt(samples)
        loss = loss._replace(scale=max(loss.scale, least))

        def table(x: FloatArray, segments: list[Segment]) -> FloatArray:
            if not segments:  # one does not reach its end
                return np.full((self._count, x.size + 1), np.nan)
            parts = [
                self._spread(places, triangular(loss.bent(rows)))
                for places, rows in self._rows(segments)
            ]
            parts.append(step.gaps * self._unit * self._gaps(x, segments))
            parts.append(np.column_stack([pulls, pulls @ (x - at)]))
            found = np.concatenate(parts)
            self._count = len(found)
            return found

        objective, more = Objective(self._segments, table), np.full(x.size - p, np.inf)
        found = least_squares(
            objective.residuals, at, objective.jacobian, x_scale=self._scale, max_nfev=20,
            bounds=(np.append(self._low, -more), np.append(self._high, more)),
            **dict.fromkeys(("ftol", "xtol", "gtol"), ROUGH),
        )  # fmt: skip
        return np.asarray(found.x)

    def converged(self, x: FloatArray) -> Estimate:
        """The solution, from unknowns near it."""
        more = np.full(x.size - self._p, np.inf)
        bounds = np.append(self._low, -more), np.append(self._high, more)
        found = gauss_newton(self._linear, x, self._scale, bounds)
        x, segments = found.x, self._segments(found.x)
        values = self._problem.named(x[: self._p])
        own = scales(x[: self._p], self._low, self._high)
        linear = Linear(self._rows(segments), self._gaps(x, segments))
        reduced = Reduced(linear, np.append(own, self._scale[self._p :]), [])
        return Estimate(
            values, linear.residuals, reduced.jacobian, own, self._runs, found.converged,
            found.message, self._problem.known, self._starts(x), reduced.basis[: self._p],
        )  # fmt: skip

    def _linear(self, x: FloatArray) -> Linear | None:
        """Residuals and gaps for some unknowns; None if a segment does not reach its end."""
        segments, loss = self._segments(x), self._problem.loss
        if not segments:
            return None
        rows = [(places, loss.bent(rows)) for places, rows in self._rows(segments)]
        return Linear(rows, self._gaps(x, segments))

    def _pulls(self, hold: float) -> FloatArray:
        """Weights of the distances from the unknowns at the start of a step, (n, n).

        While gaps are allowed, the trace may not determine all parameters, and states at the starts
        of segments could compensate for wrong ones.

        hold : weight of the distances of the measured states, or of the changes from one segment to
               the next if the angle is the integral of a measured speed, see ``GapStep``
        """
        p, n, s = self._p, self.start.size, self._shape[1]
        direct, integrated = (
            np.ravel(one) / self._scale[p:] for one in (self._guess.direct, self._guess.integrated)
        )
        distances = np.eye(n - p)
        changes = distances - np.eye(n - p, k=-s)
        found = np.zeros((n, n))
        found[:p, :p] = np.diag(self._problem.pull(self._model.trace.time.size))
        found[p:, p:] = direct[:, None] * distances + integrated[:, None] * changes
        found[p:, p:] *= hold * self._unit
        return found

    def _starts(self, x: FloatArray) -> FloatArray:
        return x[self._p :].reshape(self._shape)

    def _segments(self, x: FloatArray) -> list[Segment]:
        """The segments; none if one does not reach its end, or if the system cannot have x."""
        values, starts = self._problem.named(x[: self._p]), self._starts(x)
        self._runs += 1
        try:
            return self._model.linearised_segments(values, starts)
        except InputError:
            if self._model.simulated(values, starts).responses:  # it has no derivative
                raise
            return []

    def _rows(self, segments: list[Segment]) -> list[tuple[list[int], FloatArray]]:
        """Of each segment the unknowns on which it depends, and its rows, see ``Linear``."""
        found, ends = [], [*self._model.firsts[1:], None]
        for number, (one, end) in enumerate(zip(segments, ends, strict=True)):
            samples, places = slice(self._model.firsts[number], end), self._places(number)
            rows = np.concatenate(self._problem.rows_of(one.columns, one.changes, samples))
            found.append((places, np.column_stack([rows[:, : len(places)], rows[:, -1]])))
        return found

    def _places(self, number: int) -> list[int]:
        """Unknowns on which a segment depends: the parameters, and its state at the start."""
        first = self._p + (number - 1) * self._shape[1]
        state = range(first, first + self._shape[1]) if number else ()
        return [*range(self._p), *state]

    def _spread(self, places: list[int], rows: FloatArray) -> FloatArray:
        """Rows with derivatives with respect to some unknowns, over all unknowns."""
        found = np.zeros((len(rows), self.start.size + 1))
        found[:, places], found[:, -1] = rows[:, : len(places)], rows[:, -1]
        return found

    def _gaps(self, x: FloatArray, segments: list[Segment]) -> FloatArray:
        """Derivatives (gaps, n) of the gaps and, as last column, gaps in sizes of the motion."""
        found, starts = [np.empty((0, x.size + 1))], self._starts(x)
        for number, (one, start) in enumerate(zip(segments, starts, strict=False)):
            ends = np.nan_to_num(one.ends[self._free])
            gap = one.states[-1, self._free] - start
            gaps = self._spread(self._places(number), np.column_stack([ends, gap]))
            gaps[:, self._places(number + 1)[self._p :]] = -np.eye(start.size)
            found.append(gaps / self._sizes[:, None])
        return np.concatenate(found)


def _sizes(states: FloatArray) -> FloatArray:
    """Sizes of the motion in some states (k, s): deviations from straight lines; 1 if at rest."""
    line = np.vander(np.linspace(-1.0, 1.0, len(states)), 2)
    apart = states - line @ np.linalg.lstsq(line, states, rcond=None)[0]
    sizes = np.asarray(apart.std(axis=0))
    return np.where(sizes > 1e-9 * np.abs(states).max(axis=0), sizes, 1.0)
