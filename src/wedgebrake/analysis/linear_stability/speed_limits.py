"""``stability_limits``: stability limits of slope, friction and damping over the speed."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from wedgebrake.analysis.linear_stability.hopf import boundary_between, verdict_of
from wedgebrake.analysis.linear_stability.machine_stability import (
    MachineStability,
    machine_stability,
)
from wedgebrake.analysis.linear_stability.sliding_contact import frozen
from wedgebrake.analysis.linear_stability.varied_parameters import (
    VariedParameter,
    varied_parameters,
)
from wedgebrake.analysis.responses.datasets import labelled
from wedgebrake.arrays import FloatArray
from wedgebrake.errors import InputError
from wedgebrake.model.machine import Machine
from wedgebrake.model.machine_matrices import contact_rows
from wedgebrake.model.machine_names import replaced
from wedgebrake.model.studies.sweep_settings import sweepable
from wedgebrake.model.system import BrakedDriveline
from wedgebrake.model.validation import check_instance, wrong

if TYPE_CHECKING:
    import xarray as xr


# Distances from the present value at which the verdict is evaluated: the nearest and the farthest
# one as shares of the parameter's scale, and the ratio of neighbours.
_NEAREST, _FARTHEST, _RATIO = 1e-3, 1e3, 3.0
# Bisections of the last step, up to the value at which sliding ends.
_BISECTIONS = 30
# Distance from a bound, as a share of the scale, within which a limit counts as the bound.
_ROUNDING = 1e-9
# Default speeds: their number, the first as a share of the last, the last as a multiple of the
# machine's own speed, and the last for a machine that does not turn [rad/s].
_COUNT, _FIRST, _BEYOND, _LAST = 41, 0.01, 3.0, 100.0
# Their number with controllers, whose multipliers take thirty times as long.
_FEW = 9
_MOST_SPEEDS = 10_000
_FASTEST = 1e12


@dataclass(frozen=True)
class ParameterLimit:
    """The stability limit in one parameter, nearest to its present value.

    parameter, unit : dotted name, SI unit
    kind    : "slope" (of the actuation force over the speed), "friction" (coefficient, with static
              friction in proportion, or scale of a table) or "damping" (of a shaft)
    present : present value
    limit   : the value at which the verdict changes; None if there is none
    stable  : "above" or "below" the limit; "everywhere" or "nowhere" without one
    also_static : whether static friction changes in proportion
    frequency : of the critical mode at the limit [Hz]; 0 if it does not oscillate; None without a
              limit
    """

    parameter: str
    unit: str
    kind: str
    present: float
    limit: float | None
    stable: str
    also_static: bool = False
    frequency: float | None = None

    def as_dict(self) -> dict[str, Any]:
        """Plain values."""
        return dict(vars(self))


def limits_of(machine: Machine) -> tuple[ParameterLimit, ...]:
    """Stability limits of slope, friction and damping at the machine's own speeds."""
    units, start = sweepable(machine), _at_start(machine)
    return tuple(_limit_of(start, one, units[one.name][0]) for one in varied_parameters(machine))


