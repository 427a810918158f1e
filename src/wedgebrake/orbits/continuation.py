"""``continuation``: the branch of an orbit, or of the limit cycles at a Hopf point."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from wedgebrake.analysis.linear_stability.hopf import StabilityLimit
from wedgebrake.errors import InputError
from wedgebrake.model.studies.study_run import METHODS
from wedgebrake.model.studies.sweep_settings import joined
from wedgebrake.model.validation import (
    check_choice,
    check_instance,
    check_number,
    check_whole,
    shown,
    wrong,
)
from wedgebrake.orbits.branches.branch import Branch
from wedgebrake.orbits.branches.hopf_start import bounds_around, first_cycle
from wedgebrake.orbits.equations.equations import NoOrbitError
from wedgebrake.orbits.orbit import BranchPoint, Orbit
from wedgebrake.orbits.palc import NotConvergedError
from wedgebrake.orbits.ranges import Range, check_ranges, make_ranges
from wedgebrake.solvers.simulate import check_limits

STEP, LONGEST_STEP = 0.02, 0.5
POINTS, _MOST_POINTS = 2000, 1_000_000
# Default tolerance of "smooth".
RTOL = 1e-10


class NotFollowedError(InputError):
    """An orbit cannot be followed over one range, but possibly over others."""


def continuation(
    orbit: Orbit | StabilityLimit,
    over: Mapping[str, tuple[float, float]] | None = None,
    *,
    step: float = STEP,
    points: int = POINTS,
    method: str | None = None,
    rtol: float = RTOL,
    **parameter: tuple[float, float],
) -> Branch:
    """The branch of an orbit over a parameter, as an iterator (docs/numerics.md, "Branches").

    Parameters
    ----------
    orbit : Orbit or StabilityLimit
        Start of the branch: an orbit as found by ``wb.orbit``, or a Hopf point of steady sliding
        as found by ``wb.hopf``, at which a branch of limit cycles begins, stable or unstable. The
        parameter of the branch must be that of the Hopf point.
    over : mapping
        The parameter and its ends, instead of a keyword, for names with a dot: for example
        ``{"belt.base_speed": (0.3, 1.4)}``.
    step : float
        Longest step along the branch, as a share of the range.
    points : int
        Largest number of points, including bifurcations.
    method, rtol
        As for ``wb.orbit``, if the branch begins at a Hopf point; an orbit has its own.
    **parameter : (float, float)
        One SI parameter or group with its ends, for example ``eta=(12, -60)``: the branch
        starts at the orbit's own value towards the second end, and ends where it leaves the
        range or closes. From a Hopf point it goes in the direction of the limit cycles.

    Returns
    -------
    Branch
        Each ``next`` gives a ``BranchPoint``. ``points``, ``bifurcations``, ``step`` and
        ``end`` can be read at any time; ``stop()`` ends it.

    Raises ``InputError`` for invalid arguments, or an orbit that was not found.
    """
    if method is not None:
        check_choice("method", method, METHODS)
    check_limits(rtol=rtol)
    if isinstance(orbit, StabilityLimit):
        (along,) = make_ranges(orbit.system, joined(over, parameter), 1)
        check_step(step, points)
        return branch_from(first_cycle(orbit, along, method, rtol), along, step, points)
    check_instance(
        "orbit", orbit, Orbit, "an Orbit, the result of wb.orbit(system), or the result of wb.hopf"
    )
    if orbit._solution is None:
        raise InputError(
            f"orbit: was not found ({orbit.status.value}). {orbit.message}",
            name="orbit", value=orbit.status.value, allowed="an orbit that was found",
        )  # fmt: skip
    if not orbit.isolated:
        raise InputError(
            f"orbit: {orbit.message}",
            name="orbit", value=orbit.verdict, allowed="an isolated orbit",
        )  # fmt: skip
    if method not in (None, orbit.method):
        raise wrong("method", method, f"{orbit.method!r}, the method of the orbit")
    if rtol not in (RTOL, orbit.rtol):
        raise wrong("rtol", rtol, f"{orbit.rtol!r}, the tolerance of the orbit")
    check_step(step, points)
    parameter = joined(over, parameter)
    (along,) = make_ranges(orbit.system, parameter, 1)
    value = orbit.system.value(along.name)
    low, high = along.bounds
    if not low <= value <= high:
        raise wrong(
            along.name, parameter[along.name],
            f"a range that contains {value:g}, where the orbit is",
            f"Find the orbit at {along.name}={along.first:g} first, or widen the range.",
        )  # fmt: skip
    problem, equations = orbit._solution.problem, orbit._solution.equations
    unknowns = orbit._solution.unknowns
    if not problem.covers(problem.base.replace(**{along.name: along.last})):
        problem, equations, unknowns = problem.general(equations, unknowns)
    problem = problem.over((along.name,), (along.exact_scale,))
    if not problem.has_odd_symmetry((along.last,)):
        # An orbit that is its own mirror image does not stay so.
        equations, unknowns = equations.whole(unknowns)
    start = BranchPoint(problem, (value,), equations, unknowns, orbit.multipliers, np.empty(0))
    asked = f"{along.name} = {shown(parameter[along.name])}"
    given: Any = {
        "name": along.name, "value": parameter[along.name],
        "allowed": "a range with orbits near the present value",
    }  # fmt: skip
    try:
        return branch_from(start, along, step, points)
    except NotConvergedError:
        raise NotFollowedError(
            f"{asked}: the orbit at {value:g} cannot be followed over this range, because no"
            " neighbouring orbit was found. Begin at another value, or narrow the range.",
            **given,
        ) from None
    except NoOrbitError:
        raise InputError(
            f"{asked}: must contain values near {value:g} at which there is an orbit, and there"
            " are none. Vary another parameter, or begin at another value.",
            **given,
        ) from None


def branch_from(start: BranchPoint, along: Range, step: float, points: int) -> Branch:
    """The branch that begins at a point, over a range."""
    check_ranges(start.problem, [along])
    # Unknowns are scaled by the power of two.
    longest = float(step) * along.scale / along.exact_scale
    bounds = along.bounds if start.bifurcation is None else bounds_around(start.value, along)
    return Branch(start, bounds, along.last > along.first, longest, int(points))


def check_step(step: Any, points: Any) -> None:
    """Refuse, with ``InputError``, steps and numbers of points out of range."""
    why = " It is a share of the range."
    check_number("step", step, 1e-6, LONGEST_STEP, f"a number, 1e-6 to {LONGEST_STEP}", why)
    check_whole("points", points, 2, _MOST_POINTS)
