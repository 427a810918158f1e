"""The reference integrator for machines: closed forms, balances and 50-digit arithmetic."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import pytest
from mpmath import mp

import machine_examples as examples
from machine_reference import Contact, Event, Plain, Run, shaft_matrices, simulate

UNIT: dict[str, Any] = {"radius": 1.0, "kinetic": (-1.0, 1.0), "static": (-1.0, 1.0)}


def constant(value: float) -> Callable[[Any], Any]:
    return lambda t: np.full(np.shape(t), value)


def plain(
    inertia: Sequence[float], speed: Sequence[float], contacts: Sequence[Contact],
    shafts: Sequence[tuple[int, int, float, float, float]] = (), **more: Any,
) -> Plain:  # fmt: skip
    n = len(inertia)
    names = tuple(str(i) for i in range(n))
    stiffness, damping = shaft_matrices(n, shafts)
    return Plain(
        names, np.array(inertia, dtype=float), stiffness, damping, np.zeros(n),
        np.array(speed, dtype=float), tuple(contacts), **more,
    )  # fmt: skip


LINES = {
    "Friction": (
        examples.friction_line, examples.friction_plain, examples.FRICTION_DURATION,
        examples.FRICTION_EVENTS, examples.FRICTION_ANGLES, examples.FRICTION_SPEEDS,
    ),
    "CoupledClutches": (
        examples.coupled_line, examples.coupled_plain, examples.COUPLED_DURATION,
        examples.COUPLED_EVENTS, examples.COUPLED_ANGLES, examples.COUPLED_SPEEDS,
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", LINES)
def test_modelica_drivelines_at_40_digits(name: str) -> None:
    line, _, duration, events, angles, speeds = LINES[name]
    found = examples.exact(line, duration)
    later = [event for event in found.events if event[0] > 0]
    assert [event[1:] for event in later] == [event[1:] for event in events]
    with mp.workdps(50):
        for event, (time, *_) in zip(later, events, strict=True):
            assert abs(event[0] - mp.mpf(time)) < mp.mpf("1e-29")
        for i, (angle, speed) in enumerate(zip(angles, speeds, strict=True)):
            assert abs(found.z[i] - mp.mpf(angle)) < mp.mpf("1e-27")
            assert abs(found.z[found.n + i] - mp.mpf(speed)) < mp.mpf("1e-28")


@pytest.mark.parametrize("name", LINES)
def test_modelica_drivelines(name: str) -> None:
    _, machine, duration, events, angles, speeds = LINES[name]
    run = simulate(machine(), float(duration))
    found = [e for e in run.events if e.kind != "breakpoint" and e.time > 0.0]
    assert [(e.contact, e.kind, e.side) for e in found] == [event[1:] for event in events]
    for e, event in zip(found, events, strict=True):
        assert e.time == pytest.approx(float(event[0]), abs=1e-13)
    last = run.at([float(duration)])
    np.testing.assert_allclose(last["angle"][0], [float(v) for v in angles], atol=2e-12)
    np.testing.assert_allclose(last["velocity"][0], [float(v) for v in speeds], atol=2e-12)


def test_angular_momentum_of_free_inertias() -> None:
    run = simulate(examples.coupled_plain(), 1.5)
    times = np.linspace(0.0, 1.5, 301)
    total = run.at(times)["velocity"].sum(axis=1)
    expected = 10.0 + (1.0 - np.cos(10.0 * math.pi * times)) / math.pi
    np.testing.assert_allclose(total, expected, rtol=2e-15)


def leines_block(blocks: int, coupling: float = 0.0) -> Run:
    """Leine's block(s) on a belt at 0.2 m/s: friction 1/(1 + 3 |v|), unit mass and spring."""
    shafts = [(i, -1, 1.0, 0.0, 1.0) for i in range(blocks)]
    shafts += [(i, i + 1, coupling, 0.0, 1.0) for i in range(blocks - 1)]
    contacts = [
        Contact(
            str(i), i, -1, force=constant(1.0), base=constant(0.2), base_rate=constant(0.0),
            curve=lambda side, v: side / (1.0 + 3.0 * v), **UNIT,
        )
        for i in range(blocks)
    ]  # fmt: skip
    return simulate(plain([1.0] * blocks, [0.2] * blocks, contacts, shafts), 31.0)


