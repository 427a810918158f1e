"""``--set NAME=VALUE``: one parameter, group or run setting."""

from __future__ import annotations

import tomllib
from collections.abc import Iterable
from typing import Any

from wedgebrake.errors import InputError


def parse_changes(texts: Iterable[str]) -> dict[str, Any]:
    """The changes of several ``--set`` options, values written as in a study file.

    Raises ``InputError`` for a text that is not NAME=VALUE, or a name given twice.
    """
    changes: dict[str, Any] = {}
    for text in texts:
        name, separator, value = (part.strip() for part in text.partition("="))
        if not separator or not name or not value:
            raise InputError(f"--set {text}: must be NAME=VALUE, for example --set eta=-30.")
        if name in changes:
            raise InputError(f"--set {name}: given twice. Give it once.")
        changes[name] = _value(text, value)
    return changes


def _value(text: str, value: str) -> Any:
    try:
        read = tomllib.loads(f"value = {value}")
    except tomllib.TOMLDecodeError:
        # A bare word is taken as a string, so that --set method=smooth needs no quotes.
        if value.replace("-", "").replace("_", "").isalnum() and not value[0].isdigit():
            return value
        raise InputError(
            f"--set {text}: {value!r} is not a value. Write a number, true, false, a word, or"
            " [a, b]."
        ) from None
    if set(read) != {"value"}:
        raise InputError(f"--set {text}: must be one NAME=VALUE.")
    return read["value"]
