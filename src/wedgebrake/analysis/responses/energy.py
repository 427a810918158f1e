"""The energy balance of a response, period by period."""

from __future__ import annotations

import dataclasses
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from wedgebrake.analysis.responses.datasets import attributes, dataset_over
from wedgebrake.analysis.responses.dense_motion import DenseMotion
from wedgebrake.analysis.responses.machine_energy import energy_of_parts, stored_energy
from wedgebrake.analysis.responses.machine_series import largest, machine_series, series
from wedgebrake.analysis.responses.repeat import run_of, solved
from wedgebrake.analysis.responses.segments import (
    ResponseSystem,
    Segments,
    of_series,
    recorded_system,
    segments_between,
)
from wedgebrake.analysis.responses.sticking import inside, span
from wedgebrake.arrays import FloatArray
from wedgebrake.errors import InputError
from wedgebrake.model.machine_matrices import shaft_rows

if TYPE_CHECKING:
    import xarray as xr


# Largest distance of recorded states, in periods of the torque and of the free vibration.
_FORCED, _FREE = 0.1, 0.25
# Number of nodes that are evaluated at a time.
_BLOCK = 300_000
# States closer than this fraction of a period count as one.
_SAME = 1e-12
# The error refers to the energy exchanged, or to this fraction of the stored energy if larger.
_LEAST_EXCHANGE = 1e-6

_SPEC = {
    "period": ("1", "number of the period"),
    "time": ("s", "beginning"),
    "torque_work": ("J", "work of the torque"),
    "drive_work": ("J", "work of the shaft's drive against the brake"),
    "viscous_loss": ("J", "heat of the viscous damping"),
    "friction_heat": ("J", "heat of the brake"),
    "stored_change": ("J", "gain of kinetic and elastic energy"),
    "residual": ("J", "error of the balance"),
    "friction_power": ("W", "mean power of the brake's heat"),
    "peak_torque": ("N m", "largest magnitude of the brake torque, also at rest"),
    "amplification": ("1", "mean |F_mu|/F_a while the pressed brake slides"),
}
_BALANCE = tuple(name for name, (unit, _) in _SPEC.items() if unit == "J")
_INTEGRALS = (*_BALANCE[:4], "amplification_time", "amplification_integral", "peak_torque")


