"""Derivatives of a response with respect to parameters."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from wedgebrake.analysis.derivatives.task import checked_names, tangent_task, varying
from wedgebrake.arrays import FloatArray
from wedgebrake.errors import InputError
from wedgebrake.model.machine import Machine
from wedgebrake.model.system import BrakedDriveline
from wedgebrake.model.validation import check_instance, wrong
from wedgebrake.solvers.layout import VARIABLES, full
from wedgebrake.solvers.simulate import simulate

if TYPE_CHECKING:
    import xarray as xr

    from wedgebrake.analysis.derivatives.coincidences import OneSided
    from wedgebrake.analysis.derivatives.varied_response import VariedResponse
    from wedgebrake.solvers.machine.final_state import FinalState
    from wedgebrake.solvers.machine.tangents import TangentAnswer

# Attributes of the response that the result has too.
_KEPT = ("wedgebrake_version", "method", "system", "status", "start_time", "final_time")


def sensitivity(
    system: BrakedDriveline | Machine,
    parameters: Sequence[str],
    duration: float | None = None,
    *,
    of: Sequence[str] | None = None,
    periods: int | None = None,
    initial: tuple[float, float] | FinalState | None = None,
    start_time: float = 0.0,
    method: str | None = None,
    times: ArrayLike | None = None,
    samples: int | None = None,
    samples_per_period: int | None = None,
    side: int = 1,
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
    of : sequence of str
        Measures of the whole run to differentiate, instead of the response over time: over
        ``contact`` friction_heat, base_work [J], friction_power [W], peak_torque, rms_torque [N m];
        over ``shaft`` viscous_loss, over ``torque`` torque_work, over ``controller`` control_work
        and over ``driven`` drive_work [J]; over ``inertia`` lowest_velocity, highest_velocity,
        velocity_amplitude, rms_velocity [rad/s], angle_amplitude [rad], peak_acceleration,
        rms_acceleration [rad/s^2]. Their names are those of ``energy`` and of sweeps. Amplitudes
        are half the range; rms_torque and rms_velocity are about the mean.
    duration, periods, initial, start_time, method, times, samples, samples_per_period
        As in ``simulate``. An initial state given here does not depend on the parameters.
    side : int
        Side whose derivatives are returned if those on the two sides of the value of a parameter
        differ: 1 for larger values, -1 for smaller values.

    Returns
    -------
    xarray.Dataset
        The derivatives with the names, dimensions and units of the response, per unit of the
        parameter: over (``parameter``, ``time``, ...) ``angle``, ``velocity``, ``shaft_torque``,
        ``brake_torque``, ``actuation_force`` and, of a machine with controllers,
        ``control_output``, and over (``parameter``, ``event``) ``event_time``. The derivative of a
        time that does not depend on the motion, such as the jump of a signal, is 0. If the motion
        only grazes the condition of an event, its time has no derivative and is nan;
        ``attrs["message"]`` says so, and the derivatives of the states after it are those for the
        order of events of this run, on one side.
        If an event coincides with another event, a sampling or a knot of a signal, and their order
        changes with a parameter, ``attrs["message"]`` says so too. The derivatives with respect to
        this parameter may then differ on the two sides of its value (``side``). The same applies
        where a force is at one of its limits, such as that of a brake whose force is 0, and where
        the parameter moves a knot of a signal that is at a sampling. They may also
        differ if a contact slips from the sliding speed 0 at the start and the parameter changes
        this speed, or if the lines of friction change at the value, for example where a release
        speed is that of a point of a friction table: there is then only one side.
        ``one_sided`` over (``parameter``) is 1 if the derivatives hold for larger values only, -1
        if for smaller values only, and 0 otherwise.

        With ``of``, over (``parameter``, ...), the derivatives of the measures, and as
        ``<name>_value`` the measures themselves. The run begins and ends at fixed times. A
        derivative is nan if two extremes are equal and change differently, if a root mean square is
        0, if the time of a jump has no derivative, or if the measure jumps at the value of the
        parameter; ``attrs["message"]`` names these measures. If a contact is at rest at the start
        and the parameter changes its sliding speed, derivatives are those on one side (``side``).

    Raises
    ------
    InputError
        For a parameter that does not exist or has no derivative, and as ``simulate``.
    """
    check_instance("system", system, BrakedDriveline | Machine, "a BrakedDriveline or a Machine")
    names = checked_names(system, parameters, system.initial_conditions)
    if isinstance(side, bool) or side not in (1, -1):
        raise wrong("side", side, "1 or -1")
    system = varying(system, names)
    run: dict[str, Any] = {
        "periods": periods, "initial": initial, "start_time": start_time, "method": method,
        "times": times, "samples": samples, "samples_per_period": samples_per_period,
    }  # fmt: skip
    if of is not None:
        return _of_run(system, names, of, duration, run, side)
    from wedgebrake.analysis.derivatives.coincidences import differentiated
    from wedgebrake.analysis.derivatives.moved_samples import beside_samples
    from wedgebrake.analysis.derivatives.varied_response import VariedResponse

    response = simulate(system, duration, **run)
    task = tangent_task(
        system, names, _span(response), response.attrs["method"], initial,
        response["time"].to_numpy(),
    )  # fmt: skip
    task, moved = beside_samples(task, side)
    found, sides = differentiated(task, side)
    sides = moved.joined(sides)
    varied = VariedResponse(task._replace(parameters=found.parameters), found)
    return _dataset(system, response, varied, sides)