@pytest.mark.parametrize(("blocks", "coupling"), [(1, 0.0), (2, 0.0), (2, 0.7)])
def test_mass_on_a_belt(blocks: int, coupling: float) -> None:
    run = leines_block(blocks, coupling)
    for j in range(blocks):
        slips = [e.time for e in run.list_of("slip", contact=j)]
        assert slips[0] == pytest.approx(5.0, abs=1e-14)
        np.testing.assert_allclose(np.diff(slips), 12.0010312948, atol=5e-11)
    times = np.linspace(5.0, 8.0, 3001)
    assert run.at(times)["angle"].max() == pytest.approx(1.1339446764, abs=2e-7)


def test_furthest_deflection_on_a_belt() -> None:
    """The turn of the slip from (1, 0.2), by mpmath's Taylor series at 30 digits."""
    run = leines_block(1)
    low, high = 5.0, 7.0
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if run.at([middle])["velocity"][0, 0] > 0 else (low, middle)
    assert run.at([low])["angle"][0, 0] == pytest.approx(1.133944676441657, rel=1e-14)
    assert low == pytest.approx(5.942001415990798, rel=1e-8)


@pytest.mark.parametrize("slope", [-0.9, 0.0, 1.5])
def test_stop_of_a_free_inertia(slope: float) -> None:
    inertia, speed, force, gain = 1.3, 40.0, 60.0, 0.2 * 0.7
    brake = Contact("brake", 0, -1, 0.2, (-0.5, 0.7), (-0.5, 0.7), constant(force), slope=slope)
    run = simulate(plain([inertia], [speed], [brake]), 30.0)
    rate = slope / force * speed
    share = math.log1p(rate) / rate if slope else 1.0
    (stick,) = run.events
    assert stick.kind == "stick"
    assert stick.time == pytest.approx(inertia * speed / (gain * force) * share, rel=1e-14)
    heat = run.integral(lambda _, s: s["brake_torque"][:, 0] * s["sliding_velocity"][:, 0])
    assert heat == pytest.approx(0.5 * inertia * speed**2, rel=1e-13)


def test_two_parallel_brakes_hold_together() -> None:
    """Capacities 1 and 10 under a torque of 6: both hold, with equal shares 6/11."""
    brakes = [Contact(str(j), 0, -1, force=constant(f), **UNIT) for j, f in enumerate((1.0, 10.0))]
    machine = plain([1.0], [0.0], brakes, torques=((0, lambda t: 6.0 + t),))
    run = simulate(machine, 6.0)
    seen = run.at([0.0, 4.9])
    assert seen["sticking"].all()
    # Least sum of squares of the shares: torque in proportion to the square of the capacity.
    np.testing.assert_allclose(seen["brake_torque"][0], [6 / 101, 600 / 101], rtol=1e-12)
    slips = run.list_of("slip")
    assert [e.contact for e in slips] == [0, 1]
    np.testing.assert_allclose([e.time for e in slips], 5.0, rtol=1e-14)
    assert run.at([6.0])["velocity"][0, 0] == pytest.approx(0.5, rel=1e-12)


def test_parallel_clutches_beside_another_one_share_the_torque() -> None:
    """In proportion to the squares of their capacities 1 and 2; the third has its own torque."""
    contacts = [
        Contact(name, a, b, force=constant(f), **UNIT)
        for name, a, b, f in (("x", 0, 1, 1.0), ("y", 1, 2, 9.0), ("z", 0, 1, 2.0))
    ]
    torques = ((0, constant(3.0)), (2, constant(-0.6)))
    run = simulate(plain([1.0, 1.0, 1.0], [0.0] * 3, contacts, torques=torques), 1.0)
    seen = run.at([0.5])
    total = 3.0 - 0.8  # the whole accelerates with 0.8
    expected = [total / 5.0, 0.8 + 0.6, 4.0 * total / 5.0]
    np.testing.assert_allclose(seen["brake_torque"][0], expected, rtol=1e-13)


