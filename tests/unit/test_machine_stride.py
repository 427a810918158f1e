"""Cells of equal lengths: the same motion as without their matrices, and no guard is missed."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import pytest
from scipy.signal import lsim

import wedgebrake as wb
from machine_cases import random_machine
from machines import contact, single
from wedgebrake.dynamics.enums import EventKind, Outcome
from wedgebrake.solvers.machine import problem as numbers
from wedgebrake.solvers.machine.assemble import assemble
from wedgebrake.solvers.machine.final_state import start_state
from wedgebrake.solvers.machine.trajectory import trajectory
from wedgebrake.solvers.machine.trajectory.observers import observer_of

MOST = 10**9


class Moved(NamedTuple):
    """A run: events, final state, states at the samples, cells with matrices, and all cells."""

    events: Any
    state: Any
    samples: Any
    strode: int
    cells: int


def moved(machine: wb.Machine, duration: float, times: Any = ()) -> Moved:
    problem = assemble(machine, 0.0).problem
    run = numbers.run_of(problem)
    start_state(machine, problem, run)
    observer = observer_of(problem, np.asarray(times, float))
    log = np.zeros(20_000, numbers.EVENT)
    span = trajectory.Span(duration, MOST, MOST, False, True, False, np.zeros(1, np.bool_))
    ended = trajectory.move(problem, run, span, log, observer)
    assert ended.outcome == Outcome.COMPLETED
    return Moved(
        log[: ended.events], run.z[: problem.states, 0].copy(), observer.states,
        int(run.strides.kinds["uses"][1:].sum()), ended.cells,
    )  # fmt: skip


def check_both(
    monkeypatch: pytest.MonkeyPatch, machine: wb.Machine, duration: float, tolerance: float = 1e-11
) -> Moved:
    """The motion with matrices is that without them; returns it."""
    times = np.linspace(0.0, duration, 41)
    found = moved(machine, duration, times)
    with monkeypatch.context() as patch:
        patch.setattr(numbers, "_STRIDES", 0)
        plain = moved(machine, duration, times)
    assert plain.strode == 0
    for name in ("contact", "kind", "before", "after"):
        np.testing.assert_array_equal(found.events[name], plain.events[name])
    np.testing.assert_allclose(
        found.events["time"], plain.events["time"], rtol=0.0, atol=tolerance * duration
    )
    scale = np.maximum(np.max(np.abs(plain.samples), axis=0), 1e-3)
    assert np.max(np.abs(found.samples - plain.samples) / scale) < tolerance
    assert np.max(np.abs(found.state - plain.state) / scale) < tolerance
    return found


def record(seed: int, spacing: float, duration: float, size: float, **more: Any) -> wb.Table:
    """A random torque that wanders at a few Hz, at times of equal spacing."""
    rng = np.random.default_rng(seed)
    times = spacing * np.arange(2 + int(np.ceil(duration / spacing)))
    values = sum(
        size * rng.normal() * np.sin(2.0 * np.pi * f * times + rng.uniform(0.0, 6.0))
        for f in rng.uniform(0.3, 6.0, size=5)
    )
    return wb.Table(times, values, **more)


def with_torque(machine: wb.Machine, signal: Any) -> wb.Machine:
    extra = wb.Torque(machine.inertias[0].name, signal, name="record")
    return rebuilt(machine, torques=(*machine.torques, extra))


def rebuilt(machine: wb.Machine, **parts: Any) -> wb.Machine:
    """The machine with other parts."""
    names = ("inertias", "shafts", "contacts", "torques")
    return wb.Machine(**({name: getattr(machine, name) for name in names} | parts))


SEEDS = (0, 1, 2, 4, 5, 7, 8, 11, 13, 16, 17, 20, 23, 26, 29, 33)


@pytest.mark.parametrize("seed", SEEDS)
def test_random_machines_under_a_record(monkeypatch: pytest.MonkeyPatch, seed: int) -> None:
    spacing = (1e-3, 2.5e-3, 1.0 / 1024.0, 0.02)[seed % 4]
    machine = with_torque(random_machine(seed), record(seed, spacing, 1.0, 8.0))
    found = check_both(monkeypatch, machine, 1.0, 1e-10)
    assert found.cells > 0.9 / spacing


@pytest.mark.parametrize("seed", SEEDS)
def test_random_machines_under_controllers(monkeypatch: pytest.MonkeyPatch, seed: int) -> None:
    rng = np.random.default_rng(seed)
    machine = random_machine(seed)
    plain = [one for one in machine.contacts if isinstance(one.friction, wb.CoulombFriction)]
    for number, one in enumerate(plain[:2]):
        law = {
            "sample_time": (1e-3, 2e-3)[number], "delay": int(rng.integers(0, 3)),
            "resolution": (None, 0.25)[int(rng.integers(2))],
        }  # fmt: skip
        machine = machine.replace({f"{one.name}.{name}": value for name, value in law.items()})
    check_both(monkeypatch, machine, 0.7, 1e-10)


@pytest.mark.parametrize("seed", SEEDS)
def test_random_machines_without_knots(monkeypatch: pytest.MonkeyPatch, seed: int) -> None:
    check_both(monkeypatch, random_machine(seed), 2.0, 1e-10)


def slider(
    torque: Any, *, speed: float = 0.0, base: Any = 0.0, force: Any = 1.0, on: str = "disc"
) -> wb.Machine:
    """An inertia of 1 kg m^2 without shaft, under a torque and a friction of 1 N m per newton."""
    brake = contact(on, radius=2.0, force=force, base_speed=base)
    return single(brake, name=on, torque=torque, speed=speed)


def test_record_is_a_first_order_hold() -> None:
    """A disc that always slides, against SciPy's discretisation of the linear system."""
    inertia, stiffness, damping = 0.7, 900.0, 3.0
    machine = wb.Machine(
        inertias=[wb.Inertia("disc", inertia)],
        shafts=[wb.Shaft("disc", "ground", stiffness=stiffness, damping=damping)],
        contacts=slider(0.0, base=1000.0).contacts,
        torques=[wb.Torque("disc", table := record(3, 1e-3, 4.0, 10.0), name="torque")],
    )
    times, values = (np.array(one) for one in (table.times, table.values))
    found = moved(machine, 4.0, times[:4000])
    matrix = [[0.0, 1.0], [-stiffness / inertia, -damping / inertia]]
    system = (matrix, [[0.0], [1.0 / inertia]], np.eye(2), np.zeros((2, 1)))
    _, _, states = lsim(system, values[:4000] + 1.0, times[:4000])
    assert found.strode > 3900
    scale = np.max(np.abs(states), axis=0)
    assert np.max(np.abs(found.samples - states) / scale) < 1e-12