def stability_limits(system: Machine | BrakedDriveline, speeds: Any = None) -> xr.Dataset:
    """Damping ratios of the modes, and stability limits of parameters, over the sliding speed.

    The speeds of all inertias and bases are multiplied by the same factor; in a machine that does
    not turn, all inertias are given the same speed. At each speed the limit of a parameter is the
    value nearest to the present one at which the linear verdict on steady sliding changes, while
    all other parameters keep their values. Values beyond which a brake locks itself, or an actuator
    is released or reaches a limit of its force, are not considered.

    system : the machine; a ``BrakedDriveline`` is converted to a ``Machine``
    speeds : sliding speeds [rad/s] of the contact that slides fastest, (k,), above 0; by default up
             to three times its own speed

    Returns a Dataset over ``speed``: ``growth_rate`` [1/s] and ``stable``; over ``mode`` too, in
    the order of the frequencies: ``damping_ratio`` and ``frequency`` [Hz] of the modes that
    oscillate; and for each parameter a variable with its limit, in its own unit, nan where it has
    none: "brake.slope", "brake.kinetic" (with static friction in proportion) or "brake.scale"
    (neither with a ``CustomFriction``), and the damping of each shaft. ``attrs["present"]`` is the
    present value. ``stable_side`` is 1 where sliding is stable above the limit, -1 below it, 0
    without a limit. ``wb.plot`` draws the result.

    A pair of limits may be missed if they are closer to each other than to the present value.

    Raises ``InputError`` for other systems or speeds, and for what ``wb.stability`` does not
    accept.
    """
    import xarray as xr

    check_instance("system", system, BrakedDriveline | Machine, "a BrakedDriveline or a Machine")
    machine = system.machine
    turning = _Turning(_at_start(machine))
    values = turning.values(speeds)
    parameters = varied_parameters(machine)
    found, limits, sides = [], [], []
    for value in values.tolist():
        at = turning.at(value)
        found.append(machine_stability(*at))
        row = [_nearest(partial(_evaluated, *at, one), one) for one in parameters]
        limits.append([math.nan if one is None else one[0] for one in row])
        sides.append([0 if one is None else one[1] for one in row])
    units = sweepable(machine)
    columns = np.array(limits).reshape(values.size, len(parameters))
    modes = _modes(found)
    rates, stable = [_rate(one) for one in found], [one.stable for one in found]
    over = ("speed", "mode")
    dataset = xr.Dataset(
        {
            "growth_rate": labelled("speed", rates, "1/s", "largest growth rate"),
            "stable": labelled("speed", stable, "1", "whether small vibration decays"),
            "damping_ratio": labelled(over, modes[0], "1", "damping ratio"),
            "frequency": labelled(over, modes[1], "Hz", "frequency"),
            "stable_side": labelled(
                ("speed", "parameter"), np.array(sides, np.int8).reshape(columns.shape), "1",
                "side of the limit on which sliding is stable: 1 above, -1 below, 0 without a"
                " limit",
            ),
        },
        coords={
            "speed": labelled("speed", values, "rad/s", f"sliding speed of {turning.contact}"),
            "parameter": [parameter.name for parameter in parameters],
        },
        attrs={
            "kind": "stability_limits", "system": json.dumps(machine.as_dict()),
            "contact": turning.contact, "own_speed": turning.own,
        },
    )  # fmt: skip
    for parameter, column in zip(parameters, columns.T, strict=True):
        unit, meaning = units[parameter.name]
        dataset[parameter.name] = (
            "speed", column,
            {
                "units": unit, "long_name": f"limit of {meaning}",
                "present": parameter.present, "kind": parameter.kind,
            },
        )  # fmt: skip
    return dataset


_Evaluation = Callable[[float], tuple[int, MachineStability]]


def _evaluated(
    machine: Machine, speeds: Mapping[str, float] | None, parameter: VariedParameter, value: float
) -> tuple[int, MachineStability]:
    """Linear stability with another value of a parameter, at given speeds; without its modes."""
    found = machine_stability(_changed(machine, parameter.changes(value)), speeds, modes=False)
    return verdict_of(found), found


def _changed(machine: Machine, changes: Mapping[str, float]) -> Machine:
    """A copy with other values of one part, which alone is checked."""
    name = next(iter(changes)).partition(".")[0]
    kind = "shafts" if any(one.name == name for one in machine.shafts) else "contacts"
    part = replaced({name: machine.parts()[name]}, changes)[name]
    parts = tuple(part if one.name == name else one for one in getattr(machine, kind))
    return machine.model_copy(update={kind: parts})


def _at_start(machine: Machine) -> Machine:
    """A copy with actuation forces and base speeds as linear stability takes them: numbers."""
    contacts = []
    for one in machine.contacts:
        force = {"initial_force": frozen(one.actuation.initial_force)}
        fixed = {"base_speed": frozen(one.base_speed)}
        contacts.append(
            one.model_copy(update={**fixed, "actuation": one.actuation.model_copy(update=force)})
        )
    return machine.model_copy(update={"contacts": tuple(contacts)})


class _Turning:
    """A machine with all its speeds multiplied by one factor.

    contact : name of the contact that slides fastest
    own     : its sliding speed [rad/s]; 0 if the machine does not turn
    """

    def __init__(self, machine: Machine) -> None:
        if not machine.contacts:
            raise wrong("system", machine, "a machine with contacts")
        self._machine = machine
        self._bases = {f"{one.name}.base_speed": frozen(one.base_speed) for one in machine.contacts}
        self._speeds = {one.name: one.speed for one in machine.inertias}
        rows = contact_rows(machine)
        sliding = np.abs(rows @ list(self._speeds.values()) - list(self._bases.values()))
        self.own = float(sliding.max())
        if self.own == 0.0:
            self._speeds = dict.fromkeys(self._speeds, 1.0)
            sliding = np.abs(rows @ np.ones(len(self._speeds)))
        self._fastest = float(sliding.max())
        if self._fastest == 0.0:
            raise wrong("system", machine, "a machine in which a contact slides")
        self.contact = machine.contacts[int(sliding.argmax())].name

    def values(self, given: Any) -> FloatArray:
        """Return the checked speeds, by default up to a multiple of the own speed."""
        if given is None:
            last = _BEYOND * self.own or _LAST
            sampled = any(one.actuation.sample_time is not None for one in self._machine.contacts)
            return np.linspace(_FIRST * last, last, _FEW if sampled else _COUNT)
        allowed = f"one to {_MOST_SPEEDS} speeds in rad/s, above 0"
        try:
            values = np.atleast_1d(np.asarray(given, dtype=float))
        except (TypeError, ValueError):
            raise wrong("speeds", given, allowed) from None
        if values.ndim != 1 or not 0 < values.size <= _MOST_SPEEDS:
            raise wrong("speeds", given, allowed)
        if not np.all((values > 0.0) & (values <= _FASTEST)):
            raise wrong("speeds", given, allowed)
        return values

    def at(self, value: float) -> tuple[Machine, dict[str, float]]:
        """The machine and speeds of its inertias at a sliding speed of the contact [rad/s]."""
        factor = value / self._fastest
        bases = {name: factor * one for name, one in self._bases.items() if one != 0.0}
        speeds = {name: factor * one for name, one in self._speeds.items()}
        return self._machine.replace(bases), speeds