def test_a_ring_of_dependent_contacts() -> None:
    """Two inertias with a brake each and a clutch between them: held by 3 + 2 at most.

    The torque on the first is held by its brake (3) and what the clutch passes on, at most 1, as
    the second brake holds 5: it releases at 4, and the second inertia goes on standing.
    """
    contacts = [
        Contact("first", 0, -1, force=constant(3.0), **UNIT),
        Contact("second", 1, -1, force=constant(5.0), **UNIT),
        Contact("clutch", 0, 1, force=constant(1.0), **UNIT),
    ]
    run = simulate(plain([1.0, 2.0], [0.0, 0.0], contacts, torques=((0, lambda t: t),)), 6.0)
    slips = run.list_of("slip")
    assert sorted(e.contact for e in slips) == [0, 2]
    np.testing.assert_allclose([e.time for e in slips], 4.0, rtol=1e-14)
    assert run.at([6.0])["sticking"][0].tolist() == [False, True, False]


def test_static_peak_holds_as_many_as_possible() -> None:
    """Two brakes in a row on one shaft line: the one nearest to its limit releases first."""
    contacts = [
        Contact("a", 0, -1, 1.0, (-1.0, 1.0), (-1.5, 1.5), constant(2.0)),
        Contact("b", 1, -1, 1.0, (-1.0, 1.0), (-1.5, 1.5), constant(4.0)),
    ]
    torques = ((0, lambda t: t), (1, lambda t: 1.8 * t))
    run = simulate(plain([1.0, 1.0], [0.0, 0.0], contacts, torques=torques), 5.0)
    slips = run.list_of("slip")
    assert [e.contact for e in slips] == [0, 1]
    np.testing.assert_allclose([e.time for e in slips], [3.0, 6.0 / 1.8], rtol=1e-14)
    # The torque jumps to 2 at the breakaway: v = (t - 3)^2/2 + (t - 3).
    assert run.at([4.0])["velocity"][0, 0] == pytest.approx(1.5, rel=1e-13)


@pytest.mark.parametrize("order", [1, 2])
def test_lag_between_command_and_force(order: int) -> None:
    """A free inertia braked by a force that rises with a lag, from nothing to 10 N."""
    lag: dict[str, Any] = {"lag": 0.3} if order == 1 else {"frequency": 4.0, "damping_ratio": 0.25}
    brake = Contact("brake", 0, -1, force=lambda t: np.where(t < 1.0, 0.0, 10.0), **UNIT, **lag)
    run = simulate(plain([1.0], [100.0], [brake], knots=(1.0,)), 3.0)
    t = np.linspace(1.0, 3.0, 50)
    s = t - 1.0
    if order == 1:
        force = 10.0 * -np.expm1(-s / 0.3)
    else:
        damped = 4.0 * math.sqrt(1.0 - 0.25**2)
        force = 10.0 - 10.0 * np.exp(-s) * (np.cos(damped * s) + np.sin(damped * s) / damped)
    np.testing.assert_allclose(run.at(t)["actuation_force"][:, 0], force, atol=1e-13)
    # Limits act after the lag, whose state goes on beyond them.
    limited = simulate(
        plain([1.0], [100.0], [brake._replace(limits=(1.0, 9.0))], knots=(1.0,)), 3.0
    )
    np.testing.assert_allclose(
        limited.at(t)["actuation_force"][:, 0], np.clip(force, 1.0, 9.0), atol=1e-13
    )


def test_sampled_control_by_recursion() -> None:
    """A free inertia under a sampled, delayed, rounded force: momentum sample by sample."""
    step, delay, resolution, slope = 0.01, 2, 0.5, -0.8
    brake = Contact(
        "brake", 0, -1, force=constant(50.0), slope=slope, sample_time=step, delay=delay,
        resolution=resolution, **UNIT,
    )  # fmt: skip
    run = simulate(plain([1.0], [30.0], [brake]), 0.3)
    speed, queue, speeds = 30.0, [50.0] * delay, []
    for _ in range(30):
        queue.append(resolution * round((50.0 + slope * speed) / resolution))
        speeds.append(speed)
        speed -= step * queue.pop(0)
    found = run.at(step * np.arange(30))["velocity"][:, 0]
    np.testing.assert_allclose(found, speeds, rtol=1e-14)


