"""The run of a machine: cells of Taylor series, the first zero of every guard, and events."""

import math
from enum import IntEnum
from typing import Any, NamedTuple

import numpy as np

from wedgebrake.dynamics.jit import compiled, inlined
from wedgebrake.dynamics.records import record
from wedgebrake.dynamics.signals import advance, expand, next_knot, pass_knots, start_tables
from wedgebrake.solvers.machine.complementarity import _ROUNDING as _ROUNDING_OF_RATES
from wedgebrake.solvers.machine.complementarity import AtRest, matrix_of, solve
from wedgebrake.solvers.machine.modes import (
    GuardKind,
    assemble,
    bit,
    command_row,
    compliance,
    slip_row,
    speed_rows,
)

TERMS = 26
# Largest product of a cell and the norm of the machine or the fastest frequency.
_CELL = 2.0
# Relative size of a guard that is rounding.
_ROUNDING = 1e-13
# Zero-length modes at one instant, per contact, after which the run gives up.
_CASCADE = 12
# Bit of ``fresh``: slip has begun without a rate, as a holding torque has reached its limit.
_FLAT = 1 << 10

EVENT = record("time", whole="contact kind side")


class EventKind(IntEnum):
    """Events of a contact."""

    STICK = 0
    SLIP = 1
    REVERSAL = 2
    LIMIT = 3
    BREAKPOINT = 4


class Outcome(IntEnum):
    """How a run ended."""

    COMPLETED = 0
    LOG_FULL = 1
    STUCK = 2
    AT_REST = 3


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
def series(system, states, x, inputs, terms):
    """Store the Taylor coefficients of x in x[:, 1:terms], from x[:, 0]."""
    rates, size = system.rates, system.rates.shape[1]
    half = system.torque.shape[0]
    for k in range(terms - 1):
        share = 1.0 / (k + 1.0)
        for i in range(half):
            x[i, k + 1] = x[half + i, k] * share
        for i in range(half, states):
            total = rates[i, size - 1] if k == 0 else 0.0
            for j in range(states):
                total += rates[i, j] * x[j, k]
            for j in range(states, size - 1):
                total += rates[i, j] * inputs[j - states, k]
            x[i, k + 1] = total * share


@compiled
def combine(row, states, x, inputs, terms, result):
    """Store the series of a row; returns the sum of the sizes of what its value is made of."""
    size = row.size
    for k in range(terms):
        result[k] = 0.0
    scale = abs(row[size - 1])
    result[0] = row[size - 1]
    for j in range(states):
        if row[j] != 0.0:
            scale += abs(row[j] * x[j, 0])
            for k in range(terms):
                result[k] += row[j] * x[j, k]
    for j in range(size - 1 - states):
        factor = row[states + j]
        if factor != 0.0:
            scale += abs(factor * inputs[j, 0])
            for k in range(terms):
                result[k] += factor * inputs[j, k]
    return scale


@compiled
def value(row, states, x, inputs):
    """Value of a row at the begin of a cell."""
    total = row[row.size - 1]
    for j in range(states):
        if row[j] != 0.0:
            total += row[j] * x[j, 0]
    for j in range(row.size - 1 - states):
        if row[states + j] != 0.0:
            total += row[states + j] * inputs[j, 0]
    return total


@compiled
def _size(row, states, x, inputs):
    """Sum of the sizes of what the value of a row is made of."""
    total = abs(row[row.size - 1])
    for j in range(states):
        total += abs(row[j] * x[j, 0])
    for j in range(row.size - 1 - states):
        total += abs(row[states + j] * inputs[j, 0])
    return total


@inlined
def polynomial(coefficients, terms, tau):
    """Value of a series at tau."""
    total = 0.0
    for k in range(terms - 1, -1, -1):
        total = total * tau + coefficients[k]
    return total


