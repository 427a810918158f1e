"""Matrices of a machine, which describe how shafts and contacts join its inertias."""

from __future__ import annotations

import numpy as np

from wedgebrake.arrays import FloatArray
from wedgebrake.model.joints import free_motions, joint_rows
from wedgebrake.model.machine import Machine
from wedgebrake.model.machine_parts import GROUND, Driven, OverAngle
from wedgebrake.model.validation import wrong

# Eigenvalues of the stiffness smaller than this share of the largest are rounding.
RANK = 1e-10


def shaft_rows(machine: Machine) -> FloatArray:
    """Factors of the angles in the twist of each shaft, q_a - ratio q_b: (shafts, n)."""
    rows = np.zeros((len(machine.shafts), len(machine.inertias)))
    for row, shaft in zip(rows, machine.shafts, strict=True):
        for end, factor in ((shaft.a, 1.0), (shaft.b, -shaft.ratio)):
            if end != GROUND:
                row[machine.index(end)] += factor
    return rows


def free_rotations(machine: Machine) -> FloatArray:
    """Factors of the angles in each rotation that changes no torque: (rotations, n).

    One for each part of the machine that shafts join to each other but not to the ground. Shafts
    without stiffness, which are dampers, may be twisted.
    """
    stiff = shaft_rows(machine)[stiffnesses(machine) > 0.0]
    normals = normal_rows(machine)[:, : len(machine.inertias)]
    acting = [one[one.any(axis=1)] for one in (normals, controlled_angles(machine))]
    rows = np.vstack([stiff, over_angle(machine)[0], *acting])
    if machine.joints:
        return _rotations_with_joints(np.vstack([joint_rows(machine), rows]))
    found = []
    left = set(range(len(machine.inertias)))
    while left:
        part, ahead = np.zeros(len(machine.inertias)), [min(left)]
        part[ahead[0]] = 1.0
        while ahead:
            inertia = ahead.pop()
            left.discard(inertia)
            for row in rows[rows[:, inertia] != 0.0]:
                for other in np.flatnonzero(row):
                    if other in left and part[other] == 0.0:
                        part[other] = -row[inertia] * part[inertia] / row[other]
                        ahead.append(int(other))
        if np.all(np.abs(rows @ part) <= RANK * (np.abs(rows) @ np.abs(part))):
            found.append(part)
    return np.array(found).reshape(-1, len(machine.inertias))


def _rotations_with_joints(rows: FloatArray) -> FloatArray:
    """Rotations along which no row changes, of each of which one entry is 1 and 0 in the others."""
    n = rows.shape[1]
    follow, left = np.eye(n), list(range(n))
    for row in rows:
        reduced = row @ follow
        scale = np.abs(row) @ np.abs(follow).max(axis=1)
        at = int(np.argmax(np.abs(reduced)))
        if abs(reduced[at]) > RANK * scale:
            follow += np.outer(follow[:, at], -reduced / reduced[at])
            follow[:, at] = 0.0
            left.remove(at)
    follow[np.abs(follow) <= RANK * np.abs(follow).max(axis=1, keepdims=True)] = 0.0
    return follow[:, left].T


def over_angle(machine: Machine) -> tuple[FloatArray, FloatArray]:
    """Rows of the angles over which torques are given, (k, n), and their largest slopes, (k,)."""
    rows, slopes = [], []
    for torque in machine.torques:
        if isinstance(torque.signal, OverAngle):
            row = np.zeros(len(machine.inertias))
            row[machine.index(torque.on)] = 1.0
            if torque.relative_to is not None:
                row[machine.index(torque.relative_to)] = -1.0
            rows.append(row)
            scale = torque.signal.throttle
            largest = 1.0 if scale is None else scale.bound
            slopes.append(largest * max(map(abs, torque.signal.law.slopes)))
    return np.array(rows).reshape(-1, len(machine.inertias)), np.array(slopes)


def stiffnesses(machine: Machine) -> FloatArray:
    """Stiffness of each shaft, the largest one of a shaft with stages [N m/rad]."""
    return np.array([one.largest_stiffness for one in machine.shafts], float)