def _nearest(of: _Evaluation, parameter: VariedParameter) -> tuple[float, int] | None:
    """The limit nearest to the present value, and the side on which sliding is stable."""
    try:
        present, found = of(parameter.present)
    except InputError:
        return None
    if found.critical is None:
        return None
    held = found.critical.limited

    def verdict(value: float) -> int | None:
        """The verdict; None where a brake locks itself or a force reaches a limit."""
        try:
            here, found = of(value)
        except InputError:
            return None
        return here if found.critical is not None and found.critical.limited == held else None

    limits = []
    for side in (1.0, -1.0):
        bracket = _bracket(verdict, parameter, present, side)
        if bracket is None:
            continue
        _, outer = bracket
        # Without any damping, vibration neither grows nor decays: the limit is the bound itself.
        at_bound = outer in (parameter.low, parameter.high) and of(outer)[0] == 0
        limit = outer if at_bound else boundary_between(of, *bracket)
        # No value beyond a bound is stable.
        beside = min(abs(limit - parameter.low), abs(limit - parameter.high))
        if present == -1 or beside > _ROUNDING * parameter.scale:
            limits.append(limit)
    if not limits:
        return None
    limit = min(limits, key=lambda one: abs(one - parameter.present))
    towards = 1 if parameter.present > limit else -1
    if parameter.present == limit:
        towards = 0
    return limit, towards if present == -1 else -towards


def _bracket(
    verdict: Callable[[float], int | None], parameter: VariedParameter, present: int, side: float
) -> tuple[float, float] | None:
    """Two values on one side of the present one with different verdicts; None without a limit."""
    last, distance = parameter.present, _NEAREST * parameter.scale
    while distance <= _FARTHEST * parameter.scale:
        value = min(max(parameter.present + side * distance, parameter.low), parameter.high)
        if value == last:
            return None
        here = verdict(value)
        if here is None:
            break
        if here != present:
            return last, value
        last, distance = value, distance * _RATIO
    else:
        return None
    for _ in range(_BISECTIONS):
        middle = 0.5 * (last + value)
        here = verdict(middle)
        if here is None:
            value = middle
        elif here == present:
            last = middle
        else:
            return last, middle
    return None


def _limit_of(machine: Machine, parameter: VariedParameter, unit: str) -> ParameterLimit:
    """The limit in a parameter, with its critical mode."""
    of = partial(_evaluated, machine, None, parameter)
    found = _nearest(of, parameter)
    value, frequency = None, None
    if found is None:
        stable = "everywhere" if of(parameter.present)[0] == -1 else "nowhere"
    else:
        value, side = found
        modes = machine_stability(_changed(machine, parameter.changes(value))).modes
        stable = "above" if side > 0 else "below"
        frequency = modes[0].frequency if modes else None
    return ParameterLimit(
        parameter.name,
        unit,
        parameter.kind,
        parameter.present,
        value,
        stable,
        bool(parameter.also),
        frequency,
    )


def _modes(found: list[MachineStability]) -> tuple[FloatArray, FloatArray]:
    """Damping ratios and frequencies [Hz] of the oscillating modes, (speed, mode)."""
    rows = [
        sorted(
            (mode.frequency, mode.damping_ratio)
            for mode in one.modes
            if mode.frequency > 0.0 and not mode.rigid
        )
        for one in found
    ]
    shape = (len(rows), max(map(len, rows), default=0))
    ratios, frequencies = np.full(shape, math.nan), np.full(shape, math.nan)
    for place, row in enumerate(rows):
        for number, (frequency, ratio) in enumerate(row):
            ratios[place, number], frequencies[place, number] = ratio, frequency
    return ratios, frequencies


def _rate(found: MachineStability) -> float:
    return math.nan if found.growth_rate is None else found.growth_rate