@compiled
def first_zero(g, terms, h, zero, flat):
    """First zero of the polynomial g in [0, h]; inf: there is none.

    Each step is one within which a bound of the second derivative excludes a zero (EXACT: Newton's
    step from the safe side).

    zero : g begins at zero;  flat : so does its derivative, up to rounding
    """
    reach = 0.0
    for k in range(terms - 1, 0, -1):
        reach = (reach + abs(g[k])) * h
    start = 0.0 if zero else g[0]
    if start > reach:
        return math.inf
    two = 0.0
    for k in range(terms - 1, 2, -1):
        two = two * h + k * (k - 1.0) * (k - 2.0) * abs(g[k])
    third = two
    tau = 0.0
    if zero:
        # g = tau (g1 + g2 tau + ...): a zero of the parenthesis is excluded.
        slope, curve = 0.0 if flat else g[1], g[2]
        # slope + curve d - third d^2/6 > 0
        c = third / 6.0
        if slope < 0.0 or (slope == 0.0 and curve < 0.0):
            return 0.0
        root = math.sqrt(curve * curve + 4.0 * c * slope)
        if c == 0.0:
            d = h if curve >= 0.0 else min(h, -slope / curve)
        else:
            d = (curve + root) / (2.0 * c)
        if d >= h:
            return math.inf
        tau = max(d, 1e-9 * h)
    elif start <= 0.0:
        return 0.0
    tick = 1e-16 * h
    for _ in range(400):
        u, du, ddu = 0.0, 0.0, 0.0
        for k in range(terms - 1, -1, -1):
            ddu = ddu * tau + du
            du = du * tau + u
            u = u * tau + g[k]
        if zero:
            u -= g[0]
        ddu *= 2.0
        if u <= 0.0:
            return tau
        rest = h - tau
        bound = max(-ddu, 0.0) + third * rest
        if bound == 0.0:
            d = rest if du >= 0.0 else -u / du
        else:
            root = math.sqrt(du * du + 2.0 * bound * u)
            d = (du + root) / bound if du >= 0.0 else 2.0 * u / (root - du)
        if d >= rest:
            return math.inf
        # A tighter bound within the step, as the third derivative acts there alone.
        bound = max(-ddu, 0.0) + third * 2.0 * d
        root = math.sqrt(du * du + 2.0 * bound * u)
        longer = (du + root) / bound if du >= 0.0 else 2.0 * u / (root - du)
        d = max(d, min(longer, 2.0 * d))
        if d >= rest:
            return math.inf
        tau += d
        if d <= tick:
            return tau
    return tau


class Run(NamedTuple):
    """Arrays of a run: ``x`` (states, TERMS), ``inputs`` (signals, TERMS), modes and workspace."""

    x: Any
    inputs: Any
    modes: Any
    system: Any
    work: Any
    guard: Any
    limited: Any
    numbers: Any
    choices: Any
    resting: Any
    before: Any


@compiled
def force_at_rest(problem, number, modes, x, inputs):
    """Actuation force of a contact at rest."""
    contact = problem.contacts[number]
    if contact.lag > 0:
        force = x[contact.state, 0]
    elif contact.sample_time > 0.0:
        force = modes[number].held
    else:
        force = inputs[contact.force, 0]
    return min(max(force, contact.lowest), contact.highest)


@inlined
def _times(gain, force):
    return gain * force if force != 0.0 else 0.0


