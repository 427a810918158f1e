"""Examples of the Modelica Standard Library from their published parameters.

Of Mechanics.Rotational: Backlash (with ElastoBacklash2), First, DemoFreeWheel, CoupledClutches,
OneWayClutch and SimpleGearShift; of Mechanics.Translational: PreLoad, the spool of a valve. Where
the motion has a closed form, it is compared event by event; otherwise it is put into its equations,
see ``verified``. The friction coefficient of all clutches is 0.5.
"""

from __future__ import annotations

import math
from typing import Any, ClassVar

import numpy as np
import pytest
from scipy.linalg import expm
from scipy.optimize import brentq

import wedgebrake as wb
from machines import contact
from verified import error_of

MU = 0.5


def events(response: Any, part: str) -> np.ndarray:
    """Times of the events of a part."""
    if "event_part" in response:
        names = response["event_part"].to_numpy()
    else:  # contacts alone have events
        names = response["contact"].to_numpy()[response["event_contact"].to_numpy().astype(int)]
    return response["event_time"].to_numpy()[names == part]


def clutch(a: str, b: str, name: str, force: Any, peak: float = 1.0, arm: float = 1.0) -> Any:
    """A clutch of several plates: a tenth of the coefficient on ten times the arm."""
    law = wb.CoulombFriction(kinetic=0.1 * MU, static=0.1 * peak * MU)
    return contact(a, b, name=name, friction=law, force=force, radius=10.0 * arm)


class TestBacklash:
    INERTIA, STIFFNESS, DAMPING = 5.0, 2e4, 50.0
    HALF, START = math.pi / 8.0, math.pi / 2.0

    def machine(self) -> wb.Machine:
        ends = (-self.HALF, self.HALF)
        shaft = wb.Shaft("body", "ground", self.STIFFNESS, self.DAMPING, name="stop", gap=ends)
        body = wb.Inertia("body", self.INERTIA, self.START)
        return wb.Machine(inertias=[body], shafts=[shaft])

    def pressed(self, x: float, v: float, t: Any) -> tuple[Any, Any]:
        """Twist beyond the limit, and speed, a time after others."""
        rate = self.DAMPING / (2.0 * self.INERTIA)
        omega = math.sqrt(self.STIFFNESS / self.INERTIA - rate**2)
        slope = (v + rate * x) / omega
        cos, sin, decay = np.cos(omega * t), np.sin(omega * t), np.exp(-rate * t)
        there = decay * (x * cos + slope * sin)
        return there, -rate * there + decay * omega * (slope * cos - x * sin)

    def test_contacts_and_flights(self) -> None:
        """Contact ends where spring and damper together would pull; then the body flies."""

        def push(t: float) -> float:
            there, rate = self.pressed(x, v, t)
            return float(self.STIFFNESS * there + self.DAMPING * rate)

        t, x, v, found = 0.0, self.START - self.HALF, 0.0, list[float]()
        while t < 1.0:
            # The torque vanishes once before the twist does, within half a period.
            times = np.linspace(1e-6, 0.06, 6001)
            first = int(np.flatnonzero(np.array([push(one) for one in times]) < 0.0)[0])
            end = brentq(push, times[first - 1], times[first], xtol=1e-16)
            left, v = (float(one) for one in self.pressed(x, v, end))
            flight = (left + 2.0 * self.HALF) / -v
            found += [t + end, t + end + left / -v, t + end + flight]
            t, x, v = t + end + flight, 0.0, -v  # the other stop, mirrored
        expected = np.array(found)
        response = wb.simulate(self.machine(), 1.0)
        seen = events(response, "stop")
        assert seen.size > 15
        np.testing.assert_allclose(seen, expected[: seen.size], atol=1e-12)
        assert expected[seen.size] > 1.0

    def test_equations(self) -> None:
        assert error_of(self.machine(), 1.0) < 1e-10


