"""While the user waits: a word on compilation, and an ear for Ctrl-C."""

from __future__ import annotations

import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any, TypeVar

_Result = TypeVar("_Result")


class Interrupted(Exception):  # noqa: N818 - not an error
    """The user pressed Ctrl-C."""


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
    try:
        while thread.is_alive():
            thread.join(0.1)  # without a limit, Windows would not hear Ctrl-C
    except KeyboardInterrupt:
        raise Interrupted from None
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
