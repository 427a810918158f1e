"""First orbit of the branch of limit cycles that begins at a Hopf point of steady sliding.

Steady sliding is a fixed point of the flow over any time, and its small vibration an eigenvector
of the derivative there. Both are computed from the same flow as the orbits. With the exact method
the Hopf point is therefore that of the straight lines: where steady sliding crosses a kink, or at a
single value for all small orbits.
"""

from __future__ import annotations

import cmath
import math
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from scipy.optimize import brentq

from wedgebrake.analysis.linear_stability.hopf import StabilityLimit
from wedgebrake.analysis.linear_stability.verdict_changes import HOPF
from wedgebrake.analysis.machine_motion.coordinates import Coordinates
from wedgebrake.arrays import FloatArray
from wedgebrake.dynamics.enums import Outcome
from wedgebrake.errors import InputError
from wedgebrake.model.machine import Machine
from wedgebrake.model.machine_parts import speed_at
from wedgebrake.orbits.bifurcation_types import Bifurcation, Kind
from wedgebrake.orbits.curves import OrbitCurve
from wedgebrake.orbits.equations.equations import NoOrbitError
from wedgebrake.orbits.equations.return_map import ReturnMap
from wedgebrake.orbits.orbit import BranchPoint
from wedgebrake.orbits.palc import FAILED, corrected
from wedgebrake.orbits.problems.machine_problem import (
    LONGEST_RETURN,
    MachineOrbitProblem,
    restrained_rates,
)
from wedgebrake.orbits.ranges import Range
from wedgebrake.solvers.kernels import method_of
from wedgebrake.solvers.machine.final_state import FinalState
from wedgebrake.solvers.machine.passage import Course, Crossing, Every, Record
from wedgebrake.solvers.simulate import check_limits

# Times of the flow, as shares of the period of the vibration: a short one, in which no contact
# changes its direction, to approach steady sliding, and one that separates the vibration from
# others.
_SHORT, _QUARTER = 1e-4, 0.25
# Largest number of steps of Newton's method for steady sliding, and its last step relative to the
# speeds.
_STEPS, _STEADY = 40, 1e-12
# Distances of the Hopf point of the flow from that of the linear verdict, as shares of the range.
_NEAREST, _FURTHEST, _FACTOR = 1e-9, 0.2, 2.0
# Largest distance at which a bound of the range counts as the Hopf point, as a share of the range.
_BESIDE = 1e-11
# Tolerances of the value, relative to the interval around it and to itself: rounding.
_XTOL, _RTOL = 1e-15, 1e-15
# Sizes of the first orbit, as shares of that at which a contact would come to rest.
_SIZES = (1e-3, 3e-3, 3e-4, 1e-2, 3e-2, 0.1, 0.3)


class HopfMode(NamedTuple):
    """Small vibration about steady sliding.

    state      : of steady sliding
    eigenvalue : of the critical mode [1/s]
    shape      : of its scaled coordinates, complex, of length one
    sliding    : (contacts,) sliding speeds of steady sliding [rad/s]
    rows       : (contacts, states) factors of the states in the sliding speeds
    """

    state: FloatArray
    eigenvalue: complex
    shape: FloatArray
    sliding: FloatArray
    rows: FloatArray


