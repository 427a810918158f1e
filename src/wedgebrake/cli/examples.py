"""The command ``example``: example study files of wedgebrake."""

from __future__ import annotations

import os
import re
from pathlib import Path

from wedgebrake.cli.output import check_target, of_option
from wedgebrake.errors import InputError, OutputError, nearest
from wedgebrake.model.files import write
from wedgebrake.model.studies.examples import example_files, first_sentence

_RECORD = r'(?m)^file = "([^"/]+)"'


def listing() -> str:
    """The names of the examples, with the first sentence of the comment that begins each."""
    paths = example_files()
    lines = ["Examples, written by wedgebrake example NAME --out NAME.toml:"]
    for name, path in paths.items():
        lines.append(f"  {name:{max(map(len, paths)) + 2}}{first_sentence(path)}")
    return "\n".join(lines)


def example(name: str) -> str:
    """The text of an example.

    Raises ``InputError`` for an unknown name.
    """
    paths = example_files()
    if name not in paths:
        raise InputError(f"example {name}: not known. {nearest(name, paths)}")
    return paths[name].read_text(encoding="utf-8")


def written(name: str, path: Path) -> Path:
    """Write an example and its records to new files; returns the full path of the example.

    Raises ``InputError`` for an unknown name and if a file exists or cannot exist, and
    ``OutputError`` if one cannot be written; no incomplete file remains.
    """
    text = example(name)
    check_target("--out", path, (".toml",))
    if os.path.lexists(path):
        raise InputError(f"--out {path}: already exists. Choose another name.")
    records = [example_files()[name].with_name(record) for record in re.findall(_RECORD, text)]
    for record in records:
        beside = path.with_name(record.name)
        if os.path.lexists(beside) and beside.read_bytes() != record.read_bytes():
            raise InputError(
                f"--out {path}: its record {beside} already exists. Choose another folder."
            )
    try:
        for record in records:
            write(path.with_name(record.name), record.read_bytes())
        write(path, text.encode())
    except OutputError as error:
        raise of_option(error, "--out", path) from None
    return path.resolve()
