"""Periodic orbits of machines, their Floquet multipliers and branches."""

from __future__ import annotations

import dataclasses
import math
from typing import Any

import numpy as np
import pytest
from scipy.linalg import expm
from scipy.optimize import brentq
from test_orbit import FOUND

import wedgebrake as wb
from differences import jacobian
from machine_digits import DIGITS, Exact, line_of, mp
from machine_plain import plain
from machine_reference import simulate
from machines import after, block, contact, general, in_row, numbers, pressed, single, stribeck
from wedgebrake.errors import InputError
from wedgebrake.orbits.bifurcation_types import Kind, Scenario
from wedgebrake.orbits.equations.floquet import Floquet
from wedgebrake.orbits.equations.segments import OrbitSegments
from wedgebrake.orbits.friction_bifurcations.event_changes import bifurcation_of
from wedgebrake.orbits.orbit_status import OrbitStatus


def pair(phase: float) -> Any:
    """Two inertias, a brake on the first and a clutch between them."""
    contacts = pressed("a"), pressed("b", "a", force=0.5, name="clutch")
    return in_row(*contacts, engine=wb.Harmonic(2.0, 0.25, phase))


@pytest.mark.parametrize("name", [
    "2T of the wedge", "unstable T of the wedge", "unstable T with releases", "conventional",
    "turning, never at rest",
])  # fmt: skip
def test_orbits_of_one_inertia_are_those_of_its_driveline(name) -> None:
    system, order = FOUND[name]
    expected, found = wb.orbit(system, order), wb.orbit(general(system.machine), order)
    size = np.array([expected.angle_amplitude, expected.velocity_amplitude])
    shifts = [np.roll(found.points, k, axis=0) for k in range(order)]
    assert min(np.max(np.abs(one - expected.points) / size) for one in shifts) <= 1e-11
    np.testing.assert_allclose(found.multipliers, expected.multipliers, atol=1e-11)
    for quantity in ("period", "stick_share", "peak_torque", "sticks_forward", "sticks_backward"):
        assert getattr(found, quantity) == pytest.approx(getattr(expected, quantity), rel=1e-10)
    assert found.stable == expected.stable


@pytest.mark.parametrize(("static", "speed"), [(1.5, 1.0), (1.25, 0.5), (2.0, 0.125)])
def test_stick_slip_has_the_period_of_the_closed_form(static, speed) -> None:
    """Without damping: a stick from 1 - a to 1 + a, and a slip with a phase that mirrors it."""
    belt = pressed("block", static=static, name="belt", base_speed=speed)
    machine = single(belt, name="block", stiffness=1.0)
    found = wb.orbit(machine)
    a = static - 1.0
    period = 2.0 * math.pi - 2.0 * math.atan2(a, speed) + 2.0 * a / speed
    assert found.period == pytest.approx(period, rel=1e-12)
    assert found.period == pytest.approx(wb.motion(machine).period, rel=1e-12)
    assert found.stick_share == pytest.approx(2.0 * a / speed / period, rel=1e-12)
    assert found.multipliers == (0.0,)
    # What a machine does not have, such as one angle, is not shown; its states are.
    shown = f"{found!r} {found} {found._repr_html_()}"
    assert "nan" not in shown
    assert "speed, block" in shown
    again = wb.orbit(machine, 1, initial=found.initial)
    assert again.period == pytest.approx(period, rel=1e-12)


def test_a_guess_of_one_inertia_is_a_pair_or_a_state_at_any_time() -> None:
    system = wb.paper.system(eta=-24.0, F0=0.067)
    machine, expected = system.machine, wb.orbit(system, 1)
    start = wb.orbit(machine, 1).initial
    later = wb.simulate(machine, 0.7 * expected.period, initial=start, times=())
    pair = expected.angle, expected.velocity
    for one in (system, machine, general(machine)):
        for initial in (pair, start, wb.final_state(later)):
            found = wb.orbit(one, 1, initial=initial)
            np.testing.assert_allclose(found.points, expected.points, rtol=1e-9)


def multipliers_of_50_digits(machine: wb.Machine, found: Any) -> np.ndarray:
    """Eigenvalues of the derivative of the return map at ``found``, by differences."""
    start, step = found.points[0], mp.mpf(10) ** -20

    def end(place: int | None = None) -> Any:
        run = Exact(line, found.order / mp.mpf(machine.torques[0].signal.frequency))
        for k, value in enumerate(start):
            run.z[k] = mp.mpf(float(value)) + (step if k == place else 0)
        return run.run().z

    with mp.workdps(DIGITS):
        line = line_of(machine)
        unchanged = end()
        columns = [(end(k) - unchanged) / step for k in range(len(start))]
    # It is an orbit.
    after = np.array([float(value) for value in unchanged[: len(start)]])
    np.testing.assert_allclose(after, start, rtol=0, atol=1e-13)
    matrix = np.array([[float(column[k]) for column in columns] for k in range(len(start))])
    return sorted_by_size(np.linalg.eigvals(matrix))


def sorted_by_size(values: Any) -> np.ndarray:
    """Values in an order that rounding does not change."""
    return np.array(sorted(values, key=lambda one: (-round(abs(one), 7), one.imag)))


def test_multipliers_of_two_inertias_agree_with_50_digits() -> None:
    sticking, found = wb.orbit(pair(0.0)), wb.orbit(pair(math.pi / 2.0))
    assert found.stick_share == pytest.approx(sticking.stick_share, rel=1e-10)
    assert found.sequence == sticking.sequence
    # Only one of the two sections is in a stick.
    assert any(mode[0] == 0 for mode in sticking.initial.modes)
    assert all(mode[0] != 0 for mode in found.initial.modes)
    expected = multipliers_of_50_digits(pair(math.pi / 2.0), found)
    np.testing.assert_allclose(sorted_by_size(found.multipliers), expected, rtol=0, atol=1e-12)
    np.testing.assert_allclose(sorted_by_size(sticking.multipliers), expected, rtol=0, atol=1e-12)


