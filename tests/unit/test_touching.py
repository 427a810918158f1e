"""Multipliers that touch 1, -1 or the unit circle along a branch, and return."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from wedgebrake.orbits.bifurcation_types import Kind, Scenario
from wedgebrake.orbits.equations.floquet import Floquet
from wedgebrake.orbits.palc import (
    CurvePoint,
    Step,
    corrected,
    ends_on_root,
    smooth_bifurcations,
    tangent,
)

# Where multipliers are critical: inside a step, in its middle, near its ends, at its end.
PLACES = (0.0137, 0.01, 0.0005, 0.0199, 0.02)


class Map:
    """Fixed points of a plane map over p, whose first coordinate is x(p) with F(x, p) = 0."""

    def __init__(self, floquet, function=lambda x, p: (x, 1.0, 0.0)) -> None:
        self.floquet, self.function = floquet, function

    def linearize(self, y):
        value, by_x, by_p = self.function(*y)
        return np.array([value]), np.array([[by_x, by_p]])

    def solution(self, y):
        floquet = self.floquet(*y)
        equations = SimpleNamespace(to_rounding=True)
        return SimpleNamespace(tests=floquet.tests, floquet=floquet, equations=equations)

    def found(self, start=(0.0, 0.0), length=0.02):
        """Bifurcations from a point in the direction of rising p, in one step or two."""
        y, up = np.array(start), np.array([1e-3, 1.0])
        matrix = self.linearize(y)[1]
        first = CurvePoint(y, matrix, tangent(matrix, up))
        step = self._step(first, length)
        steps = [step]
        if ends_on_root(step):
            step = self._step(first, 0.5 * length)
            steps = [step, self._step(step.at(step.length), 0.75 * length)]
        return [
            (one.kind, one.scenario, step.at(s).y[1])
            for step in steps
            for s, one in smooth_bifurcations(step, step.length)
        ]

    def _step(self, first, length):
        last = corrected(self, first.y + length * first.direction, first.direction)
        return Step(self, first, last)


def diagonal(*multipliers, half=False):
    return Floquet.of_matrices([np.diag(multipliers)], half=half)


def pair(modulus, angle):
    c, s = modulus * np.cos(angle), modulus * np.sin(angle)
    return Floquet.of_matrices([np.array([[c, -s], [s, c]])])


# Multipliers at distance g from their value at a bifurcation.
CASES = {
    "fold or branch point": (Kind.BRANCH_POINT, lambda g: diagonal(1.0 - g, 0.3)),
    "doubling": (Kind.PERIOD_DOUBLING, lambda g: diagonal(-1.0 + g, 0.3)),
    "doubling from below": (Kind.PERIOD_DOUBLING, lambda g: diagonal(-1.0 - g, 0.3)),
    "doubling of a plane": (Kind.PERIOD_DOUBLING, lambda g: Floquet.of_plane(g - 0.7, 0.3 * (g - 1))),
    "symmetry": (Kind.SYMMETRY_BREAKING, lambda g: diagonal(-1.0 + g, 0.3, half=True)),
    "torus": (Kind.NEIMARK_SACKER, lambda g: pair(1.0 - g, 1.1)),
    "torus from outside": (Kind.NEIMARK_SACKER, lambda g: pair(1.0 + g, 1.1)),
    "many": (Kind.PERIOD_DOUBLING, lambda g: diagonal(-1.0 + g, 0.9, -0.9, 0.99, 0.5, -0.2)),
}  # fmt: skip
# Distances over the distance d = p - p0: parabola, higher order, asymmetric.
SHAPES = {
    "parabola": lambda d: d * d,
    "steep": lambda d: 40.0 * d * d,
    "asymmetric": lambda d: d * d * (1.0 + 8.0 * d),
    "cosine": lambda d: 2.0 - 2.0 * np.cos(d),
}


@pytest.mark.parametrize("place", PLACES)
@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("case", CASES)
def test_touch_is_reported_once(case, shape, place) -> None:
    kind, floquet = CASES[case]
    branch = Map(lambda x, p: floquet(SHAPES[shape](p - place)))
    ((found, scenario, at),) = branch.found()
    assert (found, scenario) == (kind, Scenario.TOUCH)
    assert at == pytest.approx(place, abs=1e-9)


@pytest.mark.parametrize("place", PLACES)
@pytest.mark.parametrize("case", CASES)
def test_near_miss_is_not_reported(case, place) -> None:
    _, floquet = CASES[case]
    assert Map(lambda x, p: floquet((p - place) ** 2 + 1e-5)).found() == []


@pytest.mark.parametrize("place", PLACES[:2])
@pytest.mark.parametrize("case", CASES)
def test_two_crossings_are_reported_both(case, place) -> None:
    kind, floquet = CASES[case]
    found = Map(lambda x, p: floquet((p - place) ** 2 - 1e-6)).found()
    assert [one[:2] for one in found] == [(kind, Scenario.NONE)] * 2
    values = [at for _, _, at in found]
    np.testing.assert_allclose(values, [place - 1e-3, place + 1e-3], atol=1e-10)


class TestNoTouch:
    """Test functions that are small for other reasons."""

    @pytest.mark.parametrize("distance", [1e-3, 1e-4, 1e-5])
    def test_complex_pair_near_one(self, distance) -> None:
        """The function is the square of its distance."""

        def floquet(x, p):
            a, b = 1.0 - (p - 0.012), distance
            return Floquet.of_matrices([np.array([[a, -b], [b, a]])])

        kinds = {kind for kind, _, _ in Map(floquet).found()}
        assert kinds <= {Kind.NEIMARK_SACKER}

    def test_product_with_other_multipliers_near_one(self) -> None:
        def floquet(x, p):
            return diagonal(1.0 - (p - 0.012) ** 2 - 1e-5, 1.0 - 1e-3, 1.0 - 2e-3)

        assert Map(floquet).found() == []

    @pytest.mark.parametrize("least", [1e-6, 1e-10])
    def test_jump(self, least) -> None:
        """An approach to -1 that a jump of the multiplier ends."""

        def floquet(x, p):
            d = 0.012 - p
            return diagonal(-1.0 + (least + d * d if d > 0.0 else 0.05), 0.3)

        assert Map(floquet).found() == []

    def test_neutral_multiplier(self) -> None:
        """One that remains 1 up to rounding, as in a family of orbits."""

        def floquet(x, p):
            return diagonal(1.0 - 1e-12 * np.sin(1e4 * p), 0.3)

        assert Map(floquet).found() == []

    def test_modulus_without_damping(self) -> None:
        def floquet(x, p):
            return pair(1.0 - 1e-13 * (1.0 + np.sin(1e4 * p)), 1.1 + p)

        assert Map(floquet).found() == []


@pytest.mark.parametrize("bend", [0.0, 1e-5, -1e-6], ids=["two folds meet", "none", "two folds"])
def test_fold(bend) -> None:
    """p = x^3 + bend x: two folds that meet in a cusp at bend = 0, and are gone above."""

    def function(x, p):
        return p - x**3 - bend * x, -3.0 * x * x - bend, 1.0

    branch = Map(lambda x, p: diagonal(1.0 - 3.0 * x * x - bend, 0.3), function)
    x = -0.0123
    found = branch.found((x, x**3 + bend * x))
    if bend == 0.0:
        ((kind, scenario, at),) = found
        assert (kind, scenario) == (Kind.FOLD, Scenario.TOUCH)
        assert at == pytest.approx(0.0, abs=1e-18)
    elif bend > 0.0:
        assert found == []
    else:
        turn = np.sqrt(-bend / 3.0)
        assert [one[:2] for one in found] == [(Kind.FOLD, Scenario.NONE)] * 2
        expected = [turn * -2.0 / 3.0 * bend, turn * 2.0 / 3.0 * bend]
        np.testing.assert_allclose([at for _, _, at in found], expected, rtol=1e-9)
