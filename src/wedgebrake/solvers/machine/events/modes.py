"""The linear system of a mode: its matrix and its guards, assembled when it is first entered."""

import math
from enum import IntEnum

import numpy as np

from wedgebrake.dynamics.jit import borrowing, compiled, embedded
from wedgebrake.dynamics.references import by_reference
from wedgebrake.solvers.machine.events.cells import value
from wedgebrake.solvers.machine.events.controllers import (
    add_commands,
    add_controls,
    add_outer_controls,
    control_guards,
    set_control_rates,
)
from wedgebrake.solvers.machine.events.coupled import react
from wedgebrake.solvers.machine.events.pieces import add_outer_pieces, add_pieces, bound_guards
from wedgebrake.solvers.machine.events.reactions import reactions

# Largest product of the length of a cell and the growth of the system or the fastest frequency.
_CELL = 2.0
_DOUBLINGS = 6
JUMP = 1e-9
"""Share of the speed of a base, or of 1 rad/s, beyond which a change is a jump."""
# Share of a row that is rounding.
_DEPENDENT = 1e-9
# Relative size of a factor that is the rounding of terms which cancel.
_CANCELLED = 1e-14
# Key of a system that holds for the present state alone.
NO_KEY = -(1 << 40)


class GuardKind(IntEnum):
    """What a guard watches."""

    ZERO_SPEED = 0
    NEXT_LINE = 1
    FORCE_LIMIT = 2
    HOLDING_LIMIT = 3
    PIECE = 4
    CONTROL = 5


@borrowing
def bit(kind, sign):
    """The bit of a guard among those of its contact."""
    return 1 << (2 * kind + (sign > 0))


@embedded
def _key(mode):
    """A number that differs between modes of a contact with different systems."""
    return 27 * mode.line + 9 * mode.side + 3 * mode.force_limit + mode.clamp


@embedded
def _has_key(modes, places, key):
    """Return True if the key of a system is that of the modes and pieces."""
    same = True
    for number in range(modes.size):
        same = same and _key(modes[number]) == key[number]
    for number in range(places.size):
        same = same and places[number].piece == key[modes.size + number]
    return same


@borrowing
def command_row(problem, run, number, side, row):
    """Set a row to the command of the actuator of a contact, before its lag."""
    contact, states, sliding = problem.contacts[number], problem.states, problem.sliding[number]
    row[:] = 0.0
    if contact.sampled_input >= 0:
        row[states + contact.sampled_input] = 1.0
        return
    if contact.force >= 0:
        row[states + contact.force] = 1.0
    row[-1] = contact.initial_force
    if side != 0 and contact.slope != 0.0:
        for i in range(row.size):
            row[i] += side * contact.slope * sliding[i]
    if contact.commanded != 0:
        add_commands(problem, run, number, row)


@borrowing
def unlimited_force_row(problem, run, number, side, row):
    """Set a row to the normal force of a contact before its limits."""
    contact = problem.contacts[number]
    if contact.lag > 0:
        row[:] = 0.0
        row[contact.state] = 1.0
    else:
        command_row(problem, run, number, side, row)
    if contact.normal >= 0:
        for i in range(row.size):
            row[i] += problem.normals[contact.normal, i]


@embedded
def is_straight(contact):
    """Return True if the torque is a straight line of the sliding speed, force included."""
    return contact.lines_forward > 0 and contact.curve < 0


@borrowing
def _force_row(problem, run, number, row):
    """Set a row to the normal force of a contact."""
    contact, mode = problem.contacts[number], run.modes[number]
    if mode.force_limit != 0:
        row[:] = 0.0
        row[-1] = contact.lowest if mode.force_limit < 0 else contact.highest
    elif (
        mode.side != 0
        and is_straight(contact)
        and problem.lines[contact.first_line + mode.line].released
    ):
        row[:] = 0.0
    else:
        unlimited_force_row(problem, run, number, mode.side, row)


@borrowing
def _scaled(target, factor, row):
    """Set a row to another one times a factor; where the other one is 0, also if it is infinite."""
    for i in range(row.size):
        target[i] = factor * row[i] if row[i] != 0.0 else 0.0


