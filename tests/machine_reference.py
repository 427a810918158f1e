"""A reference integrator for machines: spectral collocation from event to event.

Written from the equations of motion alone; it takes plain numbers and functions of time and
shares nothing with the package. Between events the motion is smooth. A cell of it is solved by
Picard iteration at Chebyshev points of the first kind, which leave out both ends of the cell, so
that a signal is never asked for its value at a jump; cells end at the signals' knots, and shrink
until the last coefficients are rounding. Every guard (a sliding speed, a force at a limit, a
holding torque at its end) is then a polynomial, of which the companion matrix gives *all* roots.

At an event the next state of the contacts at rest is found by trying all of them, holding as many
as possible: a trial is a short cell of its own, and is consistent if each of its guards is
positive at first order, or at the first order at which it is not zero.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from itertools import combinations, pairwise, product
from typing import Any, NamedTuple

import numpy as np
from numpy.polynomial import chebyshev
from numpy.typing import NDArray
from scipy.linalg import null_space
from scipy.optimize import brentq

Array = NDArray[np.float64]
Function = Callable[[Array], Array]


class Contact(NamedTuple):
    """A dry-friction contact. Pairs are (backwards, forwards): values at -mu and at +mu.

    base, base_rate : speed of a moving base and its derivative, None for a base at rest
    table           : (sliding speed [rad/s], g(-mu), g(+mu)), ascending from 0: the torque is
                      linear between these speeds; the force then varies with the speed alone
    curve           : g as a smooth function of (side, sliding speed), in place of ``kinetic``
    """

    name: str
    a: int
    b: int  # -1: the ground, or a moving base
    radius: float
    kinetic: tuple[float, float]
    static: tuple[float, float]
    force: Function
    slope: float = 0.0
    release: bool = True
    base: Function | None = None
    base_rate: Function | None = None
    table: tuple[tuple[float, float, float], ...] = ()
    curve: Callable[[int, Array], Array] | None = None
    lag: float = 0.0
    frequency: float | None = None
    damping_ratio: float | None = None
    limits: tuple[float, float] = (-math.inf, math.inf)
    sample_time: float | None = None
    delay: int = 0
    resolution: float | None = None
    ratio: float = 1.0

    @property
    def order(self) -> int:
        """Number of states of the actuator."""
        return 2 if self.frequency else 1 if self.lag else 0

    @property
    def bounds(self) -> tuple[float, float]:
        """Least and greatest force."""
        low, high = self.limits
        return (max(low, 0.0), max(high, 0.0)) if self.release else (low, high)


class Plain(NamedTuple):
    """A machine as numbers and functions of time.

    stiffness, damping : (inertia, inertia)
    torques            : (number of an inertia, function of time)
    knots              : times at which a function of time has a kink or a jump
    joints             : (joints, inertia) factors of the speeds, of which each sum is zero
    """

    names: tuple[str, ...]
    inertia: Array
    stiffness: Array
    damping: Array
    angle: Array
    speed: Array
    contacts: tuple[Contact, ...] = ()
    torques: tuple[tuple[int, Function], ...] = ()
    knots: tuple[float, ...] = ()
    joints: Array | None = None


def shaft_matrices(
    n: int, shafts: Sequence[tuple[int, int, float, float, float]]
) -> tuple[Array, Array]:
    """Stiffness and damping matrix of shafts (a, b, stiffness, damping, ratio); ground is -1."""
    stiffness, damping = np.zeros((n, n)), np.zeros((n, n))
    for a, b, k, c, ratio in shafts:
        row = np.zeros(n)
        if a >= 0:
            row[a] += 1.0
        if b >= 0:
            row[b] -= ratio
        stiffness += k * np.outer(row, row)
        damping += c * np.outer(row, row)
    return stiffness, damping


class LockingError(RuntimeError):
    """A contact slides in the direction in which it locks itself, and is pressed from now on."""


class Event(NamedTuple):
    """``kind``: "stick", "slip", "reversal", or "breakpoint" (of the force or of a table).

    side : the direction of sliding before a stick, else after the event
    """

    time: float
    contact: int
    kind: str
    side: int


class Mode(NamedTuple):
    """Of each contact: direction of sliding (0: stick), line of its table, force at a limit."""

    side: tuple[int, ...]
    line: tuple[int, ...]
    clip: tuple[int, ...]

    def change(self, name: str, j: int, value: int) -> Mode:
        old = getattr(self, name)
        return self._replace(**{name: (*old[:j], value, *old[j + 1 :])})


# Chebyshev points of the first kind: values to coefficients, and the integral from -1.
N = 22
_ANGLES = (N - 0.5 - np.arange(N)) * math.pi / N
_X = np.cos(_ANGLES)
_VALUES = np.cos(np.outer(_ANGLES, np.arange(N + 1)))  # T_k at the points
_COEFFICIENTS = _VALUES[:, :N].T * 2.0 / N
_COEFFICIENTS[0] /= 2.0
_INTEGRAL = _VALUES @ chebyshev.chebint(np.eye(N), lbnd=-1) @ _COEFFICIENTS
_ORDERS = 4
_AT_START = np.array(
    [
        [float(chebyshev.chebval(-1.0, chebyshev.chebder(c, k) if k else c)) for c in np.eye(N)]
        for k in range(_ORDERS)
    ]
)
_EPS = 2.0**-52
_START_NOISE = np.maximum(1e-12, 20.0 * _EPS * np.abs(_AT_START[:, -1]))
_SIMULTANEOUS = 1e-12  # relative to the time
_MOST_EVENTS = 100_000


class Inputs(NamedTuple):
    """Functions of time at some times: torque (t, inertia), the others (t, contact)."""

    torque: Array
    force: Array
    base: Array
    rate: Array


class Guard(NamedTuple):
    """Positive inside a mode. ``scale``: the size of what its rounding errors come from."""

    kind: str  # "zero", "line", "clip", "hold"
    contact: int
    to: int
    values: Array
    scale: float


@dataclass
class Flow:
    """x' = matrix x + column(t) + curves, and what the guards need."""

    matrix: Array
    column: Array
    curves: list[tuple[int, Array]] = field(default_factory=list)
    projection: Array | None = None
    stuck: tuple[int, ...] = ()
    free: Array | None = None  # accelerations without contacts at rest: how large their terms are
    push: float = 0.0
    hold_row: Array | None = None
    hold_column: Array | None = None
    hold_weight: Array | None = None


