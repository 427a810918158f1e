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
    """Write a file, complete or, after an error, as it was.

    Raises ``OutputError`` where nothing can be written.
    """
    with whole(target) as file:
        file.write(content)


@contextlib.contextmanager
def whole(target: Path) -> Iterator[IO[bytes]]:
    """Open a file that takes the name ``target`` when the block ends without an error.

    Until then it lies beside ``target`` under another name; after an error, or Ctrl-C, it is
    gone, and what had the name before is as it was.

    Raises ``OutputError`` where nothing can be written, also for an ``OSError`` of the block.
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
            # A disk may say only now that it is full.
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
        f"path = {str(target)!r}: cannot be written ({reason}). Make room, or choose"
        " a folder that exists and that you may write to."
    )
