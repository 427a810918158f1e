"""Sticks as constraints, and decisions where loads are equal to limits or nothing presses.

Right values are closed forms, balances of momentum, or the motion of the reference integrator,
which shares nothing with the package; ``machine_round.faults`` holds the laws of friction, the
balance of torques and of energy against each run.
"""

from __future__ import annotations

import math
from itertools import product
from typing import Any

import numpy as np
import pytest

import machine_plain
import wedgebrake as wb
from machine_cases import Case
from machine_round import faults, returns
from machines import in_row, pressed, single

STICK, SLIP, BREAKPOINT = 2, 3, 5
LONG = 1e6  # [s]


def brake(
    a: str, b: str = "ground", *, force: Any, static: float | None = None, name: str = "brake",
    part: Any = None, **more: Any,
) -> wb.Contact:  # fmt: skip
    """R = 0.1 m and mu = 0.3: a torque of 0.03 m times the force."""
    return wb.Contact(
        a, b, name=name, brake=part or wb.ConventionalBrake(radius=0.1),
        friction=wb.CoulombFriction(kinetic=0.3, static=0.3 if static is None else static),
        actuation=wb.Actuation(initial_force=force), **more,
    )  # fmt: skip


def table(times: Any, values: Any) -> wb.Table:
    return wb.Table(tuple(times), tuple(values), after="hold")


def completed(machine: wb.Machine, duration: float, **more: Any) -> Any:
    response = wb.simulate(machine, duration, **{"max_events": 5000} | more)
    assert response.attrs["status"] == "completed", response.attrs["message"]
    return response


def check(machine: wb.Machine, duration: float) -> None:
    """Nothing is broken, and the motion is the reference's."""
    found = faults(Case(0, machine_plain.table(machine), duration))
    assert not found, found


def events(response: Any, contact: int = 0) -> list[tuple[float, int]]:
    kept = response["event_contact"].values == contact
    times, kinds = (response[f"event_{name}"].values[kept] for name in ("time", "kind"))
    return [(float(t), int(k)) for t, k in zip(times, kinds, strict=True)]


# What sticks does not move.


def held_loads() -> list[Any]:
    rng = np.random.default_rng(2)
    cases = [single(wb.Contact(
        "disc", name="brake", brake=wb.ConventionalBrake(radius=1.0),
        friction=wb.CoulombFriction(kinetic=0.5), actuation=wb.Actuation(initial_force=1420.65),
    ), inertia=1.827, torque=473.55)]  # fmt: skip
    for count in (1, 2, 2, 2, 3, 3):
        forces = np.round(rng.uniform(1.0, 999.0, count), 2).tolist()
        load = round(float(rng.uniform(0.1, 0.9)) * sum(forces), 2)
        contacts = [pressed(name=f"b{k}", force=force) for k, force in enumerate(forces)]
        size = round(float(rng.uniform(0.1, 5.0)), 3)
        cases.append(single(*contacts, inertia=size, torque=load))
        cases.append(single(*contacts, inertia=size, torque=load, stiffness=70.0, angle=0.1))
    return cases


@pytest.mark.parametrize("machine", held_loads())
def test_a_held_load_does_not_move(machine: wb.Machine) -> None:
    response = completed(machine, LONG, times=np.linspace(0.0, LONG, 11))
    start = machine.inertias[0].angle
    assert np.all(response["sticking"].values == 1)
    np.testing.assert_array_equal(response["velocity"].values, 0.0)
    np.testing.assert_array_equal(response["angle"].values, start)
    assert float(wb.energy(response)["residual"]) == 0.0


@pytest.mark.parametrize("seed", range(6))
def test_what_sticks_together_has_one_speed(seed: int) -> None:
    """A locked clutch under a torque on one side: v = T t / (J1 + J2), the same of both."""
    rng = np.random.default_rng(seed)
    sizes, load = np.round(rng.uniform(0.1, 5.0, 2), 2).tolist(), round(float(rng.uniform(1, 9)), 2)
    machine = wb.Machine(
        inertias=[wb.Inertia("a", sizes[0]), wb.Inertia("b", sizes[1])],
        contacts=[pressed("a", "b", name="clutch", force=100.0)],
        torques=[wb.Torque("a", load, name="load")],
    )
    response = completed(machine, 1e3, times=np.linspace(0.0, 1e3, 11))
    velocity = response["velocity"].values
    np.testing.assert_array_equal(velocity[:, 0], velocity[:, 1])
    exact = load / sum(sizes) * response["time"].values
    np.testing.assert_allclose(velocity[:, 0], exact, rtol=1e-12)
    np.testing.assert_array_equal(response["sliding_velocity"].values, 0.0)


