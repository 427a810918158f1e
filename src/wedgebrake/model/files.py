"""Files, written whole or not at all."""

from __future__ import annotations

import contextlib
import os
import secrets
from pathlib import Path

from wedgebrake.errors import OutputError


def write(target: Path, content: bytes) -> None:
    """Write a file atomically: after an error, or Ctrl-C, its previous state is unchanged.

    The content goes to a temporary file in the same folder, which is then renamed.

    Raises ``OutputError`` if the file cannot be written.
    """
    beside = target.with_name(f".{target.name}.{secrets.token_hex(6)}.part")
    try:
        with beside.open("xb") as file:
            file.write(content)
            file.flush()
            # A full disk may be reported only here.
            os.fsync(file.fileno())
        beside.replace(target)
    except BaseException as error:
        with contextlib.suppress(OSError, ValueError):
            beside.unlink()
        if not isinstance(error, OSError | ValueError):  # ValueError: a name with a zero byte
            raise
        reason = str(getattr(error, "strerror", None) or error).lower()
        raise OutputError(
            f"path = {str(target)!r}: cannot be written ({reason}). Free disk space, or"
            " choose an existing folder with write permission."
        ) from None
