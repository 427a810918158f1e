"""Features read off the paper's pictures, on data whose answer is known."""

import json

import numpy as np
import pytest
import xarray as xr

import wedgebrake as wb
from wedgebrake.model.paper_machines import CORRECTED, Case
from wedgebrake.paper.diagrams import PLANS, diagram, fit
from wedgebrake.paper.laboratory import Laboratory, SteadyRun
from wedgebrake.paper.signal_features import (
    STICK_SPEED,
    asymmetry,
    distortion,
    edges,
    visible_sticks,
)
from wedgebrake.paper.visual_criteria import (
    DOUBLE,
    FILLED,
    MULTIPLE,
    NOTHING,
    SYNCHRONOUS,
    THRESHOLDS,
    appearance,
)

AXIS = 10.0


def torus(count=51, low=1.0, high=9.0):
    phase = 2.0 * np.pi * 0.6180339887 * np.arange(count)
    return 0.5 * (low + high) + 0.5 * (high - low) * np.sin(phase)


@pytest.mark.parametrize(
    ("velocity", "word", "groups"),
    [
        (np.full(51, 4.2), SYNCHRONOUS, 1),
        (4.2 + 0.04 * np.sin(np.arange(51)), SYNCHRONOUS, 1),
        (np.tile([1.0, 8.0], 26), DOUBLE, 2),
        (np.tile([1.0, 4.0, 8.0], 17), MULTIPLE, 3),
        (np.tile(np.linspace(1.0, 9.0, 8), 7), MULTIPLE, 8),
        (torus(), FILLED, None),
        (np.random.default_rng(1).uniform(1.0, 9.0, 51), FILLED, None),
        (torus(low=4.0, high=5.0), MULTIPLE, None),  # too small to tell filled from dots
        (np.empty(0), NOTHING, 0),
    ],
)
def test_what_a_column_looks_like(velocity, word, groups):
    seen = appearance(velocity, AXIS)
    assert seen.kind == word
    if groups is not None:
        assert seen.groups == groups


class Painted:
    """A laboratory that shows what a rule says, without physics."""

    coarse, thresholds = False, THRESHOLDS

    def __init__(self, rule):
        self.rule = rule

    def steadies(self, cases):
        return [self.steady(case) for case in cases]

    def steady(self, case):
        return SteadyRun("completed", 25.0, np.zeros(51), self.rule(case.eta))


def three(eta):
    """2T below -31.4, a torus to -17.3, synchronous above."""
    if eta < -31.4:
        return np.tile([1.0, 9.0], 26)[:51]
    return torus(low=2.0, high=8.0) if eta < -17.3 else np.full(51, 5.0)


SEGMENTS = [(DOUBLE,), (FILLED, MULTIPLE), (SYNCHRONOUS,)]


def windows(eta):
    """Five of forty-five columns show something else, as windows in chaos do."""
    return np.full(51, 5.0) if round(eta) in (-105, -90, -75, -60, -24) else three(eta)


@pytest.mark.parametrize("rule", [three, windows])
def test_limits_are_found_and_refined(rule):
    laboratory = Painted(rule)
    shown = diagram(laboratory, Case(), "eta", np.linspace(-120.0, 12.0, 45))
    found = fit(laboratory, shown, SEGMENTS, 0.01)
    np.testing.assert_allclose(found.limits, [-31.4, -17.3], atol=0.01)
    assert np.all(np.diff(found.brackets, axis=1) <= 0.01)
    assert np.array_equal(found.agreement == 1.0, [rule is three] * 2 + [True])


def response(velocity, frequency=10.0, natural=16.0):
    """A response with a given velocity over 25 s."""
    times = np.arange(25001) * 1e-3
    system = {
        "excitation": {"frequency": frequency},
        "driveline": {"inertia": 1.0, "stiffness": (2.0 * np.pi * natural) ** 2},
    }
    return xr.Dataset(
        {"velocity": ("time", velocity(times), {"units": "rad/s"})},
        coords={"time": times},
        attrs={"system": json.dumps(system), "status": "completed"},
    )


def test_a_sine_is_smooth_symmetric_and_does_not_stick():
    sine = response(lambda t: 3.0 * np.sin(20.0 * np.pi * t))
    assert visible_sticks(sine).kind == "non-stick-slip"
    assert distortion(sine) < 0.01
    assert asymmetry(sine) < 1e-6
    up = edges(sine, 1)
    # From asin(0.1) to asin(0.9) of a sine of 10 Hz.
    expected = (np.arcsin(0.9) - np.arcsin(0.1)) / (20.0 * np.pi)
    assert up.rise == pytest.approx(expected, rel=0.03)
    assert up.fall == pytest.approx(expected, rel=0.03)


def clipped(times, forward, backward):
    """A sine of 10 Hz that rests for a share of the period after each lobe."""
    phase = (10.0 * times) % 1.0
    first, second = 0.5 - forward, 0.5 - backward
    wave = np.zeros_like(times)
    up, down = phase < first, (phase >= 0.5) & (phase < 0.5 + second)
    wave[up] = 5.0 * np.sin(np.pi * phase[up] / first)
    wave[down] = -5.0 * np.sin(np.pi * (phase[down] - 0.5) / second)
    return wave


@pytest.mark.parametrize(
    ("forward", "backward", "word"),
    [
        (0.2, 0.0, "unidirectional stick-slip"),
        (0.0, 0.2, "unidirectional stick-slip"),
        (0.2, 0.1, "bidirectional stick-slip"),
        (0.0, 0.0, "non-stick-slip"),
    ],
)
def test_rests_are_measured_with_the_side_they_follow(forward, backward, word):
    found = visible_sticks(response(lambda t: clipped(t, forward, backward)))
    assert found.kind == word
    # Either side of a rest the sine is within the threshold for a moment.
    slack = 2.5 * STICK_SPEED / (5.0 * 2.0 * np.pi)
    assert found.shares[0] == pytest.approx(forward, abs=slack)
    assert found.shares[1] == pytest.approx(backward, abs=slack)


def test_rest_by_the_picture_is_rest_by_the_exact_solution():
    """(-24, 0.067) sticks on the way up; shares from the events of the exact solver."""
    with Laboratory("exact") as laboratory:
        data = laboratory.response(Case(F0=0.067))
    found, truth = visible_sticks(data), wb.sticks(data, 20.0).attrs
    assert found.kind == truth["class"] == "unidirectional stick-slip"
    assert truth["share"] <= found.shares[2] <= truth["share"] + 0.05


def test_limits_seen_are_limits_of_the_motion():
    """The end of 2T over F_0, from dots and from the class with exponents."""
    plan = PLANS["11a"]
    with Laboratory("exact", thresholds=THRESHOLDS._replace(dot=0.005)) as laboratory:
        shown = diagram(laboratory, plan.base, "F0", np.linspace(0.06, 0.12, 31))
        found = fit(laboratory, shown, [(DOUBLE,), (SYNCHRONOUS,)], 1e-5)
    limit = float(found.limits[0])
    system = CORRECTED.system(plan.base, "coulomb")
    # Dots merge a little before the orbits do.
    assert wb.motion(system.replace(F0=limit - 0.0005)).order == 2
    assert wb.motion(system.replace(F0=limit + 0.001)).order == 1
