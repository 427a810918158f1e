"""Margins against closed forms and bisection by hand."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from scipy import stats

import wedgebrake as wb

SYSTEM = wb.load_study(Path(__file__).parents[2] / "examples" / "paper.toml").system
TANGENT, DAMPING, RADIUS = math.tan(SYSTEM.brake.angle), 0.1, 0.2
FRICTION = 0.3


def hopf_slope(friction):
    """Slope below which forward sliding is unstable: c + slope R mu/(tan alpha - mu) = 0."""
    return -DAMPING * (TANGENT - friction) / (RADIUS * friction)


def test_slope_of_stable_sliding():
    found = wb.margin(SYSTEM, "slope", between=(-60.0, 12.0))
    assert found.low == pytest.approx(hopf_slope(FRICTION), rel=1e-9)
    assert found.high is None
    assert found.margin == pytest.approx(SYSTEM.actuation.slope - hopf_slope(FRICTION), rel=1e-9)
    assert not found.holds
    assert found.monotone
    assert "N s/rad" in found.verdict
    assert found.low == pytest.approx(wb.stability(SYSTEM).forward.hopf_slope, rel=1e-9)


def test_of_a_machine():
    found = wb.margin(SYSTEM.machine, "brake.slope", between=(-60.0, 12.0))
    assert found.low == pytest.approx(hopf_slope(FRICTION), rel=1e-9)


def test_friction_that_does_not_lock():
    found = wb.margin(SYSTEM, "kinetic", "no self-locking", between=(0.1, 0.5))
    assert found.high == pytest.approx(TANGENT, rel=1e-9)
    assert found.holds
    assert found.margin == pytest.approx(TANGENT - FRICTION, rel=1e-8)


def test_over_a_range():
    """The highest friction decides."""
    frictions = np.linspace(0.28, 0.34, 7)
    found = wb.margin(SYSTEM, "slope", between=(-60.0, 12.0), over={"kinetic": frictions})
    assert found.low == pytest.approx(hopf_slope(0.34), rel=1e-9)
    assert "kinetic from 0.28 to 0.34" in found.verdict


def test_the_verdict_claims_nothing_between_the_values():
    """Between 5 and 40 Hz there is a resonance, which two values do not show."""
    system = SYSTEM.replace(slope=0.0, initial_force=30.0)
    name, between = "amplitude", (50.0, 900.0)
    ends = {"frequency": np.array([5.0, 40.0])}
    found = wb.margin(system, name, "amplitude < 20", between=between, over=ends, points=9)
    assert found.holds
    assert "2 values of frequency from 5 to 40" in found.verdict
    resonant = wb.margin(
        system, name, "amplitude < 20", between=between, over={"frequency": 15.9}, points=9
    )
    assert not resonant.holds
    assert "at frequency = 15.9" in resonant.verdict


def test_a_peak_within_a_range_decides():
    """At resonance the amplitude of the speed is the torque over the damping."""
    line = wb.Machine(
        inertias=[wb.Inertia("disc", 2.0)],
        shafts=[wb.Shaft("disc", "ground", name="spring", stiffness=3000.0, damping=4.0)],
        torques=[wb.Torque("disc", wb.Harmonic(30.0, 6.0), name="engine")],
    )
    given = {"between": (2.0, 12.0), "points": 5, "transient": 400, "periods": 420}
    found = [
        wb.margin(line, "spring.damping", "amplitude < 5", over={"engine.frequency": one}, **given)
        for one in (np.linspace(2.0, 10.0, 5), (2.0, 10.0), (10.0, 2.0))
    ]
    assert found[0].low < 5.9  # at the nearest value
    for one in found[1:]:
        assert one.low == pytest.approx(6.0, rel=3e-4)
        assert not one.holds


def test_a_range_and_values():
    """The highest friction and the smallest angle decide; the ends of a range are examined."""
    over = {"kinetic": (0.28, 0.34), "angle": [0.35, SYSTEM.brake.angle]}
    found = wb.margin(SYSTEM, "slope", between=(-60.0, 12.0), over=over, points=5)
    given = {"kinetic": np.linspace(0.28, 0.34, 5), "angle": over["angle"]}
    assert found.low == wb.margin(SYSTEM, "slope", between=(-60.0, 12.0), over=given, points=5).low


@pytest.mark.parametrize("criterion", ["torque < 300", "rms_torque < nan"])
def test_a_wrong_limit_is_one_of_the_criterion(criterion):
    with pytest.raises(wb.InputError) as error:
        wb.margin(SYSTEM, "slope", criterion, between=(-60.0, 12.0))
    assert error.value.name == "criterion"


@pytest.mark.parametrize("quantile", [0.5, 0.95])
def test_with_a_probability(quantile):
    law = stats.norm(0.3, 0.01)
    found = wb.margin(
        SYSTEM, "slope", between=(-2.0, 1.0), scatter={"kinetic": law}, quantile=quantile,
        samples=64, points=9,
    )  # fmt: skip
    # The points of one dimension lie one in each 64th of the distribution.
    near = [hopf_slope(law.ppf(quantile + way / 64)) for way in (-1.01, 1.01)]
    assert near[0] <= found.low <= near[1]


def test_a_limit_against_bisection_by_hand():
    """The force at which the amplitude falls below a limit."""
    system = SYSTEM.replace(slope=0.0, damping=20.0)
    settings = {"periods": 4}
    found = wb.margin(
        system, "initial_force", "amplitude < 5", between=(1.0, 300.0), points=9, **settings
    )

    def amplitude(force):
        one = wb.sweep(system, initial_force=[force], **settings)
        return 0.5 * float((one["highest_velocity"] - one["lowest_velocity"])[0])

    (end,) = (one for one in (found.low, found.high) if one is not None)
    low, high = (amplitude(end * (1.0 + way * 2e-2)) < 5.0 for way in (-1, 1))
    assert low != high


def test_not_monotone():
    """A resonance: low and high frequencies hold, those between do not."""
    system = wb.paper.system(brake="conventional", eta=0.0).replace(initial_force=0.0, damping=20.0)
    limit = 2.0
    found = wb.margin(
        system, "frequency", f"amplitude < {limit}", between=(5.0, 60.0), points=29,
        periods=2,
    )  # fmt: skip
    assert not found.monotone
    line, force = system.driveline, system.excitation.amplitude

    def amplitude(frequency):
        omega = 2.0 * math.pi * frequency
        return force * omega / math.hypot(line.stiffness - line.inertia * omega**2, 20.0 * omega)

    (_, first), (second, _) = found.intervals
    for end in (first, second):
        assert amplitude(end) == pytest.approx(limit, rel=1e-3)
    assert "not monotone" in found.verdict


def test_samples_that_change_back_between_two_values_of_the_scan():
    """Of two oscillators one exceeds the limit within a window, in which the other begins to."""
    system = wb.paper.system(brake="conventional", eta=0.0).replace(initial_force=0.0, damping=20.0)
    line, force, limit = system.driveline, system.excitation.amplitude, 4.0
    low, middle, high = 5.0, 35.0, 65.0

    def stiffness(frequency):
        return line.inertia * (2.0 * math.pi * frequency) ** 2

    def window(stiffness):
        """Where the amplitude of the speed is the limit: k/w - J w = +- sqrt((F/v)^2 - c^2)."""
        width = math.sqrt((force / limit) ** 2 - 20.0**2)
        root = math.sqrt(width**2 + 4.0 * line.inertia * stiffness)
        return [(way * width + root) / (4.0 * math.pi * line.inertia) for way in (-1.0, 1.0)]

    values = [stiffness(22.0), stiffness(38.0)]
    (begin, end), (other, last) = map(window, values)
    assert low < begin < other < end < middle < last < high
    for given in (
        {"over": {"stiffness": values}}, {"scatter": {"stiffness": values}, "quantile": 1.0}
    ):  # fmt: skip
        found = wb.margin(
            system, "frequency", f"amplitude < {limit}", between=(low, high), points=3,
            periods=2, **given,
        )  # fmt: skip
        assert found.intervals[0] == (low, pytest.approx(begin, rel=1e-3))
        assert found.intervals[1] == (pytest.approx(last, rel=1e-3), high)


def test_the_unit_of_a_limit_is_in_the_verdict():
    found = wb.margin(SYSTEM, "slope", "peak_torque < 1e9", between=(0.0, 1.0), points=3, periods=2)
    assert found.verdict.endswith("peak_torque is below 1e+09 N m.")


def test_wrong_settings_of_the_runs_are_not_blamed_on_the_parameter():
    with pytest.raises(wb.InputError) as raised:
        wb.margin(SYSTEM, "slope", "no stick-slip", between=(0.0, 1.0), transient=60, periods=60)
    assert raised.value.name == "transient"
    assert "slope" not in str(raised.value)


def test_nowhere_and_everywhere():
    nowhere = wb.margin(SYSTEM, "slope", between=(-60.0, -40.0))
    assert (nowhere.low, nowhere.high, nowhere.margin) == (None, None, None)
    assert not nowhere.intervals
    everywhere = wb.margin(SYSTEM, "slope", between=(1.0, 12.0))
    assert everywhere.intervals == ((1.0, 12.0),)


@pytest.mark.parametrize(
    "arguments",
    [
        {"parameter": "slop"}, {"parameter": 3}, {"criterion": "safe"},
        {"criterion": "torque < 3"}, {"criterion": "rms_torque < much"}, {"between": (1.0, 1.0)},
        {"between": 3}, {"over": {"slope": [1.0]}}, {"over": {"eta": [-1.0]}},
        {"over": {"kinetik": [0.3]}}, {"store": "margin.zarr"},
        {"over": {"kinetic": []}}, {"over": {"kinetic": (0.3, 0.3)}},
        {"over": {"kinetic": (0.28, 0.3), "angle": (0.34, 0.35)}},
        {"scatter": {}}, {"scatter": {"kinetic": stats.norm(0.3, 0.01)}, "quantile": 2.0},
        {"over": {"kinetic": [0.3]}, "scatter": {"angle": stats.norm(0.3, 0.01)}},
        {"points": 1}, {"colour": 1},
    ],
)  # fmt: skip
def test_wrong_arguments(arguments):
    given = {"parameter": "slope", "between": (-60.0, 12.0), **arguments}
    with pytest.raises(wb.InputError):
        wb.margin(SYSTEM, given.pop("parameter"), **given)


def test_a_torque_without_a_measure_suggests_its_measures():
    with pytest.raises(wb.InputError, match="peak_torque"):
        wb.margin(SYSTEM, "slope", between=(-90.0, 0.0), criterion="torque < 3")
