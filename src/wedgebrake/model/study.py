"""A study file: the system, the run and the sweep, with the names of the Python objects.

``study_run`` defines the [run] table and ``study_schema`` the schema. ``study_text`` writes
studies; ``machine_study`` and ``records`` read the tables of machines.
"""

from __future__ import annotations

import os
from collections.abc import Collection, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, cast

from wedgebrake.errors import InputError, nearest
from wedgebrake.model import toml
from wedgebrake.model.display import Tabular, part_rows
from wedgebrake.model.groups import SETTERS, check_group
from wedgebrake.model.machine import Machine
from wedgebrake.model.machine_study import (
    TABLES,
    beside_machine,
    flat_axes,
    is_machine,
    parse_machine,
)
from wedgebrake.model.part import Part, given
from wedgebrake.model.records import with_records
from wedgebrake.model.study_run import METHODS, MachineRun, Method, Run
from wedgebrake.model.study_schema import schema
from wedgebrake.model.sweep_settings import SWEEP_SETTINGS, Sweep, parse_sweep
from wedgebrake.model.system import CHOSEN, PARTS, BrakedDriveline
from wedgebrake.model.tables import FIXED, make_part
from wedgebrake.model.validation import check_instance, named, shown

__all__ = [
    "METHODS", "Method", "Run", "Study", "load_study", "parse_study", "read_study", "schema",
]  # fmt: skip

# SI values until the group that sets them is applied: those of wb.paper.system, so that the same
# groups give the same system there, to the last bit.
_PLACEHOLDERS = {"slope": 0.0, "frequency": 10.0, "amplitude": 500.0, "angle": 0.34}


@dataclass(frozen=True)
class Study(Tabular):
    """A system (a braked driveline or a machine), the settings of a run, and a sweep."""

    # Also a Machine and its MachineRun; functions for one inertia raise an error for machines when
    # called.
    system: BrakedDriveline
    run: Run
    sweep: Sweep = field(default_factory=Sweep)

    @property
    def of_machine(self) -> bool:
        """True for the study of a machine with several inertias and contacts."""
        return isinstance(self.system, Machine)

    def changed(self, /, **changes: Any) -> Study:
        """A copy with other parameters, groups or run settings (``eta=-30, periods=50``).

        changes : the new values, by name; for a machine by dotted name, as in
                  ``study.changed(**{"brake.slope": -40.0})``

        ``duration`` and ``periods`` are those of the run and replace each other. Of the sweep,
        ``transient``, ``limit``, ``follow`` and ``keep_points`` can be changed by name, and all
        of it by ``sweep=Sweep(...)``.
        """
        kind = type(self.run)
        for name, value in changes.items():
            self.check_name(name)
            if kind is Run and name in SETTERS:
                check_group(name, value)
        for_sweep = {name: changes.pop(name) for name in _CHANGED if name in changes}
        for_run = {name: changes.pop(name) for name in kind.model_fields if name in changes}
        settings = given(self.run)
        for one, other in (("duration", "periods"), ("periods", "duration")):
            if for_run.get(one) is not None and other not in for_run:
                settings.pop(other, None)
        sweep = for_sweep.pop("sweep", self.sweep)
        check_instance("sweep", sweep, Sweep)
        system = self.system.replace(**changes) if changes else self.system
        run = kind(**{**settings, **for_run})
        return Study(system, run, Sweep(**{**given(sweep), **for_sweep}))

    def _headline(self) -> str:
        return self.system._headline()

    def _rows(self) -> Iterator[tuple[str, Any, str]]:
        yield from self.system._rows()
        yield from part_rows("run", self.run, given(self.run))

    def to_toml(self) -> str:
        """The study as the text of a study file: ``wb.read_study`` gives it back, bit for bit.

        Raises ``InputError`` for what a study file cannot hold.
        """
        from wedgebrake.model.study_text import study_text

        return study_text(self)

    def check_name(self, name: str, settings: Collection[str] | None = None) -> None:
        """Refuse an unknown name, with the nearest of all that can be changed.

        settings : of the run and of the sweep that can be changed; default all

        Raises ``InputError``.
        """
        if self.of_machine and "." in name:
            return  # not a number of the machine, perhaps; its replace checks the name
        every = (*type(self.run).model_fields, *_CHANGED)
        known = [one for one in every if settings is None or one in settings]
        allowed = [*self.system.names(), *known]
        if name in allowed:
            return
        if name in self.run.absent:
            raise InputError(f"{name}: {self.run.absent[name]}")
        hint = self.system.hint(name, allowed)
        if "initial" in known and hint == nearest("initial_velocity", allowed):
            hint += " It holds angle [rad] and velocity [rad/s], for example initial=[0.0, 5.0]."
        what = "parameter, group or run setting" if known else "parameter or group"
        raise InputError(f"{named(name)}: no such {what}. {hint}", name=name)