def test_first() -> None:
    """A motor with a gear of ratio 10 on a load behind a spring, with damping in the bearing."""
    machine = wb.Machine(
        inertias=[wb.Inertia("motor", 0.1), wb.Inertia("gear", 2.0), wb.Inertia("load", 2.0)],
        joints=[wb.Gear("motor", "gear", 10.0, name="ideal")],
        shafts=[wb.Shaft("gear", "load", 1e4), wb.Shaft("gear", "ground", 0.0, 10.0)],
        torques=[wb.Torque("motor", wb.Harmonic(10.0, 5.0))],
    )
    times = np.linspace(0.0, 1.0, 101)
    response = wb.simulate(machine, 1.0, times=times)
    # Angles and speeds of gear and load, and the sine and the cosine of the torque.
    omega, inertia = 10.0 * math.pi, 2.0 + 10.0**2 * 0.1
    matrix = np.zeros((6, 6))
    matrix[0, 2] = matrix[1, 3] = 1.0
    matrix[2, [0, 1, 2, 4]] = np.array([-1e4, 1e4, -10.0, 10.0 * 10.0]) / inertia
    matrix[3, [0, 1]] = np.array([1e4, -1e4]) / 2.0
    matrix[4, 5], matrix[5, 4] = omega, -omega
    expected = np.array([expm(matrix * t)[:, 5] for t in times])
    found = response.sel(inertia=["gear", "load"])
    np.testing.assert_allclose(found["angle"], expected[:, :2], atol=1e-12)
    np.testing.assert_allclose(found["velocity"], expected[:, 2:4], atol=1e-11)
    # The joint accelerates the motor: torque = 10 sin - 0.1 times 10 times that of the gear.
    rate = expected @ matrix[2]
    torque = 10.0 * expected[:, 4] - 0.1 * 10.0 * rate
    np.testing.assert_allclose(response["joint_torque"][:, 0], torque, atol=1e-11)


def test_freewheel_from_a_prescribed_speed() -> None:
    """A load with damping of 5 N m s/rad that a shaft of 5 sin(10 pi t) rad/s drives forwards."""
    size, omega, damping = 5.0, 10.0 * math.pi, 5.0
    machine = wb.Machine(
        inertias=[wb.Inertia("load", 1.0), wb.Driven("drive", wb.Harmonic(size, 5.0))],
        contacts=[wb.OneWayClutch("load", "drive", "free", direction=-1)],
        shafts=[wb.Shaft("load", "ground", 0.0, damping)],
    )
    response = wb.simulate(machine, 1.0)
    # It overruns where the drive would have to brake it: w' + 5 w = 0.
    release = (math.pi - math.atan(omega / damping)) / omega
    speed, expected = size * math.sin(omega * release), list[float]()
    for period in range(5):
        start = period / 5.0
        expected.append(start + release)

        def ahead(t: float, start: float = start) -> float:
            return speed * math.exp(-damping * (t - start - release)) - size * math.sin(omega * t)

        expected.append(brentq(ahead, start + 0.2, start + 0.25, xtol=1e-16))
    found = events(response, "free")
    np.testing.assert_allclose(found, expected[: found.size], atol=1e-13)
    assert found.size == 9
    sliding = response["time"].to_numpy()[response["sticking"].to_numpy()[:, 0] == 0]
    later = sliding[(sliding > release) & (sliding < expected[1])]
    seen = response["velocity"].sel(inertia="load").sel(time=later)
    np.testing.assert_allclose(seen, speed * np.exp(-damping * (later - release)), rtol=1e-12)


