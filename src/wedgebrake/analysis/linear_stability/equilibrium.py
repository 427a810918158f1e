"""A machine linearised about an equilibrium: one piece of each element, and steady forces.

In steady sliding at given speeds, the torques of the shafts, the elements and the contacts balance
the loads in all rotations that shafts restrain. This is one piecewise-linear equation for the
angles of these rotations. It is solved by Newton's method from the initial angles, which ends with
the solution of one linear system.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, NamedTuple, NoReturn

import numpy as np

from wedgebrake.analysis.linear_stability.controllers import (
    command_loads,
    commanded_actuation,
    steady_torque,
    torque_loads,
)
from wedgebrake.analysis.linear_stability.sliding_contact import frozen, linearised
from wedgebrake.arrays import FloatArray
from wedgebrake.errors import InputError
from wedgebrake.model.controller import Controller
from wedgebrake.model.elements import Element, elements, part_of, said_of, with_fixed_scales
from wedgebrake.model.machine import Machine
from wedgebrake.model.machine_matrices import contact_rows, normal_rows, shaft_matrices, shaft_rows
from wedgebrake.model.machine_parts import GROUND, Driven, Shaft, Torque
from wedgebrake.model.validation import wrong

_MOST_STEPS = 200
# Number of steps after which each goes only half of the way, as the pieces may otherwise cycle.
_CAUTIOUS = 20
# Distance of an argument from a corner of a law that counts as rounding: relative, absolute [rad].
_AT_CORNER, _SMALLEST = 1e-9, 1e-12
# Stiffness, relative to the largest one, that counts as none, and the one used in its place.
_NONE, _WEAK = 1e-12, 1e-9
# Angle beyond all stops [rad].
_FAR = 1e6
# Torque, relative to the largest of its terms, that counts as rounding.
_BALANCED = 1e-10
# The same for the sum of the magnitudes of all terms of the lines.
_ROUNDING = 1e-14


class _Balance(NamedTuple):
    """The balance of torques in the restrained rotations, with the angles e.

    given     : elements
    at        : (n,) speeds of the inertias;  origin : (n,) angles where e = 0
    held      : (n, p) restrained rotations
    stiffness : (n, n) of the shafts that are not elements
    load      : (n,) torques that do not depend on the angles
    rows, by_angle : (contacts, n) factors of the speeds in the sliding speeds, and of the angles in
                the normal forces
    gains     : (contacts,) torque per force;  forces : (contacts,) forces where all angles are 0
    releases  : (contacts,) whether a negative force releases the contact
    """

    given: tuple[Element, ...]
    at: FloatArray
    origin: FloatArray
    held: FloatArray
    stiffness: FloatArray
    load: FloatArray
    rows: FloatArray
    by_angle: FloatArray
    gains: FloatArray
    forces: FloatArray
    releases: Any

    def angles(self, e: FloatArray) -> FloatArray:
        """Angles of the inertias, (n,)."""
        return self.origin + self.held @ e

    def pieces(self, e: FloatArray) -> tuple[Any, ...]:
        """Numbers of the pieces of the elements, then whether each contact is released."""
        angles = self.angles(e)
        force = self.forces + self.by_angle @ angles
        return (
            *(int(one.pieces_at(angles, self.at)) for one in self.given),
            *(self.releases & (force < 0.0)).tolist(),
        )

    def terms(self, e: FloatArray, pieces: tuple[Any, ...]) -> tuple[FloatArray, FloatArray]:
        """Torques in the rotations, (terms, p), of sum 0 in equilibrium; minus its derivative."""
        angles = self.angles(e)
        found = [self.load, -self.stiffness @ angles]
        matrix = self.stiffness.copy()
        for element, piece in zip(self.given, pieces, strict=False):
            place = element.place_at(angles, self.at)._replace(piece=np.array(piece))
            found.append(element.torque(angles, self.at, place) * element.load)
            matrix -= np.outer(element.load, element.line(place.piece)[0] * element.angle_row)
        acts = np.where(pieces[len(self.given) :], 0.0, self.gains)
        found += list(-self.rows * (acts * (self.forces + self.by_angle @ angles))[:, None])
        matrix += self.rows.T @ (acts[:, None] * self.by_angle)
        return np.array(found) @ self.held, self.held.T @ matrix @ self.held

    def solve(self, start: FloatArray) -> FloatArray | None:
        """The solution that Newton's method finds from a start; None if it finds none."""
        e, pieces = start, self.pieces(start)
        for count in range(_MOST_STEPS):
            # About the angle 0, not about e, which may be so far away that rounding is larger.
            terms, matrix = self.terms(np.zeros(e.size), pieces)
            rounding = _ROUNDING * (np.abs(terms).sum(axis=0) + np.abs(matrix) @ np.abs(e))
            if self._is_zero(self.terms(e, pieces)[0], rounding):
                return e
            target, weak = _solve(matrix, terms.sum(axis=0), e)
            e = target if count < _CAUTIOUS else 0.5 * (e + target)
            before, pieces = pieces, self.pieces(e)
            torque = self.terms(e, pieces)[0].sum(axis=0)
            if weak and pieces == before:  # a torque so small that it has not reached a stop
                e = e + torque * (_FAR / max(np.abs(torque).max(), _SMALLEST))
                pieces = self.pieces(e)
        return None

    @staticmethod
    def _is_zero(terms: FloatArray, rounding: FloatArray) -> bool:
        """Return True for torques in balance.

        rounding : of their sums, as torques of gaps and stages are differences of larger ones
        """
        allowed = np.maximum(_BALANCED * np.abs(terms).max(initial=0.0), rounding)
        return bool(np.all(np.abs(terms.sum(axis=0)) <= allowed))


