"""Reading what the command line printed."""

import json
import re
from pathlib import Path
from typing import Any


def strict_json(text: str) -> Any:
    """The one object in a text, without the nan and infinities that JSON does not have."""

    def refuse(constant: str) -> Any:
        raise AssertionError(constant)

    return json.loads(text, parse_constant=refuse)


def unwrapped(text: str) -> str:
    """The words, whatever the width of the terminal."""
    return re.sub(r"\s+", " ", text)


def names(folder: str | Path = ".") -> list[str]:
    """Names of the files in a folder."""
    return sorted(path.name for path in Path(folder).iterdir())
