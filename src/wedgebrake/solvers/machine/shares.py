"""Shares of contacts at rest that depend on each other, as a response reports them.

Two brakes that hold one inertia share its torque in many ways that all lead to the same motion. The
solver keeps the shares that the limits had when the stick began or a contact last reached its
limit. Reported are those of docs/equations.md, "Contacts at rest", at each time: within the limits,
with the least sum of (torque/limit)^2. They are the solver's plus what the contacts can pass around
a loop of inertias, which is found from a quadratic problem with linear inequalities (Lawson and
Hanson, Solving Least Squares Problems, chapter 23).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import null_space
from scipy.optimize import nnls

from wedgebrake.arrays import FloatArray
from wedgebrake.model.joints import free_motions
from wedgebrake.model.machine import Machine
from wedgebrake.model.machine_matrices import contact_rows

# Share of a limit by which torques beyond it are rounding.
_ROUNDING = 1e-12
_NEAR = 1e-9
# Limit of a contact that has none, in those of the others: they are left less than rounding.
_NO_LIMIT = 1e8


def least_shares(
    machine: Machine, torque: FloatArray, force: FloatArray, sticking: NDArray[np.bool_]
) -> FloatArray:
    """Torques of the contacts of a machine with the least sum of (torque/limit)^2.

    torque   : (k, contacts) at some times, as the solver shares them, positive on a [N m]
    force    : (k, contacts) actuation forces [N]
    sticking : (k, contacts) whether each contact is at rest
    """
    directions = contact_rows(machine).T
    if machine.joints:
        directions = free_motions(machine).T @ directions
    if _loops(directions).shape[1] == 0:
        return torque
    per_force = np.array(
        [
            [-one.brake.radius * one.brake.amplification(side * one.friction.breakaway)  # type: ignore[attr-defined]
             for side in (1.0, -1.0)]
            for one in machine.contacts
        ]
    )  # fmt: skip
    found = torque.copy()
    # A contact without force transmits nothing.
    patterns, which = np.unique(sticking & (force > 0.0), axis=0, return_inverse=True)
    for number, pattern in enumerate(patterns):
        held = np.flatnonzero(pattern)
        loops = _loops(directions[:, held])
        if loops.shape[1] == 0:
            continue
        times = np.flatnonzero(which.ravel() == number)[:, None]
        lower, upper = _limits(per_force[held], force[times, held])
        found[times, held] = _least(torque[times, held], loops, lower, upper)
    return found


def _loops(directions: FloatArray) -> FloatArray:
    """(contacts, loops) independent torques without effect on any inertia.

    directions : (inertias, contacts) torques on the inertias of a unit torque of each contact
    """
    count = directions.shape[1]
    return np.asarray(null_space(directions)) if count > 1 else np.zeros((count, 0))


def _limits(per_force: FloatArray, force: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Least and largest torques that hold; a pressed brake that locks itself has no limit."""
    pressed = np.where(force > 0.0, force, 1.0)
    torques = np.where(force[..., None] > 0.0, per_force * pressed[..., None], 0.0)
    return torques[..., 0], torques[..., 1]


def _least(
    torque: FloatArray, loops: FloatArray, lower: FloatArray, upper: FloatArray
) -> FloatArray:
    """The torques of some contacts, (k, contacts) at k times.

    With torque + loops y = width (A y + b), the least |A y + b| is found, where A = Q R, as the
    least |z| for z = R y + Q' b. Where this is beyond limits, these are inequalities for z.
    """
    width = np.maximum(np.abs(lower), np.abs(upper))
    largest = np.max(width, axis=1, where=np.isfinite(width), initial=0.0, keepdims=True)
    largest = np.where(largest > 0.0, largest, 1.0)
    # A contact without a limit takes all that it can.
    width = np.where(width > 0.0, np.minimum(width, _NO_LIMIT * largest), largest)
    q, r = np.linalg.qr(loops / width[..., None])
    basis = loops @ np.linalg.inv(r)  # torques per z
    begin = np.swapaxes(q, 1, 2) @ (torque / width)[..., None]
    free = torque - (basis @ begin)[..., 0]
    tolerance = _ROUNDING * width
    beyond = np.any((free < lower - tolerance) | (free > upper + tolerance), axis=1)
    for time in np.flatnonzero(beyond):
        below, above = lower[time] - free[time], free[time] - upper[time]
        found = _bounded(
            basis[time] / width[time, :, None], below / width[time], above / width[time]
        )
        least = torque[time] if found is None else free[time] + basis[time] @ found
        # Where hardly any other share is within the limits, rounding may lead beyond them.
        within = np.all(
            np.abs(np.clip(least, lower[time], upper[time]) - least) <= width[time] * _NEAR
        )
        free[time] = least if within else torque[time]
    return free


def _bounded(rows: FloatArray, below: FloatArray, above: FloatArray) -> FloatArray | None:
    """The least |z| with rows z >= below and -rows z >= above; None if there is no z.

    z follows from the u >= 0 that comes closest to [rows' u, least u] = [0, 1].
    """
    sides = np.concatenate([rows[np.isfinite(below)], -rows[np.isfinite(above)]])
    least = np.concatenate([below[np.isfinite(below)], above[np.isfinite(above)]])
    problem = np.concatenate([sides.T, least[None]])
    wanted = np.append(np.zeros(rows.shape[1]), 1.0)
    left = problem @ nnls(problem, wanted)[0] - wanted
    return None if abs(left[-1]) <= _ROUNDING else -left[:-1] / left[-1]
