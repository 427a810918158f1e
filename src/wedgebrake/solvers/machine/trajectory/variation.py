"""Derivative of the flow of a machine (docs/numerics.md, "Derivative of the flow").

Its columns obey the homogeneous equation of a mode, x' = A x, and are advanced through each cell
by Taylor series. At an event with the guard g, its gradient h and its rate g', a neighbouring
motion changes its mode earlier by (h X)/g'. This adds the difference of the rates of the state
times this row (saltation; Leine and Nijmeijer, Dynamics and Bifurcations of Non-Smooth Mechanical
Systems, 2004, ch. 8). Knots occur at fixed times. So do samplings, unless a parameter changes the
sample time: they are then events too. At a fixed time, a sample depends on the state only.

The last columns are derivatives with respect to parameters: x' = A x + (dA/dp) z, and the guard of
an event is (dh/dp) z beyond its value for the state alone. ``Tangents`` contains these rows.
"""

import math

from wedgebrake.dynamics.jit import borrowing, embedded
from wedgebrake.solvers.machine.events.arrivals import TOGETHER
from wedgebrake.solvers.machine.events.cells import next_coefficient, polynomial, value
from wedgebrake.solvers.machine.events.curves import add_curve, change_smoothed, differentiate
from wedgebrake.solvers.machine.events.modes import GuardKind, set_pull
from wedgebrake.solvers.machine.events.products import (
    add_product,
    expand_direct,
    extend_product,
)
from wedgebrake.solvers.machine.trajectory.watch import Anew, SectionKind

# Relative size of the rate of a guard that is zero: the motion touches it only.
_TOUCHING = 1e-13
# Relative energy of the part of an impulse that others do not give already, which is rounding.
_DEPENDENT = 1e-20


@borrowing
def lacks_tangents(run, slot):
    """Return True if rows for the parameters, or memory for events, must be provided first."""
    tangents, missing = run.tangents, False
    if tangents.rates.shape[1] > 0:
        missing = tangents.count[0] >= tangents.events.size
        for number in range(tangents.keys.shape[1]):
            missing = missing or tangents.keys[slot, number] != run.systems.keys[slot, number]
    return missing


@borrowing
def vary(watch, problem, run, slot, terms, clock, tau):
    """Advance the derivative through a cell of length tau from the time of a clock on."""
    state = watch.state[0]
    if state.anew != Anew.NO:
        begin(watch, problem, run, slot)
    elif state.pending != 0:
        for i in range(problem.states):
            change = run.z[i, 1] - watch.before[i]
            if change != 0.0:
                for column in range(watch.shift.size):
                    watch.variation[i, column] += change * watch.shift[column]
        _add_arrivals(watch, problem, run, slot)
        state.pending = 0
    _vary_driven(watch, problem, run)
    if run.curves.size > 0:
        differentiate(problem, run, terms)
        for number in range(run.tangents.rates.shape[1]):
            _expand_gains(problem, run, number, terms)
    for number in range(run.tangents.rates.shape[1]):
        expand_direct(problem, run, number, terms)
    if tau > 0.0:
        watch.shift[:] = 0.0
        first = watch.shift.size - run.tangents.rates.shape[1]
        until = _next_sample(run.tangents, clock, tau)
        for column in range(watch.shift.size):
            _expand_column(watch, problem, run, slot, column, terms)
            if column >= first:
                _sample_column(watch, run, slot, terms, clock, until, column)
            for i in range(problem.states):
                watch.variation[i, column] = polynomial(watch.series[i], terms, tau)
        run.tangents.at[0] = until
        if run.tangents.samplings.size > 0:  # their times may change with a parameter
            for i in range(watch.before.size):
                watch.before[i] = _slope(run.z[i], terms, tau)


