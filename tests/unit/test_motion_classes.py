"""The table of classes of motion, which reports, pictures and the explorer read."""

from __future__ import annotations

import pickle

import numpy as np
import pytest

from wedgebrake.dynamics.enums import Comparison, MotionClass
from wedgebrake.figures import style
from wedgebrake.figures.data.class_styles import CODES, MOTION_STYLES, MOTIONS

# Values that are written to results and stores.
STORED = {
    "NONE": -1, "UNDECIDED": 0, "AT_REST": 1, "SYNCHRONOUS": 2, "PERIODIC": 3,
    "QUASI_PERIODIC": 4, "CHAOTIC": 5, "DIVERGED": 6, "SELF_LOCKED": 7, "STEADY_SLIDING": 8,
    "LIMIT_CYCLE": 9,
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
    assert one.about.tone in ("good", "warn", "bad")
    assert one.about.headline
    settled = one not in (MotionClass.UNDECIDED, MotionClass.DIVERGED, MotionClass.SELF_LOCKED)
    assert (one.about.comparison != Comparison.NONE) == settled


def test_every_class_has_a_style_of_its_own():
    ranks = [one.about.rank for one in MotionClass if one.about.rank]
    assert sorted(ranks) == list(range(1, len(MotionClass)))
    names = [one.name.lower() for one in MotionClass if one != MotionClass.NONE]
    split = {"synchronous": "period_1", "periodic": "period_more"}
    codes = [CODES[split.get(name, name)] for name in names]
    assert len(set(codes)) == len(codes)
    opaque = [one.colour for one in MOTIONS if one.opacity == 1.0]
    distances = [
        np.linalg.norm(np.subtract(style.rgb(a), style.rgb(b)))
        for i, a in enumerate(opaque) for b in opaque[:i]
    ]  # fmt: skip
    assert min(distances) > 0.1
    assert list(MOTION_STYLES)[:3] == ["at_rest", "steady_sliding", "limit_cycle"]
