"""Machines with round numbers, in which ties are common, and what must hold of their motions.

    round_case("locked", 7)        # tables and a duration
    faults(case)                   # (kind, text) of all that is wrong, empty if nothing is

The families draw what people type: one or two digits, records rounded to 0.001, loads equal to
limits, parts that are alike. From the command line, ``python tests/machine_round.py FAMILY FIRST
LAST`` lists the seeds that fail, and why; FAMILY may be "all".
"""

from __future__ import annotations

import argparse
import copy
import math
import multiprocessing
import signal
import sys
import time
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

import machine_plain
import wedgebrake as wb
from machine_cases import Case, with_units
from machine_plain import Tables
from machine_reference import Event, LockingError, Machine, Plain, Run, simulate

Array = NDArray[np.float64]
STICK, SLIP, REVERSAL = 2, 3, 4
_STATES = ("angle", "velocity", "sliding_velocity")
_SAMPLES = 301
_SAME_INSTANT = 1e-9  # [s]
_TIE = 3e-12  # of the reference, see its ``simulate``
_NEAR_TIES = 1e-4  # relative difference of two motions up to which they are near each other
_INSTANT = 1e-6  # [s] difference of the ends of slides
_ROOT = 2e-4  # [s] a slip may begin with the third power of time: the cube root of a tie


# The machines.


def _harmonic(amplitude: float, frequency: float, phase: float = 0.0) -> Tables:
    return {"kind": "harmonic", "amplitude": amplitude, "frequency": frequency, "phase": phase}


def _table(times: Sequence[float], values: Sequence[float]) -> Tables:
    points = {"times": list(times), "values": list(values)}
    return {"kind": "table", **points, "periodic": False, "after": "hold"}


def _ramp(start: float, end: float, begin: float, duration: float) -> Tables:
    return {"kind": "ramp", "start": start, "end": end, "duration": duration, "begin": begin}


class _Draw:
    """Parts with round numbers. A conventional brake of ``force`` has a torque of 0.1 mu force."""

    def __init__(self, family: str, seed: int) -> None:
        self.rng = np.random.default_rng([20142607, *family.encode(), seed])

    def chance(self, share: float) -> bool:
        return bool(self.rng.random() < share)

    def pick(self, *values: Any) -> Any:
        return values[int(self.rng.integers(len(values)))]

    def count(self, low: int, high: int) -> int:
        return int(self.rng.integers(low, high + 1))

    def inertia(self, name: str, speed: float = 0.0, angle: float = 0.0) -> Tables:
        size = self.pick(0.1, 0.2, 0.3, 0.5, 1.0, 1.0, 2.0, 2.5, 5.0)
        return {"name": name, "inertia": size, "angle": angle, "speed": speed}

    def shaft(self, a: str, b: str = "ground") -> Tables:
        return {
            "a": a, "b": b, "stiffness": self.pick(50.0, 100.0, 200.0, 500.0, 1000.0, 2000.0),
            "damping": self.pick(0.0, 0.0, 0.3, 1.0, 3.0), "ratio": 1.0, "name": f"{a}-{b}",
        }  # fmt: skip

    def contact(
        self, a: str, b: str = "ground", *, force: Any, static: float | None = None,
        name: str | None = None, base: Any = 0.0, brake: Tables | None = None, kinetic: float = 0.3,
        **actuation: Any,
    ) -> Tables:  # fmt: skip
        static = self.pick(0.3, 0.3, 0.4) if static is None else static
        return {
            "a": a, "b": b, "name": name or f"{b}-on-{a}", "base_speed": base,
            "brake": brake or {"kind": "conventional", "radius": 0.1},
            "friction": {"kind": "coulomb", "kinetic": kinetic, "static": static},
            "actuation": {"initial_force": force, **actuation},
        }  # fmt: skip

    def wave(self, amplitude: float | None = None) -> Tables:
        size = self.pick(1.0, 10.0, 20.0, 30.0, 50.0, 60.0, 100.0)
        frequency = self.pick(0.5, 1.0, 1.0, 2.0, 2.5, 3.0, 5.0)
        return _harmonic(size if amplitude is None else amplitude, frequency, self.pick(0.0, 1.0))

    def record(self, size: float, duration: float, points: int = 100) -> Tables:
        times = np.linspace(0.0, duration, points + 1)
        shape = (times / duration) ** self.pick(0, 1, 2) * np.sin(self.pick(5, 7, 20) * times)
        return _table(np.round(times, 3).tolist(), np.round(size * shape, 3).tolist())


def _torque(on: str, signal: Any) -> Tables:
    return {"on": on, "signal": signal, "name": f"torque-{on}"}


def _machine(
    inertias: Sequence[Tables], shafts: Sequence[Tables], contacts: Sequence[Tables],
    torques: Sequence[Tables] = (),
) -> Tables:  # fmt: skip
    return {
        "inertias": list(inertias), "shafts": list(shafts), "contacts": list(contacts),
        "torques": list(torques),
    }  # fmt: skip


FORCES = (100.0, 200.0, 300.0, 400.0, 500.0, 600.0, 1000.0)


