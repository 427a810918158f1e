"""Ends of axes for given values, and thinning of lines with many points."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from wedgebrake.arrays import FloatArray
from wedgebrake.figures.style import margins

Codes = NDArray[np.int64]
Limits = tuple[float, float]

MOST_POINTS = 3000
"""Points of a line that a browser draws fast enough without a graphics card."""


def extent(*arrays: FloatArray) -> Limits:
    """Smallest and largest of all values; (0, 0) if there are none."""
    low = min((float(np.min(one)) for one in arrays if one.size), default=0.0)
    return low, max((float(np.max(one)) for one in arrays if one.size), default=0.0)


def limits_of_points(low: float, high: float) -> Limits:
    """Limits about low..high, not closer than 2 % of the largest value: rounding is no scatter."""
    return margins(low, high, 0.02 * max(abs(low), abs(high)), share=0.04)


def round_limits(low: float, high: float, least: float = 0.0) -> Limits:
    """Limits about low..high with a margin of 5 %, rounded so that they seldom change.

    least : smallest distance between them
    """
    if not (math.isfinite(low) and math.isfinite(high)):
        return -1.0, 1.0
    low, high = margins(low, high, least, share=0.05)
    step = round_step((high - low) / 20.0)
    first, last = math.floor(low / step) * step, math.ceil(high / step) * step
    return (first, last) if first < low and last > high else (low, high)


def round_step(least: float) -> float:
    """The smallest of 1, 2 or 5 times a power of ten that is not below ``least``."""
    power = 10.0 ** math.floor(math.log10(least))
    return next(factor * power for factor in (1.0, 2.0, 5.0, 10.0) if factor * power >= least)


def round_limits_about(low: float, high: float, scale: float = 0.0) -> Limits:
    """Round limits about low..high; about a constant, a fifth of its size on each side.

    scale : size in addition to that of the values; much smaller variation than either is rounding
    """
    size = max(abs(low), abs(high), scale)
    return round_limits(low, high, 0.2 * size if high - low <= 1e-9 * size else 0.0)


def thinned(values: FloatArray, most: int = MOST_POINTS) -> NDArray[np.int64]:
    """Indices of at most ``most`` values that keep every extreme of the line through all."""
    if values.size <= most:
        return np.arange(values.size)
    width = math.ceil(2 * values.size / (most - 2))
    full = values.size // width * width
    blocks = values[:full].reshape(-1, width)
    first = np.arange(0, full, width)
    found = [first + blocks.argmin(axis=1), first + blocks.argmax(axis=1), [0, values.size - 1]]
    return np.unique(np.concatenate(found))


def before_divergence(velocity: FloatArray) -> slice:
    """Samples of a motion that grows without bound before it leaves the picture."""
    size = np.abs(velocity)
    outside = np.flatnonzero(size > 4.0 * np.quantile(size, 0.6)) if size.size else size
    return slice(0, int(outside[0]) + 1 if outside.size else size.size)
