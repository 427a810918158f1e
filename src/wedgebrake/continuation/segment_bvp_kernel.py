"""A periodic orbit as a chain of pieces whose order is given (docs/theory.md, section 13).

An orbit of n periods of the torque is a cyclic sequence of pieces joined at nodes. A piece is
numbered from rest: 0 rest, 1, 2, ... slip forwards in the first, second, ... piece of the
brake's law, -1, -2, ... backwards. Two neighbours say what happens at the node between them:

0 after k         the motion comes to rest        k after 0   rest ends
-1 after 1, or 1 after -1   reversal              k+1 after k  a breakpoint is crossed
k after k         nothing; a mark at phase 0, for an orbit without events

The velocity at an event is known. The unknowns are two numbers for each node: phase omega t
[rad] (at a mark the velocity) and angle [rad]. Each piece asks two equations: where its closed
form ends, in angle and in velocity (in rest, in torque). With the order of the pieces given,
these are smooth functions also where the orbit is none: beyond a graze, or with a rest of
negative length. ``margins`` says how far the orbit is from there.
"""

import math

import numpy as np

from wedgebrake.analysis.accumulators import extreme
from wedgebrake.analysis.saltation import propagate
from wedgebrake.dynamics.deviations import Deviations
from wedgebrake.dynamics.enums import EventKind, FlowForm
from wedgebrake.dynamics.harmonic import phase_of
from wedgebrake.dynamics.jit import compiled
from wedgebrake.dynamics.linear_flow import (
    acceleration,
    enter,
    forcing_of,
    impulse,
    jerk,
    state_at,
)
from wedgebrake.dynamics.problem import slip_acceleration
from wedgebrake.dynamics.section import phase_at_return
from wedgebrake.dynamics.segment_log import REST
from wedgebrake.dynamics.segment_log import write as write_row

# Columns of the margins of a piece; positive where the orbit is one.
(
    DURATION,  # of the piece [rad]
    TOUCH,  # from the nearest limit of the piece, inside it: velocity or torque, over its scale
    HOLDING,  # at its end: from what the brake can hold there, over the torque's scale
    CROSSING,  # acceleration through its end, over its scale
    TOUCH_PHASE,  # where TOUCH was measured [rad]
    TOUCH_ANGLE,  # and at which angle [rad]
    TOUCH_SIDE,  # which limit: 1 the upper, -1 the lower
) = range(7)
MARGINS = 4
COLUMNS = 7

# Below this many radians of the fastest rate differences of closed forms are sums of a series.
_SHORT = 0.1
# Below this many, derivatives are those of a length of zero.
_VANISHING = 1e-6
# Radians of the fastest rate in which the acceleration is looked at once.
_CELL = 0.5
# A jump of the torque at breakaway below this share of it is rounding.
_NO_JUMP = 1e-12


@compiled
def kind_of(before, code):
    """The event between two pieces."""
    if before == code:
        return EventKind.RETURN
    if code == 0:
        return EventKind.STICK
    if before == 0:
        return EventKind.SLIP
    return EventKind.REVERSAL if before * code < 0 else EventKind.BREAKPOINT


@compiled
def index_of(code, zero):
    """Number of a piece in the brake's law."""
    if code == 0:
        return REST
    return zero + code - 1 if code > 0 else zero + code


@compiled
def speed_at(before, code, zero, bounds):
    """Velocity [rad/s] at the node between two pieces; nan where there is no such piece."""
    low = min(before, code)
    # The pieces 1 and -1 both end at rest; k and k+1 share the upper end of k.
    edge = zero - 1
    if low > 0:
        edge = zero + low - 1
    elif max(before, code) < 0:
        edge = zero + low
    return bounds[edge] if 0 <= edge < bounds.size else math.nan


@compiled
def _limit(problem, code):
    """Torque [N m] at which rest ends towards a piece."""
    return problem.brake.upper if code > 0 else problem.brake.lower


@compiled
def _scales(problem):
    """(acceleration, torque) that the motion has."""
    inertia, amplitude, lower, upper = (
        problem.driveline.inertia,
        problem.torque.amplitude,
        problem.brake.lower,
        problem.brake.upper,
    )
    torque = amplitude
    for end in (lower, upper):
        if not math.isinf(end):
            torque = max(torque, abs(end))
    torque = max(torque, 1e-300)
    return torque / inertia, torque


