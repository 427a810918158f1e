"""Orbits of the smoothed brake against AUTO-07p: where they bifurcate, and their states.

AUTO finds orbits by collocation, the package by integration: nothing is shared but the
system's numbers.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import auto_peer
import numpy as np
import pytest

import wedgebrake as wb

pytestmark = pytest.mark.peers

KINDS = {"PD": "period doubling", "TR": "Neimark-Sacker", "LP": "fold", "BP": "branch point"}


class Case(NamedTuple):
    """A branch of orbits of some order, from ``begin`` to ``end`` of a parameter."""

    system: wb.BrakedDriveline
    name: str
    begin: float
    end: float
    order: int
    step: float  # of AUTO, the longest
    bifurcations: tuple[str, ...]  # that AUTO finds on it

    def auto(self, *wanted: float) -> auto_peer.Branch:
        """The branch from AUTO, with the orbits at ``wanted``."""
        system = self.at(self.begin)
        order, step = self.order, self.step
        return auto_peer.branch(system, self.name, self.end, order=order, step=step, wanted=wanted)

    def at(self, value: float) -> wb.BrakedDriveline:
        return self.system.replace(**{self.name: value})


WEDGE = wb.paper.system(f=0.63, F0=0.036, alpha=1.18, brake="wedge", friction="smoothed")
PLAIN = wb.paper.system(f=0.63, F0=0.036, brake="conventional", friction="smoothed")
CASES = {
    "wedge, slope": Case(WEDGE, "eta", -10.0, -22.0, 1, 0.5, ("PD",)),
    "wedge, force": Case(WEDGE.replace(eta=-24.0), "F0", 0.09, 0.05, 1, 0.2, ("PD",)),
    "wedge, force, 2T": Case(WEDGE.replace(eta=-24.0), "F0", 0.065, 0.05, 2, 0.2, ("PD",)),
    "conventional, slope": Case(PLAIN, "eta", -10.0, -25.0, 1, 0.5, ("TR",)),
    "conventional, force": Case(PLAIN.replace(eta=-24.0), "F0", 0.06, 0.036, 1, 0.2, ("TR",)),
}


@pytest.fixture(scope="module", params=CASES)
def case(request: pytest.FixtureRequest) -> Case:
    if reason := auto_peer.missing():
        pytest.skip(reason)
    return CASES[request.param]


@pytest.fixture(scope="module")
def peer(case: Case) -> auto_peer.Branch:
    return case.auto(*np.linspace(case.begin, case.end, 5)[1:-1])


def periods(system: wb.BrakedDriveline, state: Any, order: int) -> np.ndarray:
    """(order + 1, 2) states at whole periods of the torque, by the smooth solver."""
    made = wb.simulate(
        system, periods=order, initial=(float(state[0]), float(state[1])), method="smooth",
        rtol=1e-12, samples_per_period=1,
    )  # fmt: skip
    return np.column_stack([made.angle, made.velocity])


def multipliers(system: wb.BrakedDriveline, orbit: auto_peer.Orbit, order: int) -> np.ndarray:
    """Of the map over ``order`` periods, by central differences."""
    sides = [
        [periods(system, orbit.states[0] + sign * step, order)[-1] for sign in (1.0, -1.0)]
        for step in np.diag(1e-5 * orbit.peaks)
    ]
    columns = [up - down for up, down in sides] / (2e-5 * orbit.peaks)[:, None]
    return np.linalg.eigvals(np.transpose(columns))


def test_auto_finds_the_bifurcations_of_the_case(case, peer):
    """And no other, so that the comparisons below compare something."""
    found = [orbit.kind for orbit in peer.of("PD", "TR", "LP", "BP")]
    assert tuple(found) == case.bifurcations


def test_smooth_solver_follows_the_orbits_of_auto(case, peer):
    """From AUTO's state at phase 0, through its states at whole periods, and back."""
    for orbit in peer.of("PD", "TR", "UZ"):
        made = periods(case.at(orbit.value), orbit.states[0], case.order)
        wanted = np.vstack([orbit.states, orbit.states[0]])
        np.testing.assert_allclose(made / orbit.peaks, wanted / orbit.peaks, rtol=0.0, atol=1e-6)


def test_smooth_solver_has_the_multipliers_of_auto(case, peer):
    """At AUTO's bifurcations they lie on the unit circle; AUTO prints six digits."""
    for orbit in peer.of("PD", "TR", "UZ"):
        made = multipliers(case.at(orbit.value), orbit, case.order)
        assert np.sort_complex(made) == pytest.approx(
            np.sort_complex(orbit.multipliers), rel=0.0, abs=1e-4
        )


def test_orbits_bifurcate_where_auto_says(case, peer):
    """Kinds in order along the branch, and the parameter to 1e-4 of itself."""
    start = wb.orbit(case.at(case.begin), case.order, method="smooth")
    branch = wb.continuation(start, **{case.name: (case.begin, case.end)})
    found = [point for point in branch if point.bifurcation]
    wanted = peer.of(*KINDS)
    assert [point.bifurcation.kind.value for point in found] == [KINDS[one.kind] for one in wanted]
    values = [orbit.value for orbit in wanted]
    np.testing.assert_allclose([point.value for point in found], values, rtol=1e-4)


def test_orbits_are_those_of_auto_at_equal_parameter(case, peer):
    """States at whole periods to 1e-4 of the amplitude, and the multipliers, of three points."""
    *orbits, _end = peer.of("UZ")
    assert len(orbits) == 3
    for orbit in orbits:
        found = wb.orbit(case.at(orbit.value), case.order, initial=tuple(orbit.states[0]))
        assert found.found
        # Either program may begin at any of the orbit's periods.
        away = [
            np.abs((np.roll(found.points, shift, axis=0) - orbit.states) / orbit.peaks).max()
            for shift in range(case.order)
        ]
        assert min(away) < 1e-4
        assert np.sort_complex(found.multipliers) == pytest.approx(
            np.sort_complex(orbit.multipliers), rel=0.0, abs=1e-4
        )