def brakes(d: _Draw) -> tuple[Tables, float]:
    """One inertia with one to three brakes, perhaps a spring, under constant or harmonic loads."""
    start = {"speed": d.pick(0.0, 0.0, 1.0, 10.0, -2.0), "angle": d.pick(0.0, 0.0, 0.1, -0.2)}
    disc = d.inertia("disc", **start)
    shafts = [d.shaft("disc")] if d.chance(0.7) else []
    contacts = [
        d.contact("disc", force=d.pick(*FORCES), name=f"brake-{k}") for k in range(d.count(1, 3))
    ]
    limit = sum(0.1 * c["friction"]["static"] * c["actuation"]["initial_force"] for c in contacts)
    load = d.pick(1.0, 0.5, 0.99, 1.0, 1.5) * limit
    signal: Any = d.pick(load, d.wave(load), d.wave())
    return _machine([disc], shafts, contacts, [_torque("disc", signal)]), d.pick(1.0, 2.0, 3.0)


def limit(d: _Draw) -> tuple[Tables, float]:
    """Loads that reach the holding limit exactly, or meet it at rest: springs, torques, ramps."""
    force = d.pick(*FORCES)
    contact = d.contact("disc", force=force, name="brake")
    capacity = 0.1 * contact["friction"]["static"] * force
    shaft, kind = d.shaft("disc"), d.pick("spring", "torque", "wave", "ramp", "both")
    disc, signal = d.inertia("disc"), 0.0
    sign = d.pick(1.0, -1.0)
    if kind == "spring":
        disc["angle"] = sign * d.pick(1.0, 2.0, 3.0, 5.0) * capacity / shaft["stiffness"]
    elif kind == "torque":
        signal = sign * capacity
    elif kind == "wave":
        signal = d.wave(capacity)
    elif kind == "ramp":
        signal = _table([0.0, 0.5, 1.0, 3.0], [0.0, capacity, capacity, d.pick(0.0, -capacity)])
    else:
        disc["angle"] = 0.5 * capacity / shaft["stiffness"]
        signal = sign * d.pick(0.5, 1.5) * capacity
    contacts = [contact]
    if d.chance(0.3):
        contacts.append(d.contact("disc", force=0.0, name="open"))
    if d.chance(0.3):
        contacts[0]["actuation"]["initial_force"] = force / 2
        contacts.append(copy.deepcopy({**contacts[0], "name": "twin"}))
    return _machine([disc], [shaft], contacts, [_torque("disc", signal)]), 3.0


def line(d: _Draw) -> tuple[Tables, float]:
    """Two to four inertias in a row, with brakes and clutches between neighbours."""
    n, speed = d.count(2, 4), d.pick(0.0, 0.0, 5.0, 10.0)
    names = [f"i{k}" for k in range(n)]
    inertias = [d.inertia(name, speed=d.pick(speed, speed, 0.0, -1.0)) for name in names]
    pairs = [(names[k], names[k + 1]) for k in range(n - 1)]
    shafts = [d.shaft(*pair) for pair in pairs if d.chance(0.6)]
    shafts += [d.shaft(names[-1])] if d.chance(0.5) else []
    contacts = [d.contact(*pair, force=d.pick(*FORCES)) for pair in pairs if d.chance(0.6)]
    contacts += [d.contact(name, force=d.pick(*FORCES)) for name in names if d.chance(0.5)]
    contacts = contacts[:5] or [d.contact(names[0], force=300.0)]
    torques = [_torque(name, d.pick(d.wave(), 10.0, 30.0)) for name in names if d.chance(0.5)]
    return _machine(inertias, shafts, contacts, torques), d.pick(0.5, 1.0)


def loop(d: _Draw) -> tuple[Tables, float]:
    """Clutches and brakes that close loops, most with a static peak."""
    n = d.count(2, 3)
    names = ["a", "b", "c"][:n]
    inertias = [d.inertia(name, speed=d.pick(0.0, 0.0, 1.0, 3.0)) for name in names]
    pairs = [("a", "b"), ("b", "c"), ("c", "a")][: 1 if n == 2 else d.count(2, 3)]
    static = d.pick(0.4, 0.4, 0.36, 0.3)
    contacts = [d.contact(*pair, force=d.pick(*FORCES), static=static) for pair in pairs]
    contacts += [d.contact(name, force=d.pick(*FORCES), static=static) for name in names]
    contacts = contacts[: d.count(3, 5)]
    shafts = [d.shaft("a", "b")] + ([d.shaft("b")] if d.chance(0.6) else [])
    torques = [_torque("a", d.wave())] + ([_torque("b", d.wave())] if d.chance(0.6) else [])
    return _machine(inertias, shafts, contacts, torques), d.pick(0.5, 1.0, 2.0)


def locked(d: _Draw) -> tuple[Tables, float]:
    """Springs between contacts that stick: their twist cannot change while all hold."""
    duration = d.pick(3.0, 5.0, 10.0)
    engine, vehicle = d.inertia("engine"), d.inertia("vehicle")
    end = d.pick(0.5, 1.0, 2.0)
    drive = d.pick(
        _table([0.0, 0.5, end, end + 0.1, 9.0], [0.0, 20.0, 20.0, 0.0, 0.0]),
        d.record(60.0, min(duration, 4.0)), d.wave(), _ramp(0.0, d.pick(20.0, 60.0), 0.5, 1.0),
    )  # fmt: skip
    brake = d.pick(
        1000.0, _table([0.0, end, end + 0.2, 9.0], [0.0, 0.0, 1000.0, 1000.0]),
        _table([0.0, end, end + 1.0], [1000.0, 1000.0, 0.0]), 300.0,
    )  # fmt: skip
    contacts = [
        d.contact("engine", "vehicle", force=d.pick(1e5, 1e6, 1000.0, 300.0), name="clutch"),
        d.contact("vehicle", force=brake, name="brake"),
    ]
    if d.chance(0.4):
        belt = _table([0.0, 1.0, 2.0, 3.0], [d.pick(0.0, -0.4, 1.0), -0.8, d.pick(0.0, 1.2), -1.6])
        contacts.append(d.contact("vehicle", force=d.pick(50.0, 100.0), base=belt, name="belt"))
    if d.chance(0.4):
        contacts.append(d.contact("engine", force=d.pick(100.0, 1e6), name="parking-brake"))
    shafts = [d.shaft("engine", "vehicle")] + ([d.shaft("vehicle")] if d.chance(0.3) else [])
    machine = _machine([engine, vehicle], shafts, contacts, [_torque("engine", drive)])
    if d.chance(0.25):  # one inertia alone
        machine["inertias"] = [vehicle]
        machine["shafts"] = [d.shaft("vehicle")]
        machine["contacts"] = [c for c in contacts if c["b"] == "ground" and c["a"] == "vehicle"]
        machine["torques"] = [_torque("vehicle", drive)]
    return machine, duration


