"""What can go wrong, in words for the person who can mend it."""

from __future__ import annotations

import difflib
from collections.abc import Iterable


class WedgebrakeError(Exception):
    """Base of every error that wedgebrake raises on purpose."""


class InputError(WedgebrakeError, ValueError):
    """An argument or a study file is wrong; the message names it and the way out."""


class OutputError(WedgebrakeError, OSError):
    """A result could not be written; nothing half-written is left."""


def nearest(word: str, allowed: Iterable[str]) -> str:
    """A sentence that suggests the allowed words nearest to ``word``."""
    allowed = sorted(allowed)
    close = difflib.get_close_matches(word, allowed, n=3, cutoff=0.6)
    if not close:
        lowered = {name.lower(): name for name in allowed}
        close = [lowered[word.lower()]] if word.lower() in lowered else []
    if close:
        return "Did you mean " + " or ".join(repr(name) for name in close) + "?"
    return "Allowed: " + ", ".join(allowed) + "."
