"""A smooth friction law: numeric near zero speed, closed form where the torque is linear.

A numeric step is a Taylor series where the law is known to be mu tanh and the brake a
fraction (``series``), and a Runge-Kutta step for any other law (``pair``).

The velocity axis is cut at ``edges``. Two kinds of cut:

kinks     zero sliding speed and the release of the actuation, where the law bends: a step
          ends exactly there, found on DOP853's continuous extension with the rigour of the
          exact solver, or on the series (no crossing is missed);
borders   of the steep layer and of the speeds from which the law is constant to well below
          the tolerance: there only the way of solving changes.

Where the torque is linear, the exact solver's closed form and event search serve.
"""

import math
from functools import cache

import numpy as np
from numba import types

from wedgebrake.dynamics.brake_torque import LAW, SHAPE
from wedgebrake.dynamics.enums import EventKind, FlowForm, Outcome, SearchEnd
from wedgebrake.dynamics.harmonic import Harmonic, phase_at
from wedgebrake.dynamics.jit import array_of, compiled, compiled_for
from wedgebrake.dynamics.linear_flow import PIECE, enter, state_at
from wedgebrake.dynamics.linear_flow import acceleration as linear_acceleration
from wedgebrake.dynamics.segment_log import SEGMENT, write
from wedgebrake.solvers.event_driven.event_search import Motion, slip
from wedgebrake.solvers.smooth.runge_kutta import (
    DEGREE,
    STAGES,
    acceleration,
    coefficients,
    drive_at,
    error_norm,
    extend,
    first_root,
    room,
    step,
)
from wedgebrake.solvers.smooth.taylor import (
    A1,
    ACCELS,
    INPUTS,
    LAST,
    OUTPUTS,
    SIZE,
    THETA1,
    W1,
    aim,
    crossing,
    limit,
    load,
    passes,
    state,
)
from wedgebrake.solvers.smooth.taylor import acceleration as series_acceleration
from wedgebrake.solvers.smooth.taylor import step as step_by_series

# Columns of a row of the trail, one for each step: its stretch, where it starts and its size;
# for Runge-Kutta steps also the speeds of the stages.
TRAIL_STRETCH, TRAIL_TIME, TRAIL_THETA, TRAIL_W, TRAIL_SIZE, TRAIL_SPEEDS = range(6)
TRAIL_COLUMNS = TRAIL_SPEEDS + STAGES

# A numeric step may cover this share of the way to the nearest pole of the law, which for
# tanh(v/band) lies at v = i pi/2 band: a Runge-Kutta step, and a series.
_SHARE, SERIES_SHARE, POLE = 0.4, 0.6, 0.5 * math.pi
# A start on a kink is no crossing, nor is what happens within this share of a step: far less
# than the kink bends there, but more than rounding where the speed grows as time cubed.
_ON_KINK = 1e-4
# Share of the tolerance that the second-order term of Newton's last move to a kink may have.
_CLOSE = 1e-2

# Rows of the scratch array.
_RATE, _ACCEL, _DRIVE, _SUMS, _POLY, _TERMS = range(6)
SCRATCH_ROWS = 6


@compiled
def _leave(trail, left, stretch, t, theta, w, size):
    """One row of the trail; the caller has made sure that there is room."""
    trail[left, TRAIL_STRETCH] = stretch
    trail[left, TRAIL_TIME] = t
    trail[left, TRAIL_THETA] = theta
    trail[left, TRAIL_W] = w
    trail[left, TRAIL_SIZE] = size
    return left + 1


@compiled
def stretch_at(edges, w, rising):
    """The stretch that holds ``w``; on an edge, the one that the motion enters."""
    stretch = 0
    while stretch < edges.size and (w > edges[stretch] or (w == edges[stretch] and rising)):
        stretch += 1
    return stretch


@compiled
def _crossing(tableau, work, w, w1, h, low, high):
    """(share of the step, what) of the first kink crossed by the extended step.

    A state on a kink leaves it on either side: there the share is 0 where the step goes to
    the other side than the stretch, and later than ``_ON_KINK`` for a true crossing.
    """
    _, _, _, _, d_matrix, bernstein = tableau
    poly = work[_POLY]
    x, hit = 2.0, SearchEnd.TIME
    for what in (SearchEnd.HIT_LOW, SearchEnd.HIT_HIGH):
        edge = low if what == SearchEnd.HIT_LOW else high
        if math.isinf(edge):
            continue
        coefficients(d_matrix, bernstein, w, w1, h, work[_ACCEL], work[_TERMS], poly)
        for k in range(DEGREE + 1):
            poly[k] = poly[k] - edge if what == SearchEnd.HIT_LOW else edge - poly[k]
        found = first_root(poly, _ON_KINK if w == edge else 0.0)
        if w == edge and found == _ON_KINK:
            found = 0.0
        if found < x:
            x, hit = found, what
    return x, hit