def open_clutch(d: _Draw) -> tuple[Tables, float]:
    """A clutch that is open, at times or always, in a line that turns evenly."""
    speed = d.pick(13.0, 10.0, 100.0, 7.0)
    names = ["engine", "gearbox", "vehicle"]
    inertias = [d.inertia(name, speed=speed) for name in names]
    force = d.pick(0.0, _ramp(0.0, 800.0, 0.1, 0.4), _ramp(400.0, 0.0, 0.1, 0.4), 0.0)
    ends = d.pick(("engine", "gearbox"), ("gearbox", "engine"), ("engine", "vehicle"))
    contacts = [d.contact(*ends, force=force, name="clutch")]
    if d.chance(0.5):
        brake = d.pick(0.0, _ramp(0.0, 150.0, 0.3, 0.2), 150.0)
        contacts.append(d.contact("vehicle", force=brake, name="brake"))
    if d.chance(0.3):
        contacts.append(d.contact("gearbox", "vehicle", force=d.pick(0.0, 1000.0), name="lock-up"))
    shafts = [d.shaft("gearbox", "vehicle")]
    shafts += [d.shaft("engine", "gearbox")] if d.chance(0.3) else []
    torques = [_torque("engine", d.pick(20.0, d.wave()))] if d.chance(0.4) else []
    return _machine(inertias, shafts, contacts, torques), d.pick(0.6, 1.0, 2.0)


def unequal(d: _Draw) -> tuple[Tables, float]:
    """Contacts from 1e-3 N to 1e8 N, in loops and side by side."""
    inertias = [d.inertia(name, speed=d.pick(0.0, 0.0, 1.0)) for name in ("a", "b")]
    forces = [1e-3, 1.0, 100.0, 500.0, 1000.0, 1e5, 1e7, 1e8, 0.0]
    ends = [("a", "b"), ("a", "ground"), ("b", "ground"), ("a", "b"), ("b", "ground")]
    contacts = [
        d.contact(*pair, force=d.pick(*forces), name=f"contact-{k}")
        for k, pair in enumerate(ends[: d.count(2, 5)])
    ]
    shafts = [d.shaft("a", "b"), d.shaft("b")][: d.count(0, 2)]
    torques = [_torque("a", d.wave()), _torque("b", d.wave())][: d.count(1, 2)]
    return _machine(inertias, shafts, contacts, torques), d.pick(1.0, 2.0)


def one_way(d: _Draw) -> tuple[Tables, float]:
    """A wedge that locks itself in one direction, as a one-way clutch; its force may end."""
    wedge = {"kind": "wedge", "angle": 0.2, "radius": d.pick(0.1, 0.15)}
    force = d.pick(
        0.0, 1e-8, 2e-8, 1.0, 100.0, _ramp(100.0, 0.0, 0.5, 0.5), _ramp(0.0, 100.0, 0.5, 0.5),
        _table([0.0, 0.5, 1.0, 1.5, 2.0], [10.0, 0.0, 0.0, 10.0, 0.0]),
    )  # fmt: skip
    two = d.chance(0.6)
    inertias = [d.inertia("a", speed=d.pick(0.0, 0.0, -1.0))]
    inertias += [d.inertia("b", speed=d.pick(0.0, 0.0, 2.0))] if two else []
    ends = ("a", "b") if two else ("a", "ground")
    contacts = [d.contact(*ends, force=force, static=d.pick(0.3, 0.4), brake=wedge, name="wedge")]
    if two or d.chance(0.4):
        contacts.append(d.contact(inertias[-1]["name"], force=d.pick(0.0, 100.0, 300.0)))
    shafts = [d.shaft(inertias[-1]["name"])] if d.chance(0.6) else []
    load = d.pick(10.0, -10.0, d.wave(), _table([0.0, 0.5, 1.0, 1.5], [10.0, 10.0, -10.0, 0.0]))
    return _machine(inertias, shafts, contacts, [_torque("a", load)]), d.pick(1.0, 2.0)


def sampled(d: _Draw) -> tuple[Tables, float]:
    """Forces of sampled actuations, rounded and delayed."""
    table, duration = d.pick(brakes, line, base)(d)
    for contact in table["contacts"]:
        force, given = contact["actuation"]["initial_force"], contact["actuation"]
        if not d.chance(0.7):
            continue
        given["sample_time"] = d.pick(0.01, 0.02, 0.05)
        given["delay"] = d.count(0, 2)
        if isinstance(force, float):
            given["resolution"] = d.pick(0.5, 1.0, 30.0)
            given["slope"] = d.pick(0.0, 0.0, -10.0, 20.0)
        elif d.chance(0.3):
            given["lag"] = d.pick(0.01, 0.1)
    return table, duration


