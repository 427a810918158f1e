"""Further numbers that describe a run: period, stick time, harmonics and orders of each part.

Like measures, they have derivatives with respect to parameters. Unlike measures, they may not
exist, such as the stick time of a run without a complete stick; they are then nan.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.polynomial import legendre
from numpy.typing import NDArray

from wedgebrake.analysis.derivatives.measures import MEASURES, Found, mean
from wedgebrake.analysis.derivatives.varied_motion import VariedMotion, period_changes
from wedgebrake.analysis.responses.machine_series import NODES, WEIGHTS, series
from wedgebrake.arrays import FloatArray

# Places in an interval between which passages are sought, and number of bisections.
_GRID: FloatArray = np.linspace(-1.0, 1.0, 33)
_HALVINGS = 52
# Amplitudes below this share of the largest speed are rounding errors.
_ROUNDING = 1e-12
_TURN = 2.0 * math.pi


class Observable(NamedTuple):
    """A number that describes a run, for each part along a dimension.

    missing : reason why it does not exist; empty for measures
    """

    dim: str
    unit: str
    of: Callable[[VariedMotion], Found]
    missing: str = ""


class _Curve(NamedTuple):
    """A quantity of a part in each interval of a motion, as Legendre series.

    own : (p, degrees) coefficients in p intervals
    by  : (p, degrees, q) their derivatives with respect to parameters
    """

    own: FloatArray
    by: FloatArray

    @classmethod
    def of(cls, values: FloatArray, changes: FloatArray, part: int) -> _Curve:
        return cls(series(values[..., part]), series(changes[..., part, :]))

    def at(self, interval: NDArray[np.intp], x: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Values (k,) and derivatives (k, q) at places from -1 to 1 in intervals."""
        matrix = legendre.legvander(x, self.own.shape[1] - 1)
        values = np.einsum("kd,kd->k", matrix, self.own[interval])
        return values, np.einsum("kd,kdq->kq", matrix, self.by[interval])


class _Passages(NamedTuple):
    """Times (k,) at which a quantity rises through a level, and their derivatives (k, q)."""

    times: FloatArray
    shifts: FloatArray


def _passages(
    varied: VariedMotion, curves: tuple[_Curve, _Curve], level: tuple[float, FloatArray]
) -> _Passages:
    """Upward passages of a quantity through a level.

    curves : the quantity and its rate of change
    level  : the level and its derivatives (q,)
    """
    motion, (curve, rate) = varied.motion, curves
    grid = curve.own @ legendre.legvander(_GRID, curve.own.shape[1] - 1).T
    above = (grid >= level[0]).ravel()
    place = np.flatnonzero(above[1:] & ~above[:-1])
    interval, number = np.divmod(place, _GRID.size)
    edge = number == _GRID.size - 1  # between two intervals
    low, high = _GRID[number], _GRID[np.where(edge, number, number + 1)]
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        below = curve.at(interval, middle)[0] < level[0]
        low, high = np.where(below, middle, low), np.where(below, high, middle)
    times = motion.start[interval] + 0.5 * motion.length[interval] * (1.0 + high)
    by, slope = curve.at(interval, high)[1], rate.at(interval, high)[0]
    return _Passages(times, (level[1] - by) / slope[:, None])


def _vibration(varied: VariedMotion, part: int) -> _Passages:
    """Upward passages of the speed of an inertia through its mean."""
    speed, own = varied.speed, varied.acceleration
    level, changes = mean(varied, speed)
    curves = _Curve.of(*speed, part), _Curve.of(*own, part)
    if np.ptp(speed.values[..., part]) <= _ROUNDING * np.abs(speed.values).max():
        return _Passages(np.empty(0), np.empty((0, changes.shape[-1])))
    return _passages(varied, curves, (float(level[part]), changes[part]))


def _each(varied: VariedMotion, of: Callable[[VariedMotion, int], Found]) -> Found:
    """Values of a number of all inertias, and their derivatives."""
    found = [of(varied, part) for part in range(varied.speed.values.shape[-1])]
    return np.array([one for one, _ in found]), np.array([by for _, by in found])


def _missing(varied: VariedMotion) -> Found:
    return np.array(math.nan), np.full(varied.shifts.shape[1], math.nan)


