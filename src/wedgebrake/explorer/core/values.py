"""The values of a system by the names that ``replace`` takes, and its brakes and friction laws."""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache
from typing import Any, Literal, NamedTuple, get_args, get_origin

from pydantic.fields import FieldInfo

from wedgebrake.model.brakes import Brake
from wedgebrake.model.controller import Controller
from wedgebrake.model.friction import Friction
from wedgebrake.model.groups import SETTERS
from wedgebrake.model.joints import reduction
from wedgebrake.model.machine_names import values
from wedgebrake.model.machine_parts import GROUND, Driven, OverState
from wedgebrake.model.part import Part
from wedgebrake.model.signals.signals import Signal
from wedgebrake.model.studies.study import Study
from wedgebrake.model.studies.study_run import RunSettings
from wedgebrake.model.validation import is_number

# Fields whose word is not their name, by the table of their part.
_OTHER_WORDS = {
    ("inertia", "angle"): "initial_angle",
    ("inertia", "speed"): "initial_speed",
    ("driven", "angle"): "initial_angle",
    ("driven", "speed"): "driven_speed",
    ("planetary", "ratio"): "teeth",
    ("actuation", "frequency"): "lag_frequency",
}
# Numbers of which few are allowed, with their words.
_CHOICES = {
    ("one_way_clutch", "direction"): ((1.0, "a no faster than b"), (-1.0, "a no slower than b")),
}
# Fields of signals with words of their own.
_OF_SIGNALS = ("amplitude", "frequency", "phase")


class ShownValue(NamedTuple):
    """A value, the field that describes it, the part that has the field, and the part shown."""

    value: Any
    field: FieldInfo
    owner: Part
    section: str

    @property
    def word(self) -> str:
        """The name of the field: "gap" of "stop.gap.0"."""
        return next(key for key, one in type(self.owner).model_fields.items() if one is self.field)

    @property
    def whole(self) -> Any:
        """The value of the field, of which this value may be an entry."""
        return getattr(self.owner, self.word)

    @property
    def given(self) -> bool:
        """False for a value that is not used, or that has only one possible value."""
        word, end = self.word, getattr(self.owner, "b", GROUND)
        if word in self.owner.later and self.value == self.field.default:
            return False
        if isinstance(self.owner, Controller) and word in ("delay", "derivative"):
            filtered = word == "derivative" and self.owner.filter_time is not None
            return filtered or self.owner.sample_time is not None
        return not (
            (word == "ratio" and end == GROUND and hasattr(self.owner, "b"))
            or (word == "base_speed" and end != GROUND)
        )

    @property
    def choices(self) -> tuple[tuple[Any, str], ...]:
        """The allowed values with their words, if there are few; otherwise none."""
        if get_origin(self.field.annotation) is Literal:
            return tuple((one, str(one)) for one in get_args(self.field.annotation))
        return _CHOICES.get((self.owner.table, self.word), ())


@lru_cache(maxsize=64)
def values_of(system: Any) -> Mapping[str, ShownValue]:
    """All values of a system by name; those that the system does not use are left out."""
    found = {
        name: ShownValue(*one, section)
        for section, part in system.parts().items()
        for name, one in values(part).items()
    }
    return {name: one for name, one in found.items() if one.given}


@lru_cache(maxsize=64)
def chosen_of(system: Any) -> Mapping[str, Brake | Friction]:
    """The brakes and friction laws of a system, by the names that ``replace`` takes."""
    parts = {
        name: part
        for section, whole in system.parts().items()
        for name, part in {
            section: whole,
            **{f"{section}.{inner}": part for inner, part in whole.inner().items()},
        }.items()
    }
    return {name: part for name, part in parts.items() if isinstance(part, Brake | Friction)}


def groups_of(system: Any) -> dict[str, float | None]:
    """The normalised groups that a system can be given, by name, None where undefined; or {}."""
    return system.groups.as_dict() if SETTERS.keys() & set(system.names()) else {}


def word_of(system: Any, name: str) -> str:
    """The word for a value, common to all parts that have it: "slope" of "brake.slope"."""
    if name not in values_of(system):
        return name
    one = values_of(system)[name]
    if isinstance(one.owner, Signal | OverState) and one.word not in _OF_SIGNALS:
        return f"signal {one.word}"
    return _OTHER_WORDS.get((one.owner.table, one.word), one.word)


def entry_of(system: Any, name: str) -> str:
    """What names an entry of a list or a mapping: "0" of "stop.gap.0"; empty for other values."""
    one = values_of(system)[name]
    is_entry = isinstance(one.whole, tuple | Mapping) and one.whole is not one.value
    return name.partition(f".{one.word}.")[2] if is_entry else ""


def following(system: Any) -> frozenset[str]:
    """Names of the initial angles and speeds that follow from others by the joints of a machine."""
    machine = system.machine
    if not machine.joints:
        return frozenset()
    free = reduction(machine).free
    return frozenset(
        f"{one.name}.{end}"
        for number, one in enumerate(machine.inertias)
        if number not in free and not isinstance(one, Driven)
        for end in ("angle", "speed")
    )


def nameable(study: Study) -> Study:
    """The study, or that of the equivalent machine, so that all numbers have names to edit them.

    The start of a machine with joints is given by the bodies that do not follow others.
    """
    system: Any = study.system
    machine = system.unreduced
    if machine.joints:
        angles = [one.angle for one in machine.inertias]
        speeds = [0.0 if isinstance(one, Driven) else one.speed for one in machine.inertias]
        return Study(machine.started_at(angles, speeds), study.run, study.sweep)
    names = system.names()
    found = values_of(system).items()
    hidden = any(
        (is_number(one.value) and name not in names) or name in one.owner.later
        for name, one in found
    )
    if machine is system or not hidden:
        return study
    run = study.run
    period = getattr(system.excitation, "period", None) or 0.1
    duration = (run.periods or 250) * period if run.duration is None else run.duration
    more: Any = {name: getattr(run, name) for name in ("start_time", "method", "max_events")}
    return Study(system.machine.started_at(*run.initial), RunSettings(duration=duration, **more))
