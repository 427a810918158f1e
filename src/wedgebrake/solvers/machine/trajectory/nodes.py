"""Values of a series at fixed nodes of a cell, for its integrals and a bound of its extremes.

Squares and products of two series are integrated to rounding by Gauss' rule: their terms fall as
4^k/k! on a cell. Between two nodes a series deviates from its linear interpolation by at most an
eighth of their squared distance times the largest second derivative.
"""

import numpy as np

from wedgebrake.dynamics.jit import embedded
from wedgebrake.dynamics.signals import TERMS

_INNER, WEIGHTS = (0.5 * numbers for numbers in np.polynomial.legendre.leggauss(14))
# Both ends of the cell, and between them Gauss' points, as shares of its length.
_NODES = np.concatenate([[0.0], _INNER + 0.5, [1.0]])
NODES = _NODES.size
_POWERS = _NODES ** np.arange(TERMS)[:, None]
_BETWEEN = 0.125 * float(np.diff(_NODES).max()) ** 2


@embedded
def values_at_nodes(g, terms, tau, values):
    """Store the values of a series at the nodes of a cell of length tau.

    values : (NODES,)

    Returns the largest deviation of the series from its linear interpolation between the nodes.
    """
    power, bend = 1.0, 0.0
    for i in range(NODES):
        values[i] = 0.0
    # Four terms for all nodes at once, which the compiler turns into vector instructions.
    for k in range(0, terms, 4):
        a, power = g[k] * power, power * tau
        b, power = g[k + 1] * power, power * tau
        c, power = g[k + 2] * power, power * tau
        d, power = g[k + 3] * power, power * tau
        bend += k * (k - 1.0) * abs(a) + (k + 1.0) * k * abs(b)
        bend += (k + 2.0) * (k + 1.0) * abs(c) + (k + 3.0) * (k + 2.0) * abs(d)
        for i in range(NODES):
            values[i] += a * _POWERS[k, i] + b * _POWERS[k + 1, i]
            values[i] += c * _POWERS[k + 2, i] + d * _POWERS[k + 3, i]
    return _BETWEEN * bend
