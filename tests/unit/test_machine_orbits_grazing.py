"""Orbits of machines that just touch a breakpoint of a torque, a limit of a force or a release."""

from __future__ import annotations

import math
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest
from test_machine_boundaries import inner, pair

import wedgebrake as wb
from machines import block, contact, general, in_row, stribeck
from wedgebrake.orbits.bifurcation_types import Scenario

EXAMPLES = Path(__file__).parents[2] / "examples"
TABLE = wb.TabulatedFriction(speeds=[0.0, 0.5, 1.0, 2.0], coefficients=[0.3, 0.28, 0.25, 0.22])
WEDGE = wb.paper.system(eta=-24.0, F0=0.036)
DRIVELINES = {
    "release": (WEDGE, 1, (540.0, 640.0), "exact"),
    "release of 2T": (WEDGE, 2, (320.0, 480.0), "exact"),
    "table": (wb.paper.system(eta=-12.0, F0=0.05).replace(friction=TABLE), 1, (260.0, 310.0),
              "exact"),
    "curve": (wb.paper.system(eta=0.0, F0=0.05, brake="conventional").replace(friction=TABLE), 1,
              (200.0, 300.0), "smooth"),
}  # fmt: skip


def points_of(branch: Any) -> list[Any]:
    """The bifurcations of a branch."""
    return [one for one in branch if one.bifurcation]


def grazes(branch: Any) -> list[Any]:
    """The grazes of a branch."""
    return [one for one in points_of(branch) if one.bifurcation.kind.value == "grazing"]


@pytest.mark.parametrize("name", DRIVELINES)
def test_bifurcations_are_those_of_the_driveline(name) -> None:
    """Those of the driveline are roots of margins of the equations of its segments."""
    system, order, ends, method = DRIVELINES[name]
    system = system.replace(amplitude=ends[0])
    expected = wb.continuation(wb.orbit(system, order), amplitude=ends, step=0.1)
    orbit = wb.orbit(general(system.machine), order, method=method)
    found = wb.continuation(orbit, {"torque.amplitude": ends}, step=0.1)
    kinds = [[one.bifurcation.kind for one in points_of(own)] for own in (found, expected)]
    assert kinds[0] == kinds[1]
    assert any(kind.value == "grazing" for kind in kinds[0])
    values = [[one.value for one in own.bifurcations] for own in (found, expected)]
    np.testing.assert_allclose(*values, rtol=1e-11)


def test_an_unstable_branch_turns_back_at_grazing_sliding() -> None:
    """In a corner, as that of the driveline, and reaches the synchronous orbit."""
    line = wb.paper.system(eta=-48.0, F0=0.06)
    ends = (line.excitation.frequency, 1.5 * line.excitation.frequency)
    expected = wb.continuation(wb.orbit(line, 2), frequency=ends)
    start = wb.orbit(general(line.machine), 2)
    found = wb.continuation(start, {"torque.frequency": ends})
    (corner,), (turn,) = (
        [one for one in points_of(own) if one.bifurcation.scenario is Scenario.FOLD]
        for own in (found, expected)
    )
    assert corner.bifurcation.kind is turn.bifurcation.kind
    assert corner.value == pytest.approx(turn.value, rel=1e-11)
    assert not corner.stable
    assert found.end == expected.end == "period doubling of the synchronous orbit"
    assert found.points[-1].value == pytest.approx(expected.points[-1].value, rel=1e-9)


def test_branches_contain_grazes() -> None:
    machine = general(WEDGE.machine).replace({"torque.amplitude": 540.0})
    over = {"torque.amplitude": (540.0, 640.0)}
    expected = [one.value for one in grazes(wb.continuation(wb.orbit(machine, 1), over, step=0.1))]
    found = wb.branches(machine, over, order=1, switch=0, opposite=False, step=0.1)
    values = found["bifurcation_value"].values[found["bifurcation_kind"].values == "grazing"]
    np.testing.assert_allclose(values, expected, rtol=1e-12)


MASSES, STIFFNESS, DAMPING, RADIUS, KINETIC = (1.0, 0.5), (4.0, 6.0), (0.125, 0.0625), 2.0, 0.5
FREQUENCY, BASE = 0.25, 9.0


def sliding(friction: Any = KINETIC, **actuation: Any) -> Any:
    """Two inertias, of which one slides on a moving base at all times, so that all is linear."""
    brake = contact("a", radius=RADIUS, friction=friction, base_speed=-BASE, **actuation)
    wave = wb.Harmonic(1.0, FREQUENCY)
    return in_row(brake, inertia=MASSES, stiffness=STIFFNESS, damping=DAMPING, engine=wave)


