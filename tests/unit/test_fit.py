"""Fits of parameters to traces: recovery, coverage, what a trace does not determine."""

from __future__ import annotations

import re
from pathlib import Path
from typing import ClassVar

import numpy as np
import pandas as pd
import pytest
from matplotlib.text import Text
from scipy.io import savemat
from scipy.signal import butter, filtfilt, lfilter
from test_sensitivity import TWO_BRAKES

import wedgebrake as wb

TIMES = np.linspace(0.0, 1.0, 501)
LINE = wb.paper.system(eta=-24.0).replace(friction=wb.CoulombFriction(kinetic=0.3))
FREE = {"kinetic": (0.1, 0.5), "slope": (-90.0, 0.0)}


def machine(**more: float) -> wb.Machine:
    made = wb.Machine(
        inertias=[wb.Inertia("disc", 1.0, angle=0.01, speed=2.0), wb.Inertia("hub", 0.4)],
        shafts=[
            wb.Shaft("disc", "hub", name="shaft", stiffness=3000.0, damping=1.0),
            wb.Shaft("hub", "ground", name="mount", stiffness=1500.0, damping=0.5),
        ],
        contacts=[
            wb.Contact(
                "disc", name="brake", brake=wb.ConventionalBrake(radius=0.2),
                friction=wb.CoulombFriction(kinetic=0.3),
                actuation=wb.Actuation(initial_force=300.0, slope=-5.0),
            )
        ],
        torques=[wb.Torque("disc", wb.Harmonic(80.0, 7.0, 0.3), name="engine")],
    )  # fmt: skip
    return made.replace({name.replace("_", ".", 1): value for name, value in more.items()})


def trace_of(system: wb.BrakedDriveline | wb.Machine, **run: object) -> dict[str, np.ndarray]:
    response = wb.simulate(system, 1.0, times=TIMES, **run)
    velocity = response["velocity"].to_numpy()
    return {"time": TIMES, "velocity": velocity if velocity.ndim == 1 else velocity[:, 0]}


class TestRecovery:
    """Without noise the parameters come back, to the accuracy of the derivatives."""

    def test_parameters_of_a_driveline(self) -> None:
        found = wb.fit(LINE.replace(kinetic=0.25, slope=-50.0), trace_of(LINE), FREE)
        assert found.converged
        for name in FREE:
            assert found.values[name] == pytest.approx(LINE.value(name), rel=1e-8)
        assert found.system == LINE.replace(found.values)
        assert found.undetermined == []

    def test_progress_counts_simulations_and_can_end_the_fit(self) -> None:
        told: list[int] = []
        wb.fit(LINE.replace(kinetic=0.28), trace_of(LINE), FREE, progress=told.append)
        assert told == list(range(1, len(told) + 1))

        def stop(number: int) -> None:
            if number == 3:
                raise KeyError(number)

        with pytest.raises(KeyError):
            wb.fit(LINE.replace(kinetic=0.28), trace_of(LINE), FREE, progress=stop)

    def test_parameters_and_initial_speed_of_a_machine(self) -> None:
        free = {
            "brake.kinetic": (0.1, 0.5), "shaft.stiffness": (2000.0, 4000.0),
            "engine.amplitude": (40.0, 150.0), "disc.speed": (0.0, 4.0),
        }  # fmt: skip
        start = machine().replace(
            {"brake.kinetic": 0.36, "shaft.stiffness": 2700.0, "engine.amplitude": 65.0,
             "disc.speed": 1.5}
        )  # fmt: skip
        found = wb.fit(start, trace_of(machine()), free, observe={"velocity": "disc.speed"})
        for name in free:
            assert found.values[name] == pytest.approx(machine().value(name), rel=1e-8)

    def test_time_scale_offset_and_start_of_a_driveline(self) -> None:
        run = {"start_time": 0.003, "times": TIMES + 0.003, "initial": (0.0, 1.0)}
        velocity = wb.simulate(LINE, 1.0, **run)["velocity"].to_numpy()
        given = {"time": TIMES, "v": 30.0 / np.pi * velocity + 2.0}  # in revolutions per minute
        free = {
            "time_shift": (0.0, 0.01), "v.scale": (8.0, 12.0), "v.offset": (-5.0, 5.0),
            "initial_velocity": (-2.0, 2.0),
        }  # fmt: skip
        found = wb.fit(LINE, given, free, observe={"v": "driveline.speed"})
        expected = {
            "time_shift": 0.003, "v.scale": 30.0 / np.pi, "v.offset": 2.0, "initial_velocity": 1.0,
        }  # fmt: skip
        for name, value in expected.items():
            assert found.values[name] == pytest.approx(value, rel=1e-6)

    def test_an_initial_speed_on_which_nothing_depends_at_the_start(self) -> None:
        """The brake holds at the speed 0 from which the fit would begin."""
        velocity = wb.simulate(LINE, 1.0, times=TIMES, initial=(0.0, 1.0))["velocity"].to_numpy()
        assert wb.simulate(LINE, 0.01)["sticking"].to_numpy()[0] == 1
        found = wb.fit(
            LINE, {"time": TIMES, "velocity": velocity}, {"initial_velocity": (-2.0, 2.0)}
        )
        assert found.values["initial_velocity"] == pytest.approx(1.0, rel=1e-9)

    def test_outliers_with_a_robust_loss(self) -> None:
        trace = trace_of(LINE)
        trace["velocity"][::50] += 30.0
        start = LINE.replace(kinetic=0.28)
        plain, robust = (
            wb.fit(start, trace, {"kinetic": (0.2, 0.4)}, loss=loss, loss_scale=0.01)
            for loss in ("linear", "cauchy")
        )
        errors = [abs(one.values["kinetic"] - 0.3) for one in (plain, robust)]
        assert errors[1] < 1e-6
        assert errors[1] < 0.1 * errors[0]

    @pytest.mark.slow
    def test_random_machines_from_thirty_percent_off(self) -> None:
        """At least 95 of 100."""
        rng, good = np.random.default_rng(1), 0
        for _ in range(100):
            values = {
                "brake.kinetic": rng.uniform(0.2, 0.4), "brake.slope": rng.uniform(-10.0, -2.0),
                "shaft.stiffness": rng.uniform(1000.0, 5000.0),
            }  # fmt: skip
            true = machine().replace(
                {**values, "engine.amplitude": rng.uniform(40.0, 150.0),
                 "disc.speed": rng.uniform(0.5, 4.0)}
            )  # fmt: skip
            start = true.replace(
                {name: value * (1.0 + rng.choice((-0.3, 0.3))) for name, value in values.items()}
            )
            free = {
                name: tuple(sorted((0.4 * value, 2.0 * value))) for name, value in values.items()
            }
            found = wb.fit(start, trace_of(true), free, observe={"velocity": "disc.speed"})
            errors = [abs(found.values[name] / value - 1.0) for name, value in values.items()]
            good += max(errors) < 1e-8
        assert good >= 95

    @pytest.mark.slow
    def test_random_machines_within_ranges_of_a_decade(self) -> None:
        """With frequency and phase of the torque unknown; from the middle of the ranges."""
        rng, times = np.random.default_rng(4), np.linspace(0.0, 1.0, 201)
        good = {"values": 0, "features": 0}
        for _ in range(20):
            values = {
                "brake.kinetic": rng.uniform(0.2, 0.4),
                "shaft.stiffness": rng.uniform(1000.0, 5000.0),
                "engine.amplitude": rng.uniform(40.0, 150.0),
                "engine.frequency": rng.uniform(3.0, 12.0), "engine.phase": rng.uniform(-3.0, 3.0),
            }  # fmt: skip
            true = machine().replace({**values, "disc.speed": rng.uniform(0.5, 4.0)})
            lowest = {name: value * 10.0 ** -rng.uniform() for name, value in values.items()}
            free = {name: (low, 10.0 * low) for name, low in lowest.items()}
            middle = {name: np.sqrt(10.0) * low for name, low in lowest.items()}
            free["engine.phase"], middle["engine.phase"] = (-3.2, 3.2), 0.0
            speed = wb.simulate(true, 1.0, times=times)["velocity"].to_numpy()[:, 0]
            for start in good:
                found = wb.fit(
                    true.replace(middle), {"time": times, "velocity": speed}, free,
                    observe={"velocity": "disc.speed"}, start=start,
                )  # fmt: skip
                errors = [abs(found.values[name] / value - 1.0) for name, value in values.items()]
                good[start] += max(errors) < 1e-8
        assert good["features"] >= 16
        assert good["features"] > good["values"]

    @pytest.mark.slow
    def test_intervals_cover_the_truth(self) -> None:
        """95 % intervals of 500 noisy traces: 93 to 97 %."""
        rng, clean, inside = np.random.default_rng(2), trace_of(LINE), np.zeros(2)
        for _ in range(500):
            noisy = {**clean, "velocity": clean["velocity"] + rng.normal(0.0, 0.05, TIMES.size)}
            intervals = wb.fit(LINE, noisy, FREE).interval()
            each = [low < LINE.value(name) < high for name, (low, high) in intervals.items()]
            inside += each
        assert np.all((inside >= 465) & (inside <= 485))


