"""The machine in a study file: lists of tables, [[inertia]], [[driven]], [[shaft]] and others."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from wedgebrake.errors import InputError
from wedgebrake.model.machine import FURTHER, KINDS, Machine
from wedgebrake.model.machine_parts import Contact, Named, OverState, Stages
from wedgebrake.model.part import Chosen, Part, given
from wedgebrake.model.signals.signals import Constant, Signal
from wedgebrake.model.studies import toml
from wedgebrake.model.studies.records import Records
from wedgebrake.model.studies.tables import make_part
from wedgebrake.model.validation import labels, moved, wrong

TABLES = {kind.table: name for name, kind in KINDS.items()} | {
    kind.table: name for name, kinds in FURTHER.items() for kind in kinds
}
"""Names of the lists of a ``Machine``, by the names of their tables in a study file."""
_FURTHER = {kind.table: kind for kinds in FURTHER.values() for kind in kinds}
_OF_CONTACT = ("brake", "friction", "actuation")
_MOST_WRONG = 8  # parts that are reported
_JOINTS = ("name", "a", "b", "on", "sun", "ring", "carrier")  # fields without comments


def is_machine(tables: Mapping[str, Any]) -> bool:
    """Return True for the tables of a machine, not of a braked driveline."""
    return any(name in TABLES and isinstance(one, list | dict) for name, one in tables.items())


def parse_machine(tables: Mapping[str, Any]) -> Machine:
    """A machine from the tables of a study.

    Raises ``InputError`` that reports the first few wrong parts.
    """
    parts: dict[str, list[Named]] = {}
    wrongs: list[InputError] = []
    for table, name in TABLES.items():
        entries = tables.get(table, [])
        if not isinstance(entries, list):
            raise wrong(
                table, entries, "a list of tables",
                f"Write [[{table}]] above the parameters of each {table}.",
            )  # fmt: skip
        for i, entry in enumerate(entries):
            if len(wrongs) == _MOST_WRONG:
                break
            try:
                parts.setdefault(name, []).append(_part(table, entry, f"{table}[{i}]"))
            except InputError as error:
                wrongs.append(error)
    if wrongs:
        more = "... and perhaps more." if len(wrongs) == _MOST_WRONG else ""
        raise InputError.joined(wrongs, more)
    return Machine(**parts)


def bodies_of(tables: Mapping[str, Any]) -> Machine:
    """The bodies, shafts and joints of a machine from the tables of ``Machine.as_dict``."""
    kept = ("inertias", "shafts", "joints")
    return parse_machine({name: one for name, one in tables.items() if TABLES.get(name) in kept})


def _part(table: str, entry: Any, place: str) -> Named:
    if not isinstance(entry, dict):
        raise wrong(place, entry, f"a table, below a line [[{table}]]")
    kind = _FURTHER.get(table) or KINDS[TABLES[table]]
    if kind is not Contact:
        return kind(**entry)
    values = dict(entry)
    own = values.get("name")
    label = own if isinstance(own, str) else place
    taken = {"kind", *kind.model_fields}
    for inner in _OF_CONTACT:
        one = values.get(inner)
        if one is None:
            raise InputError(
                f"{label}.{inner}: missing. Give it a table [contact.{inner}].",
                name=f"{label}.{inner}", allowed=f"a table [contact.{inner}]",
            )  # fmt: skip
        if not isinstance(one, dict):
            raise wrong(f"{label}.{inner}", one, f"a table, below a line [contact.{inner}]")
        try:
            values[inner] = make_part(inner, one)
        except InputError as error:
            words = {word for one in error.errors for word in (one.name or "").split(".")[1:2]}
            # As in dotted names: "brake.radius", but "brake.brake.kind", as kinds are several.
            plain = isinstance(own, str) and not taken & words
            raise moved(error, label if plain else f"{label}.{inner}") from None
        taken |= set(type(values[inner]).model_fields)
    return kind(**values)


def machine_text(machine: Machine, records: Records | None = None) -> str:
    """A machine as the text of a study file, with the unit or meaning of each value.

    records : receive long tables; by default these are written in the text
    """
    return "\n".join(
        text
        for name in KINDS
        for part in getattr(machine, name)
        for text in _texts(part.table, part, records)
    )


def _texts(table: str, part: Named, records: Records | None) -> Iterator[str]:
    def kept(values: dict[str, Any]) -> dict[str, Any]:
        return values if records is None else records.kept(values, part.name)

    values = {name: value for name, value in given(part).items() if value is not None}
    inner = {name: values.pop(name) for name in _OF_CONTACT if name in values}
    # A name that is not the default comes first.
    first = {"name": values.pop("name")} if "name" in values else {}
    lines = {name: plain_value(value, name == "signal") for name, value in values.items()}
    words = {name: word for name, word in comments(part).items() if name not in _JOINTS}
    yield toml.table(f"[{table}]", first | kept(lines), words)
    for name, one in inner.items():
        kind = {"kind": kind_of(f"{part.name}.{name}", one)} if isinstance(one, Chosen) else {}
        yield toml.table(f"{table}.{name}", kept(kind | plain_given(one)), comments(one))


def kind_of(name: str, part: Chosen) -> str:
    """The kind of a part; raises ``InputError`` for a part without a kind."""
    if not part.kind:
        raise InputError(
            f"{name} = {part.kind_or_class}: has no kind, so that no study file can name it. Use a"
            " brake or friction law with a kind, or keep the program that makes it.",
            name=name, value=part, allowed="a part with a kind",
        )  # fmt: skip
    return part.kind


def plain_given(part: Part) -> dict[str, Any]:
    """The values given to a part, with signals as tables."""
    converts = isinstance(part, Signal)
    return {
        name: plain_value(value, converts)
        for name, value in given(part).items()
        if value is not None
    }


def plain_value(value: Any, converts: bool = False) -> Any:
    """A value as numbers, texts, lists and tables.

    converts : whether a number means a constant signal at this place
    """
    if isinstance(value, Constant) and converts:
        return value.value
    if isinstance(value, Stages):
        return plain_given(value)
    if isinstance(value, Signal | OverState):
        return {"kind": kind_of("signal", value), **plain_given(value)}
    if isinstance(value, tuple | list):
        return [plain_value(one, converts) for one in value]
    return value


def comments(part: Part) -> dict[str, str]:
    """The unit of each field of a part, or its meaning if it has no unit."""
    found = {}
    for name, field in type(part).model_fields.items():
        unit = labels(field).get("unit", "1")
        words = (field.description or "").split(";")[0]
        found[name] = words if unit in ("1", "-") else str(unit)
    return found


def flat_axes(table: Mapping[str, Any], machine: Machine) -> dict[str, Any]:
    """The [sweep] table of a machine, with dotted names in place of inner tables."""
    parts, found = machine.parts(), dict[str, Any]()
    for name, value in table.items():
        found |= _flat({name: value}) if name in parts else {name: value}
    return found


def _flat(table: Mapping[str, Any]) -> dict[str, Any]:
    found: dict[str, Any] = {}
    for name, value in table.items():
        if isinstance(value, dict) and not {"from", "to", "points"} & value.keys():
            found |= {f"{name}.{rest}": one for rest, one in _flat(value).items()}
        else:
            found[name] = value
    return found


def beside_machine(name: str) -> str:
    """The error message for a table of a braked driveline in the study of a machine."""
    return (
        f"[{name}]: given together with {', '.join(f'[[{one}]]' for one in TABLES)}. A study is a"
        " machine of these, or a braked driveline; keep the tables of one of them."
    )
