"""The derivative of the flow with smooth friction over a period of the torque."""

from __future__ import annotations

import math

import numba
import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.linalg import expm

import wedgebrake as wb
from differences import jacobian
from equations import angular_frequency, gain, right_side
from wedgebrake.dynamics.enums import EventKind, Outcome
from wedgebrake.solvers.smooth import variational
from wedgebrake.solvers.smooth.assemble import laws, problem
from wedgebrake.solvers.smooth.problem import joined
from wedgebrake.solvers.smooth.solve_periods import advance

MOST = 10**6


def paper(**changes) -> wb.BrakedDriveline:
    """The paper's wedge at eta = -24, F_0 = 0.036 with the smoothed law, then changed."""
    return wb.paper.system(friction="smoothed").replace(**changes)


@numba.njit
def falling(v):
    """Leine's falling friction, smoothed by arctan; a kink at 0 and no limit."""
    return 0.3 / (1.0 + 3.0 * abs(v)) * 2.0 / math.pi * math.atan(100.0 * v)


CONVENTIONAL = wb.paper.system(friction="smoothed", brake="conventional")
CUSTOM = wb.CustomFriction(law=falling, width=0.01)
BAND = wb.BandBrake(radius=0.2, wrap_angle=4.0)
# System, state at phase 0, and whether a period from there reverses and passes the release.
CASES = {
    "wedge": (paper(), (-0.05, 6.0), True, True),
    "conventional": (CONVENTIONAL, (-0.024, 7.4), True, True),
    "start in the layer": (paper(), (0.02, 0.01), True, False),
    "always fast": (paper(eta=-3.0, drive_speed=30.0), (0.0, 0.0), False, False),
    "static peak": (paper(static=0.33), (0.02, 3.0), True, False),
    "turning": (paper(drive_speed=3.0), (0.02, 1.0), True, True),
    "turning, static peak": (paper(static=0.33, drive_speed=-3.0), (0.02, 1.0), True, True),
    "low release": (paper(eta=-60.0), (-0.02, 5.0), True, True),
    "custom": (paper(friction=CUSTOM), (-0.05, 6.0), True, True),
    "band": (paper(brake=BAND), (0.02, 1.0), True, True),
    "towards the wall": (paper(eta=0.0, alpha=0.95), (0.0, 0.0), True, False),
    "hundreds of steps": (CONVENTIONAL.replace(frequency=2.0), (0.02, 7.0), True, False),
}

# Those whose derivative SciPy integrates with the slope of the law by hand.
ANALYTIC = (
    "wedge",
    "conventional",
    "static peak",
    "turning",
    "turning, static peak",
    "low release",
)


def passed(given, state, most=MOST):
    """(state, derivative) after one period that is completed."""
    there = advance(given, tuple(state), 1, most, derivative=True)
    assert there.outcome == Outcome.COMPLETED
    return np.array(there.state), there.matrices[0]


def scaled(system, matrix):
    """The derivative with the angle times the natural frequency: all entries alike in size."""
    weight = system.driveline.natural_frequency
    return matrix * np.array([[1.0, weight], [1.0 / weight, 1.0]])


def differences(system, given, state, step):
    """(2, 2) differences of fourth order of the flow, with a step [rad/s]."""
    steps = step * np.array([1.0 / system.driveline.natural_frequency, 1.0])
    return jacobian(lambda begin: advance(given, tuple(begin), 1, MOST).state, state, steps)


@pytest.mark.parametrize("name", [name for name in CASES if name not in ANALYTIC])
def test_against_differences_of_the_flow(name):
    """What the differences can show: errors of the states over the step.

    At rtol 1e-13 a state is exact to some 1e-12, and to 1e-11 where a neighbour's steps fall
    otherwise about a kink. Weights of 1, 8, 8 and 1 over 12 steps make 1.5e-11 / 5e-4 of it.
    """
    system, state, reverses, releases = CASES[name]
    kinds = wb.simulate(system, periods=1, initial=state).event_kind.values
    assert (EventKind.REVERSAL in kinds) == reverses
    assert (EventKind.BREAKPOINT in kinds) == releases
    given = problem(system, 1e-13)
    got = scaled(system, passed(given, state)[1])
    near = scaled(system, differences(system, given, state, 5e-4))
    assert np.max(np.abs(got - near)) <= 3e-8


