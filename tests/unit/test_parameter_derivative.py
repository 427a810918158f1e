"""Derivatives of the equations of an orbit with respect to parameters, against differences."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
import pytest
from test_orbits_of_parts import PAIRS

import wedgebrake as wb
from differences import jacobian
from machines import general, pressed, single
from wedgebrake.orbits.curves import OrbitCurve

FREQUENCY, SAMPLINGS = 10.0, 20
WEDGE = wb.paper.system(eta=-24.0, F0=0.067)
BELT = single(
    pressed("block", static=1.5, name="belt", base_speed=1.0), name="block", stiffness=1.0
)
SMOOTH = WEDGE.replace(friction=wb.SmoothedFriction(kinetic=0.3, static=0.35, steepness=50.0))


def block(actuation: wb.Actuation, torque: Any = None, **more: Any) -> Any:
    return wb.Machine(
        inertias=[wb.Inertia("block", 0.1)],
        shafts=[wb.Shaft("block", "ground", 500.0, damping=0.3, name="spring")],
        contacts=[
            wb.Contact(
                "block", "ground", name="brake", brake=wb.ConventionalBrake(radius=0.2),
                friction=wb.CoulombFriction(kinetic=0.3, static=0.35), actuation=actuation,
            )
        ],
        torques=[wb.Torque("block", torque or wb.Harmonic(15.0, FREQUENCY), name="motor")],
        **more,
    )  # fmt: skip


def digital(output: str, **more: Any) -> list[wb.Controller]:
    given: dict[str, Any] = {
        "measured": {"block.angle": 1.0}, "setpoint": 0.01, "proportional": 1.0, "integral": 5.0,
        "derivative": 0.01, "filter_time": 0.02, "sample_time": 1.0 / (SAMPLINGS * FREQUENCY),
    }  # fmt: skip
    return [wb.Controller("loop", output=output, **given | more)]


OF_SPEED = digital(
    "brake.command", measured={"block.speed": 1.0}, setpoint=0.0, integral=0.0
)  # fmt: skip
SAMPLED = wb.Actuation(initial_force=100.0, slope=-1.0, sample_time=1.0 / (SAMPLINGS * FREQUENCY))
DELAYED = wb.Actuation(**{**dict(SAMPLED), "delay": 3, "lag": 0.01})
CONSTANT, LAGGING = wb.Actuation(initial_force=100.0), wb.Actuation(initial_force=100.0, lag=0.02)
ORDERS = wb.Orders(60.0, [[1.0, 15.0, 0.2], [2.0, 3.0, 0.0]])
# A system, and the parameters; that of the branch first.
SYSTEMS: dict[str, tuple[Any, list[str]]] = {
    "a wedge brake": (
        general(WEDGE.machine), ["brake.slope", "brake.angle", "torque.frequency"],
    ),
    "one inertia": (
        WEDGE,
        [
            "slope", "damping", "stiffness", "inertia", "angle", "radius",
            "initial_force", "amplitude", "frequency",
        ],
    ),
    # Slips from rest to rest: with static friction, and without, where the torque does not jump.
    "one inertia with sticks": (
        WEDGE.replace(kinetic=0.25, static=0.3, amplitude=200.0, drive_speed=0.3),
        ["kinetic", "static", "slope", "drive_speed", "frequency"],
    ),
    "one inertia without jumps": (
        WEDGE.replace(kinetic=0.285, static=0.285, amplitude=100.0, drive_speed=0.3),
        ["slope", "damping", "stiffness", "inertia", "drive_speed", "frequency"],
    ),
    "one inertia that slides on": (
        WEDGE.replace(static=0.35, drive_speed=20.0),
        ["slope", "kinetic", "amplitude", "frequency"],
    ),
    "a belt": (BELT, ["belt.static", "belt.base_speed", "block-ground.stiffness"]),
    "smooth friction": (SMOOTH, ["steepness", "static", "frequency"]),
    "a gear": (PAIRS["a brake behind a gear"]().machine, ["gear.ratio", "brake.slope"]),
    "a moved spring end": (
        PAIRS["a moved spring end"]().machine, ["end.speed.amplitude", "end.speed.frequency"],
    ),
    "a belt on a pulley": (
        PAIRS["a belt on a pulley"]().machine, ["pulley.speed", "brake.ratio"],
    ),
    "a sampled actuation": (
        block(SAMPLED), ["brake.initial_force", "brake.kinetic", "motor.frequency"],
    ),
    "a delayed actuation with lag": (
        block(DELAYED), ["brake.initial_force", "brake.lag", "motor.frequency"],
    ),
    "a digital controller": (
        block(CONSTANT, controllers=digital("block.torque", delay=1)),
        ["loop.integral", "loop.filter_time", "motor.frequency"],
    ),
    "a commanded actuation": (
        block(LAGGING, controllers=OF_SPEED), ["loop.proportional", "motor.frequency"],
    ),
    "orders": (block(CONSTANT, ORDERS), ["motor.speed.value"]),
}  # fmt: skip


@pytest.mark.parametrize("name", SYSTEMS)
def test_derivative_is_that_of_the_equations(name: str) -> None:
    """Beside the orbit, where no equation holds. Sample times follow the period of the torque."""
    system, names = SYSTEMS[name]
    found = wb.orbit(system, 1, method="smooth" if system is SMOOTH else None)
    start = next(iter(wb.continuation(found, {names[0]: bounds(system, names[0])})))
    rng = np.random.default_rng(0)
    for one in names:
        value = system.value(one)
        samplings = SAMPLINGS if one == "motor.frequency" else 0
        problem = replace(start.problem.over((one,), (abs(value) or 1.0,)), samplings=samplings)
        there = replace(start, problem=problem, values=(value,))
        curve = OrbitCurve(there)
        y = curve.scaled(there)
        y[:-1] *= 1.0 + 1e-4 * rng.standard_normal(y.size - 1)
        wanted = jacobian(partial(residual, curve, y), y[-1:], 1e-4)
        matrix = curve.linearize(y)[1]
        # F is known to the rounding of its terms, over the step.
        tolerance = (1e-6 if system is SMOOTH else 1e-8) * max(1.0, np.abs(wanted).max())
        tolerance += 1e-11 * np.abs(matrix).max()
        np.testing.assert_allclose(matrix[:, -1:], wanted, 0.0, tolerance)


def residual(curve: OrbitCurve, y: np.ndarray, value: np.ndarray) -> np.ndarray:
    """F at a value of the parameter."""
    return curve.residual(np.append(y[:-1], value))


def bounds(system: Any, name: str) -> tuple[float, float]:
    value = system.value(name)
    return value, value + 0.2 * abs(value)
