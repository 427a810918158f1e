"""Quantities of parts over a motion, with their derivatives with respect to parameters.

Each part contributes the derivative of its own torque; what follows from torques and speeds is
linear in them, with factors that depend on the parameters.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from wedgebrake.arrays import FloatArray
from wedgebrake.model.elements import elements
from wedgebrake.model.machine import Machine
from wedgebrake.model.signals.signal_tangents import rate_of
from wedgebrake.model.signals.signals import Signal
from wedgebrake.solvers.machine.shares import depend, least_shares, limits_reached
from wedgebrake.solvers.machine.tangents import TangentTask, difference_of, signal_change


class VariedValues(NamedTuple):
    """Quantities of parts over a motion, with their derivatives.

    values  : (..., parts)
    changes : (..., parts, q) derivatives with respect to q parameters at fixed times
    """

    values: FloatArray
    changes: FloatArray

    def __mul__(self, other: VariedValues) -> VariedValues:  # type: ignore[override]
        """Product of quantities of the same parts."""
        changes = self.changes * other.values[..., None] + self.values[..., None] * other.changes
        return VariedValues(self.values * other.values, changes)

    def __sub__(self, level: FloatArray) -> VariedValues:
        """The quantities without levels, (parts,), that do not depend on the parameters."""
        return VariedValues(self.values - level, self.changes)

    def select(self, parts: list[int]) -> VariedValues:
        """The quantities of some parts."""
        return VariedValues(self.values[..., parts], self.changes[..., parts, :])


def by_parameter(task: TangentTask, of: Callable[[Machine], FloatArray]) -> FloatArray:
    """Derivatives (..., q) of numbers of the machine."""
    if not task.parameters:
        return np.zeros((*np.shape(of(task.machine)), 0))
    return np.stack(
        [
            difference_of(one, lambda value, at=machine_at: of(at(value)))  # type: ignore[misc]
            for one, machine_at in zip(task.parameters, task.machine_at, strict=True)
        ],
        axis=-1,
    )


def combined(
    task: TangentTask, of: Callable[..., FloatArray], *given: VariedValues
) -> VariedValues:
    """Quantities that are linear in others.

    of : of the machine and the values of the others, (..., parts)
    """
    values = [one.values for one in given]
    moved = of(task.machine, *[np.moveaxis(one.changes, -1, 0) for one in given])
    direct = by_parameter(task, lambda machine: of(machine, *values))
    return VariedValues(of(task.machine, *values), direct + np.moveaxis(moved, 0, -1))


def varied_signals(
    task: TangentTask, times: FloatArray, of: Callable[[Machine], list[Signal]]
) -> tuple[VariedValues, VariedValues]:
    """Signals of a machine at times (...), and their rates between their jumps."""
    signals, q = of(task.machine), len(task.parameters)
    values, rates = np.zeros((2, *times.shape, len(signals)))
    changes, changed = np.zeros((2, *values.shape, q))
    for i, signal in enumerate(signals):
        values[..., i], rates[..., i] = signal(times), rate_of(signal.primitive())(times)
        for j, one in enumerate(task.parameters):
            change = signal_change(one, task.machine_at[j], lambda given, i=i: of(given)[i])  # type: ignore[misc]
            changes[..., i, j], changed[..., i, j] = change(times), rate_of(change)(times)
    return VariedValues(values, changes), VariedValues(rates, changed)


def varied_elements(
    task: TangentTask, angle: VariedValues, speed: VariedValues, *, lost: bool = False
) -> VariedValues:
    """Torques of the elements of a machine, straight shafts among them, without their scales.

    angle, speed : of the inertias
    lost         : whether they are the parts of the torques whose work is not stored
    """
    state, given = (angle.values, speed.values), elements(task.machine, straight=True)
    places = [one.place_at(*state) for one in given]
    moved = [np.moveaxis(one.changes, -1, 0) for one in (angle, speed)]
    by_state = np.zeros((*angle.values.shape[:-1], len(given), len(task.parameters)))
    for number, (one, place) in enumerate(zip(given, places, strict=True)):
        change = one.change(place.piece, *moved, lost=lost)
        by_state[..., number, :] = np.moveaxis(change, 0, -1)

    def torques(machine: Machine) -> FloatArray:
        found = np.zeros(by_state.shape[:-1])
        near = elements(machine, straight=True)
        for number, (one, place) in enumerate(zip(near, places, strict=True)):
            found[..., number] = one.torque(*state, place, lost=lost)
        return found

    return VariedValues(torques(task.machine), by_parameter(task, torques) + by_state)


def varied_shares(
    task: TangentTask, torque: VariedValues, force: VariedValues, sticking: NDArray[np.bool_]
) -> VariedValues:
    """Torques of the contacts (..., contacts) as a response shares them among those at rest.

    torque   : as the solver shares them, positive on a
    force    : actuation forces
    sticking : whether each contact is at rest
    """
    if not depend(task.machine):
        return torque
    m, q = torque.values.shape[-1], len(task.parameters)
    own, press = torque.values.reshape(-1, m), force.values.reshape(-1, m)
    rest = np.broadcast_to(sticking, torque.values.shape).reshape(-1, m)
    found = least_shares(task.machine, own, press, rest)
    reached = limits_reached(task.machine, found, press, rest)
    by, pressed = torque.changes.reshape(-1, m, q), force.changes.reshape(-1, m, q)
    changes = np.empty_like(by)
    for j, (one, machine_at) in enumerate(zip(task.parameters, task.machine_at, strict=True)):

        def shared(value: float, j: int = j, one: Any = one, at: Any = machine_at) -> FloatArray:
            step = value - one.value
            near = own + step * by[..., j], press + step * pressed[..., j]
            return least_shares(at(value), *near, rest, reached)

        changes[..., j] = difference_of(one, shared)
    return VariedValues(found.reshape(torque.values.shape), changes.reshape(torque.changes.shape))
