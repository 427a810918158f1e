"""Events: sticks, slips, reversals, and forces at their limits change the modes of the contacts."""

import math

import numpy as np

from wedgebrake.dynamics.enums import EventKind
from wedgebrake.dynamics.jit import borrowing, embedded
from wedgebrake.solvers.machine.events.arrivals import add_held, arrives_too
from wedgebrake.solvers.machine.events.cells import size, value
from wedgebrake.solvers.machine.events.complementarity import (
    ROUNDING,
    rate,
    solve,
)
from wedgebrake.solvers.machine.events.curves import curve_gain
from wedgebrake.solvers.machine.events.modes import (
    GuardKind,
    bit,
    compliance,
    is_straight,
    slip_row,
    unlimited_force_row,
)
from wedgebrake.solvers.machine.problem import Complementarity

FLAT = 1 << 10
"""Bit of ``fresh``: slip has begun without a rate, as a holding torque has reached its limit."""
# Relative size of a sliding speed at the start that is rounding.
_AT_START = 1e-14
# Relative distance from the end of a line of a speed that is there.
_AT_LINE = 1e-9
# Share of the speed of a base, or of 1 rad/s, beyond which a change is a jump.
_JUMP = 1e-9


@embedded
def limited_force(problem, number, run, side):
    """The actuation force in the present state, and -1 or 1 if it is at a limit, otherwise 0."""
    contact, row = problem.contacts[number], run.spare
    unlimited_force_row(contact, problem.states, problem.sliding[number], side, row)
    force = value(row, run.z)
    if is_straight(contact) or (contact.sampled_input >= 0 and contact.lag == 0):
        return force, 0
    if force < contact.lowest:
        return contact.lowest, -1
    if force > contact.highest:
        return contact.highest, 1
    return force, 0


@embedded
def _times(gain, force):
    """Torque by a force; none without a force, also where the brake locks itself."""
    return gain * force if force != 0.0 else 0.0


@embedded
def _load(problem, run, contacts):
    """Set ``run.load`` for the inertias of the given contacts at rest."""
    z, row, load = run.z, run.spare, run.load
    for number in contacts:
        contact = problem.contacts[number]
        _free_torque(problem, z, contact.a, load)
        if contact.b >= 0:
            _free_torque(problem, z, contact.b, load)
    pending = 0
    for number in range(run.modes.size):
        if pending < contacts.size and contacts[pending] == number:
            pending += 1
            continue
        mode, contact = run.modes[number], problem.contacts[number]
        if is_straight(contact):
            slip_row(problem, number, mode, row, row)
            push = value(row, z)
        else:
            force, _ = limited_force(problem, number, run, mode.side)
            gain = contact.forward if mode.side > 0 else contact.backward
            if contact.curve >= 0:
                gain = curve_gain(problem, number, mode, value(problem.sliding[number], z))
            push = -_times(gain, force)
        load[0, contact.a] += push
        load[1, contact.a] += abs(push)
        if contact.b >= 0:
            load[0, contact.b] -= push
            load[1, contact.b] += abs(push)


@embedded
def _free_torque(problem, z, i, load):
    """Set the torque on an inertia without those of its contacts, and the sum of its magnitudes."""
    row = problem.torque[i]
    load[0, i], load[1, i] = value(row, z), size(row, z)


@embedded
def settle(problem, run):
    """Decide which of the contacts with zero sliding speed hold, and set their modes.

    These contacts are the pending ones of ``run.resting``, in ascending order. Returns False if no
    pattern is consistent.
    """
    count = run.pending[0]
    contacts = run.resting[:count]
    lcp = Complementarity(run.lcp.contacts[:count], run.lcp.matrix, run.lcp.scale)
    pattern = run.pattern[:count]
    _describe(problem, run, contacts, lcp)
    for one in pattern:
        one.clamp = 0
    if count == 1:
        _settle_one(lcp, pattern)
    elif not solve(lcp, pattern):
        # A contact whose torque has just reached its limit must slip, unless others relieve it. If
        # a contact that comes to rest at this instant lowers that torque, it may hold after all.
        for one in lcp.contacts:
            one.at_holding_limit = 0
        if not solve(lcp, pattern):
            return False
    for i in range(count):
        contact, mode = problem.contacts[contacts[i]], run.modes[contacts[i]]
        mode.side, mode.clamp = pattern[i].side, pattern[i].clamp
        mode.line = contact.lines_forward if mode.side < 0 else 0
        _, mode.force_limit = limited_force(problem, contacts[i], run, mode.side)
        if mode.side != 0:
            if math.isinf(pattern[i].torque):
                return False
            mode.fresh |= bit(GuardKind.ZERO_SPEED, -1)
            if abs(rate(lcp, pattern, i)) <= ROUNDING * lcp.scale[0]:
                mode.fresh |= FLAT
    return True


