"""Which contacts at rest hold, and which slip: a boxed linear complementarity problem.

With G = W' M^-1 W of the contacts at rest and c the rates of their sliding speeds under all other
torques, the rates y = G torque + c satisfy: a contact holds, with y = 0 and its torque within its
limits, or slips forwards with y > 0 or backwards with y < 0 and the torque of sliding. Where there
are several answers, the one in which the most contacts hold is taken.
"""

import math
from typing import Any, NamedTuple

import numpy as np

from wedgebrake.dynamics.jit import compiled
from wedgebrake.solvers.machine.modes import compliance

# Relative size of rates and torques that are rounding.
_ROUNDING = 1e-11
_SINGULAR = 1e-10


class AtRest(NamedTuple):
    """Contacts at rest at an instant, as numbers.

    contacts : (count,) their numbers
    matrix   : (count, count) G
    rates    : (count,) c
    scale    : of c: the sum of the sizes of what it is made of
    lower, upper   : (count,) limits of the torque that holds
    forward, backward : (count,) torque of sliding
    preferred : (count,) side of slip that is meant where the rate is rounding, or 0
    limited   : (count,) -1 or 1 where the torque has just reached a limit and would exceed it
    """

    contacts: Any
    matrix: Any
    rates: Any
    scale: float
    lower: Any
    upper: Any
    forward: Any
    backward: Any
    preferred: Any
    limited: Any


@compiled
def matrix_of(problem, contacts):
    """G of some contacts."""
    count = contacts.size
    matrix = np.empty((count, count))
    for i in range(count):
        for k in range(count):
            matrix[i, k] = compliance(problem, contacts[i], contacts[k])
    return matrix


@compiled
def _least(matrix, right, weights):
    """(torques, residual): matrix torques = right with the least sum (torque/weight)^2."""
    count = right.size
    if count == 1:
        return right / matrix[0, 0], 0.0
    scaled = np.empty((count, count))
    for i in range(count):
        for k in range(count):
            scaled[i, k] = matrix[i, k] * weights[k]
    solution = np.linalg.pinv(scaled, _SINGULAR) @ right
    left = scaled @ solution - right
    return weights * solution, np.abs(left).max()


@compiled
def hold(rest, pattern, torques, clamps):
    """Find torques with which the contacts of a pattern's zeros hold; False: there are none.

    pattern : (count,) side of sliding of each contact, 0: it holds
    torques : (count,) receives the torques
    clamps  : (count,) receives -1 or 1 where a holding torque is at a limit

    As the limits only matter where contacts depend on each other, those beyond theirs are set to
    it and the others take the rest.
    """
    count = pattern.size
    free = np.empty(count, np.int64)
    for i in range(count):
        clamps[i] = 0
        if pattern[i] != 0:
            torques[i] = rest.forward[i] if pattern[i] > 0 else rest.backward[i]
        elif rest.limited[i] != 0:
            if not _depends(rest, pattern, i):
                return False
            clamps[i] = rest.limited[i]
            torques[i] = rest.upper[i] if clamps[i] > 0 else rest.lower[i]
    for _ in range(count + 1):
        size = 0
        for i in range(count):
            if pattern[i] == 0 and clamps[i] == 0:
                free[size] = i
                size += 1
        right, weights = np.empty(size), np.empty(size)
        matrix = np.empty((size, size))
        for i in range(size):
            right[i] = -rest.rates[free[i]]
            for k in range(count):
                if pattern[k] != 0 or clamps[k] != 0:
                    right[i] -= rest.matrix[free[i], k] * torques[k]
            for k in range(size):
                matrix[i, k] = rest.matrix[free[i], free[k]]
            width = max(abs(rest.lower[free[i]]), abs(rest.upper[free[i]]))
            weights[i] = width if 0.0 < width < math.inf else 1.0
        if size > 0:
            found, residual = _least(matrix, right, weights)
            if residual > _ROUNDING * rest.scale:
                return False
            for i in range(size):
                torques[free[i]] = found[i]
        worst, beyond = -1, 0.0
        for i in range(size):
            at = free[i]
            room = _ROUNDING * max(abs(rest.lower[at]), abs(rest.upper[at]))
            if math.isinf(room):
                room = 0.0
            over = max(torques[at] - rest.upper[at], rest.lower[at] - torques[at])
            if over > room and over / weights[i] > beyond:
                worst, beyond = at, over / weights[i]
        if worst < 0:
            return _balanced(rest, pattern, torques)
        clamps[worst] = 1 if torques[worst] > rest.upper[worst] else -1
        torques[worst] = rest.upper[worst] if clamps[worst] > 0 else rest.lower[worst]
    return False


@compiled
def _depends(rest, pattern, which):
    """Return True if others that hold can take the torque of one."""
    count, size = pattern.size, 0
    others = np.empty(count, np.int64)
    for i in range(count):
        if pattern[i] == 0 and i != which and rest.limited[i] == 0:
            others[size] = i
            size += 1
    if size == 0:
        return False
    matrix, column = np.empty((size + 1, size)), np.empty(size + 1)
    for k in range(size):
        for i in range(size):
            matrix[i, k] = rest.matrix[others[i], others[k]]
        matrix[size, k] = rest.matrix[which, others[k]]
        column[k] = rest.matrix[others[k], which]
    column[size] = rest.matrix[which, which]
    solution = np.linalg.pinv(matrix, _SINGULAR) @ column
    return np.abs(matrix @ solution - column).max() <= _ROUNDING * column[size]


@compiled
def _balanced(rest, pattern, torques):
    """Return True if the contacts that hold do not move."""
    for i in range(pattern.size):
        if pattern[i] == 0 and abs(_rate(rest, torques, i)) > _ROUNDING * rest.scale:
            return False
    return True


@compiled
def _rate(rest, torques, i):
    """Rate of the sliding speed of a contact."""
    total = rest.rates[i]
    for k in range(torques.size):
        total += rest.matrix[i, k] * torques[k]
    return total


@compiled
def solve(rest, pattern, torques, clamps, flat):
    """Find the pattern of sticks and slips; False: there is none.

    flat : (count,) receives 1 where slip begins with a rate that is rounding
    """
    count = rest.contacts.size
    trial, best = np.zeros(count, np.int64), -1
    trial_clamps, trial_torques = np.zeros(count, np.int64), np.zeros(count)
    least = math.inf
    for code in range(3**count):
        left, held = code, 0
        for i in range(count):
            digit = left % 3
            trial[i] = 0 if digit == 0 else (1 if digit == 1 else -1)
            held += digit == 0
            left //= 3
        if held < best or not hold(rest, trial, trial_torques, trial_clamps):
            continue
        fits = True
        for i in range(count):
            if trial[i] != 0:
                rate = trial[i] * _rate(rest, trial_torques, i)
                room = _ROUNDING * rest.scale
                if rate < -room or (rate <= room and trial[i] != rest.preferred[i]):
                    fits = False
        if not fits:
            continue
        # Of patterns in which as many hold, that with the smallest share of a limit.
        share = 0.0
        for i in range(count):
            width = max(abs(rest.lower[i]), abs(rest.upper[i]))
            if trial[i] == 0 and 0.0 < width < math.inf:
                share = max(share, abs(trial_torques[i]) / width)
        if held > best or share < least:
            best, least = held, share
            pattern[:] = trial
            torques[:] = trial_torques
            clamps[:] = trial_clamps
            for i in range(count):
                rate = abs(_rate(rest, trial_torques, i))
                flat[i] = rate <= _ROUNDING * rest.scale
    return best >= 0
