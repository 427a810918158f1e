"""Feedback controllers: their outputs, limits and samples.

A continuous controller with limits is in one of four pieces. Let u be its output without limits:

    LINEAR     u is within the limits
    FROZEN     u is beyond a limit, and the error drives the integral part further out, which
               therefore does not change
    UNWINDING  u is beyond a limit, and the error drives the integral part back
    FOLLOWING  u is at a limit. With the full rate of the integral part, u would leave the limit
               outwards; with a constant integral part, inwards. The integral part changes at the
               rate that keeps u at the limit: a sliding mode in the sense of Filippov, the limit of
               conditional integration as its steps become shorter

The number of a piece is positive at the upper limit and negative at the lower one.
"""

import math
from enum import IntEnum

from wedgebrake.dynamics.jit import borrowing, embedded
from wedgebrake.solvers.machine.events.cells import size, value

# Relative distance from a limit within which an output counts as at it, at knots and restarts.
_AT_LIMIT = 1e-9


class Stage(IntEnum):
    """Pieces of a controller; the sign of the number of a piece is that of the limit."""

    LINEAR = 0
    FROZEN = 1
    UNWINDING = 2
    FOLLOWING = 3


# Bits of ``fresh``, of quantities that have just been zero: the distances from the lower and the
# upper limit, the error, and the rate of such a distance.
_AT_LOW, _AT_HIGH, _AT_TURN, _TOUCHES = 1, 2, 4, 8


@borrowing
def error_row(problem, run, number, row):
    """Set a row to the error of a controller: setpoint minus measured quantity."""
    given = problem.controllers
    for k in range(row.size):
        row[k] = given.errors[number, k]
    for other in range(problem.contacts.size):
        factor = given.forces[number, other]
        if factor != 0.0:
            contact, limit = problem.contacts[other], run.modes[other].force_limit
            if limit != 0:
                row[-1] -= factor * (contact.lowest if limit < 0 else contact.highest)
            else:
                row[contact.state] -= factor
                if contact.normal >= 0:
                    for k in range(row.size):
                        row[k] -= factor * problem.normals[contact.normal, k]
    for other in range(problem.elements.elements.size):
        factor = given.torques[number, other]
        if factor != 0.0:
            torque = problem.elements.torques[run.places[other].piece]
            for k in range(row.size):
                row[k] -= factor * torque[k]


@borrowing
def _unlimited_row(problem, run, number, row):
    """Set a row to the output of a continuous controller without its limits."""
    one = problem.controllers.records[number]
    error_row(problem, run, number, row)
    gain = one.proportional + one.derivative
    for k in range(row.size):
        row[k] *= gain
    if one.sum >= 0:
        row[one.sum] += 1.0
    if one.filtered >= 0:
        row[one.filtered] -= one.derivative


@borrowing
def output_row(problem, run, number, row):
    """Set a row to the output of a controller."""
    one = problem.controllers.records[number]
    piece = run.places[problem.elements.elements.size + number].piece
    if one.held >= 0 or piece != 0:
        row[:] = 0.0
        if one.held >= 0:
            row[one.held] = 1.0
        else:
            row[-1] = one.high if piece > 0 else one.low
    else:
        _unlimited_row(problem, run, number, row)


@borrowing
def add_commands(problem, run, contact, row):
    """Add the outputs of controllers to the row of the command of a contact."""
    given, output = problem.controllers.records, run.assembly.loop[0]
    for number in range(given.size):
        if given[number].contact == contact:
            output_row(problem, run, number, output)
            for k in range(row.size):
                row[k] += output[k]


@borrowing
def add_controls(problem, run, torque):
    """Add the torques of controllers to those on the inertias, (n, z)."""
    given, output = problem.controllers.records, run.assembly.loop[0]
    for number in range(given.size):
        if given[number].inertia >= 0:
            output_row(problem, run, number, output)
            for k in range(output.size):
                torque[given[number].inertia, k] += output[k]


@borrowing
def add_outer_controls(problem, run, lead, first, target):
    """Add the torques of controllers on a group of inertias, like ``add_outer_pieces``."""
    given, output = problem.controllers.records, run.assembly.loop[0]
    for number in range(given.size):
        if given[number].inertia >= 0 and lead[given[number].inertia] == first:
            output_row(problem, run, number, output)
            for k in range(output.size):
                target[k] += output[k]


@borrowing
def add_control_loads(problem, run, i, load):
    """Add the torques of controllers on an inertia, and their rounding, as in ``run.load``."""
    given, output = problem.controllers.records, run.assembly.loop[0]
    for number in range(given.size):
        if given[number].inertia == i:
            output_row(problem, run, number, output)
            load[0, i] += value(output, run.z)
            load[1, i] += problem.rounding * size(output, run.z)


