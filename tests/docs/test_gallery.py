"""The numbers that the gallery states, from equations of their own."""

from math import tan
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import cumulative_trapezoid, solve_ivp
from scipy.linalg import expm
from scipy.optimize import brentq

import wedgebrake as wb

ROOT = Path(__file__).parents[2]


def section(title: str) -> str:
    text = (ROOT / "docs/gallery.md").read_text(encoding="utf-8")
    return " ".join(text.partition(f"## {title}\n")[2].partition("\n## ")[0].split())


def example(name: str) -> wb.Study:
    return wb.load_study(ROOT / "examples" / f"{name}.toml")


class TestTipIn:
    """An engine and a vehicle with backlash, by SciPy's integrator."""

    ENGINE, VEHICLE, STIFFNESS, DAMPING, HALF = 0.3, 4.0, 400.0, 0.3, 0.03
    ROAD = -10.0

    def shaft(self, twist, rate):
        """Torque beyond the backlash; spring and damper do not pull."""
        contact = self.STIFFNESS * (np.abs(twist) - self.HALF) + self.DAMPING * rate * np.sign(
            twist
        )
        return np.where(np.abs(twist) > self.HALF, np.sign(twist) * np.maximum(contact, 0.0), 0.0)

    def reference(self, gain, times):
        def rates(time, state):
            pedal = np.interp(time, [0.0, 0.5, 0.6, 2.0, 2.1], [-15.0, -15.0, 100.0, 100.0, -15.0])
            rate = state[2] - state[3]
            torque = self.shaft(state[0] - state[1], rate)
            engine = pedal + np.clip(-gain * rate, -60.0, 60.0) - torque
            return [*state[2:], engine / self.ENGINE, (torque + self.ROAD) / self.VEHICLE]

        found = solve_ivp(
            rates, (0.0, times[-1]), np.zeros(4), t_eval=times, rtol=1e-9, atol=1e-10, max_step=1e-3
        )
        return self.shaft(found.y[0] - found.y[1], found.y[2] - found.y[3])

    @pytest.mark.parametrize(("gain", "flanks"), [(0.0, 9), (8.0, 1)])
    def test_shaft_torque(self, gain, flanks):
        study = example("tip_in")
        machine = study.system.replace({"antijerk.proportional": gain})
        response = wb.simulate(machine, **study.arguments())
        times, found = response.time.to_numpy(), response.shaft_torque.to_numpy()[:, 0]
        right = self.reference(gain, times)
        assert found == pytest.approx(right, abs=2e-3)
        after = np.sign(np.where(np.abs(right) > 0.01, right, 0.0))[times >= 2.0]
        assert np.count_nonzero(np.diff(after[after != 0.0])) == flanks
        last = 100.0 - self.ENGINE * (100.0 + self.ROAD) / (self.ENGINE + self.VEHICLE)
        text = section("Tip-in through the backlash")
        assert f"{last:.1f} N m" in text
        assert f"{100.0 * (right.max() / last - 1.0):.0f} %" in text

    @pytest.mark.parametrize("gain", [0.0, 8.0])
    def test_damping_of_the_shuffle(self, gain):
        each = 1.0 / self.ENGINE + 1.0 / self.VEHICLE
        damping = self.DAMPING * each + gain / self.ENGINE
        ratio = damping / (2.0 * np.sqrt(self.STIFFNESS * each))
        linear = wb.Shaft("engine", "wheels", self.STIFFNESS, self.DAMPING, name="driveline")
        machine = example("tip_in").system
        machine = machine.replace({"driveline": linear, "antijerk.proportional": gain})
        assert wb.stability(machine).modes[0].damping_ratio == pytest.approx(ratio, rel=1e-12)
        assert f"{100.0 * ratio:.2g} %" in section("Tip-in through the backlash")


