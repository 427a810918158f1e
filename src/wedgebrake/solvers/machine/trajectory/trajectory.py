"""The run of a machine: cells of Taylor series, the first zero of every guard, and events."""

import math
from typing import Any, NamedTuple

import numpy as np

from wedgebrake.dynamics.enums import EventKind, Outcome
from wedgebrake.dynamics.jit import borrowing, embedded
from wedgebrake.dynamics.references import by_reference
from wedgebrake.dynamics.signals import TERMS, advance, next_knot, pass_knots, start_tables
from wedgebrake.solvers.machine.events.arrivals import Cell, find_arrived
from wedgebrake.solvers.machine.events.cells import (
    advance_states,
    combine,
    expand_states,
    first_zero,
    largest_change,
    size,
    terms_for,
    value,
    zero_before,
)
from wedgebrake.solvers.machine.events.clock import Clock, expand_inputs, later
from wedgebrake.solvers.machine.events.controllers import (
    is_fresh_limit,
    place_controls,
    touches_limit,
)
from wedgebrake.solvers.machine.events.curves import CURVE_TERMS, expand_curves, slides_on_curve
from wedgebrake.solvers.machine.events.events import (
    apply_event,
    check_lines,
    classify,
    find_resting,
    flatness,
    follow_bases,
    follow_forces,
    joins_bases,
    kind_of,
    next_sampling,
    set_sides,
    settle,
    take_samples,
)
from wedgebrake.solvers.machine.events.modes import (
    GuardKind,
    bit,
    present_system,
    share_speeds,
)
from wedgebrake.solvers.machine.events.pieces import (
    check_pieces,
    forget_passed,
    is_fresh,
    is_undecided,
    place_pieces,
)
from wedgebrake.solvers.machine.events.products import multiply
from wedgebrake.solvers.machine.trajectory.follow import follow, follow_samples
from wedgebrake.solvers.machine.trajectory.observers import observe
from wedgebrake.solvers.machine.trajectory.resolution import resolves
from wedgebrake.solvers.machine.trajectory.stride import Ends, stride
from wedgebrake.solvers.machine.trajectory.variation import lacks_tangents

# Relative size of a guard that is rounding.
_ROUNDING = 1e-13
# The least torque beyond its limit at which a contact slips, relative to its change in a cell.
_LEAST_SLACK = 1e-15
_SMALLEST = np.finfo(float).tiny
# Relative size of a guard below zero from which a jump, and not rounding, is the cause.
_BEYOND = 1e-9
# Relative size of a difference of two times that is rounding.
_TOGETHER = 4e-15
# Size of a state that counts as divergence.
_LARGEST = 1e18
# Share of the longest cell up to which a cell counts as an instant: rounding then determines the
# sign of a guard that has just been zero.
_INSTANT = 1e-11
# Number of modes at one instant, per contact or element, after which the run ends.
_CASCADE = 12


class Span(NamedTuple):
    """Limits of a run.

    end    : time [s]
    events : largest number of events
    cells  : largest number of cells
    pause  : whether to end where all contacts have come to rest
    begins : whether it is the beginning of a run, whose state is no event
    restarts : whether the modes, held forces and queues there are those of an earlier run
    stop   : (1,) ends the run when another thread sets it to True
    """

    end: float
    events: int
    cells: int
    pause: bool
    begins: bool
    restarts: bool
    stop: Any


class Ended(NamedTuple):
    """How a run ended: an ``Outcome``, numbers of events and cells, and the time [s]."""

    outcome: int
    events: int
    cells: int
    time: float


