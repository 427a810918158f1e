"""The end of an automatic transient: which motions around a torus are final."""

from __future__ import annotations

import math

import numpy as np
import pytest

from wedgebrake.analysis import settling
from wedgebrake.analysis.classify import Verdict, Window
from wedgebrake.dynamics.enums import MotionClass

GOLDEN = 0.5 * (5.0**0.5 - 1.0)


def rotation(phase: float) -> float:
    return phase + GOLDEN


def kinked(phase: float) -> float:
    """A homeomorphism of the circle with two corners, as of a torus with sticks."""
    share = phase % 1.0
    return phase + 0.381 + 0.1 * min(share, 1.0 - share)


def folded(phase: float) -> float:
    """Not one-to-one: points overtake each other, as in chaos."""
    return phase + 0.606 - 1.3 / (2.0 * math.pi) * math.sin(2.0 * math.pi * phase)


def locked(phase: float) -> float:
    """Approaches an orbit of 145 returns slowly."""
    order = 145
    return phase + 89 / order - 0.0002 * math.sin(2.0 * math.pi * order * phase) / order


@pytest.mark.parametrize(
    ("turn", "expected"), [(rotation, True), (kinked, True), (folded, False), (locked, False)]
)
@pytest.mark.parametrize("returns", [256, 512])
def test_end_of_a_transient_on_a_torus(turn, returns, expected) -> None:
    """Only of returns that are a homeomorphism of the torus, and not of a resonance."""
    phases = [0.1]
    for _ in range(3 * returns):
        phases.append(turn(phases[-1]))
    angles = 2.0 * math.pi * np.array(phases[-returns - 1 :])
    points = np.column_stack((3.0 * np.cos(angles), 2.0 * np.sin(angles)))
    growth = np.zeros(returns)
    window = Window(points, np.ones(2), 5.0, growth, -0.2, False)
    verdict = Verdict(MotionClass.QUASI_PERIODIC, 0, 0.1, 0.0, 0.0, -0.2)
    assert settling.is_final(window, verdict) == expected
