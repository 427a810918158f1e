"""The machine: inertias, shafts, contacts, torques, joints and controllers."""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Iterator, Mapping, Sequence
from functools import cache
from typing import TYPE_CHECKING, Annotated, Any, ClassVar

from pydantic import InstanceOf, PlainValidator, ValidationInfo, field_validator, model_validator

from wedgebrake.errors import InputError, nearest
from wedgebrake.model.controller import COMMAND, Controller
from wedgebrake.model.display import unit_of
from wedgebrake.model.groups import SETTERS, Groups, Oscillator, compute
from wedgebrake.model.joints import started_together, without_dependent
from wedgebrake.model.machine_names import numbers, replaced
from wedgebrake.model.machine_parts import (
    GROUND,
    Body,
    Contact,
    Driven,
    Gear,
    Inertia,
    Joint,
    Named,
    OverState,
    Planetary,
    Rigid,
    Shaft,
    Torque,
)
from wedgebrake.model.part import SMALLEST, Part, Quantity, parameter, plain_table
from wedgebrake.model.signals.signals import Signal
from wedgebrake.model.system_base import System
from wedgebrake.model.torque_contacts import TORQUE_CONTACTS, TorqueContact
from wedgebrake.model.validation import NotAllowedError, unknown, wrong
from wedgebrake.model.view import MACHINE, View

if TYPE_CHECKING:
    from wedgebrake.model.system import BrakedDriveline

KINDS: dict[str, type[Named]] = {
    "inertias": Inertia, "shafts": Shaft, "contacts": Contact, "torques": Torque,
    "joints": Gear,
    "controllers": Controller,
}  # fmt: skip
"""Lists of parts. Those in ``FURTHER`` have further classes of parts, with tables of their own."""
FURTHER: dict[str, tuple[type[Named], ...]] = {
    "inertias": (Driven,), "contacts": TORQUE_CONTACTS, "joints": (Planetary, Rigid),
}  # fmt: skip
KIND_WORDS = {
    "inertia": ("inertia", "inertias"), "driven": ("driven body", "driven bodies"),
    "one_way_clutch": ("one-way clutch", "one-way clutches"),
    "planetary": ("planetary gear", "planetary gears"),
    "rigid": ("rigid joint", "rigid joints"),
}  # fmt: skip
"""One part, and several, in words, by table, where they differ from the table."""
_OF_ONE_INERTIA = ("inertias", "shafts", "contacts", "torques")
_Numbers = float | Sequence[float]


def _parts(description: str, example: str, **extra: Any) -> Any:
    return parameter(description, unit="-", example=example, strict=False, **extra)


@cache
def _list_of(part: type[Named]) -> str:
    """The list of a machine to which parts of a class belong; empty for anything else."""
    found = (kind for kind in KINDS if issubclass(part, (KINDS[kind], *FURTHER.get(kind, ()))))
    return next(found, "")


@cache
def _rank(part: type[Named]) -> int:
    """Place of the class of a part among those of its list, as in study files."""
    kind = _list_of(part)
    return [issubclass(part, one) for one in (KINDS[kind], *FURTHER.get(kind, ()))].index(True)


def _contact(value: Any) -> Any:
    if isinstance(value, Contact | TorqueContact):
        return value
    others = " or ".join(one.__name__ for one in TORQUE_CONTACTS)
    raise NotAllowedError(f"a Contact, {others}")


def _body(value: Any) -> Any:
    if isinstance(value, Inertia | Driven):
        return value
    raise NotAllowedError("an Inertia or a Driven")


def _joint(value: Any) -> Any:
    if isinstance(value, Joint):
        return value
    raise NotAllowedError("a Gear, a Planetary or a Rigid")


_AnyJoint = Annotated[Joint, PlainValidator(_joint)]
_AnyBody = Annotated[Body, PlainValidator(_body)]
# A ``TorqueContact`` has the attributes of a ``Contact`` that solvers use.
_AnyContact = Annotated[Contact, PlainValidator(_contact)]


