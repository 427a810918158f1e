"""Brake torque over a window of a response: mean, mean magnitude and peak."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from wedgebrake.analysis.responses.datasets import of_part
from wedgebrake.analysis.responses.dense_motion import DenseMotion
from wedgebrake.analysis.responses.energy import check_gaps
from wedgebrake.analysis.responses.machine_series import (
    integrals_of_magnitude,
    largest,
    machine_series,
    series,
)
from wedgebrake.analysis.responses.repeat import run_of, solved
from wedgebrake.analysis.responses.segments import of_series, recorded_system, segments_between
from wedgebrake.analysis.responses.sticking import inside
from wedgebrake.arrays import FloatArray
from wedgebrake.errors import InputError
from wedgebrake.model.display import Tabular
from wedgebrake.model.validation import wrong
from wedgebrake.solvers.layout import full

if TYPE_CHECKING:
    import xarray as xr


# States closer than this share of a period count as one.
_SAME = 1e-12


@dataclass(frozen=True)
class BrakeTorque(Tabular):
    """Brake torque R F_mu over a window of time [N m].

    mean      : mean, positive against forward motion
    mean_size : mean magnitude
    peak      : largest magnitude, on both sides of every jump and at rest
    """

    mean: float
    mean_size: float
    peak: float


def brake_torque(
    response: xr.Dataset,
    start: float | None = None,
    stop: float | None = None,
    *,
    contact: str | None = None,
) -> BrakeTorque:
    """Mean, mean magnitude and peak of the brake torque.

    The integrals are computed from the motion between the recorded states. For "exact" responses
    they are exact to rounding, since the motion between events is known. Otherwise torque laws and
    accuracy are those of ``energy`` (docs/numerics.md, "Energy, torque and spectral lines"): with
    signals, lag, limits or sampling, and for machines, the run is repeated.

    response    : as returned by ``simulate``
    start, stop : ends of the window [s], for example whole periods; default: the sampled range
    contact     : name of the contact; default: the only one

    Raises ``InputError`` for a dataset that is not a response, an unknown contact, a window outside
    the response, and, where the samples are needed, samples too far apart: more than a tenth of the
    torque's period or a quarter of the natural one.
    """
    if of_series(response):
        return _by_series(response, start, stop, contact)
    of_part(full(response)[["brake_torque"]], "contact", contact, "contact")
    given = recorded_system(response)
    period = 1.0 / given.excitation.frequency
    low, high = _window(response, start, stop, period)
    times = response["time"].to_numpy()
    segments = segments_between(response, times[0], times[-1], _SAME * period)
    first = int(np.searchsorted(segments.start, low, side="right")) - 1
    behind = int(np.searchsorted(segments.start, high))
    segments = segments.select(slice(max(first, 0), max(behind, 1)))
    check_gaps(segments, given, period, "the torque of the brake")
    motion = DenseMotion(response, given, segments)
    # Fractions of the first and last segment inside the window.
    begin = np.clip((low - segments.start) / segments.duration, 0.0, 1.0)
    end = np.clip((high - segments.start) / segments.duration, 0.0, 1.0)
    return _between(motion, begin, end)


def _by_series(
    response: xr.Dataset, start: float | None, stop: float | None, contact: str | None
) -> BrakeTorque:
    """The torque of a contact from the series of the repeated run."""
    given = full(response)
    names = given["contact"].to_numpy().tolist()
    name = of_part(given[["brake_torque"]], "contact", contact, "contact")["contact"].item()
    machine, task = run_of(response)
    low, high = _window(response, start, stop, 1.0)
    motion = machine_series(machine, task, solved(machine, task), [low, high]).select(low, high)
    torque = -series(motion.torque)[..., names.index(name)]
    half = 0.5 * motion.length
    total = np.sum(2.0 * half * torque[:, 0])
    size = np.sum(half * integrals_of_magnitude(torque))
    peak = largest(torque[..., None]).item()
    time = np.sum(motion.length)
    return BrakeTorque(mean=float(total / time), mean_size=float(size / time), peak=peak)


def _between(motion: DenseMotion, begin: FloatArray, end: FloatArray) -> BrakeTorque:
    """Torque between the fractions ``begin`` and ``end`` of the segments, (n,) each."""
    ends = motion.state(np.column_stack((begin, end)))[2]
    peaks = [np.abs(ends), np.abs(_extremes(motion, begin, end))]
    # A segment in which the sign changes is integrated in two parts.
    changes = np.flatnonzero(ends[:, 0] * ends[:, 1] < 0.0)
    share = ends[changes, 0] / (ends[changes, 0] - ends[changes, 1])
    at = begin[changes] + share * (end - begin)[changes]
    rows = np.concatenate((np.arange(begin.size), changes))
    low, high = np.concatenate((begin, at)), np.concatenate((end, end[changes]))
    high[changes] = at
    parts = motion.select(rows)
    total = size = time = 0.0
    for group in parts.quadrature_groups():
        some = parts.select(group)
        x, weights = some.quadrature()
        length = (high - low)[group, None]
        torque = some.state(low[group, None] + length * x)[2]
        shares = length * some.segments.duration[:, None] * weights
        total, size = total + np.sum(shares * torque), size + np.sum(shares * np.abs(torque))
        time += np.sum(shares)
        peaks.append(np.abs(torque))
    peak = max(float(np.max(one, initial=0.0)) for one in peaks)
    return BrakeTorque(mean=float(total / time), mean_size=float(size / time), peak=peak)


def _extremes(motion: DenseMotion, begin: FloatArray, end: FloatArray) -> FloatArray:
    """Torque [N m] at its extremes inside the segments."""
    segments, given = motion.segments, motion.given
    drive = given.excitation
    ends = np.column_stack((motion.local_time, motion.local_time + segments.duration))
    rate = drive.amplitude * drive.angular_frequency * np.cos(drive.angular_frequency * ends)
    held = rate - (given.driveline.stiffness * segments.rotation / segments.duration)[:, None]
    first, last = np.where(
        motion.at_rest[:, None], held, np.column_stack((motion.first, motion.last))
    ).T
    turns = np.flatnonzero(first * last < 0.0)
    x = first[turns] / (first[turns] - last[turns])
    inside = (x > begin[turns]) & (x < end[turns])
    return motion.select(turns[inside]).state(x[inside][:, None])[2]


def _window(response: xr.Dataset, start: Any, stop: Any, period: float) -> tuple[float, float]:
    """Checked ends of the window [s]; a bound outside by less than a sample is moved inside."""
    times = response["time"].to_numpy() if "time" in response.coords else np.empty(0)
    if times.size < 2 or "stick_start" not in response.data_vars:
        raise wrong(
            "response", response, "the result of wb.simulate(...), with two samples or more"
        )
    first, last = float(times[0]), float(times[-1])
    beside = (last - first) / (times.size - 1)
    bounds = [
        min(max(inside(value, first - beside, last + beside, name), first), last)
        for name, value in (
            ("start", first if start is None else start),
            ("stop", last if stop is None else stop),
        )
    ]
    if not bounds[1] - bounds[0] > _SAME * period:
        raise InputError(
            f"start = {bounds[0]!r} and stop = {bounds[1]!r}: the window is empty. Make"
            " stop the later one.",
            name="start", value=bounds[0], allowed="before stop",
        )  # fmt: skip
    return bounds[0], bounds[1]
