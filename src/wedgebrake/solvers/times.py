"""Output times of a response: given ones, and the default number of samples."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from wedgebrake.arrays import FloatArray
from wedgebrake.errors import InputError
from wedgebrake.model.machine import Machine
from wedgebrake.model.machine_matrices import natural_frequencies
from wedgebrake.model.signals.signals import Signal
from wedgebrake.model.system import BrakedDriveline
from wedgebrake.model.validation import wrong

PER_PERIOD = 50
"""Fewest samples in a period of the fastest vibration, by default."""
MOST_SAMPLES = 50_000_000
"""Largest number of samples that can be asked for."""
MOST_BY_DEFAULT = 200_000
"""Largest number of samples that is stored by default."""


def needed_samples(system: BrakedDriveline | Machine, start: float, end: float) -> int:
    """Number of samples that show the fastest motion of a run [s].

    ``PER_PERIOD`` in each period of the highest natural frequency of inertias and shafts and of the
    highest frequency of a signal, and one for each knot of a signal, such as a recorded value.
    """
    varying = [one for one in system.signals().values() if one.varies]
    natural = natural_frequencies(system.machine).max(initial=0.0)
    cycles = (end - start) * max([natural, *(one.rate for one in varying)]) / (2.0 * math.pi)
    knots = sum(_knots(one, start, end) for one in varying)
    return math.ceil(max(PER_PERIOD * float(cycles), knots))


def _knots(signal: Signal, start: float, end: float) -> float:
    """Number of knots of a signal between two times [s]; of one that repeats from one period."""
    length, period = end - start, signal.period
    if period and period < length:
        return (signal.knots(start, start + period).size + 1) * length / period
    inner = signal.knots(start, end).size
    return inner + 2 if inner else 0


def sampling_note(needed: int, count: int) -> str:
    """A sentence, after a space, on a run with fewer samples than it needs; else nothing."""
    if count >= needed:
        return ""
    return (
        f" {count} samples are stored, the most by default; {needed} would show the fastest"
        f" vibration with {PER_PERIOD} in each period. Give samples={min(needed, MOST_SAMPLES)}, or"
        " a shorter duration."
    )


def wanted_times(times: ArrayLike, start: float, stop: float) -> FloatArray:
    """Return ascending times in [start, stop] as an array; raises ``InputError`` for others."""
    try:
        wanted = np.atleast_1d(np.asarray(times, dtype=float))
    except (TypeError, ValueError):
        raise wrong("times", times, "an array of numbers [s]") from None
    slack = 1e-9 * max(abs(stop), 1e-9)
    inside = wanted.size == 0 or (wanted.min() >= start - slack and wanted.max() <= stop + slack)
    if wanted.ndim != 1 or not np.all(np.isfinite(wanted)) or not inside:
        raise InputError(
            f"times: must be finite, one-dimensional and between {start:g} s (start_time) and"
            f" {stop:g} s (the end). Lengthen duration, or drop the times outside.",
            name="times", value=times, allowed=f"finite times from {start:g} s to {stop:g} s",
        )  # fmt: skip
    if np.any(np.diff(wanted) < 0.0):
        raise InputError("times: must ascend. Sort them, for example with numpy.sort.")
    return np.asarray(np.clip(wanted, start, stop))
