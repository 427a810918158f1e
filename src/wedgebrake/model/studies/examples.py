"""The example study files of the package."""

from __future__ import annotations

import itertools
import re
from pathlib import Path

import wedgebrake

_PACKAGE = Path(wedgebrake.__file__).parent
# Folders in an installed package and in a clone.
_FOLDERS = (_PACKAGE / "examples", _PACKAGE.parents[1] / "examples")


def example_files() -> dict[str, Path]:
    """The paths of all examples by name."""
    folder = next(folder for folder in _FOLDERS if (folder / "paper.toml").is_file())
    return {path.stem: path for path in sorted(folder.glob("*.toml"))}


def first_sentence(path: Path) -> str:
    """The first sentence of the comment that begins a study file."""
    lines = path.read_text(encoding="utf-8").splitlines()
    comment = itertools.takewhile(lambda line: line.startswith("#"), lines)
    words = " ".join(line.removeprefix("#").strip() for line in comment)
    return re.split(r"(?<=\.)\s", words)[0].rstrip(".")
