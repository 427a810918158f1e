"""The state: every edit gives a new one, or a sentence that says what is wrong."""

import pytest
from states import new_state

import wedgebrake as wb
from wedgebrake.explorer.core.limits import MOST_PERIODS
from wedgebrake.explorer.core.state import PageState
from wedgebrake.model.brakes import Brake


@pytest.fixture
def state():
    return new_state(wb.paper.system())


def study(system, **run):
    return wb.Study(system, wb.load_study("examples/paper.toml").run).changed(**run)


def test_an_edit_leaves_the_old_state_as_it_was(state):
    other = state.edited(eta=-30.0)
    assert state.system.groups.eta == -24.0
    assert other.system == state.system.replace(eta=-30.0)
    # A whole number from a browser is a number.
    assert state.edited(eta=-30).system == other.system
    assert state.edited(stiffness=10000).system == state.system


@pytest.mark.parametrize("name", ["inertia", "slope", "eta", "frequency", "f", "radius", "angle"])
def test_values_are_those_of_replace(state, name):
    value = state.value(name) * 1.25
    other = state.edited(**{name: value})
    assert other.value(name) == value
    assert other.system == state.system.replace(**{name: value})


def test_every_kind_of_brake_and_back(state):
    state = state.edited(angle=0.5, radius=0.3)
    there = state
    for kind in Brake.kinds:
        there = there.edited(brake=kind)
        assert there.value("brake") == kind
        assert there.value("radius") == 0.3
    assert there.edited(brake="wedge").system == state.system


def test_coefficients_move_from_law_to_law(state):
    state = state.edited(kinetic=0.25, static=0.3)
    smooth = state.edited(friction="smoothed")
    assert (smooth.value("kinetic"), smooth.value("static")) == (0.25, 0.3)
    changed = smooth.edited(kinetic=0.2, steepness=50.0)
    back = changed.edited(friction="coulomb")
    assert back.system.friction == wb.CoulombFriction(kinetic=0.2, static=0.3)
    assert back.edited(friction="smoothed").value("steepness") == 50.0


def test_a_table_begins_from_a_constant_and_is_kept(state):
    table = state.edited(friction="tabulated")
    assert table.system.friction.coefficients[-1] == pytest.approx(0.3)
    assert table.system.friction.coefficients[0] > 0.3
    own = table.edited(speeds=[0.0, 0.5], coefficients=[0.4, 0.2], static=0.5)
    there = own.edited(friction="coulomb")
    assert there.system == state.system
    assert there.edited(friction="tabulated").system == own.system
    # The largest coefficient makes a table too.
    most = state.edited(brake="conventional", kinetic=5.0)
    assert most.edited(friction="tabulated").value("static") == 5.0


def test_a_solver_that_does_not_fit_the_new_law_is_not_kept():
    state = PageState.of(study(wb.paper.system(), method="exact"))
    assert state.edited(friction="smoothed").study.run.method is None


def test_static_friction_follows_where_it_must(state):
    assert state.edited(kinetic=0.2).value("static") == 0.2
    peak = state.edited(static=0.36)
    assert peak.edited(kinetic=0.31).value("static") == 0.36
    assert peak.edited(kinetic=0.4).value("static") == 0.4


def test_static_friction_returns_with_kinetic_friction(state):
    peak = state.edited(kinetic=0.35, static=0.4)
    raised = peak.edited(kinetic=0.5)
    assert (raised.value("kinetic"), raised.value("static")) == (0.5, 0.5)
    assert raised.edited(kinetic=0.6).edited(kinetic=0.35).system == peak.system
    assert raised.edited(kinetic=0.45).edited(kinetic=0.35).system == peak.system
    # Other edits keep it; a value that is set replaces it.
    other = raised.edited(eta=-3.0).edited(friction="smoothed").edited(friction="coulomb")
    assert other.edited(kinetic=0.35).value("static") == 0.4
    assert raised.edited(static=0.55).edited(kinetic=0.35).value("static") == 0.55


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"eta": "x"}, "groups.eta = 'x'"),
        ({"inertia": -1.0}, "driveline.inertia = -1.0: must be greater than 0"),
        ({"static": 0.1}, "friction.static = 0.1: must be at least"),
        ({"nonsense": 1}, "nonsense: cannot be edited"),
        ({"brake": "wegde"}, "Did you mean 'wedge'"),
        ({"periods": 10**9}, f"20 to {MOST_PERIODS}"),
        ({"comparison": 1}, "comparison = 1: must be true or false"),
        ({"quantity": {}}, "quantity = {}"),
        ({"spans": 3}, "spans = 3"),
        ({"spans": {"eta": [float("-inf"), 1]}}, "eta, from = -inf"),
        ({"spans": {"eta": [2, 1]}}, "eta from 2 to 1"),
    ],
)
def test_wrong_edits_are_refused_with_words(state, changes, words):
    with pytest.raises(wb.InputError) as refused:
        state.edited(**changes)
    assert words in str(refused.value)


def test_a_run_in_seconds_is_counted_in_periods():
    assert PageState.of(study(wb.paper.system(f=0.63), duration=25.0)).periods == 251
    exact = wb.paper.system().replace(frequency=10.0)
    for duration, periods in ((25.0, 250), (1e6, MOST_PERIODS), (0.0, 20)):
        assert PageState.of(study(exact, duration=duration)).periods == periods
