"""Standard streams that are there, and that move no terminal's cursor."""

from __future__ import annotations

import io
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

# What a terminal obeys: control characters but the ends of lines and tabs, and the marks that
# turn the direction of writing. Names of files may hold them.
_OBEYED = {*range(0x20), *range(0x7F, 0xA0), *range(0x202A, 0x202F), *range(0x2066, 0x206A)}
_ESCAPES = {code: ascii(chr(code))[1:-1] for code in _OBEYED - set(map(ord, "\n\t"))}


class _Shown:
    """A stream that writes as escapes what a terminal would obey."""

    def __init__(self, stream: Any) -> None:
        self._stream = stream

    def __getattr__(self, name: str) -> Any:
        if name == "buffer":  # by which Click goes round ``write`` where all is ASCII
            raise AttributeError(name)
        return getattr(self._stream, name)

    @property
    def rich_proxied_file(self) -> Any:
        """For Rich, which draws bars with control characters of its own."""
        return self._stream

    def write(self, text: str) -> int:
        return int(self._stream.write(text.translate(_ESCAPES)))


@contextmanager
def standard_streams() -> Iterator[None]:
    """Inside, standard output and error can be written to, whatever is written.

    Characters that the terminal's encoding lacks, or that it would obey, become escapes. Where
    standard output was closed (``>&-``), writing fails; and no file that is opened later takes
    its place.
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
    """Open the null device where a standard stream is closed; as output, so that writing fails."""
    for number, flags in ((0, os.O_RDONLY), (1, os.O_RDONLY), (2, os.O_WRONLY)):
        try:
            os.fstat(number)
        except OSError:
            os.open(os.devnull, flags)  # takes the lowest number that is free