def first_cycle(
    limit: StabilityLimit, over: Range, method: str | None = None, rtol: float = 1e-10
) -> BranchPoint:
    """Small limit cycle near a Hopf point, labelled as this point, with its direction of growth.

    Raises ``InputError`` if no limit cycles begin at the limit.
    """
    _check_limit(limit, over)
    check_limits(rtol=rtol)
    angles = tuple(one.angle for one in limit.machine.inertias)
    speeds = tuple(speed_at(one, 0.0) for one in limit.machine.inertias)
    problem = MachineOrbitProblem(
        limit.system, method_of(limit.machine, method), float(rtol), (over.name,),
        (over.exact_scale,), longest=LONGEST_RETURN / limit.frequency, start=(angles, speeds),
    )  # fmt: skip
    try:
        value = hopf_value(problem, limit.value, limit.frequency, bounds_around(limit.value, over))
        if value is None:
            raise _refused(
                limit, f"with the {problem.method} method, the stability of steady sliding does not"
                " change within the range. Widen the range, or choose another method",
            )  # fmt: skip
        found = vibration(problem, value, limit.frequency)
    except NoOrbitError:
        raise _refused(
            limit, "steady sliding is not an isolated equilibrium there, or a contact is at rest"
        ) from None
    space = problem.space
    slips = np.abs(found.rows @ (space.back @ found.shape))
    slides = slips > 0.0
    if not slides.any():
        raise _refused(limit, "the critical mode moves no contact")
    # Amplitude at which the first contact comes to rest.
    reach = float(np.min(np.abs(found.sliding[slides]) / slips[slides]))
    section, turn = _section(found, space, limit.machine)
    size = reach * float(np.sum(np.abs(found.shape)))
    problem = replace(problem, crossing=section, size=size)
    flow = problem.kernel_problem((value,))
    centre = flow.points(found.state)
    away = flow.points(found.state + (space.back @ (found.shape * turn)).real) - centre
    direction = np.append(away, 0.0) / np.linalg.norm(away)
    for share in _SIZES:
        start = BranchPoint(
            problem, (value,), ReturnMap(1, centre.size), centre + share * reach * away, (),
            direction, bifurcation=Bifurcation(Kind.HOPF),
        )  # fmt: skip
        try:
            curve = OrbitCurve(start)
            corrected(curve, curve.scaled(start), direction)
        except FAILED:
            continue
        return start
    raise _refused(limit, "Newton's method did not converge to a small cycle")


def _refused(limit: StabilityLimit, why: str) -> InputError:
    """The exception for a stability limit without a branch."""
    return InputError(
        f"limit: no branch of limit cycles was found from {limit.parameter} = {limit.value:g}:"
        f" {why}. Start from wb.orbit(machine) at a value at which the machine vibrates.",
        name="limit", value=limit.value, allowed="a Hopf point of steady sliding",
    )  # fmt: skip


def _check_limit(limit: StabilityLimit, over: Range) -> None:
    """Refuse limits at which no limit cycles begin, and parameters other than that of the limit."""
    if limit.kind != HOPF:
        raise _refused(limit, f"it is not a Hopf point ({limit.kind})")
    if not limit.machine.autonomous:
        raise _refused(limit, "a signal varies in time, so that sliding is not steady")
    if over.name != limit.parameter:
        raise InputError(
            f"{over.name}: must be {limit.parameter}, the parameter of the Hopf point. Find the"
            f" Hopf point in {over.name} with wb.hopf.",
            name="over", value=over.name, allowed=limit.parameter,
        )  # fmt: skip
    low, high = bounds_around(limit.value, over)
    if not low <= limit.value <= high:
        raise InputError(
            f"{over.name} = {(over.first, over.last)!r}: must contain {limit.value:g}, the Hopf"
            " point. Widen the range.",
            name=over.name, value=(over.first, over.last),
            allowed=f"a range around {limit.value:g}",
        )  # fmt: skip


def bounds_around(value: float, over: Range) -> tuple[float, float]:
    """Bounds of a range; one that equals the Hopf point up to rounding is moved beyond it."""
    low, high = over.bounds
    margin = _BESIDE * over.scale
    return (
        low - margin if abs(value - low) <= margin else low,
        high + margin if abs(value - high) <= margin else high,
    )


