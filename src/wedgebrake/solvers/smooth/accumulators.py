"""What a smooth motion adds up to: heat, range, and time inside the band.

A stick is a passage through the band about zero sliding speed that lasts (theory, section 6).
"""

import math

import numpy as np

from wedgebrake.dynamics.brake_torque import brake_torque, smooth_brake
from wedgebrake.dynamics.enums import EventKind
from wedgebrake.dynamics.harmonic import Harmonic, Phase, phase_at
from wedgebrake.dynamics.jit import compiled
from wedgebrake.dynamics.linear_flow import Entry, enter, state_at
from wedgebrake.dynamics.linear_flow import acceleration as linear_acceleration
from wedgebrake.solvers.smooth.dense_output import NODES, PARTS, WEIGHTS, inside
from wedgebrake.solvers.smooth.dense_output import look as seen
from wedgebrake.solvers.smooth.runge_kutta import ROWS, SUMS, acceleration, drive_at
from wedgebrake.solvers.smooth.runge_kutta import step as advance
from wedgebrake.solvers.smooth.trajectory import (
    TRAIL_SIZE,
    TRAIL_STRETCH,
    TRAIL_THETA,
    TRAIL_TIME,
    TRAIL_W,
)

# Entries of the sums.
(
    HEAT,  # of the brake's torque on the sliding velocity [J]
    LOW_THETA,  # extreme values met
    HIGH_THETA,
    LOW_W,
    HIGH_W,
    REST_TIME,  # in sticks that have ended [s]
    STICKS_FORWARD,  # ended ones, entered from w > w_rest
    STICKS_BACKWARD,
    SINCE,  # when the band was entered that has not been left [s]; nan: none
    SIDE,  # from where
) = range(10)
ENTRIES = 10

# The motion is looked at so often in a radian of its fastest rate, at least.
_CELL = 0.5
# Secant steps to where the motion turns: there its extremes are flat.
_REFINED = 4


@compiled
def clear(sums):
    """Begin to count."""
    sums[:] = 0.0
    sums[SINCE] = math.nan
    sums[LOW_THETA] = sums[LOW_W] = math.inf
    sums[HIGH_THETA] = sums[HIGH_W] = -math.inf


@compiled
def leave(sums, now, shortest):
    """The band is left at the time ``now`` [s]: a stick, if it lasted."""
    lasted = now - sums[SINCE]
    if lasted > shortest:
        sums[REST_TIME] += lasted
        if sums[SIDE] > 0.0:
            sums[STICKS_FORWARD] += 1.0
        elif sums[SIDE] < 0.0:
            sums[STICKS_BACKWARD] += 1.0
    sums[SINCE] = math.nan


@compiled
def passages(log, rows, before, shortest, sums):
    """Count the sticks of a period that began ``before`` [s] after the first one."""
    for row in log[:rows]:
        if row.kind == EventKind.BAND_ENTERED and math.isnan(sums[SINCE]):
            sums[SINCE], sums[SIDE] = before + row.time, row.side
        elif row.kind == EventKind.BAND_LEFT:
            leave(sums, before + row.time, shortest)


