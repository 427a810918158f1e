"""Which contacts at rest hold, and which slip: a boxed linear complementarity problem.

The bodies (inertias and bases) that contacts at rest join are a network: each contact transmits a
torque within its limits. All contacts of a part of the network hold if its bodies can have one
acceleration, that is, if the torque that some bodies have in excess can flow through the contacts
to those that lack torque: a problem of maximum flow. Otherwise a minimum cut separates the
bodies that accelerate more from the others. The contacts across the cut transmit the torque of
their limits, and each side becomes a separate part. If the torque of sliding equals that of
holding, the problem always has a solution, and this is the only one: the accelerations minimise a
convex function (Chambolle and Darbon, On total variation minimization and surface
evolution using parametric maximum flows, Int. J. Comput. Vis. 84, 2009).

A contact with a static peak transmits less torque once it slips. Therefore contacts are released
one after another: of those that would slip, the one whose torque would be the largest share of its
limit if all held. From then on it transmits at most the torque of sliding, and the problem is
solved again. A released contact holds if its torque stays within that of sliding. This ends with a
solution, as each contact is released only once. Where a contact that has held until now would slip,
those of its group that have just come to rest are released first, and stay released if it then
holds: a stick does not end because a contact that slid a moment ago could hold more.

A contact whose torque is at its limit, up to the rounding of the torques on its part, holds.
"""

import math
from typing import Any, NamedTuple

import numpy as np

from wedgebrake.dynamics.jit import borrowing, chosen_by_class, compiled, inlined
from wedgebrake.solvers.machine.events.coupled import (
    Coupling,
    balance,
    held_torques,
    is_spanned_by,
    linked,
    uncertainty,
)
from wedgebrake.solvers.machine.events.reactions import groups_of, is_spanned, reactions
from wedgebrake.solvers.machine.problem import PATTERN

ROUNDING = 2e-14
"""Torque that is rounding, relative to the sum of the magnitudes of its terms."""
SLACK = 4.0
"""Torque beyond its limit at which a contact that holds slips, relative to that rounding.

As it exceeds what counts as holding, a decision is not reconsidered because of rounding.
"""
# Relative difference of a torque and its limit that is rounding.
_SATURATED = 1e-15
# Instead of the number of a contact: the body is a source, or no torque reaches it.
_SOURCE, _NOT = -1, -2


class Network(NamedTuple):
    """The bodies that contacts at rest join: the inertias, and a base for each contact with one.

    contacts : (count,) of dtype ``AT_REST``
    a, b     : (count,) bodies that each contact joins
    inertia  : (bodies,) inf: a base
    torque   : (bodies,) without those of the contacts at rest
    rounding : (bodies,) of these torques
    level    : (bodies,) acceleration of a base
    """

    contacts: Any
    a: Any
    b: Any
    inertia: Any
    torque: Any
    rounding: Any
    level: Any


class _Division(NamedTuple):
    """Parts of a network.

    part     : (bodies,) number of the part of each body
    level    : (parts,) acceleration
    rounding : (parts,) torque that is rounding
    torque, errors : (bodies,) torque and its rounding, with the contacts that slip
    released : (count,) whether a contact transmits the torque of sliding at most
    flow     : (count,) torque that a contact transmits from its body a to b
    """

    part: Any
    level: Any
    rounding: Any
    torque: Any
    errors: Any
    released: Any
    flow: Any


@compiled
def solve(network, pattern):
    """Decide which contacts at rest hold, and share their torques.

    pattern : (count,) of dtype ``PATTERN``; the result

    Returns False if there is no solution: brakes that lock themselves join bases whose
    accelerations differ.
    """
    contacts, weakest = network.contacts, 0
    released, ratios = np.zeros(contacts.size, np.bool_), np.empty(0)
    found = _divided(network, pattern, released)
    for value in (True, False):
        if found.part[0] != _NOT and _set_released(network, pattern, released, value):
            found = _divided(network, pattern, released)
    while weakest >= 0:
        if found.part[0] == _NOT:
            return False
        weakest, largest = -1, -1.0
        for i in range(contacts.size):
            side = pattern[i].side
            if side == 0 or released[i]:
                continue
            if abs(_limit(contacts[i], True, side)) >= abs(_limit(contacts[i], False, side)):
                continue
            if ratios.size == 0:
                ratios = _load_ratios(network)
            if ratios[i] > largest:
                weakest, largest = i, ratios[i]
        if weakest >= 0:
            released[weakest] = True
            found = _divided(network, pattern, released)
    _distributed(network, pattern, found)
    return True


