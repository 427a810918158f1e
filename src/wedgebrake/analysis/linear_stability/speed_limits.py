"""``stability_limits``: stability limits of slope, friction and damping over the speed."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING, Any

import numpy as np

from wedgebrake.analysis.linear_stability.machine_stability import (
    Stability,
    check_sticking,
    machine_stability,
)
from wedgebrake.analysis.linear_stability.sliding_contact import (
    CURVE,
    Method,
    check_method,
    frozen,
)
from wedgebrake.analysis.linear_stability.varied_parameters import (
    VariedParameter,
    varied_parameters,
)
from wedgebrake.analysis.linear_stability.verdict_changes import (
    At,
    VerdictChange,
    changes_between,
    pattern,
    verdict_of,
)
from wedgebrake.analysis.responses.datasets import labelled
from wedgebrake.arrays import FloatArray
from wedgebrake.errors import InputError
from wedgebrake.model.joints import reduction
from wedgebrake.model.machine import Machine
from wedgebrake.model.machine_matrices import contact_rows
from wedgebrake.model.machine_names import replaced
from wedgebrake.model.machine_parts import Driven
from wedgebrake.model.studies.sweep_settings import sweepable
from wedgebrake.model.system import BrakedDriveline
from wedgebrake.model.torque_contacts import TorqueContact
from wedgebrake.model.validation import check_instance, wrong

if TYPE_CHECKING:
    import xarray as xr


# Distances from the present value at which the verdict is evaluated: the nearest and the farthest
# one as shares of the parameter's scale, and the ratio of neighbours.
_NEAREST, _FARTHEST, _RATIO = 1e-3, 1e3, 3.0
# Distance from a bound, as a share of the scale, within which a limit counts as the bound.
_ROUNDING = 1e-9
# Default speeds: their number, the first as a share of the last, the last as a multiple of the
# machine's own speed, and the last for a machine that does not turn [rad/s].
_COUNT, _FIRST, _BEYOND, _LAST = 41, 0.01, 3.0, 100.0
# Their number with samples, as multipliers take thirty times as long.
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
    limit   : the value at which vibration begins to grow or to decay; None if there is none
    stable  : "above" or "below" the limit; "everywhere" or "nowhere" without one, as far as the
              parameter can be varied or up to the ends in ``changes``
    also_static : whether static friction changes in proportion
    frequency : of the critical mode at the limit [Hz]; 0 if it does not oscillate; None without a
              limit
    changes : all changes of the verdict, of which ``limit`` is one, in ascending order: up to the
              first value on each side at which a brake begins to lock itself or a force to be held
              by the release or a limit
    """

    parameter: str
    unit: str
    kind: str
    present: float
    limit: float | None
    stable: str
    also_static: bool = False
    frequency: float | None = None
    changes: tuple[VerdictChange, ...] = ()

    def as_dict(self) -> dict[str, Any]:
        """Plain values."""
        return dict(vars(self)) | {"changes": [one.as_dict() for one in self.changes]}


def limits_of(
    machine: Machine, sticking: Sequence[str] = (), method: Method = CURVE
) -> tuple[ParameterLimit, ...]:
    """Stability limits of slope, friction and damping at the machine's own speeds.

    sticking : checked names of the contacts that stick
    """
    units, start = sweepable(machine), _at_start(machine)
    return tuple(
        _limit_of(_evaluated(start, None, one, sticking, method), one, units[one.name][0])
        for one in _varied(machine, sticking)
    )


def _varied(machine: Machine, sticking: Sequence[str]) -> list[VariedParameter]:
    """The varied parameters, without those of contacts that stick."""
    return [
        one for one in varied_parameters(machine) if one.name.rpartition(".")[0] not in sticking
    ]


