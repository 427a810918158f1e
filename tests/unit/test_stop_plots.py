"""Pictures of stops."""

from __future__ import annotations

import numpy as np
import pytest

import wedgebrake as wb
from machines import contact, single
from wedgebrake.figures.data.stopping import StopCurves


@pytest.fixture(scope="module")
def stop():
    machine = wb.Machine(
        inertias=[wb.Inertia("disc", 4.0, speed=50.0), wb.Inertia("hub", 1.0, speed=50.0)],
        shafts=[wb.Shaft("disc", "hub", stiffness=400.0, damping=1.0)],
        contacts=[contact(radius=4.0, force=20.0)],
    )
    return wb.stopping(wb.simulate(machine, 60.0, until="rest"), ringdown=1.0)


def test_contents_are_those_of_the_dataset(stop):
    data = StopCurves.of(stop)
    speeds, judder, torques = data.panels
    assert [line.name for line in speeds.lines] == ["disc", "hub"]
    for i, line in enumerate(judder.lines):
        assert np.array_equal(line.x, stop.mean_speed[:, i])
        assert np.array_equal(line.y, stop.judder_speed[:, i])
    assert np.array_equal(torques.lines[0].y, stop.judder_torque[:, 0])
    assert [bars.phase for bars in data.jerks] == ["braking", "ring-down"]
    assert np.array_equal(data.jerks[1].peak, stop.peak_jerk[1])


def test_of_a_constant_torque_has_zero_at_the_bottom():
    machine = single(contact(radius=0.2, force=1500.0), inertia=10.0, speed=60.0)
    figure = wb.plot(wb.stopping(wb.simulate(machine, 8.0)))
    for axes in figure.axes:
        low, high = axes.get_ylim()
        assert low <= 0.0 < high
        assert -low < 0.05 * high


@pytest.mark.parametrize("width", [3.5, 7.2])
def test_is_drawn(stop, width, tmp_path):
    figure = wb.plot(stop, width=width)
    assert figure.get_figwidth() == width
    path = tmp_path / "stop.png"
    figure.savefig(path)
    assert path.stat().st_size > 0
