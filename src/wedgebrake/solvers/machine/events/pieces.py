"""Pieces of the elements of a machine: their torques, their guards and their changes."""

import math

import numpy as np

from wedgebrake.dynamics.jit import borrowing, embedded
from wedgebrake.solvers.machine.events.cells import size, value

# Number of changes of a piece at one instant from which its bounds, where they have just been zero,
# last until they are below zero by more than rounding: rounding then determines their rates.
_UNDECIDED = 4
# Relative distance of a state from a bound that counts as on it, at a restart.
_AT_BOUND = 1e-9


@borrowing
def place_pieces(problem, run):
    """Set the pieces of all elements by the state, at the start."""
    for number in range(problem.elements.elements.size):
        _place(problem, run, number)


@borrowing
def _place(problem, run, number):
    """Set the piece of an element by the state, and the period of its argument."""
    given, one, place = problem.elements, problem.elements.elements[number], run.places[number]
    if one.turns >= 0:
        argument = value(given.arguments[number], run.z)
        turns = math.floor((argument - one.start) / one.period)
        run.z[problem.states + one.turns, 0] = turns
    place.fresh, place.changes = 0, 0
    place.piece = _piece_at(problem, run, number)


@borrowing
def _piece_at(problem, run, number):
    """The first piece of an element none of whose bounds is negative.

    The one whose least bound is largest, if rounding makes a bound of each negative.
    """
    given, one = problem.elements, problem.elements.elements[number]
    best, found = -math.inf, one.first
    for piece in range(one.first, one.first + one.count):
        least = math.inf
        for bound in range(given.pieces[piece].first, _end_of_bounds(given, piece)):
            least = min(least, value(given.rows[bound], run.z))
        if least >= 0.0:
            return piece
        if least > best:
            best, found = least, piece
    return found


@borrowing
def check_pieces(problem, run):
    """Set the pieces of elements that are not known or do not belong to the state, at a restart."""
    given = problem.elements
    for number in range(problem.elements.elements.size):
        place, one = run.places[number], given.elements[number]
        known = place.piece >= one.first and place.piece < one.first + one.count
        if not (known and _is_in_period(problem, run, number)):
            _place(problem, run, number)
            continue
        found = _piece_at(problem, run, number)
        if found == place.piece:
            continue
        if not (_is_about(given, run, place.piece) and _ends(given, run, found)):
            place.piece, place.fresh = found, 0


@borrowing
def _is_in_period(problem, run, number):
    """Return True if the argument of an element is in its present period, up to rounding."""
    one = problem.elements.elements[number]
    if one.turns < 0:
        return True
    argument = value(problem.elements.arguments[number], run.z) - one.start
    share = argument / one.period - run.z[problem.states + one.turns, 0]
    return -_AT_BOUND <= share <= 1.0 + _AT_BOUND


@borrowing
def _is_about(given, run, piece):
    """Return True if no bound of a piece is below zero by more than rounding."""
    fits = True
    for bound in range(given.pieces[piece].first, _end_of_bounds(given, piece)):
        row = given.rows[bound]
        fits = fits and value(row, run.z) >= -_AT_BOUND * size(row, run.z)
    return fits


@borrowing
def _ends(given, run, piece):
    """Return True if a bound of a piece is zero up to rounding."""
    ends = False
    for bound in range(given.pieces[piece].first, _end_of_bounds(given, piece)):
        row = given.rows[bound]
        ends = ends or value(row, run.z) <= _AT_BOUND * size(row, run.z)
    return ends


@embedded
def _end_of_bounds(given, piece):
    """Number of the bound after the last one of a piece."""
    return given.pieces[piece].first + given.pieces[piece].count


@borrowing
def add_pieces(problem, run, torque):
    """Add the torques of the elements to those on the inertias, (n, z)."""
    given = problem.elements
    for number in range(problem.elements.elements.size):
        row = given.torques[run.places[number].piece]
        for i in range(torque.shape[0]):
            factor = given.loads[number, i]
            if factor != 0.0:
                for k in range(row.size):
                    torque[i, k] += factor * row[k]


@borrowing
def add_outer_pieces(problem, run, lead, first, target):
    """Add the torques of the elements on a group of inertias, without those inside it.

    lead, first : as in ``Systems``, and the first inertia of the group
    """
    given = problem.elements
    for number in range(problem.elements.elements.size):
        row, share = given.torques[run.places[number].piece], 0.0
        for i in range(lead.size):
            if lead[i] == first:
                share += given.loads[number, i]
        if share != 0.0:
            for k in range(row.size):
                target[k] += share * row[k]


@borrowing
def add_piece_loads(problem, run, i, load):
    """Add the torques of the elements on an inertia, and their rounding, as in ``run.load``."""
    given = problem.elements
    for number in range(problem.elements.elements.size):
        factor = given.loads[number, i]
        if factor != 0.0:
            row = given.torques[run.places[number].piece]
            load[0, i] += factor * value(row, run.z)
            load[1, i] += problem.rounding * abs(factor) * size(row, run.z)


@borrowing
def bound_guards(problem, run, kind, rows, what, count):
    """Set the guards of the pieces; returns the number of guards."""
    given = problem.elements
    for number in range(problem.elements.elements.size):
        piece = run.places[number].piece
        for bound in range(given.pieces[piece].first, _end_of_bounds(given, piece)):
            row, target, one = given.rows[bound], rows[count], what[count]
            for k in range(row.size):
                target[k] = row[k]
            one.contact, one.kind, one.sign = number, kind, bound
            count += 1
    return count


@embedded
def is_fresh(problem, run, what):
    """Return True if the quantity of a guard of an element has just been zero."""
    return run.places[what.contact].fresh & problem.elements.bounds[what.sign].own != 0


@embedded
def is_undecided(run, what):
    """Return True if rounding determines the rates of the bounds of an element."""
    return run.places[what.contact].changes > _UNDECIDED


@embedded
def pass_bound(problem, run, what):
    """Change the piece of an element whose guard has become zero."""
    place, bound = run.places[what.contact], problem.elements.bounds[what.sign]
    place.piece = bound.target
    place.fresh |= bound.reached
    place.changes += 1
    if bound.turns != 0:
        turns = problem.states + problem.elements.elements[what.contact].turns
        run.z[turns, 0] += bound.turns


@embedded
def forget_passed(places):
    """Forget which quantities have just been zero."""
    for place in places:
        place.fresh, place.changes = 0, np.int64(0)
