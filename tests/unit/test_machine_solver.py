"""The exact solver for machines: closed forms, published motions and 40-digit arithmetic."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from scipy.linalg import expm
from scipy.optimize import brentq, lsq_linear, minimize

import machine_examples as examples
import machines
import wedgebrake as wb
from machines import FRICTION, single
from machines import pressed as contact
from stick_slip import stick_slip

STICK, SLIP, REVERSAL, BREAKPOINT = 2, 3, 4, 5


def events(response: Any) -> list[tuple[float, int, int]]:
    """(time, contact, kind), without breakpoints."""
    names = ("event_time", "event_contact", "event_kind")
    rows = zip(*(response[name].values.tolist() for name in names), strict=True)
    return [(t, int(j), int(k)) for t, j, k in rows if k != BREAKPOINT]


def times_of(response: Any, kind: int, number: int = 0) -> np.ndarray:
    return np.array([t for t, j, k in events(response) if (j, k) == (number, kind)])


# Published motions.


def belt(lines: int, blocks: int = 1, coupling: float = 0.0) -> wb.Machine:
    """Leine's block(s) of 1 kg on springs of 1 N/m on a belt at 0.2 m/s; friction 1/(1 + 3 |v|).

    lines : number of straight lines of the friction over the speed; shortest where it bends most
    """
    share = np.linspace(0.0, 1.0, lines + 1)
    speeds = ((1.0 - (1.0 - 4.0**-0.5) * share) ** -2.0 - 1.0) * 2.0 / 3.0  # up to 2 m/s
    friction = wb.TabulatedFriction(
        speeds=tuple(speeds.tolist()), coefficients=tuple((0.5 / (1.0 + 3.0 * speeds)).tolist())
    )
    shafts = [wb.Shaft(f"b{i}", "ground", stiffness=1.0) for i in range(blocks)]
    shafts += [wb.Shaft(f"b{i}", f"b{i + 1}", stiffness=coupling) for i in range(blocks - 1)]
    return wb.Machine(
        inertias=[wb.Inertia(f"b{i}", 1.0, speed=0.2) for i in range(blocks)],
        shafts=[shaft for shaft in shafts if shaft.stiffness],
        contacts=[
            machines.contact(f"b{i}", name=f"belt{i}", friction=friction, force=2.0, base_speed=0.2)
            for i in range(blocks)
        ],
    )


def test_mass_on_a_belt() -> None:
    """Period and furthest deflection of the curve, to which those of its lines converge as h^2."""
    found = []
    for lines in (300, 600, 1200):
        response = wb.simulate(belt(lines), 31.0, times=np.linspace(5.9, 6.0, 10_001))
        slips = times_of(response, SLIP)
        assert slips[0] == pytest.approx(5.0, abs=1e-12)
        np.testing.assert_allclose(np.diff(slips), slips[1] - slips[0], rtol=0, atol=1e-9)
        found.append((slips[1] - slips[0], float(response["angle"].max())))
    coarse, middle, fine = np.array(found)
    cycle = stick_slip(lambda speed: 1.0 / (1.0 + 3.0 * speed), 0.2)
    truth = np.array([cycle.period, cycle.highest])
    assert np.all(np.abs(fine - truth) < 0.3 * np.abs(middle - truth))
    # Without the errors of h^2, then of h^3.
    first, second = (4.0 * middle - coarse) / 3.0, (4.0 * fine - middle) / 3.0
    curve = (8.0 * second - first) / 7.0
    np.testing.assert_allclose(curve, truth, rtol=0, atol=1e-7)


@pytest.mark.parametrize("coupling", [0.0, 0.7])
def test_two_equal_masses_side_by_side(coupling: float) -> None:
    """Started alike they move as one alone, whatever joins them."""
    alone, together = (wb.simulate(belt(50, blocks, coupling), 31.0) for blocks in (1, 2))
    assert together.attrs["status"] == "completed"
    for j in range(2):
        np.testing.assert_allclose(times_of(together, SLIP, j), times_of(alone, SLIP), rtol=1e-12)
        angle = together["angle"][:, j]
        np.testing.assert_allclose(angle, alone["angle"][:, 0], rtol=0, atol=1e-10)


@pytest.mark.parametrize("count", [2, 3, 14])
def test_equal_brakes_apart_from_each_other_release_together(count: int) -> None:
    """Independent inertias under the same torque t against 1 N m: v = (t - 1)^2/2."""
    rising = wb.Table((0.0, 3.0), (0.0, 3.0))
    machine = wb.Machine(
        inertias=[wb.Inertia(f"b{i}", 1.0) for i in range(count)],
        contacts=[contact(f"b{i}", name=f"brake{i}") for i in range(count)],
        torques=[wb.Torque(f"b{i}", rising) for i in range(count)],
    )
    response = wb.simulate(machine, 3.0, times=[3.0])
    assert response.attrs["status"] == "completed"
    assert sorted(event[1:] for event in events(response)) == [(j, SLIP) for j in range(count)]
    np.testing.assert_allclose(response["velocity"][-1], 2.0, rtol=1e-13)


def modelica_friction() -> wb.Machine:
    """Modelica.Mechanics.Rotational.Examples.Friction, as ``machine_examples.FRICTION``."""
    motor = wb.Harmonic(200.0, 100.0 / (2.0 * math.pi))
    pulse = wb.Table((0.0, 0.5, 0.5), (1.0, 1.0, 0.0), after="hold")
    pressed = wb.Table((0.0, 0.5, 0.5), (0.0, 0.0, 800.0), after="hold")
    return wb.Machine(
        inertias=[
            wb.Inertia("J1", 1.0, speed=90.0), wb.Inertia("J2", 0.05, speed=90.0),
            wb.Inertia("J3", 1.0, speed=100.0),
        ],
        shafts=[wb.Shaft("J1", "J2", stiffness=160.0, damping=1.0)],
        contacts=[
            contact("J3", "J2", name="clutch", force=80.0), contact("J1", force=pressed)
        ],
        torques=[wb.Torque("J3", motor * pulse, name="motor")],
    )  # fmt: skip


def modelica_coupled() -> wb.Machine:
    """Modelica's CoupledClutches, as ``machine_examples.COUPLED``."""

    def step(time: float) -> wb.Signal:
        return wb.Table((0.0, time, time), (0.0, 0.0, 10.0), after="hold")

    wave = wb.Harmonic(10.0, 0.2, 0.5 * math.pi)
    until = wb.Table((0.0, 1.25, 1.25), (1.0, 1.0, 0.0), after="hold")
    return wb.Machine(
        inertias=[wb.Inertia(f"J{i}", 1.0, speed=10.0 if i == 1 else 0.0) for i in (1, 2, 3, 4)],
        contacts=[
            contact(f"J{i}", f"J{i + 1}", name=f"clutch{i}", force=force, static=1.1)
            for i, force in ((1, wave * until), (2, step(0.4)), (3, step(0.9)))
        ],
        torques=[wb.Torque("J1", wb.Harmonic(10.0, 5.0), name="motor")],
    )


