"""A slow and plain reference: Taylor series at 50 digits from event to event.

Written from the equation of motion alone. Within a piece of the brake's law the Taylor
coefficients of the angle follow from

    theta'' + g2 theta' + w2 theta = f sin(omega t) + q

term by term, whatever the damping, so there are no cases to tell apart. A step is half a
radian of the fastest rate; in it the distance from each boundary is a polynomial, and its
first root is looked for at 64 points, at every minimum between them, and then bisected.

With 50 digits a difference of two motions 1e-20 apart is a derivative of the flow to 20 digits,
and Newton's method on it finds a periodic orbit to as many: no tangent equations are needed.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
from mpmath import mp

import wedgebrake as wb
from equations import Law, Piece, gain, law

DIGITS = 50
_TERMS = 44  # 0.5^44/44! < 1e-67
_SAMPLES = np.linspace(0.0, 1.0, 65)
STICK, SLIP, REVERSAL, BREAKPOINT = 2, 3, 4, 5  # as the package numbers its events
_STEP = 1e-20  # [rad], [rad/s] between motions whose difference is a derivative
_ORBIT = 1e-20  # last step of Newton's method to an orbit, relative
_MOST_NEWTON = 8

Polynomial = list[Any]  # coefficients of s^n, with s = time/step in [0, 1]


@dataclass
class Answer:
    """States at the wanted times, and the events (kind, time, side)."""

    states: list[tuple[Any, Any]] = field(default_factory=list)
    events: list[tuple[int, Any, int]] = field(default_factory=list)
    locked_at: Any = None


def value(p: Polynomial, s: Any) -> Any:
    total = mp.mpf(0)
    for c in reversed(p):
        total = total * s + c
    return total


def slope(p: Polynomial) -> Polynomial:
    return [n * c for n, c in enumerate(p)][1:]


def first_root(distance: Polynomial, on_boundary: bool) -> Any:
    """The first s in (0, 1] where a distance, positive before, becomes zero; None if none.

    ``on_boundary``: the motion starts at distance zero, a root that does not count.
    """
    p = list(distance)
    if on_boundary:
        # Divide by s until the distance starts at a value; what is left below 1e-35 of it
        # is rounding of 50 digits.
        size = max(abs(c) for c in p)
        if size == 0:
            return None
        while abs(p[0]) <= size * mp.mpf(10) ** -35:
            p.pop(0)
        if p[0] < 0:
            return mp.mpf(0)
    assert p[0] > 0
    # Doubles choose where to look, 50 digits decide.
    scale = max(abs(c) for c in p)
    rough = np.polynomial.polynomial.polyval(_SAMPLES, [float(c / scale) for c in p])
    derivative = slope(p)
    for i in range(1, _SAMPLES.size):
        left, right = mp.mpf(_SAMPLES[i - 1]), mp.mpf(_SAMPLES[i])
        if min(rough[i - 1], rough[i]) > 1e-2:
            continue  # |p''| <= 0.25 scale or so: cannot reach zero within 1/64
        if value(p, right) > 0:
            if value(derivative, left) >= 0 or value(derivative, right) <= 0:
                continue  # no minimum between
            lowest = bisect(derivative, left, right)
            if value(p, lowest) > 0:
                continue
            right = lowest
        return bisect([-c for c in p], left, right)
    return None


def bisect(p: Polynomial, left: Any, right: Any) -> Any:
    """The root of a polynomial that rises through zero between two points."""
    derivative = slope(p)
    guess = (left + right) / 2
    for _ in range(4 * DIGITS):
        if value(p, guess) < 0:
            left = guess
        else:
            right = guess
        rate = value(derivative, guess)
        newton = guess - value(p, guess) / rate if rate > 0 else left
        if abs(newton - guess) < mp.mpf(10) ** (2 - DIGITS):
            return guess
        guess = newton if left < newton < right else (left + right) / 2
    return guess


def tabulated_law(system: wb.BrakedDriveline) -> Law:
    """Torque linear between the points of a table of coefficients and the release speed."""
    friction, radius = system.friction, mp.mpf(system.brake.radius)
    assert isinstance(friction, wb.TabulatedFriction)
    force, slope = mp.mpf(system.actuation.initial_force), mp.mpf(system.actuation.slope)
    assert system.actuation.release
    assert slope < 0 < force
    release = force / -slope
    speeds = [mp.mpf(speed) / radius for speed in friction.speeds]
    pieces, holds = [Piece(release, mp.inf, mp.mpf(0), mp.mpf(0))], []
    pieces.append(Piece(-mp.inf, -release, mp.mpf(0), mp.mpf(0)))
    for side in (-1, 1):
        gains = [gain(system.brake, side * mp.mpf(m), mp) for m in friction.coefficients]
        corners = [
            (side * v, radius * g * (force + slope * v))
            for v, g in zip(speeds, gains, strict=True)
            if v < release
        ]
        corners.append((side * release, mp.mpf(0)))
        for (v0, torque0), (v1, torque1) in pairwise(corners):
            rate = (torque1 - torque0) / (v1 - v0)
            pieces.append(Piece(min(v0, v1), max(v0, v1), torque0 - rate * v0, rate))
        holds.append(radius * gain(system.brake, side * mp.mpf(friction.static), mp) * force)
    return Law(tuple(sorted(pieces)), *holds)


class Motion:
    """A braked driveline at 50 digits."""

    def __init__(self, system: wb.BrakedDriveline) -> None:
        line = system.driveline
        tabulated = isinstance(system.friction, wb.TabulatedFriction)
        self.law = tabulated_law(system) if tabulated else law(system, mp.mpf, mp)
        self.inertia, self.damping = mp.mpf(line.inertia), mp.mpf(line.damping)
        self.stiffness, self.drive = mp.mpf(line.stiffness), mp.mpf(line.drive_speed)
        self.amplitude = mp.mpf(system.excitation.amplitude)
        self.omega = 2 * mp.pi * mp.mpf(system.excitation.frequency)
        self.t = self.angle = self.velocity = mp.mpf(0)
        self.piece: Piece | None = None  # None: at rest relative to the brake
        self.boundary: Any = None  # the one that the motion is on, if any

    def pull(self) -> Any:
        torque = self.amplitude * mp.sin(self.omega * self.t)
        return torque - self.damping * self.velocity - self.stiffness * self.angle

    def decide(self) -> int:
        """At rest relative to the brake: hold (0), or slip up (1) or down (-1)."""
        pull = self.pull()
        side = 1 if pull > self.law.upper else -1 if pull < self.law.lower else 0
        self.piece = self.law.beside(0, side) if side else None
        self.boundary = mp.mpf(0) if side else None
        return side

    def _torque(self, step: Any) -> Polynomial:
        """T over a step."""
        phase = self.omega * self.t
        sine, cosine = self.amplitude * mp.sin(phase), self.amplitude * mp.cos(phase)
        cycle, factor, terms = (sine, cosine, -sine, -cosine), mp.mpf(1), []
        for n in range(_TERMS):
            terms.append(factor * cycle[n % 4])
            factor = factor * self.omega * step / (n + 1)
        return terms

    def length(self) -> Any:
        """Half a radian of the fastest rate."""
        rates = [self.omega, mp.sqrt(self.stiffness / self.inertia)]
        if self.piece is not None:
            rates.append(abs(self.damping + self.piece.slope) / self.inertia)
        return 1 / (2 * max(rates))

    def series(self, step: Any) -> Polynomial:
        """The angle over a step."""
        if self.piece is None:
            return [self.angle, -self.drive * step] + [mp.mpf(0)] * (_TERMS - 2)
        g2 = (self.damping + self.piece.slope) / self.inertia
        w2 = self.stiffness / self.inertia
        drive = [term / self.inertia for term in self._torque(step)]
        drive[0] -= (self.piece.offset + self.piece.slope * self.drive) / self.inertia
        c = [self.angle, self.velocity * step]
        for n in range(_TERMS - 2):
            rest = drive[n] * step**2 - g2 * step * (n + 1) * c[n + 1] - w2 * step**2 * c[n]
            c.append(rest / ((n + 1) * (n + 2)))
        return c

    def distances(self, series: Polynomial, step: Any) -> list[tuple[Polynomial, Any, int]]:
        """(distance over a step, boundary, side) of each boundary of the present motion."""
        if self.piece is None:
            pull = [
                torque - self.stiffness * angle
                for torque, angle in zip(self._torque(step), series, strict=True)
            ]
            pull[0] -= self.damping * self.velocity
            limits = ((self.law.upper, 1), (self.law.lower, -1))
            around = [([side * -c for c in pull], limit, side) for limit, side in limits]
        else:
            v = [c / step for c in slope(series)]
            v[0] += self.drive
            limits = ((self.piece.high, 1), (self.piece.low, -1))
            around = [([side * -c for c in v], limit, side) for limit, side in limits]
        around = [item for item in around if not mp.isinf(item[1])]
        for distance, limit, side in around:
            distance[0] += side * limit
        return around

    def cross(self, boundary: Any, side: int) -> tuple[int, int]:
        """Go on from a boundary reached; (kind, side) of the event."""
        if self.piece is None:
            self.piece, self.boundary = self.law.beside(0, side), mp.mpf(0)
            return SLIP, side
        self.velocity = boundary - self.drive
        if boundary != 0:
            self.piece, self.boundary = self.law.beside(boundary, side), boundary
            return BREAKPOINT, side
        after = self.decide()
        return (REVERSAL, after) if after else (STICK, -side)


def _on(motion: Motion, boundary: Any, distance: Polynomial) -> bool:
    if motion.piece is None:
        return abs(distance[0]) <= mp.mpf(10) ** -35 * (motion.amplitude + abs(boundary))
    return motion.boundary is not None and boundary == motion.boundary


def solve(system: wb.BrakedDriveline, initial: tuple[Any, Any], times: list[Any]) -> Answer:
    """States at ``times`` [s], ascending, from the state ``initial`` at t = 0."""
    with mp.workdps(DIGITS):
        motion, answer = Motion(system), Answer()
        motion.angle, motion.velocity = mp.mpf(initial[0]), mp.mpf(initial[1])
        v = motion.velocity + motion.drive
        if v == 0:
            motion.decide()
        else:
            motion.piece = motion.law.at(v)
        for wanted in times:
            while motion.t < wanted and answer.locked_at is None:
                _advance(motion, mp.mpf(wanted), answer)
            if answer.locked_at is not None:
                break
            answer.states.append((motion.angle, motion.velocity))
        return answer


def _advance(motion: Motion, until: Any, answer: Answer) -> None:
    """One step, to the next event at most."""
    if motion.piece is not None and math.isinf(motion.piece.offset):
        answer.locked_at = motion.t
        return
    step = min(motion.length(), until - motion.t)
    series = motion.series(step)
    first, what = mp.mpf(2), None
    for distance, boundary, side in motion.distances(series, step):
        root = first_root(distance, _on(motion, boundary, distance))
        if root is not None and root < first:
            first, what = root, (boundary, side)
    end = first if what else mp.mpf(1)
    motion.t = until if end == 1 and step == until - motion.t else motion.t + end * step
    motion.angle = value(series, end)
    motion.velocity = value(slope(series), end) / step
    if motion.piece is not None:
        motion.boundary = None
    if what:
        kind, side = motion.cross(*what)
        answer.events.append((kind, motion.t, side))


class Return(NamedTuple):
    """The motion over whole periods of the torque, from t = 0.

    state  : (2, 1) where it ends
    matrix : (2, 2) derivative of that by where it begins
    events : (kind, side) of each
    """

    state: Any
    matrix: Any
    events: list[tuple[int, int]]


def returned(system: wb.BrakedDriveline, initial: Any, periods: int) -> Return:
    """The return from a state (2, 1)."""
    with mp.workdps(DIGITS):
        end = periods / mp.mpf(system.excitation.frequency)
        answers = [
            solve(system, (initial[0] + angle, initial[1] + velocity), [end])
            for angle, velocity in ((0, 0), (mp.mpf(_STEP), 0), (0, mp.mpf(_STEP)))
        ]
        state, *moved = [mp.matrix(answer.states[0]) for answer in answers]
        matrix = mp.matrix(2, 2)
        for column, one in enumerate(moved):
            matrix[:, column] = (one - state) / mp.mpf(_STEP)
        return Return(state, matrix, [(kind, side) for kind, _, side in answers[0].events])


def orbit(
    system: wb.BrakedDriveline, near: tuple[float, float], periods: int
) -> tuple[Any, Return]:
    """The state of a periodic orbit at t = 0 and the return from it, by Newton's method."""
    with mp.workdps(DIGITS):
        state = mp.matrix(near)
        for _ in range(_MOST_NEWTON):
            there = returned(system, state, periods)
            missing = mp.lu_solve(mp.eye(2) - there.matrix, there.state - state)
            if mp.norm(missing) <= mp.mpf(_ORBIT) * mp.norm(state):
                return state, there
            state = state + missing
        raise AssertionError(f"no orbit of {periods} periods near {near}")


def invariants(matrix: Any) -> tuple[Any, Any]:
    """(trace, determinant)."""
    with mp.workdps(DIGITS):
        return matrix[0, 0] + matrix[1, 1], mp.det(matrix)


def eigenvalues(matrix: Any) -> tuple[Any, Any]:
    """Of a 2 x 2 matrix, the larger modulus first; of two alike that with imaginary part > 0."""
    with mp.workdps(DIGITS):
        trace, determinant = invariants(matrix)
        root = mp.sqrt(trace**2 / 4 - determinant)
        first = trace / 2 + (-root if trace < 0 and mp.im(root) == 0 else root)
        return first, trace - first
