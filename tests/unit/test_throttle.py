"""Torques over a speed or an angle that are multiplied by a signal, such as a throttle.

Against closed forms, equivalent machines and ``piecewise_reference``, an integrator that locates
events on its own. Their derivatives: ``test_sensitivity_digits``.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq
from test_machine_pieces import assert_right, states

import piecewise_reference
import wedgebrake as wb
from machine_draw import throttle
from machines import contact

INERTIA, LOSS, SPEED = 2.0, 0.3, 10.0
FAR = 1000.0
LINE = wb.OverSpeed([-FAR, FAR], [LOSS * FAR, -LOSS * FAR])
SCALES = {
    "wave": wb.Harmonic(0.5, 1.3, 0.2) + 1.0,
    "wave of both signs": wb.Harmonic(2.0, 0.7),
    "ramp": wb.Ramp(0.0, 1.0, 1.5, begin=0.5),
    "log ramp": wb.Ramp(0.1, 2.0, 2.0, begin=0.25, law="log"),
    "chirp": wb.Chirp(1.0, 0.5, 4.0, 4.0),
    "jumps": wb.Table([0.0, 1.0, 1.0, 2.0], [1.0, 0.5, -1.0, 0.0], periodic=True),
    "product": wb.Harmonic(2.0, 1.0) * wb.Ramp(0.0, 1.0, 2.0),
    "orders": wb.Orders(wb.Ramp(2.0, 9.0, 4.0), [(2.0, 1.0, 0.3)]),
}


def wheel(curve: Any, speed: float = SPEED, **more: Any) -> wb.Machine:
    return wb.Machine(
        inertias=[wb.Inertia("wheel", INERTIA, speed=speed)],
        torques=[wb.Torque("wheel", curve, name="motor")], **more
    )  # fmt: skip


@pytest.mark.parametrize("kind", SCALES)
class TestClosedForm:
    """J w' = -k s(t) w has the solution w = w_0 exp(-(k/J) int s)."""

    def speed(self, kind: str, times: Any) -> Any:
        return SPEED * np.exp(-LOSS / INERTIA * SCALES[kind].integral(times))

    def test_speed_and_energy(self, kind: str) -> None:
        found = wb.simulate(wheel(LINE * SCALES[kind]), 4.0)
        expected = self.speed(kind, found["time"].to_numpy())
        assert found["velocity"][:, 0].to_numpy() == pytest.approx(expected, rel=2e-13)
        torque = -LOSS * SCALES[kind](found["time"].to_numpy()) * expected
        assert found["torque"][:, 0].to_numpy() == pytest.approx(torque, rel=1e-12, abs=1e-12)
        balance, gained = wb.energy(found), 0.5 * INERTIA * (expected[-1] ** 2 - SPEED**2)
        assert balance["torque_work"].item() == pytest.approx(gained, rel=1e-12, abs=1e-10)
        assert abs(balance["residual"].item()) < 1e-11
        assert wb.check(found) == []

    def test_time_at_which_a_corner_is_passed(self, kind: str) -> None:
        """The curve is the same line, with corners that do not change it before the first one."""
        after = SPEED * math.exp(-0.01)
        curve = wb.OverSpeed([-FAR, after, FAR], [-LOSS * after, -LOSS * after, -LOSS * FAR])
        area = 0.01 * INERTIA / LOSS
        end = 4.0
        times = np.linspace(0.0, end, 4001)
        passed = np.flatnonzero(SCALES[kind].integral(times) >= area)
        bracket = times[passed[0] - 1], times[passed[0]]
        expected = brentq(
            lambda t: float(SCALES[kind].integral(t)) - area, *bracket, xtol=1e-15, rtol=1e-15
        )
        found = wb.simulate(wheel(curve * SCALES[kind]), end)
        assert found["event_time"][0].item() == pytest.approx(expected, rel=1e-12, abs=1e-13)
        # Below the corner the torque does not depend on the speed.
        t = found["time"].to_numpy()
        until = found["event_time"][1].item() if found["event_time"].size > 1 else end
        inside = (t > expected) & (t < until)
        gone = SCALES[kind].integral(t[inside]) - area
        wanted = after - LOSS * after / INERTIA * gone
        assert found["velocity"].to_numpy()[inside, 0] == pytest.approx(wanted, rel=1e-12)

    def test_derivatives(self, kind: str) -> None:
        machine = wheel(LINE * SCALES[kind])
        names = ["wheel.speed", "wheel.inertia"]
        found = wb.sensitivity(machine, names, 4.0, times=[1.7, 4.0])["velocity"][..., 0]
        speed, area = self.speed(kind, [1.7, 4.0]), SCALES[kind].integral([1.7, 4.0])
        assert found[0].to_numpy() == pytest.approx(speed / SPEED, rel=1e-11)
        by_inertia = speed * LOSS / INERTIA**2 * area
        assert found[1].to_numpy() == pytest.approx(by_inertia, rel=1e-10, abs=1e-13)