def stability_limits(
    system: Machine | BrakedDriveline, speeds: Any = None, sticking: Sequence[str] | None = None,
    *, method: Method = CURVE,
) -> xr.Dataset:  # fmt: skip
    """Damping ratios of the modes, and stability limits of parameters, over the sliding speed.

    The speeds of all inertias, driven bodies and bases are multiplied by the same factor, and so
    are the setpoints of controllers that measure speeds alone; in a machine that does not turn, all
    inertias are given the same speed. At each speed the limit of a parameter is the
    value nearest to the present one at which the linear verdict on steady sliding changes, while
    all other parameters keep their values. Values beyond which a brake locks itself, or an actuator
    is released or reaches a limit of its force, are not considered.

    system : the machine; a ``BrakedDriveline`` is converted to a ``Machine``
    speeds : sliding speeds [rad/s] of the contact that slides fastest, (k,), above 0; by default up
             to three times its own speed
    sticking : names of contacts that stick, as for ``wb.stability``
    method : how varying friction is linearised, as for ``wb.stability``

    Returns a Dataset over ``speed``: ``growth_rate`` [1/s] and ``stable``; over ``mode`` too, in
    the order of the frequencies: ``damping_ratio`` and ``frequency`` [Hz] of the modes that
    oscillate; and for each parameter a variable with its limit, in its own unit, nan where it has
    none: "brake.slope", "brake.kinetic" (with static friction in proportion) or "brake.scale"
    (neither with a ``CustomFriction``), and the damping of each shaft. ``attrs["present"]`` is the
    present value. ``stable_side`` is 1 where sliding is stable above the limit, -1 below it, 0
    without a limit. ``stable_from`` and ``stable_to`` bound the stable values next to the limit, or
    without one those around the present value: at another limit, or where a brake locks itself or a
    force begins to be held; infinite without such an end, nan without stable values. ``wb.plot``
    draws the result.

    A pair of limits may be missed if they are closer to each other than to the present value.

    Raises ``InputError`` for other systems or speeds, and for what ``wb.stability`` does not
    accept.
    """
    import xarray as xr

    check_instance("system", system, BrakedDriveline | Machine, "a BrakedDriveline or a Machine")
    machine = system.unreduced
    sticks = () if sticking is None else check_sticking(machine, sticking)
    chosen = check_method(method)
    turning = _Turning(_at_start(machine))
    values = turning.values(speeds)
    parameters = _varied(machine, sticks)
    found, limits, sides, ranges = [], [], [], []
    for value in values.tolist():
        at = turning.at(value)
        found.append(machine_stability(*at, sticks, chosen))
        row = [_limit_of(_evaluated(*at, one, sticks, chosen), one, "") for one in parameters]
        limits.append([math.nan if one.limit is None else one.limit for one in row])
        sides.append([_SIDES[one.stable] for one in row])
        ranges.append([_stable_range(one) for one in row])
    units = sweepable(machine)
    shape = (values.size, len(parameters))
    columns, ends = np.array(limits).reshape(shape), np.array(ranges).reshape(*shape, 2)
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
                ("speed", "parameter"), np.array(sides, np.int8).reshape(shape), "1",
                "side of the limit on which sliding is stable: 1 above, -1 below, 0 without a"
                " limit",
            ),
            **{
                name: labelled(("speed", "parameter"), ends[..., end], "", f"{word} stable value")
                for end, (name, word) in enumerate(
                    (("stable_from", "smallest"), ("stable_to", "largest"))
                )
            },
        },
        coords={
            "speed": labelled("speed", values, "rad/s", f"sliding speed of {turning.contact}"),
            "parameter": [parameter.name for parameter in parameters],
        },
        attrs={
            "kind": "stability_limits", "system": json.dumps(machine.as_dict()),
            "contact": turning.contact, "own_speed": turning.own, "method": chosen,
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


_SIDES = {"above": 1, "below": -1, "everywhere": 0, "nowhere": 0}


def _evaluated(
    machine: Machine,
    speeds: Mapping[str, float] | None,
    parameter: VariedParameter,
    sticking: Sequence[str],
    method: Method,
) -> At:
    """Linear stability as a function of a parameter, at given speeds of the inertias.

    None where the machine cannot have that value.
    """

    @cache
    def at(value: float, *, modes: bool = False) -> Stability | None:
        try:
            changed = _changed(machine, parameter.changes(value))
            return machine_stability(changed, speeds, sticking, method, modes=modes)
        except InputError:
            return None

    return at


def _changed(machine: Machine, changes: Mapping[str, float]) -> Machine:
    """A copy with other values of one part, which alone is checked."""
    name = next(iter(changes)).partition(".")[0]
    kind = "shafts" if any(one.name == name for one in machine.shafts) else "contacts"
    part = replaced({name: machine.parts()[name]}, changes)[name]
    parts = tuple(part if one.name == name else one for one in getattr(machine, kind))
    return machine.model_copy(update={kind: parts})


def _at_start(machine: Machine) -> Machine:
    """A copy with signals as linear stability takes them: numbers."""
    contacts = []
    for one in machine.contacts:
        if isinstance(one, TorqueContact):  # of a force and a base without signals
            contacts.append(one)
            continue
        force = {"initial_force": frozen(one.actuation.initial_force)}
        fixed = {"base_speed": frozen(one.base_speed)}
        contacts.append(
            one.model_copy(update={**fixed, "actuation": one.actuation.model_copy(update=force)})
        )
    inertias = tuple(
        one.model_copy(update={"speed": frozen(one.speed)}) if isinstance(one, Driven) else one
        for one in machine.inertias
    )
    loops = tuple(
        one.model_copy(update={"setpoint": frozen(one.setpoint)}) for one in machine.controllers
    )
    changes = {"contacts": tuple(contacts), "inertias": inertias, "controllers": loops}
    return machine.model_copy(update=changes)


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
        self._setpoints = {
            f"{one.name}.setpoint": frozen(one.setpoint)
            for one in machine.controllers
            if all(name.endswith(".speed") for name in one.measured)
        }
        self._speeds = {one.name: frozen(one.speed) for one in machine.inertias}
        rows = contact_rows(machine)
        sliding = np.abs(rows @ list(self._speeds.values()) - list(self._bases.values()))
        self.own = float(sliding.max())
        if self.own == 0.0:
            ones = np.array([not isinstance(one, Driven) for one in machine.inertias], float)
            ones = reduction(machine).follow @ ones if machine.joints else ones
            self._speeds = dict(zip(self._speeds, ones.tolist(), strict=True))
            sliding = np.abs(rows @ ones)
        self._fastest = float(sliding.max())
        if self._fastest == 0.0:
            raise wrong("system", machine, "a machine in which a contact slides")
        self.contact = machine.contacts[int(sliding.argmax())].name

    def values(self, given: Any) -> FloatArray:
        """Return the checked speeds, by default up to a multiple of the own speed."""
        if given is None:
            last = _BEYOND * self.own or _LAST
            machine = self._machine
            sampled = any(one.actuation.sample_time is not None for one in machine.contacts)
            sampled |= any(one.sample_time is not None for one in machine.controllers)
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
        given = {name: factor * one for name, one in self._bases.items() if one != 0.0}
        given |= {name: factor * one for name, one in self._setpoints.items()}
        speeds = {name: factor * one for name, one in self._speeds.items()}
        given |= {f"{one.name}.speed": speeds[one.name] for one in self._machine.driven}
        return self._machine.replace(given).machine, speeds


def _limit_of(at: At, parameter: VariedParameter, unit: str) -> ParameterLimit:
    """The limit in a parameter, with all changes of the verdict."""
    found = at(parameter.present)
    present = 2 if found is None else verdict_of(found)
    below, above = (_changes(at, parameter, side) for side in (-1.0, 1.0))
    changes = [*below[::-1], *above]
    # No value beyond a bound is stable.
    bounds = (parameter.low, parameter.high)
    limits = [
        one
        for one in changes
        if one.of_vibration
        and (
            present == -1
            or min(abs(one.value - bound) for bound in bounds) > _ROUNDING * parameter.scale
        )
    ]
    limit = min(limits, key=lambda one: abs(one.value - parameter.present), default=None)
    if limit is None:
        stable = "everywhere" if present == -1 else "nowhere"
    elif "stable" in (limit.below, limit.above):
        stable = "below" if limit.below == "stable" else "above"
    else:
        stable = "nowhere"
    return ParameterLimit(
        parameter.name, unit, parameter.kind, parameter.present,
        None if limit is None else limit.value, stable, bool(parameter.also),
        None if limit is None else limit.frequency, tuple(changes),
    )  # fmt: skip


def _changes(at: At, parameter: VariedParameter, side: float) -> list[VerdictChange]:
    """The changes on one side of the present value, outwards, up to that of the pattern."""
    found: list[VerdictChange] = []
    last, distance = parameter.present, _NEAREST * parameter.scale
    same = pattern(at(last))
    while distance <= _FARTHEST * parameter.scale and same is not None:
        value = parameter.present + side * distance
        value = min(max(value, parameter.low), parameter.high)
        if value == last:
            break
        for one in changes_between(at, last, value):
            found.append(one.change)
            if not one.change.of_vibration:
                return found
        if pattern(at(value)) != same:
            break
        last, distance = value, distance * _RATIO
    return found


def _stable_range(limit: ParameterLimit) -> tuple[float, float]:
    """The stable values next to a limit, or around the present value; nan if there are none."""
    if limit.stable == "nowhere":
        return math.nan, math.nan
    inside = limit.present
    if limit.limit is not None:
        inside = math.nextafter(limit.limit, math.inf if limit.stable == "above" else -math.inf)
    ends = [one.value for one in limit.changes]
    return (
        max((one for one in ends if one <= inside), default=-math.inf),
        min((one for one in ends if one >= inside), default=math.inf),
    )


def _modes(found: list[Stability]) -> tuple[FloatArray, FloatArray]:
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


def _rate(found: Stability) -> float:
    return math.nan if found.growth_rate is None else found.growth_rate
