"""Where a chain of pieces ends to be an orbit, and the chain beyond (docs/theory.md, section 13).

At such an end a piece begins or ceases to be: the bifurcations that only friction has. The
chain beyond is made by putting in a piece of length zero, or by taking one out.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

from wedgebrake.continuation import segment_bvp_kernel as kernel
from wedgebrake.continuation.bifurcation_types import Kind
from wedgebrake.continuation.equations import FloatArray
from wedgebrake.continuation.segment_bvp import Chain


class Margin(NamedTuple):
    """One distance from an end: of which piece, and which of ``kernel.margins``' columns."""

    piece: int
    column: int


class Node(NamedTuple):
    """A piece with where it begins: phase [rad] (or velocity, of a mark) and angle [rad]."""

    code: int
    first: float
    angle: float


@dataclass
class Transition:
    """What becomes of a chain at one of its ends.

    jump   : whether nothing near by goes on
    nodes  : the chain beyond; none where all is rest
    grown  : numbers of its pieces that begin with length zero
    shares : for each of them, which share of its length lies before the end
    """

    kind: Kind
    jump: bool = False
    nodes: list[Node] = field(default_factory=list)
    grown: list[int] = field(default_factory=list)
    shares: list[float] = field(default_factory=list)


# A slip in the middle of a stick lasts three times as long as the torque takes to its extreme.
_OF_ADDED = 1.0 / 3.0


def violated(margins: FloatArray) -> list[Margin]:
    """What a solution of the equations misses to be an orbit."""
    lacking = ~(margins[:, : kernel.MARGINS] > 0.0)
    return [Margin(int(piece), int(column)) for piece, column in np.argwhere(lacking)]


def transition(
    chain: Chain, unknowns: FloatArray, problem: Any, ends: list[Margin]
) -> Transition | None:
    """What happens where some margins vanish at once; None where it is not known.

    Several vanish where the orbit is symmetric, or where one end shows in two margins.
    """
    if chain.half:
        return _halved(chain, unknowns, problem, ends)
    # The end of a piece shows in the margins of its neighbours too.
    column = min(end.column for end in ends)
    pieces = sorted(end.piece for end in ends if end.column == column)
    margins = chain.margins(unknowns, problem)
    kinds = {_kind(chain.codes, piece, column, margins[piece]) for piece in pieces}
    if len(kinds) != 1 or None in kinds:
        return None
    (kind,) = kinds
    assert kind is not None  # noqa: S101 - excluded above
    found = Transition(kind)
    if any(_jumps(chain, unknowns, piece, column, margins[piece], problem) for piece in pieces):
        found.jump = True
        return found
    nodes = [
        Node(code, float(unknowns[2 * i]), float(unknowns[2 * i + 1]))
        for i, code in enumerate(chain.codes)
    ]
    # From the last on, so that numbers before stay what they are, but where the first goes too.
    begun = [nodes[piece] for piece in pieces]
    for piece, node in zip(reversed(pieces), reversed(begun), strict=True):
        if column == kernel.DURATION:
            nodes = _taken_out(nodes, nodes.index(node), 2.0 * np.pi * chain.order)
        else:
            _put_in(nodes, piece, column, margins[piece], found, chain.order)
    _drop_mark(chain, nodes, found)
    if not nodes and chain.codes[pieces[0] - 1] != 0:
        angle, velocity = chain.points(unknowns, problem)[0]
        nodes = [Node(chain.codes[pieces[0] - 1], float(velocity), float(angle))]
    found.nodes = nodes
    return found


def _halved(
    chain: Chain, unknowns: FloatArray, problem: Any, ends: list[Margin]
) -> Transition | None:
    """The same for half an orbit: what happens in it happens in its mirror image."""
    count = len(chain.codes)
    both = [*ends, *(Margin(end.piece + count, end.column) for end in ends)]
    found = transition(*chain.whole(unknowns), problem, both)
    if found is not None:
        half = len(found.nodes) // 2
        kept = [place for place, piece in enumerate(found.grown) if piece < half]
        found.nodes = found.nodes[:half]
        found.grown = [found.grown[place] for place in kept]
        found.shares = [found.shares[place] for place in kept]
    return found


