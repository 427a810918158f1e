"""The characteristic against the formulas of docs/equations.md, "Friction", worked by hand."""

import math

import mpmath
import numpy as np
import pytest

import wedgebrake as wb
from wedgebrake.model.characteristic import characteristic

R, F, DELTA, MU_K, MU_S = 0.2, 300.0, -40.0, 0.30, 0.33
ACTUATION = wb.Actuation(initial_force=F, slope=DELTA)
COULOMB = wb.CoulombFriction(kinetic=MU_K, static=MU_S)


def wedge(alpha):
    return wb.WedgeBrake(angle=math.atan(alpha * MU_K), radius=R)


def test_wedge_has_a_piece_for_each_direction_and_for_release():
    law = characteristic(wedge(1.18), COULOMB, ACTUATION)
    tangent = 1.18 * MU_K
    forward, backward = MU_K / (tangent - MU_K), MU_K / (tangent + MU_K)
    np.testing.assert_allclose(law.breakpoints, [-7.5, 0.0, 7.5], rtol=1e-15)
    np.testing.assert_allclose(
        law.slopes, [0.0, R * DELTA * backward, R * DELTA * forward, 0.0], rtol=1e-13
    )
    np.testing.assert_allclose(
        law.offsets, [0.0, -R * F * backward, R * F * forward, 0.0], rtol=1e-13
    )
    upper, lower = MU_S / (tangent - MU_S), MU_S / (tangent + MU_S)
    np.testing.assert_allclose(law.holding, [-R * F * lower, R * F * upper], rtol=1e-12)


def test_conventional_brake_is_odd():
    law = characteristic(wb.ConventionalBrake(radius=R), COULOMB, ACTUATION)
    v = np.linspace(0.1, 20.0, 57)
    np.testing.assert_allclose(law.torque(v), -law.torque(-v), rtol=1e-14)
    expected = R * MU_K * np.maximum(F + DELTA * v, 0.0)
    np.testing.assert_allclose(law.torque(v), expected, rtol=1e-13, atol=1e-12)
    assert law.holding == pytest.approx((-R * MU_S * F, R * MU_S * F), rel=1e-15)


def test_as_printed_the_force_becomes_negative():
    law = characteristic(
        wedge(1.18), COULOMB, wb.Actuation(initial_force=F, slope=DELTA, release=False)
    )
    assert law.breakpoints.tolist() == [0.0]
    assert law.torque(10.0) < 0.0


@pytest.mark.parametrize("alpha", [1.0, 0.9, 0.33])
def test_self_locking_at_the_kinetic_coefficient_blocks_forward_sliding(alpha):
    law = characteristic(wedge(alpha), COULOMB, ACTUATION)
    assert law.holding[1] == math.inf
    assert math.isfinite(law.holding[0])
    assert law.torque(1.0) == math.inf
    assert law.torque(-1.0) < 0.0
    assert law.torque(8.0) == 0.0  # released, nothing presses


def test_self_locking_at_the_static_coefficient_only_holds():
    law = characteristic(wedge(1.05), COULOMB, ACTUATION)
    assert law.holding[1] == math.inf
    assert 0.0 < law.torque(1.0) < math.inf


def test_nothing_presses():
    law = characteristic(wedge(0.9), COULOMB, wb.Actuation(initial_force=0.0, slope=-1.0))
    assert law.holding == (0.0, 0.0)
    assert law.torque(np.array([-3.0, 3.0])).tolist() == [0.0, 0.0]


@pytest.mark.parametrize(
    ("brake", "gain"),
    [
        (wb.BandBrake(wrap_angle=4.0, radius=R), lambda m: math.exp(4.0 * m) - 1.0),
        (
            wb.LeadingShoeBrake(radius=R, actuation_arm=0.2, normal_arm=0.1, friction_arm=0.08),
            lambda m: 0.2 * m / (0.1 - 0.08 * m),
        ),
    ],
)
def test_other_brakes_differ_in_g_alone(brake, gain):
    law = characteristic(brake, COULOMB, ACTUATION)
    for v in (-5.0, -0.1, 0.1, 5.0):
        m = math.copysign(MU_K, v)
        assert law.torque(v) == pytest.approx(R * (F + DELTA * abs(v)) * gain(m), rel=1e-13)


def test_a_table_of_friction_is_met_at_its_points():
    table = wb.TabulatedFriction(speeds=(0.0, 0.5, 1.0), coefficients=(0.4, 0.3, 0.25), static=0.45)
    law = characteristic(wedge(2.0), table, ACTUATION)
    tangent = math.tan(wedge(2.0).angle)
    for speed, mu in table.nodes():
        v = speed / R + 1e-9
        expected = R * (F + DELTA * v) * mu / (tangent - mu)
        assert law.torque(v) == pytest.approx(expected, rel=1e-7)
    assert law.torque(1.0) < law.torque(0.01)


