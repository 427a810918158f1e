"""Lines along which values over two parameters have one level."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]


def level_lines(x: FloatArray, y: FloatArray, values: FloatArray, level: float) -> list[FloatArray]:
    """Lines, (n, 2) each, along which values over (y, x) have a level; NaN interrupts them."""
    from contourpy import contour_generator

    if min(values.shape) < 2 or not np.isfinite(values).any():
        return []
    found: Sequence[Any] = contour_generator(x, y, np.ma.masked_invalid(values)).lines(level)
    return list(found)


def columns(lines: Sequence[FloatArray]) -> dict[str, list[FloatArray]]:
    """Lines as lists of their coordinates, by the names ``xs`` and ``ys``."""
    return {"xs": [one[:, 0] for one in lines], "ys": [one[:, 1] for one in lines]}
