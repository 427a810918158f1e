"""Docstrings of this project as reStructuredText.

They are plain text: paragraphs, sections with underlined titles, indented formulas, and lists

    name  : what it means [unit]
    other : ...

``reading`` turns them into what Sphinx renders; nothing in them is markup but ``code``. The
parameters of a part of the machine come from its fields, with symbol, unit, range and default.
"""

from __future__ import annotations

import re
import textwrap
from typing import Any

from pydantic import BaseModel
from pydantic.fields import FieldInfo
from sphinx.application import Sphinx

from wedgebrake.model.part import FIELDS
from wedgebrake.model.validation import labels

_NAMES = re.compile(r"\**\w[\w*.]*(?:, \**\w[\w*.]*)*|\"[^\"]+\"")
_UNDERLINE = re.compile(r"-{3,}\s*")
_BOUNDS = (("gt", "> "), ("ge", "≥ "), ("lt", "< "), ("le", "≤ "))


def setup(app: Sphinx) -> dict[str, bool]:
    """Register with Sphinx."""
    app.connect("autodoc-process-docstring", _process)
    return {"parallel_read_safe": True}


def _process(
    _app: Sphinx, what: str, _name: str, subject: Any, _options: Any, lines: list[str]
) -> None:
    text = reading("\n".join(lines).partition(f"\n{FIELDS}")[0])
    if what == "class" and issubclass(subject, BaseModel):
        text += "\n\n" + parameters(subject)
    lines[:] = text.split("\n")


def reading(text: str) -> str:
    """A docstring, without common indentation, as reStructuredText."""
    blocks = [_block(lines) for lines in _paragraphs(text)]
    return "\n\n".join(block for block in blocks if block)


def parameters(part: type[BaseModel]) -> str:
    """The fields of a part as a list: name, symbol and unit, then range, default and meaning."""
    return "\n".join(
        f"``{name}`` : {_facts(field)}\n   {_meaning(field)}"
        for name, field in part.model_fields.items()
    )


def _facts(field: FieldInfo) -> str:
    extra = labels(field)
    symbol, unit = extra.get("symbol"), extra.get("unit")
    facts = [f"{symbol} [{unit}]"] if symbol and (symbol, unit) != ("-", "-") else []
    bounds = [
        f"{sign}{getattr(one, key):.6g}"
        for one in field.metadata
        for key, sign in _BOUNDS
        if isinstance(getattr(one, key, None), int | float)
    ]
    facts += [", ".join(bounds)] if bounds else []
    if field.default_factory is None and not field.is_required():
        facts.append(f"default {field.default}")
    return escaped("; ".join(facts) or getattr(field.annotation, "__name__", "any"))


def _meaning(field: FieldInfo) -> str:
    words = field.description or f"one of class {getattr(field.annotation, '__name__', '')}"
    return escaped(words[0].upper() + words[1:] + ".")


def escaped(text: str) -> str:
    """Text in which only ``code`` is markup, and a page of docs a link."""
    parts = re.split(r"(``.+?``)", text)
    parts[::2] = [re.sub(r"([\\*|_`])", r"\\\1", part) for part in parts[::2]]
    return re.sub(r"docs/(\w+)\.md", r":doc:`\1 </\1>`", "".join(parts))


def _paragraphs(text: str) -> list[list[str]]:
    """Its paragraphs; a section, to the next line that is not its own, is one."""
    lines, found, current = text.rstrip().split("\n"), [], []
    for i, line in enumerate(lines):
        section = bool(current) and len(current) > 1 and bool(_UNDERLINE.fullmatch(current[1]))
        heads = i + 1 < len(lines) and bool(_UNDERLINE.fullmatch(lines[i + 1]))
        goes_on = section and not heads and _belongs(lines, i)
        if current and (heads or not (line.strip() or goes_on)):
            found.append(current)
            current = []
        if section and not goes_on and current:
            found.append(current)
            current = []
        if line.strip() or current:
            current.append(line)
    return [*found, current] if current else found


def _belongs(lines: list[str], i: int) -> bool:
    """Whether a line of a section is still of its list: indented, or before an indented one."""
    rest = lines[i:]
    while rest and not rest[0].strip():
        rest = rest[1:]
    if not rest or rest[0].startswith(" "):
        return bool(rest)
    if _UNDERLINE.fullmatch(rest[0]):
        return True
    return len(rest) > 1 and rest[1].startswith(" ")


def _block(lines: list[str]) -> str:
    if len(lines) > 1 and _UNDERLINE.fullmatch(lines[1]):
        return f"**{lines[0].strip()}**\n\n{_entries(lines[2:])}"
    if lines[0].startswith(" "):
        return "::\n\n" + textwrap.indent(textwrap.dedent("\n".join(lines)), "   ")
    if lines[0].startswith("==="):
        return "\n".join(lines)  # a table
    column = _column(lines)
    if column is not None:
        return _list(lines, column)
    if lines[0].startswith("- "):
        return "\n".join(line[:2] + escaped(line[2:]) for line in lines)
    return "\n".join(escaped(line) for line in lines)


def _entries(lines: list[str]) -> str:
    """The list of a section: ``name : type``, or a type, and below it what it is."""
    found: list[tuple[str, list[str]]] = []
    for line in lines:
        if line.strip() and not line.startswith(" "):
            found.append((line.strip(), []))
        elif found:
            found[-1][1].append(line)
    return "\n".join(_entry(head, "\n".join(below)) for head, below in found)


def _entry(head: str, below: str) -> str:
    name, _, kind = head.partition(" : ")
    title = f"``{name}`` : {escaped(kind)}" if kind else f"``{name}``"
    return title + "\n" + textwrap.indent(reading(textwrap.dedent(below).strip("\n")), "   ") + "\n"


def _column(lines: list[str]) -> int | None:
    """Where the colons of a list of names stand; None if it is no such list."""
    first = re.match(r"(\S.*?) +: ", lines[0])
    if first and _NAMES.fullmatch(first[1]):
        return first.end() - 2
    second = re.match(r" +: ", lines[1]) if len(lines) > 1 else None
    if second and _NAMES.fullmatch(lines[0].strip()):
        return second.end() - 2
    return None


def _list(lines: list[str], column: int) -> str:
    found: list[tuple[str, list[str]]] = []
    waiting = ""
    for line in lines:
        if line[column : column + 2] == ": " and (waiting or not line.startswith(" ")):
            found.append((f"{waiting} {line[:column].strip()}".strip(), [line[column + 2 :]]))
            waiting = ""
        elif not line.startswith(" "):
            name, colon, meaning = line.partition(" : ")
            if colon:  # a name longer than the column
                found.append((name.strip(), [meaning]))
            else:
                waiting = line.strip()
        else:
            found[-1][1].append(line.strip())
    return "\n".join(
        f"{_codes(names)}\n{textwrap.indent(escaped(chr(10).join(below)), '   ')}"
        for names, below in found
    )


def _codes(names: str) -> str:
    return ", ".join(f"``{name}``" for name in names.split(", "))