@dataclass
class Cell:
    """The motion from ``start`` to ``end``; coefficients (N + 1, state) over ``step``."""

    start: float
    end: float
    step: float
    coefficients: Array
    sizes: Array
    mode: Mode
    held: tuple[float, ...]
    guards: list[Guard]
    tail: bool
    compatible: bool  # contacts at rest stay so, as those on two bases that differ do not

    def state(self, x: float) -> Array:
        return chebyshev.chebval(x, self.coefficients)


@dataclass
class Run:
    """What the reference found: ``events``, and the motion as cells."""

    machine: Machine
    cells: list[Cell]
    events: list[Event]
    duration: float

    def list_of(self, *kinds: str, contact: int | None = None) -> list[Event]:
        """The events of some kinds ("stick", "slip", ...), of one contact or of all."""
        return [
            e for e in self.events if e.kind in kinds and (contact is None or e.contact == contact)
        ]

    def at(self, times: Sequence[float] | Array, dependent: bool = True) -> dict[str, Array]:
        """Angle, velocity (time, inertia); sliding_velocity, actuation_force, brake_torque,

        sticking (time, contact). At an event: after it. The brake torque is positive where it
        acts against forward sliding; of dependent contacts at rest it is the feasible one of the
        least sum of squares relative to the holding torques, which takes time for many of them;
        without ``dependent`` it is nan.
        """
        times = np.atleast_1d(np.asarray(times, dtype=float))
        starts = np.array([cell.start for cell in self.cells])
        which = np.clip(np.searchsorted(starts, times, side="right") - 1, 0, None)
        n, m = self.machine.n, self.machine.m
        shapes = {"angle": n, "velocity": n, "sliding_velocity": m, "actuation_force": m}
        shapes |= {"brake_torque": m, "sticking": m, "acceleration": n, "torque": n}
        out = {name: np.empty((times.size, size)) for name, size in shapes.items()}
        for index in np.unique(which):
            chosen, cell = np.flatnonzero(which == index), self.cells[index]
            at = times[chosen]
            x = 2.0 * (at - cell.start) / cell.step - 1.0
            states = chebyshev.chebval(x, cell.coefficients).T.reshape(at.size, -1)
            seen = self.machine.observe(cell.mode, cell.held, at, states, dependent)
            for name, values in seen.items():
                out[name][chosen] = values
        out["sticking"] = out["sticking"] > 0.5
        return out

    def integral(self, power: Callable[[Array, dict[str, Array]], Array]) -> float:
        """Integral over time of a function of (times, what ``at`` returns), by Gauss' rule."""
        x, w = np.polynomial.legendre.leggauss(14)
        total = 0.0
        for cell in self.cells:
            span = cell.end - cell.start
            times = cell.start + 0.5 * span * (x + 1.0)
            at = 2.0 * (times - cell.start) / cell.step - 1.0
            states = chebyshev.chebval(at, cell.coefficients).T
            seen = self.machine.observe(cell.mode, cell.held, times, states)
            total += 0.5 * span * float(np.sum(w * power(times, seen)))
        return total


