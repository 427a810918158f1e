"""Piecewise-linear elements of a machine: shafts with stages or gaps, and torques over a state.

An element is a torque that acts on inertias with constant factors and is linear in the state within
each of its pieces. ``elements`` alone decides which parts are elements; solvers and results take
them from it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from wedgebrake.arrays import FloatArray
from wedgebrake.model.machine import Machine
from wedgebrake.model.machine_matrices import shaft_rows
from wedgebrake.model.machine_parts import OverState, Shaft, Torque
from wedgebrake.model.piecewise import Chain, Law
from wedgebrake.model.signals.signals import Signal


class Place(NamedTuple):
    """Where the argument of an element is: number of the piece, and of the period."""

    piece: NDArray[np.intp]
    period: FloatArray | float


@dataclass(frozen=True, eq=False)
class Element:
    """A torque that is piecewise linear in the state.

    kind, number : table of the part, and its number among those of its kind
    row      : (n,) factors of the angles of the inertias, or of their speeds, in the argument
    load     : (n,) factors of the torque on the inertias
    of_speed : whether the argument is a speed
    scale    : factor of the torque that varies in time, which ``torque``, ``change`` and ``line``
               leave out; None: without
    """

    kind: str
    number: int
    row: FloatArray
    load: FloatArray
    law: Law
    of_speed: bool = False
    scale: Signal | None = None

    @cached_property
    def _lines(self) -> FloatArray:
        """(pieces, 3) torques of the pieces: by the argument, by its rate, and offset."""
        return np.array([piece.torque for piece in self.law.pieces()])

    @cached_property
    def _losses(self) -> FloatArray:
        """(pieces, 3) of the parts of the torques whose work is not stored."""
        return np.array([piece.loss for piece in self.law.pieces()])

    @property
    def angle_row(self) -> FloatArray:
        """(n,) factors of the angles in the argument."""
        return 0.0 * self.row if self.of_speed else self.row

    def line(self, piece: NDArray[np.intp]) -> FloatArray:
        """(3,) torque of a piece: per argument, per rate of the argument, and offset."""
        return self._lines[piece]

    def pieces_at(self, angle: FloatArray, speed: FloatArray) -> NDArray[np.intp]:
        """Numbers of the pieces at angles and speeds (..., n)."""
        return self.law.piece_at(*self._argument(angle, speed))

    def place_at(self, angle: FloatArray, speed: FloatArray) -> Place:
        """Where the element is at angles and speeds (..., n)."""
        (argument, rate), period = self._argument(angle, speed), self.law.period
        passed = argument - self.law.start
        turns = np.rint((passed - np.mod(passed, period)) / period) if period else 0.0
        return Place(self.law.piece_at(argument, rate), turns)

    def torque(
        self, angle: FloatArray, speed: FloatArray, place: Place | None = None, *,
        lost: bool = False,
    ) -> FloatArray:  # fmt: skip
        """The torque at angles and speeds (..., n) [N m].

        place : whose line is continued; None: that at these angles and speeds
        lost  : whether it is the part of the torque whose work is not stored
        """
        place = place or self.place_at(angle, speed)
        argument, rate = self._argument(angle, speed)
        if self.law.period:
            argument = argument - place.period * self.law.period
        lines = (self._losses if lost else self._lines)[place.piece]
        return np.asarray(lines[..., 0] * argument + lines[..., 1] * rate + lines[..., 2])

    def change(
        self, pieces: NDArray[np.intp], angle: FloatArray, speed: FloatArray, *,
        lost: bool = False,
    ) -> FloatArray:  # fmt: skip
        """Change of ``torque`` by changes of angles and speeds (..., n) in given pieces [N m]."""
        argument, rate = self._argument(angle, speed)
        lines = (self._losses if lost else self._lines)[pieces]
        return np.asarray(lines[..., 0] * argument + lines[..., 1] * rate)

    def _argument(self, angle: FloatArray, speed: FloatArray) -> tuple[FloatArray, FloatArray]:
        """The argument and its rate, 0 for that of a speed, over which there is no damping."""
        if self.of_speed:
            return speed @ self.row, np.zeros(speed.shape[:-1])
        return angle @ self.row, speed @ self.row


def elements(machine: Machine, *, straight: bool = False) -> tuple[Element, ...]:
    """The piecewise-linear elements of a machine, in the order of its parts.

    straight : whether shafts with a constant stiffness are among them
    """
    laws = [one.law or (_straight(one) if straight else None) for one in machine.shafts]
    rows = shaft_rows(machine) if any(one is not None for one in laws) else laws
    found = [
        Element("shaft", number, row, -row, law)
        for number, (law, row) in enumerate(zip(laws, rows, strict=True))
        if law is not None
    ]
    for number, torque in enumerate(machine.torques):
        if isinstance(torque.signal, OverState):
            row = np.zeros(len(machine.inertias))
            row[machine.index(torque.on)] = 1.0
            if torque.relative_to is not None:
                row[machine.index(torque.relative_to)] = -1.0
            curve = torque.signal
            found.append(
                Element("torque", number, row, row, curve.law, curve.of_speed, curve.throttle)
            )
    return tuple(found)


def _straight(shaft: Shaft) -> Law:
    """The law of a shaft with a constant stiffness, whose two lines are one."""
    stiffness = shaft.largest_stiffness
    return Chain(
        (shaft.rest,), (0.0,), (stiffness, stiffness), shaft.damping, neutral=shaft.rest
    )  # fmt: skip


def element_loads(
    machine: Machine, kind: str, times: FloatArray, angle: FloatArray, speed: FloatArray
) -> FloatArray:
    """Torques of the elements of a kind on the inertias [N m].

    times : (...);  angle, speed : (..., n)
    """
    found = np.zeros(angle.shape)
    for one in elements(machine):
        if one.kind == kind:
            torque = one.torque(angle, speed) * (1.0 if one.scale is None else one.scale(times))
            found += torque[..., None] * one.load
    return found


def with_fixed_scales(machine: Machine, value: Callable[[Signal], float]) -> Machine:
    """The machine with numbers in place of the scales of torques over the state that vary.

    value : the number for a scale
    """
    torques = []
    for one in machine.torques:
        scale = one.signal.throttle if isinstance(one.signal, OverState) else None
        if scale is not None:
            fixed = one.signal.model_copy(update={"scale": value(scale)})
            one = one.model_copy(update={"signal": fixed})
        torques.append(one)
    return machine.model_copy(update={"torques": tuple(torques)})


def part_of(machine: Machine, element: Element) -> Shaft | Torque:
    """The shaft or torque that is an element."""
    parts = machine.shafts if element.kind == "shaft" else machine.torques
    return parts[element.number]


def said_of(part: Shaft | Torque) -> tuple[str, Any]:
    """Dotted name and value of what makes a part an element, for errors."""
    if isinstance(part, Torque):
        return f"{part.name}.signal", part.signal
    name = "stiffness" if part.gap is None else "gap"
    return f"{part.name}.{name}", getattr(part, name)


def event_parts(machine: Machine) -> list[str]:
    """Names of the parts that have events, in the order of their numbers there."""
    parts = {"shaft": machine.shafts, "torque": machine.torques}
    names = [parts[one.kind][one.number].name for one in elements(machine)]
    return [*machine.contact_names, *names, *(one.name for one in machine.controllers)]
