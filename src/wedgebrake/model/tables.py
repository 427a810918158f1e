"""The tables of a study file that hold the machine: the part of each, or its kinds."""

from __future__ import annotations

from typing import Any

from wedgebrake.errors import InputError
from wedgebrake.model.actuation import Actuation
from wedgebrake.model.brakes import Brake
from wedgebrake.model.driveline import Driveline
from wedgebrake.model.excitation import HarmonicTorque
from wedgebrake.model.friction import Friction
from wedgebrake.model.groups import SETTERS
from wedgebrake.model.part import Part
from wedgebrake.model.system import BrakedDriveline

FIXED: dict[str, type[Part]] = {
    "driveline": Driveline,
    "actuation": Actuation,
    "excitation": HarmonicTorque,
}
CHOSEN: dict[str, dict[str, type[Brake]] | dict[str, type[Friction]]] = {
    "brake": Brake.kinds,
    "friction": Friction.kinds,
}


def refuse_of_another_kind(name: str, system: BrakedDriveline, where: str = "") -> None:
    """Raise ``InputError`` for a parameter that brakes or frictions of other kinds have."""
    for table, kinds in CHOSEN.items():
        others = [repr(kind) for kind, one in sorted(kinds.items()) if name in one.model_fields]
        if others:
            part = getattr(system, table)
            kind = part.kind or type(part).__name__
            raise InputError(
                f"{where}{name}: no parameter of the {table} of this study, of kind {kind!r}, but"
                f" of kind {' and '.join(others)}. Change the kind in the study first."
            )


def table_schema(model: type[Part]) -> dict[str, Any]:
    """The schema of one table; what a group can set is not required here."""
    table = model.model_json_schema()
    table.pop("title", None)
    settable = {setter.target for setter in SETTERS.values()}
    required = [name for name in table.get("required", []) if name not in settable]
    table.pop("required", None)
    if required:
        table["required"] = required
    return table