def test_derivative_with_respect_to_the_factor() -> None:
    """d w/d a of the factor 1 + a sin is -(k/J) w int sin."""
    sine = wb.Harmonic(0.5, 1.3, 0.2)
    name = "motor.scale.signals.1.amplitude"
    found = wb.sensitivity(wheel(LINE * (1.0 + sine)), [name], 4.0, times=[4.0])
    area = float(sine.integral(4.0))
    speed = SPEED * math.exp(-LOSS / INERTIA * (4.0 + area))
    expected = -LOSS / INERTIA * speed * area / 0.5
    assert found["velocity"].item() == pytest.approx(expected, rel=1e-11)


def test_a_number_as_the_factor_multiplies_the_torques() -> None:
    curve = wb.OverSpeed([-1.0, 3.0, 9.0], [4.0, 2.0, -3.0])
    expected = wb.simulate(wheel(wb.OverSpeed([-1.0, 3.0, 9.0], [2.0, 1.0, -1.5])), 9.0)
    for one in (curve * 0.5, 0.5 * curve, curve * wb.Constant(0.5), 0.25 * curve * 2.0):
        found = wb.simulate(wheel(one), 9.0)
        assert np.array_equal(found["velocity"], expected["velocity"])
    assert curve * 1.0 == wb.OverSpeed([-1.0, 3.0, 9.0], [4.0, 2.0, -3.0], scale=1.0)


def test_a_flat_curve_is_the_signal() -> None:
    """Also with a contact that sticks, whose limits the torque reaches."""
    wave = wb.Harmonic(3.0, 0.7, 0.2)
    parts: dict[str, Any] = {
        "inertias": [wb.Inertia("a", 1.0, speed=1.0), wb.Inertia("b", 0.5)],
        "shafts": [wb.Shaft("a", "b", 20.0, 0.1)],
        "contacts": [contact("b", name="brake", force=5.0), contact("a", "b", name="c", force=4.0)],
    }
    flat = (wb.OverSpeed([0.0], [2.0]), wb.OverAngle([0.0], [2.0], period=0.3))
    machines = [
        wb.Machine(torques=[wb.Torque("a", one)], **parts)
        for one in (2.0 * wave, *(curve * wave for curve in flat))
    ]
    expected, *others = (wb.simulate(one, 9.0) for one in machines)
    assert expected["event_time"].size > 10
    contacts = expected["event_time"].to_numpy()
    for found in others:
        # The places where the period of an angle ends are events too.
        own = found["event_time"].to_numpy()[found["event_kind"].to_numpy() != 5]
        assert own == pytest.approx(contacts, abs=1e-12)
        for name in ("angle", "velocity", "torque", "brake_torque"):
            room = 1e-11 * float(np.abs(expected[name]).max())
            assert found[name].to_numpy() == pytest.approx(expected[name].to_numpy(), abs=room)


