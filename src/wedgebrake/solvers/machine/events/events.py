"""Events: sticks, slips, reversals, and forces at their limits change the modes of the contacts."""

import math

import numpy as np

from wedgebrake.dynamics.enums import EventKind
from wedgebrake.dynamics.jit import borrowing, compiled, embedded
from wedgebrake.dynamics.signals import TERMS
from wedgebrake.solvers.machine.events.arrivals import add_held, arrives_too, base_speed
from wedgebrake.solvers.machine.events.cells import size, value
from wedgebrake.solvers.machine.events.complementarity import ROUNDING, SLACK, Network, solve
from wedgebrake.solvers.machine.events.controllers import (
    add_commands,
    add_control_loads,
    next_controller_sample,
    pass_limit,
    sample_controllers,
)
from wedgebrake.solvers.machine.events.coupled import Coupling, react, uncertainty
from wedgebrake.solvers.machine.events.curves import curve_gain
from wedgebrake.solvers.machine.events.modes import (
    JUMP,
    GuardKind,
    bit,
    is_straight,
    join,
    set_pull,
    slip_row,
    unlimited_force_row,
)
from wedgebrake.solvers.machine.events.pieces import add_piece_loads, pass_bound

# Relative size of a sliding speed at the start that is rounding.
_AT_START = 1e-14
# Relative distance from the end of a line of a speed that is there.
_AT_LINE = 1e-9


@embedded
def limited_force(problem, number, run, side):
    """The actuation force in the present state, and -1 or 1 if it is at a limit, otherwise 0."""
    contact, row = problem.contacts[number], run.spare
    unlimited_force_row(problem, run, number, side, row)
    force = value(row, run.z)
    if force == contact.lowest and run.modes[number].force_limit < 0:
        return force, -1
    if is_straight(contact) or (contact.sampled_input >= 0 and contact.lag == 0):
        return force, 0
    if force < contact.lowest:
        return contact.lowest, -1
    if force > contact.highest:
        return contact.highest, 1
    return force, 0


@embedded
def _times(gain, force, begins):
    """Torque by a force; where the brake locks itself, infinite as soon as there is a force.

    begins : whether the force is about to increase from zero
    """
    if force != 0.0:
        return gain * force
    return gain if begins and math.isinf(gain) else 0.0


@embedded
def _load(problem, run, contacts):
    """Set ``run.load`` for the inertias of the given contacts at rest."""
    z, row, load = run.z, run.spare, run.load
    if problem.joints.mobility.size > 0:
        _load_all(problem, run)
    else:
        for number in contacts:
            contact = problem.contacts[number]
            _free_torque(problem, run, contact.a, load)
            if contact.b >= 0:
                _free_torque(problem, run, contact.b, load)
    pending = 0
    for number in range(run.modes.size):
        if pending < contacts.size and contacts[pending] == number:
            pending += 1
            continue
        mode, contact = run.modes[number], problem.contacts[number]
        if is_straight(contact):
            slip_row(problem, number, mode, row, row)
            push = value(row, z)
        else:
            force, _ = limited_force(problem, number, run, mode.side)
            gain = contact.forward if mode.side > 0 else contact.backward
            if contact.curve >= 0:
                line = problem.lines[contact.first_line + mode.line]
                gain, _ = curve_gain(line, mode.side, value(problem.sliding[number], z))
            push = -_times(gain, force, False)
        error = problem.rounding * abs(push)
        load[0, contact.a] += push
        load[1, contact.a] += error
        if contact.b >= 0:
            load[0, contact.b] -= contact.ratio * push
            load[1, contact.b] += abs(contact.ratio) * error


@borrowing
def _load_all(problem, run):
    """Set ``run.load`` for all inertias."""
    for i in range(problem.inverse.size):
        _free_torque(problem, run, i, run.load)


@embedded
def _free_torque(problem, run, i, load):
    """Set the torque on an inertia without those of its contacts, and its rounding."""
    row, z = problem.torque[i], run.z
    load[0, i], load[1, i] = value(row, z), problem.rounding * size(row, z)
    add_piece_loads(problem, run, i, load)
    add_control_loads(problem, run, i, load)


