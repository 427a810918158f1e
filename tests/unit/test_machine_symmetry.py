"""Orbits of machines that are their own mirror image half a period later, and what leaves them."""

from __future__ import annotations

import math
from functools import cache
from typing import Any

import numpy as np
import pytest
from scipy.optimize import brentq

import wedgebrake as wb
from differences import jacobian
from machines import after, contact, general, numbers
from wedgebrake.orbits.bifurcation_types import Kind
from wedgebrake.orbits.branches.branch import Branch
from wedgebrake.orbits.branches.branch_switching import leaving
from wedgebrake.orbits.equations.odd_symmetry import has_odd_symmetry

FREQUENCY = 10.0
SYSTEM = wb.paper.system(eta=-6.0, F0=0.05, brake="conventional")
BEGIN = SYSTEM.excitation.frequency


def followed(system: Any, name: str, ends: tuple[float, float]) -> wb.Branch:
    """The branch of the synchronous orbit over one parameter."""
    branch = wb.continuation(wb.orbit(system, 1), {name: ends})
    list(branch)
    return branch


@cache
def over_the_frequency() -> wb.Branch:
    """The branch of the machine, which two tests look at."""
    return followed(general(SYSTEM.machine), "torque.frequency", (BEGIN, 0.49 / 0.63 * BEGIN))


def breakings(branch: wb.Branch) -> list[Any]:
    """The symmetry breakings of a branch."""
    return [p for p in branch.bifurcations if p.bifurcation.kind is Kind.SYMMETRY_BREAKING]


def mirror_gap(orbit: Any) -> float:
    """Largest x(t + nT/2) + x(t) of the angles and speeds at t = 0, as a share of the orbit."""
    run = wb.simulate(orbit.system, 0.5 * orbit.period, initial=orbit.initial, times=())
    state, begin = wb.final_state(run), orbit.initial
    size = getattr(orbit, "measures", orbit)
    angles = [state.angles[name] + begin.angles[name] for name in begin.angles]
    speeds = [state.speeds[name] + begin.speeds[name] for name in begin.speeds]
    return max(
        np.max(np.abs(angles)) / size.angle_amplitude,
        np.max(np.abs(speeds)) / size.velocity_amplitude,
    )


def directions(sequence: str) -> str:
    """Signs of the segments in cyclic order, without the changes of a brake's law."""
    signs = [word[0] for word in sequence.split()]
    signs = [one for k, one in enumerate(signs) if one != signs[k - 1]]
    return min("".join(signs[k:] + signs[:k]) for k in range(len(signs)))


def pair(**brake: Any) -> Any:
    """Two inertias with a conventional brake each."""
    driveline = SYSTEM.machine
    more = {"force": 20.0, "slope": -0.2, **brake}
    second = contact("tail", name="second", radius=0.2, friction=0.3, **more)
    return wb.Machine(
        inertias=[*driveline.inertias, wb.Inertia("tail", 0.1)],
        shafts=[*driveline.shafts, wb.Shaft("tail", "driveline", stiffness=1e4, damping=0.01)],
        contacts=[*driveline.contacts, second],
        torques=[wb.Torque("driveline", wb.Harmonic(360.0, FREQUENCY), name="torque")],
    )


@pytest.mark.parametrize(
    ("changes", "order"),
    [({}, 1), ({"F0": 0.2, "eta": 0.0, "f": 0.3}, 1), ({"f": 0.6, "F0": 0.02, "eta": -20.0}, 3)],
    ids=["sliding", "stick-slip", "3T"],
)
def test_symmetric_orbits_are_those_of_the_driveline(changes, order) -> None:
    system = SYSTEM.replace(**changes)
    expected, found = wb.orbit(system, order), wb.orbit(general(system.machine), order)
    assert expected.found
    assert found._solution.equations.half
    assert mirror_gap(found) <= 1e-9
    size = np.array([expected.angle_amplitude, expected.velocity_amplitude])
    shifts = [np.roll(found.points, k, axis=0) for k in range(order)]
    assert min(np.max(np.abs(one - expected.points) / size) for one in shifts) <= 1e-9
    np.testing.assert_allclose(found.multipliers, expected.multipliers, atol=1e-8)
    for name in (
        "period", "angle_amplitude", "velocity_amplitude", "stick_share", "sticks_forward",
        "sticks_backward", "events", "peak_torque",
    ):  # fmt: skip
        assert getattr(found, name) == pytest.approx(getattr(expected, name), rel=1e-9), name
    assert directions(found.sequence) == directions(expected.sequence)