def _neighbour(code: int, side: float) -> int:
    """The piece beyond the upper (side 1) or lower (-1) limit of a piece."""
    step = 1 if side > 0.0 else -1
    return code + step


def _kind(codes: tuple[int, ...], piece: int, column: int, margins: FloatArray) -> Kind | None:
    code, before, after = codes[piece], codes[piece - 1], codes[(piece + 1) % len(codes)]
    if column == kernel.TOUCH:
        if code == 0:
            return Kind.ADDING_SLIDING
        beyond = _neighbour(code, margins[kernel.TOUCH_SIDE])
        return Kind.GRAZING_SLIDING if beyond == 0 else Kind.GRAZING
    if column == kernel.HOLDING:
        return Kind.SWITCHING_SLIDING if after == 0 else Kind.CROSSING_SLIDING
    if column == kernel.CROSSING:
        return Kind.GRAZING_SLIDING if after == 0 or code * after < 0 else None
    if code == 0:
        return Kind.GRAZING_SLIDING if before == after else Kind.CROSSING_SLIDING
    if before == after:
        return Kind.ADDING_SLIDING if before == 0 else Kind.GRAZING
    if before == -code and after == 0:
        return Kind.SWITCHING_SLIDING
    return None


def _jumps(
    chain: Chain,
    unknowns: FloatArray,
    piece: int,
    column: int,
    margins: FloatArray,
    problem: Any,
) -> bool:
    """Whether a static peak keeps what is put in from being short."""
    following = (piece + 1) % len(chain.codes)
    code, after = chain.codes[piece], chain.codes[following]
    if column == kernel.CROSSING:
        return True
    side = 0
    if column == kernel.TOUCH:
        beyond = _neighbour(code, margins[kernel.TOUCH_SIDE])
        side = beyond if code == 0 else code if beyond == 0 else 0
    elif column == kernel.HOLDING and after == 0:
        side = -code
    elif column == kernel.HOLDING:
        # A rest in place of the reversal ends soon only where the torque goes outwards.
        return bool(after * kernel.pull_rate(problem, unknowns[2 * following]) <= 0.0)
    return side != 0 and bool(kernel.breakaway(problem, side) != 0.0)


def _put_in(
    nodes: list[Node],
    piece: int,
    column: int,
    margins: FloatArray,
    found: Transition,
    order: int,
) -> None:
    """A piece of length zero inside a piece, or at its end."""
    code = nodes[piece].code
    last = piece + 1 == len(nodes)
    follower = nodes[0] if last else nodes[piece + 1]
    if column == kernel.TOUCH:
        beyond = _neighbour(code, float(margins[kernel.TOUCH_SIDE]))
        at, angle = float(margins[kernel.TOUCH_PHASE]), float(margins[kernel.TOUCH_ANGLE])
        new = [Node(beyond, at, angle), Node(code, at, angle)]
        # A stick begins before a graze and ends in it.
        share = _OF_ADDED if code == 0 else 1.0 if beyond == 0 else 0.5
    else:
        at = follower.first + (2.0 * np.pi * order if last else 0.0)
        new = [Node(-code if follower.code == 0 else 0, at, follower.angle)]
        share = 0.0
    nodes[piece + 1 : piece + 1] = new
    found.grown = [piece + 1, *(number + len(new) for number in found.grown)]
    found.shares = [share, *found.shares]


def _taken_out(nodes: list[Node], piece: int, circle: float) -> list[Node]:
    """Without a piece of length zero; neighbours that are one piece then are joined."""
    count = len(nodes)
    before, after = nodes[piece - 1], nodes[(piece + 1) % count]
    if before.code != after.code:
        # The next one begins where this one did.
        kept = list(nodes)
        here = nodes[piece]
        if piece + 1 == count:
            kept[0] = Node(after.code, here.first - circle, here.angle)
        else:
            kept[piece + 1] = Node(after.code, here.first, here.angle)
        del kept[piece]
        return kept
    gone = {piece, (piece + 1) % count}
    return [node for number, node in enumerate(nodes) if number not in gone]


def _drop_mark(chain: Chain, nodes: list[Node], found: Transition) -> None:
    """An orbit with events needs no mark."""
    if len(nodes) > 1 and chain.is_mark(0):
        del nodes[0]
        found.grown = [number - 1 for number in found.grown]
