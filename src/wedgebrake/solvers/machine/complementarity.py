"""Which contacts at rest hold, and which slip: a boxed linear complementarity problem.

With G = W' M^-1 W of the contacts at rest and c the rates of their sliding speeds under all other
torques, the rates y = G torque + c satisfy: a contact holds, with y = 0 and its torque within its
limits, or slips forwards with y > 0 or backwards with y < 0 and the torque of sliding. Where there
are several answers, the one in which the most contacts hold is taken.
"""

import math

import numpy as np

from wedgebrake.dynamics.jit import borrowing, compiled, embedded
from wedgebrake.solvers.machine.least_torques import least_torques
from wedgebrake.solvers.machine.problem import AtRest, Pattern

ROUNDING = 1e-11
"""Relative size of rates and torques that are rounding."""


@compiled
def pattern_of(count):
    """Room for a pattern."""
    return Pattern(np.zeros(count, np.int64), np.zeros(count), np.zeros(count, np.int64))


@embedded
def view_of(rest, pattern, count):
    """The first ``count`` contacts of ``AtRest`` and ``Pattern``."""
    return (
        AtRest(
            rest.a[:count], rest.b[:count], rest.matrix, rest.rates[:count],
            rest.scale, rest.lower[:count], rest.upper[:count], rest.forward[:count],
            rest.backward[:count], rest.limited[:count], rest.clamped[:count],
        ),
        Pattern(pattern.side[:count], pattern.torque[:count], pattern.clamp[:count]),
    )  # fmt: skip


@borrowing
def _width(rest, i):
    """Largest torque at which a contact holds; 1 where there is none or no limit."""
    width = max(abs(rest.lower[i]), abs(rest.upper[i]))
    return width if 0.0 < width < math.inf else 1.0


@embedded
def _at_limit(rest, i):
    """-1 or 1 where a holding torque is at a limit, else 0."""
    return rest.limited[i] if rest.limited[i] != 0 else rest.clamped[i]


@compiled
def hold(rest, pattern):
    """Find torques with which the contacts of a pattern that do not slide hold; False: none.

    Limits decide on the shares only where contacts depend on each other: then the fewest contacts
    are set to their limits with which the others can hold the rest.
    """
    side, torque, clamp = pattern
    count = side.size
    free = np.empty(count, np.int64)
    size = 0
    for i in range(count):
        clamp[i] = 0
        if side[i] != 0:
            torque[i] = rest.forward[i] if side[i] > 0 else rest.backward[i]
            if math.isinf(torque[i]):
                return False
        elif _at_limit(rest, i) != 0 and not _is_relieved(rest, side, i):
            return False
        elif rest.limited[i] != 0:
            clamp[i] = rest.limited[i]
            torque[i] = rest.upper[i] if clamp[i] > 0 else rest.lower[i]
        else:
            free[size] = i
            size += 1
    free = free[:size]
    unique = _share(rest, pattern, free)
    if _within(rest, torque, free):
        return _is_balanced(rest, side, torque)
    if unique:
        return False
    return _hold_at_limits(rest, pattern, free)


@compiled
def _hold_at_limits(rest, pattern, free):
    """Find torques within their limits by setting the fewest of the free contacts to theirs."""
    side, torque, size = pattern.side, pattern.torque, free.size
    for clamped in range(1, size):
        best, least = np.int64(-1), math.inf
        for code in range(3**size):
            if _set_clamps(rest, pattern, free, code) != clamped:
                continue
            _share(rest, pattern, free)
            if _within(rest, torque, free) and _is_balanced(rest, side, torque):
                cost = _cost(rest, torque, free)
                if cost < least:
                    best, least = code, cost
        if best >= 0:
            _set_clamps(rest, pattern, free, best)
            _share(rest, pattern, free)
            return True
    return False


@compiled
def _cost(rest, torque, free):
    """Sum of (torque/limit)^2 of some contacts."""
    total = 0.0
    for i in free:
        total += (torque[i] / _width(rest, i)) ** 2
    return total


@compiled
def _set_clamps(rest, pattern, free, code):
    """Set contacts to their limits by the digits of a number; returns how many, or -1."""
    clamped = 0
    for i in free:
        digit = code % 3
        code //= 3
        pattern.clamp[i] = 0 if digit == 0 else (1 if digit == 1 else -1)
        if digit != 0:
            clamped += 1
            pattern.torque[i] = rest.upper[i] if digit == 1 else rest.lower[i]
            if math.isinf(pattern.torque[i]):
                return -1
    return clamped