@pytest.mark.parametrize("name", CASES)
def test_error_follows_the_tolerance(name):
    """Within rtol times the speed over the half width of the layer: 150, with room for growth."""
    system, state, _, _ = CASES[name]
    right = scaled(system, passed(problem(system, 1e-13), state)[1])
    for rtol in (1e-9, 1e-11):
        got = scaled(system, passed(problem(system, rtol), state)[1])
        assert np.max(np.abs(got - right)) <= 1e3 * rtol * np.max(np.abs(right))


@pytest.mark.parametrize("rtol", [1e-8, 1e-10, 1e-11])
@pytest.mark.parametrize(
    ("system", "state"),
    [
        (paper(steepness=1e4), (0.02, 1.0)),
        (paper(static=0.33, drive_speed=-3.0, steepness=1e3), (0.02, 1.0)),
        (paper(F0=0.5, steepness=1e4), (0.0, 1.0)),
        (paper(eta=0.0, alpha=0.95), (0.0, 0.0)),
    ],
    ids=["steep", "steep peak, turning", "mostly sticking", "towards the wall"],
)
def test_creep_in_a_steep_layer(system, state, rtol):
    """Steps at the bound of stability, in which a deviation in speed must die none the less.

    An error of rtol in the speed is one of up to 1e4 rtol where it is compared with the layer.
    """
    got = scaled(system, passed(problem(system, rtol), state)[1])
    near = scaled(system, differences(system, problem(system, 1e-13), state, 5e-4))
    assert np.max(np.abs(got - near)) <= 1e4 * rtol * np.max(np.abs(near))


def torque_slope(system, v):
    """dM/dv of the brake with the smoothed law, by hand from eqs. 3, 5, 14 and 15."""
    friction, force, radius = system.friction, system.actuation, system.brake.radius
    pressing = force.initial_force + force.slope * abs(v)
    if force.release and pressing < 0.0:
        return 0.0
    tanh = math.tanh(friction.steepness * radius * v)
    peak = (friction.static - friction.kinetic) * math.exp(-friction.decay * radius * abs(v))
    m = (friction.kinetic + peak) * tanh
    m_slope = (friction.kinetic + peak) * friction.steepness * (1.0 - tanh * tanh)
    m_slope -= friction.decay * peak * abs(tanh)
    g_slope = 1.0
    if isinstance(system.brake, wb.WedgeBrake):
        tangent = math.tan(system.brake.angle)
        g_slope = tangent / (tangent - m) ** 2
    pressed = force.slope * math.copysign(1.0, v) * gain(system.brake, m)
    return radius * (pressed + pressing * g_slope * m_slope * radius)


@pytest.mark.parametrize("beyond", [-7.0, -1.0, -0.01, -1e-7, 0.0, 1e-4])
@pytest.mark.parametrize(
    "system", [paper(), paper(static=0.33), CONVENTIONAL], ids=["wedge", "peak", "conventional"]
)
def test_slope_of_the_torque_never_looks_across_a_kink(system, beyond):
    """Sliding speeds from the layer to the release, which a stage may pass, and the mirror."""
    brake = joined.py_func(*laws(system))
    release = system.actuation.release_speed
    reach = 0.5 * math.pi * problem(system, 1e-9).problem.band
    inside = math.nextafter(release, 0.0)
    for low, high, sign in ((0.0, release, 1.0), (-release, 0.0, -1.0)):
        for v in (sign * (release + beyond), -sign * beyond):
            arm = variational.ARM * (abs(v) + reach)
            got = variational.torque_slope(brake, v, low, high, arm)
            nearest = sign * min(max(sign * v, 0.0), inside)
            assert got == pytest.approx(torque_slope(system, nearest), rel=1e-9)