def test_a_new_brake_is_one_small_class():
    """The promise of the model: state g and a radius, and everything works (docs/extend.md)."""

    class DuoServoBrake(wb.Brake):
        gain: float

        def shape(self):
            return (self.gain,)

        @staticmethod
        def law(m, shape):
            return math.sinh(shape[0] * m)

    system = wb.paper.system(eta=-6.0).replace(brake=DuoServoBrake(radius=R, gain=3.0))
    assert wb.stability(system).forward.hopf_eta == pytest.approx(-0.3 / math.sinh(0.9))
    assert wb.simulate(system, periods=10).attrs["status"] == "completed"


TABLE = wb.TabulatedFriction(speeds=(0.0, 0.5, 1.0), coefficients=(0.4, 0.3, 0.25), static=0.45)


@pytest.mark.parametrize("friction", [COULOMB, TABLE], ids=["coulomb", "table"])
@pytest.mark.parametrize(
    "brake",
    [wedge(2.0), wb.ConventionalBrake(radius=R), wb.BandBrake(radius=R, wrap_angle=4.0)],
    ids=["wedge", "conventional", "band"],
)
def test_the_torque_jumps_at_rest_only_and_there_within_what_is_held(brake, friction):
    law = characteristic(brake, friction, ACTUATION)
    places = law.breakpoints
    left = law.offsets[:-1] + law.slopes[:-1] * places
    right = law.offsets[1:] + law.slopes[1:] * places
    assert np.all(np.diff(places) > 0.0)
    (rest,) = np.flatnonzero(places == 0.0)
    assert law.first_forward == rest + 1
    moving = places != 0.0
    np.testing.assert_allclose(left[moving], right[moving], rtol=1e-12, atol=1e-12)
    assert law.holding[0] <= left[rest] < right[rest] <= law.holding[1]


def test_narrow_places_may_be_lists():
    law = wb.CustomFriction(
        law=lambda v: 0.3 * math.tanh(v / 0.01), width=0.01, narrow=[[0.5, 1e-3]]
    )
    assert law.narrow_places == ((0.5, 1e-3),)


@pytest.mark.parametrize(
    ("static", "decay", "steepness"),
    [(0.33, 6.0, 100.0), (0.6, 2.0, 1e3), (0.3, 6.0, 100.0), (0.33, 300.0, 50.0)],
)
@pytest.mark.parametrize("tolerance", [1e-5, 1e-12])
def test_smoothed_friction_is_constant_from_its_saturation(static, decay, steepness, tolerance):
    """To the tolerance, and not long before it."""
    law = wb.SmoothedFriction(kinetic=MU_K, static=static, decay=decay, steepness=steepness)

    def error(speed):
        with mpmath.workdps(30):
            peak = (mpmath.mpf(static) - MU_K) * mpmath.exp(-decay * speed)
            return abs((MU_K + peak) * mpmath.tanh(steepness * speed) / MU_K - 1)

    saturation = law.saturation(tolerance)
    assert all(error(factor * saturation) <= tolerance for factor in (1.0, 1.1, 3.0))
    assert error(0.8 * saturation) > tolerance
    assert law.limit == MU_K


def test_smoothed_friction_without_kinetic_friction_or_decay():
    """The peak never becomes small beside nothing; one that does not decay is constant."""
    assert wb.SmoothedFriction(kinetic=0.0, static=0.3).saturation(1e-6) == math.inf
    plateau = wb.SmoothedFriction(kinetic=0.3, static=0.5, decay=0.0, steepness=10.0)
    assert plateau.limit == 0.5
    assert 1.0 - math.tanh(10.0 * plateau.saturation(1e-6)) <= 1e-6


def test_smooth_friction_has_no_characteristic():
    with pytest.raises(wb.InputError, match="method='smooth'"):
        _ = wb.paper.system(friction="smoothed").characteristic


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"breakpoints": [1.0]}, "contain 0"),
        ({"breakpoints": [0.0, -1.0], "slopes": [0.0] * 3, "offsets": [0.0] * 3}, "ascend"),
        ({"offsets": [1.0]}, "must be n"),
        ({"breakpoints": [0.0, 1.0]}, "must be n"),
        ({"offsets": [-1.0, 5.0]}, "must contain"),
        (
            {"breakpoints": [0.0, 1.0], "slopes": [0.0] * 3, "offsets": [-1.0, 1.0, 1.0 + 1e-6]},
            "continuous except at 0",
        ),
    ],
)
def test_inconsistent_characteristics_are_refused(change, words):
    good = {"breakpoints": [0.0], "slopes": [0.0, 0.0], "offsets": [-1.0, 1.0],
            "holding": (-1.0, 1.0)}  # fmt: skip
    wb.Characteristic(**good)
    # A difference that rounding makes is no jump, however large the torque.
    more = {"breakpoints": [0.0, 1.0], "slopes": [0.0] * 3, "offsets": [-1e6, 1e6, 1e6 + 1e-5]}
    wb.Characteristic(**more, holding=(-1e6, 1e6))
    with pytest.raises(wb.InputError, match=words):
        wb.Characteristic(**{**good, **change})
