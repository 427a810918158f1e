"""Rotations that twist no shaft, subtracted from the angles of a run."""

from __future__ import annotations

import math

import numpy as np

from wedgebrake.arrays import FloatArray
from wedgebrake.model.machine import Machine
from wedgebrake.model.machine_matrices import free_rotations, natural_frequencies
from wedgebrake.solvers.machine.problem import Run

# Angle from which on rotations are subtracted [rad].
_LARGEST = 500.0


class Rotations:
    """Rotations that twist no shaft, subtracted from the angles when these have become large.

    An angle of 1e5 rad is rounded to 1e-11 rad, and a stiff shaft turns this error into a torque.

    out : (n,) rotation subtracted from each angle so far [rad]
    """

    def __init__(self, machine: Machine) -> None:
        rows = free_rotations(machine)
        self.out = np.zeros(rows.shape[1])
        self._rows = _joined(rows)
        # The machine may start from rest. The steps do not depend on the end of the run, so that a
        # longer one has the same cells.
        natural = natural_frequencies(machine) if len(self._rows) else np.zeros(0)
        if not natural.size:  # no torque depends on angles
            self._rows = self._rows[:0]
        self._step = 0.5 * _LARGEST / (natural[0] if natural.size else math.inf)

    def next_end(self, run: Run, end: float) -> float:
        """Subtract large rotations, and return the time until which this suffices [s]."""
        if not len(self._rows):
            return end
        n = self.out.size
        for row in self._rows:
            first = _own(self._rows, row)
            turn = round(float(run.z[first, 0] / row[first]))  # of few bits, so that it is exact
            if abs(turn) > _LARGEST:
                run.z[:n, 0] -= row * turn
                self.out += row * turn
        speed = float(np.abs(run.z[n : 2 * n, 0]).max())
        self._step = min(2.0 * self._step, _LARGEST / speed if speed > 0.0 else math.inf)
        return min(end, float(run.clock[0]) + self._step)


def _own(rows: FloatArray, row: FloatArray) -> int:
    """The first inertia that turns in a rotation and in no other one, if possible."""
    turning = np.flatnonzero(row)
    alone = turning[np.count_nonzero(rows[:, turning], axis=0) == 1]
    return int(alone[0] if alone.size else turning[0])


def largest_angles(machine: Machine, angles: FloatArray) -> FloatArray:
    """Largest angles with which a run computes, given those of its response: (n,) [rad]."""
    found = np.array(angles)
    for row in _joined(free_rotations(machine)):
        found = np.where(row != 0.0, np.minimum(found, _LARGEST * np.abs(row)), found)
    return found


def _joined(rows: FloatArray) -> FloatArray:
    """The rotations in which several inertias, joined by shafts, turn."""
    several: FloatArray = rows[np.count_nonzero(rows, axis=1) > 1]
    return several