@pytest.mark.parametrize("delay", [0, 1])
def test_limit_of_the_controlled_torque(delay):
    """Multipliers of the caliper, the motor and the controller, from sample to sample."""
    inertia, stiffness, damping, lag, step = 0.05, 20000.0, 10.0, 0.01, 0.001
    proportional, integral = 6.0, 300.0

    def matrix(friction):
        gain = 0.13 * friction / (tan(0.34) - friction)
        rates = np.zeros((4, 4))  # angle, speed, force; its command
        rates[0, 1] = 1.0
        rates[1] = np.array([-stiffness, -damping, gain, 0.0]) / inertia
        rates[2, 2:] = -1.0 / lag, 1.0 / lag
        held = expm(rates * step)[:3]
        measured = np.array([stiffness, damping, 0.0])
        # After a sample: angle, speed, force, sum, output.
        found = np.zeros((5, 5))
        found[:3, :3], found[3, 3] = np.eye(3), 1.0
        found[3, :3] = -integral * step * measured
        found[4] = found[3] - np.array([*(proportional * measured), 0.0, 0.0])
        moved = np.eye(5)
        moved[:3, :3], moved[:3, 4] = held[:, :3], held[:, 3]
        if delay == 0:
            return found @ moved
        late = np.zeros((6, 6))  # ... and the output that is applied next
        late[:4, :4] = found[:4, :4]
        late[4, 5] = 1.0
        late[5, :4] = found[4, :4]
        moved = np.eye(6)
        moved[:3, :3], moved[:3, 4] = held[:, :3], held[:, 3]
        return late @ moved

    limit = brentq(lambda one: np.abs(np.linalg.eigvals(matrix(one))).max() - 1.0, 0.2, 0.3)
    system = example("torque_control").system.replace({"loop.delay": delay})
    found = wb.hopf(system, "brake.kinetic", between=(0.15, 0.34))
    assert found.value == pytest.approx(limit, rel=1e-8)
    values = np.linalg.eigvals(matrix(limit))
    turn = np.abs(np.angle(values[np.argmax(np.abs(values))]))
    assert found.frequency == pytest.approx(turn / (2.0 * np.pi * step), rel=1e-6)
    shown = f"{limit:.4f}" if delay else f"{limit:.3f}"
    assert shown in section("A brake whose torque is controlled")


@pytest.mark.parametrize("release", [0.1, 0.2, 0.4])
def test_shift(release):
    """The band slips where the torque on the ring is its capacity; the clutch takes heat."""
    study = example("shift")
    machine = study.system.replace({"band.initial_force.duration": release})
    response = wb.simulate(machine, **study.arguments())
    times = np.linspace(0.0, 1.5, 300001)
    clutch = np.clip(600.0 * (times - 0.5), 0.0, 240.0)
    band = np.clip(240.0 * (1.0 - (times - 0.5) / release), 0.0, 240.0)
    # Speeds of turbine, ring and carrier, and the torque of the gear on the sun.
    balance = np.array([
        [0.2, 0.0, 0.0, 1.0], [0.0, 0.05, 0.0, 2.0], [0.0, 0.0, 6.0, -3.0], [1.0, 2.0, -3.0, 0.0]
    ])  # fmt: skip
    outer = np.array([100.0 - clutch, 0.0 * clutch, clutch - 40.0, 0.0 * clutch])
    held = balance.copy()
    held[1] = 0.0, 1.0, 0.0, 0.0  # the ring does not accelerate
    first = np.linalg.solve(held, outer)
    on_ring = -2.0 * first[3]
    at = np.argmax(np.abs(on_ring) > band)
    begin = response.stick_end[response.stick_contact == 0].max().item()
    assert begin == pytest.approx(times[at], abs=1e-5)
    outer[1] = -np.sign(on_ring[at]) * band
    rates = np.where(times < times[at], first, np.linalg.solve(balance, outer))
    sliding = 140.0 + cumulative_trapezoid(rates[0] - rates[2], times, initial=0.0)
    end = np.argmax(sliding <= 0.0)
    assert response.stick_start[response.stick_contact == 1].item() == pytest.approx(
        times[end], abs=1e-4
    )
    heat = np.trapezoid((clutch * sliding)[:end], times[:end])
    found = wb.energy(response).friction_heat.sel(contact="clutch").item()
    assert found == pytest.approx(heat, rel=1e-5)
    if release == 0.2:
        text = section("A gear shift under load")
        assert f"{1e-3 * heat:.2f} kJ" in text
        assert f"{times[at]:.4f} s" in text
        assert f"{band[at]:.0f} N m" in text
