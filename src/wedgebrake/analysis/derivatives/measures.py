"""Numbers that describe a run, such as heat, peaks and root mean squares, and their derivatives.

An integral over a run changes with the quantity, and where the quantity jumps with the time of the
jump. An extreme between two events is stationary, so that it changes as the quantity does at this
time; at an event it also changes with the time of the event.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.polynomial import legendre

from wedgebrake.analysis.derivatives.varied_motion import VariedMotion, ends_of
from wedgebrake.analysis.derivatives.varied_values import VariedValues
from wedgebrake.analysis.responses.machine_series import series, values_at
from wedgebrake.arrays import FloatArray
from wedgebrake.model.validation import unknown, wrong

# A jump below this share of the largest value is rounding, and so is a root mean square, and a
# derivative below this share of the largest one.
_ROUNDING = 1e-12
# Extremes that differ by less than this share of their size are equal. If their derivatives do not
# agree to the second share, the larger one of them changes with the sign of the change.
_EQUAL, _AGREE = 1e-11, 1e-8
_GRID: FloatArray = np.cos(np.linspace(0.0, np.pi, 65))

Found = tuple[FloatArray, FloatArray]
"""Values (parts,) and their derivatives (parts, q)."""


class Measure(NamedTuple):
    """A number that describes a run, for each part along a dimension."""

    dim: str
    unit: str
    meaning: str
    of: Callable[[VariedMotion], Found]


def integral(varied: VariedMotion, trace: VariedValues) -> Found:
    """Integrals over the run."""
    values = varied.motion.integral(trace.values).sum(axis=0)
    changes = varied.motion.integral(trace.changes).sum(axis=0)
    first, last = ends_of(trace.values)
    still = np.zeros((1, values.size))
    falls = np.concatenate([still, last]) - np.concatenate([first, still])
    largest = np.abs(trace.values).max(axis=(0, 1), initial=0.0)
    for edge, part in np.argwhere(np.abs(falls) > _ROUNDING * largest):
        changes[part] += falls[edge, part] * varied.shifts[edge]
    return values, changes


def mean(varied: VariedMotion, trace: VariedValues) -> Found:
    """Means over the run."""
    (total, changes), (duration, longer) = integral(varied, trace), varied.duration
    values = total / duration
    return values, (changes - values[:, None] * longer) / duration


def root_mean_square(varied: VariedMotion, trace: VariedValues) -> Found:
    """Root mean squares over the run; their derivatives are nan where they are 0."""
    squares, changes = mean(varied, trace * trace)
    values = np.sqrt(np.maximum(squares, 0.0))
    largest = np.abs(trace.values).max(axis=(0, 1), initial=0.0)
    moves = values > _ROUNDING * largest
    halves = np.where(moves, 2.0 * values, np.nan)
    return np.where(moves, values, 0.0), changes / halves[:, None]


def about_mean(varied: VariedMotion, trace: VariedValues) -> Found:
    """Root mean squares about the means; a small change of the mean has no effect on them."""
    largest = np.abs(trace.values).max(axis=(0, 1), initial=0.0)
    values, changes = root_mean_square(varied, trace - mean(varied, trace)[0])
    still = values <= _ROUNDING * largest
    return np.where(still, 0.0, values), np.where(still[:, None], np.nan, changes)


def highest(varied: VariedMotion, trace: VariedValues, signs: Sequence[float] = (1.0,)) -> Found:
    """Largest values of the quantities times the signs; derivatives nan where two are equal."""
    parts, q = trace.changes.shape[2:]
    rounding = _ROUNDING * np.abs(trace.changes).max(axis=(0, 1, 2), initial=0.0)
    values, changes = np.full(parts, np.nan), np.full((parts, q), np.nan)
    for part in range(parts):
        own, by = series(trace.values[..., part]), series(trace.changes[..., part, :])
        found = [_candidates(varied, sign * own, sign * by) for sign in signs]
        tops, slopes, sizes = (np.concatenate(one) for one in zip(*found, strict=True))
        values[part] = tops.max()
        equal = tops >= values[part] - _EQUAL * np.abs(trace.values[..., part]).max()
        near, size = slopes[equal], sizes[equal]
        apart = near.max(axis=0) - near.min(axis=0)
        # The terms of an extreme at an event may cancel each other.
        best = np.take_along_axis(near, size.argmin(axis=0)[None], axis=0)[0]
        changes[part] = np.where(apart <= _AGREE * size.max(axis=0) + rounding, best, np.nan)
    return values, changes


def _candidates(
    varied: VariedMotion, rows: FloatArray, by: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Largest values of a series in intervals where they may be largest.

    rows, by : (p, degrees) and (p, degrees, q) coefficients of a quantity and its derivatives

    Returns the values, their derivatives, and the magnitude of the terms of these.
    """
    matrix = legendre.legvander(_GRID, rows.shape[1] - 1)
    values = rows @ matrix.T
    bound = np.abs(rows[:, 1:]).sum(axis=1) + rows[:, 0]
    chosen = np.flatnonzero(bound >= values.max() - _EQUAL * np.abs(values).max())
    own = rows[chosen]
    first = np.asarray(legendre.legder(own, axis=1), float)
    second = np.asarray(legendre.legder(first, axis=1), float)
    x = _GRID[np.argmax(values[chosen], axis=1)]
    for _ in range(8):
        slope, bend = values_at(first, x), values_at(second, x)
        step = np.divide(slope, bend, out=np.zeros_like(x), where=bend < 0.0)
        x = np.clip(x - np.clip(step, -0.1, 0.1), -1.0, 1.0)
    found: list[tuple[FloatArray, FloatArray, FloatArray]] = []
    for place, shifts in (
        (x, np.zeros((chosen.size, by.shape[2]))),
        (np.full(x.shape, -1.0), varied.shifts[chosen]),
        (np.full(x.shape, 1.0), varied.shifts[chosen + 1]),
    ):
        rate = values_at(first, place) * 2.0 / varied.motion.length[chosen]
        at = legendre.legvander(place, rows.shape[1] - 1)
        moved = np.where(shifts == 0.0, 0.0, rate[:, None] * shifts)
        terms = np.einsum("pd,pdq->pq", at, by[chosen]), moved
        size = np.einsum("pd,pdq->pq", np.abs(at), np.abs(by[chosen])) + np.abs(moved)
        found.append((values_at(own, place), terms[0] + terms[1], size))
    # An extreme between the ends is one only if the quantity is stationary there.
    inside = np.abs(x) < 1.0
    found[0] = tuple(one[inside] for one in found[0])
    tops, slopes, sizes = (np.concatenate(one) for one in zip(*found, strict=True))
    return tops, slopes, sizes


