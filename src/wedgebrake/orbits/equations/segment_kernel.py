"""A periodic orbit as a boundary-value problem of segments (docs/numerics.md, "Periodic orbits").

An orbit of n periods of the torque is a cyclic sequence of segments joined at nodes. Its codes
count the modes of the brake from rest: 0 rest, 1, 2, ... slip forwards in the first, second, ...
piece of the brake's law, -1, -2, ... backwards. Two neighbours define the event at their node:

0 after k         the motion comes to rest        k after 0    rest ends
-1 after 1, or 1 after -1   reversal              k+1 after k  a breakpoint is crossed
k after k         none; a mark at phase 0, for an orbit without events

The velocity at an event is known. The unknowns are two numbers for each node: phase omega t
[rad] (at a mark the velocity) and angle [rad]. Each segment gives two equations, by the closed
form of its end: in angle and in velocity (at rest, in torque). For a given sequence these are
smooth functions also if the solution is not an orbit: beyond a graze, or with a rest of negative
length. ``segment_orbit`` computes the distance to these cases.
"""

import math
from typing import NamedTuple

from wedgebrake.dynamics.enums import EventKind, FlowForm
from wedgebrake.dynamics.harmonic import differentiated, phase_of, rate, value
from wedgebrake.dynamics.jit import compiled
from wedgebrake.dynamics.linear_flow import (
    acceleration,
    enter,
    forcing_of,
    impulse,
    jerk,
    state_at,
)
from wedgebrake.dynamics.problem import slip_acceleration, torque_at_rest
from wedgebrake.dynamics.segment_log import REST

# Below this many radians of the fastest rate, differences of closed forms come from a series.
_SHORT = 0.1
# Below this many radians, derivatives are those at length zero.
_VANISHING = 1e-6
# A jump of the torque at breakaway below this share of it is rounding.
_NO_JUMP = 1e-12
# Radians of the fastest rate in which extremes are bracketed.
CELL = 0.5


class SegmentEnd(NamedTuple):
    """An end of a segment: phase of the torque [rad], angle [rad] and velocity [rad/s]."""

    phase: float
    angle: float
    velocity: float


class Segment(NamedTuple):
    """A segment between its neighbours; at the end of the orbit the phase continues to increase."""

    before: int
    code: int
    after: int
    begin: SegmentEnd
    end: SegmentEnd


class Equation(NamedTuple):
    """A function of the end of a slip, and its derivatives.

    With respect to phase, angle and velocity at its beginning, and phase at its end.
    """

    value: float
    by_phase: float
    by_angle: float
    by_velocity: float
    by_end_phase: float


class Kinematics(NamedTuple):
    """Angle and its first three derivatives."""

    angle: float
    velocity: float
    acceleration: float
    jerk: float


@compiled
def kinematics_of(piece, forcing, theta, w, phase):
    """``Kinematics`` of a slip in a state at a phase of the torque."""
    a = acceleration(piece, forcing, theta, w, phase)
    return Kinematics(theta, w, a, jerk(piece, forcing, w, a, phase))


@compiled
def kinematics_at(piece, forcing, entry, begin, tau):
    """``Kinematics`` of a slip a time ``tau`` after its entry, at phase ``begin`` [rad]."""
    phase = phase_of(begin + forcing.angular_frequency * tau)
    theta, w = state_at(piece, forcing, entry, tau, phase)
    return kinematics_of(piece, forcing, theta, w, phase)


@compiled
def event_kind(before, code):
    """The event between two segments."""
    if before == code:
        return EventKind.RETURN
    if code == 0:
        return EventKind.STICK
    if before == 0:
        return EventKind.SLIP
    return EventKind.REVERSAL if before * code < 0 else EventKind.BREAKPOINT


@compiled
def mode_of(brake, code):
    """Mode of a segment in the segment log: a piece of the brake's law, or rest."""
    if code == 0:
        return REST
    return brake.first_forward + (code - 1 if code > 0 else code)


@compiled
def has_mode(brake, code):
    """Return True if the brake has a mode of this code."""
    return REST <= mode_of(brake, code) < brake.pieces.size


@compiled
def node_velocity(brake, before, code):
    """Velocity [rad/s] at the node between two segments; nan where there is no such piece."""
    low = min(before, code)
    # The pieces 1 and -1 both end at rest; k and k+1 share the upper end of k.
    edge = brake.first_forward - 1
    if low > 0:
        edge += low
    elif max(before, code) < 0:
        edge += low + 1
    return brake.breakpoints[edge] if 0 <= edge < brake.breakpoints.size else math.nan