def responses(slope: float, lag: float = 0.0, falling: float = 0.0) -> tuple[float, float]:
    """Amplitudes of the speed of the first inertia and of the force, for a torque of 1 N m.

    slope   : of the force over the sliding speed, which is positive
    falling : change of the torque per change of the sliding speed, other than by the force
    """
    s, (k, m), (c, d) = 2.0j * math.pi * FREQUENCY, STIFFNESS, DAMPING
    gain = RADIUS * wb.ConventionalBrake(radius=RADIUS).amplification(KINETIC)
    matrix = np.array([
        [MASSES[0] * s**2 + (c + d + falling) * s + k + m, -d * s - m, gain],
        [-d * s - m, MASSES[1] * s**2 + d * s + m, 0.0],
        [-slope * s, 0.0, lag * s + 1.0],
    ])  # fmt: skip
    found = np.linalg.solve(matrix, [0.0, 1.0, 0.0])
    return float(abs(s * found[0])), float(abs(found[2]))


class Linear(NamedTuple):
    """A graze of a motion that is linear up to there.

    amplitude : of the torque at the graze, in closed form, by a second parameter
    """

    machine: Any
    second: str
    ends: tuple[float, float]
    amplitude: Any


def _speed_of_table(_: float) -> float:
    """The sliding speed reaches 11 rad/s, where the table bends."""
    falling = RADIUS * wb.ConventionalBrake(radius=RADIUS).amplification(1.0) * RADIUS
    return 2.0 / responses(0.0, falling=falling * (0.45 - 0.5) / 12.0)[0]


BENT = wb.TabulatedFriction(speeds=[0.0, 10.0, 22.0, 40.0], coefficients=[0.5, 0.5, 0.45, 0.4])
LINEAR = {
    "highest force after a lag": Linear(
        sliding(slope=0.02, lag=0.3, limits=(0.5, 1.3)), "brake.initial_force",
        (0.95, 1.05), lambda force: (1.3 - (force + 0.02 * BASE)) / responses(0.02, 0.3)[1],
    ),
    "lowest force after a lag": Linear(
        sliding(slope=0.02, lag=0.3, limits=(1.1, 1.9)), "brake.initial_force",
        (0.95, 1.05), lambda force: (force + 0.02 * BASE - 1.1) / responses(0.02, 0.3)[1],
    ),
    "release": Linear(
        sliding(slope=-0.1), "brake.initial_force", (0.97, 1.03),
        lambda force: (force - 0.1 * BASE) / responses(-0.1)[1],
    ),
    "table": Linear(
        sliding(BENT, slope=0.0), "brake.base_speed", (-9.2, -8.9),
        lambda speed: _speed_of_table(0.0) * (11.0 + speed) / 2.0,
    ),
}  # fmt: skip


@cache
def of_linear(name: str) -> Any:
    """The first graze of a linear motion over the amplitude of the torque."""
    machine, _, _, amplitude = LINEAR[name]
    end = 1.2 * amplitude(machine.value(LINEAR[name].second))
    orbit = wb.orbit(machine.replace({"engine.amplitude": 0.5 * end}))
    return grazes(wb.continuation(orbit, {"engine.amplitude": (0.5 * end, end)}, step=0.2))[0]


LOWEST = "lowest force after a lag"


@pytest.mark.parametrize(
    "name",
    [pytest.param(name, marks=[pytest.mark.slow] * (name == LOWEST)) for name in LINEAR],
)
def test_grazes_of_linear_motions_are_those_of_the_closed_form(name) -> None:
    machine, second, ends, amplitude = LINEAR[name]
    point = of_linear(name)
    value = amplitude(machine.value(second))
    assert point.value == pytest.approx(value, rel=1e-11)
    assert point.bifurcation.changed.contact == 0
    curve = wb.boundary(
        point, step=0.2, **{"engine.amplitude": (0.3 * value, 2.0 * value), second: ends}
    )
    assert curve.attrs["bifurcation"] == "grazing"
    assert curve.sizes["point"] > 5
    expected = [amplitude(one) for one in curve[second].values]
    np.testing.assert_allclose(curve["engine.amplitude"].values, expected, rtol=1e-9)


def events_beside(point: Any, shares: tuple[float, ...]) -> list[int]:
    """Numbers of events in orbits at amplitudes that differ from a point by small shares."""
    counts = []
    for share in shares:
        machine = point.system.replace({"engine.amplitude": (1.0 + share) * point.value})
        orbit = wb.orbit(machine, initial=point.initial, order=1)
        response = wb.simulate(machine, 1.0 / FREQUENCY, initial=orbit.initial, times=[])
        counts.append(response.sizes["event"])
    return counts


@pytest.mark.parametrize("name", LINEAR)
def test_linear_motions_on_both_sides_of_a_graze_differ_in_the_events_of_one_touch(name) -> None:
    assert events_beside(of_linear(name), (-1e-10, 1e-10)) == [0, 2]


@pytest.mark.parametrize(
    ("second", "ends", "more"),
    [pytest.param(0.1, (1.1, 1.33), 2, marks=pytest.mark.slow), (0.0, (1.1, 1.343), 4)],
    ids=["one touch", "symmetric"],
)  # fmt: skip
def test_stick_slip_on_both_sides_of_a_graze_differs_in_the_events_of_a_touch(
    second, ends, more
) -> None:
    machine = pair(ends[0], second).replace({"clutch.slope": -0.4})
    branch = wb.continuation(wb.orbit(machine), {"engine.amplitude": ends}, step=0.2)
    point = grazes(branch)[0]
    assert point.measures.stick_share > 0.0
    before, beyond = events_beside(point, (-1e-9, 1e-9))
    assert beyond - before == more


