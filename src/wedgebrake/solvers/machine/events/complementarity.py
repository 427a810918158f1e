"""Which contacts at rest hold, and which slip: a boxed linear complementarity problem.

With G = W' M^-1 W of the contacts at rest and c the rates of their sliding speeds under all other
torques, the rates y = G torque + c satisfy: a contact holds, with y = 0 and its torque within its
limits, or slips forwards with y > 0 or backwards with y < 0 and the torque of sliding. If several
patterns of up to ``MOST_TRIED`` contacts satisfy this, one in which most contacts hold is chosen.
"""

import math

import numpy as np

from wedgebrake.dynamics.jit import borrowing, compiled, embedded
from wedgebrake.solvers.machine.events.least_torques import least_torques
from wedgebrake.solvers.machine.problem import PATTERN

ROUNDING = 1e-11
"""Relative size of rates and torques that are rounding."""
MOST_TRIED = 12
"""Largest number of contacts at rest for which all patterns are tried."""
# Pivots per contact after which the search ends without a pattern, and after which the contact with
# the lowest number changes its side instead of the one with the largest violation.
_MOST_PIVOTS, _LARGEST_FIRST = 60, 10


@borrowing
def _width(lcp, i):
    """Largest torque at which a contact holds; 1 where there is none or no limit."""
    width = max(abs(lcp.contacts[i].lower), abs(lcp.contacts[i].upper))
    return width if 0.0 < width < math.inf else 1.0


@embedded
def _at_limit(lcp, i):
    """Return -1 or 1 if the holding torque of a contact is at a limit, otherwise 0."""
    one = lcp.contacts[i]
    return one.at_holding_limit if one.at_holding_limit != 0 else one.clamped


@compiled
def hold(lcp, pattern):
    """Find torques with which the contacts of a pattern that do not slide hold; False: none.

    Limits affect how torque is shared only where contacts depend on each other: then as few
    contacts as possible are set to their limits, such that the others can hold the rest.
    """
    free = np.empty(pattern.size, np.int64)
    size = 0
    for i in range(pattern.size):
        one, contact = pattern[i], lcp.contacts[i]
        one.clamp = 0
        if one.side != 0:
            one.torque = contact.forward if one.side > 0 else contact.backward
            if math.isinf(one.torque):
                return False
        elif _at_limit(lcp, i) != 0 and not _is_relieved(lcp, pattern, i):
            return False
        elif contact.at_holding_limit != 0:
            one.clamp = contact.at_holding_limit
            one.torque = contact.upper if one.clamp > 0 else contact.lower
        else:
            free[size] = i
            size += 1
    free = free[:size]
    rank = _share(lcp, pattern, free)
    if _within(lcp, pattern, free):
        return _is_balanced(lcp, pattern, ROUNDING)
    if rank == free.size:
        return _hold_at_rounding(lcp, pattern, free)
    return _hold_at_limits(lcp, pattern, free, rank)


@compiled
def _hold_at_rounding(lcp, pattern, free):
    """Return True if the torques beyond their limits are at these limits up to rounding.

    They are if, with them set to the limits, the contacts do not move, up to twice the rounding by
    which slips are recognised. The two tolerances overlap: either a slip or this is always found.
    """
    given = pattern["clamp"].copy()
    for i in free:
        one, contact = pattern[i], lcp.contacts[i]
        if one.clamp == 0 and one.torque > contact.upper:
            one.clamp, one.torque = 1, contact.upper
        elif one.clamp == 0 and one.torque < contact.lower:
            one.clamp, one.torque = -1, contact.lower
    _share(lcp, pattern, free)
    holds = _within(lcp, pattern, free) and _is_balanced(lcp, pattern, 2.0 * ROUNDING)
    pattern["clamp"][:] = given
    return holds


@compiled
def _hold_at_limits(lcp, pattern, free, rank):
    """Find torques within their limits by setting the fewest of the free contacts to theirs.

    The other contacts must be able to hold any torque that all of them can hold.

    rank : of the matrix of all free contacts, and of that of the others
    """
    size = free.size
    for rounding in (False, True):
        for clamped in range(1, size - rank + 1):
            best, least = np.int64(-1), math.inf
            for code in range(3**size):
                if _set_clamps(lcp, pattern, free, code) != clamped:
                    continue
                if _share(lcp, pattern, free) < rank or not _holds(lcp, pattern, free, rounding):
                    continue
                cost = _cost(lcp, pattern, free)
                if cost < least:
                    best, least = code, cost
            if best >= 0:
                _set_clamps(lcp, pattern, free, best)
                _share(lcp, pattern, free)
                return True
    return False


