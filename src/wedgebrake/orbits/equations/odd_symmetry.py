"""Odd symmetry of a machine: if x(t) is a motion, so is -x(t + T/2), with the period T."""

from __future__ import annotations

import math

import numpy as np

from wedgebrake.model.brakes import Brake
from wedgebrake.model.elements import elements
from wedgebrake.model.friction import Friction, SmoothFriction
from wedgebrake.model.machine import Machine
from wedgebrake.model.signals.signal_tables import Table
from wedgebrake.model.signals.signals import (
    Constant,
    Harmonic,
    Orders,
    Product,
    Signal,
    Sum,
    as_signal,
)

# Coefficients of friction at which the two directions of a brake are compared.
_COMPARED = (0.05, 0.2, 0.4)
# Sliding speeds at which the directions of a smooth law are compared, in half widths.
_SPEEDS = (0.1, 0.5, 1.0, 2.0, 10.0, 100.0)
# Relative difference that is rounding.
_ROUNDING = 1e-12
# Share of a sample by which half a period may differ from a whole number of samples.
_SAMPLES = 1e-9
_EVEN, _ODD, _ZERO = {1}, {-1}, {1, -1}


def alike_in_both_directions(brake: Brake) -> bool:
    """Return True if a brake acts equally in both directions."""
    return all(brake.amplification(m) == -brake.amplification(-m) for m in _COMPARED)


def has_odd_symmetry(machine: Machine) -> bool:
    """Return True if the mirror image of every motion, half a period later, is another motion.

    Torques and speeds of bases then change their sign after half a period, actuation forces and
    samplings repeat after it, and friction acts alike in both directions. Returns False for
    machines without a period, with controllers, driven bodies, or piecewise-linear parts.
    """
    period = machine.period
    if not period:
        return False
    for contact in machine.contacts:
        given = contact.actuation
        # Without a slope the coordinates of the section omit the state of a lag (``coordinates``).
        unknown = given.states > 0 and given.slope == 0.0
        if unknown or (given.sample_time and not _is_whole(0.5 * period / given.sample_time)):
            return False
        if not alike_in_both_directions(contact.brake) or not _is_odd(contact.friction):
            return False
    if machine.controllers or machine.driven or elements(machine):
        return False
    if any(one.normal for one in machine.contacts):
        return False
    odd = [one.over_time for one in machine.torques if one.over_time is not None]
    odd += [as_signal(one.base_speed) for one in machine.contacts]
    even = [as_signal(one.actuation.initial_force) for one in machine.contacts]
    return all(-1 in _signs(one.primitive(), period) for one in odd) and all(
        1 in _signs(one.primitive(), period) for one in even
    )


def _is_whole(count: float) -> bool:
    """Return True for a whole number, up to rounding."""
    return abs(count - round(count)) <= _SAMPLES


def _is_odd(friction: Friction) -> bool:
    """Return True for a law whose coefficient depends on the magnitude of the speed alone."""
    if not isinstance(friction, SmoothFriction):
        return True
    speeds = [share * friction.transition for share in _SPEEDS]
    return all(friction.coefficient(v) == -friction.coefficient(-v) for v in speeds)


def _signs(signal: Signal, period: float) -> set[int]:
    """The factors, of 1 and -1, by which a primitive signal changes in half a period."""
    if signal.bound == 0.0:
        return _ZERO
    if isinstance(signal, Constant):
        return _EVEN
    if isinstance(signal, Harmonic):
        return _of_turns(0.5 * signal.frequency * period)
    if isinstance(signal, Sum):
        return set.intersection(*(_signs(one, period) for one in signal.signals))
    if isinstance(signal, Product):
        factors = {1}
        for one in signal.signals:
            factors = {first * second for first in factors for second in _signs(one, period)}
        return factors
    if isinstance(signal, Orders) and 1 in _signs(signal.speed, period):
        turns = float(signal.speed.integral(0.5 * period)) / (2.0 * math.pi)
        terms = (_of_turns(n * turns) for n, size, _ in signal.orders if size != 0.0)
        return set.intersection(*terms)
    return _of_table(signal, period) if isinstance(signal, Table) else set()


def _of_turns(turns: float) -> set[int]:
    """Factors by which a sine changes in a number of turns; none unless it is half or whole."""
    halves = round(2.0 * turns)
    if abs(2.0 * turns - halves) > _ROUNDING * max(abs(halves), 1.0):
        return set()
    return _ODD if halves % 2 else _EVEN


def _of_table(table: Table, period: float) -> set[int]:
    """Factors by which a table changes in half a period, from two points of each of its lines."""
    if not table.varies:
        return _EVEN
    if not table.periodic:
        return set()
    half = 0.5 * period
    knots = table.knots(-half, 2.0 * period)
    edges = np.unique(np.concatenate((knots, knots - half, [0.0, half])))
    edges = edges[(edges >= 0.0) & (edges <= half)]
    # Knots that differ by rounding are one.
    edges = edges[np.append(np.diff(edges) > _ROUNDING * period, True)]
    times = np.concatenate([edges[:-1] + share * np.diff(edges) for share in (0.25, 0.75)])
    first, second = table(times), table(times + half)
    return {
        sign for sign in (1, -1)
        if np.all(np.abs(second - sign * first) <= _ROUNDING * table.bound)
    }  # fmt: skip
