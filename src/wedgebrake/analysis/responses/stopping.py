"""Measures of a stop: its time, angle, heat, torque, jerk and judder."""

from __future__ import annotations

import dataclasses
import json
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from wedgebrake.analysis.responses.datasets import attributes, labelled
from wedgebrake.analysis.responses.machine_series import (
    MachineSeries,
    largest,
    machine_series,
    series,
)
from wedgebrake.analysis.responses.repeat import run_of, solved
from wedgebrake.arrays import FloatArray
from wedgebrake.errors import InputError
from wedgebrake.model.machine import Machine
from wedgebrake.model.machine_parts import GROUND, Contact
from wedgebrake.model.signals.signals import as_signal
from wedgebrake.model.validation import check_number, check_whole
from wedgebrake.solvers.machine.sticks import sticks_of

if TYPE_CHECKING:
    import xarray as xr

    from wedgebrake.solvers.machine.solve import MachineAnswer, MachineTask


PHASES = ("braking", "ring-down")
_MOST_WINDOWS = 10_000
# Time after the stop in which its acceleration is found, as a share of the braking.
_AHEAD = 1e-3
_LONGEST = 1e9  # ring-down [s]
# Points between two knots at which a base is checked to be at rest.
_CHECKED = np.linspace(0.05, 0.95, 7)

_SPEC = {
    "stop_time": ((), "s", "time from the start to the stop"),
    "contact_stop_time": (("contact",), "s", "time from the start to its last stick"),
    "stop_angle": (("inertia",), "rad", "angle turned until the stop"),
    "stop_speed": (("inertia",), "rad/s", "speed at the stop"),
    "stop_acceleration": (("inertia",), "rad/s^2", "acceleration just after the stop"),
    "acceleration_step": (("inertia",), "rad/s^2", "jump of the acceleration at the stop"),
    "heat": (("contact",), "J", "heat until the stop"),
    "sliding_time": (("contact",), "s", "time of sliding until the stop"),
    "sliding_angle": (("contact",), "rad", "angle of sliding until the stop"),
    "mean_torque": (("contact",), "N m", "mean magnitude of the torque while it slides"),
    "peak_torque": (("contact",), "N m", "largest magnitude of the torque while it slides"),
    "rms_jerk": (("phase", "inertia"), "rad/s^3", "root mean square of the jerk"),
    "peak_jerk": (("phase", "inertia"), "rad/s^3", "largest magnitude of the jerk"),
    "judder_speed": (("window", "inertia"), "rad/s", "amplitude of the speed about its line"),
    "judder_torque": (("window", "contact"), "N m", "amplitude of the torque about its line"),
}


class _Stop(NamedTuple):
    """Times of the last sticks [s], nan: none, and of the stop."""

    contacts: FloatArray
    time: float


