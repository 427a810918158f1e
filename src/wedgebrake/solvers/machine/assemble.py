"""Conversion of a ``Machine`` to the numbers of the kernels."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from wedgebrake.dynamics.signals import OPERATION, TABLE, TERMS, Operation, Signals, powers
from wedgebrake.errors import InputError
from wedgebrake.model.friction import SetValuedFriction, SmoothFriction
from wedgebrake.model.machine import Machine
from wedgebrake.model.machine_matrices import contact_rows, shaft_matrices
from wedgebrake.model.machine_parts import GROUND, Contact
from wedgebrake.model.signal_orders import Orders
from wedgebrake.model.signal_tables import Table
from wedgebrake.model.signals import Harmonic, Product, Signal, Sum, as_signal
from wedgebrake.solvers.machine.friction_lines import Line, curved_lines, lag_order, straight_lines
from wedgebrake.solvers.machine.problem import CONTACT, LINE, MachineProblem

FloatArray = NDArray[np.float64]
# Coefficient of the torque that a contact with a smooth law holds at rest.
_HELD = 1e-12
_MOST_CONTACTS = 12


@dataclass
class _Programs:
    """Programs of the signals of a machine, each once."""

    numbers: dict[Signal, int] = field(default_factory=dict)
    operations: list[tuple[Any, ...]] = field(default_factory=list)
    ends: list[int] = field(default_factory=list)
    tables: list[tuple[Any, ...]] = field(default_factory=list)
    points: list[tuple[FloatArray, FloatArray]] = field(
        default_factory=lambda: [(np.empty(0), np.empty(0))]
    )
    speeds: list[Signal] = field(default_factory=list)

    def input(self, signal: Signal) -> int:
        """Number of the input that is a signal; of its own speeds first, as kernels need."""
        if signal not in self.numbers:
            plain = signal.primitive()
            for speed in _speeds(plain):
                self.input(speed)
            self._append(plain)
            self.numbers[signal] = len(self.ends)
            self.ends.append(len(self.operations))
        return self.numbers[signal]

    def _append(self, signal: Signal) -> None:
        """Append the operations of a primitive signal."""
        if isinstance(signal, Sum | Product):
            for place, one in enumerate(signal.signals):
                self._append(one)
                if place > 0:
                    kind = Operation.ADD if isinstance(signal, Sum) else Operation.MULTIPLY
                    self._operation(kind)
        elif isinstance(signal, Harmonic):
            self._operation(Operation.HARMONIC, 0, signal.amplitude, signal.frequency, signal.phase)
        elif isinstance(signal, Table):
            self._operation(Operation.TABLE, len(self.tables), 1.0)
            self._table(signal)
        elif isinstance(signal, Orders):
            self._orders(signal)
        else:
            self._operation(Operation.CONSTANT, 0, float(signal(0.0)))

    def _operation(
        self, kind: int, index: int = 0, value: float = 0.0, frequency: float = 0.0,
        phase: float = 0.0,
    ) -> None:  # fmt: skip
        self.operations.append((int(kind), index, value, frequency, phase))

    def _table(self, table: Table) -> None:
        first = sum(len(times) for times, _ in self.points)
        self.points.append(table.points)
        period = table.times[-1] - table.times[0] if table.periodic else 0.0
        self.tables.append((first, first + len(table.times) - 1, 0, 0, period, table.periodic))

    def _orders(self, signal: Orders) -> None:
        if signal.speed not in self.speeds:
            self.speeds.append(signal.speed)
        angle = self.speeds.index(signal.speed)
        for place, (order, amplitude, phase) in enumerate(signal.orders):
            self._operation(Operation.ORDER, angle, amplitude, order, phase)
            if place > 0:
                self._operation(Operation.ADD)

    def numbers_of(self, start: float) -> Signals:
        """The programs as the kernels take them."""
        depth = len(self.operations) + 1
        times, values = map(np.concatenate, zip(*self.points, strict=True))
        return Signals(
            np.array(self.operations, OPERATION),
            np.array([_powers(one) for one in self.operations]).reshape(-1, TERMS),
            np.array(self.ends, np.int64),
            np.array(self.tables, TABLE),
            times,
            values,
            np.array([float(one.integral(start)) for one in self.speeds], float),
            np.array([self.numbers[one] for one in self.speeds], np.int64),
            np.zeros((depth, TERMS)),
        )


def _powers(operation: tuple[Any, ...]) -> FloatArray:
    """``powers`` of a harmonic, otherwise zeros."""
    kind, _, value, frequency, _ = operation
    if kind != Operation.HARMONIC:
        return np.zeros(TERMS)
    return powers(value, 2.0 * math.pi * frequency)


def _speeds(signal: Signal) -> Iterator[Signal]:
    """The speeds that the orders in a primitive signal follow."""
    if isinstance(signal, Orders):
        yield signal.speed
    elif isinstance(signal, Sum | Product):
        for one in signal.signals:
            yield from _speeds(one)


@dataclass(frozen=True)
class Assembled:
    """The numbers of a machine.

    signals : of the first inputs
    torques : input of each torque, -1: constant
    """

    problem: MachineProblem
    signals: tuple[Signal, ...]
    torques: tuple[int, ...]


def assemble(machine: Machine, start: float, *, curved: bool = False) -> Assembled:
    """Return the numbers of a machine for a run that starts at a time [s].

    curved : with friction as a curve over the sliding speed, for the method "smooth", in place of
             straight lines

    Raises ``InputError`` for what the method cannot solve.
    """
    if len(machine.contacts) > _MOST_CONTACTS:
        raise InputError(
            f"machine.contacts: {len(machine.contacts)} contacts, but the solver tries all"
            f" patterns of sticks and slips of at most {_MOST_CONTACTS}. Use fewer contacts.",
            name="machine.contacts", value=len(machine.contacts),
            allowed=f"at most {_MOST_CONTACTS} contacts",
        )  # fmt: skip
    programs = _Programs()
    n, count = len(machine.inertias), len(machine.contacts)
    load, drives = np.zeros(n), []
    torques = []
    for torque in machine.torques:
        on = machine.index(torque.on)
        number = -1
        if torque.signal.varies:
            number = programs.input(torque.signal)
            drives.append((on, number))
        else:
            load[on] += float(torque.signal(start))
        torques.append(number)
    contacts = np.zeros(count, CONTACT)
    state = 2 * n
    for number, one in enumerate(machine.contacts):
        _contact(contacts[number], one, machine, start, programs)
        if lag_order(one.actuation) > 0:
            contacts[number]["state"] = state
            state += int(contacts[number]["lag"])
    lines = _set_lines(contacts, machine, curved)
    inputs = _number_inputs(contacts, len(programs.ends))
    stiffness, damping = shaft_matrices(machine)
    free = np.zeros((n, state + inputs + 1))
    free[:, :n], free[:, n : 2 * n], free[:, -1] = -stiffness, -damping, load
    for on, number in drives:
        free[on, state + number] += 1.0
    sliding = np.zeros((count, state + inputs + 1))
    sliding[:, n : 2 * n], sliding[:, -1] = contact_rows(machine), -contacts["base_speed"]
    for row, one in zip(sliding, contacts, strict=True):
        if one["base_input"] >= 0:
            row[state + one["base_input"]] = -1.0
    problem = MachineProblem(
        1.0 / np.array([one.inertia for one in machine.inertias]), free, sliding, contacts,
        _numbers_of(lines), programs.numbers_of(start), state,
        max((one.rate for one in programs.numbers), default=0.0), start,
    )  # fmt: skip
    return Assembled(problem, tuple(programs.numbers), tuple(torques))


def _contact(
    row: Any, contact: Contact, machine: Machine, start: float, programs: _Programs
) -> None:
    """Set the numbers of a contact, except its lines."""
    brake, friction, given = contact.brake, contact.friction, contact.actuation
    row["a"] = machine.index(contact.a)
    row["b"] = -1 if contact.b == GROUND else machine.index(contact.b)
    row["force"], row["initial_force"] = _input(given.initial_force, start, programs)
    row["base_input"], row["base_speed"] = _input(contact.base_speed, start, programs)
    row["base_bound"] = as_signal(contact.base_speed).bound
    row["base_rate"] = row["held"] = -1
    row["slope"] = given.slope
    row["lag"] = lag_order(given)
    row["lag_time"] = given.lag
    row["lag_frequency"] = given.frequency or 0.0
    row["lag_damping"] = given.damping_ratio or 0.0
    low, high = given.limits or (-math.inf, math.inf)
    row["lowest"] = max(low, 0.0) if given.release else low
    row["highest"] = high
    # Smooth laws hold no torque at rest. One above rounding lets a contact at rest wait until its
    # direction is decided.
    mu, breakaway = 0.0, _HELD
    if isinstance(friction, SetValuedFriction):
        mu, breakaway = friction.kinetic_at(0.0), friction.breakaway
    for name, m in (
        ("forward", mu), ("backward", -mu),
        ("breakaway_forward", breakaway), ("breakaway_backward", -breakaway),
    ):  # fmt: skip
        row[name] = brake.radius * brake.amplification(m)
    if given.sample_time is not None:
        row["sample_time"] = given.sample_time
        row["resolution"] = given.resolution or 0.0
        row["delay"] = given.delay


def _number_inputs(contacts: Any, inputs: int) -> int:
    """Number the inputs of contacts that are no signals, after those that are; returns how many."""
    for row in contacts:
        if row["base_input"] >= 0:
            row["base_rate"], inputs = inputs, inputs + 1
        if row["sample_time"] > 0.0:
            row["held"], inputs = inputs, inputs + 1
        if row["curve"] >= 0:
            row["curve"], inputs = inputs, inputs + 1
    return inputs


def _set_lines(contacts: Any, machine: Machine, curved: bool) -> list[Line]:
    """Return the lines of all contacts, and set their numbers; ``curve`` is 0 if it has curves."""
    lines: list[Line] = []
    for row, one in zip(contacts, machine.contacts, strict=True):
        smooth = isinstance(one.friction, SmoothFriction)
        bends = curved and (smooth or not one.friction.constant)
        row["curve"] = 0 if bends else -1
        found = curved_lines(one) if bends else straight_lines(one)
        row["first_line"] = len(lines)
        row["lines_forward"], row["lines_backward"] = map(len, found)
        lines += [*found[0], *found[1]]
    return lines


def _input(value: float | Signal, start: float, programs: _Programs) -> tuple[int, float]:
    """(number of the input, 0), or (-1, value) for a signal that does not vary."""
    signal = as_signal(value)
    if signal.varies:
        return programs.input(signal), 0.0
    return -1, float(signal(start))


def _numbers_of(lines: list[Line]) -> Any:
    """Lines as the kernels take them, of dtype ``LINE``."""
    rows = np.zeros(max(len(lines), 1), LINE)
    for row, line in zip(rows, lines, strict=False):
        for name in ("start", "offset", "slope", "bends"):
            row[name] = getattr(line, name)
        row["degree"] = max(len(line.factors) - 1, 0)
        row["factors"][: len(line.factors)] = line.factors
    return rows
