"""Files, written whole or not at all."""

from __future__ import annotations

import contextlib
import secrets
from pathlib import Path

from wedgebrake.errors import OutputError


def write(target: Path, content: bytes) -> None:
    """A file, complete or, after an error, as it was: written beside it, then renamed.

    Raises ``OutputError`` where nothing can be written.
    """
    beside = target.with_name(f".{target.name}.{secrets.token_hex(6)}.part")
    try:
        try:
            with beside.open("xb") as file:
                file.write(content)
            beside.replace(target)
        except BaseException:
            with contextlib.suppress(OSError):
                beside.unlink()
            raise
    except (OSError, ValueError) as error:  # a name with a zero byte
        reason = str(getattr(error, "strerror", None) or error).lower()
        raise OutputError(
            f"path = {str(target)!r}: cannot be written ({reason}). Make room, or choose"
            " a folder that exists and that you may write to."
        ) from None
