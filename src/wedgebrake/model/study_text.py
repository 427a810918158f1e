"""A study as the text of a study file, to the last bit."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any, cast

from wedgebrake.errors import InputError
from wedgebrake.model import toml
from wedgebrake.model.excitation import HarmonicTorque
from wedgebrake.model.files import write
from wedgebrake.model.groups import SETTERS
from wedgebrake.model.machine_study import comments, kind_of, machine_text, plain_given
from wedgebrake.model.part import Chosen, Part, given
from wedgebrake.model.records import Records
from wedgebrake.model.study import Study, parse_study
from wedgebrake.model.sweep_settings import SWEEP_SETTINGS, Sweep, sweepable
from wedgebrake.model.system import PARTS, BrakedDriveline
from wedgebrake.model.validation import check_instance, shown

_Tables = dict[str, dict[str, Any]]


def save_study(study: Study, path: str | os.PathLike[str]) -> Path:
    """Write a study file (TOML), completely or not at all; ``load_study`` gives the study back.

    Tables of more than 100 points become CSV files beside it, named after it and their part.

    Returns the path.

    Raises ``InputError`` for what a study file cannot hold or a path that names no file,
    ``OutputError`` where nothing can be written.
    """
    check_instance("study", study, Study, "a Study, as wb.Study(system, run)")
    if not isinstance(path, str | os.PathLike) or not Path(path).name:
        raise InputError(f"path = {shown(path)}: must name a file, for example 'study.toml'.")
    target = Path(path)
    records = Records(target.stem)
    text = _text(study, records)
    for name, record in records.files.items():
        write(target.with_name(name), record.encode())
    _check(text, study, target.parent)
    write(target, text.encode())
    return target


def study_text(study: Study) -> str:
    """A study as TOML, with a unit or a meaning beside each value.

    Defaults are left out. A group that was given is written instead of the SI value that it
    sets, if it gives that value to the last bit.

    Raises ``InputError`` for what a study file cannot hold: parts without a kind, values
    that are no numbers and no text, or too many of them.
    """
    text = _text(study, None)
    _check(text, study)
    return text


def _text(study: Study, records: Records | None) -> str:
    if study.of_machine:
        return _machine_study_text(study, records)
    tables = _tables(study)
    _state_groups(tables, study.system)
    if records is not None:
        tables = {name: records.kept(table, name) for name, table in tables.items()}
    words = _comments(study)
    return "\n".join(toml.table(name, table, words[name]) for name, table in tables.items())


def _machine_study_text(study: Study, records: Records | None) -> str:
    texts = [machine_text(cast("Any", study.system), records)]
    axes = sweepable(study.system)
    meanings = {name: _with_unit(*one) for name, one in axes.items()}
    for name, table, remarks in (
        ("run", _given(study.run), comments(study.run)),
        ("sweep", _of_sweep(study.sweep), meanings | comments(study.sweep)),
    ):
        if table:
            texts.append(toml.table(name, table, remarks))
    return "\n".join(texts)


def _with_unit(unit: str, meaning: str) -> str:
    return meaning if unit in ("1", "-") else f"{meaning} [{unit}]"


def _tables(study: Study) -> _Tables:
    """Everything in SI values."""
    tables: _Tables = {}
    for name, part in study.system.parts().items():
        tables[name] = {**_kind(name, part), **plain_given(part)}
    tables["groups"] = {}
    tables["run"] = _given(study.run)
    tables["sweep"] = _of_sweep(study.sweep)
    return {name: table for name, table in tables.items() if table or name in (*PARTS, "groups")}


def _kind(name: str, part: Part) -> dict[str, str]:
    if not isinstance(part, Chosen) or isinstance(part, HarmonicTorque):
        return {}
    return {"kind": kind_of(name, part)}


def _given(part: Part) -> dict[str, Any]:
    return {name: value for name, value in given(part).items() if value is not None}


def _of_sweep(sweep: Sweep) -> dict[str, Any]:
    axes = {
        name: _given(values) if isinstance(values, Part) else values for name, values in sweep.axes
    }
    settings = {name: value for name, value in _given(sweep).items() if name in SWEEP_SETTINGS}
    return {**axes, **settings}


def _state_groups(tables: _Tables, system: BrakedDriveline) -> None:
    """Write the groups that were given instead of the values that they set, where that is exact."""
    places = {name: SETTERS[name].part for name in system.stated}
    trial: _Tables = {part: dict(tables[part]) for part in PARTS}
    for name, part in places.items():
        trial[part].pop(SETTERS[name].target, None)
    read = parse_study({**trial, "groups": system.stated}).system
    for name, part in places.items():
        target = SETTERS[name].target
        before, after = (getattr(getattr(one, part), target) for one in (system, read))
        if repr(before) == repr(after):  # tells 0.0 from -0.0
            tables[part].pop(target, None)
            tables["groups"][name] = system.stated[name]
    if not tables["groups"]:
        del tables["groups"]


def _comments(study: Study) -> dict[str, dict[str, str]]:
    """The comments of the values of each table: the unit, or the meaning."""
    parts = {**study.system.parts(), "run": study.run}
    found = {name: comments(part) for name, part in parts.items()}
    found["groups"] = {name: setter.meaning for name, setter in SETTERS.items()}
    axes = {
        name: _with_unit(unit, meaning) for name, (unit, meaning) in sweepable(study.system).items()
    }
    found["sweep"] = {**axes, **comments(study.sweep)}
    return found


def _check(text: str, study: Study, folder: Path | None = None) -> None:
    """Refuse a text that does not give the study back, as for some parts of a user's own."""
    try:
        read = parse_study(toml.read(text), folder)
    except InputError as error:
        raise InputError(f"study: a study file cannot hold it. {error}") from None
    if read != study:
        raise InputError(
            "study: a study file cannot hold it: read back, it would differ. Use numbers and"
            " texts alone in parts of your own."
        )
