"""A study file: the machine and the run, with the same names as the Python objects."""

from __future__ import annotations

import math
import os
import re
import tomllib
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, ClassVar, Literal, get_args

import numpy as np
from pydantic import Field, model_validator

from wedgebrake.errors import InputError, nearest
from wedgebrake.model import groups as _groups
from wedgebrake.model.actuation import Actuation
from wedgebrake.model.brakes import Brake
from wedgebrake.model.driveline import Driveline
from wedgebrake.model.excitation import HarmonicTorque
from wedgebrake.model.friction import Friction
from wedgebrake.model.part import Part, named, parameter, shown
from wedgebrake.model.system import PARTS, BrakedDriveline

Method = Literal["exact", "smooth", "ode14x"]
METHODS: tuple[str, ...] = get_args(Method)
_State = Annotated[float, Field(ge=-1e12, le=1e12)]
_LARGEST = 1_000_000  # bytes; a study is a page, not a data set
# Names of so many parts, a.b.c, that tomllib takes minutes for them: its time goes with
# their square.
_DEEPEST = 100
# What stands in for an SI value until the group that sets it is applied: as in
# wb.paper.system, so that the same groups give the same system there, to the last bit.
_PLACEHOLDERS = {"slope": 0.0, "frequency": 10.0, "amplitude": 500.0, "angle": 0.34}


class Run(Part):
    """What to simulate: the arguments of ``wb.simulate``, with its defaults."""

    table: ClassVar[str] = "run"

    duration: float | None = parameter(
        "length of the run", symbol="-", unit="s", example=25.0, default=None,
        ge=0, le=1e12,
    )  # fmt: skip
    periods: int | None = parameter(
        "length of the run in periods of the torque (250, without duration)", symbol="-",
        unit="1", example=250, default=None, gt=0, le=1_000_000_000,
    )  # fmt: skip
    initial: tuple[_State, _State] = parameter(
        "angle [rad] and velocity [rad/s] at the start", symbol="theta, theta'", unit="-",
        example=[0.0, 0.0], default=(0.0, 0.0), strict=False,
    )  # fmt: skip
    start_time: float = parameter(
        "time of the start (it sets the phase of the torque)", symbol="t_0", unit="s",
        example=0.0, default=0.0, ge=0, le=1e12,
    )  # fmt: skip
    method: Method | None = parameter(
        "the solver (default: by the friction law)", symbol="-", unit="-", example="exact",
        default=None,
    )  # fmt: skip
    samples_per_period: int = parameter(
        "samples in a period of the torque", symbol="-", unit="1", example=200, default=200,
        gt=0, le=50_000_000,
    )  # fmt: skip
    rtol: float = parameter(
        "relative tolerance of the method smooth", symbol="-", unit="1", example=1e-9,
        default=1e-9, ge=1e-13, le=1e-2,
    )  # fmt: skip
    step: float = parameter(
        "fixed step of the method ode14x", symbol="-", unit="s", example=1e-4, default=1e-4,
        ge=1e-9, le=1,
    )  # fmt: skip
    max_events: int = parameter(
        "most events of the method exact", symbol="-", unit="1", example=10_000_000,
        default=10_000_000, gt=0, le=1_000_000_000_000,
    )  # fmt: skip
    max_steps: int = parameter(
        "most steps of the methods smooth and ode14x", symbol="-", unit="1",
        example=100_000_000, default=100_000_000, gt=0, le=1_000_000_000_000,
    )  # fmt: skip

    @model_validator(mode="after")
    def _one_length(self) -> Run:
        if self.duration is not None and self.periods is not None:
            raise ValueError(
                f"run.duration = {self.duration!r} and run.periods = {self.periods!r}: both"
                " given, but one says how long. Remove one of them."
            )
        return self

    def arguments(self) -> dict[str, Any]:
        """Keyword arguments of ``wb.simulate``."""
        given = dict(self)
        if self.duration is None and self.periods is None:
            given["periods"] = 250
        return given


_FIXED: dict[str, type[Part]] = {
    "driveline": Driveline,
    "actuation": Actuation,
    "excitation": HarmonicTorque,
    "run": Run,
}
_CHOSEN: dict[str, dict[str, type[Brake]] | dict[str, type[Friction]]] = {
    "brake": Brake.kinds,
    "friction": Friction.kinds,
}


