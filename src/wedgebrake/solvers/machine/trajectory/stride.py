"""Cells of equal length without events, each advanced by one matrix product.

In a mode x' = A x + B u + b, so that over a cell of length h

    x(h) - x(0) = h phi(h A) x'(0) + sum_k Psi_k u_k,   phi(s) = (e^s - 1)/s,

with the Taylor coefficients u_k of the inputs, k >= 1. The change of a guard g is linear in the
same factors y = (x'(0), u_1, u_2, ...). These matrices are computed once for each mode and length,
from the Taylor series of each factor, whose remainder is rounding as in any other cell. (In x'(0)
the growing angles of a turning machine cancel.)

Sufficient condition for a guard without a zero: let p(t) = sum_{k <= d} g_k t^k. Its Bernstein
coefficients on the cell, b_i = sum_{k <= i} C(i, k)/C(d, k) g_k h^k, bound it from below:
p >= min b_i. The remainder is at most sum_{k > d} |g_k| h^k <= r |y|, where r contains the same
sums for the factors. Hence g > 0 on the cell if b_i > r |y| for all i. Otherwise, and where modes
or knots are not regular, the cell is left to the search for events: this module neither locates nor
passes an event.
"""

import math
from typing import NamedTuple

import numpy as np

from wedgebrake.dynamics.jit import borrowing, chosen_by_class, embedded, inlined
from wedgebrake.dynamics.signals import advance, next_knot, pass_knots
from wedgebrake.solvers.machine.events.cells import (
    expand_states,
    value,
)
from wedgebrake.solvers.machine.events.clock import Clock, expand_inputs, later
from wedgebrake.solvers.machine.events.events import next_sampling, take_samples
from wedgebrake.solvers.machine.events.modes import GuardKind, share_speeds
from wedgebrake.solvers.machine.trajectory.observers import observe
from wedgebrake.solvers.machine.trajectory.stride_matrices import MARGIN, cell_terms, find, propose
from wedgebrake.solvers.machine.trajectory.watch import NoWatch, Watch

# Largest number of cells of equal length up to a time at which a cell has to end.
_PIECES = 64
# Relative sizes of differences of times, and of lengths of cells, that are rounding.
_TOGETHER, _EQUAL = 4.0 * np.finfo(float).eps, 1e-14
# Magnitude of a state above which the run is left to the test for divergence.
_LARGEST = 1e17


class Ends(NamedTuple):
    """Times at which cells have to end: the next knot, and the end of the run [s]."""

    knot: float
    run: float


class Strode(NamedTuple):
    """State after the cells: time, next knot [s], number of cells."""

    clock: Clock
    knot: float
    cells: int


@inlined
def _no_strides(watch, problem, run, slot, ends, most, observer, clock):  # noqa: ARG001 - as ``_stride``
    """Replace ``_stride`` in runs that record each cell: take no cells."""
    return Strode(clock, ends.knot, np.int64(0))


@borrowing
def _stride(watch, problem, run, slot, ends, most, observer, clock):  # noqa: ARG001
    """Take cells in a mode as long as they are proved to have no events; returns ``Strode``.

    The inputs are expanded before the first cell and after the last one.

    ends : ``Ends`` of the cells
    most : upper limit of the number of cells, which is not reached
    """
    signals, longest = problem.signals, run.systems.longest[slot]
    cells, number = np.int64(0), np.int64(-1)
    sampled, jumps = problem.presence.samples, problem.presence.jumps
    knot, end, sample = ends.knot, ends.run, _next_sample(observer)
    stale, passed = False, False
    regular = _is_regular(problem, run, observer)
    while True:
        if stale:
            expand_inputs(problem, run, clock)
            share_speeds(problem, run, slot, True)
            if passed and sampled:
                take_samples(problem, run, clock.time)
            knot = next_knot(signals)
            if sampled:
                knot = min(knot, next_sampling(problem, run))
            stale = passed = False
        if not regular or cells + 1 >= most:
            break
        ahead = min(knot, end)
        remaining = (ahead - clock.time) - clock.remainder
        tolerance = _TOGETHER * abs(ahead)
        if remaining <= tolerance and ahead < end:  # reached up to rounding
            if jumps and _jumps(signals, knot):
                break
            _shift(problem, run, slot, remaining)
            clock, stale, passed = Clock(ahead, 0.0), True, True
            pass_knots(signals, knot)
            continue
        if number < 0 or abs(remaining - run.strides.kinds[number].length) > tolerance:
            h = _length(remaining, longest, ahead < end)
            tolerance += _EQUAL * h
            if number < 0 or abs(h - run.strides.kinds[number].length) > tolerance:
                number = find(run, slot, h, tolerance)
            if number < 0 and longest < remaining:
                number = find(run, slot, longest, tolerance)
            if number < 0 and (h == longest or clock.remainder == 0.0):
                number = propose(problem, run, slot, h, tolerance)
            if number < 0:
                break
        kind = run.strides.kinds[number]
        late = remaining - kind.length
        whole = abs(late) <= tolerance + _EQUAL * kind.length
        after = Clock(ahead, 0.0) if whole else later(clock, kind.length)
        if after.time >= end or after.time > ahead:
            break
        if whole and jumps and _jumps(signals, knot):
            break
        _change(problem, run, slot, number)
        if not _is_quiet(problem, run, slot, kind):
            break
        if sample < after.time:
            _record(problem, run, slot, kind, observer, clock)
            sample = _next_sample(observer)
        if signals.speeds.size > 0:
            advance(signals, run.z, problem.states, kind.terms, kind.length)
        regular = _move(problem, run, late if whole else 0.0)
        kind.uses += 1
        clock, cells, stale, passed = after, cells + 1, True, whole
        if whole:
            pass_knots(signals, clock.time)
    return Strode(clock, knot, cells)


