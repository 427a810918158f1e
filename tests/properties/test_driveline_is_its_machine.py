"""A driveline and its machine are one system: every call gives the same numbers for both."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
import xarray as xr

import wedgebrake as wb

LINE: dict[str, Any] = {"inertia": 1.0, "damping": 1.0, "stiffness": 400.0}


def system(
    brake: Any = None, friction: Any = None, force: Any = None, torque: Any = None, **line: Any
) -> wb.BrakedDriveline:
    return wb.BrakedDriveline(
        driveline=wb.Driveline(**{**LINE, **line}),
        brake=brake or wb.ConventionalBrake(radius=0.2),
        friction=friction or wb.CoulombFriction(kinetic=0.3, static=0.4),
        actuation=force or wb.Actuation(initial_force=60.0),
        excitation=torque or wb.HarmonicTorque(amplitude=20.0, frequency=2.3),
    )


TABLE = wb.TabulatedFriction(speeds=(0.0, 0.5, 2.0), coefficients=(0.4, 0.35, 0.3))
SMOOTH = wb.SmoothedFriction(kinetic=0.3, steepness=50.0)
SYSTEMS = {
    "conventional, Coulomb": system(),
    "wedge, table, turning": system(wb.WedgeBrake(angle=0.6, radius=0.2), TABLE, drive_speed=3.0),
    "smooth": system(friction=SMOOTH),
    "force follows the speed": system(force=wb.Actuation(initial_force=60.0, slope=-4.0)),
    "force begins at a speed": system(
        force=wb.Actuation(initial_force=0.0, slope=40.0, release=True)
    ),
    "no spring": system(stiffness=0.0),
    "lag": system(force=wb.Actuation(initial_force=60.0, slope=-1.0, lag=0.05)),
    "order": system(torque=wb.HarmonicTorque(amplitude=20.0, frequency=2.3, orders=[(2, 0.3, 0)])),
    "no torque": system(
        torque=wb.HarmonicTorque(amplitude=0.0, frequency=2.3), drive_speed=0.5, damping=0.1
    ),
}
NAMES = {"initial_force": "brake.initial_force", "damping": "shaft.damping"}
OF_DRIVELINE = {
    "largest_exponent", "second_exponent", "sliding_damping", "final_angle", "final_velocity",
}  # fmt: skip


def of_machine(found: xr.Dataset) -> xr.Dataset:
    """A result of a machine with the names and dimensions of a driveline."""
    left_out = {dim: 0 for dim in ("inertia", "contact") if dim in found.dims}
    names = {NAMES[key]: key for key in NAMES}
    names |= {"driveline.angle": "initial_angle", "driveline.speed": "initial_velocity"}
    return found.isel(left_out, drop=True).rename({k: v for k, v in names.items() if k in found})


def assert_same(one: xr.Dataset, other: xr.Dataset, free: bool) -> None:
    other = of_machine(other)
    assert set(one.data_vars) - OF_DRIVELINE == set(other.data_vars) - {"exponents"}
    for name in other.data_vars:
        if name == "exponents":
            if not free:
                largest = other[name].values[..., 0]
                np.testing.assert_allclose(one["largest_exponent"], largest, rtol=1e-9, atol=1e-9)
            continue
        assert one[name].dims == other[name].dims
        np.testing.assert_allclose(one[name], other[name], rtol=1e-9, atol=1e-9, err_msg=str(name))


def returns(name: str, count: int) -> dict[str, int]:
    return {"crossings" if name == "no torque" else "periods": count}


@pytest.mark.parametrize("name", SYSTEMS)
def test_motion(name: str) -> None:
    given: dict[str, Any] = {**returns(name, 20), "limit": 300, "initial": (0.01, 0.5)}
    one, other = (
        wb.motion(one, **given).as_dict() for one in (SYSTEMS[name], SYSTEMS[name].machine)
    )
    if name == "no spring":
        # A driveline also tells the exponent of its free angle, 0.
        assert math.isclose(max(other["exponents"][0], 0.0), one["largest_exponent"], abs_tol=1e-9)
        for key in ("exponents", "largest_exponent", "second_exponent", "verdict"):
            del one[key], other[key]
    assert repr(one) == repr(other)


@pytest.mark.parametrize("name", SYSTEMS)
def test_poincare(name: str) -> None:
    given: dict[str, Any] = {**returns(name, 40), "transient": 30, "initial": (0.01, 0.5)}
    if name == "no torque":
        given["section"] = "driveline"
    one, other = (wb.poincare(one, **given) for one in (SYSTEMS[name], SYSTEMS[name].machine))
    other = of_machine(other)
    for variable in ("angle", "velocity"):
        np.testing.assert_allclose(one[variable], other[variable], rtol=1e-9, atol=1e-8)


@pytest.mark.parametrize("follow", [None, "initial_force"])
@pytest.mark.parametrize("name", SYSTEMS)
def test_sweep(name: str, follow: str | None) -> None:
    given: dict[str, Any] = {**returns(name, 40), "transient": 30}
    own: dict[str, Any] = {"initial_force": [-20.0, 50.0, 70.0], "damping": [0.5, 1.0]}
    if follow:
        own.pop("damping")
    one = wb.sweep(SYSTEMS[name], own, follow=follow, **given)
    dotted = {NAMES[key]: values for key, values in own.items()}
    along = NAMES[follow] if follow else None
    other = wb.sweep(SYSTEMS[name].machine, dotted, follow=along, **given)
    assert_same(one, other, name == "no spring")


@pytest.mark.parametrize("name", ["conventional, Coulomb", "smooth", "lag"])
def test_basins(name: str) -> None:
    given: dict[str, Any] = {**returns(name, 40), "transient": 30}
    values = [-0.1, 0.1], [-1.0, 1.0]
    names = ("initial_angle", "initial_velocity"), ("driveline.angle", "driveline.speed")
    one, other = (
        wb.basins(one, dict(zip(over, values, strict=True)), **given)
        for one, over in zip((SYSTEMS[name], SYSTEMS[name].machine), names, strict=True)
    )
    assert_same(one, other, free=False)


def test_points_without_the_closed_form_are_part_of_a_sweep() -> None:
    """A lag that is swept from 0 changes the kernel, not the meaning of the result."""
    machine = SYSTEMS["conventional, Coulomb"].machine
    found = wb.sweep(machine, {"brake.lag": [0.0, 1e-9]}, periods=220, transient=200)
    assert (found["status"] == 1).all()
    power = found["friction_power"].values
    np.testing.assert_allclose(power[0], power[1], rtol=1e-6)


def test_a_short_transient_that_has_decayed_is_judged_as_by_series() -> None:
    """The distance to the orbit decides, not the sum of the returns."""
    driven = SYSTEMS["force follows the speed"]
    (torque,) = driven.machine.torques
    half = wb.Harmonic(10.0, 2.3)
    halves = driven.machine.replace(torques=[wb.Torque(torque.on, half, name=n) for n in "ab"])
    for last in (26, 30, 40, 60):
        one, other = (wb.motion(one, last, transient=10) for one in (driven, halves))
        assert (one.kind, one.order) == (other.kind, other.order), last
