"""A study file: the machine and the run, with the same names as the Python objects."""

from __future__ import annotations

import math
import tomllib
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar, Literal

from pydantic import Field

from wedgebrake.errors import InputError, nearest
from wedgebrake.model import groups as _groups
from wedgebrake.model.brakes import Brake
from wedgebrake.model.driveline import Driveline
from wedgebrake.model.excitation import HarmonicTorque
from wedgebrake.model.friction import Friction
from wedgebrake.model.part import Part
from wedgebrake.model.system import PARTS, BrakedDriveline
from wedgebrake.model.actuation import Actuation

_LARGEST = 1_000_000  # bytes; a study is a page, not a data set
# What stands in for an SI value until the group that sets it is applied.
_PLACEHOLDERS = {"slope": 0.0, "frequency": 1.0, "amplitude": 1.0, "angle": 0.5}
_FIXED: dict[str, type[Part]] = {
    "driveline": Driveline,
    "actuation": Actuation,
    "excitation": HarmonicTorque,
}
_CHOSEN: dict[str, dict[str, type[Brake]] | dict[str, type[Friction]]] = {
    "brake": Brake.kinds,
    "friction": Friction.kinds,
}


class Run(Part):
    """What to simulate: the arguments of ``wb.simulate``, with its defaults."""

    table: ClassVar[str] = "run"

    duration: float | None = Field(default=None, description="how long [s]")
    periods: int | None = Field(default=None, description="how long, in torque periods")
    initial: tuple[float, float] = Field(
        default=(0.0, 0.0), description="angle [rad] and velocity [rad/s] at the start",
        strict=False,
    )  # fmt: skip
    start_time: float = Field(default=0.0, description="time of the start [s]")
    method: Literal["exact", "smooth", "ode14x"] | None = Field(
        default=None, description="the solver; default by the friction law"
    )
    samples_per_period: int = Field(default=200, description="samples in a torque period")
    rtol: float = Field(default=1e-9, description="relative tolerance of smooth")
    step: float = Field(default=1e-4, description="fixed step of ode14x [s]")
    max_events: int = Field(default=10_000_000, description="limit of exact")
    max_steps: int = Field(default=100_000_000, description="limit of smooth and ode14x")

    def arguments(self) -> dict[str, Any]:
        """Keyword arguments of ``wb.simulate``."""
        given = dict(self)
        if self.duration is None and self.periods is None:
            given["periods"] = 250
        return given


@dataclass(frozen=True)
class Study:
    """A system and how to run it."""

    system: BrakedDriveline
    run: Run

    def changed(self, **changes: Any) -> Study:
        """A copy with other parameters, groups or run settings (``eta=-30, periods=50``).

        ``duration`` and ``periods`` replace each other.
        """
        for_run = {name: value for name, value in changes.items() if name in Run.model_fields}
        for_system = {name: value for name, value in changes.items() if name not in for_run}
        settings = {name: getattr(self.run, name) for name in self.run.model_fields_set}
        if "duration" in for_run and "periods" not in for_run:
            settings.pop("periods", None)
        if "periods" in for_run and "duration" not in for_run:
            settings.pop("duration", None)
        system = self.system.replace(**for_system) if for_system else self.system
        return Study(system, Run(**{**settings, **for_run}))


def load_study(path: str | Path) -> Study:
    """Read a study file (TOML).

    Tables ``driveline``, ``brake``, ``friction``, ``actuation``, ``excitation``; optional
    ``groups`` (eta, f, F0, alpha instead of the SI values that they set) and ``run``.

    Raises ``InputError`` that names the file and what is wrong in it.
    """
    path = Path(path)
    try:
        return parse_study(_read(path))
    except InputError as error:
        raise InputError(f"{path}: {error}") from None


def _read(path: Path) -> dict[str, Any]:
    if path.is_dir():
        raise InputError("is a directory: must be a study file (TOML).")
    try:
        size = path.stat().st_size
        if size > _LARGEST:
            raise InputError(f"has {size} bytes: a study file has at most {_LARGEST}.")
        text = path.read_text(encoding="utf-8")
    except FileNotFoundError:
        raise InputError(
            "no such file. Give the path of a study file; examples/paper.toml is one."
        ) from None
    except OSError as error:
        raise InputError(f"cannot be read ({error.strerror}).") from None
    except UnicodeDecodeError:
        raise InputError("is not text: must be a study file (TOML, UTF-8).") from None
    try:
        return tomllib.loads(text)
    except (tomllib.TOMLDecodeError, RecursionError) as error:
        raise InputError(
            f"is not TOML: {error}. A line reads name = value, under a [table]."
        ) from None


def parse_study(tables: dict[str, Any]) -> Study:
    """A study from its tables, as ``tomllib`` gives them.

    Raises ``InputError`` that names the table, the parameter, the value and the way out.
    """
    allowed = [*PARTS, "groups", "run"]
    for name, table in tables.items():
        if name not in allowed:
            raise InputError(f"[{name}]: no such table. {nearest(name, allowed)}")
        if not isinstance(table, dict):
            raise InputError(
                f"{name} = {table!r}: must be a table. Write [{name}] on a line of its own, and"
                " its parameters below."
            )
    missing = [name for name in PARTS if name not in tables]
    if missing:
        raise InputError(
            f"missing: {', '.join(f'[{name}]' for name in missing)}. A study has the tables"
            f" {', '.join(f'[{name}]' for name in PARTS)}; examples/paper.toml shows them."
        )
    chosen = _chosen_groups(tables.get("groups", {}), tables)
    parts: dict[str, Any] = {name: _part(name, tables[name], chosen) for name in PARTS}
    system = BrakedDriveline(**parts)
    if chosen:
        system = system.replace(**chosen)
    return Study(system, Run(**tables.get("run", {})))


def _chosen_groups(given: dict[str, Any], tables: dict[str, Any]) -> dict[str, float]:
    """The [groups] table, checked against unknown names and doubled parameters."""
    for name, value in given.items():
        if name not in _groups.SETTERS:
            raise InputError(f"groups.{name}: no such group. {nearest(name, _groups.SETTERS)}")
        if not isinstance(value, int | float) or isinstance(value, bool):
            raise InputError(f"groups.{name} = {value!r}: must be a number.")
        if not math.isfinite(value):
            raise InputError(f"groups.{name} = {value!r}: must be finite (not nan, not inf).")
        target = _groups.SETTERS[name][0]
        doubled = [part for part in PARTS if target in tables[part]]
        if doubled:
            raise InputError(
                f"groups.{name} and {doubled[0]}.{target}: both given, but {name} sets {target}."
                " Remove one of them."
            )
    return dict(given)


def _part(name: str, table: dict[str, Any], chosen: dict[str, float]) -> Part:
    values = dict(table)
    if name in _FIXED:
        model = _FIXED[name]
    else:
        kinds = _CHOSEN[name]
        if "kind" not in values:
            raise InputError(f"{name}.kind: missing. Allowed: {', '.join(sorted(kinds))}.")
        kind = values.pop("kind")
        if not isinstance(kind, str) or kind not in kinds:
            raise InputError(f"{name}.kind = {kind!r}: not known. {nearest(str(kind), kinds)}")
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
    properties["run"] = _table_schema(Run)
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
