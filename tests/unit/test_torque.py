"""Brake torque over a window: closed forms, the equation of motion, and dense samples.

Nothing here uses the integrals of ``wedgebrake.analysis``: the mean follows from the equation
of motion, the rest from dense samples.
"""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import simpson

import wedgebrake as wb

PAPER = wb.paper.system()
BAND = wb.BrakedDriveline(
    driveline=wb.Driveline(inertia=1.0, damping=0.02, stiffness=1e4, drive_speed=2.0),
    brake=wb.BandBrake(radius=0.2, wrap_angle=4.0),
    friction=wb.CoulombFriction(kinetic=0.25, static=0.30),
    actuation=wb.Actuation(initial_force=300.0),
    excitation=wb.HarmonicTorque(amplitude=100.0, frequency=15.0),
)
FALLING = wb.TabulatedFriction(speeds=(0.0, 0.1, 0.3), coefficients=(0.4, 0.3, 0.25))
SHOE = wb.LeadingShoeBrake(radius=0.2, actuation_arm=0.2, normal_arm=0.1, friction_arm=0.08)
SYSTEMS = {
    "wedge, sticks and releases": PAPER,
    "wedge, sticks both ways": PAPER.replace(eta=0.0, F0=0.034),
    "wedge, static peak": PAPER.replace(static=0.33, eta=-30.0),
    "conventional, reverses": wb.paper.system(brake="conventional"),
    "band, on a turning shaft": BAND,
    "band, backwards": BAND.replace(drive_speed=-2.0, slope=-20.0),
    "leading shoe": PAPER.replace(brake=SHOE, slope=30.0),
    "falling friction": BAND.replace(friction=FALLING, slope=-20.0),
    "negative force": wb.paper.system(
        brake="conventional", eta=-0.8, F0=0.01, damping=20.0, release=False
    ),
}


def balance(system: wb.BrakedDriveline, response, start: float, stop: float) -> float:
    """The mean torque by eq. (1): int (T - J theta'' - c theta' - k theta) dt over the time."""
    line, torque = system.driveline, system.excitation
    time, angle, velocity = (response[name].to_numpy() for name in ("time", "angle", "velocity"))
    first, last = (int(np.argmin(np.abs(time - one))) for one in (start, stop))
    assert abs(time[first] - start) < 1e-9
    assert abs(time[last] - stop) < 1e-9
    omega = torque.angular_frequency
    work = torque.amplitude / omega * (math.cos(omega * start) - math.cos(omega * stop))
    work -= line.inertia * (velocity[last] - velocity[first])
    work -= line.damping * (angle[last] - angle[first])
    area = simpson(angle[first : last + 1], x=time[first : last + 1])
    return (work - line.stiffness * area) / (stop - start)


def window(system: wb.BrakedDriveline, first: int, last: int) -> dict[str, float]:
    period = system.excitation.period
    return {"start": first * period, "stop": last * period}


class TestClosedForms:
    @pytest.mark.parametrize("speed", [3.0, -3.0])
    @pytest.mark.parametrize("friction", ["coulomb", "smoothed"])
    @pytest.mark.parametrize("brake", ["conventional", "wedge"])
    def test_steady_sliding(self, speed, friction, brake):
        """R (F_a0 + slope |Omega|) g(+-mu_k), the spring held against it."""
        system = wb.paper.system(eta=0.0, brake=brake, friction=friction)
        system = system.replace(drive_speed=speed, amplitude=0.0, slope=-20.0, damping=3.0)
        mu = math.copysign(0.3, speed)
        gain = mu if brake == "conventional" else mu / (1.18 * 0.3 - mu)
        torque = 0.2 * (300.0 - 20.0 * 3.0) * gain
        response = wb.simulate(system, periods=5, initial=(-torque / 1e4, 0.0))
        found = wb.brake_torque(response)
        assert found.mean == pytest.approx(torque, rel=1e-9)
        assert found.mean_size == pytest.approx(abs(torque), rel=1e-9)
        assert found.peak == pytest.approx(abs(torque), rel=1e-9)

    @pytest.mark.parametrize("samples", [10, 37, 200])
    def test_rest(self, samples):
        """The brake holds the torque: no mean, 2/pi and 1 of its amplitude."""
        system = PAPER.replace(amplitude=7.0)
        response = wb.simulate(system, periods=3, samples_per_period=samples)
        found = wb.brake_torque(response)
        assert abs(found.mean) < 1e-13
        assert found.mean_size == pytest.approx(14.0 / math.pi, rel=2e-4)
        assert found.peak == pytest.approx(7.0, rel=2e-4)
        half = wb.brake_torque(response, stop=1.5 * system.excitation.period)
        assert half.mean == pytest.approx(14.0 / math.pi / 3.0, rel=1e-6)

    def test_stick_on_a_turning_shaft(self):
        """Carried along by the brake, the spring winds up evenly."""
        system = BAND.replace(amplitude=0.0)
        speed, line = -2.0, system.driveline
        response = wb.simulate(system, duration=0.005, initial=(0.0, speed))
        found = wb.brake_torque(response)
        mean = -line.damping * speed - line.stiffness * 0.5 * speed * 0.005
        assert found.mean == pytest.approx(mean, rel=1e-12)
        assert found.mean_size == pytest.approx(mean, rel=1e-12)
        assert found.peak == pytest.approx(-line.damping * speed - 1e4 * speed * 0.005, rel=1e-12)


