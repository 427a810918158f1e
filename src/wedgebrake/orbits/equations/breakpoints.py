"""Breakpoints of the torques of a machine, and the segments of an orbit between them.

At a breakpoint the torque of a contact is continuous and its slope is not: at a point of a friction
table, where the actuation force reaches a limit, and at a release, where it becomes zero. The same
holds at the ends of stages and gaps of shafts, at the points of torques over a speed or an angle,
and where a continuous controller reaches a limit.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from wedgebrake.model.elements import Element
from wedgebrake.model.friction import SetValuedFriction
from wedgebrake.model.machine_parts import Contact
from wedgebrake.orbits.bifurcation_types import Limit
from wedgebrake.orbits.equations.segments import OrbitSegments
from wedgebrake.solvers.machine.events.modes import GuardKind
from wedgebrake.solvers.machine.passage import Passage
from wedgebrake.solvers.machine.problem import MachineProblem

# Share of a speed that is rounding.
_ROUNDING = 1e-9
_OF_PIECES = ("contact", "time", "line")
# Rate of an argument so large that its sign decides about the piece.
_FAST = 1e12


class Breakpoints(NamedTuple):
    """Breakpoints of the torque of a contact.

    speeds  : of the sliding speed [rad/s], ascending; those of lines that approximate a smooth
              curve are none
    release_number : number of the one at which the brake is released; -1 if it is none of these
    levels  : of each line of the torque: number of breakpoints between rest and this line
    released_at_limit : True if the brake is released where the force is at its lower limit
    """

    speeds: tuple[float, ...]
    release_number: int
    levels: NDArray[np.int64]
    released_at_limit: bool

    @classmethod
    def of(cls, contact: Contact, number: int, problem: MachineProblem) -> Breakpoints:
        """The breakpoints of a contact."""
        numbers, friction = problem.contacts[number], contact.friction
        bends = friction.bends if isinstance(friction, SetValuedFriction) else ()
        first = numbers["first_line"]
        last = first + numbers["lines_forward"] + numbers["lines_backward"]
        starts = problem.lines["start"][first:last]
        # A stated bend at which the slope of the torque does not change is none.
        bent = starts[problem.lines["bends"][first:last]]
        speeds = {
            speed
            for speed in (one / contact.brake.radius for one in bends)
            if np.any(np.abs(bent - speed) <= _ROUNDING * speed)
        }
        released = math.inf
        if numbers["lines_forward"] > 0 and numbers["curve"] < 0:
            released = contact.actuation.release_speed
            speeds |= {released}
        ascending = sorted(speed for speed in speeds if 0.0 < speed < math.inf)
        beyond = starts[:, None] >= np.array(ascending) * (1.0 - _ROUNDING)
        release = ascending.index(released) if released in ascending else -1
        return cls(
            tuple(ascending), release, np.sum(beyond, axis=1), bool(numbers["lowest"] == 0.0)
        )

    def name_of(self, limit: Limit) -> str:
        """Words for a part of an orbit beyond a breakpoint."""
        if limit.guard == GuardKind.FORCE_LIMIT:
            released = limit.level < 0 and self.released_at_limit
            return "release" if released else "crossing of a limit of the force"
        number = abs(limit.level) - 1
        if number == self.release_number:
            return "release"
        return f"crossing of the breakpoint at {self.speeds[number]:.6g} rad/s"


class Event(NamedTuple):
    """An event of a contact: time since the beginning of the orbit [s], and the mode after it."""

    time: float
    side: int
    line: int
    force_limit: int


class _Change(NamedTuple):
    """An event of an element or controller: time as in ``Event`` [s], and the piece after it."""

    time: float
    piece: int


def events_of(passages: Sequence[Passage]) -> tuple[list[list[Event]], float]:
    """Events of each contact in the passages of an orbit, and its period [s]."""
    events: list[list[Event]] = [[] for _ in passages[-1].final.modes]
    begin = 0.0
    for one in passages:
        names = ("contact", "time", "after", "line", "force_limit")
        log = one.log[one.log["contact"] < len(events)]  # the others are those of elements
        columns = (log[name].tolist() for name in names)
        for contact, time, *mode in zip(*columns, strict=True):
            events[contact].append(Event(begin + time, *mode))
        begin += one.duration
    return events, begin


def piece_levels(element: Element) -> NDArray[np.int64]:
    """For each piece of an element, the number of corners below its arguments.

    A stop has two pieces beyond a limit, in one of which its damper does not pull.
    """
    law = element.law
    corners = np.array(law.corners)
    edges = np.concatenate(([corners[0] - 2.0], corners, [corners[-1] + 2.0]))
    found = np.zeros(len(law.pieces()), np.int64)
    for level, argument in enumerate(0.5 * (edges[1:] + edges[:-1])):
        found[law.piece_at(np.full(3, argument), np.array([-_FAST, 0.0, _FAST]))] = level
    return found


def levels_of(
    passages: Sequence[Passage],
    breakpoints: Sequence[Breakpoints],
    pieces: Sequence[NDArray[np.int64]],
) -> list[OrbitSegments]:
    """Segments of an orbit between breakpoints: of each contact those of its speed and its force.

    The level of a speed is the number of breakpoints between it and rest, negative if the contact
    slides backwards; that of a force is -1 or 1 at its lower or upper limit, otherwise 0. Then
    follow those of piecewise-linear elements, whose level is the number of corners below the
    argument, and those of controllers, whose level is -1 or 1 at a limit, otherwise 0.

    pieces : for each element, the levels of its pieces
    """
    (events, period), found = events_of(passages), []
    for own, (side, line, limit, *_), given in zip(
        events, passages[-1].final.modes, breakpoints, strict=True
    ):
        speeds, forces = [], []
        for one in own:
            speeds.append((one.time, one.side * _level(given, one.line)))
            forces.append((one.time, one.force_limit))
        found.append(OrbitSegments.between(speeds, period, side * _level(given, line)))
        found.append(OrbitSegments.between(forces, period, limit))
    # Events number the pieces of all elements consecutively.
    levels = np.concatenate([*pieces, np.empty(0, np.int64)])
    at_end = [piece for piece, _, _ in passages[-1].final.pieces]
    for number, (changes, piece) in enumerate(zip(_changes_of(passages), at_end, strict=True)):
        after = np.array([one.piece for one in changes], np.int64)
        if number < len(pieces):
            last, reached = pieces[number][piece], levels[after]
        else:
            last, reached = np.sign(piece), np.sign(after)
        each = zip([one.time for one in changes], reached.tolist(), strict=True)
        found.append(OrbitSegments.between(list(each), period, int(last)))
    return found


def _changes_of(passages: Sequence[Passage]) -> list[list[_Change]]:
    """Changes of the piece of each element and controller in the passages of an orbit."""
    last = passages[-1].final
    found, begin = [list[_Change]() for _ in last.pieces], 0.0
    for one in passages:
        log = one.log[one.log["contact"] >= len(last.modes)]
        for number, time, piece in zip(*(log[name].tolist() for name in _OF_PIECES), strict=True):
            found[number - len(last.modes)].append(_Change(begin + time, piece))
        begin += one.duration
    return found


def _level(given: Breakpoints, line: int) -> int:
    return int(given.levels[line]) if given.levels.size else 0
