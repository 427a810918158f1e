"""Derivatives at values of a parameter at which those on its two sides differ, and at tiny values.

The reference are differences of runs on one side of the value.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import wedgebrake as wb

EXAMPLES = Path(__file__).parents[2] / "examples"


def slowing(**force: Any) -> wb.Machine:
    """An inertia on a shaft, with a brake."""
    brake = wb.Contact(
        "a", name="b", brake=wb.ConventionalBrake(radius=0.1),
        friction=wb.CoulombFriction(kinetic=0.3), actuation=wb.Actuation(**force),
    )  # fmt: skip
    return wb.Machine(
        inertias=[wb.Inertia("a", 1.0, speed=3.0)],
        shafts=[wb.Shaft("a", "ground", stiffness=100.0, damping=0.1, name="s")],
        contacts=[brake],
    )


def difference(value_at: Any, step: float) -> Any:
    """Derivative at 0 on the side of the step, of second order."""
    return (4.0 * value_at(step) - value_at(2.0 * step) - 3.0 * value_at(0.0)) / (2.0 * step)


def assert_measures(system: Any, name: str, of: list[str], side: int, **run: Any) -> None:
    """Compare derivatives of measures on one side with differences."""
    own, step = system.value(name), 1e-6 * side
    found = wb.sensitivity(system, [name], 1.0, of=of, side=side, **run)

    def values(change: float, one: str) -> Any:
        near = system.replace(**{name: own + change})
        return wb.sensitivity(near, [name], 1.0, of=[one], **run)[f"{one}_value"].values

    for one in of:
        expected = difference(lambda change, one=one: values(change, one), step)  # type: ignore[misc]
        # The values of a run are accurate to about 1e-14 of the largest.
        rounding = 1e-14 * (1.0 + np.abs(values(0.0, one)).max()) / abs(step)
        np.testing.assert_allclose(found[one][0], expected, 1e-5, rounding)


HEAT = ["friction_heat", "rms_velocity"]
LATER = wb.Table([0.0, 0.5, 0.5, 1.0], [0.0, 0.0, 50.0, 50.0], after="hold")


@pytest.mark.parametrize(
    ("force", "name", "side"),
    [
        ({"initial_force": 0.0}, "b.initial_force", 1),
        ({"initial_force": 0.0}, "b.slope", 1),
        ({"initial_force": 0.0}, "b.slope", -1),
        ({"initial_force": LATER}, "b.slope", 1),
        ({"initial_force": LATER}, "b.slope", -1),
    ],
)
def test_a_force_at_its_limit(force: dict[str, Any], name: str, side: int) -> None:
    """At the force 0 a brake is pressed for larger values, and released for smaller ones."""
    machine = slowing(**force)
    assert_measures(machine, name, HEAT, side)
    times, own = [0.4, 1.0], machine.value(name)
    found = wb.sensitivity(machine, [name], 1.0, times=times, side=side)
    assert int(found.one_sided[0]) == side
    assert "force is at one of its limits" in found.attrs["message"]

    def velocity(change: float) -> Any:
        return wb.simulate(machine.replace(**{name: own + change}), 1.0, times=times).velocity

    expected = difference(velocity, 1e-6 * side)
    np.testing.assert_allclose(found.velocity[0], expected, 1e-5, 1e-8)


def test_times_of_events_with_a_force_at_its_limit() -> None:
    """The brake reverses earlier or later when it is pressed."""
    machine = slowing(initial_force=0.0)
    found = wb.sensitivity(machine, ["b.slope"], 1.0)
    own = wb.simulate(machine, 1.0).event_time.values
    assert own.size

    def times(change: float) -> Any:
        near = wb.simulate(machine.replace({"b.slope": change}), 1.0).event_time.values
        return near[[np.abs(near - one).argmin() for one in own]]

    expected = difference(times, 1e-5)
    np.testing.assert_allclose(found.event_time[0], expected, 1e-4, 1e-7)


@pytest.mark.parametrize("name", ["initial_force", "slope"])
def test_a_driveline_without_force(name: str) -> None:
    assert_measures(
        wb.paper.system().replace(initial_force=0.0, slope=0.0), name, ["rms_velocity"], 1
    )


@pytest.mark.parametrize("side", [1, -1])
def test_a_knot_of_a_signal_at_a_sampling(side: int) -> None:
    """The setpoint rises for 0.2 s, and is sampled each 1 ms."""
    machine: Any = wb.load_study(EXAMPLES / "torque_control.toml").system
    name = "loop.setpoint.duration"
    found = wb.sensitivity(machine, [name], 1.0, times=[1.0], side=side)
    assert int(found.one_sided[0]) == side
    assert float(found.velocity[0, 0, 0]) == pytest.approx(25.0 + 0.125 * side, rel=1e-9)
    assert_measures(machine, name, ["rms_velocity", "friction_heat"], side)


@pytest.mark.parametrize("value", [1e-20, 1e-12, 1e-9, 2.4e-7])
@pytest.mark.parametrize("name", ["oa.angles.1", "oa.torques.1", "s.rest"])
def test_a_tiny_value_has_the_derivative_at_0(name: str, value: float) -> None:
    machine = slowing(initial_force=50.0).replace({"s.rest": 0.01})
    torques = [
        wb.Torque("a", wb.OverAngle([-0.2, 0.001, 0.1], [3.0, 0.1, -2.0]), name="oa"),
        wb.Torque("a", wb.Harmonic(30.0, 2.0, 0.0), name="T"),
    ]
    machine = wb.Machine(
        inertias=machine.inertias, shafts=machine.shafts, contacts=machine.contacts,
        torques=torques,
    )  # fmt: skip

    def derivative(at: float) -> Any:
        near = machine.replace({name: at})
        return wb.sensitivity(near, [name], 1.0, times=np.linspace(0.0, 1.0, 11)).velocity.values

    expected = derivative(0.0)
    np.testing.assert_allclose(derivative(value), expected, atol=1e-5 * np.abs(expected).max())


@pytest.mark.parametrize(("name", "side"), [("band.base_speed", 1), ("output.speed", -1)])
def test_a_parameter_that_moves_a_contact_at_rest_at_the_start(name: str, side: int) -> None:
    """The sliding speed at the start ends at once; the extremes contain it."""
    machine: Any = wb.load_study(EXAMPLES / "shift.toml").system
    of = ["velocity_amplitude", "rms_acceleration", "lowest_velocity", "friction_heat"]
    assert_measures(machine, name, of, side)
    found = wb.sensitivity(machine, [name], 1.0, of=["peak_torque"], side=side)
    assert np.isnan(found.peak_torque[0, 0])  # it jumps to that of sliding
    assert "peak_torque" in found.attrs["message"]


@pytest.mark.parametrize("side", [1, -1])
def test_measures_where_contacts_on_one_body_reverse_together(side: int) -> None:
    """A brake and a drag; the body meets the end of a gap later."""
    machine = slowing(initial_force=20.0)
    machine = wb.Machine(
        inertias=machine.inertias,
        shafts=[
            *machine.shafts,
            wb.Shaft("a", "ground", stiffness=900.0, damping=4.0, gap=(-0.1, 0.15), name="gap"),
        ],
        contacts=[*machine.contacts, wb.Drag("a", linear=0.05, quadratic=0.02, name="dr")],
    )
    of = ["friction_heat", "viscous_loss", "rms_velocity", "rms_acceleration"]
    assert_measures(machine, "b.base_speed", of, side)


def test_a_group_without_a_value_is_refused():
    """A band brake has no angle."""
    band = wb.load_study(EXAMPLES / "band.toml").system
    with pytest.raises(wb.InputError, match="alpha"):
        wb.sensitivity(band, ["alpha"], 0.5)