@compiled
def breakaway(problem, code):
    """Acceleration [rad/s^2] with which slip into a piece begins after rest; 0: no jump."""
    inertia = problem.driveline.inertia
    piece = problem.brake.pieces[index_of(code, problem.brake.first_forward)]
    limit = _limit(problem, code)
    a = slip_acceleration(problem.driveline, piece, limit)
    return a if abs(a) * inertia > _NO_JUMP * abs(limit) else 0.0


@compiled
def pull_rate(problem, phase):
    """Rate [N m/s] of the torque that rest at a phase of the drive must hold."""
    stiffness, amplitude, omega, w_rest = (
        problem.driveline.stiffness,
        problem.torque.amplitude,
        problem.torque.angular_frequency,
        problem.driveline.rest_velocity,
    )
    return amplitude * omega * math.cos(phase) - stiffness * w_rest


@compiled
def _gained(piece, forcing, w, a, phase, tau, skipped):
    """(w(tau) - w(0)) / tau^skipped from its Taylor series, where that begins so.

    a : acceleration at entry, 0 for skipped = 2
    """
    g2, w2, (f, omega), (sine, cosine) = piece.damping, piece.stiffness, forcing, phase
    c, following = a, jerk(piece, forcing, w, a, phase)
    # Derivatives of the drive: f omega^n times cos, -sin, -cos, sin.
    force = f * omega
    total, power = 0.0, 1.0
    for n in range(1, 13):
        if n >= skipped:
            total += c * power / math.gamma(n + 1.0)
            power *= tau
        before, c = c, following
        force *= omega
        drive = cosine if n % 2 == 0 else sine
        sign = -1.0 if n % 4 == 1 or n % 4 == 2 else 1.0
        following = sign * force * drive - g2 * c - w2 * before
    return total


@compiled
def _slip(problem, code, before, theta0, w0, phase0, phase1, target, out):
    """The end of a slip and its derivative.

    before : piece before it;  target : velocity at its end (nan: free)

    ``out`` (5, 2) receives angle and velocity residual, and their derivatives by phase, angle
    and velocity at its begin, and by phase at its end. Where it ends on the boundary that it
    began on, the velocity is divided by the time, and after a rest without a jump of the
    torque by its square: a length of zero is then no solution.
    """
    inertia, stiffness, amplitude, omega = (
        problem.driveline.inertia,
        problem.driveline.stiffness,
        problem.torque.amplitude,
        problem.torque.angular_frequency,
    )
    row = problem.brake.pieces[index_of(code, problem.brake.first_forward)]
    w2, f = stiffness / inertia, amplitude / inertia
    forcing = forcing_of(problem.driveline, problem.torque)
    tau = (phase1 - phase0) / omega
    first, last = phase_of(phase0), phase_of(phase1)
    sin0, cos0 = first
    entry = enter(row, forcing, theta0, w0, first)
    theta, w = state_at(row, forcing, entry, tau, last)
    a0 = acceleration(row, forcing, theta0, w0, first)
    a1 = acceleration(row, forcing, theta, w, last)
    h, rate = impulse(row, tau)
    g2 = row.damping
    out[0, 0] = theta
    out[1, 0] = -((rate + g2 * h) * w0 + h * a0) / omega
    out[2, 0] = rate + g2 * h
    out[3, 0] = h
    out[4, 0] = w / omega
    out[0, 1] = w - target if not math.isnan(target) else w
    out[1, 1] = (w2 * h * w0 - rate * a0) / omega
    out[2, 1] = -w2 * h
    out[3, 1] = rate
    out[4, 1] = a1 / omega
    if before == code or target != w0:
        return
    turned = max(3.0 / row.cell, abs(g2)) * abs(tau)
    j0 = jerk(row, forcing, w0, a0, first)
    if before == 0 and breakaway(problem, code) == 0.0:
        # Without the part that the initial acceleration makes, which rest's end makes zero.
        out[2, 1] = 0.0
        if turned <= _SHORT:
            ratio = _gained(row, forcing, w0, 0.0, first, tau, 2)
        else:
            ratio = (w - w0 - a0 * h) / (tau * tau)
        out[0, 1] = ratio
        if turned <= _VANISHING:
            change = -f * omega * sin0 - g2 * j0 / omega
            out[4, 1] = change / 6.0
            out[1, 1] = -f * omega * sin0 / 2.0 - change / 6.0
            return
        out[1, 1] = (2.0 * ratio / tau - h * (j0 + g2 * a0) / (tau * tau)) / omega
        out[4, 1] = ((a1 - a0 * rate) / (tau * tau) - 2.0 * ratio / tau) / omega
        return
    ratio = _gained(row, forcing, w0, a0, first, tau, 1) if turned <= _SHORT else (w - w0) / tau
    out[0, 1] = ratio
    if turned <= _VANISHING:
        out[2, 1] = -w2
        out[4, 1] = 0.5 * j0 / omega
        out[1, 1] = f * cos0 - 0.5 * j0 / omega
        return
    out[1, 1] = (out[1, 1] + ratio / omega) / tau
    out[2, 1] /= tau
    out[4, 1] = (out[4, 1] - ratio / omega) / tau


