"""Whether a response is a solution of the equations of its machine.

Between two events, the sides of the contacts and the lines of the laws are taken from the response
at the middle. With these, DOP853 integrates the machine from one event to the next; the equations
are written here independently, from their definitions. The response is a solution if

- its state at the end of each part is that of the integrator,
- each contact slides in its direction, and each law stays on its line, throughout the part,
- the contacts that stick can be in equilibrium with torques within their limits.

This verifies the solver's search for events, and its decisions, without a second search.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import linprog

import wedgebrake as wb
from piecewise_reference import Array, Law, factors_of, laws

# Shares of a part at which its conditions are checked, and relative errors of conditions.
_INSIDE = np.linspace(0.02, 0.98, 13)
_ROOM = 1e-8
_SHORTEST = 1e-9
_SIGNAL_STEP = 1e-4


class _Touch:
    """A contact: its sliding speed, force and torques, by their definitions."""

    def __init__(self, machine: wb.Machine, contact: Any) -> None:
        self.contact = contact
        self.driven = next((one for one in machine.driven if one.name == contact.b), None)
        self.row = factors_of(machine, {contact.b: -contact.ratio} | {contact.a: 1.0})
        self.normal = np.zeros(2 * len(machine.inertias))
        for name, factor in contact.normal.items():
            body, _, what = name.rpartition(".")
            at = machine.inertia_names.index(body) + (what == "speed") * len(machine.inertias)
            self.normal[at] += factor

    def sliding(self, t: float, y: Array) -> float:
        speed = float(self.row @ y[y.size // 2 :])
        return speed - _value(getattr(self.contact, "base_speed", 0.0), t)

    def force(self, t: float, y: Array, side: int) -> float:
        given = self.contact.actuation
        rise = given.slope * abs(self.sliding(t, y)) if side else 0.0
        found = _value(given.initial_force, t) + rise + float(self.normal @ y)
        return max(found, 0.0)

    def torque(self, t: float, y: Array, side: int) -> float:
        """Torque on the first inertia while the contact slides."""
        if isinstance(self.contact, wb.OneWayClutch):
            return -side * self._ends()[0 if side > 0 else 1]
        if isinstance(self.contact, wb.Drag):
            v = abs(self.sliding(t, y))
            return -side * (self.contact.linear + self.contact.quadratic * v) * v
        return self.force(t, y, side) * self._gain(side * self.contact.friction.kinetic)

    def limits(self, t: float, y: Array) -> tuple[float, float]:
        """Lowest and highest torque on the first inertia while the contact sticks."""
        if isinstance(self.contact, wb.OneWayClutch):
            forward, backward = self._ends()
            return -forward, backward
        if isinstance(self.contact, wb.Drag):
            return 0.0, 0.0
        static, force = self.contact.friction.static, self.force(t, y, 0)
        return force * self._gain(static), force * self._gain(-static)

    def _ends(self) -> tuple[float, float]:
        """Magnitudes of the torques of a one-way clutch, forwards and backwards."""
        given = self.contact
        ends = given.capacity, given.drag
        return ends if given.direction > 0.0 else ends[::-1]

    def _gain(self, m: float) -> float:
        brake = self.contact.brake
        if isinstance(brake, wb.WedgeBrake):
            return float(-brake.radius * m / (np.tan(brake.angle) - m))
        assert isinstance(brake, wb.ConventionalBrake)
        return -brake.radius * m


def _value(signal: Any, t: float) -> float:
    return float(signal(t)) if isinstance(signal, wb.Signal) else float(signal)


def _rate(signal: Any, t: float) -> float:
    """Rate of a signal that is known at all times and has no jumps, from values on both sides."""
    if not isinstance(signal, wb.Signal):
        return 0.0
    h = _SIGNAL_STEP
    near = [_value(signal, t + k * h) for k in (-2, -1, 1, 2)]
    return (near[0] - 8.0 * near[1] + 8.0 * near[2] - near[3]) / (12.0 * h)


class _Part:
    """A machine between two events.

    sides  : of each contact, 0 where it sticks
    labels : of the line of each law
    """

    def __init__(self, machine: wb.Machine, sides: Any, labels: Any) -> None:
        self.machine, self.sides, self.labels = machine, sides, labels
        self.laws: list[Law] = laws(machine)
        self.touches = [_Touch(machine, one) for one in machine.contacts]
        bodies = machine.inertias
        self.free = np.array([not isinstance(one, wb.Driven) for one in bodies])
        self.mass = np.array([getattr(one, "inertia", np.inf) for one in bodies])
        self.signals = [
            (machine.inertia_names.index(one.on), one.signal)
            for one in machine.torques
            if isinstance(one.signal, wb.Signal)
        ]
        held = [one.row for one, side in zip(self.touches, sides, strict=True) if side == 0]
        joints = [factors_of(machine, one.factors) for one in machine.joints]
        self.rows = np.array([*held, *joints]).reshape(-1, len(bodies))

    def loads(self, t: float, y: Array) -> Array:
        """Torques on the inertias, without those of contacts that stick."""
        found = np.zeros(self.mass.size)
        for law, label in zip(self.laws, self.labels, strict=True):
            found += law.load * law.of.torque(label, *law.argument(y)) * law.scale(t)
        for at, signal in self.signals:
            found[at] += _value(signal, t)
        for touch, side in zip(self.touches, self.sides, strict=True):
            if side != 0:
                found += touch.row * touch.torque(t, y, side)
        return found

    def accelerations(self, t: float, y: Array) -> Array:
        """Accelerations, with the contacts that stick as constraints."""
        found = self.loads(t, y) / self.mass
        for i, one in enumerate(self.machine.inertias):
            if isinstance(one, wb.Driven):
                found[i] = _rate(one.speed, t)
        if not len(self.rows):
            return found
        sticks = [one for one, side in zip(self.touches, self.sides, strict=True) if side == 0]
        bases = [_rate(getattr(one.contact, "base_speed", 0.0), t) for one in sticks]
        wanted = np.array([*bases, *(0.0 for _ in self.machine.joints)])
        inverse = np.where(self.free, 1.0 / self.mass, 0.0)
        matrix = (self.rows * inverse) @ self.rows.T
        forces = np.linalg.lstsq(matrix, wanted - self.rows @ found, rcond=1e-12)[0]
        return np.asarray(found + inverse * (self.rows.T @ forces))

    def rates(self, t: float, y: Array) -> Array:
        n = self.mass.size
        speed = y[n:].copy()
        for i, one in enumerate(self.machine.inertias):
            if isinstance(one, wb.Driven):
                speed[i] = _value(one.speed, t)
        return np.concatenate([speed, self.accelerations(t, np.concatenate([y[:n], speed]))])

    def violated(self, t: float, y: Array, scale: float) -> str:
        """The condition that the state violates; empty if it violates none."""
        for touch, side in zip(self.touches, self.sides, strict=True):
            v = touch.sliding(t, y)
            if side * v < -_ROOM * scale or (side == 0 and abs(v) > _ROOM * scale):
                return f"{touch.contact.name} slides at {v} in a part with the side {side}"
        for law, label in zip(self.laws, self.labels, strict=True):
            x, v = law.argument(y)
            wanted = law.of.torque(law.of.label(x, v), x, v)
            if abs(law.of.torque(label, x, v) - wanted) > 100.0 * _ROOM * scale:
                return f"a law at {x}, {v} is on another line than {label}"
        return self._unbalanced(t, y)

    def _unbalanced(self, t: float, y: Array) -> str:
        """Contacts that stick without an equilibrium within their limits."""
        if not len(self.rows):
            return ""
        sticks = [one for one, side in zip(self.touches, self.sides, strict=True) if side == 0]
        loads = self.loads(t, y)
        need = self.mass[self.free] * self.accelerations(t, y)[self.free] - loads[self.free]
        size = max(np.abs(loads[self.free]).max(initial=0.0), 1.0)
        limits = [one.limits(t, y) for one in sticks]
        room = _ROOM * size
        bounds = [(low - room if np.isfinite(low) else None,
                   high + room if np.isfinite(high) else None) for low, high in limits]  # fmt: skip
        bounds += [(None, None)] * len(self.machine.joints)
        rows = self.rows[:, self.free].T
        # Equilibrium up to rounding, by slack torques of which the largest is minimal.
        count = rows.shape[1]
        above = np.vstack([np.hstack([rows, -np.ones((len(rows), 1))]),
                           np.hstack([-rows, -np.ones((len(rows), 1))])])  # fmt: skip
        found = linprog(
            [*np.zeros(count), 1.0], A_ub=above / size, b_ub=np.concatenate([need, -need]) / size,
            bounds=[*bounds, (0.0, None)],
        )  # fmt: skip
        if found.status != 0 or found.fun > room:
            names = [one.contact.name for one in sticks]
            return f"{names} stick with limits {limits}, which do not balance {need}"
        return ""


def error_of(
    machine: wb.Machine, duration: float, *, equations: wb.Machine | None = None, **options: Any
) -> float:
    """Largest difference of a response from the solution of the equations, relative to its size.

    equations : the machine whose equations are solved, by default ``machine``

    Raises ``AssertionError`` if the response is not a solution.
    """
    stated = equations or machine
    first = wb.simulate(machine, duration, times=[], **options)
    assert first.attrs["status"] == "completed", first.attrs["message"]
    knots = [one.knots(0.0, duration) for one in machine.signals().values()]
    ends = np.concatenate([[0.0, duration], first["event_time"].to_numpy(), *knots])
    ends = np.unique(ends)
    ends = ends[np.append(True, np.diff(ends) > _SHORTEST)]
    middles = 0.5 * (ends[:-1] + ends[1:])
    times = np.unique(np.concatenate([ends, middles]))
    response = wb.simulate(machine, duration, times=times, **options)
    y = np.hstack([response["angle"].to_numpy(), response["velocity"].to_numpy()])
    speeds = np.abs(response["velocity"].to_numpy()).max()
    scale = max(float(speeds), 1e-3)
    sticks = response["sticking"].to_numpy()
    worst = 0.0
    for left, middle, right in zip(ends[:-1], middles, ends[1:], strict=True):
        a, m, b = np.searchsorted(times, [left, middle, right])
        touches = [_Touch(machine, one) for one in stated.contacts]
        sides = [
            0 if stick else int(np.sign(one.sliding(middle, y[m])))
            for one, stick in zip(touches, sticks[m], strict=True)
        ]
        part = _Part(stated, sides, [law.label(y[m]) for law in laws(stated)])
        run = solve_ivp(
            part.rates, (left, right), y[a], method="DOP853", rtol=1e-12, atol=1e-13 * scale,
            dense_output=True, max_step=0.05,
        )  # fmt: skip
        n = part.mass.size
        error = np.abs(run.y[:, -1] - y[b])
        error[n:] /= scale
        error[:n] /= max(np.abs(y[:, :n]).max(), 1e-3)
        error[n:][~part.free] = 0.0  # given
        worst = max(worst, float(error.max()))
        if right - left < 1e-6:
            continue
        for share in _INSIDE:
            t = left + share * (right - left)
            state = run.sol(t)
            said = part.violated(t, state, scale)
            assert not said, f"at {t} s: {said}"
    return worst
