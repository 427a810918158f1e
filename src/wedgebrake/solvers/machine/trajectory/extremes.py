"""Extremes of a series on a cell."""

from wedgebrake.dynamics.jit import borrowing, embedded
from wedgebrake.solvers.machine.events.cells import largest_change, polynomial
from wedgebrake.solvers.machine.trajectory.nodes import NODES, values_at_nodes
from wedgebrake.solvers.machine.trajectory.section import next_turn

# Most extremes of a quantity in a cell.
_TURNS = 8


@embedded
def differentiate(g, rate, terms):
    """Store the rate of a series."""
    for k in range(terms - 1):
        rate[k] = (k + 1.0) * g[k + 1]
    rate[terms - 1] = 0.0


@embedded
def is_within(values, between, low, high):
    """Return True if a series is within a range, from its values at the nodes."""
    least = most = values[0]
    for i in range(1, NODES):
        least, most = min(least, values[i]), max(most, values[i])
    return low <= least - between and most + between <= high


@borrowing
def widened(work, g, terms, tau, low, high):
    """Extend a range such that it contains the values of a series on [0, tau].

    work : (2, TERMS) or larger, workspace
    """
    reach = largest_change(g, terms, tau)
    if low <= g[0] - reach and g[0] + reach <= high:
        return low, high
    if is_within(work[1], values_at_nodes(g, terms, tau, work[1]), low, high):
        return low, high
    return extremes(work[0], g, terms, tau, low, high)


@borrowing
def extremes(rate, g, terms, tau, low, high):
    """``widened`` by the zeros of the rate of the series.

    rate : workspace for it
    """
    end = polynomial(g, terms, tau)
    low, high = min(low, g[0], end), max(high, g[0], end)
    differentiate(g, rate, terms)
    at = 0.0
    for _ in range(_TURNS):
        step = next_turn(rate, terms, tau - at)
        at += step
        if at >= tau:
            break
        value = polynomial(g, terms, at)
        low, high = min(low, value), max(high, value)
    return low, high
