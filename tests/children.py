"""Processes that tests start and interrupt."""

from __future__ import annotations

import signal
import subprocess
import time
from collections.abc import Callable
from typing import Any


def started(command: list[Any], **options: Any) -> subprocess.Popen:
    """``subprocess.Popen`` of a process that hears Ctrl-C.

    Where the tests run in the background SIGINT is ignored, and what they start would inherit
    that. A handler is not inherited: the process begins with the default.
    """
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        return subprocess.Popen(command, **options)
    finally:
        signal.signal(signal.SIGINT, before)


def interrupted(process: subprocess.Popen, ready: Callable[[], bool]) -> tuple[str, str]:
    """Press Ctrl-C in a process once it is ready; its output and messages."""
    while not ready():
        assert process.poll() is None, process.communicate()
        time.sleep(0.01)
    process.send_signal(signal.SIGINT)
    return process.communicate(timeout=60)