def variational_solution(system, state):
    """(state, matrix, log of the determinant) after a period: SciPy, analytic slope of the law.

    The last by Liouville's formula, minus the integral of (c + M')/J. Kinks are left to the
    step control.
    """
    line, motion = system.driveline, right_side(system)

    def rates(t, y):
        damping = (line.damping + torque_slope(system, y[1] + line.drive_speed)) / line.inertia
        spring = line.stiffness / line.inertia
        pushed = (-damping * y[k + 1] - spring * y[k] for k in (2, 4))
        return (*motion(t, y), y[3], next(pushed), y[5], next(pushed), -damping)

    y0 = (*state, 1.0, 0.0, 0.0, 1.0, 0.0)
    end = 2.0 * math.pi / angular_frequency(system)
    answer = solve_ivp(rates, (0.0, end), y0, "DOP853", rtol=1e-12, atol=1e-14, max_step=2e-4)
    assert answer.status == 0
    y = answer.y[:, -1]
    return y[:2], np.array([[y[2], y[4]], [y[3], y[5]]]), y[6]


@pytest.mark.parametrize("name", ANALYTIC)
def test_against_scipy_with_the_slope_of_tanh(name):
    """Every way apart: other steps, the slope by hand, and the determinant from Liouville."""
    system, state, _, _ = CASES[name]
    expected, matrix, area = variational_solution(system, state)
    end, got = passed(problem(system, 1e-12), state)
    assert end == pytest.approx(expected, rel=1e-10)
    largest = np.max(np.abs(scaled(system, matrix)))
    error = np.max(np.abs(scaled(system, got - matrix)))
    assert error <= 1e-9 * largest
    # A determinant far below the entries is a difference of almost equal products.
    room = 1e-9 * largest**2
    assert np.linalg.det(got) == pytest.approx(math.exp(area), rel=1e-9, abs=room)


@pytest.mark.parametrize(
    "system",
    [paper(kinetic=0.0, static=0.0), paper(initial_force=0.0, slope=-40.0), paper(amplitude=0.0)],
    ids=["no friction", "never pressed", "at rest"],
)
def test_linear_systems_in_closed_form(system):
    """The matrix exponential; at rest in the layer, with the slope of tanh at zero."""
    state = (0.0, 0.0) if system.excitation.amplitude == 0.0 else (0.01, 3.0)
    line = system.driveline
    damping = line.damping
    if system.excitation.amplitude == 0.0:
        damping += torque_slope(system, 0.0)
    rates = np.array([[0.0, 1.0], [-line.stiffness / line.inertia, -damping / line.inertia]])
    expected = expm(rates * (2.0 * math.pi / angular_frequency(system)))
    _, got = passed(problem(system, 1e-12), state)
    assert scaled(system, got) == pytest.approx(scaled(system, expected), abs=1e-11)


@pytest.mark.parametrize("name", CASES)
def test_derivative_leaves_the_motion_alone(name):
    system, state, _, _ = CASES[name]
    given = problem(system, 1e-9)
    run = wb.simulate(system, periods=1, initial=state, times=[]).attrs
    there = advance(given, state, 1, MOST)
    assert there.state == tuple(passed(given, state)[0])
    assert there.state == (run["final_angle"], run["final_velocity"])
    assert there.matrices.shape == (0, 2, 2)


DIVERGING = wb.paper.system(friction="smoothed", release=False, damping=1.0)


@pytest.mark.parametrize(
    ("system", "velocity", "of_divergence", "most", "outcome"),
    [
        (paper(), 1.0, 0.0, 10, Outcome.STEP_LIMIT),
        (paper(eta=0.0, alpha=0.9), 2.0, 0.0, MOST, Outcome.NO_FORWARD_SOLUTION),
        (DIVERGING, 0.0, 0.999, MOST, Outcome.DIVERGED),
    ],
    ids=["step limit", "beyond the wall", "divergence"],
)
def test_not_completed(system, velocity, of_divergence, most, outcome):
    """From a velocity [rad/s] plus a share of that at which the motion counts as divergent."""
    given = problem(system, 1e-9)
    velocity += of_divergence * given.problem.divergence_velocity
    got = advance(given, (0.0, velocity), 1, most, derivative=True)
    assert got.outcome == outcome
    assert got.matrices.shape == (0, 2, 2)
