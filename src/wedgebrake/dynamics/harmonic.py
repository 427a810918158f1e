"""The torque on the driveline, ``amplitude sin(angular_frequency t)``, for kernels.

Sine and cosine of its phase are computed only here; code that needs the torque or
its derivatives at a time uses the ``Phase`` there.
"""

import math
from typing import NamedTuple

from wedgebrake.dynamics.jit import compiled


class Phase(NamedTuple):
    """Sine and cosine of the phase of a harmonic."""

    sine: float
    cosine: float


class Sine(NamedTuple):
    """A harmonic: amplitude (of a torque [N m], or of an acceleration) and frequency [rad/s]."""

    amplitude: float
    angular_frequency: float


@compiled
def phase_of(angle):
    """Phase at an angle [rad]."""
    return Phase(math.sin(angle), math.cos(angle))


@compiled
def phase_at(harmonic, t):
    """Phase at the time t [s]."""
    angle = harmonic.angular_frequency * t
    return Phase(math.sin(angle), math.cos(angle))


@compiled
def advanced(phase, x):
    """Phase advanced by a small angle x, of up to about 0.1 rad, to rounding."""
    y = x * x
    c = 1.0 - y / 2.0 * (1.0 - y / 12.0 * (1.0 - y / 30.0 * (1.0 - y / 56.0)))
    s = x * (1.0 - y / 6.0 * (1.0 - y / 20.0 * (1.0 - y / 42.0 * (1.0 - y / 72.0))))
    return Phase(phase.sine * c + phase.cosine * s, phase.cosine * c - phase.sine * s)


@compiled
def value(harmonic, phase):
    """Value at a phase."""
    return harmonic.amplitude * phase.sine


@compiled
def rate(harmonic, phase):
    """First time derivative."""
    return harmonic.amplitude * harmonic.angular_frequency * phase.cosine


@compiled
def second_rate(harmonic, phase):
    """Second time derivative."""
    omega = harmonic.angular_frequency
    return -harmonic.amplitude * omega * omega * phase.sine


@compiled
def differentiated(harmonic, phase):
    """The time derivative, again a harmonic, and its phase."""
    omega = harmonic.angular_frequency
    return Sine(harmonic.amplitude * omega, omega), Phase(phase.cosine, -phase.sine)


@compiled
def angle_of_rate(harmonic, level):
    """Angle [rad] in [0, pi] at which the first derivative falls through ``level``; nan: none."""
    greatest = harmonic.amplitude * harmonic.angular_frequency
    return math.acos(level / greatest) if abs(level) <= greatest and greatest > 0.0 else math.nan


@compiled
def _wait(level, amplitude, angle):
    """Phase to wait until amplitude sin(angle) rises through ``level``; inf if it never does."""
    if level >= amplitude:
        return math.inf
    if level < -amplitude:
        return 0.0
    crossing = math.asin(level / amplitude)
    since = (angle - crossing) % (2.0 * math.pi)
    if since < math.pi - 2.0 * crossing:
        return 0.0
    return 2.0 * math.pi - since


@compiled
def wait_above(harmonic, level, t):
    """Time from t on until the value rises above ``level``: 0 if it is above, inf if never."""
    omega = harmonic.angular_frequency
    return _wait(level, harmonic.amplitude, omega * t) / omega


@compiled
def wait_below(harmonic, level, t):
    """Time from t on until the value falls below ``level``: 0 if it is below, inf if never."""
    omega = harmonic.angular_frequency
    return _wait(-level, harmonic.amplitude, omega * t + math.pi) / omega