@embedded
def _first_event(problem, run, slot, terms, longest, before):
    """Return the time until the first zero of a guard, and its number; (longest, -1): none.

    before : length of the cell before [s]
    """
    systems, z, g = run.systems, run.z, run.guard
    tau, first, beyond = longest, -1, 0.0
    for number in range(systems.counts[slot]):
        what = systems.what[slot, number]
        scale = combine(systems.guards[slot, number], z, g)
        fresh, tolerance, slack = False, 0.0, 0.0
        if what.kind == GuardKind.HOLDING_LIMIT:
            # Not 0 in a cell without length, at the end of a run: a torque at its limit holds.
            least = _LEAST_SLACK * largest_change(g, terms, tau) + _SMALLEST
            slack = max(run.modes[what.contact].slack, least)
            g[0] += slack
        elif what.kind == GuardKind.ZERO_SPEED:
            tolerance = _ROUNDING * problem.contacts[what.contact].base_bound
            if run.modes[what.contact].fresh & bit(what.kind, what.sign) != 0:
                g[0] = 0.0  # a slip has begun
            if abs(g[0]) <= tolerance and abs(g[1]) <= flatness(problem, run, what.contact):
                g[1] = max(g[1], 0.0)  # the slip has begun as the torque was at its limit
        else:
            if what.kind == GuardKind.PIECE:
                fresh = is_fresh(problem, run, what)
            elif what.kind == GuardKind.CONTROL:
                fresh = is_fresh_limit(problem, run, what)
                if fresh and touches_limit(problem, run, what):
                    g[1] = max(g[1], 0.0)
            else:
                fresh = run.modes[what.contact].fresh & bit(what.kind, what.sign) != 0
            # With the rounding in the cell before, which may be much longer than this one.
            tolerance = _ROUNDING * (scale + (abs(g[1]) * before if fresh else 0.0))
            if fresh and what.kind == GuardKind.PIECE and is_undecided(run, what):
                change = largest_change(g, terms, tau)
                g[0] = max(g[0], 0.0) + tolerance + _LEAST_SLACK * change
                fresh, tolerance = False, 0.0
        found = first_zero(g, terms, tau, tolerance, fresh)
        if found <= tau:
            tau, first, beyond = found, number, slack
            if tau == 0.0:
                break
    if first >= 0 and systems.what[slot, first].kind == GuardKind.HOLDING_LIMIT:
        combine(systems.guards[slot, first], z, g)
        # Nearer to its limit, a torque would not change before it: time has a last digit too.
        if g[0] > beyond:
            tau = zero_before(g, terms, tau)
    return tau, first


@embedded
def _is_beyond(run, slot, number):
    """Return True if a guard is below zero at the beginning of a cell by more than rounding."""
    row = run.systems.guards[slot, number]
    return value(row, run.z) < -_BEYOND * size(row, run.z)


@embedded
def _apply_event(problem, run, slot, first, cell):
    """Apply the event of guard ``first``; returns the number of what bends, -1: nothing.

    That of an element follows those of the contacts, then those of controllers.
    """
    if first < 0:
        return np.int64(-1)
    what = run.systems.what[slot, first]
    number = what.contact + (run.modes.size if what.kind >= GuardKind.PIECE else 0)
    if what.kind == GuardKind.CONTROL:
        number += problem.elements.elements.size
    return number if apply_event(problem, run, what, cell) else np.int64(-1)


@embedded
def _log_events(run, time, log, count, bent, begins):
    """Log what has happened to the contacts; returns the number of events.

    bent   : contact or element whose torque bends, -1: none
    begins : at the start of a run, which is no event
    """
    if bent >= run.modes.size and not begins:
        event = log[count]
        event.time, event.contact, event.kind = time, bent, EventKind.BREAKPOINT
        event.before, event.after, event.force_limit = 0, 0, 0
        event.line = run.places[bent - run.modes.size].piece
        count += 1
    elif 0 <= bent < run.modes.size:
        mode = run.modes[bent]
        count = _log(log, count, time, bent, EventKind.BREAKPOINT, mode.side, mode)
    for number in range(run.modes.size):
        mode = run.modes[number]
        if begins:
            mode.first = mode.side
        elif mode.before != mode.side:
            kind = kind_of(mode.before, mode.side)
            count = _log(log, count, time, number, kind, mode.before, mode)
        mode.before = mode.side
    return count


@embedded
def _log(log, count, time, contact, kind, before, mode):
    """Log an event after which a contact is in a mode; returns the number of events."""
    event = log[count]
    event.time, event.contact, event.kind = time, contact, kind
    event.before, event.after = before, mode.side
    event.line, event.force_limit = mode.line, mode.force_limit
    return count + 1