def energy(response: xr.Dataset, start: float | None = None) -> xr.Dataset:
    """Energy balance of every whole period of the torque (docs/equations.md, "Energy balance").

    For a machine the balance covers the whole run, part by part.

    With v = drive_speed + theta' the sliding velocity,

        torque_work + drive_work = viscous_loss + friction_heat + stored_change + residual
        int T theta' dt, int drive_speed R F_mu dt, int c theta'^2 dt, int R F_mu v dt

    Every integral is computed from the motion, and none from the others, so that the residual
    measures their error. With signals, lag, limits or sampling, and for machines, the run is
    repeated, and the integrals are those of the exact motion, to rounding. Otherwise the motion is
    that between the recorded states. For responses of "exact" the motion between
    the states is known in closed form, for any sampling, and the residual is rounding: below
    1e-12 of the energy exchanged, more only if the rounding of the recorded times corresponds
    to more energy (a torque much slower than a lightly damped vibration). A smooth law passes
    through its steep layer between two samples: the residual is some 1e-6 with 200 samples in a
    period, 1e-3 with 20. A law that the response does not contain (custom friction, a brake
    without a kind) is reconstructed from the samples, with a similar residual. ``wb.paper.ode14x``
    adds its own error.

    Parameters
    ----------
    response : xarray.Dataset
        As returned by ``simulate``.
    start : float
        Beginning of the window [s]; default: of the response. Whole periods
        n/f_e <= t <= (n + 1)/f_e that lie in it and were sampled are counted. Where the torque
        has no period, the window is one.

    Returns
    -------
    xarray.Dataset
        Over ``period`` (n, with its beginning ``time`` [s] as a coordinate): torque_work,
        drive_work, viscous_loss, friction_heat, stored_change, residual [J];
        friction_power [W], the mean; peak_torque [N m], the largest |R F_mu|, on both sides
        of every jump and at rest; amplification [1], the mean over time of |F_mu|/F_a while
        the brake slides (no stick) and is pressed (F_a > 0), nan where it never does.
        ``attrs``: start, stop [s]; ``total_`` and each of the six energies [J]; over the whole
        window mean_friction_power, mean_amplification, largest_peak_torque; error, the largest
        |residual| relative to the mean energy exchanged in a period; law, "system" or
        "samples": where the torque between the samples comes from; method, status and
        message of the response.

        For a machine: friction_heat and base_work over ``contact``, viscous_loss over ``shaft``,
        torque_work over ``torque``, with driven bodies drive_work over ``driven``, stored_change,
        residual, and the rounding to be expected in it [J]: the angles of very stiff shafts are
        rounded; ``attrs``: start, stop [s], and note, a sentence with the way out where this is
        more than a millionth of the energy exchanged.

    Raises
    ------
    InputError
        For a dataset that is not a response, a start outside the response, less than one whole
        period, or samples too far apart where they are needed: more than a tenth of the torque's
        period or a quarter of the natural one.
    """
    begin, end = span(response)
    low = begin if start is None else inside(start, begin, end)
    if "inertia" in response.dims:
        return energy_of_parts(response, start)
    balance = _by_series(response, low) or _between_states(response, low)
    parts, times = balance.integrals, balance.times
    parts["stored_change"] = np.diff(balance.stored)
    supplied = parts["torque_work"] + parts["drive_work"]
    taken = parts["viscous_loss"] + parts["friction_heat"] + parts["stored_change"]
    pressed, ratio = parts["amplification_time"], parts["amplification_integral"]
    values = parts | {
        "period": balance.numbers,
        "time": times[:-1],
        "residual": supplied - taken,
        "friction_power": parts["friction_heat"] / np.diff(times),
        "amplification": _ratio(ratio, pressed),
    }
    dataset = dataset_over("period", _SPEC, values).set_coords("time")
    dataset.attrs = {
        "start": float(times[0]),
        "stop": float(times[-1]),
        **{f"total_{name}": float(np.sum(values[name])) for name in _BALANCE},
        "mean_friction_power": float(np.sum(parts["friction_heat"]) / (times[-1] - times[0])),
        "mean_amplification": float(_ratio(np.sum(ratio), np.sum(pressed))),
        "largest_peak_torque": float(np.max(parts["peak_torque"])),
        "error": _error(values, float(np.max(balance.stored))),
        "law": balance.law,
        **attributes(response, "method", "status", "message"),
    }
    return dataset


class _Balance(NamedTuple):
    """Integrals over p periods.

    numbers   : (p,) of the periods
    times     : (p + 1,) their ends [s]
    stored    : (p + 1,) kinetic and elastic energy there [J]
    integrals : (p,) each
    law       : where the torque comes from
    """

    numbers: NDArray[np.int64]
    times: FloatArray
    stored: FloatArray
    integrals: dict[str, FloatArray]
    law: str = "system"


def _between_states(response: xr.Dataset, low: float) -> _Balance:
    """The balance from the motion between the recorded states."""
    given = recorded_system(response)
    period = 1.0 / given.excitation.frequency
    first, last = _periods(response, low, period)
    times, angle, velocity, numbers = (
        response[name].to_numpy()[first : last + 1]
        for name in ("poincare_time", "poincare_angle", "poincare_velocity", "period")
    )
    segments = segments_between(response, times[0], times[-1], _SAME * period)
    check_gaps(segments, given, period, "the energy balance")
    line = given.driveline
    stored = 0.5 * line.inertia * velocity**2 + 0.5 * line.stiffness * angle**2
    law = "samples" if given.system is None else "system"
    integrals = _integrals(response, given, segments, times)
    return _Balance(numbers[:-1], times, stored, integrals, law)


