"""``orbit``: a periodic orbit near a guess, by Newton's method on the flow and its equations."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np

from wedgebrake.analysis.classify_driveline import classify_driveline
from wedgebrake.analysis.motion import as_machine
from wedgebrake.analysis.run_settings import LIMIT, protocol
from wedgebrake.dynamics.enums import MotionClass, Outcome
from wedgebrake.errors import InputError
from wedgebrake.model.machine import Machine
from wedgebrake.model.system import BrakedDriveline, check_driveline
from wedgebrake.model.validation import check_whole
from wedgebrake.orbits.curves import OrbitCurve, OrbitSolution
from wedgebrake.orbits.machine_shooting import guesses
from wedgebrake.orbits.orbit import MOST_SEGMENTS, Orbit, OrbitStatus
from wedgebrake.orbits.palc import FAILED, NotConvergedError, newton
from wedgebrake.orbits.problem import FloatArray, NoOrbitError, OrbitProblem
from wedgebrake.orbits.return_map import ReturnMap
from wedgebrake.orbits.segment_bvp import from_log, run
from wedgebrake.orbits.stroboscopic_map import StroboscopicMap
from wedgebrake.solvers.machine.final_state import FinalState
from wedgebrake.solvers.machine.passage import Crossing
from wedgebrake.solvers.machine.simulate import machine_method
from wedgebrake.solvers.simulate import check_limits, check_state, choose_method

_MOST_ORDER = 512
# Steps of Newton's method on the flow, which need only approximate the orbit.
_STEPS, _NEAR = 40, 1e-7
# Number of guesses that are tried, the nearest returns first.
_GUESSES = 16
# Search for an orbit if the motion has not settled: highest order, initial guesses for each order,
# and periods of the run from which they are taken, of which the first ones are skipped.
_HIGHEST_ORDER, _SPREAD, _RECORDED, _SKIPPED = 8, 24, 1200, 200


def orbit(
    system: BrakedDriveline | Machine,
    order: int | None = None,
    *,
    initial: tuple[float, float] | FinalState | None = None,
    method: str | None = None,
    rtol: float = 1e-10,
    limit: int = LIMIT,
) -> Orbit:
    """A periodic orbit, stable or not (docs/theory.md, section 13).

    Parameters
    ----------
    system : BrakedDriveline or Machine
        System of which an orbit is sought.
    order : int
        Periods of the torque in the orbit; of a machine without varying signals the number of
        times that a speed returns to a level. Default: that of the motion to which the system
        settles from ``initial``. Orbits of other orders may be unstable; they are sought from
        the points where that motion nearly returns.
    initial : (angle [rad], velocity [rad/s]) or FinalState
        With ``order``: a guess of a point of the orbit at t = 0. Without: the start of the
        motion that settles; default rest. Of a machine it is a ``FinalState``.
    method : {"exact", "smooth"}
        Default: "exact" for Coulomb, tabulated and Stribeck friction, "smooth" for smooth laws.
    rtol : float
        Tolerance of "smooth", see ``simulate``.
    limit : int
        Largest number of periods to wait for the motion to settle.

    Returns
    -------
    Orbit
        State, Floquet multipliers, segments and more; ``status`` says whether it was found, and
        ``message`` gives a remedy if not.

    Raises ``InputError`` for arguments that are invalid or do not fit the friction law.
    """
    chosen = check(system, order, method, rtol)
    if isinstance(system, Machine):
        return _of_machine(system, order, initial, limit, (chosen, float(rtol)))
    start = None if initial is None else check_state("initial", initial)
    settling = protocol(None, "auto", limit)
    problem = OrbitProblem(system, method=chosen, rtol=float(rtol))
    if order is not None and start is not None:
        return _near(problem, order, [np.array(start)])
    result, record = classify_driveline(system, start or (0.0, 0.0), chosen, settling)
    if result.outcome != Outcome.COMPLETED:
        return Orbit(system, chosen, problem.rtol, OrbitStatus.NO_RUN, order or 0)
    if result.motion == MotionClass.AT_REST:
        return Orbit(system, chosen, problem.rtol, OrbitStatus.AT_REST, order or 0)
    settled = int(result.order)
    if order is None and not settled:
        unsettled = result.motion == MotionClass.UNDECIDED
        why = OrbitStatus.NOT_SETTLED if unsettled else OrbitStatus.NOT_PERIODIC
        return Orbit(system, chosen, problem.rtol, why, 0)
    wanted = order or settled
    if wanted == settled:
        final = np.array([result.final_angle, result.final_velocity])
        return _near(problem, wanted, [final])
    return _near(problem, wanted, _guesses(record, wanted))


def orbit_to_follow(
    system: BrakedDriveline | Machine,
    order: int | None = None,
    *,
    initial: tuple[float, float] | FinalState | None = None,
    method: str | None = None,
    rtol: float = 1e-10,
    like: OrbitSolution | None = None,
) -> Orbit:
    """First orbit of a branch: that of ``orbit``, or a stable one near an irregular motion.

    The duration of a chaotic transient depends on the last bits of the run. If the motion is
    still irregular after the longest transient, the result is the stable orbit of the fewest
    periods to which Newton's method converges from near returns of the motion, if there is one.

    like : orbit with which the result will be compared
    """
    if isinstance(system, Machine) and like is not None:
        # The same section, so that orbits can be compared.
        section = like.problem.crossing
        return _of_machine(
            system, order, initial, LIMIT, (like.problem.method, float(rtol)), section
        )  # fmt: skip
    found = orbit(system, order, initial=initial, method=method, rtol=rtol)
    if found.status not in (OrbitStatus.NOT_PERIODIC, OrbitStatus.NOT_SETTLED):
        return found
    if isinstance(system, Machine) or not _isolated(system):
        return found
    problem = OrbitProblem(system, method=found.method, rtol=found.rtol)
    run_for = protocol(_RECORDED, _SKIPPED, rtol=found.rtol)
    start = check_state("initial", initial or (0.0, 0.0))
    result, record = classify_driveline(system, start, found.method, run_for)
    if result.outcome != Outcome.COMPLETED:
        return found
    for fewest in range(1, _HIGHEST_ORDER + 1):
        returns = _returns(record, fewest)[: len(record) // 3]
        # Evenly spaced guesses: the nearest often belong to one passage and lead to the same orbit.
        for k in returns[:: max(1, len(returns) // _SPREAD)]:
            near = _near(problem, fewest, [record[k]])
            if near.found and near.stable:
                return near
    return found


def check(system: Any, order: Any, method: str | None, rtol: Any) -> str:
    """Name of the solver; raises ``InputError`` for arguments with which no orbit can be found."""
    if order is not None:
        check_whole("order", order, 1, _MOST_ORDER, "a whole number of returns")
    if isinstance(system, Machine):
        return machine_method(method, system)
    check_driveline(system)
    chosen = choose_method(system, method)
    if chosen == "ode14x":
        raise InputError(
            "method = 'ode14x': a fixed step that chatters has no derivative. Use 'exact' or"
            " 'smooth', by the friction law."
        )
    check_limits(rtol, 1e-4, 1, 1)
    return chosen


def _of_machine(
    system: Machine, order: int | None, initial: Any, limit: int, solver: tuple[str, float],
    section: Crossing | None = None,
) -> Orbit:  # fmt: skip
    """``orbit`` for a machine.

    solver : its method and rtol
    """
    (method, rtol), (machine, start) = solver, as_machine(system, initial)
    given = guesses(machine, order, start, limit, method=method, rtol=rtol, section=section)
    if given.status is not OrbitStatus.FOUND:
        return Orbit(machine, method, rtol, given.status, given.order)
    first = [given.record[-1]] if given.settled else _guesses(given.record, given.order)
    found = _near(given.problem, given.order, first)
    if given.stuck and found.status is OrbitStatus.NOT_CONVERGED:
        # The angles that a contact holds for ever are arbitrary.
        return replace(found, status=OrbitStatus.NOT_ISOLATED)
    return found


def _guesses(record: FloatArray, order: int) -> list[FloatArray]:
    """Points to which the motion nearly returns, nearest first, and the mean of all points."""
    nearest = [record[k] for k in _returns(record, order)[:_GUESSES]]
    mean = np.mean(record, axis=0)
    return [mean, *nearest] if order == 1 else [*nearest, mean]


def _returns(record: FloatArray, order: int) -> list[int]:
    """Indices of the points of a record, sorted by the distance of the motion's return."""
    size = np.ptp(record, axis=0) + 1e-300
    apart = np.linalg.norm((record[order:] - record[:-order]) / size, axis=1)
    return [int(k) for k in np.argsort(apart)]