@compiled
def residual(problem, codes, order, sign, unknowns, values, matrix):
    """The equations of an orbit, and their derivative by the unknowns.

    problem  : the first thirteen arguments of ``exact.run``
    codes    : (n,) pieces;  order : periods of the torque in the orbit
    sign     : 1; or -1, where the pieces are half an orbit, of which the other half is the
               mirror image: theta(t + order T/2) = -theta(t)
    unknowns : (2 n,)
    values   : (2 n,) receives the residuals;  matrix : (2 n, 2 n) their derivative

    Returns False where the brake has no such pieces.
    """
    damping, stiffness, amplitude, omega = (
        problem.driveline.damping,
        problem.driveline.stiffness,
        problem.torque.amplitude,
        problem.torque.angular_frequency,
    )
    bounds, table, zero, w_rest = (
        problem.brake.breakpoints,
        problem.brake.pieces,
        problem.brake.first_forward,
        problem.driveline.rest_velocity,
    )
    n = codes.size
    circle = math.pi * order * (2.0 if sign > 0 else 1.0)
    out = np.empty((5, 2))
    matrix[:] = 0.0
    for i in range(n):
        j = (i + 1) % n
        code = codes[i]
        before = codes[i - 1] if i > 0 else sign * codes[n - 1]
        after = codes[j] if j > 0 else sign * codes[0]
        wrap = circle if j == 0 else 0.0
        marked, ends_marked = before == code, after == code
        phase0 = 0.0 if marked else unknowns[2 * i]
        w0 = unknowns[2 * i] if marked else speed_at(before, code, zero, bounds)
        phase1 = wrap + (0.0 if ends_marked else unknowns[2 * j])
        turned = sign if j == 0 else 1
        theta0, theta1 = unknowns[2 * i + 1], turned * unknowns[2 * j + 1]
        piece = index_of(code, zero)
        if not math.isfinite(w0) or piece < REST or piece >= table.shape[0]:
            return False
        first, second = 2 * i, 2 * i + 1
        if code == 0:
            theta = theta0 + w_rest * (phase1 - phase0) / omega
            pull = amplitude * math.sin(phase1) - damping * w_rest - stiffness * theta1
            limit = _limit(problem, after)
            if math.isinf(limit):
                return False
            values[first] = theta - theta1
            values[second] = pull - limit
            matrix[first, first] -= w_rest / omega
            matrix[first, second] += 1.0
            matrix[first, 2 * j] += w_rest / omega
            matrix[first, 2 * j + 1] -= turned
            matrix[second, 2 * j] += amplitude * math.cos(phase1)
            matrix[second, 2 * j + 1] -= turned * stiffness
            continue
        if table[piece].form == FlowForm.BLOCKED:
            return False
        target = math.nan if ends_marked else speed_at(code, after, zero, bounds)
        _slip(problem, code, before, theta0, w0, phase0, phase1, target, out)
        values[first] = out[0, 0] - theta1
        values[second] = out[0, 1] - (unknowns[2 * j] if ends_marked else 0.0)
        for line in range(2):
            row = 2 * i + line
            matrix[row, 2 * i] += out[3, line] if marked else out[1, line]
            matrix[row, 2 * i + 1] += out[2, line]
            if not ends_marked:
                matrix[row, 2 * j] += out[4, line]
        matrix[first, 2 * j + 1] -= turned
        if ends_marked:
            matrix[second, 2 * j] -= 1.0
    return True