@borrowing
def set_control_rates(problem, run, slot):
    """Set the rows of errors and outputs, and the rates of the states of controllers.

    The rates of all other states must already be set.
    """
    given, first = problem.controllers.records, problem.elements.elements.size
    rates, loop = run.systems.rates[slot], run.assembly.loop[0]
    for number in range(given.size):
        one, piece = given[number], run.places[first + number].piece
        error = run.systems.error[slot, number]
        error_row(problem, run, number, error)
        output_row(problem, run, number, run.systems.output[slot, number])
        if one.held >= 0:
            for i in range(one.state, one.queue + one.delay):
                rates[i, :] = 0.0
            continue
        if one.filtered >= 0:
            row = rates[one.filtered]
            for k in range(row.size):
                row[k] = one.filter * error[k]
            row[one.filtered] -= one.filter
        if one.sum >= 0:
            row = rates[one.sum]
            row[:] = 0.0
            if abs(piece) == Stage.FOLLOWING:
                _rate_row(problem, run, slot, number, loop)
                for k in range(row.size):
                    row[k] = -loop[k]
            elif abs(piece) != Stage.FROZEN:
                for k in range(row.size):
                    row[k] = one.integral * error[k]


@borrowing
def _rate_row(problem, run, slot, number, row):
    """Set a row to the rate of an output, without its limits and its integral part."""
    one, rates, output = problem.controllers.records[number], run.systems.rates[slot], run.spare
    _unlimited_row(problem, run, number, output)
    if one.sum >= 0:
        output[one.sum] = 0.0
    row[:] = 0.0
    for j in range(problem.states):
        if output[j] != 0.0:
            for k in range(row.size):
                row[k] += output[j] * rates[j, k]
    if one.rate >= 0:
        at = problem.states
        row[at + one.rate] += output[at + one.input]


@borrowing
def control_guards(problem, run, slot, kind, count):
    """Set the guards of the pieces of controllers; returns the number of guards."""
    given, first = problem.controllers.records, problem.elements.elements.size
    rows, what, loop = run.systems.guards[slot], run.systems.what[slot], run.assembly.loop[0]
    for number in range(given.size):
        one, piece = given[number], run.places[first + number].piece
        if one.held >= 0 or math.isinf(one.low):
            continue
        error = run.systems.error[slot, number]
        side = 1.0 if piece > 0 else -1.0
        limit = one.high if piece > 0 else one.low
        if abs(piece) == Stage.FOLLOWING:
            _rate_row(problem, run, slot, number, loop)
            for k in range(loop.size):
                rows[count, k] = -side * loop[k]
                rows[count + 1, k] = side * (loop[k] + one.integral * error[k])
        else:
            _unlimited_row(problem, run, number, loop)
            if piece == 0:
                for k in range(loop.size):
                    rows[count, k], rows[count + 1, k] = loop[k], -loop[k]
                rows[count, -1] -= one.low
                rows[count + 1, -1] += one.high
            else:
                turn = side if abs(piece) == Stage.FROZEN else -side
                for k in range(loop.size):
                    rows[count, k] = side * loop[k]
                    rows[count + 1, k] = turn * one.integral * error[k]
                rows[count, -1] -= side * limit
        for guard in range(1 if piece != 0 and one.sum < 0 else 2):
            what[count].contact, what[count].kind, what[count].sign = number, kind, guard
            count += 1
    return count


@embedded
def is_fresh_limit(problem, run, what):
    """Return True if the quantity of a guard of a controller has just been zero."""
    place = run.places[problem.elements.elements.size + what.contact]
    bits = _AT_TURN
    if place.piece == 0:
        bits = _AT_LOW if what.sign == 0 else _AT_HIGH
    elif what.sign == 0:
        bits = _AT_HIGH if place.piece > 0 else _AT_LOW
    return place.fresh & bits != 0 and abs(place.piece) != Stage.FOLLOWING


@embedded
def touches_limit(problem, run, what):
    """Return True if the rate of the quantity of a guard has just been zero too, and increases."""
    place = run.places[problem.elements.elements.size + what.contact]
    return place.fresh & _TOUCHES != 0 and (place.piece == 0 or what.sign == 0)


@borrowing
def pass_limit(problem, run, what):
    """Change the piece of a controller whose guard has become zero.

    Returns True if its output has a kink.
    """
    number, one = what.contact, problem.controllers.records[what.contact]
    place = run.places[problem.elements.elements.size + number]
    piece, side = place.piece, 1 if place.piece > 0 else -1
    place.changes += 1
    if piece == 0:
        side = -1 if what.sign == 0 else 1
        place.piece = side * (Stage.FOLLOWING if one.sum >= 0 else Stage.FROZEN)
        if one.sum >= 0 and _full_rate(problem, run, number) * side < 0.0:
            place.piece = side * Stage.UNWINDING
        place.fresh |= _AT_HIGH if side > 0 else _AT_LOW
        _move_to_limit(problem, run, number, side)
        return True
    if abs(piece) == Stage.FOLLOWING:
        _move_to_limit(problem, run, number, side)
        place.piece = side * Stage.FROZEN if what.sign == 0 else 0
        place.fresh |= (_AT_HIGH if side > 0 else _AT_LOW) | _TOUCHES
    elif what.sign == 1:
        place.piece = side * (Stage.UNWINDING if abs(piece) == Stage.FROZEN else Stage.FROZEN)
        place.fresh |= _AT_TURN
    elif abs(piece) == Stage.FROZEN and one.sum >= 0:
        place.piece = side * Stage.FOLLOWING
        _move_to_limit(problem, run, number, side)
    else:
        place.piece = 0
        place.fresh |= _AT_HIGH if side > 0 else _AT_LOW
    return place.piece == 0


