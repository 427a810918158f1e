"""Machines as plain tables, and as data for ``machine_reference``.

A table has the field names of the package's classes: {"inertias": [...], "shafts": [...],
"contacts": [...], "torques": [...]}, a signal is a number or {"kind": ...}. Signals, gains and
matrices are computed here from these numbers alone.

    table(machine)    tables of a ``wb.Machine``, from its public attributes
    plain(machine)    a ``wb.Machine`` or its tables as a ``Plain``
    machine(tables)   tables as a ``wb.Machine``
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import quad

import wedgebrake as wb
from machine_reference import Contact, Plain, shaft_matrices

Array = NDArray[np.float64]
Function = Callable[[Array], Array]
Tables = dict[str, Any]

_FIELDS = {
    "constant": ("value",),
    "harmonic": ("amplitude", "frequency", "phase"),
    "table": ("times", "values", "periodic", "after"),
    "ramp": ("start", "end", "duration", "begin"),
    "orders": ("speed", "orders"),
    "sum": ("signals",),
    "product": ("signals",),
    "harmonic_torque": ("amplitude", "frequency", "orders"),
}


# Signals.


def signal_table(signal: Any) -> Any:
    """A number or ``wb.Signal`` as plain data."""
    if isinstance(signal, int | float | dict):
        return signal
    found: Tables = {"kind": signal.kind}
    for name in _FIELDS[signal.kind]:
        value = getattr(signal, name)
        if name == "signals":
            value = [signal_table(one) for one in value]
        elif name == "speed":
            value = signal_table(value)
        found[name] = value
    return found


def as_signal(data: Any) -> Any:
    """Plain data as a ``wb.Signal``; numbers stay numbers."""
    if isinstance(data, int | float):
        return data
    values = {name: value for name, value in data.items() if name != "kind"}
    if "speed" in values:
        values["speed"] = as_signal(values["speed"])
    if "signals" in values:
        values["signals"] = tuple(as_signal(one) for one in values["signals"])
    classes = {
        "constant": "Constant", "harmonic": "Harmonic", "table": "Table", "ramp": "Ramp",
        "orders": "Orders", "sum": "Sum", "product": "Product",
        "harmonic_torque": "HarmonicTorque",
    }  # fmt: skip
    kind: Any = getattr(wb, classes[data["kind"]], None)
    if kind is None:
        from wedgebrake.model.signals import signals

        kind = getattr(signals, classes[data["kind"]])
    return kind(**values)


def _points(data: Tables) -> tuple[Array, Array]:
    """Times and values of a table or ramp."""
    if data["kind"] == "ramp":
        begin = data.get("begin", 0.0)
        times, values = (begin, begin + data["duration"]), (data["start"], data["end"])
    else:
        times, values = data["times"], data["values"]
    return np.asarray(times, dtype=float), np.asarray(values, dtype=float)


def value(data: Any) -> Function:
    """A signal as a function of an array of times; after a jump at its time."""
    if isinstance(data, int | float):
        number = float(data)
        return lambda t: np.full(np.shape(t), number)
    kind = data["kind"]
    if kind == "constant":
        return value(data["value"])
    if kind == "harmonic":
        size, rate = data["amplitude"], 2.0 * math.pi * data["frequency"]
        phase = data.get("phase", 0.0)
        return lambda t: size * np.sin(rate * np.asarray(t) + phase)
    if kind == "harmonic_torque":
        return value({"kind": "sum", "signals": _orders_of_torque(data)})
    if kind in ("table", "ramp"):
        return _table_value(data)
    if kind == "orders":
        angle, orders = integral(data["speed"]), data["orders"]
        return lambda t: sum(a * np.sin(n * angle(t) + phase) for n, a, phase in orders)
    parts = [value(one) for one in data["signals"]]
    if kind == "sum":
        return lambda t: np.sum([one(t) for one in parts], axis=0)
    return lambda t: np.prod([one(t) for one in parts], axis=0)


def _orders_of_torque(data: Tables) -> list[Tables]:
    size, frequency = data["amplitude"], data["frequency"]
    terms = [(1.0, 1.0, 0.0), *data.get("orders", ())]
    return [
        {"kind": "harmonic", "amplitude": size * r, "frequency": n * frequency, "phase": phase}
        for n, r, phase in terms
    ]


def _local(data: Tables, times: Array) -> Callable[[Array], Array]:
    """Times within a period of a table that repeats."""
    if not data.get("periodic", False):
        return lambda t: np.asarray(t, dtype=float)
    first, length = times[0], times[-1] - times[0]
    return lambda t: first + np.mod(np.asarray(t, dtype=float) - first, length)


def _table_value(data: Tables) -> Function:
    times, values = _points(data)
    local, after = _local(data, times), data.get("after", "hold")
    outside = after == "zero" and not data.get("periodic", False)

    def found(t: Array) -> Array:
        t = local(t)
        at = np.clip(np.searchsorted(times, t, side="right") - 1, 0, times.size - 2)
        width = times[at + 1] - times[at]
        share = np.clip((t - times[at]) / np.where(width > 0.0, width, 1.0), 0.0, 1.0)
        y = values[at] + share * (values[at + 1] - values[at])
        y = np.where(t >= times[-1], values[-1], y)
        return np.where((t < times[0]) | (t >= times[-1]), 0.0, y) if outside else y

    return found


def rate(data: Any) -> Function:
    """The derivative of a signal between its knots."""
    zero = lambda t: np.zeros(np.shape(t))  # noqa: E731
    if isinstance(data, int | float) or data["kind"] == "constant":
        return zero
    kind = data["kind"]
    if kind == "harmonic":
        ahead = {**data, "phase": data.get("phase", 0.0) + 0.5 * math.pi}
        factor, turned = 2.0 * math.pi * data["frequency"], value(ahead)
        return lambda t: factor * turned(t)
    if kind in ("table", "ramp"):
        times, values = _points(data)
        local, repeats = _local(data, times), data.get("periodic", False)

        def found(t: Array) -> Array:
            t = local(t)
            at = np.clip(np.searchsorted(times, t, side="right") - 1, 0, times.size - 2)
            width = times[at + 1] - times[at]
            slope = (values[at + 1] - values[at]) / np.where(width > 0.0, width, math.inf)
            inside = (t >= times[0]) & (t < times[-1])
            return slope if repeats else np.where(inside, slope, 0.0)

        return found
    parts = [value(one) for one in data["signals"]]
    rates = [rate(one) for one in data["signals"]]
    if kind == "sum":
        return lambda t: np.sum([one(t) for one in rates], axis=0)
    assert kind == "product", kind

    def of_product(t: Array) -> Array:
        total = np.zeros(np.shape(t))
        for i, change in enumerate(rates):
            rest = [one(t) for k, one in enumerate(parts) if k != i]
            total = total + change(t) * np.prod(rest, axis=0)
        return total

    return of_product


def integral(data: Any) -> Function:
    """The integral of a signal from time 0."""
    if isinstance(data, int | float):
        return lambda t: float(data) * np.asarray(t, dtype=float)
    kind = data["kind"]
    if kind == "constant":
        return integral(data["value"])
    if kind == "harmonic":
        w, phase = 2.0 * math.pi * data["frequency"], data.get("phase", 0.0)
        size = data["amplitude"] / w
        return lambda t: size * (math.cos(phase) - np.cos(w * np.asarray(t) + phase))
    if kind == "sum":
        parts = [integral(one) for one in data["signals"]]
        return lambda t: np.sum([one(t) for one in parts], axis=0)
    if kind in ("table", "ramp") and not data.get("periodic", False):
        return _table_integral(data)
    function, bends = value(data), np.array(list(_knots(data, 0.0, 1e3)))

    def summed(t: Array) -> Array:
        def one(end: float) -> float:
            ends = [0.0, *bends[(bends > 0.0) & (bends < end)], end]
            return sum(
                quad(lambda s: float(function(np.array(s))), a, b, epsabs=0, epsrel=1e-14)[0]
                for a, b in pairwise(ends)
            )

        return np.vectorize(one, otypes=[float])(t)

    return summed


def _table_integral(data: Tables) -> Function:
    """Parabolas between the points."""
    times, values = _points(data)
    steps = 0.5 * np.diff(times) * (values[1:] + values[:-1])
    areas = np.concatenate(([0.0], np.cumsum(steps)))
    zero = data.get("after", "hold") == "zero"
    first, last = (0.0, 0.0) if zero else (values[0], values[-1])

    def primitive(t: Array) -> Array:
        t = np.asarray(t, dtype=float)
        at = np.clip(np.searchsorted(times, t, side="right") - 1, 0, times.size - 2)
        s = np.clip(t - times[at], 0.0, times[at + 1] - times[at])
        width = np.where(times[at + 1] > times[at], times[at + 1] - times[at], 1.0)
        slope = (values[at + 1] - values[at]) / width
        inside = areas[at] + s * (values[at] + 0.5 * slope * s)
        before, beyond = np.minimum(t - times[0], 0.0), np.maximum(t - times[-1], 0.0)
        return inside + first * before + last * beyond

    start = float(primitive(np.array(0.0)))
    return lambda t: primitive(t) - start


def _knots(data: Any, first: float, last: float) -> Iterator[float]:
    """Times of kinks and jumps of a signal."""
    if isinstance(data, int | float):
        return
    kind = data["kind"]
    if kind in ("table", "ramp"):
        times = _points(data)[0]
        if not data.get("periodic", False):
            yield from (float(t) for t in times if first < t < last)
            return
        length = times[-1] - times[0]
        for n in range(math.floor((first - times[0]) / length), math.ceil(last / length) + 2):
            yield from (float(t + n * length) for t in times if first < t + n * length < last)
    for one in (data.get("speed", 0.0), *data.get("signals", ())):
        yield from _knots(one, first, last)


# Parts.


def gain(brake: Tables, m: float) -> float:
    """g(m) of docs/equations.md, "Amplification"; inf where the brake locks itself."""
    kind = brake["kind"]
    if kind == "conventional":
        return m
    if kind == "band":
        return math.expm1(m * brake["wrap_angle"])
    if kind == "wedge":
        top, gap = m, math.tan(brake["angle"]) - m
    else:
        assert kind == "leading-shoe", kind
        top = m * brake["actuation_arm"]
        gap = brake["normal_arm"] - m * brake["friction_arm"]
    return top / gap if gap > 0.0 else math.inf


def table(given: Any) -> Tables:
    """The tables of a ``wb.Machine``; tables stay as they are."""
    if isinstance(given, dict):
        return given
    found: Tables = {
        "inertias": [
            {"name": i.name, "inertia": i.inertia, "angle": i.angle, "speed": i.speed}
            for i in given.inertias
        ],
        "shafts": [
            {name: getattr(s, name) for name in ("a", "b", "stiffness", "damping", "ratio", "name")}
            for s in given.shafts
        ],
        "torques": [
            {"on": t.on, "signal": signal_table(t.signal), "name": t.name} for t in given.torques
        ],
        "contacts": [],
    }
    for c in given.contacts:
        found["contacts"].append(
            {
                "a": c.a, "b": c.b, "name": c.name,
                "base_speed": signal_table(c.base_speed),
                "brake": _part(c.brake), "friction": _part(c.friction),
                "actuation": {
                    name: getattr(c.actuation, name)
                    for name in type(c.actuation).model_fields if name != "initial_force"
                } | {"initial_force": signal_table(c.actuation.initial_force)},
            }
        )  # fmt: skip
    return found


def _part(part: Any) -> Tables:
    values = {name: getattr(part, name) for name in type(part).model_fields}
    return {"kind": part.kind, **values}


def _contact(data: Tables, index: Callable[[str], int]) -> Contact:
    brake, friction, actuation = data["brake"], data["friction"], data["actuation"]
    force = signal_table(actuation["initial_force"])
    limits = actuation.get("limits")
    static = friction.get("static")
    pair = lambda mu: (gain(brake, -mu), gain(brake, mu))  # noqa: E731
    curve: Any = None
    rows: tuple[tuple[float, float, float], ...] = ()
    if friction["kind"] == "coulomb":
        kinetic = friction["kinetic"]
    elif friction["kind"] == "tabulated":
        kinetic = friction["coefficients"][0]
        rows = _rows(brake, friction, actuation)
    else:
        assert friction["kind"] == "stribeck", friction
        kinetic = static
        curve = _stribeck(brake, friction)
    static = kinetic if static is None else static
    base = data.get("base_speed", 0.0)
    moves = base != 0.0
    return Contact(
        name=data["name"], a=index(data["a"]), b=index(data.get("b", "ground")),
        radius=brake["radius"], kinetic=pair(kinetic), static=pair(static), force=value(force),
        slope=actuation.get("slope", 0.0), release=actuation.get("release", True),
        base=value(base) if moves else None, base_rate=rate(base) if moves else None,
        table=rows, curve=curve, lag=actuation.get("lag", 0.0),
        frequency=actuation.get("frequency"), damping_ratio=actuation.get("damping_ratio"),
        limits=(-math.inf, math.inf) if limits is None else tuple(limits),
        sample_time=actuation.get("sample_time"), delay=actuation.get("delay", 0),
        resolution=actuation.get("resolution"), ratio=data.get("ratio", 1.0),
    )  # fmt: skip


def _rows(brake: Tables, friction: Tables, actuation: Tables) -> tuple:
    """Speeds [rad/s] of the table and those at which the force meets a bound, with gains."""
    speeds = [v / brake["radius"] for v in friction["speeds"]]
    slope, force = actuation.get("slope", 0.0), actuation["initial_force"]
    if not isinstance(force, int | float):
        force = float(value(force)(np.zeros(1))[0])
    bounds = [0.0] if actuation.get("release", True) else []
    bounds += list(actuation.get("limits") or ())
    if slope:
        speeds += [s for bound in bounds if (s := (bound - force) / slope) > 0.0]
    speeds = sorted(set(speeds))
    known = [v / brake["radius"] for v in friction["speeds"]]
    return tuple(
        (s, gain(brake, -m), gain(brake, m))
        for s in speeds
        for m in (float(np.interp(s, known, friction["coefficients"])),)
    )


def _stribeck(brake: Tables, friction: Tables) -> Callable[[int, Array], Array]:
    kinetic, peak = friction["kinetic"], friction["static"] - friction["kinetic"]
    decay = brake["radius"] / friction["speed"]

    def curve(side: int, v: Array) -> Array:
        return gains(brake, side * (kinetic + peak * np.exp(-decay * v)))

    return curve


def gains(brake: Tables, m: Array) -> Array:
    """``gain`` of many coefficients."""
    return np.array([gain(brake, float(one)) for one in np.ravel(m)]).reshape(np.shape(m))


def plain(given: Any, duration: float = 1e2) -> Plain:
    """A ``wb.Machine`` or its tables for the reference; ``duration`` bounds the knots."""
    data = table(given)
    names = [one["name"] for one in data["inertias"]]

    def index(name: str) -> int:
        return -1 if name == "ground" else names.index(name)

    shafts = [
        (index(s["a"]), index(s["b"]), s["stiffness"], s.get("damping", 0.0), s.get("ratio", 1.0))
        for s in data.get("shafts", ())
    ]
    stiffness, damping = shaft_matrices(len(names), shafts)
    signals = [one["signal"] for one in data.get("torques", ())]
    for contact in data.get("contacts", ()):
        signals += [contact["actuation"]["initial_force"], contact.get("base_speed", 0.0)]
    knots = sorted({t for one in signals for t in _knots(signal_table(one), 0.0, duration)})
    column = lambda key: np.array([float(i.get(key, 0.0)) for i in data["inertias"]])  # noqa: E731
    return Plain(
        tuple(names), column("inertia"), stiffness, damping, column("angle"), column("speed"),
        tuple(_contact(one, index) for one in data.get("contacts", ())),
        tuple((index(t["on"]), value(signal_table(t["signal"]))) for t in data.get("torques", ())),
        tuple(knots),
        _joints(data.get("joints", ()), names),
    )  # fmt: skip


def _joints(joints: Any, names: list[str]) -> Array | None:
    """Factors of the speeds in each joint, (joints, inertia); None without joints."""
    rows = np.zeros((len(joints), len(names)))
    for row, one in zip(rows, joints, strict=True):
        for name, factor in joint_factors(one).items():
            row[names.index(name)] = factor
    return rows if len(rows) else None


def joint_factors(joint: Tables) -> dict[str, float]:
    """Factors of the speeds in a joint."""
    if joint["kind"] == "planetary":
        z = joint["ratio"]
        return {joint["sun"]: 1.0, joint["ring"]: z, joint["carrier"]: -1.0 - z}
    return {joint["a"]: 1.0, joint["b"]: -joint.get("ratio", 1.0)}


def machine(data: Tables) -> Any:
    """Tables as a ``wb.Machine``."""
    brakes = {
        "wedge": wb.WedgeBrake, "conventional": wb.ConventionalBrake, "band": wb.BandBrake,
        "leading-shoe": wb.LeadingShoeBrake,
    }  # fmt: skip
    laws = {"coulomb": wb.CoulombFriction, "tabulated": wb.TabulatedFriction}

    def without_kind(part: Tables) -> Tables:
        return {name: value for name, value in part.items() if name != "kind"}

    package: Any = wb
    contacts = []
    for one in data["contacts"]:
        friction = one["friction"]
        law = laws.get(friction["kind"]) or package.StribeckFriction
        force = {"initial_force": as_signal(one["actuation"]["initial_force"])}
        contacts.append(
            package.Contact(
                one["a"], one["b"], name=one["name"],
                brake=brakes[one["brake"]["kind"]](**without_kind(one["brake"])),
                friction=law(**without_kind(friction)),
                actuation=wb.Actuation(**{**one["actuation"], **force}),
                base_speed=as_signal(one.get("base_speed", 0.0)),
                **{name: one[name] for name in ("ratio",) if name in one},
            )
        )  # fmt: skip
    return package.Machine(
        inertias=[package.Inertia(**one) for one in data["inertias"]],
        shafts=[package.Shaft(**one) for one in data["shafts"]],
        contacts=contacts,
        torques=[
            package.Torque(t["on"], as_signal(t["signal"]), name=t["name"]) for t in data["torques"]
        ],
        joints=[
            {"gear": package.Gear, "planetary": package.Planetary, "rigid": package.Rigid}[
                one["kind"]
            ](**without_kind(one))
            for one in data.get("joints", ())
        ],
    )