def _by_series(response: xr.Dataset, low: float) -> _Balance | None:
    """The balance from the series of the repeated run; None if no series solved it."""
    if not of_series(response):
        return None
    machine, task = run_of(response)
    points, numbers = response["poincare_time"].to_numpy(), response["period"].to_numpy()
    later = points >= low - 1e-9 * abs(low)
    times, numbers = points[later], numbers[later]
    if not points.size:
        times, numbers = np.array([low, task.end]), np.zeros(2, np.int64)
    if times.size < 2 or times[-1] <= times[0]:
        raise _no_period(response, low, float(np.min(np.diff(points), initial=np.inf)))
    motion = machine_series(machine, task, solved(machine, task), times).select(times[0], times[-1])
    states = solved(machine, dataclasses.replace(task, times=times)).observer.states
    n = len(machine.inertias)
    window = np.searchsorted(times, motion.start + 0.5 * motion.length) - 1
    radius = np.array([one.brake.radius for one in machine.contacts])
    damping = np.array([one.damping for one in machine.shafts])
    pressed = motion.slides[:, None] & (motion.force > 0.0)
    ratio = np.abs(motion.torque) / (radius * np.where(pressed, motion.force, np.inf))
    powers = {
        "torque_work": motion.external * motion.speed,
        "drive_work": motion.base * motion.torque,
        "viscous_loss": damping * (motion.speed @ shaft_rows(machine).T) ** 2,
        "friction_heat": motion.power,
        "amplification_time": pressed.astype(float),
        "amplification_integral": ratio,
    }
    integrals = {name: np.zeros(times.size - 1) for name in powers}
    for name, power in powers.items():
        np.add.at(integrals[name], window, motion.integral(power).sum(axis=1))
    torque = series(motion.torque)
    integrals["peak_torque"] = np.array(
        [largest(torque[window == k]).max() for k in range(times.size - 1)]
    )
    stored = stored_energy(machine, states[:, :n], states[:, n : 2 * n])
    return _Balance(numbers[:-1], times, stored, integrals)