def base(d: _Draw) -> tuple[Tables, float]:
    """Bases whose speed ends at 0, or meets the speed of the inertia at a knot."""
    speed = d.pick(1.0, 2.0, 3.0, 5.0, -2.0)
    belt = d.pick(
        _ramp(speed, 0.0, 0.5, 0.5), _ramp(0.0, speed, 0.5, 0.5), _ramp(speed, -speed, 0.2, 0.8),
        _table([0.0, 0.5, 1.0, 1.5], [speed, 0.0, 0.0, -speed]), _harmonic(speed, 1.0), speed,
        _table([0.0, 1.0, 2.0, 3.0], [-0.42, -0.771, 1.228, -1.57]),
    )  # fmt: skip
    disc = d.inertia("disc", speed=d.pick(0.0, speed, speed))
    contacts = [d.contact("disc", force=d.pick(*FORCES), base=belt, name="belt")]
    if d.chance(0.6):
        contacts.append(d.contact("disc", force=d.pick(0.0, 100.0, 1e6, 300.0), name="brake"))
    if d.chance(0.3):
        other = d.pick(belt, -speed, _ramp(speed, 0.0, 0.5, 0.5))
        contacts.append(d.contact("disc", force=d.pick(*FORCES), base=other, name="second-belt"))
    shafts = [d.shaft("disc")] if d.chance(0.7) else []
    torques = [_torque("disc", d.pick(d.wave(), 30.0))] if d.chance(0.5) else []
    return _machine([disc], shafts, contacts, torques), d.pick(1.5, 2.0, 3.0)


def symmetric(d: _Draw) -> tuple[Tables, float]:
    """Parts that are alike, so that contacts arrive and release at the same instant."""
    one, n = d.inertia("m"), d.count(2, 4)
    names = [f"i{k}" for k in range(n)]
    speeds = d.pick([0.0] * n, [2.0] * n, [2.0 * (-1.0) ** k for k in range(n)])
    inertias = [
        {**one, "name": name, "speed": speed} for name, speed in zip(names, speeds, strict=True)
    ]
    force, static = d.pick(*FORCES), d.pick(0.3, 0.3, 0.4)
    contacts = [d.contact(name, force=force, static=static) for name in names][: d.count(1, n)]
    if n < 4 and d.chance(0.5):
        pairs = [(names[k], names[k + 1]) for k in range(n - 1)]
        clutch = d.pick(force, 2.0 * force)
        contacts += [d.contact(*pair, force=clutch, static=static) for pair in pairs]
    shaft = d.shaft("m")
    shafts = [
        {**shaft, "a": names[k], "b": names[k + 1], "name": f"shaft-{k}"} for k in range(n - 1)
    ]
    shafts += [{**shaft, "a": name, "b": "ground", "name": f"{name}-ground"} for name in names]
    shafts = shafts if d.chance(0.5) else shafts[n - 1 :]
    load = d.pick(0.03 * force, 0.04 * force, d.wave(), d.wave(0.06 * force))
    torques = [_torque(name, load) for name in names] if d.chance(0.7) else [_torque("i0", load)]
    return _machine(inertias, shafts, contacts, torques), d.pick(0.5, 1.0, 2.0)


def record(d: _Draw) -> tuple[Tables, float]:
    """A recorded torque, rounded to 0.001, on brakes that amplify themselves and cannot lock."""
    duration = 1.0
    size = d.pick(10.0, 20.0, 50.0, 100.0)
    drive = d.record(size, duration, d.pick(100, 200, 1000))
    wedge = {"kind": "wedge", "angle": math.radians(25.0), "radius": 0.15}
    brake = d.pick(wedge, wedge, None)
    names = ["a", "b"][: d.count(1, 2)]
    inertias = [d.inertia(name, speed=d.pick(0.0, 0.0, 3.0)) for name in names]
    force, shafts = d.pick(150.0, 100.0, 200.0), [d.shaft(names[0])]
    contacts = [
        d.contact("a", force=force, brake=brake, kinetic=0.35, static=d.pick(0.35, 0.4), name="one")
    ]
    if len(names) == 2:
        shafts.append(d.shaft("a", "b"))
        contacts.append(d.contact(*d.pick(("a", "b"), ("b", "ground")), force=300.0, name="two"))
    return _machine(inertias, shafts, contacts, [_torque(names[-1], drive)]), duration


def pressing(d: _Draw) -> tuple[Tables, float]:
    """Forces that start at 0, ramp to exactly 0, or stay there for a while."""
    table, _ = d.pick(brakes, line, loop)(d)
    for contact in table["contacts"]:
        if d.chance(0.7):
            force = contact["actuation"]["initial_force"]
            contact["actuation"]["initial_force"] = d.pick(
                _ramp(0.0, force, 0.0, 0.5), _ramp(force, 0.0, 0.5, 0.5),
                _ramp(0.0, force, 0.5, 0.2), _table([0.0, 0.5, 0.5, 1.0], [force, force, 0.0, 0.0]),
                _table([0.0, 0.2, 0.4, 0.6, 0.8], [0.0, force, 0.0, 0.0, force]),
                {"kind": "sum", "signals": [force, _harmonic(force, 1.0)]},
            )  # fmt: skip
    return table, 1.0