@borrowing
def _add_arrivals(watch, problem, run, slot):
    """Add what contacts that have come to rest beside an event change at times of their own.

    The whole change of the rates has been added as if it occurred at the time of the event. Where
    the contacts do not affect each other's times, the derivative is the same in any order.
    """
    n, pull = problem.inverse.size, run.spare
    for number in range(run.modes.size):
        torque = watch.torques[number]
        if not math.isnan(torque):
            change = value(run.systems.contact[slot, number], run.z) - torque
            if problem.joints.mobility.size > 0:
                set_pull(problem, number, pull)
            else:
                for i in range(n):
                    pull[i] = problem.inverse[i] * problem.sliding[number, n + i]
            for column in range(watch.shift.size):
                later = watch.arrivals[number, column] - watch.shift[column]
                for i in range(n):
                    watch.variation[n + i, column] += pull[i] * change * later


@embedded
def _vary_driven(watch, problem, run):
    """Set the derivatives of the speeds of driven bodies, which depend on parameters alone."""
    driven, first = run.tangents.driven, watch.shift.size - run.tangents.rates.shape[1]
    for number in range(problem.driven.size):
        row = watch.variation[problem.inverse.size + problem.driven[number].body]
        for column in range(watch.shift.size):
            row[column] = 0.0
            if column >= first:
                row[column] = value(driven[number, column - first], run.z)


@embedded
def _since(time, clock):
    """Time from a clock to a time [s]."""
    return (time - clock.time) - clock.remainder


@borrowing
def _next_sample(tangents, clock, tau):
    """Number of the first sample that does not belong to a cell of length tau.

    The last one, the end of the run, belongs to the cell that ends there.
    """
    at, times = tangents.at[0], tangents.times
    while at < times.size:
        since = _since(times[at], clock)
        if since > tau or (since == tau and times[at] < times[times.size - 1]):
            break
        at += 1
    return at


@borrowing
def _sample_column(watch, run, slot, terms, clock, until, column):
    """Store the derivative with respect to a parameter at the samples of a cell."""
    tangents, systems, d, states = run.tangents, run.systems, watch.series, run.tangents.states
    number = column - (watch.shift.size - tangents.rates.shape[1])
    for at in range(tangents.at[0], until):
        since = max(_since(tangents.times[at], clock), 0.0)
        for i in range(states.shape[1]):
            states[at, i, number] = polynomial(d[i], terms, since)
        for one in range(run.modes.size):
            for row, change, target in (
                (systems.contact[slot, one], tangents.contact[slot, number, one], tangents.torques),
                (systems.force[slot, one], tangents.force[slot, number, one], tangents.forces),
            ):
                target[at, one, number] = _at(row, d, terms, since) + _at(
                    change, run.z, terms, since
                )
        for one in range(run.samplings.size):
            output = _at(systems.output[slot, one], d, terms, since)
            output += _at(tangents.output[slot, number, one], run.z, terms, since)
            tangents.outputs[at, one, number] = output


@borrowing
def _expand_column(watch, problem, run, slot, column, terms):
    """Store the Taylor series of a column of the derivative.

    The torque of a contact that slides on a curve is an additional row of the series, and so is
    that of an element with a scale that varies.
    """
    d, half, states = watch.series, problem.inverse.size, problem.states
    rates = run.systems.rates[slot]
    for i in range(states):
        d[i, 0] = watch.variation[i, column]
        d[i, 1:terms] = 0.0
    number = column - (watch.shift.size - run.tangents.rates.shape[1])
    for i in range(half, states):
        if number >= 0:
            _add_forcing(run.tangents.rates[slot, number, i], run.z, d[i], terms)
        d[i, 1] += _by_held(watch, problem, rates[i], column)
    _set_held(watch, problem, column)
    for k in range(terms - 1):
        for curve in run.curves:
            if run.modes[curve.contact].side != 0:
                _extend_torque(watch, problem, run, slot, curve, column, k)
                if number >= 0:
                    _add_to_torque(problem, run, slot, curve, d, (number, k))
                add_curve(problem, run, slot, curve, d, k)
        for place in range(run.products.size):
            product = run.products[place]
            extend_product(problem, run, product, d, product.change, k)
            if number >= 0:
                d[states + product.input, k] += run.tangents.direct[number, place, k]
            add_product(problem, run, slot, product, d, k)
        next_coefficient(rates, run.systems.lead[slot], d, k)


