"""Events: sticks, slips, reversals, and forces at their limits change the modes of the contacts."""

import math
from typing import NamedTuple

import numpy as np

from wedgebrake.dynamics.enums import EventKind
from wedgebrake.dynamics.jit import compiled, inlined
from wedgebrake.solvers.machine.cells import size, value
from wedgebrake.solvers.machine.complementarity import (
    ROUNDING,
    at_rest_of,
    pattern_of,
    rate,
    solve,
)
from wedgebrake.solvers.machine.modes import GuardKind, bit, slip_row, unlimited_force_row

FLAT = 1 << 10
"""Bit of ``fresh``: slip has begun without a rate, as a holding torque has reached its limit."""
# Relative size of a sliding speed at the start that is rounding.
_AT_START = 1e-14
# Share of the speed of a base beyond which a change is a jump.
_JUMP = 1e-9
# Share of the change of a speed in a cell within which two contacts come to rest together.
_TOGETHER = 1e-13


@compiled
def _limited_force(problem, number, run, side):
    """(actuation force, -1 or 1 if a limit gives it) at the present state."""
    contact, row = problem.contacts[number], run.work.spare
    unlimited_force_row(problem, number, side, run.work, row)
    force = value(row, run.z)
    if contact.lines_forward > 0 or (contact.held >= 0 and contact.lag == 0):
        return force, 0
    if force < contact.lowest:
        return contact.lowest, -1
    if force > contact.highest:
        return contact.highest, 1
    return force, 0


@inlined
def _times(gain, force):
    """Torque by a force; none without a force, also where the brake locks itself."""
    return gain * force if force != 0.0 else 0.0


@compiled
def _load(problem, run, contacts, torque, sizes):
    """Set the torques on the inertias without those of the contacts at rest, and their sizes."""
    n, states, z = problem.inverse.size, problem.states, run.z
    for i in range(n):
        torque[i], sizes[i] = problem.load[i], abs(problem.load[i])
        for k in range(n):
            part, other = problem.stiffness[i, k] * z[0, k], problem.damping[i, k] * z[0, n + k]
            torque[i] -= part + other
            sizes[i] += abs(part) + abs(other)
        for k in range(problem.drive.shape[1]):
            part = problem.drive[i, k] * z[0, states + k]
            torque[i] += part
            sizes[i] += abs(part)
    row = run.work.rows[0]
    for number in range(run.modes.size):
        mode, contact = run.modes[number], problem.contacts[number]
        resting = False
        for one in contacts:
            resting = resting or one == number
        if resting:
            continue
        if contact.lines_forward > 0:
            slip_row(problem, number, mode, run.work, run.work.spare, row)
            push = value(row, z)
        else:
            force, _ = _limited_force(problem, number, run, mode.side)
            push = -_times(contact.forward if mode.side > 0 else contact.backward, force)
        torque[contact.a] += push
        sizes[contact.a] += abs(push)
        if contact.b >= 0:
            torque[contact.b] -= push
            sizes[contact.b] += abs(push)