@embedded
def settle(problem, run):
    """Decide which of the contacts with zero sliding speed hold, and set their modes.

    These contacts are the pending ones of ``run.resting``, in ascending order. Returns False if
    there is no solution.
    """
    contacts = run.resting[: run.pending[0]]
    pattern = run.pattern[: contacts.size]
    _load(problem, run, contacts)
    if problem.joints.mobility.size > 0:
        _set_margins_coupled(problem, run, contacts)
    else:
        _set_margins(problem, run, contacts)
    _set_limits(problem, run, contacts)
    if problem.joints.mobility.size > 0:
        if not _settle_coupled(problem, run, contacts):
            return False
    elif contacts.size == 1:
        _settle_one(problem, run, contacts[0])
    elif not _settle_together(problem, run, contacts):
        return False
    for i in range(contacts.size):
        contact, mode, one = problem.contacts[contacts[i]], run.modes[contacts[i]], pattern[i]
        if one.side != 0 and math.isinf(one.torque):
            return False
        mode.side, mode.clamp, mode.slack = one.side, one.clamp, one.slack
        mode.line = contact.lines_forward if mode.side < 0 else 0
        _, mode.force_limit = limited_force(problem, contacts[i], run, mode.side)
        if mode.side != 0 and problem.joints.mobility.size > 0:  # its speed may be rounding
            mode.fresh |= bit(GuardKind.ZERO_SPEED, -1)
    return True


@embedded
def _set_margins(problem, run, contacts):
    """Set the torques that are rounding by far."""
    rounding = 0.0
    for number in contacts:
        contact = problem.contacts[number]
        rounding += run.load[1, contact.a] + (run.load[1, contact.b] if contact.b >= 0 else 0.0)
    for i in range(contacts.size):
        run.limits[i].margin = 2.0 * SLACK * rounding


@embedded
def _set_limits(problem, run, contacts):
    """Set the torques that contacts at rest can transmit.

    That of a contact which has just reached its limit is less by more than rounding.
    """
    at_rest = np.int64(0)
    for i in range(contacts.size):
        contact, mode, one = problem.contacts[contacts[i]], run.modes[contacts[i]], run.limits[i]
        force, limit = limited_force(problem, contacts[i], run, at_rest)
        begins = limit == 0
        one.lower = min(-_times(contact.breakaway_forward, force, begins), 0.0)
        one.upper = max(-_times(contact.breakaway_backward, force, begins), 0.0)
        one.capacity = max(-one.lower, one.upper)
        if mode.beyond > 0:
            one.upper = max(one.upper - one.margin, 0.0)
        elif mode.beyond < 0:
            one.lower = min(one.lower + one.margin, 0.0)
        mode.beyond = 0
        one.forward = -_times(contact.forward, force, begins)
        one.backward = -_times(contact.backward, force, begins)
        one.arrived = mode.before != 0


@embedded
def _base_rate(problem, run, number):
    """Acceleration of the base of a contact."""
    contact = problem.contacts[number]
    return run.z[problem.states + contact.base_rate, 0] if contact.base_rate >= 0 else 0.0


@embedded
def flatness(problem, run, number):
    """Rate of a sliding speed that is rounding where a slip begins."""
    return run.modes[number].slack * problem.contacts[number].mobility


@embedded
def _settle_one(problem, run, number):
    """``solve`` for one contact, whose bodies have the same speed from now on."""
    contact, one, found = problem.contacts[number], run.limits[0], run.pattern[0]
    n, z, (torque, errors) = problem.inverse.size, run.z, (run.load[0], run.load[1])
    a, b = contact.a, contact.b
    inertia = 1.0 / problem.inverse[a]
    if b < 0:
        rate = _base_rate(problem, run, number)
        needed = inertia * rate - torque[a]
        rounding = errors[a] + ROUNDING * inertia * abs(rate)
        z[n + a, 0] = base_speed(problem, run, number)
    else:
        other = 1.0 / problem.inverse[b]
        needed = (inertia * torque[b] - other * torque[a]) / (inertia + other)
        rounding = 2.0 * (errors[a] + errors[b])
        z[n + a, 0] += other / (inertia + other) * (z[n + b, 0] - z[n + a, 0])
        z[n + b, 0] = z[n + a, 0]
    found.side, found.clamp, found.torque, found.slack = 0, 0, needed, SLACK * rounding
    if needed > one.upper + rounding:
        found.side, found.torque = -1, one.backward
    elif needed < one.lower - rounding:
        found.side, found.torque = 1, one.forward