# What ``changed`` takes for the sweep; ``periods`` is the run's.
_CHANGED = ("sweep", *(name for name in SWEEP_SETTINGS if name != "periods"))


def load_study(path: str | Path) -> Study:
    """Read the study file (TOML) at a path.

    Tables ``driveline``, ``brake``, ``friction``, ``actuation``, ``excitation``; optional
    ``groups`` (eta, f, F0, alpha instead of the SI values that they set), ``run`` and
    ``sweep``. For a machine, instead, lists of tables ``inertia``, ``shaft``, ``contact`` and
    ``torque``, with optional ``run`` and ``sweep``; records are CSV files relative to the study.

    Raises ``InputError`` that names the file and what is wrong in it.
    """
    path = Path(check_instance("path", path, str | os.PathLike, "the path of a study file (TOML)"))
    with _about(str(path)):
        return parse_study(toml.read(_content(path)), path.parent)


def read_study(content: bytes | str) -> Study:
    """Read a study from the text of a study file (TOML).

    content : text or bytes of the file

    Raises ``InputError`` that names what is wrong.
    """
    allowed = "the text or bytes of a study file (TOML); for a path use wb.load_study(...)"
    check_instance("content", content, bytes | str, allowed)
    with _about("study"):
        return parse_study(toml.read(content))


@contextmanager
def _about(what: str) -> Iterator[None]:
    """Name what was read at the beginning of an error."""
    try:
        yield
    except InputError as error:
        lines = str(error).split("\n")
        text = "\n  ".join((f"{what}:", *lines)) if lines[1:] else f"{what}: {error}"
        raise InputError(text, name=error.name, value=error.value, allowed=error.allowed) from None


def _content(path: Path) -> bytes:
    try:
        with path.open("rb") as file:
            # Not read to the end: it may be a device that has none.
            return file.read(toml.LARGEST + 1)
    except FileNotFoundError:
        raise InputError(
            "no such file. Give the path of a study file; `wedgebrake example paper` prints one."
        ) from None
    except IsADirectoryError:
        raise InputError("is a directory. Give the path of a study file in it.") from None
    except (OSError, ValueError) as error:
        why = getattr(error, "strerror", None) or error
        raise InputError(f"cannot be read ({why}). Give the path of a study file.") from None


def parse_study(tables: dict[str, Any], folder: Path | None = None) -> Study:
    """A study from its tables, as ``tomllib`` gives them.

    folder : of the study file, to which the paths of records are relative

    Raises ``InputError`` that names the table, the parameter, the value and the way out.
    """
    tables = with_records(tables, folder)
    if is_machine(tables):
        return _machine_study(tables)
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
    wrong: list[str] = []
    for name in [*PARTS, "run"]:
        try:
            made[name] = _part(name, tables.get(name, {}), chosen)
        except InputError as error:
            wrong.append(str(error))
    if wrong:
        raise InputError("\n".join(wrong))
    run = made.pop("run")
    system = BrakedDriveline(**made)
    system = system.replace(**chosen) if chosen else system
    return Study(system, run, parse_sweep(tables.get("sweep", {}), system))


def _machine_study(tables: dict[str, Any]) -> Study:
    allowed = [*TABLES, "run", "sweep"]
    for name in (*PARTS, "groups"):
        if name in tables:
            raise InputError(
                beside_machine(name), name=name, value=tables[name], allowed=tuple(allowed)
            )
    _check_tables(tables, allowed, TABLES)
    machine = parse_machine(tables)
    run = MachineRun(**tables.get("run", {}))
    sweep = parse_sweep(flat_axes(tables.get("sweep", {}), machine), machine)
    return Study(cast("Any", machine), cast("Any", run), sweep)


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
    """The [groups] table, checked against unknown names and doubled parameters."""
    for name, value in groups.items():
        if name not in SETTERS:
            near = nearest(name, SETTERS)
            raise InputError(f"groups.{named(name)}: no such group to set. {near}")
        check_group(name, value)
        target = SETTERS[name].target
        part = SETTERS[name].part
        if target in tables[part]:
            raise InputError(
                f"groups.{name} and {part}.{target}: both given, but {name} sets {target}."
                " Remove one of them."
            )
    return dict(groups)


def _part(name: str, table: dict[str, Any], chosen: dict[str, float]) -> Part:
    values = dict(table)
    if name == "run":
        return Run(**values)
    kinds: Mapping[str, type[Part]] = CHOSEN.get(name, {})
    kind = values.get("kind")
    model = FIXED.get(name) or kinds.get(kind if isinstance(kind, str) else "")
    for group in chosen:
        target = SETTERS[group].target
        if name == SETTERS[group].part and model is not None and target in model.model_fields:
            values.setdefault(target, _PLACEHOLDERS[target])
    return make_part(name, values)
