"""Temperature of discs against closed forms and plain quadrature."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import quad

import wedgebrake as wb
from machines import contact, single

THICK = wb.SemiInfiniteDisc(conductivity=50.0, density=7200.0, specific_heat=500.0, area=0.04)
THIN = wb.LumpedDisc(mass=8.0, specific_heat=500.0)
INERTIA, SPEED, FORCE, TORQUE = 40.0, 50.0, 100.0, 2.0
STOP = INERTIA * SPEED / (TORQUE * FORCE)


def machine(force=FORCE):
    return single(contact(radius=4.0, force=force), inertia=INERTIA, speed=SPEED)


@pytest.fixture(scope="module")
def stop():
    """A stop with a constant torque, and 5 s of rest."""
    return wb.simulate(machine(), STOP + 5.0, times=np.linspace(0.0, STOP + 5.0, 61))


def constant_torque(time):
    """The rise under q0 (1 - t/t_s) until t_s, then none: Carslaw and Jaeger, section 2.9."""
    flux = TORQUE * FORCE * SPEED / THICK.area

    def linear(t):
        return 2.0 * np.sqrt(t) - 4.0 / 3.0 * t**1.5 / STOP

    # After the stop the flux q0 (t - t_s)/t_s takes back the continued line.
    late = np.maximum(time - STOP, 0.0)
    shape = linear(time) + 4.0 / 3.0 * late**1.5 / STOP
    return flux * shape / (THICK.effusivity * math.sqrt(math.pi))


class TestSemiInfinite:
    def test_peak_of_a_constant_torque(self, stop):
        found = wb.temperature(stop, THICK)
        flux = TORQUE * FORCE * SPEED / THICK.area
        share = 4.0 / (3.0 * math.sqrt(2.0 * math.pi))
        assert share == pytest.approx(0.5319230405, abs=5e-11)
        peak = share * flux * math.sqrt(STOP) / THICK.effusivity
        assert float(found.peak_temperature) == pytest.approx(peak, rel=1e-13)
        assert float(found.peak_time) == pytest.approx(0.5 * STOP, rel=1e-6)

    def test_course_of_a_constant_torque(self, stop):
        found = wb.temperature(stop, THICK)
        expected = constant_torque(found.time.to_numpy())
        np.testing.assert_allclose(found.temperature, expected, rtol=1e-11, atol=1e-9)

    def test_flow_with_ripple_and_jump_against_quadrature(self):
        force = wb.Table([0.0, 2.0, 2.0, 50.0], [50.0, 80.0, 150.0, 150.0]) * (
            1.0 + 0.2 * wb.Harmonic(1.0, 1.5)
        )
        times = np.array([0.0, 0.7, 2.0, 2.01, 4.0])
        found = wb.temperature(wb.simulate(machine(force), 4.0, times=times), THICK)

        def power(time):
            lost = TORQUE * float(force.integral(time)) / INERTIA
            return TORQUE * float(force(time)) * (SPEED - lost)

        for time, rise, flow in zip(times[1:], found.temperature[1:], found.power[1:], strict=True):
            assert float(flow) == pytest.approx(power(time), rel=1e-12)
            # u = sqrt(time - s); the jump is a break.
            breaks = [math.sqrt(time - 2.0)] if time > 2.0 else None
            total, _ = quad(
                lambda u, time=time: 2.0 * power(time - u * u), 0.0, math.sqrt(time),
                points=breaks, limit=400, epsabs=0.0, epsrel=1e-11,
            )  # fmt: skip
            expected = total / (THICK.effusivity * THICK.area * math.sqrt(math.pi))
            assert float(rise) == pytest.approx(expected, rel=1e-9)


class TestLumped:
    def test_whole_energy_warms_the_disc(self, stop):
        found = wb.temperature(stop, THIN, share=0.9)
        energy = 0.5 * INERTIA * SPEED**2
        assert float(found.peak_temperature) == pytest.approx(0.9 * energy / 4000.0, rel=1e-13)
        part = 1.0 - (1.0 - np.minimum(found.time / STOP, 1.0)) ** 2
        np.testing.assert_allclose(found.heat, 0.9 * energy * part, rtol=1e-12, atol=1e-8)
        np.testing.assert_allclose(found.temperature, found.heat / 4000.0, rtol=1e-14)

    def test_power_is_that_of_the_response(self, stop):
        found = wb.temperature(stop, THIN)
        power = stop.brake_torque[:, 0] * stop.sliding_velocity[:, 0]
        np.testing.assert_allclose(found.power, power, rtol=1e-12, atol=1e-8)


class TestBadInput:
    @pytest.mark.parametrize(
        ("name", "given"),
        [("disc", 3.0), ("contact", "clutch"), ("share", 1.5), ("share", "half")],
    )
    def test_arguments(self, stop, name, given):
        with pytest.raises(wb.InputError) as error:
            wb.temperature(stop, **{"disc": THIN, name: given})
        assert error.value.name == name

    @pytest.mark.parametrize("name", ["mass", "specific_heat"])
    def test_discs(self, name):
        with pytest.raises(wb.InputError) as error:
            wb.LumpedDisc(**{"mass": 1.0, "specific_heat": 500.0, name: 0.0})
        assert error.value.name == f"disc.{name}"

    def test_units(self):
        found = wb.SemiInfiniteDisc(50.0, "7.2 g/cm^3", "0.5 kJ/(kg K)", "400 cm^2")
        assert found.effusivity == pytest.approx(THICK.effusivity, rel=1e-15)
        assert found.area == pytest.approx(THICK.area, rel=1e-15)


@pytest.mark.parametrize(("steepness", "periods"), [(50.0, 20), (1000.0, 20)])
def test_heat_of_a_steep_smooth_law(steepness, periods):
    """Rounding of time and speed in the torque is not taken for vibration."""
    system = wb.paper.system(eta=-24, f=0.63, F0=0.036, alpha=1.18, brake="wedge").replace(
        friction=wb.SmoothedFriction(kinetic=0.3, steepness=steepness)
    )
    response = wb.simulate(system, periods=periods, rtol=1e-11)
    disc = wb.LumpedDisc(mass=8.0, specific_heat=500.0)
    heat = wb.temperature(response, disc)["heat"][-1].item()
    # Without the series: by the stepper and interpolation between the samples.
    assert heat == pytest.approx(wb.energy(response)["friction_heat"].sum().item(), rel=1e-5)
