"""Periodic orbits and their Floquet multipliers against differences of the flow at 50 digits."""

from __future__ import annotations

import pytest
import reference_mpmath as reference
from reference_mpmath import BREAKPOINT, REVERSAL, SLIP, STICK, mp

import wedgebrake as wb


def _wedge(**changes) -> wb.BrakedDriveline:
    """The paper's wedge at eta = -24, F_0 = 0.036, f = 0.63, alpha = 1.18, then changed."""
    return wb.paper.system().replace(**changes)


def _conventional(eta: float) -> wb.BrakedDriveline:
    return wb.paper.system(eta=eta, brake="conventional")


_TABLE = wb.TabulatedFriction(speeds=(0.0, 0.3, 0.8), coefficients=(0.32, 0.31, 0.3))

# name: (system, order, stable, kinds of event)
ORBITS = {
    "reversals alone": (_wedge(eta=-10.0), 1, True, {REVERSAL}),
    "unstable, as at the strange attractor": (_wedge(), 1, False, {REVERSAL}),
    "two periods, without sticks": (_wedge(eta=-18.0), 2, True, {REVERSAL}),
    "a stick": (_wedge(F0=0.09), 1, True, {REVERSAL, STICK, SLIP}),
    "five periods, unstable": (_wedge(), 5, False, {REVERSAL, STICK, SLIP, BREAKPOINT}),
    "releases and a stick": (_wedge(eta=-35.0), 2, True, {REVERSAL, STICK, SLIP, BREAKPOINT}),
    "conventional": (_conventional(-10.0), 1, True, {REVERSAL}),
    "conventional, unstable, with releases": (
        _conventional(-40.0), 1, False, {REVERSAL, BREAKPOINT},
    ),
    "turning shaft": (
        _wedge(eta=-5.0, drive_speed=1.0, amplitude=60.0), 2, True, {STICK, SLIP},
    ),
    "turning shaft, with breakaway": (
        _wedge(eta=0.0, drive_speed=1.0, amplitude=60.0, static=0.32), 1, True, {STICK, SLIP},
    ),
    # Neighbours with another velocity come to rest at once; their angle differs by its square.
    "turning shaft, begun at rest on the brake": (
        _wedge(eta=-10.0, drive_speed=0.5, amplitude=150.0), 1, True, {STICK, SLIP},
    ),
    "breakaway": (
        _wedge(F0=0.02, static=0.32), 2, True, {REVERSAL, STICK, SLIP, BREAKPOINT},
    ),
    "tabulated friction": (
        _wedge(eta=-10.0, F0=0.04).replace(friction=_TABLE),
        2, True, {REVERSAL, STICK, SLIP, BREAKPOINT},
    ),
    "no event": (_wedge(eta=10.0, drive_speed=1.0, amplitude=60.0), 1, True, set()),
}  # fmt: skip


# Together they have every kind of event, brake and friction.
ALWAYS = (
    "releases and a stick", "conventional, unstable, with releases",
    "turning shaft, with breakaway", "turning shaft, begun at rest on the brake",
    "tabulated friction", "no event",
)  # fmt: skip


@pytest.mark.parametrize(
    "name",
    [pytest.param(name, marks=() if name in ALWAYS else pytest.mark.slow) for name in ORBITS],
)
def test_orbit_and_multipliers(name) -> None:
    """The state is that of the orbit to 1e-12 of its size, the multipliers to 1e-11."""
    system, order, stable, kinds = ORBITS[name]
    found = wb.orbit(system, order)
    assert (found.found, found.order, found.stable) == (True, order, stable)

    state, there = reference.orbit(system, (found.angle, found.velocity), order)
    assert {kind for kind, _ in there.events} == kinds
    assert len(there.events) == round(found.events * order)
    size = abs(found.points).max(axis=0)
    assert abs(state[0] - found.angle) <= 1e-12 * size[0]
    assert abs(state[1] - found.velocity) <= 1e-12 * size[1]

    expected = reference.eigenvalues(there.matrix)
    worst = max(abs(mp.mpc(g) - e) for g, e in zip(found.multipliers, expected, strict=True))
    assert worst <= 1e-11 * abs(expected[0])
    if STICK in kinds:
        # A stick forgets: neighbours end on one line.
        assert found.multipliers[1] == 0.0
