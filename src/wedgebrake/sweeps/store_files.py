"""Files of a store: written whole or not at all, and by one process at a time."""

from __future__ import annotations

import contextlib
import json
import os
import socket
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from wedgebrake.errors import InputError, OutputError


def replace_file(target: Path, content: bytes, scratch: Path) -> None:
    """Write under the name ``scratch``, on the same disk, then rename.

    A process killed at any instant leaves the old file, the new one, or none under the name
    ``target``. Not forced out to the disk (5 ms a file): who fears a power failure reads the
    checksums afterwards.
    """
    try:
        with scratch.open("wb") as file:
            file.write(content)
        try:
            scratch.replace(target)
        except FileNotFoundError:
            target.parent.mkdir(parents=True, exist_ok=True)
            scratch.replace(target)
    except BaseException:
        with contextlib.suppress(OSError):
            scratch.unlink()
        raise


def is_there(path: Path) -> bool:
    """Whether there is such a file or folder; one that may not be looked at is none."""
    try:
        path.stat()
    except (OSError, ValueError):
        return False
    return True


def is_folder(path: Path) -> bool:
    """Whether there is such a folder; one that may not be looked at is none."""
    try:
        return path.is_dir()
    except (OSError, ValueError):
        return False


def reason(error: OSError) -> str:
    """What the system says, as part of a sentence."""
    return (error.strerror or str(error)).lower()


class WriterLock:
    """The right to write in a store; an OS lock, which ends with its process.

    folder : where the lock's files are; must exist
    store  : the store, for messages
    """

    def __init__(self, folder: Path, store: Path) -> None:
        from filelock import FileLock

        # The same lock from whatever thread closes the store.
        self._lock = FileLock(folder / "lock", timeout=0, thread_local=False)
        # Apart from the lock's own file, which others cannot read on Windows.
        self._writer = folder / "writer.json"
        self._scratch = folder / "writer.partial"
        self._store = store

    def acquire(self) -> None:
        """Take it, or raise ``InputError`` at once with who has it."""
        from filelock import Timeout

        try:
            self._lock.acquire()
        except Timeout:
            raise InputError(
                f"path = {str(self._store)!r}: {self._holder()} is writing in it. Wait until"
                " it ends, or end it: what it has finished stays, and resume=True (--resume on"
                " the command line) goes on with it. Or choose another name."
            ) from None
        except (OSError, NotImplementedError) as error:
            why = reason(error) if isinstance(error, OSError) else str(error)
            raise OutputError(
                f"path = {str(self._store)!r}: cannot be locked for writing ({why}). Choose a"
                " folder that you may write to, on a disk that knows file locks."
            ) from None
        who = {
            "pid": os.getpid(),
            "host": socket.gethostname(),
            "since": datetime.now(UTC).isoformat(sep=" ", timespec="seconds"),
        }
        # Only for the message above: a full disk shall not hide here what it stops later.
        with contextlib.suppress(OSError):
            replace_file(self._writer, json.dumps(who).encode(), self._scratch)

    def release(self) -> None:
        """Give it back; without effect where it is not held."""
        if self._lock.is_locked:
            with contextlib.suppress(OSError):
                self._writer.unlink()
            self._lock.release()

    def _holder(self) -> str:
        try:
            who: Any = json.loads(self._writer.read_bytes())
            pid, host, since = who["pid"], who["host"], who["since"]
        except (OSError, ValueError, KeyError, TypeError):
            return "another process"
        if (pid, host) == (os.getpid(), socket.gethostname()):
            return f"another sweep of this process, {pid} (since {since}),"
        return f"process {pid} on {host} (since {since})"