def _lowest(varied: VariedMotion, trace: VariedValues) -> Found:
    values, changes = highest(varied, trace, (-1.0,))
    return -values, -changes


def _half_range(varied: VariedMotion, trace: VariedValues) -> Found:
    (high, up), (low, down) = highest(varied, trace), _lowest(varied, trace)
    return 0.5 * (high - low), 0.5 * (up - down)


def _peak(varied: VariedMotion, trace: VariedValues) -> Found:
    return highest(varied, trace, (1.0, -1.0))


def _heat(varied: VariedMotion) -> VariedValues:
    power = varied.torque * varied.sliding
    return VariedValues(-power.values, -power.changes)


MEASURES: dict[str, Measure] = {
    "friction_heat": Measure(
        "contact", "J", "heat of the contact", lambda one: integral(one, _heat(one))
    ),
    "friction_power": Measure(
        "contact", "W", "mean power turned into heat", lambda one: mean(one, _heat(one))
    ),
    "base_work": Measure(
        "contact", "J", "work of the moving base against the contact",
        lambda one: integral(one, one.base * one.torque),
    ),
    "viscous_loss": Measure(
        "shaft", "J", "heat of the viscous damping", lambda one: integral(one, one.power["shaft"])
    ),
    "torque_work": Measure(
        "torque", "J", "work of the torque", lambda one: integral(one, one.power["torque"])
    ),
    "control_work": Measure(
        "controller", "J", "work of the torque of the controller",
        lambda one: integral(one, one.power["controller"]),
    ),
    "drive_work": Measure(
        "driven", "J", "work of the driven body, without that of a contact",
        lambda one: integral(one, one.power["driven"]),
    ),
    "peak_torque": Measure(
        "contact", "N m", "largest |torque|", lambda one: _peak(one, one.shared)
    ),
    "rms_torque": Measure(
        "contact", "N m", "rms torque, about its mean", lambda one: about_mean(one, one.shared)
    ),
    "lowest_velocity": Measure(
        "inertia", "rad/s", "lowest speed", lambda one: _lowest(one, one.speed)
    ),
    "highest_velocity": Measure(
        "inertia", "rad/s", "highest speed", lambda one: highest(one, one.speed)
    ),
    "velocity_amplitude": Measure(
        "inertia", "rad/s", "half the range of the speed", lambda one: _half_range(one, one.speed)
    ),
    "rms_velocity": Measure(
        "inertia", "rad/s", "rms speed, about its mean", lambda one: about_mean(one, one.speed)
    ),
    "angle_amplitude": Measure(
        "inertia", "rad", "half the range of the angle", lambda one: _half_range(one, one.angle)
    ),
    "peak_acceleration": Measure(
        "inertia", "rad/s^2", "largest |acceleration|", lambda one: _peak(one, one.acceleration)
    ),
    "rms_acceleration": Measure(
        "inertia", "rad/s^2", "rms acceleration",
        lambda one: root_mean_square(one, one.acceleration),
    ),
}  # fmt: skip
"""The measures by name, which are those of sweeps and of ``energy``."""


def checked_measures(given: Any) -> tuple[str, ...]:
    """The names of measures that are asked for."""
    if isinstance(given, str) or not isinstance(given, Sequence) or not given:
        raise wrong("of", given, 'a list of names, for example ["friction_heat", "peak_torque"]')
    for name in given:
        if name not in MEASURES:
            raise unknown("of", name, list(MEASURES), "no such measure")
    return tuple(dict.fromkeys(given))