def shaft_matrices(machine: Machine, *, linear: bool = False) -> tuple[FloatArray, FloatArray]:
    """Stiffness [N m/rad] and damping [N m s/rad] of the shafts, (n, n) each.

    linear : whether shafts with a law, which are elements, are left out; otherwise they have their
             largest stiffness, and torques over angles have that of their largest slope
    """
    rows = shaft_rows(machine)
    acts = np.array([not linear or one.law is None for one in machine.shafts], float)
    stiffness = acts * stiffnesses(machine)
    damping = acts * np.array([one.damping for one in machine.shafts])
    found = rows.T @ (stiffness[:, None] * rows)
    if not linear:
        angles, slopes = over_angle(machine)
        if len(slopes):
            found += angles.T @ (slopes[:, None] * angles)
    return found, rows.T @ (damping[:, None] * rows)


def masses(machine: Machine) -> FloatArray:
    """The inertias whose motion is not given, 0 for driven bodies [kg m^2]."""
    return np.array([0.0 if isinstance(one, Driven) else one.inertia for one in machine.inertias])


def natural_frequencies(machine: Machine) -> FloatArray:
    """Undamped natural frequencies of inertias and shafts, without contacts [rad/s], ascending.

    Free rotations, whose frequency is 0, are left out: (m,).
    """
    inertia = np.array([one.inertia for one in machine.inertias])
    stiffness, _ = shaft_matrices(machine)
    if machine.joints:
        basis = free_motions(machine)
        inverse = np.linalg.inv(root_of_inertias(machine, basis))
        springs = basis.T @ stiffness @ basis
        squares = np.asarray(np.linalg.eigvalsh(inverse @ springs @ inverse.T), float)
    else:
        by_inertia = np.sqrt(np.outer(inertia, inertia))
        squares = np.asarray(np.linalg.eigvalsh(stiffness / by_inertia), float)
    return np.asarray(np.sqrt(squares[squares > RANK * max(squares[-1], 0.0)]))


def root_of_inertias(machine: Machine, basis: FloatArray) -> FloatArray:
    """(f, f) lower triangular root of the inertias of motions, (n, f)."""
    return np.asarray(np.linalg.cholesky(basis.T @ (masses(machine)[:, None] * basis)))


def normal_rows(machine: Machine) -> FloatArray:
    """Factors of the angles and speeds of the inertias in the normal force: (contacts, 2 n)."""
    n = len(machine.inertias)
    rows = np.zeros((len(machine.contacts), 2 * n))
    for row, contact in zip(rows, machine.contacts, strict=True):
        for name, factor in contact.normal.items():
            body, _, what = name.rpartition(".")
            row[machine.index(body) + (n if what == "speed" else 0)] += factor
    return rows


def controlled_angles(machine: Machine) -> FloatArray:
    """Factors of the angles of the inertias that each controller measures: (controllers, n)."""
    rows = np.zeros((len(machine.controllers), len(machine.inertias)))
    for row, loop in zip(rows, machine.controllers, strict=True):
        for name, factor in loop.measured.items():
            body, _, what = name.rpartition(".")
            if what == "angle":
                row[machine.index(body)] += factor
    return rows


def check_restrained(machine: Machine) -> None:
    """Check that shafts restrain all angles on which normal forces depend.

    Raises ``InputError`` for a contact whose force would grow as inertias turn.
    """
    rows = normal_rows(machine)[:, : len(machine.inertias)]
    if not rows.any():
        return
    stiffness = shaft_matrices(machine)[0]
    if machine.joints:
        basis = free_motions(machine)
        stiffness, rows = basis.T @ stiffness @ basis, rows @ basis
    sizes, shapes = np.linalg.eigh(stiffness)
    free = shapes[:, sizes <= RANK * max(sizes[-1], 0.0)]
    for contact, row in zip(machine.contacts, rows, strict=True):
        if np.abs(row @ free).max(initial=0.0) > RANK * np.abs(row).max():
            raise wrong(
                f"{contact.name}.normal", dict(contact.normal), "of angles that shafts restrain",
                "Join the inertia to the ground by a shaft, or use wb.simulate.",
            )  # fmt: skip


def contact_rows(machine: Machine) -> FloatArray:
    """Factors of the speeds in the sliding speed of each contact, 1 and -ratio: (contacts, n).

    The speed of a moving base must be subtracted from the result.
    """
    rows = np.zeros((len(machine.contacts), len(machine.inertias)))
    for row, contact in zip(rows, machine.contacts, strict=True):
        row[machine.index(contact.a)] += 1.0
        if contact.b != GROUND:
            row[machine.index(contact.b)] -= contact.ratio
    return rows
