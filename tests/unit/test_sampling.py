"""Default and given numbers of samples, and windows of pictures."""

from __future__ import annotations

import numpy as np
import pytest

import wedgebrake as wb
from wedgebrake.figures.style import MOST_ACROSS

FAST = 80.0  # [Hz]
MACHINE = wb.Machine(
    inertias=[wb.Inertia("disc", 1.0, 0.0, 1.0)],
    shafts=[wb.Shaft("disc", "ground", (2.0 * np.pi * 3.0) ** 2)],
    torques=[wb.Torque("disc", wb.Harmonic(1.0, FAST), name="engine")],
)


def test_the_fastest_signal_has_fifty_samples_a_period():
    time = wb.simulate(MACHINE, 25.0)["time"].to_numpy()
    assert time[-1] == 25.0
    assert np.diff(time).max() <= 1.0 / (50.0 * FAST) * (1.0 + 1e-3)


def test_the_natural_frequency_of_a_driveline_counts():
    system = wb.paper.system().replace(frequency=0.1)
    step = np.diff(wb.simulate(system, periods=2)["time"]).max()
    assert step <= 2.0 * np.pi / system.driveline.natural_frequency / 50.0


def test_all_values_of_a_record_are_seen():
    values = np.cos(np.arange(10_001.0) ** 2)
    record = wb.Table(np.linspace(0.0, 1.0, 10_001), values)
    found = wb.simulate(MACHINE.replace({"engine.signal": record}), 1.0)
    assert found.sizes["time"] >= 10_000


def test_the_bound_is_said():
    found = wb.simulate(MACHINE, 100.0)
    needed = 50.0 * FAST * 100.0
    assert found.sizes["time"] == 200_000
    assert f"{needed:.0f}" in found.attrs["message"]


@pytest.mark.parametrize("system", [MACHINE, wb.paper.system()])
def test_the_number_can_be_given(system):
    time = wb.simulate(system, 0.7, samples=351)["time"].to_numpy()
    assert np.allclose(time, np.linspace(0.0, 0.7, 351), rtol=1e-12, atol=1e-12)
    for wrong in ({"samples": 1}, {"samples": 5, "times": [0.1]}):
        with pytest.raises(wb.InputError):
            wb.simulate(system, 0.7, **wrong)


def test_a_curve_of_many_samples_is_its_envelope():
    run = wb.simulate(MACHINE, 10.0, samples=100_000)
    figure = wb.plot(run, start=1.0, stop=9.0)
    (line, *_) = (one for one in figure.axes[0].lines if len(one.get_xdata()) > 2)
    shown = run["velocity"].sel(time=slice(1.0, 9.0), inertia="disc")
    assert len(line.get_xdata()) <= MOST_ACROSS
    assert line.get_ydata().min() == shown.min()
    assert line.get_ydata().max() == shown.max()


def test_the_pictures_of_a_driveline_show_a_window():
    run = wb.simulate(wb.paper.system(), periods=40)
    figure = wb.plot(run, start=1.0, stop=2.0)
    assert figure.axes[0].get_xlim() == pytest.approx((1.0, 2.0), abs=0.02)
    with pytest.raises(wb.InputError, match="start"):
        wb.plot(run, start=100.0)


def test_orders_that_stop_are_said():
    speed = wb.Ramp(10.0, 0.0, 1.0)
    engine = wb.Orders(speed, [[1.0, 2.0, 0.0]])
    run = wb.simulate(MACHINE.replace({"engine.signal": engine}), 2.0)
    kept = 2.0 * np.sin(5.0)  # the angle turned is 10 / 2
    assert run["torque"].sel(inertia="disc")[-1] == pytest.approx(kept)
    assert f"{kept:.4g}" in run.attrs["message"]