FAMILIES: dict[str, Callable[[_Draw], tuple[Tables, float]]] = {
    "brakes": brakes, "limit": limit, "line": line, "loop": loop, "locked": locked,
    "open": open_clutch, "unequal": unequal, "one-way": one_way, "sampled": sampled, "base": base,
    "symmetric": symmetric, "record": record, "pressing": pressing,
}  # fmt: skip


def round_case(family: str, seed: int) -> Case:
    """A machine of a family, and a duration."""
    tables, duration = FAMILIES[family](_Draw(family, seed))
    return Case(seed, tables, duration)


# What must hold.


class Fault(NamedTuple):
    """``kind``: "run", "reference", "events" or the name of the condition that is broken."""

    kind: str
    text: str


@contextmanager
def at_most(seconds: float) -> Iterator[None]:
    """Raise TimeoutError after some seconds; 0: never."""
    if not seconds:
        yield
        return

    def stop(*_: Any) -> None:
        raise TimeoutError(f"no answer within {seconds} s of the processor")

    old = signal.signal(signal.SIGPROF, stop)
    signal.setitimer(signal.ITIMER_PROF, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0.0)
        signal.signal(signal.SIGPROF, old)


def returns(function: Callable[..., Any], *given: Any, seconds: float) -> bool:
    """Return True if a function returns in a process of its own, within some seconds."""
    child = multiprocessing.get_context("fork").Process(target=function, args=given)
    child.start()
    child.join(seconds)
    if child.is_alive():
        child.kill()
        child.join()
    return child.exitcode == 0


def run_case(case: Case) -> Any:
    """The response, sampled evenly, at every event and between each two of them."""
    machine = case.machine()
    more: Any = {"max_events": 5000}
    even = np.linspace(0.0, case.duration, _SAMPLES)
    first = wb.simulate(machine, case.duration, times=even, **more)
    if first.attrs["status"] != "completed":
        return first
    events = np.unique(np.concatenate(([0.0], first["event_time"].values, [case.duration])))
    middles = 0.5 * (events[1:] + events[:-1])
    times = np.unique(np.concatenate((even, events, middles)))
    return wb.simulate(machine, case.duration, times=times, **more)


class Seen(NamedTuple):
    """A motion at some times, over (time, part), as a solver reports it."""

    time: Array
    angle: Array
    velocity: Array
    sliding_velocity: Array
    actuation_force: Array
    brake_torque: Array
    sticking: NDArray[np.bool_]


def seen_by_package(response: Any) -> Seen:
    values = {name: response[name].values for name in Seen._fields}
    return Seen(**{**values, "sticking": values["sticking"].astype(bool)})


def seen_by_reference(run: Run, times: Array) -> Seen:
    found = run.at(times, dependent=False)
    return Seen(times, **{name: found[name] for name in Seen._fields[1:]})


def speed_scale(plain: Plain, seen: Seen) -> float:
    """The largest speed, or of machines that stand what their torques give them in 1 ms."""
    machine = Machine(plain)
    u = machine.inputs(seen.time)
    speeds = np.abs(seen.velocity) @ np.abs(machine.w.T) + np.abs(u.base)
    torque = np.abs(u.torque) + np.abs(seen.angle) @ np.abs(plain.stiffness).T
    push = float(np.max(torque / plain.inertia, initial=0.0))
    return max(float(np.max(speeds, initial=0.0)), 1e-3 * push)


def conditions(plain: Plain, seen: Seen, exact: bool = True) -> Iterator[Fault]:
    """What is broken of the laws of friction and of the balance of torques at the times.

    exact : a contact that sticks to a base at rest has a sliding velocity of exactly 0
    """
    machine = Machine(plain)
    u = machine.inputs(seen.time)
    knots = np.array([*plain.knots, seen.time[-1]])  # signals may have a knot at the end
    smooth = np.min(np.abs(seen.time[:, None] - knots), axis=1) > _SAME_INSTANT
    terms = np.abs(u.torque) + np.abs(seen.angle) @ np.abs(plain.stiffness).T
    terms = terms + np.abs(seen.velocity) @ np.abs(plain.damping).T
    terms = np.max(terms + np.abs(np.nan_to_num(seen.brake_torque)) @ np.abs(machine.w), axis=0)
    free = u.torque - seen.angle @ plain.stiffness.T - seen.velocity @ plain.damping.T
    acceleration = (free - seen.brake_torque @ machine.w) / plain.inertia
    size, span = speed_scale(plain, seen), seen.time[-1] - seen.time[0]

    def fault(kind: str, contact: int, bad: NDArray[np.bool_], *values: Array) -> Iterator[Fault]:
        if np.any(bad):
            k = int(np.flatnonzero(bad)[0])
            numbers = ", ".join(f"{float(v[k]):.6g}" for v in values)
            text = f"{plain.contacts[contact].name} at {float(seen.time[k])!r} s: {numbers}"
            yield Fault(kind, f"{text} ({int(np.sum(bad))} times)")

    for j, contact in enumerate(plain.contacts):
        v, torque, force = (
            one[:, j] for one in (seen.sliding_velocity, seen.brake_torque, seen.actuation_force)
        )
        own = seen.velocity @ machine.w[j] - u.base[:, j]
        rest, side = seen.sticking[:, j], np.where(v > 0.0, 1, -1)
        yield from fault("sliding", j, ~rest & (np.abs(own - v) > 1e-12 * size), v, own)
        moving = ~rest & (np.abs(v) > 1e-10 * size)
        room = 1e-9 * np.abs(torque) + 1e-12 * float(np.max(terms))
        slow = ~rest & (np.abs(v) <= 1e-12 * size) & (force > 0.0)
        longer = np.diff(seen.time, prepend=seen.time[0], append=seen.time[-1]) > 1e-3 * span
        slow[1:-1] &= slow[:-2] & slow[2:] & longer[1:-2] & longer[2:-1]
        slow[[0, -1]] = False
        yield from fault("creeps", j, slow, v)
        yield from fault("opposes", j, moving & (torque * side < -room), v, torque)
        if contact.order == 0 and not contact.sample_time:
            law = np.clip(u.force[:, j] + contact.slope * np.abs(v), *contact.bounds)
            near = 1e-9 * (np.abs(law) + np.max(np.abs(u.force[:, j]), initial=0.0))
            yield from fault("force", j, smooth & (np.abs(law - force) > near), force, law)
        if not contact.table and contact.curve is None:
            gain = np.where(side > 0, contact.kinetic[1], contact.kinetic[0])
            with np.errstate(invalid="ignore"):
                law = np.nan_to_num(contact.radius * gain * force, nan=0.0)
            bad = moving & (np.abs(torque - law) > room)
            yield from fault("law", j, bad, v, torque, law)
        still = 0.0 if exact and contact.base is None and contact.b < 0 else 1e-12 * size
        yield from fault("stick", j, rest & (np.abs(own) > still), own)
        up, down = (
            np.where(force > 0.0, contact.radius * abs(one) * force, 0.0)
            if math.isfinite(one)
            else np.where(force > 0.0, math.inf, 0.0)
            for one in (contact.static[1], contact.static[0])
        )
        # At a knot the torque is that before it where the force has come to 0.
        bad = (torque > up * (1 + 1e-9) + room) | (-torque > down * (1 + 1e-9) + room)
        yield from fault("limit", j, rest & bad & (smooth | (force > 0.0)), torque, up, down)
        other = acceleration @ machine.w[j] - u.rate[:, j]
        sizes = float((terms / plain.inertia) @ np.abs(machine.w[j])) + np.abs(u.rate[:, j])
        held = rest & smooth & (np.abs(other) > 1e-9 * sizes)
        yield from fault("balance", j, held, other, sizes)


