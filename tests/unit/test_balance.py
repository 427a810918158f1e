"""Steady sliding, and limits of stability over the speed, with driven bodies and controllers.

Against closed forms, moving frames and simulations from the solutions.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

import wedgebrake as wb
from machines import contact

STRIBECK = wb.StribeckFriction(kinetic=0.2, static=0.5, speed=3.0)


def one_of(found: tuple[dict[str, float], ...]) -> dict[str, float]:
    assert len(found) == 1
    return found[0]


def stays(machine: wb.Machine, speeds: dict[str, float]) -> None:
    """A run from a solution keeps its speeds."""
    bodies = [
        one
        if isinstance(one, wb.Driven)
        else wb.Inertia(one.name, one.inertia, 0.0, speeds[one.name])
        for one in machine.inertias
    ]
    found = wb.simulate(machine.replace(inertias=bodies), 1.0)
    expected = [speeds[one.name] for one in machine.inertias]
    assert found["velocity"][-1].to_numpy() == pytest.approx(expected, rel=1e-9)


class TestDriven:
    def test_dampers(self) -> None:
        machine = wb.Machine(
            inertias=[wb.Inertia("a", 1.0), wb.Driven("end", 6.0)],
            shafts=[wb.Shaft("a", "end", 0.0, 2.0), wb.Shaft("a", "ground", 0.0, 1.0)],
        )
        assert one_of(wb.steady_sliding(machine))["a"] == pytest.approx(4.0, rel=1e-14)

    def test_what_a_driven_body_carries_along(self) -> None:
        """By a spring, a gear and a contact that sticks."""
        machine = wb.Machine(
            inertias=[
                wb.Inertia("a", 1.0), wb.Inertia("b", 1.0), wb.Inertia("c", 1.0),
                wb.Driven("end", 6.0),
            ],
            shafts=[wb.Shaft("a", "end", 100.0, 2.0, ratio=0.5)],
            joints=[wb.Gear("b", "a", -2.0)],
            contacts=[contact("c", "b", name="clutch")],
        )  # fmt: skip
        found = one_of(wb.steady_sliding(machine, ["clutch"]))
        expected = {"a": 3.0, "b": -6.0, "c": -6.0, "end": 6.0}
        assert found == pytest.approx(expected, rel=1e-14)

    def test_a_base_that_moves_carries_a_body_that_sticks(self) -> None:
        machine = wb.Machine(
            inertias=[wb.Inertia("a", 1.0)], contacts=[contact("a", name="belt", base_speed=3.0)]
        )
        assert wb.steady_sliding(machine, ["belt"]) == ({"a": 3.0},)

    def test_a_shaft_that_winds_up_has_no_steady_sliding(self) -> None:
        machine = wb.Machine(
            inertias=[wb.Inertia("a", 1.0), wb.Driven("end", 6.0)],
            shafts=[wb.Shaft("a", "end", 100.0), wb.Shaft("a", "ground", 1.0)],
        )
        assert wb.steady_sliding(machine) == ()

    @pytest.mark.parametrize("speed", [0.0, 5.0, -20.0])
    def test_a_frame_that_moves(self, speed: float) -> None:
        """With friction that falls, there are several solutions."""

        def machine(base: float, end: str) -> wb.Machine:
            bodies: list[Any] = [wb.Inertia("a", 1.0)]
            if end != "ground":
                bodies.append(wb.Driven(end, base))
            return wb.Machine(
                inertias=bodies, shafts=[wb.Shaft("a", end, 0.0, 0.02)],
                contacts=[contact("a", name="brake", friction=STRIBECK, base_speed=base + 9.0)],
                torques=[wb.Torque("a", -0.2)],
            )  # fmt: skip

        expected = wb.steady_sliding(machine(0.0, "ground"))
        found = wb.steady_sliding(machine(speed, "end"))
        assert len(expected) > 1
        assert [one["a"] - speed for one in found] == pytest.approx(
            [one["a"] for one in expected], rel=1e-12, abs=1e-12
        )

    def test_two_rotations(self) -> None:
        """A clutch slips with 10 N m between dampers to the driven body and to the ground."""
        machine = wb.Machine(
            inertias=[wb.Inertia("a", 1.0), wb.Inertia("b", 1.0), wb.Driven("end", 60.0)],
            shafts=[wb.Shaft("b", "ground", 0.0, 0.5), wb.Shaft("a", "end", 0.0, 1.0)],
            contacts=[contact("a", "b", name="clutch", force=20.0)],
        )
        found = one_of(wb.steady_sliding(machine))
        assert found == pytest.approx({"a": 50.0, "b": 20.0, "end": 60.0}, rel=1e-13)
        stays(machine, found)

    def test_limits_over_the_speed_are_those_of_a_moving_base(self) -> None:
        spring = wb.Shaft("a", "ground", 100.0, 0.3, name="spring")
        brake = {"friction": STRIBECK, "force": 10.0, "slope": -0.3, "name": "brake"}
        driven = wb.Machine(
            inertias=[wb.Inertia("a", 2.0), wb.Driven("belt", 30.0)], shafts=[spring],
            contacts=[contact("a", "belt", **brake)],
        )  # fmt: skip
        plain = wb.Machine(
            inertias=[wb.Inertia("a", 2.0)], shafts=[spring],
            contacts=[contact("a", base_speed=30.0, **brake)],
        )  # fmt: skip
        found, expected = (wb.stability_limits(one, [1.0, 9.0, 30.0]) for one in (driven, plain))
        for name in ("growth_rate", "brake.slope", "brake.kinetic", "spring.damping"):
            np.testing.assert_array_equal(found[name], expected[name])


def controlled(**gains: Any) -> wb.Machine:
    """One inertia with losses of 0.5 N m s/rad, whose speed is to be 10 rad/s."""
    return wb.Machine(
        inertias=[wb.Inertia("a", 1.0)], shafts=[wb.Shaft("a", "ground", 0.0, 0.5)],
        controllers=[wb.Controller("loop", {"a.speed": 1.0}, 10.0, "a.torque", **gains)],
    )  # fmt: skip


class TestControllers:
    @pytest.mark.parametrize(
        ("gains", "speed"),
        [
            ({"proportional": 2.0}, 8.0),  # 2 (10 - w) = 0.5 w
            ({"proportional": 2.0, "limits": (-1.0, 3.0)}, 6.0),
            ({"proportional": 2.0, "integral": 3.0}, 10.0),
            ({"integral": 3.0, "limits": (-1.0, 5.0)}, 10.0),  # just within
            ({"integral": 3.0, "limits": (-1.0, 4.0)}, 8.0),
            ({"proportional": 2.0, "derivative": 0.1, "filter_time": 0.1}, 8.0),
            ({"proportional": 2.0, "integral": 3.0, "sample_time": 0.01}, 10.0),
        ],
    )
    def test_a_torque(self, gains: dict[str, Any], speed: float) -> None:
        machine = controlled(**gains)
        found = one_of(wb.steady_sliding(machine))
        assert found["a"] == pytest.approx(speed, rel=1e-13)
        end = wb.simulate(machine, 60.0)["velocity"][-1].item()
        assert end == pytest.approx(speed, rel=1e-6)

    def test_an_integral_of_the_wrong_sign_is_at_a_limit(self) -> None:
        machine = controlled(integral=-3.0, limits=(-1.0, 4.0))
        assert one_of(wb.steady_sliding(machine))["a"] == pytest.approx(-2.0, rel=1e-13)
        assert wb.steady_sliding(controlled(integral=-3.0))[0]["a"] == pytest.approx(10.0)

    @pytest.mark.parametrize(
        ("gains", "speed"),
        [
            ({"proportional": -2.0}, 19.5 / 1.1),  # 12 - 0.1 w = 0.5 (5 - 2 (10 - w))
            ({"proportional": -2.0, "integral": -3.0}, 10.0),
            ({"integral": -3.0, "limits": (-5.0, 10.0)}, 45.0),  # 12 - 0.1 w = 0.5 * 15
            ({"proportional": -20.0, "limits": (-9.0, 9.0)}, 50.0),  # 0.5 * 14
        ],
    )
    def test_the_command_of_a_brake(self, gains: dict[str, Any], speed: float) -> None:
        machine = wb.Machine(
            inertias=[wb.Inertia("a", 1.0)], torques=[wb.Torque("a", 12.0)],
            shafts=[wb.Shaft("a", "ground", 0.0, 0.1)],
            contacts=[contact("a", name="brake", force=5.0, lag=0.1)],
            controllers=[wb.Controller("loop", {"a.speed": 1.0}, 10.0, "brake.command", **gains)],
        )  # fmt: skip
        assert one_of(wb.steady_sliding(machine))["a"] == pytest.approx(speed, rel=1e-12)

    def test_a_force_that_would_have_to_pull(self) -> None:
        """Released, the brake cannot drive the body to its setpoint."""
        machine = wb.Machine(
            inertias=[wb.Inertia("a", 1.0)], torques=[wb.Torque("a", 1.0)],
            shafts=[wb.Shaft("a", "ground", 0.0, 1.0)],
            contacts=[contact("a", name="brake", force=1.0, lag=0.1)],
            controllers=[
                wb.Controller("loop", {"a.speed": 1.0}, 10.0, "brake.command", integral=-1.0)
            ],
        )  # fmt: skip
        assert wb.steady_sliding(machine) == ()

    @pytest.mark.parametrize(
        "changes",
        [
            {"measured": {"a.angle": 1.0}}, {"resolution": 0.1, "sample_time": 0.1},
        ],
    )  # fmt: skip
    def test_what_is_not_known_is_refused(self, changes: dict[str, Any]) -> None:
        given = {"measured": {"a.speed": 1.0}, "proportional": 1.0, **changes}
        machine = wb.Machine(
            inertias=[wb.Inertia("a", 1.0)],
            controllers=[wb.Controller(name="loop", setpoint=1.0, output="a.torque", **given)],
        )
        with pytest.raises(wb.InputError) as caught:
            wb.steady_sliding(machine)
        assert caught.value.name.startswith("loop.")

    def test_limits_of_a_pi_loop(self) -> None:
        """(J s + c)(T s + 1) s + K_p s + K_i: stable for (J + c T)(K_p + c) > J T K_i."""
        inertia, lag, loss, kp, ki = 2.0, 0.1, 0.3, 2.0, 30.0
        machine = wb.Machine(
            inertias=[wb.Inertia("a", inertia, speed=10.0)], torques=[wb.Torque("a", 8.0)],
            shafts=[wb.Shaft("a", "ground", 0.0, loss, name="air")],
            contacts=[contact("a", name="brake", force=10.0, lag=lag)],
            controllers=[
                wb.Controller(
                    "loop", {"a.speed": 1.0}, 10.0, "brake.command", proportional=-2.0 * kp,
                    integral=-2.0 * ki,
                )
            ],
        )  # fmt: skip
        found = wb.stability_limits(machine, [5.0, 10.0])
        needed = inertia * lag * ki / (inertia + loss * lag) - loss
        # The slope adds half its value, as R mu = 1/2, to the proportional gain.
        assert found["brake.slope"].to_numpy() == pytest.approx(2.0 * (needed - kp), rel=1e-9)
        roots = np.roots([lag, inertia + lag * kp, inertia * kp - inertia * lag * ki])
        assert found["air.damping"].to_numpy() == pytest.approx(max(roots), rel=1e-9)
        eigenvalues = np.roots([inertia * lag, inertia + loss * lag, kp + loss, ki])
        assert found["growth_rate"].to_numpy() == pytest.approx(max(eigenvalues.real), rel=1e-9)
        frequency = max(eigenvalues.imag) / (2.0 * math.pi)
        assert found["frequency"].to_numpy() == pytest.approx(frequency, rel=1e-9)
