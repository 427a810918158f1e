"""A periodic orbit near a guess: Newton's method, on the flow and then on its equations."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from wedgebrake.analysis.classify_run import classify_run
from wedgebrake.analysis.run_settings import LIMIT, protocol
from wedgebrake.continuation.curves import OrbitCurve
from wedgebrake.continuation.discontinuity_induced import violated
from wedgebrake.continuation.equations import Equations, FloatArray, NoOrbitError, multipliers
from wedgebrake.continuation.flow import run
from wedgebrake.continuation.orbit import MOST_PIECES, Orbit, OrbitStatus, told
from wedgebrake.continuation.palc import NotConvergedError, newton
from wedgebrake.continuation.problem import Family
from wedgebrake.continuation.segment_bvp import from_log, goes_through
from wedgebrake.continuation.stroboscopic_map import Strobe
from wedgebrake.continuation.symmetry import is_symmetric, prime_order
from wedgebrake.dynamics.enums import MotionClass, Outcome
from wedgebrake.errors import InputError
from wedgebrake.model.system import BrakedDriveline
from wedgebrake.model.validation import check_instance, check_whole
from wedgebrake.solvers.simulate import check_limits, check_state, choose_method

_MOST_ORDER = 512
# Steps of Newton's method on the flow; it need not converge, only come near.
_STEPS, _NEAR = 40, 1e-7
# Guesses that are tried, the nearest returns first.
_GUESSES = 16
# Search for an orbit if the motion has not settled: highest order, initial guesses for each order,
# and periods of the run from which they are taken, of which the first ones are skipped.
_LONGEST, _SPREAD, _LOOKED, _SKIPPED = 8, 24, 1200, 200
_FAILED = (NotConvergedError, NoOrbitError)


def orbit(
    system: BrakedDriveline,
    order: int | None = None,
    *,
    initial: tuple[float, float] | None = None,
    method: str | None = None,
    rtol: float = 1e-10,
    limit: int = LIMIT,
) -> Orbit:
    """A periodic orbit, stable or not (docs/theory.md, section 13).

    Parameters
    ----------
    system : BrakedDriveline
        What moves.
    order : int
        Periods of the torque in the orbit. Default: that of the motion that the system
        settles to from ``initial``. Another than that one's may be unstable; it is looked for
        from the points where the motion nearly returns.
    initial : (angle [rad], velocity [rad/s])
        With ``order``: a guess of a point of the orbit at t = 0. Without: where the motion
        begins that is waited for; default rest.
    method : {"exact", "smooth"}
        Default: "exact" for Coulomb and tabulated friction, "smooth" for smooth laws.
    rtol : float
        Tolerance of "smooth", see ``simulate``.
    limit : int
        Most periods to wait for the motion to settle.

    Returns
    -------
    Orbit
        State, Floquet multipliers, pieces and more; ``status`` says whether it was found, and
        ``message`` what can be done if not.

    Raises ``InputError`` for arguments that are wrong or do not fit the friction law.
    """
    chosen = check(system, order, method, rtol)
    start = None if initial is None else check_state("initial", initial)
    settling = protocol(None, "auto", limit)
    family = Family(system, method=chosen, rtol=float(rtol))
    if order is not None and start is not None:
        return _near(family, order, [np.array(start)])
    result, record = classify_run(system, start or (0.0, 0.0), chosen, settling)
    if result.outcome != Outcome.COMPLETED:
        return Orbit(system, chosen, family.rtol, OrbitStatus.NO_RUN, order or 0)
    if result.motion == MotionClass.AT_REST:
        return Orbit(system, chosen, family.rtol, OrbitStatus.AT_REST, order or 0)
    settled = int(result.order)
    if order is None and not settled:
        unsettled = result.motion == MotionClass.UNDECIDED
        why = OrbitStatus.NOT_SETTLED if unsettled else OrbitStatus.NOT_PERIODIC
        return Orbit(system, chosen, family.rtol, why, 0)
    wanted = order or settled
    if wanted == settled:
        final = np.array([result.final_angle, result.final_velocity])
        return _near(family, wanted, [final])
    return _near(family, wanted, _guesses(record, wanted))


def orbit_to_follow(
    system: BrakedDriveline,
    order: int | None = None,
    *,
    initial: tuple[float, float] | None = None,
    method: str | None = None,
    rtol: float = 1e-10,
) -> Orbit:
    """First orbit of a branch: that of ``orbit``, or a stable one near an irregular motion.

    The duration of a chaotic transient depends on the last bits of the run. If the motion is
    still irregular after the longest transient, the result is the stable orbit of the fewest
    periods to which Newton's method converges from near returns of the motion, if there is one.
    """
    found = orbit(system, order, initial=initial, method=method, rtol=rtol)
    if found.status not in (OrbitStatus.NOT_PERIODIC, OrbitStatus.NOT_SETTLED):
        return found
    if not _isolated(system):
        return found
    family = Family(system, method=found.method, rtol=found.rtol)
    run_for = protocol(_LOOKED, _SKIPPED, rtol=found.rtol)
    result, record = classify_run(system, initial or (0.0, 0.0), found.method, run_for)
    if result.outcome != Outcome.COMPLETED:
        return found
    for fewest in range(1, _LONGEST + 1):
        returns = _returns(record, fewest)[: len(record) // 3]
        # Evenly spaced guesses: the nearest often belong to one passage and lead to the same orbit.
        for k in returns[:: max(1, len(returns) // _SPREAD)]:
            near = _near(family, fewest, [record[k]])
            if near.found and near.stable:
                return near
    return found


def check(system: Any, order: Any, method: str | None, rtol: Any) -> str:
    """The solver's name; raises ``InputError`` for what no orbit can be found with."""
    check_instance("system", system, BrakedDriveline)
    chosen = choose_method(system, method)
    if chosen == "ode14x":
        raise InputError(
            "method = 'ode14x': a fixed step that chatters has no derivative. Use 'exact' or"
            " 'smooth', by the friction law."
        )
    check_limits(rtol, 1e-4, 1, 1)
    if order is not None:
        check_whole("order", order, 1, _MOST_ORDER, "a whole number of periods")
    return chosen


