"""Taylor series of signals: functions of time made of constants, sines, tables and orders.

A signal is a program in postfix notation: each operation pushes a series, or replaces the last
two by their sum or product. Between the knots of its tables a signal is analytic.
"""

import math
from enum import IntEnum
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from wedgebrake.dynamics.jit import borrowing, embedded
from wedgebrake.dynamics.records import record

TERMS = 28
"""Largest number of terms of a Taylor series."""


class Operation(IntEnum):
    """Operations of a signal's program."""

    CONSTANT = 0  # value
    HARMONIC = 1  # value sin(2 pi frequency t + phase)
    TABLE = 2  # value times the interpolated table number ``index``
    ORDER = 3  # value sin(frequency theta + phase), theta the integral of speed number ``index``
    ADD = 4
    MULTIPLY = 5
    EXPONENTIAL = 6  # value exp(frequency (t - phase)), the exponent at most 700
    ANGLE = 7  # theta, the integral of speed number ``index``


OPERATION = record("value frequency phase", whole="kind index")
# A table: its points in the arrays of all tables, whether it repeats, and for the present time the
# point before it and the repetitions so far. Not periodic: the first value before, the last after.
TABLE = record("period", whole="first last cursor turns", fields=[("periodic", np.bool_)])


class Signals(NamedTuple):
    """Signals of a machine.

    operations : of dtype ``OPERATION``, the programs one after the other
    powers     : (operations, TERMS) factors of sine and cosine in the series of a harmonic
    ends       : (signals,) end of each program
    tables     : of dtype ``TABLE``; their cursors belong to the run
    times, values : points of all tables
    angles     : integrals of the speeds that orders follow, at the present time [rad]
    speeds     : the signals that are these speeds
    stack      : (depth, TERMS) for the programs
    """

    operations: Any
    powers: Any
    ends: Any
    tables: Any
    times: Any
    values: Any
    angles: Any
    speeds: Any
    stack: Any


@borrowing
def turns(frequency, time, rest):
    """Frequency (time + rest) modulo 1, accurate to rounding at any time.

    Dekker's product gives the rounding error.
    """
    product = frequency * time
    big = 134217729.0 * frequency
    high = big - (big - frequency)
    low = frequency - high
    big = 134217729.0 * time
    time_high = big - (big - time)
    time_low = time - time_high
    error = ((high * time_high - product) + high * time_low + low * time_high) + low * time_low
    return product - math.floor(product) + (error + frequency * rest)


def powers(value: float, rate: float) -> NDArray[np.float64]:
    """Factors of sin(angle) and cos(angle) in the series of value sin(angle + rate tau)."""
    steps = rate / np.maximum(np.arange(float(TERMS)), 1.0)
    steps[0] = value
    found: NDArray[np.float64] = np.cumprod(steps)
    found[2::4] *= -1.0
    found[3::4] *= -1.0
    return found


@embedded
def _sine(stack, row, powers, angle):
    """Series of a harmonic at an angle."""
    sine, cosine = math.sin(angle), math.cos(angle)
    for k in range(0, TERMS, 2):
        stack[row, k] = powers[k] * sine
        stack[row, k + 1] = powers[k + 1] * cosine


@embedded
def _table(signals, table, value, time, row):
    """Series of a table between two knots."""
    times, values, at = signals.times, signals.values, table.cursor
    stack = signals.stack
    for k in range(TERMS):
        stack[row, k] = 0.0
    local = time - table.turns * table.period
    if at < table.first:
        stack[row, 0] = value * values[table.first]
        return
    if at >= table.last:
        stack[row, 0] = value * values[table.last]
        return
    slope = (values[at + 1] - values[at]) / (times[at + 1] - times[at])
    stack[row, 0] = value * (values[at] + slope * (local - times[at]))
    stack[row, 1] = value * slope


@borrowing
def _multiply(stack, row):
    """Multiply the series of a row by that of the next one; the row after that is a workspace."""
    one, other, product = stack[row], stack[row + 1], stack[row + 2]
    for k in range(TERMS):
        product[k] = 0.0
    for i in range(TERMS):
        factor = other[i]
        if factor != 0.0:  # a table has two terms
            for k in range(TERMS - i):
                product[i + k] += factor * one[k]
    for k in range(TERMS):
        one[k] = product[k]