def stopping(response: xr.Dataset, ringdown: float | None = None, windows: int = 20) -> xr.Dataset:
    """Time, angle, heat, torque, jerk and judder of a stop.

    The stop is the instant at which the last of the contacts that stick at the end of the
    response begins its final stick; if the base of a contact moves, the base must have come to
    rest too. The phase "braking" lasts from the start of the response to the stop, the phase
    "ring-down" from the stop to the end of the response or for ``ringdown`` seconds.

    The run is repeated, and all quantities are computed from the exact motion between its events,
    not from the samples of the response.

    Parameters
    ----------
    response : xarray.Dataset
        As returned by ``simulate``.
    ringdown : float
        Duration of the ring-down [s]; default: until the end of the response. The run is continued
        if the response is shorter.
    windows : int
        Number of windows of equal duration in the phase "braking" in which judder is measured.

    Returns
    -------
    xarray.Dataset
        stop_time [s]. Over ``inertia``: stop_angle [rad], stop_speed [rad/s], stop_acceleration
        just after the stop and acceleration_step, its jump there [rad/s^2]. Over ``contact``:
        contact_stop_time [s], nan for a contact that does not rest at the end; heat [J],
        sliding_time [s] and sliding_angle [rad] until the stop; mean_torque and peak_torque [N m],
        the time average and the maximum of the magnitude of the torque while the contact slides.
        Over (``phase``, ``inertia``): rms_jerk and peak_jerk [rad/s^3], where the jerk is the
        derivative of the acceleration between its jumps. Over ``window``: judder_speed [rad/s] and
        judder_torque [N m] (of the torque, which counts as zero while the contact sticks), sqrt(2)
        times the root mean square deviation from a fitted straight line, with the coordinates
        mean_speed and mean_sliding [rad/s] and window_time [s]. ``attrs["moving_bases"]`` has the
        contact of each inertia that slides on a moving base, as JSON.

    Raises
    ------
    InputError
        If ``response`` is another dataset, if no contact with the ground sticks at the end, or if
        a contact slips again in the ring-down.
    """
    check_whole("windows", windows, 1, _MOST_WINDOWS)
    machine, task = run_of(response)
    end = task.end
    # A little beyond the stop, for the events there and the acceleration after it.
    sticks = response["stick_start"].to_numpy()[response["stick_exit"].to_numpy() == 0]
    task = _prolonged(machine, task, max(sticks, default=task.start))
    answer = solved(machine, task)
    stop = _stop_of(machine, task, answer)
    if ringdown is not None:
        end = stop.time + check_number("ringdown", ringdown, 0.0, _LONGEST)
        machine.check_times(task.start, end)
        task = _prolonged(machine, dataclasses.replace(task, end=end), stop.time)
        answer = solved(machine, task)
        _check_rests(machine, stop, answer)
    end = max(end, stop.time)
    edges = np.linspace(task.start, stop.time, windows + 1)
    motion = machine_series(machine, task, answer, [*edges, end])
    braking, after = motion.select(task.start, stop.time), motion.select(stop.time, task.end)
    n = len(machine.inertias)
    states = solved(machine, dataclasses.replace(task, times=edges[[0, -1]])).observer.states
    before, at = _end_values(braking, -1), _end_values(after, 0)
    judder = _judder(braking, edges)
    values: dict[str, Any] = {
        "stop_time": stop.time - task.start,
        "contact_stop_time": stop.contacts - task.start,
        "stop_angle": states[1, :n] - states[0, :n],
        "stop_speed": states[1, n : 2 * n],
        "stop_acceleration": at,
        "acceleration_step": at - before,
        **_braking(braking),
        **_jerks(braking, after.select(stop.time, end)),
        "judder_speed": judder.speed,
        "judder_torque": judder.torque,
    }
    found = _dataset(machine, values, judder)
    found.attrs = {
        "kind": "stopping", "start": task.start, "stop": stop.time, "end": end,
        "moving_bases": json.dumps(moving_bases(machine)),
        **attributes(response, "status", "message"),
    }  # fmt: skip
    return found


def moving_bases(machine: Machine) -> dict[str, str]:
    """The contact of each inertia that slides on a moving base, by the name of the inertia.

    As the shaft of a driveline with a drive speed, such an inertia turns by its vibration only.
    """
    return {
        one.a: one.name
        for one in machine.contacts
        if one.b == GROUND and as_signal(one.base_speed).bound > 0.0
    }


def _stop_of(machine: Machine, task: MachineTask, answer: MachineAnswer) -> _Stop:
    """Find the stop of a run; raise ``InputError`` if no contact with the ground stops."""
    times = np.full(len(machine.contacts), np.nan)
    sticks = sticks_of(answer)
    final = sticks.exit == 0
    times[sticks.contact[final]] = sticks.start[final]
    grounded = False
    for number, one in enumerate(machine.contacts):
        if one.b == GROUND and np.isfinite(times[number]):
            times[number] = np.maximum(times[number], _base_stop(one, task))  # nan if it moves
            grounded = grounded or bool(np.isfinite(times[number]))
    if not grounded or np.nanmax(times) <= task.start:
        names = ", ".join(one.name for one in machine.contacts)
        raise InputError(
            f"response: nothing stops: at its end, t = {task.end:g} s, no contact with the ground"
            f" has come to rest on a base at rest (contacts: {names or 'none'}). Simulate a longer"
            " time, for example with until='rest', or brake harder.",
            name="response", allowed="the response of a machine that comes to rest",
        )  # fmt: skip
    return _Stop(times, float(np.nanmax(times)))


def _base_stop(contact: Contact, task: MachineTask) -> float:
    """Time from which the base of a contact stays at rest [s]; nan if it moves at the end."""
    signal = as_signal(contact.base_speed)
    if not signal.varies:
        return task.start if float(signal(task.start)) == 0.0 else np.nan
    knots = [task.start, *signal.knots(task.start, task.end), task.end]
    rest = np.nan
    for first, last in zip(knots[-2::-1], knots[:0:-1], strict=True):
        if np.any(signal(first + _CHECKED * (last - first)) != 0.0):
            break
        rest = first
    return float(rest)


def _prolonged(machine: Machine, task: MachineTask, stop: float) -> MachineTask:
    """Extend the task to a little after a stop if all signals are defined until then."""
    end = max(task.end, stop + _AHEAD * (stop - task.start))
    try:
        machine.check_times(task.start, end)
    except InputError:
        return task
    return dataclasses.replace(task, end=end)


