"""Gears, planetary gears and rigid joints, against closed forms and equations with multipliers."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

import wedgebrake as wb
from machines import contact, pressed
from verified import error_of

TIMES = np.linspace(0.0, 2.0, 21)


def geared(ratio: float = 3.0, *, on: str = "motor", **more: Any) -> wb.Machine:
    """A motor of 0.2 kg m^2 and a wheel of 5 kg m^2 with a gear between them, and a torque."""
    given = {
        "inertias": [wb.Inertia("motor", 0.2), wb.Inertia("wheel", 5.0)],
        "joints": [wb.Gear("motor", "wheel", ratio)],
        "torques": [wb.Torque(on, wb.Constant(7.0), name="load")],
    }  # fmt: skip
    return wb.Machine(**(given | more))


def simulated(machine: wb.Machine, **more: Any) -> Any:
    return wb.simulate(machine, 2.0, **({"times": TIMES} | more))


class TestGear:
    @pytest.mark.parametrize("ratio", [3.0, -0.5, 1.0])
    @pytest.mark.parametrize("on", ["motor", "wheel"])
    def test_reduced_inertia(self, ratio: float, on: str) -> None:
        """r^2 J_a + J_b in the coordinate of b; a torque on a acts r times."""
        found = simulated(geared(ratio, on=on))
        rate = 7.0 * (ratio if on == "motor" else 1.0) / (ratio**2 * 0.2 + 5.0)
        wheel, motor = (
            found["velocity"].sel(inertia="wheel"),
            found["velocity"].sel(inertia="motor"),
        )
        assert wheel.to_numpy() == pytest.approx(rate * TIMES, rel=1e-13, abs=1e-15)
        assert motor.to_numpy() == pytest.approx(ratio * wheel.to_numpy(), rel=1e-15)
        own = 0.2 * ratio * rate - (7.0 if on == "motor" else 0.0)
        assert found["joint_torque"].to_numpy()[:, 0] == pytest.approx(-own, rel=1e-12)

    def test_a_rigid_joint_is_one_body(self) -> None:
        shaft = wb.Shaft("wheel", "ground", 90.0, 0.5)
        rigid = geared(shafts=[shaft], joints=[wb.Rigid("motor", "wheel")])
        one = wb.Machine(
            inertias=[wb.Inertia("wheel", 5.2)], shafts=[shaft],
            torques=[wb.Torque("wheel", wb.Constant(7.0), name="load")],
        )  # fmt: skip
        unit = geared(1.0, shafts=[shaft])
        right = simulated(one)["velocity"].to_numpy()[:, 0]
        for machine in (rigid, unit):
            found = simulated(machine)["velocity"].to_numpy()
            assert np.array_equal(found[:, 0], found[:, 1])
            assert found[:, 0] == pytest.approx(right, rel=1e-12, abs=1e-14)

    def test_a_stiff_shaft_in_place_of_a_gear(self) -> None:
        """Differences of the mean motion fall like one over the stiffness."""
        spring = wb.Shaft("wheel", "ground", 40.0, 4.0, name="spring")
        wave = [wb.Torque("motor", wb.Harmonic(5.0, 0.4), name="load")]
        right = simulated(geared(shafts=[spring], torques=wave))["angle"].sel(inertia="wheel")
        errors = []
        for stiffness in (1e5, 1e6, 1e7):
            shaft = wb.Shaft("motor", "wheel", stiffness, 20.0, ratio=3.0, name="shaft")
            machine = geared(joints=[], shafts=[spring, shaft], torques=wave)
            found = simulated(machine)["angle"].sel(inertia="wheel")
            errors.append(float(abs(found - right).max()))
        assert errors[0] / errors[1] == pytest.approx(10.0, rel=0.1)
        assert errors[1] / errors[2] == pytest.approx(10.0, rel=0.1)

    @pytest.mark.parametrize("ratio", [3.0, -2.0])
    def test_a_brake_behind_a_gear_is_a_brake_of_another_radius(self, ratio: float) -> None:
        """A brake on the motor brakes the wheel with ratio times its torque."""
        brake = pressed("motor", force=36.0 / abs(ratio), static=1.5)
        wave = [wb.Torque("wheel", wb.Harmonic(60.0, 0.7), name="load")]
        spring = wb.Shaft("wheel", "ground", 60.0, 0.5, name="spring")
        given = geared(ratio, contacts=[brake], torques=wave, shafts=[spring])
        alone = wb.Machine(
            inertias=[wb.Inertia("wheel", 5.0 + 0.2 * ratio**2)], shafts=[spring], torques=wave,
            contacts=[pressed("wheel", force=36.0, static=1.5)],
        )  # fmt: skip
        found, right = (wb.simulate(one, 20.0, times=TIMES) for one in (given, alone))
        assert found.sizes["stick"] == right.sizes["stick"] > 4
        assert found["event_time"].to_numpy() == pytest.approx(
            right["event_time"].to_numpy(), abs=1e-11
        )
        assert found["angle"].sel(inertia="wheel").to_numpy() == pytest.approx(
            right["angle"].to_numpy()[:, 0], abs=1e-11
        )

    def test_modes_of_a_geared_line(self) -> None:
        """With the reduced matrices, and without spurious eigenvalues."""
        spring = wb.Shaft("wheel", "ground", 90.0, 0.5)
        found = wb.stability(geared(shafts=[spring])).eigenvalues
        inertia = 9.0 * 0.2 + 5.0
        right = np.roots([inertia, 0.5, 90.0])
        assert sorted(found, key=lambda one: one.imag) == pytest.approx(
            sorted(right.tolist(), key=lambda one: one.imag), rel=1e-12
        )

    def test_energy(self) -> None:
        brakes = [pressed("motor", force=2.0), pressed("wheel", force=3.0, name="second")]
        spring = wb.Shaft("wheel", "ground", 60.0, 0.5, name="spring")
        wave = [wb.Torque("wheel", wb.Harmonic(30.0, 0.7), name="load")]
        given = geared(contacts=brakes, shafts=[spring], torques=wave)
        energy = wb.energy(wb.simulate(given, 20.0))
        assert energy["residual"] == pytest.approx(0.0, abs=1e-11)
        assert energy["friction_heat"].to_numpy().min() > 1.0


class TestPlanetary:
    RATIO, INERTIAS, TORQUES = 2.5, (0.3, 0.7, 4.0), (5.0, -2.0, 3.0)

    def machine(self, **more: Any) -> wb.Machine:
        names = ("sun", "ring", "carrier")
        given = {
            "inertias": [wb.Inertia(*one) for one in zip(names, self.INERTIAS, strict=True)],
            "joints": [wb.Planetary(*names, self.RATIO, name="gear")],
            "torques": [
                wb.Torque(name, wb.Constant(value), name=f"on-{name}")
                for name, value in zip(names, self.TORQUES, strict=True)
            ],
        }
        return wb.Machine(**(given | more))

    def test_accelerations_by_the_multiplier(self) -> None:
        """M a + f lambda = T and f a = 0."""
        row = np.array([1.0, self.RATIO, -1.0 - self.RATIO])
        matrix = np.zeros((4, 4))
        matrix[:3, :3], matrix[:3, 3], matrix[3, :3] = np.diag(self.INERTIAS), row, row
        right = np.linalg.solve(matrix, [*self.TORQUES, 0.0])
        found = simulated(self.machine())
        speeds = found["velocity"].to_numpy()
        assert speeds == pytest.approx(np.outer(TIMES, right[:3]), rel=1e-12, abs=1e-14)
        torque = found["joint_torque"].to_numpy()[:, 0]
        assert torque == pytest.approx(np.full(len(TIMES), right[3]), rel=1e-12)
        power = torque * (speeds @ row)
        assert np.abs(power).max() <= 1e-14 * np.abs(torque).max() * np.abs(speeds).max()

    def test_a_held_ring_is_a_gear(self) -> None:
        brake = contact("ring", name="band", force=1e4)
        found = simulated(self.machine(contacts=[brake]))["velocity"].to_numpy()
        assert np.all(found[:, 1] == 0.0)
        ratio = 1.0 + self.RATIO
        rate = (self.TORQUES[0] * ratio + self.TORQUES[2]) / (0.3 * ratio**2 + 4.0)
        assert found[:, 2] == pytest.approx(rate * TIMES, rel=1e-12, abs=1e-14)

    def test_a_shift_by_two_clutches(self) -> None:
        """The band releases the ring while the clutch joins sun and carrier: one speed at last."""
        band = contact("ring", name="band", force=wb.Ramp(400.0, 0.0, 0.2, 0.3))
        clutch = contact("sun", "carrier", name="clutch", force=wb.Ramp(0.0, 400.0, 0.2, 0.3))
        given = self.machine(contacts=[band, clutch])
        found = simulated(given)
        last = found["velocity"].to_numpy()[-1]
        assert last == pytest.approx(last[0], rel=1e-15)
        assert {"band", "clutch"} <= set(found["contact"].to_numpy()[found["event_contact"]])
        assert error_of(given, 2.0) < 1e-9

    @pytest.mark.parametrize("force", [2.0, 1.0])
    def test_both_clutches_at_their_limits(self, force: float) -> None:
        """Two equal contacts with round numbers."""
        band = pressed("ring", force=force, name="band")
        clutch = pressed("sun", "carrier", force=force, name="clutch")
        given = self.machine(
            contacts=[band, clutch], torques=[wb.Torque("sun", wb.Harmonic(8.0, 0.5), name="t")]
        )
        assert error_of(given, 6.0) < 1e-9


class TestStarts:
    def test_speeds_follow_from_each_other(self) -> None:
        inertias = [wb.Inertia("motor", 0.2, speed=6.0), wb.Inertia("wheel", 5.0)]
        assert geared(3.0, inertias=inertias).inertias[1].speed == pytest.approx(2.0, rel=1e-15)

    def test_restart(self) -> None:
        given = geared(
            contacts=[pressed("motor", force=4.0)],
            shafts=[wb.Shaft("wheel", "ground", 60.0, 0.5, name="spring")],
            torques=[wb.Torque("wheel", wb.Harmonic(30.0, 0.7), name="load")],
        )
        whole = wb.simulate(given, 6.0, times=[6.0])["velocity"].to_numpy()
        half = wb.final_state(wb.simulate(given, 3.1, times=[]))
        rest = wb.simulate(given, 2.9, initial=half, times=[6.0])["velocity"].to_numpy()
        assert rest == pytest.approx(whole, abs=1e-11)

    def test_mirror(self) -> None:
        given = geared(
            contacts=[pressed("motor", force=4.0)],
            torques=[wb.Torque("wheel", wb.Harmonic(30.0, 0.7), name="load")],
        )
        other = given.replace({"load.amplitude": -30.0})
        first, second = (simulated(one)["velocity"].to_numpy() for one in (given, other))
        assert np.array_equal(first, -second)

    def test_on_a_driven_body(self) -> None:
        """A gear passes the speed of a driven body on; the drive bears the torque."""
        given = wb.Machine(
            inertias=[
                wb.Inertia("wheel", 5.0),
                wb.Inertia("idle", 1.0),
                wb.Driven("drive", wb.Harmonic(2.0, 0.5)),
            ],
            joints=[wb.Gear("wheel", "drive", 2.0)],
        )
        found = simulated(given)
        speed = 2.0 * np.sin(np.pi * TIMES)
        assert found["velocity"].to_numpy()[:, 0] == pytest.approx(2.0 * speed, abs=1e-13)
        torque = 5.0 * 2.0 * 2.0 * 2.0 * np.pi * np.cos(np.pi * TIMES)
        assert found["driven_torque"].to_numpy()[:, 0] == pytest.approx(torque, abs=1e-11)

    def test_study(self, tmp_path: Any) -> None:
        given = TestPlanetary().machine()
        file = wb.save_study(wb.Study(given), tmp_path / "gear.toml")
        assert "[[planetary]]" in file.read_text()
        assert wb.load_study(file).system == given
        assert given.replace({"gear.ratio": 3.0}).value("gear.ratio") == 3.0

    @pytest.mark.parametrize(
        ("make", "name"),
        [
            (lambda: wb.Gear("motor", "wheel", 0.0), "motor-wheel.ratio"),
            (lambda: wb.Gear("motor", "wheel", math.nan), "motor-wheel.ratio"),
            (lambda: wb.Gear("motor", "motor", 2.0), "motor-motor.b"),
            (lambda: wb.Gear("motor", "ground", 2.0), "motor-ground.b"),
            (lambda: wb.Rigid("ground", "wheel"), "ground-wheel.a"),
            (lambda: wb.Planetary("a", "b", "c", -1.0, name="g"), "g.ratio"),
            (lambda: wb.Planetary("a", "b", "c", 0.0, name="g"), "g.ratio"),
            (lambda: wb.Planetary("a", "b", "a", 2.0, name="g"), "g.carrier"),
            (lambda: geared(joints=[wb.Gear("motor", "nobody", 2.0, name="g")]), "g.b"),
            (
                lambda: geared(joints=[wb.Gear("motor", "wheel", 2.0, name="g"),
                                       wb.Rigid("motor", "wheel", name="h")]),
                "h",
            ),
            (
                lambda: geared(inertias=[wb.Inertia("motor", 0.2, speed=1.0),
                                         wb.Inertia("wheel", 5.0, speed=1.0)]),
                "motor.speed",
            ),
        ],
    )  # fmt: skip
    def test_wrong(self, make: Any, name: str) -> None:
        with pytest.raises(wb.InputError) as caught:
            make()
        assert caught.value.name == name