@compiled
def settle(problem, run, at_rest):
    """Decide which of the contacts at rest hold, and set their modes; False: no answer.

    at_rest : numbers of the contacts with zero sliding speed
    """
    x, inputs, modes, system = run.x, run.inputs, run.modes, run.system
    count, states = at_rest.size, problem.states
    rates, lower, upper, forward, backward, torque, sizes = run.numbers
    limited, preferred, pattern, clamps, flat = run.choices
    # Torques on the inertias without those of the contacts at rest.
    n = problem.inverse.size
    for i in range(n):
        torque[i] = sizes[i] = 0.0
        for k in range(n):
            part = problem.stiffness[i, k] * x[k, 0]
            other = problem.damping[i, k] * x[n + k, 0]
            torque[i] -= part + other
            sizes[i] += abs(part) + abs(other)
        for k in range(problem.drive.shape[1]):
            part = problem.drive[i, k] * inputs[k, 0]
            torque[i] += part
            sizes[i] += abs(part)
    for number in range(problem.contacts.size):
        mode, contact = modes[number], problem.contacts[number]
        resting = False
        for one in at_rest:
            resting = resting or one == number
        if resting:
            continue
        row = system.contact[number]
        slip_row(problem, number, mode.side, mode.line, system, row)
        push = value(row, states, x, inputs)
        torque[contact.a] += push
        sizes[contact.a] += abs(push)
        if contact.b >= 0:
            torque[contact.b] -= push
            sizes[contact.b] += abs(push)
    scale = 0.0
    for i in range(count):
        contact = problem.contacts[at_rest[i]]
        force = force_at_rest(problem, at_rest[i], modes, x, inputs)
        lower[i] = -_times(contact.breakaway_forward, force)
        upper[i] = -_times(contact.breakaway_backward, force)
        forward[i] = -_times(contact.forward, force)
        backward[i] = -_times(contact.backward, force)
        rates[i] = problem.inverse[contact.a] * torque[contact.a]
        size = problem.inverse[contact.a] * sizes[contact.a]
        if contact.b >= 0:
            rates[i] -= problem.inverse[contact.b] * torque[contact.b]
            size += problem.inverse[contact.b] * sizes[contact.b]
        if contact.base >= 0:
            rates[i] -= inputs[contact.base_rate, 0]
            size += abs(inputs[contact.base_rate, 0])
        if math.isfinite(lower[i]) and math.isfinite(upper[i]):
            size += problem.inverse[contact.a] * max(abs(lower[i]), abs(upper[i]))
        scale = max(scale, size)
        limited[i] = run.limited[at_rest[i]]
        preferred[i] = -limited[i]
    if count == 1:
        needed = -rates[0] / compliance(problem, at_rest[0], at_rest[0])
        room = scale * _ROUNDING_OF_RATES / compliance(problem, at_rest[0], at_rest[0])
        clamps[0], pattern[0] = 0, 0
        if limited[0] != 0:
            pattern[0] = -limited[0]
        elif needed > upper[0] + room:
            pattern[0] = -1
        elif needed < lower[0] - room:
            pattern[0] = 1
        if pattern[0] != 0:
            push = forward[0] if pattern[0] > 0 else backward[0]
            flat[0] = abs(push - needed) <= room
    else:
        rest = AtRest(
            at_rest, matrix_of(problem, at_rest), rates[:count], scale, lower[:count],
            upper[:count], forward[:count], backward[:count], preferred[:count], limited[:count],
        )  # fmt: skip
        if not solve(rest, pattern[:count], np.zeros(count), clamps[:count], flat[:count]):
            return False
    for i in range(count):
        mode = modes[at_rest[i]]
        mode.side, mode.clamp = pattern[i], clamps[i]
        if pattern[i] != 0:
            mode.line = 0 if pattern[i] > 0 else problem.contacts[at_rest[i]].lines_forward
            mode.fresh |= bit(GuardKind.ZERO_SPEED, -1)
            if flat[i] != 0:
                mode.fresh |= _FLAT
        _set_clip(problem, at_rest[i], run)
    return True


@compiled
def _set_clip(problem, number, run):
    """Set the mode of the actuation force by what it is without limits."""
    contact, mode = problem.contacts[number], run.modes[number]
    mode.clip = 0
    if contact.lines > 0:
        return
    if contact.lag > 0:
        force = run.x[contact.state, 0]
    else:
        row = run.system.spare
        command_row(problem, number, mode, run.system, row)
        force = value(row, problem.states, run.x, run.inputs)
    if force < contact.lowest:
        mode.clip = -1
    elif force > contact.highest:
        mode.clip = 1


