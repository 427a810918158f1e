"""Sums over a motion, for all solvers: rest, sticks, heat, peak torque, range of the state."""

import math
from typing import Any

import numpy as np

from wedgebrake.dynamics.jit import compiled
from wedgebrake.dynamics.records import record

SUMS = record(
    fields=[
        ("rest_time", np.float64),  # [s]
        ("sticks_forward", np.float64),  # entered from above the rest velocity
        ("sticks_backward", np.float64),
        ("heat", np.float64),  # of the brake's torque on the sliding velocity [J]
        ("peak_torque", np.float64),  # largest |torque| of the brake [N m]
        ("least_velocity", np.float64),  # extreme values met
        ("greatest_velocity", np.float64),
        ("least_angle", np.float64),
        ("greatest_angle", np.float64),
        ("last_slip", np.float64),  # last time of slip, in returns
        # Smooth friction: time of entry into the present stick band [s], nan if in none,
        # and the side of entry.
        ("band_entered", np.float64),
        ("band_side", np.float64),
    ]
)


@compiled
def clear(sums):
    """Set a record of sums to those of no motion."""
    sums.rest_time = sums.sticks_forward = sums.sticks_backward = 0.0
    sums.heat = sums.peak_torque = 0.0
    sums.least_velocity = sums.least_angle = math.inf
    sums.greatest_velocity = sums.greatest_angle = sums.last_slip = -math.inf
    sums.band_entered, sums.band_side = math.nan, 0.0


@compiled
def widen(sums, angle, velocity):
    """Include a state in the range of the motion."""
    sums.least_velocity = min(sums.least_velocity, velocity)
    sums.greatest_velocity = max(sums.greatest_velocity, velocity)
    sums.least_angle = min(sums.least_angle, angle)
    sums.greatest_angle = max(sums.greatest_angle, angle)


@compiled
def count_stick(sums, side):
    """Count a stick that was entered from a side."""
    sums.sticks_forward += side > 0.0
    sums.sticks_backward += side < 0.0


def empty_sums() -> Any:
    """Sums of no motion."""
    sums = np.zeros(1, dtype=SUMS)[0]
    clear(sums)
    return sums
