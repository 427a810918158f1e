"""Files, written whole or not at all."""

from __future__ import annotations

import contextlib
import os
import secrets
from collections.abc import Iterator
from pathlib import Path
from typing import IO

from wedgebrake.errors import OutputError


def write(target: Path, content: bytes) -> None:
    """Write a file atomically: after an error its previous state is unchanged.

    Raises ``OutputError`` if the file cannot be written.
    """
    with whole(target) as file:
        file.write(content)


@contextlib.contextmanager
def whole(target: Path) -> Iterator[IO[bytes]]:
    """Open a temporary file that is renamed to ``target`` when the block ends without an error.

    The temporary file is in the folder of ``target``. After an error, or Ctrl-C, it is removed,
    and an existing ``target`` is unchanged.

    Raises ``OutputError`` if the file cannot be written, also for an ``OSError`` in the block.
    """
    beside = target.with_name(f".{target.name}.{secrets.token_hex(6)}.part")
    try:
        file = beside.open("x+b")
    except (OSError, ValueError) as error:  # a name with a zero byte
        raise _not_written(target, error) from None
    try:
        with file:
            yield file
            file.flush()
            # A full disk may be reported only here.
            os.fsync(file.fileno())
        beside.replace(target)
    except BaseException as error:
        with contextlib.suppress(OSError):
            beside.unlink()
        if isinstance(error, OSError):
            raise _not_written(target, error) from None
        raise


def _not_written(target: Path, error: OSError | ValueError) -> OutputError:
    reason = str(getattr(error, "strerror", None) or error).lower()
    return OutputError(
        f"path = {str(target)!r}: cannot be written ({reason}). Free disk space, or"
        " choose an existing folder with write permission."
    )
