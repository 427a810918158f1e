"""A bifurcation followed in a second parameter, against the first one's and closed forms."""

from __future__ import annotations

import json
import math
from functools import cache

import numpy as np
import pytest

import wedgebrake as wb
from cases import ISLAND
from wedgebrake.orbits.bifurcation_types import Kind
from wedgebrake.orbits.palc import StepLength
from wedgebrake.orbits.problems.choose_problem import orbit_problem

WEDGE = wb.paper.system(eta=-24.0, F0=0.067)
CONVENTIONAL = wb.paper.system(eta=-10.0, F0=0.05, brake="conventional")
# Kind: the branch on which the first one is, and the ranges of its curve.
KINDS = {
    "period doubling": (
        WEDGE, {"F0": (0.06, 0.09)}, {"F0": (0.05, 0.1), "eta": (-28.0, -20.0)},
    ),
    "switching-sliding": (
        WEDGE, {"F0": (0.09, 0.035)}, {"F0": (0.05, 0.07), "eta": (-26.0, -22.0)},
    ),
    "grazing-sliding": (
        WEDGE, {"F0": (0.09, 0.035)}, {"F0": (0.05, 0.07), "eta": (-26.0, -22.0)},
    ),
    "Neimark-Sacker": (
        CONVENTIONAL, {"eta": (-10.0, -50.0)}, {"eta": (-50.0, -10.0), "F0": (0.04, 0.06)},
    ),
}  # fmt: skip


def _first(kind: str, system: wb.BrakedDriveline, order: int = 1, **over) -> wb.BranchPoint:
    """The first bifurcation of a kind on a branch."""
    branch = wb.continuation(wb.orbit(system, order), **over)
    return next(p for p in branch if p.bifurcation and p.bifurcation.kind.value == kind)


@cache
def _start(kind: str) -> wb.BranchPoint:
    system, over, _ = KINDS[kind]
    return _first(kind, system.replace(**{name: ends[0] for name, ends in over.items()}), **over)


@cache
def _curve(kind: str):
    return wb.boundary(_start(kind), **KINDS[kind][2])