class TestStartFromFeatures:
    """Starting values within the ranges, for a system whose values are far off."""

    FREE: ClassVar = {
        "kinetic": (0.1, 0.5), "slope": (-90.0, -9.0), "frequency": (3.0, 30.0),
    }  # fmt: skip

    def test_names_the_values_from_which_it_started(self) -> None:
        start = LINE.replace({"kinetic": 0.1, "frequency": 4.0})
        truth = {name: LINE.value(name) for name in self.FREE}
        near = wb.fit(start, trace_of(LINE), self.FREE, start="features")
        assert near.values == pytest.approx(truth, rel=1e-8)
        assert near.start == "features"
        for name, (low, high) in self.FREE.items():
            assert low <= near.start_values[name] <= high
            assert f"{name} {near.start_values[name]:.4g}" in near.report()
        again = wb.fit(start, trace_of(LINE), self.FREE, start="features")
        assert again.start_values == near.start_values
        assert again.values == near.values

    def test_values_of_the_system_may_lie_outside_the_ranges(self) -> None:
        start = LINE.replace(kinetic=0.05)
        with pytest.raises(wb.InputError, match="features"):
            wb.fit(start, trace_of(LINE), FREE)
        found = wb.fit(start, trace_of(LINE), FREE, start="features")
        assert found.values["kinetic"] == pytest.approx(0.3, rel=1e-8)

    def test_lost_samples_and_unknown_scale(self) -> None:
        trace = trace_of(LINE)
        trace["velocity"] = 5.0 * trace["velocity"]
        trace["velocity"][100:130] = np.nan
        free = {**FREE, "velocity.scale": (1.0, 20.0)}
        found = wb.fit(LINE.replace(kinetic=0.12), trace, free, start="features")
        assert found.values["kinetic"] == pytest.approx(0.3, rel=1e-7)
        assert found.values["velocity.scale"] == pytest.approx(5.0, rel=1e-7)

    def test_a_noisy_trace_is_not_called_inverted(self) -> None:
        rng, trace = np.random.default_rng(8), trace_of(LINE)
        trace["velocity"] += rng.normal(0.0, 0.05, TIMES.size)
        start = LINE.replace({"kinetic": 0.1, "frequency": 4.0})
        found = wb.fit(start, trace, self.FREE, start="features")
        assert found.remarks == []
        assert found.values["kinetic"] == pytest.approx(0.3, rel=1e-2)

    def test_measured_numbers_alone(self) -> None:
        times = np.linspace(0.0, 0.2, 20001)
        rms = float(np.std(wb.simulate(LINE, 0.2, times=times)["velocity"]))
        found = wb.fit(
            LINE.replace(kinetic=0.45), None, {"kinetic": (0.1, 0.5)},
            measured={"rms_velocity": (rms, 1e-3 * rms)}, window=(0.0, 0.2), start="features",
        )  # fmt: skip
        # Several values of kinetic have this number.
        assert found.numbers["rms_velocity"]["fitted"] == pytest.approx(rms, rel=1e-6)

    def test_an_unknown_start_is_refused(self) -> None:
        with pytest.raises(wb.InputError, match="start = 'feature'"):
            wb.fit(LINE, trace_of(LINE), FREE, start="feature")


