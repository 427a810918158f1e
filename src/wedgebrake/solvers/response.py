"""The response: a labelled dataset, units in its attributes."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from wedgebrake._version import __version__
from wedgebrake.model.controller import TORQUE
from wedgebrake.model.elements import element_loads, elements
from wedgebrake.model.joints import joint_rows, joint_torques
from wedgebrake.model.machine import Machine
from wedgebrake.model.machine_matrices import contact_rows, shaft_rows, stiffnesses
from wedgebrake.model.machine_parts import GROUND
from wedgebrake.model.signals.signal_tangents import rate_of
from wedgebrake.model.signals.signals import as_signal
from wedgebrake.model.torque_contacts import TorqueContact
from wedgebrake.solvers.layout import shown
from wedgebrake.solvers.solution import Task, Trajectory

if TYPE_CHECKING:
    import xarray as xr

    from wedgebrake.arrays import FloatArray
    from wedgebrake.model.system import BrakedDriveline


def assemble(system: BrakedDriveline | Machine, task: Task, answer: Trajectory) -> xr.Dataset:
    """The answer of a kernel as the system shows it, see ``layout.VARIABLES``."""
    machine = system.machine
    speed, times, events, sticks = answer.velocity, answer.times, answer.events, answer.sticks
    sliding = sliding_speeds(machine, speed, times)
    if not answer.creeps:
        sliding = np.where(answer.sticking, 0.0, sliding)
    values: dict[str, Any] = {
        "time": times,
        "inertia": [one.name for one in machine.inertias],
        "shaft": [one.name for one in machine.shafts],
        "contact": [one.name for one in machine.contacts],
        "angle": answer.angle,
        "velocity": speed,
        "torque": external_torques(machine, times, answer.angle, speed, answer.control),
        "shaft_torque": shaft_torques(machine, answer.angle, speed),
        "brake_torque": answer.brake_torque,
        "actuation_force": np.where(without_force(machine), np.nan, answer.force),
        "sliding_velocity": sliding,
        "sticking": answer.sticking.astype(np.int8),
        **{f"event_{name}": one for name, one in vars(events).items() if one is not None},
        **{f"stick_{name}": one for name, one in vars(sticks).items()},
    }
    unreduced = system.unreduced
    if unreduced.joints:
        values |= {
            "joint": [one.name for one in unreduced.joints],
            "joint_torque": torques_of_joints(unreduced, values),
        }
    if answer.control is not None:
        values |= {
            "controller": [one.name for one in machine.controllers],
            "control_output": answer.control,
            "control_integral": answer.integral,
        }
    if unreduced.driven:
        torque = drive_torques(unreduced, values)
        values |= {
            "driven": [one.name for one in machine.driven],
            "driven_torque": torque,
            "driven_power": torque * speed[:, -len(machine.driven) :],
        }
    if answer.at_events is not None:
        values["event_angle"], values["event_velocity"] = (
            answer.at_events.angle, answer.at_events.velocity,
        )  # fmt: skip
    if answer.at_periods is not None:
        values["period"] = answer.periods
        values |= {f"poincare_{name}": one for name, one in vars(answer.at_periods).items()}
    return shown(values, system.view, _attributes(system, task, answer))


def without_force(machine: Machine) -> NDArray[np.bool_]:
    """Whether each contact has no actuation force: (contacts,)."""
    return np.array([isinstance(one, TorqueContact) for one in machine.contacts], bool)


def _attributes(
    system: BrakedDriveline | Machine, task: Task, answer: Trajectory
) -> dict[str, Any]:
    """What was computed, and how the run ended."""
    final = answer.final
    found: dict[str, Any] = {
        "wedgebrake_version": __version__,
        "method": task.method,
        "system": json.dumps(system.as_dict()),
        "status": answer.status.value,
        "message": answer.message + task.note,
        "start_time": task.span[0],
        "final_time": final.time,
        "final_state": final.to_json(),
        "at_rest": int(answer.at_rest),
        "work": answer.work,
    }
    groups = system.groups
    if groups is not None:
        found["groups"] = json.dumps(groups.as_dict())
    if system.view.single:  # of one part
        (angle,), (speed,) = final.angles.values(), final.speeds.values()
        options = {"initial": task.state, "start_time": task.span[0], **task.limits}
        found |= {
            "options": json.dumps(options), "final_angle": angle, "final_velocity": speed,
        }  # fmt: skip
    if task.initial is not None and not isinstance(task.initial, tuple):
        found["initial_state"] = task.initial.to_json()
    return found


def shaft_torques(machine: Machine, angle: FloatArray, speed: FloatArray) -> FloatArray:
    """Torque of each shaft against its end a, from angles and speeds (..., inertias) [N m]."""
    twist = shaft_rows(machine).T
    damping = np.array([one.damping for one in machine.shafts])
    preload = np.array([one.preload for one in machine.shafts])
    found = np.asarray(angle @ twist * stiffnesses(machine) + speed @ twist * damping)
    if np.any(preload):
        found -= preload
    for one in elements(machine):
        if one.kind == "shaft":
            found[..., one.number] = one.torque(angle, speed)
    return found


def drive_torques(machine: Machine, values: dict[str, Any]) -> FloatArray:
    """Torque of the drive of each driven body (..., driven) [N m], from values of a response."""
    count = len(machine.driven)
    found = values["shaft_torque"] @ shaft_rows(machine)
    found += values["brake_torque"] @ contact_rows(machine)
    if machine.joints:
        found += values["joint_torque"] @ joint_rows(machine)
    loads = element_loads(machine, "torque", values["time"], values["angle"], values["velocity"])
    return np.asarray((found - loads)[..., -count:])


def torques_of_joints(machine: Machine, values: dict[str, Any]) -> FloatArray:
    """Torque of each joint against its first body (time, joints) [N m], from values of a response.

    They give the bodies, under all other torques, the accelerations that the joints require.
    """
    load = values["torque"] - values["shaft_torque"] @ shaft_rows(machine)
    load -= values["brake_torque"] @ contact_rows(machine.machine)
    return joint_torques(machine, load, driven_accelerations(machine, values["time"]))


def driven_accelerations(machine: Machine, times: FloatArray) -> FloatArray:
    """Accelerations of the driven bodies, 0 of the others, at times (...): (..., n) [rad/s^2]."""
    bodies = len(machine.inertias)
    found = np.zeros((*np.shape(times), bodies))
    for number, body in enumerate(machine.driven, bodies - len(machine.driven)):
        found[..., number] = rate_of(as_signal(body.speed).primitive())(times)
    return found


def external_torques(
    machine: Machine, times: FloatArray, angle: FloatArray, speed: FloatArray,
    control: FloatArray | None = None,
) -> FloatArray:  # fmt: skip
    """Sum of the torques on each inertia (..., inertias) [N m].

    times        : (...)
    angle, speed : (..., inertias), for the torques over the state
    control      : (..., controllers) outputs of controllers; None without controllers
    """
    found = element_loads(machine, "torque", times, angle, speed)
    for one in machine.torques:
        if one.over_time is not None:
            found[..., machine.index(one.on)] += one.over_time(times)
    for number, loop in enumerate(machine.controllers):
        part, what = loop.acts_on
        if what == TORQUE and control is not None:
            found[..., machine.index(part)] += control[..., number]
    return found


def sliding_speeds(machine: Machine, speed: FloatArray, times: FloatArray) -> FloatArray:
    """Sliding speed of each contact, from speeds (..., inertias) at times (...) [rad/s]."""
    found = speed @ contact_rows(machine).T
    for j, contact in enumerate(machine.contacts):
        if contact.b == GROUND:
            found[..., j] -= as_signal(contact.base_speed)(times)
    return np.asarray(found)