def _period(varied: VariedMotion, part: int) -> Found:
    """Mean time between upward passages of the speed through its mean."""
    times, shifts = _vibration(varied, part)
    if times.size < 2:
        return _missing(varied)
    return (times[-1] - times[0]) / (times.size - 1), (shifts[-1] - shifts[0]) / (times.size - 1)


def _stick_times(varied: VariedMotion) -> Found:
    """Mean durations of the sticks that begin and end in the run."""
    slides, q = varied.motion.slides, varied.shifts.shape[1]
    edges = np.append(varied.motion.start, varied.motion.start[-1] + varied.motion.length[-1])
    values, changes = np.full(slides.shape[1], math.nan), np.full((slides.shape[1], q), math.nan)
    for part, own in enumerate(slides.T):
        begins = 1 + np.flatnonzero(own[:-1] & ~own[1:])
        ends = 1 + np.flatnonzero(~own[:-1] & own[1:])
        ends = ends[ends > begins[0]] if begins.size else ends[:0]
        if ends.size:
            begins = begins[: ends.size]
            values[part] = (edges[ends] - edges[begins]).mean()
            changes[part] = (varied.shifts[ends] - varied.shifts[begins]).mean(axis=0)
    return values, changes


class _Span(NamedTuple):
    """Part of a run [s], and the derivatives (q,) of its ends."""

    begin: float
    end: float
    begin_by: FloatArray
    end_by: FloatArray

    def nodes(
        self, varied: VariedMotion, most: float
    ) -> tuple[NDArray[np.intp], FloatArray, FloatArray, FloatArray]:
        """Gauss points of pieces not longer than ``most`` [s].

        Returns their intervals, places in these, times [s] and weights [s], each (k,).
        """
        motion, length = varied.motion, self.end - self.begin
        count = math.ceil(length / most)
        inner = motion.start[(motion.start > self.begin) & (motion.start < self.end)]
        cuts = np.union1d(inner, self.begin + length * np.arange(count + 1) / count)
        cuts[-1] = self.end
        half = 0.5 * np.diff(cuts)
        middle = cuts[:-1] + half
        interval = np.clip(np.searchsorted(motion.start, middle) - 1, 0, motion.start.size - 1)
        times = middle[:, None] + half[:, None] * NODES
        x = 2.0 * (times - motion.start[interval, None]) / motion.length[interval, None] - 1.0
        weights = half[:, None] * WEIGHTS
        return np.repeat(interval, NODES.size), x.ravel(), times.ravel(), weights.ravel()


def _of_amplitude(varied: VariedMotion, value: complex, by: NDArray[np.complex128]) -> Found:
    """The magnitude of a complex amplitude."""
    size = abs(value)
    if size <= _ROUNDING * float(np.abs(varied.speed.values).max()):
        return np.array(0.0), np.full(by.shape, math.nan)
    return np.array(size), np.real(np.conj(value) * by) / size


def _harmonic(varied: VariedMotion, part: int, number: int) -> Found:
    """Amplitude of the speed at a multiple of the fundamental frequency.

    The fundamental frequency is that of the signals or, without a common period of signals, that of
    the vibration. The last whole periods of the run are used. With s from 0 to 1 over these
    periods, the amplitude is an integral over s whose kernel does not depend on the parameters.
    """
    motion, period, still = varied.motion, varied.machine.period, np.zeros(varied.shifts.shape[1])
    if period:
        last = float(motion.start[-1] + motion.length[-1])
        count = math.floor((last - motion.start[0]) / period * (1.0 + _ROUNDING))
        changes = -count * period_changes(varied.task)
        span = _Span(max(last - count * period, motion.start[0]), last, changes, still)
    else:
        times, shifts = _vibration(varied, part)
        count = times.size - 1
        if count > 0:
            span = _Span(float(times[0]), float(times[-1]), shifts[0], shifts[-1])
    if count < 1:
        return _missing(varied)
    length = span.end - span.begin
    interval, x, times, weights = span.nodes(varied, 0.5 * length / (count * number))
    s = (times - span.begin) / length
    kernel = 2.0 * weights / length * np.exp(-1j * _TURN * number * count * s)
    speed, by = _Curve.of(*varied.speed, part).at(interval, x)
    rate = _Curve.of(*varied.acceleration, part).at(interval, x)[0]
    moved = span.begin_by + s[:, None] * (span.end_by - span.begin_by)
    return _of_amplitude(varied, kernel @ speed, kernel @ (by + rate[:, None] * moved))