class TestUndetermined:
    """What a trace does not determine is named."""

    def test_speed_alone_gives_the_product_of_friction_and_force(self) -> None:
        """A brake of constant force: its torque is the product of friction, radius and force."""
        true = machine(brake_slope=0.0)
        free = {"brake.kinetic": (0.1, 0.5), "brake.initial_force": (100.0, 900.0)}
        start = true.replace({"brake.kinetic": 0.33})
        observe = {"velocity": "disc.speed"}
        found = wb.fit(start, trace_of(true), free, observe=observe)
        product = found.values["brake.kinetic"] * found.values["brake.initial_force"]
        assert product == pytest.approx(90.0, rel=1e-8)
        assert all(np.isinf(one) for one in found.stderr.values())
        (told,) = found.undetermined
        assert {"brake.kinetic", "brake.initial_force"} <= set(told.replace(":", " ").split())
        assert "product" in told

    def test_without_slip_the_friction_is_not_determined(self) -> None:
        held = machine(brake_initial_force=1e5, disc_speed=0.0, brake_slope=0.0)
        observe = {"velocity": "hub.speed"}
        times = {"time": TIMES, "velocity": np.sin(TIMES)}
        free = {"brake.kinetic": (0.1, 0.5), "mount.stiffness": (1000.0, 2000.0)}
        found = wb.fit(held.replace({"hub.speed": 0.5}), times, free, observe=observe)
        assert np.isinf(found.stderr["brake.kinetic"])
        assert np.isfinite(found.stderr["mount.stiffness"])
        assert any("brake.kinetic" in one and "never slip" in one for one in found.undetermined)

    def test_without_stick_the_static_friction_is_not_determined(self) -> None:
        true = machine(brake_initial_force=30.0, brake_slope=0.0, engine_amplitude=200.0)
        true = true.replace({"brake.static": 0.4})
        assert not wb.simulate(true, 1.0)["sticking"].to_numpy().any()
        free = {"brake.static": (0.37, 0.6), "brake.kinetic": (0.2, 0.36)}
        start = true.replace({"brake.static": 0.5, "brake.kinetic": 0.27})
        found = wb.fit(start, trace_of(true), free, observe={"velocity": "disc.speed"})
        assert found.values["brake.kinetic"] == pytest.approx(0.3, rel=1e-8)
        assert np.isinf(found.stderr["brake.static"])
        assert any("brake.static" in one and "never stick" in one for one in found.undetermined)


def clipped(one: np.ndarray) -> np.ndarray:
    return np.clip(one, -1.0, 1.0)


def filtered(one: np.ndarray) -> np.ndarray:
    found = one.copy()
    for i in range(1, one.size):
        found[i] = found[i - 1] + 0.3 * (one[i] - found[i - 1])
    return found


@pytest.mark.parametrize(
    ("change", "word"),
    [(clipped, "clipped"), (filtered, "filtered"), (np.negative, "inverted")],
)
def test_remarks_on_a_column(change, word) -> None:
    trace = trace_of(machine())
    trace["velocity"] = change(trace["velocity"])
    observe = {"velocity": "disc.speed"}
    found = wb.fit(machine(), trace, {"brake.kinetic": (0.2, 0.4)}, observe=observe)
    assert any("velocity" in one and word in one for one in found.remarks)


class TestWrongTimes:
    """Errors of the times are named, with their place and size; nothing else is called so."""

    FREE: ClassVar = {"brake.kinetic": (0.2, 0.4), "shaft.stiffness": (2000.0, 4500.0)}

    def remarks(self, times: np.ndarray, speed: np.ndarray) -> list[str]:
        trace = {"time": times, "velocity": speed}
        found = wb.fit(machine(), trace, self.FREE, observe={"velocity": "disc.speed"})
        return [one for one in found.remarks if one.startswith("time:")]

    @pytest.mark.parametrize("noise", [0.0, 0.02])
    @pytest.mark.parametrize(("at", "number"), [(100, 2), (250, 3), (400, 3)])
    def test_renumbered_after_lost_samples(self, noise: float, at: int, number: int) -> None:
        speed = np.delete(trace_of(machine())["velocity"], slice(at, at + number))
        speed = speed + noise * np.std(speed) * np.random.default_rng(1).normal(size=speed.size)
        (told,) = self.remarks(TIMES[: speed.size], speed)
        ahead, place = map(float, re.findall(r"([\d.]+) s", told)[:2])
        assert ahead == pytest.approx(0.002 * number, abs=0.0005)
        assert place == pytest.approx(TIMES[at - 1], abs=0.008)
        assert f"{number} lost samples" in told

    @pytest.mark.parametrize("factor", [0.99, 0.999, 1.005, 1.01])
    def test_a_wrong_sample_rate(self, factor: float) -> None:
        """The size of the error is known to first order: within a tenth."""
        (told,) = self.remarks(factor * TIMES, trace_of(machine())["velocity"])
        longer = float(re.findall(r"longer by (\S+) %", told)[0])
        assert longer == pytest.approx(100.0 * (1.0 / factor - 1.0), rel=0.1)

    @pytest.mark.parametrize("change", [clipped, filtered, np.negative])
    def test_other_faults(self, change) -> None:
        assert self.remarks(TIMES, change(trace_of(machine())["velocity"])) == []

    def test_another_system(self) -> None:
        for name, value in (
            ("mount.stiffness", 1600.0), ("disc.inertia", 1.1), ("hub.inertia", 0.5),
            ("engine.amplitude", 100.0), ("disc.angle", 0.03), ("brake.slope", -9.0),
        ):  # fmt: skip
            assert self.remarks(TIMES, trace_of(machine().replace({name: value}))["velocity"]) == []

    @pytest.mark.slow
    def test_noise(self) -> None:
        rng, clean = np.random.default_rng(7), trace_of(LINE)
        for _ in range(500):
            noisy = {**clean, "velocity": clean["velocity"] + rng.normal(0.0, 0.05, TIMES.size)}
            told = wb.fit(LINE, noisy, FREE).remarks
            assert not any(one.startswith("time:") or "filtered" in one for one in told)


def causal(order: int, cutoff: float):
    return lambda one, rate: lfilter(*butter(order, cutoff, fs=rate), one)


def without_delay(cutoff: float):
    return lambda one, rate: filtfilt(*butter(2, cutoff, fs=rate), one)


def averaged(count: int):
    return lambda one, _: np.convolve(one, np.ones(count) / count)[: one.size]


def centred(count: int):
    return lambda one, _: np.convolve(one, np.ones(count) / count, "same")


