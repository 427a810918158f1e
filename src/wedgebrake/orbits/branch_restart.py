"""Where a branch goes on beyond a discontinuity-induced bifurcation, and where all motion ends."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import brentq

from wedgebrake.errors import InputError
from wedgebrake.orbits.bifurcation_types import Bifurcation, Margin, Scenario
from wedgebrake.orbits.curves import OrbitCurve, OrbitSolution
from wedgebrake.orbits.discontinuity_induced import Transition, transition
from wedgebrake.orbits.palc import FAILED, CurvePoint, corrected
from wedgebrake.orbits.segment_bvp import Codes, SegmentBVP
from wedgebrake.orbits.shooting import is_orbit

PERMANENT = "permanent sticking: every angle that the brake holds is an equilibrium"
# Lengths [rad] of inserted segments, in the order in which they are tried.
_LENGTHS = (1e-3, 1e-4, 1e-2, 1e-5, 1e-6, 1e-7)
# First steps beyond, as shares of the longest.
_STEPS = (1e-3, 1e-4, 1e-2)
# Slips shorter than this [rad] approach the onset of permanent sticking, which is no further
# than this (scaled).
_SHORT, _REACH = 0.05, 1e-3
_TWO_SLIPS = (0, 1, 0, -1)


@dataclass(frozen=True, eq=False)
class Restart:
    """Continuation of a branch beyond a discontinuity-induced bifurcation.

    curve, point : where the branch continues; None where it does not
    why          : then the reason
    """

    bifurcation: Bifurcation
    curve: OrbitCurve | None = None
    point: CurvePoint | None = None
    why: str = ""


def restart(
    curve: OrbitCurve, came: float, at: CurvePoint, margins: list[Margin], longest: float
) -> Restart | None:
    """The branch beyond a point where some margins vanish; None where it was not found.

    came    : change of the scaled parameter on the way to it. The direction there does not tell:
              on the side of a short segment it stands square to the parameter.
    longest : step along the branch
    """
    solution = curve.solution(at.y)
    equations = solution.equations
    found = transition(solution, margins)
    if found is None:
        return None
    assert isinstance(equations, SegmentBVP)  # noqa: S101 - others have no margins
    kind, effect, ends = found.kind, found.effect(equations.codes), tuple(margins)
    if found.jump:
        why = f"{kind.value}, beyond which the motion jumps"
        return Restart(Bifurcation(kind, effect, Scenario.JUMP, margins=ends), why=why)
    if not found.nodes:
        return Restart(Bifurcation(kind, effect, margins=ends), why=PERMANENT)
    beyond = replace(
        solution,
        equations=SegmentBVP(found.codes, equations.order, half=equations.half),
        unknowns=found.unknowns,
    )
    attempts = _grown(beyond, found) if found.inserted else _further(beyond, longest)
    for there, point in attempts:
        if is_orbit(there.solution(point.y)):
            on = came * (point.y[-1] - at.y[-1]) > 0.0
            scenario = Scenario.PERSISTENCE if on else Scenario.FOLD
            return Restart(Bifurcation(kind, effect, scenario, margins=ends), there, point)
    return None


def _grown(solution: OrbitSolution, found: Transition) -> Iterator[tuple[OrbitCurve, CurvePoint]]:
    """Solutions on which the inserted segments last a little."""
    for length in _LENGTHS:
        unknowns = solution.unknowns.copy()
        normal = np.zeros(unknowns.size + len(solution.values))
        for segment, share in found.inserted:
            begin, end = 2 * segment, 2 * (segment + 1) % unknowns.size
            unknowns[begin] -= share * length
            unknowns[end] += (1.0 - share) * length
            normal[begin] -= 1.0
            normal[end] += 1.0
        guess = replace(solution, unknowns=unknowns)
        curve = OrbitCurve(guess)
        normal = normal * curve.scales
        normal /= np.linalg.norm(normal)
        try:
            yield curve, corrected(curve, curve.scaled(guess), normal)
        except FAILED:
            continue


def _further(solution: OrbitSolution, longest: float) -> Iterator[tuple[OrbitCurve, CurvePoint]]:
    """Solutions a little further to both sides, on one of which the fewer segments are an orbit."""
    curve = OrbitCurve(solution)
    along = np.zeros(curve.scales.size)
    along[-1] = 1.0
    try:
        at = corrected(curve, curve.scaled(solution), along)
    except FAILED:
        return
    for step in _STEPS:
        for side in (1.0, -1.0):
            guess = at.y + side * step * longest * at.direction
            try:
                yield curve, corrected(curve, guess, at.direction, side * at.direction)
            except FAILED:
                continue


def onset_of_permanent_sticking(curve: OrbitCurve, at: CurvePoint) -> OrbitSolution | None:
    """The orbit whose slips vanish just ahead of a point; None if there is none near.

    Towards it the remaining slips become short together. What they add up to in angle falls like
    the cube of their durations and is lost in rounding before they vanish; but the parameter is
    known: the brake at rest holds just the whole swing of the torque, upper - lower = 2 T_e.
    """
    solution = curve.solution(at.y)
    equations, values = solution.equations, solution.values
    if not isinstance(equations, SegmentBVP) or len(values) != 1:
        return None
    codes = np.array(equations.all_codes)
    durations = solution.margins["duration"]
    slips = codes[: durations.size] != 0
    turns = [turn for turn in range(codes.size) if tuple(np.roll(codes, turn)) == _TWO_SLIPS]
    if not turns or np.any(durations[slips] > _SHORT):
        return None
    reach = math.copysign(_REACH * curve.scales[-1], at.direction[-1])
    try:
        ends = values[0], values[0] + reach
        if _spare(curve, ends[0]) * _spare(curve, ends[1]) >= 0.0:
            return None
        value = float(brentq(lambda one: _spare(curve, one), *ends, xtol=1e-300, rtol=1e-15))
    except InputError:
        return None
    problem = curve.problem.kernel_problem((value,))
    # Forwards at the torque's crest, backwards at its trough; the angle is that of both.
    angle = (problem.torque.amplitude - problem.brake.upper) / problem.driveline.stiffness
    phases = _crests(equations.all_codes, solution.unknowns[0::2])
    unknowns = np.column_stack((phases, np.full(phases.size, angle))).ravel()
    return replace(solution, values=(value,), unknowns=unknowns)


def _spare(curve: OrbitCurve, value: float) -> float:
    """Width of the brake's holding interval beyond the swing of the torque [N m]."""
    problem = curve.problem.kernel_problem((value,))
    brake = problem.brake
    return float(brake.upper - brake.lower - 2.0 * problem.torque.amplitude)


def _crests(codes: Codes, phases: np.ndarray) -> np.ndarray:
    """Phase of the torque's crest or trough nearest to each node, by the slip beside it."""
    crests = np.empty(phases.size)
    for node, phase in enumerate(phases):
        crest = 0.5 * math.pi if (codes[node] or codes[node - 1]) > 0 else 1.5 * math.pi
        crests[node] = crest + 2.0 * math.pi * round((phase - crest) / (2.0 * math.pi))
    return crests
