"""``wb.motion`` of 200 random machines against the judge of long runs."""

from __future__ import annotations

import math
from collections import Counter
from typing import Any

import pytest

import wedgebrake as wb

from .judge import judge
from .systems import cases, machine_of

TRUTH = cases()
REPEATS = ("limit cycle", "synchronous", "periodic")
# Of each class, those that the judge knew first.
_OF_EACH = 6
QUICK = [
    case
    for kind in sorted(
        {case["motion"] for case in TRUTH} - {"chaotic", "quasi-periodic", "unknown"}
    )
    for case in sorted(
        (one for one in TRUTH if one["motion"] == kind), key=lambda one: one["units"]
    )[:_OF_EACH]
]


def number(case: dict[str, Any]) -> str:
    return f"{case['number']} {case['motion']}"


def agrees(case: dict[str, Any], found: wb.Motion) -> bool:
    """Whether class, order, period and sticks are those of the judge."""
    if found.kind != case["motion"]:
        return False
    if found.kind not in REPEATS:
        return True
    same = found.self_excited or found.order == case["order"]
    sticks = any(one.stick_class != "non-stick-slip" for one in found.contacts)
    return same and sticks == case["sticks"]


@pytest.mark.parametrize("case", QUICK, ids=number)
def test_motion_is_that_of_a_long_run(case) -> None:
    found = wb.motion(machine_of(case))
    assert agrees(case, found), found.verdict
    if found.kind in REPEATS:
        assert found.period == pytest.approx(case["period"], rel=1e-9)


@pytest.mark.parametrize("case", QUICK[::9], ids=number)
def test_judge_repeats_itself(case) -> None:
    now = judge(machine_of(case))
    assert (now.motion, now.order, now.sticks) == (case["motion"], case["order"], case["sticks"])


def test_table_holds_every_class() -> None:
    """Of 200 machines, half of which have no signal that varies."""
    assert len(TRUTH) == 200
    counts = Counter(case["motion"] for case in TRUTH)
    assert counts["unknown"] <= 8
    for kind in ("steady sliding", "limit cycle", "quasi-periodic", "synchronous", "at rest"):
        assert counts[kind] > 4, counts
    assert {"periodic", "chaotic", "self-locked"} <= set(counts)
    assert sum(machine_of(case).autonomous for case in TRUTH) == 100


@pytest.mark.slow
def test_all_motions() -> None:
    """No wrong class; undecided at most one in fifty of those that the judge knows."""
    table: Counter[tuple[str, str]] = Counter()
    wrong = []
    for case in TRUTH:
        if case["motion"] == "unknown":
            continue
        found = wb.motion(machine_of(case))
        table[case["motion"], found.kind] += 1
        if found.settled and not agrees(case, found):
            wrong.append((case["number"], case["motion"], case["order"], found.verdict))
        if found.kind in REPEATS:
            assert found.period == pytest.approx(case["period"], rel=1e-9), case["number"]
        if found.kind == "chaotic" == case["motion"]:
            error = math.hypot(case["error"], found.exponent_error)
            assert abs(found.largest_exponent - case["exponent"]) < 4.0 * error, case["number"]
    assert not wrong, wrong
    assert sum(count for (_, kind), count in table.items() if kind == "undecided") <= 4, table
