"""Torques that hold contacts at rest, also where contacts depend on each other.

Contacts depend on each other where they close a loop of inertias (and the ground), such as two
brakes on one inertia: then many torques keep the balance, and the feasible ones with the least
sum of (torque/limit)^2 are taken.
"""

import numpy as np

from wedgebrake.dynamics.jit import compiled

# Relative size below which a pivot is zero.
_SINGULAR = 1e-10


@compiled
def _independent(matrix, count):
    """Numbers of rows of a symmetric semidefinite matrix that span the others."""
    left, chosen, size = matrix[:count, :count].copy(), np.empty(count, np.int64), 0
    for i in range(count):
        if left[i, i] <= _SINGULAR * matrix[i, i]:
            continue
        chosen[size] = i
        size += 1
        for k in range(i + 1, count):
            factor = left[k, i] / left[i, i]
            if factor != 0.0:
                for j in range(i, count):
                    left[k, j] -= factor * left[i, j]
    return chosen[:size]


@compiled
def _eliminate(matrix, rows):
    """Solve matrix x = rows in place; the matrix is symmetric and positive definite."""
    count = matrix.shape[0]
    for i in range(count):
        for k in range(i + 1, count):
            factor = matrix[k, i] / matrix[i, i]
            if factor != 0.0:
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
def least_torques(matrix, rows, weights, count):
    """Solve matrix x = rows with the least sum of (x/weight)^2, in place.

    matrix : (count, count) or larger, symmetric and semidefinite
    rows   : (count, columns) or more, right sides of a system that has a solution

    Returns the rank of the matrix; the solution is unique if the rank is ``count``.
    """
    if count <= 1:  # without workspace
        for j in range(rows.shape[1] if count == 1 else 0):
            rows[0, j] /= matrix[0, 0]
        return count
    chosen = _independent(matrix, count)
    rank, columns = chosen.size, rows.shape[1]
    if rank == count:
        _eliminate(matrix[:count, :count].copy(), rows[:count])
        return rank
    squares, right = np.zeros((rank, rank)), np.empty((rank, columns))
    for i in range(rank):
        right[i] = rows[chosen[i]]
        for j in range(rank):
            for k in range(count):
                part = matrix[chosen[i], k] * weights[k] * weights[k]
                squares[i, j] += part * matrix[chosen[j], k]
    _eliminate(squares, right)
    for k in range(count):
        for j in range(columns):
            rows[k, j] = 0.0
            for i in range(rank):
                rows[k, j] += weights[k] * weights[k] * matrix[chosen[i], k] * right[i, j]
    return rank
