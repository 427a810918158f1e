"""Derivatives of the equations of an orbit of segments with respect to the numbers of the problem.

A slip obeys a linear equation of motion. If its numbers change, the deviation obeys the same
equation, driven by these changes. By variation of constants, the deviation at the end is an
integral of the changes times the free motion of the piece. Gauss-Legendre quadrature computes it to
rounding, without cancellation even for slips whose length is zero.
"""

import numpy as np

from wedgebrake.dynamics.harmonic import phase_of, rate, value
from wedgebrake.dynamics.jit import compiled
from wedgebrake.dynamics.linear_flow import acceleration, enter, forcing_of, impulse, state_at
from wedgebrake.orbits.equations.segment_kernel import (
    cell_count,
    divisor_power,
    mode_of,
    node_velocity,
    release_torque,
    segment_of,
)

# Length of a cell of the quadrature in radians of the fastest mode: its error is then rounding.
_WIDTH = 1.0
_PLACES, _WEIGHTS = (np.polynomial.legendre.leggauss(10) + np.array([[1.0], [0.0]])) * 0.5


@compiled
def _slip_changes(problem, changes, segment):
    """Changes of the two equations of a slip at its end, with the unknowns fixed.

    changes : derivatives of the numbers of the problem
    """
    forcing = forcing_of(problem.driveline, problem.torque)
    mode = mode_of(problem.brake, segment.code)
    piece, by = problem.brake.pieces[mode], changes.brake.pieces[mode]
    f, omega = forcing.amplitude, forcing.angular_frequency
    f_change = changes.torque.amplitude - f * changes.driveline.inertia
    f_change, omega_change = f_change / problem.driveline.inertia, changes.torque.angular_frequency
    g2, w2, power = piece.damping, piece.stiffness, divisor_power(problem, segment)
    begin, end, w0 = segment.begin, segment.end, segment.begin.velocity
    first = last = 0.0
    if segment.before != segment.code:
        first = node_velocity(changes.brake, segment.before, segment.code)
    if segment.code != segment.after:
        last = node_velocity(changes.brake, segment.code, segment.after)
    phase = phase_of(begin.phase)
    entry = enter(piece, forcing, begin.angle, w0, phase)
    a0 = acceleration(piece, forcing, begin.angle, w0, phase)
    # Integrals over the slip, divided by its duration tau: the changes of angle and velocity. Of an
    # equation that is divided by tau^power: its value (ratio), the change of this for a given tau,
    # and the rate of the numerator divided by tau^(power-1).
    tau, angle, speed, ratio, numerator_rate, ratio_change = (
        (end.phase - begin.phase) / omega,
        0.0,
        0.0,
        0.0,
        0.0,
        0.0,
    )
    count = cell_count(piece, forcing, abs(tau), _WIDTH)
    for node in range(count * _PLACES.size):
        cell, k = divmod(node, _PLACES.size)
        share, weight = (cell + _PLACES[k]) / count, _WEIGHTS[k] / count
        s = share * tau
        phase = phase_of(begin.phase + omega * s)
        theta, w = state_at(piece, forcing, entry, s, phase)
        a = acceleration(piece, forcing, theta, w, phase)
        h, h_rate = impulse(piece, (1.0 - share) * tau)
        push = f_change * phase.sine + f * s * omega_change * phase.cosine + by.constant
        push -= by.damping * w + by.stiffness * theta + g2 * first
        angle += weight * (h * push + (h_rate + g2 * h) * first)
        speed += weight * (h_rate * push - w2 * h * first)
        if power == 2:
            # w - w0 without the part a0 h0 of the initial acceleration
            h0, h0_rate = impulse(piece, s)
            short = h / tau if tau != 0.0 else 1.0 - share
            push = rate(forcing, phase) - w2 * w0
            numerator_rate += weight * h_rate * push
            ratio += weight * short * push
            push = (f_change * omega + f * omega_change) * phase.cosine - w2 * first
            push -= f * omega * s * omega_change * phase.sine + by.stiffness * w0
            push -= by.damping * (a - a0 * h0_rate) + by.stiffness * (w - w0 - a0 * h0)
            ratio_change += weight * short * push
        else:
            ratio += weight * a
    phase = phase_of(end.phase)
    theta, w = state_at(piece, forcing, entry, tau, phase)
    shorter = omega_change / omega  # for fixed phases, tau decreases by this share
    angle = tau * (angle - w * shorter)
    if power == 2:
        return angle, ratio_change - shorter * (numerator_rate - 2.0 * ratio)
    a = acceleration(piece, forcing, theta, w, phase)
    if power == 1:
        return angle, speed - shorter * (a - ratio)
    return angle, first - last + tau * (speed - a * shorter)


@compiled
def _rest_changes(problem, changes, segment):
    """Changes of the two equations of a rest at its end, with the unknowns fixed."""
    driveline, by, omega = problem.driveline, changes.driveline, problem.torque.angular_frequency
    begin, end, w_rest = segment.begin, segment.end, driveline.rest_velocity
    later = by.rest_velocity - w_rest * changes.torque.angular_frequency / omega
    held = value(changes.torque, phase_of(end.phase)) - by.damping * w_rest
    held -= driveline.damping * by.rest_velocity + by.stiffness * end.angle
    angle = later * (end.phase - begin.phase) / omega
    return angle, held - release_torque(changes.brake, segment.after)


@compiled
def changes_of(problem, changes, codes, order, sign, unknowns, found):
    """Changes of the equations of an orbit, with the unknowns fixed; as ``residual``.

    changes : derivatives of the numbers of the problem
    found   : (2 n,) receives the changes
    """
    for i in range(codes.size):
        segment = segment_of(problem.brake, codes, order, sign, unknowns, i)
        if segment.code == 0:
            found[2 * i], found[2 * i + 1] = _rest_changes(problem, changes, segment)
        else:
            found[2 * i], found[2 * i + 1] = _slip_changes(problem, changes, segment)