@compiled
def segment_of(brake, codes, order, sign, unknowns, i):
    """Segment i of an orbit.

    sign : 1; or -1, where the segments are half an orbit, of which the other half is the mirror
           image: theta(t + order T/2) = -theta(t)
    """
    n = codes.size
    j = (i + 1) % n
    code = codes[i]
    before = codes[i - 1] if i > 0 else sign * codes[n - 1]
    after = codes[j] if j > 0 else sign * codes[0]
    turn, mirror = 0.0, 1.0
    if j == 0:
        turn, mirror = math.pi * order * (2.0 if sign > 0 else 1.0), float(sign)
    # At a mark the unknown is the velocity, at an event the phase.
    u0, u1 = unknowns[2 * i], unknowns[2 * j]
    phase0, velocity0 = u0, node_velocity(brake, before, code)
    phase1, velocity1 = turn + u1, node_velocity(brake, code, after)
    if before == code:
        phase0, velocity0 = 0.0, u0
    if code == after:
        phase1, velocity1 = turn, u1
    begin = SegmentEnd(phase0, unknowns[2 * i + 1], velocity0)
    return Segment(
        before, code, after, begin, SegmentEnd(phase1, mirror * unknowns[2 * j + 1], velocity1)
    )


@compiled
def release_torque(brake, code):
    """Torque [N m] at which rest ends towards a slip."""
    return brake.upper if code > 0 else brake.lower


@compiled
def breakaway(problem, code):
    """Acceleration [rad/s^2] with which a slip begins after rest; 0: the torque does not jump."""
    brake, inertia = problem.brake, problem.driveline.inertia
    limit = release_torque(brake, code)
    a = slip_acceleration(problem.driveline, brake.pieces[mode_of(brake, code)], limit)
    return a if abs(a) * inertia > _NO_JUMP * abs(limit) else 0.0


@compiled
def divisor_power(problem, segment):
    """Power of its duration by which the equation for the velocity of a slip is divided.

    1 if the slip ends on the boundary on which it began; 2 if, besides, it follows a rest without a
    jump of the torque; otherwise 0. A length of zero is then no solution.
    """
    marked = segment.before == segment.code or segment.code == segment.after
    if marked or segment.end.velocity != segment.begin.velocity:
        return 0
    return 2 if segment.before == 0 and breakaway(problem, segment.code) == 0.0 else 1


@compiled
def _velocity_series(piece, forcing, w, a, phase, tau, power):
    """(w(tau) - w(0)) / tau^power and its rate, by a Taylor series that begins with that power.

    a : acceleration at entry, 0 for the power 2
    """
    derivative, following = a, jerk(piece, forcing, w, a, phase)
    drive, at = differentiated(forcing, phase)
    total, slope, factor, last = 0.0, 0.0, 1.0, 0.0
    for n in range(1, 13):
        if n >= power:
            term = derivative / math.gamma(n + 1.0)
            total += term * factor
            slope += (n - power) * term * last
            last, factor = factor, factor * tau
        drive, at = differentiated(drive, at)
        before, derivative = derivative, following
        following = value(drive, at) - piece.damping * derivative - piece.stiffness * before
    return total, slope


@compiled
def _slip_equations(problem, segment):
    """Equations for angle and velocity at the end of a slip, as two ``Equation``.

    That for the velocity is divided by a power of the duration, see ``divisor_power``.
    """
    forcing = forcing_of(problem.driveline, problem.torque)
    piece = problem.brake.pieces[mode_of(problem.brake, segment.code)]
    omega, g2, w2 = forcing.angular_frequency, piece.damping, piece.stiffness
    begin, end = segment.begin, segment.end
    w0 = begin.velocity
    tau = (end.phase - begin.phase) / omega
    first, last = phase_of(begin.phase), phase_of(end.phase)
    entry = enter(piece, forcing, begin.angle, w0, first)
    theta, w = state_at(piece, forcing, entry, tau, last)
    _, _, a0, j0 = kinematics_of(piece, forcing, begin.angle, w0, first)
    a1 = acceleration(piece, forcing, theta, w, last)
    h, h_rate = impulse(piece, tau)
    top = h_rate + g2 * h
    angle = Equation(theta, -(top * w0 + h * a0) / omega, top, h, w / omega)
    by_phase, by_angle, by_end = (w2 * h * w0 - h_rate * a0) / omega, -w2 * h, a1 / omega
    power = divisor_power(problem, segment)
    if power == 0:
        return angle, Equation(w - end.velocity, by_phase, by_angle, h_rate, by_end)
    turned = max(3.0 / piece.cell, abs(g2)) * abs(tau)
    if power == 2:
        # Without the part that the initial acceleration makes, which the end of rest makes zero.
        if turned <= _SHORT:
            ratio, slope = _velocity_series(piece, forcing, w0, 0.0, first, tau, 2)
            # The quotient below would cancel.
            drive, at = differentiated(forcing, first)
            by_phase = (_velocity_series(piece, drive, 0.0, 0.0, at, tau, 2)[0] - slope) / omega
        else:
            ratio = (w - w0 - a0 * h) / (tau * tau)
            slope = (a1 - a0 * h_rate) / (tau * tau) - 2.0 * ratio / tau
            by_phase = (2.0 * ratio / tau - h * (j0 + g2 * a0) / (tau * tau)) / omega
        return angle, Equation(ratio, by_phase, 0.0, h_rate, slope / omega)
    if turned <= _SHORT:
        ratio, slope = _velocity_series(piece, forcing, w0, a0, first, tau, 1)
    else:
        ratio = (w - w0) / tau
        slope = (a1 - ratio) / tau
    if turned <= _VANISHING:
        by_phase, by_angle = (rate(forcing, first) - 0.5 * j0) / omega, -w2
    else:
        by_phase, by_angle = (by_phase + ratio / omega) / tau, by_angle / tau
    return angle, Equation(ratio, by_phase, by_angle, h_rate, slope / omega)


