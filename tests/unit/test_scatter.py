"""Scattering parameters: probabilities, intervals, Sobol indices, against closed forms."""

from __future__ import annotations

import math
from itertools import product
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from scipy import stats
from scipy.optimize import brentq

import wedgebrake as wb
from wedgebrake.dynamics.enums import MotionClass
from wedgebrake.sweeps.outcomes import wilson
from wedgebrake.sweeps.results import PointStatus

ANGLE, DAMPING, SLOPE, RADIUS, INERTIA = math.atan(0.354), 0.1, -1.0, 0.2, 1.0
SYSTEM = wb.BrakedDriveline(
    driveline=wb.Driveline(inertia=INERTIA, damping=DAMPING, stiffness=1e4),
    brake=wb.WedgeBrake(radius=RADIUS, angle=ANGLE),
    friction=wb.CoulombFriction(kinetic=0.3),
    actuation=wb.Actuation(initial_force=300.0, slope=SLOPE),
    excitation=wb.HarmonicTorque(amplitude=500.0, frequency=10.0),
)
FRICTION = stats.uniform(0.05, 0.4)
LINEAR = ["unstable_forwards", "self_locked"]
# Friction at which steady sliding forwards loses its stability, and at which the brake locks.
HOPF = math.tan(ANGLE) * DAMPING / (DAMPING + abs(SLOPE) * RADIUS)
LOCKS = math.tan(ANGLE)


def probability(found, outcome):
    one = found.sel(outcome=outcome)
    return float(one["low"]), float(one["probability"]), float(one["high"])


def test_the_limits_are_those_of_stability():
    for limit, inner in ((HOPF, lambda one: one.stable), (LOCKS, lambda one: not one.locked)):
        below, above = (
            wb.stability(SYSTEM.replace(kinetic=limit * (1.0 + way * 1e-9))).forward
            for way in (-1, 1)
        )
        assert inner(below)
        assert not inner(above)


# Of one outcome, fewer are inside with a probability of 3 % and of 13 %.
@pytest.mark.parametrize(
    ("seeds", "fewest"), [(25, 22), pytest.param(100, 93, marks=pytest.mark.slow)]
)
def test_intervals_contain_the_closed_form(seeds, fewest):
    exact = {"unstable_forwards": FRICTION.sf(HOPF), "self_locked": FRICTION.sf(LOCKS)}
    inside = dict.fromkeys(exact, 0)
    for seed in range(seeds):
        found = wb.scatter(SYSTEM, {"kinetic": FRICTION}, samples=128, seed=seed, outcomes=LINEAR)
        for name, value in exact.items():
            low, _, high = probability(found, name)
            inside[name] += low <= value <= high
    assert min(inside.values()) >= fewest


@pytest.mark.parametrize(("count", "total"), [(0, 10), (3, 10), (512, 1024), (10, 10)])
def test_wilson_solves_its_equation(count, total):
    """At the ends of the interval the share is 1.96 standard deviations away."""
    low, high = wilson(count, total)
    share, z = count / total, stats.norm.ppf(0.975)

    def distance(value):
        return (share - value) ** 2 - z**2 * value * (1.0 - value) / total

    expected = (
        0.0 if count == 0 else brentq(distance, 1e-12, share * (1.0 - 1e-9), xtol=1e-14),
        1.0 if count == total else brentq(distance, share + 1e-9, 1.0 - 1e-12, xtol=1e-14),
    )
    assert (low, high) == pytest.approx(expected, abs=1e-10)


@pytest.fixture(scope="module")
def run():
    return wb.scatter(
        wb.paper.system(eta=-24.0).replace(static=0.4),
        {"kinetic": stats.uniform(0.28, 0.06), "slope": stats.norm(-40.0, 3.0)},
        samples=64,
        limits={"rms_torque": 150.0},
    )


def test_samples_are_systems_computed_alone(run):
    for i in (0, 11, 42):
        one = run.isel(sample=i)
        system = wb.paper.system(eta=-24.0).replace(
            static=0.4, kinetic=float(one["kinetic"]), slope=float(one["slope"])
        )
        alone = wb.sweep(system, slope=[float(one["slope"])]).isel(slope=0)
        for name in ("motion", "order", "stick_class", "rms_torque", "peak_torque", "status"):
            assert np.array_equal(one[name], alone[name], equal_nan=True)
        stability = wb.stability(system, method="exact")
        for side in ("forward", "backward"):
            direction = getattr(stability, side)
            expected = math.nan if direction.locked else direction.growth_rate
            assert float(one["growth_rate"].sel(direction=f"{side}s")) == pytest.approx(
                expected, rel=1e-12, nan_ok=True
            )


