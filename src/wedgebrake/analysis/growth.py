"""Growth of small deviations: exponents of a motion and multipliers of an orbit."""

from __future__ import annotations

import math

import numpy as np

from wedgebrake.arrays import FloatArray
from wedgebrake.dynamics.jit import compiled, inlined

# What is left of a deviation in a direction that a stick or a section removes.
_LOST = 1e-12
# Share of the largest multiplier below which another one is not resolved.
_RESOLVED = 1e-9


def growths(matrices: FloatArray) -> FloatArray:
    """Logarithmic growth of p orthogonal deviations from return to return, (k, p).

    -inf where a direction is lost.

    matrices : (k, p, p) derivatives of the return map, in scaled coordinates
    """
    found = np.empty(matrices.shape[:2])
    _grow(np.ascontiguousarray(matrices), found)
    return found


@compiled
def _grow(matrices, found):
    """Set the growths of ``growths``, (k, p), by QR decompositions."""
    count, p = found.shape
    frame, moved, factors = np.empty((p, p)), np.empty((p, p)), np.empty(p)
    # Any frame that no direction of the machine is likely to be orthogonal to.
    for i in range(p):
        for j in range(p):
            moved[i, j] = math.cos((i * p + j) ** 2)
    for k in range(-1, count):
        size = 0.0
        if k >= 0:
            for i in range(p):
                for j in range(p):
                    total = 0.0
                    for m in range(p):
                        total += matrices[k, i, m] * frame[m, j]
                    moved[i, j] = total
                    size += matrices[k, i, j] ** 2
        _decompose(moved, factors, frame)
        if k >= 0:
            lost = _LOST * max(math.sqrt(size), 1.0)
            for j in range(p):
                grown = abs(moved[j, j])
                found[k, j] = -math.inf if grown <= lost else math.log(max(grown, 1e-300))


@inlined
def _decompose(a, factors, q):
    """QR decomposition by Householder reflections: ``a`` becomes R, with their vectors below.

    LAPACK takes longer to call than to decompose matrices of this size.
    """
    p = factors.size
    for j in range(p):
        below = 0.0
        for i in range(j + 1, p):
            below += a[i, j] ** 2
        factors[j] = 0.0
        if below > 0.0:
            diagonal = -math.copysign(math.sqrt(a[j, j] ** 2 + below), a[j, j])
            factors[j] = 1.0 - a[j, j] / diagonal
            for i in range(j + 1, p):
                a[i, j] /= a[j, j] - diagonal
            a[j, j] = diagonal
            for c in range(j + 1, p):
                _reflect(a, j, factors[j], a, c)
    for j in range(p - 1, -1, -1):
        for i in range(p):
            q[i, j] = 1.0 if i == j else 0.0
        for c in range(j, p):
            _reflect(a, j, factors[j], q, c)


@inlined
def _reflect(a, j, factor, target, c):
    """Reflect column ``c`` of ``target`` at the vector in column ``j`` of ``a`` below row j."""
    total = target[j, c]
    for i in range(j + 1, a.shape[0]):
        total += a[i, j] * target[i, c]
    total *= factor
    target[j, c] -= total
    for i in range(j + 1, a.shape[0]):
        target[i, c] -= total * a[i, j]


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


def distance_to_orbit(matrices: FloatArray, change: FloatArray) -> float:
    """Distance of a point to the orbit that it approaches, by a step of Newton's method.

    matrices : (n, p, p) derivatives from return to return along the orbit
    change   : (p,) of the point over the last orbit
    """
    whole = np.eye(change.size)
    for matrix in matrices[:, : change.size, : change.size]:
        whole = matrix @ whole
    try:
        return float(np.linalg.norm(np.linalg.solve(np.eye(change.size) - whole, change)))
    except np.linalg.LinAlgError:
        return math.inf


def mean_exponents(growth: FloatArray, duration: float) -> FloatArray:
    """Exponents [1/s] from the growths over a duration, (p,), descending."""
    if growth.size == 0 or duration <= 0.0:
        return np.full(growth.shape[1], math.nan)
    return np.sort(growth.sum(axis=0) / duration)[::-1]
