"""The section at which a motion is sampled: the start of each period of the torque.

Solvers log a row of kind ``RETURN`` wherever the motion returns to the section, and analysis
uses only these rows: classes, orders and windows count returns. Time is kept as a number
of returns and the time since the last one, so that the phase keeps its digits in long runs.
"""

import math

from wedgebrake.dynamics.harmonic import Phase
from wedgebrake.dynamics.jit import compiled


@compiled
def return_time(torque):
    """Time [s] between two returns."""
    return 2.0 * math.pi / torque.angular_frequency


@compiled
def phase_at_return():
    """Phase of the torque at the section."""
    return Phase(0.0, 1.0)
