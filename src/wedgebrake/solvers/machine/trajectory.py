"""The run of a machine: cells of Taylor series, the first zero of every guard, and events."""

import math
from typing import Any, NamedTuple

import numpy as np

from wedgebrake.dynamics.enums import EventKind, Outcome
from wedgebrake.dynamics.jit import compiled, inlined
from wedgebrake.dynamics.signals import advance, expand, next_knot, pass_knots, start_tables
from wedgebrake.solvers.machine.cells import (
    advance_states,
    combine,
    expand_states,
    first_zero,
    terms_for,
)
from wedgebrake.solvers.machine.events import (
    FLAT,
    Cell,
    apply_event,
    classify,
    follow_bases,
    kind_of,
    next_sampling,
    sample_controllers,
    set_sides,
    settle_arrived,
)
from wedgebrake.solvers.machine.modes import GuardKind, bit, select_system, speed_rows
from wedgebrake.solvers.machine.observers import observe
from wedgebrake.solvers.machine.problem import TERMS

# Relative size of a guard that is rounding.
_ROUNDING = 1e-13
# Modes of no length at one instant, per contact, after which the run gives up.
_CASCADE = 12


class Span(NamedTuple):
    """How far a run goes.

    end    : time [s]
    events : most events
    pause  : whether to end where all contacts have come to rest
    stop   : (1,) ends the run when another thread sets it to True
    """

    end: float
    events: int
    pause: bool
    stop: Any


class Ended(NamedTuple):
    """How a run ended, an ``Outcome``; its events, cells and time [s]."""

    outcome: int
    events: int
    cells: int
    time: float


class Clock(NamedTuple):
    """A time as a sum of two numbers, so that many small cells lose nothing."""

    time: float
    rest: float


@inlined
def later(clock, tau):
    """A clock a time tau later."""
    total = clock.time + tau
    back = total - clock.time
    lost = (clock.time - (total - back)) + (tau - back) + clock.rest
    time = total + lost
    return Clock(time, lost - (time - total))


@compiled
def _expand_inputs(problem, run, clock, terms):
    """Store the series of the signals, and the rates of moving bases."""
    states, z = problem.states, run.z
    expand(problem.signals, clock.time, clock.rest, terms, z, states)
    for contact in problem.contacts:
        if contact.base_rate >= 0:
            base, rate = states + contact.base, states + contact.base_rate
            for k in range(terms - 1):
                z[k, rate] = (k + 1.0) * z[k + 1, base]
            z[terms - 1, rate] = 0.0


@compiled
def _first_event(run, slot, terms, longest):
    """(time until the first zero of a guard, its number); (longest, -1) if there is none."""
    systems, z, g = run.systems, run.z, run.guard
    tau, first = longest, -1
    for number in range(systems.counts[slot]):
        what = systems.what[slot, number]
        scale = combine(systems.guards[slot, number], z, terms, g)
        fresh = run.modes[what.contact].fresh
        zero = fresh & bit(what.kind, what.sign) != 0 or abs(g[0]) <= _ROUNDING * scale
        flat = what.kind == GuardKind.ZERO_SPEED and fresh & FLAT != 0
        found = first_zero(g, terms, tau, zero, flat)
        if found <= tau:
            tau, first = found, number
    return tau, first


@compiled
def _log_changes(run, time, log, count):
    """Log the contacts whose side differs from ``run.before``; returns the number of events."""
    for number in range(run.modes.size):
        before, after = run.before[number], run.modes[number].side
        if before == after:
            continue
        count = _log(log, count, time, number, kind_of(before, after), before, after)
    return count


@compiled
def _log(log, count, time, contact, kind, before, after):
    """Log an event; returns the number of events."""
    event = log[count]
    event.time, event.contact, event.kind = time, contact, kind
    event.before, event.after = before, after
    return count + 1


@compiled
def _after_knot(problem, run, cell, log, count):
    """Sample controllers, and follow bases whose speed may have jumped or become that of a contact.

    cell : that ended at the knot

    Returns (number of events, whether there is an answer).
    """
    time = run.clock[0]
    sample_controllers(problem, run, time)
    for number in range(run.modes.size):
        run.before[number] = run.modes[number].side
    if follow_bases(problem, run):
        answer = classify(problem, run)
    else:
        arrived, answer = settle_arrived(problem, run, cell)
        if not arrived:
            return count, answer
    return _log_changes(run, time, log, count), answer