@pytest.mark.parametrize("kind", KINDS)
def test_points_are_bifurcations_over_the_first_parameter(kind) -> None:
    """Found again, at the value that the boundary has there, to 1e-8 of the range."""
    found, ranges = _curve(kind), KINDS[kind][2]
    assert found.attrs["kind"] == "boundary"
    assert found.attrs["bifurcation"] == kind
    assert found.sizes["point"] > 5
    own, second = ranges
    width = abs(ranges[own][1] - ranges[own][0])
    for k in (1, found.sizes["point"] // 2, found.sizes["point"] - 2):
        value = float(found[own][k])
        # From the orbit a little beside it.
        system = _start(kind).system.replace(
            **{second: float(found[second][k]), own: value + 3e-4 * width}
        )
        state = float(found.angle[k]), float(found.velocity[k])
        near = wb.orbit(system, 1, initial=state)
        assert near.found
        branch = wb.continuation(
            near, step=0.05, **{own: (value + 1e-3 * width, value - 1e-3 * width)}
        )
        values = [p.value for p in branch if p.bifurcation and p.bifurcation.kind.value == kind]
        assert np.min(np.abs(np.array(values) - value)) <= 1e-8 * width


def test_multipliers_along_are_those_of_the_kind() -> None:
    least = np.abs(_curve("period doubling").multiplier_real.values + 1.0).min(axis=1)
    assert np.all(least <= 1e-8)
    torus = _curve("Neimark-Sacker")
    moduli = np.hypot(torus.multiplier_real.values, torus.multiplier_imag.values)
    np.testing.assert_allclose(moduli, 1.0, atol=1e-9)


def test_dataset() -> None:
    start, found = _start("switching-sliding"), _curve("switching-sliding")
    assert set(found.sizes) == {"point", "multiplier"}
    assert found.attrs["parameters"] == ["F0", "eta"]
    for name, (low, high) in KINDS["switching-sliding"][2].items():
        assert {"units", "long_name"} <= set(found[name].attrs)
        assert found[name].dtype == float
        assert np.all((found[name].values >= low) & (found[name].values <= high))
    assert found.attrs["begin"].startswith("left the range of")
    assert found.attrs["end"].startswith("left the range of")
    assert json.loads(found.attrs["system"]) == start.problem.base.as_dict()
    # The curve goes through the point that it was begun from.
    at = np.argmin(np.abs(found.eta.values + 24.0))
    assert float(found.F0[at]) == pytest.approx(start.value, abs=1e-9)


def test_steps_are_no_longer_than_asked() -> None:
    start, ranges = _start("switching-sliding"), KINDS["switching-sliding"][2]
    found = wb.boundary(start, step=0.01, points=30, **ranges)
    assert 30 < found.sizes["point"] <= 61
    parts = [np.diff(found[n].values) / (ranges[n][1] - ranges[n][0]) for n in ranges]
    assert np.all(np.hypot(*parts) <= 0.0101)


def test_release_touches_a_slip_without_friction_where_the_linear_oscillator_says() -> None:
    """A brake that presses nowhere but beyond the reach of its motion: a closed form.

    With mu = 0 nothing acts but spring, damping and torque: the velocity amplitude is
    omega T/|k - J omega^2 + i c omega|, and a breakpoint of the law is grazed where it equals
    the release speed F_a0/-slope, over any two parameters.
    """
    system = wb.paper.system(eta=0.0).replace(
        kinetic=0.0, static=0.0, damping=20.0, initial_force=100.0, slope=-10.0, amplitude=300.0
    )

    def amplitude(s: wb.BrakedDriveline) -> float:
        line, omega = s.driveline, s.excitation.angular_frequency
        z = line.stiffness - line.inertia * omega**2 + 1j * line.damping * omega
        return omega * s.excitation.amplitude / abs(z)

    reach = amplitude(system) / 10.0
    ends = (300.0, 600.0 / reach)
    graze = _first("grazing", system, amplitude=ends)
    assert graze.value == pytest.approx(300.0 / reach, rel=1e-9)
    found = wb.boundary(graze, amplitude=ends, damping=(5.0, 60.0))
    assert found.sizes["point"] > 10
    for one, other in zip(found.amplitude.values, found.damping.values, strict=True):
        at = system.replace(amplitude=float(one), damping=float(other))
        assert amplitude(at) == pytest.approx(10.0, rel=1e-8)
    np.testing.assert_allclose(found.damping.values[[0, -1]].min(), 5.0, atol=0.5)


class TestNothingTwice:
    """A curve ends where it would go back over its own points."""

    def test_torus_of_2t_ends_where_the_synchronous_orbit_is_at_its_resonance(self) -> None:
        """There the halves of the 2T orbit meet; both multipliers of the synchronous one are -1.

        Beyond, they change places: the same orbits, half of each later.
        """
        system = wb.paper.system(eta=-18.0, F0=0.036)
        start = _first("Neimark-Sacker", system, 2, eta=(-18.0, -22.0))
        begins = []
        for step in (0.05, 0.02):
            found = wb.boundary(start, step=step, eta=(-22.0, -10.0), F0=(0.03, 0.06))
            assert found.attrs["begin"] == "period doubling of the synchronous orbit"
            assert found.attrs["end"] == "left the range of eta"
            assert np.all(np.diff(found.eta.values) < 0.0)
            begins.append((float(found.eta[0]), float(found.F0[0])))
        np.testing.assert_allclose(*begins, rtol=1e-6)
        eta, force = begins[0]
        # docs/numerics.md, "In two parameters".
        assert (eta, force) == pytest.approx((-18.0458, 0.0306961), rel=3e-6)
        state = float(found.angle[0]), float(found.velocity[0])
        first = wb.orbit(wb.paper.system(eta=eta, F0=force), 1, initial=state)
        one, other = first.multipliers
        assert (one * other).real == pytest.approx(1.0, abs=1e-5)
        assert (one + other).real == pytest.approx(-2.0, abs=1e-5)

    @pytest.mark.parametrize("points", [2000, 40])
    def test_a_closed_curve_is_gone_round_once(self, points) -> None:
        """Also where neither half of it is the whole."""
        start = _first("period doubling", ISLAND.replace(f=0.41), f=(0.41, 0.38))
        ends = {"f": (0.3, 0.5), "drive_speed": (0.05, 3.0)}
        found = wb.boundary(start, points=points, **ends)
        assert "the curve has closed" in (found.attrs["begin"], found.attrs["end"])
        places = np.column_stack([(found[n].values / (b - a)) for n, (a, b) in ends.items()])
        np.testing.assert_allclose(places[0], places[-1], atol=1e-6)
        # About a point within, the angles add up to one turn.
        inner = places[1:-1].mean(axis=0)
        turns = np.unwrap(np.arctan2(*(places - inner).T))
        assert abs(turns[-1] - turns[0]) == pytest.approx(2.0 * np.pi, abs=1e-3)


def test_boundaries_are_of_the_kinds_that_are_asked_for() -> None:
    ends = {"F0": (0.09, 0.06), "eta": (-26.0, -22.0)}
    options = {"order": 1, "switch": 0, "points": 40}
    (curve,) = wb.boundaries(WEDGE, kinds=["period doubling"], **options, **ends)
    at = np.argmin(np.abs(curve.eta.values + 24.0))
    # Both sides of it by their multipliers.
    below, above = (
        wb.orbit(WEDGE.replace(F0=float(curve.F0[at]) + side), 1).multipliers[0].real + 1.0
        for side in (-1e-6, 1e-6)
    )
    assert below * above < 0.0
    assert wb.boundaries(WEDGE, kinds=["fold"], **options, **ends) == []


class TestArguments:
    def test_no_bifurcation(self) -> None:
        ordinary = next(wb.continuation(wb.orbit(WEDGE, 1), F0=(0.067, 0.06)))
        for point in (ordinary, 3, None):
            with pytest.raises(wb.InputError) as caught:
                wb.boundary(point, F0=(0.01, 0.1), eta=(-30.0, -20.0))
            assert caught.value.name == "point"

    @pytest.mark.parametrize(
        ("ranges", "name"),
        [
            ({}, "parameters"),
            ({"F0": (0.01, 0.1)}, "parameters"),
            ({"F0": (0.01, 0.1), "eta": (-30.0, -20.0), "f": (0.5, 0.7)}, "parameters"),
            ({"eta": (-30.0, -20.0), "f": (0.5, 0.7)}, "parameters"),
            ({"F0": (0.01, 0.1), "eta": (-30.0, -30.0)}, "eta"),
            ({"F0": (0.01, 0.1), "eta": (-30.0, math.nan)}, "eta"),
            ({"F0": (0.08, 0.1), "eta": (-30.0, -20.0)}, "F0"),
            ({"F0": (0.01, 0.1), "eta": (-20.0, -10.0)}, "eta"),
            ({"F0": (0.01, 0.1), "amplitude": (100.0, 9000.0)}, "F0"),
            ({"F0": (0.01, 0.1), "bogus": (1.0, 2.0)}, "bogus"),
            ({"F0": (0.01, 0.1), "eta": (-30.0, -20.0), "step": 0.0}, "step"),
            ({"F0": (0.01, 0.1), "eta": (-30.0, -20.0), "points": 1}, "points"),
        ],
    )
    def test_ranges(self, ranges, name) -> None:
        with pytest.raises(wb.InputError) as caught:
            wb.boundary(_start("switching-sliding"), **ranges)
        assert caught.value.name == name
        assert caught.value.allowed

    def test_the_second_range_holds_the_value_of_the_system(self) -> None:
        with pytest.raises(wb.InputError) as caught:
            wb.boundaries(WEDGE, F0=(0.067, 0.06), eta=(-20.0, -10.0))
        assert (caught.value.name, caught.value.value) == ("eta", (-20.0, -10.0))

    # A word is not a list of its letters.
    @pytest.mark.parametrize("kinds", [["doubling"], ["branch point"], [3], "fold", 3])
    def test_kinds(self, kinds) -> None:
        with pytest.raises(wb.InputError) as caught:
            wb.boundaries(WEDGE, kinds=kinds, F0=(0.01, 0.1), eta=(-30.0, -20.0))
        assert caught.value.name == "kinds"
        assert "fold" in caught.value.allowed


def test_onset_of_permanent_sticking_is_left_out() -> None:
    """No margin vanishes there; of the others there is a curve."""
    system = wb.paper.system(eta=-3.0, F0=0.09)
    ends = {"F0": (0.09, 0.12), "eta": (-10.0, 0.0)}
    with pytest.warns(UserWarning, match="permanent sticking"):
        found = wb.boundaries(system, switch=0, opposite=False, step=0.2, **ends)
    assert all(one.sizes["point"] > 1 for one in found)
    *_, onset = wb.continuation(wb.orbit(system), F0=(0.09, 0.12), step=0.2)
    assert "permanent sticking" in onset.bifurcation.effect
    assert not onset.can_be_followed
    with pytest.raises(wb.InputError, match="onset of permanent sticking"):
        wb.boundary(onset, **ends)


@pytest.mark.parametrize(
    ("friction", "crossing"),
    [(WEDGE.friction, True), (wb.SmoothedFriction(kinetic=0.3, steepness=100.0), False)],
)
def test_kinds_that_can_be_followed(friction, crossing) -> None:
    """Those of segments only where friction is set-valued."""
    problem = orbit_problem(WEDGE.replace(friction=friction))
    assert [problem.can_follow(kind) for kind in Kind if kind.of_friction] == [crossing] * 5
    assert problem.can_follow(Kind.SYMMETRY_BREAKING)
    assert problem.can_follow(Kind.FOLD)
    assert not problem.can_follow(Kind.BRANCH_POINT)


def test_second_parameter_is_that_of_the_point() -> None:
    """The stiffness changes the group f; the curve begins at the f that the point has."""
    system = wb.paper.system(eta=-10.0, F0=0.036)
    value = system.driveline.stiffness
    branch = wb.continuation(wb.orbit(system), stiffness=(value, 1.5 * value))
    point = next(one for one in branch if one.can_be_followed)
    curve = wb.boundary(point, points=2, stiffness=(0.5 * value, 2.0 * value), f=(0.2, 1.0))
    apart = np.hypot(
        curve["stiffness"].values / point.value - 1.0,
        curve["f"].values / point.system.groups.f - 1.0,
    )
    assert np.min(apart) < 1e-9


@pytest.mark.parametrize(("longest", "creeps"), [(1e-4, True), (0.05, False), (1.0, False)])
def test_steps_that_lead_almost_nowhere_are_noticed(longest, creeps) -> None:
    """200 steps of at most 1e-4 of the longest are 0.02 of it; at most 1/20, they are ten of it."""
    length = StepLength(0.02)

    def step() -> bool:
        if length.length > longest * length.longest:
            return False
        length.grow()
        return True

    for _ in range(199):
        assert length.attempt(step, 1e-5)
        assert not length.creeps
    # The first steps, before the last 200, do not count.
    for _ in range(200):
        assert length.attempt(step, 1e-5)
    assert length.creeps is creeps