@pytest.mark.parametrize("depth", [1e-3, 1e-6, 1e-9])
@pytest.mark.parametrize("spacing", [1e-3, 1.0 / 512.0])
def test_dip_between_two_samples(depth: float, spacing: float) -> None:
    """The speed reaches zero inside a cell at both ends of which it is positive, or just not.

    The torque beyond friction is -a at one sample and a at the next one, so that the speed falls
    by a h/2, then by a h/4 to the middle of the cell, and rises again.
    """
    push, count, at = 40.0, 200, 100
    values = np.ones(count)
    values[at], values[at + 1] = 1.0 - push, 1.0 + push
    table = wb.Table(spacing * np.arange(count), values)
    least = 0.75 * push * spacing
    passing = moved(slider(table, speed=least * (1.0 + depth)), 190 * spacing)
    assert not passing.events.size
    assert passing.strode > 150
    sticking = moved(slider(table, speed=least * (1.0 - depth)), 190 * spacing)
    assert sticking.strode > 70
    assert sticking.events["kind"][0] in (EventKind.STICK, EventKind.REVERSAL)
    # v = v0 - a h/2 - a tau + a tau^2/h.
    rest = least * (1.0 - depth) - 0.5 * push * spacing
    tau = 0.5 * spacing * (1.0 - np.sqrt(1.0 - 4.0 * rest / (push * spacing)))
    expected = (at * spacing + tau, spacing * (at + 0.5))
    assert sticking.events["time"][0] == pytest.approx(expected[0], abs=1e-9 * spacing)
    assert sticking.events["time"][0] < expected[1]


