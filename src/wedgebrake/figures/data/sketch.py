"""Contents of the sketch of a machine: its bodies in a row, and what joins and drives them.

Bodies that are joined are side by side. Parts between bodies are between them or above them, parts
of one body below it; signals of controllers run along the bottom. One unit of length is about the
distance of two bodies.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

from wedgebrake.model.controller import Controller
from wedgebrake.model.machine import Machine
from wedgebrake.model.machine_parts import GROUND, OverState, Stages
from wedgebrake.model.signals.signals import Signal, number_of
from wedgebrake.model.system_base import System
from wedgebrake.model.validation import check_instance

Point = tuple[float, float]
_Shape = tuple[str, list[Point]]

RADIUS = 0.3
"""Radius of a body."""
# Least half distance of two bodies; distance of the parts below a body; half length of a symbol.
_HALF, _SLOT, _REACH = 0.63, 0.42, 0.2
# Heights of the lowest line above the bodies, of the next one above it, and of names above symbols.
_FIRST, _STEP, _NAME = 0.62, 0.48, 0.21
# Parts below a body: where their symbols begin, the places of their names by turns.
_BELOW, _NAMES = -0.44, (-1.03, -1.19)
# Lines of signals below everything else, and the size of the box with the name of a controller.
_SIGNAL, _BOX = 0.34, (0.095, 0.11)
# Length of the head of an arrow.
_HEAD = 0.08
# Most bodies whose order is the best of all orders.
_MOST = 7


class Line(NamedTuple):
    """A line that belongs to a part.

    look : "line", "bold" (of a contact), "area" (closed, filled with white), "head" (of an arrow,
           closed and filled), or "signal" and "signal head" (of controllers)
    """

    part: str
    points: tuple[Point, ...]
    look: str = "line"


class Text(NamedTuple):
    """The name of a part, or another word, about a point; ``wide`` is the width that it has."""

    part: str
    words: str
    at: Point
    wide: float


class Disc(NamedTuple):
    """A body seen along its axis."""

    name: str
    at: Point
    driven: bool


@dataclass(frozen=True)
class Sketch:
    """The sketch of a machine: bodies, lines and texts, and the (left, bottom, right, top)."""

    discs: tuple[Disc, ...]
    lines: tuple[Line, ...]
    texts: tuple[Text, ...]
    box: tuple[float, float, float, float]

    @classmethod
    def of(cls, system: System) -> Sketch:
        """The sketch of a machine, or of the machine that a driveline is.

        Raises ``InputError`` for anything else.
        """
        check_instance("system", system, System, "a Machine or a BrakedDriveline")
        return _Drawing(system.unreduced).sketch()


# Symbols about (0, 0), along the first coordinate, from -_REACH to _REACH.


def _between(low: float, high: float, *shapes: _Shape) -> list[_Shape]:
    """Shapes with lines to both ends of a symbol."""
    return [("line", [(-_REACH, 0.0), (low, 0.0)]), *shapes, ("line", [(high, 0.0), (_REACH, 0.0)])]


def _zigzag(low: float, high: float, heights: Sequence[float]) -> list[Point]:
    step = (high - low) / len(heights)
    teeth = [(low + (i + 0.5) * step, (-1) ** i * one) for i, one in enumerate(heights)]
    return [(low, 0.0), *teeth, (high, 0.0)]


def _bar(at: float, half: float = 0.1) -> list[Point]:
    return [(at, -half), (at, half)]


def _circle(radius: float, at: Point = (0.0, 0.0)) -> list[Point]:
    turns = [2.0 * math.pi * i / 24 for i in range(25)]
    return [(at[0] + radius * math.cos(one), at[1] + radius * math.sin(one)) for one in turns]


def _dashpot() -> list[_Shape]:
    cup = [(0.08, 0.08), (-0.08, 0.08), (-0.08, -0.08), (0.08, -0.08)]
    return _between(-0.08, 0.02, ("line", cup), ("line", _bar(0.02, 0.055)))


def _shaft(part: Any) -> list[_Shape]:
    if isinstance(part.stiffness, Stages):
        return _between(-0.14, 0.14, ("line", _zigzag(-0.14, 0.14, [0.03] * 4 + [0.09] * 4)))
    if part.gap is not None:
        spring = ("line", _zigzag(-0.01, 0.16, [0.07] * 6))
        return _between(-0.13, 0.16, ("line", _bar(-0.13)), ("line", _bar(-0.01)), spring)
    if part.stiffness == 0.0:
        return _dashpot()
    return _between(-0.14, 0.14, ("line", _zigzag(-0.14, 0.14, [0.07] * 8)))


def _contact(_: Any) -> list[_Shape]:
    return _between(-0.025, 0.025, ("bold", _bar(-0.025, 0.12)), ("bold", _bar(0.025, 0.12)))


def _one_way(part: Any) -> list[_Shape]:
    side = 0.08 * part.direction
    wedge = [(-side, 0.09), (side, 0.0), (-side, -0.09), (-side, 0.09)]
    return _between(-0.08, 0.08, ("area", wedge), ("bold", _bar(side)))


def _gear(_: Any) -> list[_Shape]:
    return _between(-0.16, 0.16, ("area", _circle(0.06, (-0.1, 0.0))),
                    ("area", _circle(0.1, (0.06, 0.0))))  # fmt: skip


def _planetary(_: Any) -> list[_Shape]:
    planets = [("area", _circle(0.03, (0.0, side))) for side in (-0.075, 0.075)]
    wheels: list[_Shape] = [("area", _circle(0.12)), ("area", _circle(0.035)), *planets]
    return _between(-0.12, 0.12, *wheels)


def _rigid(_: Any) -> list[_Shape]:
    pair = [("line", [(-0.12, side), (0.12, side)]) for side in (-0.025, 0.025)]
    return _between(-0.12, 0.12, *pair, ("line", _bar(-0.12, 0.06)), ("line", _bar(0.12, 0.06)))


def _torque(part: Any) -> list[_Shape]:
    if isinstance(part.signal, OverState):
        frame = [(-0.1, -0.1), (0.1, -0.1), (0.1, 0.1), (-0.1, 0.1), (-0.1, -0.1)]
        curve = [(-0.07, 0.05), (-0.02, 0.05), (0.04, -0.05), (0.07, -0.05)]
        return _between(-0.1, 0.1, ("area", frame), ("line", curve))
    turns = [math.radians(one) for one in range(150, -121, -15)]
    arc = [(0.1 * math.cos(one), 0.1 * math.sin(one)) for one in turns]
    return [("line", [(-_REACH, 0.0), (0.0, 0.0)]), ("arrow", arc)]


def _unknown(_: Any) -> list[_Shape]:
    frame = [(-0.1, -0.1), (0.1, -0.1), (0.1, 0.1), (-0.1, 0.1), (-0.1, -0.1)]
    return _between(-0.1, 0.1, ("area", frame))


_SYMBOLS: dict[str, Callable[[Any], list[_Shape]]] = {
    "shaft": _shaft, "contact": _contact, "one_way_clutch": _one_way,
    "drag": lambda _: _dashpot(), "gear": _gear, "planetary": _planetary, "rigid": _rigid,
    "torque": _torque,
}  # fmt: skip
"""Symbols by the table of a part; a part of another class is a box."""


class _Drawing:
    def __init__(self, machine: Machine) -> None:
        self.machine = machine
        bodies = [one.name for one in machine.inertias]
        parts = [
            part for name, part in machine.parts().items()
            if name not in bodies and not isinstance(part, Controller)
        ]  # fmt: skip
        joined = {part.name: _ends(part, bodies) for part in parts}
        self.links = [part for part in parts if len(joined[part.name]) > 1]
        self.single = [part for part in parts if len(joined[part.name]) == 1]
        self.joined = joined
        self.order = _order(bodies, [joined[part.name] for part in self.links])
        self.below = {name: [one for one in self.single if joined[one.name] == (name,)]
                      for name in bodies}  # fmt: skip
        ends = [end for loop in self._signals() for end in (*loop[1], loop[2])]
        self.x = self._places(ends)
        self.lines: list[Line] = []
        self.texts: list[Text] = []
        # Where signals begin and end: at a body, or at the symbol of another part.
        self.symbols: dict[str, tuple[Point, str]] = {}
        self.used: dict[str, int] = {}

    def _places(self, ends: Sequence[str]) -> dict[str, float]:
        """Places of the bodies, with the widths that the parts below them need."""
        found: dict[str, float] = {}
        at = before = 0.0
        for name in self.order:
            half = max(_HALF, 0.5 * _SLOT * len(self.below[name]) + 0.08 * (1 + ends.count(name)))
            at += before + half if found else 0.0
            found[name], before = at, half
        return found

    def sketch(self) -> Sketch:
        """Everything at its place."""
        for part, level in self._levels():
            self._link(part, level)
        for name in self.order:
            for slot, part in enumerate(self.below[name]):
                self._hang(part, name, slot)
        for number, signal in enumerate(self._signals()):
            self._signal(number, *signal)
        driven = {one.name for one in self.machine.driven}
        discs = tuple(Disc(name, (self.x[name], 0.0), name in driven) for name in self.x)
        points = [point for line in self.lines for point in line.points]
        points += [(one.at[0] + side * 0.4 * one.wide, one.at[1] + 0.4 * side * RADIUS)
                   for one in self.texts for side in (-1.0, 1.0)]  # fmt: skip
        points += [(one.at[0] + side, one.at[1] + side) for one in discs for side in (-0.4, 0.4)]
        across, up = zip(*points, strict=True)
        box = (min(across), min(up), max(across), max(up))
        return Sketch(discs, tuple(self.lines), tuple(self.texts), box)

    def _levels(self) -> Iterator[tuple[Any, int]]:
        """Parts between bodies, each with its line: 0 between the bodies, others above them."""
        taken: dict[int, list[tuple[int, int]]] = {}

        def reach(part: Any) -> tuple[int, int]:
            places = [self.order.index(name) for name in self.joined[part.name]]
            return min(places), max(places)

        for part in sorted(self.links, key=lambda one: reach(one)[1] - reach(one)[0]):
            first, last = reach(part)
            level = 0 if last - first == 1 and len(self.joined[part.name]) == 2 else 1
            while any(first < high and low < last for low, high in taken.get(level, [])):
                level += 1
            taken.setdefault(level, []).append((first, last))
            yield part, level

    def _draw(self, part: Any, at: Point, *, turned: bool = False, flipped: bool = False) -> None:
        """The symbol of a part; turned, it points downwards."""
        side = -1.0 if flipped else 1.0
        for look, points in _SYMBOLS.get(part.table, _unknown)(part):
            placed = [
                (at[0] + side * v, at[1] - u) if turned else (at[0] + side * u, at[1] + v)
                for u, v in points
            ]
            self._add(part.name, placed, look)

    def _add(self, part: str, points: Sequence[Point], look: str = "line") -> None:
        """A line; that of an arrow has a head at its end."""
        points = [one for one, _ in itertools.groupby(points)]
        if not look.endswith("arrow"):
            self.lines.append(Line(part, tuple(points), look))
            return
        kind = look.removesuffix("arrow")
        (x, y), (u, v) = points[-1], (points[-1][i] - points[-2][i] for i in (0, 1))
        u, v = u * _HEAD / math.hypot(u, v), v * _HEAD / math.hypot(u, v)
        sides = [(x - u - 0.4 * side * v, y - v + 0.4 * side * u) for side in (-1.0, 1.0)]
        self._add(part, points, kind.strip() or "line")
        self._add(part, [(x, y), *sides, (x, y)], f"{kind}head")

    def _name(self, part: Any, at: Point, wide: float) -> None:
        """The name of a part; a name that only repeats those of its bodies is left out."""
        if "name" in part.model_fields_set:
            self.texts.append(Text(part.name, part.name, at, wide))

    def _link(self, part: Any, level: int) -> None:
        """A part between two or more bodies."""
        names = sorted(self.joined[part.name], key=self.order.index)
        first, last = self.order.index(names[0]), self.order.index(names[-1])
        # Symbols are between bodies, where signals can reach them from below.
        gap = (first + last - 1) // 2
        middle = 0.5 * (self.x[self.order[gap]] + self.x[self.order[gap + 1]])
        y = _FIRST + _STEP * (level - 1) if level else 0.0
        left, right = self.x[names[0]], self.x[names[-1]]
        # The line from an inner part is further out, so that lines do not cross.
        out = max(0.17 - 0.05 * (level - 1), 0.04)
        ends = (left + out, right - out) if level else (left + RADIUS, right - RADIUS)
        for end, at in zip(ends, (left, right), strict=True):
            rise = [(end, math.sqrt(RADIUS**2 - (end - at) ** 2))] if level else []
            inner = middle + (_REACH if end > middle else -_REACH)
            self._add(part.name, [*rise, (end, y), (inner, y)])
        for name in names[1:-1]:
            at = self.x[name]
            self._add(part.name, [(at, RADIUS), (at, y)])
        if len(names) > 2:
            places = dict(zip(names, (ends[0], *(self.x[one] for one in names[1:-1]), ends[1]),
                              strict=True))  # fmt: skip
            for field in part.ends:
                letter = (places[getattr(part, field)] + 0.07, y - 0.12)
                self.texts.append(Text(part.name, field[0], letter, 0.1))
        self._draw(part, (middle, y), flipped=names[0] != self.joined[part.name][0])
        wide = 1.1 if level else 0.8
        self._name(part, (middle, y + _NAME), wide)
        self.symbols[part.name] = (middle, y - 0.13), ""

    def _hang(self, part: Any, body: str, slot: int) -> None:
        """A part between a body and the ground, or a torque, below the body."""
        offset = (slot - 0.5 * (len(self.below[body]) - 1)) * _SLOT
        start = max(-0.2, min(0.2, offset))
        x, edge = self.x[body], -math.sqrt(RADIUS**2 - start**2)
        stem = [(x + start, edge), (x + start, _BELOW + 0.06), (x + offset, _BELOW + 0.06)]
        at = (x + offset, _BELOW - _REACH)
        self._add(part.name, [*stem, (x + offset, _BELOW)])
        self._draw(part, at, turned=True)
        if GROUND in _given_ends(part):
            self._ground(part, (at[0], _BELOW - 2.0 * _REACH))
        self._name(part, (at[0], _NAMES[slot % 2]), 0.95)
        self.symbols[part.name] = (at[0] + 0.13, at[1]), "beside"

    def _ground(self, part: Any, at: Point) -> None:
        """The ground, or the base of a contact, which may turn."""
        x, y = at
        self._add(part.name, [(x - 0.14, y), (x + 0.14, y)])
        base = getattr(part, "base_speed", 0.0)
        if isinstance(base, Signal) or number_of(base) != 0.0:
            self._add(part.name, [(x - 0.14, y - 0.07), (x + 0.14, y - 0.07)], "arrow")
            return
        for i in range(5):
            top = x - 0.1 + 0.06 * i
            self._add(part.name, [(top, y), (top - 0.05, y - 0.07)])

    def _signals(self) -> Iterator[tuple[str, list[str], str]]:
        """Name, measured parts and the part acted on: of controllers, and of normal forces."""
        for loop in self.machine.controllers:
            measured = [name.rpartition(".")[0] for name in loop.measured]
            yield loop.name, list(dict.fromkeys(measured)), loop.acts_on[0]
        for one in self.machine.contacts:
            names = [name.rpartition(".")[0] for name in one.normal]
            if names:
                yield "", list(dict.fromkeys(names)), one.name

    def _signal(self, number: int, name: str, measured: list[str], onto: str) -> None:
        below = (_NAMES[1] if self.single else -RADIUS) - 0.24
        y = below - _SIGNAL * number
        starts = [self._down(one, y) for one in measured]
        end = self._down(onto, y)
        for points in starts:
            self._add(name or onto, [*points, (end[-1][0], y)], "signal")
        self._add(name or onto, end[::-1], "signal arrow")
        if name:
            across = [points[-1][0] for points in (*starts, end)]
            middle = 0.5 * (min(across) + max(across))
            half, tall = 0.5 * (_BOX[0] * len(name) + 0.12), _BOX[1]
            box = [(middle + side * half, y + up * tall)
                   for side, up in ((-1, -1), (1, -1), (1, 1), (-1, 1), (-1, -1))]  # fmt: skip
            self._add(name, box, "area")
            self.texts.append(Text(name, name, (middle, y), 2.0 * half))

    def _down(self, part: str, y: float) -> list[Point]:
        """A line from a body, or from the symbol of another part, down to a height."""
        count = self.used[part] = self.used.get(part, 0) + 1
        if part in self.x:
            slots = len(self.below[part])
            offset = (0.5 * _SLOT * slots + 0.06 if slots else 0.0) + 0.1 * (count - 1)
            start = min(offset, 0.29)
            edge = (self.x[part] + start, -math.sqrt(RADIUS**2 - start**2))
            return [edge, (self.x[part] + offset, edge[1]), (self.x[part] + offset, y)]
        at, beside = self.symbols[part]
        out = (at[0] + (0.07 if beside else 0.0) + 0.06 * (count - 1), at[1])
        return [at, out, (out[0], y)]


def _given_ends(part: Any) -> list[str]:
    """The bodies and the ground that a part names, in order."""
    fields = getattr(part, "ends", ("a", "b", "on", "relative_to"))
    return [one for field in fields if (one := getattr(part, field, None)) is not None]


def _ends(part: Any, bodies: Sequence[str]) -> tuple[str, ...]:
    return tuple(one for one in _given_ends(part) if one in bodies)


def _order(bodies: Sequence[str], links: Sequence[tuple[str, ...]]) -> list[str]:
    """The bodies in an order with short links, most of which go from left to right."""
    if len(bodies) > _MOST:
        return list(bodies)

    def cost(order: Sequence[str]) -> tuple[int, int]:
        places = [[order.index(name) for name in link] for link in links]
        lengths = sum(max(one) - min(one) for one in places)
        return lengths, sum(one[0] > one[-1] for one in places)

    return min(map(list, itertools.permutations(bodies)), key=cost)
