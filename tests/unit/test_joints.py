"""Rigid joints: closed forms, equivalent machines, independent integrators, and wrong input."""

from __future__ import annotations

import dataclasses
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy.integrate import solve_ivp

import wedgebrake as wb
from machines import contact, pressed
from verified import error_of

RATIO, SMALL, LARGE = 3.0, 0.5, 2.0


def bodies(*inertias: float, **speeds: float) -> list[wb.Inertia]:
    """Inertias a, b, c, ... with speeds at the start of those that are named."""
    return [
        wb.Inertia(name, one, **({"speed": speeds[name]} if name in speeds else {}))
        for name, one in zip("abcdef", inertias, strict=False)
    ]


def geared(**parts: Any) -> wb.Machine:
    """A small inertia a that turns three times as fast as b."""
    inertias = parts.pop("inertias", bodies(SMALL, LARGE, a=12.0))
    return wb.Machine(inertias=inertias, joints=[wb.Gear("a", "b", RATIO, name="gear")], **parts)


def braked(static: float = 1.3) -> wb.Machine:
    """A gear with brakes on both shafts, a spring and a torque."""
    return geared(
        shafts=[wb.Shaft("b", "ground", stiffness=300.0, damping=0.5)],
        contacts=[
            pressed("a", name="fast", force=8.0, static=static),
            pressed("b", name="slow", force=10.0, static=static),
        ],
        torques=[wb.Torque("a", wb.Harmonic(40.0, 1.7), name="drive")],
    )


def braked_body(static: float = 1.3) -> wb.Machine:
    """The same machine as one body, with the coordinate of b."""
    return wb.Machine(
        inertias=[wb.Inertia("b", RATIO**2 * SMALL + LARGE, speed=4.0)],
        shafts=[wb.Shaft("b", "ground", stiffness=300.0, damping=0.5)],
        contacts=[
            pressed("b", name="fast", force=RATIO * 8.0, static=static),
            pressed("b", name="slow", force=10.0, static=static),
        ],
        torques=[wb.Torque("b", wb.Harmonic(RATIO * 40.0, 1.7), name="drive")],
    )


def of(response: Any, name: str, variable: str = "velocity") -> np.ndarray:
    return np.asarray(response[variable].sel(inertia=name))


class TestAccelerations:
    @pytest.mark.parametrize("ratio", [3.0, -0.5, 1e3])
    def test_gear(self, ratio: float) -> None:
        """The inertia is r^2 J_a + J_b for b, with torques on either side."""
        machine = wb.Machine(
            inertias=bodies(SMALL, LARGE), joints=[wb.Gear("a", "b", ratio)],
            torques=[wb.Torque("a", 5.0), wb.Torque("b", -2.0)],
        )  # fmt: skip
        found = wb.simulate(machine, 1.0, times=[0.0, 0.5, 1.0])
        expected = (ratio * 5.0 - 2.0) / (ratio**2 * SMALL + LARGE) * np.array([0.0, 0.5, 1.0])
        assert_allclose(of(found, "b"), expected, rtol=1e-14)
        assert_allclose(of(found, "a"), ratio * expected, rtol=1e-14)
        # On a: J_a omega_a' = 5 - T.
        own = 5.0 - SMALL * ratio * expected[-1]
        assert_allclose(found["joint_torque"].to_numpy()[:, 0], own, rtol=1e-12, atol=1e-12)

    def test_planetary(self) -> None:
        """Three accelerations and a multiplier from four equations."""
        z, inertias, torques = 2.5, np.array([0.3, 0.7, 1.1]), [5.0, -2.0, 3.0]
        factors = np.array([1.0, z, -1.0 - z])
        machine = wb.Machine(
            inertias=bodies(*inertias), joints=[wb.Planetary("a", "b", "c", z)],
            torques=[wb.Torque(name, one) for name, one in zip("abc", torques, strict=True)],
        )  # fmt: skip
        matrix = np.block([[np.diag(inertias), factors[:, None]], [factors, np.zeros((1, 1))]])
        *expected, multiplier = np.linalg.solve(matrix, [*torques, 0.0])
        found = wb.simulate(machine, 1.0, times=[0.0, 1.0])
        assert_allclose(found["velocity"].to_numpy()[1], expected, rtol=1e-13)
        assert_allclose(found["joint_torque"].to_numpy()[:, 0], multiplier, rtol=1e-13)

    def test_joints_have_no_power(self) -> None:
        found = wb.simulate(shifted(), 1.5)
        factors = np.array([1.0, 2.5, -3.5])
        power = found["joint_torque"].to_numpy() * (found["velocity"].to_numpy() @ factors)[:, None]
        assert np.abs(power).max() < 1e-11
        balance = wb.energy(found)
        assert abs(float(balance["residual"])) < 1e-11 * float(balance["friction_heat"].sum())
        assert wb.check(found) == []

    def test_a_stiff_shaft_approaches_the_gear(self) -> None:
        """The difference falls like one over the stiffness."""
        torques, times = [wb.Torque("a", wb.Harmonic(5.0, 0.4))], np.linspace(0.0, 1.0, 21)
        exact = of(wb.simulate(geared(torques=torques), 1.0, times=times), "b", "angle")
        apart = []
        for stiffness in (1e5, 1e6, 1e7):
            shaft = wb.Shaft("a", "b", stiffness=stiffness, ratio=RATIO)
            inertias = bodies(SMALL, LARGE, a=12.0, b=4.0)
            machine = wb.Machine(inertias=inertias, shafts=[shaft], torques=torques)
            found = of(wb.simulate(machine, 1.0, times=times), "b", "angle")
            apart.append(np.abs(found - exact).max())
        for soft, stiff in pairwise(apart):
            assert 8.0 < soft / stiff < 12.0