class TestCoupledClutches:
    CAPACITY = 10.0

    def machine(self) -> wb.Machine:
        force = self.CAPACITY / MU
        steps = [
            wb.Table([0.0, begin, begin, 2.0], [0.0, 0.0, force, force]) for begin in (0.4, 0.9)
        ]
        # The force of the first clutch vanishes at 1.25 s.
        wave = wb.Harmonic(force, 0.2, 0.5 * math.pi) * wb.Table(
            [0.0, 1.25, 1.25, 2.0], [1.0, 1.0, 0.0, 0.0]
        )
        forces = [wave, *steps]
        return wb.Machine(
            inertias=[wb.Inertia("J1", 1.0, speed=10.0),
                      *(wb.Inertia(f"J{i}", 1.0) for i in (2, 3, 4))],
            contacts=[
                clutch(f"J{i}", f"J{i + 1}", f"clutch{i}", one, peak=1.1)
                for i, one in enumerate(forces, 1)
            ],
            torques=[wb.Torque("J1", wb.Harmonic(10.0, 5.0))],
        )  # fmt: skip

    def test_the_first_two_sticks(self) -> None:
        """Until the first, all clutches slip in one direction: the speeds are integrals."""
        fast, slow, c = 10.0 * math.pi, 0.4 * math.pi, self.CAPACITY

        def given(t: float) -> float:
            return c / slow * math.sin(slow * t)

        stick = brentq(lambda t: given(t) - 2.0 * c * (t - 0.4), 0.5, 0.9, xtol=1e-16)
        response = wb.simulate(self.machine(), 1.5)
        assert events(response, "clutch2")[0] == pytest.approx(stick, abs=1e-14)
        # Then one inertia of J2 and J3.
        both = given(stick) - c * (stick - 0.4)

        def ahead(t: float) -> float:
            one = 10.0 + 10.0 / fast * (1.0 - math.cos(fast * t)) - given(t)
            return one - both - 0.5 * (given(t) - given(stick))

        meets = brentq(ahead, stick, 0.9, xtol=1e-16)
        assert events(response, "clutch1")[0] == pytest.approx(meets, abs=1e-14)

    def test_momentum(self) -> None:
        response = wb.simulate(self.machine(), 1.5)
        time, fast = response["time"].to_numpy(), 10.0 * math.pi
        expected = 10.0 + 10.0 / fast * (1.0 - np.cos(fast * time))
        np.testing.assert_allclose(response["velocity"].sum("inertia"), expected, rtol=1e-13)
        assert wb.check(response) == []

    def test_equations(self) -> None:
        assert error_of(self.machine(), 1.25) < 1e-9


def test_engaged_one_way_clutch() -> None:
    """A freewheel beside a clutch that is pressed now and then; their torque pulls on one side."""
    pulses = wb.Table(
        [0.0, 0.3, 0.3, 0.95, 0.95, 1.6, 1.6, 2.0], [0.0, 0.0, 3.0, 3.0, 0.0, 0.0, 3.0, 3.0]
    )
    machine = wb.Machine(
        inertias=[wb.Inertia("in", 1.0, speed=-0.5), wb.Inertia("out", 1.0)],
        contacts=[
            clutch("in", "out", "pressed", pulses, peak=25.0),
            wb.OneWayClutch("in", "out", "free"),
        ],
        torques=[wb.Torque("in", wb.Harmonic(10.0, 3.0))],
    )
    response = wb.simulate(machine, 2.0)
    one, two = response["velocity"].to_numpy().T
    assert np.all(one - two <= 1e-13)
    omega, time = 6.0 * math.pi, response["time"].to_numpy()
    given = -0.5 + 10.0 / omega * (1.0 - np.cos(omega * time))
    np.testing.assert_allclose(one + two, given, atol=1e-13)
    # Until they turn together, the first inertia is alone.
    meets = brentq(
        lambda t: -0.5 + 10.0 / omega * (1.0 - math.cos(omega * t)), 0.0, 0.2, xtol=1e-16
    )
    assert events(response, "free")[0] == pytest.approx(meets, abs=1e-14)
    assert error_of(machine, 2.0) < 1e-9


