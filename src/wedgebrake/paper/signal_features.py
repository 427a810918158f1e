"""Features that the paper reads off its pictures of a motion, as numbers."""

from __future__ import annotations

import json
import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from wedgebrake.analysis.responses.spectrum import spectrum
from wedgebrake.analysis.responses.sticking import (
    AT_REST,
    BIDIRECTIONAL,
    NON_STICK_SLIP,
    UNIDIRECTIONAL,
)
from wedgebrake.arrays import FloatArray
from wedgebrake.figures.data.axes import true_runs
from wedgebrake.model.paper_machines import RADIUS
from wedgebrake.paper.laboratory import STEADY
from wedgebrake.paper.visual_criteria import THRESHOLDS, Thresholds

if TYPE_CHECKING:
    import xarray as xr


STICK_SPEED = math.atanh(0.99) / (100.0 * RADIUS)
"""Speed [rad/s] up to which a brake counts as stuck: the smoothed friction has not yet reached
99 % of its value. The paper too counts creep in the steep part of its law as rest (section
4.1)."""
SEEN_SPEED = 0.2
"""A slip counts as one from this share of the largest speed on."""
# A plateau lasts this many times as long as passing through in a sine.
_PLATEAU = 3.0
# Half width of a line: the window's main lobe and, for what still decays, some more [Hz].
_WIDTH = 0.5
# So many points, this share of their spread apart, are a curve to the eye.
_CURVE, _APART = 12, 0.05
# Below this frequency [Hz] a spectrum shows the mean, not a line.
_LOWEST = 0.5


def percent(share: float) -> str:
    """A share in percent, two digits."""
    return f"{100.0 * share:.0f} %" if share >= 0.0995 else f"{100.0 * share:.2g} %"


class SideBands(NamedTuple):
    """Lines of a velocity spectrum beside the allowed ones.

    beside   : highest line away from the allowed ones, over the highest of all
    where    : its frequency [Hz]
    share    : of the energy that lies beside the allowed lines
    seen     : number of the lines beside that are seen
    """

    beside: float
    where: float
    share: float
    seen: int


def side_bands(
    response: xr.Dataset, thresholds: Thresholds = THRESHOLDS, *, natural: bool = False
) -> SideBands:
    """Lines of the spectrum of all 25 s beside the forcing and, if ``natural``, natural frequency.

    Peaks nearer than a line is wide are one line, as the ripples of a broad hump.
    """
    found = spectrum(response)
    frequency, amplitude = found["frequency"].to_numpy(), found["amplitude"].to_numpy()
    inside = frequency > _LOWEST
    free = inside.copy()
    for name in ("forcing_frequency", "natural_frequency")[: 1 + natural]:
        free &= np.abs(frequency - found.attrs[name]) > _WIDTH
    top = float(np.max(amplitude[inside]))
    beside = np.where(free, amplitude, 0.0)
    energy = amplitude**2
    peak = int(np.argmax(beside))
    local = (beside[1:-1] >= beside[:-2]) & (beside[1:-1] > beside[2:])
    tall = frequency[1:-1][local & (beside[1:-1] >= thresholds.line * top)]
    return SideBands(
        beside=float(beside[peak]) / top,
        where=float(frequency[peak]),
        share=float(np.sum(energy[free]) / np.sum(energy[inside])),
        seen=int(tall.size and 1 + np.count_nonzero(np.diff(tall) > _WIDTH)),
    )


class VisibleSticks(NamedTuple):
    """Sticks after 20 s, as a reader sees them.

    kind   : class of stick-slip
    shares : of the time, in sticks that follow a slip forwards, in those that follow one
             backwards, and in all
    """

    kind: str
    shares: tuple[float, float, float]

    def description(self) -> str:
        """Class of stick-slip with its numbers."""
        if self.kind == AT_REST:
            return "at rest throughout"
        forward, backward, share = map(percent, self.shares)
        return (
            f"{self.kind} (at rest {share} of the time: {forward} after θ' > 0, {backward} after"
            " θ' < 0)"
        )


def visible_sticks(response: xr.Dataset, thresholds: Thresholds = THRESHOLDS) -> VisibleSticks:
    """Find the sticks of a response after 20 s: plateaus within ``STICK_SPEED``.

    A plateau lasts ``thresholds.stick`` of a torque period, and ``_PLATEAU`` times as long as
    a sine of the same largest speed takes to pass through. It follows the last speed beyond
    ``SEEN_SPEED``, as a reader overlooks a small dip before it.
    """
    times, velocity = _steady(response)
    if times.size < 2:
        return VisibleSticks("no steady motion", (0.0, 0.0, 0.0))
    excitation = json.loads(response.attrs["system"])["excitation"]
    period, largest = 1.0 / excitation["frequency"], float(np.max(np.abs(velocity)))
    if largest <= STICK_SPEED:
        return VisibleSticks(AT_REST, (0.0, 0.0, 1.0))
    passage = STICK_SPEED * period / (math.pi * largest)
    shortest = max(thresholds.stick * period, _PLATEAU * passage)
    slips = np.where(np.abs(velocity) > SEEN_SPEED * largest, np.sign(velocity), 0.0)
    spent = {1: 0.0, -1: 0.0, 0: 0.0}
    for begin, end in _rests(times, np.abs(velocity)):
        if end - begin >= shortest:
            before = slips[: int(np.searchsorted(times, begin))]
            moving = before[before != 0.0]
            side = int(moving[-1]) if moving.size else 0
            spent[side] += (end - begin) / (times[-1] - times[0])
    noticed = sum(spent[side] >= thresholds.share for side in (1, -1))
    kind = (NON_STICK_SLIP, UNIDIRECTIONAL, BIDIRECTIONAL)[noticed]
    return VisibleSticks(kind, (spent[1], spent[-1], sum(spent.values())))


