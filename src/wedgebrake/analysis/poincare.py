"""Poincare section: the state once in every period, or whenever a motion returns to a section."""

from __future__ import annotations

import inspect
import json
import math
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from wedgebrake._version import __version__
from wedgebrake.analysis.responses.datasets import labelled
from wedgebrake.analysis.run_settings import protocol, returns_of
from wedgebrake.errors import InputError, nearest
from wedgebrake.model.machine import Machine
from wedgebrake.model.signals.signals import check_repeat
from wedgebrake.model.system import BrakedDriveline
from wedgebrake.model.validation import check_instance, check_number, check_whole, unknown, wrong
from wedgebrake.solvers.interrupts import interruptible
from wedgebrake.solvers.kernels import method_of
from wedgebrake.solvers.layout import assembled, indexed
from wedgebrake.solvers.machine.final_state import FinalState
from wedgebrake.solvers.simulate import simulate

if TYPE_CHECKING:
    import xarray as xr

    from wedgebrake.analysis.machine_motion.crossings import Crossings

_MOST, _MOST_EVENTS = 5_000_000, 10_000_000
_PERIODS, _TRANSIENT = 250, 200
# Options of ``simulate`` that the section sets, and the arguments to use instead.
_DECIDED = {
    "duration": "periods",
    "times": "periods, transient and section_time",
    "samples_per_period": "section_time",
    "until": "periods or crossings",
}
# Those that a run to crossings accepts.
_OF_CROSSINGS = ("start_time", "max_events")


def poincare(
    system: BrakedDriveline | Machine,
    periods: int | None = None,
    *,
    crossings: int | None = None,
    section: str | None = None,
    transient: int = _TRANSIENT,
    section_time: float = 0.0,
    initial: tuple[float, float] | FinalState | None = None,
    method: str | None = None,
    **options: Any,
) -> xr.Dataset:
    """Return the states at which a motion returns to a section.

    Where signals vary, these are the states at t = section_time + n T for n = transient, ...,
    periods, where T is the period of the torque or the common period of all signals. The state
    is computed at these times, not interpolated from samples. The paper's own section,
    t = 20 s + n / f_e up to 25 s, is ``section_time=20.0, transient=0, periods=50`` (section 4.1;
    the phase of the section differs from that of n / f_e).

    Where no signal varies, there is no period: the states are those at the crossings number
    transient, ..., crossings of a section of the motion.

    Parameters
    ----------
    system : BrakedDriveline or Machine
        System to simulate.
    periods : int
        Number n of the last point, at least 0; default 250.
    crossings : int
        Of a self-excited system: number of the last crossing, counted from 1; default 250.
    section : str
        Of a self-excited system: the name of an inertia, whose speed crosses the middle of its
        range upwards, or of a contact, which begins to slide. By default the inertia whose speed
        has the largest range, weighted with the root of the inertia, as for ``motion``. The range
        is that of the motion shortly before the first point.
    transient : int
        Number of the first point, at least 0 and below the last.
    section_time : float
        Time of the point number 0 [s]; it sets the phase of the signals at the section.
    initial : (angle [rad], velocity [rad/s]), or FinalState
        State at ``start_time`` (an option of ``simulate``, default 0 s): by default rest of a
        driveline and the initial state of a machine.
    method, options
        As in ``simulate``: method, start_time, rtol, max_events, max_steps.

    Returns
    -------
    xarray.Dataset
        Over ``period`` (the numbers n, at most periods - transient + 1 of them) or
        ``crossing``, and of a machine over ``inertia``: angle [rad], velocity [rad/s], and ``time``
        [s] as a coordinate. ``attrs`` are those of the response, with transient, and
        section_time [s] and section_phase (share of a period), or section (the inertia or contact)
        and section_level (the speed of the inertia there [rad/s]). A run that ended early
        (``attrs["status"]``, ``attrs["message"]``), or a motion that does not return, gives the
        points that it reached, perhaps none.

    Notes
    -----
    A ``BrakedDriveline`` whose torque has amplitude 0 is sampled at n / f_e, unless crossings or a
    section are given.

    Raises
    ------
    InputError
        For invalid arguments, for periods of a system that has none and crossings of one that has
        periods, and as ``simulate``.
    """
    from wedgebrake.analysis.machine_motion.section import sampling

    check_instance("system", system, BrakedDriveline | Machine, "a BrakedDriveline or a Machine")
    _check_options(options)
    check_whole("transient", transient, 0, _MOST)
    if crossings is not None or section is not None or system.period == 0.0:
        returns_of(system.machine, periods, crossings)
        if system.machine.autonomous:
            return _crossings(
                system, crossings, section, transient, section_time, initial, method, options
            )
    if section is not None:
        raise wrong(
            "section", section, "None for a system with signals that vary",
            "Give section_time, which sets the phase at the section.",
        )  # fmt: skip
    last = _PERIODS if periods is None else periods
    check_whole("periods", last, 1, _MOST)
    protocol(last, transient)
    seconds = "a number of seconds in [0, 1e+12]"
    check_number("section_time", section_time, 0.0, 1e12, seconds)
    start_time = options.get("start_time", 0.0)
    if isinstance(initial, FinalState):
        start_time = initial.time
    check_number("start_time", start_time, 0.0, 1e12, seconds)

    numbers = np.arange(int(transient), int(last) + 1)
    check_repeat(system.signals())
    every = sampling(system.machine)
    period = system.period if every is None else every.period
    frequency = 1.0 / float(period or 1.0)
    times = section_time + numbers / frequency
    if times[0] < start_time:
        least = math.ceil((start_time - section_time) * frequency)
        raise InputError.of(
            "transient", transient, f"its point lies at {times[0]:g} s, before start_time ="
            f" {start_time:g} s. Use a transient of at least {least}.", allowed=f"at least {least}",
        )  # fmt: skip
    span: dict[str, Any] = {"duration": times[-1] - start_time}
    if system.period == period and section_time == 0.0 and start_time == 0.0:
        span = {"periods": int(last)}
    response = simulate(system, **span, initial=initial, method=method, times=times, **options)
    return _by_period(
        response, numbers[: response.sizes["time"]],
        {"section_time": float(section_time), "section_phase": section_time * frequency % 1.0,
         "transient": int(transient)},
    )  # fmt: skip


