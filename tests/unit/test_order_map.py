"""Order maps of motions with known orders."""

from __future__ import annotations

import math

import numpy as np
import pytest

import wedgebrake as wb
from machines import contact, single
from wedgebrake.figures.data import order_map

INERTIA, RATE = 2.0, 18.0
SPEED = wb.Ramp(20.0, 200.0, 10.0)
ORDERS = ((2.0, 30.0, 0.3), (4.5, 7.0, 1.0))


@pytest.fixture(scope="module")
def run_up():
    """A free inertia; its torque has two orders of the speed that it would have without them."""
    torque = INERTIA * RATE + wb.Orders(SPEED, ORDERS)
    return wb.simulate(
        wb.Machine(
            inertias=[wb.Inertia("engine", INERTIA, speed=20.0)],
            torques=[wb.Torque("engine", torque)],
        ),
        10.0,
    )


class TestRunUp:
    def test_orders_of_the_torque_are_exact(self, run_up):
        found = wb.order_map(run_up, "torque", reference=SPEED)
        for order, amplitude, _ in ORDERS:
            own = found.amplitude.sel(order=order)
            np.testing.assert_allclose(own, amplitude, rtol=1e-10)
        np.testing.assert_allclose(found.amplitude.sel(order=0.0), INERTIA * RATE, rtol=1e-10)
        near = [order for order, *_ in ORDERS] + [0.0]
        others = [one for one in found.order.to_numpy() if min(abs(one - n) for n in near) > 0.2]
        assert np.abs(found.amplitude.sel(order=others)).max() < 1e-9

    def test_speeds_and_times(self, run_up):
        turns = 8
        found = wb.order_map(run_up, "torque", reference=SPEED, turns=turns)
        # A window begins at an angle of 2 pi times its number of quarter lengths.
        begins = 2.0 * math.pi * turns / 4.0 * np.arange(found.speed.size)
        ends = begins + 2.0 * math.pi * turns
        first, last = ((np.sqrt(400.0 + 2.0 * RATE * one) - 20.0) / RATE for one in (begins, ends))
        np.testing.assert_allclose(found.speed, 2.0 * math.pi * turns / (last - first), rtol=1e-10)
        np.testing.assert_allclose(found.time, 0.5 * (first + last), rtol=1e-10)

    def test_speed_of_the_inertia(self, run_up):
        """A small order of the torque gives A/(J n omega) in the speed."""
        found = wb.order_map(run_up, "velocity", start=5.0, turns=16)
        expected = 30.0 / (INERTIA * 2.0 * found.speed)
        np.testing.assert_allclose(found.amplitude.sel(order=2.0), expected, rtol=0.03)

    def test_other_direction(self, run_up):
        system = wb.Machine(
            inertias=[wb.Inertia("engine", INERTIA, speed=-20.0)],
            torques=[wb.Torque("engine", -1.0 * (INERTIA * RATE + wb.Orders(SPEED, ORDERS)))],
        )
        back = wb.order_map(wb.simulate(system, 10.0), "velocity")
        forth = wb.order_map(run_up, "velocity")
        np.testing.assert_allclose(back.amplitude, forth.amplitude, rtol=1e-7, atol=1e-9)

    def test_driveline_follows_its_drive_speed(self):
        system = wb.BrakedDriveline(
            driveline=wb.Driveline(inertia=1.0, stiffness=1e4, damping=10.0, drive_speed=SPEED),
            brake=wb.ConventionalBrake(radius=0.2), friction=wb.CoulombFriction(kinetic=0.4),
            actuation=wb.Actuation(
                initial_force=1000.0 * (1.0 + 0.02 * wb.Orders(SPEED, [[2.0, 1.0, 0.0]]))
            ),
            excitation=wb.Harmonic(0.0, 1.0),
        )  # fmt: skip
        found = wb.order_map(wb.simulate(system, duration=10.0), "brake_torque")
        np.testing.assert_allclose(found.amplitude.sel(order=2.0), 0.02 * 80.0, rtol=1e-9)
        np.testing.assert_allclose(found.amplitude.sel(order=0.0), 80.0, rtol=1e-9)
        assert found.reference == "drive speed 20 to 200 rad/s in 10 s"


def test_stop_is_used_until_the_reference_stands():
    """The brake's torque is proportional to its force, whose ripple follows the disc."""
    ripple = 0.1 * wb.Orders(wb.Ramp(60.0, 0.0, 10.0), [[3.0, 1.0, 0.0]])
    machine = single(contact(radius=4.0, force=30.0 * (1.0 + ripple)), inertia=10.0, speed=60.0)
    found = wb.order_map(wb.simulate(machine, 12.0), "brake_torque", turns=4)
    assert found.time.max() < 10.1
    assert np.all(np.diff(found.speed) > 0.0)
    # The disc follows the ramp but for the small swing of the ripple itself.
    np.testing.assert_allclose(found.amplitude.sel(order=3.0), 6.0, rtol=0.02)


class TestBadInput:
    @pytest.mark.parametrize(
        ("name", "given"),
        [
            ("variable", "angle"), ("part", "disc"), ("reference", "disc"), ("reference", 3.0),
            ("highest", 0.0), ("turns", 0), ("turns", 1000), ("start", -1.0), ("stop", 99.0),
        ],
    )  # fmt: skip
    def test_arguments(self, run_up, name, given):
        with pytest.raises(wb.InputError) as error:
            wb.order_map(run_up, **{"variable": "torque", name: given})
        assert error.value.name == name

    def test_reference_that_stands_still(self):
        machine = wb.Machine(inertias=[wb.Inertia("disc", 1.0)])
        with pytest.raises(wb.InputError):
            wb.order_map(wb.simulate(machine, 1.0), "velocity")


class TestPicture:
    def test_shows_the_amplitudes(self, run_up):
        found = wb.order_map(run_up, "torque", reference=SPEED)
        data, _ = order_map.of_dataset(found)
        assert data.values.shape == (data.y.values.size, data.x.values.size)
        row = np.searchsorted(data.y.edges, 4.5) - 1
        np.testing.assert_allclose(data.values[row], 7.0, rtol=1e-9)
        figure = wb.plot(found, width=5.0)
        assert figure.get_figwidth() == 5.0

    @pytest.mark.parametrize(
        ("speed", "words"),
        [
            (SPEED, "speed 20 to 200 rad/s in 10 s"),
            (wb.Ramp("600 rpm", 40.0, 3.0, 1.0), "speed 62.83 to 40 rad/s in 3 s from t = 1 s"),
            (SPEED + 5.0, "speed between 25 and 205 rad/s (sum)"),
        ],
    )
    def test_tells_the_speed_of_the_reference(self, run_up, speed, words):
        _, sentence = order_map.of_dataset(wb.order_map(run_up, "torque", reference=speed))
        assert f" {words}." in sentence

    def test_needs_two_speeds(self, run_up):
        found = wb.order_map(run_up, "torque", reference=SPEED)
        with pytest.raises(wb.InputError):
            wb.plot(found.isel(speed=[0]))