def test_symmetry_breakings_and_leaving_branches_are_those_of_the_driveline() -> None:
    stop = 0.5042 / 0.63 * BEGIN
    located, ended = [], []
    for parent in (followed(SYSTEM, "frequency", (BEGIN, 0.49 / 0.63 * BEGIN)),
                   over_the_frequency()):  # fmt: skip
        points = breakings(parent)
        located.append([point.value for point in points])
        ((origin, first),) = leaving(points[0])
        branch = Branch(first, (stop, BEGIN), False, 0.02, 300, points=[origin])
        ended.append(list(branch)[-1])
        assert branch.points[-1].value == stop
    np.testing.assert_allclose(located[1], located[0], rtol=1e-10)
    assert len(located[0]) == 2
    # The mirror image has the same multipliers and amplitudes.
    one, other = ended
    assert not other.is_symmetric()
    np.testing.assert_allclose(other.multipliers, one.multipliers, atol=1e-8)
    for name in ("angle_amplitude", "velocity_amplitude", "stick_share", "peak_torque"):
        assert getattr(other.measures, name) == pytest.approx(getattr(one.measures, name), rel=1e-8)


def whole_multiplier(machine: Any, initial: Any) -> float:
    """The real multiplier nearest to 1 of a whole period, by differences of simulations."""
    begin = numbers(initial)[: 2 * len(machine.inertias)]
    np.testing.assert_allclose(after(machine, begin, machine.period), begin, rtol=1e-9, atol=1e-9)
    matrix = jacobian(lambda states: after(machine, states, machine.period), begin, 1e-6)
    found = np.linalg.eigvals(matrix)
    return float(found[np.abs(found - 1.0).argmin()].real)


def test_symmetry_breaking_of_two_brakes() -> None:
    name = "torque.frequency"
    machine = pair()
    branch = followed(machine, name, (FREQUENCY, 8.7))
    points = breakings(branch)
    assert len(points) == 2
    at = points[0]
    assert abs(at.multipliers[0] - 1.0) <= 1e-10
    assert mirror_gap(at) <= 1e-10
    # At the bifurcation itself Newton's method for the whole orbit is singular.
    nodes = 4e-3 * np.cos((np.arange(8) + 0.5) * math.pi / 8)
    values = []
    for node in nodes:
        there = machine.replace({name: at.value + node})
        found = wb.orbit(there, 1, initial=at.initial)
        values.append(whole_multiplier(there, found.initial) - 1.0)
        assert found.stable == (values[-1] < 0.0)
    curve = np.polynomial.Polynomial.fit(nodes, values, 7)
    root = at.value + brentq(curve, min(nodes), max(nodes), xtol=1e-14)
    assert root == pytest.approx(at.value, rel=1e-7)
    # Both branches that leave are stable motions, which are each other's mirror image.
    ((origin, first),) = leaving(at)
    off = Branch(first, (points[1].value, at.value), False, 0.02, 40, points=[origin])
    beside = next(one for one in off if not one.is_symmetric(1e-3))
    assert beside.stable
    orbit = wb.orbit(beside.system, 1, initial=beside.initial)
    assert mirror_gap(orbit) > 1e-3
    half = wb.simulate(beside.system, 0.5 * orbit.period, initial=orbit.initial, times=())
    state = wb.final_state(half)
    image = beside.system.replace(
        {f"{one}.angle": -angle for one, angle in state.angles.items()}
        | {f"{one}.speed": -speed for one, speed in state.speeds.items()}
    )
    start = wb.final_state(wb.simulate(image, 1e-12, times=()))
    other = wb.orbit(beside.system, 1, initial=start)
    np.testing.assert_allclose(other.multipliers, orbit.multipliers, atol=1e-8)
    assert np.max(np.abs(other.points - orbit.points)) > 1e-3 * orbit.velocity_amplitude


SMOOTH = SYSTEM.replace(friction=wb.SmoothedFriction(kinetic=0.3, steepness=100.0))
SAMPLED = SYSTEM.machine.replace({"brake.sample_time": 1.0 / (16.0 * BEGIN)})


