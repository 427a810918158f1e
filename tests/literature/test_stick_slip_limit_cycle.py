"""The classical friction oscillator: its stick-slip limit cycle in closed form.

A mass on a spring, undamped, carried along by a turning shaft with mu_s > mu_k (den Hartog,
Mechanical Vibrations; docs/equations.md, "One inertia with one brake"). With c = 0 and no torque
a slip is an arc of a circle in the plane (theta, theta'/omega_n) about the kinetic equilibrium
theta_e = -s M_k/k, s the direction of the shaft; a stick is the chord theta' = -Omega that
closes it. With d = (M_s - M_k)/k:

    slip   from theta_e - s d to theta_e + s d in (2/omega_n)(pi - atan(omega_n d/|Omega|))
    stick  back again in 2 d/|Omega|
    amplitude about theta_e: sqrt(d^2 + (Omega/omega_n)^2)
"""

import math
from functools import cache
from typing import NamedTuple

import numpy as np
import pytest
import xarray as xr

import wedgebrake as wb
from equations import gain

STIFFNESS, NATURAL, RADIUS, FORCE, KINETIC, STATIC = 1e4, 100.0, 0.2, 300.0, 0.3, 0.33
BRAKES = {
    "conventional": wb.ConventionalBrake(radius=RADIUS),
    "wedge": wb.WedgeBrake(radius=RADIUS, angle=0.4),
}
TOLERANCE = 1e-10


class Cycle(NamedTuple):
    """The limit cycle in closed form."""

    side: int
    centre: float  # theta_e
    half: float  # d
    drive: float  # Omega

    @property
    def slip(self) -> float:
        return 2.0 / NATURAL * (math.pi - math.atan(NATURAL * self.half / abs(self.drive)))

    @property
    def stick(self) -> float:
        return 2.0 * self.half / abs(self.drive)

    @property
    def amplitude(self) -> float:
        return math.hypot(self.half, self.drive / NATURAL)

    def angle(self, since_release: np.ndarray) -> np.ndarray:
        """Angle a time after the beginning of a slip, for any number of cycles."""
        tau = np.mod(since_release, self.slip + self.stick)
        phase = NATURAL * tau
        start = -self.side * self.half
        slipping = start * np.cos(phase) - self.drive / NATURAL * np.sin(phase)
        sticking = -start - self.drive * (tau - self.slip)
        return self.centre + np.where(tau < self.slip, slipping, sticking)


def oscillator(brake: str, drive_speed: float) -> tuple[wb.BrakedDriveline, Cycle]:
    system = wb.BrakedDriveline(
        driveline=wb.Driveline(
            inertia=1.0, damping=0.0, stiffness=STIFFNESS, drive_speed=drive_speed
        ),
        brake=BRAKES[brake],
        friction=wb.CoulombFriction(kinetic=KINETIC, static=STATIC),
        actuation=wb.Actuation(initial_force=FORCE),
        excitation=wb.HarmonicTorque(amplitude=0.0, frequency=10.0),
    )
    side = 1 if drive_speed > 0.0 else -1
    moving, resting = (RADIUS * FORCE * gain(BRAKES[brake], side * mu) for mu in (KINETIC, STATIC))
    half = abs(resting - moving) / STIFFNESS
    return system, Cycle(side, -moving / STIFFNESS, half, drive_speed)


@cache
def reached(brake: str, drive_speed: float, start: str) -> tuple[Cycle, xr.Dataset]:
    """The cycle, and a run that reaches it."""
    system, cycle = oscillator(brake, drive_speed)
    initial = (0.0, -drive_speed)
    if start == "from outside":
        initial = (cycle.centre + 3.0 * cycle.amplitude, 0.0)
    duration = 2.0 * abs(cycle.centre / drive_speed) + 20.0 * (cycle.slip + cycle.stick)
    return cycle, wb.simulate(system, duration, initial=initial)


@pytest.mark.parametrize("drive_speed", [0.02, 0.5, -0.02, -0.5])
@pytest.mark.parametrize("brake", BRAKES)
@pytest.mark.parametrize("start", ["from rest", "from outside"])
class TestLimitCycle:
    """The cycle is reached at the first release, from rest and from any larger motion."""

    def test_durations(self, brake, drive_speed, start):
        cycle, r = reached(brake, drive_speed, start)
        begins, ends = r.stick_start.values[1:], r.stick_end.values
        complete = r.stick_exit.values != 0
        assert np.count_nonzero(complete) >= 15
        sticks = (ends[1:] - begins)[complete[1:]]
        periods = np.diff(ends[complete])
        assert sticks == pytest.approx(cycle.stick, rel=TOLERANCE)
        assert periods == pytest.approx(cycle.slip + cycle.stick, rel=TOLERANCE)
        assert set(r.stick_entry.values[1:]) == {cycle.side}
        assert set(r.stick_exit.values[complete]) == {cycle.side}

    def test_ends_of_the_slips(self, brake, drive_speed, start):
        cycle, r = reached(brake, drive_speed, start)
        first = int(np.argmax(r.event_kind.values == 3))
        released = r.event_angle.values[first::2]
        caught = r.event_angle.values[first + 1 :: 2]
        room = TOLERANCE * cycle.amplitude
        assert released == pytest.approx(cycle.centre - cycle.side * cycle.half, abs=room)
        assert caught == pytest.approx(cycle.centre + cycle.side * cycle.half, abs=room)

    def test_waveform_and_amplitude(self, brake, drive_speed, start):
        cycle, r = reached(brake, drive_speed, start)
        release = float(r.stick_end[0])
        later = r.time.values >= release
        error = r.angle.values[later] - cycle.angle(r.time.values[later] - release)
        assert np.max(np.abs(error)) <= TOLERANCE * cycle.amplitude
        about = r.angle.values[later] - cycle.centre
        assert np.max(np.abs(about)) <= cycle.amplitude * (1.0 + TOLERANCE)
