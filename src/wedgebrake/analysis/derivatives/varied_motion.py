"""The motion of a machine and its derivatives with respect to parameters, between its events.

The times at which the motion is not smooth, its events, knots and samplings, divide the run into
intervals (``machine_series``), in which the derivatives at fixed times are smooth too. The ends of
the intervals move with the parameters.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np
from numpy.polynomial import legendre
from numpy.typing import ArrayLike, NDArray

from wedgebrake.analysis.derivatives.coincidences import OneSided, differentiated, matching
from wedgebrake.analysis.derivatives.varied_values import (
    VariedValues,
    combined,
    varied_elements,
    varied_shares,
    varied_signals,
)
from wedgebrake.analysis.responses.machine_series import (
    NODES,
    MachineSeries,
    machine_series,
    series,
)
from wedgebrake.analysis.responses.repeat import solved
from wedgebrake.arrays import FloatArray
from wedgebrake.dynamics.enums import Outcome
from wedgebrake.model.controller import TORQUE
from wedgebrake.model.elements import elements
from wedgebrake.model.joints import accelerations, mobility
from wedgebrake.model.machine import Machine
from wedgebrake.model.machine_matrices import contact_rows, masses
from wedgebrake.model.signals.signals import as_signal
from wedgebrake.model.validation import wrong
from wedgebrake.solvers.machine.shares import depend, least_shares, limits_reached
from wedgebrake.solvers.machine.solve import MachineTask
from wedgebrake.solvers.machine.tangents import (
    TangentAnswer,
    TangentTask,
    difference_of,
    knot_changes,
    samples_of,
)

_MOST_EVENTS = 10**12
# Distance from the ends of an interval where shares are looked at; how often bends are looked for,
# and bisections of one; and share of the largest slope below which torques do not bend.
_INSIDE, _ROUNDS, _HALVINGS, _BENT = 1e-6, 4, 50, 1e-7
_ENDS = np.array([-1.0, 1.0])


@dataclass(frozen=True, eq=False)
class VariedMotion:
    """A motion in p consecutive intervals, with its derivatives with respect to q parameters.

    motion : at the nodes of the intervals
    shifts : (p + 1, q) derivatives of the times of their ends; nan where an event only grazes its
             condition
    angle, speed, acceleration : of the inertias
    torque, sliding, base : torque of each contact on its first inertia, sliding speed, and speed
             of the base
    shared : the torques as a response shares them among contacts at rest that depend on each other
    power : by the dimension of the parts: what the damping of each shaft turns into heat, what
            each torque, controller and driven body supplies [W]
    sides  : the sides of the parameters on which the derivatives hold
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
    shared: VariedValues
    power: dict[str, VariedValues]
    sides: OneSided

    @property
    def machine(self) -> Machine:
        """The machine."""
        return self.task.machine

    @property
    def duration(self) -> tuple[float, FloatArray]:
        """Duration of the motion [s], and its derivatives."""
        return float(self.motion.length.sum()), self.shifts[-1] - self.shifts[0]

    def select(self, first: float, last: float) -> VariedMotion:
        """The motion between two fixed times that are ends of intervals."""
        middle = self.motion.start + 0.5 * self.motion.length
        chosen = (middle > first) & (middle < last)
        begin, count = int(np.argmax(chosen)), int(np.count_nonzero(chosen))
        shifts = self.shifts[begin : begin + count + 1].copy()
        shifts[0] = shifts[-1] = 0.0

        def cut(one: VariedValues) -> VariedValues:
            return VariedValues(one.values[chosen], one.changes[chosen])

        values: dict[str, Any] = {
            one.name: cut(getattr(self, one.name))
            for one in fields(self) if isinstance(getattr(self, one.name), VariedValues)
        }  # fmt: skip
        return replace(
            self, motion=self.motion.select(first, last), shifts=shifts,
            power={name: cut(one) for name, one in self.power.items()}, **values,
        )  # fmt: skip


