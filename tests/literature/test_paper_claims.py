"""The audit of Chen and Xi (2014): verdicts follow from the physics, and from nothing else."""

import json
from dataclasses import replace

import numpy as np
import pytest

import wedgebrake as wb
from wedgebrake.model.paper_machines import AS_PRINTED, CORRECTED, RESPONSES, Assumptions
from wedgebrake.paper.claims import Assertion, Statement, StatementVerdict, all_hold, examine
from wedgebrake.paper.identification import identify
from wedgebrake.paper.laboratory import Laboratory
from wedgebrake.paper.smoothing import compare
from wedgebrake.paper.statements import STATEMENTS

BY_NAME = {statement.name: statement for statement in STATEMENTS}


@pytest.fixture(scope="module")
def exact():
    with Laboratory("exact") as laboratory:
        yield laboratory


@pytest.fixture(scope="module")
def smooth():
    with Laboratory("smooth") as laboratory:
        yield laboratory


def test_responses_are_those_of_the_captions():
    """As printed below figures 6 to 19: each figure of the wedge, then the conventional brake."""
    f, alpha = ([getattr(case, name) for case in RESPONSES[n].cases]
                for n, name in ((15, "f"), (18, "alpha")))  # fmt: skip
    np.testing.assert_allclose(f, [0.31, 0.63, 1.0, 1.26, 2.07], atol=0.006)
    np.testing.assert_allclose(alpha, [0.68, 5.20], atol=0.01)
    assert sorted(RESPONSES) == [6, 7, 9, 10, 12, 13, 15, 16, 18]
    for number, rows in RESPONSES.items():
        assert {case.brake for case in rows.cases} == {
            "wedge" if number % 3 == 0 else "conventional"
        }
        wedge = RESPONSES[number - number % 3].cases
        assert [replace(case, brake="wedge") for case in rows.cases] == list(wedge)


@pytest.mark.parametrize("name", ["S1", "S2", "S3", "S5", "S6"])
def test_linear_statements_hold_as_printed(name, exact):
    """S4, which takes seconds, is in the whole audit."""
    assert examine(BY_NAME[name], exact).verdict is StatementVerdict.REPRODUCED


# The even diagrams are those of the conventional brake.
@pytest.mark.parametrize(
    "name",
    ["S7", "S8", "M2", "B1", "B3", "R2"]
    + [pytest.param(name, marks=pytest.mark.slow) for name in ("B2", "B4")],
)
def test_what_needs_a_correction_says_which(name, exact):
    found = examine(BY_NAME[name], exact)
    assert found.verdict is StatementVerdict.CORRECTED
    assert found.needed
    assert all_hold(found.printed) is False


DIAGRAMS = ("B1", "B2", "B3", "B4")


@pytest.mark.parametrize(
    ("changed", "names"),
    [
        (Assumptions(damping=1.0), DIAGRAMS),
        (Assumptions(damping=0.3), DIAGRAMS),
        (Assumptions(release=False), DIAGRAMS),
        (Assumptions(slope_on="interface"), DIAGRAMS),
        (AS_PRINTED, DIAGRAMS),
        (Assumptions(static=0.33), ("S7", "M2", "B1", "B3")),
    ],
)
def test_other_physics_flips_the_verdicts(changed, names, exact):
    coarse = exact.like(coarse=True)
    for name in names:
        assert BY_NAME[name].holds(coarse) is True
        assert BY_NAME[name].holds(coarse.like(assumptions=changed)) is False


def test_rest_for_good_beyond_the_width_of_the_holding_interval():
    """F_0 = mu_s (alpha^2 - 1)/alpha, from the two ends of the interval at rest.

    Just beyond it the slips only tend to nothing, with the square of their number.
    """
    system = wb.paper.system(eta=0.0)
    bound = 0.3 * (1.18**2 - 1.0) / 1.18
    for share, word in ((1.05, "at rest"), (0.97, "bidirectional stick-slip")):
        run = wb.simulate(system.replace(F0=share * bound), periods=250, times=())
        assert wb.sticks(run, 20.0).attrs["class"] == word


