"""The energy balance of a machine."""

from __future__ import annotations

import dataclasses
from typing import TYPE_CHECKING, Any

import numpy as np

from wedgebrake.analysis.responses.datasets import labelled
from wedgebrake.analysis.responses.repeat import run_of, solved
from wedgebrake.arrays import FloatArray
from wedgebrake.model.elements import elements
from wedgebrake.model.machine import Machine
from wedgebrake.model.machine_matrices import masses, natural_frequencies, shaft_rows, stiffnesses
from wedgebrake.model.machine_parts import speed_at
from wedgebrake.solvers.layout import full
from wedgebrake.solvers.machine.final_state import FinalState
from wedgebrake.solvers.machine.rotations import largest_angles

if TYPE_CHECKING:
    import xarray as xr

# Relative rounding of an angle.
_HALF_A_BIT = 2.0**-53
# Share of the energy exchanged beyond which rounding is told.
_NOTABLE = 1e-6
_PARTS = {
    "friction_heat": ("contact", "heat of the contact"),
    "base_work": ("contact", "work of the moving base against the contact"),
    "viscous_loss": ("shaft", "heat of the viscous damping"),
    "torque_work": ("torque", "work of the torque"),
    "control_work": ("controller", "work of the torque of the controller"),
    "drive_work": ("driven", "work of the driven body, without that of a contact"),
}


def energy_of_parts(response: xr.Dataset, start: float | None = None) -> xr.Dataset:
    """Work and heat of every part of a machine, from a time on [s]; None: over a whole response.

    The run is repeated, and every power is integrated over each cell of its Taylor series, so that
    the residual is rounding error. The angles are rounded too: a shaft's torque has the error
    stiffness x 2^-53 x angle, whose work grows with the speed of the inertias (of a rotation that
    twists no shaft, angles up to 500 rad count). ``rounding`` is the
    expected size of this work; it matters for very stiff shafts that have turned far.

    Returns
    -------
    xarray.Dataset
        friction_heat, base_work over ``contact``, viscous_loss over ``shaft``, torque_work over
        ``torque``; with controllers control_work over ``controller``, 0 for those that act on the
        command of a brake; with driven bodies drive_work over ``driven``, without what they
        give to contacts, which is their base_work; stored_change, the gain of kinetic and elastic
        energy, residual = sum(torque_work) + sum(control_work) + sum(base_work) + sum(drive_work)
        - sum(friction_heat) - sum(viscous_loss) - stored_change,
        and rounding, the residual to be expected from the rounding of the angles, all in J.
        ``attrs``: start, stop [s]; note, a sentence where rounding is more than a millionth of the
        energy exchanged, otherwise empty.
    """
    import xarray as xr

    response = full(response)
    machine, task = run_of(response)
    if start is not None:
        initial = solved(machine, dataclasses.replace(task, end=start)).final
        task = dataclasses.replace(task, start=start, initial=initial)
    answer = solved(machine, task, powers=True)
    contacts, shafts, torques, loops = (
        len(one) for one in (machine.contacts, machine.shafts, machine.torques, machine.controllers)
    )
    bounds = np.cumsum([contacts, contacts, shafts, torques, loops])
    works = dict(zip(_PARTS, np.split(answer.observer.work, bounds), strict=True))
    if machine.driven:
        each_element = works["drive_work"].reshape(-1, len(machine.driven))
        works["drive_work"] = each_element.sum(axis=0)
    else:
        del works["drive_work"]
    if not machine.controllers:
        del works["control_work"]
    parts = {name: one for name, one in _PARTS.items() if name in works}
    change = _stored(machine, answer.final) - _stored(machine, task.initial)
    gained = works["torque_work"].sum() + works["base_work"].sum()
    gained += sum(works[name].sum() for name in ("drive_work", "control_work") if name in works)
    lost = works["friction_heat"].sum() + works["viscous_loss"].sum()
    each = _rounding(machine, response)
    rounding = float(np.sqrt(np.sum(each**2)))
    table = {
        **{name: labelled(dim, works[name], "J", text) for name, (dim, text) in parts.items()},
        "stored_change": labelled((), change, "J", "gain of kinetic and elastic energy"),
        "residual": labelled((), gained - lost - change, "J", "error of the balance"),
        "rounding": labelled((), rounding, "J", "expected error by the rounding of angles"),
    }
    named: dict[str, Any] = {
        "contact": machine.contacts, "shaft": machine.shafts, "torque": machine.torques,
    }  # fmt: skip
    if machine.driven:
        named["driven"] = machine.driven
    if machine.controllers:
        named["controller"] = machine.controllers
    found = xr.Dataset(
        table,
        coords={name: np.array([one.name for one in parts], str) for name, parts in named.items()},
    )
    exchanged = sum(float(np.abs(one).sum()) for one in works.values()) + abs(change)
    note = ""
    if rounding > _NOTABLE * exchanged:
        name = machine.shafts[int(each.argmax())].name
        note = (
            f"The rounding of angles leaves about {rounding:.1g} J in the balance, most of it at"
            f" {name}, which is stiff for angles as large as here. Start from angles near 0, give"
            f" {name} a lower stiffness, or make one inertia of those that it joins."
        )
    found.attrs = {"start": task.start, "stop": answer.final.time, "note": note}
    return found


def _rounding(machine: Machine, response: xr.Dataset) -> FloatArray:
    """Expected work of the rounding of the angles, through each shaft [J].

    The error of a shaft's torque is random in each step of the solver, which is about as long as
    the fastest vibration takes to turn by one radian, and constant during the step.
    """
    if not machine.shafts or not response["time"].size:
        return np.zeros(len(machine.shafts))
    ends = np.abs(shaft_rows(machine))
    largest = [np.abs(response[name].to_numpy()).max(axis=0) for name in ("angle", "velocity")]
    angles, speeds = ends @ largest_angles(machine, largest[0]), ends @ largest[1]
    stiffness = stiffnesses(machine)
    duration = float(response["time"][-1] - response["time"][0])
    fastest = natural_frequencies(machine).max(initial=0.0)
    step = duration / max(1.0, duration * fastest)
    return np.asarray(_HALF_A_BIT * stiffness * angles * speeds * np.sqrt(duration * step))


def _stored(machine: Machine, state: FinalState | None) -> float:
    """Kinetic and elastic energy of a state; None: the initial state of the machine."""
    angle = np.array([one.angle for one in machine.inertias])
    speed = np.array([speed_at(one, 0.0) for one in machine.inertias])
    if state is not None:
        angle, speed = np.array(list(state.angles.values())), np.array(list(state.speeds.values()))
    return float(stored_energy(machine, angle, speed))


def stored_energy(machine: Machine, angle: FloatArray, speed: FloatArray) -> FloatArray:
    """Kinetic and elastic energy at angles and speeds (..., inertias) [J]."""
    inertia = masses(machine)
    stiffness = np.where([one.law is None for one in machine.shafts], stiffnesses(machine), 0.0)
    rest = np.array([one.rest for one in machine.shafts])
    twist = angle @ shaft_rows(machine).T - rest
    found = 0.5 * speed**2 @ inertia + 0.5 * twist**2 @ stiffness
    for one in elements(machine):
        if one.kind == "shaft":
            found = found + one.law.stored(angle @ one.row)
    return np.asarray(found)
