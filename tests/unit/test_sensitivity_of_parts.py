"""Derivatives of measures by parameters of stages, gaps, curves, controllers, drives and joints."""

import math

import numpy as np
import pytest
import xarray as xr
from test_machine_orbits import controlled
from test_orbits_of_parts import PAIRS
from test_sensitivity import COULOMB, DISC, ENGINE, WEDGE, parameters
from test_sensitivity_of import OF, Values, assert_agrees

import wedgebrake as wb
from machines import pressed, single

WORKS = ("friction_heat", "base_work", "viscous_loss", "torque_work", "control_work", "drive_work")
EVERY = (*OF, "control_work", "drive_work")
MOUNT = wb.Shaft("hub", "ground", name="mount", stiffness=1000.0, damping=0.5)


def brake(**more: float) -> wb.Contact:
    force = wb.Actuation(initial_force=27.0, **more)
    return wb.Contact("disc", name="brake", brake=WEDGE, friction=COULOMB, actuation=force)


def clutch(b: str) -> wb.Contact:
    return wb.Contact(
        "disc", b, name="clutch", ratio=1.5, brake=wb.ConventionalBrake(radius=0.2),
        friction=COULOMB, actuation=wb.Actuation(initial_force=40.0),
    )  # fmt: skip


def shaft(**more: object) -> wb.Shaft:
    given = {"stiffness": 300.0, "damping": 1.0} | more
    return wb.Shaft("disc", "hub", name="shaft", ratio=1.5, **given)


def pair(**changes: object) -> wb.Machine:
    """A braked disc and a hub."""
    return wb.Machine(**{
        "inertias": [*DISC, wb.Inertia("hub", 0.5, speed=1.0)], "shafts": [shaft(), MOUNT],
        "contacts": [brake()], "torques": [ENGINE],
    } | changes)  # fmt: skip


def loop(output: str = "hub.torque", **more: object) -> wb.Controller:
    given = {
        "measured": {"disc.speed": 1.0, "shaft.torque": 0.001}, "proportional": 6.0,
        "setpoint": wb.Harmonic(3.0, 2.0, 0.1) + 1.0,
    }  # fmt: skip
    return wb.Controller(name="loop", output=output, **given | more)


END = wb.Driven("end", wb.Harmonic(3.0, 4.0, 0.2), angle=0.01)
STEPS = wb.Stages([-0.05, 0.03, 0.1], [900.0, 100.0, 400.0, 1500.0])
CURVES = [
    wb.Torque("hub", wb.OverSpeed([-2.0, 0.5, 3.0], [5.0, -3.0, -20.0]), name="motor"),
    wb.Torque(
        "disc", wb.OverAngle([0.1, 0.12, 0.17], [5.0, 20.0, -15.0], period=0.2), name="cog",
        relative_to="hub",
    ),
]  # fmt: skip
PID = {"integral": 35.0, "derivative": 0.3, "filter_time": 0.02}
# Machines, and the parts whose parameters are varied.
RUNS: dict[str, tuple[wb.Machine, set[str]]] = {
    "stages": (pair(shafts=[shaft(stiffness=STEPS, rest=0.01), MOUNT]), {"shaft"}),
    "gap with damping": (
        pair(shafts=[shaft(stiffness=3000.0, damping=2.0, rest=0.01, gap=(-0.02, 0.05)), MOUNT]),
        {"shaft"},
    ),
    "gap without damping": (
        pair(shafts=[shaft(stiffness=3000.0, damping=0.0, gap=(-0.02, 0.05)), MOUNT]), {"shaft"},
    ),
    "preload": (pair(shafts=[shaft(rest=0.03), MOUNT]), {"shaft", "mount"}),
    "curves": (pair(torques=[ENGINE, *CURVES]), {"motor", "cog"}),
    "PID": (pair(controllers=[loop(**PID)]), {"loop"}),
    "PID with limits": (
        pair(controllers=[loop(**PID | {"proportional": 26.0}, limits=(-40.0, 30.0))]), {"loop"},
    ),
    "PI of a brake": (
        pair(
            contacts=[brake(lag=0.01)],
            controllers=[
                loop(
                    "brake.command", integral=35.0, limits=(-10.0, 10.0), setpoint=1.0,
                    measured={"disc.speed": 1.0, "brake.force": 0.01},
                )
            ],
        ),
        {"loop"},
    ),
    "digital": (
        pair(
            controllers=[
                loop(
                    integral=0.5, derivative=0.01, sample_time=0.013, delay=1, limits=(-10.0, 14.0)
                )
            ]
        ),
        {"loop"},
    ),
    "driven": (
        pair(
            inertias=[*DISC, wb.Inertia("hub", 0.5, speed=1.0), END],
            shafts=[shaft(), wb.Shaft("hub", "end", 1000.0, 0.5, name="mount")],
            contacts=[brake(), clutch("end")],
        ),
        {"end", "clutch", "mount"},
    ),
    "joints": (
        wb.Machine(
            inertias=[*DISC, wb.Inertia("hub", 0.5), wb.Inertia("gear", 0.3), END],
            joints=[
                wb.Planetary("hub", "disc", "end", ratio=2.0, name="set"),
                wb.Gear("gear", "hub", -1.5, name="pair"),
            ],
            shafts=[
                wb.Shaft("disc", "ground", 1000.0, 0.5, name="mount"),
                wb.Shaft("gear", "ground", 500.0, 0.4, gap=(-0.1, 0.2), name="stop"),
            ],
            contacts=[brake()], torques=[ENGINE],
            controllers=[loop("gear.torque", measured={"gear.speed": 1.0}, setpoint=0.3)],
        ),
        {"end", "set", "pair", "stop", "loop"},
    ),
}  # fmt: skip
# Without derivatives, or with other numbers of pieces or states beside them.
WITHOUT = {
    "gap without damping": {"shaft.damping"}, "joints": {"loop.integral", "loop.derivative"},
    "PI of a brake": {"loop.derivative"},
}  # fmt: skip