def energy_fault(response: Any, plain: Plain) -> Iterator[Fault]:
    found = wb.energy(response)
    parts = ("torque_work", "base_work", "friction_heat", "viscous_loss")
    passed = sum(float(np.abs(found[name]).sum()) for name in parts)
    passed += abs(float(found["stored_change"]))
    angle, velocity = response["angle"].values, response["velocity"].values
    stored = 0.5 * np.einsum("ti,ij,tj->t", angle, np.abs(plain.stiffness), angle)
    stored = stored + 0.5 * velocity**2 @ plain.inertia
    room = 1e-9 * passed + 1e-13 * float(np.max(stored)) + 1e-15
    residual = float(found["residual"])
    if not abs(residual) <= room:
        yield Fault("energy", f"residual {residual:.3g} J of {passed:.3g} J")


def event_faults(case: Case, plain: Plain, response: Any) -> Iterator[Fault]:
    """Chatter: more than two events of a contact at once, or more than the motion explains."""
    time, contact, kind = (response[f"event_{n}"].values for n in ("time", "contact", "kind"))
    fastest = np.sqrt(np.linalg.eigvals(plain.stiffness / plain.inertia[:, None]).real.clip(0.0))
    swings = case.duration * float(np.sum(fastest)) / math.pi
    forced = [t["signal"] for t in case.tables["torques"]]
    waves = sum(2.0 * case.duration * _frequency(one) for one in forced) + 2.0 * case.duration
    samples = sum(case.duration / c.sample_time for c in plain.contacts if c.sample_time)
    most = 6 * len(plain.contacts) * (swings + waves + samples + len(plain.knots) + 3)
    for j, one in enumerate(plain.contacts):
        times = time[(contact == j) & np.isin(kind, (STICK, SLIP, REVERSAL))]
        near = np.flatnonzero(times[2:] - times[:-2] < _SAME_INSTANT)
        if near.size:
            at = float(times[near[0]])
            yield Fault("chatter", f"{one.name} at {at!r} s, and {near.size - 1} times more")
        if times.size > most:
            yield Fault("chatter", f"{one.name} has {times.size} events, at most {most:.0f}")


def _frequency(data: Any) -> float:
    return float(data.get("frequency", 0.0)) if isinstance(data, dict) else 0.0


# Comparisons.


def _apart(times: Array, jumps: Array) -> NDArray[np.bool_]:
    if jumps.size == 0:
        return np.ones(times.shape, dtype=bool)
    return np.asarray(np.min(np.abs(times[:, None] - jumps), axis=1) > 1e-7)


def differences(kind: str, plain: Plain, one: Seen, other: Seen, jumps: Array, room: float) -> Any:
    """Faults of two motions that should be the same, apart from the times of jumps."""
    kept = _apart(one.time, np.concatenate((jumps, plain.knots)))
    size = float(np.max(np.abs(one.velocity), initial=0.0))
    for name in _STATES:
        ours, theirs = getattr(one, name)[kept], getattr(other, name)[kept]
        scale = max(float(np.max(np.abs(ours), initial=0.0)), 1e-3 * size, 1e-5)
        error = float(np.max(np.abs(ours - theirs), initial=0.0)) / scale
        if not error <= room:
            worst = np.max(np.abs(ours - theirs), axis=1)
            at = float(one.time[kept][np.flatnonzero(~(worst <= room * scale))[0]])
            yield Fault(kind, f"{name} differs by {error:.2g}, first at {at:.9g} s")
            return


