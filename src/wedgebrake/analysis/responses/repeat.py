"""The system of a response and its run, which measures repeat."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import numpy as np

from wedgebrake.arrays import FloatArray
from wedgebrake.errors import InputError
from wedgebrake.model.machine import Machine
from wedgebrake.model.studies.study import parse_study
from wedgebrake.model.studies.study_run import METHODS
from wedgebrake.solvers.interrupts import interruptible
from wedgebrake.solvers.layout import full
from wedgebrake.solvers.machine.final_state import FinalState
from wedgebrake.solvers.simulate import simulate

if TYPE_CHECKING:
    import xarray as xr

    from wedgebrake.model.system import BrakedDriveline
    from wedgebrake.solvers.machine.solve import MachineAnswer, MachineTask


def system_of(response: xr.Dataset) -> BrakedDriveline | Machine:
    """The system of a response, from its attributes.

    Raises ``InputError`` for other datasets, and for parts that have no name in study files.
    """
    full(response)
    try:
        return parse_study(dict(json.loads(response.attrs["system"]))).system
    except (KeyError, TypeError, ValueError):  # an InputError is a ValueError
        raise InputError(
            "response: attrs['system'] does not say what was simulated, or contains a part that has"
            " no name in study files. Use the result of wb.simulate(...); to draw a response with"
            " parts of your own, use"
            " wedgebrake.figures.matplotlib.motion.overview(system, response)."
        ) from None


def run_of(response: xr.Dataset) -> tuple[Machine, MachineTask]:
    """The machine of a response, and the task that led to it, without samples.

    For a response of ``wb.paper.ode14x``, which has no true sticks, it is the exact run.

    Raises ``InputError`` as ``system_of``.
    """
    from wedgebrake.solvers.machine.solve import MachineTask

    machine, attrs = system_of(response).machine, response.attrs
    options = json.loads(attrs.get("options", "{}"))
    initial = None
    if "initial_state" in attrs:
        initial = FinalState.from_json(attrs["initial_state"])
    elif "initial" in options:
        machine = machine.started_at(*options["initial"])
    start = float(options.get("start_time", attrs.get("start_time", 0.0)))
    task = MachineTask(
        start, float(attrs["final_time"]), np.empty(0), initial,
        until_rest=False, max_events=10**12,
        method="smooth" if attrs["method"] == "smooth" else "exact",
    )  # fmt: skip
    return machine, task


def solved(machine: Machine, task: MachineTask, **options: Any) -> MachineAnswer:
    """The answer of the solver of machines; Ctrl-C stops it."""
    from wedgebrake.solvers.machine.solve import solve_machine

    return interruptible(
        lambda: solve_machine(machine, task, **options), stop=lambda: task.stop.fill(True)
    )


def repeated(response: xr.Dataset, times: FloatArray) -> xr.Dataset:
    """The response at other times, with the dimensions of a machine; see ``run_of``.

    times : within the run [s]
    """
    task = run_of(response)[1]
    system, method = system_of(response), response.attrs["method"]
    options = json.loads(response.attrs.get("options", "{}"))
    limits = {name: options[name] for name in ("rtol", "max_steps") if name in options}
    state = options.get("initial")
    found = simulate(
        system, task.end - task.start, times=times, start_time=task.start, max_events=10**12,
        initial=task.initial if task.initial is not None or state is None else tuple(state),
        method=method if method in METHODS else None, **limits,
    )  # fmt: skip
    return full(found)


def complete(response: xr.Dataset) -> xr.Dataset:
    """A response with the dimensions of a machine and all variables.

    Drivelines of earlier versions have no actuation_force, for example: it is that of the repeated
    run.
    """
    found = full(response)
    if "actuation_force" in found:
        return found
    again = repeated(response, found["time"].to_numpy())
    return found.assign({name: one for name, one in again.items() if name not in found})
