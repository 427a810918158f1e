"""``orbit``: a periodic orbit near a guess, by Newton's method on the flow and its equations."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np

from wedgebrake.analysis.run_settings import LIMIT
from wedgebrake.arrays import FloatArray
from wedgebrake.model.machine import Machine
from wedgebrake.model.system import BrakedDriveline
from wedgebrake.model.system_base import own_names
from wedgebrake.model.validation import check_whole
from wedgebrake.orbits.curves import OrbitCurve, OrbitSolution
from wedgebrake.orbits.equations.equations import NoOrbitError
from wedgebrake.orbits.orbit import Orbit
from wedgebrake.orbits.orbit_status import MOST_SEGMENTS, OrbitStatus
from wedgebrake.orbits.palc import FAILED, NotConvergedError, least_norm, newton
from wedgebrake.orbits.problems.choose_problem import AMPLITUDES, orbit_problem
from wedgebrake.orbits.problems.problem import Guesses, OrbitProblem, returns_by_distance
from wedgebrake.solvers.machine.final_state import FinalState

_MOST_ORDER = 512
# Steps of Newton's method on the flow, which need only approximate the orbit.
_STEPS, _NEAR = 40, 1e-7
# Singular values, as shares of the largest, that count as zero: on the way to a family of orbits,
# in the last steps, and at an orbit of it, where they are rounding. Distance, in scaled unknowns,
# at which another orbit of the family is sought.
_NEARLY_SINGULAR, _SINGULAR, _VANISHES, _ASIDE = 1e-2, 1e-6, 1e-10, 1e-3
# Largest amplitude of an equilibrium, as a share of the size of its state.
_STILL = 1e-9
# Search for an orbit if the motion has not settled: highest order, and guesses for each order.
_HIGHEST_ORDER, _SPREAD = 8, 24
# Outcomes of the search for a limit cycle near which there may be an equilibrium.
_MAYBE_EQUILIBRIUM = (OrbitStatus.STEADY_SLIDING, OrbitStatus.NOT_CONVERGED)


def orbit(
    system: BrakedDriveline | Machine,
    order: int | None = None,
    *,
    initial: tuple[float, float] | FinalState | None = None,
    method: str | None = None,
    rtol: float = 1e-10,
    limit: int = LIMIT,
) -> Orbit:
    """A periodic orbit, stable or not (docs/numerics.md, "Periodic orbits").

    Parameters
    ----------
    system : BrakedDriveline or Machine
        System of which an orbit is sought.
    order : int
        Periods of the torque (of a machine, of the signals) in the orbit; crossings of its section
        if no signal varies. Default: that of the motion to which the system settles from
        ``initial``. Orbits of other orders may be unstable; they are sought from
        the points where that motion nearly returns.
    initial : (angle [rad], velocity [rad/s]) or FinalState
        With ``order``: a guess of a point of the orbit at t = 0. Without: the start of the
        motion that settles; default rest, or the initial state of the machine. A pair is that of
        a single inertia.
    method : {"exact", "smooth"}
        Default: "exact" for Coulomb, tabulated and Stribeck friction, "smooth" for smooth laws.
    rtol : float
        Tolerance of "smooth", see ``simulate``.
    limit : int
        Largest number of periods or crossings to wait for the motion to settle.

    Returns
    -------
    Orbit
        State, Floquet multipliers, segments and more; ``status`` says whether it was found, and
        ``message`` gives a remedy if not. Of a continuous family of orbits the nearest one, with
        ``isolated`` False; ``continuation`` refuses it.

    Raises ``InputError`` for arguments that are invalid or do not fit the friction law.
    """
    with own_names(system):
        problem = orbit_problem(system, method, rtol)
        found = _orbit_of(problem, order, initial, limit)
        if not problem.self_excited or found.status not in _MAYBE_EQUILIBRIUM:
            return found
        # Without a torque, an equilibrium is an orbit of any period.
        driven = orbit_problem(system, method, rtol, AMPLITUDES)
        still = found if driven.self_excited else _orbit_of(driven, order, initial, limit)
    return still if still.found else found


def orbit_to_follow(
    problem: OrbitProblem,
    order: int | None = None,
    initial: tuple[float, float] | FinalState | None = None,
) -> Orbit:
    """First orbit of a branch: that of ``orbit``, or a stable one near an irregular motion.

    The duration of a chaotic transient depends on the last bits of the run. If the motion is
    still irregular after the longest transient, the result is the stable orbit of the fewest
    periods to which Newton's method converges from near returns of the motion, if there is one.
    """
    found = _orbit_of(problem, order, initial, LIMIT)
    if found.status not in (OrbitStatus.NOT_PERIODIC, OrbitStatus.NOT_SETTLED):
        return found
    record = problem.irregular_record(initial)
    for fewest in range(1, _HIGHEST_ORDER + 1) if len(record) else ():
        returns = returns_by_distance(record, fewest)[: len(record) // 3]
        # Evenly spaced guesses: the nearest often belong to one passage and lead to the same orbit.
        for k in returns[:: max(1, len(returns) // _SPREAD)]:
            near = _near(Guesses(OrbitStatus.FOUND, problem, fewest, [record[k]]))
            if near.found and near.stable:
                return near
    return found


def _orbit_of(problem: OrbitProblem, order: int | None, initial: Any, limit: int) -> Orbit:
    """``orbit`` of a problem."""
    if order is not None:
        check_whole("order", order, 1, _MOST_ORDER, "a whole number of returns")
    given = problem.guesses(order, initial, limit)
    if given.status is OrbitStatus.FOUND:
        return _near(given)
    return Orbit(problem.base, problem.method, problem.rtol, given.status, given.order)


def _near(given: Guesses) -> Orbit:
    """The first orbit found from one of the guesses: isolated ones, then those of families."""
    found = _solved(given, isolated=True)
    if given.isolated and found.status is OrbitStatus.NOT_CONVERGED:
        return _solved(given, isolated=False)
    return found


def _solved(given: Guesses, *, isolated: bool) -> Orbit:
    """The first isolated orbit, or the first one of a family, found from one of the guesses."""
    problem, order = given.problem, given.order
    status = OrbitStatus.NOT_CONVERGED if given.isolated else OrbitStatus.NOT_ISOLATED
    for candidate in _candidates(given, 0.0 if isolated else _NEARLY_SINGULAR):
        if candidate.equations.size > 2 * MOST_SEGMENTS:
            status = OrbitStatus.TOO_LONG
            continue
        steps: list[float] = []
        try:
            curve = OrbitCurve(candidate)
            guess = curve.scaled(candidate)
            if isolated:
                y, _ = newton(curve, guess, None, steps)
            else:
                y = _of_family(curve, guess, steps)
            solved = curve.solution(y)
            if not solved.is_orbit or (problem.self_excited and _is_still(solved)):
                continue
        except FAILED:
            continue
        if solved.prime_order() < order:
            status = OrbitStatus.OF_LOWER_ORDER
            continue
        if solved.is_symmetric():
            equations, unknowns = solved.equations.halved(solved.unknowns)
            solved = replace(solved, equations=equations, unknowns=unknowns)
        return Orbit.of(solved, steps, isolated)
    return Orbit(problem.base, problem.method, problem.rtol, status, order)


def _of_family(curve: OrbitCurve, guess: FloatArray, steps: list[float]) -> FloatArray:
    """The orbit nearest to a guess among a continuous family of orbits of one system, as y.

    Raises ``NotConvergedError`` if it does not converge, or if the orbit is isolated, as where a
    fold or branch point happens to be: there another solution is found in neither direction in
    which the derivative vanishes, at a distance that a family would have.
    """
    y, matrix = newton(curve, guess, None, steps, rank=_SINGULAR)
    _, sizes, rows = np.linalg.svd(matrix)
    if sizes[-1] > _VANISHES * sizes[0]:
        raise NotConvergedError
    for side in (1.0, -1.0):
        aside = y + side * _ASIDE * rows[-1]
        try:
            other, matrix = newton(curve, aside, None, rank=_SINGULAR)
        except FAILED:
            continue
        sizes = np.linalg.svd(matrix, compute_uv=False)
        # The solutions lie on a curve with this tangent: its bend moves them by a square.
        along = side * float(rows[-1] @ (other - y))
        if along > 0.5 * _ASIDE and sizes[-1] <= _VANISHES * sizes[0]:
            return y
    raise NotConvergedError


def _is_still(orbit: OrbitSolution) -> bool:
    """Return True for an equilibrium, to which Newton's method may also converge."""
    size = float(np.linalg.norm(orbit.section.scaled(orbit.points[0])))
    return orbit.measures.velocity_amplitude <= _STILL * size