def run_motion(task: TangentTask, further: ArrayLike = ()) -> MachineSeries:
    """The motion of a run that is to be differentiated.

    further : times that are to be ends of intervals too [s]
    """
    run = MachineTask(
        *task.span, np.empty(0), task.initial,
        until_rest=False, max_events=_MOST_EVENTS, method=task.method,
    )  # fmt: skip
    answer = solved(task.machine, run)
    found = machine_series(task.machine, run, answer, further)
    for _ in range(_ROUNDS):  # two bends may follow each other closely
        bends = _bends(found)
        if not bends.size:
            break
        further = np.union1d(further, bends)
        found = machine_series(task.machine, run, answer, further)
    return found


def _bends(motion: MachineSeries) -> FloatArray:
    """Times in intervals at which a contact at rest begins or ceases to bear the most it can.

    There the shares of others bend, though the motion is smooth.
    """
    machine, several = motion.machine, np.flatnonzero((~motion.slides).sum(axis=1) > 1)
    if not several.size or not depend(machine):
        return np.empty(0)
    torque, force = series(motion.torque[several]), series(motion.force[several])
    rest = ~motion.slides[several]

    def reached(chosen: NDArray[np.int64], x: FloatArray) -> NDArray[np.int8]:
        matrix = legendre.legvander(x, torque.shape[1] - 1)
        own, press = (np.einsum("kd,kdm->km", matrix, one[chosen]) for one in (torque, force))
        shared = least_shares(machine, own, press, rest[chosen])
        return limits_reached(machine, shared, press, rest[chosen])

    x = np.concatenate([[-1.0 + _INSIDE], NODES, [1.0 - _INSIDE]])
    every = np.repeat(np.arange(several.size), x.size)
    found = reached(every, np.tile(x, several.size)).reshape(several.size, x.size, -1)
    chosen, place = np.nonzero((found[:, 1:] != found[:, :-1]).any(axis=2))
    low, high, begun = x[place], x[place + 1], found[chosen, place]
    for _ in range(_HALVINGS if chosen.size else 0):
        middle = 0.5 * (low + high)
        same = (reached(chosen, middle) == begun).all(axis=1)
        low, high = np.where(same, middle, low), np.where(same, high, middle)
    own = several[chosen]
    return np.unique(motion.start[own] + 0.5 * motion.length[own] * (1.0 + high))


def varied_motion(
    task: TangentTask, motion: MachineSeries, end: FloatArray | float = 0.0, side: float = 1.0
) -> VariedMotion:
    """Differentiate a motion, that of ``run_motion``, at its nodes.

    end  : (q,) derivatives of the time at which it ends
    side : as for ``differentiated``
    """
    machine, nodes = task.machine, motion.times
    inside = np.clip(nodes, *task.span)
    found, sides = differentiated(task._replace(times=inside.ravel()), side)
    if found.outcome != Outcome.COMPLETED:
        raise RuntimeError(found.outcome)  # ``motion`` has completed
    task = task._replace(parameters=found.parameters)
    n = len(machine.inertias)

    def changes(of: FloatArray) -> FloatArray:
        return of.reshape(*nodes.shape, *of.shape[1:])

    angle = VariedValues(motion.angle, changes(found.states[:, :n]))
    speed = VariedValues(motion.speed, changes(found.states[:, n : 2 * n]))
    torque = VariedValues(motion.torque, changes(found.torques))
    base, _ = varied_signals(
        task, inside, lambda given: [as_signal(one.base_speed) for one in given.contacts]
    )
    relative = combined(task, lambda given, of: of @ contact_rows(given).T, speed)
    rates = np.where(motion.slides[:, None, :, None], relative.changes - base.changes, 0.0)
    output = VariedValues(motion.control, changes(found.outputs))
    acceleration, power = _supplied(task, inside, (angle, speed), (torque, output))
    force = VariedValues(motion.force, changes(found.forces))
    shared = varied_shares(task, torque, force, ~motion.slides[:, None])
    shifts = _shifts(task, motion, found, sides, end)
    if shared is not torque:
        _set_bends(shifts, motion, shared, found.events)
    return VariedMotion(
        task, motion, shifts, angle, speed,
        VariedValues(motion.acceleration, acceleration.changes), torque,
        VariedValues(motion.sliding, rates), base, shared, power, sides,
    )  # fmt: skip