@compiled
def _is_locked(run, slot):
    """Return True if a contact slides in a direction in which its brake locks itself."""
    for number in range(run.modes.size):
        if run.modes[number].side != 0:
            for entry in run.systems.contact[slot, number]:
                if math.isinf(entry):
                    return True
    return False


@compiled
def _all_at_rest(modes):
    """Return True if no contact slides."""
    resting = True
    for mode in modes:
        resting = resting and mode.side == 0
    return resting


@compiled
def _finish_cell(problem, run, terms, tau):
    """Move the states, the angles of orders and the marks of the guards on by tau."""
    advance_states(run.z, problem.states, terms, tau)
    advance(problem.signals, run.z, problem.states, terms, tau)
    if tau > 0.0:
        for mode in run.modes:
            mode.fresh = 0


@compiled
def start(problem, run, restart):
    """Set the inputs and modes at the start; returns whether there is an answer.

    restart : the modes, held forces and queues are those of a former run
    """
    clock, terms = Clock(problem.start_time, 0.0), np.int64(2)
    run.clock[0], run.clock[1] = clock.time, clock.rest
    start_tables(problem.signals, clock.time)
    _expand_inputs(problem, run, clock, terms)
    run.z[0, run.z.shape[1] - 1] = 1.0
    speed_rows(problem, run.work)
    if restart:
        return not follow_bases(problem, run) or classify(problem, run)
    set_sides(run)  # controllers sample the sliding speeds
    sample_controllers(problem, run, clock.time)
    return classify(problem, run)


@compiled
def move(problem, run, span, log, observer):
    """Move a run on, after ``start`` or a former part of it; returns ``Ended``.

    log      : of dtype ``EVENT``; the run ends before it may be too short
    observer : an ``Observer`` of the cells
    """
    clock, cells, again = Clock(run.clock[0], run.clock[1]), 0, 0
    count = np.int64(0)  # Numba would compile functions for a literal 0 too
    few = np.int64(2)
    contacts, answer = run.modes.size, True
    slot = select_system(problem, run)
    knot = min(next_knot(problem.signals), next_sampling(problem, run.modes))
    outcome = Outcome.STEP_LIMIT
    while not span.stop[0]:
        if not answer or again > _CASCADE * (contacts + 1) or _is_locked(run, slot):
            outcome = Outcome.NO_FORWARD_SOLUTION
            break
        if count >= span.events:
            outcome = Outcome.EVENT_LIMIT
            break
        if count + contacts > log.size:
            outcome = Outcome.LOG_FULL
            break
        remaining = (min(span.end, knot) - clock.time) - clock.rest
        longest = run.systems.longest[slot]
        h = min(longest, remaining)
        terms = TERMS if math.isinf(longest) else terms_for(2.0 * h / longest)
        _expand_inputs(problem, run, clock, terms)
        expand_states(run.systems.rates[slot], problem.inverse.size, problem.states, run.z, terms)
        tau, first = _first_event(run, slot, terms, h)
        observe(observer, problem, run, slot, terms, clock.time, clock.rest, tau)
        _finish_cell(problem, run, terms, tau)
        clock = later(clock, tau)
        cells += 1
        again = 0 if tau > 0.0 else again + 1
        if first >= 0:
            _expand_inputs(problem, run, clock, few)
            what = run.systems.what[slot, first]
            kind, answer = apply_event(problem, run, what, Cell(h, terms))
            if kind == EventKind.BREAKPOINT:
                side = run.modes[what.contact].side
                count = _log(log, count, clock.time, what.contact, kind, side, side)
            else:
                count = _log_changes(run, clock.time, log, count)
            slot = select_system(problem, run)
            if span.pause and _all_at_rest(run.modes):
                outcome = Outcome.PAUSED
                break
        elif tau >= remaining:
            clock = Clock(min(span.end, knot), 0.0)
            if clock.time >= span.end:
                outcome = Outcome.COMPLETED
                break
            pass_knots(problem.signals, knot)
            _expand_inputs(problem, run, clock, few)
            before = count
            run.clock[0], run.clock[1] = clock.time, clock.rest
            count, answer = _after_knot(problem, run, Cell(h, terms), log, count)
            knot = min(next_knot(problem.signals), next_sampling(problem, run.modes))
            if count > before:
                slot = select_system(problem, run)
    run.clock[0], run.clock[1] = clock.time, clock.rest
    return Ended(outcome, count, cells, clock.time)