class Machine:
    """The equations of motion of a ``Plain`` in each mode."""

    def __init__(self, plain: Plain, tie: float = 0.0) -> None:
        self.tie = tie
        self.plain = plain
        self.n, self.m = len(plain.inertia), len(plain.contacts)
        n = self.n
        self.first: list[int] = []  # number of each actuator's first state
        size = 2 * n
        for contact in plain.contacts:
            self.first.append(size)
            size += contact.order
        self.size = size
        self.mass = np.asarray(plain.inertia, dtype=float)
        self.w = np.zeros((self.m, n))
        for j, contact in enumerate(plain.contacts):
            if contact.a >= 0:
                self.w[j, contact.a] += 1.0
            if contact.b >= 0:
                self.w[j, contact.b] -= contact.ratio
        self.mobility: Array | None = None
        self.motions = np.eye(n)  # that the joints allow, in columns
        if plain.joints is not None:
            self.motions = null_space(plain.joints)
            inertia = self.motions.T @ (self.mass[:, None] * self.motions)
            self.mobility = self.motions @ np.linalg.solve(inertia, self.motions.T)
        self.free = np.zeros((size, size))
        self.free[:n, n : 2 * n] = np.eye(n)
        self.free[n : 2 * n, :n] = -self.accelerate(plain.stiffness)
        self.free[n : 2 * n, n : 2 * n] = -self.accelerate(plain.damping)
        self.lines = [_lines(contact) if contact.table else () for contact in plain.contacts]
        self.sizes = np.zeros(size)
        self.input_sizes: tuple[Array, ...] = ()
        self.time = 1.0  # of the fastest vibration [s]
        self.dependent = lru_cache(maxsize=None)(self._elementary)

    def accelerate(self, torques: Array) -> Array:
        """Accelerations of the inertias by torques on them, (inertia, ...)."""
        if self.mobility is not None:
            return self.mobility @ torques
        return (torques.T / self.mass).T

    def inputs(self, times: Array) -> Inputs:
        torque = np.zeros((times.size, self.n))
        for i, function in self.plain.torques:
            torque[:, i] += function(times)
        force, base, rate = (np.zeros((times.size, self.m)) for _ in range(3))
        for j, contact in enumerate(self.plain.contacts):
            force[:, j] = contact.force(times)
            if contact.base is not None:
                base[:, j] = contact.base(times)
                if contact.base_rate is not None:
                    rate[:, j] = contact.base_rate(times)
        return Inputs(torque, force, base, rate)

    def command(self, j: int, mode: Mode, held: Sequence[float], u: Inputs) -> tuple[Array, Array]:
        """F_cmd as (row of the state, column over time)."""
        contact, row = self.plain.contacts[j], np.zeros(self.size)
        if contact.sample_time:
            return row, np.full(len(u.force), held[j])
        factor = contact.slope * mode.side[j]
        row[self.n : 2 * self.n] = factor * self.w[j]
        return row, u.force[:, j] - factor * u.base[:, j]

    def raw(self, j: int, mode: Mode, held: Sequence[float], u: Inputs) -> tuple[Array, Array]:
        """The force before limits and release."""
        if self.plain.contacts[j].order == 0:
            return self.command(j, mode, held, u)
        row = np.zeros(self.size)
        row[self.first[j]] = 1.0
        return row, np.zeros(len(u.force))

    def force(self, j: int, mode: Mode, held: Sequence[float], u: Inputs) -> tuple[Array, Array]:
        """The force after limits and release."""
        clip = mode.clip[j]
        if clip == 0:
            return self.raw(j, mode, held, u)
        value = self.plain.contacts[j].bounds[(clip + 1) // 2]
        return np.zeros(self.size), np.full(len(u.force), value)

    def flow(self, mode: Mode, held: Sequence[float], u: Inputs) -> Flow:
        n = self.n
        flow = Flow(self.free.copy(), np.zeros((len(u.torque), self.size)))
        a, c = flow.matrix, flow.column
        c[:, n : 2 * n] = self.accelerate(u.torque.T).T
        for j, contact in enumerate(self.plain.contacts):
            self._actuator(j, mode, held, u, flow)
            side = mode.side[j]
            if side == 0:
                continue
            push = -self.accelerate(self.w[j])  # acceleration of each inertia by a brake torque
            if contact.table:
                _, value, slope = self.lines[j][(side + 1) // 2][mode.line[j]]
                a[n : 2 * n, n : 2 * n] += slope * side * np.outer(push, self.w[j])
                c[:, n : 2 * n] += np.outer(value - slope * side * u.base[:, j], push)
            elif contact.curve is not None:
                flow.curves.append((j, push))
            else:
                row, column = self.force(j, mode, held, u)
                gain = contact.radius * contact.kinetic[(side + 1) // 2]
                if math.isinf(gain):
                    if np.any(row) or np.any(column > 0.0):
                        raise LockingError(f"reference: {contact.name} locks itself in motion.")
                    continue
                a[n : 2 * n] += gain * np.outer(push, row)
                c[:, n : 2 * n] += gain * np.outer(column, push)
        flow.stuck = tuple(j for j in range(self.m) if mode.side[j] == 0)
        flow.free = np.abs(a[n : 2 * n])
        flow.push = float(np.max(np.abs(c[:, n : 2 * n]), initial=0.0))
        if flow.stuck:
            self._stick(flow, u)
        return flow

    def _actuator(self, j: int, mode: Mode, held: Sequence[float], u: Inputs, flow: Flow) -> None:
        contact, at = self.plain.contacts[j], self.first[j]
        if not contact.order:
            return
        row, column = self.command(j, mode, held, u)
        if contact.order == 1:
            flow.matrix[at] = row / contact.lag
            flow.matrix[at, at] -= 1.0 / contact.lag
            flow.column[:, at] = column / contact.lag
            return
        omega, zeta = contact.frequency, contact.damping_ratio
        assert omega is not None
        assert zeta is not None
        flow.matrix[at, at + 1] = 1.0
        flow.matrix[at + 1] = omega**2 * row
        flow.matrix[at + 1, at] -= omega**2
        flow.matrix[at + 1, at + 1] -= 2.0 * zeta * omega
        flow.column[:, at + 1] = omega**2 * column

    def _stick(self, flow: Flow, u: Inputs) -> None:
        """Torques that keep the sliding speeds of contacts at rest at zero."""
        n, stuck = self.n, list(flow.stuck)
        w = self.w[stuck].T
        by_torque = self.accelerate(w)
        inverse = np.linalg.pinv(w.T @ by_torque, rcond=1e-10, hermitian=True)
        weight = -inverse @ w.T  # torque from the free accelerations
        spread = by_torque @ weight
        flow.hold_row = weight @ flow.matrix[n : 2 * n]
        flow.hold_column = flow.column[:, n : 2 * n] @ weight.T + u.rate[:, stuck] @ inverse.T
        flow.hold_weight = weight
        flow.matrix[n : 2 * n] += spread @ flow.matrix[n : 2 * n]
        flow.column[:, n : 2 * n] += flow.column[:, n : 2 * n] @ spread.T
        flow.column[:, n : 2 * n] += u.rate[:, stuck] @ (by_torque @ inverse).T
        flow.projection = np.eye(n) + spread

    def curves(self, flow: Flow, mode: Mode, held: Sequence[float], u: Inputs, x: Array) -> Array:
        """Accelerations by friction that is a smooth curve over the sliding speed."""
        total = np.zeros((len(x), self.n))
        for j, push in flow.curves:
            contact, side = self.plain.contacts[j], mode.side[j]
            row, column = self.force(j, mode, held, u)
            speed = np.abs(side * (x[:, self.n : 2 * self.n] @ self.w[j] - u.base[:, j]))
            assert contact.curve is not None
            torque = contact.radius * contact.curve(side, speed) * (x @ row + column)
            total += np.outer(torque, push)
        return total

    def holding(
        self, flow: Flow, mode: Mode, held: Sequence[float], u: Inputs, x: Array
    ) -> tuple[Array, Array, Array]:
        """Torques on a of the contacts at rest, and how far they may go down and up."""
        assert flow.hold_row is not None
        assert flow.hold_column is not None
        torque = x @ flow.hold_row.T + flow.hold_column
        if flow.curves:
            assert flow.hold_weight is not None
            torque = torque + self.curves(flow, mode, held, u, x) @ flow.hold_weight.T
        down, up = np.zeros_like(torque), np.zeros_like(torque)
        for s, j in enumerate(flow.stuck):
            contact = self.plain.contacts[j]
            if contact.table:
                low, high = contact.bounds
                force = np.clip(u.force[:, j], low, high)
            else:
                row, column = self.force(j, mode, held, u)
                force = x @ row + column
            for ends, sign, gain in ((down, 1.0, 1), (up, -1.0, 0)):
                static = contact.static[gain]
                if math.isinf(static):
                    ends[:, s] = np.where(force > 0.0, math.inf, 0.0)
                else:
                    ends[:, s] = sign * contact.radius * static * force
        return torque, down, up

    def _elementary(self, stuck: tuple[int, ...]) -> list[Array]:
        """Combinations of holding torques that the motion determines, as small as possible.

        Torques within their limits exist if and only if each of these combinations, of both
        signs, is within the sum of its limits (Farkas' lemma for the row space of the contacts).
        """
        rows = self.motions.T @ self.w[list(stuck)].T  # row space: what the motion determines
        _, sizes, basis = np.linalg.svd(rows)
        rank = int(np.sum(sizes > 1e-10))
        basis = basis[:rank]
        if rank == len(stuck):
            return list(np.eye(len(stuck)))
        found: list[Array] = []
        for zeros in combinations(range(len(stuck)), rank - 1):
            _, values, rest = np.linalg.svd(basis[:, list(zeros)].T, full_matrices=True)
            if zeros and np.sum(values > 1e-10) < rank - 1:
                continue
            y = rest[-1] @ basis
            y = y / y[np.argmax(np.abs(y))]
            y[np.abs(y) < 1e-10] = 0.0
            if not any(np.allclose(y, other, atol=1e-9) for other in found):
                found.append(y)
        return found

    def guards(
        self, flow: Flow, mode: Mode, held: Sequence[float], u: Inputs, x: Array, size: float
    ) -> list[Guard]:
        found: list[Guard] = []
        n = self.n
        speeds = np.abs(x[:, n : 2 * n])
        for j, contact in enumerate(self.plain.contacts):
            side = mode.side[j]
            if side:
                v = side * (x[:, n : 2 * n] @ self.w[j] - u.base[:, j])
                scale = float(np.max(speeds @ np.abs(self.w[j]) + np.abs(u.base[:, j])))
                scale = max(scale, 1e-3 * size, 1e-300)
                line = mode.line[j]
                lines = self.lines[j][(side + 1) // 2] if contact.table else ()
                if line == 0:
                    found.append(Guard("zero", j, 0, v, scale))
                else:
                    found.append(Guard("line", j, line - 1, v - lines[line][0], scale))
                if line + 1 < len(lines):
                    found.append(Guard("line", j, line + 1, lines[line + 1][0] - v, scale))
            if not contact.table:
                found += self._clip_guards(j, mode, held, u, x)
        if flow.stuck:
            found += self._hold_guards(flow, mode, held, u, x)
        return found

    def _clip_guards(
        self, j: int, mode: Mode, held: Sequence[float], u: Inputs, x: Array
    ) -> list[Guard]:
        low, high = self.plain.contacts[j].bounds
        row, column = self.raw(j, mode, held, u)
        raw = x @ row + column
        scale = float(np.max(np.abs(x) @ np.abs(row) + np.abs(column)))
        scale += sum(abs(bound) for bound in (low, high) if math.isfinite(bound))
        scale = max(scale, 1e-300)
        clip = mode.clip[j]
        if clip == 0:
            both = ((-1, raw - low), (1, high - raw))
            return [Guard("clip", j, to, v, scale) for to, v in both if np.isfinite(v[0])]
        return [Guard("clip", j, 0, low - raw if clip < 0 else raw - high, scale)]

    def _hold_guards(
        self, flow: Flow, mode: Mode, held: Sequence[float], u: Inputs, x: Array
    ) -> list[Guard]:
        torque, down, up = self.holding(flow, mode, held, u, x)
        assert flow.hold_row is not None
        assert flow.hold_column is not None
        terms = np.abs(x) @ np.abs(flow.hold_row.T) + np.abs(flow.hold_column)
        found = []
        for y in self.dependent(flow.stuck):
            for sign in (1.0, -1.0):
                z = sign * y
                used = z != 0.0
                reach = np.maximum(z[used] * up[:, used], -z[used] * down[:, used]).sum(axis=1)
                if not np.all(np.isfinite(reach)):
                    continue
                first = flow.stuck[int(np.flatnonzero(used)[0])]
                scale = float(np.max(terms @ np.abs(z) + np.abs(reach)))
                values = reach - torque @ z + self.tie * scale
                found.append(Guard("hold", first, 0, values, max(scale, 1e-300)))
        return found

    def cell(
        self, start: float, step: float, state: Array, mode: Mode, held: tuple, trial: bool = False
    ) -> Cell:
        """The motion in one mode, over a step that is short enough.

        trial : the mode may be a wrong one, in which the motion may grow: keep the step short
        """
        if trial:
            matrix = self.flow(mode, held, self.inputs(np.array([start + 1e-3 * step]))).matrix
            step = min(step, 1.0 / (float(np.max(np.abs(np.linalg.eigvals(matrix)))) + 1e-300))
        while True:
            times = start + 0.5 * step * (_X + 1.0)
            u = self.inputs(times)
            if self._resolved(u, start / step):
                flow = self.flow(mode, held, u)
                solved = self._picard(flow, mode, held, u, state, step)
                if solved is not None:
                    break
            step *= 0.5
            if step < 1e-14 * max(1.0, start):
                raise RuntimeError(f"reference: no short enough cell at {start} s in {mode}.")
        nodes, coefficients, sizes, tail = solved
        guards = self.guards(flow, mode, held, u, nodes, sizes[self.n])
        stuck = list(flow.stuck)
        drift = nodes[:, self.n : 2 * self.n] @ self.w[stuck].T - u.base[:, stuck]
        fits = bool(np.all(np.abs(drift) <= 1e-11 * sizes[self.n]))
        end = start + step
        return Cell(start, end, step, coefficients, sizes, mode, held, guards, tail, fits)

    def _resolved(self, u: Inputs, late: float) -> bool:
        """Return True if polynomials follow the functions of time to rounding.

        late : time over step, by which the rounding of the time itself matters more
        """
        for values, size in zip(u, self.input_sizes, strict=True):
            room = 2e-14 * size + 4.0 * _EPS * late * np.ptp(values, axis=0)
            if np.any(np.abs(_COEFFICIENTS[-2:] @ values) > room):
                return False
        return True

    def _picard(
        self, flow: Flow, mode: Mode, held: tuple, u: Inputs, state: Array, step: float
    ) -> tuple[Array, Array, Array, bool] | None:
        n = self.n
        operator = 0.5 * step * _INTEGRAL
        matrix, column = flow.matrix.T, flow.column
        x = state + operator @ (state @ matrix + column)
        last = math.inf
        for count in range(60):
            rate = x @ matrix + column
            if flow.curves:
                more = self.curves(flow, mode, held, u, x)
                if flow.projection is not None:
                    more = more @ flow.projection.T
                rate[:, n : 2 * n] += more
            new = state + operator @ rate
            if count >= 8:
                size = self._sizes(flow, new, rate, step)
                change = float(np.max(np.max(np.abs(new - x), axis=0) / size))
                if not math.isfinite(change):
                    return None
                if change < 3e-16 or (change < 1e-14 and change >= 0.5 * last):
                    x = new
                    break
                last = change
            x = new
        else:
            return None
        c = _COEFFICIENTS @ rate
        size = self._sizes(flow, x, rate, step)
        rest = step * np.abs(c) / size
        if np.max(rest[-2:]) > 2e-15:
            return None
        coefficients = 0.5 * step * chebyshev.chebint(c, lbnd=-1)
        coefficients[0] += state
        return x, coefficients, size, bool(np.max(rest[-6:]) < 2e-15)

    def _sizes(self, flow: Flow, x: Array, rate: Array, step: float) -> Array:
        """What errors are relative to: the largest angle, speed and state of each actuator yet."""
        size = np.max(np.abs(x) + step * np.abs(rate), axis=0)
        n = self.n
        assert flow.free is not None
        terms = flow.push + float(np.max(flow.free @ np.max(np.abs(x), axis=0)))
        speed = max(0.05 * self.time * terms, np.max(size[n : 2 * n]))
        size[:n], size[n : 2 * n] = max(self.time * speed, np.max(size[:n])), speed
        for contact, at in zip(self.plain.contacts, self.first, strict=True):
            if contact.frequency:
                size[at + 1] = max(size[at + 1], contact.frequency * size[at])
        return np.maximum(np.maximum(size, self.sizes), 1e-300)

    def observe(
        self, mode: Mode, held: tuple, times: Array, x: Array, dependent: bool = True
    ) -> dict[str, Array]:
        """What ``Run.at`` returns, in one mode."""
        n, u = self.n, self.inputs(times)
        flow = self.flow(mode, held, u)
        velocity = x[:, n : 2 * n]
        acceleration = (x @ flow.matrix.T + flow.column)[:, n : 2 * n]
        sliding = velocity @ self.w.T - u.base
        force, torque = np.zeros((2, times.size, self.m))
        for j, contact in enumerate(self.plain.contacts):
            side = mode.side[j]
            if contact.table:
                force[:, j] = np.clip(
                    u.force[:, j] + contact.slope * np.abs(side * sliding[:, j]), *contact.bounds
                )
                if side:
                    _, value, slope = self.lines[j][(side + 1) // 2][mode.line[j]]
                    torque[:, j] = value + slope * side * sliding[:, j]
                continue
            row, column = self.force(j, mode, held, u)
            force[:, j] = x @ row + column
            if side:
                gain: Any = contact.kinetic[(side + 1) // 2]
                if contact.curve is not None:
                    gain = contact.curve(side, np.abs(sliding[:, j]))
                if not np.any(np.isinf(gain)):  # it is not pressed then
                    torque[:, j] = contact.radius * gain * force[:, j]
        if flow.curves:
            more = self.curves(flow, mode, held, u, x)
            acceleration += more if flow.projection is None else more @ flow.projection.T
        if flow.stuck:
            stuck = list(flow.stuck)
            hold, down, up = self.holding(flow, mode, held, u, x)
            if not dependent and self.undetermined(stuck).shape[1]:
                hold = np.full(hold.shape, math.nan)
            else:
                hold = self._least(flow.stuck, hold, down, up)
            torque[:, stuck] = -hold
            sliding[:, stuck] = 0.0
        sticking = np.broadcast_to([side == 0 for side in mode.side], sliding.shape)
        return {
            "angle": x[:, :n],
            "velocity": velocity,
            "acceleration": acceleration,
            "torque": u.torque,
            "sliding_velocity": sliding,
            "actuation_force": force,
            "brake_torque": torque,
            "sticking": sticking.astype(float),
        }

    def undetermined(self, stuck: Sequence[int]) -> Array:
        """Basis of the holding torques that change no motion, in columns."""
        w = self.motions.T @ self.w[list(stuck)].T
        _, sizes, rows = np.linalg.svd(w)
        basis = rows[int(np.sum(sizes > 1e-10)) :].T
        return np.where(np.abs(basis) < 1e-12, 0.0, basis)

    def _least(self, stuck: tuple[int, ...], torque: Array, down: Array, up: Array) -> Array:
        """The torques within their limits that minimise sum (torque/limit)^2."""
        basis = self.undetermined(stuck)
        if basis.shape[1] == 0:
            return torque
        out = torque.copy()
        for i, row in enumerate(torque):
            out[i] = _least_squares(row, basis, down[i], up[i])
        return out


def _least_squares(torque: Array, basis: Array, down: Array, up: Array) -> Array:
    """Minimise sum (torque/limit)^2 over torque + span(basis), within the limits.

    The limit of a torque is the one on its side. Every set of torques at a limit, or at zero, where
    the limit changes, is tried; the others then follow from linear equations.
    """
    room = 1e-9 * (np.abs(torque).sum() + 1e-300)
    best, least = torque, math.inf
    states = [("low", "down", "zero", "up", "high")] * torque.size
    for state in product(*states):
        fixed = [k for k, one in enumerate(state) if one in ("low", "zero", "high")]
        if len(fixed) > basis.shape[1]:
            continue
        ends = {"low": -down, "zero": np.zeros_like(down), "high": up}
        goal = np.array([ends[state[k]][k] for k in fixed])
        if not np.all(np.isfinite(goal)):
            continue
        limit = np.where([one in ("up", "high") for one in state], up, down)
        with np.errstate(divide="ignore"):
            weight = np.minimum(np.where(np.isfinite(limit), 1.0 / limit, 0.0), 1e12)
        value = _on_limits(torque, basis, weight, fixed, goal)
        if np.all(value >= -down - room) and np.all(value <= up + room):
            limit = np.maximum(np.where(value >= 0.0, up, down), 1e-12)
            cost = float(np.sum((value / limit) ** 2))
            if cost < least:
                best, least = value, cost
    return best


def _on_limits(
    torque: Array, basis: Array, weight: Array, fixed: Sequence[int], goal: Array
) -> Array:
    """The least weighted sum of squares in torque + span(basis) with some values fixed."""
    if fixed:
        rows = basis[list(fixed)]
        torque = torque + basis @ np.linalg.lstsq(rows, goal - torque[list(fixed)], rcond=None)[0]
        _, sizes, rest = np.linalg.svd(rows)
        basis = basis @ rest[int(np.sum(sizes > 1e-10)) :].T
    if basis.shape[1]:
        rows = weight[:, None] * basis
        torque = torque + basis @ np.linalg.lstsq(rows, -weight * torque, rcond=None)[0]
    return torque


def _lines(contact: Contact) -> tuple:
    """For both sides the lines (first speed, value at speed 0, slope) of the brake torque."""
    force = float(contact.force(np.zeros(1))[0])
    low, high = contact.bounds

    def value(speed: float, gain: float) -> float:
        return contact.radius * gain * min(max(force + contact.slope * speed, low), high)

    both = []
    for side in (0, 1):
        points = [(row[0], value(row[0], row[1 + side])) for row in contact.table]
        lines = []
        for (v0, t0), (v1, t1) in pairwise(points):
            slope = (t1 - t0) / (v1 - v0)
            lines.append((v0, t0 - slope * v0, slope))
        last, torque = points[-1]
        # Beyond the last speed: g stays, and the force goes on unless it is at a limit.
        raw = force + contact.slope * (last * (1.0 + 1e-9) + 1e-9)
        slope = contact.radius * contact.table[-1][1 + side] * contact.slope
        slope = slope if low < raw < high else 0.0
        lines.append((last, torque - slope * last, slope))
        both.append(tuple(lines))
    return tuple(both)


def _first_order(c: Array, scale: float) -> tuple[int, int]:
    """(k, sign) of the first derivative at the start that is not rounding; (-1, 0) if none."""
    if np.max(np.abs(c)) <= 1e-13 * scale:
        return -1, 0
    start = _AT_START @ c
    for k in range(_ORDERS):
        if abs(start[k]) > _START_NOISE[k] * scale:
            return k, 1 if start[k] > 0.0 else -1
    return -1, 0


def first_exit(values: Array, scale: float) -> float:
    """The first point in (-1, 1] at which a guard becomes negative; inf if there is none."""
    c = _COEFFICIENTS @ values
    if abs(c[0]) > np.sum(np.abs(c[1:])):
        return math.inf
    order, sign = _first_order(c, scale)
    if order < 0:
        return math.inf
    if sign < 0:
        return -1.0
    q = _COEFFICIENTS @ (values / (1.0 + _X) ** order) if order else c
    small = np.max(np.abs(q)) * 1e-15
    used = np.flatnonzero(np.abs(q) > small)
    if used.size == 0 or used[-1] == 0:
        return math.inf
    roots = chebyshev.chebroots(q[: used[-1] + 1])
    near = roots.real[(np.abs(roots.imag) < 1e-6) & (np.abs(roots.real) < 1.0 + 1e-9)]
    # Between two neighbouring roots the sign does not change.
    points = np.unique(np.clip(np.concatenate(([-1.0, 1.0], near)), -1.0, 1.0))
    left = -1.0
    middles = 0.5 * (points[1:] + points[:-1])
    candidates = np.sort(np.concatenate((middles, [1.0])))
    for x in candidates:
        if chebyshev.chebval(x, q) < 0.0:
            if chebyshev.chebval(left, q) < 0.0:
                return -1.0
            return float(
                brentq(
                    lambda s: chebyshev.chebval(s, q if order else c),
                    left,
                    x,
                    xtol=1e-16,
                    rtol=1e-15,
                )
            )
        left = float(x)
    return math.inf


class _Driver:
    """From event to event."""

    def __init__(self, plain: Plain, duration: float, longest: float, tie: float) -> None:
        self.machine = Machine(plain, tie)
        self.longest = longest
        self.duration = duration
        self.events: list[Event] = []
        self.cells: list[Cell] = []
        self.knots = self._knots(plain, duration)
        self.sampled = [j for j, c in enumerate(plain.contacts) if c.sample_time]
        self.queues: dict[int, list[float]] = {}
        self.held = [0.0] * self.machine.m
        rate = math.sqrt(float(np.max(np.abs(self.machine.accelerate(plain.stiffness)))))
        sample = self.machine.inputs(np.linspace(0.0, duration, 257)[:-1])
        self.machine.input_sizes = tuple(np.max(np.abs(one), axis=0) for one in sample)
        self.step = self.machine.time = min(1.0 / (rate + 1e-300), duration)

    @staticmethod
    def _knots(plain: Plain, duration: float) -> list[tuple[float, list[int]]]:
        """(time, contacts that are sampled then), ascending, with the end last."""
        times = [(float(t), -1) for t in plain.knots if 0.0 < t < duration]
        for j, contact in enumerate(plain.contacts):
            if contact.sample_time:
                count = int(duration / contact.sample_time) + 1
                times += [(n * contact.sample_time, j) for n in range(1, count + 1)]
        times = sorted(item for item in times if item[0] < duration * (1.0 - 1e-13))
        merged: list[tuple[float, list[int]]] = []
        for time, j in times:
            if not merged or time > merged[-1][0] * (1.0 + 1e-13):
                merged.append((time, []))
            if j >= 0:
                merged[-1][1].append(j)
        return [*merged, (duration, [])]

    def run(self, state: Array | None = None) -> Run:
        machine, plain = self.machine, self.machine.plain
        time, n = 0.0, machine.n
        state = self._initial() if state is None else np.array(state, dtype=float)
        for j in self.sampled:
            contact = plain.contacts[j]
            before = float(contact.force(np.zeros(1))[0])
            self.queues[j] = [before] * contact.delay
        self._sample(time, state, self.sampled)
        mode = Mode((0,) * machine.m, (0,) * machine.m, (0,) * machine.m)
        mode, cell = self._restart(time, state, mode, first=True)
        knots = iter(self.knots)
        knot, samples = next(knots)
        while True:
            machine.sizes = cell.sizes
            exits = [first_exit(guard.values, guard.scale) for guard in cell.guards]
            x = min(exits, default=math.inf)
            last = min(x, 1.0)
            end = cell.start + 0.5 * cell.step * (last + 1.0)
            reached = end >= knot * (1.0 - 1e-15)
            # What happens within rounding of a knot happens at the knot.
            if math.isinf(x) or reached:
                self.cells.append(cell)
                state = cell.state(last)
                time = knot if reached else end
                if cell.tail:
                    self.step = max(self.step, 1.4 * cell.step)
                if reached:
                    if knot >= self.duration:
                        break
                    self._sample(time, state, samples)
                    knot, samples = next(knots)
                    mode, cell = self._restart(time, state, mode)
                    continue
            else:
                time = cell.start + 0.5 * cell.step * (x + 1.0)
                state = cell.state(x)
                near = 2.0 * _SIMULTANEOUS * max(time, cell.step) / cell.step
                hit = [g for g, e in zip(cell.guards, exits, strict=True) if e <= x + near]
                if x > -1.0:
                    cell.end = time
                    self.cells.append(cell)
                mode, cell = self._event(time, state, mode, hit)
                if len(self.events) > _MOST_EVENTS:
                    raise RuntimeError(f"reference: too many events before {time} s.")
                continue
            state = self._on_constraints(time, state, mode)
            cell = self._cell(time, state, mode)
        assert n == machine.n
        return Run(machine, self.cells, self.events, self.duration)

    def _initial(self) -> Array:
        plain = self.machine.plain
        state = np.zeros(self.machine.size)
        n = self.machine.n
        state[:n], state[n : 2 * n] = plain.angle, plain.speed
        for j, contact in enumerate(plain.contacts):
            if contact.order:
                state[self.machine.first[j]] = float(contact.force(np.zeros(1))[0])
        return state

    def _cell(self, time: float, state: Array, mode: Mode, trial: bool = False) -> Cell:
        knot = next(t for t, _ in self.knots if t > time * (1.0 + 1e-15))
        step = min(self.step, self.longest, knot - time)
        # No sliver before a knot.
        step = 0.5 * (knot - time) if step < knot - time < 1.5 * step else step
        cell = self.machine.cell(time, step, state, mode, tuple(self.held), trial)
        if not trial and cell.step < step:
            self.step = cell.step
        return cell

    def _sample(self, time: float, state: Array, contacts: Sequence[int]) -> None:
        """Sample, round and queue the commands of sampled actuations; hold what is due."""
        machine = self.machine
        u = machine.inputs(np.array([time]))
        n = machine.n
        for j in contacts:
            contact = machine.plain.contacts[j]
            v = float(state[n : 2 * n] @ machine.w[j] - u.base[0, j])
            value = float(u.force[0, j]) + contact.slope * abs(v)
            if contact.resolution:
                value = contact.resolution * round(value / contact.resolution)
            self.queues[j].append(value)
            self.held[j] = self.queues[j].pop(0)

    def _on_constraints(self, time: float, state: Array, mode: Mode) -> Array:
        """The state with the speeds of contacts at rest exactly zero again."""
        machine = self.machine
        stuck = [j for j, side in enumerate(mode.side) if side == 0]
        if not stuck:
            return state
        n, w = machine.n, machine.w[stuck].T
        u = machine.inputs(np.array([time]))
        v = w.T @ state[n : 2 * n] - u.base[0, stuck]
        by_torque = machine.accelerate(w)
        inverse = np.linalg.pinv(w.T @ by_torque, rcond=1e-10, hermitian=True)
        state = state.copy()
        state[n : 2 * n] -= by_torque @ (inverse @ v)
        return state

    def _restart(
        self, time: float, state: Array, mode: Mode, first: bool = False
    ) -> tuple[Mode, Cell]:
        """The mode after a knot or at the start: speeds, forces and limits may have jumped."""
        machine = self.machine
        u = machine.inputs(np.array([time]))
        speeds = state[machine.n : 2 * machine.n]
        rest = []
        for j in range(machine.m):
            v = float(speeds @ machine.w[j] - u.base[0, j])
            size = float(np.abs(speeds) @ np.abs(machine.w[j]) + abs(u.base[0, j]))
            if abs(v) <= 1e-12 * max(size, machine.sizes[machine.n]):
                rest.append(j)
                continue
            side, before = 1 if v > 0.0 else -1, mode.side[j]
            if side == before:
                continue
            if not first:
                kind = "reversal" if before else "slip"
                self.events.append(Event(time, j, kind, side))
            mode = mode.change("side", j, side).change("line", j, self._line(j, side, abs(v)))
        return self._decide(time, state, mode, rest, first=first)

    def _line(self, j: int, side: int, speed: float) -> int:
        lines = self.machine.lines[j]
        if not lines:
            return 0
        return max(i for i, line in enumerate(lines[(side + 1) // 2]) if line[0] <= speed)

    def _event(self, time: float, state: Array, mode: Mode, hit: list[Guard]) -> tuple[Mode, Cell]:
        rest = {j for j, side in enumerate(mode.side) if side == 0}
        for guard in hit:
            j = guard.contact
            if guard.kind == "zero":
                rest.add(j)
            elif guard.kind != "hold":
                mode = mode.change(guard.kind, j, guard.to)
                self.events.append(Event(time, j, "breakpoint", mode.side[j]))
        if all(guard.kind in ("clip", "line") for guard in hit):
            rest = set()  # the contacts at rest stay so: nothing jumps
        ends = {guard.contact for guard in hit if guard.kind == "hold"}
        return self._decide(time, state, mode, sorted(rest), keep=not rest, ends=ends)

    def _decide(
        self, time: float, state: Array, mode: Mode, rest: Sequence[int],
        first: bool = False, keep: bool = False, ends: Collection[int] = (),
    ) -> tuple[Mode, Cell]:  # fmt: skip
        """The next state of the contacts at rest.

        Those that have held go on doing so if they can. Otherwise one slips whose torque is at its
        limit, and as few others as possible; of several, those that would bear the largest shares
        of their limits if all held.

        ends : contacts whose torque is at its limit
        """
        if keep or not rest:
            found = self._trial(time, state, mode, [])
            if found is None:
                raise self._nothing(time, mode, rest)
            return found
        before = mode
        holding = mode
        for j in rest:
            holding = holding.change("side", j, 0).change("line", j, 0)
        held = set() if first else {j for j in rest if before.side[j] == 0}
        shares: Array | None = None
        good: list[tuple[bool, bool, int, list[float], Mode, Cell]] = []
        for slips in range(len(rest) + 1):
            for chosen in combinations(rest, slips):
                for sides in product((1, -1), repeat=slips):
                    trial = holding
                    for j, side in zip(chosen, sides, strict=True):
                        trial = trial.change("side", j, side)
                    found = self._trial(time, state, trial, rest)
                    if found is None:
                        continue
                    if shares is None and slips:
                        shares = self._shares(time, state, holding)
                    borne = sorted(-shares[j] for j in chosen) if shares is not None else []
                    breaks = not held.isdisjoint(chosen)
                    other = breaks and bool(ends) and set(ends).isdisjoint(chosen)
                    good.append((breaks, other, slips, borne, *found))
            if good and not min(good, key=lambda one: one[:4])[0]:
                break
        if not good:
            raise self._nothing(time, before, rest)
        *_, mode, cell = min(good, key=lambda one: one[:4])
        self._report(time, before, mode, rest, first)
        return mode, cell

    def _nothing(self, time: float, mode: Mode, rest: Sequence[int]) -> RuntimeError:
        """Why there is no next mode."""
        for j, contact in enumerate(self.machine.plain.contacts):
            side = mode.side[j]
            if side and j not in rest and math.isinf(contact.kinetic[(side + 1) // 2]):
                return LockingError(f"reference: {contact.name} locks itself at {time} s.", time)
        return RuntimeError(f"reference: nothing consistent at {time} s for {rest} in {mode}.")

    def _report(
        self, time: float, before: Mode, after: Mode, rest: Sequence[int], first: bool
    ) -> None:
        for j in rest:
            old, new = before.side[j], after.side[j]
            if first:
                if new == 0:
                    self.events.append(Event(time, j, "stick", 0))
            elif old == 0 and new != 0:
                self.events.append(Event(time, j, "slip", new))
            elif old != 0 and new == 0:
                self.events.append(Event(time, j, "stick", old))
            elif old == -new != 0:
                self.events.append(Event(time, j, "reversal", new))

    def _shares(self, time: float, state: Array, mode: Mode) -> Array:
        """|torque|/limit of each contact at rest if all hold."""
        machine = self.machine
        state = self._on_constraints(time, state, mode)
        u = machine.inputs(np.array([time]))
        mode = self._clipped(mode, state, u)
        flow = machine.flow(mode, tuple(self.held), u)
        torque, down, up = machine.holding(flow, mode, tuple(self.held), u, state[None])
        basis = machine.undetermined(flow.stuck)
        if basis.shape[1]:
            torque = torque.copy()
            torque[0] = _least_squares(torque[0], basis, down[0] * 1e6, up[0] * 1e6)
        limit = np.where(torque >= 0.0, up, down)[0]
        shares = np.zeros(machine.m)
        with np.errstate(divide="ignore", invalid="ignore"):
            shares[list(flow.stuck)] = np.nan_to_num(np.abs(torque[0]) / limit, posinf=1e300)
        return shares

    def _clipped(self, mode: Mode, state: Array, u: Inputs) -> Mode:
        """The mode with each force at its limit if it is beyond."""
        for j, contact in enumerate(self.machine.plain.contacts):
            if contact.table:
                continue
            row, column = self.machine.raw(j, mode, tuple(self.held), u)
            raw, (low, high) = float(state @ row + column[0]), contact.bounds
            room = 1e-12 * (abs(raw) + float(np.abs(state) @ np.abs(row)) + abs(float(column[0])))
            clip = mode.clip[j]
            if raw > high + room or raw < low - room:
                clip = 1 if raw > high else -1
            elif low + room < raw < high - room:
                clip = 0
            mode = mode.change("clip", j, clip)
        return mode

    def _trial(
        self, time: float, state: Array, mode: Mode, rest: Sequence[int]
    ) -> tuple[Mode, Cell] | None:
        """The first cell in a mode if the motion enters it; forces and lines are settled."""
        machine = self.machine
        state = self._on_constraints(time, state, mode)
        if rest:
            whole = mode
            for j in rest:
                whole = whole.change("side", j, 0)
            state = self._on_constraints(time, state, whole)
        mode = self._clipped(mode, state, machine.inputs(np.array([time])))
        seen = set()
        while mode not in seen:
            seen.add(mode)
            try:
                cell = self._cell(time, state, mode, trial=True)
            except LockingError:
                return None
            changed = mode
            if not cell.compatible:
                return None
            for guard in cell.guards:
                _, sign = _first_order(_COEFFICIENTS @ guard.values, guard.scale)
                if guard.kind in ("hold", "zero"):
                    idle = guard.kind == "zero" and guard.contact in rest and sign == 0
                    if sign < 0 or idle:
                        return None
                elif sign < 0:
                    changed = changed.change(guard.kind, guard.contact, guard.to)
            if changed == mode:
                return mode, cell
            mode = changed
        raise RuntimeError(f"reference: forces do not settle at {time} s in {mode}.")


def simulate(plain: Plain, duration: float, longest: float = math.inf, *, tie: float = 0.0) -> Run:
    """The motion of a machine from its initial angles and speeds; ``longest``: of a cell [s].

    tie : share of the largest torque by which a load may exceed its limit without slip, so that a
          load which is equal to its limit holds
    """
    return _Driver(plain, duration, longest, tie).run()