def _supplied(
    task: TangentTask,
    times: FloatArray,
    state: tuple[VariedValues, VariedValues],
    known: tuple[VariedValues, VariedValues],
) -> tuple[VariedValues, dict[str, VariedValues]]:
    """Accelerations of the inertias, and the powers of shafts, torques, controllers and drives.

    state : angles and speeds;  known : torques of the contacts and outputs of the controllers
    """
    machine, (_, speed) = task.machine, state
    scale, _ = varied_signals(
        task, times,
        lambda given: [as_signal(one.scale or 1.0) for one in elements(given, straight=True)],
    )  # fmt: skip
    torque, lost = (scale * varied_elements(task, *state, lost=lost) for lost in (False, True))
    external, _ = varied_signals(
        task, times, lambda given: [as_signal(one.over_time or 0.0) for one in given.torques]
    )
    _, driven = varied_signals(
        task, times, lambda given: [as_signal(one.speed) for one in given.driven]
    )
    load = combined(task, _loads, torque, external, *known)
    acceleration = combined(task, _accelerations, load, driven)
    rate = combined(task, lambda given, of: of @ _rows(given, "row").T, speed)
    each, shafts = lost * rate, len(machine.shafts)
    supplied = external * combined(task, lambda given, of: of @ _on(given).T, speed)
    for number, one in enumerate(elements(machine, straight=True)[shafts:], shafts):
        for total, part in zip(supplied, each, strict=True):
            total[:, :, one.number] += part[:, :, number]
    bodies = range(len(machine.inertias))
    return acceleration, {
        "shaft": each.select([*range(shafts)]),
        "torque": supplied,
        "controller": known[1] * combined(task, lambda given, of: of @ _steered(given).T, speed),
        "driven": combined(task, _drives, load, acceleration)
        * speed.select([*bodies[len(bodies) - len(machine.driven) :]]),
    }


def _loads(
    machine: Machine, element: FloatArray, external: FloatArray, contact: FloatArray,
    output: FloatArray,
) -> FloatArray:  # fmt: skip
    """Torques on the bodies (..., n) without those of joints, from those of the parts."""
    found = element @ _rows(machine, "load") + external @ _on(machine)
    return np.asarray(found + contact @ contact_rows(machine) + output @ _steered(machine))


def _rows(machine: Machine, name: str) -> FloatArray:
    """Rows of the elements, (elements, n)."""
    rows = [getattr(one, name) for one in elements(machine, straight=True)]
    return np.array(rows).reshape(-1, len(machine.inertias))


def _on(machine: Machine) -> FloatArray:
    """Which body each torque acts on, (torques, n)."""
    return np.eye(len(machine.inertias))[[machine.index(one.on) for one in machine.torques]]


def _steered(machine: Machine) -> FloatArray:
    """Which body the output of each controller acts on as a torque, (controllers, n)."""
    rows = np.zeros((len(machine.controllers), len(machine.inertias)))
    for row, (part, what) in zip(rows, (one.acts_on for one in machine.controllers), strict=True):
        if what == TORQUE:
            row[machine.index(part)] = 1.0
    return rows


def _accelerations(machine: Machine, load: FloatArray, driven: FloatArray) -> FloatArray:
    """Accelerations of the bodies, from the torques on them and those of the driven ones."""
    still = np.zeros((*load.shape[:-1], load.shape[-1] - driven.shape[-1]))
    return accelerations(machine, load, np.concatenate([still, driven], axis=-1))


