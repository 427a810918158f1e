"""The fixed-step scheme of the paper: extrapolated linearly implicit Euler, order 4.

Hairer and Wanner, Solving Ordinary Differential Equations II, section IV.9: one step h is
repeated with n_1, n_2, n_3, n_4 substeps (9.25)

    (I - h_j J) (y_{m+1} - y_m) = h_j f(t, y_m),    h_j = h/n_j

with the Jacobian J of the start of the step, and the four results are extrapolated to
h_j = 0 by Aitken-Neville (9.26). One solve a substep is one Newton iteration. Order 4 holds
for any J, so that a difference quotient is good enough.

The kernel takes the substeps and the phases at which they see the torque from its caller,
and the brake as compiled laws. It knows neither events nor kinks: it steps over them.
"""

import math
from typing import Any, NamedTuple

import numpy as np
from numba import types

from wedgebrake.dynamics.actuator import Actuator
from wedgebrake.dynamics.brake_torque import ACTUATOR, LAW, SHAPE, SmoothBrake, brake_torque
from wedgebrake.dynamics.enums import EventKind, Outcome
from wedgebrake.dynamics.harmonic import Sine, phase_at, value
from wedgebrake.dynamics.jit import array_of, compiled, compiled_for
from wedgebrake.dynamics.linear_flow import LinearDriveline
from wedgebrake.dynamics.records import record
from wedgebrake.dynamics.section import return_time
from wedgebrake.dynamics.segment_log import REST, SEGMENT, write

# State and brake torque at a wanted time.
SAMPLE = record("angle velocity brake_torque")
# Phase of the torque that a substep sees, from that of the grid point on.
TURN = record("sine cosine")

# MATLAB's numjac, as Simulink's generated code has it: increments of a share ``factor`` of
# the state, at least of THRESHOLD; the share follows the size of the difference.
EPS = 2.0**-52
THRESHOLD = 1e-6
SMALL_DIFFERENCE, LARGE_DIFFERENCE = EPS**0.75, EPS**0.25
SMALLEST_FACTOR, FIRST_FACTOR, LARGEST_FACTOR = EPS**0.78, EPS**0.5, 0.1

# A wanted time this close to a grid point, as a share of the step, is that grid point.
SNAP = 1e-9


class Scheme(NamedTuple):
    """A machine and the numbers of the scheme.

    hold      : half width of the band of the law [rad/s], 0 for a smooth law
    band      : half width of the band that is logged [rad/s]
    divergence_velocity : speed past which growth is called divergence [rad/s]
    step      : h [s]
    substeps  : (4,) n_j
    turns     : (sum n_j,) of dtype ``TURN``
    max_steps : steps after which to give up
    """

    driveline: LinearDriveline
    torque: Sine
    radius: float
    actuator: Actuator
    hold: float
    band: float
    divergence_velocity: float
    step: float
    substeps: Any
    turns: Any
    max_steps: int


class FixedStepEnd(NamedTuple):
    """End of a run: why, elapsed time [s], state, steps, and rows and samples written."""

    outcome: int
    time: float
    angle: float
    velocity: float
    steps: int
    rows: int
    samples: int


class GridState(NamedTuple):
    """A state on the grid: angle, velocity, acceleration, and the driving torque there."""

    angle: float
    velocity: float
    acceleration: float
    drive: float


class _Jacobian(NamedTuple):
    """Derivatives of the acceleration, and the shares of their difference quotients."""

    by_angle: float
    by_velocity: float
    angle_factor: float
    velocity_factor: float


class _Crossing(NamedTuple):
    """Direction of sliding, and whether the velocity is inside the band that is logged."""

    side: float
    inside: bool


@compiled
def _torque(scheme, brake, drive, theta, w):
    """Brake torque R F_mu [N m] under the driving torque ``drive`` [N m].

    With ``hold`` > 0 the law is banded, eqs. (16) to (20), hold being their epsilon: inside
    the band it is what equilibrium demands, between the torques of both directions (17)(18).
    Infinite where the brake locks itself while sliding.
    """
    driveline, hold = scheme.driveline, scheme.hold
    v = w - driveline.rest_velocity
    if abs(v) > hold or hold == 0.0:
        return brake_torque(brake, v)
    forwards, backwards = brake_torque(brake, abs(v)), brake_torque(brake, -abs(v))
    demanded = drive - driveline.damping * w - driveline.stiffness * theta
    lower, upper = min(backwards, forwards), max(backwards, forwards)
    return min(max(demanded, lower), upper)


@compiled
def _acceleration(scheme, brake, drive, theta, w):
    """Second derivative of the angle, from the equation of motion (1)."""
    line = scheme.driveline
    torque = _torque(scheme, brake, drive, theta, w)
    return (drive - line.damping * w - line.stiffness * theta - torque) / line.inertia


@compiled
def _increment(x, rate, factor):
    """(increment of a state variable for its difference quotient, share), towards its motion."""
    share = max(abs(x), THRESHOLD)
    change = x + factor * share - x
    while change == 0.0 and factor < LARGEST_FACTOR:
        factor = min(100.0 * factor, LARGEST_FACTOR)
        change = x + factor * share - x
    if change == 0.0:
        change = THRESHOLD
    return math.copysign(change, rate if rate != 0.0 else 1.0), factor


