"""The torque of the brake over a stretch of a response: mean, mean size, peak."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from wedgebrake.analysis import segments as _arcs
from wedgebrake.analysis.dense_torque import Along
from wedgebrake.analysis.energy import check_gaps
from wedgebrake.analysis.system_from_response import machine
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
    """The brake's torque R F_mu over a stretch of time [N m].

    mean      : its mean, positive against forward motion
    mean_size : the mean of its magnitude
    peak      : its largest magnitude, on both sides of every jump and at rest
    """

    mean: float
    mean_size: float
    peak: float


def brake_torque(
    response: xr.Dataset, start: float | None = None, stop: float | None = None
) -> BrakeTorque:
    """Mean, mean size and peak of the brake's torque (docs/theory.md, section 10).

    Every integral is one over the motion between the recorded states. Of "exact" responses
    the mean is exact: between events the torque is linear in the velocity, whose integral is
    the angle. Laws and accuracy are otherwise those of ``energy``.

    response    : as ``simulate`` gives it
    start, stop : of the stretch [s], for example whole periods; default: what was sampled

    Raises ``InputError`` for a dataset that is no response, a stretch outside of it, and
    samples too far apart: more than a tenth of the torque's period or a quarter of the
    natural one.
    """
    given = machine(response)
    period = given.excitation.period
    low, high = _stretch(response, start, stop, period)
    times = response["time"].to_numpy()
    along = _arcs.arcs(response, times[0], times[-1], _SAME * period)
    along = along.block(slice(*_touched(along, low, high)))
    check_gaps(along, given, period, "the torque of the brake")
    motion = Along(response, given, along)
    # How much of the first and the last arc belongs to it.
    begin = np.clip((low - along.start) / along.length, 0.0, 1.0)
    end = np.clip((high - along.start) / along.length, 0.0, 1.0)
    return _over(motion, begin, end, response.attrs.get("method") == "exact")


def _touched(along: _arcs.Arcs, low: float, high: float) -> tuple[int, int]:
    """The first of the arcs that reach into a stretch, and the one behind the last."""
    first = int(np.searchsorted(along.start, low, side="right")) - 1
    behind = int(np.searchsorted(along.start, high))
    return max(first, 0), max(behind, 1)


def _over(motion: Along, begin: FloatArray, end: FloatArray, exact: bool) -> BrakeTorque:
    """The torque from the shares ``begin`` to the shares ``end`` of the arcs, (n,) each."""
    length = motion.along.length
    ends = motion.state(np.column_stack((begin, end)))[2]
    # Of whole arcs of an exact solution the integral is known, and so is that of the magnitude
    # unless the sign changes inside.
    known = np.full(length.size, exact and motion.given.system is not None)
    known &= (begin == 0.0) & (end == 1.0)
    changes = np.flatnonzero(known & (ends[:, 0] * ends[:, 1] < 0.0))
    at = ends[changes, 0] / (ends[changes, 0] - ends[changes, 1])
    known[changes] = False
    others = np.flatnonzero(~known)
    others = others[~np.isin(others, changes)]
    rows = np.concatenate((others, changes, changes))
    low = np.concatenate((begin[others], np.zeros(at.size), at))
    high = np.concatenate((end[others], at, np.ones(at.size)))
    integrals = (length * _means(motion))[known]
    torque = motion.rows(rows).state(low[:, None] + (high - low)[:, None] * _arcs.NODES)[2]
    shares = ((high - low) * length[rows])[:, None] * _arcs.WEIGHTS
    span = float(np.sum((end - begin) * length))
    sizes = (np.abs(ends), np.abs(torque), np.abs(_turning(motion, begin, end)))
    return BrakeTorque(
        mean=float(np.sum(integrals) + np.sum(shares * torque)) / span,
        mean_size=float(np.sum(np.abs(integrals)) + np.sum(shares * sizes[1])) / span,
        peak=max(float(np.max(size, initial=0.0)) for size in sizes),
    )


def _means(motion: Along) -> FloatArray:
    """The mean torque [N m] of each arc of an exact solution.

    A torque that is linear in the velocity has the mean that belongs to the mean velocity; at
    rest it is what equilibrium demands of a shaft that turns evenly.
    """
    along, given = motion.along, motion.given
    line, drive = given.driveline, given.excitation
    even = along.rise / along.length
    middle = drive.angular_frequency * (motion.local + 0.5 * along.length)
    held = drive.amplitude * np.sin(middle) * np.sinc(drive.frequency * along.length)
    held = held - line.damping * even - line.stiffness * (along.angle + 0.5 * along.rise)
    slid = motion.law((even + line.drive_speed)[:, None])[:, 0]
    return np.where(motion.rest, held, slid)


def _turning(motion: Along, begin: FloatArray, end: FloatArray) -> FloatArray:
    """The torque [N m] where it turns inside an arc: with the velocity, or at rest by itself."""
    along, given = motion.along, motion.given
    drive = given.excitation
    ends = np.column_stack((motion.local, motion.local + along.length))
    rate = drive.amplitude * drive.angular_frequency * np.cos(drive.angular_frequency * ends)
    held = rate - (given.driveline.stiffness * along.rise / along.length)[:, None]
    first, last = np.where(
        motion.rest[:, None], held, np.column_stack((motion.first, motion.last))
    ).T
    turns = np.flatnonzero(first * last < 0.0)
    x = first[turns] / (first[turns] - last[turns])
    inside = (x > begin[turns]) & (x < end[turns])
    return motion.rows(turns[inside]).state(x[inside][:, None])[2]


def _stretch(response: xr.Dataset, start: Any, stop: Any, period: float) -> tuple[float, float]:
    """The stretch [s], checked; a bound less than a sample outside is moved to the end there."""
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
