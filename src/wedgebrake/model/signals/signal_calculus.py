"""Calculus of signals: phases of long times, common periods, sums and integrals."""

from __future__ import annotations

import math
from fractions import Fraction
from typing import Protocol

import numpy as np

from wedgebrake.arrays import FloatArray

LARGEST_DENOMINATOR = 64
"""Two frequencies have a common period if their ratio is a fraction up to this denominator."""
# Relative difference of the ratio of two frequencies from a fraction that counts as rounding.
_ALIKE = 1e-12
_SPLIT = 134217729.0  # 2^27 + 1
# Gauss-Legendre points on a cell of at most _CELL radians of the fastest sine; the error is far
# below rounding.
_POINTS, _CELL = 20, 3.0
_MOST_CELLS = 4096  # evaluated at once


def turns(frequency: float, time: FloatArray) -> FloatArray:
    """Number of turns, frequency times time, modulo 1.

    Dekker's product keeps the result accurate to rounding at any time.
    """
    product = frequency * time
    high, low = _halves(np.asarray(frequency))
    time_high, time_low = _halves(time)
    error = high * time_high - product
    error = ((error + high * time_low) + low * time_high) + low * time_low
    return np.asarray(product - np.floor(product) + error)


def _halves(value: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Split a value into two numbers with half the digits, whose sum is the value."""
    big = _SPLIT * value
    high = big - (big - value)
    return high, value - high


def common_period(frequencies: tuple[float, ...] | None) -> float | None:
    """The common period [s] of signals with these frequencies [Hz].

    None if there is none, or if ``frequencies`` is None; 0 if there are no frequencies.
    """
    if frequencies is None:
        return None
    if not frequencies:
        return 0.0
    lowest = min(frequencies)
    ratios = []
    for one in frequencies:
        ratio = one / lowest
        fraction = Fraction(ratio).limit_denominator(LARGEST_DENOMINATOR)
        if abs(ratio - float(fraction)) > _ALIKE * ratio:
            return None
        ratios.append(fraction)
    # The common frequency is the greatest common divisor of the ratios, as fractions with one
    # denominator.
    shared = math.lcm(*(ratio.denominator for ratio in ratios))
    divisor = math.gcd(*(int(ratio * shared) for ratio in ratios))
    return shared / divisor / lowest


def running_sum(terms: FloatArray) -> FloatArray:
    """Sums of the first 0, 1, ... n terms, corrected for the rounding error of each addition."""
    sums = np.concatenate(([0.0], np.cumsum(terms)))
    before, after = sums[:-1], sums[1:]
    moved = after - before
    errors = (before - (after - moved)) + (terms - moved)
    sums[1:] += np.cumsum(errors)
    return sums


class Integrand(Protocol):
    """The part of a signal that ``quadrature`` uses."""

    @property
    def rate(self) -> float:
        """A bound on its angular frequencies [rad/s]."""

    def knots(self, first: float, last: float) -> FloatArray:
        """Its knots in (first, last) [s]."""

    def _values(self, time: FloatArray) -> FloatArray:
        """Its values."""


def quadrature(signal: Integrand, time: FloatArray) -> FloatArray:
    """Integral of a signal from 0 to an array of times [s], by Gauss-Legendre between its knots."""
    ends = np.unique(np.append(time, 0.0))
    first, last = float(ends[0]), float(ends[-1])
    edges = np.union1d(ends, signal.knots(first, last))
    parts = np.maximum(np.ceil(np.diff(edges) * signal.rate / _CELL), 1.0).astype(np.int64)
    areas = [_area(signal, *cell) for cell in zip(edges[:-1], edges[1:], parts, strict=True)]
    sums = running_sum(np.asarray(areas, dtype=float))
    sums -= sums[np.searchsorted(edges, 0.0)]
    return np.asarray(sums[np.searchsorted(edges, time)])


def _area(signal: Integrand, left: float, right: float, parts: int) -> float:
    nodes, weights = np.polynomial.legendre.leggauss(_POINTS)
    width = (right - left) / parts
    total = []
    for begin in range(0, parts, _MOST_CELLS):
        cells = np.arange(begin, min(begin + _MOST_CELLS, parts))
        middles = left + (cells + 0.5) * width
        values = signal._values(middles[:, None] + 0.5 * width * nodes)
        total += (0.5 * width * (values @ weights)).tolist()
    return math.fsum(total)
