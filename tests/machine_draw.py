"""Random machines with parts of all kinds."""

from __future__ import annotations

from typing import Any

import numpy as np

import wedgebrake as wb
from machines import contact


class _Draw:
    """Random values, with odd numbers in round ones."""

    def __init__(self, *seeds: int) -> None:
        self.random = np.random.default_rng(seeds if len(seeds) > 1 else seeds[0])
        self.digits = 1 if seeds[0] % 2 else 15

    def __call__(self, low: float, high: float) -> float:
        return round(float(self.random.uniform(low, high)), self.digits)

    def chance(self, share: float) -> bool:
        return bool(self.random.random() < share)

    def of(self, *values: Any) -> Any:
        return values[int(self.random.integers(len(values)))]


def random_machine(seed: int) -> wb.Machine:
    """A chain of one to three inertias, perhaps behind a driven body, with parts of all kinds."""
    draw = _Draw(seed)
    names = ["a", "b", "c"][: int(draw.random.integers(1, 4))]
    bodies: list[Any] = [
        wb.Inertia(one, draw(0.5, 3.0), draw(-0.3, 0.3), draw(-3.0, 3.0)) for one in names
    ]
    ends = ["ground"]
    if draw.chance(0.4):
        bodies.append(wb.Driven("drive", _speed(draw), draw(-0.2, 0.2)))
        ends = ["drive"]
    shafts = [
        _shaft(draw, one, other, f"s{one}")
        for one, other in zip(names, [*ends, *names], strict=False)
    ]
    if draw.chance(0.3):
        low = -draw(0.1, 0.6)
        stop = {"gap": (low, draw(0.1, 0.6)), "damping": draw.of(0.0, draw(0.1, 2.0))}
        shafts.append(wb.Shaft(names[-1], "ground", draw(50.0, 400.0), name="stop", **stop))
    contacts = [
        _contact(draw, names, bool(ends[0] == "drive"), f"k{i}")
        for i in range(int(draw.random.integers(1, 4)))
    ]
    torques = [wb.Torque(names[0], wb.Harmonic(draw(1.0, 8.0), draw(0.2, 1.5)), name="wave")]
    if draw.chance(0.3):
        curve = wb.OverSpeed((-4.0, draw(-1.0, 1.0), 4.0), (draw(0.0, 3.0), draw(-1.0, 1.0), -2.0))
        torques.append(wb.Torque(names[-1], curve * throttle(seed), name="curve"))
    if draw.chance(0.3):
        detent = wb.OverAngle((0.0, 0.1, 0.3), (0.0, draw(0.5, 3.0), 0.0), period=0.4)
        torques.append(wb.Torque(names[-1], detent * throttle(seed + 1), name="detent"))
    return wb.Machine(inertias=bodies, shafts=shafts, contacts=contacts, torques=torques)


def throttle(seed: int) -> Any:
    """A factor of a torque over the state, which does not change what else is drawn."""
    draw = _Draw(seed, 2)
    wave = wb.Harmonic(draw(0.3, 1.5), draw(0.2, 1.0))
    return draw.of(1.0, draw(0.2, 2.0), wave, wave + draw(0.2, 1.0))


def _speed(draw: _Draw) -> Any:
    wave = wb.Harmonic(draw(0.2, 3.0), draw(0.2, 1.0))
    return draw.of(draw(-2.0, 2.0), wave, wave + draw(-2.0, 2.0))


def _shaft(draw: _Draw, one: str, other: str, name: str) -> wb.Shaft:
    more: dict[str, Any] = {"rest": draw.of(0.0, draw(-0.2, 0.2)), "damping": draw(0.0, 1.0)}
    if other not in ("ground", "drive"):
        more["ratio"] = draw.of(1.0, draw(0.5, 2.0), -1.0)
    stiffness: Any = draw(5.0, 80.0)
    kind = draw.of("plain", "stages", "gap")
    if kind == "stages":
        first = draw(-0.4, 0.0)
        stages = (draw(10.0, 80.0), draw.of(0.0, draw(1.0, 20.0)), draw(10.0, 80.0))
        stiffness = wb.Stages((first, first + draw(0.2, 0.5)), stages)
    elif kind == "gap":
        more["gap"] = (draw.of(0.0, -draw(0.1, 0.3)), draw(0.1, 0.3))
    return wb.Shaft(one, other, stiffness, name=name, **more)


