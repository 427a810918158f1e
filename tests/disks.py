"""Disks that are full, for the writers of files."""

from __future__ import annotations

import errno
import os
import resource
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest


@pytest.fixture
def full_disk(monkeypatch: pytest.MonkeyPatch) -> None:
    """A disk that says at the end of a file that there was no room for it."""

    def fail(_: int) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(os, "fsync", fail)


def with_room(size: int, *arguments: object, **options: Any) -> subprocess.CompletedProcess[str]:
    """A program of Python in a process that can write no file of more than ``size`` bytes.

    Python ignores the signal that comes with it, so that a write fails as on a full disk.
    """

    def limit() -> None:
        resource.setrlimit(resource.RLIMIT_FSIZE, (size, size))

    return subprocess.run(
        [sys.executable, *map(str, arguments)],
        capture_output=True, text=True, timeout=300, preexec_fn=limit, **options,
    )  # fmt: skip


def earlier(folder: Path, name: str) -> bytes:
    """What stands in the only file that is to be in a folder, ``name``."""
    assert [path.name for path in folder.iterdir()] == [name]
    return (folder / name).read_bytes()