def _isolated(system: BrakedDriveline | Machine) -> bool:
    """Return True if orbits are isolated: no shift in time or angle gives another orbit."""
    if isinstance(system, Machine):
        return True
    return system.driveline.stiffness != 0.0 and system.excitation.amplitude != 0.0


def _near(problem: OrbitProblem, order: int, guesses: list[FloatArray]) -> Orbit:
    """The first orbit of this order found from one of the guesses."""
    status = OrbitStatus.NOT_CONVERGED
    if not _isolated(problem.base):
        status = OrbitStatus.NOT_ISOLATED
    for candidate in _candidates(problem, order, guesses):
        if candidate.equations.size > 2 * MOST_SEGMENTS:
            status = OrbitStatus.TOO_LONG
            continue
        steps: list[float] = []
        try:
            curve = OrbitCurve(candidate)
            y, _ = newton(curve, curve.scaled(candidate), None, steps)
            solved = curve.solution(y)
            if not solved.is_orbit:
                continue
        except FAILED:
            continue
        if solved.prime_order() < order:
            status = OrbitStatus.OF_LOWER_ORDER
            continue
        if solved.is_symmetric():
            equations, unknowns = solved.equations.halved(solved.unknowns)
            solved = replace(solved, equations=equations, unknowns=unknowns)
        return Orbit.of(solved, steps)
    return Orbit(problem.base, problem.method, problem.rtol, status, order)


