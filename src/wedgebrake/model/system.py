"""The whole machine: driveline, brake, friction, actuation and torque."""

from __future__ import annotations

import dataclasses
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from functools import lru_cache
from typing import TYPE_CHECKING, Any, ClassVar

from pydantic import InstanceOf, PrivateAttr

from wedgebrake.errors import InputError, nearest
from wedgebrake.model import groups as _groups
from wedgebrake.model import stribeck  # noqa: F401 - files name their kinds
from wedgebrake.model.actuation import Actuation
from wedgebrake.model.brakes import Brake
from wedgebrake.model.characteristic import Characteristic, characteristic
from wedgebrake.model.display import part_rows
from wedgebrake.model.driveline import Driveline
from wedgebrake.model.friction import Friction, SetValuedFriction
from wedgebrake.model.groups import Groups
from wedgebrake.model.machine import Machine, joined_changes
from wedgebrake.model.machine_parts import GROUND, Contact, Factors, Inertia, Shaft, Stages, Torque
from wedgebrake.model.part import (
    Chosen,
    Part,
    Quantity,
    given,
    is_numeric,
    parameter,
    plain_fields,
    plain_table,
)
from wedgebrake.model.signals.excitation import HarmonicTorque
from wedgebrake.model.signals.signals import Harmonic, Signal, SignalField
from wedgebrake.model.system_base import System
from wedgebrake.model.validation import is_number, wrong
from wedgebrake.model.view import DRIVELINE, View

_BASES = (Driveline, Brake, Friction, Actuation, HarmonicTorque)
BASES: dict[str, type[Part]] = {base.table: base for base in _BASES}
PARTS = tuple(BASES)
CHOSEN: dict[str, dict[str, type[Part]]] = {
    name: base.kinds
    for name, base in BASES.items()
    if issubclass(base, Chosen) and "kinds" in vars(base)  # a base of several kinds
}
"""The kinds of a brake and of a friction law, by the name of their part."""
# ``replace`` reads damping_ratio as that of a lag.
_RATIO = "For the driveline give damping = 2 damping_ratio sqrt(inertia stiffness)."
# Names in the machine of a driveline, and in the driveline; those of the actuation besides.
_OWN_NAMES = {
    "torque.signal": "excitation", "brake.base_speed": "driveline.drive_speed",
    "brake.brake": "brake", "brake.friction": "friction",
}  # fmt: skip
INITIAL = {
    "initial_angle": Quantity("theta", "rad", "angle at the start"),
    "initial_velocity": Quantity("theta'", "rad/s", "velocity at the start"),
}

# A HarmonicTorque for type checkers: functions for one inertia raise an error for other signals
# when called.
if TYPE_CHECKING:
    _Torque = HarmonicTorque
else:
    _Torque = SignalField


def _part(description: str, example: str) -> Any:
    return parameter(description, unit="-", example=example)