class Machine(System):
    """A machine of inertias, shafts, contacts, torques, rigid joints and feedback controllers.

    Immutable, in SI units; two machines are equal if all their parts are. Shafts, contacts, torques
    and joints refer to inertias by name; "ground" is the ground. No two parts may have the same
    name. Each list is sorted by class, as in study files: inertias before driven bodies, contacts
    before one-way clutches and drag. Angles and speeds at the start that are left out follow from
    the others where the joints determine them; otherwise they are 0.
    """

    table: ClassVar[str] = "machine"
    default_length: ClassVar[Mapping[str, Any]] = {"duration": 10.0}
    elsewhere: ClassVar[Mapping[str, str]] = {
        "initial": "belongs to drivelines. Give the angle and speed of an inertia (disc.speed=30).",
        **dict.fromkeys(
            SETTERS,
            "groups belong to a brake on a driveline. Set a parameter of the machine, for example"
            " brake.slope.",
        ),
    }
    holds_start: ClassVar[bool] = True
    view: ClassVar[View] = MACHINE

    inertias: tuple[_AnyBody, ...] = _parts(
        "rotating bodies, one or more, also driven ones", '[wb.Inertia("disc", 1.0)]', min_length=1
    )
    shafts: tuple[InstanceOf[Shaft], ...] = _parts(
        "springs and dampers between them", '[wb.Shaft("motor", "disc", stiffness=2e4)]', default=()
    )
    contacts: tuple[_AnyContact, ...] = _parts(
        "brakes and clutches, also one-way clutches and drag",
        '[wb.Contact("disc", name="brake", brake=..., friction=..., actuation=...)]',
        default=(),
    )
    torques: tuple[InstanceOf[Torque], ...] = _parts(
        "torques on them",
        '[wb.Torque("disc", wb.Harmonic(500.0, 10.03), name="engine")]',
        default=(),
    )
    joints: tuple[_AnyJoint, ...] = _parts(
        "gears, planetary gears and rigid joints between them",
        '[wb.Gear("motor", "disc", 3.5)]',
        default=(),
    )
    controllers: tuple[InstanceOf[Controller], ...] = _parts(
        "feedback controllers",
        '[wb.Controller("loop", {"disc.speed": 1.0}, 10.0, "disc.torque", proportional=20.0)]',
        default=(),
    )

    if TYPE_CHECKING:

        def __init__(self, /, **data: Any) -> None: ...

    @field_validator(*KINDS, mode="before")
    @classmethod
    def _in_its_list(cls, value: Any, info: ValidationInfo) -> Any:
        """Refuse a part alone, and parts of another list."""
        kind = str(info.field_name)
        if isinstance(value, Part | Mapping):
            raise NotAllowedError("a list of parts", f"Write {kind}=[...], with brackets.")
        for number, part in enumerate(value if isinstance(value, list | tuple) else ()):
            other = _list_of(part.__class__)
            if other and other != kind:
                name, allowed = f"{kind}.[{number}]", f"in the list {other}"
                raise wrong(name, part, allowed, f"Write {other}=[wb.{type(part).__name__}(...)].")
        return value

    @field_validator(*FURTHER)
    @classmethod
    def _by_table(cls, parts: tuple[Any, ...]) -> tuple[Any, ...]:
        """Sort parts in the order of study files: inertias, then driven bodies, for example."""
        return tuple(sorted(parts, key=lambda part: _rank(part.__class__)))

    @field_validator("shafts", "torques", "joints")
    @classmethod
    def _told_apart(cls, parts: tuple[Any, ...]) -> tuple[Any, ...]:
        """Number the default names of parts between the same ends, and of torques on one body."""
        taken, found = {one.name for one in parts if "name" in one.model_fields_set}, []
        for one in parts:
            name, number = one.name, 2
            if "name" not in one.model_fields_set:
                while name in taken:
                    name, number = f"{one.name}-{number}", number + 1
            taken.add(name)
            found.append(one if name == one.name else one.model_copy(update={"name": name}))
        return tuple(found)

    @model_validator(mode="after")
    def _joined(self) -> Machine:
        seen: dict[str, str] = {}
        for part, place in self._places():
            if part.name in seen:
                raise wrong(
                    f"{place}.name", part.name, "a name that no other part has",
                    f"machine.{seen[part.name]} has it; give name=... to one of them.",
                )  # fmt: skip
            seen[part.name] = place
        driven = [one.name for one in self.inertias if isinstance(one, Driven)]
        names = [one.name for one in self.inertias]
        if len(driven) == len(names):
            raise wrong(
                "inertias", tuple(names), "a list with an inertia that moves freely",
                "Add wb.Inertia(name, inertia).",
            )  # fmt: skip
        for shaft in self.shafts:
            _check_joined(shaft, "a", names)
            _check_joined(shaft, "b", [*names, GROUND])
        for contact in self.contacts:
            _check_contact(contact, names, driven)
        for torque in self.torques:
            _check_joined(torque, "on", [one for one in names if one not in driven])
            if torque.relative_to is not None:
                _check_joined(torque, "relative_to", names)
        for joint in self.joints:
            for end in joint.ends:
                _check_joined(joint, end, names)
        self.__dict__["inertias"] = started_together(self)
        for one in self.controllers:
            _check_measured(one, self)
            _check_output(one, self)
        self._close_loops()
        return self

    def _close_loops(self) -> None:
        """Let the actuations know whether controllers command or measure their forces."""
        loops = {one.acts_on[0] for one in self.controllers}
        loops |= {name.rpartition(".")[0] for one in self.controllers for name in one.measured}
        if any(one.actuation.is_in_loop != (one.name in loops) for one in self.contacts):
            contacts = tuple(one.in_loop(one.name in loops) for one in self.contacts)
            self.__dict__["contacts"] = contacts  # of a frozen model

    def _places(self) -> Iterator[tuple[Named, str]]:
        """Every part, with its place in the lists of the machine: "shafts[0]"."""
        for kind in KINDS:
            for i, part in enumerate(getattr(self, kind)):
                yield part, f"{kind}[{i}]"

    def parts(self) -> dict[str, Named]:
        """All parts by name, in order."""
        return {part.name: part for part, _ in self._places()}

    def signals(self) -> dict[str, Signal]:
        """The signals by dotted name: "engine.signal", "brake.initial_force", "brake.base_speed".

        Actuation forces and speeds that are numbers are left out.
        """
        found = {
            f"{one.name}.signal": one.over_time for one in self.torques if one.over_time is not None
        }
        for torque in self.torques:
            if isinstance(torque.signal, OverState) and isinstance(torque.signal.scale, Signal):
                found[f"{torque.name}.scale"] = torque.signal.scale
        for body in self.driven:
            if isinstance(body.speed, Signal):
                found[f"{body.name}.speed"] = body.speed
        for one in self.contacts:
            values = {"initial_force": one.actuation.initial_force, "base_speed": one.base_speed}
            for name, value in values.items():
                if isinstance(value, Signal):
                    found[f"{one.name}.{name}"] = value
        for loop in self.controllers:
            if isinstance(loop.setpoint, Signal):
                found[f"{loop.name}.setpoint"] = loop.setpoint
        return found

    @property
    def returns(self) -> str:
        """What counts the returns of a motion: "periods", or "crossings" if no signal varies."""
        return "crossings" if self.autonomous else "periods"

    def parameters(self) -> dict[str, float]:
        """All numbers of the machine by dotted name, such as "brake.slope" [SI units]."""
        return {name: one.value for name, one in numbers(self.parts()).items()}

    def owner(self, name: str) -> str:
        """The name of the part that has a parameter, the first word of its dotted name."""
        return name.partition(".")[0]

    @property
    def groups(self) -> Groups:
        """The normalised groups (docs/equations.md, "Normalised groups").

        They are defined for one inertia with one linear shaft to the ground, one contact with the
        ground and one torque over time; all are None for any other machine.
        """
        counts = [len(getattr(self, kind)) for kind in KINDS]
        if counts != [kind in _OF_ONE_INERTIA for kind in KINDS] or {
            self.shafts[0].b,
            self.contacts[0].b,
        } != {GROUND}:
            return Groups()
        (body,), (shaft,), (contact,), (torque,) = (getattr(self, kind) for kind in _OF_ONE_INERTIA)
        if shaft.law is not None or shaft.rest != 0.0 or torque.over_time is None:
            return Groups()
        speed = contact.base_speed
        return compute(Oscillator(
            body.inertia, shaft.damping, shaft.stiffness,
            -speed if isinstance(speed, Signal) else 0.0 - speed,
            contact.brake, contact.friction, contact.actuation, torque.over_time,
        ))  # fmt: skip

    @property
    def initial_conditions(self) -> tuple[str, ...]:
        """Names of the initial angles and speeds that can be swept."""
        return tuple(
            f"{one.name}.{end}"
            for one in self.inertias
            for end in (("angle",) if isinstance(one, Driven) else ("angle", "speed"))
        )

    @property
    def parts_along(self) -> dict[str, tuple[Any, ...]]:
        """The parts along each dimension of results, by the name of the dimension."""
        return {
            "inertia": self.inertias, "shaft": self.shafts, "contact": self.contacts,
            "torque": self.torques, "controller": self.controllers, "driven": self.driven,
        }  # fmt: skip

    @property
    def inertia_names(self) -> tuple[str, ...]:
        """Names of the inertias."""
        return tuple(one.name for one in self.inertias)

    @property
    def contact_names(self) -> tuple[str, ...]:
        """Names of the contacts."""
        return tuple(one.name for one in self.contacts)

    def names(self) -> list[str]:
        """The names that ``replace`` takes: numbers by dotted name, and parts."""
        return [*self.parameters(), *self.parts(), *KINDS]

    def checks_itself(self, name: str) -> bool:
        """True for dotted names: of a value that is no number, or of a signal to come."""
        return "." in name

    def quantities(self) -> dict[str, Quantity]:
        """Everything that can be swept, by dotted name."""
        return {name: Quantity.of(name, one.field) for name, one in numbers(self.parts()).items()}

    def hint(self, name: str, allowed: Collection[str]) -> str:
        """A sentence that helps with a name that is not among the allowed ones."""
        found = [] if "." in name else [one for one in allowed if one.rpartition(".")[2] == name]
        return f"Name its part too: {', '.join(found)}." if found else nearest(name, allowed)

    def affecting(self, part: str, names: Collection[str]) -> set[str]:
        """Which of some numbers can change a part of the driveline that one inertia is.

        names : of the numbers
        part  : "driveline", "brake", "friction", "actuation" or "excitation"
        """
        starts = {f"{one}.{end}" for one in self.inertia_names for end in ("angle", "speed")}
        torques = {one.name for one in self.torques}
        of_driveline = {*self.inertia_names, *(one.name for one in self.shafts)}
        wanted = set()
        for name in set(names) - starts:
            owners = {name.partition(".")[0]}
            reaches = {
                "excitation": owners & torques,
                # The speed of the base is that of the driveline's shaft.
                "driveline": owners & of_driveline or ".base_speed" in name,
            }.get(part, owners & set(self.contact_names))
            wanted |= {name} if reaches else set()
        return wanted

    @property
    def unreduced(self) -> Machine:
        """The machine itself, also if it has contacts with driven bodies."""
        return self

    @property
    def machine(self) -> Machine:
        """The machine as solvers take it; a ``BrakedDriveline`` has the same property.

        It is the machine itself, except that contacts with driven bodies have moving bases.
        """
        speeds = {one.name: one.speed for one in self.inertias if isinstance(one, Driven)}
        if not any(one.b in speeds for one in self.contacts):
            return self
        contacts = tuple(
            one.on_base(speeds[one.b]) if one.b in speeds else one for one in self.contacts
        )
        return self.model_copy(update={"contacts": contacts})

    @property
    def driven(self) -> tuple[Driven, ...]:
        """The driven bodies, which are the last ones of ``inertias``."""
        return tuple(one for one in self.inertias if isinstance(one, Driven))

    @property
    def one_inertia(self) -> BrakedDriveline | None:
        """The driveline with the same motion; None if there is none, see ``driveline_of``."""
        from wedgebrake.model.system import driveline_of

        return driveline_of(self)

    def value(self, name: str) -> float:
        """Number of the machine, by dotted ``name`` [SI units]."""
        first = self.owner(name)
        return float(numbers({first: self.parts()[first]})[name].value)

    def replace(self, changes: Mapping[str, Any] | None = None, /, **more: Any) -> Machine:
        """A copy with other values.

        changes : the new values by dotted name: "disc.inertia", "brake.slope" (of the contact
                  "brake", its brake, friction or actuation), "engine.amplitude" (of the signal of
                  the torque "engine"); or whole parts, "brake.friction", "brake"
        more    : the same as keywords; ``inertias``, ``shafts``, ``contacts``, ``torques``,
                  ``joints`` or ``controllers`` replace all parts of a kind

        Raises ``InputError`` for an unknown name or a value that is not allowed.
        """
        values = joined_changes(changes, more, 'machine.replace({"brake.slope": -40.0})')
        lists = {kind: values.pop(kind, getattr(self, kind)) for kind in KINDS}
        try:
            parts = {one.name: one for parts in lists.values() for one in parts}
        except (TypeError, AttributeError):  # no lists of parts
            return Machine(**lists)  # raises an error that names the wrong one
        new = replaced(parts, values)
        return Machine(**{kind: [new[one.name] for one in parts] for kind, parts in lists.items()})

    def machine_at(
        self,
        values: Mapping[str, float],
        initial: Sequence[float] | None = None,  # noqa: ARG002 - its inertias hold it
    ) -> Machine:
        """A copy with other values; initial angles and speeds are among them."""
        return self.replace(values)

    def started_at(self, angles: _Numbers, speeds: _Numbers) -> Machine:
        """A copy with other initial angles [rad] and speeds [rad/s], one of each by inertia.

        Numbers are those of the only inertia. The speed of a driven body does not change. Raises
        ``InputError`` for values that contradict a joint.
        """
        # A decayed vibration may end at values that are too small for a parameter.
        starts = [
            [0.0 if abs(value) < SMALLEST else value for value in _sequence(values)]
            for values in (angles, speeds)
        ]
        for name, values in zip(("angles", "speeds"), starts, strict=True):
            if len(values) != len(self.inertias):
                names = ", ".join(self.inertia_names)
                raise wrong(name, values, f"a list of {len(self.inertias)} values, of {names}")
        each = zip(self.inertias, *starts, strict=True)
        started = self.replace(inertias=[_started(one, *to) for one, *to in each])
        return started.replace(inertias=without_dependent(started)) if self.joints else started

    def summary(self, swept: Collection[str] = ()) -> str:  # noqa: ARG002 - it has no groups
        """The number of parts of each kind."""
        return self._headline()

    def as_dict(self) -> dict[str, list[dict[str, Any]]]:
        """The machine as plain tables, as a study file holds them; empty lists are left out.

        A brake or law without a kind is named by its class, and its functions are left out.
        """
        tables: dict[str, list[dict[str, Any]]] = {}
        for part, _ in self._places():
            tables.setdefault(part.table, []).append(plain_table(part))
        return tables

    def __repr__(self) -> str:
        return self._headline()

    __str__ = __repr__

    def _headline(self) -> str:
        counts = Counter(part.table for part, _ in self._places())
        said = (
            f"{count} {KIND_WORDS.get(table, (table, f'{table}s'))[count > 1]}"
            for table, count in counts.items()
        )
        return f"Machine of {', '.join(said)}"

    def _rows(self) -> Iterator[tuple[str, Any, str]]:
        for name, one in numbers(self.parts()).items():
            yield name, one.value, unit_of(one.field)

    def index(self, name: str) -> int:
        """Return the index in ``inertias`` of an inertia, by its ``name``; -1 for "ground"."""
        if name == GROUND:
            return -1
        names = [one.name for one in self.inertias]
        if name not in names:
            raise unknown("name", name, [*names, GROUND], "no such inertia")
        return names.index(name)