@compiled
def _turning(row, forcing, entry, phase0, low, high, growing):
    """(time, acceleration) between two times after entry where the acceleration is extreme."""
    tau, a = low, 0.0
    for _ in range(40):
        tau = 0.5 * (low + high)
        phase = phase_of(phase0 + forcing.angular_frequency * tau)
        theta, w = state_at(row, forcing, entry, tau, phase)
        a = acceleration(row, forcing, theta, w, phase)
        if (jerk(row, forcing, w, a, phase) > 0.0) == growing:
            low = tau
        else:
            high = tau
    return tau, a


@compiled
def _touch_of_slip(problem, code, before, after, theta0, w0, phase0, phase1, out):
    """How near a slip comes to a limit of its piece between its ends, into margins ``out``."""
    inertia, stiffness, _amplitude, omega = (
        problem.driveline.inertia,
        problem.driveline.stiffness,
        problem.torque.amplitude,
        problem.torque.angular_frequency,
    )
    bounds, zero = problem.brake.breakpoints, problem.brake.first_forward
    piece = index_of(code, zero)
    row = problem.brake.pieces[piece]
    w2, forcing = stiffness / inertia, forcing_of(problem.driveline, problem.torque)
    low = bounds[piece - 1] if piece > 0 else -math.inf
    high = bounds[piece] if piece < bounds.size else math.inf
    tau = (phase1 - phase0) / omega
    scale = _scales(problem)[0] / max(omega, math.sqrt(w2))
    first = phase_of(phase0)
    entry = enter(row, forcing, theta0, w0, first)
    cells = 1 + int(max(omega, math.sqrt(w2), abs(row.damping)) * tau / _CELL)
    width = tau / cells
    # Into the piece and out of it the velocity goes one way, whatever rounding says.
    rising = code > before
    if before == code:
        rising = acceleration(row, forcing, theta0, w0, first) > 0.0
    begin = 0.0
    before_a = acceleration(row, forcing, theta0, w0, first)
    before_j = jerk(row, forcing, w0, before_a, first)
    for cell in range(1, cells + 1):
        part = cell * width
        phase = phase_of(phase0 + omega * part)
        theta, w = state_at(row, forcing, entry, part, phase)
        a = acceleration(row, forcing, theta, w, phase)
        j = jerk(row, forcing, w, a, phase)
        now = a > 0.0
        if cell == cells and after != code:
            now = after > code
        # Two extremes in one cell: the acceleration turns back between its ends.
        middle = part
        if now == rising and (before_j > 0.0) != rising and (j > 0.0) == rising:
            middle, there = _turning(row, forcing, entry, phase0, begin, part, before_j > 0.0)
            if (there > 0.0) == rising:
                middle = part
        for half in range(2):
            start, end = (begin, middle) if half == 0 else (middle, part)
            if (half == 1 and middle == part) or (middle == part and now == rising):
                break
            at, there, top = extreme(row, forcing, entry, phase0 / omega, start, end, rising)
            gap, side = ((high - top), 1.0) if rising else ((top - low), -1.0)
            if gap / scale < out[TOUCH]:
                out[TOUCH], out[TOUCH_SIDE] = gap / scale, side
                out[TOUCH_PHASE], out[TOUCH_ANGLE] = phase0 + omega * at, there
            rising = not rising
        begin, before_j = part, j


@compiled
def _touch_of_rest(problem, theta0, phase0, phase1, out):
    """How near the torque comes to what the brake holds, inside a rest."""
    damping, stiffness, amplitude, omega = (
        problem.driveline.damping,
        problem.driveline.stiffness,
        problem.torque.amplitude,
        problem.torque.angular_frequency,
    )
    lower, upper, w_rest = problem.brake.lower, problem.brake.upper, problem.driveline.rest_velocity
    scale = _scales(problem)[1]
    share = stiffness * w_rest / (amplitude * omega) if amplitude > 0.0 else 2.0
    if abs(share) > 1.0:
        return
    turn = math.acos(share)
    for look in range(2):
        at = turn if look == 0 else -turn
        at += 2.0 * math.pi * math.ceil((phase0 - at) / (2.0 * math.pi))
        while at < phase1:
            here = theta0 + w_rest * (at - phase0) / omega
            held = amplitude * math.sin(at) - damping * w_rest - stiffness * here
            gap, side = ((upper - held), 1.0) if look == 0 else ((held - lower), -1.0)
            if at > phase0 and gap / scale < out[TOUCH]:
                out[TOUCH], out[TOUCH_SIDE] = gap / scale, side
                out[TOUCH_PHASE], out[TOUCH_ANGLE] = at, here
            at += 2.0 * math.pi