@pytest.mark.parametrize(
    ("stiffness", "ratio"),
    [(1e3, 1.0), (1e3, 3.3), (1e5, 1.0), (1e5, 3.3),
     *(pytest.param(1e7, ratio, marks=pytest.mark.slow) for ratio in (1.0, 3.3))],
)  # fmt: skip
def test_a_line_that_turns_evenly_goes_on_so(stiffness: float, ratio: float) -> None:
    """Through 1e5 rad, as a stiff shaft of a line that turns freely does not feel their rounding.

    The torque of the shaft is rounded to 2^-53 of 1e3 rad times its stiffness at most, at random
    in each cell, which is as long as the fastest vibration takes for a radian. Allowed are four
    standard deviations of the speed after 1e3 s.
    """
    start = 100.0
    machine = wb.Machine(
        inertias=[wb.Inertia("motor", 0.3, speed=start), wb.Inertia("plate", 0.5, speed=start),
                  wb.Inertia("load", 2.0, speed=start / ratio)],
        shafts=[wb.Shaft("plate", "load", stiffness=stiffness, damping=1.0, ratio=ratio)],
        contacts=[pressed("motor", "plate", name="clutch", force=1e4)],
    )  # fmt: skip
    response = completed(machine, 1e3, times=[0.0, 500.0, 1e3])
    even = np.array([start, start, start / ratio])
    cell = math.sqrt(0.8 / stiffness)
    bound = 4.0 * 2.0**-53 * 1e3 * stiffness * math.sqrt(1e3 * cell) / 0.8
    np.testing.assert_allclose(response["velocity"].values - even, 0.0, atol=bound)
    angles = np.outer(response["time"].values, even)
    np.testing.assert_allclose(response["angle"].values, angles, rtol=1e-12, atol=1e3 * bound)
    assert abs(float(wb.energy(response)["residual"])) <= 1e-11 * 0.5 * 2.8 * start**2 + 10.0 * (
        float(wb.energy(response)["rounding"])
    )


def test_what_sticks_to_a_base_has_the_speed_of_the_base() -> None:
    """A belt of 0.7 rad/s carries an inertia on a spring up to its limit."""
    machine = single(
        pressed(name="belt", force=3.0, base_speed=0.7), inertia=1.3, stiffness=2.0, speed=0.7
    )
    response = completed(machine, 6.0)
    rest = response["sticking"].values[:, 0] == 1
    assert np.any(rest)
    assert np.any(~rest)
    np.testing.assert_array_equal(response["velocity"].values[rest, 0], 0.7)
    np.testing.assert_array_equal(response["sliding_velocity"].values[rest, 0], 0.0)


# Loads that are equal to limits.


@pytest.mark.parametrize(
    ("inertia", "stiffness", "limit", "swings"),
    [
        *product((0.2, 0.3, 0.7), (2.0, 3.0, 700.0), (1.0, 0.7), (1, 2, 5, 12)),
        *product((1.0, 5.0), (0.1, 49.0), (30.0, 1e-3), (1, 3, 8)),
    ],
)
def test_rest_exactly_at_the_limit(
    inertia: float, stiffness: float, limit: float, swings: int
) -> None:
    """From (2 n + 1) limit/k, n half swings end where the spring's torque is the limit."""
    start = (2 * swings + 1) * limit / stiffness
    machine = single(pressed(force=limit), inertia=inertia, stiffness=stiffness, angle=start)
    stop = swings * math.pi * math.sqrt(inertia / stiffness)
    response = completed(machine, 4.0 * stop)
    last = response["stick_start"].values[-1]
    assert last == pytest.approx(stop, rel=1e-9)
    late = response["time"].values > stop * (1.0 + 1e-9)
    assert np.all(response["sticking"].values[late] == 1)
    np.testing.assert_array_equal(response["velocity"].values[late], 0.0)
    assert len([kind for _, kind in events(response) if kind == SLIP]) <= swings
    until = completed(machine, 4.0 * stop, until="rest")
    assert until.attrs["at_rest"]
    assert until.attrs["final_time"] == pytest.approx(stop, rel=1e-9)
    driveline = wb.BrakedDriveline(
        driveline=wb.Driveline(inertia=inertia, stiffness=stiffness, damping=0.0),
        brake=wb.ConventionalBrake(radius=1.0),
        friction=wb.CoulombFriction(kinetic=1.0),
        actuation=wb.Actuation(initial_force=limit),
        excitation=wb.HarmonicTorque(amplitude=0.0, frequency=1.0),
    )
    response = wb.simulate(driveline, 4.0 * stop, initial=(start, 0.0))
    assert response["stick_start"].values[-1] == pytest.approx(stop, rel=1e-9)
    assert response.attrs["final_velocity"] == 0.0