def own(machine: wb.Machine, parts: set[str], without: set[str]) -> list[str]:
    """The parameters of some parts."""
    return [
        name
        for name in parameters(machine)
        if name.split(".")[0] in parts
        and name not in without
        and not name.endswith((".filter_time", "clutch.slope", "clutch.lag", "clutch.static"))
    ] + [f"{one}.filter_time" for one in parts if machine.parameters().get(f"{one}.filter_time")]


@pytest.mark.parametrize("kind", RUNS)
def test_of_a_run_against_differences(kind: str) -> None:
    machine, parts = RUNS[kind]
    names = own(machine, parts, WITHOUT.get(kind, set()))
    found = wb.sensitivity(machine, names, 0.4, of=EVERY)
    for name in names:

        def values(value: float, name: str = name) -> Values:
            near = wb.sensitivity(machine.replace({name: value}), names[:1], 0.4, of=EVERY)
            return {one: near[f"{one}_value"].to_numpy() for one in EVERY if near[one].size}

        assert_agrees(found, name, values, machine.value(name), (1e-4, 1e-5))


@pytest.mark.parametrize("kind", RUNS)
def test_works_are_those_of_the_energy(kind: str) -> None:
    machine, _ = RUNS[kind]
    found = wb.sensitivity(machine, ["disc.inertia"], 0.4, of=WORKS)
    energy = wb.energy(wb.simulate(machine, 0.4))
    for name in WORKS:
        expected = energy[name].to_numpy() if name in energy else np.zeros(0)
        np.testing.assert_allclose(found[f"{name}_value"], expected, rtol=1e-10, atol=1e-11)


