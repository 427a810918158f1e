"""The run that is to be differentiated, from a system and names of its parameters."""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from functools import cache
from typing import TYPE_CHECKING, Any

import numpy as np

from wedgebrake.arrays import FloatArray
from wedgebrake.model.machine import Machine
from wedgebrake.model.part import SMALLEST
from wedgebrake.model.system import INITIAL, BrakedDriveline
from wedgebrake.model.validation import unknown, wrong

if TYPE_CHECKING:
    from wedgebrake.solvers.machine.tangents import TangentTask

# Parameters without derivatives, and why.
_WITHOUT = {
    "delay": "it is a whole number",
    "resolution": "the force is rounded to it",
}


def checked_names(
    system: BrakedDriveline | Machine, parameters: Any, initial: Collection[str] = ()
) -> tuple[str, ...]:
    """The names of the parameters, and those of initial conditions that are allowed."""
    if isinstance(parameters, str) or not isinstance(parameters, Sequence) or not parameters:
        raise wrong("parameters", parameters, 'a list of names, for example ["slope"]')
    names = set(system.names())
    known = [name for name in system.quantities() if name in names]
    known += initial
    known = [name for name in known if name in initial or name not in system.initial_conditions]
    for name in parameters:
        if name not in known:
            raise unknown("parameters", name, known, "no such parameter")
        why = _WITHOUT.get(name.rpartition(".")[2])
        if why:
            raise wrong("parameters", name, "a parameter with a derivative", f"{why.capitalize()}.")
    return tuple(parameters)


def varying(system: BrakedDriveline | Machine, names: Sequence[str]) -> BrakedDriveline | Machine:
    """The system, with what it does not have at the value 0 of a parameter.

    A signal with the amplitude 0 is constant, a controller with a gain of 0 has no such state, and
    a gap without damping has no end of contact of its own. At the smallest value, the effect of the
    parameter is below all rounding.
    """
    for name in names:
        if name not in INITIAL and system.value(name) == 0.0:
            near = system.replace(**{name: SMALLEST})
            system = near if _present(near.machine) != _present(system.machine) else system
    return system


def _present(machine: Machine) -> tuple[int, ...]:
    """Numbers of signals that vary, of states of controllers, and of gaps with damping."""
    return (
        sum(one.varies for one in machine.signals().values()),
        sum(len(one.memory) for one in machine.controllers),
        sum(one.gap is not None and one.damping > 0.0 for one in machine.shafts),
    )


def tangent_task(
    system: BrakedDriveline | Machine,
    names: Sequence[str],
    span: tuple[float, float],
    method: str,
    initial: Any,
    times: FloatArray | None = None,
) -> TangentTask:
    """The run of a system over a span [s] from an initial state, as of ``simulate``."""
    from wedgebrake.solvers.machine.final_state import FinalState
    from wedgebrake.solvers.machine.tangents import Parameter, TangentTask

    machine = system.machine
    if isinstance(initial, tuple | list):
        machine = machine.started_at(*initial)
    machine_at = tuple(_machine_at(system, name, initial) for name in names)
    parameters = tuple(
        Parameter(name, _value(system, name, initial)).allowed(at)
        for name, at in zip(names, machine_at, strict=True)
    )
    return TangentTask(
        machine, parameters, machine_at, span, np.empty(0) if times is None else times, method,
        initial if isinstance(initial, FinalState) else None,
    )  # fmt: skip


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
