"""The orbit of a solution of segments: its log, extremes, monodromy matrix and margins.

The margins are its distances from the beginning or end of a segment.
"""

import math

import numpy as np
from numpy.typing import NDArray

from wedgebrake.analysis.driveline_motion.accumulators import extreme
from wedgebrake.analysis.driveline_motion.saltation import propagate
from wedgebrake.dynamics.deviations import Deviations
from wedgebrake.dynamics.enums import EventKind
from wedgebrake.dynamics.harmonic import angle_of_rate, phase_of
from wedgebrake.dynamics.jit import compiled
from wedgebrake.dynamics.linear_flow import acceleration, enter, forcing_of, state_at
from wedgebrake.dynamics.motion_sums import widen
from wedgebrake.dynamics.problem import torque_at_rest
from wedgebrake.dynamics.records import record
from wedgebrake.dynamics.section import phase_at_return
from wedgebrake.dynamics.segment_log import write
from wedgebrake.orbits.bifurcation_types import OrbitMargin
from wedgebrake.orbits.equations.segment_kernel import (
    CELL,
    cell_count,
    event_kind,
    kinematics_at,
    kinematics_of,
    mode_of,
    segment_of,
    torque_scale,
)

_TURN = 2.0 * math.pi

# The first four are positive where the solution is an orbit:
# duration    of the segment [rad]
# touch       least distance inside it from a limit of its piece, or of the holding torque
# holding     at the end of a slip: distance from the limit of the holding torque there
# crossing    acceleration through the end of a slip
# touch_phase, touch_angle  where ``touch`` was measured [rad]
# touch_side  which limit: 1 the upper, -1 the lower
MARGINS = record("duration touch holding crossing touch_phase touch_angle touch_side")
QUANTITIES = ("duration", "touch", "holding", "crossing")


def violated(margins: NDArray[np.record]) -> list[OrbitMargin]:
    """Violated margins of a solution that is not an orbit, segment by segment."""
    lacking = ~np.stack([margins[name] > 0.0 for name in QUANTITIES], axis=-1)
    return [OrbitMargin(int(segment), QUANTITIES[k]) for segment, k in np.argwhere(lacking)]


@compiled
def _state_in(problem, segment, tau):
    """State a time ``tau`` after the beginning of a segment, at the section."""
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
        # A rest records the side from which it was entered, other segments their direction.
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
def _turn(piece, forcing, entry, begin, low, high, order, positive):
    """(time, ``Kinematics``) after entry where a derivative of the angle vanishes in between.

    order    : of the derivative: 1 the velocity, 3 the jerk
    positive : whether it is positive at the earlier time
    """
    tau, at = low, kinematics_at(piece, forcing, entry, begin, low)
    for _ in range(50):
        tau = 0.5 * (low + high)
        at = kinematics_at(piece, forcing, entry, begin, tau)
        if (at[order] > 0.0) == positive:
            low = tau
        else:
            high = tau
    return tau, at


@compiled
def _widen_by_slip(problem, segment, sums):
    """Include a slip in the range of the motion."""
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
        widen(sums, here.angle, here.velocity)
        if now != rising:
            t0 = begin.phase / omega
            _, theta, w = extreme(piece, forcing, entry, t0, since, until, rising)
            widen(sums, theta, w)
        if (here.velocity > 0.0) != (speed > 0.0):
            _, at = _turn(piece, forcing, entry, begin.phase, since, until, 1, speed > 0.0)
            widen(sums, at.angle, at.velocity)
        since, speed, rising = until, here.velocity, now


@compiled
def widen_by_orbit(problem, codes, order, unknowns, sums):
    """Include an orbit in the range of a record of ``SUMS``, to rounding."""
    rest = problem.driveline.rest_velocity
    for i in range(codes.size):
        segment = segment_of(problem.brake, codes, order, 1, unknowns, i)
        begin = segment.begin
        widen(sums, begin.angle, begin.velocity)
        tau = (segment.end.phase - begin.phase) / problem.torque.angular_frequency
        if segment.code == 0:
            widen(sums, begin.angle + rest * tau, rest)
        elif tau > 0.0:
            _widen_by_slip(problem, segment, sums)


@compiled
def monodromy_invariants(problem, codes, order, unknowns, log, half):
    """(trace, determinant) of the monodromy matrix; they do not depend on its first node.

    log  : as of ``write_log``
    half : whether the matrix is that of the first half of the orbit, followed by the mirror image
    """
    rows = write_log(problem, codes, order, unknowns, log)
    if half:
        nodes, rows = -1, 0
        while nodes < codes.size // 2:
            nodes += log[rows].kind != EventKind.RETURN
            rows += 1
    weight = problem.torque.angular_frequency
    there = propagate(problem, log, rows, Deviations(1.0, 0.0, 0.0, weight), np.empty(0), 0)
    determinant = math.exp(there.log_determinant) if there.full_rank else 0.0
    trace = there.deviations.angle1 + there.deviations.velocity2 / weight
    # The mirror image changes the sign of both deviations.
    return (-trace if half else trace) * math.exp(there.log_scale), determinant


