"""Leine's block on a belt: stick-slip from friction that falls with speed.

Leine, van Campen, de Kraker and van den Steen, "Stick-slip vibrations induced by alternate
friction models", Nonlinear Dynamics 16 (1998): m = 1 kg, k = 1 N/m, belt at 0.2 m/s,
F = F_s/(1 + delta |v_rel|), F_s = 1 N, delta = 3 s/m, no damping; the friction is smoothed by
(2/pi) arctan(eps v_rel).

The parameters are the published ones. The truth for the set-valued law is our own: the
sticking block leaves at x = F_s/k with the belt's speed, whatever came before, so one slip,
integrated by SciPy to 1e-13 from there to the next stick, is the whole limit cycle.

For eps = 1e3 Leine's own programs (github.com/rleine/Keynote_Nonsmooth_Dynamics_ENOC2024,
stickslip_system/script.m) state the arctan limit cycle to the digits that a picture needs:
it passes (1.067, 0) and closes after 11.3 s; and start the set-valued one at (1.135, 0).
"""

from __future__ import annotations

import math

import numba
import numpy as np
import pytest

import wedgebrake as wb
from stick_slip import stick_slip

BELT, FALL = 0.2, 3.0
SPEEDS = 1.6  # m/s, more than the block reaches relative to the belt


@pytest.fixture(scope="module")
def truth() -> dict[str, float]:
    """Period, stick [s], displacements where the stick begins and farthest [m]."""
    cycle = stick_slip(lambda speed: 1.0 / (1.0 + FALL * speed), BELT)
    stick = cycle.period - cycle.slip
    return {
        "period": cycle.period, "stick": stick, "catch": 1.0 - BELT * stick,
        "furthest": cycle.highest,
    }  # fmt: skip


def block(friction: wb.SetValuedFriction | wb.CustomFriction) -> wb.BrakedDriveline:
    """theta = -x: the sliding speed is then BELT + theta', and the friction the brake's."""
    return wb.BrakedDriveline(
        driveline=wb.Driveline(inertia=1.0, damping=0.0, stiffness=1.0, drive_speed=BELT),
        brake=wb.ConventionalBrake(radius=1.0),
        friction=friction,
        actuation=wb.Actuation(initial_force=1.0, slope=0.0),
        excitation=wb.HarmonicTorque(amplitude=0.0, frequency=0.1),
    )


START = (-0.9, -BELT)  # sticking


def smoothed(step, eps: float) -> wb.CustomFriction:
    return wb.CustomFriction(law=lambda v: step(eps * v) / (1.0 + FALL * abs(v)), width=1.0 / eps)


@numba.njit
def arctan(x):
    return 2.0 / math.pi * math.atan(x)


def smooth_cycle(friction: wb.CustomFriction) -> tuple[float, float, float]:
    """(period, furthest displacement, time in the layer) of the second cycle."""
    times = np.linspace(0.0, 26.0, 26_001)
    r = wb.simulate(block(friction), 26.0, initial=START, times=times, rtol=1e-9)
    x, v = -r.angle.values, -r.velocity.values
    tops = np.flatnonzero((v[:-1] > 0.0) & (v[1:] <= 0.0))
    when = times[tops] + (times[tops + 1] - times[tops]) * v[tops] / (v[tops] - v[tops + 1])
    sticks = (r.stick_end - r.stick_start).values
    return when[1] - when[0], float(np.max(x[tops[1] - 5 : tops[1] + 5])), sticks[1]


def test_the_set_valued_cycle_is_leines(truth):
    assert truth["furthest"] == pytest.approx(1.135, abs=2e-3)
    assert truth["period"] < 12.3  # Leine's window, which his curve closes in


def test_exact_solver_converges_to_it(truth):
    """A table of n intervals, its torque linear between the points: second order.

    Measured: 1.8, 1.9, 1.92, from the slip's beginning, where the speed grows like exp(3 t)
    out of the first interval.
    """
    errors = []
    for n in (80, 160, 320, 640):
        speeds = np.linspace(0.0, SPEEDS, n + 1)
        table = wb.TabulatedFriction(
            speeds=tuple(speeds), coefficients=tuple(1.0 / (1.0 + FALL * speeds))
        )
        times = np.linspace(0.0, 40.0, 40_001)
        r = wb.simulate(block(table), 40.0, initial=START, times=times, method="exact")
        start, end = r.stick_start.values, r.stick_end.values
        errors.append(
            [
                end[2] - end[1] - truth["period"],
                end[1] - start[1] - truth["stick"],
                float(-r.angle.min()) - truth["furthest"],
            ]
        )
    sizes = np.abs(errors)
    orders = np.log2(sizes[:-1] / sizes[1:])
    assert np.all((orders > 1.75) & (orders < 2.05))
    assert np.all(np.diff(orders, axis=0) > 0.0)
    assert np.all(sizes[-1] <= 1e-4)


def test_arctan_cycle_is_leines():
    period, furthest, _ = smooth_cycle(smoothed(arctan, 1e3))
    assert period == pytest.approx(11.3, abs=0.01)
    assert furthest == pytest.approx(1.067, abs=1e-3)


def test_arctan_tends_to_the_set_valued_law_slowly(truth):
    """The block leaves before the load reaches F_s, by about 2.8/sqrt(eps) of it.

    That is where (2/pi) arctan(eps u) - 3 u has its maximum, 1 - 2 sqrt(6/(pi eps)).
    Measured orders of the period's error in 1/eps: 0.56, 0.59, 0.62.
    """
    errors = []
    for eps in (1e3, 1e4, 1e5, 1e6):
        period, _, stay = smooth_cycle(smoothed(arctan, eps))
        errors.append(truth["period"] - period)
        # The layer |eps u| <= 1 is left and entered where the spring pulls with F_s/2.
        # (At eps = 1e3 the block is caught later than that.)
        assert eps < 1e4 or stay == pytest.approx(1.0 / BELT, abs=2e-3)
    orders = np.log10(np.array(errors[:-1]) / np.array(errors[1:]))
    assert np.all((orders > 0.5) & (orders < 0.7))
    assert 0.0 < errors[-1] < 0.0125


def test_tanh_tends_to_the_set_valued_law_faster(truth):
    """Its tail is exponential: first order but for a logarithm. Measured: 0.91, 0.93."""
    errors = []
    for eps in (1e3, 1e4, 1e5):
        period, furthest, stay = smooth_cycle(smoothed(math.tanh, eps))
        errors.append(truth["period"] - period)
    # Entered at the catch, left where the spring pulls with tanh(1) F_s.
    assert stay == pytest.approx((math.tanh(1.0) - truth["catch"]) / BELT, abs=2e-3)
    assert furthest == pytest.approx(truth["furthest"], abs=2e-4)
    orders = np.log10(np.array(errors[:-1]) / np.array(errors[1:]))
    assert np.all((orders > 0.85) & (orders < 1.0))
    assert 0.0 < errors[-1] < 2e-3
