"""A study file: the machine, the run and the sweep, with the names of the Python objects."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any, ClassVar, Literal, get_args

from pydantic import Field, model_validator

from wedgebrake.errors import InputError, nearest
from wedgebrake.model import toml
from wedgebrake.model.display import Tabular, part_rows
from wedgebrake.model.groups import SETTERS, check_group
from wedgebrake.model.part import Part, given, parameter
from wedgebrake.model.sweep_settings import SWEEP_SETTINGS, Sweep, parse_sweep, sweep_schema
from wedgebrake.model.system import PARTS, BrakedDriveline
from wedgebrake.model.tables import CHOSEN, FIXED, refuse_of_another_kind, table_schema
from wedgebrake.model.validation import check_choice, check_instance, named, shown

Method = Literal["exact", "smooth", "ode14x"]
METHODS: tuple[str, ...] = get_args(Method)
_State = Annotated[float, Field(ge=-1e12, le=1e12)]
# SI values until the group that sets them is applied: those of wb.paper.system, so that the same
# groups give the same system there, to the last bit.
_PLACEHOLDERS = {"slope": 0.0, "frequency": 10.0, "amplitude": 500.0, "angle": 0.34}


class Run(Part):
    """Arguments of ``wb.simulate``, with its defaults."""

    table: ClassVar[str] = "run"

    duration: float | None = parameter(
        "length of the run", unit="s", example=25.0, default=None, ge=0, le=1e12
    )
    periods: int | None = parameter(
        "length of the run in periods of the torque (250, without duration)",
        example=250, default=None, gt=0, le=1_000_000_000,
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
        "the solver (default: by the friction law)", unit="-", example="exact", default=None
    )
    samples_per_period: int = parameter(
        "samples in a period of the torque", example=200, default=200, gt=0, le=50_000_000
    )
    rtol: float = parameter(
        "relative tolerance of the method smooth", example=1e-9, default=1e-9, ge=1e-13, le=1e-2
    )
    step: float = parameter(
        "fixed step of the method ode14x", unit="s", example=1e-4, default=1e-4, ge=1e-9, le=1
    )
    max_events: int = parameter(
        "most events of the method exact", example=10_000_000, default=10_000_000,
        gt=0, le=1_000_000_000_000,
    )  # fmt: skip
    max_steps: int = parameter(
        "most steps of the methods smooth and ode14x", example=100_000_000, default=100_000_000,
        gt=0, le=1_000_000_000_000,
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
        without = self.duration is None and self.periods is None
        return {**dict(self), "periods": 250} if without else dict(self)


_FIXED: dict[str, type[Part]] = {**FIXED, "run": Run}


@dataclass(frozen=True)
class Study(Tabular):
    """A system, the settings of a run, and a sweep."""

    system: BrakedDriveline
    run: Run
    sweep: Sweep = field(default_factory=Sweep)

    def changed(self, /, **changes: Any) -> Study:
        """A copy with other parameters, groups or run settings (``eta=-30, periods=50``).

        changes : the new values, by name

        ``duration`` and ``periods`` are those of the run and replace each other. Of the sweep,
        ``transient``, ``limit``, ``follow`` and ``keep_points`` can be changed by name, and all
        of it by ``sweep=Sweep(...)``.
        """
        for name, value in changes.items():
            self._check(name)
            if name in SETTERS:
                check_group(name, value)
        for_sweep = {name: changes.pop(name) for name in _CHANGED if name in changes}
        for_run = {name: changes.pop(name) for name in Run.model_fields if name in changes}
        settings = given(self.run)
        for one, other in (("duration", "periods"), ("periods", "duration")):
            if one in for_run and other not in for_run:
                settings.pop(other, None)
        sweep = for_sweep.pop("sweep", self.sweep)
        check_instance("sweep", sweep, Sweep)
        system = self.system.replace(**changes) if changes else self.system
        return Study(system, Run(**{**settings, **for_run}), Sweep(**{**given(sweep), **for_sweep}))

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

    def _check(self, name: str) -> None:
        """Refuse an unknown name, with the nearest of all that can be changed."""
        parts = self.system.parts().values()
        fields = [name for part in parts for name in type(part).model_fields]
        allowed = [*fields, *SETTERS, *PARTS, *Run.model_fields, *_CHANGED]
        if name in allowed:
            return
        refuse_of_another_kind(name, self.system)
        hint = nearest(name, allowed)
        if hint == nearest("initial_velocity", allowed):
            hint += " It holds angle [rad] and velocity [rad/s], for example initial=[0.0, 5.0]."
        raise InputError(f"{named(name)}: no such parameter, group or run setting. {hint}")


# What ``changed`` takes for the sweep; ``periods`` is the run's.
_CHANGED = ("sweep", *(name for name in SWEEP_SETTINGS if name != "periods"))


def load_study(path: str | Path) -> Study:
    """Read the study file (TOML) at a path.

    Tables ``driveline``, ``brake``, ``friction``, ``actuation``, ``excitation``; optional
    ``groups`` (eta, f, F0, alpha instead of the SI values that they set), ``run`` and
    ``sweep``.

    Raises ``InputError`` that names the file and what is wrong in it.
    """
    path = Path(check_instance("path", path, str | os.PathLike, "the path of a study file (TOML)"))
    with _about(str(path)):
        return parse_study(toml.read(_content(path)))


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
        raise InputError(text) from None


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
    system = system.replace(**chosen) if chosen else system
    return Study(system, run, parse_sweep(tables.get("sweep", {}), system))


def _check_tables(tables: dict[str, Any]) -> None:
    allowed = [*PARTS, "groups", "run", "sweep"]
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
            f" {', '.join(f'[{name}]' for name in PARTS)}; `wedgebrake example paper` shows them."
        )


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
    if name in _FIXED:
        model = _FIXED[name]
    else:
        kinds = CHOSEN[name]
        if "kind" not in values:
            words = ", ".join(repr(kind) for kind in sorted(kinds))
            raise InputError(f"{name}.kind: missing. Allowed: {words}.")
        model = kinds[check_choice(f"{name}.kind", values.pop("kind"), kinds)]
    for group in chosen:
        target = SETTERS[group].target
        if name == SETTERS[group].part and target in model.model_fields:
            values.setdefault(target, _PLACEHOLDERS[target])
    return model(**values)


def schema() -> dict[str, Any]:
    """JSON schema of study files."""
    properties: dict[str, Any] = {name: table_schema(model) for name, model in _FIXED.items()}
    for name, kinds in CHOSEN.items():
        choices = []
        for kind, model in sorted(kinds.items()):
            one = table_schema(model)
            one["properties"] = {"kind": {"const": kind}, **one["properties"]}
            one["required"] = ["kind", *one.get("required", [])]
            choices.append(one)
        properties[name] = {"oneOf": choices}
    properties["groups"] = {
        "type": "object",
        "description": "normalised groups, each instead of the SI parameter that it sets",
        "properties": {
            name: {"type": "number", "description": f"{setter.meaning}; sets {setter.target}"}
            for name, setter in SETTERS.items()
        },
        "additionalProperties": False,
    }
    properties["sweep"], definitions = sweep_schema()
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "wedgebrake study",
        "type": "object",
        "properties": {name: properties[name] for name in [*PARTS, "groups", "run", "sweep"]},
        "required": list(PARTS),
        "additionalProperties": False,
        "$defs": definitions,
    }