@compiled
def _next_factor(factor, difference, before, after):
    """The share for the next step: larger where the difference drowns in rounding."""
    if (before == 0.0 or after == 0.0) and difference != 0.0:
        return factor
    scale = max(abs(before), abs(after))
    if difference <= SMALL_DIFFERENCE * scale:
        return min(10.0 * factor, LARGEST_FACTOR)
    if difference > LARGE_DIFFERENCE * scale:
        return max(0.1 * factor, SMALLEST_FACTOR)
    return factor


@compiled
def _differentiate(scheme, brake, point, last):
    """Jacobian of the acceleration; the other row, of angle' = velocity, is known."""
    theta, w, a, drive = point
    change, angle_factor = _increment(theta, w, last.angle_factor)
    moved = _acceleration(scheme, brake, drive, theta + change, w)
    by_angle = (moved - a) / change
    angle_factor = _next_factor(angle_factor, abs(moved - a), a, moved)
    change, factor = _increment(w, a, last.velocity_factor)
    moved = _acceleration(scheme, brake, drive, theta, w + change)
    if not math.isfinite(moved):  # the wall of a self-locking brake: take the other side
        change = -change
        moved = _acceleration(scheme, brake, drive, theta, w + change)
    by_velocity = (moved - a) / change
    if abs(moved - a) >= abs(change):
        factor = _next_factor(factor, abs(moved - a), a, moved)
    else:
        factor = _next_factor(factor, abs(change), w, w + change)
    return _Jacobian(by_angle, by_velocity, angle_factor, factor)


@compiled
def _step(scheme, brake, point, jacobian, phase, work):
    """(outcome, angle, velocity) after a step, extrapolated from four numbers of substeps.

    phase : of the torque at the grid point;  work : (4, 2) scratch
    """
    theta, w, _, _ = point
    substeps, amplitude = scheme.substeps, scheme.torque.amplitude
    index = 0
    for j, n in enumerate(substeps):
        h = scheme.step / n
        share = h / (1.0 - h * jacobian.by_velocity - h * h * jacobian.by_angle)
        y, u = theta, w
        for _ in range(n):
            turn = scheme.turns[index]
            drive = amplitude * (phase.sine * turn.cosine + phase.cosine * turn.sine)
            rate = _acceleration(scheme, brake, drive, y, u)
            if math.isinf(rate) and abs(u) < scheme.divergence_velocity:
                return Outcome.NO_FORWARD_SOLUTION, theta, w
            rise = share * (rate + h * jacobian.by_angle * u)
            y += h * (u + rise)
            u += rise
            index += 1
        work[j, 0], work[j, 1] = y, u
        for k in range(j, 0, -1):
            weight = substeps[k - 1] / (substeps[j] - substeps[k - 1])
            work[k - 1, 0] = work[k, 0] + weight * (work[k, 0] - work[k - 1, 0])
            work[k - 1, 1] = work[k, 1] + weight * (work[k, 1] - work[k - 1, 1])
    if not (math.isfinite(work[0, 0]) and math.isfinite(work[0, 1])):
        return Outcome.DIVERGED, theta, w
    return Outcome.COMPLETED, work[0, 0], work[0, 1]


@compiled
def _cubic(s, h, y0, d0, y1, d1):
    """Cubic Hermite interpolation at the share s of a step h; exact at s = 0 and 1."""
    if s == 0.0:
        return y0
    r = 1.0 - s
    rise = y1 - y0
    return r * y0 + s * y1 + s * r * (r * (h * d0 - rise) - s * (h * d1 - rise))


@compiled
def _angle_in(s, h, before, after):
    return _cubic(s, h, before.angle, before.velocity, after.angle, after.velocity)


@compiled
def _log_crossings(scheme, log, rows, now, crossing, before, after):
    """Log a reversal and the band entered or left in a step: (rows, crossing).

    Both are interpolated linearly in the sliding velocity.
    """
    w_rest, band, h = scheme.driveline.rest_velocity, scheme.band, scheme.step
    side, inside = crossing
    v, v1 = before.velocity - w_rest, after.velocity - w_rest
    if v1 * side < 0.0:
        s = v / (v - v1) if v * v1 < 0.0 else 0.0
        angle = _angle_in(s, h, before, after)
        kind = EventKind.REVERSAL
        rows = write(log, rows, kind, 0, now + s * h, angle, w_rest, REST, -side)
    if v1 != 0.0:
        side = 1.0 if v1 > 0.0 else -1.0
    if (abs(v1) <= band) != inside:
        inside = not inside
        gap = band - abs(v)
        s = gap / (gap - (band - abs(v1)))
        angle = _angle_in(s, h, before, after)
        speed = before.velocity + s * (after.velocity - before.velocity)
        kind = EventKind.BAND_ENTERED if inside else EventKind.BAND_LEFT
        outer = v if inside else v1
        direction = 1.0 if outer > 0.0 else -1.0
        rows = write(log, rows, kind, 0, now + s * h, angle, speed, REST, direction)
    return rows, _Crossing(side, inside)