@dataclass(frozen=True)
class Study:
    """A system and how to run it."""

    system: BrakedDriveline
    run: Run

    def changed(self, **changes: Any) -> Study:
        """A copy with other parameters, groups or run settings (``eta=-30, periods=50``).

        ``duration`` and ``periods`` replace each other.
        """
        for name, value in changes.items():
            self._check(name)
            if name in _groups.SETTERS:
                _check_group(name, value)
        for_run = {name: value for name, value in changes.items() if name in Run.model_fields}
        for_system = {name: value for name, value in changes.items() if name not in for_run}
        settings = {name: getattr(self.run, name) for name in self.run.model_fields_set}
        if "duration" in for_run and "periods" not in for_run:
            settings.pop("periods", None)
        if "periods" in for_run and "duration" not in for_run:
            settings.pop("duration", None)
        system = self.system.replace(**for_system) if for_system else self.system
        return Study(system, Run(**{**settings, **for_run}))

    def _check(self, name: str) -> None:
        """Refuse an unknown name, with the nearest of all that can be changed."""
        parts = [getattr(self.system, part) for part in PARTS]
        fields = [field for part in parts for field in type(part).model_fields]
        allowed = [*fields, *_groups.SETTERS, *PARTS, *Run.model_fields]
        if name in allowed:
            return
        for table, kinds in _CHOSEN.items():
            others = [repr(kind) for kind, one in sorted(kinds.items()) if name in one.model_fields]
            if others:
                part = getattr(self.system, table)
                kind = part.kind or type(part).__name__
                raise InputError(
                    f"{name}: no parameter of the {table} of this study, of kind {kind!r}, but of"
                    f" kind {' and '.join(others)}. Change the kind in the study first."
                )
        raise InputError(
            f"{named(name)}: no such parameter, group or run setting. {nearest(name, allowed)}"
        )


def load_study(path: str | Path) -> Study:
    """Read a study file (TOML).

    Tables ``driveline``, ``brake``, ``friction``, ``actuation``, ``excitation``; optional
    ``groups`` (eta, f, F0, alpha instead of the SI values that they set) and ``run``.

    Raises ``InputError`` that names the file and what is wrong in it.
    """
    if not isinstance(path, str | os.PathLike):
        raise InputError(f"path = {shown(path)}: must be the path of a study file (TOML).")
    path = Path(path)
    try:
        return parse_study(_tables(_text(path)))
    except InputError as error:
        lines = str(error).split("\n")
        raise InputError(
            "\n  ".join([f"{path}:", *lines] if lines[1:] else [f"{path}: {error}"])
        ) from None


def _text(path: Path) -> str:
    try:
        with path.open("rb") as file:
            # Not read to the end: it may be a device that has none.
            content = file.read(_LARGEST + 1)
    except FileNotFoundError:
        raise InputError(
            "no such file. Give the path of a study file; examples/paper.toml is one."
        ) from None
    except IsADirectoryError:
        raise InputError("is a directory. Give the path of a study file in it.") from None
    except (OSError, ValueError) as error:
        why = getattr(error, "strerror", None) or error
        raise InputError(f"cannot be read ({why}). Give the path of a study file.") from None
    if len(content) > _LARGEST:
        raise InputError(f"is larger than {_LARGEST} bytes: must be a study file, a page of text.")
    try:
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError:
        raise InputError("is not text: must be a study file (TOML, in UTF-8).") from None
    if not text.strip():
        raise InputError("is empty. Fill it, beginning from a copy of examples/paper.toml.")
    return text


def _tables(text: str) -> dict[str, Any]:
    too_deep = InputError(
        "is nested too deeply. A study has tables and their parameters, nothing deeper."
    )
    names = re.split(r"[\n,={}\[\]]", text)
    if any(len(re.findall(r"[^\s.]\s*\.", name)) > _DEEPEST for name in names):
        raise too_deep
    try:
        return tomllib.loads(text)
    except RecursionError:
        raise too_deep from None
    except ValueError as error:  # also for a number of thousands of digits
        why = str(error).split("; use sys.")[0]
        why = why if len(why) <= 200 else why[:197] + "..."
        raise InputError(
            f"is not TOML: {why}{_line_of(why, text)}. A line reads name = value, under a [table],"
            " each name once; a text stands in quotation marks, a number reads 0.5 or 5e-4."
        ) from None


def _line_of(why: str, text: str) -> str:
    """The line that tomllib complains about."""
    found = re.search(r"at line (\d+)", why)
    if found is None:
        return ""
    line = text.split("\n")[int(found[1]) - 1]
    return f" in {shown(line.strip())}"


def parse_study(tables: dict[str, Any]) -> Study:
    """A study from its tables, as ``tomllib`` gives them.

    Raises ``InputError`` that names the table, the parameter, the value and the way out.
    """
    _check_tables(tables)
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
    if chosen:
        system = system.replace(**chosen)
    return Study(system, run)


