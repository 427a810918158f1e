"""The velocity inside a Runge-Kutta step, and its first crossing of a kink.

The continuous extension of the Dormand-Prince pair (degree 7) is written in the Bernstein
basis, where "no coefficient below the boundary" proves that the polynomial does not cross it,
and the convex hull gives a safe lower bound of its first root.
"""

import math

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import DOP853

from wedgebrake.dynamics.jit import compiled

STAGES = 12
ROWS = 16  # stages, the derivative at the end of the step, three more for the extension
DEGREE = 7

# A start on a kink is no crossing, nor is what happens within this share of a step: far less
# than the kink bends there, but more than rounding where the speed grows as time cubed.
_ON_KINK = 1e-4


def _bernstein_matrix() -> NDArray[np.float64]:
    """(8, 7) matrix from the extension's coefficients F to Bernstein coefficients.

    The extension is y0 + sum F_i x^a (1-x)^b with a = i//2 + 1, b = (i+1)//2, and
    x^a (1-x)^b has the Bernstein coefficients C(7-a-b, k-a)/C(7, k).
    """
    matrix = np.zeros((DEGREE + 1, DEGREE))
    for i in range(DEGREE):
        a, b = i // 2 + 1, (i + 1) // 2
        for k in range(a, DEGREE - b + 1):
            matrix[k, i] = math.comb(DEGREE - a - b, k - a) / math.comb(DEGREE, k)
    return matrix


def _weights() -> NDArray[np.float64]:
    """(8, 17) weights of the step's change and of the stages in the Bernstein coefficients."""
    terms = np.zeros((DEGREE, 1 + ROWS))
    terms[:3, 0] = 1.0, -1.0, 2.0
    terms[1, 1] = 1.0
    terms[2, [1, 1 + STAGES]] = -1.0
    terms[3:, 1:] = DOP853.D
    return np.ascontiguousarray(_bernstein_matrix() @ terms)


_WEIGHTS = _weights()


@compiled
def coefficients(y0, y1, h, stages, out):
    """Store the Bernstein coefficients (8,) of the extension of the velocity in ``out``."""
    for k in range(DEGREE):
        total = 0.0
        for j in range(ROWS):
            total += _WEIGHTS[k, 1 + j] * stages[j].acceleration
        out[k] = y0 + (y1 - y0) * _WEIGHTS[k, 0] + h * total
    out[DEGREE] = y1


@compiled
def _keep_from(b, cut):
    """Keep the Bernstein coefficients of the polynomial from ``cut`` on (de Casteljau)."""
    for r in range(DEGREE):
        for k in range(DEGREE - r):
            b[k] += cut * (b[k + 1] - b[k])


@compiled
def first_root(b, start):
    """First root in [start, 1] of a polynomial that is not negative before it.

    b : (8,) Bernstein coefficients, overwritten. 2: there is no root; ``start`` where the
    polynomial is negative there.
    """
    if start > 0.0:
        _keep_from(b, start)
        if b[0] == 0.0:
            return 2.0
    for _ in range(200):
        if b[0] <= 0.0:
            return start
        # The control polygon's convex hull: no root before its first crossing.
        cut = 2.0
        for k in range(1, DEGREE + 1):
            if b[k] < 0.0:
                cut = min(cut, k / DEGREE * b[0] / (b[0] - b[k]))
        if cut > 1.0:
            return 1.0 if b[DEGREE] == 0.0 else 2.0
        if cut * (1.0 - start) < 1e-15:
            return start
        _keep_from(b, cut)
        start += cut * (1.0 - start)
    return start


@compiled
def crossing_share(stages, w0, w1, h, edge, sign):
    """Share of a step from velocity w0 to w1 at which sign (velocity - edge) vanishes; 2: never.

    A state on a kink leaves it on either side: there the share is 0 where the step goes to
    the other side than the stretch, and later than ``_ON_KINK`` for a true crossing.
    """
    if math.isinf(edge):
        return 2.0
    polynomial = np.empty(DEGREE + 1)
    coefficients(w0, w1, h, stages, polynomial)
    for k in range(DEGREE + 1):
        polynomial[k] = sign * (polynomial[k] - edge)
    if w0 != edge:
        return first_root(polynomial, 0.0)
    found = first_root(polynomial, _ON_KINK)
    return 0.0 if found == _ON_KINK else found
