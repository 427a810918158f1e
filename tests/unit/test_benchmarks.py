"""The benchmarks' harness: the right truth, the right ratios, a word on what is missing."""

import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parents[2] / "benchmarks"))
import ours
import work
from peers import all_peers
from peers.brake import Brake
from reference_states import SMOOTHED

# Coulomb friction at 1 s and 25 s, known to 11 digits from 60-digit closed forms and, apart from
# those, an event-driven Taylor integrator.
COULOMB = {
    (-24.0, 0.036, 1.0): (-0.03384414089362339, 8.45587403257336),
    (-60.0, 0.036, 25.0): (-0.1060882107387432, 1.292165602053491),
    (0.0, 0.09, 25.0): (-0.005663424516747506, -0.8439873539054221),
}


def brief(law="coulomb", compared=2):
    return work.Case(law, -24.0, 0.036, compared)


@pytest.mark.parametrize("at", COULOMB)
def test_truth_of_coulomb_friction(at):
    eta, force, seconds = at
    machine = work.system("coulomb", eta, force)
    found = work.truth(machine, seconds * machine.excitation.frequency)
    assert found == pytest.approx(COULOMB[at], rel=0.0, abs=1e-9)


@pytest.mark.parametrize("pair", SMOOTHED)
def test_truth_of_smoothed_friction(pair):
    machine = work.system("smoothed", *pair)
    found = work.truth(machine, 5.0 * machine.excitation.frequency)
    assert found == pytest.approx(SMOOTHED[pair][5.0], rel=0.0, abs=1e-9)


@pytest.mark.peers
@pytest.mark.parametrize("case", work.CASES, ids=lambda case: f"{case.law} {case.words}")
def test_truth_where_cases_are_compared_is_that_of_an_independent_integrator(case):
    heyoka_events = pytest.importorskip("peers.heyoka_events")
    tolerance = 1e-15 if case.law == "coulomb" else 1e-12
    peer = heyoka_events.HeyokaEvents(case.law, tolerance)
    if peer.missing():
        pytest.skip("heyoka is not installed")
    answers = peer.solve([Brake.of(case.system)], work.duration(case.system, case.compared))
    assert answers.states[0] == pytest.approx(
        work.truth(case.system, case.compared), rel=0.0, abs=1e-9
    )


@pytest.mark.parametrize("law", ours.TOLERANCES)
def test_kernels_that_are_timed_give_the_truth(law):
    case = brief(law)
    for rtol in ours.TOLERANCES[law]:
        state = ours.kernel(case.system, rtol, case.compared)()
        allowed = 1e-12 if rtol is None else 100.0 * rtol
        assert state == pytest.approx(work.truth(case.system, case.compared), rel=0, abs=allowed)


@pytest.mark.peers
@pytest.mark.parametrize(
    "peer", all_peers(), ids=lambda peer: f"{peer.name} {peer.asked} {peer.law}"
)
def test_peer_follows_the_brake(peer):
    """Two periods of a motion that reverses and sticks: to 1e-5, or to first order in a step."""
    if why := peer.missing():
        pytest.skip(why)
    case = brief(peer.law)
    brakes = work.neighbours(case, peer.lanes)
    answers = peer.solve(brakes, work.duration(case.system, case.compared))
    expected = work.truth(case.system, case.compared)
    allowed = 300.0 * getattr(peer, "step", 0.0) if peer.name.startswith("Siconos") else 1e-5
    assert answers.states.shape == (peer.lanes, 2)
    assert answers.seconds > 0.0
    assert answers.states[0] == pytest.approx(expected, rel=0.0, abs=allowed)