class TestAgainstDenseSamples:
    @pytest.mark.parametrize("name", SYSTEMS)
    def test_mean_size_and_peak(self, name):
        """The mean satisfies the equation of motion."""
        system = SYSTEMS[name]
        where = window(system, 3, 9)
        found = wb.brake_torque(wb.simulate(system, periods=9, samples_per_period=40), **where)
        dense = wb.simulate(system, periods=9, samples_per_period=4000)
        assert found.mean == pytest.approx(balance(system, dense, **where), abs=1e-7 * found.peak)
        times = np.linspace(*where.values(), 200_001)
        torque = np.abs(wb.simulate(system, periods=9, times=times)["brake_torque"].to_numpy())
        assert found.mean_size == pytest.approx(float(np.mean(torque)), rel=2e-4)
        largest = float(np.max(torque))  # beside a jump, samples miss the largest
        assert largest * (1.0 - 1e-6) <= found.peak <= largest * (1.0 + 5e-4)

    def test_is_the_peak_of_motion_and_energy(self):
        response = wb.simulate(PAPER, periods=60)
        found = wb.brake_torque(response, **window(PAPER, 20, 60))
        motion = wb.motion(PAPER, 60, transient=20)
        assert found.peak == pytest.approx(motion.peak_torque, rel=1e-9)
        energy = wb.energy(response, start=20 * PAPER.excitation.period)
        assert found.peak == pytest.approx(energy.attrs["largest_peak_torque"], rel=1e-9)
        driven = wb.energy(wb.simulate(BAND, periods=20))
        length = driven.attrs["stop"] - driven.attrs["start"]
        mean = wb.brake_torque(wb.simulate(BAND, periods=20)).mean
        assert driven.attrs["total_drive_work"] == pytest.approx(2.0 * mean * length, rel=1e-9)


class TestRuns:
    def test_that_end_early(self):
        response = wb.simulate(wb.paper.system(damping=1.0, release=False), periods=250)
        assert response.attrs["status"] == "diverged"
        assert wb.brake_torque(response).peak > 1e4

    def test_bounds_may_miss_by_rounding(self):
        response = wb.simulate(PAPER, periods=50)
        frequency = PAPER.excitation.frequency
        found = wb.brake_torque(response, -1e-5, 50 / frequency * (1.0 + 1e-12))
        assert found == wb.brake_torque(response)

    @pytest.mark.parametrize(
        ("bounds", "name"),
        [
            ((None, 99.0), "stop"),
            ((0.3, 0.3), "start"),
            ((0.3, 0.2), "start"),
            ((None, math.nan), "stop"),
        ],
    )
    def test_wrong_bounds(self, bounds, name):
        with pytest.raises(wb.InputError, match=f"^{name} = "):
            wb.brake_torque(wb.simulate(PAPER, periods=9), *bounds)

    @pytest.mark.parametrize(
        "response", [None, PAPER, wb.simulate(PAPER, periods=2)[["velocity"]]], ids=type
    )
    def test_what_is_no_response(self, response):
        with pytest.raises(wb.InputError, match=r"^response = \w+"):
            wb.brake_torque(response)

    def test_too_few_samples(self):
        with pytest.raises(wb.InputError, match=r"^response"):
            wb.brake_torque(wb.simulate(PAPER, periods=9, times=[0.5]))
        with pytest.raises(wb.InputError, match=r"^response"):
            wb.brake_torque(wb.simulate(PAPER, periods=9, samples_per_period=5))