DRIVELINES = {
    "Friction": (
        modelica_friction, 3.0, examples.FRICTION_EVENTS, examples.FRICTION_ANGLES,
        examples.FRICTION_SPEEDS,
    ),
    "CoupledClutches": (
        modelica_coupled, 1.5, examples.COUPLED_EVENTS, examples.COUPLED_ANGLES,
        examples.COUPLED_SPEEDS,
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", DRIVELINES)
def test_modelica_drivelines(name: str) -> None:
    """Event by event as 40-digit arithmetic has them; and the energy balances."""
    make, duration, expected, angles, speeds = DRIVELINES[name]
    machine = make()
    response = wb.simulate(machine, duration, times=[duration])
    kinds = {"stick": STICK, "slip": SLIP}
    found = [event for event in events(response) if event[0] > 0.0]
    assert [event[1:] for event in found] == [(j, kinds[kind]) for _, j, kind, _ in expected]
    for (time, *_), (exact, *_) in zip(found, expected, strict=True):
        assert time == pytest.approx(float(exact), rel=0, abs=2e-14)
    np.testing.assert_allclose(response["angle"][0], np.array(angles, float), rtol=1e-14, atol=0)
    np.testing.assert_allclose(response["velocity"][0], np.array(speeds, float), rtol=0, atol=1e-12)
    energy = wb.energy(response)
    exchanged = float(energy["friction_heat"].sum() + np.abs(energy["torque_work"]).sum())
    assert abs(float(energy["residual"])) < 1e-13 * exchanged


# Several contacts on one inertia.


def parallel(capacities: Sequence[float], torque: Any, **more: Any) -> wb.Machine:
    brakes = [contact("disc", name=f"brake{i}", force=f) for i, f in enumerate(capacities)]
    return single(*brakes, torque=torque, **more)


@pytest.mark.parametrize("capacities", [(1.0, 10.0), (10.0, 1.0), (1.0, 2.0, 3.0, 5.0)])
def test_parallel_brakes(capacities: tuple[float, ...]) -> None:
    """They hold together up to the sum of their capacities 11, and slip together from there on."""
    rising = wb.Table((0.0, 10.0), (6.0, 16.0))
    response = wb.simulate(parallel(capacities, rising), 6.0, times=[0.0, 4.9, 6.0])
    assert response["sticking"].values[:2].all()
    # Least sum of (torque/capacity)^2 under a given sum: torques as the squares of capacities,
    # but none beyond its limit.
    squares = np.square(capacities)
    shares = 6.0 * squares / squares.sum()
    assert np.all(shares < capacities)
    np.testing.assert_allclose(response["brake_torque"][0], shares, rtol=1e-13)
    assert np.all(response["brake_torque"][1] <= np.array(capacities) * (1.0 + 1e-12))
    assert float(response["brake_torque"][1].sum()) == pytest.approx(10.9, rel=1e-13)
    found = events(response)
    assert [event[1:] for event in found] == [(j, SLIP) for j in range(len(capacities))]
    np.testing.assert_allclose([t for t, *_ in found], 5.0, rtol=1e-14)
    # J v = integral of (t - 5) from 5 s on.
    assert response["velocity"].values[-1, 0] == pytest.approx(0.5, rel=1e-13)


def test_many_contacts_that_depend_on_each_other() -> None:
    """Twenty brakes of 1 to 20 N m on one inertia hold 210 N m together, and no more."""
    brakes = list(map(float, range(1, 21)))
    held = wb.simulate(parallel(brakes, 209.0), 1.0, times=[1.0])
    assert held["sticking"].values.all()
    assert held["velocity"].values[-1, 0] == 0.0
    slipping = wb.simulate(parallel(brakes, 211.0), 1.0, times=[1.0])
    assert slipping["velocity"].values[-1, 0] == pytest.approx(1.0, rel=1e-12)


def test_shares_follow_limits_that_vary() -> None:
    rising = wb.Table((0.0, 1.0), (2.0, 20.0))
    brakes = [contact("disc", name="a", force=rising), contact("disc", name="b", force=10.0)]
    response = wb.simulate(single(*brakes, torque=6.0), 1.0, times=[0.0, 1.0])
    np.testing.assert_allclose(response["brake_torque"][0], [6.0 / 26.0, 150.0 / 26.0], rtol=1e-12)
    np.testing.assert_allclose(response["brake_torque"][1], [4.8, 1.2], rtol=1e-12)


@pytest.mark.parametrize("seed", range(5))
def test_shares_in_loops_are_the_least(seed: int) -> None:
    """Three inertias held by three brakes and three clutches, by another method of optimisation."""
    rng, torques = np.random.default_rng(seed), (11.0, -6.0, 10.0)
    ends = [("i0", "ground"), ("i1", "ground"), ("i2", "ground"), ("i0", "i1"), ("i1", "i2"),
            ("i2", "i0")]  # fmt: skip
    forces = [wb.Table((0.0, 1.0), rng.uniform(5.5, 8.0, size=2).tolist()) for _ in ends]
    machine = wb.Machine(
        inertias=[wb.Inertia(f"i{n}", 1.0) for n in range(3)],
        contacts=[
            contact(a, b, name=f"{a}-{b}", force=force)
            for (a, b), force in zip(ends, forces, strict=True)
        ],
        torques=[wb.Torque(f"i{n}", float(size)) for n, size in enumerate(torques)],
    )
    response = wb.simulate(machine, 1.0, times=[0.3, 1.0])
    assert response["sticking"].values.all()
    directions = np.zeros((3, 6))
    for j, (a, b) in enumerate(ends):
        directions[int(a[1]), j] = 1.0
        if b != "ground":
            directions[int(b[1]), j] = -1.0
    for time in range(2):
        limits = response["actuation_force"].values[time]
        expected = minimize(
            lambda torques, limits=limits: np.sum(np.square(torques / limits)), np.zeros(6),
            jac=lambda torques, limits=limits: 2.0 * torques / np.square(limits),
            bounds=[(-one, one) for one in limits], method="SLSQP", tol=1e-14,
            constraints={"type": "eq", "fun": lambda x: directions @ x - torques,
                         "jac": lambda _: directions},
        )  # fmt: skip
        assert expected.success
        np.testing.assert_allclose(response["brake_torque"][time], expected.x, atol=1e-6)


def test_a_ring_of_dependent_contacts() -> None:
    """Two inertias with a brake each and a clutch between them: held by 3 + 1 at most.

    The torque on the first is held by its brake and what the clutch transmits, at most 1; the
    second brake holds 5, so that the second inertia remains at rest.
    """
    machine = wb.Machine(
        inertias=[wb.Inertia("first", 1.0), wb.Inertia("second", 2.0)],
        contacts=[
            contact("first", name="one", force=3.0), contact("second", name="other", force=5.0),
            contact("first", "second", name="clutch"),
        ],
        torques=[wb.Torque("first", wb.Ramp(0.0, 6.0, duration=6.0))],
    )  # fmt: skip
    response = wb.simulate(machine, 6.0, times=[6.0])
    np.testing.assert_allclose(times_of(response, SLIP, 0), [4.0], rtol=1e-14)
    np.testing.assert_allclose(times_of(response, SLIP, 2), [4.0], rtol=1e-14)
    assert response["sticking"].values[0].tolist() == [False, True, False]


def test_static_friction_releases_the_contact_nearest_to_its_limit() -> None:
    machine = wb.Machine(
        inertias=[wb.Inertia("first", 1.0), wb.Inertia("second", 1.0)],
        contacts=[contact("first", name="a", force=2.0, static=1.5),
                  contact("second", name="b", force=4.0, static=1.5)],
        torques=[wb.Torque("first", wb.Ramp(0.0, 5.0, duration=5.0)),
                 wb.Torque("second", wb.Ramp(0.0, 9.0, duration=5.0))],
    )  # fmt: skip
    response = wb.simulate(machine, 5.0, times=[4.0])
    np.testing.assert_allclose(times_of(response, SLIP, 0), [3.0], rtol=1e-14)
    np.testing.assert_allclose(times_of(response, SLIP, 1), [6.0 / 1.8], rtol=1e-14)
    # The torque falls to 2 when it slips: v = (t - 3)^2/2 + (t - 3).
    assert response["velocity"].values[0, 0] == pytest.approx(1.5, rel=1e-13)


def test_table_of_friction_bends_the_torque() -> None:
    """Exponential decay of the speed on each line: v' = -3, then v' = -(5 - v) below 2 rad/s."""
    radius = 1.0 / FRICTION
    table = wb.TabulatedFriction(speeds=(0.0, 2.0 * radius), coefficients=(0.5, 0.3))
    brake = contact("disc", force=10.0 * FRICTION, friction=table)
    found = wb.simulate(single(brake, speed=5.0), 3.0)
    assert found["event_kind"].values.tolist() == [BREAKPOINT, STICK]
    bend, stick = found["event_time"].values
    assert bend == pytest.approx(1.0, rel=1e-14)
    assert stick - bend == pytest.approx(math.log(5.0 / 3.0), rel=1e-14)


def test_a_brake_that_locks_itself_takes_the_torque_from_others() -> None:
    """Without a limit its share of it is 0, whatever it holds."""
    locking = wb.Contact(
        "disc", name="wedge", brake=wb.WedgeBrake(radius=0.2, angle=0.2),
        friction=wb.CoulombFriction(kinetic=0.3), actuation=wb.Actuation(initial_force=10.0),
    )  # fmt: skip
    machine = single(locking, contact("disc", name="other", force=3.0), torque=2.0)
    response = wb.simulate(machine, 1.0, times=[1.0])
    np.testing.assert_allclose(response["brake_torque"][0], [2.0, 0.0], atol=1e-12)


@pytest.mark.parametrize("first", [
    "brake",
    "clutch",
])  # fmt: skip
def test_a_jump_that_more_than_one_contact_cannot_hold(first: str) -> None:
    """A brake of 3 N m holds i0, a clutch of 5 N m joins i1 to it, which 8 N m pull from 1 s on.

    Both would be beyond their limits at rest. Once the brake slips, the clutch has to pass on
    8 - 2 (8 - 3)/(1 + 2) = 14/3 N m only, and holds.
    """
    brake = contact("i0", name="brake", force=3.0)
    clutch = contact("i1", "i0", name="clutch", force=5.0)
    step = wb.Table((0.0, 1.0, 1.0), (0.0, 0.0, 8.0), after="hold")
    machine = wb.Machine(
        inertias=[wb.Inertia("i0", 1.0), wb.Inertia("i1", 2.0)],
        contacts=[brake, clutch] if first == "brake" else [clutch, brake],
        torques=[wb.Torque("i1", step, name="pull")],
    )
    response = wb.simulate(machine, 3.0, times=[3.0])
    assert response.attrs["status"] == "completed"
    assert events(response) == [(1.0, 0 if first == "brake" else 1, SLIP)]
    np.testing.assert_allclose(response["velocity"][-1], 10.0 / 3.0, rtol=1e-13)


# Linear motion.


@pytest.mark.parametrize("seed", range(20))
def test_many_contacts_after_a_jump_of_the_torques(seed: int) -> None:
    """Friction minimises the sum of inertia times squared acceleration, within its limits.

    The inertias form a tree, held by brakes and clutches.
    """
    rng = np.random.default_rng(seed)
    count = 20
    sizes, forces = rng.uniform(0.5, 2.0, count), rng.uniform(0.5, 3.0, count)
    jumps = rng.normal(0.0, rng.choice([0.5, 2.0, 8.0]), count)
    others = ["ground" if rng.random() < 0.2 else f"i{rng.integers(n)}" for n in range(1, count)]
    ends = ["ground", *others]
    machine = wb.Machine(
        inertias=[wb.Inertia(f"i{n}", one) for n, one in enumerate(sizes)],
        contacts=[
            contact(f"i{n}", end, name=f"c{n}", force=force)
            for n, (end, force) in enumerate(zip(ends, forces, strict=True))
        ],
        torques=[
            wb.Torque(f"i{n}", wb.Table((0.0, 1.0, 1.0, 2.0), (0.0, 0.0, jump, jump)))
            for n, jump in enumerate(jumps)
        ],
    )
    response = wb.simulate(machine, 1.0 + 1e-3, times=[1.0 + 1e-3])
    assert response.attrs["status"] == "completed"
    directions = np.eye(count)
    for n, end in enumerate(ends):
        if end != "ground":
            directions[int(end[1:]), n] = -1.0
    weight = 1.0 / np.sqrt(sizes)
    best = lsq_linear(
        weight[:, None] * directions, -weight * jumps, bounds=(-forces, forces), method="bvls",
        tol=1e-14,
    )  # fmt: skip
    accelerations = (jumps + directions @ best.x) / sizes
    np.testing.assert_allclose(
        response["velocity"].values[-1], 1e-3 * accelerations, atol=1e-13 * np.abs(jumps).max()
    )


@pytest.mark.parametrize("slope", [-0.9, 1e-9, 1.5])
@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_stop_of_a_free_inertia(slope: float, side: float) -> None:
    """J w' = -(F0 + slope w): t = J/(R g slope) ln(1 + slope W0/F0), heat J W0^2/2."""
    inertia, speed, force = 1.3, 40.0, 60.0
    brake = wb.Contact(
        "disc", name="brake", brake=wb.WedgeBrake(angle=0.6, radius=0.2),
        friction=wb.CoulombFriction(kinetic=0.4, static=0.5),
        actuation=wb.Actuation(initial_force=force, slope=slope),
    )  # fmt: skip
    gain = 0.2 * 0.4 / (math.tan(0.6) - side * 0.4)
    machine = single(brake, inertia=inertia, speed=side * speed)
    response = wb.simulate(machine, 60.0)
    expected = inertia / (gain * slope) * math.log1p(slope * speed / force)
    assert times_of(response, STICK) == pytest.approx([expected], rel=1e-13)
    heat = float(wb.energy(response)["friction_heat"].sum())
    assert heat == pytest.approx(0.5 * inertia * speed**2, rel=1e-13)


def chain(*inertias: float, start: Sequence[float], shafts: Any, torques: Any = ()) -> wb.Machine:
    return wb.Machine(
        inertias=[
            wb.Inertia(f"i{n}", size, angle=0.1 * n, speed=speed)
            for n, (size, speed) in enumerate(zip(inertias, start, strict=True))
        ],
        shafts=[
            wb.Shaft(a, b, stiffness=k, damping=c, ratio=ratio) for a, b, k, c, ratio in shafts
        ],
        torques=[
            wb.Torque(on, signal, name=f"torque-{n}") for n, (on, signal) in enumerate(torques)
        ],
    )  # fmt: skip


def linear(machine: wb.Machine, times: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Angles and speeds under constant torques, by the matrix exponential."""
    n = len(machine.inertias)
    names = [one.name for one in machine.inertias]
    inertia = np.array([one.inertia for one in machine.inertias])
    a = np.zeros((2 * n + 1, 2 * n + 1))
    a[:n, n : 2 * n] = np.eye(n)
    for shaft in machine.shafts:
        row = np.zeros(n)
        row[names.index(shaft.a)] += 1.0
        if shaft.b != "ground":
            row[names.index(shaft.b)] -= shaft.ratio
        a[n : 2 * n, :n] -= shaft.stiffness * np.outer(row, row) / inertia[:, None]
        a[n : 2 * n, n : 2 * n] -= shaft.damping * np.outer(row, row) / inertia[:, None]
    for torque in machine.torques:
        at = names.index(torque.on)
        a[n + at, -1] += float(torque.signal(0.0)) / inertia[at]
    start = [one.angle for one in machine.inertias] + [one.speed for one in machine.inertias]
    found = np.array([expm(a * t) @ [*start, 1.0] for t in times])
    return found[:, :n], found[:, n : 2 * n]


CHAINS = {
    "rigid mode": chain(
        1.0, 0.3, 2.0, start=(3.0, -1.0, 0.5),
        shafts=[("i0", "i1", 90.0, 0.4, 1.0), ("i1", "i2", 400.0, 0.0, -2.0)],
    ),
    "no shaft": chain(1.0, 2.0, start=(3.0, -1.0), shafts=(), torques=[("i0", 0.7)]),
    "two shafts side by side": chain(
        1.0, 2.0, start=(3.0, -1.0),
        shafts=[("i0", "i1", 90.0, 0.0, 1.0), ("i0", "ground", 30.0, 0.2, 1.0)],
        torques=[("i0", 2.0), ("i1", -5.0), ("i1", 1.0)],
    ),
    "overdamped": chain(1.0, start=(3.0,), shafts=[("i0", "ground", 100.0, 500.0, 1.0)]),
    "near critical": chain(1.0, start=(3.0,), shafts=[("i0", "ground", 100.0, 20.0 + 1e-9, 1.0)]),
    "damper alone": chain(1.0, 4.0, start=(3.0, 0.0), shafts=[("i0", "i1", 0.0, 2.0, 1.0)]),
}  # fmt: skip


@pytest.mark.parametrize("name", CHAINS)
def test_linear_machines(name: str) -> None:
    machine, times = CHAINS[name], np.linspace(0.0, 3.0, 61)
    response = wb.simulate(machine, 3.0, times=times)
    angles, speeds = linear(machine, times)
    scale = np.max(np.abs(speeds))
    np.testing.assert_allclose(response["velocity"], speeds, rtol=0, atol=1e-12 * scale)
    np.testing.assert_allclose(response["angle"], angles, rtol=0, atol=1e-12 * scale)


def test_critical_damping() -> None:
    """q = (q0 + (w0 + 10 q0) t) exp(-10 t)."""
    machine = single(stiffness=100.0, damping=20.0, angle=0.3, speed=2.0)
    response = wb.simulate(machine, 2.0)
    t = response["time"].values
    expected = (0.3 + 5.0 * t) * np.exp(-10.0 * t)
    np.testing.assert_allclose(response["angle"].values[:, 0], expected, rtol=0, atol=1e-15)


def test_resonance() -> None:
    """q'' + w^2 q = a sin(w t) from rest: a/(2 w^2) (sin w t - w t cos w t)."""
    frequency = 1.6
    omega = 2.0 * math.pi * frequency
    machine = single(stiffness=omega**2, torque=wb.Harmonic(3.0, frequency))
    response = wb.simulate(machine, 20.0)
    phase = omega * response["time"].values
    expected = 1.5 / omega**2 * (np.sin(phase) - phase * np.cos(phase))
    found = response["angle"].values[:, 0]
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-13 * np.max(np.abs(expected)))


SIGNALS: dict[str, wb.Signal] = {
    "harmonic": wb.Harmonic(3.0, 1.3, 0.4),
    "ramp": wb.Ramp(1.0, -2.0, 0.7, begin=0.4),
    "jump": wb.Table((0.0, 0.5, 0.5, 3.0), (1.0, 2.0, -4.0, 0.0)),
    "sweep": wb.Orders(wb.Ramp(2.0, 30.0, 2.0), ((1.0, 2.0, 0.0), (2.5, 1.0, 1.0))),
    "product": wb.Harmonic(3.0, 1.3) * wb.Ramp(0.0, 1.0, 1.5),
    "log ramp": wb.Ramp(1.0, 20.0, 0.7, begin=0.4, law="log"),
    "falling": wb.Ramp(-20.0, -1e-3, 1.1, law="log"),
    "chirp": wb.Chirp(2.0, 1.0, 8.0, 1.5, law="log"),
    "periodic": wb.Table((0.0, 0.1, 0.1, 0.4), (1.0, 2.0, -4.0, 1.0), periodic=True),
}


@pytest.mark.parametrize("name", SIGNALS)
def test_free_inertia_integrates_its_torque(name: str) -> None:
    signal, times = SIGNALS[name], np.linspace(0.0, 2.5, 26)
    response = wb.simulate(single(inertia=0.7, torque=signal), 2.5, times=times)
    expected = signal.integral(times) / 0.7
    np.testing.assert_allclose(response["velocity"].values[:, 0], expected, rtol=0, atol=1e-12)


def test_superposition_without_contacts() -> None:
    """The response to all torques is the sum of the responses to each."""
    shafts = [("i0", "i1", 90.0, 0.4, 1.5), ("i1", "ground", 400.0, 0.1, 1.0)]
    places = ("i0", "i1") * 5
    torques = list(zip(places, SIGNALS.values(), strict=False))

    def velocity(chosen: Any) -> np.ndarray:
        machine = chain(1.0, 0.3, start=(0.0, 0.0), shafts=shafts, torques=chosen)
        machine = machine.replace({"i1.angle": 0.0})
        return wb.simulate(machine, 2.5, times=np.linspace(0.0, 2.5, 101))["velocity"].values

    together = velocity(torques)
    parts = sum(velocity([one]) for one in torques)
    np.testing.assert_allclose(parts, together, rtol=0, atol=1e-12 * np.max(np.abs(together)))


# Where a run starts.


@pytest.mark.parametrize(("torque", "kind"), [(1.0, None), (1.0 + 1e-9, SLIP), (-1.0, None)])
def test_start_at_the_holding_limit(torque: float, kind: int | None) -> None:
    """At its limit exactly a contact holds; beyond it, it slides from the start."""
    response = wb.simulate(single(contact("disc"), torque=torque), 1.0, times=[0.0, 1.0])
    if kind is None:
        assert response["sticking"].values.all()
        np.testing.assert_array_equal(response["velocity"], 0.0)
    else:
        assert not response["sticking"].values[-1, 0]
        assert response["velocity"].values[-1, 0] == pytest.approx(torque - 1.0, rel=1e-6)


def test_start_at_the_holding_limit_that_is_left_at_once() -> None:
    """A torque that rises from the limit on: v = t^2/2."""
    rising = wb.Table((0.0, 2.0), (1.0, 3.0))
    response = wb.simulate(single(contact("disc"), torque=rising), 1.0, times=[0.0, 0.5, 1.0])
    np.testing.assert_allclose(response["velocity"][:, 0], [0.0, 0.125, 0.5], rtol=1e-13)


@pytest.mark.parametrize("parts", [(1.0,), (0.25, 0.75)])
def test_arrival_at_the_holding_limit_that_grows(parts: tuple[float, ...]) -> None:
    """A block comes to rest where the torque of its spring equals the holding limit of the brake.

    With slightly more force it holds, with slightly less it first slips back; in between, rounding
    decides. The block may consist of two parts that a clutch holds together.
    """
    stiffness, rate = 100.0, 40.0
    frequency = math.sqrt(stiffness)

    def first_kind(force: float) -> int:
        pressing = wb.Ramp(force, force + rate, 1.0)
        names = ("disc", "other")[: len(parts)]
        machine = wb.Machine(
            inertias=[wb.Inertia(*one, speed=1.0) for one in zip(names, parts, strict=True)],
            shafts=[wb.Shaft("disc", "ground", stiffness=stiffness)],
            contacts=[
                contact("disc", force=pressing),
                *(contact("disc", one, name="clutch", force=90.0) for one in names[1:]),
            ],
        )
        response = wb.simulate(machine, 0.9, times=[])
        assert response.attrs["status"] == "completed"
        kinds = [kind for _, number, kind in events(response) if number == 0]
        assert kinds in ([STICK], [REVERSAL, STICK])
        return kinds[0]

    def excess(force: float) -> float:
        """Torque of the spring in excess of that of the brake when the speed becomes zero."""
        cosine, sine = force / stiffness, (1.0 + rate / stiffness) / frequency

        def velocity(time: float) -> float:
            phase = frequency * time
            swing = sine * math.cos(phase) - cosine * math.sin(phase)
            return frequency * swing - rate / stiffness

        time = brentq(velocity, 0.0, math.pi / frequency)
        swing = cosine * math.cos(frequency * time) + sine * math.sin(frequency * time)
        return stiffness * swing - 2.0 * (force + rate * time)

    low, high = 1.0, 9.0
    assert (first_kind(low), first_kind(high)) == (REVERSAL, STICK)
    while low < 0.5 * (low + high) < high:
        middle = 0.5 * (low + high)
        low, high = (middle, high) if first_kind(middle) == REVERSAL else (low, middle)
    # Rates count as rounding below 1e-11 (with several contacts, 2e-11) of the sum of those of the
    # largest torque, 90 / 0.25, and of the spring. The excess changes 1.3 times as much
    # as the force.
    rounding = 1e-11 * len(parts) * 400.0 / 1.3
    assert high == pytest.approx(brentq(excess, 1.0, 9.0, xtol=1e-14), abs=rounding)


def test_start_on_a_limit_of_the_force() -> None:
    """A force that starts at its limit and leaves it, or stays."""
    for slope, expected in ((-0.5, 3.0 - 0.5 * 2.0), (0.5, 3.0)):
        machine = single(contact("disc", force=3.0, slope=slope, limits=(0.0, 3.0)), speed=2.0)
        response = wb.simulate(machine, 1.0, times=[0.0])
        assert float(response["actuation_force"][0, 0]) == pytest.approx(expected, rel=1e-14)


def test_start_on_a_bend_of_the_friction() -> None:
    """The speed starts at 1 rad/s, where the table bends, and follows the lower line from there."""
    friction = wb.TabulatedFriction(speeds=(0.0, 2.0, 4.0), coefficients=(0.5, 0.3, 0.3))
    machine = single(contact("disc", force=10.0, friction=friction), speed=1.0)
    # Radius 2: the bend is at 1 rad/s; below it the torque is 20 (0.5 - 0.2 v): v' = 4 v - 10.
    response = wb.simulate(machine, 1.0)
    assert times_of(response, STICK) == pytest.approx([0.25 * math.log(10.0 / 6.0)], rel=1e-13)


def test_nothing_moves_a_machine_at_rest() -> None:
    machine = single(contact("disc", force=0.0), torque=wb.Harmonic(0.0, 3.0), stiffness=4.0)
    response = wb.simulate(machine, 5.0)
    np.testing.assert_array_equal(response["velocity"], 0.0)
    assert response.attrs["status"] == "completed"


def test_duration_of_nothing() -> None:
    response = wb.simulate(single(contact("disc"), speed=3.0), 0.0, times=[0.0])
    assert response["velocity"].values.tolist() == [[3.0]]


# Signals.


def sticking_line(torque: Any, **more: Any) -> wb.Machine:
    return single(
        contact("disc", force=3.0, static=1.2, **more), torque=torque, stiffness=60.0, damping=0.5
    )


def test_table_of_a_sine_converges_as_its_step_squared() -> None:
    amplitude, frequency = 8.0, 1.0
    times = np.linspace(0.0, 3.0, 61)
    exact = wb.simulate(sticking_line(wb.Harmonic(amplitude, frequency)), 3.0, times=times)
    errors = []
    for points in (32, 64, 128, 256):
        phases = np.arange(points + 1) / points
        values = amplitude * np.sin(2.0 * math.pi * phases)
        table = wb.Table(tuple(phases / frequency), tuple(values), periodic=True)
        found = wb.simulate(sticking_line(table), 3.0, times=times)
        assert events(found)
        errors.append(float(np.abs(found["velocity"] - exact["velocity"]).max()))
    ratios = np.array([coarse / fine for coarse, fine in pairwise(errors)])
    np.testing.assert_allclose(ratios, 4.0, rtol=0.15)


def test_harmonics_of_no_size_change_nothing() -> None:
    wave = wb.Harmonic(8.0, 1.0)
    several = wave + wb.Harmonic(0.0, 7.3, 1.0) + wb.Harmonic(0.0, 1.0)
    alone, together = (wb.simulate(sticking_line(one), 5.0) for one in (wave, several))
    assert [e[1:] for e in events(alone)] == [e[1:] for e in events(together)]
    np.testing.assert_allclose(alone["velocity"], together["velocity"], rtol=0, atol=1e-12)


def test_start_time_shifts_signals() -> None:
    """A run from a later start is one under signals that begin earlier."""
    wave = wb.Harmonic(8.0, 1.0, 0.3)
    later = wb.simulate(sticking_line(wave), 3.0, start_time=0.35)
    earlier = wb.simulate(sticking_line(wb.Harmonic(8.0, 1.0, 0.3 + 0.7 * math.pi)), 3.0)
    np.testing.assert_allclose(later["velocity"], earlier["velocity"], rtol=0, atol=1e-11)


# Forces: controllers, lags, limits.


def direct(
    inertia: float, speed: float, force: float, slope: float, step: float, delay: int,
    resolution: float, count: int,
) -> np.ndarray:  # fmt: skip
    """Speeds at the samples of a free inertia under a controller, by momentum."""
    waiting, speeds = [force] * delay, []
    for _ in range(count):
        speeds.append(speed)
        command = force + slope * abs(speed)
        if resolution:
            command = resolution * round(command / resolution)
        waiting.append(command)
        applied = max(waiting.pop(0), 0.0)
        after = speed - step * applied / inertia
        # It stops and stays where the force would turn it around.
        speed = after if after > 0.0 else 0.0
    return np.array(speeds)


@pytest.mark.parametrize("delay", [0, 1, 3])
@pytest.mark.parametrize("resolution", [None, 0.5])
@pytest.mark.parametrize("slope", [-1.8, 0.7])
def test_sampled_controller(delay: int, resolution: float | None, slope: float) -> None:
    step, count = 0.01, 120
    brake = contact(
        "disc", force=50.0, slope=slope, sample_time=step, delay=delay, resolution=resolution
    )
    machine = single(brake, inertia=1.3, speed=30.0)
    times = step * np.arange(count)
    response = wb.simulate(machine, step * count, times=times)
    expected = direct(1.3, 30.0, 50.0, slope, step, delay, resolution or 0.0, count)
    np.testing.assert_allclose(response["velocity"][:, 0], expected, rtol=0, atol=1e-11)


@pytest.mark.parametrize("force", [18.0, 20.0, 22.0])
@pytest.mark.parametrize("stiffness", [0.0, 1000.0])
def test_sampled_force_that_begins_below_zero(force: float, stiffness: float) -> None:
    """The command is force - 10 |speed|, which is zero at first or begins to act later."""
    step = 0.004
    machine = wb.Machine(
        inertias=[wb.Inertia("disc", 1.0, speed=2.0)],
        shafts=[wb.Shaft("disc", "ground", stiffness=stiffness, damping=0.5)],
        contacts=[contact("disc", force=force, slope=-10.0, sample_time=step)],
        torques=[wb.Torque("disc", wb.Harmonic(150.0, 7.0, 0.3))],
    )
    times = 0.5 * step * np.arange(100)
    run = wb.simulate(machine, times[-1], times=times)
    speeds, forces = run["velocity"][::2, 0], run["actuation_force"][1::2, 0]
    assert float(forces.max()) > 1.0
    expected = np.maximum(force - 10.0 * np.abs(speeds), 0.0)
    np.testing.assert_allclose(forces, expected, rtol=0, atol=1e-11)


@pytest.mark.parametrize("lag", [{"lag": 0.1}, {"frequency": 20.0, "damping_ratio": 0.7}])
def test_a_lag_begins_at_the_force_and_follows_the_rounded_command(lag: dict[str, float]) -> None:
    """130 N rounded to steps of 100 N; the force decays to it."""
    brake = contact("disc", force=130.0, sample_time=0.01, resolution=100.0, **lag)
    times = np.array([0.0, 0.1, 0.5])
    run = wb.simulate(single(brake, inertia=100.0, speed=50.0), 0.5, times=times)
    if "lag" in lag:
        share = np.exp(-10.0 * times)
    else:
        omega = 20.0 * math.sqrt(1.0 - 0.7**2)
        share = np.exp(-14.0 * times) * (np.cos(omega * times) + 14 / omega * np.sin(omega * times))
    np.testing.assert_allclose(run["actuation_force"][:, 0], 100.0 + 30.0 * share, rtol=1e-12)


def test_sampled_controller_samples_from_the_start_on() -> None:
    """Samples count from the start of the run, wherever this is."""
    brake = contact("disc", force=50.0, slope=-0.8, sample_time=0.03, delay=1)
    machine = single(brake, speed=30.0)
    one = wb.simulate(machine, 0.4, times=np.linspace(0.0, 0.4, 41))
    other = wb.simulate(machine, 0.4, start_time=7.013, times=7.013 + np.linspace(0.0, 0.4, 41))
    np.testing.assert_allclose(one["velocity"], other["velocity"], rtol=0, atol=1e-11)


def test_controller_approaches_direct_control() -> None:
    """As T_s -> 0 the sampled force is the continuous one, with an error of order T_s."""
    times = np.linspace(0.0, 2.0, 81)
    wave = wb.Harmonic(8.0, 1.0)
    exact = wb.simulate(sticking_line(wave, slope=0.4), 2.0, times=times)["velocity"]
    errors = []
    for step in (4e-3, 1e-3, 2.5e-4):
        found = wb.simulate(sticking_line(wave, slope=0.4, sample_time=step), 2.0, times=times)
        errors.append(float(np.abs(found["velocity"] - exact).max()))
    assert errors[2] < 0.5 * errors[1] < 0.25 * errors[0]


@pytest.mark.parametrize("kind", ["first", "second"])
def test_short_lags_vanish(kind: str) -> None:
    """T_a -> 0: the force follows at once; the error is of the order of the lag."""
    times = np.linspace(0.0, 2.0, 81)
    wave = wb.Harmonic(8.0, 1.0)
    exact = wb.simulate(sticking_line(wave, slope=0.4), 2.0, times=times)["velocity"]
    errors = []
    for lag in (1e-2, 1e-3, 1e-4):
        more = {"lag": lag} if kind == "first" else {"frequency": 1.0 / lag, "damping_ratio": 0.7}
        found = wb.simulate(sticking_line(wave, slope=0.4, **more), 2.0, times=times)
        errors.append(float(np.abs(found["velocity"] - exact).max()))
    np.testing.assert_allclose(np.divide(errors[1:], errors[:-1]), 0.1, atol=0.06)


@pytest.mark.parametrize("order", [1, 2])
def test_lag_between_command_and_force(order: int) -> None:
    """A force that rises from nothing to 10 N with a lag, and limits that act after it."""
    more = {"lag": 0.3} if order == 1 else {"frequency": 4.0, "damping_ratio": 0.25}
    step = wb.Table((0.0, 1.0, 1.0), (0.0, 0.0, 10.0), after="hold")
    times = np.linspace(1.0, 3.0, 50)
    s = times - 1.0
    if order == 1:
        force = 10.0 * -np.expm1(-s / 0.3)
    else:
        damped = 4.0 * math.sqrt(1.0 - 0.25**2)
        force = 10.0 - 10.0 * np.exp(-s) * (np.cos(damped * s) + np.sin(damped * s) / damped)
    for low, high in ((0.0, 1e3), (1.0, 9.0)):
        brake = contact("disc", force=step, limits=(low, high), **more)
        response = wb.simulate(single(brake, speed=100.0), 3.0, times=times)
        expected = np.clip(force, low, high)
        np.testing.assert_allclose(response["actuation_force"][:, 0], expected, atol=1e-12)


def test_force_where_friction_vanishes() -> None:
    """The brake is pressed where its friction coefficient is 0, and released beyond 40 rad/s."""
    table = wb.TabulatedFriction(speeds=[0.0, 1.0, 2.0], coefficients=[0.3, 0.0, 0.0])
    brake = contact("disc", force=400.0, slope=-10.0, friction=table)
    for speed, expected in ((30.0, 100.0), (50.0, 0.0)):
        response = wb.simulate(single(brake, speed=speed), 0.5)
        np.testing.assert_allclose(response["actuation_force"][:, 0], expected, rtol=1e-13)


JUMPS = [(5, 5, 1, 1), (5, 5, 9, 9), (9, 9, 1, 1), (5, 5, 1, 3), (5, 5, 9, 7), (1, 1, 9, 5)]


@pytest.mark.parametrize("values", JUMPS)
def test_force_that_jumps_beyond_a_limit(values: tuple[float, ...]) -> None:
    force = wb.Table((0.0, 1.0, 1.0, 2.0), values)
    machine = single(contact("disc", force=force, limits=(2.0, 8.0)), speed=40.0)
    times = np.linspace(0.05, 1.95, 20)
    response = wb.simulate(machine, 2.0, times=times)
    expected = np.clip(force(times), 2.0, 8.0)
    np.testing.assert_allclose(response["actuation_force"][:, 0], expected, rtol=1e-13)


def test_brake_that_a_jump_releases() -> None:
    """50 - 2 |v| is pressed at v = 15 or so; 4 - 2 |v|, from 1 s on, is not."""
    force = wb.Table((0.0, 1.0, 1.0, 2.0), (50.0, 50.0, 4.0, 12.0))
    machine = single(contact("disc", force=force, slope=-2.0), inertia=10.0, speed=20.0)
    times = np.linspace(0.05, 1.95, 20)
    response = wb.simulate(machine, 2.0, times=times)
    speed = response["velocity"].values[:, 0]
    expected = np.maximum(force(times) - 2.0 * speed, 0.0)
    np.testing.assert_allclose(response["actuation_force"][:, 0], expected, atol=1e-12)


# Bases that move.


def test_brake_on_a_base_that_slows_down() -> None:
    """The inertia follows a base 8 cos t until the torque J 8 sin t reaches 6 N m."""
    base = wb.Harmonic(8.0, 0.5 / math.pi, 0.5 * math.pi)
    machine = single(contact("disc", force=6.0, base_speed=base), speed=8.0)
    response = wb.simulate(machine, 2.0, times=[0.5, 1.2])
    slip = math.asin(0.75)
    assert times_of(response, SLIP) == pytest.approx([slip], rel=1e-13)
    speeds = [8.0 * math.cos(0.5), 8.0 * math.cos(slip) - 6.0 * (1.2 - slip)]
    np.testing.assert_allclose(response["velocity"][:, 0], speeds, rtol=1e-13)


def test_base_that_jumps() -> None:
    """A base at rest starts at 3 rad/s at 1 s: the inertia catches up at 2 rad/s^2."""
    base = wb.Table((0.0, 1.0, 1.0), (0.0, 0.0, 3.0), after="hold")
    response = wb.simulate(single(contact("disc", force=2.0, base_speed=base)), 4.0)
    assert times_of(response, SLIP) == pytest.approx([1.0], rel=1e-15)
    assert times_of(response, STICK) == pytest.approx([2.5], rel=1e-13)


# Restarts.


def test_a_final_state_from_its_json() -> None:
    brake = contact("disc", force=wb.Harmonic(10.0, 1.0) + 30.0, lag=0.01)
    state = wb.final_state(wb.simulate(single(brake, speed=5.0), 0.3))
    assert wb.FinalState.from_json(state.to_json()) == state
    for wrong in ("", "[]", "{}", '{"time": 1.0}', state.to_json()[:-1], 3):
        with pytest.raises(wb.InputError) as caught:
            wb.FinalState.from_json(wrong)
        assert caught.value.name == "text"


@pytest.mark.parametrize("duration", [0.5, 3.0, 5.0])
@pytest.mark.parametrize("speed", [0.1, 0.0, -0.2, 0.4])
def test_a_restart_with_another_speed_of_the_base(duration: float, speed: float) -> None:
    """It is the motion that starts with these angles and speeds, from rest on the base or sliding.

    With the force 1 and a stiffness of 1, the mass is on the belt of 0.2 until it is at 1.
    """
    brake = contact("disc", name="belt", force=1.0, base_speed=0.2, static=1.5)
    machine = single(brake, stiffness=1.0, speed=0.15)
    first = wb.simulate(machine, duration)
    state = wb.final_state(first)
    other = machine.replace({"belt.base_speed": speed})
    start = {"disc.angle": state.angles["disc"], "disc.speed": state.speeds["disc"]}
    again = wb.simulate(other, duration + 6.0, initial=state, times=[duration + 6.0])
    expected = wb.simulate(other.replace(start), 6.0, times=[6.0])
    assert again.attrs["status"] == "completed"
    for name in ("angle", "velocity"):
        np.testing.assert_allclose(again[name], expected[name], atol=1e-11)


# Until rest.


def stopped(machine: wb.Machine, longest: float) -> Any:
    """Runs until rest; a long run from there has no release, as the proof says."""
    response = wb.simulate(machine, longest, until="rest")
    if response.attrs["at_rest"]:
        end = response.attrs["final_time"]
        assert all(mode[0] == 0 for mode in wb.final_state(response).modes)
        later = wb.simulate(machine, longest)
        assert not [t for t, _, kind in events(later) if t > end + 1e-9]
        assert events(later) == events(response)
    return response


def test_stop_ends_when_the_brake_holds() -> None:
    response = stopped(single(contact("disc", force=60.0), inertia=1.3, speed=40.0), 100.0)
    assert response.attrs["at_rest"]
    assert response.attrs["final_time"] == pytest.approx(1.3 * 40.0 / 60.0, rel=1e-14)


def test_last_sample_of_a_run_until_rest_is_at_rest() -> None:
    response = wb.simulate(single(contact("disc"), speed=2.0), 9.0, until="rest")
    assert bool(response["sticking"][-1].all())


@pytest.mark.parametrize("speed", [1.0, 9.0])
def test_stop_while_another_inertia_rings(speed: float) -> None:
    """A disc is stopped; the body on its shaft rings, and must not tear it loose again."""
    machine = wb.Machine(
        inertias=[wb.Inertia("disc", 1.0, speed=speed), wb.Inertia("body", 2.0, speed=speed)],
        shafts=[wb.Shaft("disc", "body", stiffness=300.0, damping=0.5)],
        contacts=[contact("disc", force=30.0, static=1.1)],
    )
    response = stopped(machine, 60.0)
    assert response.attrs["at_rest"]
    assert response.attrs["final_time"] < 60.0
    assert abs(float(response["velocity"][-1, 1])) > 1e-3


def test_rest_does_not_come_without_damping_enough() -> None:
    """Undamped, a body rings for ever with more torque than the brake holds: no end."""
    machine = wb.Machine(
        inertias=[wb.Inertia("disc", 1.0), wb.Inertia("body", 2.0, speed=3.0)],
        shafts=[wb.Shaft("disc", "body", stiffness=300.0)],
        contacts=[contact("disc", force=0.5)],
    )
    response = wb.simulate(machine, 3.0, until="rest")
    assert not response.attrs["at_rest"]
    assert response.attrs["final_time"] == 3.0


@pytest.mark.parametrize("torque", [
    wb.Harmonic(1.5, 0.3), wb.Table((0.0, 20.0, 20.0, 40.0), (0.0, 0.0, 1.5, 1.5)),
    wb.Ramp(0.0, 1.5, 1.0, begin=30.0),
], ids=["harmonic", "jump", "ramp"])  # fmt: skip
def test_rest_is_not_proved_where_a_torque_will_release(torque: wb.Signal) -> None:
    machine = single(contact("disc", force=1.0), torque=torque, speed=0.5)
    response = wb.simulate(machine, 40.0, until="rest")
    assert times_of(response, SLIP).size > 0
    whole = wb.simulate(machine, 40.0, times=[40.0])
    seen = [e for e in events(whole) if e[0] <= response.attrs["final_time"]]
    assert events(response) == seen


def test_rest_under_a_torque_that_the_brake_holds() -> None:
    response = stopped(single(contact("disc"), torque=wb.Harmonic(0.9, 0.3), speed=0.5), 40.0)
    assert response.attrs["at_rest"]


def test_a_controller_that_may_release_later_is_no_rest() -> None:
    """The force follows the command with a lag: it falls below the torque after the stop."""
    falling = wb.Table((0.0, 0.2, 0.2), (10.0, 10.0, 0.5), after="hold")
    machine = single(contact("disc", force=falling, lag=2.0), torque=1.0, speed=0.5)
    response = wb.simulate(machine, 20.0, until="rest")
    release = 0.2 + 2.0 * math.log(9.5 / 0.5)
    assert times_of(response, SLIP) == pytest.approx([release], rel=1e-12)
    assert not response.attrs["at_rest"]


@pytest.mark.parametrize("excess", [0.0, 2.0**-52, -(2.0**-52), 1e-14, 1e-12, 1e-11, 1e-9])
@pytest.mark.parametrize("speed", [0.0, -1.0])
def test_a_constant_torque_at_the_holding_limit(excess: float, speed: float) -> None:
    # R F mu, computed in another order, differs from the limit by rounding. At rest, the excess is
    # all that accelerates the inertia, or it holds where the excess is rounding.
    brake = machines.contact(friction=0.25, force=10.0)
    machine = single(brake, torque=2.5 * (1.0 + excess), speed=speed)
    response = wb.simulate(machine, 2.0, times=[0.0, 2.0])
    assert response.attrs["status"] == "completed"
    stop = -speed / (5.0 + 2.5 * excess)
    expected = 2.5 * excess * (2.0 - stop)
    assert float(response["velocity"][-1, 0]) == pytest.approx(expected, abs=2e-10, rel=1e-6)
