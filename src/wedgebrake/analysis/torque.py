"""Brake torque over a window of a response: mean, mean magnitude and peak."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from wedgebrake.analysis.dense_motion import DenseMotion
from wedgebrake.analysis.energy import check_gaps
from wedgebrake.analysis.segments import NODES, WEIGHTS, Segments, segments_between
from wedgebrake.analysis.system_from_response import system_from_response
from wedgebrake.errors import InputError
from wedgebrake.model.display import Tabular
from wedgebrake.model.validation import SECONDS, check_number, shown

if TYPE_CHECKING:
    import xarray as xr

FloatArray = NDArray[np.float64]

# States closer than this share of a period are one.
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
    response: xr.Dataset, start: float | None = None, stop: float | None = None
) -> BrakeTorque:
    """Mean, mean magnitude and peak of the brake torque (docs/theory.md, section 10).

    The integrals are computed from the motion between the recorded states. For "exact" responses
    the mean is exact: between events the torque is linear in the velocity, whose integral is the
    angle. Otherwise torque laws and accuracy are those of ``energy``.

    response    : as ``simulate`` gives it
    start, stop : ends of the window [s], for example whole periods; default: the sampled range

    Raises ``InputError`` for a dataset that is no response, a window outside it, and
    samples too far apart: more than a tenth of the torque's period or a quarter of the
    natural one.
    """
    given = system_from_response(response)
    period = given.excitation.period
    low, high = _window(response, start, stop, period)
    times = response["time"].to_numpy()
    segments = segments_between(response, times[0], times[-1], _SAME * period)
    segments = segments.select(slice(*_overlapping(segments, low, high)))
    check_gaps(segments, given, period, "the torque of the brake")
    motion = DenseMotion(response, given, segments)
    # Fractions of the first and last segment inside the window.
    begin = np.clip((low - segments.start) / segments.duration, 0.0, 1.0)
    end = np.clip((high - segments.start) / segments.duration, 0.0, 1.0)
    return _between(motion, begin, end, response.attrs.get("method") == "exact")


def _overlapping(segments: Segments, low: float, high: float) -> tuple[int, int]:
    """Slice bounds of the segments that overlap a window."""
    first = int(np.searchsorted(segments.start, low, side="right")) - 1
    behind = int(np.searchsorted(segments.start, high))
    return max(first, 0), max(behind, 1)


def _between(motion: DenseMotion, begin: FloatArray, end: FloatArray, exact: bool) -> BrakeTorque:
    """Torque between the fractions ``begin`` and ``end`` of the segments, (n,) each."""
    duration = motion.segments.duration
    ends = motion.state(np.column_stack((begin, end)))[2]
    # The integral over a whole segment of an exact solution is known, and so is that of the
    # magnitude unless the sign changes inside.
    known = np.full(duration.size, exact and motion.given.system is not None)
    known &= (begin == 0.0) & (end == 1.0)
    changes = np.flatnonzero(known & (ends[:, 0] * ends[:, 1] < 0.0))
    at = ends[changes, 0] / (ends[changes, 0] - ends[changes, 1])
    known[changes] = False
    others = np.flatnonzero(~known)
    others = others[~np.isin(others, changes)]
    rows = np.concatenate((others, changes, changes))
    low = np.concatenate((begin[others], np.zeros(at.size), at))
    high = np.concatenate((end[others], at, np.ones(at.size)))
    integrals = (duration * _means(motion))[known]
    torque = motion.select(rows).state(low[:, None] + (high - low)[:, None] * NODES)[2]
    shares = ((high - low) * duration[rows])[:, None] * WEIGHTS
    span = float(np.sum((end - begin) * duration))
    sizes = (np.abs(ends), np.abs(torque), np.abs(_extremes(motion, begin, end)))
    return BrakeTorque(
        mean=float(np.sum(integrals) + np.sum(shares * torque)) / span,
        mean_size=float(np.sum(np.abs(integrals)) + np.sum(shares * sizes[1])) / span,
        peak=max(float(np.max(size, initial=0.0)) for size in sizes),
    )


def _means(motion: DenseMotion) -> FloatArray:
    """Mean torque over each segment of an exact solution [N m].

    A torque that is linear in the velocity has its mean at the mean velocity. At rest it is what
    equilibrium demands of a shaft that turns evenly.
    """
    segments, given = motion.segments, motion.given
    line, drive = given.driveline, given.excitation
    even = segments.rotation / segments.duration
    middle = drive.angular_frequency * (motion.local_time + 0.5 * segments.duration)
    held = drive.amplitude * np.sin(middle) * np.sinc(drive.frequency * segments.duration)
    held = held - line.damping * even - line.stiffness * (segments.angle + 0.5 * segments.rotation)
    slid = motion.law((even + line.drive_speed)[:, None])[:, 0]
    return np.where(motion.at_rest, held, slid)


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
    """Checked ends of the window [s]; a bound less than a sample outside moves to the end."""
    times = response["time"].to_numpy() if "time" in response.coords else np.empty(0)
    if times.size < 2 or "stick_start" not in response.data_vars:
        raise InputError(
            f"response = {type(response).__name__} with {times.size} samples: must be the result of"
            " wb.simulate(...), with two samples or more."
        )
    first, last = float(times[0]), float(times[-1])
    beside = (last - first) / (times.size - 1)
    bounds = []
    for name, given, default in (("start", start, first), ("stop", stop, last)):
        value = default if given is None else given
        check_number(name, value, allowed=SECONDS)
        if not first - beside < value < last + beside:
            raise InputError(
                f"{name} = {shown(value)}: must be a time of the response that was sampled,"
                f" {first:g} s to {last:g} s. Choose one there, or simulate for longer."
            )
        bounds.append(float(min(max(value, first), last)))
    if not bounds[1] - bounds[0] > _SAME * period:
        raise InputError(
            f"start = {bounds[0]!r} and stop = {bounds[1]!r}: there is nothing between them. Make"
            " stop the later one."
        )
    return bounds[0], bounds[1]