@borrowing
def _set_held(watch, problem, column):
    """Store the derivative of the forces of sampled actuations, as series of the inputs."""
    d = watch.series
    for i in range(problem.states, d.shape[0]):
        d[i, :] = 0.0
    for number in range(watch.sampled_rows.size):
        if watch.sampled_rows[number] >= 0:
            place = problem.states + problem.contacts[number].sampled_input
            d[place, 0] = watch.variation[watch.sampled_rows[number], column]


@borrowing
def _expand_gains(problem, run, number, terms):
    """Store the series of the derivatives of P(s) with respect to a parameter, for curves."""
    for place in range(run.curves.size):
        curve, gains = run.curves[place], run.tangents.gains[number, place]
        contact, mode = problem.contacts[curve.contact], run.modes[curve.contact]
        if mode.side == 0:
            continue
        one = problem.lines[contact.first_line + mode.line]
        factors = run.tangents.lines[number, contact.first_line + mode.line]
        speed = value(problem.sliding[curve.contact], run.z)
        if one.degree < 0:
            change_smoothed(curve, one, mode.side, speed, factors, gains, terms)
            continue
        start = one.offset + one.slope * mode.side * speed
        gains[:terms] = 0.0
        for j in range(one.degree, -1, -1):
            for k in range(terms - 1, -1, -1):
                total = start * gains[k]
                for i in range(1, k + 1):
                    total += curve.argument[i] * gains[k - i]
                gains[k] = total
            gains[0] += factors[j]


@borrowing
def _add_to_torque(problem, run, slot, curve, d, which):
    """Add the direct effect of a parameter on the torque of a contact on a curve.

    which : numbers of the parameter and of the order of the coefficient
    """
    number, k = which
    tangents, total, place = run.tangents, 0.0, 0
    for i in range(run.curves.size):
        if run.curves[i].contact == curve.contact:
            place = i
    for i in range(k + 1):
        total -= tangents.gains[number, place, i] * curve.force[k - i]
        total += curve.by_force[k - i] * _coefficient(
            tangents.force[slot, number, curve.contact], run.z, i
        )
        total += curve.by_speed[k - i] * _coefficient(
            tangents.sliding[curve.contact, number], run.z, i
        )
    d[problem.states + problem.contacts[curve.contact].curve, k] += total


@borrowing
def _coefficient(row, z, k):
    """Taylor coefficient of order k of a row."""
    total = 0.0
    for j in range(row.size):
        if row[j] != 0.0:
            total += row[j] * z[j, k]
    return total


@borrowing
def _add_forcing(row, z, series, terms):
    """Add the series of a row to the rate of a state."""
    for j in range(row.size):
        if row[j] != 0.0:
            for k in range(terms - 1):
                series[k + 1] += row[j] * z[j, k]


@borrowing
def _extend_torque(watch, problem, run, slot, curve, column, k):
    """Store the coefficient of order k of the derivative of the torque of a contact on a curve.

    It follows from those of its sliding speed and force up to this order, which are stored too.
    """
    d, states = watch.series, problem.states
    sliding, force = problem.sliding[curve.contact], run.systems.force[slot, curve.contact]
    speed, push = 0.0, 0.0
    for j in range(states):
        speed += sliding[j] * d[j, k]
        push += force[j] * d[j, k]
    if k == 0:
        push += _by_held(watch, problem, force, column)
    curve.speed_change[k], curve.force_change[k] = speed, push
    # Two sums side by side: each waits for its last addition.
    by_speed, by_force = 0.0, 0.0
    for i in range(k + 1):
        by_speed += curve.by_speed[i] * curve.speed_change[k - i]
        by_force += curve.by_force[i] * curve.force_change[k - i]
    d[states + problem.contacts[curve.contact].curve, k] = by_speed + by_force


