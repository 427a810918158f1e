"""The Poincaré section: the state once in every period of the torque."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from wedgebrake.analysis.spectrum import frequencies, is_driven
from wedgebrake.analysis.sticking import steady_start
from wedgebrake.errors import InputError

if TYPE_CHECKING:
    import xarray as xr

FloatArray = NDArray[np.float64]

# The picture shows at least this share of the motion, or rounding would look like scatter.
_LEAST = 0.05


@dataclass(frozen=True, eq=False)
class Section:
    """Points of a Poincaré section.

    angle, velocity : (m,) [rad], [rad/s]
    period          : (m,) numbers of the torque periods
    least           : smallest width [rad] and height [rad/s] of the picture
    stated_period   : period of a torque that does not act [s]; None where one acts
    """

    angle: FloatArray
    velocity: FloatArray
    period: NDArray[np.int64]
    least: tuple[float, float]
    stated_period: float | None

    @classmethod
    def of(cls, points: xr.Dataset, start: float | None = None) -> Section:
        """Section of a response from a time on [s], or points that ``wb.poincare`` gives.

        start : default the last fifth of the response

        Raises ``InputError`` for a dataset that is neither.
        """
        names = getattr(points, "data_vars", {})
        if "poincare_angle" in names:
            low = steady_start(points) if start is None else start
            shown = points["poincare_time"].to_numpy() >= low - 1e-9 * abs(low)
            angle, velocity, period = (
                points[name].to_numpy()[shown]
                for name in ("poincare_angle", "poincare_velocity", "period")
            )
            motion = [points[name].to_numpy() for name in ("angle", "velocity")]
        elif "angle" in names and points["angle"].dims == ("period",):
            angle, velocity, period = (
                points[name].to_numpy() for name in ("angle", "velocity", "period")
            )
            motion = [np.append(angle, 0.0), np.append(velocity, 0.0)]
        else:
            raise InputError(
                f"points = {type(points).__name__}: must be the result of wb.simulate(...) or of"
                " wb.poincare(...)."
            )
        width, height = (_LEAST * float(np.ptp(one)) if one.size else 0.0 for one in motion)
        stated = None if is_driven(points) else 1.0 / frequencies(points)["forcing_frequency"]
        return cls(angle, velocity, period, (width, height), stated)