@compiled
def _see(margins, gap, side, phase, angle):
    """Record a distance from a limit as the margin if it is the least so far."""
    if gap < margins.touch:
        margins.touch, margins.touch_side = gap, side
        margins.touch_phase, margins.touch_angle = phase, angle


@compiled
def _touch_of_slip(problem, segment, margins):
    """Least distance of the velocity from a limit of its piece between the ends of a slip."""
    brake, begin, after = problem.brake, segment.begin, segment.after
    forcing = forcing_of(problem.driveline, problem.torque)
    mode = mode_of(brake, segment.code)
    piece, omega = brake.pieces[mode], forcing.angular_frequency
    low = brake.breakpoints[mode - 1] if mode > 0 else -math.inf
    high = brake.breakpoints[mode] if mode < brake.breakpoints.size else math.inf
    tau = (segment.end.phase - begin.phase) / omega
    scale = torque_scale(problem) / problem.driveline.inertia
    scale /= max(omega, math.sqrt(piece.stiffness))
    entry = enter(piece, forcing, begin.angle, begin.velocity, phase_of(begin.phase))
    cells = cell_count(piece, forcing, tau, CELL)
    width = tau / cells
    before = kinematics_of(piece, forcing, begin.angle, begin.velocity, entry.phase)
    # At the entry and exit the velocity has a known direction, regardless of rounding.
    rising = segment.code > segment.before
    if segment.before == segment.code:
        rising = before.acceleration > 0.0
    for cell in range(1, cells + 1):
        since, until = (cell - 1) * width, cell * width
        here = kinematics_at(piece, forcing, entry, begin.phase, until)
        now = here.acceleration > 0.0
        if cell == cells and after != segment.code:
            now = after > segment.code
        # Two extremes in one cell: the acceleration has an extreme inside.
        middle, growing = until, before.jerk > 0.0
        if now == rising and growing != rising and (here.jerk > 0.0) == rising:
            middle, at = _turn(piece, forcing, entry, begin.phase, since, until, 3, growing)
            if (at.acceleration > 0.0) == rising:
                middle = until
        for half in range(2):
            start, end = (since, middle) if half == 0 else (middle, until)
            if (half == 1 and middle == until) or (middle == until and now == rising):
                break
            when, angle, top = extreme(
                piece, forcing, entry, begin.phase / omega, start, end, rising
            )
            gap, side = ((high - top), 1.0) if rising else ((top - low), -1.0)
            _see(margins, gap / scale, side, begin.phase + omega * when, angle)
            rising = not rising
        before = here


@compiled
def _touch_of_rest(problem, segment, margins):
    """Least distance of the torque from the limits that the brake holds, inside a rest."""
    driveline, torque, brake = problem.driveline, problem.torque, problem.brake
    begin, omega = segment.begin, torque.angular_frequency
    scale, w_rest = torque_scale(problem), driveline.rest_velocity
    turn = angle_of_rate(torque, driveline.stiffness * w_rest)
    if math.isnan(turn):
        return
    # The torque to be held is largest at one phase and least at the opposite phase.
    for side in (1.0, -1.0):
        at = side * turn
        at += 2.0 * math.pi * math.ceil((begin.phase - at) / (2.0 * math.pi))
        while at < segment.end.phase:
            angle = begin.angle + w_rest * (at - begin.phase) / omega
            held = torque_at_rest(driveline, torque, phase_of(at), angle)
            gap = brake.upper - held if side > 0.0 else held - brake.lower
            if at > begin.phase:
                _see(margins, gap / scale, side, at, angle)
            at += 2.0 * math.pi


@compiled
def _margins_at_end(problem, segment, margins):
    """How clearly a slip ends in the following segment."""
    code, after, end = segment.code, segment.after, segment.end
    brake, scale = problem.brake, torque_scale(problem)
    forcing, phase = forcing_of(problem.driveline, problem.torque), phase_of(end.phase)
    piece = brake.pieces[mode_of(brake, code)]
    a = acceleration(piece, forcing, end.angle, end.velocity, phase)
    through = a / (scale / problem.driveline.inertia)
    margins.crossing = through if after > code else -through
    held = torque_at_rest(problem.driveline, problem.torque, phase, end.angle)
    if after == 0:
        # Beyond the near end of the interval the slip would not have ended.
        margins.holding = (held - brake.lower if code > 0 else brake.upper - held) / scale
    elif code * after < 0:
        margins.holding = (held - brake.upper if after > 0 else brake.lower - held) / scale


@compiled
def compute_margins(problem, codes, order, unknowns, out):
    """Margins of each segment of a solution, into ``out`` (n,) of dtype ``MARGINS``.

    Infinite if there is no limit to touch, or no torque to hold.
    """
    for i in range(codes.size):
        segment = segment_of(problem.brake, codes, order, 1, unknowns, i)
        margins = out[i]
        margins.duration = segment.end.phase - segment.begin.phase
        margins.touch = margins.holding = margins.crossing = math.inf
        margins.touch_phase = margins.touch_angle = math.nan
        margins.touch_side = 0.0
        if segment.code == 0:
            if margins.duration > 0.0:
                _touch_of_rest(problem, segment, margins)
            continue
        if margins.duration > 0.0:
            _touch_of_slip(problem, segment, margins)
        if segment.code != segment.after:
            _margins_at_end(problem, segment, margins)