@borrowing
def _by_curves(watch, problem, run, slot, row, column, terms, tau):
    """Part of the derivative of a row due to torques of contacts on curves, at tau in a cell."""
    total = 0.0
    for curve in run.curves:
        place = problem.states + problem.contacts[curve.contact].curve
        if run.modes[curve.contact].side == 0 or row[place] == 0.0:
            continue
        sliding, force = problem.sliding[curve.contact], run.systems.force[slot, curve.contact]
        speed, push = 0.0, _by_held(watch, problem, force, column)
        for j in range(problem.states):
            speed += sliding[j] * watch.variation[j, column]
            push += force[j] * watch.variation[j, column]
        by_speed = polynomial(curve.by_speed, terms, tau)
        by_force = polynomial(curve.by_force, terms, tau)
        total += row[place] * (by_speed * speed + by_force * push)
    return total


@borrowing
def _by_products(watch, problem, run, row, column, terms, tau):
    """Part of the derivative of a row due to elements with a scale, at tau in a cell."""
    total, number = 0.0, column - (watch.shift.size - run.tangents.rates.shape[1])
    for place in range(run.products.size):
        product = run.products[place]
        factor, change = row[problem.states + product.input], 0.0
        if factor == 0.0:
            continue
        line = problem.elements.lines[run.places[product.element].piece]
        scale = problem.states + product.scale
        for j in range(problem.states):
            change += line[j] * watch.variation[j, column]
        total += factor * change * polynomial(run.z[scale], terms, tau)
        if number >= 0:
            total += factor * polynomial(run.tangents.direct[number, place], terms, tau)
    return total


@borrowing
def _direct_by_curves(problem, run, slot, row, number, terms, tau):
    """Part of the derivative of a row due to the gains of contacts on curves, at tau in a cell."""
    total = 0.0
    for i in range(run.curves.size):
        curve = run.curves[i]
        place = problem.states + problem.contacts[curve.contact].curve
        if run.modes[curve.contact].side != 0 and row[place] != 0.0:
            tangents, torque = run.tangents, 0.0
            gain = polynomial(tangents.gains[number, i], terms, tau)
            torque -= gain * polynomial(curve.force, terms, tau)
            torque += polynomial(curve.by_speed, terms, tau) * _at(
                tangents.sliding[curve.contact, number], run.z, terms, tau
            )
            torque += polynomial(curve.by_force, terms, tau) * _at(
                tangents.force[slot, number, curve.contact], run.z, terms, tau
            )
            total += row[place] * torque
    return total


@borrowing
def _at(row, z, terms, tau):
    """Value of a row at tau in a cell."""
    total = 0.0
    for j in range(row.size):
        if row[j] != 0.0:
            total += row[j] * polynomial(z[j], terms, tau)
    return total


@borrowing
def _by_held(watch, problem, row, column):
    """Part of the derivative of a row due to the forces of sampled actuations."""
    total = 0.0
    for number in range(watch.sampled_rows.size):
        if watch.sampled_rows[number] >= 0:
            place = problem.states + problem.contacts[number].sampled_input
            total += row[place] * watch.variation[watch.sampled_rows[number], column]
    return total


@borrowing
def vary_event(watch, problem, run, slot, terms, clock, tau, first, jumped):
    """Store the data for the jump of the derivative at the event that ends a cell.

    clock  : time of the beginning of the cell
    jumped : a signal or another event at this instant has carried the guard beyond zero, so that
             the time of the event is that of this cause
    """
    z, states = run.z, problem.states
    for i in range(states):
        watch.before[i] = _slope(z[i], terms, tau)
    watch.state[0].pending = 1
    kind = run.systems.what[slot, first].kind
    _vary_arrivals(watch, problem, run, slot, terms, tau, first)
    if jumped and kind not in (GuardKind.ZERO_SPEED, GuardKind.PIECE):
        return
    touches = _set_shift(watch, problem, run, slot, terms, tau, first, watch.shift)
    parameters = watch.shift.size - run.tangents.rates.shape[1]
    _store_shift(watch, run, parameters, clock, tau, touches)