@pytest.mark.slow
def test_multipliers_of_four_inertias_and_two_contacts_agree_with_50_digits() -> None:
    names = ("a", "b", "c", "d")
    machine = wb.Machine(
        inertias=[wb.Inertia(name, 1.0 - 0.125 * i) for i, name in enumerate(names)],
        shafts=[wb.Shaft("a", "ground", stiffness=3.0, damping=0.0625)]
        + [
            wb.Shaft(one, other, stiffness=4.0 + i, damping=0.0625)
            for i, (one, other) in enumerate(zip(names[1:], names, strict=False))
        ],
        contacts=[pressed("a", force=0.25), pressed("d", "c", force=0.25, name="clutch")],
        torques=[wb.Torque("d", wb.Harmonic(1.0, 0.25, 0.5), name="engine")],
    )  # fmt: skip
    found = wb.orbit(machine)
    assert found.found
    assert all(mode[0] != 0 for mode in found.initial.modes)
    assert found.sequence == "brake: - +; clutch: - 0 + 0"
    expected = multipliers_of_50_digits(machine, found)
    np.testing.assert_allclose(sorted_by_size(found.multipliers), expected, rtol=0, atol=1e-12)


def end_by_reference(machine: Any, states: np.ndarray, duration: float) -> np.ndarray:
    """Angles and speeds a time after others, by the reference integrator."""
    names = [f"{one.name}.{what}" for what in ("angle", "speed") for one in machine.inertias]
    start = dict(zip(names, states.tolist(), strict=True))
    last = simulate(plain(machine.replace(start), duration), duration).cells[-1]
    return last.state(2.0 * (duration - last.start) / last.step - 1.0)


def train(base_speed: float, static: float = 1.5) -> Any:
    """Two inertias, of which a moving base drags the first; they begin with its speed."""
    belt = pressed("a", static=static, name="belt", base_speed=base_speed)
    return in_row(belt, stiffness=(1.0, 3.0), damping=(0.0625, 0.03125), speed=base_speed)


def test_multipliers_of_a_self_excited_machine_and_the_one_of_time() -> None:
    machine = train(0.25)
    found = wb.orbit(machine)
    assert len(found.multipliers) == 3
    assert found.period == pytest.approx(wb.motion(machine).period, rel=1e-10)
    assert found.initial.modes[0][0] != 0
    matrix = jacobian(
        lambda states: end_by_reference(machine, states, found.period), numbers(found.initial), 1e-4
    )
    expected = sorted_by_size(np.linalg.eigvals(matrix))
    np.testing.assert_allclose(sorted_by_size([1.0, *found.multipliers]), expected, atol=1e-8)


def test_orbits_that_are_not_found_say_why() -> None:
    assert wb.orbit(train(5.0)).status is OrbitStatus.STEADY_SLIDING
    torques = [
        wb.Torque("a", wb.Harmonic(1.0, one), name=name)
        for one, name in ((1.0, "slow"), (math.sqrt(2.0), "fast"))
    ]
    without_period = train(0.25).replace(torques=torques)
    with pytest.raises(InputError) as raised:
        wb.orbit(without_period)
    assert raised.value.name == "slow.signal"
    with pytest.raises(InputError):
        wb.continuation(wb.orbit(train(0.25)), {"belt.nothing": (0.1, 1.0)})
    with pytest.raises(InputError):
        wb.continuation(wb.orbit(train(0.25)), {"a.angle": (0.1, 1.0)})


# Branches.


def test_branch_of_a_machine_is_that_of_its_driveline() -> None:
    """Grazing is located, and the multipliers are the same, on the way to it."""
    system = wb.paper.system(eta=-24.0, F0=0.067)
    expected = wb.continuation(wb.orbit(system, 1), slope=(-52.0, -30.0))
    found = wb.continuation(wb.orbit(general(system.machine), 1), {"brake.slope": (-52.0, -30.0)})
    kinds = (Kind.PERIOD_DOUBLING, Kind.GRAZING_SLIDING, Kind.NEIMARK_SACKER, Kind.FOLD)
    points: list[Any] = []
    for branch in (expected, found):
        list(branch)
        points.append([one for one in branch.bifurcations if one.bifurcation.kind in kinds])
    assert len(points[0]) == len(points[1]) > 0
    for one, other in zip(*points, strict=True):
        assert one.bifurcation.kind is other.bifurcation.kind
        assert other.value == pytest.approx(one.value, rel=1e-8)
        np.testing.assert_allclose(other.multipliers, one.multipliers, atol=1e-5)


def test_period_doubling_and_the_branch_that_leaves_it_are_those_of_the_driveline() -> None:
    system = wb.paper.system(eta=-12.0, F0=0.067)
    found = [
        wb.branches(one, {name: (-32.0, -36.0)}, opposite=False)
        for one, name in ((system, "slope"), (general(system.machine), "brake.slope"))
    ]
    kinds = ("period doubling", "grazing-sliding")
    values = [
        [float(one["bifurcation_value"][one["bifurcation_kind"] == kind][0]) for kind in kinds]
        for one in found
    ]
    np.testing.assert_allclose(values[1], values[0], rtol=1e-9)
    assert [one["branch_order"].values.tolist() for one in found] == [[1, 2], [1, 2]]


