"""``--set NAME=VALUE``: one parameter, group or run setting."""

from __future__ import annotations

import tomllib
from collections.abc import Iterable
from typing import Any

from wedgebrake.errors import InputError
from wedgebrake.model.system import PARTS
from wedgebrake.model.tables import CHOSEN
from wedgebrake.model.validation import shown

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


def parse_changes(texts: Iterable[str]) -> dict[str, Any]:
    """The changes of several ``--set`` options, values written as in a study file.

    Raises ``InputError`` for a text that is not NAME=VALUE, or a name given twice.
    """
    changes: dict[str, Any] = {}
    for text in texts:
        name, separator, value = (part.strip() for part in text.partition("="))
        if not separator or not name or not value:
            raise InputError(f"--set {short(text)}: must be NAME=VALUE, for example --set eta=-30.")
        _check_name(text, name)
        if name in changes:
            raise InputError(f"--set {short(name)}: given twice. Give it once.")
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
            f"--set {short(text)}: another kind has other parameters, so that it cannot be set"
            f" alone. Edit a copy of the study file, kind and parameters: {'; '.join(kinds)}."
        )
    if table == "sweep":
        raise InputError(
            f"--set {short(text)}: what is swept, and its settings, are options of the command"
            " sweep: --over, --periods, --transient, --follow; of the others, for example"
            " --set limit=5000."
        )
    if table in _TABLES and not dot:
        raise InputError(
            f"--set {short(text)}: {table} is a table. Change its parameters one by one, for"
            f" example --set {_EXAMPLES[table]}, or edit the study file."
        )
    if table in _TABLES and rest.isidentifier():
        raise InputError(
            f"--set {short(text)}: write the name without its table: --set {rest}=VALUE."
        )


def _value(text: str, value: str) -> Any:
    try:
        read = tomllib.loads(f"value = {value}")
    except (ValueError, RecursionError):
        return _word_or_number(text, value)
    if set(read) != {"value"}:
        raise InputError(f"--set {short(text)}: must be one NAME=VALUE.")
    return read["value"]


def _word_or_number(text: str, value: str) -> str | float:
    """What TOML would not have: a bare word (method=smooth), or a number such as .5."""
    if value.replace("-", "").replace("_", "").isalnum() and not value[0].isdigit():
        return value
    try:
        return float(value)
    except ValueError:
        raise InputError(
            f"--set {short(text)}: {shown(value)} is not a value. Write a number, true, false,"
            " a word, or [a, b]."
        ) from None


def short(text: str) -> str:
    """The option as it was given, if that is a plain line."""
    return text if text.isprintable() and len(text) <= 60 else shown(text)
