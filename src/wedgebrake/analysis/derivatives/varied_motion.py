"""The motion of a machine and its derivatives with respect to parameters, between its events.

The times at which the motion is not smooth, its events, knots and samplings, divide the run into
intervals (``machine_series``), in which the derivatives at fixed times are smooth too. The ends of
the intervals move with the parameters.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.polynomial import legendre
from numpy.typing import NDArray

from wedgebrake.analysis.responses.machine_series import MachineSeries, machine_series, series
from wedgebrake.analysis.responses.repeat import solved
from wedgebrake.arrays import FloatArray
from wedgebrake.dynamics.enums import Outcome
from wedgebrake.model.elements import check_no_elements
from wedgebrake.model.joints import accelerations
from wedgebrake.model.machine import Machine, check_without
from wedgebrake.model.machine_matrices import contact_rows, shaft_rows
from wedgebrake.model.signals.signals import Signal, as_signal
from wedgebrake.solvers.interrupts import interruptible
from wedgebrake.solvers.machine.solve import MachineTask
from wedgebrake.solvers.machine.tangents import (
    TangentTask,
    difference_of,
    differentiate,
    knot_changes,
    signal_change,
)
from wedgebrake.solvers.response import driven_accelerations, shaft_torques

_MOST_EVENTS = 10**12
# Times of an event in the two runs that differ by less, relative to their size, are the same.
SAME = 1e-9
_ENDS = np.array([-1.0, 1.0])


class VariedValues(NamedTuple):
    """Quantities of parts over a motion, with their derivatives.

    values  : (p, nodes, parts)
    changes : (p, nodes, parts, q) derivatives with respect to q parameters at fixed times
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


@dataclass(frozen=True, eq=False)
class VariedMotion:
    """A motion in p consecutive intervals, with its derivatives with respect to q parameters.

    motion : at the nodes of the intervals
    shifts : (p + 1, q) derivatives of the times of their ends; nan where an event only grazes its
             condition
    angle, speed, acceleration : of the inertias
    torque, sliding, base : torque of each contact on its first inertia, sliding speed, and speed
             of the base
    external : torque of each signal
    viscous  : power that the damping of each shaft turns into heat
    one_sided : (q,) as in ``TangentAnswer``
    """

    task: TangentTask
    motion: MachineSeries
    shifts: FloatArray
    angle: VariedValues
    speed: VariedValues
    acceleration: VariedValues
    torque: VariedValues
    sliding: VariedValues
    base: VariedValues
    external: VariedValues
    viscous: VariedValues
    one_sided: FloatArray

    @property
    def machine(self) -> Machine:
        """The machine."""
        return self.task.machine

    @property
    def duration(self) -> tuple[float, FloatArray]:
        """Duration of the motion [s], and its derivatives."""
        return float(self.motion.length.sum()), self.shifts[-1] - self.shifts[0]


def run_motion(task: TangentTask) -> MachineSeries:
    """The motion of a run that is to be differentiated."""
    run = MachineTask(
        *task.span, np.empty(0), task.initial,
        until_rest=False, max_events=_MOST_EVENTS, method=task.method,
    )  # fmt: skip
    return machine_series(task.machine, run, solved(task.machine, run))


def varied_motion(
    task: TangentTask, motion: MachineSeries, end: FloatArray | float = 0.0
) -> VariedMotion:
    """Differentiate a motion, that of ``run_motion``, at its nodes.

    end : (q,) derivatives of the time at which it ends
    """
    machine, q, nodes = task.machine, len(task.parameters), motion.times
    check_no_elements(machine, "derivatives of measures")
    check_without(
        machine,
        "controllers",
        "derivatives of measures",
        "Differentiate the response: leave out of=[...].",
    )
    inside = np.clip(nodes, *task.span)
    found = interruptible(lambda: differentiate(task._replace(times=inside.ravel())))
    if found.outcome != Outcome.COMPLETED:
        raise RuntimeError(found.outcome)  # ``motion`` has completed
    n, m = len(machine.inertias), len(machine.contacts)
    states = found.states.reshape(*nodes.shape, -1, q)
    angle, speed = states[..., :n, :], states[..., n : 2 * n, :]
    torque = found.torques.reshape(*nodes.shape, m, q)
    base = _signals(task, inside, [as_signal(one.base_speed) for one in machine.contacts],
                    lambda one, i: as_signal(one.contacts[i].base_speed))  # fmt: skip
    external = _signals(task, inside, [as_signal(one.over_time or 0.0) for one in machine.torques],
                        lambda one, i: as_signal(one.torques[i].over_time or 0.0))  # fmt: skip
    rates = np.einsum("pknq,mn->pkmq", speed, contact_rows(machine)) - base.changes
    sliding = np.where(motion.slides[:, None, :, None], rates, 0.0)
    accelerations = _accelerations(task, motion, (angle, speed, torque), external)
    return VariedMotion(
        task, motion, _shifts(task, motion, found.events, found.shifts, end),
        VariedValues(motion.angle, angle), VariedValues(motion.speed, speed),
        VariedValues(motion.acceleration, accelerations), VariedValues(motion.torque, torque),
        VariedValues(motion.sliding, sliding), base, external,
        _viscous(task, motion, speed), found.one_sided,
    )  # fmt: skip


