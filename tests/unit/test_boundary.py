"""A bifurcation followed in a second parameter, against the first one's and closed forms."""

from __future__ import annotations

import json

import numpy as np
import pytest

import wedgebrake as wb

WEDGE = wb.paper.system(eta=-24.0, F0=0.067)


def _branch(system: wb.BrakedDriveline, order: int = 1, **over) -> wb.Branch:
    branch = wb.continuation(wb.orbit(system, order), **over)
    for _ in branch:
        pass
    return branch


@pytest.fixture(scope="module")
def over_force() -> wb.Branch:
    """The orbit of one period over F0 at eta = -24."""
    return _branch(WEDGE, F0=(0.09, 0.035))


def _of(branch: wb.Branch, kind: str) -> wb.BranchPoint:
    return next(p for p in branch.bifurcations if p.bifurcation.kind.value == kind)


def _first(kind: str, over_force: wb.Branch):
    starts = {
        "period doubling": lambda: _of(_branch(WEDGE, F0=(0.06, 0.09)), kind),
        "switching-sliding": lambda: _of(over_force, kind),
        "grazing-sliding": lambda: _of(over_force, kind),
        "Neimark-Sacker": lambda: _of(
            _branch(wb.paper.system(eta=-10.0, F0=0.05, brake="conventional"), eta=(-10.0, -50.0)),
            kind,
        ),
    }
    return starts[kind]()


RANGES = {
    "period doubling": {"F0": (0.05, 0.1), "eta": (-28.0, -20.0)},
    "switching-sliding": {"F0": (0.05, 0.07), "eta": (-26.0, -22.0)},
    "grazing-sliding": {"F0": (0.05, 0.07), "eta": (-26.0, -22.0)},
    "Neimark-Sacker": {"eta": (-50.0, -10.0), "F0": (0.04, 0.06)},
}


