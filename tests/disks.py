"""Disks that are full, for the writers of files."""

from __future__ import annotations

import errno
import os
import resource
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest


@pytest.fixture
def full_disk(monkeypatch: pytest.MonkeyPatch) -> None:
    """A disk that says at the end of a file that there was no room for it."""

    def fail(_: int) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(os, "fsync", fail)


@contextmanager
def room(size: int) -> Iterator[None]:
    """Within it no file may grow beyond ``size`` bytes.

    Python ignores the signal that comes with it, so that a write fails as on a full disk.
    """
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, before[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)


def earlier(folder: Path, name: str) -> bytes:
    """What stands in the only file that is to be in a folder, ``name``."""
    assert [path.name for path in folder.iterdir()] == [name]
    return (folder / name).read_bytes()
