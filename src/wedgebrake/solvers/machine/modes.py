"""The linear system of a mode: its matrix and its guards, assembled when it is entered."""

import math
from enum import IntEnum
from typing import Any, NamedTuple

from wedgebrake.dynamics.jit import compiled

# Relative size below which a pivot is zero: the contacts at rest depend on each other.
_SINGULAR = 1e-10


class GuardKind(IntEnum):
    """What a guard watches."""

    ZERO_SPEED = 0
    NEXT_LINE = 1
    FORCE_LIMIT = 2
    HOLDING_LIMIT = 3


@compiled
def bit(kind, sign):
    """The bit of a guard among those of its contact."""
    return 1 << (2 * kind + (sign > 0))


class System(NamedTuple):
    """The linear system of a mode, in workspace.

    torque      : (n, z) torque on each inertia
    rates       : (states, z) x' = rates z
    sliding     : (m, z) sliding speeds
    acceleration: (m, z) their rates
    force       : (m, z) actuation force
    contact     : (m, z) torque of each contact on its first inertia
    upper, lower: (m, z) largest and smallest torque of each contact at rest
    guards      : (most, z) with ``what``, of dtype ``GUARD``; ``counts[0]`` of them
    spare       : (z,) workspace
    """

    torque: Any
    rates: Any
    sliding: Any
    acceleration: Any
    force: Any
    contact: Any
    upper: Any
    lower: Any
    guards: Any
    what: Any
    counts: Any
    spare: Any


@compiled
def command_row(problem, number, mode, system, row):
    """Set a row to the command of the actuator, before its lag."""
    contact = problem.contacts[number]
    row[:] = 0.0
    if contact.sample_time > 0.0:
        row[-1] = mode.held
        return
    row[problem.states + contact.force] = 1.0
    if mode.side != 0 and contact.slope != 0.0:
        for i in range(row.size):
            row[i] += mode.side * contact.slope * system.sliding[number, i]


@compiled
def _force_row(problem, number, mode, system):
    """Set the row of the actuation force of a contact."""
    contact, row = problem.contacts[number], system.force[number]
    if mode.clip != 0:
        row[:] = 0.0
        row[-1] = contact.lowest if mode.clip < 0 else contact.highest
    elif contact.lag > 0:
        row[:] = 0.0
        row[contact.state] = 1.0
    else:
        command_row(problem, number, mode, system, row)


@compiled
def _scaled(target, factor, row):
    """Set a row to another one times a factor; an infinite one only where it presses."""
    for i in range(row.size):
        target[i] = factor * row[i] if row[i] != 0.0 else 0.0


@compiled
def slip_row(problem, number, side, line, system, row):
    """Set a row to the torque of a sliding contact on its first inertia."""
    contact = problem.contacts[number]
    if contact.lines > 0:
        one = problem.lines[contact.first_line + line]
        for i in range(row.size):
            row[i] = -one.slope * side * system.sliding[number, i]
        row[-1] -= one.offset
        return
    _scaled(row, -(contact.forward if side > 0 else contact.backward), system.force[number])


@compiled
def speed_rows(problem, system):
    """Set the rows of the sliding speeds; they are the same in all modes."""
    n, states = problem.inverse.size, problem.states
    system.sliding[:] = 0.0
    for number in range(problem.contacts.size):
        contact = problem.contacts[number]
        system.sliding[number, n + contact.a] = 1.0
        if contact.b >= 0:
            system.sliding[number, n + contact.b] = -1.0
        if contact.base >= 0:
            system.sliding[number, states + contact.base] = -1.0


@compiled
def add_torque(problem, number, row, system):
    """Add the torque of a contact to those on its inertias."""
    contact = problem.contacts[number]
    for i in range(row.size):
        system.torque[contact.a, i] += row[i]
    if contact.b >= 0:
        for i in range(row.size):
            system.torque[contact.b, i] -= row[i]


@compiled
def free_torques(problem, system):
    """Set the torques on the inertias without the contacts."""
    n, states = problem.inverse.size, problem.states
    for i in range(n):
        for k in range(n):
            system.torque[i, k] = -problem.stiffness[i, k]
            system.torque[i, n + k] = -problem.damping[i, k]
        for k in range(2 * n, states):
            system.torque[i, k] = 0.0
        for k in range(problem.drive.shape[1]):
            system.torque[i, states + k] = problem.drive[i, k]
        system.torque[i, -1] = 0.0