def _order(varied: VariedMotion, part: int, number: int) -> Found:
    """Amplitude of the speed at a number of cycles per turn, over the last whole turns."""
    motion = varied.motion
    angles, speeds = _Curve.of(*varied.angle, part), _Curve.of(*varied.speed, part)
    end = np.array([motion.start.size - 1]), np.array([1.0])
    last, last_by = angles.at(*end)
    sign = math.copysign(1.0, float(last[0] - angles.at(np.array([0]), np.array([-1.0]))[0][0]))
    first = sign * angles.at(np.array([0]), np.array([-1.0]))[0][0]
    count = math.floor((sign * last[0] - first) / _TURN * (1.0 + _ROUNDING))
    if count < 1 or (sign * varied.speed.values[..., part]).min() < 0.0:
        return _missing(varied)
    ahead = _Curve(sign * angles.own, sign * angles.by), _Curve(sign * speeds.own, sign * speeds.by)
    level = sign * last[0] - _TURN * count, sign * last_by[0]
    begin = _passages(varied, ahead, level)
    fixed = begin.times.size == 0  # the run consists of whole turns
    time = float(motion.start[0] if fixed else begin.times[-1])
    still = np.zeros(varied.shifts.shape[1])
    span = _Span(
        time, float(motion.start[-1] + motion.length[-1]),
        still if fixed else begin.shifts[-1], still,
    )  # fmt: skip
    fastest = np.abs(varied.speed.values[..., part]).max()
    interval, x, _, weights = span.nodes(varied, 0.5 * _TURN / (number * fastest))
    angle, turned = ahead[0].at(interval, x)
    speed, by = ahead[1].at(interval, x)
    kernel = weights / (math.pi * count) * np.exp(-1j * number * (angle - level[0]))
    changes = kernel @ ((2.0 * speed)[:, None] * by)
    changes -= 1j * number * ((kernel * speed**2) @ turned)
    place = np.searchsorted(motion.start, time, side="right") - 1
    x = np.array([2.0 * (time - motion.start[place]) / motion.length[place] - 1.0])
    at_begin = float(ahead[1].at(np.array([place]), x)[0][0])
    changes -= at_begin**2 / (math.pi * count) * span.begin_by
    return _of_amplitude(varied, kernel @ speed**2, changes)


_NUMBERED: dict[str, tuple[Callable[[VariedMotion, int, int], Found], str]] = {
    "harmonic": (_harmonic, "the window is shorter than a period"),
    "order": (_order, "the inertia does not complete a turn in the window, or it reverses"),
}

_NAMED = {
    "period": Observable(
        "inertia", "s", lambda one: _each(one, _period),
        "its speed does not rise through its mean at least twice in the window",
    ),
    "stick_time": Observable(
        "contact", "s", _stick_times, "no stick begins and ends in the window"
    ),
}  # fmt: skip

WORDS = (*_NAMED, *(f"{one}_1" for one in _NUMBERED), *MEASURES)
"""Names of the observables; 1 stands for the number of any harmonic or order."""


def observable(word: str) -> Observable | None:
    """The observable with a name; None if there is none.

    The names are ``period`` (mean time between upward passages of the speed through its mean),
    ``stick_time`` (mean duration of the sticks that begin and end in the run), ``harmonic_1``,
    ``harmonic_2``, ... (amplitude of the speed at a multiple of the frequency of the signals or,
    without a common period of signals, of the vibration), ``order_1``, ``order_2``, ... (amplitude
    of the speed at a number of cycles per turn of the inertia), and those of the measures.
    """
    kind, _, digits = word.rpartition("_")
    if kind in _NUMBERED and digits.isdecimal() and int(digits) > 0:
        of, missing = _NUMBERED[kind]
        number = int(digits)
        return Observable(
            "inertia", "rad/s",
            lambda one: _each(one, lambda varied, part: of(varied, part, number)), missing,
        )  # fmt: skip
    if word in MEASURES:
        return Observable(MEASURES[word].dim, MEASURES[word].unit, MEASURES[word].of)
    return _NAMED.get(word)