def test_a_controller_has_an_output_with_a_derivative() -> None:
    # w = r (1 - e), e = exp(-K t/J); u = K r e.
    times, gain, wanted, inertia = np.linspace(0.0, 1.0, 5), 6.0, 10.0, 2.0
    motor = wb.Machine(
        inertias=[wb.Inertia("motor", inertia)],
        controllers=[
            wb.Controller("loop", {"motor.speed": 1.0}, wanted, "motor.torque", proportional=gain)
        ],
    )
    found = wb.sensitivity(motor, ["loop.proportional", "loop.setpoint"], 1.0, times=times)
    e = np.exp(-gain * times / inertia)
    expected = [wanted * e * (1.0 - gain * times / inertia), gain * e]
    np.testing.assert_allclose(found["control_output"][..., 0], expected, atol=1e-11)
    # Its work is the kinetic energy.
    measures = wb.sensitivity(motor, ["loop.proportional", "loop.setpoint"], 1.0, of=WORKS)
    w, by_gain, by_wanted = wanted * (1.0 - e[-1]), wanted * e[-1] / inertia, 1.0 - e[-1]
    np.testing.assert_allclose(
        measures["control_work"][:, 0], [inertia * w * by_gain, inertia * w * by_wanted], rtol=1e-11
    )


def test_an_impact_on_a_stop() -> None:
    """It ends at rest at gap + w sqrt(J/k), where its acceleration is w sqrt(k/J)."""
    inertia, speed, stiffness, gap = 2.0, 3.0, 800.0, 0.25
    machine = wb.Machine(
        inertias=[wb.Inertia("disc", inertia, speed=speed)],
        shafts=[wb.Shaft("disc", "ground", stiffness, name="stop", gap=(-1.0, gap))],
    )
    found = wb.sensitivity(
        machine, ["stop.stiffness", "stop.gap.1", "disc.inertia", "disc.speed"],
        gap / speed + 0.75 * math.pi * math.sqrt(inertia / stiffness),
        of=["angle_amplitude", "peak_acceleration", "viscous_loss"],
    )  # fmt: skip
    depth, peak = speed * math.sqrt(inertia / stiffness), speed * math.sqrt(stiffness / inertia)
    assert found["angle_amplitude_value"].item() == pytest.approx(0.5 * (gap + depth), rel=1e-13)
    by = [-0.25 * depth / stiffness, 0.5, 0.25 * depth / inertia, 0.5 * depth / speed]
    np.testing.assert_allclose(found["angle_amplitude"][:, 0], by, rtol=1e-11)
    by = [0.5 * peak / stiffness, 0.0, -0.5 * peak / inertia, peak / speed]
    np.testing.assert_allclose(found["peak_acceleration"][:, 0], by, rtol=1e-11, atol=1e-11)
    np.testing.assert_array_equal(found["viscous_loss"], 0.0)


def test_a_damped_stop_takes_the_energy_that_the_body_loses() -> None:
    """The spring of the stop relaxes before the body is back at the start of the gap."""
    inertia, speed = 2.0, 3.0
    machine = wb.Machine(
        inertias=[wb.Inertia("disc", inertia, speed=speed)],
        shafts=[wb.Shaft("disc", "ground", 800.0, 12.0, name="stop", gap=(-9.0, 0.25))],
    )
    names = ["stop.stiffness", "stop.damping", "disc.inertia", "disc.speed", "stop.gap.1"]
    found = wb.sensitivity(machine, names, 0.5, of=["viscous_loss", "lowest_velocity"])
    back, by = found["lowest_velocity_value"].item(), found["lowest_velocity"].to_numpy()[:, 0]
    assert -speed < back < -0.2 * speed
    lost = 0.5 * inertia * (speed**2 - back**2)
    assert found["viscous_loss_value"].item() == pytest.approx(lost, rel=1e-12)
    expected = -inertia * back * by + [0.0, 0.0, lost / inertia, inertia * speed, 0.0]
    np.testing.assert_allclose(found["viscous_loss"][:, 0], expected, rtol=1e-9, atol=1e-11)


def test_the_work_of_a_drive() -> None:
    """Through a gear it accelerates an inertia to its speed, against a damper."""
    inertia, ratio, size, damping, frequency = 2.0, 1.5, 3.0, 0.4, 0.5
    machine = wb.Machine(
        inertias=[
            wb.Inertia("disc", inertia),
            wb.Inertia("other", 1.0),
            wb.Driven("drive", wb.Harmonic(size, frequency)),
        ],
        joints=[wb.Gear("drive", "disc", ratio, name="gear")],
        shafts=[wb.Shaft("drive", "ground", 0.0, damping, name="oil")],
    )
    names = ["disc.inertia", "gear.ratio", "drive.speed.amplitude", "oil.damping"]
    found = wb.sensitivity(machine, names, 0.25 / frequency, of=["drive_work", "viscous_loss"])
    energy, heat = 0.5 * inertia * (size / ratio) ** 2, damping * size**2 * 0.125 / frequency
    assert found["drive_work_value"].item() == pytest.approx(energy + heat, rel=1e-13)
    assert found["viscous_loss_value"].item() == pytest.approx(heat, rel=1e-13)
    by = [energy / inertia, -2.0 * energy / ratio, 2.0 * (energy + heat) / size, heat / damping]
    np.testing.assert_allclose(found["drive_work"][:, 0], by, rtol=1e-11)


