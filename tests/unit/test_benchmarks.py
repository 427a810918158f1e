"""The benchmarks' harness: the right truth, the right ratios, a word on what is missing."""

import sys
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parents[2] / "benchmarks"))
import ours
import pages
import scale_page
import table
import work
from peers import Answers, Peer, all_peers
from peers.brake import Brake
from reference_states import SMOOTHED

# Coulomb friction at 1 s and 25 s, known to 11 digits from 60-digit closed forms and, apart from
# those, an event-driven Taylor integrator.
COULOMB = {
    (-24.0, 0.036, 1.0): (-0.03384414089362339, 8.45587403257336),
    (-60.0, 0.036, 25.0): (-0.1060882107387432, 1.292165602053491),
    (0.0, 0.09, 25.0): (-0.005663424516747506, -0.8439873539054221),
}


class Told(Peer):
    """A peer that knows the state at the end but for an error of its own, and takes a second."""

    name, asked = "told", "nothing"

    def __init__(self, law, state, wrong, why=""):
        self.law, self.state, self.wrong, self.why = law, np.array(state), np.array(wrong), why
        self.asked_for = []

    def missing(self):
        return self.why

    def solve(self, brakes, until):
        self.asked_for.append(until)
        return Answers(np.array([self.state + self.wrong for _ in brakes]), 1.0)


def told(case, wrong=(0.0, 0.0), why=""):
    return Told(case.law, work.truth(case.system, case.compared), wrong, why)


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


def test_diagram_is_compared_with_its_own_points():
    states = ours.diagram_states("coulomb", None)
    for i in (0, 77, 199):
        machine = work.system("coulomb", float(work.ETAS[i]))
        expected = work.truth(machine, work.DIAGRAM_COMPARED)
        assert states[i] == pytest.approx(expected, rel=0.0, abs=1e-9)
    assert len(work.diagram("coulomb", 10)) == 20


def test_errors_and_ratios_of_a_case(monkeypatch):
    monkeypatch.setattr(table, "best", lambda run: (run(), 0.25)[1])
    case = brief("smoothed")
    peer = told(case, wrong=(3e-3, -0.5))
    rows = table.case_rows(case, [peer], periods=3)
    frequency = case.system.excitation.frequency
    assert peer.asked_for == pytest.approx([3 / frequency, 2 / frequency])
    row = rows[-1]
    assert row["error_angle"] == pytest.approx(3e-3)
    assert row["error_velocity"] == pytest.approx(0.5)
    assert row["ratio"] == pytest.approx(4.0)
    assert row["ratio_equal"] == pytest.approx(4.0)
    # Alone and in lanes at each tolerance; the reference is alone, at 1e-8.
    assert [place for place, one in enumerate(rows) if one["reference"]] == [2]
    assert [one.get("lanes", 1) > 1 for one in rows] == [False, True] * 4 + [False]
    assert all(one["error_velocity"] < 1e-4 for one in rows[:-1])


def test_fair_ratio_is_to_the_fastest_row_that_is_as_right():
    own = [
        {"own": True, "reference": rtol == 1e-8, "seconds": seconds, "error_velocity": error}
        for rtol, seconds, error in ((1e-6, 1.0, 1e-5), (1e-8, 2.0, 1e-7), (1e-10, 4.0, 1e-8))
    ]

    def ratio(error):
        other = {"own": False, "reference": False, "seconds": 8.0, "error_velocity": error}
        return table.compared([*own, other])[-1]["ratio_equal"]

    assert [ratio(error) for error in (1e-3, 1e-6, 5e-8, 1e-12)] == [8.0, 4.0, 2.0, 2.0]


def test_part_of_a_diagram_is_compared_on_its_own_points():
    own = {"own": True, "reference": True, "seconds": 1.0, "error_velocity": 0.1}
    better = {**own, "reference": False, "seconds": 2.0, "error_velocity": 0.1}
    rows = [{**own, "wrong": [1e-7, 0.1, 1e-7]}, {**better, "wrong": [1e-9, 0.1, 1e-9]}]
    other = {"own": False, "reference": False, "seconds": 8.0, "stride": 2}

    def ratio(error):
        return table.compared([*rows, {**other, "error_velocity": error}])[-1]["ratio_equal"]

    assert [ratio(error) for error in (1e-6, 1e-8)] == [8.0, 4.0]


def test_diagram_of_a_peer(monkeypatch):
    monkeypatch.setattr(table, "best", lambda _: 0.2)
    monkeypatch.setattr(ours, "bifurcation", lambda *_: None)
    peer = Told("coulomb", (0.0, 0.0), (0.0, 0.0))
    known = {peer.name + peer.asked: 1.0}
    row = table.diagram_rows("coulomb", [peer], known)[-1]
    assert (row["points"], row["stride"]) == (10, 20)
    assert row["seconds"] == pytest.approx(0.1)
    etas = work.ETAS[::20]
    expected = [abs(work.truth(work.system("coulomb", float(e)), 20)[1]) for e in etas]
    assert row["error_velocity"] == pytest.approx(max(expected))


def test_missing_peer_is_told(monkeypatch):
    monkeypatch.setattr(table, "CASES", (brief(),))
    monkeypatch.setattr(table, "best", lambda run: (run(), 0.25)[1])
    monkeypatch.setattr(table.auto, "missing", lambda: "gfortran is not installed")
    here, gone = told(brief(), (0.0, 2e-5)), told(brief(), why="not installed")
    gone.name = "gone"
    said = []
    found = table.measure([here, gone], quick=True, say=said.append)
    text = pages.whole(found)
    assert "gone: not installed." in text
    assert "AUTO-07p: gfortran is not installed." in text
    assert gone.asked_for == []
    assert "| told | nothing | 1 s | 1 | 4 × | 4 × | 2e-5 | 0 |" in text
    assert "gone: not installed." in pages.page(found, periods=250, points=200, force=0.036)


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


def test_overhead_of_a_chunk_is_read_off_a_line():
    rows = [{"points": n, "wall": 0.01 + 2e-4 * n} for n in (1, 64, 512, 4096)]
    assert scale_page.overhead(rows) == pytest.approx((0.01, 2e-4))


def test_time_of_the_great_map():
    chunk = scale_page.Chunk(points=1e4, chunks=10_000, work=1.9, overhead=0.1, client=0.01)
    assert chunk.most_cores == pytest.approx(200.0)
    assert chunk.wall(100) == (pytest.approx(200.0), "the points")
    assert chunk.wall(10_000) == (pytest.approx(100.0), "the client")


def test_growth_is_read_off_the_times():
    sizes = [62.0, 250.0, 1000.0, 4000.0]
    start, each, away = scale_page.line(sizes, [0.3 + 2e-3 * n for n in sizes])
    assert (start, each) == (pytest.approx(0.3), pytest.approx(2e-3))
    assert away < 1e-12
    found, error = scale_page.slope(sizes, [5.0 * n**1.5 for n in sizes])
    assert found == pytest.approx(1.5)
    assert error < 1e-9
