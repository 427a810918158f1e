"""States at the starts of segments, from measured angles and speeds."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.integrate import trapezoid
from scipy.ndimage import binary_dilation, median_filter

from wedgebrake.arrays import FloatArray

# Number of samples on each side of a sample for the slope of an angle; a state that has not been
# measured in so many samples is unknown.
_NEAR = 4
# Distance of an outlier from the median of its neighbours, in medians of all such distances.
_FAR = 10.0


class Measured(NamedTuple):
    """A measured angle or speed.

    time  : (k,) of the samples [s]
    path  : (k,) values, interpolated where there is none
    known : (k,) whether a value has been measured near the sample
    """

    time: FloatArray
    path: FloatArray
    known: FloatArray

    @classmethod
    def of(cls, time: FloatArray, column: FloatArray) -> Measured:
        """That of a column, whose outliers are replaced by medians of five samples."""
        finite = np.isfinite(column)
        path = np.interp(time, time[finite], column[finite])
        median = median_filter(path, 5, mode="nearest")
        apart = np.abs(path - median)
        path = np.where(apart > _FAR * np.median(apart), median, path)
        return cls(time, path, binary_dilation(finite, iterations=_NEAR))

    def integral(self, first: int, last: int) -> float:
        """The integral from one sample to another; nan across a gap."""
        part, intervals = slice(first, last + 1), np.diff(self.time)
        gap = intervals[first:last].max() > 2 * _NEAR * np.median(intervals)
        if gap or not np.all(self.known[part]):
            return np.nan
        return float(trapezoid(self.path[part], self.time[part]))

    def slope(self, at: int) -> float:
        """The slope of a straight line through the samples near a sample."""
        near = slice(max(at - _NEAR, 0), at + _NEAR + 1)
        return float(np.polyfit(self.time[near] - self.time[at], self.path[near], 1)[0])


class Guess:
    """States at the starts of the segments but the first, from which a fit begins.

    Angles and speeds that are measured there are those of the columns. An angle is integrated from
    a measured speed, and a speed is the slope of a measured angle. Other states, and those in gaps
    of the trace, are those at the end of the segment before.

    measured : angles and speeds that are measured, by the numbers of the states
    bodies   : number of bodies
    firsts   : first sample of each segment

    states     : (s,) of each start so far
    direct, integrated : (s,) of each start, whether a state is measured, or integrated from the
                 start of the segment before
    """

    def __init__(self, measured: dict[int, Measured], bodies: int, firsts: tuple[int, ...]) -> None:
        self._measured, self._bodies, self._firsts = measured, bodies, firsts
        self.states: list[FloatArray] = []
        self.direct: list[list[bool]] = []
        self.integrated: list[list[bool]] = []

    def append(self, free: list[int], angles: FloatArray, end: FloatArray) -> FloatArray:
        """Append the free states at the start of the next segment.

        free   : numbers of the free states
        angles : (n,) of the bodies at the start of the segment before
        end    : (states,) at its end
        """
        state, direct, integrated = end[free], [False] * len(free), [False] * len(free)
        before, first = self._firsts[len(self.states) :][:2]
        n, measured = self._bodies, self._measured
        for place, row in enumerate(free):
            own, other = measured.get(row), measured.get(row + n if row < n else row - n)
            if own is not None and own.known[first]:
                state[place], direct[place] = own.path[first], True
            elif other is not None and row < n:
                change = other.integral(before, first)
                if np.isfinite(change):
                    state[place], integrated[place] = angles[row] + change, True
            elif other is not None and other.known[first] and row < 2 * n:
                state[place] = other.slope(first)
        self.states.append(state)
        self.direct.append(direct)
        self.integrated.append(integrated)
        return state
