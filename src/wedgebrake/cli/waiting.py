"""A word to the user while the kernels are compiled for the first time."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any


@contextmanager
def announce_compilation() -> Iterator[None]:
    """Say once, on standard error, that kernels are being compiled, if they are."""
    from numba.core import event

    class Listener(event.Listener):  # type: ignore[misc]  # Numba is untyped
        said = False

        def on_start(self, _: Any) -> None:
            if not self.said:
                sys.stderr.write(
                    "Compiling the kernels: once per installation, about ten seconds ...\n"
                )
                sys.stderr.flush()
            self.said = True

        def on_end(self, _: Any) -> None:
            """Nothing to say."""

    with event.install_listener("numba:compile", Listener()):
        yield