def _contact(draw: _Draw, names: list[str], driven: bool, name: str) -> Any:
    one = draw.of(*names)
    others = ["ground", *(other for other in names if other != one)]
    other = draw.of(*others, *(["drive"] if driven else []))
    kind = draw.of("contact", "contact", "contact", "clutch", "normal")
    if kind == "clutch":
        return wb.OneWayClutch(
            one, other, name, draw.of(1.0, -1.0), draw.of(0.0, draw(0.1, 0.5)), draw(1.0, 8.0)
        )
    mu = draw(0.2, 0.6)
    more: dict[str, Any] = {
        "friction": wb.CoulombFriction(kinetic=mu, static=draw.of(mu, mu, mu + draw(0.1, 0.3))),
        "force": draw(0.5, 8.0),
        "slope": draw.of(0.0, draw(-1.5, 1.0)),
    }
    if draw.chance(0.3):
        more["brake"] = wb.WedgeBrake(angle=draw(0.9, 1.3), radius=draw(0.3, 0.9))
    made = contact(one, other, name=name, **more)
    if other == "ground" and draw.chance(0.3):
        made = made.model_copy(update={"base_speed": _speed(draw)})
    if kind == "normal":
        factors = {f"{draw.of(*names)}.angle": draw(-10.0, 10.0), f"{one}.speed": draw(-0.5, 0.5)}
        made = wb.Contact(**{**dict(made), "normal": factors})
    return made


def joined_machine(seed: int) -> wb.Machine:
    """A random machine with joints, or controllers, or both; contacts may have ratios."""
    draw, machine = _Draw(seed, 1), random_machine(seed)
    kind = draw.of("joints", "controllers", "both")
    if kind != "controllers":
        machine = _with_joint(draw, machine)
    return _with_controllers(draw, machine) if kind != "joints" else machine


def _with_joint(draw: _Draw, machine: wb.Machine) -> wb.Machine:
    """With one more inertia, which a joint determines, and parts that act on it."""
    others = list(machine.inertia_names)
    free = [one for one in others if one != "drive"]
    one = draw.of(*free)
    ends = [one, "d"] if draw.chance(0.5) else ["d", one]
    joint: Any = wb.Rigid(*ends, name="joint")
    kind = draw.of("gear", "gear", "rigid", "planetary")
    if kind == "gear":
        joint = wb.Gear(*ends, draw.of(draw(1.5, 3.0), -1.0, -draw(0.3, 0.8)), name="joint")
    elif kind == "planetary" and len(others) > 1:
        ends.insert(draw.of(0, 1, 2), draw.of(*(name for name in others if name != one)))
        joint = wb.Planetary(*ends, draw.of(draw(1.5, 3.0), -draw(1.5, 3.0)), name="joint")
    parts = {kind: list(getattr(machine, kind)) for kind in ("shafts", "contacts", "torques")}
    if draw.chance(0.4):
        gap = (-draw(0.1, 0.5), draw(0.1, 0.5))
        k, c = draw(20.0, 200.0), draw.of(0.0, draw(0.1, 1.0))
        parts["shafts"].append(wb.Shaft("d", "ground", k, c, name="end", gap=gap))
    if draw.chance(0.6):
        parts["contacts"].append(_contact(draw, ["d"], False, "kd"))
    elsewhere = [name for name in free if name not in ends]
    if elsewhere and draw.chance(0.6):
        plain = dict(contact("d", draw.of(*elsewhere), name="kr", force=draw(0.5, 6.0)))
        ratio = draw.of(draw(1.5, 2.5), -draw(0.5, 1.5))
        parts["contacts"].append(wb.Contact(**{**plain, "ratio": ratio}))
    if draw.chance(0.3):
        wave = wb.Harmonic(draw(1.0, 5.0), draw(0.2, 1.5))
        parts["torques"].append(wb.Torque("d", wave, name="more"))
    bodies = [*machine.inertias, wb.Inertia("d", draw(0.3, 2.0))]
    return machine.replace(inertias=bodies, joints=[joint], **parts)


def _with_controllers(draw: _Draw, machine: wb.Machine) -> wb.Machine:
    free = [one.name for one in machine.inertias if isinstance(one, wb.Inertia)]
    brakes = [one.name for one in machine.contacts if isinstance(one, wb.Contact)]
    loops = []
    for number in range(draw.of(1, 1, 2)):
        on = draw.of(*free)
        commands = bool(brakes) and draw.chance(0.4)
        measured = {f"{on}.speed": draw.of(1.0, draw(0.3, 2.0))}
        if draw.chance(0.3):
            measured[f"{draw.of(*machine.inertia_names)}.angle"] = draw(-0.3, 0.3)
        if draw.chance(0.2):
            measured[f"{machine.shafts[0].name}.torque"] = draw(-0.01, 0.02)
        size = draw(1.0, 5.0)
        more: dict[str, Any] = {}
        if draw.chance(0.4):
            more = {"derivative": draw(0.02, 0.2), "filter_time": draw(0.1, 0.4)}
        if draw.chance(0.4):
            more |= {"sample_time": draw.of(0.1, 0.25, 0.07), "delay": draw.of(0, 0, 1, 3)}
            more["resolution"] = draw.of(None, None, 0.125, 0.1)
        loops.append(wb.Controller(
            f"loop{number}", measured, _speed(draw),
            f"{draw.of(*brakes)}.command" if commands else f"{on}.torque",
            proportional=draw(0.0, 1.5), integral=draw.of(0.0, draw(0.1, 2.0)),
            limits=draw.of(None, (-size, draw(0.3, 1.0) * size)), **more,
        ))  # fmt: skip
    return machine.replace(controllers=loops)