def test_brake_on_a_base_that_slows_down() -> None:
    """At rest on a moving base the inertia follows it; the torque it needs is J times its rate."""
    base: dict[str, Any] = {
        "base": lambda t: 8.0 * np.cos(t),
        "base_rate": lambda t: -8.0 * np.sin(t),
    }
    brake = Contact("brake", 0, -1, force=constant(6.0), **base, **UNIT)
    run = simulate(plain([1.0], [8.0], [brake]), 6.0)
    slip = run.list_of("slip")[0]
    assert slip.time == pytest.approx(math.asin(0.75), rel=1e-14)
    later = slip.time + 0.2
    expected = 8.0 * math.cos(slip.time) - 6.0 * 0.2
    assert run.at([later])["velocity"][0, 0] == pytest.approx(expected, rel=1e-14)
    assert run.list_of("stick")[1].time < 6.0


def test_table_of_friction_bends_the_torque() -> None:
    """Exponential decay of the speed on each line of a table."""
    table = ((0.0, -0.5, 0.5), (2.0, -0.3, 0.3))
    brake = Contact("brake", 0, -1, 1.0, (-0.5, 0.5), (-0.5, 0.5), constant(10.0), table=table)
    run = simulate(plain([1.0], [5.0], [brake]), 3.0)
    bend, stick = run.events
    assert (bend.kind, stick.kind) == ("breakpoint", "stick")
    assert bend.time == pytest.approx(1.0, rel=1e-14)
    # v' = -(5 - v) from v = 2 on.
    assert stick.time - bend.time == pytest.approx(math.log(5.0 / 3.0), rel=1e-14)


def test_energy_balance_of_a_coupled_machine() -> None:
    """Work of the torques = change of energy + losses in shafts and contacts, over 1 s."""
    shafts = [(0, 1, 900.0, 0.8, 1.5), (1, 2, 400.0, 0.3, 1.0), (2, -1, 300.0, 0.5, 1.0)]
    wedge: dict[str, Any] = {"kinetic": (-0.46, 5.6), "static": (-0.48, 6.9)}
    contacts = [
        Contact(
            "brake", 0, -1, 0.2, force=lambda t: 9.0 + 3.0 * np.sin(31.0 * t), slope=-0.5, **wedge
        ),
        Contact("clutch", 0, 2, 0.1, (-0.3, 0.3), (-0.4, 0.4), constant(80.0), lag=0.02, slope=4.0),
    ]  # fmt: skip
    torques = ((1, lambda t: 40.0 * np.sin(17.0 * t)), (2, lambda t: 15.0 * np.cos(23.0 * t)))
    machine = plain([0.3, 0.2, 0.5], [3.0, -1.0, 0.5], contacts, shafts, torques=torques)
    run = simulate(machine, 1.0)
    assert len(run.list_of("stick", "slip", "reversal")) >= 10

    def energy(seen: dict[str, np.ndarray]) -> float:
        q, w = seen["angle"][0], seen["velocity"][0]
        return float(0.5 * (machine.inertia * w) @ w + 0.5 * q @ machine.stiffness @ q)

    def net(_: Any, s: dict[str, np.ndarray]) -> np.ndarray:
        gain = np.sum(s["torque"] * s["velocity"], axis=1)
        loss = np.einsum("ti,ij,tj->t", s["velocity"], machine.damping, s["velocity"])
        return gain - loss - np.sum(s["brake_torque"] * s["sliding_velocity"], axis=1)

    change = energy(run.at([1.0])) - energy(run.at([0.0]))
    losses = run.integral(
        lambda _, s: np.sum(np.abs(s["brake_torque"] * s["sliding_velocity"]), axis=1)
    )
    assert run.integral(net) == pytest.approx(change, abs=1e-12 * losses)


def test_no_contact_sticks_beyond_its_limit_and_none_slides_the_wrong_way() -> None:
    run = simulate(examples.friction_plain(), 3.0)
    seen = run.at(np.linspace(0.0, 3.0, 2000))
    assert np.all(np.abs(seen["brake_torque"][:, 0]) <= 80.0 * (1 + 1e-12))
    assert np.all(seen["brake_torque"] * seen["sliding_velocity"] >= 0.0)


def test_events_come_in_order() -> None:
    run = leines_block(1)
    times = [e.time for e in run.events]
    assert times == sorted(times)
    kinds = [e.kind for e in run.events]
    assert kinds[:4] == ["stick", "slip", "stick", "slip"]
    assert isinstance(run.events[0], Event)
