"""The values of a system by the names that ``replace`` takes, and its brakes and friction laws."""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache
from typing import Any, NamedTuple

from pydantic.fields import FieldInfo

from wedgebrake.model.brakes import Brake
from wedgebrake.model.friction import Friction
from wedgebrake.model.groups import SETTERS
from wedgebrake.model.machine_names import values
from wedgebrake.model.part import Part
from wedgebrake.model.signals.signals import Signal
from wedgebrake.model.studies.study import Study
from wedgebrake.model.studies.study_run import RunSettings
from wedgebrake.model.validation import is_number

# Fields whose word is not their name, by the table of their part.
_OTHER_WORDS = {
    ("inertia", "angle"): "initial_angle",
    ("inertia", "speed"): "initial_speed",
    ("actuation", "frequency"): "lag_frequency",
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
    def given(self) -> bool:
        """False for a field of an actuator stage or of a further order that is not used."""
        name = next(key for key, one in type(self.owner).model_fields.items() if one is self.field)
        return name not in self.owner.later or self.value != self.field.default


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
    last, owner = name.rpartition(".")[2], values_of(system)[name].owner
    if isinstance(owner, Signal) and last not in _OF_SIGNALS:
        return f"signal {last}"
    return _OTHER_WORDS.get((owner.table, last), last)


def nameable(study: Study) -> Study:
    """The study, or that of the equivalent machine, so that all numbers have names to edit them."""
    system: Any = study.system
    names = system.names()
    found = values_of(system).items()
    hidden = any(
        (is_number(one.value) and name not in names) or name in one.owner.later
        for name, one in found
    )
    if system.machine is system or not hidden:
        return study
    run = study.run
    period = getattr(system.excitation, "period", None) or 0.1
    duration = (run.periods or 250) * period if run.duration is None else run.duration
    more: Any = {name: getattr(run, name) for name in ("start_time", "method", "max_events")}
    return Study(system.machine.started_at(*run.initial), RunSettings(duration=duration, **more))
