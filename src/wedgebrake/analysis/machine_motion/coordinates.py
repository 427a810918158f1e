"""Scaled coordinates of the state of a machine, in which distances are measured.

The angles of free rotations, which no shaft restrains, are omitted; their speeds are kept. Driven
bodies have no coordinates; angles are relative to the equilibrium that follows them.
In these coordinates half the square of the norm is the energy of shafts and inertias divided by the
largest inertia, so that all coordinates are speeds [rad/s]. The states of an actuator's lag are
divided by its slope; without a slope they depend on the signals alone and are excluded, unless
controllers command the force. The states of controllers are divided by what a speed of 1 rad/s
causes; those of digital ones jump at samples and are part of derivatives of the flow only.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from wedgebrake.arrays import FloatArray
from wedgebrake.model.controller import COMMAND, Controller
from wedgebrake.model.joints import free_motions, reduction
from wedgebrake.model.machine import Machine
from wedgebrake.model.machine_matrices import (
    RANK,
    check_restrained,
    contact_rows,
    controlled_angles,
    masses,
    natural_frequencies,
    root_of_inertias,
    shaft_matrices,
    shaft_rows,
)
from wedgebrake.model.machine_parts import Contact


@dataclass(frozen=True, eq=False)
class Coordinates:
    """Linear maps from states x to scaled coordinates, y = to x, and back for small deviations.

    to, back  : (p, states), (states, p); to back = 1
    memory    : (states, d) units of the states of digital controllers, which derivatives of the
                flow contain too
    forces    : (f,) units of the forces in the memory of samples, which derivatives of the flow
                contain after the states [N s/rad]
    delayed   : (d,) units of those that are sampled but not yet applied, between two samplings
    speeds    : slice of the coordinates that belong to the speeds of inertias
    motions   : (n, f) angles of all bodies per angle of each free one
    carried   : (n, d) of all bodies per angle of each driven one, in equilibrium
    frequency : lowest natural angular frequency of the shafts [rad/s]; 0 without shafts
    """

    to: FloatArray
    back: FloatArray
    memory: FloatArray
    forces: FloatArray
    delayed: FloatArray
    speeds: slice
    motions: FloatArray
    carried: FloatArray
    frequency: float

    def scaled(self, matrices: FloatArray) -> FloatArray:
        """Derivatives of the flow, (k, states + f, states + f), in these coordinates."""
        to, back = self._of_flow
        return np.asarray(to @ matrices @ back)

    @cached_property
    def _of_flow(self) -> tuple[FloatArray, FloatArray]:
        """As ``to`` and ``back``, with all that derivatives of the flow contain."""
        states, forces, whole = self.to.shape[1], self.forces, self.with_memory()
        p = whole.size
        to = np.zeros((p + forces.size, states + forces.size))
        back = np.zeros(to.T.shape)
        to[:p, :states], to[p:, states:] = whole.to, np.diag(1.0 / forces)
        back[:states, :p], back[states:, p:] = whole.back, np.diag(forces)
        return to, back

    def with_memory(self, kept: Sequence[bool] | None = None) -> Coordinates:
        """With the states of digital controllers among the coordinates, the last of them.

        kept : which of these states; None for all
        """
        memory = self.memory if kept is None else self.memory[:, np.array(kept, bool)]
        inverse = np.divide(1.0, memory, out=np.zeros_like(memory), where=memory > 0.0)
        return replace(
            self, to=np.vstack([self.to, inverse.T]), back=np.hstack([self.back, memory]),
            memory=memory[:, :0],
        )  # fmt: skip

    @property
    def longest_period(self) -> float:
        """Period of the lowest natural vibration [s]; 1 s without shafts."""
        return 2.0 * math.pi / self.frequency if self.frequency else 1.0

    @property
    def size(self) -> int:
        """Number of coordinates."""
        return len(self.to)


def winding_bodies(machine: Machine, *, held: bool = False) -> tuple[str, ...]:
    """Names of the driven bodies that wind up a shaft for ever, whatever the others do.

    held : whether no contact slides
    """
    if not machine.driven:
        return ()
    stiff = np.array([one.largest_stiffness > 0.0 for one in machine.shafts], bool)
    rows = shaft_rows(machine)[stiff]
    if held:
        rows = np.vstack([rows, contact_rows(machine)])
    if not rows.size:
        return ()
    moving = len(machine.inertias) - len(machine.driven)
    means = np.array([one.mean_speed(machine.period or 1.0) for one in machine.driven])
    follow = reduction(machine).follow if machine.joints else np.eye(len(machine.inertias))
    twists = rows @ follow[:, moving:] * means
    # What remains of these rates if the free bodies turn so that it is least.
    turned = rows @ free_motions(machine)
    rest = twists - turned @ np.linalg.lstsq(turned, twists, rcond=RANK)[0]
    size = float(np.abs(twists).max())
    if np.abs(rest.sum(axis=1)).max() <= RANK * size:
        return ()
    winds = np.abs(rest).max(axis=0) > RANK * size
    return tuple(one.name for one, each in zip(machine.driven, winds, strict=True) if each)


def scales_of(contact: Contact) -> tuple[Any, ...]:
    """What ``coordinates`` take from a contact."""
    given = contact.actuation
    if given.direct:
        return (contact.normal,)
    names = ("states", "slope", "frequency", "sample_time", "delay", "resolution", "is_in_loop")
    return (contact.normal, *(getattr(given, name) for name in names))


def coordinates(machine: Machine) -> Coordinates:
    """Scaled coordinates of a machine.

    Raises ``InputError`` for a normal force that depends on an angle that grows.
    """
    check_restrained(machine)
    bodies, moving = len(machine.inertias), len(machine.inertias) - len(machine.driven)
    basis = free_motions(machine)
    n = basis.shape[1]
    largest = max(one.inertia for one in machine.inertias[:moving])
    stiffness = shaft_matrices(machine)[0]
    # Of the free bodies, by which those that joints connect to them follow.
    free = list(reduction(machine).free) if machine.joints else list(range(n))
    springs = basis.T @ stiffness @ basis if machine.joints else stiffness[:n, :n]
    energies, every = np.linalg.eigh(springs / largest)
    restrained = energies > RANK * max(energies[-1], 0.0)
    frequencies, shapes = np.sqrt(energies[restrained]), every[:, restrained]
    natural = natural_frequencies(machine)
    slowest = float(natural[0]) if natural.size else 0.0
    further = _measured_rotations(machine, every, restrained, basis)
    frequencies = np.append(frequencies, np.full(further.shape[1], slowest or 1.0))
    shapes = np.hstack([shapes, further])
    states = 2 * bodies + sum(one.actuation.states for one in machine.contacts)
    states += sum(len(one.memory) for one in machine.controllers)
    to, back = np.zeros((2, states, states))
    p = len(frequencies)
    to[:p, free], back[:bodies, :p] = (
        frequencies[:, None] * shapes.T,
        basis @ (shapes / frequencies),
    )
    follow = reduction(machine).follow if machine.joints else np.eye(bodies)
    carried = follow[:, moving:]
    if bodies > moving:
        following = _following(carried, stiffness, basis, _turn_together(machine))
        to[:p, moving:bodies] = to[:p, free] @ following
        carried = carried - basis @ following
    speeds = slice(bodies, 2 * bodies)
    if machine.joints:
        root = root_of_inertias(machine, basis) / math.sqrt(largest)
        to[p : p + n, [bodies + one for one in free]] = root.T
        back[speeds, p : p + n] = basis @ np.linalg.inv(root.T)
    else:
        roots = np.sqrt(masses(machine)[:n] / largest)
        to[p : p + n, bodies : bodies + n] = np.diag(roots)
        back[bodies : bodies + n, p : p + n] = np.diag(1.0 / roots)
    row, state = p + n, 2 * bodies
    units = [_loop_units(one, machine, slowest or 1.0) for one in machine.controllers]
    for contact in machine.contacts:
        given = contact.actuation
        scale = abs(given.slope) + sum(
            unit
            for loop, (unit, _) in zip(machine.controllers, units, strict=True)
            if loop.acts_on == (contact.name, COMMAND)
        )
        for derivative in range(given.states):
            if scale != 0.0:
                rate = given.frequency or 1.0
                unit = scale * rate**derivative
                to[row, state], back[state, row] = 1.0 / unit, unit
                row += 1
            state += 1
    digital: list[tuple[int, float]] = []
    for loop, (unit, of_error) in zip(machine.controllers, units, strict=True):
        for name in loop.memory:
            own = of_error if name in ("filter", "error") else unit
            if loop.sample_time is not None:
                digital.append((state, own))
            else:
                to[row, state], back[state, row] = 1.0 / own, own
                row += 1
            state += 1
    memory = np.zeros((states, len(digital)))
    for column, (place, own) in enumerate(digital):
        memory[place, column] = own
    forces, delayed = _forces(machine)
    return Coordinates(
        to=to[:row], back=back[:, :row], memory=memory, forces=forces, delayed=delayed,
        speeds=slice(p, p + n), motions=basis, carried=carried, frequency=slowest,
    )  # fmt: skip


def _measured_rotations(
    machine: Machine, shapes: FloatArray, restrained: NDArray[np.bool_], basis: FloatArray
) -> FloatArray:
    """Orthonormal rotations that no shaft restrains and whose angles controllers measure, (f, q).

    shapes : of the stiffness, (f, f)
    basis  : (n, f) free motions
    """
    free, measured = shapes[:, ~restrained], controlled_angles(machine)
    rows = measured @ basis @ free
    rows[np.abs(rows) <= RANK * (np.abs(measured) @ np.abs(basis) @ np.abs(free))] = 0.0
    if not rows.any():
        return np.zeros((len(shapes), 0))
    _, sizes, right = np.linalg.svd(rows)
    found: FloatArray = free @ right[: int(np.sum(sizes > RANK * sizes[0]))].T
    return found


def _loop_units(loop: Controller, machine: Machine, frequency: float) -> tuple[float, float]:
    """Units of the output of a controller and of its error, of vibration of 1 rad/s."""
    of_error = 0.0
    for name, factor in loop.measured.items():
        part, _, what = name.rpartition(".")
        if what == "torque":
            shaft = next(one for one in machine.shafts if one.name == part)
            of_error += abs(factor) * (shaft.largest_stiffness / frequency + shaft.damping)
        elif what != "force":
            of_error += abs(factor) / (frequency if what == "angle" else 1.0)
    of_error = of_error or 1.0
    gain = abs(loop.proportional) or abs(loop.integral) / frequency
    return (gain or abs(loop.derivative) * frequency or 1.0) * of_error, of_error


def _turn_together(machine: Machine) -> bool:
    """Return True if driven bodies turn, and together wind up no shaft."""
    turns = any(one.mean_speed(machine.period or 1.0) for one in machine.driven)
    return turns and not winding_bodies(machine)


def _following(
    carried: FloatArray, stiffness: FloatArray, basis: FloatArray, together: bool
) -> FloatArray:
    """Minus the angles of the free bodies in equilibrium, per angle of each driven body.

    Zero where driven bodies wind up shafts as they turn: their angles then repeat, or nothing does.

    carried  : (n, d) angles of all bodies per angle of each driven one, those of free ones at zero
    together : whether the driven bodies turn and together wind up no shaft, as at equal speeds
    """
    by_driven = basis.T @ stiffness @ carried
    found: FloatArray = np.linalg.pinv(basis.T @ stiffness @ basis, RANK) @ by_driven
    left = carried.T @ stiffness @ carried - by_driven.T @ found
    winds = not together and np.abs(left).max() > RANK * np.abs(stiffness).max()
    return np.zeros_like(found) if winds else found


def _forces(machine: Machine) -> tuple[FloatArray, FloatArray]:
    """Units of the forces that sampled actuations apply and delay, and of those that they delay.

    The first are without those of actuations that round: their derivative is zero.
    """
    forces: list[float] = []
    delayed: list[float] = []
    for contact in machine.contacts:
        given = contact.actuation
        if given.sample_time is not None:
            unit = abs(given.slope) or 1.0
            delayed += [unit] * given.delay
            varies = given.slope != 0.0 or given.delay > 0 or given.is_in_loop
            if varies and not given.resolution:
                forces += [unit] * (1 + given.delay)
    return np.array(forces), np.array(delayed)
