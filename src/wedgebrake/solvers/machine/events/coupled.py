"""Contacts at rest of a machine with joints: their torques act on each other's sliding speeds.

The torques t of the contacts act on the accelerations v' of their sliding speeds by a symmetric
matrix G: v' = G t + d. Each contact holds (v' = 0) with a torque within its limits, or slips with
the torque of one limit. These are the optimality conditions of a convex problem: the minimum of
1/2 t'G t + d't within the limits. It is small, and solved by an active-set method that changes the
set by one contact at a time (Nocedal and Wright, Numerical Optimization, section 16.5). G is
singular if the sliding speeds of some contacts depend linearly on those of others. Which ones do
follows from the speeds that joints leave free, not from the inertias.
"""

import math
from typing import Any, NamedTuple

import numpy as np

from wedgebrake.dynamics.jit import borrowing, compiled
from wedgebrake.solvers.machine.events.reactions import (
    descending,
    eliminate,
    pass_around,
    weights_of,
)

# Relative size of what is left of a row without its parts along other rows, if it is rounding.
_DEPENDENT = 1e-9
# Relative rounding of accelerations by the torques of the contacts themselves.
_OWN = 1e-14
# Changes of the active set per contact, after which the first contact that may leave it is taken,
# not the worst one: this excludes cycles.
_CHANGES = 20


class Coupling(NamedTuple):
    """Contacts at rest, and how their torques act on their sliding speeds.

    contacts : (count,) of dtype ``AT_REST``
    frame    : (count, f) rows of the sliding speeds, see ``Joints``
    gram     : (count, count) accelerations of the sliding speeds per torque
    drift    : (count,) these accelerations without the torques
    pull     : (count, n) accelerations of the sliding speeds per torque on the bodies
    sliding  : (count, n) factors of the speeds of the bodies in the sliding speeds
    errors   : (n,) rounding of the torques on the bodies
    noise    : (count,) rounding of the accelerations due to other causes
    """

    contacts: Any
    frame: Any
    gram: Any
    drift: Any
    pull: Any
    sliding: Any
    errors: Any
    noise: Any


@compiled
def independent(frame, order):
    """Find the rows that do not depend linearly on those before them in an order.

    Returns (count,), True for these rows, and (count, count), the factors of all rows in an
    orthonormal basis, to which each independent row adds the vector of its own number.
    """
    count, width = frame.shape
    found, shares, basis = np.zeros(count, np.bool_), np.zeros((count, count)), frame.copy()
    for i in order:
        own, whole = basis[i], math.sqrt(_product(basis[i], basis[i]))
        for _ in range(2):  # twice is enough
            for k in order:
                if found[k]:
                    share = _product(own, basis[k])
                    shares[i, k] += share
                    for j in range(width):
                        own[j] -= share * basis[k, j]
        left = math.sqrt(_product(own, own))
        if left > _DEPENDENT * whole:
            found[i], shares[i, i] = True, left
            for j in range(width):
                own[j] /= left
    return found, shares


@borrowing
def _product(one, other):
    """Scalar product of two rows."""
    total = 0.0
    for j in range(one.size):
        total += one[j] * other[j]
    return total


@compiled
def combination(order, alone, shares, row):
    """Factors of the independent rows whose sum is another row, (count,); see ``independent``."""
    found, left = np.zeros(alone.size), shares[row].copy()
    for i in order[::-1]:
        if alone[i]:
            found[i] = left[i] / shares[i, i]
            for j in range(left.size):
                left[j] -= found[i] * shares[i, j]
    return found


@compiled
def react(frame, gram, capacities, right, torque):
    """Solve gram torque = right for the torques of contacts that hold, (count, columns).

    frame, gram : of these contacts, see ``Coupling``
    capacities  : (count,) of these contacts; those that depend on each other share a torque in
                  proportion to the squares

    Returns the number of contacts that depend on others.
    """
    count, columns = right.shape
    weights = weights_of(capacities)
    order = descending(weights)
    alone, shares = independent(frame, order)
    first, loops = np.flatnonzero(alone), np.flatnonzero(~alone)
    size = loops.size
    matrix, rows = np.empty((first.size, first.size)), np.empty((first.size, columns))
    for i in range(first.size):
        for j in range(first.size):
            matrix[i, j] = gram[first[i], first[j]]
        for j in range(columns):
            rows[i, j] = right[first[i], j]
    eliminate(matrix, rows)
    found = np.zeros((count, columns + size))
    for i in range(first.size):
        for j in range(columns):
            found[first[i], j] = rows[i, j]
    # Torques without effect, one for each contact that depends on others.
    for k in range(size):
        factors = combination(order, alone, shares, loops[k])
        for i in range(count):
            found[i, columns + k] = -factors[i]
        found[loops[k], columns + k] = 1.0
    if size > 0:
        pass_around(found, loops, weights)
    for i in range(count):
        for j in range(columns):
            torque[i, j] = found[i, j]
    return size


@compiled
def held_torques(given, drift, held):
    """Torques of contacts of which some hold, (count,); 0 of the others.

    drift : (count,) accelerations of the sliding speeds without the torques of those that hold
    """
    numbers = np.flatnonzero(held)
    right, found = np.empty((numbers.size, 1)), np.zeros(held.size)
    for i in range(numbers.size):
        right[i, 0] = -drift[numbers[i]]
    torque = np.empty_like(right)
    gram = given.gram[numbers][:, numbers]
    react(given.frame[numbers], gram, given.contacts["capacity"][numbers], right, torque)
    for i in range(numbers.size):
        found[numbers[i]] = torque[i, 0]
    return found


