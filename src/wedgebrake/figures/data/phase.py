"""The phase portrait: velocity against angle, with sticks, switching line and release speeds."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from wedgebrake.analysis.sticking import inside, span, steady_start
from wedgebrake.figures.data.history import History
from wedgebrake.figures.data.limits import Limits, extent
from wedgebrake.figures.data.sticks import Sticks
from wedgebrake.model.system import BrakedDriveline

if TYPE_CHECKING:
    import xarray as xr

FloatArray = NDArray[np.float64]

# The switching line is shown if the picture gets at most this many times as high as the motion.
_FARTHEST = 3.0
# The picture shows at least this share of the motion, or rounding would look like scatter.
_LEAST = 0.05


class Segments(NamedTuple):
    """Sticks in the phase plane: angles [rad] and velocities [rad/s] of their ends, (2, k)."""

    angle: FloatArray
    velocity: FloatArray
    side: NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Phase:
    """A part of a response in the phase plane.

    history       : that part
    least         : smallest width [rad] and height [rad/s] of the picture
    drive_speed   : of the shaft [rad/s]; the brake sticks at the velocity -drive_speed
    release_speed : sliding speed beyond which the brake is released [rad/s]; inf: none
    """

    history: History
    least: tuple[float, float]
    drive_speed: float
    release_speed: float

    @classmethod
    def of(cls, system: BrakedDriveline, response: xr.Dataset, start: float | None) -> Phase:
        """Portrait from a time on [s]; None: of the last fifth of the response.

        Raises ``InputError`` for a dataset that is no response or a start outside it.
        """
        begin, end = span(response)
        low = steady_start(response) if start is None else inside(start, begin, end)
        angle, velocity = (response[one].to_numpy() for one in ("angle", "velocity"))
        width, height = (
            _LEAST * float(np.ptp(one)) if one.size else 0.0 for one in (angle, velocity)
        )
        return cls.over(system, History.between(response, low, end), (width, height))

    @classmethod
    def over(
        cls, system: BrakedDriveline, history: History, least: tuple[float, float] = (0.0, 0.0)
    ) -> Phase:
        """Portrait of what a history shows."""
        return cls(history, least, system.driveline.drive_speed, system.actuation.release_speed)

    @property
    def switching(self) -> float:
        """Velocity at which the brake may stick [rad/s]."""
        return -self.drive_speed

    @property
    def releases(self) -> tuple[float, float]:
        """Velocities beyond which the brake is released [rad/s]."""
        return self.release_speed - self.drive_speed, -self.release_speed - self.drive_speed

    @property
    def angle_extent(self) -> Limits:
        """Smallest and largest angle of the samples that fit [rad]."""
        return extent(self.history.angle[self.history.bounded])

    def reaching(self, low: float, high: float) -> Limits:
        """Limits of velocity widened to the switching line, unless the motion got too small."""
        reach = min(low, self.switching), max(high, self.switching)
        return reach if reach[1] - reach[0] <= _FARTHEST * (high - low) else (low, high)

    def segments(self, sticks: Sticks) -> Segments:
        """Sticks between the angles where they begin and end."""
        ends = np.array([sticks.start, sticks.end])
        time, angle, velocity = self.history.time, self.history.angle, self.history.velocity
        return Segments(np.interp(ends, time, angle), np.interp(ends, time, velocity), sticks.side)
