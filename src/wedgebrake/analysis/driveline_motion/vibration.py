"""Mean squares and extremes of velocity, acceleration, jerk and torque over a logged trajectory.

The velocity is a Taylor series on cells that are short compared with the time scales of the motion.
Integrals are computed to rounding by Gauss quadrature, extremes where the next derivative vanishes.
The jumps of the acceleration at events do not count as jerk.
"""

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from wedgebrake.dynamics.harmonic import Sine, phase_at, rate, second_rate
from wedgebrake.dynamics.jit import borrowing, compiled
from wedgebrake.dynamics.linear_flow import (
    Entry,
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
# Terms of a Taylor series whose remainder on such a cell is rounding, and their inverse numbers.
SERIES = 21
_INVERSE = 1.0 / np.maximum(np.arange(SERIES), 1)
# Shares of a cell at which the motion is evaluated: its ends and the nodes.
_SHARES = np.concatenate(([0.0], _NODES, [1.0]))
# (terms, 4 p) values of the terms of a series and of their derivatives at all shares.
_TERMS = np.array(
    [
        np.concatenate([np.polynomial.Polynomial.basis(k).deriv(n)(_SHARES) for n in range(4)])
        for k in range(SERIES)
    ]
)
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


class Scratch(NamedTuple):
    """Arrays that are overwritten for each cell.

    series  : (``SERIES``,) Taylor coefficients of the velocity over the share of the cell
    samples : (4, p) velocity, acceleration, jerk and snap at all shares
    """

    series: NDArray[np.float64]
    samples: NDArray[np.float64]


@compiled
def empty_scratch():
    """Allocate a ``Scratch``."""
    return Scratch(np.empty(SERIES), np.empty((4, _SHARES.size)))


class _Cell(NamedTuple):
    """A part of a slip.

    entry, start : start of the slip, and its time since the last return [s]
    begin, width : of the cell, after the start of the slip [s]
    decayed      : whether a fast decay is over, so that the motion is slower than the piece's
                   rates and the recurrence of its Taylor series unstable
    """

    piece: Any
    forcing: Sine
    entry: Entry
    start: float
    begin: float
    width: float
    decayed: bool


@borrowing
def clear_vibration(sums):
    """Reset a record."""
    sums.time = sums.velocity = sums.torque = 0.0
    sums.velocity_square = sums.acceleration_square = sums.jerk_square = sums.torque_square = 0.0
    sums.least_velocity, sums.greatest_velocity = math.inf, -math.inf
    sums.peak_acceleration = sums.peak_jerk = 0.0


@borrowing
def _start(cell):
    """Velocity, acceleration and phase of the torque at the start of a cell."""
    phase, theta, w = cell.entry.phase, cell.entry.angle, cell.entry.velocity
    if cell.begin > 0.0:
        phase = phase_at(cell.forcing, cell.start + cell.begin)
        theta, w = state_at(cell.piece, cell.forcing, cell.entry, cell.begin, phase)
    return w, acceleration(cell.piece, cell.forcing, theta, w, phase), phase


@borrowing
def _expand(cell, series):
    """Store the Taylor series of the velocity over the share of a cell."""
    piece, h = cell.piece, cell.width
    series[0], a, phase = _start(cell)
    series[1] = h * a
    turn, damping, stiffness = (
        h * cell.forcing.angular_frequency, h * piece.damping, h * h * piece.stiffness
    )  # fmt: skip
    # Taylor coefficients of the forcing of w'' + damping w' + stiffness w, and of its quadrature.
    push = h * h * rate(cell.forcing, phase)
    quadrature = h * second_rate(cell.forcing, phase) * h / cell.forcing.angular_frequency
    for k in range(2, SERIES):
        term = _INVERSE[k - 1] * (push - stiffness * series[k - 2]) - damping * series[k - 1]
        series[k] = _INVERSE[k] * term
        push, quadrature = (
            _INVERSE[k - 1] * turn * quadrature, -_INVERSE[k - 1] * turn * push
        )  # fmt: skip


@borrowing
def _second_bound(cell, series, order):
    """Bound of the second derivative of derivative ``order`` of the velocity over the share."""
    if cell.decayed:
        return math.inf
    total = 0.0
    for k in range(order + 2, SERIES):
        factor = 1.0
        for one in range(order + 2):
            factor *= k - one
        total += factor * abs(series[k])
    return total / cell.width**order


@borrowing
def _derivatives(cell, series, x):
    """Velocity, acceleration, jerk and snap at a share of a cell."""
    h = cell.width
    if cell.decayed:
        tau = cell.begin + x * h
        phase = phase_at(cell.forcing, cell.start + tau)
        theta, w = state_at(cell.piece, cell.forcing, cell.entry, tau, phase)
        a = acceleration(cell.piece, cell.forcing, theta, w, phase)
        j = jerk(cell.piece, cell.forcing, w, a, phase)
        return w, a, j, snap(cell.piece, cell.forcing, a, j, phase)
    w = first = second = third = 0.0
    for k in range(SERIES - 1, -1, -1):
        third = third * x + second
        second = second * x + first
        first = first * x + w
        w = w * x + series[k]
    return w, first / h, 2.0 * second / (h * h), 6.0 * third / (h * h * h)


@borrowing
def _sample(cell, arrays):
    """Store velocity, acceleration, jerk and snap at all shares of a cell."""
    series, samples = arrays
    if cell.decayed:
        for i in range(_SHARES.size):
            found = _derivatives(cell, series, _SHARES[i])
            for order in range(4):
                samples[order, i] = found[order]
        return
    _expand(cell, series)
    flat = samples.reshape(-1)
    for i in range(flat.size):
        flat[i] = series[0] * _TERMS[0, i]
    # Four terms at once for all shares, which the compiler turns into vector instructions.
    for k in range(1, SERIES, 4):
        first, second, third, fourth = series[k], series[k + 1], series[k + 2], series[k + 3]
        for i in range(flat.size):
            flat[i] += first * _TERMS[k, i] + second * _TERMS[k + 1, i]
            flat[i] += third * _TERMS[k + 2, i] + fourth * _TERMS[k + 3, i]
    for order in range(1, 4):
        for i in range(_SHARES.size):
            samples[order, i] /= cell.width**order


@borrowing
def _extreme(cell, series, low, high, order):
    """Extreme of derivative ``order`` of the velocity between two shares of a cell.

    The next derivative changes its sign between them (false position, Illinois variant).
    """
    below = _derivatives(cell, series, low)[order + 1]
    above = _derivatives(cell, series, high)[order + 1]
    found, last = 0.0, 0
    curvature = abs(above - below) / ((high - low) * cell.width)
    for _ in range(_STEPS):
        x = low + (high - low) * below / (below - above)
        if not low < x < high:
            x = 0.5 * (low + high)
        here = _derivatives(cell, series, x)
        found, slope = here[order], here[order + 1]
        # The error of the extreme is slope^2/(2 curvature).
        if slope * slope <= _CLOSE * abs(found) * curvature:
            break
        if (slope > 0.0) == (below > 0.0):
            low, below = x, slope
            above = 0.5 * above if last == 1 else above
            last = 1
        else:
            high, above = x, slope
            below = 0.5 * below if last == 2 else below
            last = 2
    return found


@borrowing
def _is_within(sums, order, low, high):
    """Return True if values between two numbers are within the extremes so far."""
    if order == 0:
        return sums.least_velocity <= low and high <= sums.greatest_velocity
    return max(-low, high) <= (sums.peak_acceleration if order == 1 else sums.peak_jerk)


@borrowing
def _widen(sums, order, value):
    """Include a value of the velocity or of a derivative in the extremes."""
    if order == 0:
        sums.least_velocity = min(sums.least_velocity, value)
        sums.greatest_velocity = max(sums.greatest_velocity, value)
    elif order == 1:
        sums.peak_acceleration = max(sums.peak_acceleration, abs(value))
    else:
        sums.peak_jerk = max(sums.peak_jerk, abs(value))


@borrowing
def _fastest(piece, forcing, at, tau):
    """(rate, end): the fastest rate of a slip from a time ``at`` on [1/s], and until when it holds.

    Free vibration that has decayed to rounding has no rate.
    """
    half, fastest, end = 0.5 * piece.damping, forcing.angular_frequency, tau
    apart = half * half - piece.stiffness
    first = abs(half) + math.sqrt(apart) if apart > 0.0 else math.sqrt(piece.stiffness)
    for root in (first, piece.stiffness / first if apart > 0.0 else first):
        decay = math.copysign(root, half) if apart > 0.0 else half
        gone = _GONE / decay if decay > 0.0 else math.inf
        if at < gone:
            fastest, end = max(fastest, root), min(end, gone)
    return fastest, end


@borrowing
def _add_cell(cell, arrays, sums):
    """Add a cell: integrals by quadrature, and extremes that exceed those so far."""
    piece, h, samples = cell.piece, cell.width, arrays.samples
    _sample(cell, arrays)
    for order in range(3):
        values, slopes = samples[order], samples[order + 1]
        for i in range(_SHARES.size):
            _widen(sums, order, values[i])
        for i in range(1, _SHARES.size):
            if (slopes[i] > 0.0) != (slopes[i - 1] > 0.0):
                low, high = _SHARES[i - 1], _SHARES[i]
                # Error of linear interpolation.
                bound = _second_bound(cell, arrays.series, order)
                beyond = 0.125 * (high - low) * (high - low) * bound
                least = min(values[i], values[i - 1]) - beyond
                most = max(values[i], values[i - 1]) + beyond
                if not _is_within(sums, order, least, most):
                    _widen(sums, order, _extreme(cell, arrays.series, low, high, order))
    for node in range(_NODES.size):
        w, a, j = samples[0, node + 1], samples[1, node + 1], samples[2, node + 1]
        weight, torque = _WEIGHTS[node] * h, piece.offset + piece.slope * w
        sums.velocity += weight * w
        sums.velocity_square += weight * w * w
        sums.acceleration_square += weight * a * a
        sums.jerk_square += weight * j * j
        sums.torque += weight * torque
        sums.torque_square += weight * torque * torque


@borrowing
def _add_slip(piece, forcing, entry, t0, tau, arrays, sums):
    """Add a slip within one piece of the brake torque."""
    begin = 0.0
    while begin < tau:
        fastest, end = _fastest(piece, forcing, begin, tau)
        cells = 1 + int(fastest * (end - begin))
        width = (end - begin) / cells
        for i in range(cells):
            cell = _Cell(piece, forcing, entry, t0, begin + i * width, width, begin > 0.0)
            _add_cell(cell, arrays, sums)
        begin = end


@borrowing
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


@borrowing
def add_vibration(problem, log, rows, arrays, sums):
    """Add the first ``rows`` rows of a log to a record of ``VIBRATION``; the last is its end.

    arrays : a ``Scratch``
    """
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
            _add_slip(piece, forcing, entry, row.time, tau, arrays, sums)


@borrowing
def _deviation(square, total, time):
    """Root mean square of the deviation from the mean."""
    mean = total / time
    return math.sqrt(max(square / time - mean * mean, 0.0))


@borrowing
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