@borrowing
def slip_row(problem, number, mode, force, row):
    """Set a row to the torque of a sliding contact on its first inertia."""
    contact, side = problem.contacts[number], mode.side
    if contact.curve >= 0:
        locked = math.isinf(problem.lines[contact.first_line + mode.line].factors[0])
        row[:] = 0.0
        row[problem.states + contact.curve] = 1.0
        if locked:
            _scaled(row, -side * math.inf, force)
        return
    if contact.lines_forward > 0:
        one = problem.lines[contact.first_line + mode.line]
        for i in range(row.size):
            row[i] = -one.slope * side * problem.sliding[number, i] if one.slope != 0.0 else 0.0
        row[-1] -= one.offset
        return
    _scaled(row, -(contact.forward if side > 0 else contact.backward), force)


@borrowing
def _add_torque(problem, number, row, work):
    """Add the torque of a contact to those on its inertias."""
    contact, torque = problem.contacts[number], work.torque
    for i in range(row.size):
        torque[contact.a, i] += row[i]
    if contact.b >= 0:
        for i in range(row.size):
            torque[contact.b, i] -= contact.ratio * row[i]


@compiled
def select_system(problem, run):
    """Call ``present_system`` from Python."""
    return present_system(by_reference(problem), by_reference(run))


@embedded
def present_system(problem, run):
    """Return the slot of the system of the present modes; assemble it if it is new."""
    modes, places, keys, used = run.modes, run.places, run.systems.keys, run.systems.used
    for slot in range(used[0]):
        if _has_key(modes, places, keys[slot]):
            return slot
    slot = used[0] if used[0] < keys.shape[0] else 0  # all in use: begin anew
    for number in range(modes.size):
        keys[slot, number] = _key(modes[number])
    for number in range(places.size):
        keys[slot, modes.size + number] = places[number].piece
    for stride in run.strides.kinds:
        if stride.slot == slot:
            stride.slot, stride.uses = -1, 0
    if not assemble(problem, run, slot):
        keys[slot, 0] = NO_KEY
    used[0] = slot + 1
    return slot


@borrowing
def assemble(problem, run, slot):
    """Set the linear system and the guards of the present modes in a slot.

    Returns False if it also depends on the present state: contacts at rest that depend on each
    other share a torque by their present limits.
    """
    states, m = problem.states, problem.contacts.size
    work, systems, modes = run.assembly, run.systems, run.modes
    for i in range(problem.inverse.size):
        _scaled(work.torque[i], 1.0, problem.torque[i])
    add_pieces(problem, run, work.torque)
    add_controls(problem, run, work.torque)
    force, contact_rows, rates = systems.force[slot], systems.contact[slot], systems.rates[slot]
    holding = False
    for number in range(m):
        mode, contact, row = modes[number], problem.contacts[number], contact_rows[number]
        _force_row(problem, run, number, force[number])
        if mode.side != 0:
            slip_row(problem, number, mode, force[number], row)
            _add_torque(problem, number, row, work)
            continue
        holding = True
        _scaled(work.upper[number], -contact.breakaway_backward, force[number])
        _scaled(work.lower[number], -contact.breakaway_forward, force[number])
        if mode.clamp != 0:
            _scaled(row, 1.0, work.upper[number] if mode.clamp > 0 else work.lower[number])
            _add_torque(problem, number, row, work)
    if problem.joints.mobility.size > 0:
        unique = _set_coupled(problem, run, slot) == 0
    else:
        _set_groups(problem, modes, systems.lead[slot], systems.base[slot])
        _set_rates(problem, run, slot)
        unique = not holding or _set_reactions(problem, run, slot) == 0
    for number in range(m):
        if problem.contacts[number].lag > 0:
            _lag_rows(problem, run, number, rates)
    set_control_rates(problem, run, slot)
    systems.counts[slot] = _guards(problem, run, work, slot)
    systems.longest[slot] = _longest_cell(rates, states, problem.frequency, work.powers)
    return unique


@borrowing
def _set_groups(problem, modes, lead, base):
    """Set the groups of inertias that contacts at rest join, and the bases that these join."""
    for i in range(lead.size):
        lead[i], base[i] = i, -1
    for number in range(modes.size):
        if modes[number].side == 0:
            join(problem, number, lead, base)


