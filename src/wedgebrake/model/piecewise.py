"""Piecewise-linear laws of torques over an angle or a speed."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from wedgebrake.arrays import FloatArray


class Line(NamedTuple):
    """The quantity by_argument x + by_rate x' + offset of an argument x."""

    by_argument: float = 0.0
    by_rate: float = 0.0
    offset: float = 0.0


class Bound(NamedTuple):
    """A quantity that is positive while a piece lasts.

    line     : the quantity
    target   : number of the piece after it has reached zero
    quantity : number of the quantity; the same, with the opposite sign, bounds other pieces
    reached  : number of the quantity that is then zero in the piece ``target``
    turns    : change of the number of periods
    """

    line: Line
    target: int
    quantity: int
    reached: int
    turns: int = 0


class Piece(NamedTuple):
    """A line of a law.

    loss : torque whose work is not stored
    """

    torque: Line
    loss: Line
    bounds: tuple[Bound, ...] = ()


class Law(Protocol):
    """A piecewise-linear law T(x, x') of an argument x.

    At a state, the first piece applies none of whose bounds is negative.
    """

    @property
    def start(self) -> float:
        """Beginning of a period."""

    @property
    def period(self) -> float:
        """Period of the argument; 0: the law does not repeat."""

    @property
    def corners(self) -> tuple[float, ...]:
        """Arguments at which two pieces meet."""

    def pieces(self) -> tuple[Piece, ...]:
        """The pieces of a period."""

    def piece_at(self, argument: FloatArray, rate: FloatArray) -> NDArray[np.intp]:
        """Numbers of the pieces at arguments and their rates."""

    def stored(self, argument: FloatArray) -> FloatArray:
        """The energy stored in a spring [J]."""


@dataclass(frozen=True)
class Chain:
    """Lines that join each other, and damping.

    places  : (k,) arguments where two lines meet, ascending
    values  : (k,) torques there [N m]
    slopes  : (k + 1,) of the lines
    damping : torque over the rate of the argument
    period  : of the argument, in which the first and the last line are one; 0: none
    neutral : argument at which no energy is stored; None: the chain is no spring
    """

    places: tuple[float, ...]
    values: tuple[float, ...]
    slopes: tuple[float, ...]
    damping: float = 0.0
    period: float = 0.0
    neutral: float | None = None

    @property
    def start(self) -> float:
        """Beginning of a period."""
        return self.places[0]

    @property
    def corners(self) -> tuple[float, ...]:
        """Arguments at which two lines meet."""
        return self.places

    def pieces(self) -> tuple[Piece, ...]:
        """The lines; of a chain with a period, those of the period that begins at ``start``."""
        found, last = [], len(self.places)
        for number in range(1 if self.period else 0, last + 1):
            at = max(number - 1, 0)
            offset = self.values[at] - self.slopes[number] * self.places[at]
            torque = Line(self.slopes[number], self.damping, offset)
            loss = Line(by_rate=self.damping) if self.neutral is not None else torque
            found.append(Piece(torque, loss, tuple(self._bounds(number, last))))
        return tuple(found)

    def _bounds(self, number: int, last: int) -> Iterator[Bound]:
        """The bounds of a line: it begins at a place and ends at the next one."""
        first = 1 if self.period else 0  # number of the first piece
        if number > first:
            line = Line(1.0, 0.0, -self.places[number - 1])
            yield Bound(line, number - 1 - first, number - 1, number - 1)
        elif self.period:
            line = Line(1.0, 0.0, -self.start)
            yield Bound(line, last - first, 0, last, -1)
        if number < last:
            line = Line(-1.0, 0.0, self.places[number])
            yield Bound(line, number + 1 - first, number, number)
        elif self.period:
            line = Line(-1.0, 0.0, self.start + self.period)
            yield Bound(line, 0, last, 0, 1)

    def piece_at(self, argument: FloatArray, rate: FloatArray) -> NDArray[np.intp]:  # noqa: ARG002
        """Numbers of the pieces at arguments."""
        if not self.period:
            return np.asarray(np.searchsorted(self.places, argument))
        within = self.start + np.mod(argument - self.start, self.period)
        return np.maximum(np.searchsorted(self.places, within) - 1, 0)

    def stored(self, argument: FloatArray) -> FloatArray:
        """The energy stored in a spring [J]."""
        found = np.zeros(np.shape(argument))
        if self.neutral is None:
            return found
        edges = (-math.inf, *self.places, math.inf)
        for (low, high), piece in zip(pairwise(edges), self.pieces(), strict=True):
            begin, end = np.clip(self.neutral, low, high), np.clip(argument, low, high)
            line = piece.torque
            # The mean torque of a line is that of its middle.
            mean = line.by_argument * 0.5 * (begin + end) + line.offset
            found = found + mean * (end - begin)
        return np.asarray(found)


