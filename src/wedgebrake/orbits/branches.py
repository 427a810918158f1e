"""Branches of periodic orbits over a parameter, with those that leave them, in one dataset."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from wedgebrake.errors import InputError
from wedgebrake.model.part import is_number, shown
from wedgebrake.model.system import BrakedDriveline
from wedgebrake.orbits.branch import Branch
from wedgebrake.orbits.family import Family
from wedgebrake.orbits.orbit import Orbit
from wedgebrake.orbits.point import BranchPoint
from wedgebrake.orbits.ranges import Range, exact_scale, make_ranges, value_of
from wedgebrake.orbits.shooting import check, orbit
from wedgebrake.orbits.switching import leaving
from wedgebrake.orbits.symmetry import alike, is_odd, prime_order

if TYPE_CHECKING:
    import xarray as xr

STEP, POINTS, SWITCH = 0.02, 2000, 2
_MOST_POINTS, _MOST_LEVELS = 1_000_000, 20
# Orbits of more periods are not looked for where branches leave: their windows are narrow.
_MOST_ORDER = 16
# Ends of branches nearer than this share of the range are one bifurcation.
_SAME = 1e-6
# Poincare points nearer than this share of their size are those of one orbit.
_ALIKE = 1e-5
# The same for an orbit at another value near by.
_LIKE = 0.02
# Ends of branches may miss what they meet by this share of the range.
_NEAR = 1e-3
# How far beside the end of a branch the one that it has met is begun, as a share of the range.
_ASIDE = 1e-3


@dataclass(frozen=True)
class Followed:
    """A branch that was followed.

    origin : number, among all bifurcations in their order, of the one it leaves; -1: none
    begin  : why it begins where it does, in words
    """

    branch: Branch
    origin: int
    begin: str


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
        range.

    Returns
    -------
    Branch
        Each ``next`` gives a ``BranchPoint``. ``points``, ``bifurcations``, ``step`` and
        ``end`` can be watched, ``stop()`` ends it.

    Raises ``InputError`` for arguments that are wrong, or an orbit that was not found.
    """
    if not isinstance(orbit, Orbit):
        raise InputError(f"orbit = {shown(orbit)}: must be an Orbit, as wb.orbit(system) gives it.")
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


def branches(
    system: BrakedDriveline,
    *,
    order: int | None = None,
    initial: tuple[float, float] | None = None,
    method: str | None = None,
    rtol: float = 1e-10,
    switch: int = SWITCH,
    opposite: bool = True,
    step: float = STEP,
    points: int = POINTS,
    progress: Callable[[Branch], None] | None = None,
    **parameter: tuple[float, float],
) -> xr.Dataset:
    """Branches of periodic orbits over one parameter, stable and unstable, with bifurcations.

    Parameters
    ----------
    system : BrakedDriveline
        What is changed.
    **parameter : (float, float)
        One SI parameter or group with its ends, for example ``eta=(12, -60)``. The first
        branch begins at the first end.
    order, initial, method, rtol
        Of the orbit that it begins with, as for ``wb.orbit``.
    switch : int
        How many times over branches that leave a branch are followed (at period doublings,
        symmetry breakings, branch points, and where the motion jumps): 0 none, 1 those that
        leave the first, ... Of more than 16 periods none is.
    opposite : bool
        Whether a second branch begins at the other end, with the motion that settles there,
        unless the first one has come there.
    step, points
        As for ``wb.continuation``, for each branch.
    progress : callable
        Gets the ``Branch`` after each of its points.

    Returns
    -------
    xarray.Dataset
        Over ``point``, branch after branch: the parameter, ``branch``, ``order``, ``stable``,
        ``sequence``, Floquet multipliers, amplitudes, sticks and events in a period of the
        torque, Poincare points. Over ``bifurcation``: kind, value (located to 1e-8 of the
        range or better), effect. Over ``branch_number``: where each comes from and why it ends.

    Raises ``InputError`` for arguments that are wrong, and where there is no orbit to begin.
    """
    from wedgebrake.orbits.dataset import assemble

    check(system, order, method, rtol)
    (over,) = make_ranges(system, parameter, 1)
    first = begun(system, over, order=order, initial=initial, method=method, rtol=rtol)
    followed = follow(
        first, over, switch=switch, opposite=opposite, step=step, points=points, progress=progress
    )
    return assemble(system, over, followed)