def different_sticks(kind: str, plain: Plain, one: Seen, other: Seen, jumps: Array) -> Any:
    """Contacts that stick in one of two motions only, unless they are released."""
    kept = _apart(one.time, np.concatenate((jumps, plain.knots)))
    unlike = (one.sticking != other.sticking) & (one.actuation_force > 0.0) & kept[:, None]
    if np.any(unlike):
        k, j = (int(part[0]) for part in np.nonzero(unlike))
        text = f"{plain.contacts[j].name} sticks in one only at {float(one.time[k]):.9g} s"
        yield Fault(f"{kind} sticks", text)


def events_of(response: Any) -> tuple[list[Event], list[bool]]:
    """Sticks, slips and reversals of a response, and which contacts are at rest at first."""
    kinds = {STICK: "stick", SLIP: "slip", REVERSAL: "reversal"}
    events = [
        Event(float(t), int(j), kinds[int(k)], 0)
        for t, j, k in zip(
            *(response[f"event_{name}"].values for name in ("time", "contact", "kind")), strict=True
        )
        if int(k) in kinds
    ]
    return events, list(response["sticking"].values[1])


def different_slides(
    run: Run, events: Sequence[Event], rests: Sequence[bool], times: Array, room: float
) -> Iterator[Fault]:
    """Spans of sliding whose ends differ, without those of a speed that is rounding.

    Spans that touch count as one: a reversal is a stick of no duration.
    """
    size = speed_scale(run.machine.plain, seen_by_reference(run, times))
    own = [side == 0 for side in run.cells[0].mode.side]
    for j, contact in enumerate(run.machine.plain.contacts):
        ours, theirs = (
            _slides([e for e in one if e.contact == j], bool(rest[j]), run, j, 1e-9 * size, room)
            for one, rest in ((run.events, own), (events, rests))
        )
        text = f"{contact.name}: slides {ours}, found {theirs}"
        same = len(ours) == len(theirs)
        if same and ours:
            same = bool(np.max(np.abs(np.array(ours) - np.array(theirs))) <= room)
        if not same:
            yield Fault("reference slides", text[:300])


def _slides(
    events: Sequence[Event], rest: bool, run: Run, contact: int, slow: float, room: float
) -> list[tuple[float, float]]:
    """Of a contact that is at first at ``rest``, unless its first event says otherwise."""
    found: list[tuple[float, float]] = []
    if events:
        rest = events[0].kind == "slip"
    start = math.nan if rest else 0.0
    for event in [*events, Event(run.duration, contact, "stick", 0)]:
        if event.kind == "slip":
            start = event.time
        if event.kind == "stick" and not math.isnan(start):
            times = np.linspace(start, event.time, 11)[1:-1]
            speed = np.abs(run.at(times, dependent=False)["sliding_velocity"][:, contact])
            if event.time - start > room and np.max(speed) > slow:
                if found and start - found[-1][1] <= room:
                    start = found.pop()[0]
                found.append((start, event.time))
            start = math.nan
    return found


def _all_times(*responses: Any) -> Array:
    return np.concatenate([one["event_time"].values for one in responses])


def twin_faults(case: Case, plain: Plain, response: Any) -> Iterator[Fault]:
    """The same machine with its parts in another order, and in other units of mass."""
    times = response["time"].values
    turned = {kind: list(reversed(parts)) for kind, parts in case.tables.items()}
    twins = [("order", turned, 1.0, 1e-7)]
    twins += [(f"units {f:g}", with_units(case.tables, 1.0, f), f, 1e-7) for f in (2.0, 3.0)]
    seen = seen_by_package(response)
    for kind, tables, factor, room in twins:
        machine = machine_plain.machine(tables)
        other = wb.simulate(machine, case.duration, times=times, max_events=5000)
        if other.attrs["status"] != "completed":
            yield Fault(kind, f"{other.attrs['status']} at {other.attrs['final_time']!r} s")
            continue
        jumps = _all_times(response, other)
        if kind == "order":
            turn = slice(None, None, -1)
            other = other.isel(inertia=turn, contact=turn)
        back = seen_by_package(other)
        back = back._replace(
            actuation_force=back.actuation_force / factor, brake_torque=back.brake_torque / factor
        )
        apart = list(differences(kind, plain, seen, back, jumps, room))
        yield from apart or different_sticks(kind, plain, seen, back, jumps)