def test_probabilities_count_the_samples(run):
    exceeded = run["rms_torque"] > 150.0
    assert probability(run, "rms_torque > 150")[1] == float(exceeded.mean())
    sticks = run["stick_class"] >= 2
    assert probability(run, "stick_slip")[1] == float(sticks.mean())
    undecided = run["motion"] == 0
    assert probability(run, "undecided")[1] == float(undecided.mean())
    assert not np.any(run["occurs"].sel(outcome="safe").to_numpy()[undecided.to_numpy()])
    known = run["amplitude"].to_numpy()
    assert float(run["quantiles"].sel(quantity="amplitude", quantile=0.5)) == pytest.approx(
        np.median(known), rel=0.2
    )


def test_undecided_is_never_safe():
    """A stable brake whose vibration has not settled within two periods."""
    found = wb.scatter(
        SYSTEM.replace(slope=0.5, damping=0.001), {"kinetic": stats.uniform(0.2, 0.1)},
        samples=16, transient=0, periods=2, outcomes=["undecided"],
    )  # fmt: skip
    assert probability(found, "undecided")[1] > 0.5
    safe = found["occurs"].sel(outcome="safe")
    assert not np.any(safe[found["motion"] == 0])


@pytest.mark.parametrize(
    "wrong", [{"threads": 0}, {"resume": True}, {"client": 3}, {"progress": "x"}], ids=str
)
def test_settings_of_the_computation_are_checked_where_nothing_is_simulated(wrong):
    (name,) = wrong
    for function in (
        lambda: wb.scatter(SYSTEM, kinetic=FRICTION, outcomes=LINEAR, samples=8, **wrong),
        lambda: wb.rare_event(SYSTEM, {"kinetic": FRICTION}, "self_locked", **wrong),
    ):
        with pytest.raises(wb.InputError) as raised:
            function()
        assert raised.value.name == name


def test_threads_and_stores_change_nothing(tmp_path):
    over = {"kinetic": stats.uniform(0.28, 0.06), "slope": stats.norm(-40.0, 3.0)}
    arguments = {"samples": 70, "transient": 10, "periods": 20}
    memory = wb.scatter(SYSTEM, over, **arguments, threads=1)
    stored = wb.scatter(SYSTEM, over, **arguments, store=tmp_path / "s.zarr")
    again = wb.scatter(SYSTEM, over, **arguments, store=tmp_path / "s.zarr", resume=True)
    assert memory.identical(stored.load())
    assert memory.identical(again.load())
    with pytest.raises(wb.InputError, match="another sweep"):
        wb.scatter(SYSTEM, over, **arguments, seed=1, store=tmp_path / "s.zarr", resume=True)


def test_machines_are_evaluated_as_drivelines():
    arguments = {"samples": 64, "transient": 10, "periods": 20}
    line = wb.scatter(SYSTEM, {"kinetic": FRICTION, "slope": stats.norm(-1.0, 0.2)}, **arguments)
    machine = wb.scatter(
        SYSTEM.machine, {"brake.kinetic": FRICTION, "brake.slope": stats.norm(-1.0, 0.2)},
        **arguments,
    )  # fmt: skip
    assert np.array_equal(line["kinetic"], machine["brake.kinetic"])
    assert np.array_equal(line["occurs"], machine["occurs"])
    np.testing.assert_allclose(
        machine["growth_rate"], line["growth_rate"], rtol=1e-9, equal_nan=True
    )


def test_several_contacts():
    machine = wb.load_study(Path(__file__).parents[2] / "examples" / "driveline.toml").system
    found = wb.scatter(
        machine, {"brake.kinetic": stats.uniform(0.2, 0.2)}, samples=4, outcomes=LINEAR
    )
    assert found["growth_rate"].shape == (4, 2)


def test_one_value_of_several_parameters():
    system = SYSTEM.replace(static=0.3)
    found = wb.scatter(system, {("kinetic", "static"): FRICTION}, samples=64, outcomes=LINEAR)
    alone = wb.scatter(SYSTEM, {"kinetic": FRICTION}, samples=64, outcomes=LINEAR)
    assert np.array_equal(found["occurs"], alone["occurs"])


def test_invalid_samples_are_unknown_and_unsafe():
    """Kinetic friction above the static coefficient is no Coulomb friction."""
    system = SYSTEM.replace(static=0.3)
    found = wb.scatter(system, {"kinetic": FRICTION}, samples=256, outcomes=LINEAR)
    invalid = found["kinetic"].to_numpy() > 0.3
    assert np.array_equal(found["status"] == PointStatus.INVALID, invalid)
    assert np.all(found["unknown"].sel(outcome=LINEAR) == invalid.sum())
    low, value, high = probability(found, "self_locked")
    assert (low, value) == (0.0, 0.0)
    assert high > FRICTION.sf(LOCKS)
    assert not np.any(found["occurs"].sel(outcome="safe").to_numpy()[invalid])