class TestEquivalentMachines:
    @pytest.mark.parametrize("static", [1.0, 1.3])
    def test_one_body_with_scaled_brakes(self, static: float) -> None:
        times = np.linspace(0.0, 5.0, 501)
        found, one = (wb.simulate(f(static), 5.0, times=times) for f in (braked, braked_body))
        assert found.sizes["event"] >= 20
        assert_array_equal(found["event_kind"], one["event_kind"])
        assert_array_equal(found["event_contact"], one["event_contact"])
        assert_allclose(found["event_time"], one["event_time"], rtol=0, atol=1e-13)
        assert_allclose(of(found, "b"), of(one, "b"), rtol=0, atol=1e-12)
        assert_allclose(of(found, "a"), RATIO * of(one, "b"), rtol=0, atol=1e-12)
        torque = found["brake_torque"].to_numpy() * np.array([RATIO, 1.0])
        assert_allclose(torque, one["brake_torque"], rtol=0, atol=1e-11)

    def test_the_followed_body_follows_to_the_last_digits(self) -> None:
        found = wb.simulate(braked(), 50.0, times=np.linspace(0.0, 50.0, 200))
        assert found.sizes["event"] > 150
        for name in ("angle", "velocity"):
            size = np.abs(of(found, "a", name)).max()
            apart = of(found, "a", name) - RATIO * of(found, "b", name)
            assert np.abs(apart).max() <= 2e-15 * size

    @pytest.mark.parametrize("joint", [wb.Rigid("a", "b"), wb.Gear("a", "b", 1.0)])
    def test_one_inertia(self, joint: wb.Joint) -> None:
        """Bodies that turn together are the sum of their inertias, here of few digits."""
        parts: dict[str, Any] = {
            "shafts": [wb.Shaft("a", "ground", stiffness=64.0, damping=0.5)],
            "contacts": [pressed("a", name="brake", force=2.0, static=1.25)],
            "torques": [wb.Torque("a", wb.Harmonic(24.0, 1.5))],
        }
        two = wb.Machine(inertias=bodies(0.5, 1.5, a=4.0), joints=[joint], **parts)
        one = wb.Machine(inertias=bodies(2.0, a=4.0), **parts)
        found, expected = (wb.simulate(machine, 8.0) for machine in (two, one))
        assert found.sizes["event"] >= 10
        assert_array_equal(found["event_kind"], expected["event_kind"])
        assert_allclose(found["event_time"], expected["event_time"], rtol=0, atol=1e-14)
        assert_array_equal(of(found, "a"), of(found, "b"))
        assert_allclose(of(found, "a"), of(expected, "a"), rtol=0, atol=1e-13)

    def test_rigid_is_a_gear_with_the_ratio_one(self) -> None:
        machines = [
            wb.Machine(
                inertias=bodies(0.3, 0.7, 1.1, a=3.0, c=1.0), joints=[joint],
                shafts=[wb.Shaft("b", "c", stiffness=70.0, damping=0.1)],
                contacts=[pressed("c", name="brake", force=2.0)],
            )
            for joint in (wb.Rigid("a", "b"), wb.Gear("a", "b", 1.0))
        ]  # fmt: skip
        one, other = (wb.simulate(machine, 3.0) for machine in machines)
        for name in ("velocity", "angle", "event_time", "brake_torque", "joint_torque"):
            assert_array_equal(one[name], other[name])

    def test_mirror(self) -> None:
        """All signs reversed."""
        machine = shifted()
        reversed_ = machine.replace(
            {f"{one.name}.speed": -one.speed for one in machine.inertias}
            | {"engine": wb.Torque("a", wb.Harmonic(-30.0, 1.3), name="engine")}
        )
        found, mirror = wb.simulate(machine, 2.0), wb.simulate(reversed_, 2.0)
        assert found.sizes["event"] > 3
        assert_allclose(mirror["velocity"], -found["velocity"], rtol=0, atol=1e-12)
        assert_allclose(mirror["event_time"], found["event_time"], rtol=1e-13)

    def test_a_run_that_continues(self) -> None:
        machine = braked()
        whole = wb.simulate(machine, 4.0, times=np.linspace(2.2, 4.0, 30))
        state = wb.final_state(wb.simulate(machine, 2.2))
        later = wb.simulate(
            machine, 1.8, initial=state, start_time=2.2, times=np.linspace(2.2, 4.0, 30)
        )
        assert_allclose(later["velocity"], whole["velocity"], rtol=0, atol=1e-12)

    def test_a_run_that_continues_with_another_ratio_of_a_clutch(self) -> None:
        """The clutch that held slips, as its sides no longer have the ratio of their speeds."""
        machine = wb.Machine(
            inertias=bodies(1.0, 10.0, a=40.0, b=10.0),
            contacts=[with_ratio(pressed("a", "b", name="clutch", force=50.0), 4.0)],
        )
        state = wb.final_state(wb.simulate(machine, 1.0))
        other = machine.replace({"clutch.ratio": 3.9})
        found = wb.simulate(other, 1.0, initial=state, times=[1.0, 2.0])
        begun = found.isel(time=0)
        speeds = [state.speeds[one] for one in "ab"]
        assert_allclose(begun["velocity"], speeds, rtol=1e-12)
        assert_allclose(begun["sliding_velocity"], speeds[0] - 3.9 * speeds[1], rtol=1e-9)
        assert wb.check(found) == []
        # a + b/3.9 loses no momentum; then they turn at this ratio.
        momentum = speeds[0] + 10.0 * speeds[1] / 3.9
        held = momentum / (1.0 + 10.0 / 3.9**2)
        assert_allclose(of(found, "a")[-1], held, rtol=1e-12)

    def test_a_contact_with_a_ratio(self) -> None:
        """As a contact of a body that a gear connects to b, in the limit of no inertia."""
        parts: dict[str, Any] = {
            "shafts": [wb.Shaft("b", "ground", stiffness=200.0, damping=0.3)],
            "torques": [wb.Torque("a", wb.Harmonic(60.0, 1.9))],
        }
        direct = wb.Machine(
            inertias=bodies(SMALL, LARGE, a=9.0),
            contacts=[with_ratio(pressed("a", "b", name="k", force=4.0), 2.5)],
            **parts,
        )
        apart = []
        for inertia in (1e-3, 1e-5):
            inertias = [*bodies(SMALL, LARGE, a=9.0), wb.Inertia("wheel", inertia)]
            machine = wb.Machine(
                inertias=inertias, joints=[wb.Gear("wheel", "b", 2.5)],
                contacts=[pressed("a", "wheel", name="k", force=4.0)], **parts,
            )  # fmt: skip
            times = np.linspace(0.0, 2.0, 50)
            found, expected = (wb.simulate(one, 2.0, times=times) for one in (machine, direct))
            assert expected.sizes["event"] >= 3
            apart.append(np.abs(of(found, "a") - of(expected, "a")).max())
        assert 50.0 < apart[0] / apart[1] < 200.0
        assert wb.check(expected) == []