def _solve(matrix: FloatArray, right: FloatArray, near: FloatArray) -> tuple[FloatArray, bool]:
    """The solution of a linear system.

    Rotations without stiffness keep their angles of ``near`` if nothing loads them, as in a gap;
    otherwise they move far, to a stop. Returns (solution, whether they have moved).
    """
    sizes = np.linalg.svd(matrix, compute_uv=False)
    if sizes.size and sizes[-1] <= _NONE * sizes[0]:
        found = near + np.linalg.lstsq(matrix, right - matrix @ near, rcond=_NONE)[0]
        left = np.abs(matrix @ found - right)
        if np.all(left <= _BALANCED * np.abs(right).max(initial=0.0)):
            return np.asarray(found), False
        matrix = matrix + _WEAK * (sizes[0] or 1.0) * np.eye(len(matrix))
        return np.asarray(np.linalg.solve(matrix, right)), True
    return np.asarray(np.linalg.solve(matrix, right)), False


def about_equilibrium(
    machine: Machine, at: FloatArray, sliding: Sequence[float], directions: Sequence[int],
    held: FloatArray, corner: int = 0,
) -> Machine:  # fmt: skip
    """The machine with a linear shaft for each element, and with steady forces that are numbers.

    It is the machine itself if it has neither elements nor normal forces of the state. Scales of
    torques over the state have their values at time 0.

    at         : (n,) speeds of the inertias [rad/s]
    sliding    : speed of each contact [rad/s];  directions : of sliding, 0 where it sticks
    held       : (n, p) rotations that shafts restrain
    corner     : side of the line at an equilibrium at a corner over an angle, -1 or 1; 0: none

    Raises ``InputError`` for a machine whose equilibrium moves, is not found or is at a corner,
    without ``corner``.
    """
    machine = with_fixed_scales(machine, frozen)
    given = elements(machine)
    pressed = [number for number, one in enumerate(machine.contacts) if one.normal]
    if not given and not pressed:
        return machine
    _check_steady(machine, at)
    commanded = _with_commands(machine, sliding, at)
    balance = _balance(commanded, given, at, sliding, directions, held)
    start = np.array([one.angle for one in machine.inertias])
    e = balance.solve(held.T @ (start - balance.origin))
    if e is None:
        part = part_of(machine, given[0]) if given else machine.contacts[pressed[0]]
        allowed = "part of a machine with an equilibrium for linear stability"
        raise InputError.of(
            part.name, part,
            f"must be {allowed}. None was found from the initial angles at the initial speeds. Give"
            " angles and speeds near an equilibrium.",
            allowed=allowed, said=type(part).__name__,
        )  # fmt: skip
    angles = balance.angles(e)
    changes: dict[str, Any] = {}
    if pressed:
        force = balance.forces + balance.by_angle @ angles
        changes["contacts"] = _with_forces(machine, sliding, force)
    if given:
        changes |= _linear_parts(machine, given, (angles, at), corner)
    return machine.model_copy(update=changes)


def _with_commands(machine: Machine, sliding: Sequence[float], at: FloatArray) -> Machine:
    """The machine with the steady outputs of controllers in the forces of its contacts.

    Raises ``InputError`` for a controller whose steady output is not known.
    """
    found = machine
    for number, contact in enumerate(machine.contacts):
        loops = command_loads(machine, contact.name)
        if loops:
            found, known = commanded_actuation(found, number, sliding[number], at)
            if contact.normal or not known:
                _refuse(machine.controllers[loops[0]])
    return found


def _refuse(loop: Controller) -> NoReturn:
    raise wrong(
        loop.name, loop, "a controller whose steady output is known from the speeds alone, in"
        " linear stability with stages, gaps, torques over a speed or an angle, or normal forces of"
        " the state",
        "Leave out its integral part and let it measure speeds; or replace these parts by linear"
        " ones (a torque over a speed by wb.Drag), or use wb.simulate.",
    )  # fmt: skip