class TestFiltered:
    """A filtered column is named so, with the kind and cut-off of its filter; nothing else is."""

    FREE: ClassVar = {"brake.kinetic": (0.2, 0.4), "shaft.stiffness": (2000.0, 4500.0)}
    CALM: ClassVar = LINE.replace(slope=-6.0, amplitude=400.0, initial_force=200.0, damping=1.0)

    def remarks(self, speed: np.ndarray) -> list[str]:
        start = machine().replace({"brake.kinetic": 0.33})
        trace = {"time": TIMES, "velocity": speed}
        found = wb.fit(start, trace, self.FREE, observe={"velocity": "disc.speed"})
        return [one for one in found.remarks if "filtered" in one]

    @pytest.mark.parametrize("noise", [0.0, 0.005])
    @pytest.mark.parametrize("cutoff", [30.0, 60.0, 100.0])
    @pytest.mark.parametrize(("order", "word"), [(1, "first order"), (2, "second order")])
    def test_kind_and_cutoff(self, order: int, word: str, cutoff: float, noise: float) -> None:
        speed = causal(order, cutoff)(trace_of(machine())["velocity"], 500.0)
        speed += noise * np.std(speed) * np.random.default_rng(2).normal(size=speed.size)
        (told,) = self.remarks(speed)
        if (order, cutoff) != (2, 30.0):  # the parameters imitate this one, like an average
            assert word in told
            found = float(re.findall(r"about (\S+) Hz", told)[0])
            assert found == pytest.approx(cutoff, rel=0.1)

    @pytest.mark.parametrize("cutoff", [30.0, 60.0, 100.0])
    def test_without_delay(self, cutoff: float) -> None:
        (told,) = self.remarks(without_delay(cutoff)(trace_of(machine())["velocity"], 500.0))
        assert "filtfilt" in told
        assert f"about {cutoff:g} Hz" in told

    @pytest.mark.parametrize("count", [5, 11])
    def test_moving_averages(self, count: int) -> None:
        speed = trace_of(machine())["velocity"]
        (told,) = self.remarks(centred(count)(speed, 500.0))
        assert f"centred moving average over {count} samples" in told
        assert len(self.remarks(averaged(count)(speed, 500.0))) == 1

    @pytest.mark.parametrize("change", [
        causal(1, 200.0), causal(1, 60.0), causal(1, 30.0), causal(2, 200.0), causal(2, 100.0),
        causal(2, 60.0), causal(2, 30.0), without_delay(200.0), without_delay(30.0), averaged(11),
        centred(11),
    ])  # fmt: skip
    def test_sticks_and_slips(self, change) -> None:
        times = np.arange(0.0, 2.0, 0.001)
        true = self.CALM.replace(kinetic=0.28)
        speed = wb.simulate(true, 2.0, times=times)["velocity"].to_numpy()
        trace = {"time": times, "velocity": change(speed, 1000.0)}
        free = {"kinetic": (0.1, 0.35), "slope": (-100.0, 0.0)}
        remarks = wb.fit(self.CALM.replace(slope=-5.0), trace, free).remarks
        assert sum("filtered" in one for one in remarks) == 1

    def test_missing_samples_and_a_gap(self) -> None:
        speed = causal(1, 60.0)(trace_of(machine())["velocity"], 500.0)
        speed[100:110] = np.nan
        gap = slice(400, 410)
        trace = {"time": np.delete(TIMES, gap), "velocity": np.delete(speed, gap)}
        start = machine().replace({"brake.kinetic": 0.33})
        found = wb.fit(start, trace, self.FREE, observe={"velocity": "disc.speed"})
        assert any("first order of about 6" in one for one in found.remarks)

    def test_segments(self) -> None:
        """The states of the segments follow the measurement: an average remains visible."""
        speed = centred(11)(trace_of(machine())["velocity"], 500.0)
        trace = {"time": TIMES, "velocity": speed}
        start = machine().replace({"brake.kinetic": 0.33})
        found = wb.fit(start, trace, self.FREE, observe={"velocity": "disc.speed"}, segments=5)
        assert any("moving average over 11" in one for one in found.remarks)

    @pytest.mark.slow
    @pytest.mark.parametrize("cutoff", [100.0, 60.0, 30.0])
    def test_chaotic_motion(self, cutoff: float) -> None:
        """The fit ends far from the parameters; the beginning of the trace shows the filter."""
        start = wb.load_study(Path(__file__).parents[2] / "examples" / "paper.toml").system
        times = np.arange(0.0, 2.0, 0.001)
        true = start.replace(kinetic=0.285, slope=-44.0)
        speed = wb.simulate(true, 2.0, times=times)["velocity"].to_numpy()
        trace = {"time": times, "velocity": causal(2, cutoff)(speed, 1000.0)}
        free = {"kinetic": (0.1, 0.5), "slope": (-100.0, 0.0)}
        assert any("filtered" in one for one in wb.fit(start, trace, free).remarks)

    def test_a_shift_of_the_times_is_a_delay(self) -> None:
        """It is no filter, although it cannot be told from one with a high cut-off."""
        (told,) = self.remarks(np.interp(TIMES - 0.003, TIMES, trace_of(machine())["velocity"]))
        assert "lags" in told
        assert float(re.findall(r"lags (\S+) s", told)[0]) == pytest.approx(0.003, rel=0.2)

    @pytest.mark.parametrize("change", [
        clipped, np.negative, lambda one: 1.1 * one, lambda one: one + 0.2,
        lambda one: np.append(np.delete(one, slice(250, 253)), one[-3:]),
    ])  # fmt: skip
    def test_other_faults(self, change) -> None:
        assert self.remarks(change(trace_of(machine())["velocity"])) == []

    @pytest.mark.parametrize("seed", range(5))
    def test_noise(self, seed: int) -> None:
        speed = trace_of(machine())["velocity"]
        noise = np.random.default_rng(seed).normal(0.0, 0.05 * np.std(speed), speed.size)
        assert self.remarks(speed + noise) == []

    def test_another_system(self) -> None:
        for name, value in (
            ("mount.stiffness", 1200.0), ("disc.inertia", 1.1), ("hub.inertia", 0.32),
            ("engine.amplitude", 72.0), ("shaft.damping", 2.0), ("brake.slope", -9.0),
        ):  # fmt: skip
            assert self.remarks(trace_of(machine().replace({name: value}))["velocity"]) == []

    @pytest.mark.slow
    def test_random_other_systems(self) -> None:
        rng, names = np.random.default_rng(5), ("stiffness", "inertia", "damping", "amplitude")
        free = {"kinetic": (0.1, 0.35), "slope": (-100.0, 0.0)}
        for _ in range(50):
            one, other = rng.choice(names, 2, replace=False)
            factors = np.exp(rng.normal(0.0, 0.15, 2))
            true = self.CALM.replace({
                one: factors[0] * self.CALM.value(one), other: factors[1] * self.CALM.value(other)
            })  # fmt: skip
            remarks = wb.fit(self.CALM.replace(slope=-5.0), trace_of(true), free).remarks
            assert not any("filtered" in one for one in remarks)