def _steady(response: xr.Dataset) -> tuple[FloatArray, FloatArray]:
    times, velocity = response["time"].to_numpy(), response["velocity"].to_numpy()
    return times[times >= STEADY], velocity[times >= STEADY]


def _rests(times: FloatArray, speed: FloatArray) -> list[tuple[float, float]]:
    """Intervals of speeds up to STICK_SPEED; ends interpolated between samples."""

    def crossing(slow: int, fast: int) -> float:
        if not 0 <= fast < speed.size:
            return float(times[slow])
        return float(np.interp(STICK_SPEED, speed[[slow, fast]], times[[slow, fast]]))

    intervals = true_runs(speed <= STICK_SPEED)
    return [(crossing(begin, begin - 1), crossing(end, end + 1)) for begin, end in intervals]


class Edges(NamedTuple):
    """Mean times of the lobes of one direction, between a tenth and nine tenths of their peak.

    rise, fall : on the way up and on the way down [s]; nan where there are no lobes
    """

    rise: float
    fall: float


def edges(response: xr.Dataset, side: int) -> Edges:
    """Edges of the lobes of the velocity in the direction ``side``, +1 or -1, after 20 s."""
    times, velocity = _steady(response)
    speed = side * velocity
    rises: list[float] = []
    falls: list[float] = []
    largest = float(np.max(speed, initial=0.0))
    for begin, end in true_runs(speed > 0.0):
        if begin == 0 or end == speed.size - 1:
            continue
        lobe, at = speed[begin - 1 : end + 2], times[begin - 1 : end + 2]
        peak = int(np.argmax(lobe))
        if lobe[peak] < SEEN_SPEED * largest:
            continue
        levels = (0.1 * lobe[peak], 0.9 * lobe[peak])
        up, down = slice(None, peak + 1), slice(None, peak - 1, -1)
        for part, found in ((up, rises), (down, falls)):
            low, high = np.interp(levels, np.maximum.accumulate(lobe[part]), at[part])
            found.append(abs(high - low))
    if not rises:
        return Edges(math.nan, math.nan)
    return Edges(float(np.mean(rises)), float(np.mean(falls)))


def distortion(response: xr.Dataset) -> float:
    """Median jump of the acceleration where the velocity changes sign, after 20 s.

    Over the largest acceleration; from the two samples before and after each crossing.
    """
    _, velocity = _steady(response)
    rate = np.diff(velocity)
    crossings = np.flatnonzero(velocity[:-1] * velocity[1:] < 0.0)
    crossings = crossings[(crossings >= 2) & (crossings < velocity.size - 3)]
    if not crossings.size:
        return 0.0
    jumps = np.abs(rate[crossings + 1] - rate[crossings - 1])
    return float(np.median(jumps) / np.max(np.abs(rate)))


def asymmetry(response: xr.Dataset) -> float:
    """Difference of the largest speeds in the two directions after 20 s, over the larger."""
    _, velocity = _steady(response)
    forward, backward = float(np.max(velocity)), -float(np.min(velocity))
    return abs(forward - backward) / max(forward, backward)


def ellipse_error(angle: FloatArray, velocity: FloatArray) -> float:
    """Rms distance of points from the ellipse that fits them best, over its size.

    A conic through points scaled to unit spread, by least squares; inf for points that are
    too few and too far apart for a curve, or lie on no ellipse.
    """
    if angle.size == 0 or np.ptp(angle) == 0.0 or np.ptp(velocity) == 0.0:
        return math.inf
    x = (angle - angle.mean()) / angle.std()
    y = (velocity - velocity.mean()) / velocity.std()
    if np.unique(np.round(np.column_stack((x, y)) / _APART), axis=0).shape[0] < _CURVE:
        return math.inf
    terms = np.column_stack((x * x, x * y, y * y, x, y))
    conic, *_ = np.linalg.lstsq(terms, np.ones(x.size), rcond=None)
    if 4.0 * conic[0] * conic[2] <= conic[1] ** 2:
        return math.inf
    slope = np.hypot(
        2.0 * conic[0] * x + conic[1] * y + conic[3], conic[1] * x + 2.0 * conic[2] * y + conic[4]
    )
    # To first order the distance is the residual over the gradient.
    distance = (terms @ conic - 1.0) / np.maximum(slope, 1e-12)
    return float(np.sqrt(np.mean(distance**2)) / math.sqrt(2.0))