def test_the_smoothed_diagrams_reproduce(smooth):
    """By the paper's own law, in few columns; the whole audit is in the slow tests."""
    coarse = smooth.like(coarse=True)
    for name in ("B2", "B4"):
        assert BY_NAME[name].holds(coarse) is True


def made_up(answer):
    """A statement that holds where ``answer`` says so."""
    return Statement(
        "X1", "1", "says", "test", "tolerance",
        lambda lab, values: [Assertion("a", answer(lab.assumptions, values), "found")],
        {"value": 1}, {"value": 2}, "value = 2, not 1",
    )  # fmt: skip


@pytest.mark.parametrize(
    ("answer", "verdict", "needed"),
    [
        (lambda *_: True, StatementVerdict.REPRODUCED, ""),
        (lambda *_: False, StatementVerdict.CONTRADICTED, ""),
        (lambda *_: None, StatementVerdict.UNDECIDABLE, ""),
        (lambda a, _: a.damping < 0.5, StatementVerdict.CORRECTED, "c = 0.1 N m s/rad"),
        (lambda _, v: v["value"] == 2, StatementVerdict.CORRECTED, "value = 2, not 1"),
        (
            lambda a, v: v["value"] == 2 and a.static < 0.32,
            StatementVerdict.CORRECTED,
            "μ_s = 0.3; value = 2, not 1",
        ),
    ],
)
def test_verdicts_follow_from_the_parts(answer, verdict, needed, exact):
    found = examine(made_up(answer), exact)
    assert found.verdict is verdict
    assert found.needed == needed


def test_of_changes_that_each_suffice_one_is_named(exact):
    """Either a lower damping or the other value: the value is taken back first."""
    one = made_up(lambda a, v: a.damping < 0.5 or v["value"] == 2)
    assert examine(one, exact).needed == "c = 0.1 N m s/rad"


def test_a_finding_is_plain_for_json(exact):
    plain = examine(BY_NAME["S2"], exact).as_dict()
    assert json.loads(json.dumps(plain)) == plain
    assert (plain["id"], plain["verdict"]) == ("S2", "reproduced")
    assert plain["parts"][0]["holds"] is True


def test_a_false_part_outweighs_one_that_cannot_be_told():
    yes, no, open_ = (Assertion("a", holds, "") for holds in (True, False, None))
    assert all_hold([yes, yes]) is True
    assert all_hold([yes, open_]) is None
    assert all_hold([open_, no, yes]) is False


def test_identification_prefers_the_corrected_assumptions(exact):
    found = identify(exact, [Assumptions(damping=0.3), CORRECTED])
    assert found.rows[0].assumptions == CORRECTED
    assert found.rows[0].held > found.rows[1].held
    assert len(found.table()) == 2
    assert found.open_questions


@pytest.mark.slow
def test_the_whole_audit_by_the_paper_s_own_law(smooth):
    """B1 to B4 within the resolution of a printed diagram, the linear ones as printed."""
    found = {statement.name: examine(statement, smooth) for statement in STATEMENTS}
    for name in ("S1", "S2", "S3", "S4", "S5", "S6"):
        assert found[name].verdict is StatementVerdict.REPRODUCED
    for name in ("S7", "B1", "B2", "B3", "B4"):
        assert found[name].verdict is StatementVerdict.CORRECTED
    assert found["K1"].verdict is StatementVerdict.CONTRADICTED


@pytest.mark.slow
def test_smoothing_converges_to_the_exact_solution(smooth):
    found = compare(smooth)
    assert (found.errors[:, :-1] > found.errors[:, 1:]).all()
    for _, row, truth in found.limits:
        assert (abs(row[:-1] - truth) > abs(row[1:] - truth)).all()
        assert abs(row[-1] - truth) < 5e-4
    assert (found.creep[:-1] > found.creep[1:]).all()