@compiled
def _set_released(network, pattern, released, value):
    """Release the contacts that have just come to rest in the group of one that has held.

    Only in groups in which a contact that has held until now would slip.

    value : False to undo this

    Returns whether there are such contacts.
    """
    contacts, any_ = network.contacts, False
    group = _grouped(network)
    for i in range(contacts.size):
        if pattern[i].side == 0 or contacts[i].arrived:
            continue
        for j in range(contacts.size):
            if group[j] == group[i] and contacts[j].arrived and released[j] != value:
                released[j], any_ = value, True
    return any_


@borrowing
def _limit(contact, released, side):
    """Torque at which a contact begins to slip in a direction, or that of sliding if released."""
    if side > 0:
        return contact.forward if released else contact.lower
    return contact.backward if released else contact.upper


@compiled
def _divide(network, pattern, released):
    """Divide a network into parts with one acceleration each, and set the sides of the contacts.

    Returns a ``_Division``, whose bodies are in no part if there is no solution.
    """
    a, b, bodies = network.a, network.b, network.inertia.size
    most = 2 * bodies
    found = _Division(
        groups_of(a, b, bodies), np.zeros(most), np.zeros(most), network.torque.copy(),
        network.rounding.copy(), released, np.zeros(a.size),
    )  # fmt: skip
    part = found.part
    for contact in pattern:
        contact.side = 0
    numbers, used = np.zeros(bodies, np.bool_), bodies
    for one in part:
        numbers[one] = True
    ahead = list(np.flatnonzero(numbers))
    while len(ahead) > 0:
        number = ahead.pop()
        faster = _faster(network, pattern, found, number)
        if faster.size == 0:
            continue
        if faster.size < bodies:
            part[:] = _NOT
            return found
        for i in range(a.size):
            if part[a[i]] == number and pattern[i].side == 0 and faster[a[i]] != faster[b[i]]:
                pattern[i].side = 1 if faster[a[i]] else -1
                _transmit(network, found, i, pattern[i].side)
        part[faster] = used
        ahead.append(number)
        ahead.append(used)
        used += 1
    for i in range(a.size):
        one, other = part[a[i]], part[b[i]]
        ahead_by = pattern[i].side * (found.level[one] - found.level[other])
        if ahead_by <= _uncertainty(network, found, one) + _uncertainty(network, found, other):
            pattern[i].side = 0
    return found


@compiled
def _transmit(network, found, i, side):
    """Add the torque of a contact that slips to those on its bodies."""
    torque = _limit(network.contacts[i], found.released[i], side)
    found.flow[i] = -torque
    found.torque[network.a[i]] += torque
    found.torque[network.b[i]] -= torque
    found.errors[network.a[i]] += ROUNDING * abs(torque)
    found.errors[network.b[i]] += ROUNDING * abs(torque)


@compiled
def _uncertainty(network, found, number):
    """Rounding error of the acceleration of a part."""
    return found.rounding[number] / network.inertia[found.part == number].sum()


@compiled
def _set_level(network, found, number):
    """Set the acceleration at which a part is examined; return whether it has bases that differ."""
    low, high, inertia, torque, error = math.inf, -math.inf, 0.0, 0.0, 0.0
    for body in np.flatnonzero(found.part == number):
        if math.isinf(network.inertia[body]):
            low, high = min(low, network.level[body]), max(high, network.level[body])
        else:
            inertia += network.inertia[body]
            torque += found.torque[body]
            error += found.errors[body]
    if high < low:  # no base
        low = high = torque / inertia
        error *= 2.0  # the acceleration is not exact
    largest = max(abs(low), abs(high))
    found.level[number] = 0.5 * low + 0.5 * high
    found.rounding[number] = error + ROUNDING * inertia * largest
    return high - low > ROUNDING * largest


