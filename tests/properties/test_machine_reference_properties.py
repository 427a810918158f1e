"""The reference for machines on random machines: laws of mechanics, and today's exact solver."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

import machine_plain
import wedgebrake as wb
from machine_cases import SEEDS, Case, compare_events, random_case
from machine_reference import Run, simulate

_STEP = 13  # every 13th of the cases: all take minutes


@pytest.fixture(scope="module", params=SEEDS[::_STEP])
def found(request: pytest.FixtureRequest) -> tuple[Case, Run]:
    case = random_case(request.param)
    return case, case.reference()


def test_tables_of_machines_round_trip(found: tuple[Case, Run]) -> None:
    """The same numbers from tables and from the package's machine; signals have equal values."""
    if not hasattr(wb, "Machine"):
        pytest.skip("this version has no machines")
    case, _ = found
    machine = case.machine()
    plain, other = case.plain(), machine_plain.plain(machine, case.duration)
    assert plain.knots == other.knots
    np.testing.assert_array_equal(plain.stiffness, other.stiffness)
    np.testing.assert_array_equal(plain.damping, other.damping)
    times = np.linspace(0.0, case.duration, 500)[:-1] + 1e-7
    for (_, function), torque in zip(plain.torques, machine.torques, strict=True):
        values = function(times)
        room = 1e-12 * np.max(np.abs(values))
        np.testing.assert_allclose(torque.signal(times), values, rtol=0, atol=room)
    for contact, same in zip(plain.contacts, other.contacts, strict=True):
        for name in ("kinetic", "static", "table", "limits", "slope", "lag", "bounds"):
            assert getattr(contact, name) == getattr(same, name)


def single(seed: int) -> wb.BrakedDriveline:
    """A random braked driveline whose groups are of order one, mostly one that sticks."""
    rng = np.random.default_rng([7, seed])
    inertia, natural = math.exp(rng.uniform(-1.5, 1.5)), math.exp(rng.uniform(2.0, 4.5))
    kinetic = rng.uniform(0.1, 0.4)
    static = kinetic * float(rng.choice([1.0, 1.15, 1.3]))
    tangent = static * rng.uniform(1.15, 3.0)
    arm = 0.1 * rng.uniform(0.2, 0.85) / static
    brakes = (
        wb.WedgeBrake(angle=math.atan(tangent), radius=0.2), wb.ConventionalBrake(radius=0.2),
        wb.BandBrake(wrap_angle=3.0, radius=0.2),
        wb.LeadingShoeBrake(actuation_arm=0.2, normal_arm=0.1, friction_arm=arm, radius=0.2),
    )  # fmt: skip
    brake = brakes[seed % 4]
    torque = math.exp(rng.uniform(2.0, 5.0))
    gain = 0.5 * (brake.amplification(kinetic) - brake.amplification(-kinetic))
    force = torque * rng.uniform(0.05, 0.7) / (brake.radius * gain)
    reach = torque / (inertia * natural)
    friction: Any = wb.CoulombFriction(kinetic=kinetic, static=static)
    if rng.random() < 0.3:
        speeds = (0.0, 0.1 * reach, 0.25 * reach)
        friction = wb.TabulatedFriction(
            speeds=speeds, coefficients=(kinetic, 0.7 * kinetic, 0.9 * kinetic), static=static
        )
    factor = float(rng.choice([0.0, rng.uniform(-0.5, 0.4)]))
    return wb.BrakedDriveline(
        driveline=wb.Driveline(
            inertia=inertia, damping=2.0 * rng.uniform(0.02, 0.3) * inertia * natural,
            stiffness=inertia * natural**2,
            drive_speed=float(rng.choice([0.0, rng.uniform(-1.0, 1.0) * reach])),
        ),
        brake=brake, friction=friction,
        actuation=wb.Actuation(
            initial_force=force, slope=factor * force / reach
        ),
        excitation=wb.HarmonicTorque(
            amplitude=torque, frequency=natural / (2.0 * math.pi) * rng.uniform(0.3, 1.8)
        ),
    )  # fmt: skip


def as_tables(system: wb.BrakedDriveline) -> machine_plain.Tables:
    """One inertia with a shaft to the ground, on whose brake the base turns."""
    parts = system.as_dict()
    line, torque = parts["driveline"], parts["excitation"]
    shaft = {"a": "line", "b": "ground", "name": "shaft"}
    shaft |= {"stiffness": line["stiffness"], "damping": line["damping"]}
    contact = {"a": "line", "b": "ground", "name": "brake", "base_speed": -line["drive_speed"]}
    contact |= {key: parts[key] for key in ("brake", "friction", "actuation")}
    wave = {"kind": "harmonic", "phase": 0.0}
    wave |= {key: torque[key] for key in ("amplitude", "frequency")}
    return {
        "inertias": [{"name": "line", "inertia": line["inertia"]}],
        "shafts": [shaft],
        "contacts": [contact],
        "torques": [{"on": "line", "signal": wave, "name": "torque"}],
    }


@pytest.mark.parametrize("seed", range(24))
def test_one_brake_is_todays_exact_solution(seed: int) -> None:
    system = single(seed)
    response = wb.simulate(system, periods=6)
    time = response["time"].values
    run = simulate(machine_plain.plain(as_tables(system)), float(time[-1]))
    kinds = response["event_kind"].values.astype(int)
    contacts = np.zeros(kinds.size, dtype=int)
    found = response["event_time"].values, contacts, kinds
    assert compare_events(run, *found, breakpoints=True) < 1e-12
    seen = run.at(time)
    for name in ("angle", "velocity"):
        scale = np.max(np.abs(seen[name]))
        np.testing.assert_allclose(response[name], seen[name][:, 0], rtol=0, atol=1e-11 * scale)