@compiled
def _set_line(problem, number, speed, run):
    """Set the line of the torque of a sliding contact."""
    contact, mode = problem.contacts[number], run.modes[number]
    mode.line = 0
    if contact.lines == 0:
        return
    line = 0 if speed > 0.0 else contact.lines_forward
    last = contact.lines_forward if speed > 0.0 else contact.lines
    while line + 1 < last and problem.lines[contact.first_line + line + 1].start <= abs(speed):
        line += 1
    mode.line = line


@compiled
def begin(problem, run):
    """Set the modes at the begin of a run; False: no answer."""
    x, inputs, modes, system = run.x, run.inputs, run.modes, run.system
    speed_rows(problem, system)
    resting = np.empty(modes.size, np.int64)
    count = 0
    for number in range(modes.size):
        row = system.sliding[number]
        speed = value(row, problem.states, x, inputs)
        mode = modes[number]
        mode.clamp, mode.fresh = 0, 0
        if abs(speed) <= 1e-14 * _size(row, problem.states, x, inputs):
            resting[count] = number
            count += 1
            mode.side, mode.line = 0, 0
        else:
            mode.side = 1 if speed > 0.0 else -1
            _set_line(problem, number, speed, run)
        _set_clip(problem, number, run)
    run.limited[:] = 0
    # Slipping contacts need their force rows.
    assemble(problem, modes, system, run.work)
    return count == 0 or settle(problem, run, resting[:count])


@compiled
def _resting(run, arrived):
    """Numbers of the contacts at rest, with one that has arrived there (-1: none)."""
    found, count = run.resting, 0
    for number in range(run.modes.size):
        if run.modes[number].side == 0 or number == arrived:
            found[count] = number
            count += 1
    return found[:count]


@compiled
def longest_cell(system, states, fastest):
    """Longest cell, from the norm of the machine in scaled variables and its fastest signal."""
    half = system.torque.shape[0]
    stiff, damp, rest = 0.0, 0.0, 0.0
    for i in range(half):
        one, other, third = 0.0, 0.0, 0.0
        for j in range(half):
            one += abs(system.rates[half + i, j])
            other += abs(system.rates[half + i, half + j])
        for j in range(2 * half, states):
            third += abs(system.rates[half + i, j])
        stiff, damp, rest = max(stiff, one), max(damp, other), max(rest, third)
    norm = max(math.sqrt(stiff) + damp, fastest)
    lag = 0.0
    for i in range(2 * half, states):
        for j in range(2 * half, states):
            lag = max(lag, abs(system.rates[i, j]))
    norm = max(norm, lag)
    return _CELL / norm if norm > 0.0 else math.inf


@compiled
def _event(problem, run, what, clock, log, count):
    """Change the mode at an event; (events logged, whether there is an answer)."""
    number, mode = what.contact, run.modes[what.contact]
    side, answer = mode.side, True
    if what.kind == GuardKind.NEXT_LINE:
        mode.line += what.sign
        mode.fresh |= bit(what.kind, -what.sign)
        kind = EventKind.BREAKPOINT
    elif what.kind == GuardKind.FORCE_LIMIT:
        mode.clip += what.sign
        mode.fresh |= bit(what.kind, -what.sign)
        kind = EventKind.LIMIT
    else:
        run.limited[:] = 0
        arrived = -1
        if what.kind == GuardKind.HOLDING_LIMIT:
            run.limited[number] = what.sign
        else:
            arrived = number
        before = run.before
        for other in range(before.size):
            before[other] = run.modes[other].side
        resting = _resting(run, arrived)
        answer = settle(problem, run, resting)
        for other in resting:
            after = run.modes[other].side
            if after == before[other]:
                continue
            kind = EventKind.STICK if after == 0 else EventKind.SLIP
            if before[other] != 0 and after != 0:
                kind = EventKind.REVERSAL
            if count < log.size:
                log[count].time, log[count].contact = clock.time, other
                log[count].kind, log[count].side = kind, after if after != 0 else before[other]
            count += 1
        return count, answer
    if count < log.size:
        log[count].time, log[count].contact = clock.time, number
        log[count].kind, log[count].side = kind, side
    return count + 1, answer


