"""The orbit of a solution of segments: its log, its extremes and its monodromy matrix."""

import math
from typing import NamedTuple

import numpy as np

from wedgebrake.analysis.accumulators import extreme
from wedgebrake.analysis.saltation import propagate
from wedgebrake.dynamics.deviations import Deviations
from wedgebrake.dynamics.enums import EventKind
from wedgebrake.dynamics.harmonic import phase_of
from wedgebrake.dynamics.jit import compiled
from wedgebrake.dynamics.linear_flow import enter, forcing_of, state_at
from wedgebrake.dynamics.section import phase_at_return
from wedgebrake.dynamics.segment_log import write
from wedgebrake.orbits.segment_kernel import (
    CELL,
    cell_count,
    event_kind,
    kinematics_at,
    kinematics_of,
    mode_of,
    segment_of,
)

_TURN = 2.0 * math.pi


class Extremes(NamedTuple):
    """Least and greatest velocity [rad/s] and angle [rad]."""

    least_velocity: float
    greatest_velocity: float
    least_angle: float
    greatest_angle: float


@compiled
def _state_in(problem, segment, tau):
    """State a time ``tau`` after the begin of a segment, at the section."""
    begin, rest = segment.begin, problem.driveline.rest_velocity
    if segment.code == 0:
        return begin.angle + rest * tau, rest
    forcing = forcing_of(problem.driveline, problem.torque)
    piece = problem.brake.pieces[mode_of(problem.brake, segment.code)]
    entry = enter(piece, forcing, begin.angle, begin.velocity, phase_of(begin.phase))
    return state_at(piece, forcing, entry, tau, phase_at_return())


@compiled
def write_log(problem, codes, order, unknowns, log):
    """Write an orbit as the exact solver logs it, from node 0 to node 0, and return the rows.

    log : at least n + order + 2 rows. Rows of kind RETURN hold the orbit's Poincare points.
    """
    omega, n, rows = problem.torque.angular_frequency, codes.size, 0
    for i in range(n + 1):
        segment = segment_of(problem.brake, codes, order, 1, unknowns, i % n)
        begin, code, before = segment.begin, segment.code, segment.before
        phase = begin.phase + (_TURN * order if i == n else 0.0)
        period, kind = math.floor(phase / _TURN), event_kind(before, code)
        # A rest remembers the side from which it was entered, other segments where they go.
        up = before > 0 if kind == EventKind.STICK else code > before
        time, mode = (phase - _TURN * period) / omega, mode_of(problem.brake, code)
        side = 1.0 if up else -1.0
        rows = write(log, rows, kind, period, time, begin.angle, begin.velocity, mode, side)
        if i == n:
            break
        at, end = period + 1, segment.end.phase
        # An event exactly at a return is written after the return's row; a mark is the return.
        marked = segment.after == code
        while (_TURN * at < end or (_TURN * at == end and not marked)) and (
            rows < log.size - (n - i)
        ):
            theta, w = _state_in(problem, segment, (_TURN * at - phase) / omega)
            rows = write(log, rows, EventKind.RETURN, at, 0.0, theta, w, mode, 0.0)
            at += 1
    return rows


@compiled
def _widened(extremes, theta, w):
    """Extremes that include a state."""
    return Extremes(
        min(extremes.least_velocity, w), max(extremes.greatest_velocity, w),
        min(extremes.least_angle, theta), max(extremes.greatest_angle, theta),
    )  # fmt: skip


@compiled
def _extreme_angle(piece, forcing, entry, begin, low, high, positive):
    """``Kinematics`` where the velocity vanishes between two times after entry.

    positive : whether the velocity is positive at the earlier one
    """
    at = kinematics_at(piece, forcing, entry, begin, 0.5 * (low + high))
    for _ in range(50):
        tau = 0.5 * (low + high)
        at = kinematics_at(piece, forcing, entry, begin, tau)
        if (at.velocity > 0.0) == positive:
            low = tau
        else:
            high = tau
    return at


@compiled
def _extremes_of_slip(problem, segment, extremes):
    """Extremes that include a slip."""
    forcing = forcing_of(problem.driveline, problem.torque)
    piece = problem.brake.pieces[mode_of(problem.brake, segment.code)]
    begin, omega = segment.begin, forcing.angular_frequency
    tau = (segment.end.phase - begin.phase) / omega
    entry = enter(piece, forcing, begin.angle, begin.velocity, phase_of(begin.phase))
    cells = cell_count(piece, forcing, tau, CELL)
    since, before = 0.0, kinematics_of(piece, forcing, begin.angle, begin.velocity, entry.phase)
    speed, rising = begin.velocity, before.acceleration > 0.0
    for cell in range(1, cells + 1):
        until = cell * tau / cells
        here = kinematics_at(piece, forcing, entry, begin.phase, until)
        now = here.acceleration > 0.0
        extremes = _widened(extremes, here.angle, here.velocity)
        if now != rising:
            t0 = begin.phase / omega
            _, theta, w = extreme(piece, forcing, entry, t0, since, until, rising)
            extremes = _widened(extremes, theta, w)
        if (here.velocity > 0.0) != (speed > 0.0):
            turned = _extreme_angle(piece, forcing, entry, begin.phase, since, until, speed > 0.0)
            extremes = _widened(extremes, turned.angle, turned.velocity)
        since, speed, rising = until, here.velocity, now
    return extremes


@compiled
def extremes_of(problem, codes, order, unknowns):
    """``Extremes`` of an orbit."""
    rest = problem.driveline.rest_velocity
    extremes = Extremes(math.inf, -math.inf, math.inf, -math.inf)
    for i in range(codes.size):
        segment = segment_of(problem.brake, codes, order, 1, unknowns, i)
        begin = segment.begin
        extremes = _widened(extremes, begin.angle, begin.velocity)
        tau = (segment.end.phase - begin.phase) / problem.torque.angular_frequency
        if segment.code == 0:
            extremes = _widened(extremes, begin.angle + rest * tau, rest)
        elif tau > 0.0:
            extremes = _extremes_of_slip(problem, segment, extremes)
    return extremes


@compiled
def monodromy_invariants(problem, codes, order, unknowns, log):
    """(trace, determinant) of the monodromy matrix; they do not depend on the begin of the orbit.

    log : as of ``write_log``
    """
    rows = write_log(problem, codes, order, unknowns, log)
    weight = problem.torque.angular_frequency
    there = propagate(problem, log, rows, Deviations(1.0, 0.0, 0.0, weight), np.empty(0), 0)
    determinant = math.exp(there.log_determinant) if there.full_rank else 0.0
    trace = there.deviations.angle1 + there.deviations.velocity2 / weight
    return trace * math.exp(there.log_scale), determinant