WITH_SPEEDS = "Give the speeds of the inertias to wb.stability."
_WAYS_OUT = {
    "driven": "Use wb.simulate or wb.motion, or give a contact a base_speed.",
    "joints": "Give one inertia in place of those that it joins, or a stiff shaft.",
    "controllers": "Use wb.simulate or wb.motion.",
}


def check_without(machine: Machine, kind: str, what: str, way_out: str = "") -> None:
    """Raise ``InputError`` for a machine with parts of a kind.

    kind    : "driven", "joints" (contacts with ratios among them) or "controllers"
    what    : what cannot take such a machine
    way_out : what to do instead, if there is something better than usual
    """
    advice = way_out or _WAYS_OUT[kind]
    for one in getattr(machine, kind):
        allowed = f"left out for {what}"
        raise InputError.of(
            one.name, one, f"must be {allowed}. {advice}", allowed=allowed, said=type(one).__name__
        )
    geared = [one for one in machine.contacts if one.geared] if kind == "joints" else []
    for one in geared:
        raise wrong(f"{one.name}.ratio", one.ratio, f"left out for {what}", advice)


def joined_changes(changes: Any, more: Mapping[str, Any], example: str) -> dict[str, Any]:
    """The changes of ``replace`` from its mapping and its keywords.

    Raises ``InputError`` for anything but a mapping.
    """
    if changes is not None and not isinstance(changes, Mapping):
        raise wrong("changes", changes, "values by name", f"For example {example}.")
    return {**(changes or {}), **more}


