"""Starting values of a fit, found from features of the trace within the ranges.

Features hardly change with the phase of a vibration or with a small shift of the time. Where a
simulation has features like those of the trace, a fit to the trace itself can start, even if the
two motions differ at each sample.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from wedgebrake.analysis.responses.spectrum import window_weights
from wedgebrake.analysis.sobol import sobol
from wedgebrake.arrays import FloatArray

if TYPE_CHECKING:
    from wedgebrake.analysis.fitting.estimate import FitProblem

# Simulated points in the ranges, fewer with measured numbers, which take longer, and points from
# which the trace is fitted.
_POINTS, _POINTS_OF_NUMBERS, _STARTS = 512, 64, 4
# Ranges whose ends have at least this ratio are covered on a logarithmic scale.
_DECADE = 10.0
# Parts of the trace, so that growth and decay are seen.
_PARTS = 4
# Shares of the power below the frequencies that describe a spectrum.
_SHARES = (0.1, 0.3, 0.5, 0.7, 0.9)
# Amplitudes below this share of the measured one are equal to 0.
_LEAST = 1e-3
# Steps between samples that are at rest, in ranges of the column.
_REST = 1e-4


class Features:
    """Features of a measured column, and their distance from those of a simulated one.

    They are, in each quarter of the trace, mean, standard deviation and range; the frequencies
    below which certain shares of the power lie; and the share of time at rest.

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
        """The distance of a simulated column (k,)."""
        return float(np.linalg.norm(self._of(column) - self._measured))

    def _of(self, column: FloatArray) -> FloatArray:
        """The features: means in sizes of the measured column, logarithms of sizes and frequencies.

        A model is compared at the measured samples only.
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
    """Values within the ranges whose runs have features most like those of the trace, best first.

    The ranges are covered by Sobol points. A shift of the time, and initial conditions that a
    column measures, keep the values from which a fit starts otherwise: features do not depend on
    the former, and the latter are known. Empty if no run reaches the end of the trace.
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
    """Distances of measured numbers, in their sizes; nan where one does not exist."""
    model = problem.model
    if model.numbers is None:
        return []
    near, _ = model.numbers_at(values)
    sizes = np.maximum(np.abs(model.numbers.measured), model.numbers.sigmas)
    return list(np.abs(near - model.numbers.measured) / sizes)


def _spread(low: float, high: float, places: FloatArray) -> FloatArray:
    """Values in a range at places (n,) from 0 to 1, on a logarithmic scale across decades."""
    if low * high > 0.0 and max(low / high, high / low) >= _DECADE:
        return np.asarray(low * (high / low) ** places)
    return np.asarray(low + (high - low) * places)