def test_a_branch_over_the_phase_of_the_torque_is_one_orbit() -> None:
    """A phase is a shift in time: nothing but the points at the returns changes.

    Where the phase is zero, and from there on, other equations are solved.
    """
    system = wb.paper.system(eta=-24.0, F0=0.067)
    sine = wb.Harmonic(system.excitation.amplitude, system.excitation.frequency)
    machine = system.machine.replace(torques=[wb.Torque("driveline", sine, name="torque")])
    expected = wb.orbit(system, 1)
    for ends in ((0.0, 1.0), (1.0, 0.0)):
        given = {"torque.phase": ends}
        data = wb.branches(machine, given, order=1, switch=0, opposite=False, step=0.3)
        assert data["branch_end"].item() == f"left the range at torque.phase = {ends[1]:g}"
        largest = data["multiplier_real"].values[:, 0]
        np.testing.assert_allclose(largest, expected.multipliers[0].real, rtol=1e-9)
        amplitude = data["velocity_amplitude"].values
        np.testing.assert_allclose(amplitude, expected.velocity_amplitude, rtol=1e-9)


def test_by_the_curve_itself_the_unstable_cycle_ends_at_the_hopf_point() -> None:
    """At ln(10)/2, where the slope of the friction is -2 xi."""
    machine = block(stribeck(), 1.25)
    machine = machine.replace({"block.angle": 0.8, "block.speed": 1.25})
    branch = wb.continuation(
        wb.orbit(machine, method="smooth"), {"belt.base_speed": (0.5, 3.0)}, step=0.05
    )
    list(branch)
    assert grazing_of(branch).bifurcation.scenario is Scenario.FOLD
    last = branch.points[-1]
    assert last.bifurcation.kind is Kind.HOPF
    assert last.value == pytest.approx(0.5 * math.log(10.0), abs=1e-5)
    assert last.period == pytest.approx(2.0 * math.pi, rel=1e-5)


def test_period_doubling_in_two_parameters() -> None:
    """Every point of the curve is a period doubling of the driveline."""
    system = wb.paper.system(eta=-12.0, F0=0.067).replace(slope=-34.0)
    machine = general(system.machine)
    branch = wb.continuation(wb.orbit(machine, 1), {"brake.slope": (-34.0, -34.5)})
    doubling = next(point for point in branch if point.bifurcation)
    ends = {"brake.slope": (-35.0, -33.5), "torque.amplitude": (260.0, 280.0)}
    curve = wb.boundary(doubling, step=0.5, **ends)
    assert curve.sizes["point"] > 2
    for k in range(curve.sizes["point"]):
        there = system.replace(
            slope=float(curve["brake.slope"][k]), amplitude=float(curve["torque.amplitude"][k])
        )
        found = wb.orbit(there, 1)
        assert min(abs(one + 1.0) for one in found.multipliers) <= 1e-7


@pytest.fixture(scope="module")
def belt_branch() -> Any:
    """The stable cycle of the block on a belt, and the unstable one beyond its grazing."""
    branch = wb.continuation(
        wb.orbit(block(stribeck(), 1.5), initial=start(1.5)), {"belt.base_speed": (0.5, 3.0)}
    )
    list(branch)
    return branch


def start(speed: float) -> Any:
    """The block at rest on the belt, at the end of a stick."""
    machine = block(stribeck(), speed)
    machine = machine.replace({"block.angle": 1.0 - 0.1 * speed, "block.speed": speed})
    return wb.final_state(wb.simulate(machine, duration=1e-9, times=()))


def grazing_of(branch: Any) -> Any:
    return next(p for p in branch.bifurcations if p.bifurcation.kind is Kind.GRAZING_SLIDING)


def test_the_cycle_of_the_belt_turns_where_it_grazes(belt_branch) -> None:
    grazing = grazing_of(belt_branch)
    assert grazing.bifurcation.scenario is Scenario.FOLD
    index = belt_branch.points.index(grazing)
    before, after = belt_branch.points[index - 1], belt_branch.points[index + 1]
    assert before.stable
    assert before.measures.stick_share > 0.0
    assert not after.stable
    assert after.measures.stick_share == 0.0
    # Only sticking cycles exist beside steady sliding just before, and none behind.
    for change, kind in ((-1e-6, "limit cycle"), (1e-6, "steady sliding")):
        speed = grazing.value + change
        assert wb.motion(block(stribeck(), speed), initial=start(speed)).kind == kind


def test_the_unstable_cycle_separates_sliding_from_the_stable_one(belt_branch) -> None:
    """Motions that begin a little inside or outside of it find it without its equations."""
    at = next(p for p in belt_branch.points if not p.stable and p.value < 1.5)
    machine, (angle, speed) = at.system, at.points[0]

    def grows(factor: float) -> bool:
        rest = 0.5 + 0.5 * math.exp(-at.value / 0.5)
        there = machine.replace(
            {"block.angle": rest + factor * (angle - rest), "block.speed": factor * speed}
        )
        return wb.motion(there).kind == "limit cycle"

    assert not grows(1.0 - 1e-8)
    assert grows(1.0 + 1e-8)


def test_the_unstable_cycle_ends_at_the_hopf_point_of_sliding(belt_branch) -> None:
    """That of the smooth law is at ln(10)/2; on a line of its table nothing changes.

    A chord that deviates by the tolerance has the length sqrt(8 tolerance/curvature).
    """
    assert belt_branch.bifurcations[-1].bifurcation.kind is Kind.HOPF
    limit = wb.hopf(block(stribeck()), "belt.base_speed", between=(0.8, 1.5))
    assert limit.value == pytest.approx(0.5 * math.log(10.0), rel=1e-6)
    length = math.sqrt(8e-4 / (0.5 / 0.5**2 * 0.1))
    assert belt_branch.points[-1].value == pytest.approx(limit.value, abs=length)


FOLLOWED = (
    "fold", "period doubling", "Neimark-Sacker", "symmetry breaking", "grazing-sliding",
    "crossing-sliding", "switching-sliding", "adding-sliding", "grazing",
)  # fmt: skip