def test_correlation():
    over = {"kinetic": stats.uniform(0.1, 0.2), "slope": stats.norm(-1.0, 0.1)}
    for given in ([[1.0, 0.7], [0.7, 1.0]], {("kinetic", "slope"): 0.7}):
        found = wb.scatter(
            SYSTEM, over, samples=1024, correlation=given, outcomes=["unstable_backwards"]
        )
        # Of a Gaussian copula: Spearman's coefficient is 6/pi asin(rho/2).
        rank = stats.spearmanr(found["kinetic"], found["slope"]).statistic
        assert rank == pytest.approx(6.0 / math.pi * math.asin(0.35), abs=0.01)
        assert stats.kstest(found["kinetic"], over["kinetic"].cdf).statistic < 0.01


def test_a_given_sample():
    sample = pd.DataFrame({"kinetic": [0.2, 0.3, 0.36], "slope": [-1.0, 0.5, -1.0]})
    found = wb.scatter(SYSTEM, sample, outcomes=LINEAR)
    assert found["occurs"].sel(outcome=LINEAR).to_numpy().tolist() == [[1, 0], [0, 0], [1, 1]]
    again = wb.scatter(SYSTEM, {name: sample[name].to_numpy() for name in sample}, outcomes=LINEAR)
    assert found.identical(again)


def test_sobol_indices_against_quadrature():
    """Of the growth rate -(c + delta R mu/(tan alpha - mu))/2J, which is a product."""
    friction, slope = stats.uniform(0.1, 0.15), stats.uniform(-2.0, 1.5)
    found = wb.scatter(
        SYSTEM, {"kinetic": friction, "slope": slope}, samples=512, indices=True,
        outcomes=["unstable_forwards"],
    )  # fmt: skip
    nodes, weights = np.polynomial.legendre.leggauss(40)
    nodes, weights = 0.5 * (nodes + 1.0), 0.5 * weights
    mu, delta = friction.ppf(nodes)[:, None], slope.ppf(nodes)[None]
    growth = -(DAMPING + delta * RADIUS * mu / (math.tan(ANGLE) - mu)) / (2.0 * INERTIA)
    both = weights[:, None] * weights
    mean = np.sum(both * growth)
    variance = np.sum(both * (growth - mean) ** 2)
    given_mu, given_delta = growth @ weights, weights @ growth
    first = [np.sum(weights * (one - mean) ** 2) / variance for one in (given_mu, given_delta)]
    total = [1.0 - first[1], 1.0 - first[0]]
    one = found.sel(effect="growth_rate forwards")
    for name, exact in (("S1", first), ("ST", total)):
        error = np.abs(one[name].to_numpy() - exact)
        assert np.all(error <= one[f"{name}_conf"])
        assert np.all(error <= 0.05)
    assert found.sizes["sample"] == 1024


@pytest.mark.parametrize(
    "arguments",
    [
        {"over": {}},
        {"over": {"kinetic": 0.3}},
        {"over": {"kinetic": "norm"}},
        {"over": {"kinetic": stats.norm}},
        {"over": {"friction": FRICTION}},
        {"over": {"kinetic": FRICTION}, "samples": 1},
        {"over": {"kinetic": FRICTION}, "seed": -1},
        {"over": {"kinetic": FRICTION}, "outcomes": ["stable"]},
        {"over": {"kinetic": FRICTION}, "outcomes": "self_locked"},
        {"over": {"kinetic": FRICTION}, "limits": {"torque": 1.0}},
        {"over": {"kinetic": FRICTION}, "limits": {"peak_torque": math.nan}},
        {"over": {"kinetic": FRICTION}, "quantiles": [2.0]},
        {"over": {"kinetic": FRICTION}, "correlation": {("kinetic", "slope"): 0.5}},
        {"over": {"kinetic": FRICTION, "slope": stats.norm()}, "correlation": [[1, 2], [2, 1]]},
        {"over": {"kinetic": FRICTION, "slope": stats.norm()}, "indices": True,
         "correlation": {("kinetic", "slope"): 0.5}},
        {"over": {"kinetic": [0.2, 0.3], "slope": [1.0]}},
        {"over": {"kinetic": [0.2, 0.3]}, "indices": True},
        {"over": {"kinetic": FRICTION}, "colour": 1},
        {"over": {"kinetic": stats.uniform(-5.0, 1.0)}},
    ],
)  # fmt: skip
def test_wrong_arguments(arguments):
    over = arguments.pop("over")
    with pytest.raises(wb.InputError):
        wb.scatter(SYSTEM, over, **arguments)


