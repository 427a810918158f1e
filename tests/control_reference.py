"""A machine with controllers by DOP853, with events and samples that are located here.

Written from the definition of a controller alone. Contacts slide in one direction all the time, so
that the machine is linear but for limits: of outputs, where the integral part rests, returns or
follows, and of actuation forces. At every limit the next state follows from the rates there.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

import wedgebrake as wb

Array = NDArray[np.float64]
# Time after an event in which its quantity, which is zero, does not count [s].
_ARMED = 1e-7
LINEAR, RESTS, RETURNS, FOLLOWS = range(4)


class Label(NamedTuple):
    """Where an output is: within its limits, or beyond or at the one of a side."""

    kind: int
    side: int


class _Signal:
    """A setpoint or torque: a number, or a sum of sines and constants."""

    def __init__(self, given: Any) -> None:
        self.value = given
        self.parts = given.signals if hasattr(given, "signals") else [given]

    def __call__(self, t: float) -> float:
        return float(self.value(t)) if callable(self.value) else float(self.value)

    def rate(self, t: float) -> float:
        total = 0.0
        for one in self.parts:
            if isinstance(one, wb.Harmonic):
                omega = 2.0 * np.pi * one.frequency
                total += one.amplitude * omega * np.cos(omega * t + one.phase)
        return total


class Reference:
    """The equations of a machine with controllers, in the order of its state."""

    def __init__(self, machine: wb.Machine) -> None:
        self.machine = machine
        self.names = list(machine.inertia_names)
        n = self.n = len(self.names)
        self.inertia = np.array([one.inertia for one in machine.inertias])
        self.twists = np.zeros((len(machine.shafts), n))
        for row, one in zip(self.twists, machine.shafts, strict=True):
            row[self.names.index(one.a)] = 1.0
            if one.b != "ground":
                row[self.names.index(one.b)] = -one.ratio
        self.signals = {one.name: _Signal(one.signal) for one in machine.torques}
        self.setpoints = [_Signal(one.setpoint) for one in machine.controllers]
        self.loops = machine.controllers
        self.size = 2 * n + len(machine.contacts)
        # Of each controller: integral part, filtered error.
        self.memory = [self.size + 2 * i for i in range(len(self.loops))]
        self.size += 2 * len(self.loops)
        self.held = [0.0] * len(self.loops)
        self.digital: list[dict[str, Any]] = [
            {"sum": 0.0, "rate": 0.0, "error": None, "queue": [0.0] * one.delay}
            for one in self.loops
        ]

    def start(self) -> Array:
        y = np.zeros(self.size)
        y[: self.n] = [one.angle for one in self.machine.inertias]
        y[self.n : 2 * self.n] = [one.speed for one in self.machine.inertias]
        for j, one in enumerate(self.machine.contacts):
            y[2 * self.n + j] = one.actuation.initial_force
        for i, at in enumerate(self.memory):
            y[at + 1] = self.error(i, 0.0, y)
        return y

    def bounds(self, j: int) -> tuple[float, float]:
        low, high = self.machine.contacts[j].actuation.limits or (0.0, np.inf)
        return max(low, 0.0), high

    def force(self, j: int, y: Array) -> float:
        return float(np.clip(y[2 * self.n + j], *self.bounds(j)))

    def _measured(self, i: int, y: Array, of_force: Callable[[int], float]) -> float:
        """The measured quantity as a function of angles and speeds, which is linear in them."""
        total = 0.0
        for name, factor in self.loops[i].measured.items():
            part, _, what = name.rpartition(".")
            if what in ("angle", "speed"):
                at = self.names.index(part) + (self.n if what == "speed" else 0)
                total += factor * y[at]
            elif what == "torque":
                k = [one.name for one in self.machine.shafts].index(part)
                one = self.machine.shafts[k]
                twist, rate = (
                    self.twists[k] @ part for part in (y[: self.n], y[self.n : 2 * self.n])
                )
                total += factor * (one.stiffness * twist + one.damping * rate)
            else:
                total += factor * of_force(self.machine.contact_names.index(part))
        return float(total)

    def error(self, i: int, t: float, y: Array) -> float:
        return self.setpoints[i](t) - self._measured(i, y, lambda j: self.force(j, y))

    def free(self, i: int, t: float, y: Array) -> float:
        """The output without limits."""
        loop, error = self.loops[i], self.error(i, t, y)
        found = loop.proportional * error + y[self.memory[i]]
        if loop.derivative:
            found += loop.derivative * (error - y[self.memory[i] + 1]) / loop.filter_time
        return float(found)

    def output(self, i: int, t: float, y: Array, labels: list[Label]) -> float:
        loop, label = self.loops[i], labels[i]
        if loop.sample_time is not None:
            return self.held[i]
        if label.kind == LINEAR:
            return self.free(i, t, y)
        return loop.limits[label.side > 0]

    def rates(self, t: float, y: Array, labels: list[Label], clipped: list[int]) -> Array:
        n, machine, found = self.n, self.machine, np.zeros(self.size)
        torque = np.zeros(n)
        for row, one in zip(self.twists, machine.shafts, strict=True):
            twist, rate = row @ y[:n], row @ y[n : 2 * n]
            torque -= row * (one.stiffness * twist + one.damping * rate)
        for one in machine.torques:
            torque[self.names.index(one.on)] += self.signals[one.name](t)
        outputs = [self.output(i, t, y, labels) for i in range(len(self.loops))]
        for j, one in enumerate(machine.contacts):
            at = self.names.index(one.a)
            sliding = y[n + at] - one.base_speed
            side = 1.0 if sliding > 0.0 else -1.0
            gain = one.brake.radius * one.brake.amplification(side * one.friction.kinetic)
            low, high = self.bounds(j)
            force = (y[2 * n + j], low, high)[clipped[j]]
            torque[at] -= gain * force
            command = one.actuation.initial_force + one.actuation.slope * abs(sliding)
            for loop, output in zip(self.loops, outputs, strict=True):
                command += output if loop.output == f"{one.name}.command" else 0.0
            found[2 * n + j] = (command - y[2 * n + j]) / one.actuation.lag
        for loop, output in zip(self.loops, outputs, strict=True):
            part, _, what = loop.output.rpartition(".")
            if what == "torque":
                torque[self.names.index(part)] += output
        found[:n], found[n : 2 * n] = y[n : 2 * n], torque / self.inertia
        for i, loop in enumerate(self.loops):
            if loop.sample_time is None:
                at, error = self.memory[i], self.error(i, t, y)
                if loop.derivative:
                    found[at + 1] = (error - y[at + 1]) / loop.filter_time
                if labels[i].kind in (LINEAR, RETURNS):
                    found[at] = loop.integral * error
                elif labels[i].kind == FOLLOWS:
                    found[at] = -self.drift(i, t, found, clipped)
        return found

    def drift(self, i: int, t: float, rates: Array, clipped: list[int]) -> float:
        """Rate of the output without limits and without the integral part."""
        loop = self.loops[i]

        def by_force(j: int) -> float:
            return float(rates[2 * self.n + j]) if clipped[j] == 0 else 0.0

        change = self.setpoints[i].rate(t) - self._measured(i, rates, by_force)
        found = loop.proportional * change
        if loop.derivative:
            found += loop.derivative * (change - rates[self.memory[i] + 1]) / loop.filter_time
        return float(found)

    def turning(self, i: int, t: float, y: Array) -> float:
        return self.loops[i].integral * self.error(i, t, y)

    def drift_at(
        self, i: int, t: float, y: Array, labels: list[Label], clipped: list[int]
    ) -> float:
        return self.drift(i, t, self.rates(t, y, labels, clipped), clipped)

    def at_limit(
        self, i: int, side: int, t: float, y: Array, labels: list[Label], clipped: list[int]
    ) -> Label:
        """Where an output goes that is at a limit."""
        drift = side * self.drift_at(i, t, y, labels, clipped)
        turning = side * self.turning(i, t, y)
        if turning <= 0.0:
            return Label(RETURNS, side) if drift + turning > 0.0 else Label(LINEAR, 0)
        if drift > 0.0:
            return Label(RESTS, side)
        return Label(LINEAR, 0) if drift + turning < 0.0 else Label(FOLLOWS, side)

    def label(self, i: int, t: float, y: Array) -> Label:
        """Where an output is, by its value alone."""
        loop = self.loops[i]
        if loop.limits is None or loop.sample_time is not None:
            return Label(LINEAR, 0)
        free, (low, high) = self.free(i, t, y), loop.limits
        if low <= free <= high:
            return Label(LINEAR, 0)
        side = 1 if free > high else -1
        returns = side * self.turning(i, t, y) < 0.0
        return Label(RETURNS if returns else RESTS, side)

    def sample(self, i: int, t: float, y: Array) -> None:
        loop, memory, error = self.loops[i], self.digital[i], self.error(i, t, y)
        step, smooth = loop.sample_time, loop.filter_time or 0.0
        before = error if memory["error"] is None else memory["error"]
        change = loop.derivative * (error - before)
        memory["rate"] = (smooth * memory["rate"] + change) / (smooth + step)
        memory["error"] = error
        low, high = loop.limits or (-np.inf, np.inf)
        rest = loop.proportional * error + memory["rate"]
        added = loop.integral * step * error
        after = rest + memory["sum"] + added
        if not ((after > high and added > 0.0) or (after < low and added < 0.0)):
            memory["sum"] += added
        output = rest + memory["sum"]
        if loop.resolution:
            output = loop.resolution * round(output / loop.resolution)
        memory["queue"].append(float(np.clip(output, low, high)))
        self.held[i] = memory["queue"].pop(0)


class Found(NamedTuple):
    """States at the wanted times, integral parts, outputs, and the times of events."""

    states: Array
    integrals: Array
    outputs: Array
    events: list[tuple[float, str]]


def simulate(machine: wb.Machine, times: Array, longest: float = 0.01) -> Found:
    """The motion at ascending times from 0 on.

    longest : largest step of the integrator [s]
    """
    ref = Reference(machine)
    loops = range(len(ref.loops))
    t, y, end = 0.0, ref.start(), float(times[-1])
    states = np.full((len(times), ref.size), np.nan)
    integrals, outputs = np.full((2, len(times), len(ref.loops)), np.nan)
    samples = [0] * len(ref.loops)
    clipped = [_clip(ref, j, y) for j in range(len(machine.contacts))]
    labels = [ref.label(i, t, y) for i in loops]
    found: list[tuple[float, str]] = []
    while True:
        jumped = False
        for i in loops:
            step = ref.loops[i].sample_time
            if step is not None and samples[i] * step <= t:
                ref.sample(i, t, y)
                samples[i] += 1
                jumped = True
        for i in loops:  # a sample may have changed the rate of an output that is at its limit
            if jumped and labels[i].kind == FOLLOWS:
                labels[i] = ref.at_limit(i, labels[i].side, t, y, labels, clipped)
                if labels[i].kind == LINEAR:
                    found.append((t, ref.loops[i].name))
        steps = [samples[i] * ref.loops[i].sample_time for i in loops if ref.loops[i].sample_time]
        until = min([end, *steps])
        guards = _guards(ref, labels, clipped)
        part = solve_ivp(
            lambda now, y, a=labels, b=clipped: ref.rates(now, y, a, b), (t, until), y,
            method="DOP853", rtol=1e-12, atol=1e-13, events=_armed(guards, t), dense_output=True,
            max_step=longest,
        )  # fmt: skip
        inside = np.flatnonzero((times >= t) & (times <= part.t[-1]))
        for k in inside:
            states[k] = part.sol(times[k]) if part.t[-1] > t else y
            for i in loops:
                digital = ref.loops[i].sample_time is not None
                integrals[k, i] = ref.digital[i]["sum"] if digital else states[k, ref.memory[i]]
                outputs[k, i] = ref.output(i, times[k], states[k], labels)
        t, y = float(part.t[-1]), part.y[:, -1]
        if part.status == 1:
            which = next(k for k, one in enumerate(part.t_events) if len(one))
            name = guards[which][1](t, y)
            if name:
                found.append((t, name))
        elif t >= end:
            return Found(states, integrals, outputs, found)


def _armed(guards: Any, begin: float) -> list[Any]:
    """Event functions that are positive just after the beginning."""
    found = []
    for guard, _ in guards:

        def event(now: float, y: Array, guard: Any = guard) -> float:
            return float(guard(now, y)) if now > begin + _ARMED else 1.0

        event.terminal = True  # type: ignore[attr-defined]
        found.append(event)
    return found


def _clip(ref: Reference, j: int, y: Array) -> int:
    low, high = ref.bounds(j)
    force = y[2 * ref.n + j]
    return 1 if force < low else 2 if force > high else 0


def _guards(ref: Reference, labels: list[Label], clipped: list[int]) -> list[Any]:
    """Pairs of a function that is positive until an event, and what changes there."""
    found: list[Any] = []
    for i, loop in enumerate(ref.loops):
        if loop.limits is None or loop.sample_time is not None:
            continue
        label = labels[i]

        def moves(t: float, y: Array, i: int, side: int) -> str:
            old = labels[i]
            labels[i] = ref.at_limit(i, side, t, y, labels, clipped)
            if not ref.loops[i].integral:
                labels[i] = Label(RESTS, side) if old.kind == LINEAR else Label(LINEAR, 0)
            bends = (old.kind == LINEAR) != (labels[i].kind == LINEAR)
            return ref.loops[i].name if bends else ""

        def turns(_t: float, _y: Array, i: int) -> str:
            kind = RETURNS if labels[i].kind == RESTS else RESTS
            labels[i] = Label(kind, labels[i].side)
            return ""

        def leaves(_t: float, _y: Array, i: int, kind: int) -> str:
            labels[i] = Label(kind, labels[i].side if kind else 0)
            return "" if kind else ref.loops[i].name

        if label.kind == LINEAR:
            for side, limit in ((-1, loop.limits[0]), (1, loop.limits[1])):
                found.append((
                    lambda t, y, i=i, s=side, m=limit: s * (m - ref.free(i, t, y)),
                    lambda t, y, i=i, s=side: moves(t, y, i, s),
                ))  # fmt: skip
            continue
        side = label.side
        if label.kind == FOLLOWS:
            if loop.proportional or loop.derivative:  # otherwise its drift is 0
                found.append((
                    lambda t, y, i=i, s=side: -s * ref.drift_at(i, t, y, labels, clipped),
                    lambda t, y, i=i: leaves(t, y, i, RESTS),
                ))  # fmt: skip
            found.append((
                lambda t, y, i=i, s=side: s
                * (ref.drift_at(i, t, y, labels, clipped) + ref.turning(i, t, y)),
                lambda t, y, i=i: leaves(t, y, i, LINEAR),
            ))  # fmt: skip
            continue
        limit = loop.limits[side > 0]
        found.append((
            lambda t, y, i=i, s=side, m=limit: s * (ref.free(i, t, y) - m),
            lambda t, y, i=i, s=side: moves(t, y, i, s),
        ))  # fmt: skip
        if loop.integral != 0.0:
            way = side if label.kind == RESTS else -side
            found.append((
                lambda t, y, i=i, w=way: w * ref.turning(i, t, y),
                lambda t, y, i=i: turns(t, y, i),
            ))  # fmt: skip
    for j, contact in enumerate(ref.machine.contacts):
        low, high = ref.bounds(j)
        place = 2 * ref.n + j

        def set_clip(_t: float, _y: Array, j: int, value: int, name: str) -> str:
            clipped[j] = value
            return name

        for value, sign, limit in ((1, 1.0, low), (2, -1.0, high)):
            if clipped[j] in (0, value) and np.isfinite(limit):
                now = sign if clipped[j] == 0 else -sign
                new = value if clipped[j] == 0 else 0
                found.append((
                    lambda _t, y, at=place, s=now, m=limit: s * (y[at] - m),
                    lambda t, y, j=j, v=new, name=contact.name: set_clip(t, y, j, v, name),
                ))  # fmt: skip
    return found


def random_machine(seed: int) -> wb.Machine:
    """One to three inertias with shafts, controllers of all kinds, and sometimes a brake.

    The base of the brake turns fast, so that it slides in one direction.
    """
    rng = np.random.default_rng([20251127, seed])
    n = int(rng.integers(1, 4))
    names = [f"body{i}" for i in range(n)]
    inertias = [
        wb.Inertia(
            name, float(rng.uniform(0.3, 2.0)), 0.1 * float(rng.normal()), float(rng.normal())
        )
        for name in names
    ]
    shafts = [
        wb.Shaft(
            names[i], names[i + 1], float(rng.uniform(20.0, 200.0)), float(rng.uniform(0.1, 2.0)),
            ratio=float(rng.choice([1.0, 1.0, -2.0])), name=f"shaft{i}",
        )
        for i in range(n - 1)
    ]  # fmt: skip
    if rng.random() < 0.6:
        shafts.append(
            wb.Shaft(names[-1], "ground", float(rng.uniform(20.0, 200.0)), 0.5, name="last")
        )
    contacts = []
    if rng.random() < 0.6:
        limits = (20.0, float(rng.uniform(60.0, 200.0))) if rng.random() < 0.3 else None
        actuation = wb.Actuation(
            initial_force=float(rng.uniform(20.0, 60.0)), slope=float(rng.uniform(-0.3, 0.3)),
            lag=float(rng.uniform(0.02, 0.2)), limits=limits,
        )  # fmt: skip
        contacts.append(
            wb.Contact(
                names[int(rng.integers(n))],
                name="brake",
                base_speed=-1000.0,
                brake=wb.ConventionalBrake(radius=0.2),
                friction=wb.CoulombFriction(kinetic=float(rng.uniform(0.1, 0.4))),
                actuation=actuation,
            )
        )
    torques = [
        wb.Torque(
            names[0], wb.Harmonic(float(rng.uniform(1.0, 10.0)), float(rng.uniform(0.2, 2.0)))
        )
    ]
    loops = [
        _random_controller(rng, f"loop{k}", names, shafts, bool(contacts))
        for k in range(int(rng.integers(1, 3)))
    ]
    return wb.Machine(
        inertias=inertias, shafts=shafts, contacts=contacts, torques=torques, controllers=loops
    )


def _random_controller(
    rng: np.random.Generator, name: str, names: list[str], shafts: list[wb.Shaft], brake: bool
) -> wb.Controller:
    commands = brake and rng.random() < 0.5
    scale = 10.0 if commands else 1.0
    measured = {f"{rng.choice(names)}.speed": 1.0}
    if rng.random() < 0.4:
        measured[f"{rng.choice(names)}.angle"] = float(rng.uniform(0.5, 3.0))
    if shafts and rng.random() < 0.3:
        measured[f"{shafts[0].name}.torque"] = float(rng.uniform(-0.02, 0.05))
    if brake and rng.random() < 0.3:
        measured["brake.force"] = float(rng.uniform(0.005, 0.02))
    size, digital = scale * float(rng.uniform(1.0, 6.0)), rng.random() < 0.4
    sine = wb.Harmonic(
        float(rng.uniform(0.5, 3.0)), float(rng.uniform(0.2, 1.0)), float(rng.uniform(0.0, 6.0))
    )
    more: dict[str, Any] = {}
    if digital:
        more = {"sample_time": float(rng.choice([0.01, 0.02, 0.05])), "delay": int(rng.integers(3))}
        if rng.random() < 0.3:
            more["resolution"] = 0.1 * scale
    derivative = float(rng.uniform(0.02, 0.2)) * scale if rng.random() < 0.4 else 0.0
    return wb.Controller(
        name, measured, sine if rng.random() < 0.7 else float(rng.normal()),
        "brake.command" if commands else f"{rng.choice(names)}.torque",
        proportional=scale * float(rng.uniform(0.0, 5.0)) * (rng.random() < 0.9),
        integral=scale * float(rng.uniform(1.0, 30.0)) * (rng.random() < 0.8),
        derivative=derivative, filter_time=float(rng.uniform(0.02, 0.2)) if derivative else None,
        limits=(-size, float(rng.uniform(0.2, 1.0)) * size) if rng.random() < 0.8 else None, **more,
    )  # fmt: skip