@borrowing
def _vary_arrivals(watch, problem, run, slot, terms, tau, first):
    """Store the torques and times of contacts that come to rest at the instant of an event.

    first : guard of the event
    """
    event = run.systems.what[slot, first]
    for number in range(run.modes.size):
        watch.torques[number] = math.nan
        row, scale = problem.sliding[number], problem.contacts[number].base_bound
        for j in range(row.size):
            if row[j] != 0.0:
                reach = 0.0
                for k in range(terms - 1, -1, -1):
                    reach = reach * tau + abs(run.z[j, k])
                scale += abs(row[j]) * reach
        own = event.kind == GuardKind.ZERO_SPEED and event.contact == number
        away = abs(_at(row, run.z, terms, tau)) > TOGETHER * scale
        if own or away or run.modes[number].side == 0:
            continue
        for guard in range(run.systems.counts[slot]):
            what = run.systems.what[slot, guard]
            if what.kind == GuardKind.ZERO_SPEED and what.contact == number:
                target = watch.arrivals[number]
                if not _set_shift(watch, problem, run, slot, terms, tau, guard, target):
                    torque = _at(run.systems.contact[slot, number], run.z, terms, tau)
                    watch.torques[number] = torque


@borrowing
def _set_shift(watch, problem, run, slot, terms, tau, first, target):
    """Set minus the derivatives of the time of the zero of a guard at tau in a cell.

    Returns True, and sets zeros, where it is only touched.
    """
    z, states, row = run.z, problem.states, run.systems.guards[slot, first]
    rate, scale = 0.0, 0.0
    parameters = watch.shift.size - run.tangents.rates.shape[1]
    for j in range(row.size):
        if row[j] != 0.0:
            part = row[j] * _slope(z[j], terms, tau)
            rate += part
            scale += abs(part)
    touches = abs(rate) <= _TOUCHING * scale
    for column in range(watch.shift.size):
        total = _by_held(watch, problem, row, column)
        total += _by_curves(watch, problem, run, slot, row, column, terms, tau)
        total += _by_products(watch, problem, run, row, column, terms, tau)
        for i in range(states):
            total += row[i] * watch.variation[i, column]
        if column >= parameters:
            guard = run.tangents.guards[slot, column - parameters, first]
            total += _at(guard, z, terms, tau)
            total += _direct_by_curves(problem, run, slot, row, column - parameters, terms, tau)
        target[column] = 0.0 if touches else total / rate
    return touches


@borrowing
def _store_shift(watch, run, first, clock, tau, touches):
    """Store the time of an event, and its derivatives; nan where it is only touched."""
    tangents = run.tangents
    if tangents.events.size > 0:
        at = tangents.count[0]
        tangents.events[at] = clock.time + (tau + clock.remainder)
        for number in range(tangents.shifts.shape[1]):
            change = -watch.shift[first + number]
            tangents.shifts[at, number] = math.nan if touches else change
        tangents.count[0] = at + 1


@borrowing
def _slope(series, terms, tau):
    """Rate of a series at tau."""
    total = 0.0
    for k in range(terms - 1, 0, -1):
        total = total * tau + k * series[k]
    return total