def test_sticks_at_the_largest_speed_are_not_clipped() -> None:
    """A mass that sticks to a belt, and the same trace clipped below the speed of the belt."""
    belt = wb.load_study(Path(__file__).parents[2] / "examples" / "belt.toml").system
    times = np.linspace(0.0, 20.0, 2001)
    velocity = wb.simulate(belt, 20.0, times=times)["velocity"].to_numpy()[:, 0]
    assert np.count_nonzero(velocity == velocity.max()) > 50
    free = {"belt.initial_force": (0.5, 2.0)}
    for highest, remarks in ((1.0, 0), (0.4, 1)):
        trace = {"time": times, "velocity": np.minimum(velocity, highest)}
        found = wb.fit(belt, trace, free, observe={"velocity": "mass.speed"})
        assert sum("clipped" in one for one in found.remarks) == remarks


def test_a_column_of_few_digits_is_not_clipped() -> None:
    times = np.linspace(0.0, 1.0, 2001)
    speed = wb.simulate(machine(), 1.0, times=times)["velocity"].to_numpy()[:, 0]
    free, observe = {"brake.kinetic": (0.2, 0.4)}, {"velocity": "disc.speed"}
    for digits in (0, 1):
        for limit, remarks in ((np.inf, 0), (1.0, 2)):
            column = np.round(np.clip(speed, -limit, limit), digits)
            if digits == 0 and remarks:  # three values: no different from clipping
                continue
            found = wb.fit(machine(), {"time": times, "velocity": column}, free, observe=observe)
            assert sum("clipped" in one for one in found.remarks) == remarks


def test_a_struct_of_matlab_is_named(tmp_path) -> None:
    path, trace = tmp_path / "trace.mat", trace_of(LINE)
    savemat(path, {"rec": trace})
    with pytest.raises(wb.InputError, match="rec is a struct with the fields time, velocity"):
        wb.fit(LINE, path, FREE)
    savemat(path, {**trace, "rec": {"room": "B"}})  # beside the columns, it does no harm
    found = wb.fit(LINE.replace(kinetic=0.29), path, {"kinetic": (0.2, 0.4)})
    assert found.values["kinetic"] == pytest.approx(0.3, rel=1e-8)


def test_a_value_at_the_end_of_its_range_is_told_with_this_end() -> None:
    trace = trace_of(LINE.replace(slope=0.0))
    found = wb.fit(LINE, trace, {"slope": (-90.0, -10.0)})
    assert any("bound -10 of" in one for one in found.undetermined)


def test_a_good_trace_has_no_remarks() -> None:
    trace = trace_of(LINE)
    trace["velocity"] += np.random.default_rng(3).normal(0.0, 0.02, TIMES.size)
    assert wb.fit(LINE, trace, FREE).remarks == []


@pytest.mark.parametrize(
    ("name", "ends"),
    [("initial_angle", (-0.1, 0.1)), ("time_shift", (-0.02, 0.02)), ("velocity.offset", (-1, 1))],
)
def test_values_that_are_zero_are_determined(name, ends) -> None:
    """Their standard errors are those of the same motion with a value that is not 0."""
    system = LINE.replace(slope=-6.0, amplitude=400.0, initial_force=200.0, damping=1.0)
    trace = trace_of(system)
    found = wb.fit(
        system.replace(kinetic=0.29), trace, {"kinetic": (0.1, 0.34), name: ends},
        sigma={"velocity": 1.0},
    )  # fmt: skip
    assert found.undetermined == []
    assert found.values[name] == pytest.approx(0.0, abs=1e-10)
    moved = {**trace, "velocity": trace["velocity"] + 1e-3 * np.sin(TIMES)}
    other = wb.fit(
        system.replace(kinetic=0.29), moved, {"kinetic": (0.1, 0.34), name: ends},
        sigma={"velocity": 1.0},
    )  # fmt: skip
    assert abs(other.values[name]) > 1e-9
    assert found.stderr[name] == pytest.approx(other.stderr[name], rel=1e-2)


def test_residuals_of_rounding_tell_nothing_of_the_times() -> None:
    system = LINE.replace(slope=-6.0, amplitude=400.0, initial_force=200.0, damping=1.0)
    times = np.arange(0.0, 2.0, 0.001)
    speed = wb.simulate(system.replace(kinetic=0.28), 2.0, times=times)["velocity"].to_numpy()
    for factor in (1.0, 30.0 / np.pi):
        trace = {"time": times, "v": factor * speed}
        free = {"kinetic": (0.1, 0.34), "slope": (-100.0, 0.0), "v.scale": (0.5, 20.0)}
        assert wb.fit(system, trace, free, observe={"v": "driveline.speed"}).remarks == []


def test_a_model_at_rest_explains_nothing_of_a_moving_trace() -> None:
    """Seconds in a column of milliseconds: the model has no time to move."""
    trace = trace_of(LINE)
    found = wb.fit(LINE, {"time [ms]": TIMES, "velocity": trace["velocity"]}, FREE)
    assert any("unit of the times" in one for one in found.remarks)
    noise = np.random.default_rng(0).normal(0.0, 0.1, TIMES.size)
    assert wb.fit(LINE, {"time": 1e-3 * TIMES, "velocity": noise}, FREE).remarks == []


def test_scale_and_offset_are_those_of_a_linear_fit() -> None:
    """Values and covariance of a problem that is linear, from many samples."""
    times = np.linspace(0.0, 1.0, 5000)
    velocity = wb.simulate(LINE, 1.0, times=times)["velocity"].to_numpy()
    measured = 3.0 * velocity - 2.0 + np.random.default_rng(3).normal(0.0, 0.5, times.size)
    measured[::7] = np.nan
    known, design = np.isfinite(measured), np.column_stack([velocity, np.ones_like(velocity)])
    expected = np.linalg.lstsq(design[known], measured[known], rcond=None)[0]
    found = wb.fit(
        LINE, {"time": times, "v": measured}, {"v.scale": (1.0, 5.0), "v.offset": (-9.0, 9.0)},
        observe={"v": "velocity"}, sigma={"v": 0.5},
    )  # fmt: skip
    np.testing.assert_allclose(list(found.values.values()), expected, rtol=1e-9)
    covariance = 0.25 * np.linalg.inv(design[known].T @ design[known])
    np.testing.assert_allclose(found.covariance.to_numpy(), covariance, rtol=1e-9)