@embedded
def _describe(problem, run, contacts, lcp):
    """Set the data of the contacts at rest."""
    scale, at_rest, limited = 0.0, np.int64(0), False
    for number in contacts:
        limited = limited or run.modes[number].at_holding_limit != 0
    _load(problem, run, contacts)
    torque, sizes = run.load[0], run.load[1]
    for i in range(contacts.size):
        contact = problem.contacts[contacts[i]]
        force, _ = limited_force(problem, contacts[i], run, at_rest)
        one = lcp.contacts[i]
        one.a, one.b = contact.a, contact.b if contact.b >= 0 else problem.inverse.size
        for k in range(contacts.size):
            lcp.matrix[i, k] = compliance(problem, contacts[i], contacts[k])
        one.lower = -_times(contact.breakaway_forward, force)
        one.upper = -_times(contact.breakaway_backward, force)
        one.forward = -_times(contact.forward, force)
        one.backward = -_times(contact.backward, force)
        one.rate = problem.inverse[contact.a] * torque[contact.a]
        size_ = problem.inverse[contact.a] * sizes[contact.a]
        if contact.b >= 0:
            one.rate -= problem.inverse[contact.b] * torque[contact.b]
            size_ += problem.inverse[contact.b] * sizes[contact.b]
        if contact.base_rate >= 0:
            base = run.z[problem.states + contact.base_rate, 0]
            one.rate -= base
            size_ += abs(base)
        if math.isfinite(one.lower) and math.isfinite(one.upper):
            size_ += problem.inverse[contact.a] * max(abs(one.lower), abs(one.upper))
        scale = max(scale, size_)
        one.at_holding_limit = run.modes[contacts[i]].at_holding_limit
        one.clamped = run.modes[contacts[i]].clamp if limited else 0
    lcp.scale[0] = scale


@embedded
def _settle_one(lcp, pattern):
    """``solve`` for one contact."""
    one = lcp.contacts[0]
    needed = -one.rate / lcp.matrix[0, 0]
    tolerance = lcp.scale[0] * ROUNDING / lcp.matrix[0, 0]
    side = 0
    if one.at_holding_limit != 0:
        side = -one.at_holding_limit
    elif needed > one.upper + tolerance:
        side = -1
    elif needed < one.lower - tolerance:
        side = 1
    pattern[0].side, pattern[0].torque = side, needed
    if side != 0:
        pattern[0].torque = one.forward if side > 0 else one.backward


@borrowing
def _set_line(problem, number, speed, mode):
    """Set the line of the torque of a sliding contact."""
    contact = problem.contacts[number]
    mode.line = 0
    if contact.lines_forward == 0 or mode.side == 0:
        return
    line, last = _lines_of(contact, 1 if speed > 0.0 else -1)
    while line + 1 < last and problem.lines[contact.first_line + line + 1].start <= abs(speed):
        line += 1
    mode.line = line


@borrowing
def check_lines(problem, run):
    """Set the lines of sliding contacts anew where they do not belong to their speeds.

    At a restart: the lines of another table, or of another method, may be others.
    """
    for number in range(run.modes.size):
        contact, mode = problem.contacts[number], run.modes[number]
        if contact.lines_forward == 0 or mode.side == 0:
            continue
        speed, first = value(problem.sliding[number], run.z), contact.first_line
        begin, end = _lines_of(contact, mode.side)
        low, high = 0.0, math.inf
        if begin <= mode.line < end:
            low = problem.lines[first + mode.line].start
            high = problem.lines[first + mode.line + 1].start if mode.line + 1 < end else math.inf
        if not (begin <= mode.line < end and _is_about(low, high, abs(speed))):
            _set_line(problem, number, mode.side * abs(speed), mode)


@embedded
def _lines_of(contact, side):
    """First line of a direction of sliding, and the line after its last one."""
    if side > 0:
        return 0, contact.lines_forward
    return contact.lines_forward, contact.lines_forward + contact.lines_backward


@embedded
def _is_about(low, high, speed):
    """Return True if a speed is between two others, up to rounding."""
    return low * (1.0 - _AT_LINE) <= speed <= high * (1.0 + _AT_LINE)


@borrowing
def set_sides(problem, run):
    """Set the sides of the contacts by their sliding speeds, at the start."""
    for number in range(run.modes.size):
        row = problem.sliding[number]
        speed = value(row, run.z)
        at_rest = abs(speed) <= _AT_START * size(row, run.z)
        run.modes[number].side = 0 if at_rest else (1 if speed > 0.0 else -1)