class BrakedDriveline(System):
    """A driveline with a brake: J theta'' + c theta' + k theta + R F_mu = T(t)  (eq. 1).

    The torque, the drive speed and the initial force may be signals. ``machine`` is the equivalent
    ``Machine``. Immutable, in SI units. ``groups`` gives the normalised groups of the paper;
    ``replace`` gives a changed copy, by SI name, group name or whole part.
    """

    table: ClassVar[str] = ""
    default_length: ClassVar[Mapping[str, Any]] = {"periods": 250}
    holds_start: ClassVar[bool] = False
    view: ClassVar[View] = DRIVELINE

    driveline: InstanceOf[Driveline] = _part(
        "the driveline", "wb.Driveline(inertia=1.0, damping=0.1, stiffness=1e4)"
    )
    brake: InstanceOf[Brake] = _part("the brake", "wb.WedgeBrake(angle=0.34, radius=0.2)")
    friction: InstanceOf[Friction] = _part("its friction law", "wb.CoulombFriction(kinetic=0.3)")
    actuation: InstanceOf[Actuation] = _part(
        "the force that presses the brake", "wb.Actuation(initial_force=300, slope=-40)"
    )
    excitation: _Torque = _part("the torque", "wb.HarmonicTorque(amplitude=500, frequency=10.03)")

    if TYPE_CHECKING:

        def __init__(self, /, **data: Any) -> None: ...

    # Groups as they were given: eta reads back to the last bit, although the slope that stores it
    # is rounded.
    _stated: dict[str, float] = PrivateAttr(default_factory=dict)
    # Those of the driveline of which this is a changed copy, with its groups by the SI values:
    # where these have not changed, the groups are still as given.
    _earlier: tuple[dict[str, float], Groups] | None = PrivateAttr(default=None)
    _machine: Machine | None = PrivateAttr(default=None)
    _computed: Groups | None = PrivateAttr(default=None)

    def __eq__(self, other: object) -> bool:
        """Equal parts, however the groups were given."""
        if not isinstance(other, BrakedDriveline):
            return NotImplemented
        return self.parts() == other.parts()

    def __hash__(self) -> int:
        return hash(tuple(getattr(self, name) for name in PARTS))

    @property
    def stated(self) -> dict[str, float]:
        """The groups that were given instead of SI values, as they were given."""
        if self._earlier is not None:
            (given, before), after = self._earlier, self._groups_of_parts
            same = {
                name: value for name, value in given.items()
                if getattr(before, name) == getattr(after, name)
            }  # fmt: skip
            self._stated, self._earlier = {**same, **self._stated}, None
        return dict(self._stated)

    @property
    def groups(self) -> Groups:
        """The normalised groups (docs/equations.md, "Normalised groups")."""
        return dataclasses.replace(self._groups_of_parts, **self.stated)

    @property
    def _groups_of_parts(self) -> Groups:
        """The groups by the SI values alone: those of the machine, without making one."""
        found = self._computed
        if found is None:
            line = self.driveline
            found = self._computed = _groups.compute(_groups.Oscillator(
                line.inertia, line.damping, line.stiffness, line.drive_speed, self.brake,
                self.friction, self.actuation, self.excitation,
            ))  # fmt: skip
        return found

    @property
    def characteristic(self) -> Characteristic:
        """Brake torque against sliding velocity, for set-valued friction.

        Raises ``InputError`` for a smooth friction law.
        """
        if not isinstance(self.friction, SetValuedFriction):
            raise wrong(
                "friction", self.friction, "set-valued (CoulombFriction or TabulatedFriction) to"
                " have a characteristic", "Use method='smooth', or"
                " replace(friction=wb.CoulombFriction(kinetic=...)).",
            )  # fmt: skip
        return characteristic(self.brake, self.friction, self.actuation)

    @property
    def machine(self) -> Machine:
        """The equivalent machine with one inertia, "driveline".

        It has the shaft "shaft" to the ground, the contact "brake", whose base turns at
        -drive_speed, and the torque "torque".
        """
        if self._machine is None:
            line, speed = self.driveline, self.driveline.drive_speed
            # Without the checks of its parts: those of the driveline have been checked.
            contact = Contact.model_construct(
                a="driveline", name="brake", brake=self.brake, friction=self.friction,
                actuation=self.actuation,
                base_speed=-speed if isinstance(speed, Signal) else 0.0 - speed, normal=Factors(),
            )  # fmt: skip
            self._machine = Machine.model_construct(
                inertias=(_inertia(line.inertia),),
                shafts=(_shaft(line.stiffness, line.damping),),
                contacts=(contact,),
                torques=(_torque(self.excitation),),
            )
        return self._machine

    def own_name(self, name: str) -> str:
        """The name in this system of what ``machine`` calls ``name``."""
        part, _, rest = name.partition(".")
        if part == "brake" and rest.partition(".")[0] in Actuation.model_fields:
            return f"actuation.{rest}"
        for of_machine, own in _OWN_NAMES.items():
            if name == of_machine or name.startswith(f"{of_machine}."):
                return own + name[len(of_machine) :]
        return name

    def signals(self) -> dict[str, Signal]:
        """The signals by name: "excitation", "driveline.drive_speed", "actuation.initial_force".

        Drive speeds and actuation forces that are numbers are left out.
        """
        values = {
            "excitation": self.excitation,
            "driveline.drive_speed": self.driveline.drive_speed,
            "actuation.initial_force": self.actuation.initial_force,
        }
        return {name: value for name, value in values.items() if isinstance(value, Signal)}

    @property
    def period(self) -> float | None:
        """The period of the torque [s], which runs count; None if none, 0 if it does not vary."""
        return self.excitation.period

    @property
    def one_inertia(self) -> BrakedDriveline | None:
        """The driveline itself, for the solvers of one inertia; None where they do not apply.

        They need one sine as the torque, numbers otherwise, and a force that acts at once. A
        ``Machine`` has the same property.
        """
        values: tuple[Any, ...] = (self.driveline.drive_speed, self.actuation.initial_force)
        numbers = not any(isinstance(one, Signal) for one in values)
        return self if numbers and self.actuation.direct and is_sine(self.excitation) else None

    def replace(self, changes: Mapping[str, Any] | None = None, /, **more: Any) -> BrakedDriveline:
        """A copy with other values, in a mapping (``changes``) or as keywords (``more``).

        Names are SI parameters (``slope=-40.0``), groups (``eta``, ``f``, ``F0``,
        ``alpha``) or whole parts (``brake=...``); a damping ratio of the driveline is given as
        ``damping``. A group changes one SI parameter and
        nothing else: ``eta`` the slope, ``f`` the torque's frequency, ``F0`` the torque's
        amplitude, ``alpha`` the wedge angle. Groups are applied last, on the new SI values.

        Raises ``InputError`` for an unknown name, a value out of range, or a group beside
        the SI parameter that it would change.
        """
        changes = joined_changes(changes, more, "system.replace(slope=-40.0)")
        given_parts = {name: changes[name] for name in PARTS if name in changes}
        system = BrakedDriveline(**self.parts() | given_parts) if given_parts else self
        parts = system.parts()
        owners = _owners(parts)
        stated = {
            name: _groups.check_group(name, value)
            for name, value in changes.items()
            if name in _groups.SETTERS
        }
        others = (*PARTS, *stated)
        si = {name: value for name, value in changes.items() if name not in others}
        system._check_parameters(si, owners)
        for name in stated:
            target = _groups.SETTERS[name].target
            if target in si:
                raise InputError(
                    f"{name} and {target}: both given, but {name} sets {target}. Give one."
                )
        of_part: dict[str, dict[str, Any]] = {}
        for name, value in si.items():
            of_part.setdefault(owners[name], {})[name] = value
        for part in sorted(of_part, key=PARTS.index):
            parts[part] = _changed(parts[part], of_part[part])
        if si:
            system = BrakedDriveline(**parts)
        for name, value in stated.items():
            system = system._with_group(name, value)
        if system is self:
            system = BrakedDriveline(**parts)
        if stated:
            system._stated = stated
        if earlier := self.stated:
            system._earlier = earlier, self._groups_of_parts
        return system

    def machine_at(
        self, values: Mapping[str, float], initial: Sequence[float] | None = None
    ) -> Machine:
        """The machine with other values, also of ``initial_angle`` and ``initial_velocity``."""
        changes, start = dict(values), dict(zip(INITIAL, initial or (0.0, 0.0), strict=True))
        start |= {name: changes.pop(name) for name in INITIAL if name in changes}
        machine = self.replace(changes).machine
        return machine.started_at(*start.values()) if any(start.values()) else machine

    def _check_parameters(self, changes: Mapping[str, Any], known: Collection[str]) -> None:
        """Refuse names that are not known, and the damping ratio of a lag that does not exist."""
        for name in changes:
            if name not in known:
                hint = self.hint(name, [*known, *_groups.SETTERS, *PARTS])
                raise InputError(
                    f"{name}: no such parameter or group. {hint}",
                    name=name, value=changes[name], allowed=tuple(known),
                )  # fmt: skip
        ratio = changes.get("damping_ratio")
        if ratio is not None and self.actuation.frequency is None:
            raise wrong("damping_ratio", ratio, "left out without a lag of second order", _RATIO)

    def _with_group(self, name: str, value: float) -> BrakedDriveline:
        if getattr(self._groups_of_parts, name) == value:
            return self
        target = _groups.SETTERS[name].target
        si = _groups.SETTERS[name].value(self, value)
        owner = _groups.SETTERS[name].part
        try:
            part = _changed(getattr(self, owner), {target: si})
        except InputError as error:
            raise InputError.of(f"groups.{name}", value, f"sets {error}") from None
        return BrakedDriveline(**{**self.parts(), owner: part})

    def parts(self) -> dict[str, Part]:
        """The parts by name."""
        return {name: getattr(self, name) for name in PARTS}

    def owner(self, name: str) -> str:
        """The name of the part that has a parameter."""
        return _owners(self.parts())[name]

    def affecting(self, part: str, names: Collection[str]) -> set[str]:
        """Which of some parameters and groups can change a part: its own, and what groups read.

        part  : name of the part
        names : of the parameters and groups
        """
        own = {name for name in type(getattr(self, part)).model_fields if self.owner(name) == part}
        wanted = set(own)
        for name in names:
            if name in _groups.SETTERS and _groups.SETTERS[name].target in own:
                wanted |= {name, *_groups.SETTERS[name].reads}
        if "kinetic" in wanted:  # any parameter of the law may decide on its reference coefficient
            wanted |= set(type(self.friction).model_fields)
        return wanted.intersection(names)

    @property
    def initial_conditions(self) -> tuple[str, ...]:
        """Names of the initial angle and velocity."""
        return tuple(INITIAL)

    def parameters(self) -> dict[str, float]:
        """All numbers by name, without the groups [SI units]."""
        owners = _owners(self.parts())
        values = {
            name: getattr(getattr(self, owners[name]), name)
            for name in self.quantities()
            if name in owners
        }
        return {name: value for name, value in values.items() if is_number(value)}

    def names(self) -> list[str]:
        """The names that ``replace`` takes: parameters, groups and parts."""
        return [*_owners(self.parts()), *_groups.SETTERS, *PARTS]

    def quantities(self) -> dict[str, Quantity]:
        """Everything that can be swept, by name."""
        return quantities(map(type, self.parts().values()))

    def hint(self, name: str, allowed: Collection[str]) -> str:
        """A sentence that helps with a name that is not among the allowed ones."""
        table, _, rest = name.partition(".")
        if name in ("damping_ratio", "driveline.damping_ratio"):
            return _RATIO
        if rest in allowed and table in (*PARTS, "groups"):
            return f"Write the name without its table: {rest}."
        for table, kinds in CHOSEN.items():
            others = [repr(kind) for kind, one in sorted(kinds.items()) if name in one.model_fields]
            if others:
                kind = getattr(self, table).kind_or_class
                return (
                    f"It is a parameter of a {table} of kind {' or '.join(others)}, but here the"
                    f" {table} is of kind {kind!r}: change the kind first."
                )
        return nearest(name, allowed)

    def value(self, name: str) -> float:
        """Value of the parameter or group with this name.

        Raises ``InputError`` for one that has no value, such as ``alpha`` of a band brake.
        """
        owner = self.groups if name in _groups.SETTERS else getattr(self, self.owner(name))
        found = getattr(owner, name)
        if found is None:
            raise InputError(
                f"{name}: has no value for this system. Use other parameters.", name=name
            )
        return float(found)

    def summary(self, swept: Collection[str] = ()) -> str:
        """Brake, friction, and the groups that the ``swept`` parameters do not change."""
        values = self.groups.as_dict()
        groups = [
            f"{name} = {values[name]:.6g}"
            for name, setter in _groups.SETTERS.items()
            if values[name] is not None and not {name, setter.target, *setter.reads} & set(swept)
        ]
        friction = type(self.friction).__name__.removesuffix("Friction")
        brake = type(self.brake).__name__.removesuffix("Brake")
        return f"{brake} brake, {friction} friction" + (": " + ", ".join(groups) if groups else "")

    def as_dict(self) -> dict[str, dict[str, Any]]:
        """The system as plain tables, as a study file holds them.

        A part without a name in study files is called by its class, without the functions that
        it holds.
        """
        tables: dict[str, dict[str, Any]] = {}
        for name, part in self.parts().items():
            has_kind = isinstance(part, Chosen) and not isinstance(part, HarmonicTorque)
            tables[name] = plain_table(part) if has_kind else plain_fields(part)
        return tables

    def _headline(self) -> str:
        groups = {k: v for k, v in self.groups.as_dict().items() if k in _groups.SETTERS}
        said = ", ".join(f"{name} = {v:.6g}" for name, v in groups.items() if v is not None)
        return f"{type(self.brake).__name__}, {type(self.friction).__name__}: {said}"

    def _rows(self) -> Iterator[tuple[str, Any, str]]:
        for name, part in self.parts().items():
            yield from part_rows(name, part, type(part).model_fields)