@pytest.mark.parametrize(
    ("system", "first", "second"),
    [
        (SYSTEM, ("frequency", BEGIN, 0.77 * BEGIN), ("F0", 0.03, 0.07)),
        (SMOOTH, ("frequency", BEGIN, 0.77 * BEGIN), ("F0", 0.03, 0.07)),
        pytest.param(general(SYSTEM.machine), ("torque.frequency", BEGIN, 0.77 * BEGIN),
                     ("brake.initial_force", 200.0, 400.0), marks=pytest.mark.slow),
        (pair(), ("torque.frequency", FREQUENCY, 8.0), ("second.initial_force", 10.0, 40.0)),
        (SAMPLED, ("shaft.stiffness", 1e4, 1.75e4), ("brake.initial_force", 200.0, 400.0)),
    ],
    ids=["driveline", "smooth driveline", "machine", "pair", "samples"],
)  # fmt: skip
def test_symmetry_breakings_over_two_parameters(system, first, second) -> None:
    """A multiplier of the whole orbit is 1; points located over one parameter are on the curve."""
    (name, *ends), (other, *more) = first, second
    point = breakings(followed(system, name, tuple(ends)))[0]
    curve = wb.boundary(point, step=0.2, **{name: tuple(ends), other: tuple(more)})
    assert curve.attrs["bifurcation"] == "symmetry breaking"
    multipliers = curve["multiplier_real"].values + 1j * curve["multiplier_imag"].values
    assert np.max(np.min(np.abs(multipliers - 1.0), axis=1)) <= 1e-9
    count = curve.sizes["point"]
    for k in (count // 4,):
        value = float(curve[name][k])
        side = 1e-3 * value
        there = system.replace(**{other: float(curve[other][k]), name: value + side})
        initial = point.initial if isinstance(system, wb.Machine) else tuple(point.points[0])
        near = wb.orbit(there, 1, initial=initial)
        branch = wb.continuation(near, {name: (value + side, value - side)}, step=0.05)
        list(branch)
        (located,) = breakings(branch)
        assert located.value == pytest.approx(value, rel=1e-8)
        if isinstance(system, wb.Machine):
            assert whole_multiplier(located.system, located.initial) == pytest.approx(1.0, abs=1e-6)


def test_a_branch_between_two_symmetry_breakings_ends_there() -> None:
    first, second = breakings(over_the_frequency())
    ((origin, start),) = leaving(first)
    off = Branch(start, (0.49 / 0.63 * BEGIN, BEGIN), False, 0.02, 300, points=[origin])
    list(off)
    assert off.end == "symmetry breaking of a symmetric orbit"
    assert off.points[-1].value == pytest.approx(second.value, abs=1e-7)


@pytest.mark.parametrize(
    "brake",
    [
        {"slope": -1.0, "lag": 0.01},
        {"force": wb.Harmonic(5.0, 2.0 * FREQUENCY) + 20.0},
        {"limits": (15.0, 30.0), "slope": 2.0},
        {"slope": -1.0, "sample_time": 0.05 / FREQUENCY, "delay": 3},
    ],
    ids=["lag", "force of half the period", "limits", "samples"],
)
def test_orbits_with_other_actuation_are_their_own_mirror_image(brake) -> None:
    machine = pair(**brake)
    assert has_odd_symmetry(machine)
    found = wb.orbit(machine, 1)
    assert found._solution.equations.half
    assert mirror_gap(found) <= 1e-10
    again = wb.final_state(wb.simulate(machine, found.period, initial=found.initial, times=()))
    np.testing.assert_allclose(list(again.speeds.values()), found.points[0][2:4], atol=1e-8)
    np.testing.assert_allclose(again.actuators, found.initial.actuators, rtol=1e-8)


def test_an_orbit_is_whole_where_the_parameter_takes_the_symmetry() -> None:
    machine = pair()
    branch = followed(machine, "second.base_speed", (0.0, 1.0))
    assert branch.end.startswith("left the range")
    assert not any(point.equations.half for point in branch.points)
    last = branch.points[-1]
    assert mirror_gap(last) > 1e-3


def test_a_torus_is_followed_where_the_second_parameter_takes_the_symmetry() -> None:
    """At the end of the curve the base moves, and the pair still has modulus 1."""
    system = general(SYSTEM.replace(eta=-22.0, F0=0.036).machine)
    slope = system.value("brake.slope")
    branch = followed(system, "brake.slope", (slope, 1.1 * slope))
    torus = next(p for p in branch.bifurcations if p.bifurcation.kind is Kind.NEIMARK_SACKER)
    assert torus.equations.half
    ends = {"brake.slope": (slope, 1.1 * slope), "brake.base_speed": (0.0, 0.2)}
    curve = wb.boundary(torus, step=0.5, points=10, **ends)
    last = int(np.argmax(curve["brake.base_speed"].values))
    values = {name: float(curve[name][last]) for name in ends}
    assert values["brake.base_speed"] > 0.01
    found = wb.orbit(system.replace(values), 1, initial=torus.initial)
    assert not found._solution.equations.half
    assert abs(found.multipliers[0]) == pytest.approx(1.0, abs=1e-7)


T = 1.0 / FREQUENCY
SINE = wb.Harmonic(360.0, FREQUENCY, 0.3)
SAW = wb.Table([0.0, 0.3 * T, 0.5 * T, 0.8 * T, T], [2.0, 5.0, -2.0, -5.0, 2.0], periodic=True)
STEPS = wb.Table([0.0, 0.5 * T, 0.5 * T, T], [3.0, 3.0, -3.0, -3.0], periodic=True)
SPEED = wb.Harmonic(5.0, 2.0 * FREQUENCY) + 2.0 * math.pi * FREQUENCY


@pytest.mark.parametrize(
    ("signal", "odd"),
    [
        (SINE, True),
        (SINE + wb.Harmonic(20.0, 3.0 * FREQUENCY, 1.0), True),
        (SINE + wb.Harmonic(20.0, 2.0 * FREQUENCY), False),
        (SINE + wb.Harmonic(0.0, 2.0 * FREQUENCY), True),
        (SINE + 1.0, False),
        (-SINE, True),
        (wb.Harmonic(20.0, FREQUENCY) * wb.Harmonic(20.0, 2.0 * FREQUENCY), True),
        (SINE + SINE * SINE, False),
        (wb.HarmonicTorque(360.0, FREQUENCY, orders=((3, 0.5, 0.2),)), True),
        (wb.HarmonicTorque(360.0, FREQUENCY, orders=((2, 0.5, 0.2),)), False),
        (wb.Orders(2.0 * math.pi * FREQUENCY, ((1.0, 5.0, 0.1), (3.0, 2.0, 0.0))), True),
        (wb.Orders(SPEED, ((1.0, 5.0, 0.1), (3.0, 2.0, 0.0))), True),
        (wb.Orders(SPEED, ((1.0, 5.0, 0.1), (2.0, 2.0, 0.0))), False),
        (SAW, True),
        (STEPS, True),
        (SINE + SAW, True),
        (wb.Table([0.0, 0.3 * T, 0.5 * T, 0.8 * T, T], [2.0, 5.0, -2.0, -4.0, 2.0],
                  periodic=True), False),
    ],
)  # fmt: skip
def test_symmetry_of_torques(signal, odd) -> None:
    machine = pair().replace(torques=[wb.Torque("driveline", signal, name="torque")])
    assert has_odd_symmetry(machine) == odd
    times = np.linspace(0.0, machine.period, 1000, endpoint=False) + 1e-5
    primitive = signal.primitive() if hasattr(signal, "primitive") else signal
    values = primitive(times)
    apart = np.max(np.abs(primitive(times + 0.5 * machine.period) + values))
    assert (apart <= 1e-9 * np.max(np.abs(values))) == odd


@pytest.mark.parametrize(
    "changes",
    [
        {"second.brake": wb.WedgeBrake(angle=0.9, radius=0.2)},
        {"second.base_speed": 1.0},
        {"second.initial_force": wb.Harmonic(5.0, FREQUENCY) + 20.0},
        {"second.sample_time": 0.2 / FREQUENCY},
        {"torque.amplitude": 0.0},
        {"second.friction": wb.CustomFriction(law=lambda v: math.tanh(v) + 0.1 * math.tanh(v) ** 2,
                                              width=1.0)},
    ],
    ids=["wedge", "base", "force", "odd number of samples", "no period", "law"],
)  # fmt: skip
def test_machines_without_symmetry(changes) -> None:
    machine = pair().replace(changes)
    assert has_odd_symmetry(pair())
    assert not has_odd_symmetry(machine)
