"""Delays and low-pass filters of measured columns, found in the residuals of a fit."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from wedgebrake.arrays import FloatArray

# Number of lags of the test for independent residuals, and its significance level.
LAGS, SIGNIFICANCE = 20, 1e-3
# Least share of the sum of squares of the residuals that must be explained by a delay of the whole
# trace, or by a delay or filter after which the rest is independent. Least share otherwise, and
# greatest rest in this case, as a share of the standard deviation of the column.
_EXPLAINED, _MOST, _REST = 0.6, 0.9, 0.1
# A filter is preferred to a delay if it leaves at most this share of what the delay leaves.
_BETTER = 0.5
# Shares of the trace, from its start, that are compared: in a short one, parameters that imitate a
# filter have not yet shifted the vibration by a period. Fewest samples of a share per unknown, and
# most samples that are compared, for speed.
_SHARES, _FEWEST, _MOST_SAMPLES = (1.0, 0.3, 0.1), 10, 10_000
# Cut-off frequencies of the first search: number, the least in units of 1 / duration, and the
# greatest in units of 1 / sampling interval. Relative accuracy of the best one.
_GRID, _LOWEST, _HIGHEST, _ACCURACY = 20, 5.0, 0.45, 0.02
# Largest relative deviation of a sampling interval from the usual one in evenly spaced samples.
_EVEN = 0.01
# Cut-off frequency (-3 dB) of a moving average, times its duration.
_AVERAGE = 0.443
# Duration at both ends in which a filter without delay is not known, in units of 1 / cut-off.
_ENDS = 0.5


class ColumnNear(NamedTuple):
    """A column of the model near some values of the parameters, linearised, in sigmas.

    model   : (k,) the column at these values
    changes : (k, q) its derivatives with respect to the parameters
    """

    model: FloatArray
    changes: FloatArray


class Explanation(NamedTuple):
    """What explains the residuals of a column: a filter or a delay.

    words   : the filter in words; empty for a delay
    delay   : of the column behind the model [s]
    share   : share of the sum of squares that it explains
    until   : time of the last sample that was compared [s]
    """

    words: str
    delay: float
    share: float
    until: float


class _Filter(NamedTuple):
    """A kind of low-pass filter.

    order    : of a Butterworth filter; 0: a moving average
    centred  : applied forwards and backwards, or centred, so that it has no delay
    """

    order: int
    centred: bool

    def samples(self, cutoff: float, step: float) -> int:
        """Number of samples over which a moving average extends; odd if it is centred."""
        count = max(round(_AVERAGE / (cutoff * step)), 1)
        return count // 2 * 2 + 1 if self.centred else count

    def of(self, rows: FloatArray, cutoff: float, step: float) -> tuple[FloatArray, FloatArray]:
        """Filtered columns, nan at the ends where they are not known, and free responses (k, f).

        rows   : (k, q)
        cutoff : [Hz], and ``step`` the time between samples [s]
        """
        from scipy.signal import butter, filtfilt, lfilter

        nothing = np.empty((len(rows), 0))
        if not self.order:
            count = self.samples(cutoff, step)
            sums = np.cumsum(np.vstack([np.zeros(rows.shape[1]), rows]), axis=0)
            found, first = np.full(rows.shape, np.nan), count // 2 if self.centred else count - 1
            means = (sums[count:] - sums[:-count]) / count
            found[first : first + len(means)] = means
            return found, nothing
        numbers = butter(self.order, cutoff, fs=1.0 / step)
        if self.centred:
            found = filtfilt(*numbers, rows, axis=0)
            ends = int(np.ceil(_ENDS / (cutoff * step)))
            found[:ends] = found[-ends:] = np.nan
            return found, nothing
        # The filter starts as if the first sample had lasted, or from any other state.
        found = rows[:1] + lfilter(*numbers, rows - rows[:1], axis=0)
        free = [lfilter(*numbers, np.zeros(len(rows)), zi=zi)[0] for zi in np.eye(self.order)]
        return found, np.column_stack(free)

    def words(self, cutoff: float, step: float) -> str:
        """The filter in words."""
        if not self.order:
            kind = "centred moving average" if self.centred else "moving average"
            count = self.samples(cutoff, step)
            about = _AVERAGE / (count * step)
            return f"a {kind} over {count} samples, a low-pass of about {_rounded(about)} Hz"
        order = {1: "first", 2: "second"}[self.order]
        kind = f"a low-pass of {order} order of about {_rounded(cutoff)} Hz"
        return f"{kind}, forwards and backwards (filtfilt)" if self.centred else kind


_FILTERS = (
    _Filter(1, False), _Filter(2, False), _Filter(2, True), _Filter(0, False), _Filter(0, True),
)  # fmt: skip


def explained(time: FloatArray, measured: FloatArray, near: list[ColumnNear]) -> Explanation | None:
    """The delay or low-pass filter of a column that explains its residuals; None if none does.

    To first order in the parameters, a filtered column is the filtered model plus the filtered
    derivatives times changes of the parameters. These products are subtracted by least squares.

    time     : (k,) [s]
    measured : (k,) in sigmas; nan: not measured
    near     : the column near the fitted values, and near other values, such as those at the start
               of the fit, from which the parameters may have moved to imitate a filter
    """
    for share in _SHARES:
        for one in near if share > _SHARES[-1] else near[:1]:
            count = int(share * min(time.size, _MOST_SAMPLES))
            fewest = max(2 * LAGS, _FEWEST * (one.changes.shape[1] + 2))
            if np.count_nonzero(np.isfinite(measured[:count])) < fewest:
                continue
            part = ColumnNear(one.model[:count], one.changes[:count])
            found = _explained(time[:count], measured[:count], part, whole=share == 1.0)
            if found is not None:
                return found
    return None


def _explained(
    time: FloatArray, measured: FloatArray, near: ColumnNear, *, whole: bool
) -> Explanation | None:
    known = np.flatnonzero(np.isfinite(measured))
    rate = np.gradient(near.model, time)
    rest = _rest(measured - near.model, near.changes, known)
    total = float(rest @ rest)
    moved = _rest(rate, near.changes, known)
    size = float(moved @ moved)
    if not total or not size:
        return None
    delay = -float(moved @ rest) / size
    delayed = float(moved @ rest) ** 2 / (size * total)
    spread = float(np.sum((measured[known] - measured[known].mean()) ** 2))
    best, words = delayed, ""
    left = rest + delay * moved
    for share, one, after in _filtered(time, measured, near):
        if share > best and 1.0 - share <= _BETTER * (1.0 - delayed):
            best, words, left = share, one, after
    small = bool(np.mean(left**2) <= _REST**2 * spread / known.size)
    accepted = (
        (best >= _MOST and small)
        or (best >= _EXPLAINED and whole and not words)
        or (best >= _EXPLAINED and independence_p(left) > SIGNIFICANCE)
    )
    return Explanation(words, delay, best, float(time[-1])) if accepted else None


def _filtered(
    time: FloatArray, measured: FloatArray, near: ColumnNear
) -> Iterator[tuple[float, str, FloatArray]]:
    """The best filter of each kind: the share that it explains, its words, and the rest."""
    from scipy.optimize import minimize_scalar

    steps = np.diff(time)
    step = float(np.median(steps))
    # Evenly spaced samples from the start on.
    count = int(np.argmin(np.append(np.abs(steps - step) < _EVEN * step, False))) + 1
    measured, rows = measured[:count], np.column_stack(near)[:count]
    low, high = _LOWEST / (count * step), _HIGHEST / step
    if not low < high or np.count_nonzero(np.isfinite(measured)) <= 2 * LAGS:
        return
    grid = np.linspace(np.log(low), np.log(high), _GRID)
    for kind in _FILTERS:

        def compared(at: float, kind: _Filter = kind) -> tuple[float, FloatArray]:
            filtered, free = kind.of(rows, float(np.exp(at)), step)
            known = np.flatnonzero(np.isfinite(measured) & np.isfinite(filtered[:, 0]))
            if known.size <= 2 * LAGS:
                return 1.0, np.zeros(0)
            before = _rest(measured - rows[:, 0], rows[:, 1:], known)
            changes = np.column_stack([filtered[:, 1:], free])
            after = _rest(measured - filtered[:, 0], changes, known)
            return float(after @ after) / (float(before @ before) or 1.0), after

        lefts = [compared(at)[0] for at in grid]
        at = int(np.argmin(lefts))
        found = minimize_scalar(
            lambda at: compared(at)[0], method="bounded", options={"xatol": _ACCURACY},
            bounds=(grid[max(at - 1, 0)], grid[min(at + 1, _GRID - 1)]),
        )  # fmt: skip
        best = float(found.x) if found.fun < lefts[at] else float(grid[at])
        left, after = compared(best)
        yield 1.0 - left, kind.words(float(np.exp(best)), step), after


def _rest(values: FloatArray, changes: FloatArray, known: NDArray[np.intp]) -> FloatArray:
    """Values at the known samples, without what changes of the parameters can explain."""
    values, changes = values[known], changes[known]
    sizes = np.linalg.norm(changes, axis=0)
    basis = np.linalg.qr(changes[:, sizes > 0.0] / sizes[sizes > 0.0])[0]
    return np.asarray(values - basis @ (basis.T @ values))


def _rounded(frequency: float) -> str:
    """Two digits, without an exponent."""
    return f"{float(f'{frequency:.2g}'):g}"


def independence_p(residual: FloatArray) -> float:
    """The p-value of the Ljung-Box test with ``LAGS`` lags; small if residuals are correlated."""
    from scipy import stats

    n, centred = residual.size, residual - residual.mean()
    power = float(np.einsum("i,i", centred, centred))
    lags = [float(np.einsum("i,i", centred[k:], centred[:-k])) / power for k in range(1, LAGS + 1)]
    statistic = n * (n + 2.0) * sum(one**2 / (n - k) for k, one in enumerate(lags, 1))
    return float(stats.chi2.sf(statistic, LAGS))