def _started(body: Body, angle: float, speed: float) -> Body:
    """A copy of a body with another initial angle, and the speed of an inertia."""
    if isinstance(body, Driven):
        return Driven(body.name, body.speed, angle)
    return Inertia(body.name, body.inertia, angle, speed)


def _sequence(values: _Numbers) -> Sequence[float]:
    return values if isinstance(values, Sequence) else (values,)


def _check_contact(contact: Contact, names: list[str], driven: list[str]) -> None:
    first, second = contact.ends
    _check_joined(contact, first, names)
    _check_joined(contact, second, [*names, GROUND])
    for name, factor in contact.normal.items():
        if name.rpartition(".")[0] not in names:
            ends = [f"{one}.{end}" for one in names for end in ("angle", "speed")]
            raise unknown(f"{contact.name}.normal.{name}", factor, ends, "no such quantity")
    if contact.a in driven:
        raise wrong(
            f"{contact.name}.{first}", contact.a, "the name of an inertia",
            f"Give the driven body as {second}, and the inertia as {first}.",
        )  # fmt: skip


def _check_joined(part: Named, field: str, names: list[str]) -> None:
    value = getattr(part, field)
    if value not in names:
        raise unknown(f"{part.name}.{field}", value, names, "no such inertia")


_MEASURED_OF = {"angle": "inertia", "speed": "inertia", "torque": "shaft", "force": "contact"}


