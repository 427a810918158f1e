"""Initial guesses of orbits of a machine, from its settled motion or from close returns."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from wedgebrake.analysis.machine_motion.classify_machine import classify_machine
from wedgebrake.analysis.machine_motion.coordinates import Coordinates
from wedgebrake.analysis.machine_motion.section import crossing
from wedgebrake.analysis.run_settings import protocol
from wedgebrake.dynamics.enums import MotionClass, Outcome
from wedgebrake.model.machine import Machine
from wedgebrake.model.validation import wrong
from wedgebrake.orbits.machine_flow import check_samples
from wedgebrake.orbits.orbit import OrbitStatus
from wedgebrake.orbits.problem import FloatArray, OrbitProblem
from wedgebrake.solvers.machine.final_state import FinalState
from wedgebrake.solvers.machine.passage import Course, Crossing, Every

# Natural periods in which a motion of unknown period is looked at, and returns that are recorded.
_LOOK, _RECORDED = 8.0, 400
# Time until a return, as a multiple of the period of the motion, after which there is none.
PATIENCE = 100.0
# Beyond one period, so that rounding does not hide its last crossing; entries that are rounding.
_ONE_PERIOD, _ROUNDING = 1.0 - 1e-6, 1e-9


class Guesses(NamedTuple):
    """Initial guesses of Newton's method.

    status  : FOUND, or why there is no orbit
    problem : the machine with its section
    order   : number of returns in the orbit
    record  : (k, size) points of the section, the last one on the orbit if ``settled``
    stuck   : whether a contact never slides
    """

    status: OrbitStatus
    problem: OrbitProblem
    order: int = 0
    record: FloatArray = np.empty((0, 0))
    settled: bool = True
    stuck: bool = False


def guesses(
    machine: Machine, order: int | None, initial: FinalState | None, limit: int,
    *, method: str, rtol: float, section: Crossing | None = None,
) -> Guesses:  # fmt: skip
    """Find points near an orbit on a section of a machine.

    section : section of a self-excited machine; None to choose one from the motion

    Raises ``InputError`` for signals without a common period.
    """
    if machine.period is None:
        raise wrong(
            "machine.period", None, "a common period of all signals",
            "The signals have none, so that no orbit closes. Use wb.motion.",
        )  # fmt: skip
    check_samples(machine)
    nothing = OrbitProblem(machine, method=method, rtol=rtol)
    if order is not None and initial is not None:
        problem = _problem(nothing, initial, math.nan, section)
        return Guesses(OrbitStatus.FOUND, problem, order, _record(problem, initial, 1), True)
    found = classify_machine(machine, protocol(None, "auto", limit), initial, method)
    if found.outcome != Outcome.COMPLETED or found.final is None:
        return Guesses(OrbitStatus.NO_RUN, nothing, order or 0)
    if found.motion in _STEADY:
        return Guesses(_STEADY[found.motion], nothing, order or 0)
    if order is None and not found.order:
        unsettled = found.motion == MotionClass.UNDECIDED
        why = OrbitStatus.NOT_SETTLED if unsettled else OrbitStatus.NOT_PERIODIC
        return Guesses(why, nothing, 0)
    problem = _problem(nothing, found.final, found.period, section)
    stuck = bool(np.any(found.contacts.stick_share >= 1.0 - _ROUNDING))
    settled = found.order
    if settled and machine.autonomous:
        settled = _crossings(problem, found.final, found.period)
    if order in (None, settled):
        record = _record(problem, found.final, settled)
        return Guesses(OrbitStatus.FOUND, problem, settled, record, True, stuck)
    record = _record(problem, found.final, _RECORDED)
    return Guesses(OrbitStatus.FOUND, problem, order or 0, record, False, stuck)


_STEADY = {
    MotionClass.AT_REST: OrbitStatus.AT_REST,
    MotionClass.STEADY_SLIDING: OrbitStatus.STEADY_SLIDING,
}


def _problem(
    plain: OrbitProblem, state: FinalState, period: float, section: Crossing | None
) -> OrbitProblem:
    """The problem with a section chosen from the motion that begins at a state."""
    machine = plain.base
    if not isinstance(machine, Machine) or not machine.autonomous:
        return plain
    if not math.isfinite(period):
        period = _LOOK * 2.0 * math.pi / (plain.space.frequency or 1.0)
    return OrbitProblem(
        machine, method=plain.method, rtol=plain.rtol, longest=PATIENCE * period,
        crossing=section or _choose(machine, plain, state, period),
    )  # fmt: skip


def _course(problem: OrbitProblem, state: FinalState, watched: FloatArray | None = None) -> Course:
    """Run of the motion that begins at a state."""
    machine = problem.system(())
    return Course(machine, state, works=False, method=problem.method, watched=watched)


def _choose(machine: Machine, plain: OrbitProblem, state: FinalState, period: float) -> Crossing:
    """Choose the section of a self-excited motion.

    The rate of an angle that shafts restrain has a mean of zero over every orbit, so that every
    orbit of a branch crosses this level. Of these rates, the one with the fewest crossings is
    chosen; among equals, the one with the fewest sticks there, and then with the largest range.
    """
    space = plain.space
    chosen: list[tuple[int, int, float, Crossing]] = []
    sections = [
        Crossing(tuple(map(float, row)), 0.0) for row in restrained_rates(machine, space)
    ]  # fmt: skip
    for section in sections:
        row = np.array(section.row)
        course = _course(plain, state, row[None, :])
        if len(course.advance(section, 1, duration=period).times):
            sticks = int(np.sum(course.state.modes["side"] == 0))
            passage = course.advance(section, duration=_ONE_PERIOD * period)
            reach = float(passage.high[0] - passage.low[0])
            chosen.append((len(passage.times), sticks, -reach, section))
    if chosen:
        return min(chosen, key=lambda one: one[:3])[3]
    course = _course(plain, state, space.to)
    return crossing(course.advance(None, duration=period), space)


def restrained_rates(machine: Machine, space: Coordinates) -> FloatArray:
    """Rates of the angles that are restrained by shafts, as rows of factors of the states.

    These are the rates of the scaled angles, and the speeds of inertias that cannot rotate freely.
    """
    n, states = len(machine.inertias), space.to.shape[1]
    rates = np.zeros((space.speeds.start + n, states))
    rates[: space.speeds.start, n : 2 * n] = space.to[: space.speeds.start, :n]
    rates[space.speeds.start :, n : 2 * n] = np.eye(n)
    turns = rates[:, n : 2 * n] @ (np.eye(states) - space.back @ space.to)[:n, :n]
    rates = rates[np.abs(turns).max(axis=1) <= _ROUNDING * np.abs(rates).max(axis=1)]
    return np.asarray(rates / np.linalg.norm(rates @ space.back, axis=1)[:, None])


def _crossings(problem: OrbitProblem, state: FinalState, period: float) -> int:
    """Number of crossings in one period of a motion."""
    course, section = _course(problem, state), problem.crossing
    course.advance(section, 1, duration=2.0 * period)
    return 1 + len(course.advance(section, duration=_ONE_PERIOD * period).times)


def _record(problem: OrbitProblem, state: FinalState, returns: int) -> FloatArray:
    """Points of the section after a state, which itself is the first if it is on the section."""
    flow = problem.kernel_problem(())
    course = _course(problem, state)
    section, begin = flow.section, course.state.z[: flow.space.to.shape[1], 0].copy()
    if isinstance(section, Every):
        distance, size = math.remainder(state.time, section.period), section.period
    else:
        row = np.array(section.row)
        distance, size = float(row @ begin) - section.level, float(np.abs(row) @ np.abs(begin))
    states = np.empty((0, begin.size))
    if abs(distance) <= _ROUNDING * size:
        states, returns = begin[None, :], returns - 1
    if returns > 0:
        passage = course.advance(section, returns, duration=flow.longest * returns)
        states = np.vstack([states, passage.states])
    return np.asarray(flow.points(states))