@embedded
def expand(signals, time, rest, z, first):
    """Store the series of all signals at ``time + rest`` in the rows of z from ``first`` on."""
    stack, begin = signals.stack, 0
    for number in range(signals.ends.size):
        top = -1
        for place in range(begin, signals.ends[number]):
            kind = signals.operations[place].kind
            if kind == Operation.ADD:
                top -= 1
                for k in range(TERMS):
                    stack[top, k] += stack[top + 1, k]
            elif kind == Operation.MULTIPLY:
                top -= 1
                _multiply(stack, top)
            else:
                top += 1
                _push(signals, place, time, rest, z, first, top)
        begin = signals.ends[number]
        for k in range(TERMS):
            z[first + number, k] = stack[0, k]


@embedded
def _push(signals, place, time, rest, z, first, top):
    """Store the series of the operation at a place of the programs in a row of the stack."""
    one, stack = signals.operations[place], signals.stack
    if one.kind == Operation.CONSTANT:
        stack[top, 0] = one.value
        for k in range(1, TERMS):
            stack[top, k] = 0.0
    elif one.kind == Operation.HARMONIC:
        angle = 2.0 * math.pi * turns(one.frequency, time, rest) + one.phase
        _sine(stack, top, signals.powers[place], angle)
    elif one.kind == Operation.TABLE:
        _table(signals, signals.tables[one.index], one.value, time + rest, top)
    elif one.kind == Operation.ORDER:
        _order(signals, one, z, first, top)
    elif one.kind == Operation.ANGLE:
        speed = first + signals.speeds[one.index]
        stack[top, 0] = signals.angles[one.index]
        for k in range(1, TERMS):
            stack[top, k] = z[speed, k - 1] / k
    else:
        _exponential(stack, one, time + rest, top)


@borrowing
def _order(signals, one, z, first, row):
    """Series of a sine of an angle whose rate is a speed signal: S' = o w C, C' = -o w S."""
    stack = signals.stack
    angle = one.frequency * signals.angles[one.index] + one.phase
    speed = first + signals.speeds[one.index]
    # The next row is the workspace for the cosine.
    stack[row, 0], stack[row + 1, 0] = one.value * math.sin(angle), one.value * math.cos(angle)
    for k in range(TERMS - 1):
        sine, cosine = 0.0, 0.0
        for i in range(k + 1):
            rate = one.frequency * z[speed, i]
            sine += rate * stack[row + 1, k - i]
            cosine -= rate * stack[row, k - i]
        stack[row, k + 1], stack[row + 1, k + 1] = sine / (k + 1.0), cosine / (k + 1.0)


@borrowing
def _exponential(stack, one, time, row):
    """Series of an exponential."""
    exponent = one.frequency * (time - one.phase)
    stack[row, 0] = one.value * math.exp(min(max(exponent, -700.0), 700.0))
    for k in range(1, TERMS):
        stack[row, k] = stack[row, k - 1] * one.frequency / k


@embedded
def advance(signals, z, first, terms, tau):
    """Advance the angles that orders follow by a time tau."""
    for number in range(signals.speeds.size):
        total = 0.0
        for k in range(terms - 1, -1, -1):
            total = total * tau + z[first + signals.speeds[number], k] / (k + 1.0)
        signals.angles[number] += total * tau


@borrowing
def start_tables(signals, time):
    """Set the cursors of all tables at a time; at a knot, behind it."""
    for table in signals.tables:
        table.turns, table.cursor = 0, table.first - 1
        if table.periodic:
            table.turns = math.floor((time - signals.times[table.first]) / table.period)
    pass_knots(signals, time)


@embedded
def _next(signals, table):
    """Time of the next knot of a table [s]; inf: none."""
    if table.cursor >= table.last:
        return math.inf
    return signals.times[table.cursor + 1] + table.turns * table.period


@embedded
def next_knot(signals):
    """Time of the next knot of all tables [s]; inf: none."""
    nearest = math.inf
    for table in signals.tables:
        nearest = min(nearest, _next(signals, table))
    return nearest


@embedded
def pass_knots(signals, time):
    """Move the cursors of the tables past the knots up to a time."""
    for table in signals.tables:
        while _next(signals, table) <= time:
            table.cursor += 1
            if table.periodic and table.cursor == table.last:
                table.cursor, table.turns = table.first, table.turns + 1
