"""Machines with Coulomb friction at 40 digits: exact exponentials from event to event.

Every signal is a sum of sines and constants between its knots, so that each mode of the machine is
an autonomous linear system z' = A z of angles, speeds, sines, cosines and a constant 1, and
z(t) = exp(A t) z(0). Doubles choose where to look for an event; Newton's method on the exponential
finds it. Nothing is shared with the package or with ``machine_reference``.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import combinations, product
from typing import Any, NamedTuple

import numpy as np
from mpmath import mp
from scipy.linalg import expm

DIGITS = 50
_ZERO = 36  # what is below 10^-36 of its size is rounding of 50 digits

# Sum of (frequency [rad/s] as a string or 0, coefficient of sin, coefficient of cos).
Terms = tuple[tuple[Any, Any, Any], ...]


class Clutch(NamedTuple):
    """Contact between inertias a and b (-1: ground); slip torque and holding torque in ``terms``.

    pieces : (from time, terms of the torque in motion) in ascending order
    peak   : torque at rest over torque in motion
    """

    name: str
    a: int
    b: int
    pieces: tuple[tuple[Any, Terms], ...]
    peak: Any


class Line(NamedTuple):
    """Inertias, shafts (a, b, stiffness, damping), torques (inertia, pieces) and contacts."""

    inertia: tuple[Any, ...]
    speed: tuple[Any, ...]
    shafts: tuple[tuple[int, int, Any, Any], ...]
    contacts: tuple[Clutch, ...]
    torques: tuple[tuple[int, tuple[tuple[Any, Terms], ...]], ...]
    frequencies: tuple[Any, ...]


def line_of(machine: Any) -> Line:
    """A machine with Coulomb friction and harmonic torques of one frequency."""
    place = {"ground": -1} | {one.name: i for i, one in enumerate(machine.inertias)}
    frequency = 2 * mp.pi * mp.mpf(machine.torques[0].signal.frequency)

    def clutch(one: Any) -> Clutch:
        law = one.friction
        force = mp.mpf(one.brake.radius) * mp.mpf(one.actuation.initial_force)
        terms = ((0, 0, force * mp.mpf(law.kinetic)),)
        peak = mp.mpf(law.static) / mp.mpf(law.kinetic)
        return Clutch(one.name, place[one.a], place[one.b], ((0, terms),), peak)

    def torque(one: Any) -> Any:
        amplitude, phase = mp.mpf(one.signal.amplitude), mp.mpf(one.signal.phase)
        terms = ((frequency, amplitude * mp.cos(phase), amplitude * mp.sin(phase)),)
        return place[one.on], ((0, terms),)

    return Line(
        inertia=tuple(one.inertia for one in machine.inertias),
        speed=tuple(one.speed for one in machine.inertias),
        shafts=tuple(
            (place[one.a], place[one.b], one.stiffness, one.damping) for one in machine.shafts
        ),
        contacts=tuple(clutch(one) for one in machine.contacts),
        torques=tuple(torque(one) for one in machine.torques), frequencies=(frequency,),
    )  # fmt: skip


class Exact:
    """A ``Line`` at 50 digits: ``events`` as (time, contact, kind, side); the end in ``z``."""

    def __init__(self, line: Line, duration: Any) -> None:
        self.line, self.n = line, len(line.inertia)
        self.mass = [mp.mpf(value) for value in line.inertia]
        self.size = 2 * self.n + 2 * len(line.frequencies) + 1
        self.t = mp.mpf(0)
        self.z = mp.matrix(self.size, 1)
        for i, value in enumerate(line.speed):
            self.z[self.n + i] = mp.mpf(value)
        for k in range(len(line.frequencies)):
            self.z[2 * self.n + 2 * k + 1] = mp.mpf(1)
        self.z[self.size - 1] = mp.mpf(1)
        self.events: list[tuple[Any, int, str, int]] = []
        self.side = [0] * len(line.contacts)
        self.duration = mp.mpf(duration)

    def terms(self, pieces: Sequence[tuple[Any, Terms]]) -> Any:
        """The row of a signal after the present time."""
        row = mp.matrix(1, self.size)
        terms = [terms for begin, terms in pieces if mp.mpf(begin) <= self.t][-1]
        for frequency, sine, cosine in terms:
            if frequency == 0:
                row[self.size - 1] += mp.mpf(cosine)
                continue
            at = 2 * self.n + 2 * self.line.frequencies.index(frequency)
            row[at] += mp.mpf(sine)
            row[at + 1] += mp.mpf(cosine)
        return row

    def knots(self) -> list[Any]:
        pieces = [p for contact in self.line.contacts for p in contact.pieces]
        pieces += [p for _, one in self.line.torques for p in one]
        times = {mp.mpf(begin) for begin, _ in pieces if 0 < mp.mpf(begin) < self.duration}
        return [*sorted(times), self.duration]

    def speed_row(self, j: int) -> Any:
        row, contact = mp.matrix(1, self.size), self.line.contacts[j]
        row[self.n + contact.a] += 1
        if contact.b >= 0:
            row[self.n + contact.b] -= 1
        return row

    def mode(self, side: Sequence[int]) -> tuple[Any, dict[int, Any]]:
        """A, and the rows of the torques on a of the contacts at rest."""
        a, n = self._free(), self.n
        for j, contact in enumerate(self.line.contacts):
            if side[j]:
                torque = -side[j] * self.terms(contact.pieces)
                self._push(a, contact.a, torque)
                self._push(a, contact.b, -torque)
        stuck = [j for j, value in enumerate(side) if value == 0]
        if not stuck:
            return a, {}
        g, r = mp.matrix(len(stuck), len(stuck)), mp.matrix(len(stuck), self.size)
        for s, j in enumerate(stuck):
            w = self.speed_row(j)
            for p, k in enumerate(stuck):
                other = self.speed_row(k)
                g[s, p] = mp.fsum(w[n + i] * other[n + i] / self.mass[i] for i in range(n))
            r[s, :] = w * a
        hold = -(g**-1) * r
        rows = {}
        for s, j in enumerate(stuck):
            rows[j] = hold[s, :]
            self._push(a, self.line.contacts[j].a, rows[j])
            self._push(a, self.line.contacts[j].b, -rows[j])
        return a, rows

    def _free(self) -> Any:
        """A without contacts."""
        n, a = self.n, mp.matrix(self.size, self.size)
        for i in range(n):
            a[i, n + i] = mp.mpf(1)
        for first, second, k, c in self.line.shafts:
            for i, si in ((first, 1), (second, -1)):
                for m, sm in ((first, 1), (second, -1)):
                    if i >= 0 and m >= 0:
                        a[n + i, m] -= si * sm * mp.mpf(k) / self.mass[i]
                        a[n + i, n + m] -= si * sm * mp.mpf(c) / self.mass[i]
        for k, frequency in enumerate(self.line.frequencies):
            at = 2 * n + 2 * k
            a[at, at + 1], a[at + 1, at] = mp.mpf(frequency), -mp.mpf(frequency)
        for i, pieces in self.line.torques:
            self._push(a, i, self.terms(pieces))
        return a

    def _push(self, a: Any, i: int, torque: Any) -> None:
        if i >= 0:
            for k in range(self.size):
                a[self.n + i, k] += torque[k] / self.mass[i]

    def guards(self, side: Sequence[int], hold: dict[int, Any]) -> list[tuple[int, Any]]:
        """(contact, row): positive in the mode."""
        found = []
        for j, contact in enumerate(self.line.contacts):
            if side[j]:
                found.append((j, side[j] * self.speed_row(j)))
                continue
            limit = mp.mpf(contact.peak) * self.terms(contact.pieces)
            found += [(j, limit - hold[j]), (j, limit + hold[j])]
        return found

    def order(self, row: Any, a: Any, z: Any) -> int:
        """Sign of the first derivative of a guard that is not zero; 0 if none."""
        z = z.copy()
        for _ in range(8):
            value = (row * z)[0]
            size = mp.fsum(abs(row[k] * z[k]) for k in range(self.size)) + mp.mpf("1e-3")
            if abs(value) > size * mp.mpf(10) ** -_ZERO:
                return 1 if value > 0 else -1
            z = a * z
        return 0

    def flow(self, a: Any, z: Any, time: Any) -> Any:
        """exp(A t) z by its series, in steps."""
        size = max(mp.fsum(abs(a[i, k]) for k in range(self.size)) for i in range(self.size))
        steps = int(mp.ceil(abs(time) * mp.sqrt(size) + 1))
        h = time / steps
        for _ in range(steps):
            term, total, k = z.copy(), z.copy(), 0
            while True:
                k += 1
                term = a * term * (h / k)
                total += term
                if k > 20 and mp.mnorm(term, 1) < mp.mpf(10) ** -(DIGITS + 5):
                    break
            z = total
        return z

    def decide(self, rest: Sequence[int], first: bool = False) -> None:
        """Hold as many of the contacts at rest as possible."""
        for slips in range(len(rest) + 1):
            good = []
            for chosen in combinations(rest, slips):
                for sides in product((1, -1), repeat=slips):
                    side = list(self.side)
                    for j in rest:
                        side[j] = 0
                    for j, value in zip(chosen, sides, strict=True):
                        side[j] = value
                    a, hold = self.mode(side)
                    signs = [
                        (self.order(row, a, self.z), side[j])
                        for j, row in self.guards(side, hold)
                        if j in rest
                    ]
                    if all(sign > 0 or (sign == 0 and not moving) for sign, moving in signs):
                        good.append(side)
            if good:
                assert len(good) == 1, "several answers: choose by the largest share of its limit"
                self._report(good[0], rest, first)
                self.side = good[0]
                return
        raise AssertionError("nothing consistent")

    def _report(self, side: Sequence[int], rest: Sequence[int], first: bool) -> None:
        for j in rest:
            old, new = self.side[j], side[j]
            if first:
                if new == 0:
                    self.events.append((self.t, j, "stick", 0))
            elif old != new:
                kind = "stick" if new == 0 else "slip" if old == 0 else "reversal"
                self.events.append((self.t, j, kind, new or old))

    def run(self) -> Exact:
        moving = [(self.speed_row(j) * self.z)[0] for j in range(len(self.side))]
        self.side = [0 if v == 0 else 1 if v > 0 else -1 for v in moving]
        self.decide([j for j, value in enumerate(self.side) if value == 0], first=True)
        for knot in self.knots():
            while self._to(knot):
                pass
            if knot < self.duration:
                self.decide([j for j, value in enumerate(self.side) if value == 0])
        return self

    def _to(self, knot: Any) -> bool:
        """To the next event (True) or to a knot."""
        a, hold = self.mode(self.side)
        guards = self.guards(self.side, hold)
        rough = np.array(a.tolist(), dtype=float)
        rows = np.array([[float(row[k]) for k in range(self.size)] for _, row in guards])
        rate = math.sqrt(np.max(np.sum(np.abs(rough), axis=1)))
        span = float(knot - self.t)
        count = max(50, math.ceil(40 * rate * span))
        step = expm(rough * (span / count))
        z = np.array([float(value) for value in self.z])
        skip = [self.order(row, a, self.z) == 0 for _, row in guards]
        done, bad = 0, []
        while done < count and not bad:
            z, done = step @ z, done + 1
            bad = [k for k, value in enumerate(rows @ z) if value < 0.0 and not skip[k]]
        if not bad:
            self.z, self.t = self.flow(a, self.z, knot - self.t), knot
            return False
        low = mp.mpf(done - 1) * (knot - self.t) / count
        start = self.flow(a, self.z, low)
        times = [self._root(a, start, guards[k][1], mp.mpf(span) / count) for k in bad]
        at = min(times)
        hit = guards[bad[times.index(at)]][0]
        self.z, self.t = self.flow(a, start, at), self.t + low + at
        rest = {j for j, value in enumerate(self.side) if value == 0} | {hit}
        self.decide(sorted(rest))
        return True

    def _root(self, a: Any, z: Any, row: Any, span: Any) -> Any:
        """Newton's method from a bracket, kept in it by bisection."""
        low, high, at = mp.mpf(0), span * 2, span / 2
        for _ in range(200):
            there = self.flow(a, z, at)
            value, slope = (row * there)[0], (row * (a * there))[0]
            if value > 0:
                low = at
            else:
                high = at
            new = at - value / slope if slope != 0 else low
            if not low < new < high:
                new = (low + high) / 2
            if abs(new - at) < mp.mpf(10) ** -(DIGITS - 6):
                return new
            at = new
        raise AssertionError("no root")