def with_ratio(contact: wb.Contact, ratio: float) -> wb.Contact:
    """A contact whose first body turns ``ratio`` times as fast as the second without sliding."""
    values = {name: getattr(contact, name) for name in contact.model_fields_set}
    return wb.Contact(**{**values, "ratio": ratio})


def shifted(brake: float = 6.0, clutch: float = 3.0) -> wb.Machine:
    """A planetary gear with a brake on the ring b and a clutch between sun a and carrier c."""
    return wb.Machine(
        inertias=bodies(0.3, 0.7, 1.1, a=20.0, c=2.0), joints=[wb.Planetary("a", "b", "c", 2.5)],
        shafts=[wb.Shaft("c", "ground", stiffness=0.0, damping=0.2, name="load")],
        contacts=[
            pressed("b", name="brake", force=brake),
            pressed("a", "c", name="clutch", force=clutch),
        ],
        torques=[wb.Torque("a", wb.Harmonic(30.0, 1.3), name="engine")],
    )  # fmt: skip


class TestAgainstAnIntegrator:
    def test_shift_of_a_planetary_gear(self) -> None:  # noqa: C901
        """Modes by hand, with two contacts on two free speeds, integrated by DOP853."""
        z, mass, limits = 2.5, np.diag([0.3, 0.7, 1.1]), np.array([6.0, 3.0])
        free = np.array([[1.0, 0.0], [-1.0 / z, (1.0 + z) / z], [0.0, 1.0]])  # by sun and carrier
        inertia = free.T @ mass @ free
        rows = np.array([[0.0, 1.0, 0.0], [1.0, 0.0, -1.0]]) @ free
        mobility = rows @ np.linalg.solve(inertia, rows.T)

        def load(t: float, y: np.ndarray) -> np.ndarray:
            engine = 30.0 * np.sin(2.0 * np.pi * 1.3 * t)
            return np.array([engine, -0.2 * y[1]])

        def held(t: float, y: np.ndarray, side: tuple[int, ...]) -> np.ndarray:
            """Torques of the contacts, of which those with side 0 keep their speed."""
            torque = -np.array(side) * limits
            stick = [i for i in range(2) if side[i] == 0]
            drift = rows @ np.linalg.solve(inertia, load(t, y)) + mobility @ torque
            if stick:
                torque[stick] = np.linalg.solve(mobility[np.ix_(stick, stick)], -drift[stick])
            return torque

        def rates(t: float, y: np.ndarray, side: tuple[int, ...]) -> np.ndarray:
            return np.linalg.solve(inertia, load(t, y) + rows.T @ held(t, y, side))

        def consistent(t: float, y: np.ndarray, sides: list[tuple[int, ...]]) -> tuple[int, ...]:
            for side in sides:
                change, later = rows @ rates(t, y, side), 1e-6
                # A little later: a contact that has just reached its limit is beyond it.
                torque = held(t + later, y + later * rates(t, y, side), side)
                speed = rows @ y
                ok = [
                    abs(torque[i]) <= limits[i]
                    if side[i] == 0
                    else side[i] * speed[i] > 1e-9 or side[i] * change[i] > 0.0
                    for i in range(2)
                ]
                if all(ok):
                    return side
            raise AssertionError(t)

        t, y, times = 0.0, np.array([20.0, 2.0]), []
        side: tuple[int, ...] = tuple(np.sign(rows @ y).astype(int))
        while t < 1.5:
            events = []
            for i in range(2):
                ends = [lambda _, y, i=i: float(rows[i] @ y)]
                if side[i] == 0:
                    ends = [
                        lambda t, y, i=i, s=s, now=side: limits[i] - s * held(t, y, now)[i]
                        for s in (1.0, -1.0)
                    ]
                events += ends
            for one in events:
                one.terminal, one.direction = True, -1 if "now" in one.__code__.co_varnames else 0  # type: ignore[attr-defined]
            part = solve_ivp(
                lambda t, y, now=side: rates(t, y, now), (t, 1.5), y, "DOP853", events=events,
                rtol=1e-12, atol=1e-13,
            )  # fmt: skip
            t, y = float(part.t[-1]), part.y[:, -1]
            if part.status != 1:
                break
            if not times or t - times[-1] > 1e-6:  # otherwise the same event again
                times.append(t)
            speed = rows @ y
            options = [
                [int(np.sign(speed[i]))] if abs(speed[i]) > 1e-8 else [0, 1, -1] for i in range(2)
            ]
            side = consistent(t, y, [(i, j) for i in options[0] for j in options[1]])
            # A step away from the event.
            t, y = t + 1e-9, y + 1e-9 * rates(t, y, side)
        found = wb.simulate(shifted(), 1.5)
        own = np.unique(found["event_time"].to_numpy().round(12))
        assert len(times) >= 4
        assert_allclose(own, times, rtol=0, atol=1e-7)
        assert_allclose(of(found, "a")[-1], y[0], rtol=0, atol=1e-6)
        assert_allclose(of(found, "c")[-1], y[1], rtol=0, atol=1e-6)

    def test_driven_body_on_a_gear(self) -> None:
        """The motion of a follows the drive; its torque accelerates a and turns the other body."""
        speed = wb.Harmonic(3.0, 0.7, 0.3)
        machine = wb.Machine(
            inertias=[*bodies(SMALL, LARGE), wb.Driven("drive", speed)],
            joints=[wb.Gear("a", "drive", 2.0)],
            shafts=[wb.Shaft("a", "b", stiffness=40.0, damping=0.3)],
        )  # fmt: skip
        times = np.linspace(0.0, 3.0, 301)
        found = wb.simulate(machine, 3.0, times=times)
        assert_array_equal(of(found, "a"), 2.0 * of(found, "drive"))
        w = 2.0 * np.pi * 0.7
        turn = 6.0 / w * (np.cos(0.3) - np.cos(w * times + 0.3))
        assert_allclose(of(found, "a", "angle"), turn, rtol=0, atol=1e-13)

        def rates(t: float, y: np.ndarray) -> list[float]:
            angle = 6.0 / w * (np.cos(0.3) - np.cos(w * t + 0.3))
            torque = 40.0 * (angle - y[0]) + 0.3 * (6.0 * np.sin(w * t + 0.3) - y[1])
            return [y[1], torque / LARGE, 0.0]

        part = solve_ivp(
            rates, (0.0, 3.0), [0.0, 0.0, 0.0], "DOP853", times, rtol=1e-12, atol=1e-13
        )
        assert_allclose(of(found, "b"), part.y[1], rtol=0, atol=1e-9)
        # J_a omega_a' = -T - shaft, and the drive gets 2 T.
        acceleration = 6.0 * w * np.cos(w * times + 0.3)
        torque = -SMALL * acceleration - found["shaft_torque"].to_numpy()[:, 0]
        assert_allclose(found["joint_torque"].to_numpy()[:, 0], torque, rtol=0, atol=1e-12)
        assert_allclose(found["driven_torque"].to_numpy()[:, 0], -2.0 * torque, rtol=0, atol=1e-12)
        assert wb.check(found) == []
        balance = wb.energy(found)
        assert abs(float(balance["residual"])) < 1e-12
        work = np.trapezoid(found["driven_power"].to_numpy()[:, 0], times)
        assert_allclose(float(balance["drive_work"][0]), work, rtol=1e-3)


