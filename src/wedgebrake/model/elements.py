"""Piecewise-linear elements of a machine: shafts with stages or gaps, and torques over a state.

An element is a torque that acts on inertias with constant factors and is linear in the state within
each of its pieces. ``elements`` is the only place that knows which parts are such; solvers and
results know elements alone.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from wedgebrake.arrays import FloatArray
from wedgebrake.model.machine import Machine
from wedgebrake.model.machine_matrices import shaft_rows
from wedgebrake.model.piecewise import Law


@dataclass(frozen=True, eq=False)
class Element:
    """A torque that is piecewise linear in the state.

    kind, number : table of the part, and its number among those of its kind
    row      : (n,) factors of the angles of the inertias, or of their speeds, in the argument
    load     : (n,) factors of the torque on the inertias
    of_speed : whether the argument is a speed
    """

    kind: str
    number: int
    row: FloatArray
    load: FloatArray
    law: Law
    of_speed: bool = False

    def torque(self, angle: FloatArray, speed: FloatArray) -> FloatArray:
        """The torque at angles and speeds (..., n) [N m]."""
        if self.of_speed:
            return self.law.torque(speed @ self.row, np.zeros(speed.shape[:-1]))
        return self.law.torque(angle @ self.row, speed @ self.row)


def elements(machine: Machine) -> tuple[Element, ...]:
    """The piecewise-linear elements of a machine, in the order of its parts."""
    rows = zip(machine.shafts, shaft_rows(machine), strict=True)
    return tuple(
        Element("shaft", number, row, -row, shaft.law)
        for number, (shaft, row) in enumerate(rows)
        if shaft.law is not None
    )