@pytest.mark.parametrize(
    ("lag", "followed"),
    [({"frequency": 4.0, "damping_ratio": 0.7}, True), ({"lag": 0.3}, False)],
    ids=["smooth force", "force with kinks"],
)
def test_a_sampled_force_touches_its_limit(lag, followed) -> None:
    """With a lag of first order, the force turns at a sampling."""
    machine = sliding(
        slope=0.02, limits=(0.5, 1.3), sample_time=1.0 / (16 * FREQUENCY), **lag
    ).replace({"engine.amplitude": 0.3})
    ends = {"engine.amplitude": (0.3, 1.0)}
    (point,) = grazes(wb.continuation(wb.orbit(machine), ends, step=0.2))
    assert events_beside(point, (-1e-10, 1e-10)) == [0, 2]
    curve = wb.boundary(point, step=0.2, **ends, **{"brake.initial_force": (0.9, 1.1)})
    if not followed:
        assert curve.attrs["begin"] == "an event coincides with a sampling"
        assert curve.sizes["point"] == 1
        return
    for k in inner(curve):
        value = float(curve["engine.amplitude"][k])
        there = machine.replace({
            "brake.initial_force": float(curve["brake.initial_force"][k]),
            "engine.amplitude": 0.999 * value,
        })  # fmt: skip
        beside = {"engine.amplitude": (0.999 * value, 1.001 * value)}
        (found,) = grazes(wb.continuation(wb.orbit(there), beside))
        assert found.value == pytest.approx(value, rel=1e-11)


@pytest.mark.slow
def test_a_curve_of_a_release_is_that_of_the_driveline() -> None:
    start, ends = WEDGE.replace(amplitude=540.0), (450.0, 700.0)
    first = wb.orbit(general(start.machine), 1)
    branch = wb.continuation(first, {"torque.amplitude": ends}, step=0.1)
    over = {"torque.amplitude": ends, "brake.slope": (-43.0, -37.0)}
    curve = wb.boundary(grazes(branch)[0], step=0.1, **over)
    for k in inner(curve):
        value = float(curve["torque.amplitude"][k])
        there = start.replace(slope=float(curve["brake.slope"][k]), amplitude=value - 1.0)
        near = wb.continuation(wb.orbit(there, 1), amplitude=(value - 1.0, value + 1.0))
        assert grazes(near)[0].value == pytest.approx(value, rel=1e-11)


def test_lines_that_approximate_a_smooth_curve_are_not_touched() -> None:
    machine = block(stribeck(), 1.5).replace({"block.angle": 0.8, "block.speed": 1.5})
    branch = wb.continuation(wb.orbit(machine), {"belt.base_speed": (1.3, 1.6)}, step=0.1)
    assert not grazes(branch)
    assert len(branch.points) > 3


def test_a_branch_passes_a_reversal_at_a_sampling() -> None:
    """The reversal passes the sampling number 13, where the derivative of the return map jumps."""
    machine = wb.paper.system(eta=-24.0, F0=0.09).machine
    step = machine.period / 40
    machine = machine.replace({"brake.sample_time": step, "torque.amplitude": 238.76})
    ends = {"torque.amplitude": (238.76, 238.77)}
    branch = wb.continuation(wb.orbit(machine, 1), ends, step=0.5)
    points = list(branch)
    assert points[-1].value == ends["torque.amplitude"][1]
    counts = []
    for one in (points[0], points[-1]):
        response = wb.simulate(one.system, machine.period, initial=one.initial, times=[])
        counts.append(float(response["event_time"][0]) / step)
    assert counts[1] < 13.0 < counts[0]
    assert counts[0] - counts[1] < 1e-2
    # Orbits from a given start, on either side and between.
    values = [one.value for one in points]
    states = np.array([one.points[0][:2] for one in points])
    for value in np.linspace(values[0], values[-1], 5):
        there = wb.orbit(machine.replace({"torque.amplitude": value}), 1, initial=points[0].initial)
        expected = [np.interp(value, values, states[:, k]) for k in range(2)]
        np.testing.assert_allclose(there.points[0][:2], expected, rtol=1e-7)


def test_a_branch_turns_at_a_fold_that_newtons_method_just_passes() -> None:
    """A step that ends within rounding of the fold finds the orbits beyond it: no persistence."""
    system = wb.load_study(EXAMPLES / "falling_friction.toml").system
    branch = wb.continuation(wb.orbit(system), drive_speed=(3.0, 19.0))
    folds = []
    for point in branch:
        if point.bifurcation and point.bifurcation.kind.value == "grazing-sliding":
            folds.append(point)
        if folds and point.value < 18.0:
            break
    (fold,) = folds
    assert fold.bifurcation.scenario is Scenario.FOLD
    beyond = branch.points[branch.points.index(fold) + 1 :]
    assert beyond[-1].value < 18.0
    assert not any(point.stable or point.measures.stick_share for point in beyond)