@compiled
def _faster(network, pattern, found, number):
    """The bodies of a part that accelerate more than the others: (bodies,), True for these.

    Empty if the part has one acceleration; a single entry if an infinite torque flows.
    """
    inside = found.part == number
    differ = _set_level(network, found, number)
    level, rounding = found.level[number], found.rounding[number]
    excess, absorbs = np.zeros(inside.size), np.zeros(inside.size, np.bool_)
    for body in np.flatnonzero(inside):
        if not math.isinf(network.inertia[body]):
            excess[body] = found.torque[body] - network.inertia[body] * level
        elif differ:
            excess[body] = math.inf if network.level[body] > level else -math.inf
        else:
            absorbs[body] = True
    for i in range(network.a.size):
        if inside[network.a[i]] and pattern[i].side == 0:
            found.flow[i] = 0.0
    # From bodies with an excess, and then from bases, to bodies that lack torque.
    for from_bases in (False, True):
        while True:
            sources = absorbs if from_bases else excess > rounding
            came = _reach(network, pattern, found, sources, True)
            takes = excess < -rounding
            targets = np.flatnonzero((came >= 0) & (takes if from_bases else takes | absorbs))
            if targets.size == 0:
                break
            if not _augment(network, found, excess, absorbs, came, targets[0]):
                return np.ones(1, np.bool_)
    if np.any(excess > rounding):
        return _reach(network, pattern, found, excess > rounding, True) > _NOT
    if np.any(excess < -rounding):
        return inside & (_reach(network, pattern, found, excess < -rounding, False) == _NOT)
    return np.empty(0, np.bool_)


@compiled
def _reach(network, pattern, found, sources, forwards):
    """Contact through which each body is reached by torque from sources: (bodies,).

    -1: a source; -2: not reached. If not ``forwards``: from which torque can reach the sources.
    """
    came = np.full(sources.size, _NOT)
    came[sources] = _SOURCE
    ahead = list(np.flatnonzero(sources))
    at = 0
    while at < len(ahead):
        body = ahead[at]
        at += 1
        for i in range(network.a.size):
            if pattern[i].side != 0 or (network.a[i] != body and network.b[i] != body):
                continue
            from_a = network.a[i] == body
            other = network.b[i] if from_a else network.a[i]
            if came[other] == _NOT and _room(network, found, i, from_a == forwards) > 0.0:
                came[other] = i
                ahead.append(other)
    return came


@borrowing
def _room(network, found, i, from_a):
    """Torque that a contact can transmit in addition, from its body a to b or backwards."""
    limit = _limit(network.contacts[i], found.released[i], 1 if from_a else -1)
    room = abs(limit) - (found.flow[i] if from_a else -found.flow[i])
    return room if math.isinf(room) or room > _SATURATED * abs(limit) else 0.0


@compiled
def _augment(network, found, excess, absorbs, came, target):
    """Let as much torque as possible flow along a path to a body; return False if infinite."""
    most, body = math.inf if absorbs[target] else -excess[target], target
    while came[body] >= 0:
        i = came[body]
        from_a = network.b[i] == body
        most = min(most, _room(network, found, i, from_a))
        body = network.a[i] if from_a else network.b[i]
    most = most if absorbs[body] else min(most, excess[body])
    if math.isinf(most):
        return False
    if not absorbs[body]:
        excess[body] -= most
    if not absorbs[target]:
        excess[target] += most
    body = target
    while came[body] >= 0:
        i = came[body]
        from_a = network.b[i] == body
        sign = 1.0 if from_a else -1.0
        if most == _room(network, found, i, from_a):
            found.flow[i] = sign * abs(_limit(network.contacts[i], found.released[i], sign))
        else:
            found.flow[i] += sign * most
        body = network.a[i] if from_a else network.b[i]
    return True


@compiled
def _needs(network, torque, held):
    """Torque that each body needs if some contacts hold; the last one is the ground.

    torque : (bodies,) without the torques of contacts that hold
    """
    group = groups_of(network.a[held], network.b[held], network.inertia.size)
    need = np.zeros((network.inertia.size - network.a.size + 1, 1))
    for body in range(need.size - 1):
        level, whole, inertia, based = 0.0, 0.0, 0.0, False
        for other in np.flatnonzero(group == group[body]):
            if math.isinf(network.inertia[other]):
                level, based = network.level[other], True
            else:
                whole += torque[other]
                inertia += network.inertia[other]
        level = level if based else whole / inertia
        need[body, 0] = network.inertia[body] * level - torque[body]
    return need