@compiled
def acceleration_row(problem, number, system):
    """Set the row of the rate of a sliding speed, from the torques."""
    contact, row = problem.contacts[number], system.acceleration[number]
    for i in range(row.size):
        row[i] = problem.inverse[contact.a] * system.torque[contact.a, i]
        if contact.b >= 0:
            row[i] -= problem.inverse[contact.b] * system.torque[contact.b, i]
    if contact.base >= 0:
        row[problem.states + contact.base_rate] -= 1.0


@compiled
def compliance(problem, one, other):
    """Rate of a sliding speed per torque of another contact: an entry of W' M^-1 W."""
    left, right = problem.contacts[one], problem.contacts[other]
    total = 0.0
    if left.a == right.a:
        total += problem.inverse[left.a]
    if left.b >= 0 and left.b == right.b:
        total += problem.inverse[left.b]
    if left.a == right.b:
        total -= problem.inverse[left.a]
    if left.b >= 0 and left.b == right.a:
        total -= problem.inverse[left.b]
    return total


@compiled
def eliminate(matrix, rows, count):
    """Solve matrix x = rows in place, symmetric and positive; a contact that depends gets nothing.

    matrix : (count, count + 1), its diagonal again in the last column;  rows : (count, z)

    Returns the number of independent ones.
    """
    rank = 0
    for i in range(count):
        largest = abs(matrix[i, i])
        # Diagonal entries shrink to rounding where the row depends on the former ones.
        if largest <= _SINGULAR * matrix[i, count]:
            matrix[i, i] = 0.0
            continue
        rank += 1
        for k in range(i + 1, count):
            factor = matrix[k, i] / matrix[i, i]
            if factor != 0.0:
                for j in range(i, count):
                    matrix[k, j] -= factor * matrix[i, j]
                for j in range(rows.shape[1]):
                    rows[k, j] -= factor * rows[i, j]
    for i in range(count - 1, -1, -1):
        if matrix[i, i] == 0.0:
            rows[i, :] = 0.0
            continue
        for k in range(i + 1, count):
            if matrix[i, k] != 0.0:
                for j in range(rows.shape[1]):
                    rows[i, j] -= matrix[i, k] * rows[k, j]
        for j in range(rows.shape[1]):
            rows[i, j] /= matrix[i, i]
    return rank


@compiled
def assemble(problem, modes, system, work):
    """Set the linear system and the guards of a mode.

    work : (matrix (m, m + 1), rows (m, z), numbers (m,)) for the contacts at rest
    """
    matrix, rows, numbers = work
    n, states, m = problem.inverse.size, problem.states, problem.contacts.size
    free_torques(problem, system)
    held = 0
    for number in range(m):
        mode, contact = modes[number], problem.contacts[number]
        _force_row(problem, number, mode, system)
        row = system.contact[number]
        if mode.side != 0:
            slip_row(problem, number, mode.side, mode.line, system, row)
            add_torque(problem, number, row, system)
            continue
        _scaled(system.upper[number], -contact.breakaway_backward, system.force[number])
        _scaled(system.lower[number], -contact.breakaway_forward, system.force[number])
        if mode.clamp != 0:
            limit = system.upper[number] if mode.clamp > 0 else system.lower[number]
            row[:] = limit
            add_torque(problem, number, row, system)
        else:
            numbers[held] = number
            held += 1
    for i in range(held):
        acceleration_row(problem, numbers[i], system)
        rows[i, :] = -system.acceleration[numbers[i]]
        for k in range(held):
            matrix[i, k] = compliance(problem, numbers[i], numbers[k])
        matrix[i, held] = matrix[i, i]
    if held == 1:
        for k in range(rows.shape[1]):
            rows[0, k] /= matrix[0, 0]
    elif held > 1:
        eliminate(matrix, rows, held)
    for i in range(held):
        system.contact[numbers[i], :] = rows[i]
        add_torque(problem, numbers[i], rows[i], system)
    for i in range(n):
        system.rates[i, :] = 0.0
        system.rates[i, n + i] = 1.0
        for k in range(system.torque.shape[1]):
            system.rates[n + i, k] = problem.inverse[i] * system.torque[i, k]
    for number in range(m):
        if problem.contacts[number].lag > 0:
            _lag_rows(problem, number, modes[number], system)
    _guards(problem, modes, system)


