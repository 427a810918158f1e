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
from wedgebrake.solvers.machine.cells import (
    expand_states,
    value,
)
from wedgebrake.solvers.machine.clock import Clock, expand_inputs, later
from wedgebrake.solvers.machine.events import next_sampling, sample_controllers
from wedgebrake.solvers.machine.modes import GuardKind
from wedgebrake.solvers.machine.observers import observe
from wedgebrake.solvers.machine.stride_matrices import MARGIN, cell_terms, find, propose
from wedgebrake.solvers.machine.watch import NoWatch, Watch

# Largest number of cells of equal length up to a time at which a cell has to end.
_PIECES = 64
# Relative sizes of differences of times, and of lengths of cells, that are rounding.
_TOGETHER, _EQUAL = 4.0 * np.finfo(float).eps, 1e-14
# Magnitude of a state above which the run is left to the test for divergence.
_LARGEST = 1e17


class Strode(NamedTuple):
    """State after the cells: time, next knot [s], number of cells."""

    clock: Clock
    knot: float
    cells: int


@inlined
def _pass(watch, problem, run, slot, end, most, observer, clock):  # noqa: ARG001 - as ``_stride``
    """Replace ``_stride`` in runs that record each cell: take no cells."""
    knot = min(next_knot(problem.signals), next_sampling(problem, run.modes))
    return Strode(clock, knot, np.int64(0))


@borrowing
def _stride(watch, problem, run, slot, end, most, observer, clock):  # noqa: ARG001, C901
    """Take cells in a mode as long as they are proved to have no events; returns ``Strode``.

    end  : time at which the run ends [s]; the cells end before it
    most : upper limit of the number of cells, which is not reached
    """
    signals, longest = problem.signals, run.systems.longest[slot]
    cells, number = np.int64(0), np.int64(-1)
    sampled, based = _has_samples(problem), _has_bases(problem)
    knot, sample = math.inf, _next_sample(observer)
    stale, passed = True, False
    regular = _is_regular(run, observer)
    while True:
        if stale:
            expand_inputs(problem, run, clock)
            if passed and sampled:
                sample_controllers(problem, run, clock.time)
            knot = next_knot(signals)
            if sampled:
                knot = min(knot, next_sampling(problem, run.modes))
            stale = passed = False
        if not regular or cells + 1 >= most:
            break
        ahead = min(knot, end)
        rest = (ahead - clock.time) - clock.rest
        room = _TOGETHER * abs(ahead)
        if rest <= room and ahead < end:  # reached up to rounding
            if based and _jumps(signals, knot):
                break
            _shift(problem, run, slot, rest)
            clock, stale, passed = Clock(ahead, 0.0), True, True
            pass_knots(signals, knot)
            continue
        if number < 0 or abs(rest - run.strides[number].length) > room:
            h = _length(rest, longest, ahead < end)
            room += _EQUAL * h
            if number < 0 or abs(h - run.strides[number].length) > room:
                number = find(run, slot, h, room)
            if number < 0 and longest < rest:
                number = find(run, slot, longest, room)
            if number < 0 and (h == longest or clock.rest == 0.0):
                number = propose(problem, run, slot, h, room)
            if number < 0:
                break
        step = run.strides[number]
        late = rest - step.length
        whole = abs(late) <= room + _EQUAL * step.length
        after = Clock(ahead, 0.0) if whole else later(clock, step.length)
        if after.time >= end or after.time > ahead:
            break
        if whole and based and _jumps(signals, knot):
            break
        _change(problem, run, slot, step)
        if not _is_quiet(problem, run, slot, step):
            break
        if sample < after.time:
            _record(problem, run, slot, step, observer, clock)
            sample = _next_sample(observer)
        if signals.speeds.size > 0:
            advance(signals, run.z, problem.states, step.terms, step.length)
        regular = _move(problem, run, step, late if whole else 0.0)
        step.uses += 1
        clock, cells, stale, passed = after, cells + 1, True, whole
        if whole:
            pass_knots(signals, clock.time)
            for mode in run.modes:
                mode.limited = 0
    return Strode(clock, knot, cells)


# Runs that record each cell are compiled without strides.
stride = chosen_by_class({Watch: _pass, NoWatch: _stride})