class TestMathieu:
    """A spring whose stiffness varies: q'' + (a - 2 p cos 2t) q = 0."""

    A, P = 1.3, 0.4

    def machine(self, angle: float = 1.0, speed: float = 0.0) -> wb.Machine:
        spring = wb.OverAngle([-FAR, FAR], [FAR, -FAR])
        factor = self.A - 2.0 * self.P * wb.Harmonic(1.0, 1.0 / math.pi, 0.5 * math.pi)
        return wb.Machine(
            inertias=[wb.Inertia("q", 1.0, angle=angle, speed=speed)],
            torques=[wb.Torque("q", spring * factor, name="spring")],
        )

    def test_motion(self) -> None:
        times = np.linspace(0.0, 20.0, 101)
        right = solve_ivp(
            lambda t, y: [y[1], -(self.A - 2.0 * self.P * math.cos(2.0 * t)) * y[0]], (0.0, 20.0),
            [1.0, 0.0], method="DOP853", rtol=1e-13, atol=1e-14, t_eval=times,
        ).y  # fmt: skip
        found = states(wb.simulate(self.machine(), 20.0, times=times))
        assert found == pytest.approx(right.T, abs=1e-10 * np.abs(right).max())

    def test_multipliers(self) -> None:
        """Their product is 1, and their sum the trace of the fundamental matrix."""
        ends = [
            states(wb.simulate(self.machine(*start), math.pi))[-1]
            for start in ((1.0, 0.0), (0.0, 1.0))
        ]
        assert np.linalg.det(ends) == pytest.approx(1.0, abs=1e-13)
        multipliers = wb.orbit(self.machine(0.0), order=1).multipliers
        assert np.prod(multipliers).real == pytest.approx(1.0, abs=1e-10)
        assert np.sum(multipliers).real == pytest.approx(np.trace(ends), abs=1e-9)


class TestOrbit:
    """J w' = c - k s(t) w: the multiplier is exp(-(k/J) int s)."""

    SCALE = 1.0 + wb.Harmonic(0.6, 0.5, 0.4)

    def test_orbit(self) -> None:
        machine = wb.Machine(
            inertias=[wb.Inertia("wheel", INERTIA, speed=SPEED)],
            torques=[
                wb.Torque("wheel", LINE * self.SCALE, name="motor"),
                wb.Torque("wheel", 4.0, name="load"),
            ],
        )
        orbit = wb.orbit(machine)
        expected = math.exp(-2.0 * LOSS / INERTIA)
        assert np.min(np.abs(orbit.multipliers)) == pytest.approx(expected, rel=1e-10)
        _, speed = orbit.states["wheel"]
        start = machine.started_at(0.0, speed)
        found = wb.simulate(start, 2.0)
        assert found["velocity"][-1].item() == pytest.approx(speed, rel=1e-9)
        # The mean power of the load is that of the losses.
        assert wb.energy(found)["torque_work"].sum().item() == pytest.approx(0.0, abs=1e-7)
        names = ["motor.scale.signals.1.amplitude", "motor.torques.0"]
        change = orbit.sensitivity(names, ["rms_velocity"])["rms_velocity"]
        for number, name in enumerate(names):
            value = machine.value(name)
            step = 1e-4 * abs(value)
            near = [
                wb.orbit(machine.replace({name: value + side * step}))
                .sensitivity(["wheel.inertia"], ["rms_velocity"])["rms_velocity_value"].item()
                for side in (-1, 1)
            ]  # fmt: skip
            expected = (near[1] - near[0]) / (2.0 * step)
            assert change[number].item() == pytest.approx(expected, rel=1e-5)

    def test_motion_and_sweep(self) -> None:
        """A factor whose variation is below rounding changes no class and no bifurcation."""
        curve = wb.OverSpeed([-9.0, 1.0, 9.0], [5.0, 1.0, -5.0])
        wave = wb.Torque("disc", wb.Harmonic(9.0, 0.9), name="wave")
        one, other = (
            wb.Machine(
                inertias=[wb.Inertia("disc", 1.0, speed=1.0)],
                shafts=[wb.Shaft("disc", "ground", 40.0)],
                contacts=[contact("disc", name="brake", force=2.0)],
                torques=[wave, wb.Torque("disc", curve * factor, name="motor")],
            )
            for factor in (1.0, 1.0 + wb.Harmonic(1e-17, 0.9))
        )
        axis = {"wave.amplitude": np.linspace(2.0, 12.0, 5)}
        first, second = (wb.sweep(each, axis, periods=20) for each in (one, other))
        for name in ("motion", "order", "stick_class"):
            assert np.array_equal(first[name], second[name])
        room = 1e-9 * float(np.abs(first["velocity"]).max())
        assert np.abs(first["velocity"] - second["velocity"]).max() < room
        multipliers = [np.sort_complex(wb.orbit(each).multipliers) for each in (one, other)]
        assert multipliers[1] == pytest.approx(multipliers[0], abs=1e-9)


