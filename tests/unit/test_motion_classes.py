"""The table of classes of motion, which reports, pictures and the explorer read."""

from __future__ import annotations

import pickle

import pytest

from wedgebrake.dynamics.enums import MotionClass
from wedgebrake.explorer.core.class_texts import text_of
from wedgebrake.figures.data.class_styles import MOTION_STYLES
from wedgebrake.sweeps.results import NO_ATTRACTOR

# Values that are written to results and stores.
STORED = {
    "NONE": -1, "UNDECIDED": 0, "AT_REST": 1, "SYNCHRONOUS": 2, "PERIODIC": 3,
    "QUASI_PERIODIC": 4, "CHAOTIC": 5, "DIVERGED": 6, "SELF_LOCKED": 7, "STEADY_SLIDING": 8,
    "LIMIT_CYCLE": 9, "FREE_VIBRATION": 10, "STEADY_ROTATION": 11,
}  # fmt: skip


def test_stored_values_do_not_change():
    assert {one.name: int(one) for one in MotionClass} == STORED


@pytest.mark.parametrize("one", MotionClass)
def test_a_class_is_complete(one):
    assert MotionClass(int(one)) is one
    assert MotionClass.named(one.word) is one
    assert pickle.loads(pickle.dumps(one)) is one  # noqa: S301 - of this test
    if one == MotionClass.NONE:
        return
    assert text_of(one).tone in ("good", "warn", "bad")
    assert text_of(one).headline
    drawn = {MotionClass.SYNCHRONOUS: "period_1", MotionClass.PERIODIC: "period_more"}
    assert drawn.get(one, one.name.lower()) in MOTION_STYLES
    no_attractor = (
        MotionClass.UNDECIDED, MotionClass.DIVERGED, MotionClass.SELF_LOCKED,
        MotionClass.FREE_VIBRATION, MotionClass.STEADY_ROTATION,
    )  # fmt: skip
    assert (one.name.lower() in NO_ATTRACTOR) == (one in no_attractor)
