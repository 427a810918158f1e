"""Systems that differ only by rounding must have the same verdict.

What another processor or another library rounds otherwise is here a change of the system itself.
"""

from __future__ import annotations

import math

import numpy as np
import pytest

import wedgebrake as wb

EPS = float(np.finfo(float).eps)
# The 2T motion of the paper's wedge at eta = -21, F_0 = 0.036. Without a stick, it is reached very
# slowly (its multipliers are 0.07 +- 0.985 i), and chaos about it lasts for some 10 000 periods.
FOCUS = wb.paper.system(eta=-21.0, F0=0.036)
ON_IT = (-0.04682642281644842, 4.979139039508842)


@pytest.mark.parametrize(
    ("f", "order"), [(1 / 2, 1), (1 / 3, 1), (1 / 4, 1), (2 / 3, 2), (3 / 4, 3)]
)
@pytest.mark.parametrize("transient", ["auto", 200])
def test_order_of_a_free_vibration(f, order, transient) -> None:
    """At the section of 1/f periods both angle and velocity vanish: all of it is rounding."""
    system = wb.paper.system(f=f).replace(kinetic=0.0, static=0.0, damping=0.0, slope=0.0)
    for amplitude in np.linspace(500.0, 512.0, 8).tolist():
        found = wb.motion(system.replace(amplitude=amplitude), transient=transient)
        assert (found.order, found.settled) == (order, True), (amplitude, found.verdict)
        # Nothing grows or decays.
        exponents = found.largest_exponent, found.second_exponent
        assert exponents == pytest.approx((0.0, 0.0), abs=1e-9)


@pytest.mark.parametrize("transient", [1800, 2600])
def test_order_of_a_focus(transient) -> None:
    """Its returns after two orbits shrink before those after one do, or not, by where it is."""
    for turn in np.linspace(0.0, 2.0 * math.pi, 16, endpoint=False).tolist():
        start = ON_IT[0] * (1.0 + 1e-3 * math.cos(turn)), ON_IT[1] * (1.0 + 1e-3 * math.sin(turn))
        found = wb.motion(FOCUS, transient + 200, transient=transient, initial=start)
        assert found.word == "2T-periodic", (turn, found.verdict)


def test_branches_begin_behind_a_chaotic_transient() -> None:
    """The wait ends before the transient for about every other last bit."""
    begins = []
    for number in range(8):
        system = FOCUS.replace(amplitude=FOCUS.excitation.amplitude * (1.0 + number * EPS))
        data = wb.branches(system, eta=(-21.0, -22.0), switch=0, opposite=False, points=2)
        begins.append((int(data["order"][0]), bool(data["stable"][0])))
    assert set(begins) <= {(2, True), (4, True)}


@pytest.mark.parametrize("step", [0.02, 0.01])
def test_boundary_ends_at_the_resonance_whatever_the_step(step) -> None:
    """The torus of the 2T motion, to where both multipliers of the synchronous one are -1."""
    start = wb.orbit(wb.paper.system(eta=-18.0, F0=0.036), 2)
    [torus] = [
        point
        for point in wb.continuation(start, eta=(-18.0, -22.0))
        if point.bifurcation and point.bifurcation.kind.value == "Neimark-Sacker"
    ]
    found = wb.boundary(torus, step=step, eta=(-22.0, -10.0), F0=(0.03, 0.06))
    # As Newton's method on det = 1 and trace = -2 of the synchronous orbit alone gives it.
    end = found.eta.values[0], found.F0.values[0]
    assert end == pytest.approx((-18.04575465, 0.03069607), rel=1e-7)