@compiled
def _inside(plant, pair, past, number, linear, line, start, row, tau, look, scratch):
    """(theta, w, w', brake torque) in the step of a ``row``, a time tau after it begins.

    start : ``Entry`` of a linear stretch
    look  : number of the look, in order through the step; -1: another time. Then the torque in
            a series step is left out, and given as 0
    """
    inertia, _, _, amplitude, omega, w_rest = plant
    begin, theta0, w0 = row[TRAIL_TIME], row[TRAIL_THETA], row[TRAIL_W]
    if linear[int(row[TRAIL_STRETCH])]:
        forcing = Harmonic(amplitude / inertia, omega)
        phase = phase_at(forcing, begin + tau)
        theta, w = state_at(line, forcing, start, tau, phase)
        torque = line.offset + line.slope * w
        return theta, w, linear_acceleration(line, forcing, theta, w, phase), torque
    theta, w, a, torque = theta0, w0, 0.0, 0.0
    if pair is not None:
        laws, numbers, tableau, _ = pair
        a = acceleration(plant, laws, numbers, drive_at(plant, begin), theta0, w0)
        theta, w, a, _, _ = advance(
            plant, laws, numbers, tableau[0], tableau[1], begin, theta0, w0, a, tau,
            scratch[0, :ROWS], scratch[1, :ROWS], scratch[2, :ROWS], scratch[3],
        )  # fmt: skip
        torque = brake_torque(smooth_brake(laws, numbers), w - w_rest)
    if past is not None:
        if look >= 0:
            theta, w, a, torque = seen(past, number, look // NODES.size, look % NODES.size)
            torque *= inertia
        else:
            theta, w, a = inside(past, number, row[TRAIL_SIZE], tau)
    return theta, w, a, torque


@compiled
def _widen(sums, theta, w):
    sums[LOW_THETA], sums[HIGH_THETA] = min(sums[LOW_THETA], theta), max(sums[HIGH_THETA], theta)
    sums[LOW_W], sums[HIGH_W] = min(sums[LOW_W], w), max(sums[HIGH_W], w)


@compiled
def add(plant, pair, past, linear, table, trail, left, sums):
    """Add ``left`` rows of a trail to the ``sums`` (ENTRIES,).

    plant, pair, linear, table : as for ``smooth.run``
    past : None, or what ``past.see`` found; one of pair and past is None
    """
    inertia, _, stiffness, amplitude, omega, w_rest = plant
    forcing, w2 = Harmonic(amplitude / inertia, omega), stiffness / inertia
    fastest = max(omega, math.sqrt(w2))
    scratch = np.empty((4, SUMS))
    start = Entry(0.0, 0.0, Phase(0.0, 1.0), 0.0, 0.0, 0.0, 0.0)
    number = -1
    for row in trail[:left]:
        stretch, begin, whole = int(row[TRAIL_STRETCH]), row[TRAIL_TIME], row[TRAIL_SIZE]
        theta0, w0, line = row[TRAIL_THETA], row[TRAIL_W], table[stretch]
        parts, a = PARTS, 0.0
        if linear[stretch]:
            parts = 1 + int(whole * fastest / _CELL)
            phase = phase_at(forcing, begin)
            start = enter(line, forcing, theta0, w0, phase)
            a = linear_acceleration(line, forcing, theta0, w0, phase)
        else:
            if pair is not None:
                laws, numbers, _, _ = pair
                a = acceleration(plant, laws, numbers, drive_at(plant, begin), theta0, w0)
            if past is not None:
                number += 1
                _, _, a = inside(past, number, whole, 0.0)
        _widen(sums, theta0, w0)
        before, w_before, a_before = 0.0, w0, a
        for look in range(parts * NODES.size + 1):
            part, k = look // NODES.size, look % NODES.size
            tau = whole * (part + NODES[k]) / parts if part < parts else whole
            theta, w, a, torque = _inside(
                plant, pair, past, number, linear, line, start, row, tau,
                look if part < parts else -1, scratch,
            )  # fmt: skip
            if part < parts:
                sums[HEAT] += whole / parts * WEIGHTS[k] * torque * (w - w_rest)
            _widen(sums, theta, w)
            # Between two looks, where the velocity turns, and where the angle does.
            for turns in range(2):
                low = a_before if turns == 0 else w_before
                high = a if turns == 0 else w
                if (low < 0.0) == (high < 0.0):
                    continue
                early, late = before, tau
                for _ in range(_REFINED):
                    # Secant, kept off the ends (Illinois).
                    at = late - high * (late - early) / (high - low)
                    theta1, w1, a1, _ = _inside(
                        plant, pair, past, number, linear, line, start, row, at, -1, scratch
                    )
                    _widen(sums, theta1, w1)
                    middle = a1 if turns == 0 else w1
                    if (middle < 0.0) == (high < 0.0):
                        late, high, low = at, middle, 0.5 * low
                    else:
                        early, low, high = at, middle, 0.5 * high
            before, w_before, a_before = tau, w, a