@embedded
def _is_regular(run, observer):
    """Return True if no guard has just been zero, no torque is a curve and no work is recorded."""
    regular = run.strides.size > 0 and run.curves.size == 0 and observer.work.size == 0
    for mode in run.modes:
        regular = regular and mode.fresh == 0
    return regular


@embedded
def _has_samples(problem):
    """Return True if there is a digital controller."""
    found = False
    for contact in problem.contacts:
        found = found or contact.held >= 0
    return found


@embedded
def _has_bases(problem):
    """Return True if a base follows a signal."""
    found = False
    for contact in problem.contacts:
        found = found or contact.base_rate >= 0
    return found


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
def _length(rest, longest, divided):
    """Length of the cells up to a time.

    divided : whether the cells are equal; otherwise each has the largest length
    """
    if rest <= longest:
        return rest
    pieces = math.ceil(rest / longest * (1.0 - _EQUAL))
    return rest / pieces if divided and pieces <= _PIECES else longest


@embedded
def _change(problem, run, slot, step):
    """Set the factors of a cell, and their products with the matrices."""
    z, memory, rates, n = run.z, run.memory, run.systems.rates[slot], problem.inverse.size
    states, rows, guards = problem.states, step.rows, step.guards
    factors, change = memory[: step.change], memory[step.change : step.change + rows]
    doubt = memory[step.change + rows : step.change + rows + guards]
    for i in range(n):
        factors[i] = z[n + i, 0]
    for i in range(n, states):
        factors[i] = value(rates[i], z)
    at = states
    for k in range(1, step.terms):
        for j in range(states, z.shape[0] - 1):
            factors[at] = z[j, k]
            at += 1
    change[:] = 0.0
    doubt[:] = 0.0
    place = step.first
    for j in range(at):
        factor = factors[j]
        if factor != 0.0:
            row = memory[place : place + rows]
            for i in range(rows):
                change[i] += factor * row[i]
            factor = abs(factor)
            row = memory[place + rows : place + rows + guards]
            for i in range(guards):
                doubt[i] += factor * row[i]
        place += rows + guards


@embedded
def _is_quiet(problem, run, slot, step):
    """Return True if no guard has a zero in a cell."""
    z, at, end = run.z, step.change + problem.states, step.change + step.rows
    bounds, doubt, quiet = run.memory[at:end], run.memory[end : end + step.guards], True
    at, degree = 0, step.degree
    for number in range(step.guards):
        row, start, scale = run.systems.guards[slot, number], 0.0, 0.0
        for j in range(row.size):
            part = row[j] * z[j, 0]
            start += part
            scale += abs(part)
        what = run.systems.what[slot, number]
        if what.kind == GuardKind.ZERO_SPEED:
            scale += problem.contacts[what.contact].base_bound
        least = 0.0
        for i in range(at, at + degree):
            least = min(least, bounds[i])
        at += degree
        quiet = quiet and start + least > doubt[number] + MARGIN * scale
    return quiet


@borrowing
def _record(problem, run, slot, step, observer, clock):
    """Record the samples of the response in a cell, without effect on the motion."""
    terms = cell_terms(run, slot, step.length)
    expand_inputs(problem, run, clock)
    expand_states(run.systems.rates[slot], problem.inverse.size, run.z, terms)
    observe(observer, problem, run, slot, terms, clock, step.length, False)
    expand_inputs(problem, run, clock)


@borrowing
def _shift(problem, run, slot, late):
    """Advance the states by a time of the order of rounding [s]."""
    z, rates, n = run.z, run.systems.rates[slot], problem.inverse.size
    for i in range(n, problem.states):
        run.memory[i] = value(rates[i], z)
    for i in range(n):
        z[i, 0] += late * z[n + i, 0]
    for i in range(n, problem.states):
        z[i, 0] += late * run.memory[i]


@embedded
def _move(problem, run, step, late):
    """Advance the states to the end of a cell; returns False if one exceeds the bound.

    late : excess of the cell over the common length, because times are rounded [s]
    """
    z, bounded = run.z, True
    factors, change = run.memory, run.memory[step.change : step.change + problem.states]
    for i in range(problem.states):
        z[i, 0] += change[i] + late * factors[i]
        bounded = bounded and abs(z[i, 0]) < _LARGEST
    return bounded
