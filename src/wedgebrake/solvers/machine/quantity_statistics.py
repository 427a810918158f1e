"""Statistics of quantities of a machine over a passage."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from wedgebrake.arrays import FloatArray
from wedgebrake.solvers.machine.trajectory.watch import Quantities


class QuantityStatistics(NamedTuple):
    """Statistics of quantities over the time of a passage, (q,) each.

    rms  : root mean square of the deviation from the mean; for derivatives, of the value itself
    peak : largest magnitude of derivatives
    """

    rms: FloatArray
    peak: FloatArray

    @classmethod
    def of(cls, found: Quantities, duration: float) -> QuantityStatistics:
        """Statistics over a duration [s]."""
        if not found.order.size:
            return cls(np.empty(0), np.empty(0))
        mean, square = found.sums.T / max(duration, 1e-300)
        centred = np.where(found.order == 0, mean, 0.0)
        peak = np.maximum(found.high, -found.low)
        return cls(np.sqrt(np.maximum(square - centred**2, 0.0)), peak)
