"""The exact solver against 50 digits, over ten periods of the torque."""

import math

import numpy as np
import pytest
import reference_mpmath as reference

import wedgebrake as wb
from cases import CASES

# One or two seconds each; these few always, the others with -m slow.
ALWAYS = {
    "wedge, sticks and releases",
    "critically damped",
    "static above kinetic",
    "self-locking",
    "no spring",
    "turning shaft",
}


def wanted_times(system: wb.BrakedDriveline, periods: float) -> np.ndarray:
    """Times that are not commensurate with the period."""
    return np.linspace(0.0, periods / system.excitation.frequency, 38)[1:]


@pytest.mark.parametrize(
    "name",
    [pytest.param(name, marks=() if name in ALWAYS else pytest.mark.slow) for name in CASES],
)
def test_ten_periods(name):
    system, initial = CASES[name]
    times = wanted_times(system, 10.0)
    expected = reference.solve(system, initial, times.tolist())
    got = wb.simulate(system, periods=10, initial=initial, times=times)
    assert expected.locked_at is None
    assert got.attrs["status"] == "completed"

    states = np.array([[float(angle), float(velocity)] for angle, velocity in expected.states])
    scale = np.abs(states).max(axis=0)
    assert np.max(np.abs(got.angle.values - states[:, 0])) <= 1e-10 * scale[0]
    assert np.max(np.abs(got.velocity.values - states[:, 1])) <= 1e-10 * scale[1]

    # A motion that begins to slip at once begins with this slip, which is then no event.
    events = [event for event in expected.events if event[1] > 0.0]
    assert [kind for kind, _, _ in events] == got.event_kind.values.tolist()
    assert [side for _, _, side in events] == got.event_side.values.tolist()
    moments = np.array([float(t) for _, t, _ in events])
    assert np.max(np.abs(got.event_time.values - moments), initial=0.0) <= 1e-10 * times[-1]


def test_secular_growth_at_resonance():
    """c = 0, mu = 0, f = 1: theta = T_e/(2 k) (sin wt - wt cos wt), in closed form."""
    system, initial = CASES["resonance without damping"]
    r = wb.simulate(system, periods=10, initial=initial)
    phase = 100.0 * r.time.values
    amplitude = system.excitation.amplitude / (2.0 * 1e4)
    angle = amplitude * (np.sin(phase) - phase * np.cos(phase))
    velocity = amplitude * 100.0 * phase * np.sin(phase)
    assert np.max(np.abs(r.angle.values - angle)) <= 1e-13 * np.max(np.abs(angle))
    assert np.max(np.abs(r.velocity.values - velocity)) <= 1e-13 * np.max(np.abs(velocity))


def test_the_reference_on_a_linear_oscillator():
    """The reference itself, where the answer is known: free vibration to 45 digits."""
    system, _ = CASES["resonance without damping"]
    answer = reference.solve(system.replace(amplitude=0.0), (0.01, 0.0), [1.0])
    with reference.mp.workdps(60):
        exact = reference.mp.mpf(0.01) * reference.mp.cos(100)
        assert abs(answer.states[0][0] - exact) < 1e-45
    assert len(answer.events) == math.floor(100.0 / math.pi)
