"""Starting values of a fit within the ranges, found by features of the trace.

Features hardly change with the phase of a vibration or with a small shift of the time. If the
features of a simulation are like those of the trace, a fit to the trace can start from its values,
even if the two motions differ at each sample.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from wedgebrake.analysis.responses.spectrum import window_weights
from wedgebrake.analysis.sobol import sobol
from wedgebrake.arrays import FloatArray

if TYPE_CHECKING:
    from wedgebrake.analysis.fitting.estimate import FitProblem

# Numbers of simulated points in the ranges, of those with measured numbers, which take longer, and
# of those from which the trace is fitted.
_POINTS, _POINTS_OF_NUMBERS, _STARTS = 512, 64, 4
# Ranges whose bounds have at least this ratio are covered on a logarithmic scale.
_DECADE = 10.0
# Number of parts of the trace, which show growth and decay.
_PARTS = 4
# Shares of the power below the frequencies that describe a spectrum.
_SHARES = (0.1, 0.3, 0.5, 0.7, 0.9)
# Amplitudes far below this share of the measured one are not distinguished from 0.
_LEAST = 1e-3
# Largest change between two samples at rest, relative to the range of the column.
_REST = 1e-4


class Features:
    """Features of a measured column, and their distance from those of a simulated column.

    The features are: mean, standard deviation and range in each quarter of the trace; the
    frequencies below which certain shares of the power lie; and the share of time at rest.

    time   : (k,) of the samples [s]
    column : (k,) measured; nan: not measured
    """

    def __init__(self, time: FloatArray, column: FloatArray) -> None:
        self._time, self._known = time, np.isfinite(column)
        self._even = np.linspace(time[0], time[-1], time.size)
        self._window = window_weights("hann", time.size)
        self._size = float(np.nanstd(column)) or float(np.nanmax(np.abs(column))) or 1.0
        self._measured = self._of(column)

    def distance(self, column: FloatArray) -> float:
        """The distance between the features of a simulated column (k,) and of the measured one."""
        return float(np.linalg.norm(self._of(column) - self._measured))

    def _of(self, column: FloatArray) -> FloatArray:
        """The features of a column, whose values are divided by the size of the measured one.

        Standard deviations, ranges and frequencies are logarithms. Only the measured samples are
        compared.
        """
        known = self._known
        even = np.interp(self._even, self._time[known], column[known] / self._size)
        parts = np.array_split(even, _PARTS)
        sizes = [[part.std(), np.ptp(part)] for part in parts]
        power = np.abs(np.fft.rfft((even - even.mean()) * self._window)) ** 2
        power[0] = np.finfo(float).tiny  # a constant has the frequency 0
        places = np.interp(_SHARES, np.cumsum(power) / power.sum(), np.arange(power.size))
        rest = np.mean(np.abs(np.diff(even)) <= _REST * np.ptp(even))
        return np.concatenate(
            [[part.mean() for part in parts], np.ravel(np.log(np.add(sizes, _LEAST))),
             np.log1p(places), [rest]]
        )  # fmt: skip


def starts_by_features(problem: FitProblem) -> list[dict[str, float]]:
    """Values within the ranges whose features are most like those of the trace, best first.

    The ranges are covered by Sobol points. ``time_shift``, and initial conditions that a column
    measures, keep the starting values that they have otherwise: features hardly depend on
    ``time_shift``, and measured initial conditions are known. Empty if no run reaches the end of
    the trace.
    """
    model, start = problem.model, problem.start
    kept = {"time_shift", *model.measured_start(start)}
    names = [name for name in problem.free if name not in kept]
    if not names:
        return []
    count = _POINTS if model.numbers is None else _POINTS_OF_NUMBERS
    points = sobol(count, len(names), 0)
    columns = [_spread(*problem.free[name], one) for name, one in zip(names, points.T, strict=True)]
    features = [Features(model.trace.time, one) for one in problem.measured]
    found, distances = [], []
    for row in zip(*columns, strict=True):
        values = {**start, **dict(zip(names, map(float, row), strict=True))}
        run = model.simulate(values, model.trace.time.size)
        if not run.responses:
            continue
        each = [one.distance(column) for one, column in zip(features, run.columns, strict=True)]
        each += _distances(problem, values)
        found.append(values)
        distances.append(float(np.linalg.norm(each)))
    order = np.argsort(distances, kind="stable")
    return [found[place] for place in order if np.isfinite(distances[place])][:_STARTS]


def _distances(problem: FitProblem, values: dict[str, float]) -> list[float]:
    """Distances of measured numbers, relative to their sizes; nan where one does not exist."""
    model = problem.model
    if model.numbers is None:
        return []
    near, _ = model.numbers_at(values)
    sizes = np.maximum(np.abs(model.numbers.measured), model.numbers.sigmas)
    return list(np.abs(near - model.numbers.measured) / sizes)


def _spread(low: float, high: float, places: FloatArray) -> FloatArray:
    """Values in a range at places (n,) from 0 to 1, on a logarithmic scale if it is wide."""
    if low * high > 0.0 and max(low / high, high / low) >= _DECADE:
        return np.asarray(low * (high / low) ** places)
    return np.asarray(low + (high - low) * places)