def _check_steady(machine: Machine, at: FloatArray) -> None:
    """Raise ``InputError`` for elements and normal forces over angles that grow."""
    for element in elements(machine):
        part = part_of(machine, element)
        turns = isinstance(part, Torque) and not element.of_speed
        if turns and element.row @ at != 0.0:
            raise wrong(
                *said_of(part),
                "over an angle that does not grow, for linear stability",
                "Give speeds at which this angle is constant, or use wb.simulate.",
            )  # fmt: skip
    for contact in machine.contacts:
        moving = [one.name for one in machine.driven if frozen(one.speed) != 0.0]
        if any(name == f"{body}.angle" for name in contact.normal for body in moving):
            raise wrong(
                f"{contact.name}.normal", dict(contact.normal),
                "of angles that do not grow, for linear stability", "Use wb.simulate.",
            )  # fmt: skip


def _balance(
    machine: Machine, given: tuple[Element, ...], at: FloatArray, sliding: Sequence[float],
    directions: Sequence[int], held: FloatArray,
) -> _Balance:  # fmt: skip
    stiffness, damping = shaft_matrices(machine, linear=True)
    load = -damping @ at
    for torque in machine.torques:
        if torque.over_time is not None:
            load[machine.index(torque.on)] += frozen(torque.over_time)
    for number, inertia in torque_loads(machine):
        output = steady_torque(machine.controllers[number], machine, at)
        if math.isnan(output):
            _refuse(machine.controllers[number])
        load[inertia] += output
    for twist, shaft in zip(shaft_rows(machine), machine.shafts, strict=True):
        load += twist * shaft.preload
    by_angle, by_speed = np.hsplit(normal_rows(machine), 2)
    forces, gains = by_speed @ at, np.zeros(len(machine.contacts))
    for number, (one, speed, side) in enumerate(
        zip(machine.contacts, sliding, directions, strict=True)
    ):
        forces[number] += frozen(one.actuation.initial_force) + one.actuation.slope * abs(speed)
        if side != 0 and one.normal:
            gains[number] = linearised(one, abs(speed), side).gain
        elif side != 0:
            contact = linearised(one, abs(speed), side)
            forces[number], gains[number] = contact.force, contact.gain
    origin = np.array([one.angle if isinstance(one, Driven) else 0.0 for one in machine.inertias])
    releases = np.array([one.actuation.release for one in machine.contacts], bool)
    return _Balance(
        given, at, origin, held, stiffness, load, contact_rows(machine), by_angle, gains, forces,
        releases,
    )  # fmt: skip


def _with_forces(machine: Machine, sliding: Sequence[float], force: FloatArray) -> tuple[Any, ...]:
    """The contacts, with steady forces for those with normal forces of the state."""
    found = []
    for one, speed, total in zip(machine.contacts, sliding, force.tolist(), strict=True):
        own = total - one.actuation.slope * abs(speed)
        actuation = one.actuation.model_copy(update={"initial_force": own})
        found.append(one.model_copy(update={"actuation": actuation}) if one.normal else one)
    return tuple(found)


def _linear_parts(
    machine: Machine, given: tuple[Element, ...], state: tuple[FloatArray, FloatArray], corner: int
) -> dict[str, Any]:
    """Linear shafts in place of all elements, that of a torque to the body it is relative to.

    state : angles and speeds
    """
    shafts = list(machine.shafts)
    for element in given:
        part = part_of(machine, element)
        stiffness, damping, _ = _line_at(part, element, state, corner)
        if isinstance(part, Shaft):
            linear = {"stiffness": stiffness, "damping": damping, "gap": None}
            shafts[element.number] = part.model_copy(update=linear)
            continue
        # The torque of a shaft acts on its first inertia with the opposite sign.
        shafts.append(
            Shaft.model_construct(
                a=part.on, b=part.relative_to or GROUND, ratio=1.0, name=part.name, rest=0.0,
                gap=None, stiffness=0.0 if element.of_speed else -stiffness,
                damping=-stiffness if element.of_speed else 0.0,
            )
        )  # fmt: skip
    torques = tuple(one for one in machine.torques if one.over_time is not None)
    return {"shafts": tuple(shafts), "torques": torques}


class CornerError(InputError):
    """An equilibrium at a corner of a torque over an angle, where no linear system exists."""


def _line_at(
    part: Shaft | Torque, element: Element, state: tuple[FloatArray, FloatArray], corner: int
) -> FloatArray:
    """The line of an element at angles and speeds.

    Of the two lines at a corner over the speed, it is that with the larger slope; over an angle,
    that on the side ``corner``.

    Raises ``InputError`` at a corner over an angle without a side, where no linear system exists.
    """
    angles, at = state
    argument = float(element.row @ (at if element.of_speed else angles))
    away = max(_AT_CORNER * abs(argument), _SMALLEST)
    lines = [
        element.line(element.law.piece_at(np.array(argument + way), np.zeros(())))
        for way in (-away, away)
    ]
    if element.of_speed:
        return max(lines, key=lambda line: float(line[0]))
    if corner:
        return lines[(1 + corner) // 2]
    if not np.array_equal(lines[0][:2], lines[1][:2]):
        allowed = f"without a corner at the equilibrium, {argument:.6g} rad, for linear stability"
        raise CornerError.of(
            *said_of(part), f"must be {allowed}. Move the corner slightly to either side.",
            allowed=allowed,
        )  # fmt: skip
    return lines[0]