def test_a_hopf_point_is_not_followed_as_an_orbit(belt_branch) -> None:
    ends = {"belt.base_speed": (0.5, 3.0), "belt.kinetic": (0.4, 0.6)}
    point = belt_branch.bifurcations[-1]
    assert not point.can_be_followed
    with pytest.raises(InputError) as raised:
        wb.boundary(point, **ends)
    assert (raised.value.name, raised.value.value) == ("point", "Hopf")
    assert raised.value.allowed == FOLLOWED


def test_a_slip_that_just_touches_a_stick_with_a_static_peak_makes_the_motion_jump() -> None:
    """No orbit of the other branch nearby, here the cycle of half the period, is reached.

    The bifurcation is where the largest speed of b on its belt within a slip becomes zero.
    """
    machine = wb.Machine(
        inertias=[wb.Inertia("a", 1.0, angle=0.3, speed=0.5), wb.Inertia("b", 1.4)],
        shafts=[
            wb.Shaft("a", "ground", stiffness=1.0, damping=0.05),
            wb.Shaft("a", "b", stiffness=1.2, damping=0.02),
            wb.Shaft("b", "ground", stiffness=0.7),
        ],
        contacts=[
            wb.Contact(
                name, name=f"{name}-belt", brake=wb.ConventionalBrake(radius=1.0),
                friction=friction, actuation=wb.Actuation(initial_force=force), base_speed=0.4,
            )
            for name, friction, force in (
                ("a", wb.StribeckFriction(kinetic=0.5, static=1.0, speed=0.5), 1.0),
                ("b", wb.CoulombFriction(kinetic=0.2, static=0.3), 0.8),
            )
        ],
    )  # fmt: skip
    branch = wb.continuation(
        wb.orbit(machine, method="smooth"), {"a-belt.base_speed": (0.4, 1.0)}, step=0.1
    )
    *_, before, last = branch
    assert last.bifurcation.kind is Kind.GRAZING_SLIDING
    assert last.bifurcation.scenario is Scenario.JUMP

    def nearest(point: Any) -> float:
        """Least distance of the speed of b from that of its belt, in the slip without a stick."""
        times = np.linspace(0.0, 0.3 * point.period, 40001)
        run = wb.simulate(
            point.system, times[-1], initial=point.initial, times=times, method="smooth"
        )
        speed = run["velocity"].values[:, 1]
        top = 1 + int(np.argmax(speed[1:-1]))
        low, middle, high = speed[top - 1 : top + 2]
        return 0.4 - middle - 0.125 * (high - low) ** 2 / (2.0 * middle - low - high)

    points = [one for one in branch.points if not one.bifurcation][-3:-1]
    one, other = (nearest(point) for point in points)
    root = points[1].value + other * (points[1].value - points[0].value) / (one - other)
    assert last.value == pytest.approx(root, rel=1e-8)
    assert before.period == pytest.approx(last.period, rel=1e-6)


@pytest.mark.parametrize("kind", ["branch point", "Hopf", "doubling"])
def test_kinds_that_cannot_be_followed_are_refused_before_any_orbit(kind) -> None:
    ends = {"belt.base_speed": (0.5, 3.0), "belt.kinetic": (0.4, 0.6)}
    orbits: list[Any] = []
    with pytest.raises(InputError) as raised:
        wb.boundaries(block(stribeck(), 1.5), kinds=[kind], progress=orbits.append, **ends)
    assert (raised.value.name, raised.value.value) == ("kinds", kind)
    assert raised.value.allowed == FOLLOWED
    assert not orbits


def test_branches_as_a_dataset() -> None:
    found = wb.branches(train(0.25), {"belt.base_speed": (0.25, 0.3)}, switch=0, opposite=False)
    assert found.attrs["parameter"] == "belt.base_speed"
    assert found["velocity"].dims == ("point", "return", "inertia")
    assert found["multiplier_real"].sizes["multiplier"] == 3
    assert np.all(np.diff(found["belt.base_speed"].values) >= 0.0)
    assert found["bifurcation_kind"].values.tolist() == ["Neimark-Sacker"]
    # There the modulus of the pair passes 1, whose square is the product.
    at = int(found["bifurcation_point"][0])
    real, imag = (found[f"multiplier_{part}"].values[at] for part in ("real", "imag"))
    np.testing.assert_allclose(np.hypot(real, imag)[:2], 1.0, rtol=1e-9)
    speed = float(found["bifurcation_value"][0])
    stable = found["stable"].values
    np.testing.assert_array_equal(stable[:at], True)
    assert not stable[-1]
    # Just before it, the orbit attracts.
    branch = wb.continuation(wb.orbit(train(0.25)), {"belt.base_speed": (0.25, 0.3)})
    near = next(point for point in branch if point.value > speed - 0.02)
    assert near.period == pytest.approx(found["period"].values[branch.points.index(near)])
    speeds = {name: one + 1e-5 for name, one in near.initial.speeds.items()}
    beside = dataclasses.replace(near.initial, speeds=speeds)
    assert wb.motion(near.system, initial=beside).period == pytest.approx(near.period, rel=1e-6)


@pytest.mark.parametrize(
    ("before", "after", "short", "kind"),
    [
        ((1,), (0, 1), (0,), Kind.GRAZING_SLIDING),
        ((0,), (0, 1), (1,), Kind.ADDING_SLIDING),
        ((-1, 1), (-1, 0, 1), (1,), Kind.CROSSING_SLIDING),
        ((-1, 1), (-1, 0, 1, 0), (1, 3), Kind.CROSSING_SLIDING),
        ((1,), (-1, 1), (0,), None),
        ((0, 1), (-1, 0, 1), (0,), Kind.SWITCHING_SLIDING),
        ((-1, 0, 1), (-1, 0, -1, 0, 1), (2,), Kind.ADDING_SLIDING),
        ((-1, 0, 1), (-1, 0, -1, 0, 1), (1,), Kind.GRAZING_SLIDING),
    ],
)
def test_bifurcations_by_the_events_that_begin_or_end(before, after, short, kind) -> None:
    """Where the sequence alone leaves a choice, the shortest segments have just begun."""
    few = OrbitSegments.of(before, np.ones(len(before)))
    many = OrbitSegments.of(
        after, np.array([1e-4 if k in short else 1.0 for k in range(len(after))])
    )
    for one, other in ((few, many), (many, few)):
        found = bifurcation_of([one], [other], ["brake"], Scenario.PERSISTENCE)
        assert (None if found is None else found.kind) is kind


