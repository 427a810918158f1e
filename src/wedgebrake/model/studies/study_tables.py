"""Tables of a study file as a system, a run and a sweep."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from pathlib import Path
from typing import Any, NamedTuple

from wedgebrake.errors import InputError, nearest
from wedgebrake.model.groups import SETTERS, check_group
from wedgebrake.model.part import Part
from wedgebrake.model.studies.machine_study import (
    TABLES,
    beside_machine,
    flat_axes,
    is_machine,
    parse_machine,
)
from wedgebrake.model.studies.records import with_records
from wedgebrake.model.studies.study_run import RunSettings
from wedgebrake.model.studies.sweep_settings import Sweep, parse_sweep
from wedgebrake.model.studies.tables import FIXED, make_part
from wedgebrake.model.system import CHOSEN, PARTS, BrakedDriveline
from wedgebrake.model.validation import named, shown

# SI values until the group that sets them is applied: those of wb.paper.system, so that the same
# groups give the same system there, to the last bit.
_PLACEHOLDERS = {"slope": 0.0, "frequency": 10.0, "amplitude": 500.0, "angle": 0.34}


class Contents(NamedTuple):
    """The contents of a study: a system, the settings of its run and of its sweep."""

    system: Any
    run: Any
    sweep: Sweep


def parse_tables(tables: dict[str, Any], folder: Path | None = None) -> Contents:
    """The contents of a study from its tables, as ``tomllib`` gives them.

    folder : of the study file, to which the paths of records are relative

    Raises ``InputError`` that names the table, the parameter, the value and the way out.
    """
    tables = with_records(tables, folder)
    if is_machine(tables):
        return _machine_contents(tables)
    _check_tables(tables, [*PARTS, "groups", "run", "sweep"])
    missing = [name for name in PARTS if name not in tables]
    if missing:
        raise InputError(
            f"missing: {', '.join(f'[{name}]' for name in missing)}. A study has the tables"
            f" {', '.join(f'[{name}]' for name in PARTS)}; `wedgebrake example paper` shows them."
            " Without a torque, [excitation] has amplitude = 0.0."
        )
    chosen = _chosen_groups(tables.get("groups", {}), tables)
    made: dict[str, Any] = {}
    wrong: list[InputError] = []
    for name in [*PARTS, "run"]:
        try:
            made[name] = _part(name, tables.get(name, {}), chosen)
        except InputError as error:
            wrong.append(error)
    if wrong:
        raise InputError.joined(wrong)
    run = made.pop("run")
    system = BrakedDriveline(**made)
    system = system.replace(**chosen) if chosen else system
    return Contents(system, run, parse_sweep(tables.get("sweep", {}), system))


def _machine_contents(tables: dict[str, Any]) -> Contents:
    allowed = [*TABLES, "run", "sweep"]
    for name in (*PARTS, "groups"):
        if name in tables:
            raise InputError(
                beside_machine(name), name=name, value=tables[name], allowed=tuple(allowed)
            )
    _check_tables(tables, allowed, TABLES)
    machine = parse_machine(tables)
    run = RunSettings(**tables.get("run", {}))
    sweep = parse_sweep(flat_axes(tables.get("sweep", {}), machine), machine)
    return Contents(machine, run, sweep)


def _check_tables(tables: dict[str, Any], allowed: list[str], listed: Collection[str] = ()) -> None:
    """Refuse unknown tables, values outside them, and lists of tables that are not ``listed``."""
    for name, table in tables.items():
        if name in allowed and (name in listed or isinstance(table, dict)):
            continue
        text = f"[{named(name)}]: no such table. {nearest(name, allowed)}"
        if name in allowed:
            text = (
                f"{name} = {shown(table)}: must be one table. Write [{name}] on a line of its"
                " own, once, and its parameters below."
            )
        elif not isinstance(table, dict | list):
            text = (
                f"{named(name)} = {shown(table)}: stands outside the tables. Move it below the"
                f" line of its table: {', '.join(f'[{one}]' for one in allowed)}."
            )
        raise InputError(text, name=name, value=table, allowed=tuple(allowed))


def _chosen_groups(groups: dict[str, Any], tables: dict[str, Any]) -> dict[str, float]:
    """The [groups] table, checked against unknown names and parameters given twice."""
    found = {}
    for name, value in groups.items():
        if name not in SETTERS:
            near = nearest(name, SETTERS)
            raise InputError(f"groups.{named(name)}: no such group to set. {near}")
        found[name] = check_group(name, value)
        target = SETTERS[name].target
        part = SETTERS[name].part
        if target in tables[part]:
            raise InputError(
                f"groups.{name} and {part}.{target}: both given, but {name} sets {target}."
                " Remove one of them."
            )
    return found


def _part(name: str, table: dict[str, Any], chosen: dict[str, float]) -> Part:
    values = dict(table)
    if name == "run":
        return RunSettings(**values)
    kinds: Mapping[str, type[Part]] = CHOSEN.get(name, {})
    kind = values.get("kind")
    model = FIXED.get(name) or kinds.get(kind if isinstance(kind, str) else "")
    for group in chosen:
        target = SETTERS[group].target
        if name == SETTERS[group].part and model is not None and target in model.model_fields:
            values.setdefault(target, _PLACEHOLDERS[target])
    return make_part(name, values)
