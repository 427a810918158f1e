"""Detection of tori of two or more dimensions by averages over their returns.

The returns of a machine with several self-excited vibrations may fill such a torus. Its first
exponents all vanish, so that areas do not shrink, and it has no single rotation number.
"""

from __future__ import annotations

import math

import numpy as np

from wedgebrake.analysis.invariant_curve import average
from wedgebrake.arrays import FloatArray

# Fewest returns.
_FEWEST = 1000
# Largest difference of the averages over both halves, as a share of the range of the returns or of
# its square. A focus that settles so slowly would need a thousand times the longest run; averages
# of chaos converge only with the square root of the number of returns. The size of the whole motion
# is no measure: the returns of a driven motion may lie in a small part of it.
_APART = 1e-4
# Growth (logarithm) of a volume below which it counts as attracted.
_ATTRACTED = -8.0


def covers_torus(points: FloatArray, growth: FloatArray) -> bool:
    """Return True if returns fill an attracting torus of two or more dimensions.

    points : (m + 1, p) in scaled coordinates
    growth : (m, p) logarithmic growth of orthogonal deviations between returns
    """
    count, p = growth.shape
    totals = np.sort(growth.sum(axis=0))[::-1]
    still = 3.0 + math.log(max(count, 1))  # largest total growth that counts as none
    dimension = int((np.abs(totals) <= still).sum())
    if count < _FEWEST or not 2 <= dimension < p or totals[0] > still:
        return False
    if totals[: dimension + 1].sum() > _ATTRACTED:
        return False
    centred = (points - points.mean(axis=0)) / (np.ptp(points, axis=0).max() or 1.0)
    observed = np.hstack([centred, centred**2])
    half = count // 2
    apart = (
        average(np.ascontiguousarray(values[half : 2 * half]))
        - average(np.ascontiguousarray(values[:half]))
        for values in observed.T
    )
    return all(abs(one) <= _APART for one in apart)