def test_functions_of_multipliers_vanish_where_they_are_on_the_unit_circle() -> None:
    angle = 0.7
    turn = np.array([[math.cos(angle), -math.sin(angle)], [math.sin(angle), math.cos(angle)]])
    for block_, name in ((np.eye(1), "one"), (-np.eye(1), "minus one"), (turn, "torus")):
        n = len(block_) + 2
        signs = []
        for factor in (0.99, 1.0, 1.01):
            matrix = np.diag([0.5] * n).astype(float)
            matrix[: len(block_), : len(block_)] = factor * block_
            matrix[-1, -1] = 40.0
            signs.append(Floquet.of_matrices([matrix]).tests[name])
        assert signs[0] * signs[2] < 0.0
        assert abs(signs[1]) <= 1e-14
    assert Floquet.of_matrices([np.diag([2.0, 0.5, 0.1])]).oscillates is False


# Controllers that sample.


def controlled(base_speed: float, *, samples: int = 8, **more: Any) -> Any:
    """Two inertias and a brake whose controller takes some samples in a period of the torque."""
    period = 4.0
    more = {"force": 1.5, "slope": -0.2, "sample_time": period / samples} | more
    brake = contact("a", base_speed=base_speed, **more)
    return in_row(brake, damping=(0.3, 0.2), engine=wb.Harmonic(2.0, 1.0 / period))


