"""Random machines with all parts: their responses are solutions of the equations.

See ``verified``: the sides of contacts and lines of laws that a response shows are put into the
equations, which another integrator solves; nothing of the solver's search is used.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import wedgebrake as wb
from machines import contact
from verified import error_of

MANY, PACK = 1500, 50
DURATION = 6.0


class _Draw:
    """Random values, with odd numbers in round ones."""

    def __init__(self, seed: int) -> None:
        self.random = np.random.default_rng(seed)
        self.digits = 1 if seed % 2 else 15

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
        torques.append(wb.Torque(names[-1], curve, name="curve"))
    if draw.chance(0.3):
        detent = wb.OverAngle((0.0, 0.1, 0.3), (0.0, draw(0.5, 3.0), 0.0), period=0.4)
        torques.append(wb.Torque(names[-1], detent, name="detent"))
    return wb.Machine(inertias=bodies, shafts=shafts, contacts=contacts, torques=torques)


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


def check(seed: int) -> None:
    assert error_of(random_machine(seed), DURATION) < 1e-9, seed


@pytest.mark.parametrize("seed", range(6))
def test_random_machines(seed: int) -> None:
    check(seed)


@pytest.mark.slow
@pytest.mark.parametrize("first", range(0, MANY, PACK))
def test_many_random_machines(first: int) -> None:
    for seed in range(first, first + PACK):
        check(seed)


@pytest.mark.parametrize("seed", range(4))
def test_drag_too(seed: int) -> None:
    """With a curve over the speed."""
    machine = random_machine(100 + seed)
    drag = wb.Drag(machine.inertias[0].name, 0.1 * (seed % 3), 0.05 * (1 + seed % 2), name="air")
    given = machine.replace(contacts=[*machine.contacts, drag])
    assert error_of(given, DURATION, method="smooth") < 1e-9


@pytest.mark.parametrize("seed", range(4))
def test_equations_of_another_machine(seed: int) -> None:
    """A response does not solve equations in which a damping differs by a millionth."""
    machine = random_machine(seed)
    first = machine.shafts[0]
    name = f"{first.name}.damping"
    other = machine.replace({name: first.damping + 1e-6})
    try:
        error = error_of(machine, DURATION, equations=other)
    except AssertionError:
        return
    assert error > 1e-9
