"""Random systems to be judged, and systems as tables of plain values."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import numpy as np

import wedgebrake as wb
from wedgebrake.model.friction import Friction

SEED = 20140
NUMBER = 200
_ARM = 0.1  # normal arm of the leading shoe [m]


def random_systems() -> Iterator[tuple[str, wb.BrakedDriveline, tuple[float, float]]]:
    """(name, system, initial state), always the same ones."""
    for number in range(NUMBER):
        rng = np.random.default_rng([SEED, number])
        system = _system(rng)
        yield f"random {number}", system, _initial(rng, system)


def _log(rng: np.random.Generator, low: float, high: float) -> float:
    return float(np.exp(rng.uniform(math.log(low), math.log(high))))


def _system(rng: np.random.Generator) -> wb.BrakedDriveline:
    kinetic, ratio = 0.3, float(rng.choice([1.0, 1.0, 1.1, 1.3]))
    kind = str(rng.choice(["wedge", "conventional", "band", "shoe"], p=[0.5, 0.34, 0.08, 0.08]))
    alpha = float(rng.uniform(0.8, 1.05)) if rng.random() < 0.15 else _log(rng, 1.05, 3.0)
    brakes: dict[str, wb.Brake] = {
        "wedge": wb.WedgeBrake(radius=0.2, angle=math.atan(alpha * kinetic)),
        "conventional": wb.ConventionalBrake(radius=0.2),
        "band": wb.BandBrake(radius=0.2, wrap_angle=float(rng.uniform(2.0, 6.0))),
        "shoe": wb.LeadingShoeBrake(
            radius=0.2, actuation_arm=0.2, normal_arm=_ARM, friction_arm=_ARM / (alpha * kinetic)
        ),
    }
    friction: wb.CoulombFriction | wb.TabulatedFriction = wb.CoulombFriction(
        kinetic=kinetic, static=kinetic * ratio
    )
    if rng.random() < 0.08:  # falling with speed, or rising, perhaps until the brake locks
        speeds = (0.0, *np.sort(rng.uniform(0.05, 4.0, 2)).tolist())
        shares = (1.0, 0.85, 0.75) if rng.random() < 0.7 else (1.0, 1.1, 1.3)
        friction = wb.TabulatedFriction(
            speeds=speeds, coefficients=tuple(kinetic * share for share in shares)
        )
    drive = float(rng.uniform(0.2, 5.0)) if rng.random() < 0.12 else 0.0
    base = wb.BrakedDriveline(
        driveline=wb.Driveline(
            inertia=1.0, damping=_log(rng, 0.05, 2.0), stiffness=1e4, drive_speed=drive
        ),
        brake=brakes[kind],
        friction=friction,
        actuation=wb.Actuation(initial_force=300.0, release=bool(rng.random() > 0.08)),
        excitation=wb.HarmonicTorque(amplitude=500.0, frequency=10.0),
    )
    return base.replace(
        eta=float(rng.uniform(-80.0, 15.0)),
        # Half of them slower than the natural frequency, where the motion sticks most.
        f=float(rng.uniform(0.2, 2.5) if rng.random() < 0.5 else rng.uniform(0.2, 1.0)),
        F0=_log(rng, 0.005, 0.2),
    )


def _initial(rng: np.random.Generator, system: wb.BrakedDriveline) -> tuple[float, float]:
    """At rest, or somewhere on the scale of the static deflection."""
    if rng.random() < 0.5:
        return 0.0, 0.0
    deflection = system.excitation.amplitude / system.driveline.stiffness
    speed = deflection * system.driveline.natural_frequency
    return float(rng.uniform(-2, 2)) * deflection, float(rng.uniform(-2, 2)) * speed


def from_tables(tables: dict[str, dict[str, Any]]) -> wb.BrakedDriveline:
    """The system that ``as_dict`` gave, to the last bit."""
    brake, friction = dict(tables["brake"]), dict(tables["friction"])
    return wb.BrakedDriveline(
        driveline=wb.Driveline(**tables["driveline"]),
        brake=wb.Brake.kinds[brake.pop("kind")](**brake),
        friction=Friction.kinds[friction.pop("kind")](**friction),
        actuation=wb.Actuation(**tables["actuation"]),
        excitation=wb.HarmonicTorque(**tables["excitation"]),
    )