@pytest.mark.parametrize("peak", [1.0, 4.0 / 3.0])
@pytest.mark.parametrize("forces", [(300.0,), (100.0, 200.0), (200.0, 500.0, 300.0), (0.0, 700.0)])
@pytest.mark.parametrize("load", ["torque", "wave", "spring"])
def test_a_load_equal_to_the_limit_is_held(
    load: str, forces: tuple[float, ...], peak: float
) -> None:
    static = 0.3 * peak
    limit = sum(0.1 * static * force for force in forces)
    contacts = [
        brake("disc", force=force, static=static, name=f"b{k}") for k, force in enumerate(forces)
    ]
    given: dict[str, Any] = {
        "torque": {"torque": limit}, "wave": {"torque": wb.Harmonic(limit, 1.0, 1.0)},
        "spring": {"stiffness": 50.0, "angle": limit / 50.0},
    }[load]  # fmt: skip
    machine = single(*contacts, inertia=0.3, **given)
    response = completed(machine, 3.0)
    np.testing.assert_array_equal(response["velocity"].values, 0.0)
    assert np.all(response["sticking"].values == 1)
    assert not [kind for k in range(len(forces)) for _, kind in events(response, k) if kind == SLIP]


# Rest is proved.


@pytest.mark.parametrize(
    ("forces", "load"),
    [((1.0, 0.0), 0.5), ((1.0, 1e-6), 0.5), ((0.0, 0.0, 3.0), 2.0), ((1.0, 10.0), 0.95 * 11.0),
     ((300.0, 7.0), 0.95 * 307.0), ((1.0,), 1.0), ((0.5, 0.5), 1.0), ((3.0, 0.7), 3.7)],
)  # fmt: skip
def test_rest_is_proved_at_once(forces: tuple[float, ...], load: float) -> None:
    contacts = [pressed(name=f"b{k}", force=force) for k, force in enumerate(forces)]
    response = completed(single(*contacts, inertia=0.7, torque=load), 10.0, until="rest")
    assert response.attrs["at_rest"]
    assert response.attrs["final_time"] == 0.0
    response = completed(
        single(*contacts, inertia=0.7, stiffness=5.0, angle=load / 5.0), 10.0, until="rest"
    )
    assert response.attrs["at_rest"]
    assert response.attrs["final_time"] == 0.0


@pytest.mark.parametrize("second", [0.0, 1e-6, 0.3])
def test_rest_after_a_swing_is_proved_beside_a_second_brake(second: float) -> None:
    contacts = [pressed(force=1.0 - second), pressed(force=second, name="second")]
    machine = single(*contacts, inertia=0.2, stiffness=2.0, angle=1.3)
    response = completed(machine, 20.0, until="rest")
    assert response.attrs["at_rest"]
    stop = math.pi * math.sqrt(0.1)  # at -0.3 rad, where the spring's torque is 0.6 N m
    assert response.attrs["final_time"] == pytest.approx(stop, rel=1e-9)


# Wedges that lock themselves, and wedges that do not.


def wedge(angle: float = 0.2, radius: float = 0.1) -> wb.WedgeBrake:
    return wb.WedgeBrake(angle=angle, radius=radius)


def test_a_wedge_releases_when_its_force_is_zero() -> None:
    """It holds 10 N m while any force presses it, from 1 s on the inertia of 2 is free."""
    contact = brake("disc", force=wb.Ramp(100.0, 0.0, 1.0), part=wedge())
    response = completed(single(contact, inertia=2.0, torque=10.0), 3.0)
    time, velocity = response["time"].values, response["velocity"].values[:, 0]
    np.testing.assert_array_equal(velocity[time <= 1.0], 0.0)
    np.testing.assert_allclose(velocity, 5.0 * np.maximum(time - 1.0, 0.0), atol=1e-9)


