"""A study as the text of a study file, to the last bit."""

from __future__ import annotations

import os
from collections.abc import Iterator
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
        texts = [machine_text(cast("Any", study.system), records)]
    else:
        texts = list(_driveline_texts(study.system, records))
    axes = {name: _with_unit(*one) for name, one in sweepable(study.system).items()}
    for name, table, remarks in (
        ("run", _given(study.run), comments(study.run)),
        ("sweep", _of_sweep(study.sweep), axes | comments(study.sweep)),
    ):
        if table:
            texts.append(toml.table(name, table, remarks))
    return "\n".join(texts)


def _with_unit(unit: str, meaning: str) -> str:
    return meaning if unit in ("1", "-") else f"{meaning} [{unit}]"


def _driveline_texts(system: BrakedDriveline, records: Records | None) -> Iterator[str]:
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
    read = parse_study({**trial, "groups": system.stated}).system
    found: dict[str, float] = {}
    for name, part in places.items():
        target = SETTERS[name].target
        before, after = (getattr(getattr(one, part), target) for one in (system, read))
        if repr(before) == repr(after):  # tells 0.0 from -0.0
            tables[part].pop(target, None)
            found[name] = system.stated[name]
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
