"""The tables of a study file that hold the system, each of one class or of several kinds."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from wedgebrake.errors import InputError
from wedgebrake.model.groups import SETTERS
from wedgebrake.model.part import Part, column_units, of_kind, text_unit
from wedgebrake.model.signals.excitation import HarmonicTorque
from wedgebrake.model.signals.signal_base import signal_from
from wedgebrake.model.system import BASES, CHOSEN
from wedgebrake.model.units import pattern
from wedgebrake.model.validation import labels, moved

FIXED: dict[str, type[Part]] = {name: base for name, base in BASES.items() if name not in CHOSEN}


def make_part(name: str, table: Mapping[str, Any]) -> Part:
    """The part that a table of a study file describes, of the kind that it names.

    Raises ``InputError`` for an unknown kind or wrong values.
    """
    values = dict(table)
    if name == "excitation" and "kind" in values:
        return _named_excitation(values)
    return FIXED[name](**values) if name in FIXED else of_kind(name, values, CHOSEN[name])


def _named_excitation(values: dict[str, Any]) -> Part:
    if values["kind"] == HarmonicTorque.kind:
        del values["kind"]
        return HarmonicTorque(**values)
    try:
        return signal_from(values)
    except InputError as error:
        raise moved(error, "excitation") from None


def table_schema(model: type[Part]) -> dict[str, Any]:
    """The schema of one table; what a group can set is not required here."""
    table = model.model_json_schema()
    table.pop("title", None)
    for name, one in table["properties"].items():
        unit, columns = text_unit(model, name), column_units(model, name)
        if columns:
            table["properties"][name] = _with_columns(one, columns)
        elif unit is not None:
            table["properties"][name] = or_text(one, _text(unit))
    settable = {setter.target for setter in SETTERS.values()}
    for name, (target, one) in model.alternatives.items():
        settable.add(target)
        number: dict[str, Any] = {"type": "number", "minimum": 0, "description": one.description}
        unit = text_unit(model, name)
        table["properties"][name] = (or_text(number, _text(unit)) if unit else number) | labels(one)
    required = [name for name in table.get("required", []) if name not in settable]
    table.pop("required", None)
    if required:
        table["required"] = required
    return table


def _text(unit: str) -> dict[str, Any]:
    """The schema of a number with one of the units of an SI unit."""
    return {"type": "string", "pattern": pattern(unit)}


def _with_columns(schema: dict[str, Any], columns: Sequence[str]) -> dict[str, Any]:
    """The schema of a row, or of a list of rows, whose values accept texts with their units."""
    if "anyOf" in schema:
        rows = [one for one in schema["anyOf"] if one.get("type") != "null"]
        rest = {name: one for name, one in schema.items() if name not in ("anyOf", "default")}
        return {**rest, **_with_columns(rows[0], columns)}
    if "prefixItems" in schema:
        pairs = zip(schema["prefixItems"], columns, strict=True)
        return {**schema, "prefixItems": [or_text(one, _text(unit)) for one, unit in pairs]}
    return {**schema, "items": _with_columns(schema["items"], columns)}


_NUMBERS = ("type", "minimum", "maximum", "exclusiveMinimum", "exclusiveMaximum")


def or_text(schema: dict[str, Any], text: dict[str, Any]) -> dict[str, Any]:
    """The schema of a number, or of a list of numbers, that also accepts texts with units."""
    found = dict(schema)
    if found.get("type") == "number":
        number = {key: found.pop(key) for key in _NUMBERS if key in found}
        return {**found, "anyOf": [number, text]}
    if found.get("type") == "array":
        for key in ("items", "prefixItems"):
            inner = found.get(key)
            if isinstance(inner, dict):
                found[key] = or_text(inner, text)
            elif isinstance(inner, list):
                found[key] = [or_text(one, text) for one in inner]
        return found
    if "anyOf" in found and any(one.get("type") in ("number", "array") for one in found["anyOf"]):
        whole = [one for one in found["anyOf"] if one.get("type") != "array"]
        lists = [or_text(one, text) for one in found["anyOf"] if one.get("type") == "array"]
        numeric = any(one.get("type") == "number" for one in whole)
        return {**found, "anyOf": [*whole, *lists, *([text] if numeric else [])]}
    return found