def _integrals(
    response: xr.Dataset, given: ResponseSystem, segments: Segments, times: FloatArray
) -> dict[str, FloatArray]:
    """Integrals over each period, and its peak torque."""
    motion = DenseMotion(response, given, segments)
    number = np.searchsorted(times, segments.middle) - 1
    sums = {name: np.zeros(times.size - 1) for name in _INTEGRALS}
    for group in motion.quadrature_groups():
        rule = motion.select(group).quadrature()
        # In blocks, to limit memory use.
        blocks = min(group.size, 1 + group.size * rule[0].size // _BLOCK)
        for rows in np.array_split(group, blocks):
            for name, values in _over_segments(motion.select(rows), *rule).items():
                add = np.maximum if name == "peak_torque" else np.add
                add.at(sums[name], number[rows], values)
    return sums


def _over_segments(
    motion: DenseMotion, x: FloatArray, weights: FloatArray
) -> dict[str, FloatArray]:
    """Integrals over each segment, by nodes and weights (m,), and its peak torque."""
    given, drive_speed = motion.given, motion.given.driveline.constant_speed
    velocity, sliding, torque = motion.state(x)
    force = given.force(sliding)
    counts = (force > 0.0) & ~motion.sticking[:, None]
    powers: dict[str, Any] = {
        "torque_work": motion.excitation(x) * velocity,
        "drive_work": drive_speed * torque,
        "viscous_loss": given.driveline.damping * velocity**2,
        "friction_heat": torque * sliding,
        "amplification_time": counts,
        "amplification_integral": np.abs(torque) / (given.radius * np.where(counts, force, np.inf)),
    }
    share = motion.segments.duration[:, None] * weights
    found = {name: np.sum(share * power, axis=1) for name, power in powers.items()}
    return found | {"peak_torque": _peak(motion, x, np.abs(torque))}


def _peak(motion: DenseMotion, nodes: FloatArray, inner: FloatArray) -> FloatArray:
    """Largest |torque| in each segment, given |torque| at the nodes."""
    outer = np.abs(motion.state(np.array([0.0, 1.0]))[2])
    x = np.concatenate(([0.0], nodes, [1.0]))
    torque = np.column_stack((outer[:, 0], inner, outer[:, 1]))
    # Also the vertex of the parabola through the largest value and its neighbours.
    top = np.clip(np.argmax(torque, axis=1), 1, x.size - 2)
    rows = np.arange(top.size)
    left, right = x[top - 1] - x[top], x[top + 1] - x[top]
    here = torque[rows, top]
    fall, rise = (torque[rows, top - 1] - here) / left, (torque[rows, top + 1] - here) / right
    bend = (rise - fall) / (right - left)
    hollow = bend < -1e-12 * here  # else flat, or rising towards an end
    step = np.where(hollow, 0.5 * (left - fall / np.where(hollow, bend, 1.0)), 0.0)
    vertex = x[top] + np.clip(step, left, right)
    turning = np.abs(motion.state(vertex[:, None])[2])[:, 0]
    return np.asarray(np.maximum(torque.max(axis=1), turning))


def _periods(response: xr.Dataset, low: float, period: float) -> tuple[int, int]:
    """Indices of the first and last Poincare point of the sampled periods from ``low`` on."""
    times = response["time"].to_numpy()
    points = response["poincare_time"].to_numpy()
    margin = _FORCED * period
    if times.size:
        early, late = max(low - 1e-9 * period, times[0] - margin), times[-1] + margin
        found = np.flatnonzero((points >= early) & (points <= late))
        if found.size >= 2:
            return int(found[0]), int(found[-1])
    raise _no_period(response, low, period)


def _no_period(response: xr.Dataset, low: float, period: float) -> InputError:
    """The error for a response without a whole period."""
    times = response["time"].to_numpy()
    covered = f"{times[0]:g} s to {times[-1]:g} s" if times.size else "none at all"
    ended = response.attrs.get("status", "completed")
    stopped = "" if ended == "completed" else f" The run ended early ({ended})."
    return InputError(
        f"response: no whole period of the torque from {low:g} s on was sampled (a period is"
        f" {period:g} s, from n/f_e to (n + 1)/f_e; samples: {covered}). Simulate at least two"
        f" periods, or choose an earlier start.{stopped}"
    )


def check_gaps(segments: Segments, given: ResponseSystem, period: float, what: str) -> None:
    """Raise ``InputError`` if states are too far apart for the integrals of ``what``."""
    natural = given.driveline.natural_frequency
    limit = _FORCED * period
    if natural > 0.0:
        limit = min(limit, _FREE * 2.0 * np.pi / natural)
    widest = float(np.max(segments.duration))
    if widest > limit * (1.0 + 1e-6):
        raise InputError(
            f"response: its states lie up to {widest:g} s apart, but {what} needs {limit:g} s or"
            f" less. Simulate with samples_per_period of at least"
            f" {int(np.ceil(period / limit - 1e-6))} and without `times` that leave gaps."
        )


def _ratio(part: Any, whole: Any) -> Any:
    """part/whole, nan where the whole is zero."""
    return np.where(whole > 0.0, part / np.where(whole > 0.0, whole, 1.0), np.nan)


def _error(values: dict[str, FloatArray], largest_stored: float) -> float:
    """Largest residual as a fraction of the mean energy exchanged in a period.

    If almost no energy is exchanged, it refers to the stored energy, so that rounding stays small.
    """
    exchanged = sum(np.abs(values[name]) for name in _BALANCE[:5])
    scale = max(0.5 * float(np.mean(exchanged)), _LEAST_EXCHANGE * largest_stored)
    return float(np.max(np.abs(values["residual"]))) / scale if scale > 0.0 else 0.0
