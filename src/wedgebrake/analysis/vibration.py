"""Mean squares and extremes of velocity, acceleration, jerk and torque over a logged trajectory.

Integrals are computed to rounding by Gauss quadrature on cells that are short compared with the
time scales of the motion, extremes where the next derivative vanishes. The jumps of the
acceleration at events do not count as jerk.
"""

import math

import numpy as np

from wedgebrake.dynamics.harmonic import phase_at
from wedgebrake.dynamics.jit import compiled
from wedgebrake.dynamics.linear_flow import (
    acceleration,
    enter,
    forcing_of,
    jerk,
    snap,
    state_at,
)
from wedgebrake.dynamics.problem import torque_at_rest
from wedgebrake.dynamics.records import record
from wedgebrake.dynamics.section import return_time
from wedgebrake.dynamics.segment_log import REST, duration

# The quadrature error on a cell of one radian is below 1e-15 of the mean square.
_NODES, _WEIGHTS = (0.5 * numbers for numbers in np.polynomial.legendre.leggauss(8))
_NODES = _NODES + 0.5
# Decay of free vibration (logarithm) that leaves rounding.
_GONE = 40.0
# Largest number of steps of the search for an extreme, and its relative tolerance.
_STEPS, _CLOSE = 60, 1e-13

VIBRATION = record(
    fields=[
        ("time", np.float64),  # [s]
        ("velocity", np.float64),  # integrals of the quantities
        ("torque", np.float64),
        ("velocity_square", np.float64),  # and of their squares
        ("acceleration_square", np.float64),
        ("jerk_square", np.float64),
        ("torque_square", np.float64),
        ("least_velocity", np.float64),
        ("greatest_velocity", np.float64),
        ("peak_acceleration", np.float64),
        ("peak_jerk", np.float64),
    ]
)


@compiled
def clear_vibration(sums):
    """Reset a record."""
    sums.time = sums.velocity = sums.torque = 0.0
    sums.velocity_square = sums.acceleration_square = sums.jerk_square = sums.torque_square = 0.0
    sums.least_velocity, sums.greatest_velocity = math.inf, -math.inf
    sums.peak_acceleration = sums.peak_jerk = 0.0


@compiled
def _derivatives(piece, forcing, entry, t0, tau):
    """Velocity, acceleration, jerk and snap a time after the entry at ``t0``."""
    phase = phase_at(forcing, t0 + tau)
    theta, w = state_at(piece, forcing, entry, tau, phase)
    a = acceleration(piece, forcing, theta, w, phase)
    j = jerk(piece, forcing, w, a, phase)
    return w, a, j, snap(piece, forcing, a, j, phase)


@compiled
def _extreme(piece, forcing, entry, t0, low, high, order):
    """Extreme of derivative ``order`` of the velocity between two times after the entry.

    The next derivative changes its sign between them (false position, Illinois variant).
    """
    below = _derivatives(piece, forcing, entry, t0, low)[order + 1]
    above = _derivatives(piece, forcing, entry, t0, high)[order + 1]
    found, last, curvature = 0.0, 0, abs(above - below) / (high - low)
    for _ in range(_STEPS):
        tau = low + (high - low) * below / (below - above)
        if not low < tau < high:
            tau = 0.5 * (low + high)
        here = _derivatives(piece, forcing, entry, t0, tau)
        found, slope = here[order], here[order + 1]
        # The error of the extreme is slope^2/(2 curvature).
        if slope * slope <= _CLOSE * abs(found) * curvature:
            break
        if (slope > 0.0) == (below > 0.0):
            low, below = tau, slope
            above = 0.5 * above if last == 1 else above
            last = 1
        else:
            high, above = tau, slope
            below = 0.5 * below if last == 2 else below
            last = 2
    return found


@compiled
def _widen(sums, order, value):
    """Include a value of the velocity or of a derivative in the extremes."""
    if order == 0:
        sums.least_velocity = min(sums.least_velocity, value)
        sums.greatest_velocity = max(sums.greatest_velocity, value)
    elif order == 1:
        sums.peak_acceleration = max(sums.peak_acceleration, abs(value))
    else:
        sums.peak_jerk = max(sums.peak_jerk, abs(value))