def _candidates(
    problem: OrbitProblem, order: int, guesses: list[FloatArray]
) -> Iterator[OrbitSolution]:
    """Equations with a guess of their solution, for each guess of a state."""
    kernel_problem = problem.kernel_problem(())
    for guess in guesses:
        try:
            state = _approach(problem, guess, order)
            equations = _shooting(problem, order, state.size)
            if equations is not None:
                points, _ = equations.iterated(state, kernel_problem, order - 1)
                yield OrbitSolution(problem, (), equations, points.ravel())
                continue
            found = from_log(run(kernel_problem, state, order).log, kernel_problem, order)
        except FAILED:
            continue
        if found is not None:
            yield OrbitSolution(problem, (), *found)


def _approach(problem: OrbitProblem, guess: FloatArray, order: int) -> FloatArray:
    """A state to which the flow nearly returns: damped Newton's method on x = P^n(x)."""
    weight = np.ones(guess.size)
    if not isinstance(problem.base, Machine):
        line, omega = problem.base.driveline, problem.base.excitation.angular_frequency
        weight[0] = line.natural_frequency or omega
    state = guess.copy()
    end, matrix = _returned(problem, state, order)
    for _ in range(_STEPS):
        gap = end - state
        error = float(np.linalg.norm(weight * gap))
        if error <= _NEAR * float(np.linalg.norm(weight * state)):
            break
        try:
            step = np.linalg.solve(matrix - np.eye(state.size), -gap)
        except np.linalg.LinAlgError:
            raise NotConvergedError from None
        for _ in range(8):
            try:
                there, derivative = _returned(problem, state + step, order)
            except NoOrbitError:
                step = 0.25 * step
                continue
            if np.linalg.norm(weight * (there - state - step)) < error:
                state, end, matrix = state + step, there, derivative
                break
            step = 0.5 * step
        else:
            raise NotConvergedError
    return state


def _returned(
    problem: OrbitProblem, state: FloatArray, order: int
) -> tuple[FloatArray, FloatArray]:
    """P^n, the state n returns later, and its derivative."""
    kernel_problem, equations = problem.kernel_problem(()), _shooting(problem, order, state.size)
    if equations is None:
        there = run(kernel_problem, state, order)
        return there.end, there.matrix
    points, matrix = equations.iterated(state, kernel_problem, order)
    return points[-1], matrix


def _shooting(
    problem: OrbitProblem, order: int, dimension: int
) -> ReturnMap | StroboscopicMap | None:
    """Equations by multiple shooting; None with set-valued friction, whose segments are known."""
    if isinstance(problem.base, Machine):
        return ReturnMap(order, dimension)
    return StroboscopicMap(order) if problem.method == "smooth" else None
