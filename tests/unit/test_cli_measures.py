"""The commands stop, orders and temperature."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import wedgebrake as wb

STUDY = Path(__file__).parents[2] / "examples" / "driveline.toml"


@pytest.fixture(scope="module")
def response():
    study = wb.load_study(STUDY)
    return wb.simulate(study.system, **study.arguments())


def test_stop(answer, response):
    told, found = answer("stop", STUDY), wb.stopping(response)
    assert told["stop_time"]["values"] == float(found["stop_time"])
    assert told["heat"]["values"] == found["heat"].to_numpy().tolist()


def test_temperature(answer, response):
    options = ("--mass", "8", "--specific-heat", "0.5 kJ/(kg K)", "--share", "50 %")
    told = answer("temperature", STUDY, *options)
    heat = float(wb.stopping(response)["heat"].sel(contact="brake"))
    assert told["peak_temperature"]["values"] == pytest.approx(0.5 * heat / (8.0 * 500.0), rel=1e-9)


def test_orders(answer, response):
    told = answer("orders", STUDY, "--variable", "velocity", "--part", "engine")
    found = wb.order_map(response, "velocity", "engine")
    assert np.array_equal(told["amplitude"]["values"], found["amplitude"])


def test_the_disc_must_be_complete(run):
    status, _, said = run("temperature", STUDY, "--mass", "8")
    assert status == 2
    assert "--specific-heat" in said


def test_judder_is_over_sliding_where_the_base_moves():
    """A shaft that turns at 60 rad/s and stops: the vibration is small, the sliding is not."""
    system = wb.paper.system(brake="conventional", eta=0.0).replace(
        drive_speed=wb.Ramp(60.0, 0.0, 2.0), amplitude=0.0
    )
    found = wb.stopping(wb.simulate(system, 4.0), windows=10)
    figure = wb.plot(found)
    expected = found["mean_sliding"].isel(contact=0)
    assert np.allclose(figure.axes[1].lines[0].get_xdata(), expected)
    assert expected.max() == pytest.approx(57.0, rel=0.01)