@borrowing
def join(problem, number, lead, base):
    """Join the groups of the inertias of a contact.

    Of several bases, one at rest or at constant speed leads.

    lead, base : (n,) as in ``Systems``
    """
    contacts = problem.contacts
    one, other = lead[contacts[number].a], number
    if contacts[number].b >= 0:
        first, second = lead[contacts[number].a], lead[contacts[number].b]
        one, kept = min(first, second), base[first] if base[first] >= 0 else base[second]
        if base[first] >= 0 and base[second] >= 0 and contacts[base[first]].base_input >= 0:
            kept = base[second]
        other = kept
        for i in range(lead.size):
            if lead[i] == first or lead[i] == second:
                lead[i] = one
    elif base[one] >= 0 and (
        contacts[base[one]].base_input < 0 or contacts[number].base_input >= 0
    ):
        return
    for i in range(lead.size):
        if lead[i] == one:
            base[i] = other


@borrowing
def _set_rates(problem, run, slot):
    """Set the rates of the states; inertias with a common speed have the same row."""
    n, systems, torque = problem.inverse.size, run.systems, run.assembly.torque
    rates, lead, base = systems.rates[slot], systems.lead[slot], systems.base[slot]
    for i in range(n):
        rates[i, :] = 0.0
        rates[i, n + i] = 1.0
        row, inertia, members = rates[n + i], 0.0, 0
        for j in range(n):
            if lead[j] == lead[i]:
                inertia += 1.0 / problem.inverse[j]
                members += 1
        if base[i] >= 0:
            row[:] = 0.0
            if problem.contacts[base[i]].base_rate >= 0:
                row[problem.states + problem.contacts[base[i]].base_rate] = 1.0
        elif members == 1:
            for k in range(row.size):
                row[k] = problem.inverse[i] * torque[i, k]
        elif lead[i] != i:
            _scaled(row, 1.0, rates[n + lead[i]])
        else:
            _set_group_torque(problem, run, slot, i)
            for k in range(row.size):
                row[k] /= inertia
    _set_driven(problem, rates)


@borrowing
def _set_driven(problem, rates):
    """Set the rates of the speeds of driven bodies, which are given."""
    for one in problem.driven:
        row = rates[problem.inverse.size + one.body]
        row[:] = 0.0
        if one.rate >= 0:
            row[problem.states + one.rate] = 1.0


@borrowing
def _set_group_torque(problem, run, slot, first):
    """Set the row of the rate of a speed to the torque on a group of inertias.

    Torques inside the group are left out: they cancel, but not to the last bit.
    """
    n, lead, contact_rows = problem.inverse.size, run.systems.lead[slot], run.systems.contact[slot]
    row = run.systems.rates[slot, n + first]
    row[:] = 0.0
    for i in range(n):
        if lead[i] == first:
            for k in range(row.size):
                row[k] += problem.loads[i, k]
    for one in problem.shafts:
        # Torque stiffness (angle of a - ratio angle of b) on a, and -ratio times it on b.
        outer = one.b >= 0 and lead[one.b] == first
        share = (-1.0 if lead[one.a] == first else 0.0) + (one.ratio if outer else 0.0)
        for at, factor in ((0, one.stiffness), (n, one.damping)):
            row[at + one.a] += share * factor
            if one.b >= 0:
                row[at + one.b] -= share * factor * one.ratio
        if one.preload != 0.0:
            row[row.size - 1] -= share * one.preload
    add_outer_pieces(problem, run, lead, first, row)
    add_outer_controls(problem, run, lead, first, row)
    for number in range(run.modes.size):
        contact = problem.contacts[number]
        outer = contact.b >= 0 and lead[contact.b] == first
        share = (1.0 if lead[contact.a] == first else 0.0) - (1.0 if outer else 0.0)
        if run.modes[number].side != 0 and share != 0.0:
            for k in range(row.size):
                row[k] += share * contact_rows[number, k]


@compiled
def _set_reactions(problem, run, slot):
    """Set the rows of the torques of the contacts that hold; returns the number of loops."""
    n, work, systems, modes = problem.inverse.size, run.assembly, run.systems, run.modes
    free = np.flatnonzero((modes["side"] == 0) & (modes["clamp"] == 0))
    a, b = problem.contacts["a"][free], problem.contacts["b"][free]
    b[b < 0] = n
    need = np.zeros((n + 1, work.torque.shape[1]))
    for i in range(n - problem.driven.size):
        for j in range(need.shape[1]):
            need[i, j] = systems.rates[slot, n + i, j] / problem.inverse[i] - work.torque[i, j]
    capacities, torque = np.empty(free.size), np.empty((free.size, need.shape[1]))
    for i in range(free.size):
        upper, lower = value(work.upper[free[i]], run.z), value(work.lower[free[i]], run.z)
        capacities[i] = max(abs(upper), abs(lower))
    loops = reactions(a, b, capacities, need, torque)
    for i in range(free.size):
        for j in range(need.shape[1]):
            systems.contact[slot, free[i], j] = torque[i, j]
    return loops


