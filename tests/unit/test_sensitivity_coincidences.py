"""Derivatives of runs in which events coincide, and change their order with a parameter."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import wedgebrake as wb
from machines import after, numbers


def rubbing(body: str, kinetic: float = 0.5, name: str = "", **more: Any) -> wb.Contact:
    """A contact with the ground; its torque is the friction coefficient times a force of 1 N."""
    return wb.Contact(
        body, name=name or f"brake_{body}", brake=wb.ConventionalBrake(radius=1.0),
        friction=wb.CoulombFriction(kinetic=kinetic, static=0.5),
        actuation=wb.Actuation(**({"initial_force": 1.0, "slope": 0.0} | more)),
    )  # fmt: skip


def pair(*shafts: wb.Shaft) -> wb.Machine:
    """Two equal inertias, each of which its brake stops after 2 s."""
    bodies = [wb.Inertia(name, 1.0, speed=1.0) for name in "ab"]
    return wb.Machine(inertias=bodies, contacts=[rubbing("a"), rubbing("b")], shafts=[*shafts])


def test_bodies_apart_that_stop_together_have_derivatives_of_their_own() -> None:
    """A body stops after J v/T; its angle is J v^2/(2 T) then."""
    found = wb.sensitivity(pair(), ["a.inertia", "b.speed"], 3.0, times=[1.0, 3.0])
    by_inertia, by_speed = (found.isel(parameter=i) for i in (0, 1))
    np.testing.assert_allclose(by_inertia.angle[-1], [1.0, 0.0], atol=1e-12)
    np.testing.assert_allclose(by_speed.angle[-1], [0.0, 2.0], atol=1e-12)
    np.testing.assert_allclose(found.velocity[:, -1], 0.0, atol=1e-12)
    stops = np.argsort(wb.simulate(pair(), 3.0).event_contact.values)
    np.testing.assert_allclose(found.event_time[:, stops], [[2.0, 0.0], [0.0, 2.0]], atol=1e-10)
    # The order of events changes, and nothing else.
    assert "coincides" in found.attrs["message"]
    assert "a.inertia, b.speed are the same" in found.attrs["message"]
    assert not found.one_sided.any()


def test_an_order_that_a_parameter_does_not_change_is_not_mentioned() -> None:
    """The shaft between two bodies that move alike is never twisted."""
    machine = pair(wb.Shaft("a", "b", stiffness=1.0))
    found = wb.sensitivity(machine, ["a-b.stiffness"], 4.0, times=[1.0, 4.0])
    assert "coincides" not in found.attrs["message"]
    for name in ("angle", "velocity", "event_time"):
        np.testing.assert_allclose(found[name], 0.0, atol=1e-12)


def test_coupled_bodies_that_stop_together_agree_with_runs_beside() -> None:
    machine, name, step = pair(wb.Shaft("a", "b", stiffness=1.0)), "a.speed", 1e-6
    run: dict[str, Any] = {"duration": 4.0, "times": [1.0, 2.5, 4.0]}
    found = wb.sensitivity(machine, [name], **run)
    assert "order changes with a.speed" in found.attrs["message"]
    for side in (1.0, -1.0):
        one, other = (
            wb.simulate(machine.replace({name: 1.0 + side * k * step}), **run) for k in (1, 2)
        )
        base = wb.simulate(machine, **run)
        for quantity in ("angle", "velocity"):
            expected = (4.0 * one - other - 3.0 * base)[quantity] * (side / (2.0 * step))
            np.testing.assert_allclose(found[quantity][0], expected, atol=1e-6)
        times = [run.event_time.values[np.argsort(run.event_contact.values)] for run in (base, one)]
        stops = np.argsort(base.event_contact.values)
        moved = (times[1] - times[0]) * (side / step)
        np.testing.assert_allclose(found.event_time[0, stops], moved, atol=1e-5)


def stopping(torque: float) -> wb.Machine:
    """A body that stops after 2 s, when a torque begins."""
    return wb.Machine(
        inertias=[wb.Inertia("a", 1.0, speed=1.0)],
        contacts=[rubbing("a")],
        torques=[wb.Torque("a", wb.Table([0.0, 2.0, 2.0, 9.0], [0.0, 0.0, torque, torque]))],
    )


@pytest.mark.parametrize(("side", "expected"), [(1, 4.0), (-1, 2.0)])
def test_a_stop_at_the_jump_of_a_signal(side: int, expected: float) -> None:
    """A faster body stops against the torque 1/2 - 1/4, a slower one against 1/2."""
    found = wb.sensitivity(stopping(0.25), ["a.speed"], 4.0, times=[4.0], side=side)
    assert float(found.event_time[0, 0]) == pytest.approx(expected, rel=1e-9)
    assert float(found.angle[0, 0, 0]) == pytest.approx(2.0, rel=1e-9)
    assert found.one_sided.values.tolist() == [side]
    assert f"{ {1: 'larger', -1: 'smaller'}[side] } values; side={-side}" in found.attrs["message"]


def test_a_parameter_that_can_take_smaller_values_only() -> None:
    """With k < 1/2, the static coefficient, the stop is at 2 + (1 - 2 k)/(k - 1/4)."""
    found = wb.sensitivity(stopping(0.25), ["brake_a.kinetic"], 4.0, times=[4.0])
    assert float(found.event_time[0, 0]) == pytest.approx(-8.0, rel=1e-9)
    assert found.one_sided.values.tolist() == [-1]
    assert "smaller values" in found.attrs["message"]
    assert "side=" not in found.attrs["message"]


def released_at_a_sample() -> wb.Machine:
    """The torque t/2 ends the stick after 1 s, when the actuation takes its second sample.

    It samples the sliding speed v, and the force is 1 + 2 v for the next second.
    """
    return wb.Machine(
        inertias=[wb.Inertia("a", 1.0)],
        contacts=[rubbing("a", kinetic=0.25, slope=2.0, sample_time=1.0)],
        torques=[wb.Torque("a", wb.Table([0.0, 9.0], [0.0, 4.5]))],
    )


@pytest.mark.parametrize(("side", "expected"), [(1, -0.5), (-1, -0.375)])
def test_a_stick_that_ends_at_a_sample(side: int, expected: float) -> None:
    """A later end is after the sample, which sees no speed.

    The body begins to move at t = 2 mu_s with the acceleration 1/4. If it begins d earlier, it has
    the speed d/4 at the sample, and the torque of friction, 1/4 of the force, is larger by
    (2 d/4)/4 for the last half second.
    """
    machine, names = released_at_a_sample(), ["brake_a.static", "brake_a.kinetic"]
    found = wb.sensitivity(machine, names, 1.5, times=[1.5], side=side)
    np.testing.assert_allclose(found.velocity[:, 0, 0], [expected, -0.5], rtol=1e-9)
    np.testing.assert_allclose(found.event_time[:, 0], [2.0, 0.0], atol=1e-9)
    assert found.one_sided.values.tolist() == [side, 0]
    (name,) = [one for one in names if one in found.attrs["message"]]
    assert name == "brake_a.static"
    # The same from a run on this side, in which the events are apart.
    near = machine.replace({names[0]: 0.5 + side * 1e-7})
    beside = wb.sensitivity(near, names[:1], 1.5, times=[1.5])
    assert beside.one_sided.values.tolist() == [0]
    np.testing.assert_allclose(found.velocity[0], beside.velocity[0], atol=1e-6)


def test_measures_are_one_sided_too() -> None:
    """The speed at the end is the largest."""
    for side, expected in ((1, -0.5), (-1, -0.375)):
        found = wb.sensitivity(
            released_at_a_sample(), ["brake_a.static"], 1.5, of=["highest_velocity"], side=side
        )
        assert float(found.highest_velocity[0, 0]) == pytest.approx(expected, rel=1e-9)
        assert found.one_sided.values.tolist() == [side]


def test_another_side_is_refused() -> None:
    for wrong in (0, 2, True, "left"):
        with pytest.raises(wb.InputError, match="1 or -1") as caught:
            wb.sensitivity(pair(), ["a.inertia"], 1.0, side=wrong)  # type: ignore[arg-type]
        assert (caught.value.name, caught.value.value) == ("side", wrong)


def oscillators(names: str, *, sticks: bool, link: float = 0.0) -> wb.Machine:
    """Equal oscillators on moving bases under equal torques, whose events coincide."""
    static, force, torque = (0.8, 3.0, 2.5) if sticks else (0.5, 2.0, 3.0)
    shafts = [wb.Shaft(one, "ground", stiffness=10.0, damping=0.3) for one in names]
    if link:
        shafts.append(wb.Shaft("a", "b", stiffness=link))
    contacts = [
        wb.Contact(
            one, name=f"brake_{one}", brake=wb.ConventionalBrake(radius=1.0), base_speed=0.5,
            friction=wb.CoulombFriction(kinetic=0.5, static=static),
            actuation=wb.Actuation(initial_force=force),
        )
        for one in names
    ]  # fmt: skip
    return wb.Machine(
        inertias=[wb.Inertia(one, 1.0) for one in names], shafts=shafts, contacts=contacts,
        torques=[wb.Torque(one, wb.Harmonic(torque, 0.4)) for one in names],
    )  # fmt: skip


@pytest.mark.parametrize("sticks", [False, True])
def test_oscillators_apart_have_the_derivatives_of_one(sticks: bool) -> None:
    """Each multiplier occurs twice, and parameters of one do not affect the other."""
    one, two = (wb.orbit(oscillators(names, sticks=sticks)) for names in ("a", "ab"))
    assert ("0" in one.sequence.split()) == sticks
    expected = np.poly(np.tile(one.multipliers, 2))
    np.testing.assert_allclose(np.poly(two.multipliers), expected, atol=1e-10)
    names = ["brake_a.kinetic", "a-ground.stiffness"]
    alone, both = (orbit.sensitivity(names, ["velocity_amplitude"]) for orbit in (one, two))
    for name in ("angle", "velocity_amplitude"):
        np.testing.assert_allclose(both[name][:, 0], alone[name][:, 0], rtol=1e-9)
        np.testing.assert_allclose(both[name][:, 1], 0.0, atol=1e-10)


@pytest.mark.parametrize("sticks", [False, True])
def test_multipliers_of_coupled_oscillators_are_those_of_differences(sticks: bool) -> None:
    machine, step = oscillators("ab", sticks=sticks, link=4.0), 1e-6
    orbit = wb.orbit(machine)
    start = numbers(orbit.initial)
    matrix = np.column_stack([
        (after(machine, start + one, orbit.period) - after(machine, start - one, orbit.period))
        / (2.0 * step)
        for one in step * np.eye(4)
    ])  # fmt: skip
    np.testing.assert_allclose(
        np.poly(orbit.multipliers), np.poly(np.linalg.eigvals(matrix)), atol=1e-6
    )


def test_measures_that_are_nan_beside_others_that_are_not() -> None:
    """Drag and brake of a body change the direction together; their order follows the base."""
    machine = wb.Machine(
        inertias=[wb.Inertia("disc", 1.0, speed=3.0)],
        shafts=[wb.Shaft("disc", "ground", stiffness=100.0, damping=0.1)],
        contacts=[
            wb.Contact(
                "disc", name="brake", brake=wb.ConventionalBrake(radius=0.1),
                friction=wb.CoulombFriction(kinetic=0.3),
                actuation=wb.Actuation(initial_force=20.0),
            ),
            wb.Drag("disc", linear=0.05, quadratic=0.02, name="drag"),
        ],
    )  # fmt: skip
    of, name, step = ["friction_heat", "rms_acceleration"], "brake.base_speed", 1e-6
    for side in (1, -1):
        found = wb.sensitivity(machine, [name], 1.0, of=of, side=side)
        values = [
            wb.sensitivity(machine.replace({name: by * side * step}), [name], 1.0, of=of)[
                "friction_heat_value"
            ].to_numpy()
            for by in (0, 1, 2)
        ]
        expected = (4.0 * values[1] - values[2] - 3.0 * values[0]) / (2.0 * side * step)
        assert found["friction_heat"].to_numpy()[0] == pytest.approx(expected, rel=1e-6)