@pytest.mark.parametrize(
    ("quantity", "variable", "dim"),
    [
        ("disc.angle", "angle", "inertia"), ("disc.speed", "velocity", "inertia"),
        ("shaft.torque", "shaft_torque", "shaft"), ("rear.torque", "brake_torque", "contact"),
        ("front.force", "actuation_force", "contact"),
    ],
)  # fmt: skip
def test_every_quantity_is_that_of_a_simulation(quantity: str, variable: str, dim: str) -> None:
    """At rest the two brakes share the torque of the disc as in ``simulate``."""
    response = wb.simulate(TWO_BRAKES, 1.0, times=TIMES)
    assert response["sticking"].to_numpy().any()
    part = quantity.partition(".")[0]
    trace = {"time": TIMES, "v": response[variable].sel({dim: part}).to_numpy()}
    free = {"front.kinetic": (0.1, 0.5), "front.slope": (-30.0, -1.0)}
    start = TWO_BRAKES.replace({"front.kinetic": 0.27, "front.slope": -8.0})
    found = wb.fit(start, trace, free, observe={"v": quantity})
    for name in free:
        assert found.values[name] == pytest.approx(TWO_BRAKES.value(name), rel=1e-7)


def test_the_gradient_of_the_sum_of_squares_is_zero() -> None:
    """By residuals and derivatives that are computed apart from the fit."""
    times, rng = np.linspace(0.0, 2.0, 2001), np.random.default_rng(5)
    names = {"velocity": "disc.speed", "torque": "shaft.torque"}
    clean = wb.simulate(TWO_BRAKES, 2.0, times=times)
    trace = {
        "time": times,
        "velocity": clean["velocity"].to_numpy()[:, 0] + rng.normal(0.0, 0.02, times.size),
        "torque": clean["shaft_torque"].to_numpy()[:, 0] + rng.normal(0.0, 1.0, times.size),
    }
    free = {"front.kinetic": (0.1, 0.5), "rear.initial_force": (100.0, 900.0)}
    sigma = {"velocity": 0.02, "torque": 1.0}
    found = wb.fit(TWO_BRAKES, trace, free, observe=names, sigma=sigma)
    run = {"duration": 2.0, "times": times}
    response = wb.simulate(found.system, **run)
    slopes = wb.sensitivity(found.system, list(free), **run)
    variables = {"velocity": "velocity", "torque": "shaft_torque"}
    residuals = [
        (response[one].to_numpy()[:, 0] - trace[column]) / sigma[column]
        for column, one in variables.items()
    ]
    changes = [slopes[one].to_numpy()[..., 0] / sigma[column] for column, one in variables.items()]
    residual, change = np.concatenate(residuals), np.concatenate(changes, axis=1)
    sizes = np.linalg.norm(change, axis=1) * np.linalg.norm(residual)
    assert np.all(np.abs(change @ residual) <= 1e-6 * sizes)


def test_a_lost_sample_is_named_and_does_no_harm() -> None:
    trace = {name: np.delete(one, slice(200, 210)) for name, one in trace_of(LINE).items()}
    found = wb.fit(LINE.replace(kinetic=0.28), trace, FREE)
    assert found.values["kinetic"] == pytest.approx(0.3, rel=1e-8)
    assert any("gap" in one for one in found.remarks)


def test_a_profile_is_the_smallest_sum_over_the_others() -> None:
    trace = trace_of(LINE)
    trace["velocity"] += np.random.default_rng(4).normal(0.0, 0.05, TIMES.size)
    found = wb.fit(LINE, trace, FREE, sigma={"velocity": 0.05})
    at, error = found.values["kinetic"], found.stderr["kinetic"]
    costs = found.profile("kinetic", [at - error, at, at + error])["cost"].to_numpy()
    # One standard deviation away the sum of squares in sigmas is larger by 1.
    np.testing.assert_allclose(costs - costs[1], [1.0, 0.0, 1.0], atol=0.05)


def write_tdms(path: Path, values: np.ndarray, unit: str = "") -> None:
    from nptdms import ChannelObject, TdmsWriter

    waveform = {"wf_increment": TIMES[1] - TIMES[0], "wf_start_offset": 0.0}
    waveform |= {"unit_string": unit} if unit else {}
    with TdmsWriter(path) as file:
        file.write_segment([ChannelObject("bench", "velocity", values, properties=waveform)])


def write_mf4(path: Path, values: np.ndarray, unit: str = "") -> None:
    """With a second channel that is sampled at other times."""
    from asammdf import MDF, Signal

    with MDF() as file:
        file.append(Signal(values, TIMES, name="velocity", unit=unit))
        file.append(Signal(np.ones(5), 0.0005 + np.arange(5), name="room"))
        file.save(path)


def write_nc(path: Path, values: np.ndarray, unit: str = "") -> None:
    dataset_of(TIMES, values, "s", unit).to_netcdf(path)


def dataset_of(times: np.ndarray, values: np.ndarray, *units: str) -> object:
    import xarray as xr

    first, second = ({"units": one} if one else {} for one in units)
    return xr.Dataset({"velocity": ("time", values, second)}, {"time": ("time", times, first)})


def write_uff(path: Path, values: np.ndarray, unit: str = "") -> None:
    import pyuff

    function = pyuff.prepare_58(
        func_type=1, rsp_node=3, rsp_dir=1, ref_node=0, ref_dir=0, id1="velocity", data=values,
        x=TIMES, ord_data_type=4, num_pts=TIMES.size, abscissa_spacing=1, abscissa_min=0.0,
        abscissa_inc=TIMES[1] - TIMES[0], binary=0, return_full_dict=True,
        ordinate_axis_units_lab=unit or None,
    )  # fmt: skip
    # Its other fields are empty.
    text = ("id1", "id2", "id3", "id4", "id5", "_name", "_lab")
    function |= {
        name: "" if any(one in name for one in text) else 0
        for name, value in function.items() if value is None
    }  # fmt: skip
    pyuff.UFF(str(path)).write_sets(function)


def test_channels_of_different_times_are_refused(tmp_path) -> None:
    from nptdms import ChannelObject, TdmsWriter

    with TdmsWriter(tmp_path / "trace.tdms") as file:
        file.write_segment([
            ChannelObject(group, "velocity", np.ones(50), properties={"wf_increment": step})
            for group, step in (("disc", 0.01), ("hub", 0.02))
        ])  # fmt: skip
    with pytest.raises(wb.InputError) as caught:
        wb.fit(LINE, tmp_path / "trace.tdms", FREE)
    assert caught.value.name == "trace"


