"""Conversion of a ``Machine`` to the numbers of the kernels."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple

import numpy as np

from wedgebrake.arrays import FloatArray
from wedgebrake.dynamics.signals import OPERATION, TABLE, TERMS, Operation, Signals, powers
from wedgebrake.model.controller import COMMAND, TORQUE, Controller
from wedgebrake.model.elements import Element, elements
from wedgebrake.model.friction import SetValuedFriction
from wedgebrake.model.joints import is_coupled, mobility, reduction
from wedgebrake.model.machine import Machine
from wedgebrake.model.machine_matrices import (
    contact_rows,
    normal_rows,
    shaft_matrices,
    shaft_rows,
)
from wedgebrake.model.machine_parts import GROUND, Contact
from wedgebrake.model.piecewise import Line
from wedgebrake.model.signals.signal_tables import Table
from wedgebrake.model.signals.signals import (
    Exponential,
    Harmonic,
    Integral,
    Orders,
    Product,
    Signal,
    Sum,
    as_signal,
)
from wedgebrake.model.validation import wrong
from wedgebrake.solvers.machine.events.complementarity import ROUNDING
from wedgebrake.solvers.machine.friction_lines import Sliding, lines_of
from wedgebrake.solvers.machine.problem import (
    BOUND,
    CONTACT,
    CONTROLLER,
    DRIVEN,
    ELEMENT,
    LINE,
    MOST_LAG,
    PIECE,
    SHAFT,
    Controllers,
    Elements,
    Joints,
    MachineProblem,
    Presence,
)

HELD = 1e-12
"""Friction coefficient with which a contact with a smooth law holds at rest."""
# ``rounding`` of a machine that nothing excites. That of all swings before is part of it, and no
# motion on which anything depends begins with a torque as small.
_UNEXCITED = 1e-12
# Relative size of a sliding speed that counts as rounding among those that joints leave free.
_NO_SLIP = 1e-9
# Bits for the quantities of an element that have just been zero. Those of a piece, and of its
# neighbours, differ.
_BITS = 60
# Fields of ``CONTACT`` that number states, inputs and memory.
_NUMBERED = [
    "lag", "state", "force", "base_input", "base_rate", "sampled_input", "delay", "curve",
]  # fmt: skip


@dataclass
class Programs:
    """Programs of the signals of a machine, each once."""

    numbers: dict[Signal, int] = field(default_factory=dict)
    operations: list[tuple[Any, ...]] = field(default_factory=list)
    ends: list[int] = field(default_factory=list)
    tables: list[tuple[Any, ...]] = field(default_factory=list)
    points: list[tuple[FloatArray, FloatArray]] = field(
        default_factory=lambda: [(np.empty(0), np.empty(0))]
    )
    speeds: list[Signal] = field(default_factory=list)
    found: tuple[float, int, Signals] | None = None

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
        elif isinstance(signal, Exponential):
            self._operation(Operation.EXPONENTIAL, 0, signal.value, signal.growth, signal.begin)
        elif isinstance(signal, Table):
            self._operation(Operation.TABLE, len(self.tables), 1.0)
            self._table(signal)
        elif isinstance(signal, Orders):
            self._orders(signal)
        elif isinstance(signal, Integral):
            self._operation(Operation.ANGLE, self._angle(signal.speed))
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

    def _angle(self, speed: Signal) -> int:
        """Number of the integral of a speed."""
        if speed not in self.speeds:
            self.speeds.append(speed)
        return self.speeds.index(speed)

    def _orders(self, signal: Orders) -> None:
        angle = self._angle(signal.speed)
        for place, (order, amplitude, phase) in enumerate(signal.orders):
            self._operation(Operation.ORDER, angle, amplitude, order, phase)
            if place > 0:
                self._operation(Operation.ADD)

    def numbers_of(self, start: float) -> Signals:
        """The programs as the kernels take them, for a run that starts at a time [s]."""
        if self.found is not None and self.found[:2] == (start, len(self.ends)):
            return self.found[2]
        signals = self._numbers(start)
        self.found = start, len(self.ends), signals
        return signals

    def _numbers(self, start: float) -> Signals:
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
    """Return ``powers`` of a harmonic, zeros for other operations."""
    kind, _, value, frequency, _ = operation
    if kind != Operation.HARMONIC:
        return np.zeros(TERMS)
    return powers(value, 2.0 * math.pi * frequency)


def _speeds(signal: Signal) -> Iterator[Signal]:
    """The speeds that the orders in a primitive signal follow."""
    if isinstance(signal, Orders | Integral):
        yield signal.speed
    elif isinstance(signal, Sum | Product):
        for one in signal.signals:
            yield from _speeds(one)


@dataclass(frozen=True)
class Assembled:
    """The numbers of a machine.

    torques : input of each torque, -1: constant, or an element
    """

    problem: MachineProblem
    programs: Programs
    torques: tuple[int, ...]

    @property
    def signals(self) -> tuple[Signal, ...]:
        """The signals of the first inputs."""
        return tuple(self.programs.numbers)


def assemble(
    machine: Machine, start: float, *, curved: bool = False, further: Sequence[Signal] = (),
    programs: Programs | None = None,
) -> Assembled:  # fmt: skip
    """Return the numbers of a machine for a run that starts at a time [s].

    curved  : with friction as a curve over the sliding speed, for the method "smooth", in place of
              straight lines
    further : signals that are inputs too, although no part of the machine has them
    programs : those of another machine with the same signals

    Raises ``InputError`` for what the method cannot solve.
    """
    machine = machine.machine
    programs = programs or Programs()
    n = len(machine.inertias)
    load, drives = np.zeros(n), []
    torques = []
    for torque in machine.torques:
        on, signal = machine.index(torque.on), torque.over_time
        number = -1
        if signal is not None and signal.varies:
            number = programs.input(signal)
            drives.append((on, number))
        elif signal is not None:
            load[on] += float(signal(start))
        torques.append(number)
    parts, lines, state = _contact_parts(machine, start, programs, curved)
    loops = []
    for loop in machine.controllers:
        loops.append(_controller(loop, machine, start, programs, state))
        state += len(loop.memory)
    driven = [_input(one.speed, start, programs) for one in machine.driven]
    given = elements(machine)
    scales = [-1 if one.scale is None else programs.input(one.scale) for one in given]
    for signal in further:
        programs.input(signal)
    inputs = _number_inputs(parts, len(programs.ends))
    varying = [number >= 0 for number, _ in driven]
    rates = np.where(varying, inputs + np.cumsum(varying) - 1, -1)
    inputs += sum(varying)
    turning = [one.law.period > 0.0 for one in given]
    turns = np.where(turning, inputs + np.cumsum(turning) - 1, -1)
    inputs += sum(turning)
    scaled = [one.scale is not None for one in given]
    products = np.where(scaled, inputs + np.cumsum(scaled) - 1, -1)
    inputs += sum(scaled)
    for loop_part in loops:
        if loop_part["rate"] >= 0:
            loop_part["rate"], inputs = inputs, inputs + 1
    stiffness, damping = shaft_matrices(machine, linear=True)
    width = state + inputs + 1
    loads = np.zeros((n, width))
    loads[:, -1] = load
    for on, number in drives:
        loads[on, state + number] += 1.0
    free = loads.copy()
    free[:, :n], free[:, n : 2 * n] = -stiffness, -damping
    preloads = [one.preload for one in machine.shafts]
    if any(preloads):
        free[:, -1] += preloads @ shaft_rows(machine)
    shafts = np.array(
        [
            (machine.index(one.a), -1 if one.b == GROUND else machine.index(one.b),
             one.stiffness, one.damping, one.ratio, one.preload)
            for one in machine.shafts
            if one.law is None
        ],
        SHAFT,
    )  # fmt: skip
    inverse = 1.0 / np.array([one.inertia for one in machine.inertias])
    found = _contacts(machine, parts, inverse, state, width)
    controllers = _controllers(machine, given, loops, state, width)
    problem = MachineProblem(
        _presence(found.contacts, rates, controllers.records, found.joints),
        inverse, found.joints, free, loads, shafts,
        _elements(given, zip(turns, scales, products, strict=True), n, state, width), controllers,
        np.array(
            [
                (body, number, rate, value)
                for body, ((number, value), rate) in enumerate(
                    zip(driven, rates, strict=True), n - len(driven)
                )
            ],
            DRIVEN,
        ),
        found.sliding, found.normals, found.contacts, lines, programs.numbers_of(start), state,
        max((one.rate for one in programs.numbers), default=0.0), start,
        _rounding(programs, found.contacts),
    )  # fmt: skip
    return Assembled(problem, programs, tuple(torques))


def with_contacts(given: Assembled, machine: Machine, *, curved: bool) -> Assembled | None:
    """The numbers of a machine that differs from an assembled one in its contacts alone.

    None if it has other states or inputs. Raises ``InputError`` as ``assemble``.
    """
    machine, problem = machine.machine, given.problem
    inputs = len(given.programs.ends)
    parts, lines, _ = _contact_parts(machine, problem.start_time, given.programs, curved)
    if len(given.programs.ends) > inputs:
        return None
    _number_inputs(parts, inputs)
    found = _contacts(machine, parts, problem.inverse, problem.states, problem.torque.shape[1])
    if found.contacts[_NUMBERED].tolist() != problem.contacts[_NUMBERED].tolist():
        return None
    rounding = _rounding(given.programs, found.contacts)
    changed = problem._replace(lines=lines, rounding=rounding, **found._asdict())
    return replace(given, problem=changed)


def _rounding(programs: Programs, contacts: Any) -> float:
    """``rounding`` of a machine."""
    return ROUNDING if programs.ends or contacts["base_bound"].any() else _UNEXCITED


def _contact_parts(
    machine: Machine, start: float, programs: Programs, curved: bool
) -> tuple[list[dict[str, Any]], Any, int]:
    """The fields of ``CONTACT`` for each contact, their lines, and the number of states so far."""
    parts: list[dict[str, Any]] = []
    tables: list[Any] = []
    first, pressed, state = 0, 0, 2 * len(machine.inertias)
    commanded = [one.acts_on[0] for one in machine.controllers]
    for one in machine.contacts:
        part = _contact(one, machine, start, programs)
        part["commanded"] = int(one.name in commanded)
        part["state"], state = state, state + part["lag"]
        part["first_line"] = first
        part["normal"], pressed = (pressed, pressed + 1) if one.normal else (-1, pressed)
        lines = lines_of(Sliding(one.name, one.brake, one.friction, one.actuation), curved)
        part["curve"] = 0 if lines.curved else -1
        part["lines_forward"], part["lines_backward"] = lines.forward, lines.backward
        parts.append(part)
        tables.append(lines.rows)
        first += len(lines.rows)
    rows = np.zeros(max(first, 1), LINE)
    for part, table in zip(parts, tables, strict=True):
        rows[part["first_line"] :][: len(table)] = table
    return parts, rows, state


class _Contacts(NamedTuple):
    """What of a ``MachineProblem`` depends on contacts, apart from their lines."""

    joints: Joints
    sliding: FloatArray
    normals: FloatArray
    contacts: Any


def _contacts(
    machine: Machine, parts: list[dict[str, Any]], inverse: FloatArray, states: int, width: int
) -> _Contacts:
    """The contacts whose fields are known, with their rows.

    inverse : (n,) one over the inertias
    """
    n, names = len(machine.inertias), CONTACT.names or ()
    contacts = np.array([tuple(part[name] for name in names) for part in parts], CONTACT)
    sliding = np.zeros((len(parts), width))
    sliding[:, n : 2 * n], sliding[:, -1] = contact_rows(machine), -contacts["base_speed"]
    for row, part in zip(sliding, parts, strict=True):
        if part["base_input"] >= 0:
            row[states + part["base_input"]] = -1.0
    pressed = contacts["normal"] >= 0
    normals = np.zeros((np.count_nonzero(pressed), width))
    if len(normals):
        normals[:, : 2 * n] = normal_rows(machine)[pressed]
    joints = _joints(machine)
    _set_mobility(contacts, sliding[:, n : 2 * n], inverse, joints)
    return _Contacts(joints, sliding, normals, contacts)


def _presence(contacts: Any, rates: Any, controllers: Any, joints: Joints) -> Presence:
    """Which parts and inputs a machine has that the solver treats only if they exist.

    rates : (driven bodies,) indices of the inputs that are the rates of their speeds; -1 if none
    """
    limited = (controllers["held"] < 0) & (controllers["high"] < math.inf)
    moving = bool((contacts["base_rate"] >= 0).any())
    return Presence(
        rates=moving or bool((rates >= 0).any() or (controllers["rate"] >= 0).any()),
        samples=bool((contacts["sampled_input"] >= 0).any() or (controllers["held"] >= 0).any()),
        jumps=moving or bool((limited & (controllers["input"] >= 0)).any()),
        given=rates.size > 0 or joints.mobility.size > 0,
    )


def _joints(machine: Machine) -> Joints:
    """How the joints of a machine couple its bodies.

    Raises ``InputError`` for a contact whose sliding speed they determine.
    """
    if not is_coupled(machine):
        none = np.zeros((0, 0))
        return Joints(none, none, none, none)
    given, contacts = reduction(machine), contact_rows(machine)
    frame = contacts @ given.basis
    sizes = np.linalg.norm(frame, axis=1)
    for contact, size, row in zip(machine.contacts, sizes, contacts, strict=True):
        if size <= _NO_SLIP * np.linalg.norm(row):
            raise wrong(
                contact.name, contact, "left out: joints determine its sliding speed",
                "Its bodies are joined to each other, or to driven bodies. Give the torque of a"
                " brake on a driven shaft as a wb.Torque.",
            )  # fmt: skip
    return Joints(*mobility(machine), given.follow.copy(), frame)


def _set_mobility(contacts: Any, sliding: FloatArray, inverse: FloatArray, joints: Joints) -> None:
    """Set the mobilities of the contacts.

    sliding : (m, n) factors of the speeds of the bodies in their sliding speeds
    """
    if joints.mobility.size:
        contacts["mobility"] = np.einsum("mi,ij,mj->m", sliding, joints.mobility, sliding)
        return
    a, b = contacts["a"], contacts["b"]
    contacts["mobility"] = inverse[a] + np.where(b >= 0, inverse[b], 0.0)


def _elements(
    given: Sequence[Element], inputs: Iterable[Any], n: int, states: int, width: int
) -> Elements:
    """The numbers of the elements.

    inputs : for each element, the inputs that are its number of periods, scale and torque; -1: none
    """
    found: list[tuple[Any, ...]] = []
    pieces: list[tuple[int, ...]] = []
    bounds: list[tuple[int, ...]] = []
    arguments, torques, losses, lines, rows = [], [], [], [], []

    def row(element: Element, line: Line, turn: int) -> FloatArray:
        """The row of a line of an argument, which is that of the present period."""
        target = np.zeros(width)
        target[-1] = line.offset
        target[n if element.of_speed else 0 :][:n] += line.by_argument * element.row
        if line.by_rate:
            target[n : 2 * n] += line.by_rate * element.row
        if turn >= 0:
            target[states + turn] = -line.by_argument * element.law.period
        return target

    for element, (turn, scale, product) in zip(given, inputs, strict=True):
        law, first = element.law, len(pieces)
        own = law.pieces()
        bound = 1.0 if element.scale is None else element.scale.bound
        found.append((first, len(own), turn, scale, product, law.start, law.period, bound))
        arguments.append(row(element, Line(1.0), -1))
        for piece in own:
            pieces.append((len(bounds), len(piece.bounds)))
            lines.append(row(element, piece.torque, turn))
            losses.append(row(element, piece.loss, turn))
            torques.append(lines[-1])
            if scale >= 0:  # no work of such a torque is stored
                torques[-1] = losses[-1] = np.eye(width)[states + product]
            for one in piece.bounds:
                own_bit, reached = (1 << k % _BITS for k in (one.quantity, one.reached))
                bounds.append((first + one.target, own_bit, reached, one.turns))
                rows.append(row(element, one.line, turn))
    return Elements(
        np.array(found, ELEMENT), _table(arguments, width),
        np.array([one.load for one in given]).reshape(-1, n),
        np.array(pieces, PIECE), _table(torques, width), _table(losses, width),
        _table(lines, width), np.array(bounds, BOUND), _table(rows, width),
    )  # fmt: skip


def _controller(
    loop: Controller, machine: Machine, start: float, programs: Programs, state: int
) -> dict[str, Any]:
    """The fields of ``CONTROLLER`` for a controller.

    state : number of its first state

    With a rate of 0, to be numbered, where its integral part may have to follow the setpoint.
    """
    part, what = loop.acts_on
    places = {name: state + at for at, name in reversed(list(enumerate(loop.memory)))}
    number, value = _input(loop.setpoint, start, programs)
    low, high = loop.limits or (-math.inf, math.inf)
    step, smooth = loop.sample_time, loop.filter_time or 0.0
    if step is None:
        integral = loop.integral
        derivative = loop.derivative / smooth if loop.derivative else 0.0
        decay = 1.0 / smooth if loop.derivative else 0.0
    else:
        integral = loop.integral * step
        derivative, decay = loop.derivative / (smooth + step), smooth / (smooth + step)
    follows = step is None and "integral" in places and loop.limits is not None
    return {
        "proportional": loop.proportional, "integral": integral, "derivative": derivative,
        "filter": decay, "low": low, "high": high, "sample_time": step or 0.0,
        "resolution": loop.resolution or 0.0,
        "inertia": machine.index(part) if what == TORQUE else -1,
        "contact": machine.contact_names.index(part) if what == COMMAND else -1,
        "input": number, "rate": 0 if follows and number >= 0 else -1, "state": state,
        "sum": places.get("integral", -1), "filtered": places.get("filter", -1),
        "held": places.get("output", -1), "slope": places.get("rate", -1),
        "last": places.get("error", -1), "delay": loop.delay,
        "queue": state + len(loop.memory) - loop.delay, "setpoint": value,
    }  # fmt: skip


def _controllers(
    machine: Machine, given: Sequence[Element], parts: Sequence[dict[str, Any]], states: int,
    width: int,
) -> Controllers:  # fmt: skip
    """The numbers of the controllers."""
    n, names = len(machine.inertias), CONTROLLER.names or ()
    records = np.array([tuple(part[name] for name in names) for part in parts], CONTROLLER)
    errors = np.zeros((len(parts), width))
    forces = np.zeros((len(parts), len(machine.contacts)))
    torques = np.zeros((len(parts), len(given)))
    twists = shaft_rows(machine) if parts else errors
    shafts = [one.name for one in machine.shafts]
    laws = {one.number: number for number, one in enumerate(given) if one.kind == "shaft"}
    for number, (loop, part) in enumerate(zip(machine.controllers, parts, strict=True)):
        row = errors[number]
        row[-1] = part["setpoint"]
        if part["input"] >= 0:
            row[states + part["input"]] = 1.0
        for quantity, factor in loop.measured.items():
            name, _, what = quantity.rpartition(".")
            if what == "force":
                forces[number, machine.contact_names.index(name)] = factor
            elif what == "torque":
                at = shafts.index(name)
                shaft = machine.shafts[at]
                if at in laws:
                    torques[number, laws[at]] = factor
                    continue
                row[:n] -= factor * shaft.largest_stiffness * twists[at]
                row[n : 2 * n] -= factor * shaft.damping * twists[at]
                row[-1] += factor * shaft.preload
            else:
                row[machine.index(name) + (n if what == "speed" else 0)] -= factor
    return Controllers(records, errors, forces, torques)


def _table(rows: list[FloatArray], width: int) -> FloatArray:
    return np.array(rows).reshape(-1, width)


def _contact(
    contact: Contact, machine: Machine, start: float, programs: Programs
) -> dict[str, Any]:
    """The fields of ``CONTACT`` for a contact, except its state, lines and inputs."""
    brake, friction, given = contact.brake, contact.friction, contact.actuation
    force, initial_force = _input(given.initial_force, start, programs)
    base_input, base_speed = _input(contact.base_speed, start, programs)
    low, high = given.limits or (-math.inf, math.inf)
    # Smooth laws hold no torque at rest. With a coefficient slightly above rounding, a contact at
    # rest holds until its direction of sliding is determined.
    mu, peak = 0.0, HELD
    if isinstance(friction, SetValuedFriction):
        mu, peak = friction.kinetic_at(0.0), friction.breakaway
    gains = {
        name: brake.radius * brake.amplification(m)
        for name, m in (
            ("forward", mu), ("backward", -mu),
            ("breakaway_forward", peak), ("breakaway_backward", -peak),
        )
    }  # fmt: skip
    sampled = given.sample_time is not None
    states, rates, command = given.states, np.zeros((MOST_LAG, MOST_LAG)), np.zeros(MOST_LAG)
    rates[:states, :states] = given.dynamics.rates[:states, :states]
    command[:states] = given.dynamics.command[:states]
    return {
        "a": machine.index(contact.a),
        "b": -1 if contact.b == GROUND else machine.index(contact.b),
        "ratio": contact.ratio,
        "mobility": 0.0,
        "force": force,
        "initial_force": initial_force,
        "base_input": base_input,
        "base_speed": base_speed,
        "base_bound": abs(base_speed) if base_input < 0 else as_signal(contact.base_speed).bound,
        "base_rate": -1,
        "sampled_input": -1,
        "slope": given.slope,
        "lag": states,
        "lag_rates": rates,
        "lag_command": command,
        "lowest": max(low, 0.0) if given.release else low,
        "highest": high,
        "sample_time": given.sample_time if sampled else 0.0,
        "resolution": (given.resolution or 0.0) if sampled else 0.0,
        "delay": given.delay if sampled else 0,
        **gains,
    }


def _number_inputs(parts: list[dict[str, Any]], inputs: int) -> int:
    """Number the inputs of contacts that are no signals, after those that are; returns how many."""
    for part in parts:
        if part["base_input"] >= 0:
            part["base_rate"], inputs = inputs, inputs + 1
        if part["sample_time"] > 0.0:
            part["sampled_input"], inputs = inputs, inputs + 1
        if part["curve"] >= 0:
            part["curve"], inputs = inputs, inputs + 1
    return inputs


def _input(value: float | Signal, start: float, programs: Programs) -> tuple[int, float]:
    """(number of the input, 0), or (-1, value) for a signal that does not vary."""
    if not isinstance(value, Signal):
        return -1, float(value)
    if value.varies:
        return programs.input(value), 0.0
    return -1, float(value(start))