@compiled
def _lag_rows(problem, number, mode, system):
    """Set the rates of the states of an actuator with a lag."""
    contact = problem.contacts[number]
    row = system.rates[contact.state]
    if contact.lag == 1:
        command_row(problem, number, mode, system, row)
        row[contact.state] -= 1.0
        for i in range(row.size):
            row[i] /= contact.lag_time
        return
    row[:] = 0.0
    row[contact.state + 1] = 1.0
    second = system.rates[contact.state + 1]
    command_row(problem, number, mode, system, second)
    second[contact.state] -= 1.0
    for i in range(second.size):
        second[i] *= contact.lag_frequency * contact.lag_frequency
    second[contact.state + 1] -= 2.0 * contact.lag_damping * contact.lag_frequency


@compiled
def _guards(problem, modes, system):
    """Set the guards of a mode."""
    count = 0
    for number in range(problem.contacts.size):
        contact, mode = problem.contacts[number], modes[number]
        if mode.side != 0:
            low, high = 0.0, math.inf
            if contact.lines > 0:
                last = contact.lines_forward if mode.side > 0 else contact.lines
                low = problem.lines[contact.first_line + mode.line].start
                if mode.line + 1 < last:
                    high = problem.lines[contact.first_line + mode.line + 1].start
            kind = GuardKind.NEXT_LINE if low > 0.0 else GuardKind.ZERO_SPEED
            count = _guard(system, count, number, kind, -1, mode.side, system.sliding[number], low)
            if high < math.inf:
                count = _guard(
                    system, count, number, GuardKind.NEXT_LINE, 1, -mode.side,
                    system.sliding[number], -high,
                )  # fmt: skip
        elif mode.clamp == 0:
            torque = system.contact[number]
            if not math.isinf(system.upper[number, -1]) and contact.breakaway_backward > -math.inf:
                count = _difference(system, count, number, 1, system.upper[number], torque)
            if contact.breakaway_forward < math.inf:
                count = _difference(system, count, number, -1, torque, system.lower[number])
        if contact.lines > 0 or contact.sample_time > 0.0 and contact.lag == 0:
            continue
        count = _limits(problem, number, mode, system, count)
    system.counts[0] = count


@compiled
def _guard(system, count, number, kind, sign, factor, row, offset):
    """Add the guard factor row - offset >= 0."""
    guard = system.guards[count]
    for i in range(row.size):
        guard[i] = factor * row[i]
    guard[-1] -= offset
    what = system.what[count]
    what.contact, what.kind, what.sign = number, kind, sign
    return count + 1


@compiled
def _difference(system, count, number, sign, above, below):
    """Add the guard above - below >= 0 of a holding torque."""
    guard = system.guards[count]
    for i in range(above.size):
        guard[i] = above[i] - below[i]
    what = system.what[count]
    what.contact, what.kind, what.sign = number, GuardKind.HOLDING_LIMIT, sign
    return count + 1


@compiled
def _limits(problem, number, mode, system, count):
    """Add the guards of the limits of the actuation force, on what it would be without them."""
    contact, row = problem.contacts[number], system.spare
    if contact.lag > 0:
        row[:] = 0.0
        row[contact.state] = 1.0
    else:
        command_row(problem, number, mode, system, row)
    kind = GuardKind.FORCE_LIMIT
    if mode.clip == 0:
        if contact.lowest > -math.inf:
            count = _guard(system, count, number, kind, -1, 1.0, row, contact.lowest)
        if contact.highest < math.inf:
            count = _guard(system, count, number, kind, 1, -1.0, row, -contact.highest)
    elif mode.clip < 0:
        count = _guard(system, count, number, kind, 1, -1.0, row, -contact.lowest)
    else:
        count = _guard(system, count, number, kind, -1, 1.0, row, contact.highest)
    return count