class TestTies:
    def test_both_contacts_reach_their_limits_at_once(self) -> None:
        """Round numbers: on a ratio of 2, limits of 1 and 2 N m are the same load."""
        machine = wb.Machine(
            inertias=bodies(1.0, 4.0), joints=[wb.Gear("a", "b", 2.0)],
            contacts=[pressed("a", name="one", force=1.0), pressed("b", name="two", force=2.0)],
            torques=[wb.Torque("b", wb.Ramp(0.0, 8.0, 2.0))],
        )  # fmt: skip
        found = wb.simulate(machine, 2.0, times=[0.5, 2.0])
        assert_allclose(found["event_time"], [1.0, 1.0], rtol=1e-12)
        # They share the load of 2 N m by the squares of their limits: 2 t_1 + t_2 = 2.
        shares = found["brake_torque"].to_numpy()[0]
        assert_allclose(2.0 * shares[0] + shares[1], 2.0, rtol=1e-12)
        assert_allclose(shares[1] / shares[0], 2.0**2 / (2.0 * 1.0**2), rtol=1e-12)
        # J = 8 for b: 8 omega' = 4 (t - 1).
        assert_allclose(of(found, "b")[1], 0.25, rtol=1e-9)

    @pytest.mark.parametrize("torque", [6.0, 4.0])
    def test_contacts_hold_at_their_limits(self, torque: float) -> None:
        """Limits of 2 x 2 + 2 hold 6 N m on b exactly."""
        machine = wb.Machine(
            inertias=bodies(1.0, 1.0), joints=[wb.Gear("a", "b", 2.0)],
            contacts=[pressed("a", name="one", force=2.0), pressed("b", name="two", force=2.0)],
            torques=[wb.Torque("b", torque)],
        )  # fmt: skip
        found = wb.simulate(machine, 1.0)
        assert found.sizes["event"] == 0
        assert found["sticking"].to_numpy().all()

    def test_a_dry_planetary_gear_locks(self) -> None:
        """The clutch locks the gear, and the brake then holds all of it."""
        machine = shifted().replace(torques=[])
        found = wb.simulate(machine, 20.0, until="rest")
        assert found.attrs["at_rest"]
        assert_array_equal(found["velocity"].to_numpy()[-1], [0.0, 0.0, 0.0])