@pytest.mark.parametrize("ring", [0.02, 0.5])
def test_gear_shift(ring: float) -> None:
    """A planetary gear whose ring a brake holds, then joined to the sun by a clutch.

    The published ring has no inertia; while it is held, its inertia has no effect.
    """
    ratio, engine, load, torque = 75.0 / 50.0, 1.0, 10.0, 20.0
    drag = 20.0 / 10.471975511966**2
    shift = [0.0, 2.0, 2.1, 5.0]
    machine = wb.Machine(
        inertias=[wb.Inertia("engine", engine), wb.Inertia("ring", ring), wb.Inertia("load", load)],
        joints=[wb.Planetary("engine", "ring", "load", ratio)],
        contacts=[
            clutch("ring", "ground", "brake", wb.Table(shift, [100.0, 100.0, 0.0, 0.0]), arm=2.0),
            clutch("engine", "ring", "clutch", wb.Table(shift, [0.0, 0.0, 100.0, 100.0]), arm=2.0),
            wb.Drag("load", quadratic=drag),
        ],
        torques=[wb.Torque("engine", wb.Table([0.0, 0.5, 0.5, 5.0], [0.0, 0.0, torque, torque]))],
    )  # fmt: skip
    response = wb.simulate(machine, 5.0, samples=1001)
    time, speeds = response["time"].to_numpy(), response["velocity"]
    first = (time > 0.5) & (time < 2.0)
    # J w' = T - k w^2 in the coordinate of the load, with the ring at rest.
    gain = 1.0 + ratio
    inertia, pull = load + gain**2 * engine, gain * torque
    expected = math.sqrt(pull / drag) * np.tanh(
        math.sqrt(pull * drag) / inertia * (time[first] - 0.5)
    )
    np.testing.assert_allclose(speeds.sel(inertia="load")[first], expected, rtol=1e-10)
    np.testing.assert_allclose(speeds.sel(inertia="engine")[first], gain * expected, rtol=1e-10)
    # Locked as a whole.
    locked = events(response, "clutch").max()
    assert 2.0 < locked < 3.0
    last = time > locked + 1e-9
    wheel = speeds.sel(inertia="load")[last].to_numpy()
    for name in ("engine", "ring"):
        np.testing.assert_allclose(speeds.sel(inertia=name)[last], wheel, rtol=1e-12)
    rest, whole = math.sqrt(torque / drag), engine + ring + load
    ratios = (wheel - rest) / (wheel + rest)
    decay = np.exp(-2.0 * math.sqrt(torque * drag) / whole * (time[last] - time[last][0]))
    np.testing.assert_allclose(ratios, ratios[0] * decay, rtol=1e-9, atol=1e-12)
    assert wb.check(response) == []


