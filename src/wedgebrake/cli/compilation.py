"""Messages on the compilation of kernels."""

from __future__ import annotations

import math
import time
from collections.abc import Iterator
from contextlib import contextmanager

from wedgebrake.cli.streams import say

# Seconds between two messages.
_PAUSE = 5.0


@contextmanager
def announce_compilation() -> Iterator[list[str]]:
    """Report on standard error that kernels are being compiled: at once, then every five seconds.

    Yields a list that receives the messages.
    """
    from wedgebrake.dynamics.compile_progress import CompileProgress, reported

    said: list[str] = []
    last = -math.inf

    def report(progress: CompileProgress) -> None:
        nonlocal last
        if time.monotonic() - last >= _PAUSE:
            last = time.monotonic()
            hint = "" if said else " Needed only once; wedgebrake compile does it in advance."
            said.append(f"{progress}.{hint}")
            say(said[-1])

    with reported(report):
        yield said