class TestAnalyses:
    def test_eigenvalues_are_those_of_the_reduced_matrices(self) -> None:
        machine = wb.Machine(
            inertias=bodies(0.2, 0.9, 1.3, 0.6),
            joints=[wb.Gear("a", "b", 2.0), wb.Planetary("b", "c", "d", 1.5)],
            shafts=[
                wb.Shaft("c", "ground", stiffness=50.0, damping=0.4),
                wb.Shaft("a", "d", stiffness=20.0, damping=0.1),
            ],
        )  # fmt: skip
        basis = np.array([[2, 0], [1, 0], [-1 / 1.5, 2.5 / 1.5], [0, 1]])  # by b and d
        mass = basis.T @ np.diag([0.2, 0.9, 1.3, 0.6]) @ basis
        twists = np.array([[0, 0, 1, 0], [1, 0, 0, -1]]) @ basis
        stiffness = twists.T @ np.diag([50.0, 20.0]) @ twists
        damping = twists.T @ np.diag([0.4, 0.1]) @ twists
        matrix = np.block([
            [np.zeros((2, 2)), np.eye(2)],
            [-np.linalg.solve(mass, stiffness), -np.linalg.solve(mass, damping)],
        ])  # fmt: skip
        expected = np.sort_complex(np.linalg.eigvals(matrix))
        found = wb.stability(machine)
        assert_allclose(np.sort_complex(np.array(found.eigenvalues)), expected, rtol=1e-11)
        for mode in found.modes:
            assert_allclose(mode.shape[0], 2.0 * mode.shape[1], atol=1e-12)

    def test_stability_of_a_geared_brake(self) -> None:
        """Force that falls with speed on a: the damping of b falls by r^2 times as much."""
        falling = pressed("a", name="brake", force=50.0, slope=-1.5)
        machine = geared(
            shafts=[wb.Shaft("b", "ground", stiffness=300.0, damping=0.5)], contacts=[falling]
        )
        body = wb.Machine(
            inertias=[wb.Inertia("b", RATIO**2 * SMALL + LARGE, speed=4.0)],
            shafts=machine.shafts,
            contacts=[pressed("b", name="brake", force=50.0 * RATIO, slope=-1.5 * RATIO**2)],
        )
        found, expected = wb.stability(machine), wb.stability(body)
        assert not found.stable
        assert_allclose(found.eigenvalues, expected.eigenvalues, rtol=1e-12)
        turning = wb.stability(machine, {"b": 5.0})
        assert turning.cases[0].speeds["brake"] == pytest.approx(15.0)

    def test_motion_is_that_of_one_body(self) -> None:
        found, expected = wb.motion(braked()), wb.motion(braked_body())
        assert found.kind == expected.kind
        assert_allclose(found.exponents, expected.exponents, rtol=1e-6)

    def test_free_rotations_are_subtracted(self) -> None:
        """A geared pair on a stiff shaft turns far; the shaft's torque keeps its digits.

        The torque of a twist rounded at 2e5 rad would err by 3e-7 N m, and the energy by 1e-8. That
        of thousands of cells is exact to 1e-12, with and without fused multiply-add.
        """
        machine = wb.Machine(
            inertias=bodies(0.5, 1.0, 2.0, b=1000.0, c=999.0),
            joints=[wb.Gear("a", "b", -2.5)],
            shafts=[wb.Shaft("b", "c", stiffness=1e4)],
        )
        found = wb.simulate(machine, 200.0, times=[0.0, 200.0])
        balance = wb.energy(found)
        whole = 0.5 * (0.5 * 6.25 + 1.0) * 1e6 + 999.0**2
        assert abs(float(balance["residual"])) < 1e-12 * whole

    def test_derivatives(self) -> None:
        """Speeds at the start that are left out follow as the ratio changes."""
        wb.testing.check_derivatives(
            geared(
                shafts=[wb.Shaft("b", "ground", stiffness=300.0, damping=0.5)],
                contacts=[pressed("a", name="brake", force=8.0, static=1.2)],
                torques=[wb.Torque("a", wb.Harmonic(40.0, 1.7), name="drive")],
            )
        )

    def test_heat_by_the_ratio(self) -> None:
        machine = braked()
        found = wb.sensitivity(machine, ["gear.ratio"], 1.0, of=["friction_heat"])

        def heat(ratio: float) -> np.ndarray:
            response = wb.simulate(machine.replace({"gear.ratio": ratio}), 1.0)
            return np.asarray(wb.energy(response)["friction_heat"])

        step = 1e-4
        expected = (heat(RATIO + step) - heat(RATIO - step)) / (2.0 * step)
        assert_allclose(found["friction_heat"].to_numpy()[0], expected, rtol=1e-5)

    def test_a_sweep_over_the_ratio(self) -> None:
        found = wb.sweep(braked(), {"gear.ratio": [2.0, 3.0]})
        for ratio in (2.0, 3.0):
            single = wb.motion(braked().replace({"gear.ratio": ratio}))
            point = found.sel({"gear.ratio": ratio})
            assert_allclose(float(point["peak_torque"].max()), single.peak_torque, rtol=1e-9)
            assert_allclose(float(point["friction_power"].sum()), single.friction_power, rtol=1e-9)

    @pytest.mark.parametrize("machine", [braked(), shifted()], ids=["gear", "planetary"])
    def test_a_sweep_that_follows_a_motion_over_the_ratio(self, machine: wb.Machine) -> None:
        """The bodies of the joint start each point with speeds of its own ratio."""
        springs = [wb.Shaft(one, "ground", 300.0, 5.0, name=f"s{one}") for one in "ab"]
        machine = machine.replace(
            shafts=springs, torques=[wb.Torque("a", wb.Harmonic(40.0, 1.7), name="drive")]
        )
        values = {f"{machine.joints[0].name}.ratio": [2.0, 2.2, 2.4]}
        found = wb.bifurcation(machine, values, follow=True, periods=5)
        single = wb.sweep(machine, values, periods=5)
        assert np.all(found["status"] == single["status"])
        for branch in ("up", "down"):
            assert_allclose(
                found["peak_torque"].sel(branch=branch), single["peak_torque"], rtol=1e-4
            )


