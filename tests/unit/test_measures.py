"""Spectrum, Poincare section and sticks, against signals and motions known otherwise."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest
import xarray as xr

import wedgebrake as wb
from wedgebrake.analysis.responses import sticking


def signal(values, interval=0.01, start=0.0, forcing=None):
    values = np.asarray(values, dtype=float)
    times = start + interval * np.arange(values.size)
    dataset = xr.Dataset(
        {"velocity": ("time", values, {"units": "rad/s"})}, coords={"time": ("time", times)}
    )
    if forcing is not None:
        line = {"inertia": 1.0, "stiffness": 1e4}
        dataset.attrs["system"] = json.dumps(
            {"driveline": line, "excitation": {"frequency": forcing}}
        )
    return dataset


def with_sticks(rows, end=10.0, start=0.0):
    """A response with nothing but sticks: rows of (start, end, entry, exit)."""
    table = np.array(rows, dtype=float).reshape(-1, 4)
    dataset = xr.Dataset(
        {
            "stick_start": ("stick", table[:, 0]),
            "stick_end": ("stick", table[:, 1]),
            "stick_entry": ("stick", table[:, 2].astype(np.int8)),
            "stick_exit": ("stick", table[:, 3].astype(np.int8)),
        },
        coords={"time": ("time", np.linspace(start, end, 11))},
    )
    dataset.attrs["final_time"] = end
    return dataset


class TestSpectrum:
    @pytest.mark.parametrize("n", [1000, 1001])
    @pytest.mark.parametrize("window", ["hann", "boxcar", "flattop", ("kaiser", 8.6)])
    def test_sine_at_a_bin_gives_its_amplitude(self, n, window):
        t = 0.01 * np.arange(n)
        frequency = 100 / (0.01 * n)
        lines = wb.spectrum(signal(2.5 * np.sin(2 * np.pi * frequency * t + 0.4)), window=window)
        # A Kaiser window leaks from the negative frequency; the others vanish at the bins.
        leak = 1e-5 if isinstance(window, tuple) else 1e-9
        assert float(lines.amplitude[100]) == pytest.approx(2.5, rel=leak)
        assert float(lines.frequency[100]) == pytest.approx(frequency, rel=1e-12)
        assert lines.amplitude.units == "rad/s"
        assert lines.frequency.units == "Hz"
        # Far from the line there is nothing but the window's side lobes.
        assert float(lines.amplitude[300:].max()) < 1e-4

    @pytest.mark.parametrize("n", [2, 3, 500, 501])
    def test_parseval(self, n):
        values = np.random.default_rng(7).normal(size=n)
        amplitude = wb.spectrum(signal(values), window="boxcar").amplitude.to_numpy()
        power = amplitude**2 / 2.0
        power[0] *= 2.0
        if n % 2 == 0:
            power[-1] *= 2.0
        assert power.sum() == pytest.approx(np.mean(values**2), rel=1e-12)

    def test_window_is_stated(self):
        lines = wb.spectrum(signal(np.ones(200)))
        assert lines.attrs["window"] == "hann"
        assert lines.attrs["coherent_gain"] == pytest.approx(0.5)
        assert lines.attrs["noise_bandwidth"] == pytest.approx(1.5)
        assert lines.attrs["resolution"] == pytest.approx(0.5)
        assert lines.attrs["samples"] == 200
        assert "forcing_frequency" not in lines.attrs

    def test_start_and_stop(self):
        values = np.concatenate((np.zeros(500), np.sin(2 * np.pi * 10 * 0.01 * np.arange(500))))
        lines = wb.spectrum(signal(values), window="boxcar", start=5.0)
        assert lines.attrs["samples"] == 500
        assert float(lines.amplitude.sel(frequency=10.0)) == pytest.approx(1.0)
        silent = wb.spectrum(signal(values), start=0.0, stop=4.99)
        assert float(silent.amplitude.max()) == 0.0
        assert (silent.attrs["start"], silent.attrs["stop"]) == pytest.approx((0.0, 4.99))

    def test_sample_that_repeats_the_first_phase_is_left_out(self):
        t = 0.01 * np.arange(1001)  # 0 to 10 s, both ends
        whole = signal(np.sin(2 * np.pi * 2.5 * t), forcing=2.5)
        lines = wb.spectrum(whole, window="boxcar")
        assert lines.attrs["samples"] == 1000
        assert float(lines.amplitude.sel(frequency=2.5)) == pytest.approx(1.0, rel=1e-12)
        assert lines.attrs["forcing_frequency"] == 2.5
        assert lines.attrs["natural_frequency"] == pytest.approx(100 / (2 * math.pi))
        assert wb.spectrum(signal(np.sin(t), forcing=2.51)).attrs["samples"] == 1001

    def test_times_that_are_not_equally_spaced(self):
        response = wb.simulate(wb.paper.system(), periods=2, times=[0.0, 0.01, 0.05, 0.06])
        with pytest.raises(wb.InputError, match=r"^response"):
            wb.spectrum(response)

    @pytest.mark.parametrize(
        ("arguments", "name"),
        [
            ({"quantity": "velocty"}, "quantity"),
            ({"window": "hanning!"}, "window"),
            ({"window": ("kaiser",)}, "window"),
            ({"start": 0.9, "stop": 0.1}, "start"),
            ({"start": 0.989}, "start"),
            ({"start": "now"}, "start"),
            ({"stop": math.nan}, "stop"),
        ],
    )
    def test_wrong_arguments(self, arguments, name):
        with pytest.raises(wb.InputError, match=f"^{name}"):
            wb.spectrum(signal(np.ones(100)), **arguments)

    def test_wrong_responses(self):
        for wrong in (signal([1.0]), signal([]), signal([1.0, math.inf, 0.0]), [1.0, 2.0]):
            with pytest.raises(wb.InputError):
                wb.spectrum(wrong)


class TestPoincare:
    def test_equals_the_simulation_at_whole_periods(self):
        system = wb.paper.system()
        points = wb.poincare(system, periods=120, transient=60)
        response = wb.simulate(system, periods=120)
        assert points.period.to_numpy().tolist() == list(range(60, 121))
        for name in ("angle", "velocity"):
            np.testing.assert_allclose(
                points[name], response[f"poincare_{name}"][60:], rtol=1e-12, atol=1e-13
            )
            assert points[name].units == response[name].units
        np.testing.assert_allclose(points.time, points.period / system.excitation.frequency)
        assert points.attrs["status"] == "completed"
        assert points.attrs["message"] == response.attrs["message"]

    def test_section_of_the_paper(self):
        system = wb.paper.system()
        period = system.excitation.period
        points = wb.poincare(system, periods=50, transient=0, section_time=20.0)
        times = 20.0 + period * np.arange(51)
        response = wb.simulate(system, duration=25.0, times=times)
        assert points.sizes["period"] == 51
        np.testing.assert_allclose(points.angle, response.angle, atol=1e-12)
        np.testing.assert_allclose(points.velocity, response.velocity, atol=1e-10)
        assert points.attrs["section_phase"] == pytest.approx(20.0 / period % 1.0, abs=1e-12)

    def test_a_run_that_ends_early_gives_what_it_reached(self):
        system = wb.paper.system(damping=1.0, static=0.33, release=False)
        points = wb.poincare(system, periods=20, transient=0)
        assert points.attrs["status"] == "diverged"
        assert points.period.to_numpy().tolist() == [0, 1]
        assert wb.poincare(system, periods=20, transient=10).sizes["period"] == 0

    @pytest.mark.parametrize(
        ("name", "value"),
        [
            ("periods", 10.0),
            ("transient", 250),
            ("times", [1.0]),
            ("duration", 25.0),
            ("rtoll", 1e-6),
            ("method", "exakt"),
        ],
    )
    def test_wrong_arguments(self, name, value):
        with pytest.raises(wb.InputError, match=f"^{name}"):
            wb.poincare(wb.paper.system(), **{name: value})

    def test_point_before_the_start(self):
        with pytest.raises(wb.InputError, match=r"^transient"):
            wb.poincare(wb.paper.system(), start_time=25.0)


class TestSticks:
    @pytest.mark.parametrize(
        ("rows", "expected"),
        [
            ([], sticking.NON_STICK_SLIP),
            ([(8.5, 8.6, 1, 1), (9, 9.1, 1, -1)], sticking.UNIDIRECTIONAL),
            ([(8.5, 8.6, -1, 1), (9, 9.1, -1, 1)], sticking.UNIDIRECTIONAL),
            ([(8.5, 8.6, 1, 1), (9, 9.1, -1, -1)], sticking.BIDIRECTIONAL),
            ([(1, 1.1, -1, 1), (9, 9.1, 1, 1)], sticking.UNIDIRECTIONAL),
            ([(1, 1.1, -1, 1), (2, 2.2, 1, 1)], sticking.NON_STICK_SLIP),
            # Entered before the window: it does not count.
            ([(7.9, 8.1, -1, 1), (9, 9.1, 1, 1)], sticking.UNIDIRECTIONAL),
            ([(7.9, 8.1, -1, 1)], sticking.NON_STICK_SLIP),
            ([(0, 10, 0, 0)], sticking.AT_REST),
            ([(3, 10, 1, 0)], sticking.AT_REST),
            ([(9, 10, 1, 0)], sticking.UNIDIRECTIONAL),
        ],
    )
    def test_classes(self, rows, expected):
        assert sticking.stick_slip_class(with_sticks(rows)) == expected

    def test_table_and_share(self):
        response = with_sticks([(0, 1, 0, 1), (3, 3.5, 1, -1), (7, 9, -1, -1), (9.5, 10, 1, 0)])
        found = wb.sticks(response)
        assert found.duration.to_numpy().tolist() == [1.0, 0.5, 2.0, 0.5]
        assert found.entry.to_numpy().tolist() == [0, 1, -1, 1]
        assert found.exit.to_numpy().tolist() == [1, -1, -1, 0]
        assert found.attrs["count"] == 3
        assert (found.attrs["count_forward"], found.attrs["count_backward"]) == (2, 1)
        assert found.attrs["share"] == pytest.approx(0.4)
        assert found.start.units == "s"

        late = wb.sticks(response, 8.0)
        assert late.start.to_numpy().tolist() == [7.0, 9.5]
        assert late.attrs["count"] == 1
        assert late.attrs["share"] == pytest.approx(1.5 / 2.0)
        assert (late.attrs["window_start"], late.attrs["window_end"]) == (8.0, 10.0)

    @pytest.mark.parametrize(
        ("system", "expected"),
        [
            (wb.paper.system(eta=0.0, F0=0.09), sticking.BIDIRECTIONAL),
            (wb.paper.system(eta=-60.0), sticking.UNIDIRECTIONAL),
            (wb.paper.system(brake="conventional"), sticking.NON_STICK_SLIP),
            (wb.paper.system(alpha=0.9), sticking.AT_REST),
            # The brake holds 41 N m backwards and 333 N m forwards: rest, from the start.
            (wb.paper.system(F0=0.5), sticking.AT_REST),
        ],
    )
    def test_known_motions(self, system, expected):
        response = wb.simulate(system, periods=250)
        assert wb.sticks(response).attrs["class"] == expected

    def test_responses_without_samples_or_length(self):
        empty = wb.simulate(wb.paper.system(), periods=20, times=[])
        assert wb.sticks(empty).attrs["window_end"] == pytest.approx(1.99466, abs=1e-4)
        point = wb.simulate(wb.paper.system(), duration=0.0)
        assert wb.sticks(point).attrs["class"] == sticking.AT_REST

    def test_wrong_arguments(self):
        response = with_sticks([])
        with pytest.raises(wb.InputError, match=r"^start = 11.0"):
            wb.sticks(response, 11.0)
        with pytest.raises(wb.InputError, match=r"^start = 'end'"):
            sticking.stick_slip_class(response, "end")
        with pytest.raises(wb.InputError, match=r"^response"):
            wb.sticks(signal([1.0, 2.0]))


def test_every_code_says_what_its_numbers_stand_for():
    """Small whole numbers are codes: flag_values holds them all, flag_meanings a word for each."""
    system = wb.paper.system()
    response = wb.simulate(system, periods=40)
    square = {"initial_angle": [-0.1, 0.1], "initial_velocity": [-1.0, 1.0]}
    results = {
        "simulate": response,
        "sticks": wb.sticks(response),
        "spectral_lines": wb.spectral_lines(wb.spectrum(response)),
        "regime_map": wb.regime_map(system, eta=[-1, 0], F0=[0.03, 0.04], periods=20, transient=9),
        "basins": wb.basins(system, **square, transient=20, periods=30),
    }
    for name, dataset in results.items():
        codes = [one for one in dataset.data_vars.values() if one.dtype == np.int8]
        assert codes, name
        for one in codes:
            values, words = one.attrs["flag_values"], one.attrs["flag_meanings"].split()
            assert len(values) == len(words) == len(set(words))
            assert set(np.unique(one)) <= set(values), (name, one.name)
    attractor = results["basins"]["attractor"]
    assert set(attractor.to_numpy()[attractor < 0]) <= set(attractor.attrs["flag_values"])
