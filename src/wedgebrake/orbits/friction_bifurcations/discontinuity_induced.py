"""Bifurcations of the friction of one inertia: the segments of an orbit beyond one.

They are discontinuity-induced (docs/numerics.md, "Bifurcations"); for other machines see
``event_changes``.

Where a margin of an orbit vanishes, a segment begins or ends. The sequence of segments
beyond is made by inserting a segment of length zero, or by removing one, and the branch restarts
with it, or the motion ends.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np
from scipy.optimize import brentq

from wedgebrake.arrays import FloatArray
from wedgebrake.dynamics.harmonic import phase_of
from wedgebrake.dynamics.problem import torque_rate_at_rest
from wedgebrake.orbits.bifurcation_types import Bifurcation, Kind, OrbitMargin, Scenario
from wedgebrake.orbits.curves import OrbitCurve, OrbitSolution
from wedgebrake.orbits.equations.equations import Codes, NoOrbitError
from wedgebrake.orbits.equations.segment_bvp import SegmentBVP
from wedgebrake.orbits.equations.segment_kernel import breakaway
from wedgebrake.orbits.equations.segment_orbit import QUANTITIES
from wedgebrake.orbits.palc import FAILED, CurvePoint, corrected

ALL_SLIP_ENDS = "all slip ends, permanent sticking begins"
# A slip in the middle of a stick lasts three times as long as the torque takes to its extreme.
_SHARE_OF_ADDED = 1.0 / 3.0
PERMANENT = "permanent sticking: every angle that the brake holds is an equilibrium"
# Lengths [rad] of inserted segments, in the order in which they are tried.
_LENGTHS = (1e-3, 1e-4, 1e-2, 1e-5, 1e-6, 1e-7)
# First steps beyond, as shares of the longest.
_STEPS = (1e-3, 1e-4, 1e-2)
# Slips shorter than this [rad] approach the onset of permanent sticking, which is no further
# than this (scaled).
_SHORT, _REACH = 0.05, 1e-3
_TWO_SLIPS = (0, 1, 0, -1)


class Node(NamedTuple):
    """A segment with its beginning.

    first : phase [rad] (of a mark: velocity) at its beginning, and the angle [rad] there
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

    jump  : True if no nearby orbit continues
    nodes : the segments beyond; empty if all is rest
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
    """A segment at whose margin an orbit ends, with its neighbours.

    touched : code of the segment beyond the touched limit
    """

    segment: int
    quantity: str
    before: int
    code: int
    after: int
    touched: int
    margins: np.record


def transition(solution: OrbitSolution, margins: list[OrbitMargin]) -> Transition | None:
    """The segments beyond a point where some margins vanish at once; None if not known.

    Several vanish where the orbit is symmetric, or where one event shows in two margins.
    """
    equations, unknowns = solution.equations, solution.unknowns
    if equations.half:
        return _transition_of_half(solution, margins)
    quantity = leading_quantity(margins)
    codes, places = equations.codes, []
    for segment in sorted(one.segment for one in margins if one.quantity == quantity):
        before, code, after = codes[segment - 1], codes[segment], codes[(segment + 1) % len(codes)]
        own = solution.margins[segment]
        touched = code + (1 if own["touch_side"] > 0.0 else -1)
        places.append(_Place(segment, quantity, before, code, after, touched, own))
    kinds = {_kind(place) for place in places}
    kind = kinds.pop()
    if kinds or kind is None:
        return None
    if any(_jumps(solution, place) for place in places):
        return Transition(kind, jump=True)
    nodes = [
        Node(code, float(unknowns[2 * i]), float(unknowns[2 * i + 1]))
        for i, code in enumerate(codes)
    ]
    # From the last, so that earlier numbers do not change, except where the first is removed too.
    begun, turn = [nodes[place.segment] for place in places], 2.0 * math.pi * equations.order
    for place, node in zip(reversed(places), reversed(begun), strict=True):
        if quantity == "duration":
            nodes = _removed(nodes, nodes.index(node), turn)
        else:
            _insert(nodes, place, turn)
    if len(nodes) > 1 and equations.is_mark(0):
        # An orbit with events needs no mark.
        del nodes[0]
    if not nodes and places[0].before != 0:
        angle, velocity = solution.points[0]
        nodes = [Node(places[0].before, float(velocity), float(angle))]
    return Transition(kind, nodes=nodes)


def leading_quantity(margins: list[OrbitMargin] | tuple[OrbitMargin, ...]) -> str:
    """The decisive one of several margins that vanish together; others are of its neighbours."""
    return min((one.quantity for one in margins), key=QUANTITIES.index)


def _transition_of_half(solution: OrbitSolution, margins: list[OrbitMargin]) -> Transition | None:
    """The same for half an orbit, whose mirror image changes in the same way."""
    count = len(solution.margins)
    both = [*margins, *(OrbitMargin(one.segment + count, one.quantity) for one in margins)]
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
    """Nodes without a segment of length zero; equal neighbours are joined."""
    count = len(nodes)
    before, after = nodes[segment - 1], nodes[(segment + 1) % count]
    following = (segment + 1) % count
    if before.code == after.code:
        return [node for number, node in enumerate(nodes) if number not in (segment, following)]
    # The next segment begins where this one began.
    here = nodes[segment]
    first = here.first - (turn if following == 0 else 0.0)
    kept = list(nodes)
    kept[following] = here._replace(code=after.code, first=first)
    del kept[segment]
    return kept