# Runs that record each cell are compiled without strides.
stride = chosen_by_class({Watch: _no_strides, NoWatch: _stride})


@embedded
def _is_regular(problem, run, observer):
    """Return True if no guard has just been zero, no torque is a curve and cells are not recorded.

    Nor may an element have a factor that varies, or a sampled force be at its limit, which no guard
    watches.
    """
    recorded = observer.work.size > 0 or observer.peak.size > 0
    regular = run.strides.kinds.size > 0 and run.curves.size == 0 and not recorded
    regular = regular and run.products.size == 0
    for number in range(run.modes.size):
        contact, mode = problem.contacts[number], run.modes[number]
        limited = contact.sampled_input >= 0 and contact.lag == 0 and mode.force_limit != 0
        regular = regular and mode.fresh == 0 and not limited
    for place in run.places:
        regular = regular and place.fresh == 0
    return regular


@embedded
def _next_sample(observer):
    """Time of the next sample of the response [s]; inf: there is none."""
    return observer.times[observer.at[0]] if observer.at[0] < observer.times.size else math.inf


@borrowing
def _jumps(signals, knot):
    """Return True if a table jumps at a knot."""
    jumps = False
    for table in signals.tables:
        at = table.cursor + 1
        if at <= table.last and signals.times[at] + table.turns * table.period <= knot:
            if at < table.last:
                jumps = jumps or signals.times[at + 1] == signals.times[at]
            elif table.periodic:
                jumps = jumps or signals.values[table.first] != signals.values[at]
    return jumps


@embedded
def _length(remaining, longest, divided):
    """Length of the next cell, of those that lead to a given time.

    remaining : time left [s]
    longest   : largest length of a cell [s]
    divided   : whether the cells are of equal length; otherwise each has the largest length
    """
    if remaining <= longest:
        return remaining
    pieces = math.ceil(remaining / longest * (1.0 - _EQUAL))
    return remaining / pieces if divided and pieces <= _PIECES else longest


@embedded
def _change(problem, run, slot, number):
    """Set the factors of a cell, and their products with the matrix of its kind."""
    z, strides, rates, n = run.z, run.strides, run.systems.rates[slot], problem.inverse.size
    kind, matrix, states = strides.kinds[number], strides.matrices[number], problem.states
    factors, count = strides.factors, kind.results
    results, left_out = strides.results[:count], strides.left_out[: kind.guards]
    for i in range(n):
        factors[i] = z[n + i, 0]
    for i in range(n, states):
        factors[i] = value(rates[i], z)
    at = states
    for k in range(1, kind.terms):
        for j in range(states, z.shape[0] - 1):
            factors[at] = z[j, k]
            at += 1
    results[:] = 0.0
    left_out[:] = 0.0
    for j in range(at):
        factor = factors[j]
        if factor != 0.0:
            row = matrix[j, :count]
            for i in range(count):
                results[i] += factor * row[i]
            factor = abs(factor)
            row = matrix[j, count : count + kind.guards]
            for i in range(kind.guards):
                left_out[i] += factor * row[i]


@embedded
def _is_quiet(problem, run, slot, kind):
    """Return True if it is proved that no guard has a zero in a cell."""
    z, strides, quiet, at = run.z, run.strides, True, problem.states
    for number in range(kind.guards):
        row, start, scale = run.systems.guards[slot, number], 0.0, 0.0
        for j in range(row.size):
            part = row[j] * z[j, 0]
            start += part
            scale += abs(part)
        what = run.systems.what[slot, number]
        if what.kind == GuardKind.ZERO_SPEED:
            scale += problem.contacts[what.contact].base_bound
        least = 0.0
        for i in range(at, at + kind.degree):
            least = min(least, strides.results[i])
        at += kind.degree
        quiet = quiet and start + least > strides.left_out[number] + MARGIN * scale
    return quiet


@borrowing
def _record(problem, run, slot, kind, observer, clock):
    """Record the samples of the response in a cell, without effect on the motion."""
    terms = cell_terms(run, slot, kind.length)
    expand_inputs(problem, run, clock)
    expand_states(run.systems.rates[slot], run.systems.lead[slot], run.z, terms)
    observe(observer, problem, run, slot, terms, clock, kind.length, False)
    expand_inputs(problem, run, clock)


@borrowing
def _shift(problem, run, slot, late):
    """Advance the states by a time of the order of rounding [s]."""
    z, rates, n, factors = run.z, run.systems.rates[slot], problem.inverse.size, run.strides.factors
    for i in range(n, problem.states):
        factors[i] = value(rates[i], z)
    for i in range(n):
        z[i, 0] += late * z[n + i, 0]
    for i in range(n, problem.states):
        z[i, 0] += late * factors[i]


@embedded
def _move(problem, run, late):
    """Advance the states to the end of a cell; returns False if one exceeds the bound.

    late : excess of the cell over the common length, because times are rounded [s]
    """
    z, strides, bounded = run.z, run.strides, True
    for i in range(problem.states):
        z[i, 0] += strides.results[i] + late * strides.factors[i]
        bounded = bounded and abs(z[i, 0]) < _LARGEST
    return bounded
