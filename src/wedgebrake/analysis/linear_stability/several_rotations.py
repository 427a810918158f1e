"""Steady sliding of a machine with several free rotations: all solutions of their balances.

The speeds of the inertias are W s, with one column of W for each free rotation, and the balance is
W'(torques - dampers - contacts) = 0. One rotation, the hub, is chosen such that dampers and
contacts couple each of the others to it alone. At a given speed of the hub, each of the other
balances is an equation for one speed; along the curves of its solutions, the balance of the hub is
searched for zeros. Tables of the contacts' torques suffice to locate the zeros; Newton's method
with the laws themselves then gives the speeds.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import pairwise, product
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from wedgebrake.analysis.linear_stability.sliding_contact import Method, frozen, linearised
from wedgebrake.arrays import FloatArray
from wedgebrake.model.machine import Machine
from wedgebrake.model.machine_matrices import contact_rows, shaft_matrices
from wedgebrake.model.machine_parts import Contact
from wedgebrake.model.validation import wrong

# Relative size below which a factor of a rotation is rounding error.
_RANK = 1e-10
# Sliding speeds of the tables, and distances from speeds at which a contact stands, relative to the
# typical speed: powers of ten, and values per decade.
_NEAREST, _FURTHEST, _TABLE, _HUB, _OTHER = -9, 6, 32, 6, 6
# How many times an interval with a zero is subdivided, and into how many parts.
_TIMES, _PARTS = 2, 16
# Newton's method: largest number of steps, relative size of the last one, and relative size below
# which steps that no longer shrink are rounding errors.
_MOST_STEPS, _LAST, _ROUNDING = 100, 4e-16, 1e-10
# Solutions on the same side of a fold are equal if their speeds differ by less, relative to the sum
# of the typical speed and their own.
_SAME = 1e-7


def balanced_speeds(
    machine: Machine, free: FloatArray, carried: FloatArray, sticking: Sequence[str],
    method: Method,
) -> list[list[float]]:  # fmt: skip
    """Speeds of the inertias [rad/s] in each steady sliding, in ascending order.

    free     : (n, r) free rotations
    carried  : (n,) speeds to which these are added
    sticking : names of the contacts that stick

    Raises ``InputError`` if speeds are undetermined, or if there is no hub.
    """
    rotations = _sparse(free)
    balances = _Balances(machine, rotations, carried, sticking, method)
    if balances.undetermined:
        raise wrong(
            "machine", machine, "a machine with isolated steady sliding",
            "Its torques are in balance at every speed. Give the speeds of its inertias.",
        )  # fmt: skip
    hub = balances.hub()
    if hub is None:
        raise wrong(
            "machine", machine, "a machine in which one free rotation couples all others",
            f"It has {rotations.shape[1]} free rotations, which contacts and dampers couple in a"
            " longer chain or in a ring. Join its inertias, give contacts that stick:"
            " sticking=(...), or give the speeds of its inertias.",
        )  # fmt: skip
    found: list[_Solution] = []
    for starts in _Search(balances, hub).starts():
        near = [balances.solved(start) for start in starts]
        sides = {one.side for one in near if one is not None}
        # The two solutions beside an extremum are on different sides of a fold.
        if len(sides) == len(starts):
            known = [one for one in near if one is not None]
            found += [one for one in known if not any(balances.same(one, two) for two in found)]
    return sorted((carried + rotations @ one.speeds + 0.0).tolist() for one in found)


def _sparse(free: FloatArray) -> FloatArray:
    """A basis of the same rotations, each of which turns as few inertias as possible."""
    rows = free.T.copy()
    for number in range(len(rows)):
        pivot = int(np.argmax(np.abs(rows[number])))
        rows[number] /= rows[number, pivot]
        others = np.arange(len(rows)) != number
        rows[others] -= np.outer(rows[others, pivot], rows[number])
    rows[np.abs(rows) <= _RANK] = 0.0
    return rows.T


class _Solution(NamedTuple):
    """Speeds of the rotations in steady sliding.

    side : sign of the determinant of the balances, which differs where two solutions meet
    """

    speeds: FloatArray
    side: float


class _Table(NamedTuple):
    """Torque of a contact over the logarithm of the sliding speed, backwards and forwards."""

    logs: FloatArray
    torques: tuple[FloatArray, FloatArray]

    def __call__(self, sliding: FloatArray, forwards: NDArray[np.bool_]) -> FloatArray:
        """Torque at sliding speeds, whose directions are given because of rounding near rest."""
        at = np.log(np.maximum(np.abs(sliding), 1e-300))
        return np.where(forwards, *(np.interp(at, self.logs, one) for one in self.torques[::-1]))


class _Balances:
    """Torques along the free rotations, as functions of their speeds.

    rotations : (n, r)
    factors   : (contacts, r) of the speeds in the sliding speeds of those that act on a rotation
    bases     : (contacts,) speeds that are subtracted
    """

    def __init__(
        self, machine: Machine, rotations: FloatArray, carried: FloatArray,
        sticking: Sequence[str], method: Method,
    ) -> None:  # fmt: skip
        self._method = method
        rows = contact_rows(machine) @ rotations
        rows[np.abs(rows) <= _RANK] = 0.0
        acting = [
            number
            for number, one in enumerate(machine.contacts)
            if one.name not in sticking and np.any(rows[number])
        ]
        self.contacts: list[Contact] = [machine.contacts[number] for number in acting]
        self.factors = rows[acting]
        self.bases = np.array([frozen(one.base_speed) for one in self.contacts])
        self.bases = self.bases - contact_rows(machine)[acting] @ carried
        damping = shaft_matrices(machine)[1]
        self.drive = -rotations.T @ damping @ carried
        for one in machine.torques:
            if one.over_time is not None:
                self.drive += rotations[machine.index(one.on)] * frozen(one.over_time)
        self.damping = rotations.T @ damping @ rotations
        self.damping[np.abs(self.damping) <= _RANK * np.max(np.abs(self.damping), initial=0)] = 0.0
        speeds = [abs(frozen(one.speed)) for one in machine.inertias]
        self.typical = max([1.0, *speeds, *np.abs(self.bases).tolist()])

    @property
    def undetermined(self) -> bool:
        """True if nothing drives or restrains some combination of the rotations."""
        acts = [
            linearised(one, 0.0, 1, self._method).force != 0.0 or one.actuation.slope != 0.0
            for one in self.contacts
        ]
        rows = np.vstack([self.damping, self.factors[acts]])
        return bool(np.linalg.matrix_rank(rows, tol=_RANK) < len(self.drive)) and not np.any(
            self.drive @ _null(rows)
        )

    def hub(self) -> int | None:
        """The rotation to which each of the others is coupled alone; None if there is none."""
        count = len(self.drive)
        coupled = (self.damping != 0.0) | ((self.factors != 0.0).T @ (self.factors != 0.0) > 0)
        for hub in range(count):
            others = [one for one in range(count) if one != hub]
            apart = not np.any(coupled[np.ix_(others, others)] & ~np.eye(count - 1, dtype=bool))
            if apart and np.all(np.count_nonzero(self.factors[:, others], axis=1) <= 1):
                return hub
        return None

    def tables(self) -> list[_Table]:
        """Torque of each contact over its sliding speed; nan where a brake locks itself."""
        count = _TABLE * (_FURTHEST - _NEAREST) + 1
        speeds = self.typical * np.logspace(_NEAREST, _FURTHEST, count)
        found = []
        for contact in self.contacts:
            torques = tuple(
                np.array([self._torque(contact, speed, side)[0] for speed in speeds.tolist()])
                for side in (-1, 1)
            )
            found.append(_Table(np.log(speeds), (torques[0], torques[1])))
        return found

    def solved(self, start: FloatArray) -> _Solution | None:
        """The solution near a start, with the same directions of sliding; None if not found."""
        speeds = start
        sides = np.sign(self.factors @ speeds - self.bases)
        last = np.inf
        for _ in range(_MOST_STEPS):
            torque, matrix = self.drive - self.damping @ speeds, -self.damping
            for contact, row, base, side in zip(
                self.contacts, self.factors, self.bases, sides.tolist(), strict=True
            ):
                size, slope = self._torque(contact, abs(row @ speeds - base), int(side))
                torque, matrix = torque - row * size, matrix - slope * np.outer(row, row)
            # No solution where a brake locks itself.
            if not np.all(np.isfinite(torque)) or np.linalg.det(matrix) == 0.0:
                return None
            step = -np.linalg.solve(matrix, torque)
            share = 1.0
            while np.any(np.sign(self.factors @ (speeds + share * step) - self.bases) != sides):
                share *= 0.5
                if share < 1e-6:
                    return None
            moved, speeds = float(np.max(np.abs(share * step))), speeds + share * step
            scale = self.typical + float(np.max(np.abs(speeds)))
            if moved <= _LAST * scale or (last <= _ROUNDING * scale and moved >= last):
                return _Solution(speeds, float(np.sign(np.linalg.det(matrix))))
            last = moved
        return None

    def _torque(self, contact: Contact, speed: float, side: int) -> tuple[float, float]:
        """Torque that a contact takes from its first inertia, and its slope; nan if locked."""
        one = linearised(contact, speed, side, self._method)
        return (np.nan, np.nan) if one.locked else (one.gain * one.force, one.damping)

    def same(self, one: _Solution, other: _Solution) -> bool:
        """Return True if two solutions are equal up to rounding."""
        scale = self.typical + float(np.max(np.abs(one.speeds)))
        gap = float(np.max(np.abs(one.speeds - other.speeds)))
        return one.side == other.side and gap <= _SAME * scale


def _null(rows: FloatArray) -> FloatArray:
    """Basis of the null space of the rows, as columns."""
    _, values, right = np.linalg.svd(rows)
    return np.asarray(right[int(np.sum(values > _RANK)) :].T)


class _Root(NamedTuple):
    """A solution of the balance of one rotation: sliding directions as bits, and the speed."""

    sides: int
    speed: float


class _Row(NamedTuple):
    """All solutions of the balances beside the hub, at one speed of the hub.

    side   : sliding directions of the contacts that act on the hub alone, as bits
    roots  : of each other rotation, in ascending order
    torque : along the hub, by the numbers of the roots
    """

    speed: float
    side: int
    roots: tuple[tuple[_Root, ...], ...]
    torque: dict[tuple[int, ...], float]

    def start(self, hub: int, numbers: tuple[int, ...]) -> FloatArray:
        """Speeds of all rotations."""
        speeds = [row[number].speed for row, number in zip(self.roots, numbers, strict=True)]
        return np.insert(np.array(speeds), hub, self.speed)


class _Search:
    """Speeds near all solutions."""

    def __init__(self, balances: _Balances, hub: int) -> None:
        self._balances, self._hub = balances, hub
        self._tables = balances.tables()
        self._others = [one for one in range(len(balances.drive)) if one != hub]

    def starts(self) -> Iterator[tuple[FloatArray, ...]]:
        """Speeds from which Newton's method leads to a solution, or to two that are close."""
        rows = self._rows(np.array(self._hub_speeds()))
        for _ in range(_TIMES):
            parts = [
                np.linspace(one.speed, other.speed, _PARTS, endpoint=False)[1:]
                for one, other in pairwise(rows)
                if one.side == other.side and self._changes(one, other)
            ]
            if parts:
                rows = sorted(
                    [*rows, *self._rows(np.concatenate(parts))], key=lambda row: row.speed
                )
        for one, other in pairwise(rows):
            if one.side == other.side:
                yield from ((start,) for start in self._between(one, other))
        for before, here, after in zip(rows, rows[1:], rows[2:], strict=False):
            if before.side == here.side == after.side:
                yield from self._extremes(before, here, after)

    def _hub_speeds(self) -> list[float]:
        """Speeds of the hub, denser where a contact stands."""
        given, hub = self._balances, self._hub
        ends = {0.0}
        for row, base in zip(given.factors, given.bases, strict=True):
            if row[hub] != 0.0:
                (other,) = (
                    np.flatnonzero(np.delete(row, hub)) if np.count_nonzero(row) > 1 else (-1,)
                )
                if other < 0:
                    ends.add(float(base / row[hub]))
                    continue
                number = self._others[int(other)]
                # Both this contact and one that acts on the other rotation alone stand.
                for own, at in zip(given.factors, given.bases, strict=True):
                    if own[number] != 0.0 and own[hub] == 0.0:
                        ends.add(float((base - row[number] * at / own[number]) / row[hub]))
        away = _away(given.typical, _HUB)
        about = np.array(sorted(ends))[:, None]
        points = np.unique(np.concatenate([about - away, about + away], axis=None))
        found: list[float] = points[~np.isin(points, list(ends))].tolist()
        return found

    def _rows(self, speeds: FloatArray) -> list[_Row]:
        """Solutions of the other balances, and the torque along the hub."""
        roots = [self._roots(number, speeds) for number in self._others]
        rows = []
        own = [
            (row[self._hub], base)
            for row, base in zip(self._balances.factors, self._balances.bases, strict=True)
            if np.count_nonzero(row) == 1 and row[self._hub] != 0.0
        ]
        for place, speed in enumerate(speeds.tolist()):
            here = tuple(tuple(one[place]) for one in roots)
            side = sum((factor * speed > base) << bit for bit, (factor, base) in enumerate(own))
            row = _Row(speed, side, here, {})
            for numbers in product(*(range(len(one)) for one in here)):
                row.torque[numbers] = self._hub_torque(row.start(self._hub, numbers))
            rows.append(row)
        return rows

    def _hub_torque(self, speeds: FloatArray) -> float:
        given, hub = self._balances, self._hub
        total = float(given.drive[hub] - given.damping[hub] @ speeds)
        for row, base, table in zip(given.factors, given.bases, self._tables, strict=True):
            if row[hub] != 0.0:
                sliding = np.array(row @ speeds - base)
                total -= float(row[hub] * table(sliding, sliding > 0.0))
        return total

    def _roots(self, number: int, hub_speeds: FloatArray) -> list[list[_Root]]:
        """Solutions of the balance of one rotation, at each speed of the hub."""
        given, hub = self._balances, self._hub
        contacts = [place for place in range(len(given.bases)) if given.factors[place, number]]
        # Speeds of the rotation at which each contact stands, (hub speeds, contacts).
        stands = np.array(
            [
                (given.bases[place] - given.factors[place, hub] * hub_speeds)
                / given.factors[place, number]
                for place in contacts
            ]
        ).reshape(len(contacts), -1)
        away = _away(given.typical, _OTHER)
        about = stands if contacts else np.zeros((1, len(hub_speeds)))
        points = np.concatenate([about + way for way in (*-away, *away)]).T
        points.sort(axis=1)
        values = given.drive[number] - given.damping[number, number] * points
        values -= (given.damping[number, hub] * hub_speeds)[:, None]
        sides = np.zeros(points.shape, int)
        for bit, (place, stand) in enumerate(zip(contacts, stands, strict=True)):
            factor = given.factors[place, number]
            beyond = points > stand[:, None]
            sides += beyond.astype(int) << bit
            forwards = beyond if factor > 0.0 else ~beyond
            sliding = factor * (points - stand[:, None])
            values -= factor * self._tables[place](sliding, forwards)
        low, high = values[:, :-1], values[:, 1:]
        crosses = (low > 0.0) != (high > 0.0)
        crosses &= (sides[:, :-1] == sides[:, 1:]) & np.isfinite(low) & np.isfinite(high)
        found: list[list[_Root]] = [[] for _ in hub_speeds]
        for row, column in np.argwhere(crosses).tolist():
            share = values[row, column] / (values[row, column] - values[row, column + 1])
            ends = points[row, column], points[row, column + 1]
            speed = float(ends[0] + share * (ends[1] - ends[0]))
            found[row].append(_Root(int(sides[row, column]), speed))
        return found

    def _matched(self, one: _Row, other: _Row) -> Iterator[tuple[tuple[int, ...], tuple[int, ...]]]:
        """Numbers of the solutions of two rows that are on the same curve."""
        pairs = []
        for first, second in zip(one.roots, other.roots, strict=True):
            same = []
            for sides in {root.sides for root in first}:
                places = [
                    [number for number, root in enumerate(roots) if root.sides == sides]
                    for roots in (first, second)
                ]
                if len(places[0]) == len(places[1]):
                    same += list(zip(*places, strict=True))
            pairs.append(same)
        for chosen in product(*pairs):
            yield tuple(a for a, _ in chosen), tuple(b for _, b in chosen)

    def _changes(self, one: _Row, other: _Row) -> bool:
        """Return True if a curve begins or ends, or a torque vanishes, between two rows."""
        kinds = [[[root.sides for root in roots] for roots in row.roots] for row in (one, other)]
        if kinds[0] != kinds[1]:
            return True
        return any(
            one.torque[first] * other.torque[second] <= 0.0
            for first, second in self._matched(one, other)
        )

    def _between(self, one: _Row, other: _Row) -> Iterator[FloatArray]:
        """Speeds between two rows at which the torque along the hub changes sign."""
        for first, second in self._matched(one, other):
            ends = one.torque[first], other.torque[second]
            if ends[0] * ends[1] <= 0.0 and ends[0] != ends[1]:
                share = ends[0] / (ends[0] - ends[1])
                low, high = one.start(self._hub, first), other.start(self._hub, second)
                yield low + share * (high - low)
        # Two curves that meet between the rows are one curve that turns back.
        for row, beside in ((one, other), (other, one)):
            for numbers in row.torque:
                for place, number in enumerate(numbers):
                    following = (*numbers[:place], number + 1, *numbers[place + 1 :])
                    if following not in row.torque or len(row.roots[place]) <= len(
                        beside.roots[place]
                    ):
                        continue
                    if row.torque[numbers] * row.torque[following] <= 0.0:
                        yield 0.5 * (
                            row.start(self._hub, numbers) + row.start(self._hub, following)
                        )

    def _extremes(
        self, before: _Row, here: _Row, after: _Row
    ) -> Iterator[tuple[FloatArray, FloatArray]]:
        """Speeds on both sides of the row, of three, at which a torque is nearest to zero."""
        ahead = dict(self._matched(here, after))
        for first, second in self._matched(before, here):
            if second not in ahead:
                continue
            middle = here.torque[second]
            ends = before.torque[first], after.torque[ahead[second]]
            if min(middle * ends[0], middle * ends[1]) > 0.0 and abs(middle) < min(map(abs, ends)):
                yield before.start(self._hub, first), after.start(self._hub, ahead[second])


def _away(typical: float, density: int) -> FloatArray:
    """Distances of the scanned speeds from one at which a contact stands."""
    count = density * (_FURTHEST - 1 - _NEAREST) + 1
    return np.asarray(typical * np.logspace(_NEAREST, _FURTHEST - 1, count))