def _check_measured(loop: Controller, machine: Machine) -> None:
    """Raise ``InputError`` for quantities that do not exist or that follow the output at once."""
    contacts = {one.name: one for one in machine.contacts}
    names = {
        "inertia": list(machine.inertia_names),
        "shaft": [one.name for one in machine.shafts],
        "contact": list(contacts),
    }
    for name, factor in loop.measured.items():
        part, _, what = name.rpartition(".")
        if part not in names[_MEASURED_OF[what]]:
            known = [f"{one}.{end}" for end, kind in _MEASURED_OF.items() for one in names[kind]]
            raise unknown(f"{loop.name}.measured", name, known, "no such quantity")
        if what == "force" and not contacts[part].actuation.order:
            raise wrong(
                f"{loop.name}.measured.{name}", factor,
                "the force of an actuation with a lag, or of second order",
                "Without a lag the force equals its command and needs no control. Give"
                f" {part}.lag.",
            )  # fmt: skip


def _check_output(loop: Controller, machine: Machine) -> None:
    """Raise ``InputError`` for an output that does not act on an inertia or a contact."""
    part, what = loop.acts_on
    if what != COMMAND:
        free = [one.name for one in machine.inertias if not isinstance(one, Driven)]
        if part not in free:
            known = [f"{one}.{what}" for one in free]
            raise unknown(f"{loop.name}.output", loop.output, known, "no such inertia")
        return
    contacts = {one.name: one for one in machine.contacts if isinstance(one, Contact)}
    if part not in contacts:
        known = [f"{one}.{what}" for one in contacts]
        raise unknown(f"{loop.name}.output", loop.output, known, "no such contact")
    if not contacts[part].actuation.release:
        raise wrong(
            f"{part}.release", False, "True if a controller adds to the command",
            "The law without release requires a force that follows the speed at once.",
        )  # fmt: skip
