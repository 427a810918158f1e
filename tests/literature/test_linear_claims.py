"""Linear claims of Chen and Xi (2014), sections 3 and 4, with printed digits.

The audit has the others, on the order of values (``wedgebrake.paper.statements.linear``).
"""

import math

import numpy as np
import pytest

import wedgebrake as wb

MU = 0.30


def system(eta=0.0, alpha=1.18, brake="wedge"):
    return wb.paper.system(eta=eta, alpha=alpha, brake=brake, damping=1.0)


@pytest.mark.parametrize("alpha", [1.03, 1.21, 2.0, 3.43])
def test_s1_critical_slopes_of_the_wedge(alpha):
    """Fig. 2: stable for eta > mu_k - tan(alpha_w); backwards -mu_k - tan(alpha_w)."""
    tangent = alpha * MU
    found = wb.stability(system(alpha=alpha))
    assert found.forward.hopf_eta == pytest.approx(MU - tangent, rel=1e-12)
    assert found.backward.hopf_eta == pytest.approx(-MU - tangent, rel=1e-12)
    for offset in (1e-6, -1e-6):
        verdict = wb.stability(system(eta=MU - tangent + offset, alpha=alpha))
        assert verdict.stable == (offset > 0.0)
        assert verdict.margin_eta == pytest.approx(offset, abs=1e-12)


@pytest.mark.parametrize("kinetic", [0.05, 0.3, 0.9])
def test_s2_critical_slope_of_the_conventional_brake(kinetic):
    one = system(brake="conventional").replace(kinetic=kinetic, static=kinetic)
    found = wb.stability(one)
    assert found.forward.hopf_eta == pytest.approx(-1.0, rel=1e-14)
    assert found.backward.hopf_eta == pytest.approx(-1.0, rel=1e-14)


@pytest.mark.parametrize("brake", ["wedge", "conventional"])
@pytest.mark.parametrize("direction", ["forward", "backward"])
def test_s4_two_node_focus_points_and_one_hopf_point(brake, direction):
    """At the node-focus points h = -+omega_n, at the Hopf point h = 0."""
    found = getattr(wb.stability(system(brake=brake)), direction)
    for eta, h in (
        (found.hopf_eta, 0.0),
        (found.node_focus_stable_eta, -100.0),
        (found.node_focus_unstable_eta, 100.0),
    ):
        there = getattr(wb.stability(system(eta=eta, brake=brake)), direction)
        assert there.growth_rate == pytest.approx(h, abs=1e-9)


def test_s7_amplification_of_figure_4():
    """5.58 forwards, 0.46 backwards, 12 times; at 0.34 rad, not at the printed alpha = 1.03."""
    brake = wb.WedgeBrake(angle=0.34, radius=0.2)
    forward, backward = brake.amplification(MU), -brake.amplification(-MU)
    assert forward == pytest.approx(5.58, abs=0.005)
    assert backward == pytest.approx(0.46, abs=0.005)
    assert forward / backward == pytest.approx(12.0, abs=0.5)
    printed = wb.WedgeBrake(angle=math.atan(1.03 * MU), radius=0.2)
    assert printed.amplification(MU) > 30.0


@pytest.mark.parametrize("brake", ["wedge", "conventional"])
@pytest.mark.parametrize("eta", [-200.0, -24.0, -0.3, 0.0, 5.0, 300.0])
def test_eigenvalues_are_those_of_the_printed_matrix(brake, eta):
    """Eqs. (8) and (23), with NumPy's eigenvalues."""
    one = system(eta=eta, brake=brake)
    found = wb.stability(one)
    for sign, direction in ((1, found.forward), (-1, found.backward)):
        gain = abs(one.brake.amplification(sign * MU))
        matrix = [[0.0, 1.0], [-1e4, -1.0 - 0.2 * one.actuation.slope * gain]]
        expected = sorted(np.linalg.eigvals(matrix), key=lambda z: (z.real, z.imag))
        got = sorted(direction.eigenvalues, key=lambda z: (z.real, z.imag))
        np.testing.assert_allclose(got, expected, rtol=1e-9)