@compiled
def _react(network, pattern, need, free):
    """Set the torques of contacts that hold; those that are not ``free`` are at their limits."""
    ground, need = need.size - 1, need.copy()
    ends = np.minimum(network.b, ground)
    for i in range(free.size):
        one, contact = pattern[i], network.contacts[i]
        if one.clamp != 0:
            one.torque = contact.upper if one.clamp > 0 else contact.lower
            need[network.a[i], 0] -= one.torque
            need[ends[i], 0] += one.torque
    torque = np.empty((np.sum(free), 1))
    reactions(network.a[free], ends[free], network.contacts["capacity"][free], need, torque)
    for at, i in enumerate(np.flatnonzero(free)):
        pattern[i].torque = torque[at, 0]


@compiled
def _load_ratios(network):
    """Torque of each contact over its limit if all held."""
    contacts, found = network.contacts, _torques_if_held(network)
    for i in range(contacts.size):
        torque = found[i]
        limit = abs(contacts[i].upper if torque > 0.0 else contacts[i].lower)
        found[i] = abs(torque) / limit if limit > 0.0 else math.inf
    return found


@compiled
def _torques_in_network(network):
    """Torque of each contact if all held."""
    pattern = np.zeros(network.contacts.size, PATTERN)
    all_ = np.ones(pattern.size, np.bool_)
    _react(network, pattern, _needs(network, network.torque, all_), all_)
    return pattern["torque"].copy()


@compiled
def _distribute(network, pattern, found):
    """Set the torques of all contacts, and which of those that hold are at their limits.

    Limits affect how torque is shared where contacts close loops. Contacts that would exceed theirs
    are set to them one by one, as long as the others can hold what remains. If this fails, it is
    repeated after those that are at their limits in the flow that was found have been set to them.
    """
    contacts, torque, held = network.contacts, network.torque.copy(), pattern["side"] == 0
    for i in np.flatnonzero(~held):
        pattern[i].torque = _limit(contacts[i], True, pattern[i].side)
        torque[network.a[i]] += pattern[i].torque
        torque[network.b[i]] -= pattern[i].torque
    need = _needs(network, torque, held)
    free = held.copy()
    for from_flow in (False, True):
        _clamp_at_rest(network, pattern, found, free, from_flow)
        if _clamp_beyond(network, pattern, found, need, free):
            break
    for i in range(held.size):
        pattern[i].slack = SLACK * _rounding(network, found, i)
        if free[i]:
            pattern[i].slack += max(_excess(pattern[i].torque, contacts[i]), 0.0)


@borrowing
def _excess(torque, contact):
    """How far a torque is beyond the limits of a contact; negative within them."""
    return max(torque - contact.upper, contact.lower - torque)


@compiled
def _clamp_at_rest(network, pattern, found, free, from_flow):
    """Set contacts that close loops to their limits: those with limits 0, or at their limits.

    from_flow : whether to set those that are at their limits in the flow that was found
    """
    ends = np.minimum(network.b, network.inertia.size - network.a.size)
    for i in range(free.size):
        free[i] = pattern[i].side == 0
    for i in range(free.size):
        contact, one = network.contacts[i], pattern[i]
        one.clamp = 0
        idle = max(-contact.lower, contact.upper) == 0.0
        if from_flow and not idle:
            idle = _room(network, found, i, True) == 0.0 or _room(network, found, i, False) == 0.0
        if free[i] and idle and is_spanned(network.a, ends, free, i):
            free[i], one.clamp = False, -1 if found.flow[i] > 0.0 else 1


@compiled
def _clamp_beyond(network, pattern, found, need, free):
    """Set contacts beyond their limits to these, one by one; return whether none is beyond."""
    ends = np.minimum(network.b, network.inertia.size - network.a.size)
    while True:
        _react(network, pattern, need, free)
        worst, most, within = -1, 0.0, True
        for i in np.flatnonzero(free):
            beyond = _excess(pattern[i].torque, network.contacts[i])
            if beyond <= _rounding(network, found, i):
                continue
            within = False
            if beyond > most and is_spanned(network.a, ends, free, i):
                worst, most = i, beyond
        if worst < 0:
            return within
        free[worst], pattern[worst].clamp = False, 1 if pattern[worst].torque > 0.0 else -1


@borrowing
def _rounding(network, found, i):
    """Torque that is rounding, in the parts that a contact joins."""
    one, other = found.part[network.a[i]], found.part[network.b[i]]
    return max(found.rounding[one], found.rounding[other])


