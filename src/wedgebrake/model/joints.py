"""Rigid joints of a machine: which bodies follow others, and their angles and speeds at the start.

The joints are linear equations J q = 0 between the angles of the bodies. Each is solved for one
body, the first one of the joint that is not driven and that no other joint determines. Hence
q = T q_f, with the angles q_f of the other bodies, which are free or driven.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from wedgebrake.arrays import FloatArray
from wedgebrake.errors import InputError
from wedgebrake.model.machine_parts import Body, Driven, Inertia, Joint, speed_at
from wedgebrake.model.validation import wrong

if TYPE_CHECKING:
    from wedgebrake.model.machine import Machine

# Relative size of a factor that is rounding, and of one that is too small to solve for its body.
_ROUNDING, _SMALL = 1e-12, 1e-3
# Relative difference from a joint that is allowed in angles and speeds at the start.
_AGREE = 1e-9


class Reduction(NamedTuple):
    """The motion of all bodies in terms of those that are free or driven.

    follow : (n, n) angles of all bodies in terms of those of the free and the driven ones
    free   : numbers of the free bodies
    """

    follow: FloatArray
    free: tuple[int, ...]

    @property
    def basis(self) -> FloatArray:
        """(n, free) motions that the joints allow without motion of driven bodies."""
        return self.follow[:, list(self.free)]


def joint_rows(machine: Machine) -> FloatArray:
    """Factors of the angles in each joint, whose sum is zero: (joints, n)."""
    return _rows(machine.joints, [one.name for one in machine.inertias])


def _rows(joints: Sequence[Joint], names: Sequence[str]) -> FloatArray:
    rows = np.zeros((len(joints), len(names)))
    for row, joint in zip(rows, joints, strict=True):
        for name, factor in joint.factors.items():
            row[names.index(name)] += factor
    return rows


def is_coupled(machine: Machine) -> bool:
    """True if torques of contacts act on bodies through ratios or joints."""
    return bool(machine.joints) or any(one.geared for one in machine.contacts)


def reduction(machine: Machine) -> Reduction:
    """The bodies that are free, and how the others follow.

    Raises ``InputError``, which names a joint that other joints already determine, or that leaves
    no freedom.
    """
    bodies = tuple(one.name for one in machine.inertias)
    driven = tuple(one.name for one in machine.inertias if isinstance(one, Driven))
    return _reduction(machine.joints, bodies, driven)


@lru_cache(maxsize=64)
def _reduction(
    joints: tuple[Joint, ...], bodies: tuple[str, ...], driven: tuple[str, ...]
) -> Reduction:
    n, moving = len(bodies), len(bodies) - len(driven)
    follow, dependent = np.eye(n), list[int]()
    for joint, row in zip(joints, _rows(joints, bodies), strict=True):
        left = row @ follow
        left[np.abs(left) <= _ROUNDING * (np.abs(row) @ np.abs(follow))] = 0.0
        if not np.any(left):
            raise wrong(
                joint.name, joint, "left out: other joints already determine it",
                "Even without it, its bodies move as it requires.",
            )  # fmt: skip
        sizes = np.abs(left[:moving])
        if not np.any(sizes):
            raise wrong(
                joint.name, joint, "left out: driven bodies determine the motion of its bodies",
                "Give the speed of one of them only.",
            )  # fmt: skip
        ends = [bodies.index(getattr(joint, end)) for end in joint.ends]
        order = [one for one in (*ends, *range(moving)) if one < moving]
        at = next(one for one in order if sizes[one] >= _SMALL * sizes.max())
        follow += np.outer(follow[:, at], -left / left[at])
        follow[:, at] = 0.0
        follow[np.abs(follow) <= _ROUNDING * np.abs(follow).max(axis=1, keepdims=True)] = 0.0
        dependent.append(at)
        stuck = np.flatnonzero(~follow.any(axis=1))
        if stuck.size:
            raise wrong(
                joint.name, joint, f"such that {bodies[stuck[0]]} can turn",
                "Together with the other joints it leaves no freedom. Leave out one of them.",
            )  # fmt: skip
    free = tuple(one for one in range(moving) if one not in dependent)
    if not free:
        raise wrong(
            "inertias", bodies, "a list with an inertia that moves freely",
            "The joints and the driven bodies determine all motion. Leave out a joint.",
        )  # fmt: skip
    follow.setflags(write=False)
    return Reduction(follow, free)


def free_motions(machine: Machine) -> FloatArray:
    """(n, f) motions that the joints allow without motion of driven bodies."""
    if machine.joints:
        return reduction(machine).basis
    return np.eye(len(machine.inertias), len(machine.inertias) - len(machine.driven))


class Mobility(NamedTuple):
    """Accelerations of the bodies of a machine.

    by_torque : (n, n) per torque on the bodies
    project   : (n, n) speeds after the impulses of the joints, of any speeds before; those of
                driven bodies do not change. Hence accelerations of all bodies per acceleration of
                each driven one
    """

    by_torque: FloatArray
    project: FloatArray


def mobility(machine: Machine) -> Mobility:
    """How torques and driven bodies accelerate the bodies of a machine.

    With the inertias M and the motions T that the joints allow, T'M (T a_f + a_d) = T' torques.
    Here a_f are the accelerations of the free bodies, and a_d those of all bodies if a_f = 0.
    """
    given, moving = reduction(machine), len(machine.inertias) - len(machine.driven)
    basis, masses = given.basis, np.zeros(len(machine.inertias))
    masses[:moving] = [one.inertia for one in machine.inertias[:moving]]
    found = basis @ np.linalg.solve(basis.T @ (masses[:, None] * basis), basis.T)
    found = 0.5 * (found + found.T)
    project, carried = found * masses, given.follow[:, moving:]
    project[:, moving:] = carried - found @ (masses[:, None] * carried)
    return Mobility(found, project)


def accelerations(machine: Machine, load: FloatArray, driven: FloatArray) -> FloatArray:
    """Accelerations of the bodies [rad/s^2].

    load   : (..., n) torques on them, without those of joints [N m]
    driven : (..., n) accelerations of the driven bodies; those of the others are not used
    """
    moving = len(machine.inertias) - len(machine.driven)
    if not machine.joints:
        found = load / np.array([one.inertia for one in machine.inertias])
        found[..., moving:] = driven[..., moving:]
        return np.asarray(found)
    by_torque, project = mobility(machine)
    return np.asarray(load @ by_torque.T + driven[..., moving:] @ project[:, moving:].T)


def joint_torques(machine: Machine, load: FloatArray, driven: FloatArray) -> FloatArray:
    """Torques T of the joints, (..., joints); each acts as -f T on a body with the factor f [N m].

    load, driven : as for ``accelerations``
    """
    rows, moving = joint_rows(machine), len(machine.inertias) - len(machine.driven)
    inverse = 1.0 / np.array([one.inertia for one in machine.inertias])
    impulses = inverse[:, None] * rows.T
    needed = load @ impulses + driven[..., moving:] @ rows[:, moving:].T
    return np.asarray(np.linalg.solve(rows @ impulses, needed[..., None])[..., 0])


def with_followers(machine: Machine, field: str, values: dict[str, float]) -> FloatArray:
    """Angles or speeds of all bodies, (n,), of which some are given.

    The others follow from these where the joints determine them; otherwise they are those of the
    machine.

    Raises ``InputError`` for values that contradict a joint.
    """
    names = [one.name for one in machine.inertias]
    found = np.array([_value(one, field) for one in machine.inertias])
    given = np.array([one in values for one in names])
    found[given] = [values[one] for one in names if one in values]
    if machine.joints:
        _complete(joint_rows(machine), given.copy(), found)
        _check(machine, joint_rows(machine), field, given, found)
    return found


def started_together(machine: Machine) -> tuple[Body, ...]:
    """The bodies of a machine with angles and speeds at the start that its joints allow.

    Values that are left out follow from the others where the joints determine them.

    Raises ``InputError`` for joints that do not fit together, and for values that contradict a
    joint.
    """
    bodies = machine.inertias
    if not machine.joints:
        return bodies
    reduction(machine)
    rows, found = joint_rows(machine), list(bodies)
    for field in ("angle", "speed"):
        given = np.array([_is_given(one, field) for one in bodies])
        values = np.array([_value(one, field) for one in bodies])
        values[~given] = 0.0
        known = _complete(rows, given.copy(), values)
        _check_known(machine, rows, field, known, values)
        _check(machine, rows, field, given, values)
        for number in np.flatnonzero(known & ~given):
            found[number] = _following(found[number], field, float(values[number]))
    return tuple(found)


def without_dependent(machine: Machine) -> list[Body]:
    """The bodies of a machine, without initial values for those that follow others."""
    free = reduction(machine).free
    return [
        Inertia(one.name, one.inertia) if isinstance(one, Inertia) and number not in free else one
        for number, one in enumerate(machine.inertias)
    ]


def check_agrees(machine: Machine, angles: Any, speeds: Any) -> None:
    """Raise ``InputError`` if angles and speeds of the bodies contradict a joint."""
    if not machine.joints:
        return
    rows, given = joint_rows(machine), np.ones(len(machine.inertias), bool)
    for field, values in (("angle", angles), ("speed", speeds)):
        _check(machine, rows, field, given, np.asarray(values, float))


def _is_given(body: Body, field: str) -> bool:
    return isinstance(body, Driven) or field in body.model_fields_set


def _value(body: Body, field: str) -> float:
    if field == "angle":
        return body.angle
    try:
        return speed_at(body, 0.0)
    except InputError:  # a signal that begins later: the run sets the speed
        return 0.0


def _complete(rows: FloatArray, known: Any, values: FloatArray) -> Any:
    """Set the values that the known ones determine; returns which are then known."""
    while True:
        single = [row for row in rows if np.count_nonzero(row[~known]) == 1]
        if not single:
            break
        at = int(np.flatnonzero((single[0] != 0.0) & ~known)[0])
        others = np.delete(np.arange(len(values)), at)
        values[at] = -(single[0][others] @ values[others]) / single[0][at] + 0.0
        known[at] = True
    left = np.flatnonzero(~known)
    if left.size and rows.size:
        inverse = np.linalg.pinv(rows[:, left], _AGREE)
        determined = 1.0 - np.diag(inverse @ rows[:, left]) <= _AGREE
        solution = -inverse @ (rows[:, known] @ values[known])
        values[left[determined]] = solution[determined]
        known[left[determined]] = True
    return known


def _check_known(
    machine: Machine, rows: FloatArray, field: str, known: Any, values: FloatArray
) -> None:
    """Raise ``InputError`` for a body that moves at the start, in a joint that leaves others open.

    Bodies of which none is given to move are at rest.
    """
    for joint, row in zip(machine.joints, rows, strict=True):
        bodies = np.flatnonzero(row)
        missing = [f"{machine.inertias[one].name}.{field}" for one in bodies if not known[one]]
        if missing and np.any(values[bodies]):
            raise InputError(
                f"{missing[0]}: missing, as {joint.name} does not determine"
                f" {' and '.join(missing)} from the values that are given. Give one of them.",
                name=missing[0], allowed="given",
            )  # fmt: skip


def _check(machine: Machine, rows: FloatArray, field: str, given: Any, values: FloatArray) -> None:
    """Raise ``InputError`` if values contradict a joint; it names a value that is given."""
    rounding = _ROUNDING * np.abs(values).max(initial=0.0)
    limits = np.abs(rows) @ (_AGREE * np.abs(values) + rounding)
    for joint, row, limit in zip(machine.joints, rows, limits, strict=True):
        if abs(row @ values) <= limit:
            continue
        bodies = np.flatnonzero(row)
        free = [one for one in bodies if isinstance(machine.inertias[one], Inertia)]
        at = next((one for one in free if given[one]), free[-1])
        wanted = values[at] - (row @ values) / row[at]
        others = [machine.inertias[one].name for one in bodies if one != at]
        raise wrong(
            f"{machine.inertias[at].name}.{field}", float(values[at]),
            f"{wanted:.10g}, as {joint.name} joins it to {' and '.join(others)}",
            "Leave it out; it then follows from the other body."
            if len(bodies) == 2
            else "Give the values of two of the three bodies; the third one then follows.",
        )  # fmt: skip


def _following(body: Body, field: str, value: float) -> Body:
    """A body with a value at the start that counts as left out."""
    found = body.model_copy(update={field: value})
    found.__pydantic_fields_set__.discard(field)
    return found
