"""Bodies that contacts join, and the torques of these contacts that follow from equilibrium.

Contacts that hold are reactions: each body that they join needs a torque for the acceleration of
its group. Where they form a tree, the torques follow from the ends of its branches inwards. Further
contacts close loops, around which any torque can be passed; the one with the least sum of
(torque/weight)^2 is taken. Equilibrium is kept to rounding in either case.

Loops, not assignments of one array to another: for each of these Numba compiles its message about
unequal shapes too, which takes longer than most of these functions.
"""

import math

import numpy as np

from wedgebrake.dynamics.jit import compiled

# Weights of a contact without a limit, and of one that holds no torque, in those of the others.
# The torque that passes through the latter, as the square of its weight, is rounding.
_NO_LIMIT, _NONE = 1e3, 1e-7


@compiled
def groups_of(a, b, nodes):
    """Number of the group of each node, the smallest one of its nodes: (nodes,).

    a, b : (count,) nodes joined by each contact
    """
    group = np.arange(nodes)
    for i in range(a.size):
        one, other = group[a[i]], group[b[i]]
        if one != other:
            low, high = min(one, other), max(one, other)
            for node in range(nodes):
                if group[node] == high:
                    group[node] = low
    return group


@compiled
def is_spanned(a, b, held, without):
    """Return True if others of the held contacts join both nodes of one of them.

    held : (count,) whether each contact holds
    """
    kept = held.copy()
    kept[without] = False
    group = groups_of(a[kept], b[kept], max(a.max(), b.max()) + 1)
    return group[a[without]] == group[b[without]]


@compiled
def descending(weights):
    """Indices of the few weights in descending order; NumPy's sorts take long to compile."""
    order = np.arange(weights.size)
    for i in range(1, order.size):
        number, at = order[i], i
        while at > 0 and weights[order[at - 1]] < weights[number]:
            order[at] = order[at - 1]
            at -= 1
        order[at] = number
    return order


@compiled
def _forest(a, b, weights, nodes):
    """A spanning forest of the contacts with the largest weights, from the last node outwards.

    Returns the nodes in the order in which they are reached, the contact towards the root of each
    node (-1 for a root), and the other contacts, which close loops.
    """
    group, inside = np.arange(nodes), np.zeros(a.size, np.bool_)
    for i in descending(weights):
        one, other = group[a[i]], group[b[i]]
        if one != other:
            inside[i] = True
            for node in range(nodes):
                if group[node] == one:
                    group[node] = other
    order, towards = np.empty(nodes, np.int64), np.full(nodes, -1)
    reached, size, at = np.zeros(nodes, np.bool_), 0, 0
    for root in range(nodes - 1, -1, -1):
        if reached[root]:
            continue
        reached[root], order[size], size = True, root, size + 1
        while at < size:
            node = order[at]
            at += 1
            for i in range(a.size):
                if inside[i] and (a[i] == node or b[i] == node):
                    other = b[i] if a[i] == node else a[i]
                    if not reached[other]:
                        reached[other], order[size], size = True, other, size + 1
                        towards[other] = i
    return order, towards, np.flatnonzero(~inside)


@compiled
def eliminate(matrix, rows):
    """Solve matrix x = rows in place; the matrix is symmetric and positive definite."""
    count = matrix.shape[0]
    for i in range(count):
        for k in range(i + 1, count):
            factor = matrix[k, i] / matrix[i, i]
            for j in range(i, count):
                matrix[k, j] -= factor * matrix[i, j]
            for j in range(rows.shape[1]):
                rows[k, j] -= factor * rows[i, j]
    for i in range(count - 1, -1, -1):
        for j in range(rows.shape[1]):
            for k in range(i + 1, count):
                rows[i, j] -= matrix[i, k] * rows[k, j]
            rows[i, j] /= matrix[i, i]


@compiled
def weights_of(capacities):
    """Capacities as positive numbers: those without a limit are larger than the others."""
    weights, largest = np.ones(capacities.size), 0.0
    for one in capacities:
        largest = max(largest, one) if math.isfinite(one) else largest
    for i in range(weights.size):
        if math.isinf(capacities[i]):
            weights[i] = _NO_LIMIT * largest if largest > 0.0 else 1.0
        elif capacities[i] > 0.0:
            weights[i] = capacities[i]
        else:
            weights[i] = _NONE * largest if largest > 0.0 else 1.0
    return weights


@compiled
def pass_around(found, loops, weights):
    """Add the torques around loops with which the sum of (torque/weight)^2 is the least.

    found : (count, columns + loops) torques, and those due to a unit torque around each loop
    """
    size, columns = loops.size, found.shape[1] - loops.size
    matrix, right = np.zeros((size, size)), np.zeros((size, columns))
    for i in range(weights.size):
        square = (weights[loops[0]] / weights[i]) ** 2
        for k in range(size):
            part = square * found[i, columns + k]
            if part != 0.0:
                for j in range(size):
                    matrix[k, j] += part * found[i, columns + j]
                for j in range(columns):
                    right[k, j] -= part * found[i, j]
    eliminate(matrix, right)
    for i in range(weights.size):
        for k in range(size):
            part = found[i, columns + k]
            if part != 0.0:
                for j in range(columns):
                    found[i, j] += part * right[k, j]


@compiled
def reactions(a, b, capacities, need, torque):
    """Store the torques of contacts that hold, each on its node ``a`` and opposite on ``b``.

    a, b    : (count,) nodes joined by each contact
    capacities : (count,) largest torque of each contact; torque in loops is shared like their
              squares
    need    : (nodes, columns) torques that the nodes need; the last node is the ground, whose need
              is not used
    torque  : (count, columns) result

    Returns the number of loops.
    """
    nodes, columns = need.shape
    weights = weights_of(capacities)
    order, towards, loops = _forest(a, b, weights, nodes)
    size = loops.size
    # Further columns: the needs due to a unit torque in each contact that closes a loop.
    left, found = np.zeros((nodes, columns + size)), np.zeros((a.size, columns + size))
    for node in range(nodes):
        for j in range(columns):
            left[node, j] = need[node, j]
    for k in range(size):
        left[a[loops[k]], columns + k] = -1.0
        left[b[loops[k]], columns + k] = 1.0
        found[loops[k], columns + k] = 1.0
    for node in order[::-1]:
        i = towards[node]
        if i < 0:
            continue
        inner, sign = (b[i], 1.0) if a[i] == node else (a[i], -1.0)
        for j in range(columns + size):
            found[i, j] = sign * left[node, j]
            left[inner, j] += left[node, j]
    if size > 0:
        pass_around(found, loops, weights)
    for i in range(a.size):
        for j in range(columns):
            torque[i, j] = found[i, j]
    return size
