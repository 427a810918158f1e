"""Spectral lines, against signals made of known lines and motions of known period."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest
import xarray as xr

import wedgebrake as wb
from wedgebrake.analysis.responses.spectral_peaks import spectral_lines

INTERVAL = 0.01
FORCING, NATURAL = 10.0, 15.915494309189533


def signal(lines, n=2000, mean=0.0, forcing=None, natural=None):
    """A response of sines (frequency, amplitude, phase) about a mean, n samples."""
    t = INTERVAL * np.arange(n)
    values = mean + sum(a * np.cos(2 * np.pi * f * t + phase) for f, a, phase in lines)
    dataset = xr.Dataset(
        {"velocity": ("time", values + 0.0 * t, {"units": "rad/s"})}, coords={"time": ("time", t)}
    )
    if forcing is not None:
        stiffness = (2 * math.pi * natural) ** 2 if natural else 0.0
        tables = {
            "driveline": {"inertia": 1.0, "stiffness": stiffness},
            "excitation": {"frequency": forcing},
        }
        dataset.attrs["system"] = json.dumps(tables)
    return dataset


def lines_of(*lines, window="hann", count=12, floor=1e-3, **more):
    return spectral_lines(wb.spectrum(signal(lines, **more), window=window), count, floor)


def named(*frequencies, n=2001, natural=NATURAL):
    """Labels of lines of falling amplitude; 2000 of n = 2001 samples are used, 0.05 Hz apart."""
    known = [(f, 2.0**-i, 0.3 * i) for i, f in enumerate(frequencies)]
    return lines_of(*known, n=n, forcing=FORCING, natural=natural)


WINDOWS = ["hann", "boxcar", "blackman", "flattop", ("kaiser", 8.6)]


class TestInterpolation:
    @pytest.mark.parametrize("window", WINDOWS)
    @pytest.mark.parametrize("share", [0.0, 0.2, 0.5, 0.77, -0.01])
    def test_one_line_between_bins(self, window, share):
        n = 2001
        resolution = 1.0 / (n * INTERVAL)
        frequency = (400 + share) * resolution
        found = lines_of((frequency, 2.5, 0.4), window=window, n=n)
        # What the negative frequency leaks, 800 bins away: of a boxcar 1/(800 pi), of a
        # flattop 1e-5, which counts where the lobe is so flat.
        loose = {"boxcar": 1e-3, "flattop": 1e-4}.get(window, 1e-5)
        assert found.sizes["line"] == 1
        assert float(found.frequency[0]) == pytest.approx(frequency, abs=loose * resolution)
        assert float(found.amplitude[0]) == pytest.approx(2.5, rel=loose)
        assert found.amplitude.units == "rad/s"

    def test_several_lines_strongest_first(self):
        known = [(7.013, 0.2, 0.0), (12.377, 3.0, 1.0), (20.0, 1.0, 2.0), (31.61, 0.05, 3.0)]
        found = lines_of(*known)
        assert found.line.to_numpy().tolist() == [1, 2, 3, 4]
        np.testing.assert_allclose(found.frequency, [12.377, 20.0, 7.013, 31.61], atol=5e-5)
        np.testing.assert_allclose(found.amplitude, [3.0, 1.0, 0.2, 0.05], rtol=1e-3)

    def test_mean_and_nyquist_are_not_doubled(self):
        found = lines_of((10.0, 0.5, 0.3), (50.0, 0.2, 0.0), mean=-3.0)
        assert found.label.to_numpy().tolist() == ["mean", "10.000 Hz", "50.000 Hz"]
        np.testing.assert_allclose(found.amplitude, [3.0, 0.5, 0.2], rtol=1e-9)

    def test_a_large_mean_does_not_raise_the_floor(self):
        found = lines_of((10.0, 1e-4, 0.3), mean=1.0)
        np.testing.assert_allclose(found.amplitude, [1.0, 1e-4], rtol=1e-6)


class TestLeakage:
    @pytest.mark.parametrize("window", WINDOWS)
    def test_side_lobes_are_no_lines(self, window):
        # Half a bin off: the worst leakage. Two lines: their side lobes interfere.
        resolution = 1.0 / (2000 * INTERVAL)
        pair = [(200.5 * resolution, 1.0, 0.0), (611.5 * resolution, 0.8, 1.0)]
        found = lines_of(*pair, window=window, floor=0.0)
        strong = found.amplitude.to_numpy() > 1e-4
        assert np.count_nonzero(strong) == 2
        assert set(found.label.to_numpy()[strong]) == {"10.025 Hz", "30.575 Hz"}

    def test_a_weak_line_beside_a_strong_one(self):
        resolution = 1.0 / (2000 * INTERVAL)
        strong, weak = 200.5 * resolution, 207.0 * resolution
        found = lines_of((strong, 1.0, 0.0), (weak, 0.01, 1.0))
        assert found.sizes["line"] == 2
        assert float(found.frequency[1]) == pytest.approx(weak, abs=0.2 * resolution)
        assert float(found.amplitude[1]) == pytest.approx(0.01, rel=0.15)

    def test_rounding_is_no_line(self):
        assert lines_of((10.0, 1.0, 0.0), floor=0.0).sizes["line"] == 1
        assert lines_of(mean=2.0, floor=0.0).label.to_numpy().tolist() == ["mean"]
        silent = lines_of(forcing=FORCING, natural=NATURAL)
        assert silent.sizes == {"line": 0}
        assert set(silent.data_vars) == set(named(FORCING).data_vars)


class TestNames:
    def test_multiples_and_fractions(self):
        found = named(10.0, 30.0, 20 / 3, 25.0, 35 / 6)
        assert found.label.to_numpy().tolist() == ["f_e", "3 f_e", "2/3 f_e", "5/2 f_e", "7/12 f_e"]
        assert found.numerator.to_numpy().tolist() == [1, 3, 2, 5, 7]
        assert found.denominator.to_numpy().tolist() == [1, 1, 3, 2, 12]
        assert found.multiple.to_numpy().tolist() == [1, 3, 1, 2, 1]
        np.testing.assert_allclose(found.order, [1.0, 3.0, 2 / 3, 2.5, 7 / 12], atol=1e-4)
        np.testing.assert_allclose(found.offset, [0.0, 0.0, -10 / 3, 5.0, -25 / 6], atol=1e-3)

    def test_natural_frequency_and_its_side_bands(self):
        found = named(NATURAL, 10.0, 20.0 - NATURAL, 40.0 - NATURAL, 10.0 + NATURAL, NATURAL - 10.0)
        assert found.label.to_numpy().tolist() == [
            "f_n", "f_e", "2 f_e - f_n", "4 f_e - f_n", "f_e + f_n", "f_n - f_e",
        ]  # fmt: skip
        assert found.natural.to_numpy().tolist() == [1, 0, -1, -1, 1, 1]

    def test_anything_else_by_its_offset(self):
        found = named(11.23, 8.77, 1.23, 31.23)
        assert found.label.to_numpy().tolist() == [
            "f_e + 1.230 Hz", "f_e - 1.230 Hz", "1.230 Hz", "3 f_e + 1.230 Hz",
        ]  # fmt: skip
        np.testing.assert_allclose(found.offset, [1.23, -1.23, 1.23, 1.23], atol=2e-4)
        assert found.denominator.to_numpy().tolist() == [0, 0, 0, 0]

    def test_free_vibration_without_a_torque_is_named(self):
        system = wb.paper.system(eta=-0.5).replace(amplitude=0.0, stiffness=4e4, drive_speed=2.0)
        lines = spectral_lines(wb.spectrum(wb.simulate(system, periods=400, initial=(0.0, 0.1))))
        assert not any("f_e" in str(label) for label in lines.label.to_numpy())
        assert np.all(np.isnan(lines.order))
        assert "f_n" in lines.label.to_numpy()
        assert lines.natural[lines.label.to_numpy() == "f_n"] == 1


class TestMotions:
    @pytest.mark.parametrize(
        ("eta", "periods"),
        [(0.0, 1), (-60.0, 2), (-24.0, 6)],
    )
    def test_period_of_the_wedge_is_the_common_denominator(self, eta, periods):
        """The least common denominator is the period that the Poincare points show."""
        system = wb.paper.system(eta=eta, F0=0.09 if eta == 0.0 else 0.036)
        response = wb.simulate(system, periods=700)
        points = response.poincare_velocity.to_numpy()[400:]
        apart = [np.max(np.abs(points[n:] - points[:-n])) for n in range(1, 13)]
        assert int(np.argmax(np.array(apart) < 1e-6 * np.max(np.abs(points)))) + 1 == periods
        start = 400.0 * system.excitation.period
        found = spectral_lines(wb.spectrum(response, start=start), count=12)
        denominators = found.denominator.to_numpy()
        assert np.all(denominators > 0)
        assert math.lcm(*denominators.tolist()) == periods
        np.testing.assert_allclose(
            found.order, found.numerator / found.denominator, rtol=0, atol=1e-7
        )
