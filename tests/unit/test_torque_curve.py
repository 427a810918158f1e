"""The brake torque over the sliding velocity: closed forms, and the torque of motions."""

from __future__ import annotations

import math

import numpy as np
import pytest

import wedgebrake as wb
from wedgebrake.figures.data.torque_curve import TorqueCurve

BRAKES = [
    wb.paper.system(),
    wb.paper.system().replace(brake=wb.BandBrake(wrap_angle=4.0, radius=0.2)),
    wb.paper.system().replace(
        friction=wb.TabulatedFriction(speeds=[0.0, 0.5, 1.0], coefficients=[0.3, 0.27, 0.25])
    ),
    wb.paper.system().replace(static=0.33),
    wb.paper.system().replace(friction=wb.SmoothedFriction(kinetic=0.3, steepness=100.0)),
]


def curve(system: wb.BrakedDriveline, speed: float = 10.0) -> TorqueCurve:
    found, (contact,) = wb.stability(system), system.machine.contacts
    return TorqueCurve.of(contact, system.driveline.damping, (found.forward, found.backward), speed)


@pytest.mark.parametrize("system", BRAKES)
def test_it_is_the_torque_of_a_motion(system):
    response = wb.simulate(system, periods=20)
    speed = response["velocity"].to_numpy()
    found = curve(system, float(np.abs(speed).max()))
    velocity, torque = found.line
    assert np.all(np.diff(velocity) > 0.0)
    assert velocity[0] == -velocity[-1]
    # While it slides; near the corners, between points of the curve, with their distance.
    slides = np.abs(speed) > 0.01
    moved, braked = speed[slides], response["brake_torque"].to_numpy()[slides]
    scale = float(np.abs(torque).max())
    drawn = np.interp(moved, velocity, torque)
    np.testing.assert_allclose(drawn, braked, atol=5e-3 * scale)
    if isinstance(system.friction, wb.SmoothedFriction):
        return
    # At rest it holds what the static coefficient gives.
    held = 0.2 * 300.0 * np.array([system.brake.amplification(m * system.friction.breakaway)
                                   for m in (-1.0, 1.0)])  # fmt: skip
    assert found.holding == pytest.approx(held)
    assert found.up[0] <= min(torque.min(), found.holding[0])
    assert max(torque.max(), found.holding[1]) <= found.up[1]


def test_the_wedge_is_strong_forwards_and_weak_backwards():
    """R F_a mu/(tan(angle) -+ mu)."""
    system = wb.paper.system(eta=0.0)
    forward, backward = curve(system).directions
    lever, tangent = 0.2 * 300.0 * 0.3, math.tan(system.brake.angle)
    assert forward.torque == pytest.approx(lever / (tangent - 0.3))
    assert backward.torque == pytest.approx(-lever / (tangent + 0.3))


def test_the_curve_touches_the_line_of_the_limit_at_the_hopf_bifurcation():
    """A line of slope -c: steeper curves are unstable, flatter ones stable."""
    hopf = wb.stability(wb.paper.system()).forward.hopf_eta
    for share, sign in ((1.1, -1.0), (1.0, 0.0), (0.9, 1.0)):
        forward, _ = curve(wb.paper.system(eta=share * hopf)).directions
        (v0, v1), (t0, t1) = forward.limit
        above = np.interp(v1, forward.velocity, forward.torque) - t1
        assert (t1 - t0) / (v1 - v0) == pytest.approx(-0.1)
        assert above == pytest.approx(0.0, abs=1e-9) if sign == 0.0 else above * sign > 0.0


def test_steady_sliding_of_a_turning_shaft_and_a_brake_that_locks():
    system = wb.paper.system(eta=0.0).replace(drive_speed=3.0)
    found = curve(system, 0.0)
    assert found.steady == pytest.approx((3.0, 18.0 / (math.tan(system.brake.angle) - 0.3)))
    (low, high), _ = found.directions[0].limit
    assert low < 3.0 < high
    assert found.directions[1].limit is None
    locked = curve(wb.paper.system(alpha=0.9))
    assert locked.locked
    assert locked.holding[1] == math.inf
    assert locked.directions[0].limit is None
    assert np.all(np.isfinite(locked.up))


@pytest.mark.parametrize("changes", [{"initial_force": 0.0}, {"kinetic": 0.0, "static": 0.0}])
def test_a_brake_without_torque(changes):
    found = curve(wb.paper.system().replace(**changes))
    assert np.all(found.line[1] == 0.0)
    assert found.up[0] < found.up[1]