def swung(**changes: object) -> wb.Machine:
    """A braked disc on a spring, shaken by a torque."""
    return wb.Machine(**{
        "inertias": DISC, "contacts": [brake()], "torques": [ENGINE],
        "shafts": [wb.Shaft("disc", "ground", 1000.0, 3.0, name="shaft")],
    } | changes)  # fmt: skip


SPRING = swung().shafts[0]
BELT = single(
    pressed("block", static=1.5, name="belt", base_speed=1.0), name="block", stiffness=1.0
).replace({"block.speed": 1.0})  # fmt: skip
ON_DISC = {"measured": {"disc.speed": 1.0, "shaft.torque": 0.001}, "setpoint": 1.0}
ORBITS: dict[str, tuple[wb.Machine, list[str]]] = {
    "stages": (
        swung(
            shafts=[
                wb.Shaft(
                    "disc", "ground", wb.Stages([-0.05, 0.03], [1500.0, 800.0, 2000.0]), 3.0,
                    name="shaft", rest=0.01,
                )
            ]
        ),
        ["shaft.angles.0", "shaft.stiffnesses.2", "shaft.rest", "engine.frequency"],
    ),
    "gap with damping": (
        swung(
            shafts=[
                SPRING,
                wb.Shaft(
                    "disc", "ground", 3000.0, 10.0, name="stop", gap=(-0.08, 0.06), rest=0.005
                ),
            ]
        ),
        ["stop.gap.1", "stop.stiffness", "stop.damping", "brake.kinetic"],
    ),
    "curves": (
        swung(
            torques=[
                ENGINE, CURVES[0].model_copy(update={"on": "disc"}),
                wb.Torque("disc", wb.OverAngle([0.0, 0.05], [9.0, 2.0]), name="cog"),
            ]
        ),
        ["motor.speeds.1", "motor.torques.2", "cog.angles.1", "cog.torques.0"],
    ),
    "PID with limits": (
        swung(
            controllers=[
                loop("disc.torque", **PID | ON_DISC | {"proportional": 16.0}, limits=(-25.0, 20.0))
            ]
        ),
        ["loop.proportional", "loop.integral", "loop.limits.1", "loop.filter_time"],
    ),
    "a shaft that turns": (
        wb.Machine(
            inertias=[wb.Inertia("disc", 1.0, speed=5.0), wb.Inertia("hub", 0.5, speed=5.0)],
            shafts=[wb.Shaft("disc", "hub", 300.0, 1.0, name="shaft")],
            torques=[wb.Torque("hub", wb.Harmonic(10.0, 1.0), name="engine")],
            controllers=[
                wb.Controller(
                    "loop", {"disc.speed": 1.0}, 5.0, "disc.torque", proportional=6.0, integral=35.0
                )
            ],
        ),
        ["shaft.ratio", "loop.integral", "hub.inertia"],
    ),
    "a moved spring end": (
        PAIRS["a moved spring end"]().machine,
        ["end.speed.amplitude", "end.speed.frequency", "spring.damping"],
    ),
    "a spring end moved by a gear": (
        PAIRS["a spring end moved by a gear"]().machine,
        ["gear.ratio", "drive.speed.signals.1.amplitude", "rack.inertia"],
    ),
    "a planetary gear whose ring stands": (
        PAIRS["a planetary gear whose ring stands"]().machine, ["set.ratio", "sun.inertia"],
    ),
    "stick-slip against a stop": (
        BELT.replace(
            shafts=[
                *BELT.shafts, wb.Shaft("block", "ground", 20.0, name="stop", gap=(-9.0, 1.2)),
            ]
        ),
        ["stop.stiffness", "stop.gap.1", "belt.base_speed"],
    ),
    "stick-slip with a limited PI": (
        BELT.replace(
            controllers=[
                wb.Controller(
                    "loop", {"block.speed": 1.0}, 0.1, "block.torque", proportional=0.02,
                    integral=0.05, limits=(-0.05, 0.04),
                )
            ]
        ),
        ["loop.integral", "loop.limits.1", "loop.setpoint"],
    ),
    "stick-slip with a digital PID": (
        controlled(0.7, sample_time=None).replace(
            controllers=[
                wb.Controller(
                    "loop", {"a.angle": 1.0}, 0.0, "a.torque", proportional=0.1, integral=0.1,
                    derivative=0.1, filter_time=0.1, sample_time=0.5, delay=1,
                )
            ]
        ),
        ["loop.integral", "loop.derivative", "brake.initial_force"],
    ),
    "a digital command of a sampled force": (
        controlled(9.0, force=4.0, sample_time=0.25).replace(
            controllers=[
                wb.Controller(
                    "loop", {"b.angle": 1.0}, -8.0, "brake.command", proportional=0.1,
                    derivative=0.05, sample_time=0.5,
                )
            ]
        ),
        ["loop.setpoint", "loop.derivative", "a.inertia"],
    ),
    "a belt on a pulley": (
        PAIRS["a belt on a pulley"]().machine, ["pulley.speed", "brake.ratio", "spring.stiffness"],
    ),
}  # fmt: skip