@pytest.mark.parametrize(
    ("base_speed", "more"),
    [
        (9.0, {}),
        (0.7, {}),
        (9.0, {"lag": 0.4, "samples": 5}),
        (0.7, {"samples": 1}),
        (4.0, {"resolution": 0.05}),
    ],
    ids=["sliding", "stick-slip", "lag", "one sample", "resolution"],
)
def test_multipliers_with_samples_are_those_of_differences(base_speed, more) -> None:
    machine = controlled(base_speed, **more)
    found = wb.orbit(machine)
    assert found.found
    assert found.order == 1
    n = 4
    if "lag" in more:
        # The state of the lag is no initial condition: its orbit is that of a long run.
        late = wb.simulate(machine, 4000.0, times=[3996.0, 4000.0])
        for one, other in zip(late["velocity"].values, late["velocity"].values[::-1], strict=True):
            assert one == pytest.approx(other, abs=1e-9)
        np.testing.assert_allclose(late["velocity"].values[-1], found.points[0][n // 2 : n],
                                   atol=1e-9)  # fmt: skip
        return
    states = found.points[0]
    np.testing.assert_allclose(after(machine, states, 4.0), states, atol=1e-9)
    expected = np.linalg.eigvals(jacobian(lambda start: after(machine, start, 4.0), states, 1e-5))
    expected = expected[np.argsort(-np.abs(expected))]
    multipliers = np.array(found.multipliers)
    assert np.abs(multipliers) == pytest.approx(np.abs(expected), rel=1e-6, abs=1e-7)


def unknowns(state: Any) -> np.ndarray:
    """Angles, speeds, and the forces in the memory of the controller, the next to act first."""
    force, *queue = state.held[0]
    queue = np.roll(queue, -state.sampled[0][1])
    return np.array([*state.angles.values(), *state.speeds.values(), force, *queue])


def state_of(values: np.ndarray, like: Any) -> Any:
    """The state with these ``unknowns``."""
    names, samples = list(like.angles), like.sampled[0][1]
    angles, speeds, held = np.split(values, [len(names), 2 * len(names)])
    return dataclasses.replace(
        like, angles=dict(zip(names, angles, strict=True)),
        speeds=dict(zip(names, speeds, strict=True)),
        held=((held[0], *np.roll(held[1:], samples)),),
    )  # fmt: skip


@pytest.mark.parametrize(
    ("base_speed", "delay", "more"),
    [
        (4.0, 1, {}), (0.7, 2, {}), (4.0, 3, {"samples": 5}), (4.0, 2, {"samples": 1}),
        (4.0, 2, {"limits": (0.6, 0.72)}), (9.0, 6, {"samples": 3}), (4.0, 2, {"resolution": 0.3}),
    ],
    ids=[
        "sliding", "stick-slip", "long", "one sample", "limits", "longer than the period",
        "resolution",
    ],
)  # fmt: skip
def test_multipliers_with_delays_are_those_of_differences(base_speed, delay, more) -> None:
    """Of restarts between two samples, where also the force that acts is a state."""
    machine = controlled(base_speed, delay=delay, **more)
    found = wb.orbit(machine)
    assert found.order == 1
    assert len(found.multipliers) == 4 + delay

    def later(state: Any, duration: float) -> Any:
        return wb.final_state(wb.simulate(machine, duration, initial=state, times=()))

    between = later(found.initial, 0.2)
    values = unknowns(between)

    def returned(start: np.ndarray) -> np.ndarray:
        return unknowns(later(state_of(start, between), 4.0))

    # The place of the force that acts, the first of the queue, has no further effect.
    kept = np.delete(np.arange(values.size), 5)
    np.testing.assert_allclose(returned(values)[kept], values[kept], atol=1e-10)
    expected = np.linalg.eigvals(jacobian(returned, values, 1e-5)[np.ix_(kept, kept)])
    expected = np.sort(np.abs(expected))[::-1][: 4 + delay]
    assert np.abs(found.multipliers) == pytest.approx(expected, rel=1e-6, abs=1e-7)


@pytest.mark.parametrize("slope", [0.0, -0.2])
def test_an_orbit_with_a_delayed_signal_closes(slope) -> None:
    force = wb.Constant(1.5) + wb.Harmonic(0.3, 0.25, 0.4)
    machine = controlled(4.0, delay=3)
    machine = machine.replace({"brake.initial_force": force, "brake.slope": slope})
    start = wb.orbit(machine).initial
    end = wb.final_state(wb.simulate(machine, 4.0, initial=start, times=()))
    for one, other in ((start.angles, end.angles), (start.speeds, end.speeds)):
        assert list(one.values()) == pytest.approx(list(other.values()), abs=1e-10)


@pytest.mark.parametrize(("delay", "samples"), [(0, 3), (1, 8), (6, 3), (6, 1)])
def test_multipliers_of_sliding_are_those_of_the_linear_theory(delay, samples) -> None:
    machine = controlled(9.0, samples=samples, delay=delay).replace(
        {"brake.initial_force": 20.0, "engine.amplitude": 0.2}
    )
    found, sliding = wb.orbit(machine), wb.stability(machine).cases[0]
    assert found.sequence == "-"
    expected = np.poly(np.array(sliding.multipliers) ** samples)
    np.testing.assert_allclose(np.poly(found.multipliers), expected, rtol=1e-9, atol=1e-10)


@pytest.mark.parametrize(
    ("changes", "name"),
    [
        ({"brake.sample_time": 0.3}, "brake.sample_time"),
        ({"brake.sample_time": 8.0}, "brake.sample_time"),
        ({"engine.amplitude": 0.0}, "brake.sample_time"),
    ],
)
def test_samples_without_a_common_period_have_no_orbit(changes, name) -> None:
    with pytest.raises(InputError) as caught:
        wb.orbit(controlled(9.0).replace(changes))
    assert caught.value.name == name
    assert caught.value.allowed is not None


def test_a_branch_of_a_controller_that_rounds_is_refused() -> None:
    machine = controlled(9.0, resolution=0.01)
    with pytest.raises(InputError) as caught:
        wb.continuation(wb.orbit(machine), {"brake.slope": (-0.2, 0.0)})
    assert caught.value.name == "brake.resolution"


def test_an_orbit_has_no_state_of_a_lag_at_a_slope_of_zero() -> None:
    """A branch cannot begin there, and ends before it."""
    machine = controlled(9.0).replace({"brake.sample_time": None, "brake.lag": 0.4})
    with pytest.raises(InputError) as caught:
        wb.continuation(
            wb.orbit(machine.replace({"brake.slope": 0.0})), {"brake.slope": (0.0, 0.1)}
        )
    assert (caught.value.name, caught.value.value) == ("brake.slope", (0.0, 0.1))
    last = list(wb.continuation(wb.orbit(machine), {"brake.slope": (-0.2, 0.0)}))[-1]
    assert -1e-4 < last.value < 0.0


def test_a_branch_over_which_samples_do_not_fit_the_period_is_refused() -> None:
    found = wb.orbit(controlled(9.0))
    with pytest.raises(InputError) as caught:
        wb.continuation(found, {"engine.frequency": (0.2, 0.3)})
    assert caught.value.name == "engine.frequency"


def digital(base_speed: float, samples: int = 8, **more: Any) -> wb.Machine:
    """Two inertias and a brake, with a controller that takes some samples in a period."""
    machine = controlled(base_speed).replace({"brake.sample_time": None})
    loop = {"measured": {"a.speed": 1.0}, "setpoint": 0.0, "output": "a.torque"} | more
    gain = 0.2 if loop["output"] == "a.torque" else -0.1
    return machine.replace(
        controllers=[wb.Controller("loop", proportional=gain, sample_time=4.0 / samples, **loop)]
    )


@pytest.mark.parametrize(
    ("base_speed", "samples", "more"),
    [
        (9.0, 8, {}), (0.7, 8, {}), (9.0, 1, {}), (0.7, 3, {"limits": (-0.1, 0.1)}),
        (9.0, 5, {"output": "brake.command"}),
    ],
    ids=["sliding", "stick-slip", "one sample", "limits", "command"],
)  # fmt: skip
def test_multipliers_with_digital_controllers_are_those_of_differences(
    base_speed: float, samples: int, more: dict[str, Any]
) -> None:
    machine, step = digital(base_speed, samples, **more), 1e-6
    found = wb.orbit(machine)
    start = numbers(found.initial)[:4]
    np.testing.assert_allclose(after(machine, start, found.period), start, atol=1e-9)
    columns = [
        (after(machine, start + one, found.period) - after(machine, start - one, found.period))
        for one in step * np.eye(4)
    ]
    expected = np.linalg.eigvals(np.transpose(columns) / (2.0 * step))
    np.testing.assert_allclose(np.poly(found.multipliers), np.poly(expected), atol=1e-7)


def test_a_curve_over_the_frequency_with_a_digital_controller() -> None:
    """Its ends are orbits of the machines with these sample times."""
    machine = digital(9.0)
    with pytest.raises(InputError, match="samplings in a period"):
        wb.response_curve(machine, frequency=(0.2, 0.3), levels=[2.0])
    curve = wb.response_curve(machine, frequency=(0.2, 0.3), levels=[2.0], samplings=8)
    for at in (curve.isel(point=0), curve.isel(point=-1)):
        changes = {"engine.frequency": float(at["engine.frequency"])}
        changes["loop.sample_time"] = float(at["sample_time"])
        assert math.prod(changes.values()) == pytest.approx(1.0 / 8.0, rel=1e-12)
        orbit = wb.orbit(machine.replace(changes))
        assert float(at.angle_amplitude.max()) == pytest.approx(orbit.angle_amplitude, rel=1e-9)


SAMPLE = 0.025


def held_by_a_digital_controller(samples: int, **more: Any) -> wb.Machine:
    """One inertia on a spring, driven by a sine; the controller measures its angle."""
    loop = {"proportional": 4.0, "sample_time": SAMPLE} | more
    return wb.Machine(
        inertias=[wb.Inertia("a", 1.0)],
        shafts=[wb.Shaft("a", "ground", stiffness=30.0, damping=0.8)],
        torques=[wb.Torque("a", wb.Harmonic(2.0, 1.0 / (samples * SAMPLE), 0.3))],
        controllers=[
            wb.Controller("loop", measured={"a.angle": 1.0}, setpoint=0.1, output="a.torque",
                          **loop)
        ],
    )  # fmt: skip


def exactly_discretised(samples: int, loop: wb.Controller) -> tuple[np.ndarray, np.ndarray]:
    """The state just before the first sample, and the multipliers, by matrix exponentials.

    The state is angle, speed, sine and cosine of the torque, sum, derivative part, last error,
    delayed outputs, 1.
    """
    turn, size = 2.0 * math.pi / (samples * SAMPLE), 8 + loop.delay
    rates = np.zeros((5, 5))
    rates[0, 1], rates[1] = 1.0, [-30.0, -0.8, 2.0, 0.0, 1.0]
    rates[2, 3], rates[3, 2] = turn, -turn
    held, unit = expm(rates * SAMPLE), np.eye(size)
    error = 0.1 * unit[-1] - unit[0]
    total = unit[4] + loop.integral * SAMPLE * error
    smooth = loop.filter_time or 0.0
    slope = (smooth * unit[5] + loop.derivative * (error - unit[6])) / (smooth + SAMPLE)
    outputs = [*unit[7 : 7 + loop.delay], loop.proportional * error + total + slope]
    step = np.vstack([
        held[:4, :4] @ unit[:4] + np.outer(held[:4, 4], outputs[0]), total, slope, error,
        *outputs[1:], unit[-1],
    ])  # fmt: skip
    own = [0, 1, *([4] if loop.integral else []), *([5, 6] if loop.derivative else [])]
    own += range(7, 7 + loop.delay)
    over, start = np.linalg.matrix_power(step, samples), np.zeros(size)
    start[[2, 3, -1]] = math.sin(0.3), math.cos(0.3), 1.0
    matrix = over[np.ix_(own, own)]
    return np.linalg.solve(np.eye(len(own)) - matrix, (over @ start)[own]), np.linalg.eigvals(
        matrix
    )


@pytest.mark.parametrize("samples", [1, 3, 7, 40, 60, 83])
@pytest.mark.parametrize(
    "more",
    [
        {"integral": 3.0}, {"integral": 3.0, "delay": 1}, {"derivative": 0.2},
        {"integral": 3.0, "derivative": 0.2, "filter_time": 0.05, "delay": 3},
    ],
    ids=["integral", "delay", "derivative", "all"],
)  # fmt: skip
def test_orbits_with_the_memory_of_a_digital_controller(samples: int, more: dict[str, Any]) -> None:
    """Against the exact discretisation, also where the period is not exact in binary."""
    machine = held_by_a_digital_controller(samples, **more)
    found = wb.orbit(machine)
    state, multipliers = exactly_discretised(samples, machine.controllers[0])
    assert found.period == samples * SAMPLE
    assert found.initial is not None
    own = [*found.initial.angles.values(), *found.initial.speeds.values()]
    np.testing.assert_allclose(own, state[:2], atol=1e-12)
    np.testing.assert_allclose(np.poly(found.multipliers), np.poly(multipliers), atol=1e-12)


def test_a_gain_at_which_the_loop_of_a_digital_controller_becomes_unstable() -> None:
    """The modulus of a pair of multipliers is 1 at the gain of the exact discretisation."""
    machine = held_by_a_digital_controller(40, integral=3.0, delay=2)
    branch = wb.continuation(wb.orbit(machine), {"loop.integral": (3.0, 40.0)})
    list(branch)
    (found,) = branch.bifurcations
    assert found.bifurcation.kind is Kind.NEIMARK_SACKER

    def beyond(gain: float) -> float:
        loop = machine.controllers[0].model_copy(update={"integral": gain})
        return float(np.abs(exactly_discretised(40, loop)[1]).max()) - 1.0

    assert found.value == pytest.approx(brentq(beyond, 3.0, 40.0, xtol=1e-13), rel=1e-9)


def moved(state: Any, changes: np.ndarray | None = None) -> tuple[np.ndarray, Any]:
    """All numbers of a state between two samples, and the state with changed ones."""
    queues = [
        (held[0], *np.roll(held[1:], -sampled[1])) if held else ()
        for held, sampled in zip(state.held, state.sampled, strict=True)
    ]
    parts = [list(state.angles.values()), list(state.speeds.values()), state.actuators, *queues]
    numbers = np.concatenate(parts) + (0.0 if changes is None else changes)
    angles, speeds, actuators, *held = np.split(
        numbers, np.cumsum([len(one) for one in parts])[:-1]
    )
    return numbers, dataclasses.replace(
        state, angles=dict(zip(state.angles, angles, strict=True)),
        speeds=dict(zip(state.speeds, speeds, strict=True)), actuators=tuple(actuators),
        held=tuple(
            (one[0], *np.roll(one[1:], sampled[1])) if len(one) else ()
            for one, sampled in zip(held, state.sampled, strict=True)
        ),
    )  # fmt: skip


ON_THE_ANGLE = {"measured": {"a.angle": 1.0}}
COMMAND = {"measured": {"b.angle": 1.0}, "setpoint": -8.0, "output": "brake.command",
           "derivative": 0.05, "filter_time": 0.3}  # fmt: skip


@pytest.mark.parametrize("base_speed", [9.0, 0.7], ids=["sliding", "stick-slip"])
@pytest.mark.parametrize(
    ("more", "loop"),
    [
        ({}, ON_THE_ANGLE | {"integral": 0.1, "derivative": 0.1, "filter_time": 0.1}),
        ({}, ON_THE_ANGLE | {"integral": 0.05, "delay": 2}),
        ({"slope": 0.0, "force": 4.0}, COMMAND),
        ({"force": 4.0, "delay": 3, "sample_time": 0.5}, COMMAND),
        ({"force": 4.0, "sample_time": 0.25}, COMMAND | {"sample_time": None}),
    ],
    ids=["derivative", "delay", "command", "sampled command", "sampled output"],
)
def test_multipliers_with_the_memory_of_controllers_are_those_of_differences(
    base_speed: float, more: dict[str, Any], loop: dict[str, Any]
) -> None:
    given = {"sample_time": 0.5, "setpoint": 0.0, "output": "a.torque"} | loop
    machine = controlled(base_speed, **({"sample_time": None} | more)).replace(
        controllers=[wb.Controller("loop", proportional=0.1, **given)]
    )
    found = wb.orbit(machine)
    assert found.order == 1

    def later(state: Any, duration: float) -> Any:
        return wb.final_state(wb.simulate(machine, duration, initial=state, times=()))

    between, step = later(found.initial, 0.1), 1e-5
    start = moved(between)[0]
    np.testing.assert_allclose(moved(later(between, 4.0))[0], start, atol=1e-11)
    columns = [
        moved(later(moved(between, one)[1], 4.0))[0] - moved(later(moved(between, -one)[1], 4.0))[0]
        for one in step * np.eye(start.size)
    ]
    expected = np.linalg.eigvals(np.transpose(columns) / (2.0 * step))
    # Between two samples there are further states, which the next sample replaces.
    own = np.append(found.multipliers, np.zeros(start.size - len(found.multipliers)))
    np.testing.assert_allclose(np.poly(own), np.poly(expected), atol=1e-7)


def test_a_rounded_output_of_a_digital_controller_is_refused() -> None:
    curve: Any = {"frequency": (0.2, 0.3), "levels": [2.0]}
    for call in (wb.orbit, lambda one: wb.response_curve(one, **curve)):
        with pytest.raises(InputError, match=r"wb\.motion") as caught:
            call(digital(9.0, resolution=0.1))
        assert caught.value.name == "loop.resolution"


def test_a_delay_of_too_many_samples_is_refused() -> None:
    machine = controlled(9.0, samples=250, delay=501)
    with pytest.raises(InputError) as caught:
        wb.orbit(machine, 1, initial=wb.final_state(wb.simulate(machine, 1e-9, times=())))
    assert (caught.value.name, caught.value.value) == ("brake.delay", 501)
    assert "500" in str(caught.value)
    # The same dead time, sampled less often.
    assert wb.orbit(controlled(9.0, samples=25, delay=50)).found


class TestRotationsAndTwists:
    """Two inertias on a shaft that rotate freely, with a harmonic torque on one of them."""

    @staticmethod
    def machine() -> wb.Machine:
        """A viscous shaft to the ground and a constant torque keep the mean speed at 2 rad/s."""
        return wb.Machine(
            inertias=[wb.Inertia("a", 1.5, speed=2.0), wb.Inertia("b", 0.5, speed=2.0)],
            shafts=[
                wb.Shaft("a", "b", 40.0, 1.2, name="string"),
                wb.Shaft("a", "ground", 0.0, 0.7, name="mud"),
            ],
            contacts=[
                wb.Contact(
                    "b", "ground", name="brake", brake=wb.ConventionalBrake(radius=0.1),
                    friction=wb.CoulombFriction(kinetic=0.3),
                    actuation=wb.Actuation(initial_force=20.0),
                )
            ],
            torques=[
                wb.Torque("a", wb.Constant(2.0), name="motor"),
                wb.Torque("b", wb.Harmonic(3.0, 1.1), name="engine"),
            ],
        )  # fmt: skip

    def test_amplitudes_are_those_of_the_linear_machine(self) -> None:
        """The contact always slides: its torque is constant, and the vibration is linear."""
        w = 2.2 * math.pi
        stiffness = 40.0 * np.array([[1.0, -1.0], [-1.0, 1.0]])
        damping = 1.2 * np.array([[1.0, -1.0], [-1.0, 1.0]]) + np.diag([0.7, 0.0])
        shape = np.linalg.solve(
            stiffness + 1j * w * damping - w * w * np.diag([1.5, 0.5]), [0.0, 3.0]
        )
        found = wb.orbit(self.machine())
        assert found.sequence == "+"
        assert found.angle_amplitude == pytest.approx(np.abs(shape).max(), rel=1e-9)
        twist = abs(shape[0] - shape[1])
        amplitude, peak = found.twists["string"]
        assert amplitude == pytest.approx(twist, rel=1e-9)
        # The friction of 0.6 N m on b winds the string up.
        assert peak == pytest.approx(twist + 0.6 / 40.0, rel=1e-9)
        assert np.isnan(found.twists["mud"]).all()
        data = wb.branches(self.machine(), {"engine.amplitude": (3.0, 3.5)}, step=0.5, switch=0)
        scale = data["engine.amplitude"].values / 3.0
        np.testing.assert_allclose(data.angle_amplitude, scale * np.abs(shape).max(), rtol=1e-9)
        string = data.sel(shaft="string")
        np.testing.assert_allclose(string.twist_amplitude, scale * twist, rtol=1e-9)
        np.testing.assert_allclose(string.peak_twist, scale * twist + 0.015, rtol=1e-9)