# Drivelines with the same values share these parts of their machines, so that results for them are
# recognised without a comparison of all numbers.
@lru_cache(maxsize=64)
def _inertia(value: float) -> Inertia:
    return Inertia.model_construct(name="driveline", inertia=value)


@lru_cache(maxsize=64)
def _shaft(stiffness: float, damping: float) -> Shaft:
    return Shaft.model_construct(
        a="driveline", b=GROUND, name="shaft", stiffness=stiffness, damping=damping
    )


@lru_cache(maxsize=64)
def _torque(signal: Signal) -> Torque:
    return Torque.model_construct(on="driveline", signal=signal, name="torque")


def driveline_of(machine: Machine) -> BrakedDriveline | None:
    """The driveline with the same motion as a machine; None if there is none.

    Such a machine has one inertia on shafts to the ground, one contact, whose force acts at once,
    and one torque, a sine of phase 0; its other values are numbers.
    """
    if not len(machine.inertias) == len(machine.contacts) == len(machine.torques) == 1:
        return None
    if machine.controllers:
        return None
    (inertia,), (contact,), (torque,) = machine.inertias, machine.contacts, machine.torques
    actuation, speed, sine = contact.actuation, contact.base_speed, torque.over_time
    if sine is None:
        return None
    if not isinstance(sine, HarmonicTorque):
        sine = sine.primitive()
        if not isinstance(sine, Harmonic) or sine.amplitude < 0.0 or sine.phase != 0.0:
            return None
        sine = HarmonicTorque.model_construct(amplitude=sine.amplitude, frequency=sine.frequency)
    if isinstance(speed, Signal) or not actuation.immediate or contact.normal:
        return None
    shafts = [one.stiffness for one in machine.shafts if not isinstance(one.stiffness, Stages)]
    if len(shafts) < len(machine.shafts) or any(one.law or one.rest for one in machine.shafts):
        return None
    # Without the checks of its parts: those of the machine have been checked.
    line = Driveline.model_construct(
        inertia=inertia.inertia, damping=sum((one.damping for one in machine.shafts), 0.0),
        stiffness=sum(shafts, 0.0), drive_speed=0.0 - speed,
    )  # fmt: skip
    found = BrakedDriveline.model_construct(
        driveline=line, brake=contact.brake, friction=contact.friction, actuation=actuation,
        excitation=sine,
    )  # fmt: skip
    return found.one_inertia


