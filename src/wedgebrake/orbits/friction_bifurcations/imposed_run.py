"""Run of a machine with imposed directions of sliding, and its derivative."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from wedgebrake.arrays import FloatArray
from wedgebrake.dynamics.enums import Outcome
from wedgebrake.orbits.bifurcation_types import Limit
from wedgebrake.orbits.equations.equations import NoOrbitError
from wedgebrake.orbits.equations.machine_flow import MachineFlow
from wedgebrake.solvers.machine.events.imposed import expand, impose
from wedgebrake.solvers.machine.events.modes import GuardKind, unlimited_force_row
from wedgebrake.solvers.machine.passage import Every, Record
from wedgebrake.solvers.machine.problem import mobility_of

Sides = tuple[int, ...]
# Number of terms of a series that are needed here.
_TERMS = 3


class EventFunction(NamedTuple):
    """A function of the state at an event, and its derivative, (columns,), see ``ImposedRun``."""

    value: Any
    derivative: FloatArray


class ImposedRun:
    """A run from a point of the section, with imposed directions of sliding.

    The derivative ``matrix`` of the states, and of the forces in the memory of samples, has a
    column for each coordinate of the point, and others for the times of events; ``enter`` and
    ``advance`` take the numbers of the latter.

    columns : number of columns of the derivative
    z       : (states and inputs, 3) Taylor coefficients now, in the mode number ``slot``
    """

    def __init__(self, flow: MachineFlow, point: FloatArray, columns: int) -> None:
        self.flow, self.course = flow, flow.imposed
        self.problem, self.run = self.course.assembled.problem, self.course.state
        self.states, self.time = self.problem.states, 0.0
        self.matrix = np.zeros((self.states + len(self.course.held_inputs), columns))
        self.matrix[flow.rows(), : point.size] = flow.on_section.back
        self.course.restart(flow.states(point), flow.local.delayed(point))
        # The beginning of a run sets the inputs and modes, whose systems must have no conditions.
        self.run.modes["imposed"] = 1
        self.course.advance(None, duration=0.0)
        self.z, self.slot = self.run.z[:, :_TERMS].copy(), -1

    def enter(self, sides: Sides, column: int | None = None) -> None:
        """Impose directions of sliding from now on.

        column : that of the present time; None at the beginning
        """
        self._bring_to_rest(sides, column)
        self._expand(sides)
        if column is not None:
            self.matrix[: self.states, column] -= self.z[: self.states, 1]

    def advance(self, end: float, column: int | None = None) -> None:
        """Continue to a time [s]; raises ``NoOrbitError`` if it is not later.

        column : that of this time; None if it is fixed
        """
        length = end - self.time
        if not 0.0 < length < np.inf:
            raise NoOrbitError
        passage = self.course.advance(Every(2.0 * length, end), 1, record=Record.DERIVATIVES)
        if passage.outcome != Outcome.COMPLETED:
            raise NoOrbitError
        self.matrix = passage.matrices[0] @ self.matrix
        self.time, self._passage = end, passage
        self._expand()
        if column is not None:
            self.matrix[: self.states, column] += self.z[: self.states, 1]

    def end(self) -> EventFunction:
        """The present point of the section."""
        rows = self.flow.rows(self._passage.final)
        return EventFunction(self.flow.end(self._passage), self.flow.local.to @ self.matrix[rows])

    def row(self, limit: Limit) -> FloatArray:
        """Factors of the states and inputs in a condition, in the present mode."""
        systems, number = self.run.systems, limit.contact
        contact, sliding = self.problem.contacts[number], self.problem.sliding[number]
        if limit.guard == GuardKind.ZERO_SPEED:
            return np.asarray(limit.sign * sliding)
        if limit.guard == GuardKind.NEXT_LINE:
            row = (1 if limit.level > 0 else -1) * sliding
            row[-1] -= self.flow.breakpoints[number].speeds[abs(limit.level) - 1]
            return np.asarray(limit.sign * row)
        if limit.guard == GuardKind.FORCE_LIMIT:
            row, side = np.zeros_like(sliding), self.run.modes[number]["side"]
            unlimited_force_row(self.problem, self.run, number, side, row)
            row[-1] -= contact["lowest" if limit.level < 0 else "highest"]
            return np.asarray(limit.sign * limit.level * row)
        force = systems.force[self.slot, number]
        gain = contact["breakaway_backward" if limit.sign > 0 else "breakaway_forward"]
        largest = np.zeros(force.size)
        largest[force != 0.0] = -gain * force[force != 0.0]
        return np.asarray(limit.sign * (largest - systems.contact[self.slot, number]))

    def row_in(self, limit: Limit, sides: Sides) -> FloatArray:
        """Factors of the states and inputs in a condition, in another mode; call ``enter`` next."""
        kept = self.z, self.slot
        self._expand(sides)
        row = self.row(limit)
        self.z, self.slot = kept
        return row

    def value(self, row: FloatArray, column: int, *, extreme: bool = False) -> EventFunction:
        """Value of a condition now; or its rate, which vanishes at its ``extreme``.

        column : that of the present time
        """
        inputs = self._inputs()
        if extreme:
            rates = self.run.systems.rates[self.slot]
            derivative = row[: self.states] @ rates @ inputs @ self.matrix
            derivative[column] = 2.0 * row @ self.z[:, 2]
            return EventFunction(float(row @ self.z[:, 1]), derivative)
        derivative = row @ inputs @ self.matrix
        derivative[column] = row @ self.z[:, 1]
        return EventFunction(float(row @ self.z[:, 0]), derivative)

    def _expand(self, sides: Sides | None = None) -> None:
        """Store the series of the present state, with other directions of sliding if given."""
        if sides is not None:
            impose(self.problem, self.run, np.array(sides))
        self.slot = int(expand(self.problem, self.run))
        if self.slot < 0:
            raise NoOrbitError
        self.z = self.run.z[:, :_TERMS].copy()

    def _inputs(self) -> FloatArray:
        """Derivative of states and inputs by the states and by the forces in that memory."""
        states, systems = self.states, self.run.systems
        held = self.course.held_inputs
        inputs = np.zeros((len(self.z), states + len(held)))
        inputs[:states, :states] = np.eye(states)
        for line, number in enumerate(held):
            if number >= 0:
                inputs[states + number, states + line] = 1.0
        for curve in self.run.curves:
            contact = curve["contact"]
            if self.run.modes[contact]["side"] != 0:
                force = systems.force[self.slot, contact] @ inputs
                torque = curve["by_force"][0] * force
                torque[:states] += curve["by_speed"][0] * self.problem.sliding[contact, :states]
                inputs[states + self.problem.contacts[contact]["curve"]] = torque
        for one in self.run.products:
            line = self.problem.elements.lines[self.run.places[one["element"]]["piece"]]
            scale = self.z[states + one["scale"], 0]
            inputs[states + one["input"]] = scale * (line @ inputs)
        return inputs

    def _bring_to_rest(self, sides: Sides, column: int | None) -> None:
        """Remove the sliding speeds of contacts that stick, by impulses of their torques."""
        rows: Any = self.problem.sliding[np.array(sides) == 0]
        if not len(rows):
            return
        n, states = self.problem.inverse.size, self.states
        moved = slice(n, 2 * n)
        speeds = np.column_stack((rows @ self.run.z[:, 0], rows[:, :states] @ self.matrix[:states]))
        if column is not None:
            speeds[:, 1 + column] += rows[:, states:] @ self.z[states:, 1]
        weighted = mobility_of(self.problem) @ rows[:, moved].T
        impulses = np.linalg.lstsq(rows[:, moved] @ weighted, speeds, rcond=None)[0]
        change = weighted @ impulses
        self.run.z[moved, 0] -= change[:, 0]
        self.matrix[moved] -= change[:, 1:]