@compiled
def uncertainty(given, held):
    """Rounding of the torques of contacts of which some hold, (count,); 0 of the others."""
    numbers, n = np.flatnonzero(held), given.errors.size
    right, found = np.zeros((numbers.size, n + numbers.size)), np.zeros(held.size)
    for i in range(numbers.size):
        for j in range(n):
            right[i, j] = given.pull[numbers[i], j] * given.errors[j]
        right[i, n + i] = given.noise[numbers[i]]
    torque = np.empty_like(right)
    gram = given.gram[numbers][:, numbers]
    react(given.frame[numbers], gram, np.ones(numbers.size), right, torque)
    for i in range(numbers.size):
        for j in range(torque.shape[1]):
            found[numbers[i]] += abs(torque[i, j])
    return found


@compiled
def balance(given, low, high, torque, side):
    """Find which contacts hold, and which slip at a limit.

    low, high : (count,) limits of the torques
    torque    : (count,) result, the torques
    side      : (count,) result, the direction of sliding, 0 for a contact that holds

    Returns False if there is no solution: an infinite torque would flow.
    """
    count = low.size
    at, rate, tolerance = np.zeros(count, np.int64), np.empty(count), np.empty(count)
    for i in range(count):
        torque[i] = 0.0
    for change in range(2 * _CHANGES * count):
        _set_rates(given, torque, rate, tolerance)
        step, length = _step(given, at, rate, tolerance)
        hit = -1
        for i in range(count):
            if step[i] != 0.0:
                room = ((high[i] if step[i] > 0.0 else low[i]) - torque[i]) / step[i]
                if room < length:
                    hit, length = i, room
        if math.isinf(length):
            return False
        for i in range(count):
            torque[i] += length * step[i]
        if hit >= 0:
            at[hit] = 1 if step[hit] > 0.0 else -1
            torque[hit] = high[hit] if step[hit] > 0.0 else low[hit]
            continue
        _set_rates(given, torque, rate, tolerance)
        worst, most = -1, 0.0
        for i in range(count):
            side[i] = 0
            if at[i] != 0 and low[i] < high[i]:
                ahead = at[i] * rate[i]
                if ahead > tolerance[i] and ahead / tolerance[i] > most:
                    worst = i
                    most = ahead / tolerance[i] if change < _CHANGES * count else math.inf
            if at[i] != 0 and abs(rate[i]) > tolerance[i]:
                side[i] = 1 if rate[i] > 0.0 else -1
        if worst < 0:
            return True
        at[worst] = 0
    return False


@borrowing
def _set_rates(given, torque, rate, tolerance):
    """Set the accelerations of the sliding speeds with given torques, and their rounding."""
    for i in range(rate.size):
        rate[i], tolerance[i] = given.drift[i], given.noise[i]
        for j in range(given.errors.size):
            tolerance[i] += abs(given.pull[i, j]) * given.errors[j]
        for j in range(rate.size):
            part = given.gram[i, j] * torque[j]
            rate[i] += part
            tolerance[i] += _OWN * abs(part)


@compiled
def _step(given, at, rate, tolerance):
    """Change of the torques of the contacts that are not at a limit, with which these hold.

    Returns the change and the length of the step: 1, or inf if contacts that depend on each other
    cannot all hold.
    """
    free = np.flatnonzero(at == 0)
    found, length = np.zeros(at.size), 1.0
    if free.size == 0:
        return found, length
    order = np.arange(free.size)
    alone, shares = independent(given.frame[free], order)
    for i in range(free.size):
        if alone[i]:
            continue
        factors = combination(order, alone, shares, i)
        left, most = rate[free[i]], tolerance[free[i]]
        for k in range(free.size):
            left -= factors[k] * rate[free[k]]
            most += abs(factors[k]) * tolerance[free[k]]
        if abs(left) > most:
            for k in range(free.size):
                found[free[k]] = factors[k] * math.copysign(1.0, left)
            found[free[i]] = -math.copysign(1.0, left)
            return found, math.inf
    first = free[alone]
    matrix, rows = given.gram[first][:, first], np.empty((first.size, 1))
    for i in range(first.size):
        rows[i, 0] = -rate[first[i]]
    eliminate(matrix, rows)
    for i in range(first.size):
        found[first[i]] = rows[i, 0]
    return found, length


@compiled
def linked(given):
    """Number of the group of each contact; torques of one group act on each other's sliding."""
    count = given.drift.size
    group = np.arange(count)
    for i in range(count):
        for j in range(i):
            scale = math.sqrt(given.gram[i, i] * given.gram[j, j])
            one, other = group[i], group[j]
            if one != other and abs(given.gram[i, j]) > _DEPENDENT * scale:
                for k in range(count):
                    if group[k] == one:
                        group[k] = other
    return group


@compiled
def is_spanned_by(frame, held, without):
    """Return True if a held contact, ``without``, depends on the others that are held."""
    numbers = np.flatnonzero(held)
    order = np.empty(numbers.size, np.int64)
    at = 0
    for i in range(numbers.size):
        if numbers[i] != without:
            order[at] = i
            at += 1
        else:
            order[numbers.size - 1] = i
    alone, _ = independent(frame[numbers], order)
    return not alone[order[numbers.size - 1]]
