"""The JSON schema of study files."""

from __future__ import annotations

import math
from typing import Any

from wedgebrake.model.groups import SETTERS
from wedgebrake.model.machine import FURTHER, KINDS
from wedgebrake.model.machine_parts import A_TORQUE, Contact, Named, OverState
from wedgebrake.model.part import Part
from wedgebrake.model.signals.signals import A_SIGNAL, Signal
from wedgebrake.model.studies.records import RECORDS
from wedgebrake.model.studies.study_run import RunSettings
from wedgebrake.model.studies.sweep_settings import sweep_schema
from wedgebrake.model.studies.tables import FIXED, table_schema
from wedgebrake.model.system import CHOSEN, PARTS
from wedgebrake.model.units import SIGNAL, pattern

_SIGNAL = {"$ref": "#/$defs/signal"}


def schema() -> dict[str, Any]:
    """JSON schema of study files."""
    properties: dict[str, Any] = {name: table_schema(model) for name, model in FIXED.items()}
    properties |= {name: {"oneOf": _of_kinds(kinds)} for name, kinds in CHOSEN.items()}
    properties["friction"]["oneOf"].append(_recorded("tabulated"))
    signals = [*_of_kinds(Signal.kinds), _recorded("table")]
    properties["excitation"] = {"oneOf": [properties["excitation"], *signals]}
    properties["groups"] = {
        "type": "object",
        "description": "normalised groups, each instead of the SI parameter that it sets",
        "properties": {
            name: {
                "anyOf": [{"type": "number"}, {"type": "string", "pattern": pattern("1")}],
                "description": f"{setter.meaning}; sets {setter.target}",
            }
            for name, setter in SETTERS.items()
        },
        "additionalProperties": False,
    }
    names = [*PARTS, "groups"]
    kinds: list[type[Named]] = [
        *KINDS.values(),
        *(one for more in FURTHER.values() for one in more),
    ]
    for kind in kinds:
        table = _contact(properties) if kind is Contact else table_schema(kind)
        properties[kind.table] = {"type": "array", "items": table}
        names.append(kind.table)
    properties["run"] = table_schema(RunSettings)
    properties["sweep"], definitions = sweep_schema()
    # Parameters of a machine, such as "brake.slope".
    properties["sweep"]["patternProperties"] = {r"\.": {"$ref": "#/$defs/swept_values"}}
    text = {"type": "string", "pattern": pattern(SIGNAL)}
    definitions["signal"] = {"oneOf": [{"type": "number"}, text, *signals]}
    found = {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "wedgebrake study",
        "description": "a braked driveline, or a machine of inertias, shafts, contacts and torques",
        "type": "object",
        "properties": {name: properties[name] for name in [*names, "run", "sweep"]},
        "oneOf": [{"required": list(PARTS)}, {"required": ["inertia"]}],
        "additionalProperties": False,
        "$defs": definitions,
    }
    return dict(_referring(found))


def _of_kinds(kinds: dict[str, type[Part]]) -> list[dict[str, Any]]:
    """The schemas of the kinds of a part."""
    return [_of_kind(kind, model) for kind, model in sorted(kinds.items())]


def _of_kind(kind: str, model: type[Part]) -> dict[str, Any]:
    one = table_schema(model)
    one["properties"] = {"kind": {"const": kind}, **one["properties"]}
    one["required"] = ["kind", *one.get("required", [])]
    return one


def _recorded(kind: str) -> dict[str, Any]:
    """The schema of a table whose points are in a CSV file."""
    record, part = RECORDS[kind]
    one, fields = _of_kind(kind, record), table_schema(part)["properties"]
    one["properties"] |= {name: fields[name] for name in record.passed}
    return one


def _contact(properties: dict[str, Any]) -> dict[str, Any]:
    """The schema of a contact, with the parts of a braked driveline."""
    table = table_schema(Contact)
    table.pop("$defs", None)
    inner = {name: properties[name] for name in ("brake", "friction", "actuation")}
    return {**table, "properties": table["properties"] | inner}


def _referring(node: Any) -> Any:
    """The schema, with a reference to the definition of signals at each signal."""
    if isinstance(node, list):
        return [_referring(one) for one in node]
    if not isinstance(node, dict):
        return node
    # JSON has no infinity: a default that is infinite is left out.
    found = {
        key: _referring(value)
        for key, value in node.items()
        if not (key == "default" and value in (math.inf, -math.inf))
    }
    if found.get("title") == A_TORQUE:
        del found["type"], found["title"]
        return found | {"anyOf": [_SIGNAL, *_of_kinds(OverState.kinds)]}
    if found.get("title") == A_SIGNAL:
        del found["type"], found["title"]
        return found | _SIGNAL
    return found
