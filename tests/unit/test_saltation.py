"""The derivative of the flow against differences of the flow, across every kind of event."""

from __future__ import annotations

import math

import numpy as np
import pytest

import wedgebrake as wb
from cases import CASES
from differences import jacobian
from wedgebrake.analysis.driveline_motion import driveline_passage, evaluate_point, saltation
from wedgebrake.dynamics.enums import Outcome
from wedgebrake.dynamics.problem import Instant, State
from wedgebrake.dynamics.segment_log import empty_log
from wedgebrake.solvers.event_driven import trajectory
from wedgebrake.solvers.event_driven.solve import problem

PERIODS = 3
# Step of a difference as a share of the motion's size, and rounding of a difference of states
# over it: what no derivative can be told from.
_STEP, _NOISE = 1e-4, 1e-10


def _flow(system, state, periods=PERIODS):
    found = _run(system, state, periods, empty_log(0))
    return found.outcome, np.array([found.state.angle, found.state.velocity])


def _run(system, state, periods, log):
    start, end = State(0, 0.0, *state), Instant(periods, 0.0)
    return trajectory.run(problem(system, *state), start, end, 10**6, log, np.empty((0, 2)))


def _derivative(system, state, periods=PERIODS):
    """(outcome, matrix, logdet, ranked) from the kernel."""
    log = empty_log(4000)
    found = _run(system, state, periods, log)
    identity = saltation.Deviations(1.0, 0.0, 0.0, 1.0)
    there = saltation.propagate(problem(system, *state), log, found.rows, identity, np.empty(0), 0)
    x1, y1, x2, y2 = there.deviations
    matrix = math.exp(there.log_scale) * np.array([[x1, x2], [y1, y2]])
    return found.outcome, matrix, there.log_determinant, there.full_rank


@pytest.mark.parametrize("name", CASES)
def test_derivative_agrees_with_differences(name) -> None:
    system, _ = CASES[name]
    rng = np.random.default_rng(len(name))
    line = system.driveline
    weight = line.natural_frequency or system.excitation.angular_frequency
    checked = 0
    for _ in range(25):
        size = 10.0 ** rng.uniform(0.0, 1.3)
        state = (size / weight * rng.normal(), size * rng.normal() - line.drive_speed)
        outcome, matrix, logdet, ranked = _derivative(system, state)
        if outcome != Outcome.COMPLETED:
            continue
        scale = (size / weight, size)
        fine, coarse = (
            jacobian(lambda there: _flow(system, tuple(there))[1], state, h * np.array(scale))
            for h in (_STEP, 2.0 * _STEP)
        )
        unit = np.array([[1.0, 1.0 / weight], [weight, 1.0]])
        spread = np.max(np.abs(fine - coarse) / unit)
        largest = np.max(np.abs(matrix) / unit)
        if not np.isfinite(spread) or spread > 1e-7 * largest + 10.0 * _NOISE:
            continue  # a corner or a graze between the neighbours: there is no derivative
        error = np.max(np.abs(matrix - fine) / unit)
        assert error <= 1e-8 * largest + _NOISE, (state, matrix, fine)
        rounding = 1e-13 * largest**2
        if ranked:
            assert np.linalg.det(matrix) == pytest.approx(math.exp(logdet), rel=1e-10, abs=rounding)
        else:
            assert abs(np.linalg.det(matrix)) <= rounding
        checked += 1
    assert checked >= 12, (name, checked)


def test_log_in_pieces_gives_the_same_sum() -> None:
    """A log that fills up again and again changes neither the sums nor the derivative."""
    system = wb.paper.system(eta=-24.0, F0=0.036)
    settings = evaluate_point.Settings(40, 20, 100, 10**6)
    results = evaluate_point.EMPTY.repeat(3)
    for rows, result in zip((3, 17, 4000), results, strict=True):
        arrays = driveline_passage.arrays_for(settings, rows)
        evaluate_point.evaluate(problem(system), 0.0, 0.0, settings, arrays, result)
    for name in evaluate_point.RESULT.names:
        np.testing.assert_allclose(results[name][1:], results[name][0], rtol=1e-7, atol=1e-9)
