"""Growth of small deviations: exponents of a motion and multipliers of an orbit."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
# What is left of a deviation in a direction that a stick or a section removes.
_LOST = 1e-12
# Share of the largest multiplier below which another one is not resolved.
_RESOLVED = 1e-9


def growths(matrices: FloatArray) -> FloatArray:
    """Logarithmic growth of p orthogonal deviations from return to return, (k, p).

    -inf where a direction is lost.

    matrices : (k, p, p) derivatives of the return map, in scaled coordinates
    """
    count, p = matrices.shape[:2]
    # Any frame that no direction of the machine is likely to be orthogonal to.
    frame = np.linalg.qr(np.cos(np.arange(p * p).reshape(p, p)))[0]
    found = np.empty((count, p))
    for k, matrix in enumerate(matrices):
        frame, triangle = np.linalg.qr(matrix @ frame)
        sizes = np.abs(np.diag(triangle))
        lost = sizes <= _LOST * max(float(np.linalg.norm(matrix)), 1.0)
        found[k] = np.where(lost, -np.inf, np.log(np.maximum(sizes, 1e-300)))
    return found


def log_multipliers(matrices: FloatArray) -> FloatArray:
    """Logarithms of the moduli of the multipliers of an orbit, (p,), descending.

    -inf where a stick or the section removes a direction; nan where rounding hides the multiplier.
    """
    p = matrices.shape[-1]
    whole = np.eye(p)
    for matrix in matrices:
        whole = matrix @ whole
    lost = int(np.isneginf(growths(matrices)).any(axis=0).sum())
    sizes = np.sort(np.abs(np.linalg.eigvals(whole)))[::-1]
    known = sizes > _RESOLVED * max(float(np.linalg.norm(whole)), _LOST)
    found = np.where(known, np.log(np.maximum(sizes, 1e-300)), np.nan)
    if lost:
        found[p - lost :] = -np.inf
    return found


def mean_exponents(growth: FloatArray, duration: float) -> FloatArray:
    """Exponents [1/s] from the growths over a duration, (p,), descending."""
    if growth.size == 0 or duration <= 0.0:
        return np.full(growth.shape[1], math.nan)
    return np.sort(growth.sum(axis=0) / duration)[::-1]