@pytest.mark.parametrize("force", [0.0, wb.Constant(-1e-9), wb.Ramp(0.0, 100.0, 0.5, begin=0.5)])
def test_a_wedge_that_nothing_presses_is_free(force: Any) -> None:
    contact = brake("disc", force=force, part=wedge())
    response = completed(single(contact, inertia=2.0, torque=10.0), 0.4)
    np.testing.assert_allclose(response["velocity"].values[:, 0], 5.0 * response["time"].values)


def test_a_wedge_that_is_pressed_later_brakes_the_other_direction() -> None:
    """Against its direction it has 0.3/(0.3 + tan 0.2) of the force times R, from 0.5 s on."""
    contact = brake("disc", force=wb.Ramp(0.0, 100.0, 0.5, begin=0.5), part=wedge())
    response = completed(single(contact, inertia=2.0, torque=-10.0), 1.0)
    gain = 0.1 * 0.3 / (0.3 + math.tan(0.2))
    time = response["time"].values
    braked = 100.0 * gain * np.maximum(time - 0.5, 0.0) ** 2
    np.testing.assert_allclose(response["velocity"].values[:, 0], -5.0 * time + 0.5 * braked)


@pytest.mark.parametrize("force", [1e-8, 2e-8, 3e-8, 1e-6, 1.0, 100.0])
@pytest.mark.parametrize("sizes", [(0.3, 0.7), (1.0, 2.0), (2.5, 0.481), (1.0, 1.0)])
def test_one_way_clutch(force: float, sizes: tuple[float, float]) -> None:
    """It drives the second inertia and overruns; an almost open one drives as well."""
    machine = wb.Machine(
        inertias=[wb.Inertia("a", sizes[0]), wb.Inertia("b", sizes[1])],
        shafts=[wb.Shaft("b", "ground", stiffness=0.0, damping=0.3)],
        contacts=[brake("a", "b", force=force, part=wedge(), name="one-way")],
        torques=[wb.Torque("a", wb.Harmonic(10.0, 1.0), name="drive")],
    )
    check(machine, 3.0)


@pytest.mark.parametrize("step", [0.001, 0.01])
def test_a_recorded_torque_never_ends_a_run(step: float) -> None:
    """A wedge of 25 degrees under mu = 0.4 cannot lock itself, whatever inertia it brakes."""
    times = np.round(np.arange(0.0, 1.0 + 0.5 * step, step), 3)
    waves = ((40.0, 3.0), (25.0, 7.3), (15.0, 17.1))
    values = np.round(sum(a * np.sin(2.0 * np.pi * f * times) for a, f in waves), 3)
    record = table(times.tolist(), values.tolist())
    for size in np.round(np.linspace(2.4, 2.6, 41), 4):
        contact = wb.Contact(
            "disc", name="brake", brake=wedge(math.radians(25.0), 0.15),
            friction=wb.CoulombFriction(kinetic=0.35, static=0.4),
            actuation=wb.Actuation(initial_force=150.0),
        )  # fmt: skip
        machine = single(contact, inertia=size, stiffness=9000.0, damping=3.0, torque=record)
        completed(machine, 1.0, times=())


# Loops, springs that are locked, open clutches.


def loop(peak: float = 0.3564, **forces: float) -> wb.Machine:
    """A clutch between two inertias, each with a brake."""
    given = {"clutch": 825.866, "first": 1264.947, "second": 474.904} | forces
    ends = {"clutch": ("a", "b"), "first": ("a",), "second": ("b",)}
    return wb.Machine(
        inertias=[wb.Inertia("a", 0.481, speed=-0.214), wb.Inertia("b", 1.627, speed=2.903)],
        shafts=[wb.Shaft("a", "b", 2235.632, 2.567), wb.Shaft("b", "ground", 1891.377, 0.41)],
        contacts=[
            brake(*ends[name], force=force, static=peak, name=name) for name, force in given.items()
        ],
        torques=[
            wb.Torque("a", wb.Harmonic(63.396, 7.765, 2.521), name="one"),
            wb.Torque("b", wb.Harmonic(91.208, 2.515, 3.834), name="two"),
        ],
    )