@compiled
def _attempt(plant, laws, numbers, tableau, tolerances, work, t, theta, w, a, h):
    """One step of size h: (theta, w, a, scaled error, lowest w, highest w)."""
    weights, c, _, _, _, _ = tableau
    rtol, scale_theta, scale_w = tolerances
    theta1, w1, a1, lowest, highest = step(
        plant, laws, numbers, weights, c, t, theta, w, a, h,
        work[_RATE], work[_ACCEL], work[_DRIVE], work[_SUMS],
    )  # fmt: skip
    norm = error_norm(
        work[_SUMS],
        h,
        rtol * (scale_theta + max(abs(theta), abs(theta1))),
        rtol * (scale_w + max(abs(w), abs(w1))),
    )
    if not math.isfinite(a1):
        norm = math.nan
    return theta1, w1, a1, norm, lowest, highest


@compiled
def _numeric_step(
    plant, laws, numbers, tableau, tolerances, work, poles, t, theta, w, a, h, h_left, low, high,
    tiny, stalled,
):  # fmt: skip
    """One accepted step, ended at the first kink that it would cross.

    Returns (theta, w, a, size, next size, what, attempts); size -1: below ``tiny``, because
    of the tolerance (next size 0) or of the wall of a self-locking brake (next size -1).
    ``stalled``: the last step had no length; a kink met at once is then rounding.
    ``work`` holds the speeds of the step's stages.
    """
    _, c, a_extra, c_extra, _, _ = tableau
    attempts = 0
    walled = not math.isfinite(a)
    # In a longer step the error estimate could miss a steep part.
    furthest = _SHARE * room(poles, w)
    if abs(a) * h > furthest:
        h = furthest / abs(a)
    while h >= tiny:
        attempts += 1
        hs = min(h, h_left)
        theta1, w1, a1, norm, lowest, highest = _attempt(
            plant, laws, numbers, tableau, tolerances, work, t, theta, w, a, hs
        )
        if not math.isfinite(norm):
            # Beyond the wall of a self-locking brake: never step there.
            walled = True
            h = 0.25 * hs
            continue
        eighth_root = math.sqrt(math.sqrt(math.sqrt(norm)))
        factor = min(6.0, max(0.2, 0.9 / eighth_root))
        if norm > 1.0:
            h = hs * min(factor, 0.9)
            continue
        following = hs * factor if hs == h else max(h, hs * factor)
        margin = 0.5 * (highest - lowest)
        near_low = low if lowest - margin <= low else -math.inf
        near_high = high if highest + margin >= high else math.inf
        if math.isinf(near_low) and math.isinf(near_high):
            return theta1, w1, a1, hs, following, SearchEnd.TIME, attempts
        extend(plant, laws, numbers, a_extra, c_extra, t, theta, w, hs, work[_RATE], work[_ACCEL])
        x, hit = _crossing(tableau, work, w, w1, hs, near_low, near_high)
        if hit == SearchEnd.TIME or (stalled and x * hs <= tiny):
            return theta1, w1, a1, hs, following, SearchEnd.TIME, attempts
        edge = low if hit == SearchEnd.HIT_LOW else high
        cut = x * hs
        if cut <= tiny:
            return theta, edge, a, 0.0, h, hit, attempts
        # Again, to the kink and no further: the extension was bent by it. In the end Newton
        # closes a gap whose square is far below the tolerance.
        close = _CLOSE * tolerances[0] * (tolerances[2] + abs(edge))
        for _ in range(4):
            attempts += 1
            theta1, w1, a1, norm, lowest, highest = _attempt(
                plant, laws, numbers, tableau, tolerances, work, t, theta, w, a, cut
            )
            gap = edge - w1
            if not norm <= 1.0:
                break
            late = gap / a1 if gap != 0.0 else 0.0
            if abs(late) <= 0.1 * cut and abs(late / cut * late * (a1 - a)) <= close:
                # The stages of the whole step, to the square of what Newton added.
                for i in range(STAGES):
                    work[_RATE, i] += c[i] * late * work[_ACCEL, i]
                return theta1 + w1 * late, edge, a1, cut + late, max(h, cut), hit, attempts
            cut = min(max(cut + late, 0.5 * cut), 1.5 * cut)
        h = 0.5 * min(cut, hs)
    return theta, w, a, -1.0, -1.0 if walled else 0.0, SearchEnd.TIME, attempts