@compiled
def _settle_together(problem, run, contacts):
    """``solve`` for several contacts, whose groups of bodies have the same speeds from now on."""
    n, count = problem.inverse.size, contacts.size
    a, b = problem.contacts["a"][contacts], problem.contacts["b"][contacts]
    inertia, torque, errors = np.full(n + count, math.inf), np.zeros(n + count), np.zeros(n + count)
    level, lead, base = np.zeros(n + count), np.arange(n), np.full(n, -1)
    for i in range(n):
        inertia[i], torque[i], errors[i] = 1.0 / problem.inverse[i], run.load[0, i], run.load[1, i]
    for one in problem.driven:  # no contact at rest joins them
        inertia[one.body], torque[one.body], errors[one.body] = 1.0, 0.0, 0.0
    for i in range(count):
        join(problem, contacts[i], lead, base)
        if b[i] < 0:
            b[i], level[n + i] = n + i, _base_rate(problem, run, contacts[i])
    for i in range(n - problem.driven.size):
        if lead[i] == i:
            _join_speeds(problem, run, lead, i, base[i])
    network = Network(run.limits[:count], a, b, inertia, torque, errors, level)
    return solve(network, run.pattern[:count])


@compiled
def _coupling(problem, run, contacts):
    """The given contacts at rest of a machine with joints, as a ``Coupling``."""
    n, count, states = problem.inverse.size, contacts.size, problem.states
    pull, sliding, gram = np.empty((count, n)), np.empty((count, n)), np.zeros((count, count))
    drift, noise = np.zeros(count), np.zeros(count)
    for i in range(count):
        number = contacts[i]
        set_pull(problem, number, pull[i])
        for j in range(n):
            sliding[i, j] = problem.sliding[number, n + j]
            drift[i] += pull[i, j] * run.load[0, j]
        for one in problem.driven:
            if one.rate >= 0:
                rate = run.z[states + one.rate, 0]
                for j in range(n):
                    part = sliding[i, j] * problem.joints.project[j, one.body] * rate
                    drift[i] += part
                    noise[i] += ROUNDING * abs(part)
        rate = _base_rate(problem, run, number)
        drift[i] -= rate
        noise[i] += ROUNDING * abs(rate)
    for i in range(count):
        for j in range(count):
            for k in range(n):
                gram[i, j] += pull[i, k] * sliding[j, k]
    frame, errors = problem.joints.frame[contacts], run.load[1].copy()
    return Coupling(run.limits[:count], frame, gram, drift, pull, sliding, errors, noise)


@compiled
def _set_margins_coupled(problem, run, contacts):
    """``_set_margins`` for a machine with joints."""
    found = uncertainty(_coupling(problem, run, contacts), np.ones(contacts.size, np.bool_))
    for i in range(contacts.size):
        run.limits[i].margin = 2.0 * SLACK * found[i]


@compiled
def _settle_coupled(problem, run, contacts):
    """``solve`` for contacts of a machine with joints, at zero sliding speeds from now on."""
    given, n, count = _coupling(problem, run, contacts), problem.inverse.size, contacts.size
    left, impulse = np.empty((count, 1)), np.empty((count, 1))
    for i in range(count):
        left[i, 0] = -value(problem.sliding[contacts[i]], run.z)
    react(given.frame, given.gram, np.ones(count), left, impulse)
    for i in range(count):
        for j in range(n):
            run.z[n + j, 0] += given.pull[i, j] * impulse[i, 0]
    return solve(given, run.pattern[:count])


@borrowing
def _join_speeds(problem, run, lead, first, base):
    """Set the speeds of a group of inertias to that of its base, or without impulse."""
    n, z = problem.inverse.size, run.z
    speed, impulse, inertia = z[n + first, 0], 0.0, 0.0
    for i in range(n):
        if lead[i] == first:
            impulse += (z[n + i, 0] - speed) / problem.inverse[i]
            inertia += 1.0 / problem.inverse[i]
    speed = base_speed(problem, run, base) if base >= 0 else speed + impulse / inertia
    for i in range(n):
        if lead[i] == first:
            z[n + i, 0] = speed


@borrowing
def _set_line(problem, number, speed, mode):
    """Set the line of the torque of a sliding contact."""
    contact = problem.contacts[number]
    mode.line = 0
    if contact.lines_forward == 0 or mode.side == 0:
        return
    line, last = _lines_of(contact, 1 if speed > 0.0 else -1)
    while line + 1 < last and problem.lines[contact.first_line + line + 1].start <= abs(speed):
        line += 1
    mode.line = line


