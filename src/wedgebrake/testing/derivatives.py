"""Checks of derivatives with respect to the parameters of a part, against differences of runs."""

from __future__ import annotations

from typing import Any

import numpy as np

from wedgebrake.analysis.derivatives.sensitivity import sensitivity
from wedgebrake.arrays import FloatArray
from wedgebrake.errors import InputError
from wedgebrake.model.joints import reduction
from wedgebrake.model.machine import Machine
from wedgebrake.model.machine_parts import GROUND, Driven, Inertia, Shaft, Torque
from wedgebrake.model.part import Part
from wedgebrake.model.signals.signals import Harmonic, Signal
from wedgebrake.model.system import BrakedDriveline
from wedgebrake.model.system_base import System
from wedgebrake.model.validation import check_instance
from wedgebrake.solvers.simulate import simulate
from wedgebrake.testing.parts import claim, system_with

# Weights of differences of fourth order at multiples of a step: about a value, above it, below it.
_WEIGHTS = (
    {1: 8.0 / 12.0, -1: -8.0 / 12.0, 2: -1.0 / 12.0, -2: 1.0 / 12.0},
    {0: -25.0 / 12.0, 1: 4.0, 2: -3.0, 3: 4.0 / 3.0, 4: -0.25},
    {0: 25.0 / 12.0, -1: -4.0, -2: 3.0, -3: -4.0 / 3.0, -4: 0.25},
)
# Steps, relative to the value: an event may pass a sample within a long one, and the error of the
# run, relative to its speeds, limits short ones.
_STEPS = (1e-3, 3e-4, 1e-4, 3e-5, 1e-5, 3e-6)
_RTOL, _ERROR = 1e-12, 1e-14
# Largest error, relative to the largest derivative, or to a share of the speed over the value.
_ALLOWED, _SHARE = 1e-6, 1e-2
# Not at the start, where a contact at rest may first have to follow its base.
# Signals that begin at 0 bend before the start.
_START = 0.25
# Between the samples of most digital parts: at a sample whose time changes, the derivatives of both
# sides differ.
_TIMES: FloatArray = _START + 0.0285 + 0.024 * np.arange(40.0)
# Initial state of a driveline: a brake at rest on a moving shaft follows it on one side only.
_MOVES = (0.0, 1.0)
# Size of a parameter that is 0.
_SMALL = 1e-2


def check_derivatives(part: Part) -> None:
    """Check the derivatives of a motion with respect to every parameter of a part.

    part : a brake, friction law, actuation, signal, inertia, ..., or a whole system

    A part is put into a small vibrating machine; a system is simulated as it is. Over 1 s, the
    derivatives of the speeds by ``wb.sensitivity`` must agree with differences of runs. Parameters
    that ``wb.sensitivity`` refuses, such as a delay, are skipped, and so is an actuation or a
    controller with a ``resolution``, whose output changes in steps.

    Raises ``AssertionError`` for a parameter whose derivatives differ, or if none of the parameters
    of a part other than a signal has derivatives; ``InputError`` if ``part`` is not a part of a
    system.
    """
    check_instance("part", part, Part, "a part, for example a brake, a signal or an inertia")
    system = _moving(part)
    parts = [*(one.actuation for one in system.machine.contacts), *system.machine.controllers]
    if any(getattr(one, "resolution") for one in parts):  # noqa: B009
        return
    names = [one for one in system.parameters() if _is_of(part, one)]
    differentiable = []
    for name in names:
        try:
            found = sensitivity(system, [name], 1.0, times=_TIMES, **_run(system))
        except InputError:
            continue
        differentiable.append(name)
        if found["one_sided"].to_numpy().any():
            continue
        _compare(type(part).__name__, system, name, found["velocity"].to_numpy()[0])
    claim(
        differentiable or not names or isinstance(part, Signal),
        f"{type(part).__name__}: wb.sensitivity must accept a parameter of {', '.join(names)}.",
    )


def _compare(kind: str, system: BrakedDriveline | Machine, name: str, found: FloatArray) -> None:
    """Compare derivatives of speeds with differences."""
    value = system.value(name)
    size = abs(value) or _SMALL
    differences = np.array([_difference(system, name, value, one * size) for one in _STEPS])
    # For each sample the pair of steps that agree best.
    speed = np.abs(_speeds(system)).max() or 1.0
    rounding = _ERROR * speed / (np.array(_STEPS[1:]) * size)
    apart = np.abs(np.diff(differences, axis=0)).T + rounding
    best = apart.T.argmin(axis=0)
    expected = np.take_along_axis(differences[1:], best[None], axis=0)[0]
    scale = max(np.abs(expected).max(), _SHARE * speed / size)
    error = np.abs(found - expected)
    worst = int(np.argmax(error.reshape(len(error), -1).max(axis=1)))
    claim(
        error.max() <= _ALLOWED * scale,
        f"{kind}: the derivative of the speed with respect to {name} at t = {_TIMES[worst]:g} s is"
        f" {np.ravel(found[worst])}, but differences of runs give {np.ravel(expected[worst])}.",
    )


def _run(system: BrakedDriveline | Machine) -> dict[str, Any]:
    start = {} if system.holds_start else {"initial": _MOVES}
    return {"start_time": _START, **start}


def _speeds(system: BrakedDriveline | Machine) -> FloatArray:
    found = simulate(system, 1.0, times=_TIMES, rtol=_RTOL, **_run(system))
    return np.asarray(found["velocity"].to_numpy())


def _difference(
    system: BrakedDriveline | Machine, name: str, value: float, step: float
) -> FloatArray:
    """Derivative of the speeds by differences, on one side at the end of the range."""
    for weights in _WEIGHTS:
        try:
            near = [system.replace(**{name: value + place * step}) for place in weights]
        except InputError as error:
            last = error
            continue
        speeds = [_speeds(one) for one in near]
        return np.asarray(np.tensordot(list(weights.values()), speeds, 1) / step)
    raise last


def _is_of(part: Part, name: str) -> bool:
    """Whether a name in the small machine is that of a parameter of the part."""
    if isinstance(part, System):
        return True
    first, _, rest = name.partition(".")
    own: str | None = getattr(part, "name", None)
    if own:
        return first == own
    if not rest:
        return name in type(part).model_fields
    # Of a signal all inner ones too.
    return first == "engine" or (first == "brake" and rest in type(part).model_fields)


def _moving(part: Part) -> BrakedDriveline | Machine:
    """A system in vibration that has a part."""
    system = system_with(part)
    if system is None:
        raise InputError(f"part = {part!r}: must be a part of a system.", name="part", value=part)
    if part is system or not system.holds_start:
        return system
    machine = system.unreduced
    free = reduction(machine).free
    inertias = [
        one
        if one == part or isinstance(one, Driven)
        else Inertia(one.name, one.inertia, **({"speed": 3.0} if number in free else {}))
        for number, one in enumerate(machine.inertias)
    ]
    shafts: list[Any] = list(machine.shafts)
    shafts += [
        Shaft(one.name, GROUND, name=f"{one.name}_mount", stiffness=900.0, damping=2.0)
        for one in inertias
        if isinstance(one, Inertia)
    ]
    torques: list[Any] = list(machine.torques)
    first = inertias[0].name
    torques.append(Torque(first, Harmonic(500.0, 4.0, 0.3), name=f"{first}_drive"))
    return Machine(
        inertias=inertias, shafts=shafts, contacts=list(machine.contacts), torques=torques,
        joints=machine.joints, controllers=machine.controllers,
    )  # fmt: skip
