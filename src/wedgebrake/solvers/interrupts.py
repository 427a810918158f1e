"""Long computations in a separate thread, so that Ctrl-C can interrupt them."""

from __future__ import annotations

import threading
from collections.abc import Callable
from concurrent.futures import Future
from typing import TypeVar

_Result = TypeVar("_Result")

# Longest wait for interrupted work [s]: it ends at its next step, unless it is being compiled.
_PATIENCE = 1.0


def interruptible(
    work: Callable[[], _Result],
    meanwhile: Callable[[], None] = lambda: None,
    stop: Callable[[], None] | None = None,
) -> _Result:
    """Return the result of ``work``, computed so that Ctrl-C can interrupt the wait.

    Python handles signals only in its main thread, and not while a compiled loop runs there. When
    called in the main thread, ``work`` therefore runs in a new thread, otherwise in place.

    meanwhile : called about ten times a second in the main thread, and once at the end
    stop      : called when the wait is interrupted, to make ``work`` end soon. Without it the
                work continues to its end in the background.
    """
    if threading.current_thread() is not threading.main_thread():
        return work()
    future: Future[_Result] = Future()
    # The wait is for a plain lock: an interrupted wait of a condition (which futures, events and
    # queues use) may end with "release unlocked lock" in place of the interruption.
    running = threading.Lock()
    running.acquire()

    def run() -> None:
        try:
            future.set_result(work())
        except BaseException as error:
            future.set_exception(error)
        finally:
            running.release()

    # A daemon, for which the interpreter does not wait at its end, as it does for an executor's.
    threading.Thread(target=run, daemon=True).start()
    try:
        # Without a timeout, Windows would not handle Ctrl-C.
        while not running.acquire(timeout=0.1):
            meanwhile()
        meanwhile()  # the work may have ended just after the last call
    except BaseException:
        if stop is not None:
            stop()
            running.acquire(timeout=_PATIENCE)
        raise
    return future.result()
