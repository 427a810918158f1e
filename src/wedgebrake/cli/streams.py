"""Standard streams that are always open and that escape control characters."""

from __future__ import annotations

import io
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

# Characters that control a terminal: control characters other than newline and tab, and marks of
# the writing direction. File names may contain them.
_OBEYED = {*range(0x20), *range(0x7F, 0xA0), *range(0x202A, 0x202F), *range(0x2066, 0x206A)}
_ESCAPES = {code: ascii(chr(code))[1:-1] for code in _OBEYED - set(map(ord, "\n\t"))}


class _Shown:
    """Wrapper of a stream that escapes the characters that control a terminal."""

    def __init__(self, stream: Any) -> None:
        self._stream = stream

    def __getattr__(self, name: str) -> Any:
        if name == "buffer":  # Click would use it to bypass ``write`` for ASCII text
            raise AttributeError(name)
        return getattr(self._stream, name)

    @property
    def rich_proxied_file(self) -> Any:
        """Unwrapped stream for Rich, which draws progress bars with control characters."""
        return self._stream

    def write(self, text: str) -> int:
        return int(self._stream.write(text.translate(_ESCAPES)))


@contextmanager
def standard_streams() -> Iterator[None]:
    """Replace standard output and error by streams that accept any text.

    Characters that are missing in the terminal's encoding, or that control the terminal, are
    written as escape sequences. If standard output is closed (``>&-``), writing fails, and files
    that are opened later do not receive its file descriptor.
    """
    _take_places()
    before = sys.stdout, sys.stderr
    if sys.stdout is None:
        sys.stdout = open(1, "w", encoding="utf-8", closefd=False)  # noqa: SIM115
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")
    sys.stdout, sys.stderr = (
        one if one is None else _Shown(one) for one in (sys.stdout, before[1])
    )
    try:
        yield
    finally:
        sys.stdout, sys.stderr = before


def _take_places() -> None:
    """Open the null device for each closed standard stream; output read-only: writing fails."""
    for number, flags in ((0, os.O_RDONLY), (1, os.O_RDONLY), (2, os.O_WRONLY)):
        try:
            os.fstat(number)
        except OSError:
            os.open(os.devnull, flags)  # receives the lowest free file descriptor


def say(message: str) -> None:
    """Write a line to standard error, if that is open."""
    if sys.stderr is not None:
        sys.stderr.write(message + "\n")
        sys.stderr.flush()