@compiled
def _series_step(
    plant, law, tolerances, inputs, outputs, reach, side, t, theta, w, h_max, h_left, low, high,
    tiny, stalled,
):  # fmt: skip
    """One step by series, ended at the first kink that it would cross.

    Returns (theta, w, a, size, what); size -1: below ``tiny``. ``stalled`` as for
    ``_numeric_step``. ``outputs`` holds the series.
    """
    aim(plant, law, side, t, theta, w, inputs, 0)
    furthest = SERIES_SHARE * (abs(w - plant[5]) + reach)
    limit(tolerances, min(h_max, h_left), furthest, inputs, 0)
    step_by_series(inputs, outputs)
    h = outputs[SIZE, 0]
    if not h >= min(tiny, h_left):
        return theta, w, outputs[ACCELS, 0], -1.0, SearchEnd.TIME
    inputs[LAST, 0] = max(h, 1e-3 * inputs[LAST, 0])
    size, hit = crossing(outputs, 0, low, high, tiny)
    if hit == SearchEnd.TIME or (stalled and size <= tiny):
        return outputs[THETA1, 0], outputs[W1, 0], outputs[A1, 0], h, SearchEnd.TIME
    edge = low if hit == SearchEnd.HIT_LOW else high
    if size <= tiny:
        return theta, edge, outputs[ACCELS, 0], 0.0, hit
    theta, _, a = state(outputs, 0, size)
    return theta, edge, a, size, hit


@compiled
def _see_series(outputs, t, h, period, want_period, want_time, seen, wanted):
    """States at the wanted times inside a step; the next one wanted."""
    while wanted < want_time.size and (
        want_period[wanted] < period
        or (want_period[wanted] == period and want_time[wanted] <= t + h)
    ):
        part = min(h, max(0.0, want_time[wanted] - t))
        seen[wanted, 0], seen[wanted, 1], _ = state(outputs, 0, part)
        wanted += 1
    return wanted


@compiled
def _see_linear(piece, forcing, theta0, w0, t0, t, period, want_period, want_time, seen, wanted):
    """Closed-form states at the wanted times up to t; the next one wanted."""
    entry = enter(piece, forcing, theta0, w0, phase_at(forcing, t0))
    while wanted < want_time.size and (
        want_period[wanted] < period or (want_period[wanted] == period and want_time[wanted] <= t)
    ):
        at = want_time[wanted]
        seen[wanted, 0], seen[wanted, 1] = theta0, w0
        if at > t0:
            seen[wanted, 0], seen[wanted, 1] = state_at(
                piece, forcing, entry, at - t0, phase_at(forcing, at)
            )
        wanted += 1
    return wanted


@compiled
def _see_numeric(
    plant, laws, numbers, tableau, tolerances, work, theta, w, a, t, h, period,
    want_period, want_time, seen, wanted,
):  # fmt: skip
    """States at the wanted times inside a step, each by a shorter step; the next one wanted.

    The continuous extension would be less exact than the step, a shorter step is more so.
    """
    while wanted < want_time.size and (
        want_period[wanted] < period
        or (want_period[wanted] == period and want_time[wanted] <= t + h)
    ):
        part = min(h, max(0.0, want_time[wanted] - t))
        seen[wanted, 0], seen[wanted, 1], _, _, _, _ = _attempt(
            plant, laws, numbers, tableau, tolerances, work, t, theta, w, a, part
        )
        wanted += 1
    return wanted