@compiled
def _add_derivative(matrix, row, i, segment, equation):
    """Add the derivatives of an equation of segment i to a row of the matrix."""
    j = (i + 1) % (matrix.shape[0] // 2)
    marked = segment.before == segment.code
    matrix[row, 2 * i] += equation.by_velocity if marked else equation.by_phase
    matrix[row, 2 * i + 1] += equation.by_angle
    if segment.code != segment.after:
        matrix[row, 2 * j] += equation.by_end_phase


@compiled
def _rest_equations(problem, segment):
    """Angle and torque at the end of a rest, as two ``Equation``."""
    driveline, torque = problem.driveline, problem.torque
    omega, w_rest = torque.angular_frequency, driveline.rest_velocity
    begin, end = segment.begin, segment.end
    theta = begin.angle + w_rest * (end.phase - begin.phase) / omega
    phase = phase_of(end.phase)
    held = torque_at_rest(driveline, torque, phase, end.angle)
    return (
        Equation(theta, -w_rest / omega, 1.0, 0.0, w_rest / omega),
        Equation(held, 0.0, 0.0, 0.0, rate(torque, phase) / omega),
    )


@compiled
def residual(problem, codes, order, sign, unknowns, values, matrix):
    """The equations of an orbit, and their derivative by the unknowns.

    codes    : (n,) segments;  order : periods of the torque in the orbit
    sign     : as of ``segment_of``
    unknowns : (2 n,)
    values   : (2 n,) receives the residuals;  matrix : (2 n, 2 n) their derivative

    Returns False where the brake has no such segments.
    """
    brake, stiffness = problem.brake, problem.driveline.stiffness
    matrix[:] = 0.0
    for i in range(codes.size):
        segment = segment_of(brake, codes, order, sign, unknowns, i)
        if not math.isfinite(segment.begin.velocity) or not has_mode(brake, segment.code):
            return False
        j = (i + 1) % codes.size
        mirror = float(sign) if j == 0 else 1.0
        first, second = 2 * i, 2 * i + 1
        if segment.code == 0:
            limit = release_torque(brake, segment.after)
            if math.isinf(limit):
                return False
            angle, last = _rest_equations(problem, segment)
            values[second] = last.value - limit
            matrix[second, 2 * j + 1] -= mirror * stiffness
        else:
            if brake.pieces[mode_of(brake, segment.code)].form == FlowForm.BLOCKED:
                return False
            angle, last = _slip_equations(problem, segment)
            values[second] = last.value
            if segment.code == segment.after:
                matrix[second, 2 * j] -= 1.0
        values[first] = angle.value - segment.end.angle
        matrix[first, 2 * j + 1] -= mirror
        _add_derivative(matrix, first, i, segment, angle)
        _add_derivative(matrix, second, i, segment, last)
    return True


@compiled
def torque_scale(problem):
    """Torque scale of the motion [N m]: the largest of the driving and the holding torque."""
    torque = problem.torque.amplitude
    for limit in (problem.brake.lower, problem.brake.upper):
        if not math.isinf(limit):
            torque = max(torque, abs(limit))
    return max(torque, 1e-300)


@compiled
def cell_count(piece, forcing, tau, width):
    """Number of cells of about ``width`` radians of the fastest rate in a time ``tau``."""
    omega = max(forcing.angular_frequency, math.sqrt(piece.stiffness), abs(piece.damping))
    return 1 + int(omega * tau / width)
