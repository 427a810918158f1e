"""Machines with one inertia by closed forms: the same motion as by series."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import wedgebrake as wb
from wedgebrake.solvers.kernels import SERIES, kernel_of

# Sines, friction over the speed, a turning base, a force that follows the speed, round numbers.
SYSTEMS: dict[str, wb.BrakedDriveline] = {
    "paper": wb.paper.system(eta=-60.0, F0=0.05),
    "round": wb.BrakedDriveline(
        driveline=wb.Driveline(inertia=2.0, damping=0.5, stiffness=200.0),
        brake=wb.ConventionalBrake(radius=0.1),
        friction=wb.CoulombFriction(kinetic=0.3, static=0.4),
        actuation=wb.Actuation(initial_force=100.0),
        excitation=wb.HarmonicTorque(amplitude=10.0, frequency=1.5),
    ),
    "turning": wb.BrakedDriveline(
        driveline=wb.Driveline(inertia=1.0, damping=2.0, stiffness=1000.0, drive_speed=5.0),
        brake=wb.WedgeBrake(angle=0.6, radius=0.2),
        friction=wb.TabulatedFriction(speeds=(0.0, 0.5, 2.0), coefficients=(0.4, 0.35, 0.3)),
        actuation=wb.Actuation(initial_force=50.0, slope=-2.0),
        excitation=wb.HarmonicTorque(amplitude=40.0, frequency=4.0),
    ),
    "held": wb.BrakedDriveline(
        driveline=wb.Driveline(inertia=1.0, damping=1.0, stiffness=100.0),
        brake=wb.ConventionalBrake(radius=0.1),
        friction=wb.CoulombFriction(kinetic=0.5),
        actuation=wb.Actuation(initial_force=1000.0),
        excitation=wb.HarmonicTorque(amplitude=50.0, frequency=2.0),
    ),
}


def in_halves(machine: wb.Machine) -> wb.Machine:
    """The same machine with its torque as two equal ones, which has no closed form."""
    (torque,) = machine.torques
    half = wb.Harmonic(0.5 * torque.signal.amplitude, torque.signal.frequency)
    return machine.replace(torques=[wb.Torque(torque.on, half, name=name) for name in "ab"])


@pytest.mark.parametrize("name", SYSTEMS)
def test_motion_is_that_by_series(name: str) -> None:
    machine = SYSTEMS[name].machine
    assert kernel_of(machine, "exact") is not SERIES
    assert kernel_of(in_halves(machine), "exact") is SERIES
    given: dict[str, Any] = {"periods": 220, "transient": 200}
    one, other = (wb.motion(system, **given) for system in (machine, in_halves(machine)))
    assert (one.kind, one.order, one.stick_class) == (other.kind, other.order, other.stick_class)
    for value in ("period", "stick_share", "peak_torque", "friction_power", "sticks_forward"):
        assert getattr(one, value) == pytest.approx(
            getattr(other, value), rel=1e-9, abs=1e-9, nan_ok=True
        )
    error = max(1e-6 * abs(one.largest_exponent), 2.0 * other.exponent_error)
    assert one.largest_exponent == pytest.approx(other.largest_exponent, abs=error)


@pytest.mark.parametrize("follow", [None, "brake.initial_force"])
def test_sweep_is_that_by_series(follow: str | None) -> None:
    machine = SYSTEMS["round"].machine
    axes = {"brake.initial_force": [50.0, 100.0, 150.0]}
    options: dict[str, Any] = {"follow": follow, "periods": 300, "transient": 290}
    one, other = (wb.sweep(system, axes, **options) for system in (machine, in_halves(machine)))
    assert set(one.data_vars) == set(other.data_vars)
    # The size of the motion is the scale of distances, not a measure: ranges of its samples.
    np.testing.assert_allclose(one["size"], other["size"], rtol=0.1)
    np.testing.assert_allclose(one["return_distance"], 0.0, atol=1e-12)
    compared = set(one.data_vars) - {"size", "return_distance", "settling", "events"}
    for variable in compared:
        np.testing.assert_allclose(
            one[variable], other[variable], rtol=1e-6, atol=1e-9, err_msg=variable
        )


CHANGES: dict[str, dict[str, Any]] = {
    "phase": {"torque": wb.Torque("driveline", wb.Harmonic(10.0, 1.5, 0.5), name="torque")},
    "no torque": {"torque": wb.Torque("driveline", 0.0, name="torque")},
    "lag": {"brake.actuation": wb.Actuation(initial_force=100.0, slope=-1.0, lag=0.1)},
    "moving base": {"brake.base_speed": wb.Harmonic(1.0, 1.5)},
    "law": {"brake.friction": wb.SmoothedFriction(kinetic=0.3, steepness=50.0)},
}


@pytest.mark.parametrize("change", CHANGES)
def test_machines_without_one_inertia_problem(change: str) -> None:
    assert kernel_of(SYSTEMS["round"].machine.replace(CHANGES[change]), "exact") is SERIES


def test_shafts_to_the_ground_add_up() -> None:
    machine = SYSTEMS["round"].machine
    shafts = [
        wb.Shaft("driveline", "ground", stiffness=k, damping=c, name=name)
        for name, k, c in (("one", 150.0, 0.125), ("two", 50.0, 0.375))
    ]
    one, other = wb.motion(machine), wb.motion(machine.replace(shafts=shafts))
    assert one.order > 0
    assert repr(one.as_dict()) == repr(other.as_dict())


def test_an_initial_state_keeps_its_time() -> None:
    """The phase of the torque at the start decides on the motion, as with series."""
    machine = SYSTEMS["round"].machine
    start = wb.FinalState(0.25, {"driveline": 0.1}, {"driveline": 1.0}, held=((),))
    given: dict[str, Any] = {"periods": 3, "transient": 0, "initial": start}
    found = (wb.motion(system, **given) for system in (machine, in_halves(machine)))
    one, other = (motion.peak_torque + motion.friction_power for motion in found)
    assert one == pytest.approx(other, rel=1e-9)


@pytest.mark.parametrize("inertias", [1, 2])
def test_machines_without_contacts_are_followed(inertias: int) -> None:
    """A linear vibration, whose amplitude is known."""
    names = "ab"[:inertias]
    machine = wb.Machine(
        inertias=[wb.Inertia(name, 1.0) for name in names],
        shafts=[wb.Shaft(name, "ground", stiffness=100.0, damping=5.0) for name in names],
        torques=[wb.Torque("a", wb.Harmonic(10.0, 1.0), name="torque")],
    )
    over = {"torque.amplitude": [10.0, 20.0]}
    options: dict[str, Any] = {"follow": "torque.amplitude", "periods": 60, "transient": 59}
    rate = 2.0 * np.pi
    size = rate * 10.0 / abs(100.0 - rate**2 + 5.0j * rate)
    swept = wb.sweep(machine, over, **options)["highest_velocity"].sel(inertia="a")
    np.testing.assert_allclose(swept.values, [[size, 2.0 * size]] * 2, rtol=1e-9)