def begun(system: BrakedDriveline, over: Range, **settings: Any) -> Orbit:
    """The orbit at the first end of a range; ``InputError`` where there is none.

    settings : of ``orbit``
    """
    first = orbit(system.replace(**{over.name: over.first}), settings.pop("order"), **settings)
    if not first.found:
        raise InputError(
            f"{over.name} = {over.first:g}: there is no orbit to begin with. {first.message}"
        )
    return first


def follow(
    first: Orbit,
    over: Range,
    *,
    switch: int = SWITCH,
    opposite: bool = True,
    step: float = STEP,
    points: int = POINTS,
    progress: Callable[[Branch], None] | None = None,
) -> list[Followed]:
    """The branches themselves, in the order in which they were found.

    first : an orbit at the first end of the range
    """
    whole = isinstance(switch, int | np.integer) and not isinstance(switch, bool)
    if not whole or not 0 <= switch <= _MOST_LEVELS:
        raise InputError(f"switch = {shown(switch)}: must be a whole number, 0 to {_MOST_LEVELS}.")
    if not isinstance(opposite, bool):
        raise InputError(f"opposite = {shown(opposite)}: must be True or False.")
    settings: dict[str, Any] = {"step": step, "points": points}
    branch = continuation(first, **settings | {over.name: (over.first, over.last)})
    followed = [_followed(branch, -1, "begin of the range", progress)]
    _follow_leaving(followed, 0, switch, progress)
    other = _opposite(first, over, followed) if opposite else None
    if other is not None:
        back = continuation(other, **settings | {over.name: (over.last, over.first)})
        followed.append(_followed(back, -1, "end of the range", progress))
        _follow_leaving(followed, len(followed) - 1, switch, progress)
    return followed


def _follow_leaving(
    followed: list[Followed],
    root: int,
    levels: int,
    progress: Callable[[Branch], None] | None,
) -> None:
    """Append the branches that leave one of the list, those that leave these, and so on."""
    begin, end = root, root + 1
    for _ in range(levels):
        for place in range(begin, end):
            number = sum(len(one.branch.bifurcations) for one in followed[:place])
            branch = followed[place].branch
            for point in branch.bifurcations:
                followed += _leaving(point, number, followed, progress)
                number += 1
            if branch.jumps:
                followed += _beyond_jump(branch, number - 1, followed, progress)
            if branch.met:
                followed += _parents(branch, place, followed, progress)
        begin, end = end, len(followed)


def _opposite(first: Orbit, over: Range, known: list[Followed]) -> Orbit | None:
    """The orbit that the motion settles to at the other end; None if there is none, or a known."""
    other = orbit(
        first.system.replace(**{over.name: over.last}), method=first.method, rtol=first.rtol
    )
    if not other.found:
        return None
    omega = other.system.excitation.angular_frequency
    for one in known:
        last = one.branch.points[-1]
        near = abs(last.value - over.last) <= _SAME * over.scale
        if near and last.order == other.order and alike(last.points, other.points, omega, _ALIKE):
            return None
    return other


