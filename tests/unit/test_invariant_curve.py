"""Evidence of quasi-periodic motion, on maps of the circle and on drivelines."""

from __future__ import annotations

import math

import numpy as np
import pytest

import wedgebrake as wb
from wedgebrake.analysis.invariant_curve import fills_curve

GOLDEN = 0.5 * (5.0**0.5 - 1.0)
SCALE = np.ones(2)


def sine(phase, omega, strength):
    """The sine circle map; a homeomorphism for a strength up to 1."""
    return phase + omega - strength / (2.0 * math.pi) * math.sin(2.0 * math.pi * phase)


def kinked(phase: float) -> float:
    """A homeomorphism of the circle with two corners, as of a torus with sticks."""
    share = phase % 1.0
    return phase + 0.381 + 0.1 * min(share, 1.0 - share)


def slowly_locked(phase: float) -> float:
    """Approaches an orbit of 145 returns slowly."""
    order = 145
    return phase + 89 / order - 0.0002 * math.sin(2.0 * math.pi * order * phase) / order


def on_curve(phase):
    """(n, 2): the points of phases on a curve that is not a circle."""
    angle, radius = 2.0 * np.pi * phase, 2.0 + np.cos(6.0 * np.pi * phase)
    return np.column_stack((3.0 * radius * np.cos(angle), radius * np.sin(angle)))


def orbit(turn, returns):
    """(phases, points): returns of a map of the circle."""
    phases = [0.1]
    for _ in range(2 * returns):
        phases.append(turn(phases[-1]))
    phase = np.array(phases[-returns - 1 :])
    return phase, on_curve(phase)


def test_homeomorphisms_without_orbits_fill_their_curve() -> None:
    """By the theorem of Denjoy, with corners of the map by computed rotation numbers."""
    for returns in (256, 1024):
        assert fills_curve(orbit(lambda x: x + GOLDEN, returns)[1], SCALE)
    for turn in (lambda x: sine(x, 0.6, 0.5), kinked):
        assert any(fills_curve(orbit(turn, returns)[1], SCALE) for returns in (2048, 4096, 8192))


@pytest.mark.parametrize("strength", [0.5, 0.9])
def test_tongues_of_the_sine_circle_map(strength) -> None:
    """Never in a tongue; between the tongues except beside one, where passing takes long."""
    omega = np.random.default_rng(3).uniform(0.0, 1.0, 300)
    phase, phases, late = np.full(omega.size, 0.1), [], []
    for k in range(120_000):
        if k <= 16_384:
            phases.append(phase)
        if k > 119_000:
            late.append(phase)
        phase = phase + omega - strength / (2.0 * np.pi) * np.sin(2.0 * np.pi * phase)
    # A locked motion repeats after a long time.
    turns = late[-1] - np.array(late[-2:-600:-1])
    locked = np.abs(turns - np.round(turns)).min(axis=0) < 1e-11
    found = np.zeros(omega.size, dtype=bool)
    for returns in (1024, 2048, 4096, 8192):
        window = np.array(phases[returns : 2 * returns + 1])
        found |= [fills_curve(on_curve(one), SCALE) for one in window.T]
    assert locked.sum() > 40
    assert not (locked & found).any()
    assert found.sum() >= 0.8 * (~locked).sum()


def test_phases_that_are_no_curve() -> None:
    """Chaos, decay to a focus, slow approach to an orbit, and an orbit itself fill no curve."""
    assert not fills_curve(orbit(lambda x: sine(x, 0.606, 1.3), 1024)[1], SCALE)
    for returns in (256, 512, 1024):
        assert not fills_curve(orbit(slowly_locked, returns)[1], SCALE)
        angle, radius = 2.0 * np.pi * GOLDEN * np.arange(returns + 1), np.arange(returns + 1)
        decay = np.exp(-radius / returns)
        assert not fills_curve(
            np.column_stack((decay * np.cos(angle), decay * np.sin(angle))), SCALE
        )
        for order in (3, 25, 145):
            repeated = orbit(lambda x, q=order: x + (q // 3 + 1) / q, returns)[1]
            assert not fills_curve(repeated, SCALE)


@pytest.mark.parametrize(
    ("parameters", "order"),
    [
        ({"eta": -22.47, "F0": 0.036}, 16),
        ({"eta": -32.5, "F0": 0.036}, 384),
        (
            {
                "eta": -27.578926787310195, "F0": 0.025470562061703263,
                "f": 0.7351229207305481, "alpha": 1.833730650195541,
            },
            25,
        ),
    ],
)  # fmt: skip
def test_slow_approach_to_an_orbit_is_never_quasi_periodic(parameters, order) -> None:
    """The order is that of a long run: its last points repeat to rounding, and not before."""
    system = wb.paper.system(**parameters)
    early = wb.motion(system, limit=2048)
    assert (early.kind, early.order) in {("undecided", 0), ("periodic", order)}
    assert "limit" in early.verdict or early.settled
    late = wb.motion(system)
    assert (late.kind, late.order) == ("periodic", order)
    run = wb.poincare(system, periods=100_000, transient=90_000)
    points = np.column_stack([run["angle"], run["velocity"]])
    size = np.ptp(points, axis=0)
    apart = (np.abs(points[-1] - points[-2::-1]) / size).max(axis=1)
    assert np.flatnonzero(apart < 1e-9)[0] + 1 == order
