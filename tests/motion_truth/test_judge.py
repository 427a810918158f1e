"""The judge on maps whose answers are known, and truth.json against what made it."""

from __future__ import annotations

import math

import numpy as np
import pytest

from . import irregular
from .make_truth import contradicted, judged
from .section import COMPLETED, Points
from .systems import cases

GOLDEN = (math.sqrt(5.0) - 1.0) / 2.0


class Map:
    """A map of the plane in the place of a section."""

    period = 1.0

    def __init__(self, step) -> None:
        self.step = step

    def points(self, state, periods: int) -> Points:
        states = [tuple(map(float, state))]
        for _ in range(periods):
            states.append(self.step(*states[-1]))
        return Points(np.array(states), COMPLETED)


def henon(x: float, y: float) -> tuple[float, float]:
    return 1.0 - 1.4 * x * x + y, 0.3 * x


def bands(x: float, y: float) -> tuple[float, float]:
    """The logistic map where its chaos has two bands."""
    return 3.6 * x * (1.0 - x), x


def rotation(x: float, y: float) -> tuple[float, float]:
    """By the golden angle, drawn back to the unit circle."""
    c, s = math.cos(2 * math.pi * GOLDEN), math.sin(2 * math.pi * GOLDEN)
    pull = 1.5 - 0.5 * math.hypot(x, y)
    return pull * (c * x - s * y), pull * (s * x + c * y)


def run(step, start, periods):
    section = Map(step)
    states = section.points(start, periods + 500).states[500:]
    return section, states, np.ptp(states, axis=0)


def test_separation_finds_the_exponent_of_the_henon_map():
    section, states, span = run(henon, (0.1, 0.1), 10_000)
    rate = irregular.divergence(section, states, span, 1e-8)
    assert rate.error < 0.01
    # Sprott, Chaos and Time-Series Analysis (2003): 0.41922.
    assert rate.exponent == pytest.approx(0.41922, abs=4.0 * rate.error)


def test_separation_finds_the_exponent_of_a_rotation():
    section, states, span = run(rotation, (1.0, 0.2), 10_000)
    rate = irregular.divergence(section, states, span, 1e-8)
    assert abs(rate.exponent) < 1e-6


@pytest.mark.parametrize(
    ("step", "start", "pieces"), [(henon, (0.1, 0.1), 1), (bands, (0.3, 0.3), 2)]
)
def test_chaotic_maps_are_irregular(step, start, pieces):
    section, states, span = run(step, start, 10_000)
    assert irregular.bands(states) == pieces
    assert irregular.sensitivity(section, states, span, 1e-9) > 0.1
    assert irregular.birkhoff_digits(states, span, pieces) < 4.0
    assert irregular.zero_one(states, pieces) > 0.95


def test_rotation_is_regular():
    section, states, span = run(rotation, (1.0, 0.2), 10_000)
    assert irregular.bands(states) == 1
    assert irregular.sensitivity(section, states, span, 1e-9) < 1e-8
    assert irregular.birkhoff_digits(states, span, 1) > 9.0
    assert abs(irregular.zero_one(states, 1)) < 0.05


def test_truth_agrees_with_what_is_known():
    assert not [one["name"] for one in cases() if contradicted(one)]
    assert sum(one["motion"] == "undecided" for one in cases()) <= 0.02 * len(cases())


def check(then):
    now = judged(then)
    for key in ("motion", "order", "sticks"):
        assert now[key] == then[key], then["name"]
    if then["motion"] == "chaotic":
        error = math.hypot(now["error"], then["error"])
        assert now["exponent"] == pytest.approx(then["exponent"], abs=5.0 * error)


def test_judge_repeats_its_verdicts():
    """Some that are found quickly."""
    quick = [case for case in cases() if case["periods"] <= 2000]
    for case in quick[::15]:
        check(case)


@pytest.mark.slow
def test_judge_repeats_all_its_verdicts():
    for case in cases():
        check(case)
