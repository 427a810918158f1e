"""Fits in segments: multiple shooting, compared with one run and with the truth."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from test_fit import LINE, TIMES, machine
from test_fit_numbers import belt

import wedgebrake as wb

RNG = np.random.default_rng
COULOMB = wb.CoulombFriction(kinetic=0.3)
BRAKE = wb.ConventionalBrake(radius=0.2)


def disc(contact: dict[str, Any] | None = None, **parts: Any) -> wb.Machine:
    """A braked disc on a spring, with other parts."""
    given: dict[str, Any] = {
        "inertias": [wb.Inertia("disc", 1.0, speed=2.0)],
        "shafts": [wb.Shaft("disc", "ground", name="shaft", stiffness=900.0, damping=0.5)],
        "torques": [wb.Torque("disc", wb.Harmonic(60.0, 3.0), name="engine")],
    }
    force = wb.Actuation(initial_force=100.0, slope=-5.0)
    pad = {"brake": BRAKE, "friction": COULOMB, "actuation": force, **(contact or {})}
    return wb.Machine(**{**given, **parts}, contacts=[wb.Contact("disc", name="pad", **pad)])


GEARED = disc(
    inertias=[
        wb.Inertia("disc", 1.0), wb.Inertia("pinion", 0.2),
        wb.Driven("road", speed=wb.Harmonic(2.0, 1.5)),
    ],
    shafts=[wb.Shaft("disc", "road", name="shaft", stiffness=300.0, damping=0.5)],
    joints=[wb.Gear("disc", "pinion", ratio=2.0, name="gear")],
)  # fmt: skip
FOLLOWED = wb.Orders(wb.Ramp(12.0, 38.0, 2.0), [(1.0, 30.0, 0.0), (2.0, 10.0, 0.5)])
PID = wb.Controller(
    "pid", measured={"disc.speed": 1.0}, setpoint=1.0, proportional=5.0, integral=20.0,
    derivative=0.1, filter_time=0.01, output="disc.torque", limits=(-20.0, 20.0),
)  # fmt: skip
# System, quantity that is measured, and the error of each free parameter at the start.
SYSTEMS: dict[str, tuple[Any, str, dict[str, float]]] = {
    "driveline": (LINE, "velocity", {"kinetic": 0.9, "slope": 1.2}),
    "angle": (LINE, "angle", {"kinetic": 0.9, "slope": 1.2}),
    "one of two inertias": (
        machine(), "disc.speed",
        {"brake.kinetic": 1.2, "shaft.stiffness": 0.9, "engine.amplitude": 0.8, "disc.speed": 0.8},
    ),
    "torque": (machine(), "shaft.torque", {"brake.kinetic": 1.1, "mount.stiffness": 0.95}),
    "lag": (
        disc({"actuation": wb.Actuation(initial_force=100.0, slope=-5.0, lag=0.02)}), "disc.speed",
        {"pad.kinetic": 1.1, "pad.lag": 0.9},
    ),
    "joint and driven body": (
        GEARED, "disc.speed",
        {"pad.kinetic": 1.1, "gear.ratio": 0.95, "road.speed.amplitude": 0.95},
    ),
    "orders": (
        disc(torques=[wb.Torque("disc", FOLLOWED, name="engine")]), "disc.speed",
        {"pad.kinetic": 1.1, "shaft.stiffness": 0.95},
    ),
    "controller": (
        disc(controllers=[PID]), "disc.speed", {"shaft.stiffness": 0.95, "pid.integral": 1.1},
    ),
}  # fmt: skip


def trace_of(system: Any, quantity: str, times: np.ndarray) -> dict[str, np.ndarray]:
    part, _, word = quantity.rpartition(".")
    variable = {"speed": "velocity", "torque": "shaft_torque"}.get(word, word)
    found = wb.simulate(system, float(np.ptp(times)), times=times)[variable]
    if part:
        found = found.sel({"shaft" if part == "shaft" else "inertia": part})
    return {"time": times, "y": found.to_numpy()}


def about(system: Any, errors: dict[str, float]) -> tuple[Any, dict[str, tuple[float, float]]]:
    """A start with errors of the parameters, and ranges about the truth."""
    true = {name: system.value(name) for name in errors}
    limits = {name: tuple(sorted((0.5 * one, 2.0 * one))) for name, one in true.items()}
    return system.replace({name: one * errors[name] for name, one in true.items()}), limits


class TestNotChaotic:
    """Where one run can be fitted too, segments change nothing."""

    @pytest.mark.parametrize("name", list(SYSTEMS))
    def test_parameters_come_back(self, name: str) -> None:
        system, quantity, errors = SYSTEMS[name]
        start, free = about(system, errors)
        trace = trace_of(system, quantity, TIMES)
        found = wb.fit(start, trace, free, observe={"y": quantity}, segments=6)
        assert found.converged
        for one in errors:
            assert found.values[one] == pytest.approx(system.value(one), rel=1e-8)

    @pytest.mark.parametrize("name", list(SYSTEMS))
    def test_values_and_covariance_are_those_of_one_segment(self, name: str) -> None:
        system, quantity, errors = SYSTEMS[name]
        start, free = about(system, {one: 1.0 + 0.05 * (two - 1.0) for one, two in errors.items()})
        trace = trace_of(system, quantity, TIMES)
        trace["y"] = trace["y"] + RNG(2).normal(0.0, 0.01 * np.std(trace["y"]), TIMES.size)
        trace["y"][::9] = np.nan
        one, more = (
            wb.fit(start, trace, free, observe={"y": quantity}, segments=number)
            for number in (1, 7)
        )
        assert more.converged
        errors_of = np.array(list(one.stderr.values()))
        apart = np.array([more.values[name] - one.values[name] for name in errors])
        assert np.all(np.abs(apart) <= 1e-5 * errors_of)
        scale = np.outer(errors_of, errors_of)
        difference = (more.covariance.to_numpy() - one.covariance.to_numpy()) / scale
        # One run ends where the sum of squares falls by less than 1e-14 of itself: about 1e-6
        # standard errors before the minimum, at which the covariance is another one.
        assert np.all(np.abs(difference) <= 2e-6)
        fitted = one.data["fitted"].to_numpy()
        np.testing.assert_allclose(
            more.data["fitted"].to_numpy(), fitted, rtol=0.0, atol=1e-6 * np.ptp(fitted)
        )
        assert more.undetermined == one.undetermined

    def test_time_scale_offset_and_start(self) -> None:
        run = {"start_time": 0.003, "times": TIMES + 0.003, "initial": (0.0, 1.0)}
        velocity = wb.simulate(LINE, 1.0, **run)["velocity"].to_numpy()
        given = {"time": TIMES, "v": 30.0 / np.pi * velocity + 2.0}
        free = {
            "time_shift": (0.0, 0.01), "v.scale": (8.0, 12.0), "v.offset": (-5.0, 5.0),
            "initial_velocity": (-2.0, 2.0),
        }  # fmt: skip
        found = wb.fit(LINE, given, free, observe={"v": "driveline.speed"}, segments=7)
        expected = [0.003, 30.0 / np.pi, 2.0, 1.0]
        np.testing.assert_allclose(list(found.values.values()), expected, rtol=1e-6)

    def test_a_trace_that_starts_later(self) -> None:
        run = {"start_time": 7.5, "times": TIMES + 7.5, "initial": (0.01, -1.0)}
        velocity = wb.simulate(LINE, 1.0, **run)["velocity"].to_numpy()
        found = wb.fit(
            LINE.replace(kinetic=0.27), {"time": TIMES + 7.5, "velocity": velocity},
            {"kinetic": (0.1, 0.5)}, initial=(0.01, -1.0), segments=5,
        )  # fmt: skip
        assert found.values["kinetic"] == pytest.approx(0.3, rel=1e-8)

    def test_product_of_friction_and_force(self) -> None:
        """A brake of constant force: its torque is their product, as with one segment."""
        true = machine(brake_slope=0.0)
        free = {"brake.kinetic": (0.1, 0.5), "brake.initial_force": (100.0, 900.0)}
        trace = trace_of(true, "disc.speed", TIMES)
        start = true.replace({"brake.kinetic": 0.33})
        found = wb.fit(start, trace, free, observe={"y": "disc.speed"}, segments=5)
        product = found.values["brake.kinetic"] * found.values["brake.initial_force"]
        assert product == pytest.approx(90.0, rel=1e-8)
        assert all(np.isinf(one) for one in found.stderr.values())
        (told,) = found.undetermined
        assert "product" in told

    def test_bounds_hold(self) -> None:
        trace = trace_of(LINE, "velocity", TIMES)
        free = {"kinetic": (0.2, 0.299), "slope": (-90.0, 0.0)}
        one, more = (
            wb.fit(LINE.replace(kinetic=0.29), trace, free, observe={"y": "velocity"}, segments=k)
            for k in (1, 5)
        )
        assert more.converged
        assert more.values["kinetic"] == pytest.approx(0.299, rel=1e-9)
        assert more.values["slope"] == pytest.approx(one.values["slope"], rel=1e-6)
        assert any(told.startswith("kinetic: ends at the bound") for told in more.undetermined)

    @pytest.mark.parametrize("lost", [False, True])
    def test_a_gap_longer_than_a_segment(self, lost: bool) -> None:
        """Samples without a value, or lost samples."""
        trace = trace_of(LINE, "velocity", TIMES)
        if lost:
            trace = {name: np.delete(one, slice(120, 210)) for name, one in trace.items()}
        else:
            trace["y"][90:210] = np.nan
        free = {"kinetic": (0.1, 0.5), "slope": (-90.0, 0.0)}
        start = LINE.replace(kinetic=0.28)
        found = wb.fit(start, trace, free, observe={"y": "velocity"}, segments=5)
        for name in free:
            assert found.values[name] == pytest.approx(LINE.value(name), rel=1e-8)

    @pytest.mark.parametrize("method", ["exact", "smooth"])
    def test_methods_and_several_columns(self, method: str) -> None:
        friction: Any = wb.CoulombFriction(kinetic=0.3, static=0.4)
        if method == "smooth":
            friction = wb.SmoothedFriction(kinetic=0.3)
        true = disc({"friction": friction})
        run = wb.simulate(true, 1.0, times=TIMES, method=method)
        columns = {"q": run["angle"].to_numpy()[:, 0], "v": run["velocity"].to_numpy()[:, 0]}
        found = wb.fit(
            true.replace({"pad.kinetic": 0.28}), {"time": TIMES, **columns},
            {"pad.kinetic": (0.1, 0.35)}, observe={"q": "disc.angle", "v": "disc.speed"},
            method=method, segments=6,
        )  # fmt: skip
        assert found.converged
        assert found.values["pad.kinetic"] == pytest.approx(0.3, rel=1e-8)

    def test_profile(self) -> None:
        trace = trace_of(LINE, "velocity", TIMES)
        trace["y"] = trace["y"] + RNG(4).normal(0.0, 0.05, TIMES.size)
        for free in ({"kinetic": (0.1, 0.5), "slope": (-90.0, 0.0)}, {"kinetic": (0.1, 0.5)}):
            found = wb.fit(
                LINE, trace, free, observe={"y": "velocity"}, sigma={"y": 0.05}, segments=5
            )
            at, error = found.values["kinetic"], found.stderr["kinetic"]
            costs = found.profile("kinetic", [at - error, at, at + error])["cost"].to_numpy()
            np.testing.assert_allclose(costs - costs[1], [1.0, 0.0, 1.0], atol=0.05)

    def test_outliers_with_a_robust_loss(self) -> None:
        trace = trace_of(LINE, "velocity", TIMES)
        trace["y"][::50] += 30.0
        start = LINE.replace(kinetic=0.28)
        found = wb.fit(
            start, trace, {"kinetic": (0.2, 0.4)}, observe={"y": "velocity"}, segments=4,
            loss="cauchy", loss_scale=0.01,
        )  # fmt: skip
        assert found.values["kinetic"] == pytest.approx(0.3, abs=1e-6)

    def test_progress_can_end_the_fit(self) -> None:
        def stop(number: int) -> None:
            if number == 9:
                raise KeyError(number)

        with pytest.raises(KeyError):
            wb.fit(
                LINE, trace_of(LINE, "velocity", TIMES), {"kinetic": (0.1, 0.5)},
                observe={"y": "velocity"}, segments=4, progress=stop,
            )  # fmt: skip


CHAOTIC = wb.load_study("examples/paper.toml").system.replace(slope=-45.0)
LONG = 0.002 * np.arange(2501)
FREE = {"kinetic": (0.1, 0.5), "slope": (-90.0, 0.0)}


class TestChaotic:
    """Five seconds of chaotic motion, in which a deviation grows a million times."""

    def test_it_is_chaotic(self) -> None:
        speed = trace_of(CHAOTIC, "velocity", LONG)["y"]
        near = wb.simulate(CHAOTIC, 5.0, times=LONG, initial=(1e-9, 0.0))["velocity"].to_numpy()
        first, last = np.abs(near[:25] - speed[:25]).max(), np.abs(near - speed).max()
        assert last > 1e6 * first
        assert last > 1.0

    def test_parameters_come_back(self) -> None:
        trace = trace_of(CHAOTIC, "velocity", LONG)
        start = CHAOTIC.replace(kinetic=0.285, slope=-48.0)
        found = wb.fit(start, trace, FREE, observe={"y": "velocity"}, segments=25)
        assert found.converged
        for name in FREE:
            assert found.values[name] == pytest.approx(CHAOTIC.value(name), rel=1e-10)
        np.testing.assert_allclose(found.data["fitted"][0], trace["y"], rtol=0.0, atol=1e-8)

    @pytest.mark.parametrize(
        "seed", [0, 3, *(pytest.param(one, marks=pytest.mark.slow) for one in (1, 2))]
    )
    def test_noise(self, seed: int) -> None:
        trace, rng = trace_of(CHAOTIC, "velocity", LONG), RNG(seed)
        noisy = {**trace, "y": trace["y"] + rng.normal(0.0, 0.05, LONG.size)}
        signs = rng.choice([-1.0, 1.0], 2)
        start = CHAOTIC.replace(
            kinetic=0.3 * (1.0 + 0.05 * signs[0]), slope=-45.0 * (1.0 + 0.07 * signs[1])
        )
        one, found = (
            wb.fit(
                start, noisy, FREE, observe={"y": "velocity"}, sigma={"y": 0.05}, segments=number
            )
            for number in (1, 25)
        )
        assert one.rms["y"] > 10.0 * 0.05  # a single run is lost
        assert found.converged
        assert found.remarks == []
        for name in FREE:
            error = found.stderr[name]
            assert abs(found.values[name] - CHAOTIC.value(name)) < 4.0 * error
            assert error < 1e-3 * abs(CHAOTIC.value(name))
        # It is a motion near the true one everywhere.
        assert np.abs(found.data["fitted"][0] - trace["y"]).max() < 0.05

    @pytest.mark.parametrize("segments", [pytest.param(2, marks=pytest.mark.slow), 3])
    def test_too_few_segments_are_told_first(self, segments: int) -> None:
        """Gaps remain, and the brake may lock itself: without a warning of NumPy."""
        trace, noise = trace_of(CHAOTIC, "velocity", LONG[:2001]), RNG(0).normal(0.0, 0.05, 2001)
        noisy, start = {**trace, "y": trace["y"] + noise}, CHAOTIC.replace(kinetic=0.29, slope=-47)
        found = wb.fit(start, noisy, FREE, observe={"y": "velocity"}, segments=segments)
        assert not found.converged
        assert found.report().startswith(found.outcome)
        assert "standard error " not in found.report()
        assert all(np.isnan(one) for one in found.stderr.values())
        assert not any("unit" in one for one in found.warnings)
        wb.plot(found)

    def test_covariance_is_the_inverse_of_the_information(self) -> None:
        """By the derivatives of one run from the first sample on, at the true values."""
        trace = trace_of(CHAOTIC, "velocity", LONG)
        found = wb.fit(
            CHAOTIC, trace, FREE, observe={"y": "velocity"}, sigma={"y": 0.05}, segments=25
        )
        slopes = wb.sensitivity(CHAOTIC, list(FREE), duration=5.0, times=LONG)
        rows = slopes["velocity"].to_numpy().T / 0.05
        # Two directions differ by 1e-7 in size: the information itself does not resolve one.
        sizes = np.linalg.norm(rows, axis=0)
        inverse = np.linalg.pinv(rows / sizes, rcond=1e-12)
        expected = inverse @ inverse.T / np.outer(sizes, sizes)
        np.testing.assert_allclose(found.covariance.to_numpy(), expected, rtol=1e-6)

    @pytest.mark.parametrize("duration", [5.0, 7.0])
    def test_one_segment_determines_as_much(self, duration: float) -> None:
        """Although deviations grow by 1e7 and more, nothing is called undetermined."""
        trace = trace_of(CHAOTIC, "velocity", 0.002 * np.arange(round(500 * duration) + 1))
        one, more = (
            wb.fit(
                CHAOTIC, trace, FREE, observe={"y": "velocity"}, sigma={"y": 0.05}, segments=number
            )
            for number in (1, round(5 * duration))
        )
        assert one.undetermined == more.undetermined == []
        for name in FREE:
            assert one.stderr[name] == pytest.approx(more.stderr[name], rel=1e-4)

    def test_the_fitted_motion_goes_on_where_one_run_leaves_it(self) -> None:
        """Rounding grows to the size of the motion; the fit ends beyond that."""
        times = 0.002 * np.arange(8001)
        trace, start = trace_of(CHAOTIC, "velocity", times), CHAOTIC.replace(kinetic=0.303)
        found = wb.fit(start, trace, FREE, observe={"y": "velocity"}, segments=80)
        assert found.converged
        for name in FREE:
            assert found.values[name] == pytest.approx(CHAOTIC.value(name), rel=1e-10)
        np.testing.assert_allclose(found.data["fitted"][0], trace["y"], rtol=0.0, atol=1e-6)
        moved = CHAOTIC.replace(kinetic=CHAOTIC.value("kinetic") * (1.0 + 1e-15))
        alone = trace_of(moved, "velocity", times)["y"]
        assert np.abs(alone - trace["y"]).max() > 1.0


class TestRoundNumbers:
    """Segments that begin at an event, or while a contact sticks; samples each 0.001 s."""

    @pytest.mark.parametrize("quantity", ["block.speed", "block.angle"])
    @pytest.mark.parametrize("segments", [2, 4, 9, 20])
    def test_sticks(self, quantity: str, segments: int) -> None:
        """The first stick ends at 0.5 s, to rounding."""
        block, times = belt(), 0.001 * np.arange(2000)
        free = {"pad.static": (0.31, 0.8), "block.inertia": (0.5, 2.0), "pad.kinetic": (0.1, 0.4)}
        firsts = [number * 2000 // segments for number in range(1, segments)]
        run = wb.simulate(block, 2.0, times=times)
        assert np.any(run["sticking"].to_numpy()[firsts] == 1) or segments == 2
        if segments in (4, 20):
            apart = times[firsts][:, None] - run["event_time"].to_numpy()
            assert np.abs(apart).min() < 1e-12
        trace = trace_of(block, quantity, times)
        start = block.replace({"pad.static": 0.53, "block.inertia": 0.93, "pad.kinetic": 0.28})
        found = wb.fit(start, trace, free, observe={"y": quantity}, segments=segments)
        assert found.converged
        for name in free:
            assert found.values[name] == pytest.approx(block.value(name), rel=1e-8)
        noisy = {**trace, "y": trace["y"] + RNG(3).normal(0.0, 1e-3 * np.std(trace["y"]), 2000)}
        one, more = (
            wb.fit(block, noisy, free, observe={"y": quantity}, segments=number)
            for number in (1, segments)
        )
        for name in free:
            assert abs(more.values[name] - one.values[name]) < 1e-4 * one.stderr[name]
            assert more.stderr[name] == pytest.approx(one.stderr[name], rel=1e-6)

    def test_a_brake_that_holds_all_the_time(self) -> None:
        """Nothing depends on its friction, whatever the segments."""
        held = machine(brake_initial_force=1e5, disc_speed=0.0, brake_slope=0.0)
        held = held.replace({"hub.speed": 0.5})
        trace = trace_of(held, "hub.speed", TIMES)
        free = {"brake.kinetic": (0.1, 0.5), "mount.stiffness": (1000.0, 2000.0)}
        start = held.replace({"mount.stiffness": 1400.0})
        found = wb.fit(start, trace, free, observe={"y": "hub.speed"}, segments=5)
        assert np.isinf(found.stderr["brake.kinetic"])
        assert found.values["mount.stiffness"] == pytest.approx(1500.0, rel=1e-8)


SAMPLED = disc({"actuation": wb.Actuation(initial_force=100.0, slope=-5.0, sample_time=0.01)})
GAP = wb.Shaft("disc", "ground", name="stop", stiffness=1e4, damping=1.0, gap=(-0.1, 0.1))
DIGITAL = wb.Controller(
    "digital", measured={"disc.speed": 1.0}, setpoint=1.0, proportional=5.0, output="disc.torque",
    sample_time=0.01,
)  # fmt: skip


@pytest.mark.parametrize(
    ("name", "system", "changes"),
    [
        ("segments", machine(), {"segments": 0}),
        ("segments", machine(), {"segments": -2}),
        ("segments", machine(), {"segments": 2.5}),
        ("segments", machine(), {"segments": "4"}),
        ("segments", machine(), {"segments": 126}),
        (
            "segments", machine(),
            {"trace": None, "observe": None, "measured": {"disc.period": (0.1, 0.01)},
             "window": (0.0, 1.0)},
        ),
        ("segments", machine(), {"measured": {"disc.period": (0.1, 0.01)}, "sigma": {"y": 0.1}}),
        ("pad.sample_time", SAMPLED, {}),
        ("digital.sample_time", disc(controllers=[DIGITAL]), {}),
        ("stop.damping", disc(shafts=[GAP]), {}),
    ],
)  # fmt: skip
def test_what_is_refused_is_named(name: str, system: wb.Machine, changes: dict[str, Any]) -> None:
    given = {
        "trace": {"time": TIMES, "y": np.sin(TIMES)}, "free": {"disc.inertia": (0.5, 2.0)},
        "observe": {"y": "disc.speed"}, "segments": 2, **changes,
    }  # fmt: skip
    with pytest.raises(wb.InputError) as raised:
        wb.fit(system, **given)
    assert raised.value.name == name


def test_as_many_segments_as_the_samples_allow() -> None:
    trace = trace_of(LINE, "velocity", TIMES)
    found = wb.fit(
        LINE.replace(kinetic=0.29), trace, {"kinetic": (0.1, 0.5)}, observe={"y": "velocity"},
        segments=125,
    )  # fmt: skip
    assert found.values["kinetic"] == pytest.approx(0.3, rel=1e-8)