def test_linear_stability_takes_the_factor_at_time_0() -> None:
    factor = 0.5 + wb.Harmonic(0.4, 1.0, 0.3)
    parts: dict[str, Any] = {
        "inertias": [wb.Inertia("a", 1.0), wb.Inertia("b", 2.0)],
        "shafts": [wb.Shaft("a", "b", 30.0, 0.2)],
    }
    load = wb.Torque("b", wb.OverSpeed([0.0, 9.0], [0.0, -18.0]), name="load")
    motor = wb.OverSpeed([0.0, 9.0], [18.0, 0.0])
    one, other = (
        wb.Machine(torques=[wb.Torque("a", motor * each, name="motor"), load], **parts)
        for each in (factor, float(factor(0.0)))
    )
    (expected,) = wb.steady_sliding(other)
    share = float(factor(0.0))
    assert expected["a"] == pytest.approx(9.0 * share / (1.0 + share), rel=1e-12)
    assert wb.steady_sliding(one) == (expected,)
    eigenvalues = [wb.stability(each, expected).eigenvalues for each in (one, other)]
    assert eigenvalues[0] == pytest.approx(eigenvalues[1], rel=1e-12)


class TestRest:
    """A brake that sticks under a throttled torque stays at rest if it cannot be released."""

    def end(self, factor: Any, force: float = 40.0) -> Any:
        machine = wb.Machine(
            inertias=[wb.Inertia("disc", 1.0, speed=3.0), wb.Inertia("rotor", 0.5, speed=3.0)],
            shafts=[wb.Shaft("disc", "rotor", 200.0, 3.0)],
            contacts=[contact("disc", name="brake", force=force)],
            torques=[
                wb.Torque("rotor", wb.OverSpeed([-10.0, 10.0], [12.0, 0.0]) * factor, name="motor"),
            ],
        )  # fmt: skip
        found = wb.simulate(machine, 30.0, until="rest")
        later = wb.simulate(machine, 30.0)
        return found, later

    def test_a_throttle_that_closes(self) -> None:
        found, later = self.end(wb.Ramp(1.0, 0.0, 1.0))
        assert found.attrs["at_rest"] == 1
        end = found.attrs["final_time"]
        assert 1.0 <= end < 30.0
        assert later["sticking"].sel(time=later["time"] >= end).all()

    def test_a_throttle_that_stays_open(self) -> None:
        """The torque at rest is 6 N m times the factor: the brake holds it, or does not."""
        holds = 0.5 * 40.0
        for value in (0.5, 3.0, 3.3, 3.4):
            found, later = self.end(wb.Ramp(0.0, value, 0.5))
            rests = bool(later["sticking"][-1].all())
            assert bool(found.attrs["at_rest"]) == rests
            assert rests == (6.0 * value < holds), (value, holds)

    def test_a_throttle_that_swings(self) -> None:
        found, _ = self.end(0.5 + wb.Harmonic(0.2, 1.0))
        assert found.attrs["at_rest"] == 0


@pytest.mark.parametrize("rounded", [False, True])
@pytest.mark.parametrize(
    "pack", [0, *(pytest.param(one, marks=pytest.mark.slow) for one in range(1, 20))]
)
def test_random_machines(pack: int, rounded: bool) -> None:
    for seed in range(3 * pack, 3 * pack + 3):
        machine = piecewise_reference.random_machine(seed, rounded=rounded)
        torques = [
            one
            if isinstance(one.signal, wb.Signal)
            else wb.Torque(one.on, one.signal * throttle(seed), one.name, one.relative_to)
            for one in machine.torques
        ]
        assert_right(machine.replace(torques=torques))