@pytest.mark.parametrize("kind", ORBITS)
def test_of_an_orbit_against_differences(kind: str) -> None:
    """Also orbits whose driven bodies move otherwise and whose joints place bodies elsewhere.

    Without the driven bodies themselves: amplitudes of uniform speeds have no derivative.
    """
    machine, names = ORBITS[kind]
    orbit = wb.orbit(machine)
    assert orbit.found
    found = orbit.sensitivity(names)
    still = [one.name for one in machine.inertias if isinstance(one, wb.Inertia)]
    of = [one for one in EVERY if one in found and found[one].size]
    if kind == "curves":  # that over the angle is zero
        of.remove("torque_work")
    every = [one for name in ("period", *of) for one in (name, f"{name}_value")]

    def chosen(dataset: xr.Dataset) -> xr.Dataset:
        return dataset[every].sel(inertia=still)

    for name in names:

        def values(value: float, name: str = name) -> Values:
            near = machine.replace({name: value})
            start = None if machine.driven or machine.joints else orbit.initial
            again = wb.orbit(near, orbit.order, initial=start).sensitivity(names[:1], of)
            return {one: chosen(again)[f"{one}_value"].to_numpy() for one in ("period", *of)}

        assert_agrees(chosen(found), name, values, machine.value(name), (1e-3, 1e-4, 1e-5))


def test_a_spring_end_starts_at_its_angle() -> None:
    """Turned with its spring it changes nothing else; the body turns with it."""
    machine = PAIRS["a moved spring end"]().machine
    found = wb.orbit(machine).sensitivity(["end.angle", "spring.rest", "end.speed.phase"])
    np.testing.assert_allclose(found["angle"].sel(inertia="end")[:2], [1.0, 0.0], atol=1e-12)
    np.testing.assert_allclose(found["angle"].sel(inertia="body")[:2], [1.0, 1.0], rtol=1e-9)
    np.testing.assert_allclose(found["friction_heat"][:2], 0.0, atol=1e-9)
    # The rate of the phase of a sine of an amplitude: at its start it is at its largest speed.
    swing = machine.value("end.speed.amplitude")
    by_phase = swing * math.cos(machine.value("end.speed.phase"))
    by_end = found["velocity"].sel(inertia="end")[2].item()
    assert by_end == pytest.approx(by_phase, abs=1e-11)


