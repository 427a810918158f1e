"""Sums over a smooth motion: heat, range, and time inside the stick band.

A stick is a passage through the band about zero sliding speed that lasts
(docs/numerics.md, "Classes of stick-slip").
"""

import math
from typing import Any, NamedTuple

from wedgebrake.dynamics.brake_torque import brake_torque
from wedgebrake.dynamics.enums import EventKind
from wedgebrake.dynamics.harmonic import Phase, phase_at
from wedgebrake.dynamics.jit import chosen_by_class, compiled
from wedgebrake.dynamics.linear_flow import Entry, acceleration, enter, forcing_of, state_at
from wedgebrake.dynamics.motion_sums import count_stick, widen
from wedgebrake.solvers.smooth.dense_output import (
    NODES,
    PARTS,
    WEIGHTS,
    Inside,
    SeriesRecord,
    at_node,
    inside,
)
from wedgebrake.solvers.smooth.runge_kutta import RungeKutta, acceleration_at, step

# Samples in a radian of the fastest rate of the motion, at least.
_CELL = 0.5
# Secant steps to where the motion turns: there its extremes are flat.
_REFINED = 4


@compiled
def leave_band(sums, now, shortest):
    """Count the passage through the band that ends at the time ``now`` [s], if it is a stick."""
    lasted = now - sums.band_entered
    if lasted > shortest:
        sums.rest_time += lasted
        count_stick(sums, sums.band_side)
    sums.band_entered = math.nan


@compiled
def count_passages(log, rows, before, shortest, sums):
    """Count the sticks of a period that began ``before`` [s] after the first one."""
    for row in log[:rows]:
        if row.kind == EventKind.BAND_ENTERED and math.isnan(sums.band_entered):
            sums.band_entered, sums.band_side = before + row.time, row.side
        elif row.kind == EventKind.BAND_LEFT:
            leave_band(sums, before + row.time, shortest)


class _Step(NamedTuple):
    """A step of the trail, and what its motion is computed from.

    record : what ``dense_output.expand_trail`` made of the trail
    entry  : ``Entry`` of a linear stretch
    number : of the numeric step in the trail
    """

    problem: Any
    record: Any
    row: Any
    entry: Entry
    number: int


@compiled
def _inside_runge_kutta(method, row, number, tau):  # noqa: ARG001 - one signature
    """``Inside`` of a Runge-Kutta step, a time tau after it begins."""
    angle, velocity = row.angle, row.velocity
    a = acceleration_at(method, row.time, angle, velocity)
    if tau > 0.0:
        end = step(method, row.time, angle, velocity, a, tau)
        angle, velocity, a = end.angle, end.velocity, end.acceleration
    torque = brake_torque(method.brake, velocity - method.driveline.rest_velocity)
    return Inside(angle, velocity, a, torque)


@compiled
def _runge_kutta_node(method, row, number, part, node, inertia):  # noqa: ARG001 - one signature
    """``Inside`` of a Runge-Kutta step at a node of one of its parts."""
    return _inside_runge_kutta(method, row, number, row.duration * (part + NODES[node]) / PARTS)


_numeric_inside = chosen_by_class({SeriesRecord: inside, RungeKutta: _inside_runge_kutta})
_numeric_node = chosen_by_class({SeriesRecord: at_node, RungeKutta: _runge_kutta_node})


@compiled
def _entered(problem, row):
    """``Entry`` of a linear stretch; of another one, none."""
    if problem.stretches[row.stretch].linear:
        piece, forcing = problem.pieces[row.stretch], forcing_of(problem.driveline, problem.torque)
        return enter(piece, forcing, row.angle, row.velocity, phase_at(forcing, row.time))
    return Entry(row.angle, row.velocity, Phase(0.0, 1.0), 0.0, 0.0, 0.0, 0.0)


@compiled
def _inside(passed, tau):
    """``Inside`` of a step, a time tau after it begins."""
    problem, row, entry = passed.problem, passed.row, passed.entry
    if not problem.stretches[row.stretch].linear:
        return _numeric_inside(passed.record, row, passed.number, tau)
    piece, forcing = problem.pieces[row.stretch], forcing_of(problem.driveline, problem.torque)
    phase = phase_at(forcing, row.time + tau)
    angle, velocity = entry.angle, entry.velocity
    if tau > 0.0:
        angle, velocity = state_at(piece, forcing, entry, tau, phase)
    a = acceleration(piece, forcing, angle, velocity, phase)
    return Inside(angle, velocity, a, piece.offset + piece.slope * velocity)


@compiled
def _widen_by_extreme(passed, early, low, late, high, of_angle, sums):
    """Include an extreme of angle or velocity between two samples, by secants (Illinois).

    early, late : times of the samples;  low, high : derivatives there
    """
    for _ in range(_REFINED):
        at = late - high * (late - early) / (high - low)
        here = _inside(passed, at)
        widen(sums, here.angle, here.velocity)
        middle = here.velocity if of_angle else here.acceleration
        if (middle < 0.0) == (high < 0.0):
            late, high, low = at, middle, 0.5 * low
        else:
            early, low, high = at, middle, 0.5 * high


@compiled
def _add_step(passed, sums):
    """Add a step."""
    problem, row = passed.problem, passed.row
    driveline, rest = problem.driveline, problem.driveline.rest_velocity
    linear = problem.stretches[row.stretch].linear
    natural = math.sqrt(driveline.stiffness / driveline.inertia)
    fastest = max(problem.torque.angular_frequency, natural)
    parts = 1 + int(row.duration * fastest / _CELL) if linear else PARTS
    before, time = _inside(passed, 0.0), 0.0
    widen(sums, row.angle, row.velocity)
    for sample in range(parts * NODES.size + 1):
        part, node = sample // NODES.size, sample % NODES.size
        tau = row.duration * (part + NODES[node]) / parts if part < parts else row.duration
        if part < parts and not linear:
            here = _numeric_node(passed.record, row, passed.number, part, node, driveline.inertia)
        else:
            here = _inside(passed, tau)
        if part < parts:
            sums.heat += row.duration / parts * WEIGHTS[node] * here.torque * (here.velocity - rest)
        widen(sums, here.angle, here.velocity)
        for of_angle in (False, True):
            low = before.velocity if of_angle else before.acceleration
            high = here.velocity if of_angle else here.acceleration
            if (low < 0.0) != (high < 0.0):
                _widen_by_extreme(passed, time, low, tau, high, of_angle, sums)
        before, time = here, tau


@compiled
def add(record, problem, trail, left, sums):
    """Add ``left`` rows of a trail to ``sums``, of dtype ``motion_sums.SUMS``.

    record : as in ``_Step``
    """
    number = 0
    for row in trail[:left]:
        _add_step(_Step(problem, record, row, _entered(problem, row), number), sums)
        if not problem.stretches[row.stretch].linear:
            number += 1
