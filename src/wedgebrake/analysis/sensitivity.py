"""Derivatives of a response with respect to parameters."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from functools import cache
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from wedgebrake.arrays import FloatArray
from wedgebrake.model.elements import elements
from wedgebrake.model.machine import Machine
from wedgebrake.model.part import SMALLEST
from wedgebrake.model.system import INITIAL, BrakedDriveline
from wedgebrake.model.validation import check_instance, unknown, wrong
from wedgebrake.solvers.interrupts import interruptible
from wedgebrake.solvers.layout import VARIABLES, full
from wedgebrake.solvers.response import shaft_torques
from wedgebrake.solvers.simulate import simulate

if TYPE_CHECKING:
    import xarray as xr

    from wedgebrake.solvers.machine.final_state import FinalState
    from wedgebrake.solvers.machine.tangents import TangentAnswer, TangentTask

# Times of an event in the two runs that differ by less, relative to their size, are the same.
_SAME = 1e-9
# Parameters without derivatives, and why.
_WITHOUT = {
    "sample_time": "the sampling times of the controller depend on it",
    "delay": "it is a whole number",
    "resolution": "the force is rounded to it",
}


def sensitivity(
    system: BrakedDriveline | Machine,
    parameters: Sequence[str],
    duration: float | None = None,
    *,
    periods: int | None = None,
    initial: tuple[float, float] | FinalState | None = None,
    start_time: float = 0.0,
    method: str | None = None,
    times: ArrayLike | None = None,
    samples: int | None = None,
    samples_per_period: int | None = None,
) -> xr.Dataset:
    """Derivatives of the response of ``simulate`` with respect to parameters.

    The derivatives are exact, without finite differences of the response. Between events they obey
    the linearised equations of motion, forced by the derivatives of the coefficients; at an event
    they jump (docs/numerics.md, "Derivatives with respect to parameters"). They are derivatives of
    the response at a fixed time; at the time of an event, those just after it.

    Parameters
    ----------
    system : BrakedDriveline or Machine
        The system.
    parameters : sequence of str
        Names of parameters of the system, as ``replace`` takes them: ``"slope"``, ``"alpha"``; of
        a machine ``"brake.kinetic"``, ``"disc.inertia"``, ``"disc.speed"`` (the initial speed),
        ``"engine.amplitude"``.
    duration, periods, initial, start_time, method, times, samples, samples_per_period
        As in ``simulate``. An initial state given here does not depend on the parameters.

    Returns
    -------
    xarray.Dataset
        The derivatives with the names, dimensions and units of the response, per unit of the
        parameter: over (``parameter``, ``time``, ...) ``angle``, ``velocity``, ``shaft_torque``,
        ``brake_torque`` and ``actuation_force``, and over (``parameter``, ``event``)
        ``event_time``. The derivative of a time that does not depend on the motion, such as the
        jump of a signal, is 0. If the motion only grazes the condition of an event, its time has no
        derivative and is nan; ``attrs["message"]`` says so, and the derivatives of the states after
        it are those for the order of events of this run, on one side.
        If a contact slips from the sliding speed 0 at the start, a parameter that changes this
        speed has one-sided derivatives: ``one_sided`` over (``parameter``) is 1 for those of larger
        values and -1 for those of smaller values, otherwise 0.

    Raises
    ------
    InputError
        For a parameter that does not exist or has no derivative, and as ``simulate``.
    """
    check_instance("system", system, BrakedDriveline | Machine, "a BrakedDriveline or a Machine")
    names = _checked(system, parameters)
    system = _varying(system, names)
    from wedgebrake.solvers.machine.tangents import differentiate

    run: dict[str, Any] = {
        "periods": periods, "initial": initial, "start_time": start_time, "method": method,
        "times": times, "samples": samples, "samples_per_period": samples_per_period,
    }  # fmt: skip
    response = simulate(system, duration, **run)
    task = _task(system, names, response, initial)
    return _dataset(system, task, response, interruptible(lambda: differentiate(task)))


def _checked(system: BrakedDriveline | Machine, parameters: Sequence[str]) -> tuple[str, ...]:
    """The names of the parameters."""
    allowed = 'a list of names, for example ["slope"]'
    if isinstance(parameters, str) or not isinstance(parameters, Sequence) or not parameters:
        raise wrong("parameters", parameters, allowed)
    names = set(system.names())
    known = [name for name in system.quantities() if name in names]
    known += system.initial_conditions
    for name in parameters:
        if name not in known:
            raise unknown("parameters", name, known, "no such parameter")
        why = _WITHOUT.get(name.rpartition(".")[2])
        if why:
            raise wrong("parameters", name, "a parameter with a derivative", f"{why.capitalize()}.")
    return tuple(parameters)


def _varying(system: BrakedDriveline | Machine, names: Sequence[str]) -> BrakedDriveline | Machine:
    """The system, with signals that begin to vary at the value 0 of a parameter, as an amplitude.

    Such a signal is constant at 0; at the smallest value its effect is below all rounding.
    """
    for name in names:
        if name not in INITIAL and system.value(name) == 0.0:
            near = system.replace(**{name: SMALLEST})
            count = [
                sum(one.varies for one in given.machine.signals().values())
                for given in (system, near)
            ]
            system = near if count[0] != count[1] else system
    return system


def _machine_at(
    system: BrakedDriveline | Machine, name: str, initial: Any
) -> Callable[[float], Machine]:
    """The machine as a function of a parameter."""

    @cache
    def machine_at(value: float) -> Machine:
        if name in INITIAL:
            start = dict(zip(INITIAL, initial or (0.0, 0.0), strict=True)) | {name: value}
            return system.machine.started_at(*start.values())
        machine = system.replace(**{name: value}).machine
        return machine.started_at(*initial) if isinstance(initial, tuple | list) else machine

    return machine_at


def _value(system: BrakedDriveline | Machine, name: str, initial: Any) -> float:
    """The value of a parameter, or of the initial state of a driveline."""
    if name in INITIAL:
        return float((initial or (0.0, 0.0))[list(INITIAL).index(name)])
    return system.value(name)


def _task(
    system: BrakedDriveline | Machine, names: Sequence[str], response: xr.Dataset, initial: Any
) -> TangentTask:
    """The run of a response, to be differentiated."""
    from wedgebrake.solvers.machine.final_state import FinalState
    from wedgebrake.solvers.machine.tangents import Parameter, TangentTask

    machine = system.machine
    if isinstance(initial, tuple | list):
        machine = machine.started_at(*initial)
    return TangentTask(
        machine,
        tuple(Parameter(name, _value(system, name, initial)) for name in names),
        tuple(_machine_at(system, name, initial) for name in names),
        (response.attrs["start_time"], response.attrs["final_time"]),
        response["time"].to_numpy(),
        response.attrs["method"],
        initial if isinstance(initial, FinalState) else None,
    )


def _dataset(
    system: BrakedDriveline | Machine,
    task: TangentTask,
    response: xr.Dataset,
    found: TangentAnswer,
) -> xr.Dataset:
    """The derivatives with the layout of the response."""
    import xarray as xr

    names = [one.name for one in task.parameters]
    given, n = full(response), len(system.machine.inertias)
    states = np.moveaxis(found.states, -1, 0)
    angle, velocity = states[..., :n], states[..., n : 2 * n]
    values = {
        "angle": angle,
        "velocity": velocity,
        "shaft_torque": _shaft_torques(task, given, (angle, velocity)),
        "brake_torque": 0.0 - np.moveaxis(found.torques, -1, 0),
        "actuation_force": np.moveaxis(found.forces, -1, 0),
        "event_time": _event_times(given["event_time"].to_numpy(), found, task.span[0]),
    }
    single, quantities = system.view.single, system.quantities()
    units = [quantities[name].unit for name in names]
    coordinates = {
        "parameter": ("parameter", list(names)), "parameter_unit": ("parameter", units),
        **{name: one for name, one in response.coords.items() if name != "period"},
    }  # fmt: skip
    variables = {}
    for name, value in values.items():
        dims, attrs = VARIABLES[name]
        if len(dims) > 1 and dims[1] in single:
            dims, value = dims[:1], value[..., 0]
        meaning = f"derivative of the {attrs['long_name']}"
        attrs = {"units": attrs["units"], "long_name": meaning}
        variables[name] = (("parameter", *dims), value, attrs)
    message = str(response.attrs["message"])
    if not np.all(np.isfinite(values["event_time"])):
        message += (
            " The motion grazes the condition of an event: its time has no derivative, and later"
            " derivatives are those for the order of events of this run."
        )
    sided = [name for name, side in zip(names, found.one_sided, strict=True) if side != 0.0]
    if sided:
        message += (
            " At the start a contact slips from the sliding speed 0: derivatives with respect to"
            f" {', '.join(sided)} are one-sided."
        )
    variables["one_sided"] = (
        ("parameter",), found.one_sided.astype(np.int8),
        {"units": "1", "long_name": "side of the derivative", "flag_values": [-1, 0, 1],
         "flag_meanings": "smaller_values both larger_values"},
    )  # fmt: skip
    kept = ("wedgebrake_version", "method", "system", "status", "start_time", "final_time")
    attributes = {name: response.attrs[name] for name in kept}
    values_now = {one.name: one.value for one in task.parameters}
    return xr.Dataset(
        variables, coordinates,
        attributes | {"message": message, "parameters": json.dumps(values_now)},
    )  # fmt: skip


def _event_times(times: FloatArray, found: TangentAnswer, start: float) -> FloatArray:
    """Derivatives of the times of events, (parameters, events)."""
    shifts = np.zeros((found.shifts.shape[1], times.size))
    if found.events.size:
        near = np.searchsorted(found.events, times)
        for place in (near - 1, near):
            place = np.clip(place, 0, found.events.size - 1)
            same = np.abs(found.events[place] - times) <= _SAME * (1.0 + np.abs(times))
            shifts[:, same] = found.shifts[place[same]].T
    shifts[:, times <= start] = 0.0  # what happens at the start happens there for all values
    return shifts


def _shaft_torques(
    task: TangentTask,
    response: xr.Dataset,
    states: tuple[FloatArray, FloatArray],
) -> FloatArray:
    """Derivatives of the torques of the shafts, (parameters, times, shafts)."""
    from wedgebrake.solvers.machine.tangents import difference_of

    now = response["angle"].to_numpy(), response["velocity"].to_numpy()
    machine, given = task.machine, elements(task.machine)
    still = np.zeros(len(machine.inertias))
    found = shaft_torques(machine, *states) - shaft_torques(machine, still, still)
    shafts = [one for one in given if one.kind == "shaft"]
    pieces = {one.number: one.pieces_at(*now) for one in shafts}
    for one in shafts:
        found[..., one.number] = one.change(pieces[one.number], *states)
    for total, parameter, machine_at in zip(found, task.parameters, task.machine_at, strict=True):

        def torques_at(value: float, at: Callable[[float], Machine] = machine_at) -> FloatArray:
            near = at(value)
            torques = shaft_torques(near, *now)
            for one in elements(near):
                if one.kind == "shaft":
                    torques[..., one.number] = one.torque(*now, pieces[one.number])
            return torques

        total += difference_of(parameter, torques_at)
    return found