@borrowing
def store_matrix(watch, problem, run, terms, tau):
    """Store the derivative at a return at tau.

    A neighbouring motion returns at another time: when it reaches the section of a crossing, or if
    the period changes with a parameter.
    """
    x, target = watch.variation, watch.matrices[watch.state[0].count]
    first, rate = watch.shift.size - run.tangents.later.size, 0.0
    for i in range(problem.states):
        rate += watch.row[i] * _slope(run.z[i], terms, tau)
    for column in range(watch.shift.size):
        watch.later[column] = 0.0
        if watch.kind == SectionKind.CROSSING:
            for i in range(problem.states):
                watch.later[column] -= watch.row[i] * x[i, column] / rate
        elif column >= first:
            watch.later[column] = run.tangents.later[column - first]
    for i in range(problem.states):
        slope = _slope(run.z[i], terms, tau)
        for column in range(watch.shift.size):
            target[i, column] = x[i, column] + slope * watch.later[column]
    line = problem.states
    for number in range(watch.sampled_rows.size):
        if watch.sampled_rows[number] >= 0:
            for place in range(problem.contacts[number].delay + 1):
                _copy_line(x[_memory_row(watch, problem, run, number, place)], target[line])
                line += 1


@borrowing
def _copy_line(line, target):
    """Copy a vector."""
    for i in range(line.size):
        target[i] = line[i]


@borrowing
def _memory_row(watch, problem, run, number, place):
    """Row of the derivative of the force of a sampled actuation ``place`` samples from now."""
    if place == 0:
        return watch.sampled_rows[number]
    return _queue_row(watch, problem, run, number, place)


@borrowing
def _queue_row(watch, problem, run, number, place):
    """The same as sampled, without limits."""
    slot = (run.modes[number].samples + place) % (problem.contacts[number].delay + 1)
    return watch.sampled_rows[number] + 1 + slot


@borrowing
def begin(watch, problem, run, slot):
    """Start the derivative with the identity, projected onto the present sticks.

    A small sliding speed of a contact at rest is removed at once by an impulse of its torque.
    """
    state, x, states, start = watch.state[0], watch.variation, problem.states, run.tangents.start
    x[:] = 0.0
    watch.shift[:] = 0.0
    watch.later[:] = 0.0
    if state.anew == Anew.AT_START:
        for i in range(start.shape[0]):
            for number in range(start.shape[1]):
                x[i, x.shape[1] - start.shape[1] + number] = start[i, number]
    for i in range(states):
        x[i, i] = 1.0
    n, project = problem.inverse.size, problem.joints.project
    for i in range(len(project)):
        for j in range(n):
            x[i, j] = x[n + i, n + j] = project[i, j]
    line = states
    for number in range(watch.control_samples.size):
        sampled = watch.control_samples[number] != run.samplings[number].samples
        watch.control_samples[number] = run.samplings[number].samples
        if state.anew == Anew.AT_START and sampled:
            _vary_control(watch, problem, run, slot, number)
    for number in range(watch.sampled_rows.size):
        # From return to return, sampled actuations and controllers take a sample at the start.
        anew = start.shape[1] == 0 or watch.samples[number] != run.modes[number].samples
        watch.samples[number] = run.modes[number].samples
        if watch.sampled_rows[number] >= 0:
            for place in range(problem.contacts[number].delay + 1):
                if state.anew != Anew.AT_START:
                    x[_memory_row(watch, problem, run, number, place), line] = 1.0
                elif place < problem.contacts[number].delay and run.modes[number].samples > 1:
                    x[_queue_row(watch, problem, run, number, place), line] = 1.0
                line += 1
            if state.anew == Anew.AT_START and anew:
                _vary_sample(watch, problem, run, slot, number)
    state.anew, state.pending = Anew.NO, 0
    _project(watch, problem, run)


@borrowing
def _project(watch, problem, run):
    """Remove the sliding speeds of the contacts at rest from the derivative.

    The velocities that impulses of their torques cause are orthogonal to the remaining motion in
    the inner product of the kinetic energy. They are orthonormalised by the Gram-Schmidt process,
    in which contacts that depend on others drop out; the next one then leaves the sliding speeds of
    those before as they are.
    """
    x, n, d, sliding = watch.variation, problem.inverse.size, watch.series, run.tangents.sliding
    count, parameters = 0, watch.shift.size - run.tangents.rates.shape[1]
    for number in range(run.modes.size):
        if run.modes[number].side == 0 and _is_new_direction(problem, number, d, count):
            row, own = problem.sliding[number], 0.0
            for i in range(n):
                own += row[n + i] * d[count, i]
            for column in range(watch.shift.size):
                speed = 0.0
                for i in range(n):
                    speed += row[n + i] * x[n + i, column]
                if column >= parameters:
                    speed += value(sliding[number, column - parameters], run.z)
                for i in range(n):
                    x[n + i, column] -= speed / own * d[count, i]
            count += 1


