"""The class of a motion on systems where it is known."""

from __future__ import annotations

import math

import numpy as np
import pytest

import wedgebrake as wb
from wedgebrake.dynamics.enums import MotionClass

GOLDEN = (math.sqrt(5.0) - 1.0) / 2.0


def linear(f: float, damping: float) -> wb.BrakedDriveline:
    """Without friction: forced part and free vibration."""
    return wb.paper.system(f=f).replace(kinetic=0.0, static=0.0, damping=damping, slope=0.0)


def test_incommensurate_free_vibration_is_quasi_periodic() -> None:
    found = wb.motion(linear(GOLDEN, 0.0))
    assert found.kind == "quasi-periodic"
    assert abs(found.largest_exponent) < 1e-9
    # Fifty periods cannot tell it from a resonance of high order.
    assert wb.motion(linear(GOLDEN, 0.0), transient=200).kind == "undecided"


def test_slow_settling_is_undecided_in_a_record_and_synchronous_by_its_rate() -> None:
    """c/2J = 0.05 1/s: after 25 s a quarter of the free vibration is left."""
    system = linear(0.63, 0.1)
    early = wb.motion(system, 250, transient=200)
    assert early.kind == "undecided"
    assert not early.settled
    late = wb.motion(system)
    assert late.kind == "synchronous"
    assert late.largest_exponent == pytest.approx(-0.05, rel=1e-6)
    assert late.second_exponent == pytest.approx(-0.05, rel=1e-6)
    # Its distance falls as exp(-0.05 t), from about the size of the motion to 1e-5 of it.
    seconds = late.settling / system.excitation.frequency
    assert math.log(1e5) / 0.05 == pytest.approx(seconds, rel=0.1)
    assert late.transient >= late.settling
    short = wb.motion(system, limit=1200)
    assert (short.kind, short.settling) == ("synchronous", pytest.approx(late.settling, rel=0.01))


TURNING = wb.BrakedDriveline(
    driveline=wb.Driveline(inertia=2.4, damping=2.77, stiffness=8000.0, drive_speed=40.0),
    brake=wb.WedgeBrake(angle=math.radians(22.0), radius=0.13),
    friction=wb.CoulombFriction(kinetic=0.3),
    actuation=wb.Actuation(initial_force=4000.0, slope=-2.0),
    excitation=wb.HarmonicTorque(amplitude=300.0, frequency=23.0),
)


@pytest.mark.parametrize(
    ("system", "order"),
    [
        (linear(0.63, 0.1), 1),
        (TURNING, 1),
        (wb.paper.system(eta=-16.08406, F0=0.036), 1),
        (wb.paper.system(eta=-57.51171, F0=0.06), 2),
    ],
    ids=["linear", "turning shaft", "reversals", "sticks"],
)
def test_orbit_that_is_approached_slowly_is_that_of_a_long_run(system, order) -> None:
    """The record is on the orbit that every period of a long run approaches."""
    slope = system.actuation.slope
    found = wb.sweep(system, slope=[slope], transient="auto").isel(slope=0)
    assert int(found["order"]) == order
    weight = [system.driveline.natural_frequency, 1.0]
    points = wb.poincare(system, periods=5000, transient=0)
    states, record = (
        weight * np.column_stack([one["angle"], one["velocity"]]) for one in (points, found)
    )
    orbit = states[-order:][(np.arange(len(states)) - len(states)) % order]
    begin, size = int(found["transient"]), float(found["size"])
    np.testing.assert_allclose(record, orbit[begin : begin + len(record)], atol=1e-9 * size)
    away = np.linalg.norm(states - orbit, axis=1) > 1e-5 * size
    assert float(found["settling"]) == pytest.approx(np.flatnonzero(away)[-1] + 1, rel=0.02)


def test_few_points_of_a_sweep_over_a_turning_shaft_are_undecided() -> None:
    """Steady sliding is unstable with the first slope and stable with the second.

    Nearly all motions with the first slope are tori, which 2048 periods often do not prove.
    """
    driveline = wb.Driveline(inertia=2.4, damping_ratio=0.01, stiffness=8000.0, drive_speed=40.0)
    friction = wb.TabulatedFriction(speeds=(0.0, 2.0), coefficients=(0.34, 0.29))
    system = TURNING.replace(driveline=driveline, friction=friction)
    slopes = [-60.0, -2.0]
    assert [wb.stability(system.replace(slope=one)).stable for one in slopes] == [False, True]
    found = wb.sweep(system, slope=slopes, frequency=np.linspace(5.0, 40.0, 100), limit=8192)
    kinds = found["motion"].values
    assert np.mean(kinds == MotionClass.UNDECIDED) <= 0.05
    # Without events the second one is linear.
    linear_ones = found["events"].values[1] == 0
    assert linear_ones.sum() > 50
    assert np.all(kinds[1, linear_ones] == MotionClass.SYNCHRONOUS)