def _by_parameter(task: TangentTask, of: Callable[[Machine], FloatArray]) -> FloatArray:
    """Derivatives (..., q) of numbers of the machine."""
    return np.stack(
        [
            difference_of(one, lambda value, at=machine_at: of(at(value)))  # type: ignore[misc]
            for one, machine_at in zip(task.parameters, task.machine_at, strict=True)
        ],
        axis=-1,
    )


def _signals(
    task: TangentTask, times: FloatArray, signals: list[Signal],
    of: Callable[[Machine, int], Signal],
) -> VariedValues:  # fmt: skip
    """Signals at the nodes; of: that of a machine with a number."""
    values = np.zeros((*times.shape, len(signals)))
    changes = np.zeros((*values.shape, len(task.parameters)))
    for i, signal in enumerate(signals):
        values[..., i] = signal(times)
        for j, one in enumerate(task.parameters):
            change = signal_change(one, task.machine_at[j], lambda given, i=i: of(given, i))  # type: ignore[misc]
            changes[..., i, j] = change(times)
    return VariedValues(values, changes)


def _viscous(task: TangentTask, motion: MachineSeries, changes: FloatArray) -> VariedValues:
    """Power that the damping of each shaft turns into heat; changes: those of the speeds."""

    def power(given: Machine) -> FloatArray:
        damping = np.array([one.damping for one in given.shafts])
        return np.asarray(damping * (motion.speed @ shaft_rows(given).T) ** 2)

    rows = shaft_rows(task.machine)
    damping = np.array([one.damping for one in task.machine.shafts])
    by_speed = 2.0 * damping * (motion.speed @ rows.T)
    rates = np.einsum("pknq,sn->pksq", changes, rows)
    return VariedValues(
        power(task.machine), _by_parameter(task, power) + by_speed[..., None] * rates
    )


def _accelerations(
    task: TangentTask,
    motion: MachineSeries,
    changes: tuple[FloatArray, FloatArray, FloatArray],
    external: VariedValues,
) -> FloatArray:
    """Derivatives of the accelerations; changes: those of angles, speeds and torques."""
    machine, (angle, speed, torque) = task.machine, changes
    rows = contact_rows(machine.machine)

    def at_rest_of_loads(given: Machine) -> FloatArray:
        """Accelerations at the present state, under the present loads."""
        shafts = shaft_torques(given, motion.angle, motion.speed)
        load = motion.load - shafts @ shaft_rows(given)
        load = load + motion.torque @ (contact_rows(given.machine) - rows)
        return accelerations(given, load, driven_accelerations(given, motion.times))

    loads = np.einsum("pkmq,mn->pknq", torque, rows)
    for i, one in enumerate(machine.torques):
        loads[..., machine.index(one.on), :] += external.changes[..., i, :]
    shafts = shaft_torques(machine, np.moveaxis(angle, -1, 0), np.moveaxis(speed, -1, 0))
    loads -= np.moveaxis(shafts @ shaft_rows(machine), 0, -1)
    given = np.moveaxis(loads, -1, 0)
    changed = np.moveaxis(accelerations(machine, given, np.zeros(given.shape)), 0, -1)
    return np.asarray(_by_parameter(task, at_rest_of_loads) + changed)


def _shifts(
    task: TangentTask, motion: MachineSeries, events: FloatArray, shifts: FloatArray,
    end: FloatArray | float,
) -> FloatArray:  # fmt: skip
    """Derivatives of the times of the ends of intervals.

    events, shifts : times of events, and their derivatives
    """
    edges = np.append(motion.start, motion.start[-1] + motion.length[-1])
    found = np.zeros((edges.size, len(task.parameters)))
    for j, (one, machine_at) in enumerate(zip(task.parameters, task.machine_at, strict=True)):
        for knots, changes in knot_changes(one, machine_at, task.span):
            place, same = matching(knots, edges)
            found[same, j] = changes[place[same]]
    place, same = matching(events, edges)
    found[same] = shifts[place[same]]
    found[0], found[-1] = 0.0, end
    return found


def matching(times: FloatArray, wanted: FloatArray) -> tuple[NDArray[np.int64], NDArray[np.bool_]]:
    """Numbers of the ascending times that are nearest to some, and whether they are the same."""
    if not times.size:
        return np.zeros(wanted.shape, int), np.zeros(wanted.shape, bool)
    after = np.clip(np.searchsorted(times, wanted), 0, times.size - 1)
    before = np.maximum(after - 1, 0)
    place = np.where(np.abs(times[before] - wanted) < np.abs(times[after] - wanted), before, after)
    return place, np.abs(times[place] - wanted) <= SAME * (1.0 + np.abs(wanted))


def ends_of(values: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Values of quantities (p, nodes, ...) at the beginnings and at the ends of the intervals."""
    coefficients = series(values)
    matrix = legendre.legvander(_ENDS, coefficients.shape[1] - 1)
    first, last = np.moveaxis(np.einsum("ed,pd...->pe...", matrix, coefficients), 1, 0)
    return first, last
