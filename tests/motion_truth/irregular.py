"""Four tests for chaos that look at trajectories only.

Each says "regular", "irregular" or "unclear"; the judge wants them to agree.

- ``divergence``: the mean rate at which neighbours separate (Benettin; finite separations)
- ``sensitivity``: how far neighbours get from each other when left alone
- ``birkhoff_digits``: how fast time averages converge
- ``zero_one``: whether the section, as the step of a walk, drives a diffusion
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from .section import FloatArray, Section

REGULAR, IRREGULAR, UNCLEAR = "regular", "irregular", "unclear"

# Separations below this share of the motion's size are rounding.
_ROUNDING = 1e-13
_SEGMENT = 24  # periods between renormalisations, at most
_BATCHES = 33  # the first of them is dropped: the perturbation turns into its direction
_BANDS = 64


@dataclass(frozen=True)
class Divergence:
    """Mean rate of separation of two trajectories that stay close (Benettin).

    exponent, error : mean and standard error over batches [1/s]
    lost            : separations that fell to rounding; the exponent is then a bound from above
    """

    separation: float
    exponent: float
    error: float
    lost: int


def divergence(section: Section, states: FloatArray, span: FloatArray, start: float) -> Divergence:
    """Follow a neighbour of ``states`` at the distance ``start`` (a share of ``span``).

    The neighbour is put back to that distance, in the direction that it has, whenever it
    has left a decade on either side of it.
    """
    unit = np.array([0.6, 0.8])
    logs, lengths, lost, i = [], [], 0, 0
    while i + _SEGMENT < len(states):
        near = section.points(states[i] + start * unit * span, _SEGMENT).states
        apart = (near - states[i : i + len(near)]) / span
        distance = np.hypot(apart[:, 0], apart[:, 1])
        outside = np.flatnonzero((distance[1:] > 10 * start) | (distance[1:] < start / 10))
        j = int(outside[0]) + 1 if outside.size else len(near) - 1
        if distance[j] < _ROUNDING:
            lost += 1
        else:
            unit = apart[j] / distance[j]
        logs.append(math.log(max(distance[j], _ROUNDING) / start))
        lengths.append(j)
        i += j
    ends = np.cumsum(lengths)
    batch = np.minimum((ends - 1) * _BATCHES // ends[-1], _BATCHES - 1)
    growth = np.bincount(batch, logs, _BATCHES)[1:]
    periods = np.bincount(batch, lengths, _BATCHES)[1:]
    rates = growth / periods / section.period
    mean = growth.sum() / periods.sum() / section.period
    return Divergence(start, mean, rates.std(ddof=1) / math.sqrt(rates.size), lost)


def bands(states: FloatArray) -> int:
    """Number of pieces of the attractor that the map visits in turn, 1 to 64.

    Taking every q-th point leaves less variance if q is a multiple of it.
    """
    spread = []
    for q in range(1, _BANDS + 1):
        rows = states[: len(states) // q * q].reshape(-1, q, 2)
        spread.append(float(np.sum(rows.var(axis=0).mean(axis=0) / states.var(axis=0))))
    return int(np.flatnonzero(np.array(spread) < 1.2 * min(spread))[0]) + 1


def _smooth_mean(values: FloatArray) -> FloatArray:
    """Average with weights exp(-1/(s(1-s))): of a quasi-periodic signal it converges faster
    than any power of the length, of a chaotic one like its square root (Das, Sander, Yorke)."""
    s = (np.arange(len(values)) + 0.5) / len(values)
    weights = np.exp(-1.0 / (s * (1.0 - s)))
    return weights @ values / weights.sum()


def birkhoff_digits(states: FloatArray, span: FloatArray, stride: int) -> float:
    """Digits to which two halves agree in the averages of four observables.

    Relative to the scatter of the observable over every ``stride``-th point.
    """
    x, y = (np.asarray(states[::stride]) / span).T
    values = np.column_stack([x, y, np.cos(5.0 * (x - y)), np.sin(5.0 * (x + y))])
    half = len(values) // 2
    gap = np.abs(_smooth_mean(values[:half]) - _smooth_mean(values[half : 2 * half]))
    return float(-np.log10(np.max(gap / values.std(axis=0)) + 1e-16))


def zero_one(states: FloatArray, stride: int) -> float:
    """The 0-1 test (Gottwald, Melbourne): 0 regular, 1 chaotic.

    Correlation version, median over 25 frequencies, on the angle of every ``stride``-th
    point. Long records: a faint diffusion has to outgrow the oscillation about it.
    """
    signal = states[::stride, 0]
    signal = (signal - signal.mean()) / signal.std()
    rng = np.random.default_rng(1)
    most = len(signal) // 10
    lags = np.arange(1, most + 1)
    steps = np.arange(1, len(signal) + 1)
    results = []
    for frequency in rng.uniform(math.pi / 5, 4 * math.pi / 5, 25):
        walk = np.cumsum(signal * np.exp(1j * frequency * steps))
        results.append(np.corrcoef(lags, _displacement(walk, most))[0, 1])
    return float(np.median(results))


def sensitivity(section: Section, states: FloatArray, span: FloatArray, start: float) -> float:
    """Largest distance, as a share of ``span``, that a neighbour at ``start`` ever reaches.

    Of two such neighbours that are left to themselves over the whole record.
    """
    reached = []
    for direction in ((0.6, 0.8), (0.8, -0.6)):
        near = section.points(states[0] + start * np.array(direction) * span, len(states) - 1)
        reached.append(float(np.max(np.abs(near.states - states) / span)))
    return max(reached)


def _displacement(walk: FloatArray, most: int) -> FloatArray:
    """Mean of |walk(j+n) - walk(j)|^2 over j = 0 .. number - most, for n = 1 .. most."""
    base = walk[: len(walk) - most]
    power = np.concatenate([[0.0], np.cumsum(np.abs(walk) ** 2)])
    lags = np.arange(1, most + 1)
    later = power[lags + base.size] - power[lags]
    # Cross term by FFT: sum_j conj(base_j) walk_(j+n).
    length = 1 << (len(walk) + base.size).bit_length()
    cross = np.fft.ifft(np.fft.fft(walk, length) * np.conj(np.fft.fft(base, length)))
    return (later + power[base.size] - 2.0 * cross[1 : most + 1].real) / base.size
