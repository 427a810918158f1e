"""All branches from the ends of a range: what leaves a branch, lies beyond a jump, or is met."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from wedgebrake.continuation.branch import Branch
from wedgebrake.continuation.branch_switching import leaving
from wedgebrake.continuation.continuation import POINTS, STEP, continuation
from wedgebrake.continuation.deduplication import CLOSED, lies_on, marks
from wedgebrake.continuation.equations import FloatArray
from wedgebrake.continuation.orbit import Orbit
from wedgebrake.continuation.point import BranchPoint
from wedgebrake.continuation.ranges import Range
from wedgebrake.continuation.shooting import orbit, orbit_to_follow
from wedgebrake.continuation.symmetry import alike, prime_order
from wedgebrake.model.validation import check_instance, check_whole

SWITCH = 2
_MOST_LEVELS = 20
# Orbits of more periods are not looked for where branches leave: their windows are narrow.
_MOST_ORDER = 16
# How far beyond a jump the motion there is looked for, as a share of the range.
_ONWARD = 1e-6
# Poincare points nearer than this share of their size may be those of one orbit, at another value
# near by.
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
    check_whole("switch", switch, 0, _MOST_LEVELS)
    check_instance("opposite", opposite, bool)
    settings: dict[str, Any] = {"step": step, "points": points}
    branch = continuation(first, **settings | {over.name: (over.first, over.last)})
    followed = [_followed(branch, -1, "begin of the range", [], progress)]
    _follow_leaving(followed, 0, switch, progress)
    other = _opposite(first, over, followed) if opposite else None
    if other is not None:
        back = continuation(other, **settings | {over.name: (over.last, over.first)})
        followed.append(_followed(back, -1, "end of the range", followed, progress))
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
    other = orbit_to_follow(
        first.system.replace(**{over.name: over.last}), method=first.method, rtol=first.rtol
    )
    if not other.found:
        return None
    if _is_known(other.points, over.last, known):
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
    found: list[Followed] = []
    for origin, start in leaving(point) if 2 * point.order <= _MOST_ORDER else ():
        rising = start.direction[-1] > 0.0
        if _is_known(start.points, start.value, [*known, *found]):
            continue
        branch = Branch(start, first.bounds, rising, first.largest, first.most, [origin])
        begin = point.bifurcation.kind.value if point.bifurcation is not None else ""
        found.append(_followed(branch, number, begin, [*known, *found], progress))
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
    onward = math.copysign(_ONWARD * (high - low), last.value - before.value)
    value, (name,), family = last.value + onward, last.family.names, last.family
    if not low < value < high:
        return []
    found = orbit(
        family.base.replace(**{name: value}), initial=(last.points[0, 0], last.points[0, 1]),
        method=family.method, rtol=family.rtol,
    )  # fmt: skip
    if not found.found or _is_known(found.points, value, known):
        return []
    # The whole range: beyond a fold it may come back, over the value that it is begun at.
    ends = (low, high) if onward > 0.0 else (high, low)
    step = branch.largest * family.scales[0] / (high - low)
    further = continuation(found, step=step, points=branch.most, **{name: ends})
    return [_followed(further, number, "beyond a jump", known, progress)]


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
    if not found.found or _is_known(found.points, value, known):
        return []
    step = branch.largest * family.scales[0] / (high - low)
    begin = f"beside the end of branch {place + 1}"
    both: list[Followed] = []
    for ends in ((high, low), (low, high)):
        further = continuation(found, step=step, points=branch.most, **{name: ends})
        both.append(_followed(further, -1, begin, [*known, *both], progress))
        if further.end == CLOSED:
            # One way round is all of it.
            break
    return both


def _is_known(points: FloatArray, value: float, known: list[Followed]) -> bool:
    """Whether an orbit, by its Poincare points, is on a branch that was followed."""
    return any(lies_on(points, value, one.branch.points) for one in known)


def _followed(
    branch: Branch,
    origin: int,
    begin: str,
    known: list[Followed],
    progress: Callable[[Branch], None] | None,
) -> Followed:
    for number, one in enumerate(known, 1):
        branch.marks += marks(one.branch.points, f"goes on as branch {number}")
    for _ in branch:
        if progress is not None:
            progress(branch)
    return Followed(branch, origin, begin)
