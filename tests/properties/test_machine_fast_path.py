"""One inertia, one brake and one harmonic: the general solver and the closed forms agree."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import Phase, given, settings

import wedgebrake as wb
from systems import systems

PERIODS = 8
STICK, BREAKPOINT = 2, 5
SMALL = 1e-7
FEW, MANY = 25, 200
# A change of the start that grows more than this would show the rounding of both solvers.
MOST_GROWTH = 1e3


def pressed(system: wb.BrakedDriveline) -> bool:
    """Whether there is something to follow: a torque, and a force that may hold.

    A torque whose peak is that which the brake holds, to the last bits, releases it or not.
    """
    torque, force = system.excitation.amplitude, system.actuation.initial_force
    if torque == 0.0 or force == 0.0:
        return False
    static = system.friction.breakaway
    gains = [abs(system.brake.amplification(side * static)) for side in (1.0, -1.0)]
    return all(abs(system.brake.radius * force * gain / torque - 1.0) > 1e-6 for gain in gains)


def events(response: Any) -> list[tuple[float, int]]:
    """(time, kind) of sticks, slips and reversals."""
    rows = zip(response["event_time"].values, response["event_kind"].values, strict=True)
    return [(float(t), int(kind)) for t, kind in rows if kind != BREAKPOINT]


def growth(system: wb.BrakedDriveline, periods: int) -> float:
    """By how much small changes of the initial speed have grown at most."""
    line = system.driveline
    scale = system.excitation.amplitude / (line.inertia * line.natural_frequency)
    whole = wb.simulate(system, periods=periods)
    largest = 1.0
    for change in (SMALL * scale, -SMALL * scale):
        moved = wb.simulate(
            system, periods=periods, initial=(0.0, change), times=whole["time"].values
        )
        if moved.attrs["status"] != whole.attrs["status"]:
            return np.inf
        size = min(moved.sizes["time"], whole.sizes["time"])
        apart = np.abs(moved["velocity"].values[:size] - whole["velocity"].values[:size])
        largest = max(largest, float(np.max(apart)) / (SMALL * scale))
    return largest


def check(system: wb.BrakedDriveline) -> bool:
    """Compare the solvers; False if the motion is too sensitive or has no solution."""
    fast = wb.simulate(system, periods=PERIODS, max_events=5000)
    if fast.attrs["status"] != "completed" or growth(system, PERIODS) > MOST_GROWTH:
        return False
    times = fast["time"].values
    general = wb.simulate(system.machine, float(times[-1]), times=times)
    assert general.attrs["status"] == "completed", general.attrs["message"]
    period = 1.0 / system.excitation.frequency
    one, other = events(fast), events(general)
    assert [kind for _, kind in one] == [kind for _, kind in other]
    np.testing.assert_allclose(
        [t for t, _ in one], [t for t, _ in other], rtol=0, atol=1e-9 * period
    )
    for name in ("angle", "velocity"):
        expected = fast[name].values
        scale = np.max(np.abs(expected), initial=0.0)
        np.testing.assert_allclose(
            general[name].values[:, 0], expected, rtol=0, atol=1e-10 * scale, err_msg=name
        )
    return True


@settings(max_examples=FEW, deadline=None, derandomize=True, phases=[Phase.generate])
@given(systems().filter(pressed))
def test_general_solver_gives_the_closed_forms(system: wb.BrakedDriveline) -> None:
    check(system)


@pytest.mark.slow
@settings(max_examples=MANY, deadline=None, derandomize=True, phases=[Phase.generate])
@given(systems().filter(pressed))
def test_general_solver_gives_the_closed_forms_of_many(system: wb.BrakedDriveline) -> None:
    check(system)


def test_paper_brake() -> None:
    assert check(wb.paper.system(eta=-60.0, F0=0.036))


def test_turning_shaft() -> None:
    system = wb.paper.system(eta=-6.0, F0=0.036).replace(drive_speed=3.0)
    assert check(system)


def test_tabulated_friction() -> None:
    system = wb.paper.system(eta=-6.0, F0=0.036)
    mu = system.friction.kinetic
    law = wb.TabulatedFriction(
        speeds=(0.0, 0.1, 1.0), coefficients=(mu, 0.7 * mu, 0.9 * mu), static=1.1 * mu
    )
    assert check(system.replace(friction=law))