@compiled
def _holds(lcp, pattern, free, rounding):
    """Return True if the torques of a pattern hold; ``rounding``: as far as rounding tells."""
    if rounding:
        return _hold_at_rounding(lcp, pattern, free)
    return _within(lcp, pattern, free) and _is_balanced(lcp, pattern, ROUNDING)


@compiled
def _cost(lcp, pattern, free):
    """Sum of (torque/limit)^2 of some contacts."""
    total = 0.0
    for i in free:
        total += (pattern[i].torque / _width(lcp, i)) ** 2
    return total


@compiled
def _set_clamps(lcp, pattern, free, code):
    """Set contacts to their limits by the digits of a number; returns how many, or -1."""
    clamped = 0
    for i in free:
        digit = code % 3
        code //= 3
        pattern[i].clamp = 0 if digit == 0 else (1 if digit == 1 else -1)
        if digit != 0:
            clamped += 1
            pattern[i].torque = lcp.contacts[i].upper if digit == 1 else lcp.contacts[i].lower
            if math.isinf(pattern[i].torque):
                return -1
    return clamped


@compiled
def _share(lcp, pattern, free):
    """Set the torques of the holding contacts not at limits; return the rank of their matrix."""
    chosen = np.empty(free.size, np.int64)
    size = 0
    for i in free:
        if pattern[i].clamp == 0:
            chosen[size] = i
            size += 1
    right, weights = np.empty((size, 1)), np.empty(size)
    matrix = np.empty((size, size))
    for i in range(size):
        right[i, 0] = -lcp.contacts[chosen[i]].rate
        for k in range(pattern.size):
            if pattern[k].side != 0 or pattern[k].clamp != 0:
                right[i, 0] -= lcp.matrix[chosen[i], k] * pattern[k].torque
        for k in range(size):
            matrix[i, k] = lcp.matrix[chosen[i], chosen[k]]
        weights[i] = _width(lcp, chosen[i])
    rank = least_torques(matrix, right, weights, size)
    for i in range(size):
        pattern[chosen[i]].torque = right[i, 0]
    return rank


@compiled
def _within(lcp, pattern, free):
    """Return True if the torques of some contacts are within their limits."""
    for i in free:
        tolerance = ROUNDING * _width(lcp, i)
        torque, contact = pattern[i].torque, lcp.contacts[i]
        if torque > contact.upper + tolerance or torque < contact.lower - tolerance:
            return False
    return True


@compiled
def _is_relieved(lcp, pattern, which):
    """Return True if others that hold can take torque from one that is at its limit.

    They can if they form a path between its two inertias on which none is at its own limit in the
    direction needed.
    """
    begin, end = lcp.contacts[which].a, lcp.contacts[which].b
    if _at_limit(lcp, which) < 0:
        begin, end = end, begin
    largest = 0
    for one in lcp.contacts:
        largest = max(largest, one.a, one.b)
    reached = np.zeros(largest + 1, np.bool_)
    reached[begin] = True
    for _ in range(pattern.size):
        for i in range(pattern.size):
            if pattern[i].side != 0 or i == which:
                continue
            a, b = lcp.contacts[i].a, lcp.contacts[i].b
            if reached[a] and _at_limit(lcp, i) <= 0:
                reached[b] = True
            if reached[b] and _at_limit(lcp, i) >= 0:
                reached[a] = True
    return reached[end]


@compiled
def _is_balanced(lcp, pattern, rounding):
    """Return True if the contacts that hold do not move.

    rounding : largest rate that counts as rest, relative to the scale of the rates
    """
    for i in range(pattern.size):
        if pattern[i].side == 0 and abs(rate(lcp, pattern, i)) > rounding * lcp.scale[0]:
            return False
    return True


@embedded
def rate(lcp, pattern, i):
    """Rate of the sliding speed of a contact."""
    total = lcp.contacts[i].rate
    for k in range(pattern.size):
        total += lcp.matrix[i, k] * pattern[k].torque
    return total


@compiled
def _slips_apart(lcp, pattern):
    """Return True if each contact that slips accelerates in the direction of its slip.

    A rate of zero, up to rounding, is accepted if the holding torque has just reached the limit for
    this direction.
    """
    for i in range(pattern.size):
        side = pattern[i].side
        if side != 0:
            forwards = side * rate(lcp, pattern, i)
            tolerance = ROUNDING * lcp.scale[0]
            if forwards < -tolerance or (forwards <= tolerance and side != -_at_limit(lcp, i)):
                return False
    return True