def reference_faults(case: Case, plain: Plain, response: Any) -> Iterator[Fault]:
    """Against the reference; what it breaks itself is reported as "reference's own".

    Where a load is equal to its limit, the time at which a slip begins may be a root of rounding.
    The motion must then be that of the reference with one of two ties, or as near to both as they
    are to each other, if that is near.
    """
    runs, fault = [], Fault("", "")
    for tie in (_TIE, 0.0):
        try:
            runs.append(simulate(plain, case.duration, tie=tie))
        except LockingError as problem:
            fault = Fault("reference locks", str(problem))
        except (RuntimeError, ValueError, np.linalg.LinAlgError) as problem:
            fault = Fault("reference has no answer", str(problem)[:100])
    if not runs:
        yield fault
        return
    times = response["time"].values
    ours, jumps = seen_by_package(response), np.concatenate([
        response["event_time"].values, *([event.time for event in run.events] for run in runs)
    ])  # fmt: skip
    both = [seen_by_reference(run, times) for run in runs]
    room, near = 1e-7, _NEAR_TIES
    if not list(differences("ties", plain, both[0], both[-1], jumps, near)):
        while list(differences("ties", plain, both[0], both[-1], jumps, room)):
            room *= 2.0
    # Roots of the tie are admitted where it shows in the reference, or leaves it without an answer.
    rests = [side == 0 for side in runs[-1].cells[0].mode.side]
    shows = any(different_slides(runs[0], runs[-1].events, rests, times, _INSTANT))
    late = _ROOT if shows or len(runs) == 1 else _INSTANT
    found: list[Fault] = []
    for run, theirs in zip(runs, both, strict=True):
        found = list(differences("reference", plain, theirs, ours, jumps, room))
        found = found or list(different_slides(run, *events_of(response), times, late))
        if not found:
            return
    kept = _apart(times, jumps)
    own = Seen(*(getattr(both[0], name)[kept] for name in Seen._fields))
    broken = sorted({fault.kind for fault in conditions(plain, own, exact=False)})
    if broken:
        found = [Fault(f"{f.kind} (it breaks {', '.join(broken)})", f.text) for f in found]
    yield from found


def _locks_at(plain: Plain, duration: float) -> float:
    """When a contact that slides locks itself by the reference, as its force begins to press it."""
    try:
        simulate(plain, duration, tie=_TIE)
    except LockingError as problem:
        return float(problem.args[1])
    except (RuntimeError, ValueError, np.linalg.LinAlgError):
        pass
    return math.inf


def rest_faults(case: Case, plain: Plain, response: Any) -> Iterator[Fault]:
    """Rest that is proved is for good: no contact slips, and none slides."""
    found = wb.simulate(case.machine(), case.duration, until="rest", times=(), max_events=5000)
    if found.attrs["status"] != "completed":
        yield Fault("rest", f"{found.attrs['status']} at {found.attrs['final_time']!r} s")
    elif found.attrs["at_rest"]:
        end = found.attrs["final_time"]
        kinds, times = response["event_kind"].values, response["event_time"].values
        slips = (kinds == SLIP) & (times > end + _SAME_INSTANT)
        late = response["time"].values > end + _SAME_INSTANT
        if np.any(slips) or not np.all(response["sticking"].values[late]):
            yield Fault("rest", f"proved at {end!r} s, but contacts slide later")


def faults(
    case: Case, *, twins: bool = True, reference: bool = True, exact: bool = True,
    rest: bool = True, seconds: float = 0.0,
) -> list[Fault]:  # fmt: skip
    """All that is wrong with the solver's motion of a case.

    exact   : see ``conditions``
    seconds : the longest time of each comparison (only in a main thread); 0: unlimited
    """
    plain = case.plain()
    try:
        with at_most(seconds):
            response = run_case(case)
    except TimeoutError as problem:
        return [Fault("run", str(problem))]
    if response.attrs["status"] == "no_forward_solution" and reference:
        end = _locks_at(plain, case.duration)
        if abs(response.attrs["final_time"] - end) <= 1e-7:
            case = case._replace(duration=(1.0 - 1e-6) * end)
            response = run_case(case)
    if response.attrs["status"] != "completed":
        text = f"{response.attrs['status']} at {response.attrs['final_time']!r} s"
        return [Fault("run", text)]
    found = list(conditions(plain, seen_by_package(response), exact))
    found += energy_fault(response, plain)
    found += event_faults(case, plain, response)
    checks = ((twins, twin_faults), (reference, reference_faults), (rest, rest_faults))
    for wanted, check in checks:
        if wanted:
            try:
                with at_most(seconds):
                    found += check(case, plain, response)
            except TimeoutError as problem:
                found.append(Fault(check.__name__.split("_")[0] + " has no answer", str(problem)))
    return found


def main() -> int:
    parser = argparse.ArgumentParser(description="Seeds of a family that fail, and why.")
    parser.add_argument("family", choices=[*FAMILIES, "all"])
    parser.add_argument("first", type=int)
    parser.add_argument("last", type=int, help="the seed after the last one")
    parser.add_argument("--no-reference", action="store_true")
    parser.add_argument("--no-twins", action="store_true")
    parser.add_argument("--rounding", action="store_true", help="a stick may move by rounding")
    parser.add_argument("--seconds", type=float, default=10.0, help="longest time of a comparison")
    parser.add_argument("--rest", action="store_true", help="with runs until rest")
    parser.add_argument("--brief", action="store_true", help="the sums alone")
    given = parser.parse_args()
    run_case(round_case("limit", 0))  # what is compiled or loaded at the first time
    families = list(FAMILIES) if given.family == "all" else [given.family]
    bad = 0
    for family in families:
        kinds: Counter[str] = Counter()
        failed, begun = 0, time.perf_counter()
        for seed in range(given.first, given.last):
            found = faults(
                round_case(family, seed), twins=not given.no_twins,
                reference=not given.no_reference, exact=not given.rounding,
                rest=given.rest, seconds=given.seconds,
            )  # fmt: skip
            wrong = [one for one in found if "no answer" not in one.kind or one.kind == "run"]
            failed += bool(wrong)
            kinds.update({one.kind for one in found})
            if not given.brief:
                for one in found:
                    print(f"{family} {seed}: {one.kind}: {one.text}", flush=True)
        spent = time.perf_counter() - begun
        sums = ", ".join(f"{kind} {count}" for kind, count in kinds.most_common())
        count = given.last - given.first
        print(f"{family}: {failed} of {count} fail in {spent:.1f} s: {sums}", flush=True)
        bad += failed
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
