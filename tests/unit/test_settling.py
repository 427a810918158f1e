"""The end of an automatic transient: which motions around a torus are final."""

from __future__ import annotations

import numpy as np
import pytest

from wedgebrake.analysis import settling
from wedgebrake.analysis.classify import Verdict, Window
from wedgebrake.dynamics.enums import MotionClass


@pytest.mark.parametrize(
    ("motion", "grown", "shrunk", "expected"),
    [
        (MotionClass.QUASI_PERIODIC, 0.0, -50.0, True),
        (MotionClass.QUASI_PERIODIC, 0.0, 0.0, False),
        (MotionClass.QUASI_PERIODIC, 3.0, -50.0, False),
        (MotionClass.UNDECIDED, 0.0, -50.0, False),
        (MotionClass.CHAOTIC, 30.0, -50.0, False),
    ],
)
def test_only_a_torus_that_attracts_ends_a_transient(motion, grown, shrunk, expected) -> None:
    """Chaos may be transient, and about a torus that does not attract others are as likely."""
    returns = 256
    window = Window(np.zeros((returns + 1, 2)), np.ones(2), 5.0, np.zeros(returns), -0.2, False)
    verdict = Verdict(motion, 0, 0.1, grown / returns, 0.0, shrunk / returns)
    assert settling.is_final(window, verdict) == expected
