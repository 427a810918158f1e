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

from numba import types

from wedgebrake.dynamics.brake_torque import LAW, SHAPE, brake_torque
from wedgebrake.dynamics.enums import (
    BAND_ENTERED,
    BAND_LEFT,
    COMPLETED,
    DIVERGED,
    LOG_FULL,
    NO_SLIDING,
    REVERSAL,
    STEP_LIMIT,
)
from wedgebrake.dynamics.jit import compiled, compiled_for

LOG_KIND, LOG_TIME, LOG_THETA, LOG_W, LOG_SIDE = range(5)
LOG_COLUMNS = 5

SEEN_THETA, SEEN_W, SEEN_TORQUE = range(3)
SEEN_COLUMNS = 3

# MATLAB's numjac, as Simulink's generated code has it: increments of a share ``factor`` of
# the state, at least of THRESHOLD; the share follows the size of the difference.
EPS = 2.220446049250313e-16
THRESHOLD = 1e-6
SMALL_DIFFERENCE, LARGE_DIFFERENCE = EPS**0.75, EPS**0.25
SMALLEST_FACTOR, FIRST_FACTOR, LARGEST_FACTOR = EPS**0.78, EPS**0.5, 0.1

# A wanted time this close to a grid point, as a share of the step, is that grid point.
SNAP = 1e-9


@compiled
def torque_at(plant, laws, numbers, hold, drive, theta, w):
    """Brake torque R F_mu [N m] under the torque ``drive`` [N m].

    With ``hold`` > 0 the law is banded, eqs. (16) to (20), hold being their epsilon: inside
    the band it is what equilibrium demands, between the torques of both directions (17)(18).
    Infinite where the brake locks itself while sliding.
    """
    _, damping, stiffness, _, _, w_rest = plant
    friction, friction_shape, brake, brake_shape = laws
    radius, initial, slope, release = numbers
    v = w - w_rest
    if abs(v) > hold or hold == 0.0:
        return brake_torque(
            friction, friction_shape, brake, brake_shape, radius, initial, slope, release, v
        )
    speed = abs(v)
    forwards = brake_torque(
        friction, friction_shape, brake, brake_shape, radius, initial, slope, release, speed
    )
    backwards = brake_torque(
        friction, friction_shape, brake, brake_shape, radius, initial, slope, release, -speed
    )
    demanded = drive - damping * w - stiffness * theta
    lower, upper = min(backwards, forwards), max(backwards, forwards)
    return min(max(demanded, lower), upper)


@compiled
def acceleration(plant, laws, numbers, hold, drive, theta, w):
    """Theta'' from the equation of motion (1)."""
    inertia, damping, stiffness, _, _, _ = plant
    brake = torque_at(plant, laws, numbers, hold, drive, theta, w)
    return (drive - damping * w - stiffness * theta - brake) / inertia


@compiled
def _increment(x, rate, factor):
    """Increment of a state variable for its difference quotient, towards where it moves."""
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
def _cubic(s, h, y0, d0, y1, d1):
    """Cubic Hermite interpolation at the share s of a step h; exact at s = 0 and 1."""
    if s == 0.0:
        return y0
    r = 1.0 - s
    rise = y1 - y0
    return r * y0 + s * y1 + s * r * (r * (h * d0 - rise) - s * (h * d1 - rise))


@compiled
def _write(log, rows, kind, time, theta, w, side):
    """One row of the log; the caller has made sure that there is room."""
    log[rows, LOG_KIND] = kind
    log[rows, LOG_TIME] = time
    log[rows, LOG_THETA] = theta
    log[rows, LOG_W] = w
    log[rows, LOG_SIDE] = side
    return rows + 1