class TestModel:
    def test_values_that_are_left_out_follow(self) -> None:
        machine = geared()
        assert machine.inertias[1].speed == 4.0
        assert machine.replace({"a.speed": 30.0}).inertias[1].speed == 10.0
        assert machine.replace({"gear.ratio": 4.0}).inertias[1].speed == 3.0
        given = geared(inertias=[wb.Inertia("a", 1.0), wb.Inertia("b", 1.0, 0.5, 2.0)])
        assert (given.inertias[0].angle, given.inertias[0].speed) == (1.5, 6.0)

    def test_study_files(self) -> None:
        machine = wb.Machine(
            inertias=bodies(1.0, 2.0, 3.0, 4.0, a=6.0),
            joints=[wb.Gear("a", "b", 3.0), wb.Rigid("b", "c"), wb.Planetary("a", "c", "d", 2.0)],
        )
        text = wb.Study(machine).to_toml()
        for table in ("[[gear]]", "[[rigid]]", "[[planetary]]"):
            assert table in text
        assert wb.read_study(text).system == machine
        assert str(machine) == ("Machine of 4 inertias, 1 gear, 1 planetary gear, 1 rigid joint")

    def test_results_name_the_joints(self) -> None:
        found = wb.simulate(geared(), 0.1)
        assert found["joint"].to_numpy().tolist() == ["gear"]
        assert found["joint_torque"].attrs["units"] == "N m"
        assert "joint" not in wb.simulate(wb.Machine(inertias=bodies(1.0, 1.0)), 0.1).dims

    def test_it_has_no_closed_form(self) -> None:
        assert braked().one_inertia is None
        assert all(value is None for value in braked().groups.as_dict().values())


