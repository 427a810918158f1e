"""Errors of the times of a trace, found in the residuals: jumps after lost samples, and scales."""

from __future__ import annotations

import numpy as np

from wedgebrake.analysis.fitting.estimate import Estimate
from wedgebrake.arrays import FloatArray

# Least share of the sum of squares of the residuals that an error of the times explains. It must
# leave at most this share of what a delay of the whole trace leaves.
_EXPLAINED, _BETTER = 0.6, 0.5
# Least error of the times, in sampling intervals: smaller ones are rounding.
_SHORTEST = 1e-6
# Least share of the changes of the model due to an error of the times that the parameters cannot
# explain. A few samples at the end, or changes that the parameters explain, are then not taken for
# an error.
_LEAST = 0.05


def remarks_on_times(
    time: FloatArray, columns: list[tuple[FloatArray, FloatArray]], found: Estimate
) -> list[str]:
    """A remark if the residuals show that the times of the trace are wrong.

    To first order, a change of the times d(t) changes the model by d times its rate. Of this, what
    the free parameters can explain is subtracted.

    time    : (k,) of the trace [s]
    columns : for each column of the trace, the rate of the model (k,) in sigmas per second, and
              whether a sample is measured (k,)
    """
    rate, at = (
        np.concatenate(one)
        for one in zip(*((each[known], time[known]) for each, known in columns), strict=True)
    )
    order = np.argsort(at, kind="stable")
    rate, at = rate[order], at[order]
    basis = np.linalg.qr(found.jacobian[: order.size])[0][order]
    residual = found.residuals[: order.size][order]
    residual = residual - basis @ (basis.T @ residual)
    total = float(residual @ residual)
    if not total or not np.any(rate):
        return []

    def along(changes: FloatArray) -> tuple[float, float]:
        """Share of the sum of squares that such changes of the model explain, and their factor."""
        apart = changes - basis @ (basis.T @ changes)
        size, by = float(apart @ apart), float(apart @ residual)
        if size <= _LEAST * float(changes @ changes):
            return 0.0, 0.0
        return by**2 / (size * total), -by / size

    delay, _ = along(rate)
    scale, share = along(rate * (at - at[0]))
    # The same for jumps at each sample, by sums over all later samples.
    sums = np.column_stack([rate * residual, rate**2, rate[:, None] * basis])
    by, squares, *own = np.cumsum(sums[::-1], axis=0)[::-1].T
    apart = squares - np.sum(np.square(own), axis=0)
    allowed = apart > _LEAST * squares[0]
    shares = np.where(allowed, by**2 / np.where(allowed, apart, 1.0), 0.0) / total
    first = int(np.argmax(shares))
    jump, best = float(shares[first]), max(scale, float(shares[first]))
    if best < _EXPLAINED or 1.0 - best > _BETTER * (1.0 - delay):
        return []
    explains = f"would explain {100.0 * best:.0f} % of the sum of squares of the residuals"
    ahead, before = float(-by[first] / apart[first]), at[max(first - 1, 0)]
    step = float(np.median(np.diff(time)))
    error = share * (at[-1] - at[0]) if scale >= jump else ahead
    if abs(error) < _SHORTEST * step:
        return []
    if scale >= jump:
        told = (
            f"time: times longer by {100.0 * share:.2g} % {explains}. Check the sample rate, and"
            " the frequencies of the signals."
        )
        return [told]
    number = max(round(abs(ahead) / step), 1)
    what = "lost samples there" if ahead > 0.0 else "samples there that are recorded twice"
    told = (
        f"time: adding {ahead:.3g} s to the times after {before:.6g} s {explains}, as with {number}"
        f" {what}, after which the others were renumbered: correct the times from there on."
    )
    return [told]