@borrowing
def check_lines(problem, run):
    """Set the lines of sliding contacts anew where they do not belong to their speeds.

    At a restart: the lines of another table, or of another method, may be others.
    """
    for number in range(run.modes.size):
        contact, mode = problem.contacts[number], run.modes[number]
        if contact.lines_forward == 0 or mode.side == 0:
            continue
        speed, first = value(problem.sliding[number], run.z), contact.first_line
        begin, end = _lines_of(contact, mode.side)
        low, high = 0.0, math.inf
        if begin <= mode.line < end:
            low = problem.lines[first + mode.line].start
            high = problem.lines[first + mode.line + 1].start if mode.line + 1 < end else math.inf
        if not (begin <= mode.line < end and _is_about(low, high, abs(speed))):
            _set_line(problem, number, mode.side * abs(speed), mode)


@embedded
def _lines_of(contact, side):
    """First line of a direction of sliding, and the line after its last one."""
    if side > 0:
        return 0, contact.lines_forward
    return contact.lines_forward, contact.lines_forward + contact.lines_backward


@embedded
def _is_about(low, high, speed):
    """Return True if a speed is between two others, up to rounding."""
    return low * (1.0 - _AT_LINE) <= speed <= high * (1.0 + _AT_LINE)


@borrowing
def set_sides(problem, run):
    """Set the sides of the contacts by their sliding speeds, at the start."""
    for number in range(run.modes.size):
        row = problem.sliding[number]
        speed = value(row, run.z)
        at_rest = abs(speed) <= _AT_START * size(row, run.z)
        run.modes[number].side = 0 if at_rest else (1 if speed > 0.0 else -1)


@borrowing
def classify(problem, run):
    """Set the modes by the sides of sliding; ``settle`` has to follow."""
    for number in range(run.modes.size):
        mode = run.modes[number]
        mode.clamp, mode.fresh = 0, 0
        _set_line(problem, number, value(problem.sliding[number], run.z), mode)
        _, mode.force_limit = limited_force(problem, number, run, mode.side)
    find_resting(run)


@borrowing
def find_resting(run):
    """Let ``settle`` decide anew which of the contacts at rest hold."""
    count = 0
    for number in range(run.modes.size):
        if run.modes[number].side == 0:
            run.resting[count] = number
            count += 1
    run.pending[0] = count


@borrowing
def joins_bases(problem, run, slot):
    """Return True if contacts that hold in a mode join two bases one of which is a signal.

    Their speeds are equal until the next knot at most, which cells of equal length would pass.
    """
    if problem.joints.mobility.size > 0:
        return _joins_bases_coupled(problem, run)
    for number in range(run.modes.size):
        contact = problem.contacts[number]
        if run.modes[number].side == 0 and contact.b < 0:
            first = run.systems.base[slot, contact.a]
            varies = contact.base_input >= 0 or problem.contacts[first].base_input >= 0
            if first != number and varies:
                return True
    return False


@borrowing
def _joins_bases_coupled(problem, run):
    """``joins_bases`` for a machine with joints; also True where it may be so."""
    held, based, varies = False, 0, False
    for number in range(run.modes.size):
        contact = problem.contacts[number]
        if run.modes[number].side == 0:
            held = True
            based += contact.b < 0
            varies = varies or contact.base_input >= 0
    for one in problem.driven:
        varies = varies or one.input >= 0
    return varies and (based > 1 or (held and problem.driven.size > 0))


@borrowing
def follow_forces(problem, run):
    """Set the limits of forces that have jumped, or have become zero for some time, at a knot."""
    for number in range(run.modes.size):
        contact, mode, row = problem.contacts[number], run.modes[number], run.spare
        if is_straight(contact):
            continue
        unlimited_force_row(problem, run, number, mode.side, row)
        force = value(row, run.z)
        below, above = contact.lowest - force, force - contact.highest
        margin, now = JUMP * abs(force), mode.force_limit
        if below == 0.0:
            now = 0 if _rises(problem, run, row) else -1
        elif below > margin:
            now = -1
        elif above > margin:
            now = 1
        elif (now < 0 and below < -margin) or (now > 0 and above < -margin):
            now = 0
        if now != mode.force_limit:
            mode.force_limit = now
            run.pending[0] = max(run.pending[0], 0)


@borrowing
def _rises(problem, run, row):
    """Return True if a row increases from now on because of the inputs."""
    for k in range(1, TERMS):
        total = 0.0
        for j in range(problem.states, row.size):
            total += row[j] * run.z[j, k]
        if total != 0.0:
            return total > 0.0
    return False


