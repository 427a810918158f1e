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
    machine: Machine, torque: FloatArray, force: FloatArray, sticking: NDArray[np.bool_],
    reached: NDArray[np.int8] | None = None,
) -> FloatArray:  # fmt: skip
    """Torques of the contacts of a machine with the least sum of (torque/limit)^2.

    torque   : (k, contacts) at some times, as the solver shares them, positive on a [N m]
    force    : (k, contacts) actuation forces [N]
    sticking : (k, contacts) whether each contact is at rest
    reached  : as of ``limits_reached``, if these limits and no others are to bind; the torques are
               then smooth in all numbers
    """
    directions = _directions(machine)
    if _loops(directions).shape[1] == 0:
        return torque
    per_force = _per_force(machine)
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
        kept = None if reached is None else reached[times, held]
        found[times, held] = _least(torque[times, held], loops, (lower, upper), kept)
    return found


def limits_reached(
    machine: Machine, torque: FloatArray, force: FloatArray, sticking: NDArray[np.bool_]
) -> NDArray[np.int8]:
    """Whether each contact at rest bears the most it can, (k, contacts), as in ``least_shares``.

    1: at the largest torque; -1: at the least; 0: at neither
    """
    lower, upper = _limits(_per_force(machine), force)
    held, sign = sticking & (force > 0.0), np.zeros(torque.shape, np.int8)
    for side, limit in ((-1, lower), (1, upper)):
        known = held & np.isfinite(limit)
        sign[known] += np.int8(side) * (
            np.abs(torque[known] - limit[known]) <= _NEAR * np.abs(limit[known])
        )
    return sign


def _per_force(machine: Machine) -> FloatArray:
    """(contacts, 2) least and largest torque that holds, per actuation force."""
    return np.array(
        [
            [-one.brake.radius * one.brake.amplification(side * one.friction.breakaway)  # type: ignore[attr-defined]
             for side in (1.0, -1.0)]
            for one in machine.contacts
        ]
    )  # fmt: skip


def depend(machine: Machine) -> bool:
    """Whether contacts at rest may share a torque in several ways."""
    return bool(_loops(_directions(machine)).shape[1] > 0)


def _directions(machine: Machine) -> FloatArray:
    """(inertias, contacts) torques of the contacts on the free coordinates, per torque."""
    directions = contact_rows(machine).T
    return free_motions(machine).T @ directions if machine.joints else directions


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
    torque: FloatArray, loops: FloatArray, limits: tuple[FloatArray, FloatArray],
    reached: NDArray[np.int8] | None,
) -> FloatArray:  # fmt: skip
    """The torques of some contacts, (k, contacts) at k times.

    With torque + loops y = width (A y + b), the least |A y + b| is found, where A = Q R, as the
    least |z| for z = R y + Q' b. Where this is beyond limits, these are inequalities for z.
    """
    lower, upper = limits
    width = np.maximum(np.abs(lower), np.abs(upper))
    largest = np.max(width, axis=1, where=np.isfinite(width), initial=0.0, keepdims=True)
    largest = np.where(largest > 0.0, largest, 1.0)
    # A contact without a limit takes all that it can.
    width = np.where(width > 0.0, np.minimum(width, _NO_LIMIT * largest), largest)
    q, r = np.linalg.qr(loops / width[..., None])
    basis = loops @ np.linalg.inv(r)  # torques per z
    begin = np.swapaxes(q, 1, 2) @ (torque / width)[..., None]
    free = torque - (basis @ begin)[..., 0]
    if reached is not None:
        return _bound(free, basis, np.where(reached > 0, upper, lower), reached != 0)
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


def _bound(
    free: FloatArray, basis: FloatArray, limit: FloatArray, binds: NDArray[np.bool_]
) -> FloatArray:
    """The torques with the least |z| where some contacts bear their limits, all (k, contacts)."""
    found = free.copy()
    patterns, which = np.unique(binds, axis=0, return_inverse=True)
    for number, pattern in enumerate(patterns):
        times = np.flatnonzero(which.ravel() == number)
        if pattern.any():
            rows = basis[times]
            missing = (limit - free)[times][:, pattern, None]
            found[times] += (rows @ (np.linalg.pinv(rows[:, pattern]) @ missing))[..., 0]
    return found


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
