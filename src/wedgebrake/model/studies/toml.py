"""TOML, as far as study files need it: tables of parameters."""

from __future__ import annotations

import json
import re
import tomllib
from collections.abc import Mapping
from typing import Any

from wedgebrake.errors import InputError
from wedgebrake.model.validation import is_finite, shown

LARGEST = 1_000_000
"""Bytes of a study file; it is a page, not a data set."""
# Names of so many parts, a.b.c, that tomllib takes minutes for them: its time goes with
# their square.
_DEEPEST = 100
# Comments stand below each other, beside lines up to so many characters.
_WIDEST = 40


def read(content: bytes | str) -> dict[str, Any]:
    """The tables of a study file, as ``tomllib`` gives them.

    Raises ``InputError`` for what is too large, no text, empty or no TOML.
    """
    text = _text(content)
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


def _text(content: bytes | str) -> str:
    # A text has at least as many bytes as characters.
    if len(content) <= LARGEST:
        try:
            content = content.encode() if isinstance(content, str) else content
            text = content.decode("utf-8-sig")
        except UnicodeError:
            raise InputError("is not text: must be a study file (TOML, in UTF-8).") from None
    if len(content) > LARGEST:
        raise InputError(f"is larger than {LARGEST} bytes: must be a study file, a page of text.")
    if not text.strip():
        raise InputError(
            "is empty. Fill it, beginning with what `wedgebrake example paper` prints."
        )
    return text


def _line_of(why: str, text: str) -> str:
    """The line that tomllib complains about."""
    found = re.search(r"at line (\d+)", why)
    if found is None:
        return ""
    line = text.split("\n")[int(found[1]) - 1]
    return f" in {shown(line.strip())}"


def table(name: str, values: Mapping[str, Any], comments: Mapping[str, str]) -> str:
    """A table as text, a value a line with its comment beside it.

    values : numbers, texts, True, False, or lists and tables of such; a table is written inline

    Raises ``InputError`` for anything else.
    """
    lines = {
        key: f"{_key(key)} = {_value(value, f'{name}.{key}')}" for key, value in values.items()
    }
    lengths = [len(line) for key, line in lines.items() if comments.get(key)]
    widest = max((length for length in lengths if length <= _WIDEST), default=0)
    text = f"[{name}]\n"
    for key, line in lines.items():
        comment = comments.get(key, "")
        text += f"{line:<{widest}}  # {comment}\n" if comment else f"{line}\n"
    return text


def _key(name: str) -> str:
    return name if re.fullmatch(r"[A-Za-z0-9_-]+", name) else _quoted(name)


def _quoted(text: str) -> str:
    """A basic string: JSON's, but for one character that TOML has escaped."""
    return json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007f")


def _value(value: Any, name: str) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, int | float) and is_finite(value):
        return repr(value)
    if isinstance(value, str):
        return _quoted(value)
    if isinstance(value, list | tuple):
        return "[" + ", ".join(_value(one, name) for one in value) + "]"
    if isinstance(value, Mapping):
        inside = (f"{_key(key)} = {_value(one, f'{name}.{key}')}" for key, one in value.items())
        return "{ " + ", ".join(inside) + " }"
    raise InputError.of(
        name, value, "cannot stand in a study file. Use finite numbers, texts, true or false, or"
        " lists of them.", allowed="finite numbers, texts, true or false, or lists of them",
    )  # fmt: skip
