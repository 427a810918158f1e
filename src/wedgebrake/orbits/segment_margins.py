"""Margins of an orbit: its distances from where a segment would begin or cease to be."""

import math

import numpy as np
from numpy.typing import NDArray

from wedgebrake.analysis.accumulators import extreme
from wedgebrake.dynamics.harmonic import angle_of_rate, phase_of
from wedgebrake.dynamics.jit import compiled
from wedgebrake.dynamics.linear_flow import acceleration, enter, forcing_of
from wedgebrake.dynamics.problem import torque_at_rest
from wedgebrake.dynamics.records import record
from wedgebrake.orbits.bifurcation_types import Margin
from wedgebrake.orbits.segment_kernel import (
    CELL,
    cell_count,
    kinematics_at,
    kinematics_of,
    mode_of,
    segment_of,
    torque_scale,
)

# The first four are positive where the solution is an orbit:
# duration    of the segment [rad]
# touch       least distance inside it from a limit of its piece, or of the holding torque
# holding     at the end of a slip: distance from the limit of the holding torque there
# crossing    acceleration through the end of a slip
# touch_phase, touch_angle  where ``touch`` was measured [rad]
# touch_side  which limit: 1 the upper, -1 the lower
MARGINS = record("duration touch holding crossing touch_phase touch_angle touch_side")
QUANTITIES = ("duration", "touch", "holding", "crossing")


def violated(margins: NDArray[np.record]) -> list[Margin]:
    """Margins in which a solution fails to be an orbit, segment by segment."""
    lacking = ~np.stack([margins[name] > 0.0 for name in QUANTITIES], axis=-1)
    return [Margin(int(segment), QUANTITIES[k]) for segment, k in np.argwhere(lacking)]


@compiled
def _see(margins, gap, side, phase, angle):
    """Take a distance from a limit for the margin if it is the least so far."""
    if gap < margins.touch:
        margins.touch, margins.touch_side = gap, side
        margins.touch_phase, margins.touch_angle = phase, angle


@compiled
def _extreme_acceleration(piece, forcing, entry, begin, low, high, growing):
    """(time, acceleration) between two times after entry where the acceleration is extreme."""
    tau, a = low, 0.0
    for _ in range(40):
        tau = 0.5 * (low + high)
        at = kinematics_at(piece, forcing, entry, begin, tau)
        a = at.acceleration
        if (at.jerk > 0.0) == growing:
            low = tau
        else:
            high = tau
    return tau, a


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
    # Into the piece and out of it the velocity goes one way, whatever rounding says.
    rising = segment.code > segment.before
    if segment.before == segment.code:
        rising = before.acceleration > 0.0
    for cell in range(1, cells + 1):
        since, until = (cell - 1) * width, cell * width
        here = kinematics_at(piece, forcing, entry, begin.phase, until)
        now = here.acceleration > 0.0
        if cell == cells and after != segment.code:
            now = after > segment.code
        # Two extremes in one cell: the acceleration turns back between its ends.
        middle, growing = until, before.jerk > 0.0
        if now == rising and growing != rising and (here.jerk > 0.0) == rising:
            middle, a = _extreme_acceleration(
                piece, forcing, entry, begin.phase, since, until, growing
            )
            if (a > 0.0) == rising:
                middle = until
        for half in range(2):
            start, end = (since, middle) if half == 0 else (middle, until)
            if (half == 1 and middle == until) or (middle == until and now == rising):
                break
            at, angle, top = extreme(piece, forcing, entry, begin.phase / omega, start, end, rising)
            gap, side = ((high - top), 1.0) if rising else ((top - low), -1.0)
            _see(margins, gap / scale, side, begin.phase + omega * at, angle)
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
    # The torque to be held is greatest at one phase and least at the opposite one.
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
        # The near end of the interval is where the slip would not have ended.
        margins.holding = (held - brake.lower if code > 0 else brake.upper - held) / scale
    elif code * after < 0:
        margins.holding = (held - brake.upper if after > 0 else brake.lower - held) / scale


@compiled
def compute_margins(problem, codes, order, unknowns, out):
    """Margins of each segment of a solution, into ``out`` (n,) of dtype ``MARGINS``.

    Infinite where there is nothing to touch, or nothing to hold.
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
