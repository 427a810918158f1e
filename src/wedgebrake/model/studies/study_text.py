"""A study as the text of a study file, to the last bit."""

from __future__ import annotations

from collections.abc import Iterator
from functools import singledispatch
from typing import Any

from wedgebrake.model.groups import SETTERS
from wedgebrake.model.machine import Machine
from wedgebrake.model.part import Chosen, Part, given
from wedgebrake.model.signals.excitation import HarmonicTorque
from wedgebrake.model.studies import toml
from wedgebrake.model.studies.machine_study import comments, kind_of, machine_text, plain_given
from wedgebrake.model.studies.records import Records
from wedgebrake.model.studies.study_tables import Contents, parse_tables
from wedgebrake.model.studies.sweep_settings import SWEEP_SETTINGS, Sweep, sweepable
from wedgebrake.model.system import PARTS, BrakedDriveline
from wedgebrake.model.system_base import System

_Tables = dict[str, dict[str, Any]]


def study_text(study: Contents, records: Records | None = None) -> str:
    """A study as TOML, with a unit or a meaning beside each value.

    Defaults are left out. A group that was given is written instead of the SI value that it
    sets, if it gives that value to the last bit.

    records : receives the tables that become files beside the study

    Raises ``InputError`` for what a study file cannot hold: parts without a kind, values
    that are no numbers and no text, or too many of them.
    """
    texts = list(_texts(study.system, records))
    swept = [name for name, _ in study.sweep.axes]
    axes = {name: _with_unit(*one) for name, one in sweepable(study.system, swept).items()}
    for name, table, remarks in (
        ("run", _given(study.run), comments(study.run)),
        ("sweep", _of_sweep(study.sweep), axes | comments(study.sweep)),
    ):
        if table:
            texts.append(toml.table(name, table, remarks))
    return "\n".join(texts)


def _with_unit(unit: str, meaning: str) -> str:
    return meaning if unit in ("1", "-") else f"{meaning} [{unit}]"


@singledispatch
def _texts(system: System, records: Records | None) -> Iterator[str]:
    """The tables of a system."""
    raise NotImplementedError(type(system).__name__)


@_texts.register
def _(system: Machine, records: Records | None) -> Iterator[str]:
    yield machine_text(system, records)


@_texts.register
def _(system: BrakedDriveline, records: Records | None) -> Iterator[str]:
    """The tables of the parts, each with the comments of its values, and of the groups."""
    tables = {
        name: {**_kind(name, one), **plain_given(one)} for name, one in system.parts().items()
    }
    groups = _stated_groups(tables, system)
    for name, part in system.parts().items():
        table = tables[name] if records is None else records.kept(tables[name], name)
        yield toml.table(name, table, comments(part))
    if groups:
        yield toml.table("groups", groups, {name: one.meaning for name, one in SETTERS.items()})


def _kind(name: str, part: Part) -> dict[str, str]:
    if isinstance(part, Chosen) and not isinstance(part, HarmonicTorque):
        return {"kind": kind_of(name, part)}
    return {}


def _given(part: Part) -> dict[str, Any]:
    return {name: value for name, value in given(part).items() if value is not None}


def _of_sweep(sweep: Sweep) -> dict[str, Any]:
    axes = {
        name: _given(values) if isinstance(values, Part) else values for name, values in sweep.axes
    }
    settings = {name: value for name, value in _given(sweep).items() if name in SWEEP_SETTINGS}
    return {**axes, **settings}


def _stated_groups(tables: _Tables, system: BrakedDriveline) -> dict[str, float]:
    """The groups that were given, where they set their values exactly; removes these values."""
    places = {name: SETTERS[name].part for name in system.stated}
    trial: _Tables = {part: dict(tables[part]) for part in PARTS}
    for name, part in places.items():
        trial[part].pop(SETTERS[name].target, None)
    read = parse_tables({**trial, "groups": system.stated}).system
    found: dict[str, float] = {}
    for name, part in places.items():
        target = SETTERS[name].target
        before, after = (getattr(getattr(one, part), target) for one in (system, read))
        if repr(before) == repr(after):  # tells 0.0 from -0.0
            tables[part].pop(target, None)
            found[name] = system.stated[name]
    return found