class TestPreloadedSpool:
    """A spool that one spring between two plates holds: Translational, PreLoad, as masses [kg, m].

    The damping of its contacts is limited by their elastic force, here only to pushing. Contacts
    open and close so slowly that this differs in the first milliseconds alone.
    """

    STOP, SPRING, FRICTION = (1e6, 250.0), 20e3, 2500.0
    GAP, COMPRESSION, OMEGA = 0.00175, 0.00325, 2.0 * math.pi * 0.01
    # Factors of the positions of spool, left and right plate in the twist, and its limit.
    CONTACTS: ClassVar = {
        "outer left": ((0.0, 1.0, 0.0), 0.0),
        "outer right": ((0.0, 0.0, 1.0), GAP),
        "inner left": ((-1.0, 1.0, 0.0), 0.0),
        "inner right": ((-1.0, 0.0, 1.0), GAP),
    }  # fmt: skip

    def machine(self) -> wb.Machine:
        bodies = {"left": "ground", "right": "ground"}
        stops = []
        for name in self.CONTACTS:
            where, side = name.split()
            ends = (0.0, 1.0) if side == "left" else (-1.0, self.GAP)
            b = bodies[side] if where == "outer" else "spool"
            stops.append(wb.Shaft(side, b, *self.STOP, name=name.replace(" ", "_"), gap=ends))
        return wb.Machine(
            inertias=[wb.Inertia("spool", 0.15), *(wb.Inertia(one, 0.01) for one in bodies)],
            shafts=[
                *stops,
                wb.Shaft("left", "right", self.SPRING, rest=-self.COMPRESSION),
                wb.Shaft("spool", "ground", 0.0, self.FRICTION),
            ],
            torques=[wb.Torque("spool", wb.Harmonic(150.0, 0.01))],
        )

    def slow(self, *active: str) -> Any:
        """Positions and speeds (3,) as functions of time while some contacts are closed."""
        rows = [np.array(self.CONTACTS[one][0]) for one in active] + [np.array([0.0, 1.0, -1.0])]
        sizes = [self.STOP[0]] * len(active) + [self.SPRING]
        limits = [self.CONTACTS[one][1] for one in active] + [-self.COMPRESSION]
        stiffness = sum(c * np.outer(row, row) for c, row in zip(sizes, rows, strict=True))
        damping = sum(self.STOP[1] * np.outer(row, row) for row in rows[:-1])
        damping = damping + np.diag([self.FRICTION, 0.0, 0.0])
        load = sum(c * end * row for c, end, row in zip(sizes, limits, rows, strict=True))
        mean = np.linalg.solve(stiffness, load)
        dynamic = (
            stiffness + 1j * self.OMEGA * damping - self.OMEGA**2 * np.diag([0.15, 0.01, 0.01])
        )
        shape = np.linalg.solve(dynamic, np.array([150.0, 0.0, 0.0]))

        def motion(t: float) -> tuple[np.ndarray, np.ndarray]:
            turned = shape * np.exp(1j * self.OMEGA * t)
            return mean + turned.imag, (1j * self.OMEGA * turned).imag

        return motion

    def opens(self, name: str, *active: str) -> float:
        """Time at which the force of a contact vanishes, before the force exceeds the preload."""
        motion, (row, end) = self.slow(*active), self.CONTACTS[name]

        def push(t: float) -> float:
            x, v = motion(t)
            return float(self.STOP[0] * (np.dot(row, x) - end) + self.STOP[1] * np.dot(row, v))

        return brentq(push, 2.0, 4.0, xtol=1e-15, rtol=1e-15)

    def closes(self, name: str) -> float:
        """Time at which a contact closes again."""
        motion, (row, end) = self.slow("inner left", "outer right"), self.CONTACTS[name]
        return brentq(
            lambda t: float(np.dot(row, motion(t)[0]) - end), 45.0, 48.0, xtol=1e-15, rtol=1e-15
        )

    def test_contacts_and_positions(self) -> None:
        response = wb.simulate(self.machine(), 60.0, times=np.linspace(10.0, 45.0, 71))
        time, x = response["time"].to_numpy(), response["angle"].to_numpy()
        motion = self.slow("inner left", "outer right")
        expected = np.array([motion(one)[0] for one in time])
        np.testing.assert_allclose(x, expected, rtol=0.0, atol=1e-13)
        # Below the preload the spool hardly moves; at 150 N it has moved by (150 - 30)/20e3 m.
        assert expected[:, 0].max() == pytest.approx(120.0 / self.SPRING, rel=0.06)
        first = {name: events(response, name.replace(" ", "_")) for name in self.CONTACTS}
        first = {name: times[times > 1.0] for name, times in first.items()}
        opened = self.opens("outer left", *self.CONTACTS)
        assert first["outer left"][0] == pytest.approx(opened, abs=1e-12)
        left = self.opens("inner right", *self.CONTACTS)
        assert first["inner right"][0] == pytest.approx(left, abs=1e-12)
        for name in ("outer left", "inner right"):
            # After its force, its compression vanishes; then it closes again.
            assert first[name].size >= 3
            assert first[name][2] == pytest.approx(self.closes(name), abs=1e-12)
        # The second half period is the mirror image.
        assert first["outer right"][0] == pytest.approx(50.0 + opened, abs=1e-11)
        assert first["inner left"][0] == pytest.approx(50.0 + left, abs=1e-11)
        assert wb.check(response) == []