@compiled
def settle(problem, run, contacts):
    """Decide which of the contacts with zero sliding speed hold, and set their modes.

    contacts : their numbers

    Returns False if there is no answer.
    """
    count = contacts.size
    rest, pattern = at_rest_of(problem, contacts), pattern_of(count)
    scale, limited, at_rest = 0.0, run.limited.any(), np.int64(0)
    torque, sizes = run.torque, run.sizes
    _load(problem, run, contacts, torque, sizes)
    for i in range(count):
        contact = problem.contacts[contacts[i]]
        force, _ = _limited_force(problem, contacts[i], run, at_rest)
        rest.lower[i] = -_times(contact.breakaway_forward, force)
        rest.upper[i] = -_times(contact.breakaway_backward, force)
        rest.forward[i] = -_times(contact.forward, force)
        rest.backward[i] = -_times(contact.backward, force)
        rest.rates[i] = problem.inverse[contact.a] * torque[contact.a]
        size_ = problem.inverse[contact.a] * sizes[contact.a]
        if contact.b >= 0:
            rest.rates[i] -= problem.inverse[contact.b] * torque[contact.b]
            size_ += problem.inverse[contact.b] * sizes[contact.b]
        if contact.base_rate >= 0:
            base = run.z[0, problem.states + contact.base_rate]
            rest.rates[i] -= base
            size_ += abs(base)
        if math.isfinite(rest.lower[i]) and math.isfinite(rest.upper[i]):
            size_ += problem.inverse[contact.a] * max(abs(rest.lower[i]), abs(rest.upper[i]))
        scale = max(scale, size_)
        rest.limited[i] = run.limited[contacts[i]]
        rest.clamped[i] = run.modes[contacts[i]].clamp if limited else 0
    rest.scale[0] = scale
    if count == 1:
        _settle_one(rest, pattern)
    elif not solve(rest, pattern):
        return False
    for i in range(count):
        contact, mode = problem.contacts[contacts[i]], run.modes[contacts[i]]
        mode.side, mode.clamp = pattern.side[i], pattern.clamp[i]
        mode.line = contact.lines_forward if mode.side < 0 else 0
        _, mode.clip = _limited_force(problem, contacts[i], run, mode.side)
        if mode.side != 0:
            if math.isinf(pattern.torque[i]):
                return False
            mode.fresh |= bit(GuardKind.ZERO_SPEED, -1)
            if abs(rate(rest, pattern.torque, i)) <= ROUNDING * scale:
                mode.fresh |= FLAT
    return True


@compiled
def _settle_one(rest, pattern):
    """``solve`` for one contact."""
    needed = -rest.rates[0] / rest.matrix[0, 0]
    room = rest.scale[0] * ROUNDING / rest.matrix[0, 0]
    side = 0
    if rest.limited[0] != 0:
        side = -rest.limited[0]
    elif needed > rest.upper[0] + room:
        side = -1
    elif needed < rest.lower[0] - room:
        side = 1
    pattern.side[0], pattern.torque[0] = side, needed
    if side != 0:
        pattern.torque[0] = rest.forward[0] if side > 0 else rest.backward[0]


@compiled
def _set_line(problem, number, speed, mode):
    """Set the line of the torque of a sliding contact."""
    contact = problem.contacts[number]
    mode.line = 0
    if contact.lines_forward == 0 or mode.side == 0:
        return
    line = 0 if speed > 0.0 else contact.lines_forward
    last = contact.lines_forward + (0 if speed > 0.0 else contact.lines_backward)
    while line + 1 < last and problem.lines[contact.first_line + line + 1].start <= abs(speed):
        line += 1
    mode.line = line


@compiled
def set_sides(run):
    """Set the sides of the contacts by their sliding speeds, at the start."""
    for number in range(run.modes.size):
        row = run.work.sliding[number]
        speed = value(row, run.z)
        at_rest = abs(speed) <= _AT_START * size(row, run.z)
        run.modes[number].side = 0 if at_rest else (1 if speed > 0.0 else -1)


@compiled
def classify(problem, run):
    """Set the modes by the sides of sliding; returns False if there is no answer."""
    count, resting = 0, run.resting
    for number in range(run.modes.size):
        mode = run.modes[number]
        mode.clamp, mode.fresh = 0, 0
        _set_line(problem, number, value(run.work.sliding[number], run.z), mode)
        if mode.side == 0:
            resting[count] = number
            count += 1
        _, mode.clip = _limited_force(problem, number, run, mode.side)
    run.limited[:] = 0
    return count == 0 or settle(problem, run, resting[:count])


@compiled
def follow_bases(problem, run):
    """Set the sides of contacts whose base has changed its speed suddenly.

    Returns whether there are such contacts.
    """
    jumped = False
    for number in range(run.modes.size):
        contact, mode = problem.contacts[number], run.modes[number]
        if contact.base < 0:
            continue
        speed = value(run.work.sliding[number], run.z)
        room = _JUMP * contact.base_bound
        if (mode.side == 0 and abs(speed) > room) or mode.side * speed < -room:
            mode.side = 1 if speed > 0.0 else -1
            jumped = True
    return jumped