@compiled
def _load(problem, clock, run, terms):
    """Store the series of all signals at a time."""
    signals = problem.signals
    expand(signals, clock.time, clock.rest, terms, run.inputs)


@compiled
def move(problem, run, end, fastest, log, samples, states_out, extra):
    """Run a machine from the start time to an end.

    run     : ``Run`` with x[:, 0] set
    fastest : largest angular frequency of the signals [rad/s]
    log     : of dtype ``EVENT``
    samples : (k,) times; states_out : (k, states) receives the states
    extra   : (k, m, 3) receives torque, force and side of each contact

    Returns (outcome, events, cells, time).
    """
    signals, states, terms = problem.signals, problem.states, TERMS
    clock = Clock(problem.start_time, 0.0)
    start_tables(signals, clock.time)
    _load(problem, clock, run, terms)
    if not begin(problem, run):
        return Outcome.STUCK, 0, 0, clock.time
    count, cells, wanted, changed, again = 0, 0, 0, True, 0
    longest, knot = 0.0, next_knot(signals)
    x, inputs, system, g = run.x, run.inputs, run.system, run.guard
    while True:
        if changed:
            assemble(problem, run.modes, system, run.work)
            longest = longest_cell(system, states, fastest)
            changed = False
        remaining = (min(end, knot) - clock.time) - clock.rest
        h = min(longest, remaining)
        cells += 1
        series(system, states, x, inputs, terms)
        tau, first = h, -1
        for number in range(system.counts[0]):
            scale = combine(system.guards[number], states, x, inputs, terms, g)
            what = system.what[number]
            zero = run.modes[what.contact].fresh & bit(what.kind, what.sign) != 0
            zero = zero or abs(g[0]) <= _ROUNDING * scale
            flat = what.kind == GuardKind.ZERO_SPEED and run.modes[what.contact].fresh & _FLAT != 0
            found = first_zero(g, terms, tau, zero, flat)
            if found <= tau:
                tau, first = found, number
        while wanted < samples.size and samples[wanted] <= clock.time + tau:
            at = min(max((samples[wanted] - clock.time) - clock.rest, 0.0), tau)
            for i in range(states):
                states_out[wanted, i] = polynomial(x[i], terms, at)
            for number in range(run.modes.size):
                combine(system.contact[number], states, x, inputs, terms, g)
                extra[wanted, number, 0] = polynomial(g, terms, at)
                combine(system.force[number], states, x, inputs, terms, g)
                extra[wanted, number, 1] = polynomial(g, terms, at)
                extra[wanted, number, 2] = run.modes[number].side
            wanted += 1
        for i in range(states):
            x[i, 0] = polynomial(x[i], terms, tau)
        advance(signals, inputs, terms, tau)
        if tau > 0.0:
            again = 0
            for number in range(run.modes.size):
                run.modes[number].fresh = 0
        else:
            again += 1
        if again > _CASCADE * (run.modes.size + 1):
            return Outcome.STUCK, count, cells, clock.time
        clock = later(clock, tau)
        if first < 0 and tau >= remaining:
            if knot <= end:
                clock = Clock(knot, 0.0)
                pass_knots(signals, knot)
                knot = next_knot(signals)
            else:
                clock = Clock(end, 0.0)
        _load(problem, clock, run, terms)
        if first >= 0:
            count, answer = _event(problem, run, system.what[first], clock, log, count)
            if not answer:
                return Outcome.STUCK, count, cells, clock.time
            if count > log.size:
                return Outcome.LOG_FULL, count, cells, clock.time
            changed = True
        elif clock.time >= end:
            return Outcome.COMPLETED, count, cells, clock.time
