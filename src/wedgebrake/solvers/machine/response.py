"""The response of a machine as a labelled dataset."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from wedgebrake._version import __version__
from wedgebrake.dynamics.enums import Outcome
from wedgebrake.model.machine import Machine
from wedgebrake.model.machine_matrices import contact_rows, shaft_rows
from wedgebrake.model.machine_parts import GROUND
from wedgebrake.model.signals.signals import as_signal
from wedgebrake.solvers.machine.shares import least_shares
from wedgebrake.solvers.machine.solve import MachineAnswer, MachineTask
from wedgebrake.solvers.machine.sticks import stick_rows
from wedgebrake.solvers.solution import FLAGS
from wedgebrake.solvers.status import Status

if TYPE_CHECKING:
    import xarray as xr

_Array = NDArray[np.float64]
_Table = dict[str, tuple[Any, Any, str, str]]

# Columns of events and sticks: type, unit and meaning.
_EVENTS = {
    "time": ("f8", "s", "time of the event"),
    "contact": ("i8", "1", "number of the contact"),
    "kind": ("i1", "1", "kind of the event"),
    "before": ("i1", "1", "sign of the sliding speed before"),
    "after": ("i1", "1", "sign of the sliding speed after"),
}
_STICKS = {
    "start": ("f8", "s", "beginning of rest"),
    "end": ("f8", "s", "end of rest"),
    "contact": ("i8", "1", "number of the contact"),
    "entry": ("i1", "1", "sign of the sliding speed before; 0: at rest from the start"),
    "exit": ("i1", "1", "sign of the sliding speed after; 0: still at rest at the end"),
}


def dataset(machine: Machine, task: MachineTask, answer: MachineAnswer) -> xr.Dataset:
    """The solver's answer as a dataset over time, inertia, shaft, contact, event and stick."""
    import xarray as xr

    reached = int(answer.observer.at[0])
    times = answer.observer.times[:reached]
    table: _Table = {
        **_motion(machine, answer, times),
        **_columns("event", answer.events, _EVENTS),
        **_columns("stick", stick_rows(answer), _STICKS),
    }
    labels = {
        "time": ("time", times, {"units": "s", "long_name": "time"}),
        "inertia": [one.name for one in machine.inertias],
        "shaft": np.array([one.name for one in machine.shafts], str),
        "contact": np.array([one.name for one in machine.contacts], str),
    }
    found = xr.Dataset(
        {
            name: (dims, values, {"units": unit, "long_name": meaning, **FLAGS.get(name, {})})
            for name, (dims, values, unit, meaning) in table.items()
        },
        coords=labels,
    )
    status = Status.of(answer.outcome)
    found.attrs = {
        "wedgebrake_version": __version__,
        "method": task.method,
        "system": json.dumps(machine.as_dict()),
        "status": status.value,
        "message": message_of(task, answer),
        "start_time": task.start,
        "final_time": answer.final.time,
        "final_state": answer.final.to_json(),
        "at_rest": int(answer.at_rest),
        "work": answer.cells,
    }
    if task.initial is not None:
        found.attrs["initial_state"] = task.initial.to_json()
    return found


def _motion(machine: Machine, answer: MachineAnswer, times: _Array) -> _Table:
    """Variables over time."""
    observer, n, reached = answer.observer, len(machine.inertias), times.size
    angle, speed = observer.states[:reached, :n], observer.states[:reached, n : 2 * n]
    sticking = observer.side[:reached] == 0
    force = observer.force[:reached]
    held = least_shares(machine, observer.torque[:reached], force, sticking)
    sliding = np.where(sticking, 0.0, sliding_speeds(machine, speed, times))
    shaft_torque = shaft_torques(machine, angle, speed)
    by_inertia, by_contact = ("time", "inertia"), ("time", "contact")
    return {
        "angle": (by_inertia, angle, "rad", "angle"),
        "velocity": (by_inertia, speed, "rad/s", "speed"),
        "torque": (by_inertia, external_torques(machine, times), "N m", "external torque"),
        "shaft_torque": (("time", "shaft"), shaft_torque, "N m", "torque of the shaft against a"),
        "brake_torque": (
            by_contact, 0.0 - held, "N m", "torque of the contact against a",
        ),
        "actuation_force": (by_contact, force, "N", "actuation force"),
        "sliding_velocity": (by_contact, sliding, "rad/s", "sliding speed"),
        "sticking": (by_contact, sticking.astype(np.int8), "1", "at rest"),
    }  # fmt: skip


def shaft_torques(machine: Machine, angle: _Array, speed: _Array) -> _Array:
    """Torque of each shaft against its end a, from angles and speeds (..., inertias) [N m]."""
    twist = shaft_rows(machine).T
    stiffness, damping = (
        np.array([getattr(one, name) for one in machine.shafts])
        for name in ("stiffness", "damping")
    )
    return np.asarray(angle @ twist * stiffness + speed @ twist * damping)


def external_torques(machine: Machine, times: _Array) -> _Array:
    """Sum of the torques on each inertia at times (...): (..., inertias) [N m]."""
    found = np.zeros((*times.shape, len(machine.inertias)))
    for one in machine.torques:
        found[..., machine.index(one.on)] += one.signal(times)
    return found


def sliding_speeds(machine: Machine, speed: _Array, times: _Array) -> _Array:
    """Sliding speed of each contact, from speeds (..., inertias) at times (...) [rad/s]."""
    found = speed @ contact_rows(machine).T
    for j, contact in enumerate(machine.contacts):
        if contact.b == GROUND:
            found[..., j] -= as_signal(contact.base_speed)(times)
    return np.asarray(found)


def _columns(dim: str, rows: NDArray[Any], spec: dict[str, tuple[str, str, str]]) -> _Table:
    """Variables over events or sticks, from their rows."""
    return {
        f"{dim}_{name}": (dim, rows[name].astype(kind), unit, meaning)
        for name, (kind, unit, meaning) in spec.items()
    }


def message_of(task: MachineTask, answer: MachineAnswer) -> str:
    """How the run ended, in a sentence or two."""
    status = Status.of(answer.outcome)
    end = f"t = {answer.final.time:.6g} s"
    if answer.at_rest:
        rest = max(stick_rows(answer)["start"], default=answer.start)
        return (
            f"All contacts are at rest from t = {rest:.6g} s on and stay so, which is proved at"
            f" {end}. Inertias may still swing."
        )
    if answer.outcome == Outcome.COMPLETED and task.until_rest:
        duration = f"{task.end - task.start:g} s"
        if any(side != 0 for side, *_ in answer.final.modes):
            return (
                f"Rest was not reached within the duration of {duration}: a contact still slides."
                " Give a longer duration."
            )
        return (
            f"All contacts are at rest after the duration of {duration}, but it is not proved that"
            " none will slip again. The proof requires that no base moves, and that all signals"
            " become constant or sums of sines, which the contacts can hold. Give a longer duration"
            " if signals still change or vibration still decays."
        )
    if answer.outcome == Outcome.COMPLETED:
        return status.sentence
    several = ""
    if answer.outcome == Outcome.NO_FORWARD_SOLUTION and answer.sides.size > 1:
        several = (
            " If no brake can lock itself, the solver found no consistent set of sticks and slips"
            " of the contacts at this instant."
        )
    return f"{status.sentence} Stopped at {end}.{several}"