WRITERS = {"tdms": write_tdms, "mf4": write_mf4, "uff": write_uff, "nc": write_nc}
KINETIC = {"kinetic": (0.2, 0.4)}


@pytest.mark.parametrize("form", WRITERS)
def test_units_in_files_are_read(form, tmp_path) -> None:
    path = tmp_path / f"trace.{form}"
    WRITERS[form](path, 30.0 / np.pi * trace_of(LINE)["velocity"], "rpm")
    found = wb.fit(LINE.replace(kinetic=0.29), path, KINETIC)
    assert found.values["kinetic"] == pytest.approx(0.3, rel=1e-8)
    path = tmp_path / f"other.{form}"
    WRITERS[form](path, trace_of(LINE)["velocity"], "V")  # another quantity: as in a name
    with pytest.raises(wb.InputError, match="observe"):
        wb.fit(LINE, path, KINETIC)
    found = wb.fit(LINE.replace(kinetic=0.29), path, KINETIC, observe={"velocity": "velocity"})
    assert found.values["kinetic"] == pytest.approx(0.3, rel=1e-8)


def test_units_of_times_in_metadata_are_read(tmp_path) -> None:
    from nptdms import ChannelObject, TdmsWriter

    speed, start = trace_of(LINE)["velocity"], LINE.replace(kinetic=0.29)
    trace = dataset_of(1e3 * TIMES, speed, "ms", "rad/s")
    trace.to_netcdf(tmp_path / "trace.nc")
    with TdmsWriter(tmp_path / "trace.tdms") as file:
        file.write_segment([
            ChannelObject("bench", "time", 1e3 * TIMES, properties={"unit_string": "ms"}),
            ChannelObject("bench", "velocity", speed),
        ])  # fmt: skip
    arrays = {str(name): one for name, one in trace.variables.items()}
    for given in (trace, arrays, tmp_path / "trace.nc", tmp_path / "trace.tdms"):
        assert wb.fit(start, given, KINETIC).values["kinetic"] == pytest.approx(0.3, rel=1e-8)
    with pytest.raises(wb.InputError, match=r"time \[s\]") as raised:
        wb.fit(start, dataset_of(TIMES, speed, "counts", ""), KINETIC)
    assert (raised.value.name, raised.value.value) == ("trace['time']", "counts")


def test_a_response_is_a_trace(tmp_path) -> None:
    """With the units that its variables state, also from a file."""
    response = wb.simulate(LINE, 1.0, times=TIMES)[["velocity"]]
    response.to_netcdf(tmp_path / "trace.nc")
    for given in (response, tmp_path / "trace.nc"):
        found = wb.fit(LINE.replace(kinetic=0.29), given, KINETIC)
        assert found.values["kinetic"] == pytest.approx(0.3, rel=1e-8)


@pytest.mark.parametrize(
    ("name", "unit", "factor"),
    [("v [rpm]", "1/min", None), ("v [rpm]", "rad/s", None), ("v [rpm]", "V", None),
     ("v [rpm]", "rpm", 30.0 / np.pi), ("v [°/s]", "deg/s", 180.0 / np.pi),
     ("v (left)", "rpm", 30.0 / np.pi), ("v [rpm]", "-", 30.0 / np.pi), ("v", "NONE", 1.0)],
)  # fmt: skip
def test_a_unit_in_the_name_and_one_in_the_metadata(name, unit, factor) -> None:
    import xarray as xr

    speed = (factor or 1.0) * trace_of(LINE)["velocity"]
    trace = {"time": TIMES, name: xr.DataArray(speed, attrs={"units": unit})}
    observe, start = {name: "velocity"}, LINE.replace(kinetic=0.29)
    if factor is not None:
        found = wb.fit(start, trace, KINETIC, observe=observe)
        assert found.values["kinetic"] == pytest.approx(0.3, rel=1e-8)
        return
    with pytest.raises(wb.InputError) as raised:
        wb.fit(start, trace, KINETIC, observe=observe)
    assert raised.value.name == f"trace[{name!r}]"
    assert "rpm" in str(raised.value)
    assert repr(unit) in str(raised.value)


@pytest.mark.parametrize("form", ["csv", "mat", "nc", "tdms", "mf4", "uff", "frame", "dataset"])
def test_forms_of_a_trace(form, tmp_path) -> None:
    trace = trace_of(LINE)
    path = tmp_path / f"trace.{form}"
    if form == "csv":
        rows = np.column_stack(list(trace.values()))
        np.savetxt(path, rows, delimiter=",", header="time,velocity", comments="", fmt="%.17g")
    elif form == "mat":
        savemat(path, trace)
    elif form in WRITERS:
        WRITERS[form](path, trace["velocity"])
    else:
        import xarray as xr

        path = xr.Dataset({"velocity": ("time", trace["velocity"])}, {"time": TIMES})
        if form == "nc":
            path.to_netcdf(tmp_path / "trace.nc")
            path = tmp_path / "trace.nc"
        elif form == "frame":
            path = pd.DataFrame(trace)
    found = wb.fit(LINE.replace(kinetic=0.29), path, {"kinetic": (0.2, 0.4)})
    assert found.values["kinetic"] == pytest.approx(0.3, rel=1e-8)


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "cp1252"])
@pytest.mark.parametrize("separator", [",", ";", "\t"])
def test_names_in_the_encodings_of_spreadsheets(encoding, separator, tmp_path) -> None:
    times, speed = trace_of(LINE).values()
    times = 1e6 * times
    lines = [f"t [µs]{separator}Größe", *map(f"{{:.17g}}{separator}{{:.17g}}".format, times, speed)]
    path = tmp_path / "trace.csv"
    path.write_bytes("\n".join(lines).encode(encoding))
    start = LINE.replace(kinetic=0.29)
    found = wb.fit(
        start, path, {"kinetic": (0.2, 0.4)}, time="t [µs]", observe={"Größe": "velocity"}
    )
    assert found.values["kinetic"] == pytest.approx(0.3, rel=1e-8)


# Names of columns of times, and their unit in seconds.
TIME_NAMES = {
    "time": 1.0, "t": 1.0, "TIME [s]": 1.0, "Time (sec)": 1.0, "time_s": 1.0, "time [ms]": 1e-3,
    "t (ms)": 1e-3, "Time_ms": 1e-3, "time/ms": 1e-3, "t[us]": 1e-6, "time (µs)": 1e-6,
    "time_ns": 1e-9, "Time [min]": 60.0, "clock [ms]": 1e-3,
}  # fmt: skip