def test_a_loop_of_contacts_with_static_peaks_goes_on() -> None:
    completed(loop(), 5.0)
    check(loop(), 0.6)


def run_until_rest(forces: dict[str, float]) -> None:
    completed(loop(**forces), 2.0, until="rest", times=())


@pytest.mark.parametrize("forces", [{}, {"clutch": 500.0, "first": 600.0, "second": 5000.0}])
def test_a_loop_that_is_run_until_rest_returns(forces: dict[str, float]) -> None:
    """In a process of its own, as a run that does not return cannot be stopped in this one."""
    assert returns(run_until_rest, forces, seconds=60.0)


@pytest.mark.parametrize("clutch", [1e5, 1e7, 1e8])
def test_very_unequal_contacts_hold_a_load(clutch: float) -> None:
    """Brakes of 40 and 28 N m hold 31 + 17 N m at most between them, and a clutch binds them."""
    machine = wb.Machine(
        inertias=[wb.Inertia("a", 1.3), wb.Inertia("b", 0.7)],
        shafts=[wb.Shaft("a", "b", 3000.0, 0.7), wb.Shaft("b", "ground", 1000.0, 0.3)],
        contacts=[
            brake("a", "b", force=clutch, static=0.4, name="clutch"),
            brake("a", force=1000.0, static=0.4, name="first"),
            brake("b", force=700.0, static=0.4, name="second"),
        ],
        torques=[
            wb.Torque("a", wb.Harmonic(31.0, 1.7), name="one"),
            wb.Torque("b", wb.Harmonic(17.0, 2.3, 1.0), name="two"),
        ],
    )
    response = completed(machine, 20.0)
    np.testing.assert_array_equal(response["velocity"].values, 0.0)
    np.testing.assert_array_equal(response["angle"].values, 0.0)
    torque, limits = response["brake_torque"].values, np.array([0.04 * clutch, 40.0, 28.0])
    assert np.all(np.abs(torque) <= limits * (1.0 + 1e-9))
    load = response["torque"].values
    np.testing.assert_allclose(torque[:, 0] + torque[:, 1], load[:, 0], atol=1e-9)
    np.testing.assert_allclose(torque[:, 2] - torque[:, 0], load[:, 1], atol=1e-9)


@pytest.mark.parametrize("last", [0.0, pytest.param(1e-6, marks=pytest.mark.slow), 300.0])
def test_a_released_brake_in_a_loop(last: float) -> None:
    """Without force the motion is that without this brake: the reference has several to choose."""
    machine = loop(0.4, clutch=500.0, first=600.0, second=5000.0)
    contacts = [*machine.contacts, brake("a", force=last, static=0.4, name="released")]
    more = wb.Machine(
        inertias=machine.inertias, shafts=machine.shafts, contacts=contacts,
        torques=machine.torques,
    )  # fmt: skip
    if last > 0.0:
        check(more, 0.4)
        return
    times = np.linspace(0.0, 1.0, 101)
    angles = [completed(one, 1.0, times=times)["angle"].values for one in (machine, more)]
    np.testing.assert_allclose(angles[1], angles[0], rtol=0.0, atol=1e-12)
    check(machine, 1.0)


@pytest.mark.parametrize("clutch", [1e4, 1e5, 1e6])
def test_a_brake_beside_a_locked_spring_stops_the_vehicle(clutch: float) -> None:
    """15 N m s drive 5.3 kg m2; the brake takes 3 of them in 0.2 s, and 30 in a second then."""
    machine = wb.Machine(
        inertias=[wb.Inertia("engine", 0.3), wb.Inertia("vehicle", 5.0)],
        shafts=[wb.Shaft("engine", "vehicle", 2000.0, 3.0)],
        contacts=[
            brake("engine", "vehicle", force=clutch, name="lock-up"),
            brake("vehicle", force=table((0, 1, 1.2, 9), (0, 0, 1000, 1000))),
        ],
        torques=[wb.Torque("engine", table((0, 0.5, 1, 1, 9), (0, 20, 20, 0, 0)), name="drive")],
    )
    response = completed(machine, 9.0, times=np.linspace(0.0, 9.0, 901))
    time, velocity = response["time"].values, response["velocity"].values
    before, after = np.abs(time - 1.0) < 1e-9, time > 1.6 + 1e-9
    np.testing.assert_allclose(velocity[before], 15.0 / 5.3, rtol=1e-12)
    np.testing.assert_array_equal(velocity[after], 0.0)
    assert np.all(response["sticking"].values[after] == 1)
    stop = response["stick_start"].values[response["stick_contact"].values == 1][-1]
    assert stop == pytest.approx(1.6, rel=1e-12)