def vibration(
    problem: MachineOrbitProblem, value: float, frequency: float, start: FinalState | None = None
) -> HopfMode:
    """Steady sliding at a value of the parameter, and its vibration nearest to a frequency [Hz].

    start : a state near steady sliding; None for the initial state of the machine

    Raises ``NoOrbitError`` if there is no isolated steady sliding.
    """
    machine, space = problem.form(problem.system((value,))), problem.space
    course = Course(machine, start, method=problem.method)
    states = course.state.z[: space.to.shape[1], 0].copy()
    for share in (_SHORT, _QUARTER):
        duration = share / frequency
        states, matrix = _steady(course, space, states, duration)
    values, shapes = np.linalg.eig(matrix)
    expected = cmath.exp(2j * math.pi * _QUARTER)
    best = int(np.argmin(np.abs(values - expected)))
    course.restart(states)
    course.advance(Every(duration), 1)  # sets the modes; the state is steady
    rows = course.assembled.problem.sliding
    sliding = rows @ course.state.z[:, 0]
    if np.any(course.state.modes["side"] == 0):
        raise NoOrbitError
    return HopfMode(
        states, cmath.log(values[best]) / duration, shapes[:, best], sliding,
        rows[:, : states.size],
    )  # fmt: skip


def _steady(
    course: Course, space: Coordinates, states: FloatArray, duration: float
) -> tuple[FloatArray, FloatArray]:
    """Fixed point of the flow over a duration, and its derivative, both in scaled coordinates."""
    size, last = states.size, math.inf
    for _ in range(_STEPS):
        course.restart(states)
        found = course.advance(Every(duration), 1, record=Record.DERIVATIVES)
        if found.outcome != Outcome.COMPLETED or not len(found.times):
            raise NoOrbitError
        matrix = space.to @ found.matrices[0][:size, :size] @ space.back
        gap = space.to @ (found.states[0] - states)
        step = np.linalg.lstsq(np.eye(space.size) - matrix, gap, rcond=1e-12)[0]
        length = float(np.linalg.norm(step))
        states = states + space.back @ step
        speeds = float(np.linalg.norm(space.to @ states)) + float(np.abs(gap).max())
        if not math.isfinite(length):
            raise NoOrbitError
        if length <= _STEADY * speeds or (length >= 0.5 * last and length <= 1e-9 * speeds):
            return states, np.asarray(matrix)
        last = length
    raise NoOrbitError


def hopf_value(
    problem: MachineOrbitProblem,
    value: float,
    frequency: float,
    bounds: tuple[float, float],
    start: FinalState | None = None,
) -> float | None:
    """Value near another at which the growth rate of the vibration of the flow crosses zero.

    frequency : of the vibration [Hz]
    bounds    : of the value
    start     : a state near steady sliding; None for the initial state of the machine

    None if there is none within a fifth of the range. Raises ``NoOrbitError`` if there is no
    isolated steady sliding.
    """

    def growth(value: float) -> float:
        return vibration(problem, value, frequency, start).eigenvalue.real

    scale = bounds[1] - bounds[0]
    reach = _NEAREST * scale
    while reach <= _FURTHEST * scale:
        low, high = max(value - reach, bounds[0]), min(value + reach, bounds[1])
        if growth(low) * growth(high) <= 0.0:
            return float(brentq(growth, low, high, xtol=_XTOL * (high - low), rtol=_RTOL))
        reach *= _FACTOR
    return None


def _section(found: HopfMode, space: Coordinates, machine: Machine) -> tuple[Crossing, complex]:
    """Section through steady sliding, and the complex factor of the shape for an upward crossing.

    The rate of an angle that shafts restrain is zero in steady sliding, whatever the parameter.
    """
    swing = space.back @ found.shape
    rows = restrained_rates(machine, space)
    moved = np.abs(rows @ swing)
    if len(rows) and moved.max() > 0.0:
        row, level = rows[int(moved.argmax())], 0.0
    else:
        speeds = space.to[space.speeds]
        row = speeds[int(np.abs(speeds @ swing).argmax())]
        level = float(row @ found.state)
    part = complex(row @ swing)
    return Crossing(tuple(map(float, row)), level), -1j * abs(part) / part
