"""Maps over two parameters: cells that stand in for others, runs of a class, level lines."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from wedgebrake.explorer.core.axis import Axis
from wedgebrake.explorer.core.limits import COARSE_MAP, FINE_MAP
from wedgebrake.figures.matplotlib.heatmap import runs

FloatArray = NDArray[np.float64]
Codes = NDArray[np.int64]
Line = tuple[list[float], list[float]]
"""Places along x and y."""


@dataclass(frozen=True, eq=False)
class Runs:
    """Rows of cells of one class each, as boxes in places, (n,), and their class."""

    left: FloatArray
    right: FloatArray
    bottom: FloatArray
    top: FloatArray
    code: Codes
    said: list[str]


def levels(some: bool) -> list[tuple[int, int]]:
    """Rows and columns of the grids of a map, one after another; ``some``: of fewer cells."""
    (width, height), (most_wide, most_high) = COARSE_MAP, FINE_MAP
    if some:
        return [(height // 4, width // 4), (height // 2, width // 2), (height, width)]
    return [(height, width), (most_high // 2, most_wide // 2), (most_high, most_wide)]


def stand_in(values: Codes, known: NDArray[np.bool_]) -> Codes:
    """Values over (rows, columns), the unknown ones as the nearest known one."""
    from scipy.ndimage import distance_transform_edt

    if known.all():
        return values
    nearest: Any = distance_transform_edt(~known, return_distances=False, return_indices=True)
    found: Codes = values[tuple(nearest)]
    return found


def rows(codes: Codes, x: Axis, y: Axis, word: Callable[[int], str]) -> Runs:
    """The runs of equal cells in each row, and what is said of them."""
    across, up = (
        np.linspace(*one.ends, count + 1)
        for one, count in ((x, codes.shape[1]), (y, codes.shape[0]))
    )
    found = [(row, *run) for row in range(codes.shape[0]) for run in runs(codes[row])]
    row, first, last = (np.array(one) for one in zip(*found, strict=True))
    code = codes[row, first]
    middles = [y.said(place) for place in y.places(codes.shape[0])]
    return Runs(
        left=across[first], right=across[last + 1], bottom=up[row], top=up[row + 1], code=code,
        said=[
            f"{word(one)}: {_between(x, low, high)}, {middles[i]}"
            for one, low, high, i in zip(code, across[first], across[last + 1], row, strict=True)
        ],
    )  # fmt: skip


def lines(x: FloatArray, y: FloatArray, values: FloatArray, level: float) -> list[Line]:
    """Lines along which values over (y, x) have a level."""
    from contourpy import contour_generator

    if min(values.shape) < 2 or not np.isfinite(values).any():
        return []
    found: Sequence[Any] = contour_generator(x, y, np.ma.masked_invalid(values)).lines(level)
    return [(one[:, 0].tolist(), one[:, 1].tolist()) for one in found]


def _between(axis: Axis, low: float, high: float) -> str:
    """A range of an axis in words."""
    first, last = axis.said(low), axis.said(high).rpartition("= ")[2]
    return f"{first} to {last}"