@pytest.mark.parametrize(
    "damping", [0.0, 0.8, *(pytest.param(one, marks=pytest.mark.slow) for one in (0.5, 0.7))]
)
def test_a_spring_that_a_brake_locks_under_a_record(damping: float) -> None:
    times = np.linspace(0.0, 4.0, 400)
    record = table(times.tolist(), (60.0 * (times / 4.0) ** 2 * np.sin(7.0 * times)).tolist())
    contact = brake("disc", force=1000.0)
    machine = single(contact, inertia=0.6, stiffness=1000.0, damping=damping, torque=record)
    check(machine, 4.0)


@pytest.mark.parametrize("force", [200.0, 1e4, 1e6])
def test_a_belt_beside_a_brake_that_holds(force: float) -> None:
    """Its torque acts along the motion of the base, which changes its direction."""
    belt = table((0, 1, 2, 3, 4), (-0.42, -0.771, 1.228, -1.57, -0.431))
    contacts = [
        brake("disc", force=45.964, base_speed=belt, name="belt"), brake("disc", force=force)
    ]  # fmt: skip
    machine = single(*contacts, inertia=5.047, angle=0.075, stiffness=9560.23, damping=2.711)
    check(machine, 4.0)
    if force == 1e6:
        response = completed(machine, 4.0, times=np.linspace(0.0, 4.0, 97))
        base = np.interp(response["time"].values, (0, 1, 2, 3, 4), belt.values)
        moves = np.abs(base) > 1e-9
        torque = response["brake_torque"].values[moves, 0]
        np.testing.assert_allclose(torque, -0.03 * 45.964 * np.sign(base[moves]), rtol=1e-12)


@pytest.mark.parametrize("peak", [0.3, 0.4])
@pytest.mark.parametrize("force", [0.0, 1.0, (0.0, 800.0), (0.0, 150.0), (400.0, 0.0)])
@pytest.mark.parametrize(
    ("sizes", "stiffness", "speed"),
    [((4.7, 4.8, 0.78), 1200.0, 13.0), ((0.34, 0.4, 0.042), 400.0, 13.0),
     ((0.3, 0.2, 1.7), 900.0, 100.0), ((0.1, 0.7, 1.3), 70.0, 0.1)],
)  # fmt: skip
def test_a_clutch_in_a_line_that_turns_evenly(
    sizes: tuple[float, ...], stiffness: float, speed: float, force: Any, peak: float
) -> None:
    """Whether it is open, closes or opens: nothing acts, nothing happens."""
    names = ("engine", "gearbox", "vehicle")
    pressing = wb.Ramp(*force, 0.4, begin=0.1) if isinstance(force, tuple) else force
    machine = wb.Machine(
        inertias=[wb.Inertia(n, j, speed=speed) for n, j in zip(names, sizes, strict=True)],
        shafts=[wb.Shaft("gearbox", "vehicle", stiffness, 1.0)],
        contacts=[brake("engine", "gearbox", force=pressing, static=peak, name="clutch")],
    )
    response = completed(machine, 1.0)
    np.testing.assert_allclose(response["velocity"].values, speed, rtol=1e-12)
    np.testing.assert_allclose(response["brake_torque"].values, 0.0, atol=1e-9)
    # Apart from the end of the force, which is a bend of the law.
    assert not [one for one in events(response) if one[0] > 0.0 and one[1] != BREAKPOINT]


# Bases, restarts, forces that jump.