@borrowing
def follow_bases(problem, run, restarts):
    """Set the sides of contacts whose sliding speed has changed suddenly.

    restarts : whether the run restarts, perhaps with another constant speed of a base, or with
               another ratio of a contact or a joint

    Returns whether there are such contacts.
    """
    jumped = False
    for number in range(run.modes.size):
        contact, mode = problem.contacts[number], run.modes[number]
        constant = contact.base_input < 0
        if constant and not restarts:
            continue
        row = problem.sliding[number]
        speed = value(row, run.z)
        # At rest on the ground the speed is rounding too.
        tolerance = JUMP * max(contact.base_bound, 1.0 if constant else 0.0)
        if contact.b >= 0:
            tolerance = max(tolerance, JUMP * size(row, run.z))
        if (mode.side == 0 and abs(speed) > tolerance) or mode.side * speed < -tolerance:
            mode.side = 1 if speed > 0.0 else -1
            jumped = True
    return jumped


@borrowing
def take_samples(problem, run, time):
    """Let digital controllers and sampled actuations that are due at a time take their samples.

    Controllers come first, so that the actuations take their new outputs.
    """
    sample_controllers(problem, run, time)
    for number in range(run.modes.size):
        contact, mode = problem.contacts[number], run.modes[number]
        if contact.sampled_input < 0 or next_actuation_sample_at(contact, mode) > time:
            continue
        force = contact.initial_force
        if contact.force >= 0:
            force += run.z[problem.states + contact.force, 0]
        start = force
        if mode.side != 0:
            force += contact.slope * abs(value(problem.sliding[number], run.z))
        if contact.commanded != 0:
            force += _control(problem, run, number)
        if contact.resolution > 0.0:
            force = contact.resolution * round(force / contact.resolution)
        queue, places = run.queues[number], contact.delay + 1
        if mode.samples == 0:
            queue[:] = start
        queue[mode.samples % places] = force
        mode.samples += 1
        force = queue[mode.samples % places]
        if contact.lag == 0:
            force = min(max(force, contact.lowest), contact.highest)
        run.z[problem.states + contact.sampled_input] = 0.0
        run.z[problem.states + contact.sampled_input, 0] = force


@borrowing
def _control(problem, run, number):
    """The outputs of controllers that add to the command of a contact."""
    row = run.spare
    row[:] = 0.0
    add_commands(problem, run, number, row)
    return value(row, run.z)


@embedded
def next_actuation_sample_at(contact, mode):
    """Time of the next sample of a sampled actuation."""
    return mode.first_sample + mode.samples * contact.sample_time


@borrowing
def next_sampling(problem, run):
    """Time of the next sample of any controller or actuation [s]; inf: there is none."""
    nearest, modes = next_controller_sample(problem, run), run.modes
    for number in range(modes.size):
        if problem.contacts[number].sampled_input >= 0:
            at = next_actuation_sample_at(problem.contacts[number], modes[number])
            nearest = min(nearest, at)
    return nearest


@embedded
def apply_event(problem, run, what, cell):
    """Change the modes at an event detected by a guard; ``settle`` must be called next.

    cell   : the cell of the event; ``run.z`` contains its series, except for the initial values

    Returns True if a torque has a kink, False if it is smooth or if a contact may come to rest or
    leave it.
    """
    number, modes = what.contact, run.modes
    run.pending[0] = 0
    if what.kind == GuardKind.PIECE:
        pass_bound(problem, run, what)
        return True
    if what.kind == GuardKind.CONTROL:
        return pass_limit(problem, run, what)
    mode = modes[number]
    if what.kind in (GuardKind.NEXT_LINE, GuardKind.FORCE_LIMIT):
        mode.fresh |= bit(what.kind, -what.sign)
        if what.kind == GuardKind.FORCE_LIMIT:
            mode.force_limit += what.sign
            return True
        later = mode.line + max(what.sign, 0)
        mode.line += what.sign
        return bool(problem.lines[problem.contacts[number].first_line + later].bends)
    arrived = number if what.kind == GuardKind.ZERO_SPEED else -1
    if arrived < 0:
        mode.beyond = what.sign
    count = 0
    for other in range(modes.size):
        at_rest = modes[other].side == 0 or other == arrived
        if at_rest or arrives_too(problem, run, other, cell):
            run.resting[count] = other
            count += 1
    run.pending[0] = add_held(problem, run, count)
    return False


@embedded
def kind_of(before, after):
    """Kind of the event that changes the side of sliding."""
    if after == 0:
        return EventKind.STICK
    return EventKind.SLIP if before == 0 else EventKind.REVERSAL