def test_transient_chaos_ends_on_six_periods() -> None:
    """Unpredictable for about 11 s; then 6T (docs/equations.md, "The paper's parameters")."""
    system = wb.paper.system(eta=-24.0, F0=0.036)
    found = wb.motion(system)
    assert (found.kind, found.order) == ("periodic", 6)
    assert found.stick_class == "bidirectional stick-slip"
    assert found.largest_exponent < 0.0
    assert found.transient >= found.settling
    seconds = found.settling / system.excitation.frequency
    assert 10.0 < seconds < 20.0
    # Sticks in a period of the torque: a whole number in six.
    assert 6.0 * found.sticks_forward == pytest.approx(round(6.0 * found.sticks_forward))
    # While it lasts, it is chaos: neighbours part.
    early = wb.motion(system, 100, transient=10)
    assert early.kind == "chaotic"


def test_rest() -> None:
    found = wb.motion(wb.paper.system(eta=0.0, F0=0.5))
    assert (found.kind, found.stick_class) == ("at rest", "at rest")
    assert (found.largest_exponent, found.second_exponent) == (0.0, -math.inf)
    assert found.stick_share == 1.0
    assert found.friction_power == 0.0


def test_exponents_of_a_motion_of_two_periods_are_those_of_its_map() -> None:
    """Per period of the torque: half the logarithms of the multipliers, here by differences."""
    system, step = wb.paper.system(eta=-18.0, F0=0.036), 1e-6
    found = wb.motion(system)
    assert (found.kind, found.order) == ("periodic", 2)
    start = np.array(wb.orbit(system, order=2).points[0])
    ends = []
    for change in step * np.vstack([np.eye(2), -np.eye(2)]):
        end = wb.simulate(system, periods=2, initial=tuple(start + change), times=[])
        ends.append([float(end[f"poincare_{name}"][-1]) for name in ("angle", "velocity")])
    columns = (np.array(ends[:2]) - ends[2:]) / (2.0 * step)
    expected = np.sort(np.log(np.abs(np.linalg.eigvals(columns.T))))[::-1] / 2.0
    exponents = np.array([found.largest_exponent, found.second_exponent])
    np.testing.assert_allclose(exponents / system.excitation.frequency, expected, rtol=1e-5)


def test_without_a_spring_the_angle_does_not_matter() -> None:
    """A free driveline on a turning brake settles to one velocity; its angle runs on."""
    system = wb.paper.system(eta=0.0, F0=0.5, damping=1.0).replace(
        stiffness=0.0, drive_speed=50.0, initial_force=10.0, slope=0.0, amplitude=3.0
    )
    found = wb.motion(system, initial=(0.0, 30.0))
    assert found.kind == "synchronous"
    assert found.largest_exponent == pytest.approx(0.0, abs=1e-6)
    assert found.second_exponent == pytest.approx(-1.0, rel=1e-6)


def test_ends_that_are_answers() -> None:
    grown = wb.motion(wb.paper.system(eta=-24.0, damping=1.0, release=False))
    assert (grown.kind, grown.status) == ("diverged", "diverged")
    locked = wb.motion(wb.paper.system(eta=0.0, F0=0.02, alpha=0.5), initial=(0.0, 5.0))
    assert (locked.kind, locked.status) == ("self-locked", "no_forward_solution")
    cut = wb.motion(wb.paper.system(), max_events=50)
    assert (cut.kind, cut.status) == ("undecided", "event_limit")
    for one in (grown, locked, cut):
        assert one.verdict
        assert one.as_dict()["verdict"] == one.verdict