@pytest.mark.parametrize("speed", [1.0, 0.3, -0.7, 2.0])
@pytest.mark.parametrize("end", [0.3, 0.5, 0.7])
@pytest.mark.parametrize("sample_time", [None, 0.01])
def test_a_base_that_stops_at_a_knot(speed: float, end: float, sample_time: float | None) -> None:
    """A strong belt carries the inertia against a brake, and both hold from its stop on."""
    contacts = [
        pressed(force=70.0, name="belt", base_speed=wb.Ramp(speed, 0.0, end)),
        pressed(force=3.0, sample_time=sample_time),
    ]
    response = completed(single(*contacts, inertia=0.7, speed=speed), 1.0)
    time, velocity = response["time"].values, response["velocity"].values[:, 0]
    np.testing.assert_allclose(velocity, speed * np.maximum(1.0 - time / end, 0.0), atol=1e-15)
    late = time > end
    np.testing.assert_array_equal(velocity[late], 0.0)
    np.testing.assert_array_equal(response["sliding_velocity"].values[late], 0.0)
    assert np.all(response["sticking"].values[late] == 1)


def test_a_base_that_passes_through_rest_at_a_knot() -> None:
    """A belt from 1 to -1 rad/s with a knot at 0, where a brake of a tenth of it holds no longer.

    The inertia goes with the belt all the time; the brake slides with it, and its torque jumps.
    """
    belt = table((0.0, 0.5, 1.0), (1.0, 0.0, -1.0))
    contacts = [pressed(force=70.0, name="belt", base_speed=belt), pressed(force=3.0)]
    response = completed(single(*contacts, inertia=0.7, speed=1.0), 1.0)
    time, velocity = response["time"].values, response["velocity"].values[:, 0]
    np.testing.assert_allclose(velocity, 1.0 - 2.0 * time, atol=1e-14)
    apart = np.abs(time - 0.5) > 1e-9
    torque = 3.0 * np.sign(0.5 - time[apart])
    np.testing.assert_allclose(response["brake_torque"].values[apart, 1], torque, rtol=1e-12)
    # The belt drives: 0.7 times an acceleration of -2 rad/s2 is what both torques make.
    exact = 1.4 - torque
    np.testing.assert_allclose(response["brake_torque"].values[apart, 0], exact, rtol=1e-12)


@pytest.mark.parametrize("share", [0.0, 1.0])
def test_a_restart_at_a_slip_adds_no_stick(share: float) -> None:
    """A ramp of 1 N m/s meets the limit of 2 N m at 2 s."""
    contacts = [pressed(force=2.0), pressed(force=share, name="second")]
    machine = single(*contacts, inertia=0.5, torque=wb.Ramp(0.0, 9.0, 9.0))
    limit = 2.0 + share
    first = completed(machine, limit)
    later = completed(machine, 1.0, initial=wb.final_state(first))
    whole = completed(machine, limit + 1.0)
    assert later["velocity"].values[-1, 0] == pytest.approx(1.0, rel=1e-9)
    for k in (0, 1):
        sticks = [one for one in (*events(first, k), *events(later, k)) if one[1] == STICK]
        assert sticks == [one for one in events(whole, k) if one[1] == STICK]
    lengths = later["stick_end"].values - later["stick_start"].values
    assert np.all(lengths > 1e-9)


@pytest.mark.parametrize("order", [1, -1])
@pytest.mark.parametrize("jump", [0.0, 5.0])
def test_a_force_that_jumps_does_not_release_a_neighbour(jump: float, order: int) -> None:
    """A load of 3 N m is held by 2 + 2 N m; one brake jumps to ``jump`` at 1 s, the other to 4."""
    contacts = [
        pressed(force=table((0.0, 1.0, 1.0, 2.0), (2.0, 2.0, jump, jump)), name="one"),
        pressed(force=table((0.0, 1.0, 1.0, 2.0), (2.0, 2.0, 4.0, 4.0)), name="other"),
    ][::order]
    response = completed(single(*contacts, inertia=0.5, torque=3.0), 2.0)
    np.testing.assert_array_equal(response["velocity"].values, 0.0)
    assert np.all(response["sticking"].values == 1)
    assert not [kind for k in (0, 1) for _, kind in events(response, k) if kind == SLIP]


def test_a_machine_in_a_row_rests_bit_by_bit() -> None:
    """Two inertias that brakes hold under a torque; nothing moves in a long time."""
    contacts = [pressed("a", force=7.0, name="one"), pressed("b", force=9.0, name="two")]
    machine = in_row(*contacts, wave=wb.Harmonic(8.0, 0.7))
    response = completed(machine, 1e4, times=np.linspace(0.0, 1e4, 101))
    for name in ("angle", "velocity", "sliding_velocity"):
        np.testing.assert_array_equal(response[name].values, 0.0)