class TestTies:
    """Round numbers: what coincides with a jump of the factor, or with its zero."""

    def test_a_corner_at_a_jump(self) -> None:
        """w' = -s, s = 1 until 1 s: the speed 1 is reached as the factor changes its sign."""
        curve = wb.OverSpeed([0.0, 1.0, 2.0], [0.0, -2.0, -2.0])
        factor = wb.Table([0.0, 1.0, 1.0, 9.0], [1.0, 1.0, -1.0, -1.0])
        found = wb.simulate(wheel(curve * factor, speed=2.0), 2.0, times=[1.0, 2.0])
        assert found["velocity"][:, 0].to_numpy() == pytest.approx([1.0, 2.0], abs=1e-14)

    def test_a_start_at_a_corner(self) -> None:
        curve = wb.OverSpeed([0.0, 1.0, 2.0], [2.0, 0.0, 2.0])  # zero at the corner
        found = wb.simulate(wheel(curve * wb.Harmonic(1.0, 1.0), speed=1.0), 5.0)
        assert np.all(found["velocity"] == 1.0)

    def test_a_factor_that_is_zero_for_a_while(self) -> None:
        factor = wb.Table([0.0, 1.0, 1.0, 2.0, 2.0, 3.0], [1.0, 1.0, 0.0, 0.0, 1.0, 1.0])
        found = wb.simulate(wheel(LINE * factor), 3.0, times=[1.0, 2.0, 3.0])
        decay = math.exp(-LOSS / INERTIA)
        expected = [SPEED * decay, SPEED * decay, SPEED * decay**2]
        assert found["velocity"][:, 0].to_numpy() == pytest.approx(expected, rel=1e-14)

    def test_a_contact_that_sticks_as_the_factor_opens(self) -> None:
        """The torque 4 s(t) reaches the holding limit 0.5 N m at s = 1/8, after 0.25 s."""
        machine = wb.Machine(
            inertias=[wb.Inertia("disc", 1.0)],
            contacts=[contact("disc", name="brake", force=1.0)],
            torques=[wb.Torque("disc", wb.OverSpeed([0.0, 8.0], [4.0, 0.0]) * wb.Ramp(0, 1, 2.0))],
        )
        found = wb.simulate(machine, 2.0)
        assert found["event_time"][0].item() == pytest.approx(0.25, rel=1e-13)


def test_a_study_file() -> None:
    machine = wheel(LINE * (1.0 + wb.Harmonic(0.5, 1.3)))
    text = wb.Study(machine).to_toml()
    assert wb.read_study(text).system == machine
    changed = machine.replace({"motor.scale.signals.1.amplitude": 0.1, "motor.torques.0": 1.0})
    assert changed.parameters()["motor.scale.signals.1.amplitude"] == 0.1
    assert machine.replace({"motor.scale": 0.5}).torques[0].signal.scale == 0.5


@pytest.mark.parametrize(
    "make",
    [
        lambda: LINE * "fast",
        lambda: LINE * wb.Harmonic(1.0, 1.0) * "fast",
        lambda: LINE * LINE,
        lambda: LINE * math.nan,
        lambda: LINE * 1e7,
        lambda: wb.OverAngle([0.0], [1.0], scale=None),
    ],
)
def test_wrong_factors_are_named(make: Any) -> None:
    with pytest.raises(wb.InputError) as caught:
        make()
    assert caught.value.name == "signal.scale"
    assert caught.value.allowed


def test_a_run_beyond_the_end_of_a_factor() -> None:
    with pytest.raises(wb.InputError, match=r"motor\.scale"):
        wb.simulate(wheel(LINE * wb.Table([0.0, 1.0], [1.0, 0.0])), 2.0)
    with pytest.raises(wb.InputError, match=r"motor\.scale"):
        wb.motion(wheel(LINE * wb.Ramp(0.0, 1.0, 1.0)))


def test_a_rotation_on_which_the_factor_has_no_effect_is_steady() -> None:
    """It approaches the speed at which the curve is 0."""
    curve = wb.OverSpeed([0.0, 400.0], [180.0, -20.0])
    motion = wb.motion(wheel(curve * (1.0 + wb.Harmonic(0.5, 1.0)), speed=100.0))
    assert motion.verdict.startswith("steady rotation")
    exponent = -0.5 / INERTIA
    assert motion.exponents[-1] == pytest.approx(exponent, rel=1e-6)