@compiled
def _sample(scheme, brake, s, local, before, after, sample):
    """Write state and torque at the share s of a step that ends at a time in the period."""
    h, angle, speed, drive = scheme.step, after.angle, after.velocity, after.drive
    if s <= 1.0 - SNAP:
        angle = _angle_in(s, h, before, after)
        # Next to a locked brake there is no acceleration to interpolate with.
        locked = not math.isfinite(after.acceleration)
        rate = before.acceleration if locked else after.acceleration
        speed = _cubic(s, h, before.velocity, before.acceleration, after.velocity, rate)
        drive = value(scheme.torque, phase_at(scheme.torque, local - (1.0 - s) * h))
    sample.angle, sample.velocity = angle, speed
    sample.brake_torque = _torque(scheme, brake, drive, angle, speed)


def _run(scheme, laws, start, theta, w, end, log, wanted, samples, stop):
    """Advance from (theta, w) by the time ``end`` or, to stay on the grid, up to h more.

    laws    : (m, its shape, g, its shape), compiled
    start   : time inside the period at the start [s]; end, wanted: elapsed times [s]
    log     : receives reversals and the band; times elapsed, without a mode
    wanted  : (m,) ascending; samples (m,) of dtype ``SAMPLE`` receives the states there
    stop    : (1,) ends the run as the limit of steps does when another thread sets it to True

    Returns ``FixedStepEnd``.
    """
    friction, friction_shape, amplification, amplification_shape = laws
    brake = SmoothBrake(
        friction, friction_shape, amplification, amplification_shape, scheme.radius, scheme.actuator
    )
    torque, w_rest, h = scheme.torque, scheme.driveline.rest_velocity, scheme.step
    length = return_time(torque)
    steps, rows, count, periods = 0, 0, 0, 0
    now, outcome = 0.0, Outcome.COMPLETED
    phase = phase_at(torque, start)
    drive = value(torque, phase)
    point = GridState(theta, w, _acceleration(scheme, brake, drive, theta, w), drive)
    jacobian = _Jacobian(0.0, 0.0, FIRST_FACTOR, FIRST_FACTOR)
    work = np.empty((4, 2))
    v = w - w_rest
    side = 1.0 if v > 0.0 else (-1.0 if v < 0.0 else 0.0)
    crossing = _Crossing(side, abs(v) <= scheme.band)
    if crossing.inside:
        rows = write(log, rows, EventKind.BAND_ENTERED, 0, 0.0, theta, w, REST, 0.0)
    while count < wanted.size and wanted[count] <= SNAP * h:
        _sample(scheme, brake, 1.0, start, point, point, samples[count])
        count += 1

    while now < end - SNAP * h:
        if steps >= scheme.max_steps or stop[0]:
            outcome = Outcome.STEP_LIMIT
        elif rows + 2 > log.size:
            outcome = Outcome.LOG_FULL
        elif not math.isfinite(point.acceleration):
            outcome = Outcome.NO_FORWARD_SOLUTION
        if outcome != Outcome.COMPLETED:
            break
        jacobian = _differentiate(scheme, brake, point, jacobian)
        outcome, theta, w = _step(scheme, brake, point, jacobian, phase, work)
        if outcome != Outcome.COMPLETED:
            break
        steps += 1
        later = steps * h
        local = start + later - periods * length
        while local >= length:
            periods += 1
            local = start + later - periods * length
        phase = phase_at(torque, local)
        drive = value(torque, phase)
        after = GridState(theta, w, _acceleration(scheme, brake, drive, theta, w), drive)
        rows, crossing = _log_crossings(scheme, log, rows, now, crossing, point, after)
        while count < wanted.size and wanted[count] <= later + SNAP * h:
            share = (wanted[count] - now) / h
            _sample(scheme, brake, share, local, point, after, samples[count])
            count += 1
        now, point = later, after
        if abs(w - w_rest) > scheme.divergence_velocity:
            outcome = Outcome.DIVERGED
            break
    return FixedStepEnd(outcome, now, point.angle, point.velocity, steps, rows, count)


_REAL, _WHOLE = types.float64, types.int64
_SCHEME = types.NamedTuple(
    (
        types.NamedUniTuple(_REAL, 4, LinearDriveline), types.NamedUniTuple(_REAL, 2, Sine), _REAL,
        ACTUATOR, _REAL, _REAL, _REAL, _REAL, _WHOLE[::1], array_of(TURN), _WHOLE,
    ),
    Scheme,
)  # fmt: skip
# One signature, with laws as function pointers, so that one cache serves all of them.
run = compiled_for(
    (
        _SCHEME, types.Tuple((LAW, SHAPE, LAW, SHAPE)), _REAL, _REAL, _REAL, _REAL,
        array_of(SEGMENT), _REAL[::1], array_of(SAMPLE), types.boolean[::1],
    )
)(_run)  # fmt: skip
