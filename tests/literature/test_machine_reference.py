"""The reference integrator for machines against published motions in 40-digit arithmetic."""

from __future__ import annotations

import numpy as np
import pytest
from mpmath import mp

import machine_examples as examples
from machine_reference import simulate

LINES = {
    "Friction": (
        examples.friction_line, examples.friction_plain, examples.FRICTION_DURATION,
        examples.FRICTION_EVENTS, examples.FRICTION_ANGLES, examples.FRICTION_SPEEDS,
    ),
    "CoupledClutches": (
        examples.coupled_line, examples.coupled_plain, examples.COUPLED_DURATION,
        examples.COUPLED_EVENTS, examples.COUPLED_ANGLES, examples.COUPLED_SPEEDS,
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", LINES)
def test_modelica_drivelines_at_40_digits(name: str) -> None:
    line, _, duration, events, angles, speeds = LINES[name]
    found = examples.exact(line, duration)
    later = [event for event in found.events if event[0] > 0]
    assert [event[1:] for event in later] == [event[1:] for event in events]
    with mp.workdps(50):
        for event, (time, *_) in zip(later, events, strict=True):
            assert abs(event[0] - mp.mpf(time)) < mp.mpf("1e-29")
        for i, (angle, speed) in enumerate(zip(angles, speeds, strict=True)):
            assert abs(found.z[i] - mp.mpf(angle)) < mp.mpf("1e-27")
            assert abs(found.z[found.n + i] - mp.mpf(speed)) < mp.mpf("1e-28")


@pytest.mark.parametrize("name", LINES)
def test_modelica_drivelines(name: str) -> None:
    _, machine, duration, events, angles, speeds = LINES[name]
    run = simulate(machine(), float(duration))
    found = [e for e in run.events if e.kind != "breakpoint" and e.time > 0.0]
    assert [(e.contact, e.kind, e.side) for e in found] == [event[1:] for event in events]
    for e, event in zip(found, events, strict=True):
        assert e.time == pytest.approx(float(event[0]), abs=1e-13)
    last = run.at([float(duration)])
    np.testing.assert_allclose(last["angle"][0], [float(v) for v in angles], atol=2e-12)
    np.testing.assert_allclose(last["velocity"][0], [float(v) for v in speeds], atol=2e-12)