class _Balance(NamedTuple):
    """Torques with which contacts of a machine with joints hold or slip.

    part     : (1,) ``_NOT`` if there is no solution
    torque   : (count,) of the contacts
    released : as in ``_Division``
    """

    part: Any
    torque: Any
    released: Any


@compiled
def _divide_coupled(given, pattern, released):
    """Set the sides of the contacts of a machine with joints; returns ``_Balance``."""
    count = pattern.size
    low, high = np.empty(count), np.empty(count)
    torque, side = np.zeros(count), np.zeros(count, np.int64)
    for i in range(count):
        low[i] = -abs(_limit(given.contacts[i], released[i], 1))
        high[i] = abs(_limit(given.contacts[i], released[i], -1))
    solved = balance(given, low, high, torque, side)
    for i in range(count):
        pattern[i].side = side[i]
    return _Balance(np.full(1, 0 if solved else _NOT), torque, released)


@compiled
def _distribute_coupled(given, pattern, found):
    """``_distribute`` for a machine with joints."""
    contacts, held, drift = given.contacts, pattern["side"] == 0, given.drift.copy()
    errors = given.errors.copy()
    for i in np.flatnonzero(~held):
        pattern[i].torque = _limit(contacts[i], True, pattern[i].side)
        for j in range(drift.size):
            drift[j] += given.gram[j, i] * pattern[i].torque
        for j in range(errors.size):
            errors[j] += ROUNDING * abs(given.sliding[i, j] * pattern[i].torque)
    noisy = Coupling(
        contacts, given.frame, given.gram, drift, given.pull, given.sliding, errors, given.noise
    )
    rounding = uncertainty(noisy, held)
    for i in np.flatnonzero(~held):
        too = held.copy()
        too[i] = True
        rounding[i] = uncertainty(noisy, too)[i]
    for from_balance in (False, True):
        free = held.copy()
        for i in np.flatnonzero(held):
            contact, one = contacts[i], pattern[i]
            one.clamp, torque = 0, found.torque[i]
            idle = max(-contact.lower, contact.upper) == 0.0
            idle = idle or (from_balance and (torque == contact.upper or torque == contact.lower))
            if idle and is_spanned_by(given.frame, free, i):
                free[i], one.clamp = False, -1 if torque < 0.0 else 1
        if _clamp_coupled(given, pattern, drift, free, rounding):
            break
    for i in range(held.size):
        pattern[i].slack = SLACK * rounding[i]
        if free[i]:
            pattern[i].slack += max(_excess(pattern[i].torque, contacts[i]), 0.0)


@compiled
def _clamp_coupled(given, pattern, drift, free, rounding):
    """``_clamp_beyond`` for a machine with joints."""
    contacts = given.contacts
    while True:
        left = drift.copy()
        for i in range(free.size):
            one = pattern[i]
            if one.side == 0 and one.clamp != 0:
                one.torque = contacts[i].upper if one.clamp > 0 else contacts[i].lower
                for j in range(left.size):
                    left[j] += given.gram[j, i] * one.torque
        torque = held_torques(given, left, free)
        worst, most, within = -1, 0.0, True
        for i in np.flatnonzero(free):
            pattern[i].torque = torque[i]
            beyond = _excess(torque[i], contacts[i])
            if beyond <= rounding[i]:
                continue
            within = False
            if beyond > most and is_spanned_by(given.frame, free, i):
                worst, most = i, beyond
        if worst < 0:
            return within
        free[worst], pattern[worst].clamp = False, 1 if pattern[worst].torque > 0.0 else -1


@inlined
def _divided_network(network, pattern, released):
    return _divide(network, pattern, released)


@inlined
def _divided_coupled(given, pattern, released):
    return _divide_coupled(given, pattern, released)


@inlined
def _groups_in_network(network):
    return groups_of(network.a, network.b, network.inertia.size)[network.a]


@inlined
def _groups_coupled(given):
    return linked(given)


@inlined
def _torques_coupled(given):
    return held_torques(given, given.drift, np.ones(given.drift.size, np.bool_))


_divided = chosen_by_class({Network: _divided_network, Coupling: _divided_coupled})
_distributed = chosen_by_class({Network: _distribute, Coupling: _distribute_coupled})
_grouped = chosen_by_class({Network: _groups_in_network, Coupling: _groups_coupled})
_torques_if_held = chosen_by_class({Network: _torques_in_network, Coupling: _torques_coupled})
