"""Growth of the distance of neighbouring runs, which are left to themselves."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

import wedgebrake as wb
from motion_truth.irregular import IRREGULAR, REGULAR, UNCLEAR

from .runs import FloatArray, Machine, seen

_START = 1e-10
# A pair counts from when its distance has turned into its direction until it is no longer small.
_TURN, _FAR = 1e-8, 1e-4
_PAIRS, _LONGEST = 24, 400


class Parting(NamedTuple):
    """Mean rate at which neighbours part [1/s], its standard error, and what it says."""

    exponent: float
    error: float
    says: str


def parting(machine: Machine, state: wb.FinalState, scale: FloatArray) -> Parting:
    """Follow pairs of neighbours from states along a motion.

    Of a regular motion none parts by more than in proportion to time; of a chaotic one all do.
    """
    unit, rates, lengths, largest = machine.unit, [], [], []
    per_unit = 12
    for pair in range(_PAIRS):
        times = state.time + unit * np.arange(1, _LONGEST * per_unit + 1) / per_unit
        own = machine.run(state, times)
        change = _START * float(scale.max())
        other = machine.run(machine.moved(state, change), times)
        apart = np.sqrt((((seen(own) - seen(other)) / scale) ** 2).sum(axis=1))
        # The largest of a unit of time: distances swing in a cycle.
        apart = np.maximum(apart.reshape(-1, per_unit).max(axis=1), 1e-14)
        largest.append(float(apart.max()))
        turned = np.flatnonzero(apart > _TURN)
        if turned.size:
            begin = int(turned[0])
            far = np.flatnonzero(apart[begin:] > _FAR)
            end = begin + int(far[0]) if far.size else len(apart) - 1
            if end > begin:
                rates.append(math.log(apart[end] / apart[begin]))
                lengths.append((end - begin) * unit)
        state = wb.final_state(own)
        if pair == 5 and max(largest) < 1e-6:
            break
    if max(largest) < 1e-6:
        return Parting(math.nan, math.nan, REGULAR)
    if len(rates) < _PAIRS - 2 or min(sorted(largest)[2:]) < _FAR:
        return Parting(math.nan, math.nan, UNCLEAR)
    total, time = np.array(rates), np.array(lengths)
    mean = float(total.sum() / time.sum())
    error = float(np.std((total - mean * time), ddof=1) / math.sqrt(len(total)) / time.mean())
    return Parting(mean, error, IRREGULAR if mean > 4.0 * error else UNCLEAR)
