"""The command ``example``: example study files of wedgebrake."""

from __future__ import annotations

import itertools
import os
import re
from pathlib import Path

import wedgebrake
from wedgebrake.cli.output import check_target, of_option
from wedgebrake.errors import InputError, OutputError, nearest
from wedgebrake.model.files import write

_PACKAGE = Path(wedgebrake.__file__).parent
# Folders in an installed package and in a clone.
_FOLDERS = (_PACKAGE / "examples", _PACKAGE.parents[1] / "examples")


_RECORD = r'(?m)^file = "([^"/]+)"'


def listing() -> str:
    """The names of the examples, with the first sentence of the comment that begins each."""
    paths = _paths()
    lines = ["Examples, written by wedgebrake example NAME --out NAME.toml:"]
    for name, path in paths.items():
        about = _first_sentence(path.read_text(encoding="utf-8"))
        lines.append(f"  {name:{max(map(len, paths)) + 2}}{about}")
    return "\n".join(lines)


def _first_sentence(text: str) -> str:
    """The first sentence of the comment that begins a study."""
    comment = itertools.takewhile(lambda line: line.startswith("#"), text.splitlines())
    words = " ".join(line.removeprefix("#").strip() for line in comment)
    return re.split(r"(?<=\.)\s", words)[0].rstrip(".")


def example(name: str) -> str:
    """The text of an example.

    Raises ``InputError`` for an unknown name.
    """
    paths = _paths()
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
    records = [_paths()[name].with_name(record) for record in re.findall(_RECORD, text)]
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


def _paths() -> dict[str, Path]:
    folder = next(folder for folder in _FOLDERS if (folder / "paper.toml").is_file())
    return {path.stem: path for path in sorted(folder.glob("*.toml"))}
