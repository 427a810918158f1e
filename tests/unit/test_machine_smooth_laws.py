"""Machines with friction laws that are smooth through zero speed."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
import xarray as xr
from scipy.integrate import solve_ivp

import wedgebrake as wb
from differences import jacobian
from machines import after, contact, general, in_row, numbers
from wedgebrake.errors import InputError


def arctan(speed: float) -> float:
    return 0.25 * math.atan(60.0 * speed)


def skewed(speed: float) -> float:
    """Stronger forwards than backwards, with the same slope at rest."""
    return math.tanh(40.0 * speed) * (0.3 + 0.05 * math.tanh(40.0 * speed))


LAWS: dict[str, Any] = {
    "tanh": wb.SmoothedFriction(kinetic=0.3, steepness=50.0),
    "tanh with a peak": wb.SmoothedFriction(kinetic=0.3, static=0.4, decay=6.0, steepness=80.0),
    "arctan": wb.CustomFriction(law=arctan, width=0.02, kinetic=0.3),
    "skewed": wb.CustomFriction(law=skewed, width=0.03, kinetic=0.3),
}


def driveline(friction: Any) -> wb.BrakedDriveline:
    return wb.paper.system(eta=-10.0, F0=0.06).replace(friction=friction)


def pair(friction: Any, slope: float = -5.0, **actuation: Any) -> wb.Machine:
    """The torque acts on the second inertia, so that the first one starts with a rate of zero."""
    wedge = wb.WedgeBrake(radius=0.2, angle=0.5)
    return in_row(
        contact(brake=wedge, friction=friction, **{"force": 60.0, "slope": slope} | actuation),
        names=("disc", "load"), stiffness=(100.0, 150.0), damping=(0.6, 0.3),
        engine=wb.Harmonic(150.0, 1.5),
    )  # fmt: skip


@pytest.mark.parametrize("name", LAWS)
def test_one_inertia_moves_as_its_driveline(name) -> None:
    system = driveline(LAWS[name])
    expected = wb.simulate(system, periods=10, rtol=1e-12)
    found = wb.simulate(
        system.machine, float(expected.time[-1]), times=expected.time.values, method="smooth"
    )
    size = np.abs(expected.velocity.values).max()
    gap = np.abs(found.velocity.values[:, 0] - expected.velocity.values).max()
    assert gap <= 1e-8 * size


@pytest.mark.parametrize("name", LAWS)
def test_two_inertias_move_as_scipy_says(name) -> None:
    machine, law = pair(LAWS[name]), LAWS[name]
    tangent = math.tan(0.5)

    def rates(t: float, u: Any) -> list[float]:
        m = law.coefficient(0.2 * u[2])
        brake = 0.2 * max(0.0, 60.0 - 5.0 * abs(u[2])) * m / (tangent - m)
        link = 0.3 * (u[2] - u[3]) + 150.0 * (u[0] - u[1])
        engine = 150.0 * math.sin(3.0 * math.pi * t)
        rest = 0.6 * u[2] + 100.0 * u[0]
        return [u[2], u[3], -brake - rest - link, (engine + link) / 0.5]

    expected = solve_ivp(
        rates, (0.0, 2.0), np.zeros(4), "DOP853", rtol=1e-12, atol=1e-13, max_step=1e-3
    ).y[:, -1]
    response = wb.simulate(machine, 2.0)
    assert response.attrs["method"] == "smooth"
    final = wb.final_state(response)
    found = [*final.angles.values(), *final.speeds.values()]
    np.testing.assert_allclose(found, expected, rtol=0.0, atol=1e-8 * np.abs(expected).max())
    # Only the start, where nothing acts on the disc yet, is a stick.
    assert float((response.stick_end - response.stick_start).sum()) <= 1e-5
    if isinstance(law, wb.SmoothedFriction):  # others have no name in study files
        energy = wb.energy(response)
        assert abs(float(energy.residual)) <= 1e-9 * abs(float(energy.torque_work.sum()))


def test_a_signal_and_a_lag_act_on_it() -> None:
    """The limit of a steep law is Coulomb's."""
    more = {"force": 60.0 + wb.Harmonic(10.0, 1.5), "lag": 0.05}
    coulomb = wb.simulate(pair(wb.CoulombFriction(kinetic=0.3), **more), 1.0)
    gaps = []
    for steepness in (200.0, 2000.0):
        law = wb.SmoothedFriction(kinetic=0.3, steepness=steepness)
        found = wb.simulate(pair(law, **more), 1.0)
        gaps.append(float(np.abs(found.velocity - coulomb.velocity).max()))
    assert gaps[1] <= 0.2 * gaps[0]
    assert gaps[1] <= 0.02 * float(np.abs(coulomb.velocity).max())


