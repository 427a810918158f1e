"""Matrices for cells of equal length in a mode, used by ``stride``: computation and reuse."""

import math

import numpy as np

from wedgebrake.dynamics.jit import borrowing, compiled, embedded
from wedgebrake.dynamics.signals import TERMS, Operation
from wedgebrake.solvers.machine.events.cells import (
    add_inputs,
    combine,
    next_coefficient,
    polynomial,
    terms_for,
)
from wedgebrake.solvers.machine.problem import MOST_BOUNDS

# Share of the magnitude of a guard that may be rounding, or that is treated as zero elsewhere.
MARGIN = 1e-12
# Relative size of the first term of a guard that the Bernstein coefficients omit.
_LEFT_OUT = 1e-5
# Number of equal cells after which their matrices are computed.
_WORTH = 16
# Logarithm of the relative size of omitted Taylor terms.
_NEGLIGIBLE = math.log(1e-18)


@borrowing
def find(run, slot, h, tolerance):
    """Return the number of the matrix for a mode and a length; -1 if there is none."""
    found = -1
    for number in range(1, run.strides.kinds.size):
        one = run.strides.kinds[number]
        if one.slot == slot and one.uses > 0 and abs(one.length - h) <= tolerance:
            found = number
    return found


@borrowing
def propose(problem, run, slot, h, tolerance):
    """Count the equal cells of a mode, and compute their matrix after a number of cells.

    Returns the number of the new matrix, which replaces the least used one; -1 if there is none.
    """
    kinds = run.strides.kinds
    candidate = kinds[0]
    if candidate.slot != slot or abs(candidate.length - h) > tolerance:
        candidate.slot, candidate.length, candidate.uses = slot, h, 0
    candidate.uses += 1
    if candidate.uses < _WORTH:
        return -1
    candidate.uses, least = 0, np.int64(1)
    for number in range(2, kinds.size):
        if kinds[number].uses < kinds[least].uses:
            least = number
    _compute(problem, run, slot, least, h)
    return least


@compiled
def _compute(problem, run, slot, number, h):
    """Compute the matrix of a mode for cells of a length.

    The row of a factor contains the changes of the states, the Bernstein coefficients of the guards
    without their initial values, and the bounds of the omitted terms.
    """
    kind, matrix = run.strides.kinds[number], run.strides.matrices[number]
    longest, states, width = run.systems.longest[slot], problem.states, run.z.shape[0]
    product = 0.0 if math.isinf(longest) else 2.0 * h / longest
    terms = cell_terms(run, slot, h)
    kind.slot, kind.length, kind.uses = slot, h, 1
    kind.terms = _signal_terms(problem, h, terms)
    kind.degree = min(_terms_of(product, math.log(_LEFT_OUT)) - 1, MOST_BOUNDS)
    kind.guards = run.systems.counts[slot]
    kind.results = states + kind.guards * kind.degree
    series, g = np.zeros((width, TERMS)), np.zeros(TERMS)
    for i in range(states):
        _row(problem, run, kind, terms, np.int64(1), i, series, g, matrix[i])
    factor = states
    for k in range(1, kind.terms):
        for j in range(states, width - 1):
            _row(problem, run, kind, terms, k, j, series, g, matrix[factor])
            factor += 1


@embedded
def cell_terms(run, slot, h):
    """Number of terms of the series in a cell."""
    longest = run.systems.longest[slot]
    return TERMS if math.isinf(longest) else terms_for(2.0 * h / longest)


@embedded
def _terms_of(product, least):
    """Number of terms product^k/k! until the logarithm of one is below ``least``."""
    k, size = 1, 0.0
    while k < TERMS and product > 0.0:
        size += math.log(product / k)
        if size < least:
            break
        k += 1
    return k


@compiled
def _signal_terms(problem, h, terms):
    """Number of terms of the signals in a cell; one more for each rate of a signal."""
    count = np.int64(2)
    if problem.frequency > 0.0:
        count = max(_terms_of(problem.frequency * h, _NEGLIGIBLE), count)
    for one in problem.signals.operations:
        if one.kind == Operation.MULTIPLY:
            count += 1
    for contact in problem.contacts:
        if contact.base_rate >= 0:
            count += 1
    for one in problem.driven:
        if one.rate >= 0:
            count += 1
    for loop in problem.controllers.records:
        if loop.rate >= 0:
            count += 1
    return min(count, terms)


@compiled
def _row(problem, run, kind, terms, order, column, series, g, results):
    """Compute the row of a factor: coefficient ``order`` of a state or an input.

    series, g : workspace
    """
    series[:] = 0.0
    series[column, order] = 1.0
    slot, h, degree = kind.slot, kind.length, kind.degree
    rates, half, states = run.systems.rates[slot], problem.inverse.size, problem.states
    add_inputs(rates, half, series)
    if column < states:
        series[column, 1] = 1.0
    for k in range(1, terms - 1):
        next_coefficient(rates, run.systems.lead[slot], series, k)
    for i in range(states):
        results[i] = polynomial(series[i], terms, h)
    place = states
    for number in range(kind.guards):
        row, left_out = run.systems.guards[slot, number], 0.0
        combine(row, series, g)
        power = 1.0
        for k in range(terms):
            g[k] *= power
            if k > degree:
                left_out += abs(g[k])
            for j in range(row.size):
                left_out += MARGIN * power * abs(row[j] * series[j, k])
            power *= h
        for i in range(1, degree + 1):
            total, share = 0.0, 1.0  # C(i, k)/C(d, k)
            for k in range(1, i + 1):
                share *= (i - k + 1.0) / (degree - k + 1.0)
                total += share * g[k]
            results[place] = total
            place += 1
        results[kind.results + number] = left_out
