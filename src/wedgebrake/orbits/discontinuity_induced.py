"""Discontinuity-induced bifurcations: the segments of an orbit beyond one (docs/theory.md, 13).

Where a margin of an orbit vanishes a segment begins or ceases to be. The sequence of segments
beyond is made by inserting a segment of length zero, or by removing one.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from wedgebrake.dynamics.harmonic import phase_of
from wedgebrake.dynamics.problem import torque_rate_at_rest
from wedgebrake.orbits.bifurcation_types import Kind, Margin
from wedgebrake.orbits.curves import OrbitSolution
from wedgebrake.orbits.section import FloatArray
from wedgebrake.orbits.segment_bvp import Codes, SegmentBVP
from wedgebrake.orbits.segment_kernel import breakaway
from wedgebrake.orbits.segment_margins import QUANTITIES

ALL_SLIP_ENDS = "all slip ends, permanent sticking begins"
# A slip in the middle of a stick lasts three times as long as the torque takes to its extreme.
_SHARE_OF_ADDED = 1.0 / 3.0


class Node(NamedTuple):
    """A segment with its begin.

    first : phase [rad] (of a mark: velocity) at its begin, and the angle [rad] there
    share : for a segment inserted with length zero: share of its later length that lies before
            the bifurcation; None for the others
    """

    code: int
    first: float
    angle: float
    share: float | None = None


@dataclass
class Transition:
    """The sequence of segments beyond a bifurcation.

    jump  : whether nothing near by continues
    nodes : the segments beyond; none where all is rest
    """

    kind: Kind
    jump: bool = False
    nodes: list[Node] = field(default_factory=list)

    @property
    def codes(self) -> Codes:
        """Codes of the segments."""
        return tuple(node.code for node in self.nodes)

    @property
    def unknowns(self) -> FloatArray:
        """Unknowns of the boundary-value problem of the segments."""
        return np.array([[node.first, node.angle] for node in self.nodes]).ravel()

    @property
    def inserted(self) -> list[tuple[int, float]]:
        """Numbers of the segments inserted with length zero, with their shares."""
        return [(i, one.share) for i, one in enumerate(self.nodes) if one.share is not None]

    def effect(self, before: Codes) -> str:
        """Describe the part of the motion that begins or ends."""
        if self.jump:
            return ""
        if not self.nodes:
            return ALL_SLIP_ENDS
        words = []
        for word, test in (
            ("slip forwards", lambda code: code > 0),
            ("slip backwards", lambda code: code < 0),
            ("sticking", lambda code: code == 0),
            ("crossing of a breakpoint (release)", lambda code: abs(code) > 1),
        ):
            had, has = any(map(test, before)), any(map(test, self.codes))
            if had != has:
                words.append(f"{word} {'begins' if has else 'ends'}")
        return ", ".join(words)


class _Place(NamedTuple):
    """A segment at whose margin an orbit ends, with its neighbours."""

    segment: int
    quantity: str
    before: int
    code: int
    after: int
    margins: np.record

    @property
    def touched(self) -> int:
        """Code of the segment beyond the limit that is touched."""
        return self.code + (1 if self.margins["touch_side"] > 0.0 else -1)


def transition(solution: OrbitSolution, margins: list[Margin]) -> Transition | None:
    """The segments beyond a point where some margins vanish at once; None if not known.

    Several vanish where the orbit is symmetric, or where one event shows in two margins.
    """
    equations, unknowns = solution.equations, solution.unknowns
    assert isinstance(equations, SegmentBVP)  # noqa: S101 - others have no margins
    if equations.half:
        return _transition_of_half(solution, margins)
    quantity = leading_quantity(margins)
    codes = equations.codes
    places = [
        _Place(
            segment, quantity, codes[segment - 1], codes[segment],
            codes[(segment + 1) % len(codes)], solution.margins[segment],
        )
        for segment in sorted(one.segment for one in margins if one.quantity == quantity)
    ]  # fmt: skip
    kinds = {_kind(place) for place in places}
    kind = kinds.pop()
    if kinds or kind is None:
        return None
    found = Transition(kind)
    if any(_jumps(solution, place) for place in places):
        found.jump = True
        return found
    nodes = [
        Node(code, float(unknowns[2 * i]), float(unknowns[2 * i + 1]))
        for i, code in enumerate(codes)
    ]
    # From the last on, so that numbers before stay what they are, but where the first goes too.
    begun = [nodes[place.segment] for place in places]
    for place, node in zip(reversed(places), reversed(begun), strict=True):
        if quantity == "duration":
            nodes = _removed(nodes, nodes.index(node), 2.0 * math.pi * equations.order)
        else:
            _insert(nodes, place, 2.0 * math.pi * equations.order)
    if len(nodes) > 1 and equations.is_mark(0):
        # An orbit with events needs no mark.
        del nodes[0]
    if not nodes and places[0].before != 0:
        angle, velocity = solution.points[0]
        nodes = [Node(places[0].before, float(velocity), float(angle))]
    found.nodes = nodes
    return found


def leading_quantity(margins: list[Margin] | tuple[Margin, ...]) -> str:
    """Which of several margins that vanish together decides; neighbours show the end as well."""
    return min((one.quantity for one in margins), key=QUANTITIES.index)


def _transition_of_half(solution: OrbitSolution, margins: list[Margin]) -> Transition | None:
    """The same for half an orbit: what happens in it happens in its mirror image."""
    count = len(solution.margins)
    both = [*margins, *(Margin(one.segment + count, one.quantity) for one in margins)]
    equations, unknowns = solution.equations.whole(solution.unknowns)
    whole = OrbitSolution(solution.problem, solution.values, equations, unknowns)
    found = transition(whole, both)
    if found is not None:
        found.nodes = found.nodes[: len(found.nodes) // 2]
    return found


def _kind(place: _Place) -> Kind | None:
    """The bifurcation by the margin that vanishes and the segments beside it."""
    before, code, after = place.before, place.code, place.after
    if place.quantity == "touch":
        if code == 0:
            return Kind.ADDING_SLIDING
        return Kind.GRAZING_SLIDING if place.touched == 0 else Kind.GRAZING
    if place.quantity == "holding":
        return Kind.SWITCHING_SLIDING if after == 0 else Kind.CROSSING_SLIDING
    if place.quantity == "crossing":
        return Kind.GRAZING_SLIDING if after == 0 or code * after < 0 else None
    if code == 0:
        return Kind.GRAZING_SLIDING if before == after else Kind.CROSSING_SLIDING
    if before == after:
        return Kind.ADDING_SLIDING if before == 0 else Kind.GRAZING
    if before == -code and after == 0:
        return Kind.SWITCHING_SLIDING
    return None


def _jumps(solution: OrbitSolution, place: _Place) -> bool:
    """Return True if a static peak keeps an inserted segment from being short."""
    problem = solution.kernel_problem
    if place.quantity == "crossing":
        return True
    slip = 0
    if place.quantity == "touch":
        beyond = place.touched
        slip = beyond if place.code == 0 else place.code if beyond == 0 else 0
    elif place.quantity == "holding" and place.after == 0:
        slip = -place.code
    elif place.quantity == "holding":
        # A rest in place of the reversal ends soon only where the torque goes outwards.
        end = 2 * ((place.segment + 1) % len(solution.margins))
        phase = phase_of(solution.unknowns[end])
        outwards = place.after * torque_rate_at_rest(problem.driveline, problem.torque, phase)
        return bool(outwards <= 0.0)
    return slip != 0 and bool(breakaway(problem, slip) != 0.0)


def _insert(nodes: list[Node], place: _Place, turn: float) -> None:
    """Insert a segment of length zero inside a segment, or at its end.

    turn : phase of the whole orbit [rad]
    """
    segment, code = place.segment, place.code
    last = segment + 1 == len(nodes)
    following = nodes[0] if last else nodes[segment + 1]
    if place.quantity == "touch":
        at, angle = float(place.margins["touch_phase"]), float(place.margins["touch_angle"])
        # A stick begins before a graze and ends in it.
        share = _SHARE_OF_ADDED if code == 0 else 1.0 if place.touched == 0 else 0.5
        new = [Node(place.touched, at, angle, share), Node(code, at, angle)]
    else:
        at = following.first + (turn if last else 0.0)
        new = [Node(-code if following.code == 0 else 0, at, following.angle, 0.0)]
    nodes[segment + 1 : segment + 1] = new


def _removed(nodes: list[Node], segment: int, turn: float) -> list[Node]:
    """Nodes without a segment of length zero; neighbours that are one segment then are joined."""
    count = len(nodes)
    before, after = nodes[segment - 1], nodes[(segment + 1) % count]
    if before.code != after.code:
        # The next one begins where this one did.
        kept = list(nodes)
        here = nodes[segment]
        if segment + 1 == count:
            kept[0] = here._replace(code=after.code, first=here.first - turn)
        else:
            kept[segment + 1] = here._replace(code=after.code)
        del kept[segment]
        return kept
    gone = {segment, (segment + 1) % count}
    return [node for number, node in enumerate(nodes) if number not in gone]