@compiled
def settle_arrived(problem, run, cell):
    """Decide what contacts do whose sliding speed has become zero just where a cell ends.

    Returns (whether there are such contacts, whether there is an answer).
    """
    count, arrived = 0, False
    for number in range(run.modes.size):
        mode = run.modes[number]
        if mode.side == 0 or (
            mode.fresh & bit(GuardKind.ZERO_SPEED, -1) == 0
            and _has_arrived(problem, run, number, cell)
        ):
            run.resting[count] = number
            count += 1
            arrived = arrived or mode.side != 0
    run.limited[:] = 0
    return arrived, not arrived or settle(problem, run, run.resting[:count])


@compiled
def sample_controllers(problem, run, time):
    """Let the controllers that are due at a time sample, and set their forces."""
    for number in range(run.modes.size):
        contact, mode = problem.contacts[number], run.modes[number]
        if contact.held < 0 or sample_time(contact, mode) > time:
            continue
        force = contact.initial_force
        if contact.force >= 0:
            force += run.z[0, problem.states + contact.force]
        start = force
        if mode.side != 0:
            force += contact.slope * abs(value(run.work.sliding[number], run.z))
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
        run.z[:, problem.states + contact.held] = 0.0
        run.z[0, problem.states + contact.held] = force


@inlined
def sample_time(contact, mode):
    """Time of the next sampling of a controller."""
    return mode.first_sample + mode.samples * contact.sample_time


@compiled
def next_sampling(problem, modes):
    """Time of the next sampling of all controllers [s]; inf: there is none."""
    nearest = math.inf
    for number in range(modes.size):
        if problem.contacts[number].held >= 0:
            nearest = min(nearest, sample_time(problem.contacts[number], modes[number]))
    return nearest


@compiled
def apply_event(problem, run, what, cell):
    """Change the modes at an event that a guard announces; ``run.before`` receives former sides.

    cell : whose series is in ``run.z``, but for its first terms

    Returns (kind of event, whether there is an answer).
    """
    number, mode, before = what.contact, run.modes[what.contact], run.before
    for other in range(before.size):
        before[other] = run.modes[other].side
    if what.kind == GuardKind.NEXT_LINE:
        mode.line += what.sign
    elif what.kind == GuardKind.FORCE_LIMIT:
        mode.clip += what.sign
    else:
        run.limited[:] = 0
        arrived = number
        if what.kind == GuardKind.HOLDING_LIMIT:
            run.limited[number] = what.sign
            arrived = -1
        count = 0
        for other in range(before.size):
            if (
                run.modes[other].side == 0
                or other == arrived
                or _has_arrived(problem, run, other, cell)
            ):
                run.resting[count] = other
                count += 1
        return EventKind.STICK, settle(problem, run, run.resting[:count])
    mode.fresh |= bit(what.kind, -what.sign)
    return EventKind.BREAKPOINT, True


class Cell(NamedTuple):
    """Length [s] and number of terms of a cell."""

    length: float
    terms: int


@compiled
def _has_arrived(problem, run, number, cell):
    """Return True if the speed of a sliding contact has become zero, up to rounding."""
    z, row = run.z, run.work.sliding[number]
    scale = problem.contacts[number].base_bound
    for j in range(row.size):
        if row[j] != 0.0:
            reach = 0.0
            for k in range(cell.terms - 1, -1, -1):
                reach = reach * cell.length + abs(z[k, j])
            scale += abs(row[j]) * reach
    return abs(value(row, z)) <= _TOGETHER * scale


@inlined
def kind_of(before, after):
    """Kind of the event that changes the side of sliding."""
    if after == 0:
        return EventKind.STICK
    return EventKind.SLIP if before == 0 else EventKind.REVERSAL
