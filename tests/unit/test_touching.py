"""Multipliers that touch 1, -1 or the unit circle along a branch, and return."""

from __future__ import annotations

import math
from functools import cache
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq, fsolve

import wedgebrake as wb
from wedgebrake.orbits.bifurcation_types import Bifurcation, Kind, Scenario
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

    def __init__(self, floquet, function=lambda x, _: (x, 1.0, 0.0)) -> None:
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


def plane(first, second):
    return Floquet.of_plane(first + second, first * second)


def pair(modulus, angle):
    c, s = modulus * np.cos(angle), modulus * np.sin(angle)
    return Floquet.of_matrices([np.array([[c, -s], [s, c]])])


# Multipliers at distance g from their value at a bifurcation.
CASES = {
    "fold or branch point": (Kind.BRANCH_POINT, lambda g: diagonal(1.0 - g, 0.3)),
    "doubling": (Kind.PERIOD_DOUBLING, lambda g: diagonal(-1.0 + g, 0.3)),
    "doubling from below": (Kind.PERIOD_DOUBLING, lambda g: diagonal(-1.0 - g, 0.3)),
    "doubling of a plane": (Kind.PERIOD_DOUBLING, lambda g: plane(-1.0 + g, 0.3)),
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
    branch = Map(lambda _, p: floquet(SHAPES[shape](p - place)))
    ((found, scenario, at),) = branch.found()
    assert (found, scenario) == (kind, Scenario.TOUCH)
    assert at == pytest.approx(place, abs=1e-9)


@pytest.mark.parametrize("place", PLACES)
@pytest.mark.parametrize("case", CASES)
def test_near_miss_is_not_reported(case, place) -> None:
    _, floquet = CASES[case]
    assert Map(lambda _, p: floquet((p - place) ** 2 + 1e-5)).found() == []


@pytest.mark.parametrize("place", PLACES[:2])
@pytest.mark.parametrize("case", CASES)
def test_two_crossings_are_reported_both(case, place) -> None:
    kind, floquet = CASES[case]
    found = Map(lambda _, p: floquet((p - place) ** 2 - 1e-6)).found()
    assert [one[:2] for one in found] == [(kind, Scenario.NONE)] * 2
    values = [at for _, _, at in found]
    np.testing.assert_allclose(values, [place - 1e-3, place + 1e-3], atol=1e-10)


class TestNoTouch:
    """Test functions that are small for other reasons."""

    @pytest.mark.parametrize("distance", [1e-3, 1e-4, 1e-5])
    def test_complex_pair_near_one(self, distance) -> None:
        """The function is the square of its distance."""

        def floquet(_, p):
            a, b = 1.0 - (p - 0.012), distance
            return Floquet.of_matrices([np.array([[a, -b], [b, a]])])

        kinds = {kind for kind, _, _ in Map(floquet).found()}
        assert kinds <= {Kind.NEIMARK_SACKER}

    def test_product_with_other_multipliers_near_one(self) -> None:
        def floquet(_, p):
            return diagonal(1.0 - (p - 0.012) ** 2 - 1e-5, 1.0 - 1e-3, 1.0 - 2e-3)

        assert Map(floquet).found() == []

    @pytest.mark.parametrize("least", [1e-6, 1e-10])
    def test_jump(self, least) -> None:
        """An approach to -1 that a jump of the multiplier ends."""

        def floquet(_, p):
            d = 0.012 - p
            return diagonal(-1.0 + (least + d * d if d > 0.0 else 0.05), 0.3)

        assert Map(floquet).found() == []

    def test_neutral_multiplier(self) -> None:
        """One that remains 1 up to rounding, as in a family of orbits."""

        def floquet(_, p):
            return diagonal(1.0 - 1e-12 * np.sin(1e4 * p), 0.3)

        assert Map(floquet).found() == []

    def test_modulus_without_damping(self) -> None:
        def floquet(_, p):
            return pair(1.0 - 1e-13 * (1.0 + np.sin(1e4 * p)), 1.1 + p)

        assert Map(floquet).found() == []


@pytest.mark.parametrize("bend", [0.0, 1e-5, -1e-6], ids=["two folds meet", "none", "two folds"])
def test_fold(bend) -> None:
    """p = x^3 + bend x: two folds that meet in a cusp at bend = 0, and are gone above."""

    def function(x, p):
        return p - x**3 - bend * x, -3.0 * x * x - bend, 1.0

    branch = Map(lambda x, _: diagonal(1.0 - 3.0 * x * x - bend, 0.3), function)
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


@pytest.mark.parametrize("growth", [1.0, 30.0, 1e3])
@pytest.mark.parametrize("share", [1.3, 1.8, 2.0, 2.4])
@pytest.mark.parametrize("turn", [1e-3, 3e-3, 1e-2, 2e-2])
def test_two_folds_in_a_step(turn, share, growth) -> None:
    """p = x^3 - 3 turn^2 x; a multiplier that changes fast is far from 1 at both ends."""
    start = -0.05
    bend = -3.0 * turn * turn

    def function(x, p):
        return p - x**3 - bend * x, -3.0 * x * x - bend, 1.0

    branch = Map(lambda x, _: diagonal(1.0 + growth * (3.0 * x * x + bend), 0.3), function)
    found = branch.found((start, start**3 + bend * start), share * -start)
    expected = [2.0 * turn**3, -2.0 * turn**3][: 2 if start + share * -start > turn else 1]
    assert [one[:2] for one in found] == [(Kind.FOLD, Scenario.NONE)] * len(expected)
    np.testing.assert_allclose([at for _, _, at in found], expected, rtol=1e-9)


@pytest.mark.parametrize("flattest", [1e-4, 1e-3, 1e-2])
def test_a_flat_part_has_no_folds(flattest) -> None:
    """p = x^3 + flattest x."""

    def function(x, p):
        return p - x**3 - flattest * x, -3.0 * x * x - flattest, 1.0

    branch = Map(lambda x, _: diagonal(1.0 + 1e3 * (3.0 * x * x + flattest), 0.3), function)
    assert branch.found((-0.2, -0.008 - 0.2 * flattest), 0.37) == []


def bifurcations(branch):
    """(kind, scenario, value) of each bifurcation of a whole branch."""
    return [
        (point.bifurcation.kind, point.bifurcation.scenario, point.value)
        for point in branch
        if point.bifurcation
    ]


class TestDoublingOfTheWedge:
    """Over F0 at the largest eta of its curve of period doublings: two of them meet.

    That value is computed from the multipliers of single orbits.
    """

    AROUND, AT = (0.0515, 0.0504), (0.05062, 0.05078)

    @staticmethod
    def system(eta, force=0.0515):
        return wb.paper.system(eta=eta, F0=force)

    def function(self, eta, force):
        found = wb.orbit(self.system(eta, force), 1, initial=(0.0, 0.0))
        return math.prod(1.0 + one.real for one in found.multipliers)

    def turn(self, eta):
        """Value of F0 with the least function, by differences that are exact to 1e-10."""
        step = 4e-7

        def slope(force):
            return self.function(eta, force + step) - self.function(eta, force - step)

        return brentq(slope, *self.AT, xtol=1e-14)

    @classmethod
    @cache
    def eta(cls):
        here = cls()
        return brentq(lambda one: here.function(one, here.turn(one)), -14.90, -14.87, xtol=1e-13)

    def test_touch(self) -> None:
        eta = self.eta()
        branch = wb.continuation(wb.orbit(self.system(eta), 1), F0=self.AROUND)
        ((kind, scenario, value),) = bifurcations(branch)
        assert (kind, scenario) == (Kind.PERIOD_DOUBLING, Scenario.TOUCH)
        assert value == pytest.approx(self.turn(eta), abs=1e-9)
        (point,) = branch.bifurcations
        assert point.multipliers[0] == pytest.approx(-1.0, abs=1e-10)
        # Over both parameters, the curve of period doublings turns there.
        curve = wb.boundary(point, step=0.1, F0=self.AROUND, eta=(-15.0, -14.0))
        assert curve.sizes["point"] > 10
        assert float(curve.eta.max()) == pytest.approx(eta, abs=1e-10)

    @pytest.mark.parametrize(("beside", "count"), [(1e-4, 0), (1e-6, 0), (-1e-6, 2), (-1e-4, 2)])
    def test_beside(self, beside, count) -> None:
        start = wb.orbit(self.system(self.eta() + beside), 1)
        found = bifurcations(wb.continuation(start, F0=self.AROUND))
        assert [one[:2] for one in found] == [(Kind.PERIOD_DOUBLING, Scenario.NONE)] * count


def falling(v):
    """A friction curve whose slope is least near 2 m/s."""
    return 0.4 * math.tanh(100.0 * v) - 0.1 * math.tanh(v - 2.0) - 0.1 * math.tanh(v + 2.0)


def slope_of_falling(v):
    squares = [1.0 / math.cosh(min(one, 300.0)) ** 2 for one in (100.0 * v, v - 2.0, v + 2.0)]
    return 40.0 * squares[0] - 0.1 * squares[1] - 0.1 * squares[2]


FALLING = wb.CustomFriction(law=falling, width=0.02)
FORCE = wb.Actuation(initial_force=10.0, slope=0.0)


class TestFoldsOfARotor:
    """J v' = T + A sin(wt) - c v - N mu(v): two folds over T meet at one value of c.

    There the return map has P(v) = v, P'(v) = 1 and P''(v) = 0, which SciPy solves.
    """

    AMPLITUDE, FREQUENCY = 2.0, 0.5
    NAME = "engine.signals.0.value"

    def conditions(self, start, torque, damping):
        """P(v) - v, log P'(v) and P''(v)/P'(v), from SciPy."""

        def bend(v):
            falls = [np.tanh(one) / np.cosh(one) ** 2 for one in (v - 2.0, v + 2.0)]
            return 0.2 * sum(falls) - 8000.0 * np.tanh(100.0 * v) / np.cosh(100.0 * v) ** 2

        def rates(t, state):
            v, growth, _ = state
            turning = self.AMPLITUDE * np.sin(2.0 * np.pi * self.FREQUENCY * t)
            return [
                torque + turning - damping * v - 10.0 * falling(v),
                -damping - 10.0 * slope_of_falling(v),
                -10.0 * bend(v) * np.exp(growth),
            ]

        period = (0.0, 1.0 / self.FREQUENCY)
        run = solve_ivp(rates, period, [start, 0.0, 0.0], "DOP853", rtol=1e-13, atol=1e-14)
        return run.y[:, -1] - [start, 0.0, 0.0]

    @classmethod
    @cache
    def cusp(cls):
        """(v, T, c)."""
        return fsolve(lambda one: cls().conditions(*one), [1.36, 4.67, 0.834], xtol=1e-13)

    def branch(self, more):
        """Over T, at c + more."""
        speed, torque, damping = self.cusp()
        signal = wb.Constant(torque - 0.2) + wb.Harmonic(self.AMPLITUDE, self.FREQUENCY)
        machine = wb.Machine(
            inertias=[wb.Inertia("disc", 1.0, speed=speed - 0.5)],
            shafts=[wb.Shaft(
                    "disc", "ground", stiffness=0.0, damping=damping + more, name="shaft"
                )],
            contacts=[
                wb.Contact(
                    "disc", name="brake", brake=wb.ConventionalBrake(radius=1.0), friction=FALLING,
                    actuation=FORCE,
                )
            ],
            torques=[wb.Torque("disc", signal, name="engine")],
        )  # fmt: skip
        ends = torque - 0.2, torque + 0.2
        return wb.continuation(wb.orbit(machine, 1), {self.NAME: ends}, step=0.1)

    def test_curve_of_folds(self) -> None:
        """From the cusp both ways: at smaller c two folds, where SciPy finds them."""
        _, torque, damping = self.cusp()
        point = next(one for one in self.branch(0.0) if one.bifurcation)
        curve = wb.boundary(
            point, step=0.2,
            **{self.NAME: (torque - 0.2, torque + 0.2), "shaft.damping": (0.7, 0.9)},
        )  # fmt: skip
        dampings, torques = curve["shaft.damping"].values, curve[self.NAME].values
        at = int(np.argmax(dampings))
        assert dampings[at] == pytest.approx(damping, abs=1e-9)
        for k in (0, at // 2, (at + dampings.size) // 2, dampings.size - 1):

            def fold(unknowns, c=dampings[k]):
                return self.conditions(*unknowns, c)[:2]

            speed, expected = fsolve(fold, [curve.velocity.values[k], torques[k]], xtol=1e-12)
            assert torques[k] == pytest.approx(expected, abs=1e-8)
            assert curve.velocity.values[k] == pytest.approx(speed, abs=1e-6)

    @pytest.mark.parametrize("more", [0.0, 1e-5, -1e-6])
    def test_folds(self, more) -> None:
        found, torque = bifurcations(self.branch(more)), self.cusp()[1]
        if more > 0.0:
            assert found == []
        elif more < 0.0:
            assert [one[:2] for one in found] == [(Kind.FOLD, Scenario.NONE)] * 2
        else:
            ((kind, scenario, value),) = found
            assert (kind, scenario) == (Kind.FOLD, Scenario.TOUCH)
            assert value == pytest.approx(torque, abs=1e-9)


def test_words() -> None:
    """They do not say that an orbit branches off or ends there."""
    sentence = Bifurcation(Kind.PERIOD_DOUBLING, scenario=Scenario.TOUCH).sentence
    assert "touched" in sentence
    assert Kind.PERIOD_DOUBLING.meaning not in sentence