@embedded
def _after_knot(problem, run, cell, time):
    """Take samples, and follow signals that have jumped, or bases that a contact reaches.

    cell : the cell that ended at the knot
    """
    place_controls(problem, run)
    take_samples(problem, run, time)
    if follow_bases(problem, run, False):
        classify(problem, run)
    else:
        find_arrived(problem, run, cell)
        follow_forces(problem, run)


@embedded
def _is_locked(run, slot):
    """Return True if a contact slides in a direction in which its brake locks itself."""
    for number in range(run.modes.size):
        if run.modes[number].side != 0:
            for entry in run.systems.contact[slot, number]:
                if math.isinf(entry):
                    return True
    return False


@embedded
def _is_bounded(z):
    """Return True if all states are numbers below the largest allowed magnitude."""
    bounded = True
    for i in range(z.shape[0]):
        bounded = bounded and abs(z[i, 0]) < _LARGEST
    return bounded


@embedded
def _all_at_rest(modes):
    """Return True if no contact slides."""
    resting = True
    for mode in modes:
        resting = resting and mode.side == 0
    return resting


@embedded
def _finish_cell(problem, run, terms, tau, passed):
    """Advance the states and the angles of orders by tau.

    passed : whether the marks of guards that have just been zero are no longer needed
    """
    advance_states(run.z, problem.states, terms, tau)
    advance(problem.signals, run.z, problem.states, terms, tau)
    if passed:
        for mode in run.modes:
            mode.fresh = 0
        forget_passed(run.places)


@borrowing
def set_inputs(problem, run):
    """Set the inputs at the beginning of a run."""
    start_tables(problem.signals, run.clock[0])
    expand_inputs(problem, run, Clock(run.clock[0], run.clock[1]))
    run.z[run.z.shape[0] - 1, 0] = 1.0


@borrowing
def _start(problem, run, restarts):
    """Set the inputs and modes at the beginning of a run."""
    set_inputs(problem, run)
    run.pending[0] = 0
    if restarts:
        check_pieces(problem, run)
        multiply(problem, run)
    else:
        place_pieces(problem, run)
        multiply(problem, run)
        set_sides(problem, run)  # sampled actuations read the sliding speeds
        place_controls(problem, run)
        take_samples(problem, run, run.clock[0])
    if not restarts or follow_bases(problem, run, True):
        classify(problem, run)
    else:
        check_lines(problem, run)
        find_resting(run)
    place_controls(problem, run)
    follow_forces(problem, run)
    for mode in run.modes:
        mode.first = mode.side


class Totals(NamedTuple):
    """Numbers of events and of cells so far, and of modes entered at the present instant."""

    events: int
    cells: int
    cascade: int


@embedded
def _reason_to_end(run, slot, span, log, totals, bent):
    """The ``Outcome`` of a run that ends where a mode begins; ``RUNNING`` if it does not end.

    bent : contact or element whose torque bends, -1: none
    """
    parts = run.modes.size + run.places.size
    if span.pause and (span.begins or totals.cells > 0) and bent < 0 and _all_at_rest(run.modes):
        return Outcome.PAUSED
    if lacks_tangents(run, slot):
        return Outcome.PAUSED
    if totals.cascade > _CASCADE * (parts + 1) or _is_locked(run, slot):
        return Outcome.NO_FORWARD_SOLUTION
    if totals.events >= span.events:
        return Outcome.EVENT_LIMIT
    if totals.events + parts > log.size:
        return Outcome.LOG_FULL
    return Outcome.RUNNING


@embedded
def _expand_cell(watch, problem, run, slot, remaining):
    """Expand the states in the next cell.

    Returns (its length without events [s], number of terms, largest length that it may have [s]).
    """
    longest = run.systems.longest[slot]
    h = min(longest, remaining)
    if slides_on_curve(run):
        h = min(h, resolves(watch, problem, run, slot))
        h = expand_curves(problem, run, slot, CURVE_TERMS, h)
        return h, CURVE_TERMS, h
    terms = TERMS if math.isinf(longest) else terms_for(2.0 * h / longest)
    expand_states(run.systems.rates[slot], run.systems.lead[slot], run.z, terms)
    return h, terms, h if math.isinf(longest) else longest


@embedded
def _next_end(problem, run):
    """Next knot of the signals, or sampling [s]."""
    return min(next_knot(problem.signals), next_sampling(problem, run))


