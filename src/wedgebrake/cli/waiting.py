"""While the user waits: a word on compilation, and an ear for Ctrl-C."""

from __future__ import annotations

import signal
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any, NoReturn, TypeVar

_Result = TypeVar("_Result")


class Interrupted(BaseException):
    """The user pressed Ctrl-C."""


@contextmanager
def hearing_interrupts() -> Iterator[None]:
    """Inside, Ctrl-C raises ``Interrupted``: what Typer does with KeyboardInterrupt varies."""
    ours = threading.current_thread() is threading.main_thread()
    if not ours or signal.getsignal(signal.SIGINT) is not signal.default_int_handler:
        yield
        return
    signal.signal(signal.SIGINT, _interrupt)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, signal.default_int_handler)


def _interrupt(*_: Any) -> NoReturn:
    raise Interrupted


def interruptible(work: Callable[[], _Result]) -> _Result:
    """The result of ``work``, done in a thread, so that Ctrl-C is heard meanwhile.

    Python hears signals in its main thread only, and not while a compiled loop runs there.
    """
    results: list[_Result] = []
    errors: list[BaseException] = []

    def run() -> None:
        try:
            results.append(work())
        except BaseException as error:
            errors.append(error)

    thread = threading.Thread(target=run, daemon=True)
    thread.start()
    while thread.is_alive():
        thread.join(0.1)  # without a limit, Windows would not hear Ctrl-C
    if errors:
        raise errors[0]
    return results[0]


@contextmanager
def announce_compilation() -> Iterator[None]:
    """Say once, on standard error, that kernels are being compiled, if they are."""
    from numba.core import event

    class Listener(event.Listener):
        said = False

        def on_start(self, _: Any) -> None:
            if not self.said and sys.stderr is not None:
                sys.stderr.write(
                    "Compiling the kernels: once per installation, about ten seconds ...\n"
                )
                sys.stderr.flush()
            self.said = True

        def on_end(self, _: Any) -> None:
            """Nothing to say."""

    with event.install_listener("numba:compile", Listener()):
        yield