def _of_run(
    system: BrakedDriveline | Machine, names: Sequence[str], of: Any, duration: Any,
    run: dict[str, Any], side: int,
) -> xr.Dataset:  # fmt: skip
    """The derivatives of measures of a run."""
    from wedgebrake.analysis.derivatives.measures import MEASURES, checked_measures
    from wedgebrake.analysis.derivatives.measures_beside import measures_beside
    from wedgebrake.analysis.derivatives.moved_samples import beside_samples
    from wedgebrake.analysis.derivatives.results import of_measures, one_sided, values_of
    from wedgebrake.analysis.derivatives.varied_motion import run_motion, varied_motion

    wanted = checked_measures(of)
    for name in ("times", "samples", "samples_per_period"):
        if run[name] is not None:
            raise wrong(
                name, run[name], "None with of=[...]",
                "Measures describe the motion at all times, not at samples.",
            )  # fmt: skip
    response = simulate(system, duration, **run)
    start, end = _span(response)
    if end <= start:
        raise InputError(
            f"duration = {duration}: must be that of a run that does not end at its start, because"
            f" measures describe a span of time. {response.attrs['message']}",
            name="duration", value=duration, allowed="that of a run that does not end at its start",
        )  # fmt: skip
    task = tangent_task(system, names, (start, end), response.attrs["method"], run["initial"])
    # A sample at the end has no part in measures.
    task, moved = beside_samples(task, 1)
    varied = varied_motion(task, run_motion(task), side=side)
    found = {name: MEASURES[name].of(varied) for name in wanted}
    varied = measures_beside(varied, task, found, side)
    sides = moved.joined(varied.sides)
    dataset, note = of_measures(system, task.parameters, found)
    variables = {"one_sided": one_sided(sides.one_sided)}
    note = sides.note + note
    kept = {name: response.attrs[name] for name in _KEPT}
    return dataset.assign(variables).assign_attrs(
        **kept, message=str(response.attrs["message"]) + note, parameters=values_of(task.parameters)
    )


def _span(response: xr.Dataset) -> tuple[float, float]:
    return response.attrs["start_time"], response.attrs["final_time"]


def _dataset(
    system: BrakedDriveline | Machine, response: xr.Dataset, varied: VariedResponse, sides: OneSided
) -> xr.Dataset:
    """The derivatives with the layout of the response."""
    import xarray as xr

    from wedgebrake.analysis.derivatives.results import one_sided, over_parameters, values_of
    from wedgebrake.analysis.derivatives.varied_response import VARIED

    task, found, single = varied.task, varied.found, system.view.single
    values = {name: varied.changes(name) for name in VARIED}
    times = full(response)["event_time"].to_numpy()
    values["event_time"] = _event_times(times, found, sides, task.span[0])
    coordinates = over_parameters(system, task.parameters) | {
        name: one for name, one in response.coords.items() if name != "period"
    }
    if not system.machine.controllers:
        del values["control_output"]
    variables: dict[str, Any] = {}
    for name, value in values.items():
        dims, attrs = VARIABLES[name]
        if len(dims) > 1 and dims[1] in single:
            dims, value = dims[:1], value[..., 0]
        meaning = f"derivative of the {attrs['long_name']}"
        attrs = {"units": attrs["units"], "long_name": meaning}
        variables[name] = (("parameter", *dims), value, attrs)
    message = str(response.attrs["message"])
    if not np.all(np.isfinite(found.shifts)):
        message += (
            " The motion grazes the condition of an event: its time has no derivative, and later"
            " derivatives are those for the order of events of this run."
        )
    variables["one_sided"] = one_sided(sides.one_sided)
    message += sides.note
    attributes = {name: response.attrs[name] for name in _KEPT}
    further = {"message": message, "parameters": values_of(task.parameters)}
    return xr.Dataset(variables, coordinates, attributes | further)


def _event_times(
    times: FloatArray, found: TangentAnswer, sides: OneSided, start: float
) -> FloatArray:
    """Derivatives of the times of events, (parameters, events)."""
    from wedgebrake.analysis.derivatives.coincidences import matching

    place, same = matching(found.events, times)
    shifts = np.zeros((found.shifts.shape[1], times.size))
    shifts[:, same] = found.shifts[place[same]].T
    sides.set_shifts(times, shifts)
    shifts[:, times <= start] = 0.0  # what happens at the start happens there for all values
    return shifts