@borrowing
def _full_rate(problem, run, number):
    """Rate of the integral part of a controller that no limit holds."""
    row = run.assembly.loop[0]
    error_row(problem, run, number, row)
    return problem.controllers.records[number].integral * value(row, run.z)


@borrowing
def _move_to_limit(problem, run, number, side):
    """Change the integral part by rounding, so that the output is exactly at a limit."""
    one, row = problem.controllers.records[number], run.assembly.loop[0]
    if one.sum >= 0:
        _unlimited_row(problem, run, number, row)
        row[-1] -= one.high if side > 0 else one.low
        run.z[one.sum, 0] -= value(row, run.z)


@borrowing
def place_controls(problem, run):
    """Set the pieces of continuous controllers that do not fit the state, after a jump."""
    given, first, row = problem.controllers.records, problem.elements.elements.size, run.spare
    for number in range(given.size):
        one, place = given[number], run.places[first + number]
        if one.held >= 0 or math.isinf(one.low):
            place.piece = 0
            continue
        _unlimited_row(problem, run, number, row)
        output, margin = value(row, run.z), _AT_LIMIT * size(row, run.z)
        piece, side = place.piece, 1 if place.piece > 0 else -1
        limit = one.high if side > 0 else one.low
        if piece == 0:
            fits = one.low - margin <= output <= one.high + margin
        elif abs(piece) == Stage.FOLLOWING:
            fits = abs(output - limit) <= margin and one.sum >= 0
        else:
            fits = side * (output - limit) >= -margin
            fits = fits and (abs(piece) == Stage.FROZEN or one.sum >= 0)
        if fits and abs(piece) <= Stage.FOLLOWING:
            continue
        place.piece, place.fresh = 0, 0
        side = 1 if output > one.high else -1
        if output > one.high or output < one.low:
            unwinds = one.sum >= 0 and _full_rate(problem, run, number) * side < 0.0
            place.piece = side * (Stage.UNWINDING if unwinds else Stage.FROZEN)
        if place.piece != piece:
            run.pending[0] = max(run.pending[0], 0)


@borrowing
def sample_controllers(problem, run, time):
    """Let the digital controllers that are due at a time take a sample, and set their outputs."""
    given, row, z = problem.controllers.records, run.assembly.loop[0], run.z
    for number in range(given.size):
        one, done = given[number], run.samplings[number]
        if one.held < 0 or next_controller_sample_at(one, done) > time:
            continue
        error_row(problem, run, number, row)
        error = value(row, z)
        if one.slope >= 0:
            if done.samples == 0:
                z[one.last, 0] = error
            done.change, done.before = error - z[one.last, 0], z[one.slope, 0]
            z[one.slope, 0] = one.filter * done.before + one.derivative * done.change
            z[one.last, 0] = error
        output = one.proportional * error
        if one.slope >= 0:
            output += z[one.slope, 0]
        done.error, done.frozen, done.clipped = error, 0, 0
        if one.sum >= 0:
            step = one.integral * error
            after = output + (z[one.sum, 0] + step)
            out = (after > one.high and step > 0.0) or (after < one.low and step < 0.0)
            if out:
                done.frozen = 1
            else:
                z[one.sum, 0] += step
            output += z[one.sum, 0]
        if one.resolution > 0.0:
            output = one.resolution * round(output / one.resolution)
        if output > one.high:
            output, done.clipped = one.high, 1
        elif output < one.low:
            output, done.clipped = one.low, -1
        if done.samples == 0:
            for i in range(one.delay):
                z[one.queue + i, 0] = 0.0
        z[one.held, 0] = z[one.queue, 0] if one.delay > 0 else output
        for i in range(one.delay):
            z[one.queue + i, 0] = z[one.queue + i + 1, 0] if i + 1 < one.delay else output
        done.samples += 1


@embedded
def next_controller_sample_at(one, done):
    """Time of the next sample of a digital controller."""
    return done.first_sample + done.samples * one.sample_time


@borrowing
def next_controller_sample(problem, run):
    """Time of the next sample of any digital controller [s]; inf: there is none."""
    given, nearest = problem.controllers.records, math.inf
    for number in range(given.size):
        if given[number].held >= 0:
            nearest = min(nearest, next_controller_sample_at(given[number], run.samplings[number]))
    return nearest