def _drives(machine: Machine, load: FloatArray, acceleration: FloatArray) -> FloatArray:
    """Torques of the drives (..., driven): the power that bodies and joints need beyond loads."""
    moving = len(machine.inertias) - len(machine.driven)
    needed = acceleration * masses(machine) - load
    return np.asarray(needed @ mobility(machine).project[:, moving:])


def _shifts(
    task: TangentTask, motion: MachineSeries, answer: TangentAnswer, sides: OneSided,
    end: FloatArray | float,
) -> FloatArray:  # fmt: skip
    """Derivatives of the end times of intervals; nan where the order of events changes."""
    edges = np.append(motion.start, motion.start[-1] + motion.length[-1])
    found = np.zeros((edges.size, len(task.parameters)))
    for j, (one, machine_at) in enumerate(zip(task.parameters, task.machine_at, strict=True)):
        for knots, changes in knot_changes(one, machine_at, task.span):
            place, same = matching(knots, edges)
            found[same, j] = changes[place[same]]
    for samples in samples_of(task):
        place, same = matching(samples.times, edges)
        found[same] += samples.changes[place[same]]
    place, same = matching(answer.events, edges)
    found[same] = answer.shifts[place[same]]
    place, same = matching(sides.times, edges)
    found[same] = np.where(sides.changes[place[same]], math.nan, found[same])
    found[0], found[-1] = 0.0, end
    return found


def _set_bends(
    shifts: FloatArray, motion: MachineSeries, shared: VariedValues, events: FloatArray
) -> None:
    """Set the derivatives of the times at which only the shares of contacts at rest bend.

    There the torques of both sides are the same, for all values of the parameters.
    """
    edges = motion.start[1:]
    rest = (~motion.slides).sum(axis=1) > 1
    free = rest[1:] & rest[:-1] & ~matching(events, edges)[1] & (shifts[1:-1] == 0.0).all(axis=1)
    (first, last), (first_by, last_by) = ends_of(shared.values), ends_of(shared.changes)
    slope = np.asarray(legendre.legder(series(shared.values), axis=1), float)
    slope *= (2.0 / motion.length)[:, None, None]
    bend = legendre.legval(-1.0, np.moveaxis(slope[1:], 1, 0))
    bend = bend - legendre.legval(1.0, np.moveaxis(slope[:-1], 1, 0))
    apart, by = np.abs(first[1:] - last[:-1]), first_by[1:] - last_by[:-1]
    size = np.abs(shared.values).max(initial=0.0)
    rate = size / motion.length[1:, None]
    bends = (np.abs(bend) > _BENT * rate).any(axis=1) & (apart <= _BENT * size).all(axis=1) & free
    for edge in np.flatnonzero(bends):
        most = np.argmax(np.abs(bend[edge]))
        shifts[edge + 1] = -by[edge, most] / bend[edge, most]


def period_changes(task: TangentTask) -> FloatArray:
    """Derivatives (q,) of the common period of the signals of a machine that has one [s].

    Raises ``InputError`` for a parameter that changes the ratio of two frequencies.
    """
    period = task.machine.period or math.nan

    def near(machine: Machine, name: str) -> float:
        found = machine.period
        if not found or abs(found - period) > 0.5 * period:
            raise wrong(
                "parameters", name, "without effect on the ratio of two frequencies",
                "The signals have a common period at this value only.",
            )  # fmt: skip
        return found

    return np.array([
        float(difference_of(one, lambda value, at=at, one=one: near(at(value), one.name)))  # type: ignore[misc]
        for one, at in zip(task.parameters, task.machine_at, strict=True)
    ])  # fmt: skip


def ends_of(values: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Values of quantities (p, nodes, ...) at the beginnings and at the ends of the intervals."""
    coefficients = series(values)
    matrix = legendre.legvander(_ENDS, coefficients.shape[1] - 1)
    first, last = np.moveaxis(np.einsum("ed,pd...->pe...", matrix, coefficients), 1, 0)
    return first, last
