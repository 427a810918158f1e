"""Recording of a cell of a passage: first return, derivative of the flow, extremes and sums."""

import numpy as np

from wedgebrake.dynamics.jit import borrowing, chosen_by_class, embedded
from wedgebrake.solvers.machine.events.cells import combine, largest_change, polynomial
from wedgebrake.solvers.machine.trajectory.section import next_return, next_turn
from wedgebrake.solvers.machine.trajectory.variation import (
    begin,
    store_matrix,
    vary,
    vary_event,
    vary_samples,
)
from wedgebrake.solvers.machine.trajectory.watch import Anew, NoWatch, SectionKind, Watch

# Most extremes of a quantity in a cell.
_TURNS = 8
# Squares of series are integrated to rounding by Gauss quadrature, like the powers in
# ``observers``; those of derivatives have slightly fewer terms.
_POINTS, _WEIGHTS = (0.5 * numbers for numbers in np.polynomial.legendre.leggauss(14))
_POINTS = _POINTS + 0.5


@borrowing
def _follow(watch, problem, run, slot, terms, clock, tau, event):
    """Record a cell that ends at tau, where an event may occur, or at a return before it.

    event : (number of the guard, -1 if none; whether it has jumped beyond zero)

    Returns (time until the end of the cell, number of the guard, whether all requested returns
    have been recorded).
    """
    state = watch.state[0]
    first, jumped = event
    returned = False
    if watch.kind != SectionKind.NONE:
        at = next_return(watch, run, terms, clock, tau, first >= 0)
        if at <= tau:
            # An event at this instant belongs to the next cell.
            tau, first, returned = at, -1, True
    _add(watch, run, slot, terms, tau)
    for mode in run.modes:
        if mode.side != 0:
            state.last_slip = clock.time + tau
    if watch.derivative:
        vary(watch, problem, run, slot, terms, tau)
        if first >= 0:
            vary_event(watch, problem, run, slot, terms, tau, first, jumped)
    if not returned:
        return tau, first, False
    _store(watch, problem, run, terms, clock, tau)
    if watch.derivative:
        store_matrix(watch, problem, run, terms, tau)
        state.anew = Anew.YES
    state.count += 1
    state.next += 1
    enough = state.count >= watch.times.size
    if watch.derivative and not enough:
        begin(watch, problem, run)
    return tau, first, enough


@borrowing
def _store(watch, problem, run, terms, clock, tau):
    """Store the time and the state of a return."""
    state = watch.state[0]
    watch.times[state.count] = clock.time + (tau + clock.remainder)
    if watch.kind == SectionKind.EVERY:
        watch.times[state.count] = watch.origin + state.next * watch.period
    for i in range(problem.states):
        watch.states[state.count, i] = polynomial(run.z[i], terms, tau)


@borrowing
def _add(watch, run, slot, terms, tau):
    """Add a cell to the extremes and to the sums."""
    g = run.guard
    for i in range(watch.low.size):
        combine(watch.rows[i], run.z, g)
        watch.low[i], watch.high[i] = _widened(
            watch.work[0], g, terms, tau, watch.low[i], watch.high[i]
        )
    for number in range(run.modes.size):
        side = run.modes[number].side
        if side == 0:
            watch.time_at_rest[number] += tau
            if watch.sides[number] != 0:
                watch.entered[number, 0 if watch.sides[number] > 0 else 1] += 1
        watch.sides[number] = side
        combine(run.systems.contact[slot, number], run.z, g)
        peak = watch.peak[number]
        low, high = _widened(watch.work[0], g, terms, tau, -peak, peak)
        watch.peak[number] = max(-low, high)
    for i in range(watch.quantities.order.size):
        _add_quantity(watch, run, slot, terms, tau, i)


@borrowing
def _add_quantity(watch, run, slot, terms, tau, i):
    """Add a cell to the integrals and extremes of a quantity."""
    g, found, contact = run.guard, watch.quantities, watch.quantities.contact[i]
    if contact < 0:
        combine(found.rows[i], run.z, g)
    else:
        combine(run.systems.contact[slot, contact], run.z, g)
    g[0] -= found.level[i]
    for _ in range(found.order[i]):
        for k in range(terms - 1):
            g[k] = (k + 1.0) * g[k + 1]
        g[terms - 1] = 0.0
    total, square = 0.0, 0.0
    for point in range(_POINTS.size):
        here = polynomial(g, terms, _POINTS[point] * tau)
        total += _WEIGHTS[point] * here
        square += _WEIGHTS[point] * here * here
    found.sums[i, 0] += total * tau
    found.sums[i, 1] += square * tau
    found.low[i], found.high[i] = _widened(
        watch.work[0], g, terms, tau, found.low[i], found.high[i]
    )


@borrowing
def _widened(work, g, terms, tau, low, high):
    """Extend a range such that it contains the values of a series on [0, tau].

    work : workspace for the derivative of the series
    """
    reach = largest_change(g, terms, tau)
    if low <= g[0] - reach and g[0] + reach <= high:
        return low, high
    end = polynomial(g, terms, tau)
    low, high = min(low, g[0], end), max(high, g[0], end)
    for k in range(terms - 1):
        work[k] = (k + 1.0) * g[k + 1]
    work[terms - 1] = 0.0
    at = 0.0
    for _ in range(_TURNS):
        step = next_turn(work, terms, tau - at)
        at += step
        if at >= tau:
            break
        value = polynomial(g, terms, at)
        low, high = min(low, value), max(high, value)
    return low, high


@borrowing
def _follow_samples(watch, problem, run):
    """Record the forces that controllers have just sampled."""
    if watch.derivative:
        vary_samples(watch, problem, run)


@embedded
def _no_record(watch, problem, run, slot, terms, clock, tau, event):  # noqa: ARG001 - as ``_follow``
    """``_follow`` where nothing is recorded."""
    return tau, event[0], False


@embedded
def _no_record_of_samples(watch, problem, run):
    """``_follow_samples`` where nothing is recorded."""


# Runs of which nothing is recorded are compiled without what records.
follow = chosen_by_class({Watch: _follow, NoWatch: _no_record})
follow_samples = chosen_by_class({Watch: _follow_samples, NoWatch: _no_record_of_samples})