@compiled
def _share(rest, pattern, free):
    """Set the torques of the contacts that hold and are not at limits; True: they are unique."""
    side, torque, clamp = pattern
    chosen = np.empty(free.size, np.int64)
    size = 0
    for i in free:
        if clamp[i] == 0:
            chosen[size] = i
            size += 1
    right, weights = np.empty((size, 1)), np.empty(size)
    matrix = np.empty((size, size))
    for i in range(size):
        right[i, 0] = -rest.rates[chosen[i]]
        for k in range(side.size):
            if side[k] != 0 or clamp[k] != 0:
                right[i, 0] -= rest.matrix[chosen[i], k] * torque[k]
        for k in range(size):
            matrix[i, k] = rest.matrix[chosen[i], chosen[k]]
        weights[i] = _width(rest, chosen[i])
    unique = least_torques(matrix, right, weights, size)
    for i in range(size):
        torque[chosen[i]] = right[i, 0]
    return unique


@compiled
def _within(rest, torque, free):
    """Return True if the torques of some contacts are within their limits."""
    for i in free:
        room = ROUNDING * _width(rest, i)
        if torque[i] > rest.upper[i] + room or torque[i] < rest.lower[i] - room:
            return False
    return True


@compiled
def _is_relieved(rest, side, which):
    """Return True if others that hold can take torque from one that is at its limit.

    They can if they form a path between its two inertias on which none is at its own limit in the
    direction needed.
    """
    begin, end = rest.a[which], rest.b[which]
    if _at_limit(rest, which) < 0:
        begin, end = end, begin
    reached = np.zeros(max(rest.a.max(), rest.b.max()) + 1, np.bool_)
    reached[begin] = True
    for _ in range(side.size):
        for i in range(side.size):
            if side[i] != 0 or i == which:
                continue
            a, b = rest.a[i], rest.b[i]
            if reached[a] and _at_limit(rest, i) <= 0:
                reached[b] = True
            if reached[b] and _at_limit(rest, i) >= 0:
                reached[a] = True
    return reached[end]


@compiled
def _is_balanced(rest, side, torque):
    """Return True if the contacts that hold do not move."""
    for i in range(side.size):
        if side[i] == 0 and abs(rate(rest, torque, i)) > ROUNDING * rest.scale[0]:
            return False
    return True


@embedded
def rate(rest, torque, i):
    """Rate of the sliding speed of a contact."""
    total = rest.rates[i]
    for k in range(torque.size):
        total += rest.matrix[i, k] * torque[k]
    return total


@compiled
def _slips_apart(rest, pattern):
    """Return True if what slides does so with a rate of its side.

    A rate that is rounding has the side to which a holding torque has just reached its limit.
    """
    for i in range(pattern.side.size):
        side = pattern.side[i]
        if side != 0:
            forwards = side * rate(rest, pattern.torque, i)
            room = ROUNDING * rest.scale[0]
            if forwards < -room or (forwards <= room and side != -_at_limit(rest, i)):
                return False
    return True


@compiled
def _shares(rest):
    """Share of its limit that each contact would have if all held."""
    count = rest.a.size
    torque = np.empty((count, 1))
    weights = np.empty(count)
    for i in range(count):
        torque[i, 0], weights[i] = -rest.rates[i], _width(rest, i)
    least_torques(rest.matrix, torque, weights, count)
    for i in range(count):
        limit = abs(rest.upper[i] if torque[i, 0] > 0.0 else rest.lower[i])
        weights[i] = abs(torque[i, 0]) / limit if limit > 0.0 else math.inf
    return weights


@compiled
def _releases_larger(shares, side, best):
    """Return True if the contacts that slide have larger shares than those that do in ``best``.

    The largest ones decide that differ.
    """
    one, other = np.sort(shares[side != 0]), np.sort(shares[best != 0])
    for i in range(one.size - 1, -1, -1):
        if one[i] != other[i]:
            return one[i] > other[i]
    return False


@compiled
def solve(rest, best):
    """Find the pattern of sticks and slips; False: there is none.

    Of patterns in which as many hold, the one is taken that releases those with the largest shares
    of their limits, if all held.
    """
    count = rest.a.size
    trial, shares = pattern_of(count), np.empty(0)
    for sliding in range(count + 1):
        found = 0
        for code in range(3**count if sliding > 0 else 1):
            left, slips = code, 0
            for i in range(count):
                digit = left % 3
                trial.side[i] = 0 if digit == 0 else (1 if digit == 1 else -1)
                slips += digit != 0
                left //= 3
            if slips != sliding or not hold(rest, trial) or not _slips_apart(rest, trial):
                continue
            found += 1
            if found == 2:
                shares = _shares(rest)
            if found == 1 or _releases_larger(shares, trial.side, best.side):
                best.side[:] = trial.side
                best.torque[:] = trial.torque
                best.clamp[:] = trial.clamp
        if found > 0:
            return True
    return False
