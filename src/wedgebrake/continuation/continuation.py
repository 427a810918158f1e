"""``continuation``: the branch of one orbit over a parameter."""

from __future__ import annotations

from typing import Any

import numpy as np

from wedgebrake.continuation.branch import Branch
from wedgebrake.continuation.orbit import Orbit
from wedgebrake.continuation.point import BranchPoint
from wedgebrake.continuation.problem import Family
from wedgebrake.continuation.ranges import exact_scale, make_ranges, value_of
from wedgebrake.continuation.symmetry import is_odd
from wedgebrake.errors import InputError
from wedgebrake.model.validation import check_instance, check_number, check_whole, shown

STEP, POINTS = 0.02, 2000
_MOST_POINTS = 1_000_000


def continuation(
    orbit: Orbit, *, step: float = STEP, points: int = POINTS, **parameter: tuple[float, float]
) -> Branch:
    """The branch of an orbit over a parameter, as an iterator (docs/theory.md, section 13).

    Parameters
    ----------
    orbit : Orbit
        Where it begins, as ``wb.orbit`` found it.
    step : float
        Longest step along the branch, as a share of the range.
    points : int
        Most points, bifurcations among them.
    **parameter : (float, float)
        One SI parameter or group with its ends, for example ``eta=(12, -60)``: the branch
        sets out from the orbit's own value towards the second, and ends where it leaves the
        range, or has closed.

    Returns
    -------
    Branch
        Each ``next`` gives a ``BranchPoint``. ``points``, ``bifurcations``, ``step`` and
        ``end`` can be watched, ``stop()`` ends it.

    Raises ``InputError`` for arguments that are wrong, or an orbit that was not found.
    """
    check_instance("orbit", orbit, Orbit, "an Orbit, as wb.orbit(system) gives it")
    if orbit._solved is None:
        raise InputError(f"orbit: was not found ({orbit.status.value}). {orbit.message}")
    check_step(step, points)
    (over,) = make_ranges(orbit.system, parameter, 1)
    value = value_of(orbit.system, over.name)
    low, high = over.bounds
    if not low <= value <= high:
        raise InputError(
            f"{over.name} = {shown(parameter[over.name])}: must contain {value:g}, where the orbit"
            f" is. Find the orbit at {over.name}={over.first:g} first, or widen the range."
        )
    equations, unknowns = orbit._solved
    if not is_odd(orbit.system.replace(**{over.name: over.last})):
        # An orbit that is its own mirror image does not stay so.
        equations, unknowns = equations.whole(unknowns)
    family = Family(orbit.system, (over.name,), (over.scale,), method=orbit.method, rtol=orbit.rtol)
    start = BranchPoint(family, (value,), equations, unknowns, orbit.multipliers, np.empty(0))
    largest = float(step) * over.scale / exact_scale(over)
    return Branch(start, over.bounds, over.last > over.first, largest, int(points))


def check_step(step: Any, points: Any) -> None:
    """Refuse, with ``InputError``, steps that lead nowhere."""
    why = " It is a share of the range."
    check_number("step", step, 1e-6, 0.5, "a number, 1e-6 to 0.5", why)
    check_whole("points", points, 2, _MOST_POINTS)