@borrowing
def _is_new_direction(problem, number, d, count):
    """Store the velocities by a unit impulse of a contact, orthonormal to the rows before.

    Returns False if they depend linearly on these rows.
    """
    contact, new = problem.contacts[number], d[count]
    if problem.joints.mobility.size > 0:
        set_pull(problem, number, new)
    else:
        for i in range(problem.inverse.size):
            new[i] = 0.0
        new[contact.a] = problem.inverse[contact.a]
        if contact.b >= 0:
            new[contact.b] = -problem.inverse[contact.b]
    whole = _product(problem, new, new)
    for _ in range(2):  # twice is enough
        for other in range(count):
            share = _product(problem, new, d[other])
            for i in range(problem.inverse.size):
                new[i] -= share * d[other, i]
    rest = _product(problem, new, new)
    for i in range(problem.inverse.size):
        new[i] /= math.sqrt(rest)
    return rest > _DEPENDENT * whole


@borrowing
def _product(problem, one, other):
    """Product of two velocities, weighted by the inertias."""
    total = 0.0
    for i in range(problem.inverse.size - problem.driven.size):
        total += one[i] * other[i] / problem.inverse[i]
    return total


@borrowing
def vary_samples(watch, problem, run, slot):
    """Store the derivative of what actuations and controllers have just sampled, at a knot.

    The directions of the sliding speeds are those of the last cell.

    slot : of the system of the last cell
    """
    if watch.state[0].pending == 0:
        watch.shift[:] = 0.0
        if _follow_sample_times(watch, run):
            watch.state[0].pending = 1
            watch.torques[:] = math.nan
            for column in range(watch.shift.size):
                watch.shift[column] = -watch.later[column]
    for number in range(watch.control_samples.size):
        if watch.control_samples[number] != run.samplings[number].samples:
            watch.control_samples[number] = run.samplings[number].samples
            _vary_control(watch, problem, run, slot, number)
    for number in range(watch.sampled_rows.size):
        if watch.samples[number] != run.modes[number].samples:
            watch.samples[number] = run.modes[number].samples
            if watch.sampled_rows[number] >= 0:
                _vary_sample(watch, problem, run, slot, number)


@borrowing
def _follow_sample_times(watch, run):
    """Set the derivatives of the time of the present samples; returns True if one is not 0."""
    tangents, controls, moves = run.tangents, watch.control_samples.size, False
    watch.later[:] = 0.0
    first = watch.shift.size - tangents.later.size
    for number in range(controls + watch.samples.size):
        if number < controls:
            taken, known = run.samplings[number].samples, watch.control_samples[number]
        else:
            taken = run.modes[number - controls].samples
            known = watch.samples[number - controls]
        if taken != known:
            for column in range(tangents.later.size):
                count = taken - 1 - tangents.unmoved[number]
                change = count * tangents.samplings[number, column]
                watch.later[first + column] = change
                moves = moves or change != 0.0
    return moves


@borrowing
def _since_moved(watch, row, column):
    """Part of the derivative of a row at a sample due to the derivative of its time."""
    total = 0.0
    if watch.later[column] != 0.0:
        for i in range(row.size):
            total += row[i] * watch.before[i]
    return total * watch.later[column]