@pytest.mark.parametrize(
    ("stage", "method"),
    [
        ({}, "exact"),
        ({"lag": 0.05}, "smooth"),
        ({"limits": (0.0, 70.0)}, "smooth"),
        ({"sample_time": 0.01}, "smooth"),
        ({"force": 60.0 + wb.Harmonic(10.0, 1.5)}, "smooth"),
    ],
    ids=["none", "lag", "limits", "samples", "signal"],
)
def test_the_default_method_is_exact_only_for_a_force_of_the_speed_alone(stage, method) -> None:
    machine = pair(wb.StribeckFriction(kinetic=0.3, static=0.36, speed=0.5), **stage)
    found = wb.simulate(machine, 0.5)
    assert found.attrs["method"] == method
    xr.testing.assert_identical(found, wb.simulate(machine, 0.5, method=method))
    coulomb = pair(wb.CoulombFriction(kinetic=0.3), **stage)
    assert wb.simulate(coulomb, 0.0).attrs["method"] == "exact"


def test_orbits_of_one_inertia_are_those_of_its_driveline() -> None:
    system = driveline(LAWS["tanh with a peak"])
    expected, found = wb.orbit(system, 1, rtol=1e-12), wb.orbit(general(system.machine), 1)
    assert found.method == "smooth"
    np.testing.assert_allclose(found.points, expected.points, rtol=1e-8)
    np.testing.assert_allclose(found.multipliers, expected.multipliers, atol=1e-8)


def test_multipliers_of_two_inertias_are_those_of_differences() -> None:
    machine = pair(LAWS["tanh"])
    found = wb.orbit(machine, 1)
    start = numbers(found.initial)
    expected = np.linalg.eigvals(
        jacobian(lambda states: after(machine, states, found.period), start, 1e-5)
    )
    np.testing.assert_allclose(
        np.sort_complex(np.array(found.multipliers)), np.sort_complex(expected), atol=1e-6
    )


def test_the_class_of_motion() -> None:
    found = wb.motion(pair(LAWS["tanh"]))
    assert (found.kind, found.order) == ("synchronous", 1)


@pytest.mark.parametrize(("drive_speed", "kind"), [(0.5, "self-locked"), (-0.5, "steady sliding")])
def test_a_brake_that_locks_itself_in_one_direction(drive_speed: float, kind: str) -> None:
    """The wedge locks itself forwards: tan(0.3) = 0.309 is below the coefficient of friction."""
    system = wb.BrakedDriveline(
        driveline=wb.Driveline(
            inertia=1.0, stiffness=100.0, damping=1.0, drive_speed=drive_speed
        ),
        brake=wb.WedgeBrake(angle=0.3, radius=0.2),
        friction=wb.SmoothedFriction(kinetic=0.35, steepness=50.0),
        actuation=wb.Actuation(initial_force=50.0),
        excitation=wb.HarmonicTorque(amplitude=0.0, frequency=1.0),
    )  # fmt: skip
    assert wb.motion(system).kind == kind


def test_a_narrow_feature_that_is_declared_is_resolved() -> None:
    def law(speed: float) -> float:
        bump = math.exp(-(((abs(speed) - 0.5) / 2e-4) ** 2))
        return math.tanh(40.0 * speed) * (0.3 + 0.1 * bump)

    from wedgebrake.solvers.machine.friction_lines import curved_lines

    friction = wb.CustomFriction(law=law, width=0.03, narrow=((0.5, 2e-4),))
    machine = pair(friction)
    lines, _ = curved_lines(machine.contacts[0])
    tangent = math.tan(0.5)
    for speed in 0.5 + 2e-4 * np.linspace(-3.0, 3.0, 25):
        line = [one for one in lines if one.start <= speed / 0.2][-1]
        place = line.offset + line.slope * speed / 0.2
        value = np.polynomial.polynomial.polyval(place, line.factors)
        m = law(speed)
        assert value == pytest.approx(0.2 * m / (tangent - m), rel=1e-12)


def test_the_exact_method_refuses_them() -> None:
    for function in (wb.simulate, wb.motion, wb.orbit):
        more = {"duration": 1.0} if function is wb.simulate else {}
        with pytest.raises(InputError) as caught:
            function(pair(LAWS["tanh"]), method="exact", **more)
        assert caught.value.name == "method"