class Restart(NamedTuple):
    """Continuation of a branch beyond a discontinuity-induced bifurcation.

    curve, point : continuation of the branch; None if it does not continue
    why          : in that case the reason
    """

    bifurcation: Bifurcation
    curve: OrbitCurve | None = None
    point: CurvePoint | None = None
    why: str = ""


def restart(
    curve: OrbitCurve, came: float, at: CurvePoint, margins: list[OrbitMargin], longest: float
) -> Restart | None:
    """The branch beyond a point where some margins vanish; None where it was not found.

    came    : change of the scaled parameter on the way to it. The direction there is no criterion:
              on the side of a short segment it is normal to the parameter.
    longest : step along the branch
    """
    solution = curve.solution(at.y)
    equations = solution.equations
    found = transition(solution, margins)
    if found is None:
        return None
    kind, effect, ends = found.kind, found.effect(equations.codes), tuple(margins)
    if found.jump:
        why = f"{kind.value}, beyond which the motion jumps"
        return Restart(Bifurcation(kind, effect, Scenario.JUMP, margins=ends), why=why)
    if not found.nodes:
        return Restart(Bifurcation(kind, effect, margins=ends), why=PERMANENT)
    beyond = replace(
        solution,
        equations=SegmentBVP(found.codes, equations.order, half=equations.half),
        unknowns=found.unknowns,
    )
    attempts = _grown(beyond, found) if found.inserted else _further(beyond, longest)
    for there, point in attempts:
        if there.solution(point.y).is_orbit:
            on = came * (point.y[-1] - at.y[-1]) > 0.0
            scenario = Scenario.PERSISTENCE if on else Scenario.FOLD
            return Restart(Bifurcation(kind, effect, scenario, margins=ends), there, point)
    return None


def _grown(solution: OrbitSolution, found: Transition) -> Iterator[tuple[OrbitCurve, CurvePoint]]:
    """Solutions with short inserted segments."""
    for length in _LENGTHS:
        unknowns = solution.unknowns.copy()
        normal = np.zeros(unknowns.size + len(solution.values))
        for segment, share in found.inserted:
            begin, end = 2 * segment, 2 * (segment + 1) % unknowns.size
            unknowns[begin] -= share * length
            unknowns[end] += (1.0 - share) * length
            normal[begin] -= 1.0
            normal[end] += 1.0
        guess = replace(solution, unknowns=unknowns)
        curve = OrbitCurve(guess)
        normal = normal * curve.scales
        normal /= np.linalg.norm(normal)
        try:
            yield curve, corrected(curve, curve.scaled(guess), normal)
        except FAILED:
            continue


def _further(solution: OrbitSolution, longest: float) -> Iterator[tuple[OrbitCurve, CurvePoint]]:
    """Solutions slightly further on both sides; on one side the fewer segments are an orbit."""
    curve = OrbitCurve(solution)
    try:
        at = corrected(curve, curve.scaled(solution), np.eye(curve.scales.size)[-1])
    except FAILED:
        return
    for step in _STEPS:
        for side in (1.0, -1.0):
            guess = at.y + side * step * longest * at.direction
            try:
                yield curve, corrected(curve, guess, at.direction, side * at.direction)
            except FAILED:
                continue


def onset_of_permanent_sticking(curve: OrbitCurve, at: CurvePoint) -> OrbitSolution | None:
    """The orbit whose slips vanish shortly after a point; None if there is none nearby.

    Towards it the remaining slips become short together. The sum of their angles decreases with
    the cube of their durations and is lost in rounding before they vanish; but the parameter is
    known: the brake at rest holds exactly the range of the torque, upper - lower = 2 T_e.
    """
    solution = curve.solution(at.y)
    equations, values = solution.equations, solution.values
    if len(values) != 1:
        return None
    codes = np.array(equations.all_codes)
    durations = solution.margins["duration"]
    slips = codes[: durations.size] != 0
    turns = [turn for turn in range(codes.size) if tuple(np.roll(codes, turn)) == _TWO_SLIPS]
    if not turns or np.any(durations[slips] > _SHORT):
        return None
    reach = math.copysign(_REACH * curve.scales[-1], at.direction[-1])

    def spare(value: float) -> float:
        """Width of the brake's holding interval less the range of the torque [N m]."""
        problem = curve.problem.kernel_problem((value,))
        return float(problem.brake.upper - problem.brake.lower - 2.0 * problem.torque.amplitude)

    ends = values[0], values[0] + reach
    try:
        if spare(ends[0]) * spare(ends[1]) >= 0.0:
            return None
        value = float(brentq(spare, *ends, xtol=1e-300, rtol=1e-15))
    except NoOrbitError:
        return None
    problem = curve.problem.kernel_problem((value,))
    # Forwards at the torque's crest, backwards at its trough; the angle is that of both.
    angle = (problem.torque.amplitude - problem.brake.upper) / problem.driveline.stiffness
    phases = _crests(equations.all_codes, solution.unknowns[0::2])
    unknowns = np.column_stack((phases, np.full(phases.size, angle))).ravel()
    return replace(solution, values=(value,), unknowns=unknowns)


def _crests(codes: Codes, phases: np.ndarray) -> np.ndarray:
    """Phase of the torque's crest or trough nearest to each node, by the slip beside it."""
    crests = np.empty(phases.size)
    for node, phase in enumerate(phases):
        crest = 0.5 * math.pi if (codes[node] or codes[node - 1]) > 0 else 1.5 * math.pi
        crests[node] = crest + 2.0 * math.pi * round((phase - crest) / (2.0 * math.pi))
    return crests