@borrowing
def _vary_control(watch, problem, run, slot, number):
    """Store the derivative of the memory of a digital controller after a sample."""
    one, done, x = problem.controllers.records[number], run.samplings[number], watch.variation
    error, tangents, z = run.systems.error[slot, number], run.tangents, run.z
    first = watch.shift.size - tangents.loops.shape[0]
    for column in range(watch.shift.size):
        change = _since_moved(watch, error, column)
        for i in range(problem.states):
            change += error[i] * x[i, column]
        if column >= first:
            change += value(tangents.error[slot, column - first, number], z)
        output = one.proportional * change
        if one.slope >= 0:
            apart = change - x[one.last, column] if done.samples > 1 else 0.0
            x[one.slope, column] = one.filter * x[one.slope, column] + one.derivative * apart
            x[one.last, column] = change
        if one.sum >= 0 and done.frozen == 0:
            x[one.sum, column] += one.integral * change
        if column >= first:
            by = tangents.loops[column - first, number]
            output += by.proportional * done.error
            if one.slope >= 0:
                x[one.slope, column] += by.filter * done.before + by.derivative * done.change
            if one.sum >= 0 and done.frozen == 0:
                x[one.sum, column] += by.integral * done.error
        output += x[one.slope, column] if one.slope >= 0 else 0.0
        output += x[one.sum, column] if one.sum >= 0 else 0.0
        low, high = 0.0, 0.0
        if one.resolution > 0.0:
            output = 0.0
        if column >= first:
            low, high = by.low, by.high
        if done.clipped != 0:
            output = high if done.clipped > 0 else low
        if done.samples == 1:
            for i in range(one.delay):
                x[one.queue + i, column] = 0.0
        x[one.held, column] = x[one.queue, column] if one.delay > 0 else output
        for i in range(one.delay):
            last = i + 1 == one.delay
            x[one.queue + i, column] = output if last else x[one.queue + i + 1, column]


@borrowing
def _by_controls(watch, problem, run, slot, number, column):
    """Derivative of the outputs of controllers that add to the command of a contact."""
    total, first = 0.0, watch.shift.size - run.tangents.loops.shape[0]
    for loop in range(problem.controllers.records.size):
        if problem.controllers.records[loop].contact == number:
            row = run.systems.output[slot, loop]
            total += _since_moved(watch, row, column)
            for i in range(problem.states):
                total += row[i] * watch.variation[i, column]
            if column >= first:
                total += value(run.tangents.output[slot, column - first, loop], run.z)
    return total


@borrowing
def _vary_sample(watch, problem, run, slot, number):
    """Store the derivative of the forces in the memory of a sampled actuation after a sample."""
    contact, mode, x = problem.contacts[number], run.modes[number], watch.variation
    first, places = watch.sampled_rows[number], contact.delay + 1
    z, tangents = run.z, run.tangents
    parameters = watch.shift.size - tangents.slope.shape[1]
    if mode.samples == 1:
        x[first : first + 1 + places] = 0.0
        for column in range(parameters, watch.shift.size):
            at_rest = value(tangents.command[number, column - parameters], z)
            x[first : first + 1 + places, column] = at_rest
    new = first + 1 + (mode.samples - 1) % places
    oldest = mode.samples % places
    force = run.queues[number, oldest]
    clipped = contact.lag == 0 and not contact.lowest <= force <= contact.highest
    for column in range(watch.shift.size):
        total = _since_moved(watch, problem.sliding[number], column)
        for i in range(problem.states):
            total += problem.sliding[number, i] * x[i, column]
        at_rest = 0.0
        if contact.force >= 0:
            at_rest += watch.before[problem.states + contact.force] * watch.later[column]
        if column >= parameters:
            one = column - parameters
            total += value(tangents.sliding[number, one], z)
            at_rest += value(tangents.command[number, one], z)
            at_rest += mode.before * tangents.slope[number, one] * value(problem.sliding[number], z)
        if contact.commanded != 0:
            at_rest += _by_controls(watch, problem, run, slot, number, column)
        x[new, column] = at_rest + mode.before * contact.slope * total
        x[first, column] = 0.0 if clipped else x[first + 1 + oldest, column]
