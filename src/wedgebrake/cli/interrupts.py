"""A separate exception for Ctrl-C."""

from __future__ import annotations

import atexit
import os
import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType
from typing import NoReturn


class Interrupted(BaseException):
    """The user pressed Ctrl-C."""


@contextmanager
def hearing_interrupts() -> Iterator[None]:
    """Inside, Ctrl-C raises ``Interrupted``: the effect of KeyboardInterrupt in Typer varies."""
    ours = threading.current_thread() is threading.main_thread()
    if not ours or signal.getsignal(signal.SIGINT) is not signal.default_int_handler:
        yield
        return
    signal.signal(signal.SIGINT, _interrupt)
    # During the shutdown of the process Ctrl-C ends it without a message.
    atexit.register(signal.signal, signal.SIGINT, signal.SIG_DFL)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, signal.default_int_handler)


def _interrupt(_: int, frame: FrameType | None) -> NoReturn:
    while frame is not None:
        if frame.f_code.co_filename.startswith("<frozen importlib"):
            # During an import an exception may be suppressed or replaced. Nothing has been
            # started that would have to be finished.
            os.write(2, b"interrupted\n")
            os._exit(1)
        frame = frame.f_back
    raise Interrupted