@compiled
def margins(problem, codes, order, unknowns, out):
    """How far a solution is from being no motion, for each piece: (n, COLUMNS).

    Infinite where there is nothing to touch, or nothing to hold.
    """
    _inertia, damping, stiffness = (
        problem.driveline.inertia,
        problem.driveline.damping,
        problem.driveline.stiffness,
    )
    amplitude, bounds, table, zero = (
        problem.torque.amplitude,
        problem.brake.breakpoints,
        problem.brake.pieces,
        problem.brake.first_forward,
    )
    lower, upper, w_rest = problem.brake.lower, problem.brake.upper, problem.driveline.rest_velocity
    accelerations, torques = _scales(problem)
    forcing = forcing_of(problem.driveline, problem.torque)
    n = codes.size
    for i in range(n):
        j = (i + 1) % n
        code, before, after = codes[i], codes[i - 1], codes[j]
        wrap = 2.0 * math.pi * order if j == 0 else 0.0
        marked, ends_marked = before == code, after == code
        phase0 = 0.0 if marked else unknowns[2 * i]
        w0 = unknowns[2 * i] if marked else speed_at(before, code, zero, bounds)
        phase1 = wrap + (0.0 if ends_marked else unknowns[2 * j])
        theta0, theta1 = unknowns[2 * i + 1], unknowns[2 * j + 1]
        here = out[i]
        here[DURATION] = phase1 - phase0
        here[TOUCH] = here[HOLDING] = here[CROSSING] = math.inf
        here[TOUCH_PHASE] = here[TOUCH_ANGLE] = math.nan
        here[TOUCH_SIDE] = 0.0
        if code == 0:
            if phase1 > phase0:
                _touch_of_rest(problem, theta0, phase0, phase1, here)
            continue
        if phase1 > phase0:
            _touch_of_slip(problem, code, before, after, theta0, w0, phase0, phase1, here)
        if ends_marked:
            continue
        w1 = speed_at(code, after, zero, bounds)
        row = table[index_of(code, zero)]
        a1 = acceleration(row, forcing, theta1, w1, phase_of(phase1))
        here[CROSSING] = a1 / accelerations if after > code else -a1 / accelerations
        held = amplitude * math.sin(phase1) - damping * w_rest - stiffness * theta1
        if after == 0:
            # The near end of what is held is where the slip would not have ended.
            here[HOLDING] = (held - lower if code > 0 else upper - held) / torques
        elif code * after < 0:
            here[HOLDING] = (held - upper if after > 0 else lower - held) / torques


@compiled
def write(problem, codes, order, unknowns, log):
    """The orbit as ``exact.run`` would log it, from node 0 to node 0: how many rows.

    log : (rows, LOG_COLUMNS), at least n + order + 2 rows. Rows of kind PERIOD hold the orbit's
          Poincare points.
    """
    _inertia, _stiffness, _amplitude, omega = (
        problem.driveline.inertia,
        problem.driveline.stiffness,
        problem.torque.amplitude,
        problem.torque.angular_frequency,
    )
    bounds, table, zero, w_rest = (
        problem.brake.breakpoints,
        problem.brake.pieces,
        problem.brake.first_forward,
        problem.driveline.rest_velocity,
    )
    forcing = forcing_of(problem.driveline, problem.torque)
    circle = 2.0 * math.pi
    n, rows = codes.size, 0
    for i in range(n + 1):
        k = i % n
        code, before = codes[k], codes[k - 1]
        marked = before == code
        phase = (0.0 if marked else unknowns[2 * k]) + (circle * order if i == n else 0.0)
        w = unknowns[2 * k] if marked else speed_at(before, code, zero, bounds)
        theta = unknowns[2 * k + 1]
        period = math.floor(phase / circle)
        kind = kind_of(before, code)
        # A rest remembers the side it was entered from, all else where it goes.
        up = before > 0 if kind == EventKind.STICK else code > before
        time, side = (phase - circle * period) / omega, 1.0 if up else -1.0
        rows = write_row(log, rows, kind, period, time, theta, w, index_of(code, zero), side)
        if i == n:
            break
        j = (k + 1) % n
        end = circle * order if k + 1 == n else 0.0
        end += 0.0 if codes[j] == code else unknowns[2 * j]
        at = period + 1
        # An event exactly at a period's begin is written after that period's row; a mark is it.
        marks = codes[j] == code
        while (circle * at < end or (circle * at == end and not marks)) and (
            rows < log.shape[0] - (n - i)
        ):
            tau = (circle * at - phase) / omega
            there, speed = theta + w_rest * tau, w_rest
            if code != 0:
                row = table[index_of(code, zero)]
                entry = enter(row, forcing, theta, w, phase_of(phase))
                there, speed = state_at(row, forcing, entry, tau, phase_at_return())
            kind, mode = EventKind.RETURN, index_of(code, zero)
            rows = write_row(log, rows, kind, at, 0.0, there, speed, mode, 0.0)
            at += 1
    return rows