def _leaving(
    point: BranchPoint,
    number: int,
    known: list[Followed],
    progress: Callable[[Branch], None] | None,
) -> list[Followed]:
    """The branches that leave a bifurcation and are not known yet."""
    first = known[0].branch
    low, high = first.bounds
    omega = point.system.excitation.angular_frequency
    for one in known:
        last = one.branch.points[-1]
        near = abs(last.value - point.value) <= _NEAR * (high - low)
        if near and one.branch.met and last.order % point.order == 0:
            repeated = np.tile(point.points, (last.order // point.order, 1))
            if last.order <= 2 * point.order and alike(last.points, repeated, omega, _LIKE):
                return []
    found = []
    for origin, start in leaving(point) if 2 * point.order <= _MOST_ORDER else ():
        rising = start.direction[-1] > 0.0
        branch = Branch(start, first.bounds, rising, first.largest, first.most, [origin])
        begin = point.bifurcation.kind.value if point.bifurcation is not None else ""
        found.append(_followed(branch, number, begin, progress))
    return found


def _beyond_jump(
    branch: Branch,
    number: int,
    known: list[Followed],
    progress: Callable[[Branch], None] | None,
) -> list[Followed]:
    """The branch of the motion that is found just beyond a jump, if it is not known yet."""
    before, last = branch.points[-2:]
    low, high = branch.bounds
    onward = math.copysign(_SAME * (high - low), last.value - before.value)
    value, (name,), family = last.value + onward, last.family.names, last.family
    if not low < value < high:
        return []
    found = orbit(
        family.base.replace(**{name: value}), initial=(last.points[0, 0], last.points[0, 1]),
        method=family.method, rtol=family.rtol,
    )  # fmt: skip
    if not found.found or _is_near(found, value, known):
        return []
    end = high if onward > 0.0 else low
    step = branch.largest * family.scales[0] / (high - low)
    further = continuation(found, step=step, points=branch.most, **{name: (value, end)})
    return [_followed(further, number, "beyond a jump", progress)]


def _parents(
    branch: Branch,
    place: int,
    known: list[Followed],
    progress: Callable[[Branch], None] | None,
) -> list[Followed]:
    """Both ways along the branch that one has met at its end, if it is not known yet."""
    last, family, (low, high) = branch.points[-1], branch.points[-1].family, branch.bounds
    fewer = prime_order(last.points, last.system.excitation.angular_frequency, _LIKE)
    (name,) = family.names
    # A little beside, so that one of the two passes the bifurcation where they meet.
    value = last.value + _ASIDE * (high - low) * (1.0 if last.value < 0.5 * (low + high) else -1.0)
    found = orbit(
        family.base.replace(**{name: value}), fewer, initial=(last.points[0, 0], last.points[0, 1]),
        method=family.method, rtol=family.rtol,
    )  # fmt: skip
    if not found.found or _is_near(found, value, known):
        return []
    step = branch.largest * family.scales[0] / (high - low)
    begin = f"beside the end of branch {place + 1}"
    both = [
        continuation(found, step=step, points=branch.most, **{name: ends})
        for ends in ((value, low), (value, high))
    ]
    return [_followed(one, -1, begin, progress) for one in both]


def _is_near(found: Orbit, value: float, known: list[Followed]) -> bool:
    """Whether a branch passes by the value with an orbit like it."""
    omega = found.system.excitation.angular_frequency
    for one in known:
        same = [point for point in one.branch.points if point.order == found.order]
        values = [point.value for point in same]
        if not same or not min(values) <= value <= max(values):
            continue
        nearest = min(same, key=lambda point: abs(point.value - value))
        near = abs(nearest.value - value) <= one.branch.largest * nearest.family.scales[0]
        if near and alike(nearest.points, found.points, omega, _LIKE):
            return True
    return False


def _followed(
    branch: Branch, origin: int, begin: str, progress: Callable[[Branch], None] | None
) -> Followed:
    for _ in branch:
        if progress is not None:
            progress(branch)
    return Followed(branch, origin, begin)


def check_step(step: Any, points: Any) -> None:
    """Refuse, with ``InputError``, steps that lead nowhere."""
    if not is_number(step) or not 1e-6 <= step <= 0.5:
        raise InputError(
            f"step = {shown(step)}: must be a number, 1e-6 to 0.5. It is a share of the range."
        )
    whole = isinstance(points, int | np.integer) and not isinstance(points, bool)
    if not whole or not 2 <= points <= _MOST_POINTS:
        raise InputError(f"points = {shown(points)}: must be a whole number, 2 to {_MOST_POINTS}.")