@pytest.mark.parametrize("kind", RANGES)
def test_points_are_bifurcations_over_the_first_parameter(kind, over_force) -> None:
    """Found again, at the value that the boundary has there, to 1e-8 of the range."""
    start = _first(kind, over_force)
    found = wb.boundary(start, **RANGES[kind])
    assert found.attrs["kind"] == "boundary"
    assert found.attrs["bifurcation"] == kind
    assert found.sizes["point"] > 5
    own, second = RANGES[kind]
    brake = start.system.brake
    for k in (1, found.sizes["point"] // 2, found.sizes["point"] - 2):
        value, other = float(found[own][k]), float(found[second][k])
        system = start.system.replace(**{own: value, second: other}).replace(brake=brake)
        # From the orbit a little beside it.
        width = abs(RANGES[kind][own][1] - RANGES[kind][own][0])
        state = float(found.angle[k]), float(found.velocity[k])
        near = wb.orbit(system.replace(**{own: value + 3e-4 * width}), 1, initial=state)
        assert near.found
        branch = wb.continuation(near, step=1e-3, **{own: (value + 0.02 * width,
                                                          value - 0.02 * width)})  # fmt: skip
        values = [
            point.value
            for point in branch
            if point.bifurcation and point.bifurcation.kind.value == kind
        ]
        assert np.min(np.abs(np.array(values) - value)) <= 1e-8 * width


def test_multipliers_along_are_those_of_the_kind(over_force) -> None:
    doubling = wb.boundary(_first("period doubling", over_force), **RANGES["period doubling"])
    least = np.abs(doubling.multiplier_real.values + 1.0).min(axis=1)
    assert np.all(least <= 1e-8)
    torus = wb.boundary(_first("Neimark-Sacker", over_force), **RANGES["Neimark-Sacker"])
    moduli = np.hypot(torus.multiplier_real.values, torus.multiplier_imag.values)
    np.testing.assert_allclose(moduli, 1.0, atol=1e-8)


def test_dataset(over_force) -> None:
    start = _first("switching-sliding", over_force)
    found = wb.boundary(start, **RANGES["switching-sliding"])
    assert set(found.sizes) == {"point", "multiplier"}
    assert found.attrs["parameters"] == ["F0", "eta"]
    for name, (low, high) in RANGES["switching-sliding"].items():
        assert "units" in found[name].attrs
        assert "long_name" in found[name].attrs
        assert found[name].dtype == float
        values = found[name].values
        assert np.all((values >= low) & (values <= high))
    assert found.attrs["begin"].startswith("left the range of")
    assert found.attrs["end"].startswith("left the range of")
    assert json.loads(found.attrs["system"]) == start.problem.base.as_dict()
    # The curve goes through the point that it was begun from.
    at = np.argmin(np.abs(found.eta.values + 24.0))
    assert float(found.F0[at]) == pytest.approx(start.value, abs=1e-9)


def test_steps_are_no_longer_than_asked(over_force) -> None:
    start = _first("switching-sliding", over_force)
    ranges = RANGES["switching-sliding"]
    found = wb.boundary(start, step=0.01, **ranges)
    parts = [np.diff(found[n].values) / (ranges[n][1] - ranges[n][0]) for n in ranges]
    assert np.all(np.hypot(*parts) <= 0.0101)
    assert wb.boundary(start, points=3, **ranges).sizes["point"] <= 7


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
        return (
            omega
            * s.excitation.amplitude
            / abs(line.stiffness - line.inertia * omega**2 + 1j * line.damping * omega)
        )

    reach = amplitude(system) / 10.0
    branch = _branch(system, amplitude=(300.0, 600.0 / reach))
    grazes = [p for p in branch.bifurcations if p.bifurcation.kind.value == "grazing"]
    assert grazes[0].value == pytest.approx(300.0 / reach, rel=1e-9)
    second = {"amplitude": (300.0, 600.0 / reach), "damping": (5.0, 60.0)}
    found = wb.boundary(grazes[0], **second)
    assert found.sizes["point"] > 10
    for one, other in zip(found.amplitude.values, found.damping.values, strict=True):
        assert amplitude(system.replace(amplitude=float(one), damping=float(other))) == (
            pytest.approx(10.0, rel=1e-8)
        )
    np.testing.assert_allclose(found.damping.values[[0, -1]].min(), 5.0, atol=0.5)


class TestNothingTwice:
    """A curve ends where it would go back over its own points."""

    def test_torus_of_2t_ends_where_the_synchronous_orbit_is_at_its_resonance(self) -> None:
        """There the halves of the 2T orbit meet; both multipliers of the synchronous one are -1.

        Beyond, they change places: the same orbits, half of each later.
        """
        system = wb.paper.system(eta=-18.0, F0=0.036)
        start = _of(_branch(system, 2, eta=(-18.0, -22.0)), "Neimark-Sacker")
        begins = []
        for step in (0.02, 0.005):
            found = wb.boundary(start, step=step, eta=(-22.0, -10.0), F0=(0.03, 0.06))
            assert found.attrs["begin"] == "period doubling of the synchronous orbit"
            assert found.attrs["end"] == "left the range of eta"
            assert np.all(np.diff(found.eta.values) < 0.0)
            begins.append((float(found.eta[0]), float(found.F0[0])))
        np.testing.assert_allclose(*begins, rtol=1e-6)
        eta, force = begins[0]
        # As section 13 of the theory says.
        assert (eta, force) == pytest.approx((-18.0458, 0.0306961), rel=3e-6)
        state = float(found.angle[0]), float(found.velocity[0])
        first = wb.orbit(wb.paper.system(eta=eta, F0=force), 1, initial=state)
        one, other = first.multipliers
        assert (one * other).real == pytest.approx(1.0, abs=1e-5)
        assert (one + other).real == pytest.approx(-2.0, abs=1e-5)

    @pytest.mark.parametrize("points", [2000, 40])
    def test_a_closed_curve_is_gone_round_once(self, points) -> None:
        """Also where neither half of it is the whole: around a small region of doubled motion."""
        system = wb.BrakedDriveline(
            driveline=wb.Driveline(inertia=1.0, damping=0.15, stiffness=1e4, drive_speed=0.65),
            brake=wb.WedgeBrake(radius=0.2, angle=0.5324),
            friction=wb.CoulombFriction(kinetic=0.3147),
            actuation=wb.Actuation(initial_force=300.0, slope=-15.2, release=False),
            excitation=wb.HarmonicTorque(amplitude=1005.0, frequency=6.8),
        )
        start = _of(_branch(system.replace(f=0.41), f=(0.41, 0.38)), "period doubling")
        ends = {"f": (0.3, 0.5), "drive_speed": (0.05, 3.0)}
        found = wb.boundary(start, points=points, **ends)
        assert "the curve has closed" in (found.attrs["begin"], found.attrs["end"])
        places = np.column_stack([(found[n].values / (b - a)) for n, (a, b) in ends.items()])
        np.testing.assert_allclose(places[0], places[-1], atol=1e-6)
        # About a point within, the angles add up to one turn.
        inner = places[1:-1].mean(axis=0)
        turns = np.unwrap(np.arctan2(*(places - inner).T))
        assert abs(turns[-1] - turns[0]) == pytest.approx(2.0 * np.pi, abs=1e-3)


class TestBoundaries:
    def test_each_is_a_bifurcation_of_the_first_parameter(self) -> None:
        system = wb.paper.system(eta=-24.0, F0=0.067)
        every = wb.boundaries(
            system, kinds=["period doubling"], order=1, switch=0, points=40,
            F0=(0.09, 0.06), eta=(-26.0, -22.0),
        )  # fmt: skip
        assert len(every) == 1
        at = np.argmin(np.abs(every[0].eta.values + 24.0))
        # 0.07467646 is where wb.continuation finds it; both sides of it by multipliers here.
        value = float(every[0].F0[at])
        below, above = (
            wb.orbit(system.replace(F0=value + side), 1).multipliers[0].real + 1.0
            for side in (-1e-6, 1e-6)
        )
        assert below * above < 0.0

    def test_none(self) -> None:
        assert (
            wb.boundaries(WEDGE, kinds=["fold"], order=1, switch=0, F0=(0.068, 0.066),
                          eta=(-26.0, -22.0))
            == []
        )  # fmt: skip


class TestArguments:
    def test_no_bifurcation(self, over_force) -> None:
        with pytest.raises(wb.InputError, match="must be a bifurcation"):
            wb.boundary(over_force.points[0], F0=(0.01, 0.1), eta=(-30.0, -20.0))
        with pytest.raises(wb.InputError, match="must be a bifurcation"):
            wb.boundary(3, F0=(0.01, 0.1), eta=(-30.0, -20.0))

    def test_own_parameter_is_missing(self, over_force) -> None:
        with pytest.raises(wb.InputError, match="must hold F0"):
            wb.boundary(over_force.bifurcations[0], eta=(-30.0, -20.0), f=(0.5, 0.7))

    @pytest.mark.parametrize(
        ("ranges", "words"),
        [
            ({"F0": (0.01, 0.1)}, "two parameters"),
            ({"F0": (0.01, 0.1), "eta": (-30.0, -20.0), "f": (0.5, 0.7)}, "two parameters"),
            ({"F0": (0.01, 0.1), "eta": (-30.0, -30.0)}, "ends are equal"),
            ({"F0": (0.08, 0.1), "eta": (-30.0, -20.0)}, "F0 = .* must contain"),
            ({"F0": (0.01, 0.1), "eta": (-20.0, -10.0)}, "eta = .* must contain"),
            ({"F0": (0.01, 0.1), "amplitude": (100.0, 9000.0)}, "sets amplitude"),
            ({"F0": (0.01, 0.1), "bogus": (1.0, 2.0)}, "bogus"),
        ],
    )
    def test_ranges(self, over_force, ranges, words) -> None:
        with pytest.raises(wb.InputError, match=words):
            wb.boundary(over_force.bifurcations[0], **ranges)

    def test_kinds(self) -> None:
        with pytest.raises(wb.InputError, match="period doubling"):
            wb.boundaries(WEDGE, kinds=["doubling"], F0=(0.01, 0.1), eta=(-30.0, -20.0))

    def test_kinds_as_one_word(self) -> None:
        """A word is not a list of its letters."""
        with pytest.raises(wb.InputError, match=r"'fold'|list|collection"):
            wb.boundaries(WEDGE, kinds="fold", F0=(0.01, 0.1), eta=(-30.0, -20.0))


def test_onset_of_permanent_sticking_is_left_out() -> None:
    """It is no end of a chain; of the others there is a curve."""
    system = wb.paper.system(eta=-3.0, F0=0.09)
    ends = {"F0": (0.09, 0.12), "eta": (-10.0, 0.0)}
    found = wb.boundaries(system, switch=0, opposite=False, **ends)
    assert all(one.sizes["point"] > 1 for one in found)
    branch = wb.continuation(wb.orbit(system), F0=(0.09, 0.12))
    onset = list(branch)[-1]
    assert "permanent sticking" in onset.bifurcation.effect
    assert not onset.can_be_followed
    with pytest.raises(
        wb.InputError, match="onset of permanent sticking, which cannot be followed"
    ):
        wb.boundary(onset, **ends)


def test_second_parameter_is_that_of_the_point() -> None:
    """The stiffness changes the group f; the curve begins at the f that the point has."""
    system = wb.paper.system(eta=-10.0, F0=0.036)
    value = system.driveline.stiffness
    branch = wb.continuation(wb.orbit(system), stiffness=(value, 1.5 * value))
    point = next(one for one in branch if one.can_be_followed)
    curve = wb.boundary(point, stiffness=(0.5 * value, 2.0 * value), f=(0.2, 1.0))
    apart = np.hypot(
        curve["stiffness"].values / point.value - 1.0,
        curve["f"].values / point.system.groups.f - 1.0,
    )
    assert np.min(apart) < 1e-9
