"""Changes of the linear verdict over one parameter: where they are, and of which kind.

Between two values the cases of sliding either keep their pattern (directions, self-locking, forces
held by a limit), so that eigenvalues change continuously except at corners of friction laws, or
the pattern changes at a value that bisection finds.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from wedgebrake.analysis.linear_stability.machine_stability import Stability
from wedgebrake.model.display import Result

HOPF, DIVERGENCE, FLIP = "hopf", "divergence", "flip"
"""Kinds of changes of vibration, which leave the pattern as it is."""
LOCKING, RELEASE, FORCE_LIMIT, REVERSAL = "self-locking", "release", "force limit", "reversal"
"""Kinds of changes of the pattern."""
NOUNS = {
    HOPF: "Hopf point",
    DIVERGENCE: "Divergence",
    FLIP: "Alternation from sample to sample",
    LOCKING: "Self-locking",
    RELEASE: "Release",
    FORCE_LIMIT: "Limit of the force",
    REVERSAL: "Reversal of sliding",
}
"""Nouns of the kinds, as in texts."""
_WORDS = {-1: "stable", 0: "neutral", 1: "unstable", 2: "locked"}
# Tolerances of values, relative to the interval and to themselves: rounding.
_XTOL, _RTOL = 1e-18, 1e-15
# Two distances of points beside a limit, as shares of the interval, and the share of the change
# across the wider pair up to which that across the narrower one shows a continuous growth rate:
# about the ratio of the distances, its root where two eigenvalues meet, and 1 at a jump.
_WIDE, _NARROW, _SHRUNK = 1e-6, 1e-8, 0.5


class At(Protocol):
    """Linear stability over a parameter; None where there is no such machine or sliding."""

    def __call__(self, value: float, *, modes: bool = False) -> Stability | None:
        """Evaluate it, with its modes or, faster, without them."""
        ...


@dataclass(frozen=True, repr=False)
class VerdictChange(Result):
    """A value of a parameter at which the linear verdict on steady sliding changes.

    value        : of the parameter, in its unit
    kind         : "hopf", "divergence" or "flip" where vibration begins to grow or to decay: the
                   critical mode oscillates, does not, or alternates from sample to sample;
                   "self-locking" where a brake begins to lock itself; "release" and
                   "force limit" where an actuation force begins to be held, at zero by the release
                   or by a limit; "reversal" where the direction of sliding changes
    below, above : verdict on each side: "stable", "unstable" or "neutral"; "locked" where a brake
                   locks itself, "released" and "limited" where the force is held, "none" where
                   there is no steady sliding
    frequency    : of the critical mode [Hz]; 0 if it does not oscillate
    continuous   : False if the growth rate jumps across 0
    """

    value: float
    kind: str
    below: str
    above: str
    frequency: float
    continuous: bool

    @property
    def of_vibration(self) -> bool:
        """True if vibration begins to grow or to decay in the same pattern of sliding."""
        return self.kind in (HOPF, DIVERGENCE, FLIP)

    def as_dict(self) -> dict[str, Any]:
        """Plain values."""
        return dict(vars(self))

    def _headline(self) -> str:
        how = f", {self.frequency:.6g} Hz" if self.kind == HOPF else ""
        sides = f": {self.below} below, {self.above} above"
        return f"{NOUNS[self.kind]} at {self.value:.9g}{how}{sides}"


@dataclass(frozen=True, eq=False)
class Located:
    """A change, with the verdict at its value.

    decides : False if small vibration grows or decays as before: only the pattern changes
    """

    change: VerdictChange
    found: Stability
    decides: bool = True


def verdict_of(found: Stability) -> int:
    """Return 1 if vibration grows, -1 if it decays, 0 if neither, 2 if no sliding exists."""
    if found.critical is None:
        return 2
    if found.stable:
        return -1
    return 1 if found.critical.state == "grows" else 0


def changes_between(at: At, one: float, other: float) -> Iterator[Located]:
    """The changes between two values, in order from the first.

    A pair of changes without a change of the pattern between them is not found.
    """
    width = abs(other - one)
    while one != other:
        first, last = at(one), at(other)
        if first is None:
            return
        if pattern(first) == pattern(last):
            yield from _change_of_vibration(at, one, other)
            return
        same = pattern(first)

        def holds(value: float, same: Any = same) -> bool:
            return bool(pattern(at(value)) == same)

        inner, outer = boundary(holds, one, other, width)
        yield from _change_of_vibration(at, one, inner)
        found = _change_of_pattern(at, inner, outer)
        if found is not None:
            yield found
        one = outer


def pattern(found: Stability | None) -> Any:
    """What changes at once: directions, self-locking and held forces of all cases."""
    if found is None:
        return None
    return [(one.directions, one.locked, one.limited) for one in found.cases]


def boundary(
    holds: Callable[[float], bool], one: float, other: float, width: float
) -> tuple[float, float]:
    """The last value for which a condition holds, coming from ``one``, and the first without."""
    while abs(other - one) > max(_XTOL * width, _RTOL * abs(other)):
        middle = 0.5 * (one + other)
        if middle in (one, other):
            break
        one, other = (middle, other) if holds(middle) else (one, middle)
    return one, other


def _change_of_vibration(at: At, one: float, other: float) -> Iterator[Located]:
    """The change between two values of the same pattern, if their verdicts differ."""
    first, last = at(one), at(other)
    assert first is not None  # noqa: S101 - of the caller
    assert last is not None  # noqa: S101
    if one == other or verdict_of(first) == verdict_of(last):
        return
    value = _root(at, one, other)
    found = at(value, modes=True)
    assert found is not None  # noqa: S101 - between values of the same pattern
    assert found.critical is not None  # noqa: S101 - its verdict changes
    mode = found.critical.modes[0]
    kind = HOPF if mode.frequency > 0.0 else DIVERGENCE
    kind = FLIP if mode.alternates else kind
    low, high = sorted((one, other))
    gaps = []
    for share in (_WIDE, _NARROW):
        # Not beyond the interval, where other patterns or impossible values may begin.
        reach = share * (high - low)
        ends = max(value - reach, low), min(value + reach, high)
        gaps.append(abs(growth(at(ends[1])) - growth(at(ends[0]))))
    below, above = _in_order((one, _WORDS[verdict_of(first)]), (other, _WORDS[verdict_of(last)]))
    continuous = bool(gaps[1] <= _SHRUNK * gaps[0])
    yield Located(VerdictChange(value, kind, below, above, mode.frequency, continuous), found)


def _root(at: At, one: float, other: float) -> float:
    """The value between two of the same pattern at which the verdict changes.

    Beside it there may be no linear system, as where the equilibrium is at a corner of a gap.
    """
    from scipy.optimize import brentq

    def verdict(value: float) -> int:
        found = at(value)
        return 2 if found is None else verdict_of(found)

    width = abs(other - one)
    before, after = verdict(one), verdict(other)
    if 0 not in (before, after):
        value = float(
            brentq(
                lambda value: growth(at(value)), one, other, xtol=_XTOL * width, rtol=_RTOL,
                maxiter=500,
            )
        )  # fmt: skip
        low, high = sorted((one, other))
        apart = 8.0 * max(_XTOL * width, _RTOL * abs(value))
        near = (value, max(value - apart, low), min(value + apart, high))
        if all(at(place) is not None for place in near):
            return value
    inner, outer = boundary(lambda value: verdict(value) == before, one, other, width)
    if at(outer) is None and after > before and after != 2:
        # The growth rate jumps: the less stable side.
        return boundary(lambda value: verdict(value) == after, other, one, width)[0]
    return outer if after == 0 and at(outer) is not None else inner


def growth(found: Stability | None) -> float:
    """Largest growth rate [1/s], finite."""
    if found is None or found.growth_rate is None:
        return 1.0  # a brake locks itself: not stable
    return found.growth_rate if np.isfinite(found.growth_rate) else -1.0


def _change_of_pattern(at: At, one: float, other: float) -> Located | None:
    """The change between two neighbouring values of different patterns; None where one ends."""
    sides = [
        (value, found) for value in (one, other) if (found := at(value, modes=True)) is not None
    ]
    existing = [side for side in sides if side[1].critical is not None]
    if len(sides) < 2 or not existing:
        return None
    kind, words = REVERSAL, [_WORDS[verdict_of(found)] for _, found in sides]
    directions = [[case.directions for case in found.cases] for _, found in sides]
    if directions[0] == directions[1]:
        for name, word in ((FORCE_LIMIT, "limited"), (RELEASE, "released"), (LOCKING, "locked")):
            held = [_held(found, word) for _, found in sides]
            for side in (0, 1):
                if held[side] - held[1 - side]:
                    kind, words[side] = name, word
    # Of both sides the less stable one.
    value, found = max(existing, key=lambda side: verdict_of(side[1]))
    assert found.critical is not None  # noqa: S101 - it exists
    frequency = next((mode.frequency for mode in found.critical.modes), 0.0)
    below, above = _in_order(*zip((one, other), words, strict=True))
    decides = kind == LOCKING or verdict_of(sides[0][1]) != verdict_of(sides[1][1])
    return Located(
        VerdictChange(value, kind, below, above, frequency, continuous=False), found, decides
    )


def meeting(at: At, value: float, beyond: float, inside: float) -> Located:
    """The divergence at which two steady slidings meet; beyond it there is neither.

    inside : a value at which there are both
    """
    found, before = at(value, modes=True), at(inside)
    assert found is not None  # noqa: S101 - it exists up to there
    assert before is not None  # noqa: S101
    words = _in_order((value, _WORDS[verdict_of(before)]), (beyond, "none"))
    return Located(VerdictChange(value, DIVERGENCE, *words, frequency=0.0, continuous=True), found)


def _held(found: Stability, word: str) -> set[tuple[int, str]]:
    """Contacts that are locked, released or limited, with the number of the case."""
    if word == "locked":
        return {(number, name) for number, one in enumerate(found.cases) for name in one.locked}
    return {
        (number, name)
        for number, one in enumerate(found.cases)
        for name in one.limited
        if (one.forces[name] == 0.0) == (word == "released")
    }


def _in_order(one: tuple[float, str], other: tuple[float, str]) -> tuple[str, str]:
    """The words below and above, of two values with their words."""
    return (one[1], other[1]) if one[0] < other[0] else (other[1], one[1])