@borrowing
def classify(problem, run):
    """Set the modes by the sides of sliding; ``settle`` has to follow."""
    count = 0
    for number in range(run.modes.size):
        mode = run.modes[number]
        mode.clamp, mode.fresh, mode.at_holding_limit = 0, 0, 0
        _set_line(problem, number, value(problem.sliding[number], run.z), mode)
        if mode.side == 0:
            run.resting[count] = number
            count += 1
        _, mode.force_limit = limited_force(problem, number, run, mode.side)
    run.pending[0] = count


@borrowing
def follow_bases(problem, run, restarts):
    """Set the sides of contacts whose base has changed its speed suddenly.

    restarts : whether the run restarts, perhaps with another constant speed of a base

    Returns whether there are such contacts.
    """
    jumped = False
    for number in range(run.modes.size):
        contact, mode = problem.contacts[number], run.modes[number]
        constant = contact.base_input < 0
        if constant and (contact.b >= 0 or not restarts):
            continue
        speed = value(problem.sliding[number], run.z)
        # At rest on the ground the speed is rounding too.
        tolerance = _JUMP * max(contact.base_bound, 1.0 if constant else 0.0)
        if (mode.side == 0 and abs(speed) > tolerance) or mode.side * speed < -tolerance:
            mode.side = 1 if speed > 0.0 else -1
            jumped = True
    return jumped


@borrowing
def sample_controllers(problem, run, time):
    """Let the controllers that are due at a time sample, and set their forces."""
    for number in range(run.modes.size):
        contact, mode = problem.contacts[number], run.modes[number]
        if contact.sampled_input < 0 or next_sample_at(contact, mode) > time:
            continue
        force = contact.initial_force
        if contact.force >= 0:
            force += run.z[problem.states + contact.force, 0]
        start = force
        if mode.side != 0:
            force += contact.slope * abs(value(problem.sliding[number], run.z))
        if contact.resolution > 0.0:
            force = contact.resolution * round(force / contact.resolution)
        queue, places = run.queues[number], contact.delay + 1
        if mode.samples == 0:
            queue[:] = start
        queue[mode.samples % places] = force
        mode.samples += 1
        force = queue[mode.samples % places]
        if contact.lag == 0:
            force = min(max(force, contact.lowest), contact.highest)
        run.z[problem.states + contact.sampled_input] = 0.0
        run.z[problem.states + contact.sampled_input, 0] = force


@embedded
def next_sample_at(contact, mode):
    """Time of the next sampling of a controller."""
    return mode.first_sample + mode.samples * contact.sample_time


@borrowing
def next_sampling(problem, modes):
    """Time of the next sampling of all controllers [s]; inf: there is none."""
    nearest = math.inf
    for number in range(modes.size):
        if problem.contacts[number].sampled_input >= 0:
            nearest = min(nearest, next_sample_at(problem.contacts[number], modes[number]))
    return nearest


@embedded
def apply_event(problem, run, what, cell, jumped):
    """Change the modes at an event detected by a guard; ``settle`` must be called next.

    cell   : the cell of the event; ``run.z`` contains its series, except for the initial values
    jumped : whether the condition has jumped beyond zero

    Returns True if the brake torque has a kink, False if it is smooth or if a contact may come to
    rest or leave it.
    """
    number, modes = what.contact, run.modes
    mode = modes[number]
    mode.at_holding_limit = 0
    run.pending[0] = 0
    if what.kind in (GuardKind.NEXT_LINE, GuardKind.FORCE_LIMIT):
        mode.fresh |= bit(what.kind, -what.sign)
        if what.kind == GuardKind.FORCE_LIMIT:
            mode.force_limit += what.sign
            return True
        later = mode.line + max(what.sign, 0)
        mode.line += what.sign
        return bool(problem.lines[problem.contacts[number].first_line + later].bends)
    for one in modes:
        one.at_holding_limit = 0
    arrived = number
    if what.kind == GuardKind.HOLDING_LIMIT:
        # Where the torque has jumped beyond its limit, others may be beyond theirs too.
        mode.at_holding_limit, arrived = 0 if jumped else what.sign, -1
    count = 0
    for other in range(modes.size):
        at_rest = modes[other].side == 0 or other == arrived
        if at_rest or arrives_too(problem, run, other, cell):
            run.resting[count] = other
            count += 1
    run.pending[0] = add_held(problem, run, count)
    return False


@embedded
def kind_of(before, after):
    """Kind of the event that changes the side of sliding."""
    if after == 0:
        return EventKind.STICK
    return EventKind.SLIP if before == 0 else EventKind.REVERSAL
