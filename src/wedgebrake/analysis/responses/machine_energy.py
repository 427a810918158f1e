"""The energy balance of a machine."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from wedgebrake.analysis.responses.datasets import labelled
from wedgebrake.model.machine import Machine
from wedgebrake.model.machine_matrices import shaft_rows
from wedgebrake.solvers.machine.final_state import FinalState
from wedgebrake.solvers.machine.simulate import solved, task_of

if TYPE_CHECKING:
    import xarray as xr

_PARTS = {
    "friction_heat": ("contact", "heat of the contact"),
    "base_work": ("contact", "work of the moving base against the contact"),
    "viscous_loss": ("shaft", "heat of the viscous damping"),
    "torque_work": ("torque", "work of the torque"),
}


def machine_energy(machine: Machine, response: xr.Dataset) -> xr.Dataset:
    """Work and heat of every part of a machine over a whole response.

    The run is repeated, and every power is integrated over each cell of its Taylor series, so that
    the residual is rounding error.

    Returns
    -------
    xarray.Dataset
        friction_heat, base_work over ``contact``, viscous_loss over ``shaft``, torque_work over
        ``torque``; stored_change, the gain of kinetic and elastic energy, and residual =
        sum(torque_work) + sum(base_work) - sum(friction_heat) - sum(viscous_loss) - stored_change,
        all in J.
    """
    import xarray as xr

    task = task_of(response)
    answer = solved(machine, task, powers=True)
    contacts, shafts = len(machine.contacts), len(machine.shafts)
    bounds = np.cumsum([contacts, contacts, shafts])
    works = dict(zip(_PARTS, np.split(answer.observer.work, bounds), strict=True))
    change = _stored(machine, answer.final) - _stored(machine, task.initial)
    gained = works["torque_work"].sum() + works["base_work"].sum()
    lost = works["friction_heat"].sum() + works["viscous_loss"].sum()
    table = {
        **{name: labelled(dim, works[name], "J", text) for name, (dim, text) in _PARTS.items()},
        "stored_change": labelled((), change, "J", "gain of kinetic and elastic energy"),
        "residual": labelled((), gained - lost - change, "J", "error of the balance"),
    }
    named = {"contact": machine.contacts, "shaft": machine.shafts, "torque": machine.torques}
    found = xr.Dataset(
        table,
        coords={name: np.array([one.name for one in parts], str) for name, parts in named.items()},
    )
    found.attrs = {"start": task.start, "stop": answer.final.time}
    return found


def _stored(machine: Machine, state: FinalState | None) -> float:
    """Kinetic and elastic energy of a state; None: the initial state of the machine."""
    angle = np.array([one.angle for one in machine.inertias])
    speed = np.array([one.speed for one in machine.inertias])
    if state is not None:
        angle, speed = np.array(list(state.angles.values())), np.array(list(state.speeds.values()))
    inertia = np.array([one.inertia for one in machine.inertias])
    stiffness = np.array([one.stiffness for one in machine.shafts])
    twist = shaft_rows(machine) @ angle
    return float(0.5 * inertia @ speed**2 + 0.5 * stiffness @ twist**2)