@pytest.mark.parametrize("values", [(0.28, 0.42), (0, 1), (np.float64(0.28), 0.42)])
def test_two_numbers_are_no_range_and_no_sample(values):
    """In ``fit`` and ``margin`` this notation is a range."""
    other = {"slope": stats.norm(-40.0, 1.0)}
    for call in (
        lambda: wb.scatter(SYSTEM, {"kinetic": values}, samples=4),
        lambda: wb.scatter(SYSTEM, {"kinetic": values, **other}, samples=4),
        lambda: wb.rare_event(SYSTEM, {"kinetic": values}, "self_locked"),
        lambda: wb.margin(SYSTEM, "slope", between=(-90.0, 0.0), scatter={"kinetic": values}),
    ):
        with pytest.raises(wb.InputError, match=r"scipy\.stats\.uniform\(") as raised:
            call()
        assert raised.value.name == "kinetic"
    for sample in ([0.28, 0.42], np.array([0.28, 0.42]), (0.28, 0.3, 0.42)):
        run = wb.scatter(SYSTEM, {"kinetic": sample}, outcomes=LINEAR)
        np.testing.assert_array_equal(run["kinetic"], sample)


@pytest.mark.parametrize("parameters", [1, 2])
def test_undecided_samples_have_a_mark_of_their_own(parameters):
    over = {"kinetic": FRICTION, "slope": stats.norm(-1.0, 0.2)}
    over = dict(list(over.items())[:parameters])
    found = wb.scatter(SYSTEM, over, samples=16, transient=5, periods=10)
    found["motion"][...] = MotionClass.SYNCHRONOUS
    found["motion"][:4] = MotionClass.UNDECIDED
    figure = wb.plot(found)
    axes = figure.axes[1]
    if parameters == 1:
        hatched = [one for one in axes.patches if one.get_hatch()]
        assert sum(one.get_height() for one in hatched) == 4
        assert sum(one.get_height() for one in axes.patches) == 16
    else:
        marks = {line.get_marker(): len(line.get_xdata()) for line in axes.lines}
        assert sorted(marks.values()) == [4, 12]
        legend = figure.axes[2].get_legend()
        named = zip(legend.get_texts(), legend.legend_handles, strict=True)
        shown = {text.get_text().split(",")[0]: one.get_marker() for text, one in named}
        assert marks[shown["undecided"]] == 4


@pytest.mark.parametrize(("indices", "runs"), list(product([False, True], repeat=2)))
def test_pictures(indices, runs, tmp_path):
    found = wb.scatter(
        SYSTEM, {"kinetic": FRICTION, "slope": stats.norm(-1.0, 0.2)}, samples=16,
        indices=indices, outcomes=None if runs else LINEAR, transient=5, periods=10,
    )  # fmt: skip
    figure = wb.plot(found)
    assert len(figure.axes) >= 2 + indices
    figure.savefig(tmp_path / "scatter.png")
    with pytest.raises(wb.InputError):
        wb.plot(found, x="angle")
    with pytest.raises(wb.InputError):
        wb.plot(found, effect="angle")


class TestWithoutContacts:
    """A loop of gain K damps an inertia on a spring of damping 0.1: unstable below K = -0.1."""

    MACHINE = wb.Machine(
        inertias=[wb.Inertia("wheel", 2.0)],
        shafts=[wb.Shaft("wheel", "ground", 50.0, 0.1)],
        controllers=[wb.Controller("loop", {"wheel.speed": 1.0}, 0.0, "wheel.torque", 2.0)],
    )

    def test_instability_has_no_direction(self):
        gains = stats.uniform(-2.0, 4.0)
        found = wb.scatter(self.MACHINE, {"loop.proportional": gains}, samples=512)
        for name in ("unstable_forwards", "unstable_backwards"):
            assert probability(found, name)[1] == pytest.approx(1.9 / 4.0, abs=2e-3)
        assert probability(found, "self_locked")[1] == 0.0
        assert probability(found, "stick_slip")[1] == 0.0

    def test_a_rare_one(self):
        found = wb.rare_event(
            self.MACHINE, {"loop.proportional": stats.norm(2.0, 0.5)}, "unstable_forwards"
        )
        assert float(found["probability"]) == pytest.approx(stats.norm.sf(4.2), rel=1e-3)

    def test_margin(self):
        found = wb.margin(self.MACHINE, "loop.proportional", between=(-3.0, 3.0))
        assert found.low == pytest.approx(-0.1, rel=1e-9)
        assert found.high is None