@pytest.mark.parametrize(("name", "unit"), TIME_NAMES.items())
def test_units_of_times_are_read(name, unit, tmp_path) -> None:
    times, speed = trace_of(LINE).values()
    path = tmp_path / "trace.csv"
    columns = {name: times / unit, "velocity": speed}
    if name != "clock [ms]":  # times without a usual name are the first column
        columns = dict(reversed(columns.items()))
    pd.DataFrame(columns).to_csv(path, index=False)
    found = wb.fit(LINE.replace(kinetic=0.29), path, {"kinetic": (0.2, 0.4)})
    assert found.values["kinetic"] == pytest.approx(0.3, rel=1e-8)


def test_a_name_with_other_words_is_no_unit_of_times() -> None:
    trace = {**trace_of(LINE), "time_stamp": 1e3 * TIMES, "T": TIMES}
    found = wb.fit(LINE.replace(kinetic=0.29), trace, {"kinetic": (0.2, 0.4)})
    assert found.values["kinetic"] == pytest.approx(0.3, rel=1e-8)


@pytest.mark.parametrize(("name", "unit"), [("time [counts]", "counts"), ("t (rpm)", "rpm")])
def test_an_unknown_unit_of_times_is_refused(name, unit) -> None:
    with pytest.raises(wb.InputError, match=r"time \[s\]") as raised:
        wb.fit(LINE, {name: TIMES, "velocity": np.sin(TIMES)}, FREE)
    assert (raised.value.name, raised.value.value) == (f"trace[{name!r}]", unit)


@pytest.mark.parametrize(
    ("quantity", "column", "factor"),
    [
        ("velocity", "velocity [rpm]", 30.0 / np.pi), ("velocity", "velocity (1/s)", 1.0),
        ("velocity", "n [°/s]", 180.0 / np.pi), ("angle", "angle (deg)", 180.0 / np.pi),
        ("brake_torque", "brake_torque [kN m]", 1e-3), ("brake_torque", "torque [Nm]", 1.0),
        ("actuation_force", "F [kN]", 1e-3), ("velocity", "velocity [V]", 1.0),
    ],
)  # fmt: skip
def test_units_of_columns_are_read(quantity, column, factor) -> None:
    """A unit of another quantity, or none that is known, is not converted, as for a voltage."""
    response = wb.simulate(LINE, 1.0, times=TIMES)
    trace = {"time": TIMES, column: factor * response[quantity].to_numpy()}
    start, free = LINE.replace(kinetic=0.29), {"kinetic": (0.2, 0.4)}
    if quantity == "actuation_force":
        start, free = LINE.replace(slope=-39.0), {"slope": (-45.0, -35.0)}
    found = wb.fit(start, trace, free, observe={column: quantity})
    (name,) = free
    assert found.values[name] == pytest.approx(LINE.value(name), rel=1e-6)
    known = column.startswith(quantity) and "V" not in column and "1/s" not in column
    if known:
        assert wb.fit(start, trace, free).values == found.values
    else:
        with pytest.raises(wb.InputError, match="observe"):
            wb.fit(start, trace, free)


def test_an_empty_file_is_refused(tmp_path) -> None:
    path = tmp_path / "trace.csv"
    path.write_bytes(b"")
    with pytest.raises(wb.InputError, match="empty") as raised:
        wb.fit(LINE, path, FREE)
    assert raised.value.name == "trace"


@pytest.mark.parametrize(
    ("name", "changes"),
    [
        ("free", {"free": {"friction": (0.1, 0.5)}}),
        ("free['kinetic']", {"free": {"kinetic": (0.4, 0.5)}}),
        ("free['kinetic']", {"free": {"kinetic": 0.3}}),
        ("free['slope']", {"free": {"slope": (-90.0, 1e13)}}),
        ("observe", {"observe": {"speed": "velocity"}}),
        ("observe['velocity']", {"observe": {"velocity": "disc.speed"}}),
        ("time", {"time": "seconds"}),
        ("trace", {"trace": 3.0}),
        ("trace", {"trace": "nowhere.csv"}),
        ("trace['time']", {"trace": {"time": 1e3 * TIMES, "velocity": np.sin(TIMES)}}),
        ("trace['time']", {"trace": {"time": TIMES[::-1], "velocity": np.sin(TIMES)}}),
        ("trace['time']", {"trace": {"time": ["0,1", "0,2"], "velocity": [1.0, 2.0]}}),
        ("trace['velocity']", {"trace": {"time": TIMES, "velocity": ["rad/s", *TIMES[1:]]}}),
        (
            "trace['speed']",
            {
                "trace": {"time": TIMES, "velocity": TIMES, "speed": ["0,1"] * TIMES.size},
                "observe": {"speed": "velocity"},
            },
        ),
        ("loss", {"loss": "square"}),
        ("sigma['velocity']", {"sigma": {"velocity": -1.0}}),
    ],
)
def test_what_is_refused_is_named(name, changes) -> None:
    arguments = {"trace": {"time": TIMES, "velocity": np.sin(TIMES)}, "free": FREE, **changes}
    with pytest.raises(wb.InputError) as raised:
        wb.fit(LINE, **arguments)
    assert raised.value.name == name


def test_a_parameter_without_derivative_is_refused() -> None:
    line = LINE.replace(sample_time=0.01)
    with pytest.raises(wb.InputError, match="sample_time"):
        wb.fit(line, trace_of(line), {"sample_time": (0.005, 0.02)})


def test_the_picture_shows_measured_and_fitted_columns() -> None:
    figure = wb.plot(wb.fit(LINE, trace_of(LINE), {"kinetic": (0.29, 0.31)}))
    assert len(figure.axes) == 2
    assert {len(one.lines) for one in figure.axes} >= {2}


def test_the_picture_gives_values_with_their_units_and_as_many_digits_as_are_known() -> None:
    trace = trace_of(LINE)
    trace["velocity"] += np.random.default_rng(3).normal(0.0, 0.02, TIMES.size)
    found = wb.fit(LINE, trace, FREE)
    written = " ".join(text.get_text() for text in wb.plot(found).findobj(Text))
    value, error, unit = re.search(r"slope = (\S+) ± (\S+) (.*?) \(", written).groups()
    assert unit == "N s/rad"
    low, high = found.interval()["slope"]
    assert float(error) == pytest.approx(0.5 * (high - low), rel=0.05)
    assert abs(float(value.replace("−", "-")) - found.values["slope"]) <= 0.05 * float(error)
    assert len(value.partition(".")[2]) == len(error.partition(".")[2])