@borrowing
def move(problem, run, span, log, observer):
    """Begin a run, or continue it after an earlier part; returns ``Ended``.

    log      : of dtype ``EVENT``; the run ends before it could overflow
    observer : an ``Observer`` of the cells
    """
    return _move(by_reference(problem), by_reference(run), span, log, observer)


@borrowing
def _move(problem, run, span, log, observer):
    """As ``move``, with references.

    ``settle`` and ``present_system`` are called in one place only, because each call is compiled
    separately.
    """
    if span.begins:
        _start(problem, run, span.restarts)
    clock, cells, cascade = Clock(run.clock[0], run.clock[1]), 0, 0
    count = np.int64(0)  # Numba would compile functions for a literal 0 too
    slot, watch, knot = np.int64(0), observer.watch, _next_end(problem, run)
    run.pending[0] = max(run.pending[0], 0)
    outcome = Outcome.RUNNING
    try_strides, first, at_knot, joined = True, np.int64(-1), False, False
    cell, instant, begins = Cell(0.0, np.int64(TERMS), 0.0), 0.0, span.begins
    while True:
        expand_inputs(problem, run, clock)
        multiply(problem, run)
        if at_knot:
            _after_knot(problem, run, cell, clock.time)
            follow_samples(watch, problem, run, slot)
            knot = _next_end(problem, run)
        share_speeds(problem, run, slot, cells > 0)
        multiply(problem, run)
        bent = _apply_event(problem, run, slot, first, cell)
        if cells >= span.cells or span.stop[0]:
            outcome = Outcome.STEP_LIMIT
            break
        if run.pending[0] >= 0:
            if bent >= run.modes.size:
                place_controls(problem, run)  # the torque of a damped stop jumps
            if run.pending[0] > 0 and not settle(problem, run):
                outcome = Outcome.NO_FORWARD_SOLUTION
                break
            run.pending[0] = -1
            slot = present_system(problem, run)
            if problem.joints.mobility.size > 0:  # those of new sticks
                share_speeds(problem, run, slot, True)
            joined = joins_bases(problem, run, slot)
            count = _log_events(run, clock.time, log, count, bent, begins)
            outcome = _reason_to_end(run, slot, span, log, Totals(count, cells, cascade), bent)
            if outcome != Outcome.RUNNING:
                break
        if try_strides and not joined:
            ends = Ends(knot, span.end)
            strode = stride(watch, problem, run, slot, ends, span.cells - cells, observer, clock)
            clock, knot, cells = strode.clock, strode.knot, cells + strode.cells
            cascade = 0 if strode.cells > 0 else cascade
        ahead = min(span.end, knot)
        remaining = (ahead - clock.time) - clock.remainder
        h, terms, longest = _expand_cell(watch, problem, run, slot, remaining)
        tau, first = _first_event(problem, run, slot, terms, h, cell.length)
        event = first, first >= 0 and _is_beyond(run, slot, first)
        tau, first, enough = follow(watch, problem, run, slot, terms, clock, tau, event)
        last = first < 0 and tau >= remaining and ahead >= span.end
        observe(observer, problem, run, slot, terms, clock, tau, last)
        instant = _INSTANT * longest if first >= 0 or begins else instant
        passed = tau > instant
        begins = begins and not passed
        _finish_cell(problem, run, terms, tau, passed)
        clock, cells, cascade = later(clock, tau), cells + 1, 0 if passed else cascade + 1
        bounded = _is_bounded(run.z)
        if enough or not bounded:
            outcome = Outcome.COMPLETED if bounded else Outcome.DIVERGED
            break
        # An event within rounding of a knot is at the knot.
        at_knot = remaining - tau <= (_TOGETHER * max(abs(ahead), h) if first >= 0 else 0.0)
        if at_knot:
            clock = Clock(ahead, 0.0)
            if clock.time >= span.end and first < 0:
                outcome = Outcome.COMPLETED
                break
            pass_knots(problem.signals, clock.time)
        cell = Cell(h, terms, tau)
        try_strides = passed and first < 0
    run.clock[0], run.clock[1] = clock.time, clock.remainder
    return Ended(outcome, count, cells, clock.time)
