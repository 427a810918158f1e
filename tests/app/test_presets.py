"""Every preset is a state that does what its title says."""

from __future__ import annotations

import math

import numpy as np
import pytest

import wedgebrake as wb
from wedgebrake.explorer.core.limits import MOST_EVENTS, MOST_PERIODS
from wedgebrake.explorer.core.parameter_ranges import span
from wedgebrake.explorer.core.presets import PRESETS, preset
from wedgebrake.explorer.core.snapshot import take_snapshot
from wedgebrake.explorer.core.state import axes

GROUPS = (
    "Machines to begin with",
    "Machines of several parts",
    "Responses of the paper",
    "Diagrams of the paper",
)


def simulated(name: str):
    state = preset(name).state()
    run = state.study.run
    return state, wb.simulate(state.system, periods=state.periods, initial=run.initial)


@pytest.mark.parametrize("name", PRESETS)
def test_each_is_a_state_a_study_and_has_a_motion(name):
    one = preset(name)
    state = one.state()
    assert one.name == name
    assert one.group in GROUPS
    assert state.view.axis in axes(state.system)
    low, high = span(state, state.view.axis)
    assert low < high
    assert (20 if state.counted else 1) <= state.periods <= MOST_PERIODS
    assert one.state() == state
    assert wb.read_study(state.study.to_toml()) == state.study
    assert take_snapshot(state).status in ("completed", "diverged")
    # Those of the paper run as long as its cases.
    frequency = 1.0 / state.cycle
    if name.startswith("fig"):
        assert 25.0 <= state.periods / frequency + 1e-9 < 25.0 + 1.0 / frequency


def test_as_printed_diverges_and_chaos_is_where_the_paper_has_it():
    state, response = simulated("as-printed")
    assert response.attrs["status"] == "diverged"
    assert (state.system.driveline.damping, state.system.friction.static) == (1.0, 0.33)
    assert not state.system.actuation.release
    assert wb.motion(preset("fig9c").state().system, max_events=MOST_EVENTS).kind == "chaotic"


def test_the_machines_that_teach_come_first():
    order = [GROUPS.index(one.group) for one in PRESETS.values()]
    assert order == sorted(order)
    assert {"start", "belt", "falling-friction", "clutch"} <= {
        name for name, one in PRESETS.items() if one.group == GROUPS[0]
    }


def test_the_belt_is_the_machine_of_its_example():
    """Seen from the other side: the mirror image of the motion of the machine."""
    state = preset("belt").state()
    study = wb.load_study("examples/belt.toml")
    settings = {"duration": 30.0, "method": "smooth", "times": np.linspace(0.0, 30.0, 301)}
    machine = wb.simulate(study.system, **settings)
    response = wb.simulate(state.system, **settings)
    there = machine["velocity"].sel(inertia="mass").to_numpy()
    np.testing.assert_allclose(response["velocity"].to_numpy(), -there, atol=1e-6)


@pytest.mark.parametrize("name", ["belt", "band", "falling-friction", "clutch"])
def test_stick_and_slip_about_the_drive_speed(name):
    """Rest is relative to the drum: the shaft is carried back, and lets go, again and again."""
    state, response = simulated(name)
    speed = state.system.driveline.drive_speed
    sticks = wb.sticks(response)
    assert sticks.attrs["class"] == "unidirectional stick-slip"
    assert sticks.attrs["count"] > 50
    velocity = response["velocity"].to_numpy()[-2000:]
    sticking = response["sticking"].to_numpy()[-2000:] == 1
    assert np.all(velocity[sticking] == -speed)
    assert float(np.max(velocity)) > 0.9 * speed
    assert float(np.min(velocity)) >= -speed * (1.0 + 1e-12)


def test_falling_friction_is_what_drives_it():
    """Friction constant in speed lets the same start decay."""
    state = preset("falling-friction").state()
    speeds, coefficients = zip(*state.system.friction.nodes(), strict=True)
    sliding = state.system.brake.radius * state.system.driveline.drive_speed
    level = wb.CoulombFriction(kinetic=float(np.interp(sliding, speeds, coefficients)))
    response = wb.simulate(
        state.system.replace(friction=level), periods=250, initial=state.study.run.initial
    )
    assert wb.sticks(response).attrs["class"] == "non-stick-slip"
    assert float(np.ptp(response["velocity"].to_numpy()[-500:])) < 0.01


@pytest.mark.parametrize(("slip", "fall"), [(15.0, 0.02), (30.0, 0.01), (50.0, 0.0025)])
def test_the_clutch_judders_where_its_friction_falls_faster_than_its_damping_holds(slip, fall):
    """Linear damping c + R^2 F mu'(R slip): its sign decides whether a small start grows."""
    system = preset("clutch").state().system.replace(drive_speed=slip)
    line, radius, force = system.driveline, system.brake.radius, system.actuation.initial_force
    damping = line.damping - radius**2 * force * fall
    assert wb.stability(system).damping == pytest.approx(damping, rel=1e-9)
    speeds, coefficients = zip(*system.friction.nodes(), strict=True)
    torque = radius * force * float(np.interp(radius * slip, speeds, coefficients))
    steady = -torque / line.stiffness
    decay = 0.5 * damping / line.inertia
    omega = math.sqrt(line.stiffness / line.inertia - decay**2)
    # Small enough to stay on one straight piece of the curve, over five periods.
    times = 2.0 * math.pi / omega * np.arange(6)
    start = (steady + 1e-6, 0.0)
    angle = wb.simulate(system, duration=times[-1], initial=start, times=times)["angle"]
    expected = steady + 1e-6 * np.exp(-decay * times)
    np.testing.assert_allclose(angle.to_numpy(), expected, rtol=0.0, atol=1e-10)


def test_the_wedge_locks_itself_and_the_shoe_sticks():
    state, response = simulated("self-locking")
    assert math.tan(state.system.brake.angle) < state.system.friction.kinetic
    assert wb.stability(state.system).self_locking == "kinetic"
    assert float(np.max(response["velocity"])) == 0.0
    assert take_snapshot(state).motion.kind == "at rest"
    state, response = simulated("leading-shoe")
    assert state.system.brake.kind == "leading-shoe"
    assert wb.sticks(response).attrs["class"] == "bidirectional stick-slip"