def test_smooth_friction_agrees_where_nothing_is_steep() -> None:
    """Synchronous sliding without a stop: both laws have the same exponents."""
    exact = wb.motion(wb.paper.system(eta=-10.0, F0=0.036))
    smooth = wb.motion(wb.paper.system(eta=-10.0, F0=0.036, friction="smoothed"))
    two = wb.motion(wb.paper.system(eta=-24.0, F0=0.067, friction="smoothed"), 120, transient=80)
    assert (two.kind, two.order) == ("periodic", 2)
    assert math.isnan(two.second_exponent) or two.second_exponent < -10.0
    assert exact.kind == smooth.kind == "synchronous"
    assert smooth.peak_torque == pytest.approx(exact.peak_torque, rel=0.02)
    assert smooth.friction_power == pytest.approx(exact.friction_power, rel=0.02)
    assert smooth.largest_exponent == pytest.approx(exact.largest_exponent, rel=0.1)


@pytest.mark.parametrize(
    ("changes", "periods"),
    [({"F0": 0.036}, 10), ({"static": 0.33, "drive_speed": 3.0}, 10), ({}, 130)],
    ids=["series", "static peak, turning", "many windows"],
)
def test_smooth_sums_are_those_of_the_response(changes, periods) -> None:
    """Integrals along the solver's own steps, and over the samples of a response."""
    system = wb.paper.system(eta=-6.0, friction="smoothed").replace(**changes)
    found = wb.motion(system, periods + 5, transient=5)
    # A motion that repeats is measured over the orbit that follows the record.
    first, measured = (periods + 5, found.order) if found.order else (5, periods)
    response = wb.simulate(system, periods=first + measured, samples_per_period=2000, rtol=1e-9)
    start = first / system.excitation.frequency
    work, rest = wb.energy(response, start).attrs, wb.sticks(response, start).attrs
    assert found.friction_power == pytest.approx(work["mean_friction_power"], rel=1e-6)
    assert found.peak_torque == pytest.approx(work["largest_peak_torque"], rel=1e-5)
    assert found.stick_share == pytest.approx(rest["share"], abs=1e-6)
    assert found.stick_class == rest["class"]
    assert found.sticks_forward == pytest.approx(rest["count_forward"] / measured, abs=1e-12)
    assert found.sticks_backward == pytest.approx(rest["count_backward"] / measured, abs=1e-12)


def test_rest_on_a_turning_shaft_is_not_for_ever() -> None:
    """Sticks of many torque periods: the spring winds up, and slip comes."""
    system = wb.BrakedDriveline(
        driveline=wb.Driveline(inertia=1.0, damping=0.5, stiffness=100.0, drive_speed=0.05),
        brake=wb.ConventionalBrake(radius=0.2),
        friction=wb.CoulombFriction(kinetic=0.2, static=0.3),
        actuation=wb.Actuation(initial_force=300.0),
        excitation=wb.HarmonicTorque(amplitude=5.0, frequency=10.0),
    )
    assert wb.motion(system).kind != "at rest"
    assert wb.motion(system, transient=200).kind != "at rest"
    # Without a torque, and still.
    steady = system.replace(amplitude=0.0, static=0.2, frequency=1.0, drive_speed=5.0)
    assert wb.motion(steady, initial=(-0.12, 0.0)).kind == "steady sliding"


def test_numbers_at_rest_are_those_of_rest() -> None:
    """A slip that ends in the record counts neither as stick nor as heat."""
    system = wb.paper.system(eta=0.0, F0=0.5, brake="conventional").replace(amplitude=0.0)
    for transient in (0, "auto"):
        found = wb.motion(system, crossings=20, transient=transient, initial=(0.05, 0.0))
        assert (found.kind, found.stick_class) == ("at rest", "at rest")
        assert (found.stick_share, found.sticks_forward, found.friction_power) == (1.0, 0.0, 0.0)
        held = abs(1e4 * wb.simulate(system, periods=20, initial=(0.05, 0.0)).attrs["final_angle"])
        assert found.peak_torque == pytest.approx(held, rel=1e-9)


def test_exponents_that_doubles_can_hardly_hold() -> None:
    """Overdamped, and a period of the torque of ten minutes: exp(-1300) in each."""
    system = wb.paper.system(F0=1.0).replace(
        kinetic=0.0, static=0.0, slope=0.0, damping=50.0, stiffness=100.0, frequency=1.6e-3
    )
    found = wb.motion(system, 260, transient=200)
    root = math.sqrt(25.0**2 - 100.0)
    assert found.largest_exponent == pytest.approx(-25.0 + root, rel=1e-9)
    assert found.second_exponent == pytest.approx(-25.0 - root, rel=1e-9)