@compiled
def _shares(lcp):
    """Share of its limit that each contact would have if all held."""
    count = lcp.contacts.size
    torque = np.empty((count, 1))
    weights = np.empty(count)
    for i in range(count):
        torque[i, 0], weights[i] = -lcp.contacts[i].rate, _width(lcp, i)
    least_torques(lcp.matrix, torque, weights, count)
    for i in range(count):
        limit = abs(lcp.contacts[i].upper if torque[i, 0] > 0.0 else lcp.contacts[i].lower)
        weights[i] = abs(torque[i, 0]) / limit if limit > 0.0 else math.inf
    return weights


@compiled
def _releases_larger(shares, pattern, best):
    """Return True if the contacts that slide have larger shares than those that do in ``best``.

    The largest shares that differ decide.
    """
    one, other = np.sort(shares[pattern["side"] != 0]), np.sort(shares[best["side"] != 0])
    for i in range(one.size - 1, -1, -1):
        if one[i] != other[i]:
            return one[i] > other[i]
    return False


@compiled
def solve(lcp, best):
    """Find the pattern of sticks and slips; False: there is none.

    Of patterns in which equally many contacts hold, the one is chosen that releases the contacts
    whose shares of their limits would be the largest if all held. For more than ``MOST_TRIED``
    contacts, ``pivot`` finds a pattern.
    """
    count = lcp.contacts.size
    if count > MOST_TRIED:
        return pivot(lcp, best)
    trial, shares = np.zeros(count, PATTERN), np.empty(0)
    for sliding in range(count + 1):
        found = 0
        for code in range(3**count if sliding > 0 else 1):
            left, slips = code, 0
            for i in range(count):
                digit = left % 3
                trial[i].side = 0 if digit == 0 else (1 if digit == 1 else -1)
                slips += digit != 0
                left //= 3
            if slips != sliding or not hold(lcp, trial) or not _slips_apart(lcp, trial):
                continue
            found += 1
            if found == 2:
                shares = _shares(lcp)
            if found == 1 or _releases_larger(shares, trial, best):
                best[:] = trial
        if found > 0:
            return True
    return False


@compiled
def pivot(lcp, pattern):
    """Find a pattern of many independent contacts by principal pivoting; False: none was found.

    At first all hold, except those that have just reached a limit, which slip throughout. In each
    step, the contact that exceeds its limit by the largest factor slips; if there is none, of the
    contacts whose rate opposes their slip the one with the largest rate holds. If this does not
    end, the contact with the lowest number changes instead: then no pattern recurs if static and
    kinetic friction are equal (Murty, Note on a Bard-type scheme, Opsearch 11, 1974).
    """
    count = lcp.contacts.size
    for i in range(count):
        pattern[i].side = -lcp.contacts[i].at_holding_limit
    for turn in range(_MOST_PIVOTS * count):
        free = np.flatnonzero(pattern["side"] == 0)
        for i in range(count):
            one, contact = pattern[i], lcp.contacts[i]
            if one.side != 0:
                one.torque = contact.forward if one.side > 0 else contact.backward
                if math.isinf(one.torque):
                    return False
        _share(lcp, pattern, free)
        lowest = turn >= _LARGEST_FIRST * count
        which = _violation(lcp, pattern, lowest)
        if which < 0:
            return _slips_apart(lcp, pattern)
        if pattern[which].side != 0:
            pattern[which].side = 0
        else:
            pattern[which].side = -1 if pattern[which].torque > 0.0 else 1
    return False


@compiled
def _violation(lcp, pattern, lowest):
    """Number of the contact that violates a pattern most; -1 if none does.

    A contact violates it if it exceeds its limit or, if none does, if its rate opposes its slip.

    lowest : whether to return the lowest number of a contact that violates it in either way
    """
    holding, sliding, share, backwards = -1, -1, 1.0, ROUNDING * lcp.scale[0]
    for i in range(lcp.contacts.size):
        torque, side, one = pattern[i].torque, pattern[i].side, lcp.contacts[i]
        limited, limit = one.at_holding_limit, one.upper if torque > 0.0 else one.lower
        tolerance = ROUNDING * _width(lcp, i)
        if side == 0 and abs(torque) > abs(limit) + tolerance:
            here = abs(torque / limit) if limit != 0.0 else math.inf
            if here > share:
                holding, share = i, here
        elif side != 0 and limited == 0 and -side * rate(lcp, pattern, i) > backwards:
            sliding, backwards = i, -side * rate(lcp, pattern, i)
        if lowest and max(holding, sliding) >= 0:
            break
    return holding if holding >= 0 else sliding