@dataclass(frozen=True)
class Gap:
    """No torque between two arguments; beyond them a spring and a damper, which do not pull."""

    low: float
    high: float
    stiffness: float
    damping: float = 0.0

    start = period = 0.0

    @property
    def corners(self) -> tuple[float, ...]:
        """The limits."""
        return (self.low, self.high)

    def pieces(self) -> tuple[Piece, ...]:
        """Inside, beyond the limits without torque (if it is damped), and in contact."""
        if self.stiffness == 0.0 and self.damping == 0.0:
            return (Piece(Line(), Line()),)
        damped, wide = self.damping > 0.0, self.high > self.low
        if not damped and not wide:
            return (Piece(Line(self.stiffness, 0.0, -self.stiffness * self.low), Line()),)
        number = self._numbers()
        found = [self._inside(number)] if wide else []
        sides = ((self.low, -1.0, "below", "above", 0), (self.high, 1.0, "above", "below", 1))
        apart, pressed = [], []
        for limit, sign, name, other, quantity in sides:
            # sign (x - limit) > 0 outside the gap, sign (k (x - limit) + c x') > 0 in contact.
            quantity = quantity if wide else 0
            outside = Line(sign, 0.0, -sign * limit)
            push = Line(self.stiffness, self.damping, -self.stiffness * limit)
            pressing = Line(*(sign * one for one in push))
            inwards = Bound(outside, number["inside" if wide else other], quantity, quantity)
            loss = Line(by_rate=self.damping)
            if not damped:
                pressed.append(Piece(push, loss, (inwards,)))
                continue
            touches = 2 + (quantity if wide else int(sign > 0.0))
            leaving = Bound(pressing, number[f"apart {name}"], touches, touches)
            pressed.append(Piece(push, loss, (leaving,)))
            meeting = Bound(Line(*(-one for one in pressing)), number[name], touches, touches)
            relaxing = Line(-self.stiffness, 0.0, self.stiffness * limit)
            apart.append(Piece(Line(), relaxing, (inwards, meeting)))
        return (*found, *apart, *pressed)

    def _numbers(self) -> dict[str, int]:
        """Numbers of the pieces by name."""
        names = ["inside"] if self.high > self.low else []
        names += ["apart below", "apart above"] if self.damping > 0.0 else []
        return {name: number for number, name in enumerate([*names, "below", "above"])}

    def _inside(self, number: dict[str, int]) -> Piece:
        below = Bound(Line(1.0, 0.0, -self.low), number["below"], 0, 0)
        above = Bound(Line(-1.0, 0.0, self.high), number["above"], 1, 1)
        return Piece(Line(), Line(), (below, above))

    def piece_at(self, argument: FloatArray, rate: FloatArray) -> NDArray[np.intp]:
        """Numbers of the pieces at arguments and their rates."""
        if self.damping == 0.0 and (self.high == self.low or self.stiffness == 0.0):
            return np.zeros(np.shape(argument), np.intp)
        numbers = self._numbers()
        below, above = argument - self.low, argument - self.high
        inside = (below >= 0.0) & (above <= 0.0)
        outside = np.where(above > 0.0, above, below)
        push = self.stiffness * outside + self.damping * rate
        pressed = push * outside > 0.0
        found = np.where(above > 0.0, numbers["above"], numbers["below"])
        if self.damping > 0.0:
            apart = np.where(above > 0.0, numbers["apart above"], numbers["apart below"])
            found = np.where(pressed, found, apart)
        return np.asarray(np.where(inside, numbers.get("inside", found), found))

    def stored(self, argument: FloatArray) -> FloatArray:
        """The energy stored in the spring [J]; it relaxes as it follows the body that leaves it."""
        x = argument - np.clip(argument, self.low, self.high)
        return np.asarray(0.5 * self.stiffness * x**2)
