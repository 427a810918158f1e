"""Long work in a thread of its own, so that Ctrl-C is heard meanwhile, and ends it."""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import TypeVar

_Result = TypeVar("_Result")

# How long an interrupted work may take to end [s]: it does so at its next step, unless it compiles.
_PATIENCE = 1.0


def interruptible(
    work: Callable[[], _Result],
    meanwhile: Callable[[], None] = lambda: None,
    stop: Callable[[], None] | None = None,
) -> _Result:
    """The result of ``work``, done in a thread where Ctrl-C would not be heard.

    Python hears signals in its main thread only, and not while a compiled loop runs there. In
    another thread the work is done in place.

    meanwhile : called here about ten times a second, and once at the end
    stop      : called here when the wait is broken off; makes ``work`` end soon. Without it the
                work goes on to its end, in the background.
    """
    if threading.current_thread() is not threading.main_thread():
        return work()
    results: list[_Result] = []
    errors: list[BaseException] = []

    def run() -> None:
        try:
            results.append(work())
        except BaseException as error:
            errors.append(error)

    thread = threading.Thread(target=run, daemon=True)
    thread.start()
    try:
        while thread.is_alive():
            thread.join(0.1)  # without a limit, Windows would not hear Ctrl-C
            meanwhile()
        meanwhile()  # the work may have ended just after the last time
    except BaseException:
        if stop is not None:
            stop()
            thread.join(_PATIENCE)
        raise
    if errors:
        raise errors[0]
    return results[0]