@compiled
def _fastest(piece, forcing, at, tau):
    """(rate, end): the fastest rate of a slip from a time ``at`` on [1/s], and until when it holds.

    Free vibration that has decayed to rounding has no rate.
    """
    half, fastest, end = 0.5 * piece.damping, forcing.angular_frequency, tau
    apart = half * half - piece.stiffness
    first = abs(half) + math.sqrt(apart) if apart > 0.0 else math.sqrt(piece.stiffness)
    for rate in (first, piece.stiffness / first if apart > 0.0 else first):
        decay = math.copysign(rate, half) if apart > 0.0 else half
        gone = _GONE / decay if decay > 0.0 else math.inf
        if at < gone:
            fastest, end = max(fastest, rate), min(end, gone)
    return fastest, end


@compiled
def _add_slip(piece, forcing, entry, t0, tau, sums):
    """Add a slip within one piece of the brake torque."""
    before = _derivatives(piece, forcing, entry, t0, 0.0)
    for order in range(3):
        _widen(sums, order, before[order])
    begin = at = 0.0
    while begin < tau:
        fastest, end = _fastest(piece, forcing, begin, tau)
        cells = 1 + int(fastest * (end - begin))
        width = (end - begin) / cells
        for cell in range(cells):
            for node in range(_NODES.size + 1):
                inner = node < _NODES.size
                part = begin + (cell + (_NODES[node] if inner else 1.0)) * width
                here = _derivatives(piece, forcing, entry, t0, part)
                for order in range(3):
                    _widen(sums, order, here[order])
                    if (here[order + 1] > 0.0) != (before[order + 1] > 0.0):
                        _widen(sums, order, _extreme(piece, forcing, entry, t0, at, part, order))
                at, before = part, here
                if inner:
                    weight, torque = _WEIGHTS[node] * width, piece.offset + piece.slope * here[0]
                    sums.velocity += weight * here[0]
                    sums.velocity_square += weight * here[0] * here[0]
                    sums.acceleration_square += weight * here[1] * here[1]
                    sums.jerk_square += weight * here[2] * here[2]
                    sums.torque += weight * torque
                    sums.torque_square += weight * torque * torque
        begin = end


@compiled
def _add_rest(problem, forcing, row, tau, sums):
    """Add an interval of rest relative to the brake."""
    driveline, w = problem.driveline, problem.driveline.rest_velocity
    for order in range(3):
        _widen(sums, order, w if order == 0 else 0.0)
    sums.velocity += w * tau
    sums.velocity_square += w * w * tau
    cells = 1 + int(forcing.angular_frequency * tau)
    width = tau / cells
    for cell in range(cells):
        for node in range(_NODES.size):
            part = (cell + _NODES[node]) * width
            phase = phase_at(forcing, row.time + part)
            torque = torque_at_rest(driveline, problem.torque, phase, row.angle + w * part)
            sums.torque += _WEIGHTS[node] * width * torque
            sums.torque_square += _WEIGHTS[node] * width * torque * torque


@compiled
def add_vibration(problem, log, rows, sums):
    """Add the first ``rows`` rows of a log to a record of ``VIBRATION``; the last is its end."""
    forcing = forcing_of(problem.driveline, problem.torque)
    interval = return_time(problem.torque)
    for i in range(rows - 1):
        row, after = log[i], log[i + 1]
        tau = duration(row, after, interval)
        if not tau > 0.0:
            continue
        sums.time += tau
        if row.mode == REST:
            _add_rest(problem, forcing, row, tau, sums)
        else:
            piece = problem.brake.pieces[row.mode]
            phase = phase_at(forcing, row.time)
            entry = enter(piece, forcing, row.angle, row.velocity, phase)
            _add_slip(piece, forcing, entry, row.time, tau, sums)


@compiled
def _deviation(square, total, time):
    """Root mean square of the deviation from the mean."""
    mean = total / time
    return math.sqrt(max(square / time - mean * mean, 0.0))


@compiled
def report_vibration(result, sums):
    """Write root mean squares and extremes into a result."""
    if not sums.time > 0.0:
        return
    time = sums.time
    result.lowest_velocity, result.highest_velocity = sums.least_velocity, sums.greatest_velocity
    result.rms_velocity = _deviation(sums.velocity_square, sums.velocity, time)
    result.rms_acceleration = math.sqrt(sums.acceleration_square / time)
    result.rms_jerk = math.sqrt(sums.jerk_square / time)
    result.peak_acceleration, result.peak_jerk = sums.peak_acceleration, sums.peak_jerk
    result.rms_torque = _deviation(sums.torque_square, sums.torque, time)