def _guesses(record: FloatArray, order: int) -> list[FloatArray]:
    """Points from which the motion nearly returns, the nearest first, and the mean of all."""
    nearest = [record[k] for k in _returns(record, order)[:_GUESSES]]
    mean = np.mean(record, axis=0)
    return [mean, *nearest] if order == 1 else [*nearest, mean]


def _returns(record: FloatArray, order: int) -> list[int]:
    """Indices of the points of a record, sorted by the distance of the motion's return."""
    size = np.ptp(record, axis=0) + 1e-300
    apart = np.linalg.norm((record[order:] - record[:-order]) / size, axis=1)
    return [int(k) for k in np.argsort(apart)]


def _isolated(system: BrakedDriveline) -> bool:
    """Return True if orbits are isolated: no shift in time or angle gives another orbit."""
    return system.driveline.stiffness != 0.0 and system.excitation.amplitude != 0.0


def _near(family: Family, order: int, guesses: list[FloatArray]) -> Orbit:
    """The first orbit of this order that one of the guesses leads to."""
    base = family.base
    status = OrbitStatus.NOT_CONVERGED
    if not _isolated(base):
        status = OrbitStatus.NOT_ISOLATED
    for equations, unknowns in _candidates(family, order, guesses):
        if equations.size > 2 * MOST_PIECES:
            status = OrbitStatus.TOO_LONG
            continue
        steps: list[float] = []
        try:
            curve = OrbitCurve.through(equations, family, unknowns, ())
            y, _ = newton(curve, curve.scaled(unknowns, ()), None, steps)
            solved = curve.unscaled(y)[0]
            if not is_orbit(equations, solved, family.problem(())):
                continue
        except _FAILED:
            continue
        points = equations.points(solved, family.problem(()))
        if prime_order(points, base.excitation.angular_frequency) < order:
            status = OrbitStatus.OF_LOWER_ORDER
            continue
        if is_symmetric(equations, solved, family, ()):
            equations, solved = equations.halved(solved)
        found = multipliers(*equations.invariants(solved, family.problem(())))
        measures = equations.measures(solved, family.problem(()), family.base)
        return told(family, equations, solved, found, points, measures, steps)
    return Orbit(family.base, family.method, family.rtol, status, order)


def is_orbit(equations: Equations, unknowns: FloatArray, problem: Any) -> bool:
    """Whether a solution of the equations is an orbit of the system."""
    if equations.margins(unknowns, problem).size == 0:
        return True
    from wedgebrake.continuation.segment_bvp import Chain

    if violated(equations.margins(unknowns, problem)):
        return False
    return not isinstance(equations, Chain) or goes_through(equations, unknowns, problem)


def _candidates(
    family: Family, order: int, guesses: list[FloatArray]
) -> Iterator[tuple[Equations, FloatArray]]:
    """Equations with a guess of their solution, for each guess of a state."""
    problem = family.problem(())
    for guess in guesses:
        try:
            state = _approached(family, guess, order)
            if family.method == "smooth":
                yield _strobe(state, order, problem)
                continue
            chain = from_log(run(problem, state, order).log, problem, order)
        except _FAILED:
            continue
        if chain is not None:
            yield chain


def _strobe(state: FloatArray, order: int, problem: Any) -> tuple[Strobe, FloatArray]:
    """The states at each period, from the first."""
    states = [state]
    for _ in range(order - 1):
        states.append(Strobe(1).through(states[-1], problem, 1)[0])
    return Strobe(order), np.concatenate(states)


def _approached(family: Family, guess: FloatArray, order: int) -> FloatArray:
    """A state from which the flow nearly returns: damped Newton on x = P^n(x)."""
    problem = family.problem(())
    line, omega = family.base.driveline, family.base.excitation.angular_frequency
    weight = np.array([line.natural_frequency or omega, 1.0])
    state = guess.copy()
    end, matrix = _returned(family, problem, state, order)
    for _ in range(_STEPS):
        gap = end - state
        error = float(np.linalg.norm(weight * gap))
        if error <= _NEAR * float(np.linalg.norm(weight * state)):
            break
        try:
            step = np.linalg.solve(matrix - np.eye(2), -gap)
        except np.linalg.LinAlgError:
            raise NotConvergedError from None
        for _ in range(8):
            try:
                there, derivative = _returned(family, problem, state + step, order)
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
    family: Family, problem: Any, state: FloatArray, order: int
) -> tuple[FloatArray, FloatArray]:
    """P^n and its derivative."""
    if family.method == "exact":
        there = run(problem, state, order)
        return there.end, there.matrix
    return Strobe(1).through(state, problem, order)
