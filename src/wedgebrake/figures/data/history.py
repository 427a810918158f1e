"""Velocity and torques over a span of time, with the sticks."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from wedgebrake.analysis.spectrum import frequencies
from wedgebrake.analysis.sticking import span
from wedgebrake.errors import InputError
from wedgebrake.figures.data.limits import Limits, before_divergence, extent
from wedgebrake.figures.data.sticks import Sticks, sticks_between

if TYPE_CHECKING:
    import xarray as xr

FloatArray = NDArray[np.float64]

# A motion that grows this many times beyond its median is shown on a logarithmic scale.
_RUNAWAY = 1e3
# Sticks nearer to each other than this share of the window are merged on the page.
_APART = 1e-3


@dataclass(frozen=True, eq=False)
class History:
    """Motion of a response between two times.

    begin, end         : of the window [s]
    time               : (n,) [s]
    angle, velocity    : (n,) [rad], [rad/s]
    brake_torque, drive_torque : (n,) [N m]
    sticking           : (n,) 1 while the brake sticks
    sticks             : cut to the window
    diverged           : the motion grows without bound
    """

    begin: float
    end: float
    time: FloatArray
    angle: FloatArray
    velocity: FloatArray
    brake_torque: FloatArray
    drive_torque: FloatArray
    sticking: NDArray[np.int8]
    sticks: Sticks
    diverged: bool

    @classmethod
    def between(cls, response: xr.Dataset, begin: float, end: float) -> History:
        """Part of a response between two times [s]."""
        time = response["time"].to_numpy()
        window = (time >= begin) & (time <= end)
        samples = {
            name: response[name].to_numpy()[window]
            for name in ("angle", "velocity", "brake_torque", "drive_torque", "sticking")
        }
        return cls(
            begin,
            end,
            time[window],
            **samples,
            sticks=sticks_between(response, begin, end if np.any(window) else -math.inf),
            diverged=response.attrs.get("status") == "diverged",
        )

    @classmethod
    def last(cls, response: xr.Dataset, periods: float | None) -> History:
        """Last torque periods of a response, or all of it; raises ``InputError`` for others."""
        return cls.between(response, *last_periods(response, periods))

    @property
    def bounded(self) -> slice:
        """Samples that fit into a picture: of a diverging motion those before it leaves it."""
        return before_divergence(self.velocity) if self.diverged else slice(self.velocity.size)

    @property
    def linear_up_to(self) -> float | None:
        """Speed [rad/s] beyond which a motion that ran away needs a logarithmic scale."""
        speed = np.abs(self.velocity)
        largest = float(np.max(speed, initial=0.0))
        if not self.diverged or not largest > _RUNAWAY * max(float(np.median(speed)), 1e-300):
            return None
        least = max(float(np.min(speed[speed > 0.0])), 1e-6 * largest)
        return float(10.0 ** np.ceil(np.log10(least)))

    @property
    def visible_sticks(self) -> Sticks:
        """Sticks, those too near to each other for the eye merged."""
        return self.sticks.merged(_APART * (self.end - self.begin), round(1.0 / _APART))

    @property
    def velocity_extent(self) -> Limits:
        """Smallest and largest velocity of the samples that fit [rad/s]."""
        return extent(self.velocity[self.bounded])


def last_periods(response: xr.Dataset, periods: float | None) -> tuple[float, float]:
    """First and last time [s] of the last torque periods of a response; None: all of it."""
    begin, end = span(response)
    if periods is None:
        return begin, end
    if not isinstance(periods, int | float) or not periods > 0:
        raise InputError(f"periods = {periods!r}: must be a number above 0, or None for all.")
    forcing = frequencies(response).get("forcing_frequency", 0.0)
    return (max(begin, end - periods / forcing) if forcing > 0.0 else begin), end
