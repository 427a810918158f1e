"""Places where what the paper prints differs from what it must have computed."""

from __future__ import annotations

import tomllib
from importlib.resources import files
from typing import NamedTuple


class Correction(NamedTuple):
    """Correction of one place.

    where     : equation, figure or section
    printed   : there
    corrected : used here instead
    evidence  : for the correction
    """

    where: str
    printed: str
    corrected: str
    evidence: str


CORRECTIONS = tuple(
    Correction(**table)
    for table in tomllib.loads(
        files("wedgebrake.paper").joinpath("corrections.toml").read_text(encoding="utf-8")
    )["correction"]
)