def _run(
    plant,
    pair,
    series,
    edges,
    kinks,
    linear,
    table,
    rest_edge,
    band,
    w_diverged,
    tolerances,
    h_max,
    period,
    t,
    theta,
    w,
    last_period,
    last_time,
    max_steps,
    log,
    want_period,
    want_time,
    seen,
    work,
    trail,
    stop,
):
    """Advance from (period, t, theta, w) to (last_period, last_time).

    plant      (J, c, k, T_e, omega, w_rest)
    pair       None, or (laws, numbers, tableau, poles) for Runge-Kutta steps, of which
                 laws     (m, its shape, g, its shape), compiled
                 numbers  (radius, initial force, slope, release)
                 tableau  (weights, c, A_extra, c_extra, D, Bernstein matrix)
                 poles    (n, 2) of the law, as defined in ``dop853.room``
    series     None, or the law's numbers for steps by series; one of both is None
    edges      (n-1,) cuts of the velocity axis [rad/s], ascending
    kinks      (n, 2) the nearest kinks below and above each stretch
    linear     (n,) whether the torque is linear; table (n, flow.COLUMNS) its lines
    rest_edge  index of the edge w_rest;  band  half width of the stick band [rad/s]
    tolerances (rtol, scale of angle, scale of velocity)
    want_*     (m,) wanted times, ascending; seen (m, 2) receives (theta, w)
    work       (SCRATCH_ROWS, dop853.SUMS), scratch
    trail      (n, TRAIL_COLUMNS) receives every step that moved; no rows: not wanted
    stop       None, or (1,): ends the run as the limit of steps does when another thread sets it

    Returns (outcome, period, t, theta, w, steps, rows, seen count, trail rows).
    """
    inertia, _, stiffness, amplitude, omega, w_rest = plant
    w2, f = stiffness / inertia, amplitude / inertia
    forcing = Harmonic(f, omega)
    length = 2.0 * math.pi / omega
    top = edges.size
    reach = POLE * band
    steps, rows, wanted, left = 0, 0, 0, 0
    trailing = trail.shape[0] > 0
    stalled = False
    h = 1e-3 * h_max
    side = 1.0 if w >= w_rest else -1.0
    a = 0.0
    # Numba leaves out a branch whose argument is None.
    if pair is not None:
        laws, numbers, tableau, poles = pair
        a = acceleration(plant, laws, numbers, drive_at(plant, t), theta, w)
    if series is not None:
        inputs, outputs = np.zeros((INPUTS, 1)), np.empty((OUTPUTS, 1))
        load(plant, series, inputs, 0)
        inputs[LAST, 0] = 1e-2 * h_max
        a = series_acceleration(plant, series, side, drive_at(plant, t), theta, w)
    rising = a > 0.0 or (a == 0.0 and f * omega * math.cos(omega * t) > w2 * w)
    stretch = stretch_at(edges, w, rising)
    inside = abs(w - w_rest) <= band
    rows = write(log, rows, EventKind.START, period, t, theta, w, stretch, 0.0)
    if inside:
        rows = write(log, rows, EventKind.BAND_ENTERED, period, t, theta, w, stretch, 0.0)

    while True:
        if rows + 4 > log.shape[0] or (trailing and left == trail.shape[0]):
            return Outcome.LOG_FULL, period, t, theta, w, steps, rows, wanted, left
        final = period >= last_period
        t_end = last_time if final else length
        hit = SearchEnd.TIME
        t0, theta0, w0, a0 = t, theta, w, a
        came_linear = linear[stretch]
        if t >= t_end:
            pass
        elif linear[stretch]:
            piece = table[stretch]
            if piece.form == FlowForm.BLOCKED:
                return Outcome.NO_FORWARD_SOLUTION, period, t, theta, w, steps, rows, wanted, left
            low = edges[stretch - 1] if stretch > 0 else -math.inf
            high = edges[stretch] if stretch < top else math.inf
            if piece.damping < 0.0:
                low, high = max(low, -w_diverged), min(high, w_diverged)
            phase = phase_at(forcing, t)
            a = linear_acceleration(piece, forcing, theta, w, phase)
            start = Motion(t, phase, theta, w, a)
            found = slip(piece, forcing, low, high, start, t_end, max_steps - steps)
            hit, (t, _, theta, w, a), spent = found
            # Steps without length count too, so that a run of only such steps ends.
            steps += max(spent, 1)
            if hit == SearchEnd.WORK_LIMIT:
                return Outcome.STEP_LIMIT, period, t, theta, w, steps, rows, wanted, left
            if trailing:
                left = _leave(trail, left, stretch, t0, theta0, w0, t - t0)
            if wanted < want_time.size:
                wanted = _see_linear(
                    piece, forcing, theta0, w0, t0, t, period, want_period, want_time, seen, wanted,
                )  # fmt: skip
            h = min(h_max, 0.3 * abs((w - w_rest) / a))
        else:
            low, high = kinks[stretch, 0], kinks[stretch, 1]
            hs, attempts = 0.0, 1
            if pair is not None:
                theta, w, a, hs, h, hit, attempts = _numeric_step(
                    plant, laws, numbers, tableau, tolerances, work, poles,
                    t, theta, w, a, min(h, h_max), t_end - t, low, high, 1e-15 * length, stalled,
                )  # fmt: skip
            if series is not None:
                theta, w, a, hs, hit = _series_step(
                    plant, series, tolerances, inputs, outputs, reach,
                    1.0 if low >= w_rest else -1.0, t, theta, w, h_max, t_end - t, low, high,
                    1e-15 * length, stalled,
                )  # fmt: skip
            steps += attempts
            stalled = hs == 0.0
            if hs < 0.0:
                outcome = Outcome.NO_FORWARD_SOLUTION if h < 0.0 else Outcome.STEP_LIMIT
                return outcome, period, t, theta, w, steps, rows, wanted, left
            if trailing and not stalled:
                left = _leave(trail, left, stretch, t0, theta0, w0, hs)
                if pair is not None:
                    trail[left - 1, TRAIL_SPEEDS:] = work[_RATE, :STAGES]
            if wanted < want_time.size:
                if pair is not None:
                    wanted = _see_numeric(
                        plant, laws, numbers, tableau, tolerances, work, theta0, w0, a0, t, hs,
                        period, want_period, want_time, seen, wanted,
                    )  # fmt: skip
                if series is not None:
                    wanted = _see_series(
                        outputs, t, hs, period, want_period, want_time, seen, wanted
                    )
            t = t_end if t_end - t - hs <= 4e-16 * length else t + hs

        if (abs(w - w_rest) <= band) != inside and not linear[stretch]:
            inside = not inside
            side = 1.0 if (w0 if inside else w) > w_rest else -1.0
            when = t
            if pair is not None:
                gap0, gap1 = abs(w0 - w_rest) - band, abs(w - w_rest) - band
                when = t0 + (t - t0) * gap0 / (gap0 - gap1)
            if series is not None:
                when = t0 + passes(outputs, t - t0, w_rest + side * band)
            kind = EventKind.BAND_ENTERED if inside else EventKind.BAND_LEFT
            rows = write(log, rows, kind, period, when, theta, w, stretch, side)

        given_up = steps > max_steps
        # Numba removes a branch whose argument is None.
        if stop is not None:
            given_up = given_up or stop[0]
        if given_up:
            return Outcome.STEP_LIMIT, period, t, theta, w, steps, rows, wanted, left
        if not math.isfinite(w) or abs(w - w_rest) >= w_diverged:
            return Outcome.DIVERGED, period, t, theta, w, steps, rows, wanted, left
        if hit != SearchEnd.TIME:
            side = -1.0 if hit == SearchEnd.HIT_LOW else 1.0
            stretch = stretch_at(edges, w, hit == SearchEnd.HIT_HIGH)
            kind = EventKind.REVERSAL if w == edges[rest_edge] else EventKind.BREAKPOINT
            on_kink = w == edges[rest_edge] or w == kinks[stretch, 0] or w == kinks[stretch, 1]
            if on_kink and (w != w0 or t != t0):
                rows = write(log, rows, kind, period, t, theta, w, stretch, side)
        elif not linear[stretch]:
            stretch = stretch_at(edges, w, a > 0.0)
        if pair is not None:  # noqa: SIM102 - one condition alone is left out by Numba
            if came_linear and not linear[stretch]:
                a = acceleration(plant, laws, numbers, drive_at(plant, t), theta, w)

        if hit == SearchEnd.TIME and t >= t_end:
            if final:
                for i in range(wanted, want_time.size):  # at the very end, or at most rounding off
                    seen[i, 0], seen[i, 1] = theta, w
                wanted = want_time.size
                rows = write(log, rows, EventKind.END, period, t_end, theta, w, stretch, 0.0)
                return Outcome.COMPLETED, period, t_end, theta, w, steps, rows, wanted, left
            period += 1
            t = 0.0
            rows = write(log, rows, EventKind.RETURN, period, t, theta, w, stretch, 0.0)


def _signature():
    """The one signature of ``run``: laws as function pointers, so that its cache serves all."""
    real, whole = types.float64, types.int64
    vector, matrix = types.Array(real, 1, "C"), types.Array(real, 2, "C")
    indices, flags = types.Array(whole, 1, "C"), types.Array(types.boolean, 1, "C")
    laws = types.Tuple((LAW, SHAPE, LAW, SHAPE))
    numbers = types.Tuple((real, real, real, types.boolean))
    tableau = types.Tuple((matrix, vector, matrix, vector, matrix, matrix))
    return (
        types.UniTuple(real, 6), types.Tuple((laws, numbers, tableau, matrix)), types.none, vector,
        matrix, flags, array_of(PIECE), whole, real, real, types.UniTuple(real, 3), real, whole,
        real, real, real, whole, real, whole, array_of(SEGMENT), indices, vector, matrix, matrix, matrix,
        types.Array(types.boolean, 1, "C"),
    )  # fmt: skip


run = compiled(_run)


@cache
def run_pair():
    """``run`` for any laws, compiled when first asked for."""
    return compiled_for(_signature())(_run)
