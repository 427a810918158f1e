"""Return map of a machine on a section, in coordinates of the section."""

from __future__ import annotations

import math

import numpy as np
from scipy.linalg import null_space

from wedgebrake.analysis.machine_motion.coordinates import Coordinates
from wedgebrake.dynamics.enums import Outcome
from wedgebrake.errors import InputError
from wedgebrake.model.machine import Machine
from wedgebrake.orbits.problem import FloatArray, NoOrbitError
from wedgebrake.solvers.machine.final_state import FinalState
from wedgebrake.solvers.machine.passage import Course, Crossing, Every, Passage

# A sliding speed below this share of its parts is rounding of Newton's method: the contact sticks.
_STICKS = 1e-11
# Number of remembered passages.
_REMEMBERED = 64


class MachineFlow:
    """Map from the section of a machine to itself, with its exact derivative.

    A point of the section has the coordinates u; the scaled coordinates of its state are
    ``origin + basis u``.

    machine : machine without sampled controllers
    space   : scaled coordinates of the state; they need not be those of this machine
    section : a crossing; None for one return per period of the signals
    longest : longest time until a return [s]
    method  : "exact" or "smooth", see ``simulate``
    """

    def __init__(
        self, machine: Machine, space: Coordinates, section: Crossing | None, longest: float,
        method: str,
    ) -> None:  # fmt: skip
        if any(one.actuation.sample_time is not None for one in machine.contacts):
            raise InputError(
                "contacts: orbits of machines with sampled controllers are not sought."
            )
        period = machine.period
        if section is None and not period:
            raise NoOrbitError
        self.section: Crossing | Every = section or Every(period or math.nan)
        self.machine, self.space, self.longest = machine, space, longest
        watched = np.vstack([space.to, np.eye(space.to.shape[1])])
        self.course = Course(machine, works=False, logs=True, watched=watched, method=method)
        self.origin, self.basis = np.zeros(space.size), np.eye(space.size)
        if section is not None:
            row = np.array(section.row) @ space.back
            self.origin = row * (section.level / (row @ row))
            self.basis = null_space(row[None, :])
        self._remembered: dict[bytes, Passage] = {}

    @property
    def size(self) -> int:
        """Dimension of the section."""
        return self.basis.shape[1]

    def states(self, points: FloatArray) -> FloatArray:
        """States (..., states) of points (..., size), without free rotation."""
        return np.asarray((self.origin + points @ self.basis.T) @ self.space.back.T)

    def points(self, states: FloatArray) -> FloatArray:
        """Points of states, projected onto the section."""
        return np.asarray((states @ self.space.to.T - self.origin) @ self.basis)

    def next_return(self, point: FloatArray, *, derivative: bool = True) -> Passage:
        """Passage to the next return; raises ``NoOrbitError`` if there is none."""
        key = point.tobytes()
        found = self._remembered.get(key)
        if found is None or (derivative and not len(found.matrices)):
            self._start(point)
            found = self.passage(1, derivative=derivative)
            if len(self._remembered) >= _REMEMBERED:
                del self._remembered[next(iter(self._remembered))]
            self._remembered[key] = found
        return found

    def matrix(self, passage: Passage) -> FloatArray:
        """Derivative of the end of a passage with respect to its beginning."""
        space = self.space
        return np.asarray(self.basis.T @ space.to @ passage.matrices[0] @ space.back @ self.basis)

    def passage(self, returns: int, *, derivative: bool = False) -> Passage:
        """Continue to a return; raises ``NoOrbitError`` if there is none."""
        duration = self.longest * returns
        if isinstance(self.section, Every):
            duration = math.inf
        passage = self.course.advance(
            self.section, returns, duration=duration, derivatives=derivative
        )
        if passage.outcome != Outcome.COMPLETED or len(passage.times) < returns:
            raise NoOrbitError
        return passage

    def initial(self, point: FloatArray) -> FinalState:
        """State at a point, as an initial state of ``simulate``."""
        self._start(point)
        return self.course.advance(None, duration=0.0).final

    def _start(self, point: FloatArray) -> None:
        """Start at a point; contacts whose sliding speed is rounding are set to rest."""
        if not np.all(np.isfinite(point)):
            raise NoOrbitError
        states, problem = self.states(point), self.course.assembled.problem
        self.course.restart(states)
        z = self.course.state.z[:, 0]
        speeds, sizes = problem.sliding @ z, np.abs(problem.sliding) @ np.abs(z)
        stick = np.abs(speeds) <= _STICKS * sizes
        if np.any(speeds[stick]):
            n = problem.inverse.size
            rows = problem.sliding[stick, n : 2 * n]
            impulse = np.linalg.lstsq(rows * problem.inverse @ rows.T, speeds[stick], rcond=None)
            states[n : 2 * n] -= problem.inverse * (impulse[0] @ rows)
            self.course.restart(states)
