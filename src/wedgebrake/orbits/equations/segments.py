"""Segments of the orbits of machines between events, and those that vanish at a bifurcation."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import NamedTuple

import numpy as np

from wedgebrake.arrays import FloatArray
from wedgebrake.orbits.bifurcation_types import Kind

# Largest number of segments that begin or end at once, and of the ways in which they are tried.
_MOST, _TRIED = 4, 64


class OrbitSegments(NamedTuple):
    """Segments of an orbit in cyclic order: slips and sticks of a contact, for example.

    sides     : of each segment; of a slip its direction, 0 of a stick: the smallest such tuple
    durations : [s]
    """

    sides: tuple[int, ...]
    durations: FloatArray

    @classmethod
    def of(cls, sides: tuple[int, ...], durations: FloatArray) -> OrbitSegments:
        """Segments in cyclic order, from a list that may begin with any of them."""
        first = min(range(len(sides)), key=lambda k: sides[k:] + sides[:k])
        return cls(
            sides[first:] + sides[:first], np.concatenate((durations[first:], durations[:first]))
        )

    @classmethod
    def between(cls, events: list[tuple[float, int]], period: float, side: int) -> OrbitSegments:
        """Segments between events.

        events : time [s] and side from then on, in order; one that changes nothing is ignored
        side   : that of an orbit without events
        """
        pairs = zip(events, events[-1:] + events, strict=False)
        events = [one for one, last in pairs if one[1] != last[1]]
        times = [time for time, _ in events] or [0.0]
        sides = tuple(after for _, after in events) or (side,)
        return cls.of(sides, np.diff([*times, times[0] + period]))


class Removal(NamedTuple):
    """Remaining segments after some have been removed.

    longest : duration of the longest segment that has been removed [s]
    kind    : bifurcation at which such segments have zero duration
    gone    : sides of each segment that has been removed and of its neighbour before
    """

    left: OrbitSegments
    longest: float
    kind: Kind | None
    gone: tuple[tuple[int, int], ...] = ()

    @property
    def size(self) -> float:
        """A size of the segments that have been removed; it is linear near the bifurcation."""
        ends = (Kind.CROSSING_SLIDING, Kind.SWITCHING_SLIDING)
        return self.longest if self.kind in ends else self.longest**2


KindOf = Callable[[int, int, int], Kind | None]


def of_slips(before: int, side: int, after: int) -> Kind | None:
    """The bifurcation at which a slip or stick between two others has zero duration."""
    if side == 0:
        return Kind.GRAZING_SLIDING if before == after else Kind.CROSSING_SLIDING
    if before == after == 0:
        return Kind.ADDING_SLIDING
    return Kind.SWITCHING_SLIDING if after == 0 and before == -side else None


def of_levels(before: int, side: int, after: int) -> Kind | None:  # noqa: ARG001 - as ``of_slips``
    """The same for the segments between two breakpoints."""
    return Kind.GRAZING if before == after else None


def removal(short: OrbitSegments, long: OrbitSegments, kind_of: KindOf) -> Removal | None:
    """The removal of the additional segments of the longer sequence; None if there is none."""
    reached = [Removal(long, 0.0, None)]
    for _ in range(_MOST):
        reached = [
            more
            for one in reached
            for more in _removals(one, kind_of)
            if one.kind in (None, more.kind)
        ]
        reached = sorted(reached, key=lambda one: one.longest)[:_TRIED]
        found = [one for one in reached if one.left.sides == short.sides]
        if found:
            return found[0]
    return None


def _removals(given: Removal, kind_of: KindOf) -> Iterator[Removal]:
    """Yield the removals of one more segment."""
    sides, durations = given.left
    count = len(sides)
    if count < 2:
        return
    for i, side in enumerate(sides):
        before, after = sides[i - 1], sides[(i + 1) % count]
        kind = kind_of(before, side, after)
        if kind is None:
            continue
        left = durations.copy()
        left[i - 1] += left[i]
        gone = [i]
        if before == after and count > 2:
            gone.append((i + 1) % count)
            left[i - 1] += left[gone[1]]
        kept = [k for k in range(count) if k not in gone]
        rest = OrbitSegments.of(tuple(sides[k] for k in kept), left[kept])
        longest = max(given.longest, float(durations[i]))
        yield Removal(rest, longest, kind, (*given.gone, (before, side)))