@compiled
def _set_coupled(problem, run, slot):
    """Set the rates of the states and the torques of the contacts that hold, with joints.

    Returns the number of these contacts that depend on others.
    """
    n, states, joints, systems = problem.inverse.size, problem.states, problem.joints, run.systems
    torque, rates, modes = run.assembly.torque, systems.rates[slot], run.modes
    width, mobility, sliding = torque.shape[1], joints.mobility, problem.sliding
    held = np.flatnonzero((modes["side"] == 0) & (modes["clamp"] == 0))
    for i in range(n):
        systems.lead[slot, i], systems.base[slot, i] = i, -1
        rates[i, :] = 0.0
        rates[i, n + i] = 1.0
        row = rates[n + i]
        row[:] = 0.0
        for j in range(n):
            if mobility[i, j] != 0.0:
                for k in range(width):
                    row[k] += mobility[i, j] * torque[j, k]
        for one in problem.driven:
            if one.rate >= 0:
                row[states + one.rate] += joints.project[i, one.body]
    pull, gram = np.zeros((held.size, n)), np.zeros((held.size, held.size))
    right, found = np.zeros((held.size, width)), np.empty((held.size, width))
    capacities = np.empty(held.size)
    for at in range(held.size):
        number = held[at]
        set_pull(problem, number, pull[at])
        for other in range(held.size):
            for i in range(n):
                gram[at, other] += pull[at, i] * sliding[held[other], n + i]
        for i in range(n):
            factor = sliding[number, n + i]
            if factor != 0.0:
                for k in range(width):
                    right[at, k] -= factor * rates[n + i, k]
        if problem.contacts[number].base_rate >= 0:
            right[at, states + problem.contacts[number].base_rate] += 1.0
        upper = value(run.assembly.upper[number], run.z)
        capacities[at] = max(abs(upper), abs(value(run.assembly.lower[number], run.z)))
    loops = react(joints.frame[held], gram, capacities, right, found)
    for at in range(held.size):
        for k in range(width):
            systems.contact[slot, held[at], k] = found[at, k]
        for i in range(n):
            if pull[at, i] != 0.0:
                for k in range(width):
                    rates[n + i, k] += pull[at, i] * found[at, k]
    _follow_sticks(problem, run, slot)
    return loops


@borrowing
def set_pull(problem, number, row):
    """Set a row, (n,), to the accelerations of a sliding speed per torque on the bodies."""
    mobility, n = problem.joints.mobility, problem.inverse.size
    for i in range(n):
        row[i] = 0.0
        for j in range(n):
            row[i] += problem.sliding[number, n + j] * mobility[j, i]


@compiled
def _follow_sticks(problem, run, slot):
    """Express the speeds by those that joints and sticks leave free, and their rates likewise."""
    n, states, follow = problem.inverse.size, problem.states, run.systems.follow[slot]
    rates, moving = run.systems.rates[slot], problem.inverse.size - problem.driven.size
    width = follow.shape[1]
    # The part of the rate of each speed that is due to bases and driven bodies.
    given, row, rate = np.zeros((n, width)), np.empty(width), np.empty(width)
    for i in range(n):
        for k in range(width):
            follow[i, k] = 0.0
        for j in range(n):
            follow[i, n + j] = problem.joints.follow[i, j]
    for number in range(run.modes.size):
        if run.modes[number].side != 0:
            continue
        contact, sliding = problem.contacts[number], problem.sliding[number]
        whole = 0.0
        for k in range(width):
            inside = n <= k < 2 * n
            row[k], rate[k] = 0.0 if inside else sliding[k], 0.0
            for i in range(n):
                row[k] += sliding[n + i] * follow[i, k]
                rate[k] += sliding[n + i] * given[i, k]
                whole += abs(sliding[n + i] * follow[i, k]) if inside else 0.0
        if contact.base_rate >= 0:
            rate[states + contact.base_rate] -= 1.0
        at = n
        for k in range(n, n + moving):
            at = k if abs(row[k]) > abs(row[at]) else at
        if abs(row[at]) <= _DEPENDENT * whole:
            continue
        share = row[at]
        for k in range(width):
            row[k], rate[k] = -row[k] / share, -rate[k] / share
        row[at] = 0.0
        for i in range(n):
            factor = follow[i, at]
            if factor != 0.0:
                follow[i, at] = 0.0
                for k in range(width):
                    given[i, k] += factor * rate[k]
                    before = abs(follow[i, k])
                    follow[i, k] += factor * row[k]
                    if abs(follow[i, k]) <= _CANCELLED * before:
                        follow[i, k] = 0.0
    for one in problem.driven:
        if one.rate >= 0:
            given[one.body, states + one.rate] = 1.0
    for i in range(n):
        if follow[i, n + i] == 1.0 and i < moving:
            continue
        target = rates[n + i]
        for k in range(width):
            target[k] = given[i, k]
        for j in range(moving):
            if j != i and follow[i, n + j] != 0.0:
                for k in range(width):
                    target[k] += follow[i, n + j] * rates[n + j, k]
        for one in problem.driven:
            if one.rate >= 0 and one.body != i:
                target[states + one.rate] += follow[i, n + one.body]


