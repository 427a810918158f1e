"""A machine in plain numbers, as a user of another program would define it.

    J w' = torques - K q - C w - W' friction,   friction = gain (F_0(t) + slope |v|),   v = W w

It has Coulomb friction with a static peak, wedge and conventional brakes, and forces that release.
Only the parameters of a machine are taken from the package.
"""

import math
from collections.abc import Callable, Sequence
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np

import wedgebrake as wb

Line = tuple[float, float, float]  # value = [1] + [2] (time - [0]), between two knots
# A signal at a time, with the sine of numbers or of expressions, and the present lines of tables.
Signal = Callable[[Any, Callable[[Any], Any], Sequence[Any]], Any]


class Friction(NamedTuple):
    """Coulomb friction of a contact.

    force, size   : F_0(t), not negative, and its bound; with a controller, the force that it holds
    slope         : of the force over the sliding speed
    kinetic, peak : torque over force, in sliding and its limit at rest, for the sides 1 and -1
    """

    force: Signal
    size: float
    slope: float
    kinetic: dict[int, float]
    peak: dict[int, float]


class Machine(NamedTuple):
    """Matrices J (its diagonal), K, C and W, angles and then speeds at the start, and the rest.

    torques     : number of the inertia, and the signal
    tables      : lines of the tables of all signals
    controllers : number of the contact, that of the table of its force, and its actuation
    """

    inertia: np.ndarray
    stiffness: np.ndarray
    damping: np.ndarray
    rows: np.ndarray
    start: np.ndarray
    torques: list[tuple[int, Signal]]
    contacts: list[Friction]
    tables: list[list[Line]]
    controllers: list[tuple[int, int, wb.Actuation]]

    @classmethod
    def of(cls, machine: wb.Machine) -> "Machine":
        """The numbers of a machine."""
        inertias, shafts = machine.inertias, machine.shafts
        unit = dict(zip([one.name for one in inertias], np.eye(len(inertias)), strict=True))
        unit["ground"] = np.zeros(len(inertias))
        twist = np.array([unit[one.a] - one.ratio * unit[one.b] for one in shafts])
        twist = twist.reshape(len(shafts), len(inertias))
        tables: list[list[Line]] = []
        contacts, controllers = [], []
        for i, one in enumerate(machine.contacts):
            assert one.base_speed == 0.0
            assert isinstance(one.friction, wb.CoulombFriction)
            force, slope = one.actuation.initial_force, one.actuation.slope
            size = force.bound if isinstance(force, wb.Signal) else force
            if one.actuation.sample_time is not None:
                controllers.append((i, len(tables), one.actuation))
                force, slope = wb.Table([0.0, 1.0], [size, size], after="hold"), 0.0
            gains = [
                {side: _gain(one.brake, side * mu) for side in (1, -1)}
                for mu in (one.friction.kinetic, one.friction.static)
            ]
            contacts.append(Friction(_signal(force, tables), size, slope, *gains))
        names = list(unit)
        return cls(
            inertia=np.array([one.inertia for one in inertias]),
            stiffness=twist.T * [one.stiffness for one in shafts] @ twist,
            damping=twist.T * [one.damping for one in shafts] @ twist,
            rows=np.array([unit[one.a] - unit[one.b] for one in machine.contacts]),
            start=np.array([one.angle for one in inertias] + [one.speed for one in inertias]),
            torques=[(names.index(one.on), _signal(one.signal, tables)) for one in machine.torques],
            contacts=contacts, tables=tables, controllers=controllers,
        )  # fmt: skip


def _gain(brake: wb.Brake, m: float) -> float:
    """Torque over actuation force at the signed coefficient m."""
    if isinstance(brake, wb.ConventionalBrake):
        return brake.radius * m
    assert isinstance(brake, wb.WedgeBrake)
    assert m < math.tan(brake.angle)
    return brake.radius * m / (math.tan(brake.angle) - m)


def _signal(signal: float | wb.Signal, tables: list[list[Line]]) -> Signal:
    """A signal as a function; its tables are appended to the others."""
    if not isinstance(signal, wb.Signal):
        return lambda _time, _sin, _lines: signal
    signal = signal.primitive()
    if isinstance(signal, wb.Constant):
        return _signal(signal.value, tables)
    if isinstance(signal, wb.Harmonic):
        amplitude, phase, omega = signal.amplitude, signal.phase, 2.0 * math.pi * signal.frequency
        return lambda time, sin, _lines: amplitude * sin(omega * time + phase)
    if isinstance(signal, wb.Table):
        at = len(tables)
        tables.append(_lines(signal))
        return lambda time, _sin, lines: lines[at][1] + lines[at][2] * (time - lines[at][0])
    assert signal.kind in ("sum", "product")
    combine = sum if signal.kind == "sum" else math.prod
    parts = [_signal(one, tables) for one in signal.signals]
    return lambda time, sin, lines: combine(one(time, sin, lines) for one in parts)


def _lines(table: wb.Table) -> list[Line]:
    """The lines of a table, the first from time 0."""
    assert table.times[0] == 0.0
    assert not table.periodic
    points = pairwise(zip(table.times, table.values, strict=True))
    lines = [(t, u, (to - u) / (end - t)) for (t, u), (end, to) in points if end > t]
    return [*lines, (table.times[-1], table.values[-1], 0.0)]