def quantities(models: Iterable[type[Part]]) -> dict[str, Quantity]:
    """The numeric parameters of some parts, the groups, and the initial conditions."""
    found: dict[str, Quantity] = {}
    for model in models:
        for name, field in model.model_fields.items():
            if is_numeric(field) and name not in model.later:
                found.setdefault(name, Quantity.of(name, field))
    setters = _groups.SETTERS.items()
    return {**found, **{n: Quantity(n, "1", one.meaning) for n, one in setters}, **INITIAL}


def is_sine(torque: Signal) -> bool:
    """True for a ``HarmonicTorque`` without further orders."""
    return isinstance(torque, HarmonicTorque) and not any(share for _, share, _ in torque.orders)


def _owners(parts: Mapping[str, Part]) -> dict[str, str]:
    """The part of each field; if two parts have it, the later one, as for ``frequency``."""
    return _owners_in(tuple(type(parts[name]) for name in PARTS))


@lru_cache(maxsize=256)
def _owners_in(types: tuple[type[Part], ...]) -> dict[str, str]:
    return {
        field: name for name, one in zip(PARTS, types, strict=True) for field in one.model_fields
    }


def _changed(part: Part, values: dict[str, Any]) -> Part:
    """A copy of ``part`` with other values; what was left to a default stays so."""
    return type(part)(**{**given(part), **values})