def test_release_between_two_samples() -> None:
    """A holding torque that reaches its limit inside a cell: at the time of a straight line."""
    spacing, count = 1e-3, 400
    values = np.zeros(count)
    values[200:] = np.minimum(0.07 * np.arange(1, 201), 3.0)
    found = moved(slider(wb.Table(spacing * np.arange(count), values)), 0.39)
    assert found.strode > 300
    assert list(found.events["kind"]) == [EventKind.SLIP]
    assert found.events["time"][0] == pytest.approx(spacing * (199.0 + 1.0 / 0.07), abs=1e-14)


@pytest.mark.parametrize("seed", range(4))
def test_irregular_tables(monkeypatch: pytest.MonkeyPatch, seed: int) -> None:
    """Equal spacings between unequal ones, jumps, repetition, and a base that follows a table."""
    rng = np.random.default_rng(seed)
    gaps = np.where(rng.random(900) < 0.1, rng.uniform(0.0, 3e-3, 900), 1e-3)
    times = np.concatenate([[0.0], np.cumsum(gaps)])
    values = 2.0 * np.sin(9.0 * times) + 0.3 * rng.normal(size=times.size)
    times, values = np.insert(times, 300, times[300]), np.insert(values, 300, 4.0)
    wave = wb.Table(2e-3 * np.arange(51), np.sin(0.3 * np.arange(51)), periodic=True)
    steps = wb.Table([0.0, 0.3, 0.3, 0.6, 1.0], [0.5, 0.5, -0.4, 0.2, 0.1], after="hold")
    for base, torque in (
        (0.0, wb.Table(times, values, after="hold")),
        (0.1, wave + wb.Harmonic(2.0, 3.0)),
        (steps, record(seed, 1e-3, 1.0, 1.0)),
        (wave, record(seed, 1e-3, 1.0, 1.0)),
    ):
        check_both(monkeypatch, slider(torque, base=base), 0.9)


@pytest.mark.parametrize("seed", range(4))
def test_other_signals(monkeypatch: pytest.MonkeyPatch, seed: int) -> None:
    """Products of tables and sines, and orders of a speed, which are no polynomials."""
    table = record(seed, 1e-3, 1.0, 0.6)
    force = wb.Constant(1.0) + wb.Table(2e-3 * np.arange(600), 0.2 * np.cos(np.arange(600) / 30))
    speed = wb.Ramp(80.0, 10.0, duration=1.0)
    for torque in (
        table * wb.Harmonic(3.0, 17.0),
        table * wb.Table(1e-3 * np.arange(1100), np.linspace(3.0, 1.0, 1100)),
        table + 2.0 * wb.Orders(speed, ((1.0, 1.0, 0.3),)),
    ):
        check_both(monkeypatch, slider(torque, speed=2.0, force=force), 0.9)


def test_rotation_loses_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    """Large angles cancel before they are multiplied: rounding is that of the spring's torque."""
    machine = wb.Machine(
        inertias=[wb.Inertia(name, 1.0, angle=1e4, speed=100.0) for name in "ab"],
        shafts=[wb.Shaft("a", "b", stiffness=3000.0, damping=0.5)],
        contacts=slider(0.0, on="a").contacts,
        torques=[wb.Torque("b", record(1, 1e-3, 3.0, 1.0), name="torque")],
    )
    found = check_both(monkeypatch, machine, 3.0, 1e-9)
    assert found.strode > 2900