@compiled
def extremes(problem, codes, order, unknowns, out):
    """Least and greatest velocity [rad/s] and angle [rad] of an orbit, into ``out`` (4,)."""
    inertia, stiffness, _amplitude, omega = (
        problem.driveline.inertia,
        problem.driveline.stiffness,
        problem.torque.amplitude,
        problem.torque.angular_frequency,
    )
    bounds, table, zero, w_rest = (
        problem.brake.breakpoints,
        problem.brake.pieces,
        problem.brake.first_forward,
        problem.driveline.rest_velocity,
    )
    w2, forcing = stiffness / inertia, forcing_of(problem.driveline, problem.torque)
    out[0] = out[2] = math.inf
    out[1] = out[3] = -math.inf
    n = codes.size
    for i in range(n):
        j = (i + 1) % n
        code, before = codes[i], codes[i - 1]
        marked = before == code
        phase0 = 0.0 if marked else unknowns[2 * i]
        phase1 = 2.0 * math.pi * order if j == 0 else 0.0
        phase1 += 0.0 if codes[j] == code else unknowns[2 * j]
        theta0 = unknowns[2 * i + 1]
        w0 = unknowns[2 * i] if marked else speed_at(before, code, zero, bounds)
        _widen(out, theta0, w0)
        tau = (phase1 - phase0) / omega
        if code == 0:
            _widen(out, theta0 + w_rest * tau, w_rest)
        if code == 0 or tau <= 0.0:
            continue
        row = table[index_of(code, zero)]
        first = phase_of(phase0)
        entry = enter(row, forcing, theta0, w0, first)
        cells = 1 + int(max(omega, math.sqrt(w2), abs(row.damping)) * tau / _CELL)
        begin, speed = 0.0, w0
        rising = acceleration(row, forcing, theta0, w0, first) > 0.0
        for cell in range(1, cells + 1):
            part = cell * tau / cells
            phase = phase_of(phase0 + omega * part)
            theta, w = state_at(row, forcing, entry, part, phase)
            now = acceleration(row, forcing, theta, w, phase) > 0.0
            _widen(out, theta, w)
            if now != rising:
                _, there, top = extreme(row, forcing, entry, phase0 / omega, begin, part, rising)
                _widen(out, there, top)
            if (w > 0.0) != (speed > 0.0):
                # The angle is extreme where the velocity vanishes.
                low, high = begin, part
                for _ in range(50):
                    middle = 0.5 * (low + high)
                    phase = phase_of(phase0 + omega * middle)
                    theta, there = state_at(row, forcing, entry, middle, phase)
                    if (there > 0.0) == (speed > 0.0):
                        low = middle
                    else:
                        high = middle
                _widen(out, theta, there)
            begin, speed, rising = part, w, now


@compiled
def _widen(out, theta, w):
    out[0], out[1] = min(out[0], w), max(out[1], w)
    out[2], out[3] = min(out[2], theta), max(out[3], theta)


@compiled
def monodromy(problem, codes, order, unknowns, log):
    """(trace, determinant) of the derivative of the orbit's return, from ``tangent.carry``.

    They do not depend on where the orbit begins. ``log`` as for ``write``.
    """
    rows = write(problem, codes, order, unknowns, log)
    weight = problem.torque.angular_frequency
    there = propagate(problem, log, rows, Deviations(1.0, 0.0, 0.0, weight), np.empty(0), 0)
    determinant = math.exp(there.log_determinant) if there.full_rank else 0.0
    trace = there.deviations.angle1 + there.deviations.velocity2 / weight
    return trace * math.exp(there.log_scale), determinant