def _candidates(given: Guesses, rank: float) -> Iterator[OrbitSolution]:
    """Equations with a guess of their solution, for each guess of a point.

    rank : as for ``newton``
    """
    problem = given.problem
    for guess in given.points:
        try:
            near = _approach(problem, guess, given.order, rank)
            found = problem.equations_at(near, given.order)
        except FAILED:
            continue
        if found is not None:
            yield OrbitSolution(problem, (), *found)


def _approach(problem: OrbitProblem, guess: FloatArray, order: int, rank: float) -> FloatArray:
    """A point to which the flow nearly returns: damped Newton's method on x = P^n(x).

    rank : as for ``newton``
    """
    weights, point = problem.weights, guess.copy()
    end, matrix = problem.returned(point, order)
    for _ in range(_STEPS):
        gap = end - point
        error = float(np.linalg.norm(weights * gap))
        if error <= _NEAR * float(np.linalg.norm(weights * point)):
            break
        try:
            slope = matrix - np.eye(point.size)
            step = least_norm(slope, -gap, rank) if rank else np.linalg.solve(slope, -gap)
        except np.linalg.LinAlgError:
            raise NotConvergedError from None
        for _ in range(8):
            try:
                there, derivative = problem.returned(point + step, order)
            except NoOrbitError:
                step = 0.25 * step
                continue
            if np.linalg.norm(weights * (there - point - step)) < error:
                point, end, matrix = point + step, there, derivative
                break
            step = 0.5 * step
        else:
            raise NotConvergedError
    return point