@borrowing
def _share_coupled(problem, run, slot, known):
    """``share_speeds`` for a machine with joints, which determine angles too."""
    n, z, follow = problem.inverse.size, run.z, problem.joints.follow
    sticks = known and run.pending[0] < 0
    for i in range(n):
        angle, speed = 0.0, 0.0
        for j in range(n):
            if follow[i, j] != 0.0:
                angle += follow[i, j] * z[j, 0]
                speed += follow[i, j] * z[n + j, 0]
        z[i, 0] = angle
        z[n + i, 0] = value(run.systems.follow[slot, i], z) if sticks else speed


@borrowing
def share_speeds(problem, run, slot, known):
    """Set the speeds of driven bodies, and remove rounding from those that contacts at rest join.

    The speeds of driven bodies may jump.

    known : whether the slot is that of the last cell; False: there has been none
    """
    n, z, lead, base = problem.inverse.size, run.z, run.systems.lead[slot], run.systems.base[slot]
    if problem.presence.given:
        for one in problem.driven:
            z[n + one.body, 0] = z[problem.states + one.input, 0] if one.input >= 0 else one.speed
        if problem.joints.mobility.size > 0:
            _share_coupled(problem, run, slot, known)
            return
    for i in range(n if known else 0):
        if base[i] >= 0 and problem.contacts[base[i]].base_input >= 0:
            contact = problem.contacts[base[i]]
            speed = z[problem.states + contact.base_input, 0]
            if abs(z[n + i, 0] - speed) <= JUMP * contact.base_bound:
                z[n + i, 0] = speed
        elif lead[i] != i:
            z[n + i, 0] = z[n + lead[i], 0]


@borrowing
def _lag_rows(problem, run, number, rates):
    """Set the rates of the states of an actuator with a lag."""
    contact, side = problem.contacts[number], run.modes[number].side
    for place in range(contact.lag):
        row, factor = rates[contact.state + place], contact.lag_command[place]
        command_row(problem, run, number, side, row)
        for i in range(row.size):
            row[i] *= factor
        for i in range(contact.lag):
            row[contact.state + i] += contact.lag_rates[place, i]


@borrowing
def _square(matrix, count, result):
    """Store the square of a matrix."""
    for i in range(count):
        for j in range(count):
            total = 0.0
            for k in range(count):
                total += matrix[i, k] * matrix[k, j]
            result[i, j] = total


@borrowing
def _longest_cell(rates, states, frequency, matrix):
    """Longest cell, from the growth of Taylor coefficients and the fastest signal.

    matrix : (2, states, states) workspace
    """
    for i in range(states):
        for j in range(states):
            matrix[0, i, j] = abs(rates[i, j])
    return cell_for(max(growth(matrix, states), frequency))


@embedded
def cell_for(growth):
    """Longest cell for a growth of Taylor coefficients [1/s]."""
    return _CELL / growth if growth > 0.0 else math.inf


