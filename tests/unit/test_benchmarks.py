"""The benchmarks' harness: the right truth, the right ratios, a word on what is missing."""

import sys
from pathlib import Path

import numpy as np
import pytest

import wedgebrake as wb

# At the end of the path, since files of tests/ and of benchmarks/ have the same names.
sys.path.append(str(Path(__file__).parents[2] / "benchmarks"))
import harmonics
import ours
import work
from peers import all_peers, heyoka_machine, moreau
from peers.brake import Brake
from peers.harmonic_balance import HarmonicBalance
from reference_states import SMOOTHED

STUDIES = Path(work.__file__).parent / "machines"

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


@pytest.mark.peers
@pytest.mark.parametrize("name", ["coupled_clutches", "four_inertias", "paper", "controller"])
def test_machine_is_that_of_an_independent_integrator(name):
    """heyoka finds the same sticks, slips and reversals, and the same final state."""
    study = wb.load_study(STUDIES / f"{name}.toml")
    duration = study.run.duration
    model = heyoka_machine.Model(study.system, duration)
    if why := model.missing():
        pytest.skip(why)
    motion = model.run()
    response = wb.simulate(study.system, duration, times=[duration])
    kinds = response.event_kind.attrs
    kind = dict(zip(kinds["flag_meanings"].split(), kinds["flag_values"], strict=True))
    changes = response.isel(event=(response.event_kind != kind["breakpoint"]).values)
    times, contacts, sides = np.array([one for one in motion.events if one[0] > 0.0]).T
    assert contacts.tolist() == changes.event_contact.values.tolist()
    assert sides.tolist() == changes.event_after.values.tolist()
    assert times == pytest.approx(changes.event_time.values, rel=0.0, abs=1e-12)
    state = np.concatenate([response.angle[0], response.velocity[0]])
    assert motion.state == pytest.approx(state, rel=0.0, abs=1e-10)


@pytest.mark.peers
def test_machine_is_that_of_time_stepping_to_first_order():
    """The error of the final speeds decreases with the step of Siconos."""
    study = wb.load_study(STUDIES / "coupled_clutches.toml")
    duration = study.run.duration
    final = wb.simulate(study.system, duration, times=[duration]).velocity.values[0]
    for step in (1e-3, 1e-4):
        peer = moreau.Siconos(step)
        if why := peer.missing():
            pytest.skip(why)
        speeds = peer.follow(study.system, duration).states[0, final.size :]
        assert speeds == pytest.approx(final, rel=0.0, abs=step)


def test_harmonic_balance_converges_to_the_exact_orbits():
    """Errors of the amplitude and of the share of sticking fall with more harmonics."""
    exact, errors = wb.orbit(harmonics.MACHINE.replace({"engine-torque.frequency": 7.0})), []
    for count in (5, 65):
        solver = HarmonicBalance(harmonics.MACHINE, count)
        assert solver.solve(7.0)
        apart = solver.amplitudes(7.0).max() / exact.angle_amplitude - 1.0
        errors.append(np.abs([apart, solver.sticking() - exact.stick_share]))
    assert np.all(errors[1] < 0.1 * errors[0])
    assert errors[1][0] < 1e-3
