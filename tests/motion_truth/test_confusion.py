"""``wb.motion`` against the slow judge: 200 random systems and the named ones."""

from __future__ import annotations

import math
from collections import Counter
from functools import cache

import pytest

import wedgebrake as wb

from .systems import cases, from_tables

TRUTH = cases()
RANDOM = [one for one in TRUTH if one["group"] == "random"]
NAMED = [one for one in TRUTH if one["group"] != "random"]

# What 20 000 periods cannot show, and why.
BEYOND = {
    "linear, resonance": "grows in proportion to time, and never by a factor that is divergence",
    "creeps to rest": "comes to rest as one over time",
    "coexisting 10a": "the same",
    "torus that locks 1": "repeats after 656 periods, more than are looked for",
    "torus that locks 2": "repeats after 12 817 periods",
}


BY_NAME = {one["name"]: one for one in TRUTH}


@cache
def found(name: str) -> wb.Motion:
    one = BY_NAME[name]
    return wb.motion(from_tables(one["system"]), initial=tuple(one["initial"]))


def _agree(truth, motion) -> bool:
    same = motion.kind == truth["motion"]
    return same and (motion.order == truth["order"] or not motion.order)


@pytest.mark.parametrize("step", [4, pytest.param(1, marks=pytest.mark.slow)])
def test_random_systems(step) -> None:
    """No wrong class; undecided at most one in fifty."""
    assert len(RANDOM) == 200
    table = Counter((one["motion"], found(one["name"]).kind) for one in RANDOM[::step])
    wrong = [
        (one["name"], one["motion"], one["order"], found(one["name"]).verdict)
        for one in RANDOM[::step]
        if not _agree(one, found(one["name"])) and found(one["name"]).settled
    ]
    assert not wrong, wrong
    undecided = sum(n for (truth, kind), n in table.items() if kind == "undecided" != truth)
    assert undecided <= 4 / step, table
    # The table means something: every class is among them.
    assert {"synchronous", "periodic", "quasi-periodic", "chaotic", "at rest"} <= {
        truth for truth, _ in table
    }


@pytest.mark.parametrize("truth", NAMED, ids=lambda one: one["name"])
def test_named_system(truth) -> None:
    motion = found(truth["name"])
    assert _agree(truth, motion) != (truth["name"] in BEYOND), motion.verdict


@pytest.mark.parametrize(
    "truth", [one for one in TRUTH if one["motion"] == "chaotic"], ids=lambda one: one["name"]
)
def test_exponent_of_chaos_is_that_of_parting_trajectories(truth) -> None:
    motion = found(truth["name"])
    error = math.hypot(truth["error"], motion.exponent_error)
    assert abs(motion.largest_exponent - truth["exponent"]) < 4.0 * error
