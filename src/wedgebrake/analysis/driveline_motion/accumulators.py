"""Sums over a logged trajectory: rest, sticks, heat, peak torque, range of the motion."""

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from wedgebrake.dynamics.enums import EventKind
from wedgebrake.dynamics.harmonic import phase_at, phase_of
from wedgebrake.dynamics.jit import borrowing
from wedgebrake.dynamics.linear_flow import acceleration, enter, forcing_of, jerk, state_at
from wedgebrake.dynamics.motion_sums import count_stick, empty_sums, widen
from wedgebrake.dynamics.problem import Problem, torque_at_rest
from wedgebrake.dynamics.section import return_time
from wedgebrake.dynamics.segment_log import REST, duration

# Sampling interval for the extremes of a motion, in radians of its fastest rate.
_CELL = 1.5
# A torque below this share of the peak at both ends of a cell does not reach it between them.
_NEAR_PEAK = 0.5
# Below this loss (share of one cycle) the work of the slope is not a difference of energies.
_LOSSLESS = 1e-7
# Gauss-Legendre nodes and weights on (0, 1), exact to order 8.
_NODES = (0.06943184420297371, 0.33000947820757187, 0.6699905217924281, 0.9305681557970262)
_WEIGHTS = (0.17392742256872692, 0.3260725774312731, 0.3260725774312731, 0.17392742256872692)


@borrowing
def _widen(sums, theta, w, torque):
    """Include a state and its brake torque in the extremes."""
    widen(sums, theta, w)
    sums.peak_torque = max(sums.peak_torque, abs(torque))


@borrowing
def _add_rest(problem, row, tau, sums):
    """Add an interval of rest: its time, and the largest torque that was held."""
    driveline, torque = problem.driveline, problem.torque
    omega, w_rest = torque.angular_frequency, driveline.rest_velocity
    sums.rest_time += tau
    begin = omega * row.time
    # The ends, and stationary points of the held torque between them.
    share = 2.0
    if torque.amplitude > 0.0:
        share = driveline.stiffness * w_rest / (torque.amplitude * omega)
    turn = math.acos(share) if abs(share) <= 1.0 else 0.0
    for sample in range(4):
        at = begin if sample == 0 else begin + omega * tau
        if sample >= 2:
            at = turn if sample == 2 else 2.0 * math.pi - turn
            if not begin < at < begin + omega * tau:
                continue
        angle = row.angle + w_rest * (at - begin) / omega
        held = torque_at_rest(driveline, torque, phase_of(at), angle)
        _widen(sums, angle, w_rest, held)


@borrowing
def extreme(piece, forcing, entry, t0, low, high, rising):
    """(time after entry, angle, velocity) of the extreme velocity between two times after entry.

    There the acceleration vanishes.

    t0     : time of the entry;  rising : whether the acceleration is positive at ``low``
    """
    theta, w, tau = entry.angle, entry.velocity, 0.5 * (low + high)
    for _ in range(60):
        phase = phase_at(forcing, t0 + tau)
        theta, w = state_at(piece, forcing, entry, tau, phase)
        a = acceleration(piece, forcing, theta, w, phase)
        j = jerk(piece, forcing, w, a, phase)
        if (a > 0.0) == rising:
            low = tau
        else:
            high = tau
        step = a / j if j != 0.0 else math.inf
        # The remaining Newton steps to the extreme change the velocity by half a step.
        if abs(a * step) <= 1e-13 * abs(w) or high - low <= 1e-15 * high:
            break
        tau -= step
        if not low < tau < high:
            tau = 0.5 * (low + high)
    return tau, theta, w


@borrowing
def _square_by_energy(piece, forcing, start, after, first):
    """Integral of the squared velocity over a slip, from the energy balance of the piece.

    damping int w^2 = f int sin(omega t) w + [constant theta - w^2/2 - stiffness theta^2/2]; the
    first integral, and the one with cos, follow from the equation of motion times sin and cos.

    first : phase of the torque at ``start``
    """
    f, omega = forcing
    g2, w2, q = piece.damping, piece.stiffness, piece.constant
    theta0, w0, theta1, w1 = start.angle, start.velocity, after.angle, after.velocity
    (sin0, cos0), (sin1, cos1) = first, phase_at(forcing, after.time)
    tau_sin = (cos0 - cos1) / omega
    tau_cos = (sin1 - sin0) / omega
    product = 0.5 * (sin1 * sin1 - sin0 * sin0) / omega
    tau = after.time - start.time
    if after.period > start.period:
        tau += return_time(forcing)
    square = 0.5 * tau - 0.5 * (sin1 * cos1 - sin0 * cos0) / omega
    react = omega - w2 / omega
    right_sin = f * square + q * tau_sin - (w1 * sin1 - w0 * sin0)
    right_sin += w2 / omega * (theta1 * cos1 - theta0 * cos0)
    right_cos = f * product + q * tau_cos - (w1 * cos1 - w0 * cos0)
    right_cos -= w2 / omega * (theta1 * sin1 - theta0 * sin0)
    forced = (g2 * right_sin + react * right_cos) / (g2 * g2 + react * react)
    gained = q * (theta1 - theta0)
    gained -= 0.5 * (w1 - w0) * (w1 + w0) + 0.5 * w2 * (theta1 - theta0) * (theta1 + theta0)
    return (f * forced + gained) / g2