def test_a_driven_orbit_of_a_joint_continues_from_its_start() -> None:
    """Angles that are rounding do not contradict a joint."""
    machine = PAIRS["a spring end moved by a gear"]().machine
    for ratio in (2.0, 2.0002, 1.9994):
        near = machine.replace({"gear.ratio": ratio})
        orbit = wb.orbit(near)
        again = wb.simulate(near, orbit.period, initial=orbit.initial)
        assert again.attrs["status"] == "completed"


def test_a_speed_that_winds_up_a_spring_has_no_neighbouring_orbit() -> None:
    machine = PAIRS["a moved spring end"]().machine
    shaken = wb.Driven("end", machine.inertias[-1].speed + 0.0)
    grounded = wb.Shaft("body", "ground", 10.0, name="other")
    machine = machine.replace(
        inertias=[machine.inertias[0], shaken], shafts=[*machine.shafts, grounded]
    )
    found = wb.orbit(machine).sensitivity(["end.speed.signals.1.value", "spring.stiffness"])
    assert np.isnan(found["friction_heat"][0]).all()
    assert np.isfinite(found["friction_heat"][1]).all()
    assert "end.speed.signals.1.value" in found.attrs["message"]


def test_a_ratio_of_one_to_a_driven_body_has_a_derivative() -> None:
    machine = RUNS["driven"][0].replace({"clutch.ratio": 1.0})
    found = wb.sensitivity(machine, ["clutch.ratio"], 0.3, of=WORKS)

    def values(ratio: float) -> Values:
        near = wb.energy(wb.simulate(machine.replace({"clutch.ratio": ratio}), 0.3))
        return {one: near[one].to_numpy() for one in WORKS if one in near}

    assert_agrees(found, "clutch.ratio", values, 1.0, (1e-4, 1e-5))


@pytest.mark.parametrize("name", ["bump.angles.0", "bump.angles.1", "bump.torques.1"])
def test_points_that_are_much_closer_than_their_distance_from_zero(name: str) -> None:
    bump = wb.OverAngle([100.1, 100.4, 100.7], [30.0, -50.0, -20.0])
    machine = wb.Machine(
        inertias=[wb.Inertia("disc", 1.0, angle=100.0, speed=5.0)],
        torques=[wb.Torque("disc", bump, name="bump")],
    )
    of = ["torque_work", "rms_acceleration", "lowest_velocity"]
    found = wb.sensitivity(machine, [name], 0.3, of=of)

    def values(value: float) -> Values:
        near = wb.sensitivity(machine.replace({name: value}), ["disc.inertia"], 0.3, of=of)
        return {one: near[f"{one}_value"].to_numpy() for one in of}

    value = machine.value(name)
    assert_agrees(found, name, values, value, (0.01 / value, 0.002 / value))


def test_the_instant_at_which_an_orbit_begins_does_not_matter() -> None:
    """Also if the integral of a controller bends just before, at a limit of the output."""
    machine, _ = ORBITS["PID with limits"]
    machine = machine.replace({"loop.limits.0": -9.0, "loop.limits.1": 6.0})
    of, found = ["friction_heat", "rms_velocity", "control_work"], []
    for phase in np.linspace(0.0, 2.0 * math.pi, 20, endpoint=False):
        orbit = wb.orbit(machine.replace({"engine.phase": float(phase)}))
        each = orbit.sensitivity(["engine.frequency"], of)
        found.append([each[one].item() for one in of])
    np.testing.assert_allclose(found, np.broadcast_to(found[0], (20, 3)), rtol=1e-10)


def test_damping_of_a_stop_without_damping() -> None:
    """A contact of half a period takes the work c v^2 pi/(2 omega) to first order."""
    inertia, stiffness, speed = 2.0, 800.0, 0.5
    stop = wb.Shaft("body", "ground", stiffness, name="stop", gap=(-0.1, 0.1))
    machine = wb.Machine(inertias=[wb.Inertia("body", inertia, speed=speed)], shafts=[stop])
    found = wb.sensitivity(machine, ["stop.damping"], 0.4, times=[0.4])
    expected = speed * math.pi / (2.0 * math.sqrt(stiffness / inertia) * inertia)
    assert found["velocity"].item() == pytest.approx(expected, rel=1e-12)
    assert found["one_sided"].item() == 1