I = wb.Inertia  # noqa: E741
WRONG: dict[str, tuple[Any, str]] = {
    "ratio 0": (lambda: wb.Gear("a", "b", 0.0), "a-b.ratio"),
    "ratio nan": (lambda: wb.Gear("a", "b", float("nan")), "a-b.ratio"),
    "no ratio": (lambda: wb.Gear("a", "b"), "a-b.ratio"),  # type: ignore[call-arg]
    "one body": (lambda: wb.Gear("a", "a", 2.0), "a-a.b"),
    "the ground": (lambda: wb.Rigid("a", "ground"), "a-ground.b"),
    "two bodies": (lambda: wb.Planetary("a", "b", "b", 2.0), "a-b-b.carrier"),
    "planetary without carrier": (lambda: wb.Planetary("a", "b", "c", -1.0), "a-b-c.ratio"),
    "planetary without ring": (lambda: wb.Planetary("a", "b", "c", 0.0), "a-b-c.ratio"),
    "no such body": (lambda: geared(inertias=[I("a", 1.0), I("c", 1.0)]), "gear.b"),
    "no joint": (
        lambda: wb.Machine(inertias=[I("a", 1.0)], joints=[wb.Shaft("a", "ground", 1.0)]),
        "machine.joints[0]",
    ),
    "speeds that contradict": (
        lambda: geared(inertias=[I("a", 1.0, speed=6.0), I("b", 1.0, speed=3.0)]), "a.speed",
    ),
    "angles that contradict": (
        lambda: geared(inertias=[I("a", 1.0, angle=0.1), I("b", 1.0, angle=0.1)]), "a.angle",
    ),
    "speeds that are not determined": (
        lambda: wb.Machine(
            inertias=[I("a", 1.0, speed=6.0), I("b", 1.0), I("c", 1.0)],
            joints=[wb.Planetary("a", "b", "c", 2.0)],
        ),
        "b.speed",
    ),
    "a joint twice": (
        lambda: wb.Machine(
            inertias=bodies(1.0, 1.0, 1.0),
            joints=[wb.Gear("a", "b", 2.0), wb.Gear("b", "c", 2.0), wb.Gear("a", "c", 4.0)],
        ),
        "a-c",
    ),
    "a loop without freedom": (
        lambda: wb.Machine(
            inertias=bodies(1.0, 1.0, 1.0, 1.0),
            joints=[wb.Gear("a", "b", 2.0), wb.Gear("b", "c", 2.0), wb.Gear("a", "c", 3.0)],
        ),
        "a-c",
    ),
    "drives in conflict": (
        lambda: wb.Machine(
            inertias=[*bodies(1.0, 1.0), wb.Driven("x", 1.0), wb.Driven("y", 2.0)],
            joints=[wb.Gear("a", "x", 2.0), wb.Rigid("a", "y")],
        ),
        "a-y",
    ),
    "two driven bodies joined": (
        lambda: wb.Machine(
            inertias=[*bodies(1.0), wb.Driven("x", 1.0), wb.Driven("y", 2.0)],
            joints=[wb.Gear("x", "y", 2.0)],
        ),
        "x-y",
    ),
    "nothing moves freely": (
        lambda: wb.Machine(
            inertias=[*bodies(1.0), wb.Driven("x", 1.0)], joints=[wb.Gear("a", "x", 2.0)]
        ),
        "inertias",
    ),
    "names twice": (
        lambda: geared(shafts=[wb.Shaft("a", "ground", 1.0, name="gear")]), "joints[0].name",
    ),
    "a contact without sliding": (
        lambda: wb.simulate(
            wb.Machine(
                inertias=bodies(1.0, 1.0), joints=[wb.Rigid("a", "b")],
                contacts=[pressed("a", "b", name="k")],
            ),
            1.0,
        ),
        "k",
    ),
    "a contact that a drive slides": (
        lambda: wb.simulate(
            wb.Machine(
                inertias=[*bodies(1.0, 1.0), wb.Driven("x", 1.0)], joints=[wb.Rigid("a", "x")],
                contacts=[pressed("a", name="k")],
            ),
            1.0,
        ),
        "k",
    ),
    "a ratio to the ground": (lambda: with_ratio(pressed("a", name="k"), 2.0), "k.ratio"),
    "a ratio of 0": (lambda: with_ratio(pressed("a", "b", name="k"), 0.0), "k.ratio"),
    "speeds of stability": (lambda: wb.stability(braked(), [1.0, 1.0]), "a.speed"),
    "states at the start": (lambda: geared().started_at([0.0, 0.0], [1.0, 1.0]), "a.speed"),
    "a state of another ratio": (
        lambda: wb.simulate(
            braked().replace({"gear.ratio": 2.0}), 1.0,
            initial=wb.final_state(wb.simulate(braked(), 0.3)), start_time=0.3,
        ),
        "initial",
    ),
}  # fmt: skip