def _check_rests(machine: Machine, stop: _Stop, answer: MachineAnswer) -> None:
    """Raise ``InputError`` if a contact that has stopped slips again."""
    sticks = sticks_of(answer)
    for end, contact, left in zip(sticks.end, sticks.contact, sticks.exit, strict=True):
        if left != 0 and end > stop.time and np.isfinite(stop.contacts[contact]):
            name = machine.contacts[contact].name
            raise InputError(
                f"ringdown: contact {name!r} slips again at t = {end:g} s, after the response."
                " Simulate a longer time.",
                name="ringdown", allowed=f"below {end - stop.time:g} s",
            )  # fmt: skip


def _end_values(part: MachineSeries, place: int) -> FloatArray:
    """Accelerations at the beginning (0) or the end (-1) of a part of the motion, (n,)."""
    if not part.start.size:
        return np.full(len(part.machine.inertias), np.nan)
    rows = series(part.acceleration)[place]
    return np.asarray(np.polynomial.legendre.legval(1.0 if place else -1.0, rows))


def _braking(part: MachineSeries) -> dict[str, FloatArray]:
    """Heat, time and angle of sliding, and torque of each contact."""
    magnitude = np.where(part.slides[:, None], np.abs(part.torque), 0.0)
    time = np.sum(part.length[:, None] * part.slides, axis=0)
    impulse = part.integral(magnitude).sum(axis=0)
    slid = time > 0.0
    mean = np.divide(impulse, time, where=slid, out=np.full(time.shape, np.nan))
    return {
        "heat": part.integral(part.power).sum(axis=0),
        "sliding_time": time,
        "sliding_angle": part.integral(np.abs(part.sliding)).sum(axis=0),
        "mean_torque": mean,
        "peak_torque": np.where(slid, largest(series(magnitude)), np.nan),
    }


def _jerks(*parts: MachineSeries) -> dict[str, list[FloatArray]]:
    """Root mean square and peak of the jerk of each inertia, in each part of the motion."""
    rms, peak = [], []
    for part in parts:
        jerk = part.jerk()
        total = part.integral(jerk**2).sum(axis=0)
        rms.append(np.sqrt(total / part.length.sum()) if part.start.size else np.nan * total)
        peak.append(largest(series(jerk)))
    return {"rms_jerk": rms, "peak_jerk": peak}


class _Judder(NamedTuple):
    """Amplitudes and mean speeds in each window, and midpoints of the windows [s]."""

    speed: FloatArray
    torque: FloatArray
    mean_speed: FloatArray
    mean_sliding: FloatArray
    time: FloatArray


def _judder(part: MachineSeries, edges: FloatArray) -> _Judder:
    """Amplitudes of the deviations from a straight line fitted in each window."""
    middle, half = 0.5 * (edges[1:] + edges[:-1]), 0.5 * np.diff(edges)
    places = np.searchsorted(edges, part.start + 0.5 * part.length) - 1
    torque = np.where(part.slides[:, None], np.abs(part.torque), 0.0)
    values = np.concatenate([part.speed, torque, np.abs(part.sliding)], axis=2)
    u = ((part.times - middle[places, None]) / half[places, None])[..., None]

    def mean(quantity: FloatArray) -> FloatArray:
        total = np.zeros((middle.size, values.shape[2]))
        np.add.at(total, places, part.integral(quantity))
        return total / (2.0 * half[:, None])

    # Twice, as the mean of large values is subject to rounding.
    means = mean(values)
    values = values - means[places, None]
    values = values - mean(values)[places, None] - 3.0 * mean(values * u)[places, None] * u
    amplitude = np.sqrt(2.0 * mean(values**2))
    n, m = part.speed.shape[2], part.torque.shape[2]
    last = slice(n + m, n + 2 * m)
    return _Judder(amplitude[:, :n], amplitude[:, n : n + m], means[:, :n], means[:, last], middle)


def _dataset(machine: Machine, values: dict[str, Any], judder: _Judder) -> xr.Dataset:
    import xarray as xr

    found = xr.Dataset(
        {
            name: labelled(dims, np.asarray(values[name]), unit, meaning)
            for name, (dims, unit, meaning) in _SPEC.items()
        },
        coords={
            "inertia": [one.name for one in machine.inertias],
            "contact": [one.name for one in machine.contacts],
            "phase": list(PHASES),
        },
    )
    return found.assign_coords(
        mean_sliding=labelled(
            ("window", "contact"), judder.mean_sliding, "rad/s",
            "mean magnitude of the sliding speed in the window",
        ),
        mean_speed=labelled(
            ("window", "inertia"), judder.mean_speed, "rad/s", "mean speed in the window"
        ),
        window_time=labelled("window", judder.time, "s", "middle of the window"),
    )  # fmt: skip
