"""The study of a command: its file, changed by ``--set``, ``--method`` and other options."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterable, Mapping
from pathlib import Path
from types import MappingProxyType
from typing import Any

from wedgebrake.errors import InputError, nearest
from wedgebrake.model.study import METHODS, Study, load_study
from wedgebrake.model.sweep_settings import Sweep
from wedgebrake.model.system import PARTS
from wedgebrake.model.tables import CHOSEN
from wedgebrake.model.validation import as_typed, shown

_TABLES = (*PARTS, "groups", "run", "sweep")
# A parameter of each table that can be set.
_EXAMPLES = {
    "driveline": "damping=0.2",
    "brake": "radius=0.25",
    "friction": "kinetic=0.25",
    "actuation": "slope=-20",
    "excitation": "amplitude=300",
    "groups": "eta=-30",
    "run": "periods=50",
}

# Settings that a sweep and a continuation do not use, and what to give instead.
NOT_SWEPT = {
    "periods": "belongs to simulate. For a sweep give --periods.",
    "duration": "belongs to simulate. For a sweep give --periods, in periods of the torque.",
    "samples_per_period": "belongs to simulate. A sweep looks once in each period. Leave it out.",
}
NOT_CONTINUED = {
    **dict.fromkeys(
        ("periods", "duration", "samples_per_period"),
        "belongs to simulate. An orbit lasts as many periods as --order says. Leave it out.",
    ),
    **dict.fromkeys(
        ("transient", "limit", "follow", "keep_points"), "belongs to sweep. Leave it out."
    ),
    "step": "belongs to the fixed step of simulate. Along a branch it is --step.",
}


def load(
    path: Path,
    changes: Iterable[str] | None,
    method: str | None = None,
    unused: Mapping[str, str] = MappingProxyType({}),
    options: Mapping[str, Any] = MappingProxyType({}),
) -> Study:
    """Read a study file and apply ``--set`` and ``--method``.

    unused  : settings that the command does not use, and what to give instead
    options : of the command; their names must not be set as well

    Raises ``InputError``.
    """
    wanted = parse_changes(changes or ())
    if method is not None:
        if method not in METHODS:
            raise InputError(f"--method {method}: not known. {nearest(method, METHODS)}")
        if "method" in wanted:
            raise InputError("--method and --set method: both given. Give one of them.")
    for name in wanted:
        if name in unused:
            raise InputError(f"--set {name}: {unused[name]}")
        if options.get(name) is not None:
            raise InputError(f"--{name} and --set {name}: both given. Give one of them.")
    study = load_study(path)
    try:
        study = study.changed(**wanted)
    except InputError as error:
        raise InputError(f"--set: {error}") from None
    return study if method is None else study.changed(method=method)


def load_for_sweep(
    path: Path,
    changes: Iterable[str] | None,
    method: str | None,
    over: list[str] | None,
    options: Mapping[str, Any],
) -> Study:
    """As ``load``, with the axes of ``--over`` and the other options of a sweep in its [sweep].

    options : transient, periods and follow, as far as they are given
    """
    from wedgebrake.cli.ranges import parse_axes

    study = load(path, changes, method, NOT_SWEPT, options)
    settings = {name: value for name, value in options.items() if value is not None}
    if settings.get("transient", "auto") != "auto":
        try:
            settings["transient"] = int(settings["transient"])
        except ValueError:
            raise InputError(
                f"--transient {as_typed(settings['transient'])}: must be a whole number of periods,"
                " or auto."
            ) from None
    axes = parse_axes(over, study.system) if over else study.sweep.axes
    try:
        return study.changed(sweep=Sweep(**{**study.sweep.arguments(), **settings}, axes=axes))
    except InputError as error:
        raise InputError(in_options(str(error), r"\w+", "sweep.")) from None


def in_options(text: str, names: str, table: str = "") -> str:
    """Rewrite a message about arguments as one about the options with their names.

    names : a regular expression for them, for example r"order|step"
    """
    return re.sub(rf"(?m)^{re.escape(table)}({names}) = ", r"--\1 ", text)


def parse_changes(texts: Iterable[str]) -> dict[str, Any]:
    """The changes of several ``--set`` options, values written as in a study file.

    Raises ``InputError`` for a text that is not NAME=VALUE, or a name given twice.
    """
    changes: dict[str, Any] = {}
    for text in texts:
        name, separator, value = (part.strip() for part in text.partition("="))
        if not separator or not name or not value:
            raise InputError(
                f"--set {as_typed(text)}: must be NAME=VALUE, for example --set eta=-30."
            )
        _check_name(text, name)
        if name in changes:
            raise InputError(f"--set {as_typed(name)}: given twice. Give it once.")
        changes[name] = _value(text, value)
    return changes


def _check_name(text: str, name: str) -> None:
    """Refuse whole tables, and names with their table, which are not needed."""
    table, dot, rest = name.partition(".")
    if "kind" in (name, rest):
        kinds = (
            f"[{one}] {', '.join(map(repr, sorted(CHOSEN[one])))}"
            for one in CHOSEN
            if one == table or table not in CHOSEN
        )
        raise InputError(
            f"--set {as_typed(text)}: another kind has other parameters, so that it cannot be set"
            f" alone. Edit a copy of the study file, kind and parameters: {'; '.join(kinds)}."
        )
    if table == "sweep":
        raise InputError(
            f"--set {as_typed(text)}: what is swept, and its settings, are options of the command"
            " sweep: --over, --periods, --transient, --follow; of the others, for example"
            " --set limit=5000."
        )
    if table in _TABLES and not dot:
        raise InputError(
            f"--set {as_typed(text)}: {table} is a table. Change its parameters one by one, for"
            f" example --set {_EXAMPLES[table]}, or edit the study file."
        )
    if table in _TABLES and rest.isidentifier():
        raise InputError(
            f"--set {as_typed(text)}: write the name without its table: --set {rest}=VALUE."
        )


def _value(text: str, value: str) -> Any:
    try:
        read = tomllib.loads(f"value = {value}")
    except (ValueError, RecursionError):
        return _word_or_number(text, value)
    if set(read) != {"value"}:
        raise InputError(f"--set {as_typed(text)}: must be one NAME=VALUE.")
    return read["value"]


def _word_or_number(text: str, value: str) -> str | float:
    """Parse a value that is not TOML: a bare word (method=smooth), or a number such as .5."""
    if value.replace("-", "").replace("_", "").isalnum() and not value[0].isdigit():
        return value
    try:
        return float(value)
    except ValueError:
        raise InputError(
            f"--set {as_typed(text)}: {shown(value)} is not a value. Write a number, true, false,"
            " a word, or [a, b]."
        ) from None
