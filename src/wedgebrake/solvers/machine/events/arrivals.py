"""Contacts that come to rest: at a knot, at the same instant as others, or held by others."""

import math
from typing import NamedTuple

import numpy as np

from wedgebrake.dynamics.jit import borrowing, compiled, embedded
from wedgebrake.solvers.machine.events.cells import value
from wedgebrake.solvers.machine.events.coupled import combination, independent

# Share of the change of a speed in a cell within which two contacts come to rest together.
TOGETHER = 1e-13


class Cell(NamedTuple):
    """Length of a cell [s], its number of terms, and how much of it has elapsed [s]."""

    length: float
    terms: int
    elapsed: float


@borrowing
def find_arrived(problem, run, cell):
    """Find contacts whose sliding speed has become zero just where a cell ends.

    Contacts at rest are reconsidered if they join several bases, which may part there.
    """
    count, arrived, based, moving = 0, False, 0, False
    for number in range(run.modes.size):
        mode = run.modes[number]
        if mode.side == 0 or _has_arrived(problem, run, number, cell):
            run.resting[count] = number
            count += 1
            arrived = arrived or mode.side != 0
            contact = problem.contacts[number]
            based += contact.b < 0
            moving = moving or contact.base_input >= 0
    for one in problem.driven:  # contacts join them to bases through joints
        if one.input >= 0 and problem.joints.mobility.size > 0:
            based, moving = based + 1, True
    if arrived or (moving and based > 1):
        run.pending[0] = add_held(problem, run, count)


@embedded
def arrives_too(problem, run, number, cell):
    """Return True if a contact comes to rest at the same instant as others, and has not just left.

    Its speed has become zero, and fallen at the end of the cell.
    """
    mode, row, z = run.modes[number], problem.sliding[number], run.z
    trend = 0.0
    for j in range(row.size):
        if row[j] != 0.0:
            part = z[j, 1]  # of inputs, at the end already
            if j < problem.states:
                part = 0.0
                for k in range(cell.terms - 1, 0, -1):
                    part = part * cell.elapsed + k * z[j, k]
            trend += row[j] * part
    return mode.side * trend < 0.0 and _has_arrived(problem, run, number, cell)


@embedded
def _has_arrived(problem, run, number, cell):
    """Return True if the speed of a sliding contact has become zero, up to rounding."""
    z, row = run.z, problem.sliding[number]
    scale = problem.contacts[number].base_bound
    for j in range(row.size):
        if row[j] != 0.0:
            reach = 0.0
            for k in range(cell.terms - 1, -1, -1):
                reach = reach * cell.length + abs(z[j, k])
            scale += abs(row[j]) * reach
    return abs(value(row, z)) <= TOGETHER * scale


@embedded
def add_held(problem, run, count):
    """Add the contacts whose sliding speed must be zero, as those at rest are; returns the number.

    They close a loop of inertias and bases that turn together. Their computed speeds differ from
    zero by the rounding of all cells so far.
    """
    listed = run.resting[:count]
    for number in range(run.modes.size):
        if number in listed or not _is_held(problem, run, listed, number):
            continue
        place = count
        while place > 0 and run.resting[place - 1] > number:
            run.resting[place] = run.resting[place - 1]
            place -= 1
        run.resting[place] = number
        count += 1
        listed = run.resting[:count]
    return count


@embedded
def _is_held(problem, run, listed, number):
    """Return True if the contacts listed, at rest, join both sides of another one at one speed."""
    if problem.joints.mobility.size > 0:
        return _is_held_by_joints(problem, run, listed, number)
    contact, speed, ground = problem.contacts[number], run.relative_speed, problem.inverse.size
    speed[:] = math.nan
    speed[contact.a] = 0.0
    bound = contact.base_bound
    for _ in range(listed.size):
        for other in listed:
            one = problem.contacts[other]
            a, b = one.a, one.b if one.b >= 0 else ground
            if math.isnan(speed[a]) == math.isnan(speed[b]):
                continue
            bound += one.base_bound
            if math.isnan(speed[b]):
                speed[b] = speed[a] - base_speed(problem, run, other)
            else:
                speed[a] = speed[b] + base_speed(problem, run, other)
    reached = speed[contact.b if contact.b >= 0 else ground]
    return abs(reached + base_speed(problem, run, number)) <= TOGETHER * bound  # False for nan


@compiled
def _is_held_by_joints(problem, run, listed, number):
    """``_is_held`` for a machine with joints."""
    numbers = np.empty(listed.size + 1, np.int64)
    for i in range(listed.size):
        numbers[i] = listed[i]
    numbers[listed.size] = number
    order = np.arange(numbers.size)
    alone, shares = independent(problem.joints.frame[numbers], order)
    if alone[listed.size]:
        return False
    factors = combination(order, alone, shares, listed.size)
    left, bound = _given_speed(problem, run, number)
    for i in range(listed.size):
        speed, size = _given_speed(problem, run, listed[i])
        left -= factors[i] * speed
        bound += abs(factors[i]) * size
    return abs(left) <= TOGETHER * bound


@borrowing
def _given_speed(problem, run, number):
    """Speed of the base of a contact less what driven bodies add to that of sliding; its bound."""
    speed, bound = base_speed(problem, run, number), problem.contacts[number].base_bound
    n, project = problem.inverse.size, problem.joints.project
    for one in problem.driven:
        for j in range(n):
            part = problem.sliding[number, n + j] * project[j, one.body] * run.z[n + one.body, 0]
            speed -= part
            bound += abs(part)
    return speed, bound


@embedded
def base_speed(problem, run, number):
    """Speed of the base of a contact [rad/s]."""
    row, total = problem.sliding[number], 0.0
    for j in range(problem.states, row.size):
        if row[j] != 0.0:
            total -= row[j] * run.z[j, 0]
    return total
