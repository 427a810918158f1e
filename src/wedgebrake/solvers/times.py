"""Output times of a response."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from wedgebrake.arrays import FloatArray
from wedgebrake.errors import InputError


def wanted_times(times: ArrayLike, start: float, stop: float) -> FloatArray:
    """Return ascending times in [start, stop] as an array; raises ``InputError`` for others."""
    try:
        wanted = np.atleast_1d(np.asarray(times, dtype=float))
    except (TypeError, ValueError):
        raise InputError("times: must be an array of numbers [s].") from None
    slack = 1e-9 * max(abs(stop), 1e-9)
    inside = wanted.size == 0 or (wanted.min() >= start - slack and wanted.max() <= stop + slack)
    if wanted.ndim != 1 or not np.all(np.isfinite(wanted)) or not inside:
        raise InputError(
            f"times: must be finite, one-dimensional and between {start:g} s (start_time) and"
            f" {stop:g} s (the end). Lengthen duration, or drop the times outside."
        )
    if np.any(np.diff(wanted) < 0.0):
        raise InputError("times: must ascend. Sort them, for example with numpy.sort.")
    return np.asarray(np.clip(wanted, start, stop))