@pytest.mark.parametrize("case", WRONG)
def test_wrong_input(case: str) -> None:
    make, name = WRONG[case]
    with pytest.raises(wb.InputError) as found:
        make()
    assert found.value.name == name
    assert name in str(found.value)


class TestBalance:
    """Steady sliding behind a gear 4 : 1 and a motor whose torque falls with the speed."""

    @staticmethod
    def driven(*contacts: wb.Contact) -> wb.Machine:
        curve = wb.OverSpeed((0.0, 100.0, 160.0), (200.0, 150.0, 0.0))
        return wb.Machine(
            inertias=[wb.Inertia("motor", 0.2), wb.Inertia("wheel", 5.0)],
            joints=[wb.Gear("motor", "wheel", 4.0)], contacts=contacts,
            torques=[
                wb.Torque("motor", curve, name="curve"), wb.Torque("wheel", -300.0, name="load")
            ],
        )  # fmt: skip

    def test_motor_curve(self) -> None:
        """The load needs 75 N m of the motor."""
        (found,) = wb.steady_sliding(self.driven())
        assert found == pytest.approx({"motor": 130.0, "wheel": 32.5}, rel=1e-13)
        growth = wb.stability(self.driven(), found).growth_rate
        assert growth == pytest.approx(-2.5 * 16.0 / (0.2 * 16.0 + 5.0), rel=1e-13)

    def test_a_brake_on_the_wheel(self) -> None:
        """With 100 N m of the brake, 100 N m of the motor."""
        (found,) = wb.steady_sliding(self.driven(pressed("wheel", force=100.0)))
        assert found == pytest.approx({"motor": 120.0, "wheel": 30.0}, rel=1e-13)

    def test_a_clutch_with_a_ratio(self) -> None:
        """It slides at the speed of the motor less twice that of the wheel, with 10 N m."""
        clutch = with_ratio(pressed("motor", "wheel", name="clutch", force=10.0), 2.0)
        (found,) = wb.steady_sliding(self.driven(clutch))
        # 4 T - 40 + 20 = 300
        assert found == pytest.approx({"motor": 128.0, "wheel": 32.0}, rel=1e-13)
        case = wb.stability(self.driven(clutch), found).cases[0]
        assert case.speeds["clutch"] == pytest.approx(64.0, rel=1e-13)


class TestEquationsOfAShift:
    """Responses of a planetary gear between a band and a clutch solve its equations."""

    @staticmethod
    def gear(*contacts: wb.Contact, torque: wb.Signal) -> wb.Machine:
        inertias = {"sun": 0.3, "ring": 0.7, "carrier": 4.0}
        return wb.Machine(
            inertias=[wb.Inertia(*one) for one in inertias.items()], contacts=contacts,
            joints=[wb.Planetary("sun", "ring", "carrier", 2.5, name="gear")],
            torques=[wb.Torque("sun", torque, name="gas")],
        )  # fmt: skip

    def test_the_band_releases_as_the_clutch_closes(self) -> None:
        band = contact("ring", name="band", force=wb.Ramp(400.0, 0.0, 0.2, 0.3))
        clutch = contact("sun", "carrier", name="clutch", force=wb.Ramp(0.0, 400.0, 0.2, 0.3))
        given = self.gear(band, clutch, torque=wb.Constant(5.0))
        assert error_of(given, 2.0) < 1e-9
        speeds = wb.simulate(given, 2.0, times=[2.0])["velocity"].to_numpy()[0]
        assert speeds == pytest.approx(speeds[0], rel=1e-15)

    @pytest.mark.parametrize("force", [2.0, 1.0])
    def test_equal_contacts(self, force: float) -> None:
        band = pressed("ring", force=force, name="band")
        clutch = pressed("sun", "carrier", force=force, name="clutch")
        assert error_of(self.gear(band, clutch, torque=wb.Harmonic(8.0, 0.5)), 6.0) < 1e-9


def test_a_state_of_another_ratio() -> None:
    """The advice can be followed."""

    def machine(ratio: float) -> wb.Machine:
        return wb.Machine(
            inertias=[wb.Inertia("a", 1.0), wb.Inertia("b", 1.0, speed=1.0)],
            joints=[wb.Gear("a", "b", ratio, name="gear")],
        )

    state = wb.final_state(wb.simulate(machine(2.0), 1.0))
    with pytest.raises(wb.InputError, match=r"a\.angle is 2 and must be 3") as caught:
        wb.simulate(machine(3.0), 1.0, initial=state)
    assert caught.value.name == "initial"
    agrees = dataclasses.replace(state, angles={"a": 3.0, "b": 1.0}, speeds={"a": 3.0, "b": 1.0})
    found = wb.simulate(machine(3.0), 1.0, initial=agrees)
    assert found["angle"][-1].to_numpy() == pytest.approx([6.0, 2.0])
