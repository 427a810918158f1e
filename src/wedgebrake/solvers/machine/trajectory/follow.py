"""Recording of a cell of a passage: first return, derivative of the flow, extremes and sums."""

from wedgebrake.dynamics.jit import borrowing, chosen_by_class, embedded
from wedgebrake.solvers.machine.events.cells import combine, polynomial
from wedgebrake.solvers.machine.trajectory.extremes import (
    differentiate,
    extremes,
    is_within,
    widened,
)
from wedgebrake.solvers.machine.trajectory.nodes import WEIGHTS, values_at_nodes
from wedgebrake.solvers.machine.trajectory.section import next_return
from wedgebrake.solvers.machine.trajectory.variation import (
    begin,
    store_matrix,
    vary,
    vary_event,
    vary_samples,
)
from wedgebrake.solvers.machine.trajectory.watch import Anew, NoWatch, SectionKind, Watch


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
    if watch.derivative:
        vary(watch, problem, run, slot, terms, clock, tau)
        if first >= 0:
            vary_event(watch, problem, run, slot, terms, clock, tau, first, jumped)
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
        begin(watch, problem, run, slot)
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
        watch.low[i], watch.high[i] = widened(
            watch.work, g, terms, tau, watch.low[i], watch.high[i]
        )
    for number in range(watch.peak.size):
        side = run.modes[number].side
        if side == 0:
            watch.time_at_rest[number] += tau
            if watch.sides[number] != 0:
                watch.entered[number, 0 if watch.sides[number] > 0 else 1] += 1
        watch.sides[number] = side
        combine(run.systems.contact[slot, number], run.z, g)
        peak = watch.peak[number]
        low, high = widened(watch.work, g, terms, tau, -peak, peak)
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
        differentiate(g, g, terms)
    values = watch.work[1]
    between = values_at_nodes(g, terms, tau, values)
    total, square = 0.0, 0.0
    for point in range(WEIGHTS.size):
        here = values[point + 1]
        total += WEIGHTS[point] * here
        square += WEIGHTS[point] * here * here
    found.sums[i, 0] += total * tau
    found.sums[i, 1] += square * tau
    if found.order[i] > 0 and not is_within(values, between, found.low[i], found.high[i]):
        found.low[i], found.high[i] = extremes(
            watch.work[0], g, terms, tau, found.low[i], found.high[i]
        )


@borrowing
def _follow_samples(watch, problem, run, slot):
    """Record what actuations and controllers have just sampled.

    slot : of the system of the last cell
    """
    if watch.derivative:
        vary_samples(watch, problem, run, slot)


@embedded
def _no_record(watch, problem, run, slot, terms, clock, tau, event):  # noqa: ARG001 - as ``_follow``
    """``_follow`` where nothing is recorded."""
    return tau, event[0], False


@embedded
def _no_record_of_samples(watch, problem, run, slot):
    """``_follow_samples`` where nothing is recorded."""


# Runs of which nothing is recorded are compiled without what records.
follow = chosen_by_class({Watch: _follow, NoWatch: _no_record})
follow_samples = chosen_by_class({Watch: _follow_samples, NoWatch: _no_record_of_samples})