@borrowing
def _square_by_nodes(piece, forcing, entry, t0, tau):
    """The same by quadrature, without loss or at resonance."""
    fastest = max(forcing.angular_frequency, math.sqrt(piece.stiffness))
    cells = 1 + int(2.0 * fastest * tau)
    width = tau / cells
    total = 0.0
    for cell in range(cells):
        for node in range(4):
            part = (cell + _NODES[node]) * width
            _, w = state_at(piece, forcing, entry, part, phase_at(forcing, t0 + part))
            total += _WEIGHTS[node] * width * w * w
    return total


@borrowing
def _heat(piece, forcing, w_rest, start, after, entry, tau):
    """Heat [J] of a slip in one piece."""
    # M v = (offset + slope w)(w - w_rest), and the integral of w is an angle.
    turned, slope = after.angle - start.angle, piece.slope
    heat = piece.offset * (turned - w_rest * tau) - slope * w_rest * turned
    if slope == 0.0:
        return heat
    omega, g2 = forcing.angular_frequency, abs(piece.damping)
    loss = g2 * tau * (g2 + abs(omega - piece.stiffness / omega)) / omega
    if loss > _LOSSLESS:
        return heat + slope * _square_by_energy(piece, forcing, start, after, entry.phase)
    return heat + slope * _square_by_nodes(piece, forcing, entry, start.time, tau)


@borrowing
def _add_inside(piece, forcing, start, after, entry, tau, cells, sums, whole):
    """Add states inside a slip in one piece, at the ends of its cells, to the extremes.

    whole : also the largest torques between them
    """
    offset, slope, t0 = piece.offset, piece.slope, start.time
    width = tau / cells
    before = acceleration(piece, forcing, start.angle, start.velocity, entry.phase)
    level = abs(offset + slope * start.velocity)
    for cell in range(1, cells + whole):
        theta, w, part = after.angle, after.velocity, tau
        if cell < cells:
            part = cell * width
            phase = phase_at(forcing, t0 + part)
            theta, w = state_at(piece, forcing, entry, part, phase)
            _widen(sums, theta, w, offset + slope * w)
        else:
            phase = phase_at(forcing, after.time)
        if not whole:
            continue
        a = acceleration(piece, forcing, theta, w, phase)
        here = abs(offset + slope * w)
        near = max(here, level) > _NEAR_PEAK * sums.peak_torque
        if (a < 0.0) != (before < 0.0) and slope != 0.0 and near:
            _, theta, w = extreme(piece, forcing, entry, t0, part - width, part, before > 0.0)
            _widen(sums, theta, w, offset + slope * w)
        before, level = a, here


@borrowing
def _add_slip(problem, forcing, row, after, tau, sums, whole):
    """Add a slip in one piece: extremes of state and torque, and its heat."""
    piece = problem.brake.pieces[row.mode]
    if whole:
        _widen(sums, row.angle, row.velocity, piece.offset + piece.slope * row.velocity)
        _widen(sums, after.angle, after.velocity, piece.offset + piece.slope * after.velocity)
    else:  # the end is the start of the next row
        widen(sums, row.angle, row.velocity)
    fastest = max(forcing.angular_frequency, math.sqrt(piece.stiffness))
    cells = 1 + int(fastest * tau / _CELL)
    if cells == 1 and not whole:
        return
    entry = enter(piece, forcing, row.angle, row.velocity, phase_at(forcing, row.time))
    _add_inside(piece, forcing, row, after, entry, tau, cells, sums, whole)
    if whole:
        w_rest = problem.driveline.rest_velocity
        sums.heat += _heat(piece, forcing, w_rest, row, after, entry, tau)


@borrowing
def add(problem, log, rows, sums, whole):
    """Add the first ``rows`` rows of a log to a record of ``SUMS``; the last row is its end.

    whole : False leaves out the heat and the largest torque
    """
    forcing = forcing_of(problem.driveline, problem.torque)
    interval = return_time(problem.torque)
    for i in range(rows - 1):
        row, after = log[i], log[i + 1]
        tau = duration(row, after, interval)
        if row.mode == REST:
            _add_rest(problem, row, tau, sums)
        elif tau > 0.0:
            _add_slip(problem, forcing, row, after, tau, sums, whole)
            sums.last_slip = after.period + after.time / interval
        if after.kind == EventKind.STICK:
            count_stick(sums, after.side)
    if rows > 0:
        widen(sums, log[rows - 1].angle, log[rows - 1].velocity)


def sums_of(problem: Problem, log: NDArray[np.record]) -> Any:
    """Return the sums over a whole log, a record of ``SUMS``."""
    sums = empty_sums()
    add(problem, log, log.size, sums, True)
    return sums