@borrowing
def growth(matrix, states):
    """Bound of the growth of the Taylor coefficients of the states.

    The coefficients grow at most like the powers of the matrix of sizes, whose growth is its
    largest eigenvalue. The 64th root of the largest row sum of its 64th power bounds it.

    matrix : (2, states, states), the first is the matrix of sizes, and both are overwritten
    """
    here, other, exponent = matrix[0], matrix[1], 0.0
    for doubling in range(_DOUBLINGS + 1):
        largest = 0.0
        for i in range(states):
            total = 0.0
            for j in range(states):
                total += here[i, j]
            largest = max(largest, total)
        if largest == 0.0:
            break
        exponent = 2.0 * exponent if doubling > 0 else 0.0
        exponent += math.log(largest)
        for i in range(states):
            for j in range(states):
                here[i, j] /= largest
        if doubling < _DOUBLINGS:
            _square(here, states, other)
            here, other = other, here
    return math.exp(exponent / 2.0**_DOUBLINGS) if largest > 0.0 else 0.0


@borrowing
def _guards(problem, run, work, slot):
    """Set the guards of the present modes; returns their number."""
    count, systems = np.int64(0), run.systems
    rows, what = systems.guards[slot], systems.what[slot]
    for number in range(problem.contacts.size):
        contact, mode = problem.contacts[number], run.modes[number]
        if mode.side != 0:
            count = _speed_guards(problem, number, mode, rows, what, count)
        elif mode.clamp == 0 and not mode.imposed:
            torque = systems.contact[slot, number]
            count = _holding_guards(work, number, torque, rows, what, count)
        if not is_straight(contact) and (contact.sampled_input < 0 or contact.lag > 0):
            count = _force_guards(problem, run, number, rows, what, count)
    count = bound_guards(problem, run, GuardKind.PIECE, rows, what, count)
    return control_guards(problem, run, slot, GuardKind.CONTROL, count)


@borrowing
def _speed_guards(problem, number, mode, rows, what, count):
    """Set the guards of the sliding speed of a contact; returns the number of guards."""
    contact, low, high = problem.contacts[number], 0.0, math.inf
    if contact.lines_forward > 0:
        last = contact.lines_forward + (contact.lines_backward if mode.side < 0 else 0)
        low = problem.lines[contact.first_line + mode.line].start
        if mode.line + 1 < last:
            high = problem.lines[contact.first_line + mode.line + 1].start
    speed = problem.sliding[number]
    if low > 0.0 or not mode.imposed:
        kind = GuardKind.NEXT_LINE if low > 0.0 else GuardKind.ZERO_SPEED
        _guard(rows[count], what[count], number, kind, -1, mode.side, speed, low)
        count += 1
    if high < math.inf:
        kind = GuardKind.NEXT_LINE
        _guard(rows[count], what[count], number, kind, 1, -mode.side, speed, -high)
        count += 1
    return count


@borrowing
def _holding_guards(work, number, torque, rows, what, count):
    """Set the guards of the torque of a contact at rest; returns the number of guards."""
    for sign in (1, -1):
        limit = work.upper[number] if sign > 0 else work.lower[number]
        if _is_finite(limit):
            row = rows[count]
            _guard(row, what[count], number, GuardKind.HOLDING_LIMIT, sign, -sign, torque, 0.0)
            for i in range(row.size):
                row[i] += sign * limit[i]
            count += 1
    return count


@borrowing
def _force_guards(problem, run, number, rows, what, count):
    """Set the guards of the force of a contact before its limits; returns the number of guards.

    Between the limits, its distances from both; at a limit, its distance beyond this one.
    """
    contact, mode, row = problem.contacts[number], run.modes[number], run.spare
    kind = GuardKind.FORCE_LIMIT
    unlimited_force_row(problem, run, number, mode.side, row)
    if not _varies(row):
        return count
    for sign in (-1, 1):
        limit = contact.lowest if sign < 0 else contact.highest
        if math.isinf(limit) or (mode.force_limit != 0 and mode.force_limit != sign):
            continue
        crossing = sign if mode.force_limit == 0 else -sign
        _guard(rows[count], what[count], number, kind, crossing, -crossing, row, -crossing * limit)
        count += 1
    return count


@borrowing
def _is_finite(row):
    """Return True if all entries of a row are finite."""
    finite = True
    for entry in row:
        finite = finite and math.isfinite(entry)
    return finite


@borrowing
def _varies(row):
    """Return True if a row is not a constant."""
    varies = False
    for j in range(row.size - 1):
        varies = varies or row[j] != 0.0
    return varies


@borrowing
def _guard(guard, what, number, kind, sign, factor, row, offset):
    """Set the guard factor row - offset >= 0."""
    for i in range(row.size):
        guard[i] = factor * row[i]
    guard[-1] -= offset
    what.contact, what.kind, what.sign = number, kind, sign