def _by_period(
    response: xr.Dataset, numbers: NDArray[np.int64], attrs: dict[str, Any]
) -> xr.Dataset:
    """Angle and velocity of a response at whole periods with these numbers."""
    import xarray as xr

    given, found = response.variables, {}
    for name in ("angle", "velocity", "time"):
        one = given[name]
        found[name] = xr.Variable(("period", *one.dims[1:]), one.to_numpy(), one.attrs)
    parts = [name for name in ("inertia",) if name in given]
    found |= {name: given[name].copy(deep=False) for name in parts}
    indexes: dict[str, Any] = {name: response.xindexes[name] for name in parts}
    words = {"units": "1", "long_name": "number of periods"}
    indexes["period"], found["period"] = indexed("period", numbers, words)
    return assembled(found, indexes, {**response.attrs, **attrs}, ("time",))


def _crossings(
    system: Any,
    crossings: int | None,
    section: str | None,
    transient: int,
    section_time: float,
    initial: Any,
    method: str | None,
    options: dict[str, Any],
) -> xr.Dataset:
    """The section of a self-excited motion."""
    from wedgebrake.analysis.machine_motion.crossings import (
        Start,
        contact_crossings,
        inertia_crossings,
    )

    last = _PERIODS if crossings is None else crossings
    check_whole("crossings", last, 1, _MOST)
    if transient >= last:
        raise wrong("transient", transient, f"below crossings = {last}")
    if section_time != 0.0:
        raise wrong(
            "section_time", section_time, "0 for a system without varying signals",
            "Give section, the name of an inertia or contact.",
        )  # fmt: skip
    for name in options:
        if name not in _OF_CROSSINGS:
            raise wrong(name, options[name], "left out for a system without varying signals")
    from wedgebrake.analysis.evaluate import begun_at

    machine, state = begun_at(system, initial)
    max_events = options.get("max_events", _MOST_EVENTS)
    check_whole("max_events", max_events, 1, 10**12)
    time = check_number("start_time", options.get("start_time", 0.0), -1e12, 1e12)
    start = Start(state, time, method_of(system, method), max_events)
    inertias, contacts = ([one.name for one in parts] for parts in
                          (machine.inertias, machine.contacts))  # fmt: skip
    if section is not None and section not in (*inertias, *contacts):
        raise unknown("section", section, [*inertias, *contacts], "no such inertia or contact")
    first = max(int(transient), 1)
    if section in contacts:
        found = interruptible(
            lambda: contact_crossings(machine, str(section), first, int(last), start)
        )
    else:
        found = interruptible(lambda: inertia_crossings(machine, section, first, int(last), start))
    dataset = _dataset(machine, found, int(last) - first + 1, start.method)
    dataset.attrs |= {"start_time": time if state is None else state.time, "transient": transient}
    dataset.attrs["system"] = json.dumps(system.as_dict())
    if system.groups is not None:
        dataset.attrs["groups"] = json.dumps(system.groups.as_dict())
    left_out = {dim: 0 for dim in system.view.single if dim in dataset.dims}
    return dataset.isel(left_out, drop=True)


def _dataset(machine: Machine, found: Crossings, wanted: int, method: str) -> xr.Dataset:
    """Crossings as a labelled dataset."""
    import xarray as xr

    from wedgebrake.solvers.status import Status

    n, over = len(machine.inertias), ("crossing", "inertia")
    message = f"The motion crossed the section {found.times.size} of {wanted} times"
    slips = math.isnan(found.level)
    return xr.Dataset(
        {
            "angle": labelled(over, found.states[:, :n], "rad", "angle"),
            "velocity": labelled(over, found.states[:, n : 2 * n], "rad/s", "speed"),
        },
        coords={
            "crossing": labelled("crossing", found.numbers, "1", "number of crossings"),
            "time": labelled("crossing", found.times, "s", "time"),
            "inertia": [one.name for one in machine.inertias],
        },
        attrs={
            "wedgebrake_version": __version__,
            "method": method,
            "status": Status.of(found.outcome).value,
            "message": f"{message}.",
            "final_time": found.final.time,
            "final_state": found.final.to_json(),
            "section": found.section,
            **({} if slips else {"section_level": found.level}),
        },
    )  # fmt: skip


def _check_options(options: dict[str, Any]) -> None:
    for name in options:
        if name in _DECIDED:
            raise InputError.of(
                name, options[name], f"the section sets it. Use {_DECIDED[name]}.",
                allowed="left out",
            )  # fmt: skip
        allowed = set(inspect.signature(simulate).parameters) - set(_DECIDED) - {"system"}
        if name not in allowed:
            raise InputError(f"{name}: no such option. {nearest(name, allowed)}")
