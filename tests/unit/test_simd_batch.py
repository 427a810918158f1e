"""Motions in vector lanes against the same motions alone, and against themselves."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

import wedgebrake as wb
from wedgebrake.dynamics.enums import Outcome
from wedgebrake.solvers.smooth import dense_output, simd_batch, taylor
from wedgebrake.solvers.smooth.assemble import problem
from wedgebrake.solvers.smooth.simd_codegen import Plain
from wedgebrake.solvers.smooth.solve_periods import WIDTH, advance, advance_together, fits_lanes

MOST = 10**7


def paper(**changes):
    return wb.paper.system(friction="smoothed").replace(**changes)


SHOE = wb.LeadingShoeBrake(radius=0.2, actuation_arm=0.2, normal_arm=0.1, friction_arm=0.08)
CASES = {
    "wedge": (paper(), (0.0, 0.0)),
    "wedge, strong": (paper(eta=-60.0), (0.01, -3.0)),
    "conventional": (wb.paper.system(friction="smoothed", brake="conventional"), (0.0, 0.0)),
    "shoe": (paper(brake=SHOE), (0.0, 0.1)),
    "turning": (paper(drive_speed=3.0), (0.001, -3.0)),
    "turning backwards": (paper(drive_speed=-3.0), (0.01, 3.0)),
    "growing force": (paper(slope=40.0), (0.0, 0.0)),
    "as printed": (paper(release=False, damping=1.0, eta=-3.0), (0.0, 0.0)),
    "no initial force": (paper(initial_force=0.0, slope=40.0), (0.0, 0.0)),
    "steep": (paper(steepness=1e4), (0.02, 1.0)),
    "mostly at rest": (paper(F0=0.5), (0.0, 1.0)),
    "no torque, no motion": (paper(amplitude=0.0), (0.0, 0.0)),
    "fast torque": (paper(f=5.0), (0.0, 2.0)),
    "slow torque": (paper(f=0.05, F0=0.09), (0.0, 0.0)),
    "no spring": (paper(stiffness=0.0), (0.0, 1.0)),
    "no damping": (paper(damping=0.0), (0.0, 1.0)),
}


def together(names, rtol=1e-9, periods=4, most=MOST):
    given = [problem(CASES[name][0], rtol, *CASES[name][1]) for name in names]
    assert all(fits_lanes(one) for one in given)
    states = np.array([CASES[name][1] for name in names])
    return advance_together(given, states, periods, most)


@pytest.mark.parametrize("first", range(0, len(CASES), WIDTH))
def test_as_alone(first):
    """Other steps, and the step's end chosen otherwise: equal as far as the tolerance goes."""
    names = list(CASES)[first : first + WIDTH]
    for name, found in zip(names, together(names, 1e-12), strict=True):
        system, state = CASES[name]
        right = advance(problem(system, 1e-12, *state), state, 4, MOST)
        assert found.outcome == Outcome.COMPLETED
        assert found.state == (found.points[-1, 0], found.points[-1, 1])
        size = np.abs(right.points).max(axis=0) + 1e-12
        assert np.max(np.abs(found.points - right.points) / size) <= 2e-8, name
        assert found.steps <= 1.5 * right.steps + 20


@pytest.mark.parametrize(("rtol", "largest"), [(1e-6, 3e-3), (1e-9, 3e-6)])
def test_error_follows_the_tolerance(rtol, largest):
    names = ["wedge", "conventional", "shoe", "turning", "growing force"]
    for found, right in zip(together(names, rtol), together(names, 1e-13), strict=True):
        assert np.max(np.abs(found.points - right.points)[:, 1]) <= largest


def test_a_lane_does_not_know_the_others():
    """To the last bit, in whatever lane and company; and with lanes left over."""
    names = list(CASES)[:WIDTH]
    right = dict(zip(names, together(names), strict=True))
    for order in itertools.islice(itertools.permutations(range(WIDTH)), 1, 40_000, 8_000):
        mixed = [names[i] for i in order]
        for name, found in zip(mixed, together(mixed), strict=True):
            np.testing.assert_array_equal(found.points, right[name].points)
    for name in names:
        (alone,) = together([name])
        np.testing.assert_array_equal(alone.points, right[name].points)
        assert alone.steps == right[name].steps


def test_ends_of_one_leave_the_others():
    """One lane grows without bound; its neighbours go on."""
    runaway = paper(release=False, eta=-60.0).replace(damping=0.0)
    state = (0.0, 5.0)
    given = [problem(runaway, 1e-8, *state), problem(paper(), 1e-8)]
    found = advance_together(given, np.array([state, (0.0, 0.0)]), 200, MOST)
    right = advance(problem(runaway, 1e-8, *state), state, 200, MOST)
    assert found[0].outcome == right.outcome == Outcome.DIVERGED
    assert found[0].points.shape == right.points.shape
    assert found[1].outcome == Outcome.COMPLETED
    assert found[1].points.shape == (201, 2)


def test_step_limit():
    found = together(["wedge", "conventional"], most=30)
    assert [one.outcome for one in found] == [Outcome.STEP_LIMIT] * 2
    assert all(0 < one.points.shape[0] < 5 for one in found)


@pytest.mark.parametrize("formulas", [taylor, dense_output], ids=["a step", "a step seen again"])
def test_the_formula_is_python(formulas):
    """What was compiled for several lanes is the formula, lane by lane."""
    given = problem(paper(), 1e-9).problem
    width, rows = WIDTH, taylor.OUTPUT_ROWS
    if formulas is dense_output:
        width, rows = dense_output.WIDTH, dense_output.DENSE_ROWS
    inputs, outputs = np.full((taylor.INPUT_ROWS, width), 1e-4), np.zeros((rows, width))
    for lane in range(width):
        taylor.load(given.driveline, given.torque, given.law, inputs, lane)
    row, rng = taylor.INPUT, np.random.default_rng(5)
    state = [row.angle, row.velocity, row.drive, row.drive_rate]
    inputs[state] = rng.uniform(-0.2, 0.2, (4, width)) + np.array([[0.01], [0.03], [1.0], [1.0]])
    inputs[[row.angle_tolerance, row.velocity_tolerance]] = [[1e-10], [1e-9]]
    compiled = simd_batch.step_lanes if formulas is taylor else dense_output.expand_lanes
    compiled(inputs, outputs)
    for lane in range(width):
        right = formulas.formula(Plain, list(inputs[:, lane]))
        np.testing.assert_allclose(outputs[:, lane], right, rtol=1e-12, atol=1e-300)


def test_a_sweep_takes_lanes():
    """Points of a sweep are the motions of their systems, however its chunks are cut."""
    system = paper(eta=-6.0)
    eta = np.linspace(-12.0, 6.0, 11)
    found = wb.bifurcation(system, eta=eta, periods=30, transient=20)
    for place in (0, 5, 10):
        one = wb.motion(system.replace(eta=eta[place]), 30, transient=20)
        assert one.largest_exponent == pytest.approx(
            float(found["largest_exponent"][place]), rel=1e-4
        )
        assert one.friction_power == pytest.approx(float(found["friction_power"][place]), rel=1e-6)
    part = wb.bifurcation(system, eta=eta[3:6], periods=30, transient=20)
    for name in ("velocity", "largest_exponent", "peak_torque"):
        np.testing.assert_array_equal(part[name], found[name][3:6])