def _run(
    plant,
    friction,
    friction_shape,
    brake,
    brake_shape,
    numbers,
    hold,
    band,
    w_diverged,
    h,
    substeps,
    turns,
    start,
    theta,
    w,
    end,
    max_steps,
    log,
    wanted,
    seen,
    work,
    stop,
):
    """Advance from (theta, w) by the time ``end`` or, to stay on the grid, up to h more.

    plant      (J, c, k, T_e, omega, w_rest)
    friction, friction_shape, brake, brake_shape: m and g, compiled, with their parameters
    numbers    (radius, initial force, slope, release)
    hold       half width of the band of the law [rad/s], 0 for a smooth law
    band       half width of the band that is logged [rad/s]
    w_diverged speed past which growth is called divergence [rad/s]
    substeps   (4,) n_j
    turns      (sum n_j, 2) (sin, cos) of the phase at which each substep sees the torque,
               from the phase of the grid point on
    start      time inside the period at the start [s]; end, wanted: elapsed times [s]
    log        (rows, LOG_COLUMNS), times elapsed
    wanted     (m,) ascending; seen (m, SEEN_COLUMNS) receives the state there
    work       (4, 2) scratch
    stop       (1,) ends the run as the limit of steps does when another thread sets it to True

    Returns (outcome, elapsed time, theta, w, steps, rows, seen count).
    """
    laws = (friction, friction_shape, brake, brake_shape)
    amplitude, omega, w_rest = plant[3], plant[4], plant[5]
    length = 2.0 * math.pi / omega
    steps, rows, count, periods = 0, 0, 0, 0
    factor_theta, factor_w = FIRST_FACTOR, FIRST_FACTOR
    now = 0.0
    sine, cosine = math.sin(omega * start), math.cos(omega * start)
    drive = amplitude * sine
    a = acceleration(plant, laws, numbers, hold, drive, theta, w)
    v = w - w_rest
    side = 1.0 if v > 0.0 else (-1.0 if v < 0.0 else 0.0)
    inside = abs(v) <= band
    if inside:
        rows = _write(log, rows, BAND_ENTERED, 0.0, theta, w, 0.0)
    while count < wanted.size and wanted[count] <= SNAP * h:
        seen[count, SEEN_THETA], seen[count, SEEN_W] = theta, w
        seen[count, SEEN_TORQUE] = torque_at(plant, laws, numbers, hold, drive, theta, w)
        count += 1

    while now < end - SNAP * h:
        if steps >= max_steps or stop[0]:
            return STEP_LIMIT, now, theta, w, steps, rows, count
        if rows + 2 > log.shape[0]:
            return LOG_FULL, now, theta, w, steps, rows, count
        if not math.isfinite(a):
            return NO_SLIDING, now, theta, w, steps, rows, count

        # Jacobian of theta'' = a(theta, w): the other row, of theta' = w, is known.
        change, factor_theta = _increment(theta, w, factor_theta)
        moved = acceleration(plant, laws, numbers, hold, drive, theta + change, w)
        by_theta = (moved - a) / change
        factor_theta = _next_factor(factor_theta, abs(moved - a), a, moved)
        change, factor_w = _increment(w, a, factor_w)
        moved = acceleration(plant, laws, numbers, hold, drive, theta, w + change)
        if not math.isfinite(moved):  # the wall of a self-locking brake: look the other way
            change = -change
            moved = acceleration(plant, laws, numbers, hold, drive, theta, w + change)
        by_w = (moved - a) / change
        if abs(moved - a) >= abs(change):
            factor_w = _next_factor(factor_w, abs(moved - a), a, moved)
        else:
            factor_w = _next_factor(factor_w, abs(change), w, w + change)

        index = 0
        for j in range(4):
            n = substeps[j]
            hj = h / n
            share = hj / (1.0 - hj * by_w - hj * hj * by_theta)
            y, u = theta, w
            for _ in range(n):
                push = amplitude * (sine * turns[index, 1] + cosine * turns[index, 0])
                rate = acceleration(plant, laws, numbers, hold, push, y, u)
                if math.isinf(rate) and abs(u) < w_diverged:
                    return NO_SLIDING, now, theta, w, steps, rows, count
                rise = share * (rate + hj * by_theta * u)
                y += hj * (u + rise)
                u += rise
                index += 1
            work[j, 0], work[j, 1] = y, u
            for k in range(j, 0, -1):
                weight = substeps[k - 1] / (substeps[j] - substeps[k - 1])
                work[k - 1, 0] = work[k, 0] + weight * (work[k, 0] - work[k - 1, 0])
                work[k - 1, 1] = work[k, 1] + weight * (work[k, 1] - work[k - 1, 1])
        theta1, w1 = work[0, 0], work[0, 1]
        if not (math.isfinite(theta1) and math.isfinite(w1)):
            return DIVERGED, now, theta, w, steps, rows, count

        steps += 1
        later = steps * h
        local = start + later - periods * length
        while local >= length:
            periods += 1
            local = start + later - periods * length
        sine, cosine = math.sin(omega * local), math.cos(omega * local)
        drive = amplitude * sine
        a1 = acceleration(plant, laws, numbers, hold, drive, theta1, w1)

        v1 = w1 - w_rest
        if v1 * side < 0.0:
            s = v / (v - v1) if v * v1 < 0.0 else 0.0
            angle = _cubic(s, h, theta, w, theta1, w1)
            rows = _write(log, rows, REVERSAL, now + s * h, angle, w_rest, -side)
        if v1 != 0.0:
            side = 1.0 if v1 > 0.0 else -1.0
        if (abs(v1) <= band) != inside:
            inside = not inside
            gap = band - abs(v)
            s = gap / (gap - (band - abs(v1)))
            angle, speed = _cubic(s, h, theta, w, theta1, w1), w + s * (w1 - w)
            outer = v if inside else v1
            kind = BAND_ENTERED if inside else BAND_LEFT
            direction = 1.0 if outer > 0.0 else -1.0
            rows = _write(log, rows, kind, now + s * h, angle, speed, direction)

        while count < wanted.size and wanted[count] <= later + SNAP * h:
            s = (wanted[count] - now) / h
            if s > 1.0 - SNAP:
                angle, speed, push = theta1, w1, drive
            else:
                angle = _cubic(s, h, theta, w, theta1, w1)
                # Next to a locked brake there is no acceleration to interpolate with.
                rate = a1 if math.isfinite(a1) else a
                speed = _cubic(s, h, w, a, w1, rate)
                push = amplitude * math.sin(omega * (local - (1.0 - s) * h))
            seen[count, SEEN_THETA], seen[count, SEEN_W] = angle, speed
            seen[count, SEEN_TORQUE] = torque_at(plant, laws, numbers, hold, push, angle, speed)
            count += 1

        now, theta, w, v, a = later, theta1, w1, v1, a1
        if abs(v) > w_diverged:
            return DIVERGED, now, theta, w, steps, rows, count
    return COMPLETED, now, theta, w, steps, rows, count


def _signature():
    """The one signature of ``run``: laws as function pointers, so that its cache serves all."""
    real, whole = types.float64, types.int64
    vector, matrix = types.Array(real, 1, "C"), types.Array(real, 2, "C")
    numbers = types.Tuple((real, real, real, types.boolean))
    return (
        types.UniTuple(real, 6), LAW, SHAPE, LAW, SHAPE, numbers, real, real, real, real,
        types.Array(whole, 1, "C"), matrix, real, real, real, real, whole, matrix, vector,
        matrix, matrix, types.Array(types.boolean, 1, "C"),
    )  # fmt: skip


run = compiled_for(_signature())(_run)