def _check_tables(tables: dict[str, Any]) -> None:
    allowed = [*PARTS, "groups", "run"]
    for name, table in tables.items():
        if name not in allowed and not isinstance(table, dict):
            raise InputError(
                f"{named(name)} = {shown(table)}: stands outside the tables. Move it below the"
                f" line of its table: {', '.join(f'[{one}]' for one in allowed)}."
            )
        if name not in allowed:
            raise InputError(f"[{named(name)}]: no such table. {nearest(name, allowed)}")
        if not isinstance(table, dict):
            raise InputError(
                f"{name} = {shown(table)}: must be one table. Write [{name}] on a line of its"
                " own, once, and its parameters below."
            )
    missing = [name for name in PARTS if name not in tables]
    if missing:
        raise InputError(
            f"missing: {', '.join(f'[{name}]' for name in missing)}. A study has the tables"
            f" {', '.join(f'[{name}]' for name in PARTS)}; examples/paper.toml shows them."
        )


def _chosen_groups(given: dict[str, Any], tables: dict[str, Any]) -> dict[str, float]:
    """The [groups] table, checked against unknown names and doubled parameters."""
    for name, value in given.items():
        if name not in _groups.SETTERS:
            raise InputError(
                f"groups.{named(name)}: no such group to set. {nearest(name, _groups.SETTERS)}"
            )
        _check_group(name, value)
        target = _groups.SETTERS[name][0]
        doubled = [part for part in PARTS if target in tables[part]]
        if doubled:
            raise InputError(
                f"groups.{name} and {doubled[0]}.{target}: both given, but {name} sets {target}."
                " Remove one of them."
            )
    return dict(given)


def _check_group(name: str, value: object) -> None:
    if not isinstance(value, int | float | np.integer | np.floating) or isinstance(value, bool):
        raise InputError(
            f"groups.{name} = {shown(value)}: must be a number, without quotation marks or units."
        )
    try:
        finite = math.isfinite(value)
    except OverflowError:  # an integer beyond all floats
        finite = False
    if not finite:
        raise InputError(
            f"groups.{name} = {shown(value)}: must be a finite number (not nan, not inf)."
        )


def _part(name: str, table: dict[str, Any], chosen: dict[str, float]) -> Part:
    values = dict(table)
    if name in _FIXED:
        model = _FIXED[name]
    else:
        kinds = _CHOSEN[name]
        words = ", ".join(repr(kind) for kind in sorted(kinds))
        if "kind" not in values:
            raise InputError(f"{name}.kind: missing. Allowed: {words}.")
        kind = values.pop("kind")
        if not isinstance(kind, str):
            raise InputError(f"{name}.kind = {shown(kind)}: must be text. Allowed: {words}.")
        if kind not in kinds:
            raise InputError(f"{name}.kind = {shown(kind)}: not known. {nearest(kind, kinds)}")
        model = kinds[kind]
    for group in chosen:
        target = _groups.SETTERS[group][0]
        if target in model.model_fields:
            values.setdefault(target, _PLACEHOLDERS[target])
    return model(**values)


def schema() -> dict[str, Any]:
    """JSON schema of study files."""
    properties: dict[str, Any] = {name: _table_schema(model) for name, model in _FIXED.items()}
    for name, kinds in _CHOSEN.items():
        choices = []
        for kind, model in sorted(kinds.items()):
            one = _table_schema(model)
            one["properties"] = {"kind": {"const": kind}, **one["properties"]}
            one["required"] = ["kind", *one.get("required", [])]
            choices.append(one)
        properties[name] = {"oneOf": choices}
    properties["groups"] = {
        "type": "object",
        "description": "normalised groups, each instead of the SI parameter that it sets",
        "properties": {
            name: {"type": "number", "description": f"sets {target}"}
            for name, (target, _) in _groups.SETTERS.items()
        },
        "additionalProperties": False,
    }
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "wedgebrake study",
        "type": "object",
        "properties": {name: properties[name] for name in [*PARTS, "groups", "run"]},
        "required": list(PARTS),
        "additionalProperties": False,
    }


def _table_schema(model: type[Part]) -> dict[str, Any]:
    """The schema of one table; what a group can set is not required here."""
    table = model.model_json_schema()
    table.pop("title", None)
    settable = {target for target, _ in _groups.SETTERS.values()}
    required = [name for name in table.get("required", []) if name not in settable]
    table.pop("required", None)
    if required:
        table["required"] = required
    return table
