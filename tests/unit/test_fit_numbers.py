"""Fits to measured numbers: periods, stick times, harmonics, orders and measures of a run."""

from __future__ import annotations

import math

import numpy as np
import pytest
from test_fit import TIMES, machine, trace_of

import wedgebrake as wb

Numbers = dict[str, tuple[float, float]]


def belt(**more: float) -> wb.Machine:
    """A block on a moving belt, held by a spring: stick-slip."""
    made = wb.Machine(
        inertias=[wb.Inertia("block", 1.0, speed=0.1)],
        shafts=[wb.Shaft("block", "ground", name="spring", stiffness=100.0)],
        contacts=[
            wb.Contact(
                "block", name="pad", brake=wb.ConventionalBrake(radius=0.1),
                friction=wb.CoulombFriction(kinetic=0.3, static=0.5),
                actuation=wb.Actuation(initial_force=100.0), base_speed=0.1,
            )
        ],
    )  # fmt: skip
    return made.replace({name.replace("_", ".", 1): value for name, value in more.items()})


def of_belt(system: wb.Machine) -> tuple[float, float]:
    """Period and stick time in closed form.

    With k x = F_s at the beginning of slip, the block leaves the belt at x = F_k / k + D / k with
    the speed v and returns to it at F_k / k - D / k, D = F_s - F_k.
    """
    k, j, v = (
        system.value(one) for one in ("spring.stiffness", "block.inertia", "pad.base_speed")
    )
    force = system.value("pad.initial_force") * 0.1
    drop = force * (system.value("pad.static") - system.value("pad.kinetic"))
    stick = 2.0 * drop / (k * v)
    slip = 2.0 * math.sqrt(j / k) * (math.pi - math.atan(drop / (v * math.sqrt(k * j))))
    return stick + slip, stick


def numbers_of(system: wb.Machine, names: list[str], window: tuple[float, float]) -> Numbers:
    """What a fit finds for a system itself, with deviations of a hundredth."""
    guess = dict.fromkeys(names, (1.0, 1.0))
    name = next(one for one in system.quantities() if one.endswith(".inertia"))
    value = system.value(name)
    found = wb.fit(
        system, None, {name: (value, value * (1.0 + 1e-9))}, measured=guess, window=window
    )
    fitted = {one: number["fitted"] for one, number in found.numbers.items()}
    return {one: (value, 0.01 * abs(value)) for one, value in fitted.items()}


def test_period_and_stick_time_in_closed_form() -> None:
    """Both are recovered, from 30 % off, and so is the covariance of the closed form."""
    true = belt()
    period, stick = of_belt(true)
    measured = {"period": (period, 1e-4), "pad.stick_time": (stick, 2e-4)}
    names, window = ("pad.static", "block.inertia"), (1.0, 30.0)
    start = true.replace({"pad.static": 0.65, "block.inertia": 0.7})
    free = {"pad.static": (0.35, 0.9), "block.inertia": (0.3, 2.0)}
    found = wb.fit(start, None, free, measured=measured, window=window)
    assert found.converged
    for name in names:
        assert found.values[name] == pytest.approx(true.value(name), rel=1e-8)
    rows = []
    for name in names:
        at = true.value(name)
        near = [of_belt(true.replace({name: at * (1.0 + h)})) for h in (1e-5, -1e-5)]
        rows.append((np.array(near[0]) - near[1]) / (2e-5 * at) / np.array([1e-4, 2e-4]))
    matrix = np.array(rows).T
    np.testing.assert_allclose(
        found.covariance.to_numpy(), np.linalg.inv(matrix.T @ matrix), rtol=1e-6
    )
    assert found.undetermined == []
    for name, (value, sigma) in measured.items():
        told = found.numbers[name]
        assert told["fitted"] == pytest.approx(value, rel=1e-9)
        assert (told["measured"], told["sigma"], told["unit"]) == (value, sigma, "s")
        assert name in found.report()
