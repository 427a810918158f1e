"""A study file: the system, the run and the sweep, with the names of the Python objects.

``study_run`` defines the [run] table and ``study_schema`` the schema. ``study_tables`` reads the
tables of a study, with ``machine_study`` and ``records`` for machines; ``study_text`` writes them.
"""

from __future__ import annotations

import itertools
import os
from collections.abc import Collection, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from textwrap import indent
from typing import Any

from wedgebrake.errors import InputError, nearest
from wedgebrake.model.display import Tabular, part_rows
from wedgebrake.model.files import write
from wedgebrake.model.groups import SETTERS, check_group
from wedgebrake.model.machine import Machine
from wedgebrake.model.part import given
from wedgebrake.model.studies import toml
from wedgebrake.model.studies.records import Records
from wedgebrake.model.studies.study_run import METHODS, Method, RunSettings
from wedgebrake.model.studies.study_schema import schema
from wedgebrake.model.studies.study_tables import Contents, parse_tables
from wedgebrake.model.studies.study_text import study_text
from wedgebrake.model.studies.sweep_settings import SWEEP_SETTINGS, Sweep
from wedgebrake.model.system import BrakedDriveline
from wedgebrake.model.validation import check_instance, named

__all__ = [
    "METHODS", "Method", "RunSettings", "Study", "load_study", "parse_study", "read_study",
    "schema",
]  # fmt: skip


@dataclass(frozen=True)
class Study(Tabular):
    """A system (a braked driveline or a machine), the settings of a run, and a sweep.

    Raises ``InputError`` for anything else, and for settings that the system does not have.
    """

    system: BrakedDriveline | Machine
    run: RunSettings = field(default_factory=RunSettings)
    sweep: Sweep = field(default_factory=Sweep)

    def __post_init__(self) -> None:
        check_instance(
            "system", self.system, BrakedDriveline | Machine, "a BrakedDriveline or a Machine"
        )
        allowed = "a RunSettings of wedgebrake.model.studies.study_run"
        check_instance("run", self.run, RunSettings, allowed)
        check_instance("sweep", self.sweep, Sweep)
        for name, value in given(self.run).items():
            if name in self.system.elsewhere:
                raise InputError(
                    f"run.{name} = {value!r}: {self.system.elsewhere[name]}",
                    name=f"run.{name}", value=value, allowed="left out",
                )  # fmt: skip

    def arguments(self) -> dict[str, Any]:
        """Keyword arguments of ``wb.simulate``: the given settings, with the length of the run.

        Raises ``InputError`` if no length is given and the system has no period to count.
        """
        settings = {name: one for name, one in given(self.run).items() if one is not None}
        has_length = {"duration", "periods"} & settings.keys()
        if has_length:
            return settings
        length = self.system.default_length
        if "periods" in length and not self.system.period:
            raise InputError(
                "run.duration: missing. The torque of this driveline has no period, so that the"
                " length of the run must be given in seconds: give duration.",
                name="run.duration", allowed="the length of the run [s]",
            )  # fmt: skip
        return {**length, **settings}

    @property
    def contents(self) -> Contents:
        """System, run and sweep."""
        return Contents(self.system, self.run, self.sweep)

    def changed(self, /, **changes: Any) -> Study:
        """A copy with other parameters, groups or run settings (``eta=-30, periods=50``).

        changes : the new values, by name; for a machine by dotted name, as in
                  ``study.changed(**{"brake.slope": -40.0})``

        ``duration`` and ``periods`` of the run replace each other, as do ``samples`` and
        ``samples_per_period``. Of the sweep,
        ``transient``, ``limit``, ``follow`` and ``keep_points`` can be changed by name, and all
        of it by ``sweep=Sweep(...)``.
        """
        for name, value in changes.items():
            self.check_name(name)
            if name in SETTERS:
                check_group(name, value)
        for_sweep = {name: changes.pop(name) for name in _CHANGED if name in changes}
        for_run = {name: changes.pop(name) for name in RunSettings.model_fields if name in changes}
        settings = given(self.run)
        for one, other in itertools.chain(*map(itertools.permutations, _EITHER)):
            if for_run.get(one) is not None and other not in for_run:
                settings.pop(other, None)
        sweep = for_sweep.pop("sweep", self.sweep)
        check_instance("sweep", sweep, Sweep)
        system = self.system.replace(**changes) if changes else self.system
        run = RunSettings(**{**settings, **for_run})
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
        text = study_text(self.contents)
        _check(text, self)
        return text

    def check_name(self, name: str, settings: Collection[str] | None = None) -> None:
        """Refuse an unknown name, with the nearest of all that can be changed.

        settings : of the run and of the sweep that can be changed; default all

        Raises ``InputError``.
        """
        if self.system.checks_itself(name):
            return
        every = (*RunSettings.model_fields, *_CHANGED)
        known = [one for one in every if settings is None or one in settings]
        allowed = [*self.system.names(), *known]
        if name in self.system.elsewhere:
            raise InputError(f"{name}: {self.system.elsewhere[name]}", name=name)
        if name in allowed:
            return
        hint = self.system.hint(name, allowed)
        if "initial" in known and hint == nearest("initial_velocity", allowed):
            hint += " It holds angle [rad] and velocity [rad/s], for example initial=[0.0, 5.0]."
        what = "parameter, group or run setting" if known else "parameter or group"
        raise InputError(f"{named(name)}: no such {what}. {hint}", name=name)


# What ``changed`` takes for the sweep; ``periods`` is the run's.
_EITHER = (("duration", "periods"), ("samples", "samples_per_period"))
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
        several = len(error.errors) > 1
        text = f"{what}:\n{indent(str(error), '  ')}" if several else f"{what}: {error}"
        found = InputError(text, name=error.name, value=error.value, allowed=error.allowed)
        found.errors = error.errors
        raise found from None


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
    """A study from its tables, as ``parse_tables`` reads them."""
    return Study(*parse_tables(tables, folder))


def save_study(study: Study, path: str | os.PathLike[str]) -> Path:
    """Write a study file (TOML), completely or not at all; ``load_study`` gives the study back.

    Tables of more than 100 points become CSV files beside it, named after it and their part.

    Returns the path.

    Raises ``InputError`` for what a study file cannot hold or a path that names no file,
    ``OutputError`` where nothing can be written.
    """
    check_instance("study", study, Study, "a Study, as wb.Study(system, run)")
    if not isinstance(path, str | os.PathLike) or not Path(path).name:
        raise InputError.of("path", path, "must name a file, for example 'study.toml'.")
    target = Path(path)
    records = Records(target.stem)
    text = study_text(study.contents, records)
    for name, record in records.files.items():
        write(target.with_name(name), record.encode())
    _check(text, study, target.parent)
    write(target, text.encode())
    return target


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
