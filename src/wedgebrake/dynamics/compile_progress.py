"""Progress of compilation: the kernel that Python has called, and the compiled share of it."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any, NamedTuple

from numba.core import event
from numba.core.dispatcher import Dispatcher

# Seconds between two reports.
_PAUSE = 0.1


class CompileProgress(NamedTuple):
    """Progress of the compilation of a kernel.

    kernel, part : names of the kernel that Python has called, and of its present part
    share        : of its parts, each of which counts the same, that are compiled or in the cache
    """

    kernel: str
    part: str
    share: float

    def __str__(self) -> str:
        return f"Compiling {self.kernel}: {self.part}, {self.share:.0%}"


Report = Callable[[CompileProgress], None]


@contextmanager
def reported(report: Report) -> Iterator[None]:
    """Report progress in this context: at the start of a kernel, then up to ten times a second."""
    with event.install_listener("numba:compile", _Listener(report)):
        yield


def report_always(report: Report, at_end: Callable[[], None]) -> None:
    """Report progress from now on, as ``reported``, and the end of each kernel."""
    event.register("numba:compile", _Listener(report, at_end))


def report_in_notebooks() -> None:
    """Report progress below the cells of a notebook, on one line that is overwritten each time."""
    if "ipykernel" in sys.modules:
        report_always(_overwrite, at_end=lambda: _overwrite(""))


def _overwrite(text: CompileProgress | str) -> None:
    sys.stderr.write(f"\r{text!s:<78.78}" + ("" if text else "\r"))
    sys.stderr.flush()


class _Listener(event.Listener):
    """Listener to Numba's compilations, which are nested, and only one of which runs at a time."""

    def __init__(self, report: Report, at_end: Callable[[], None] = lambda: None) -> None:
        self._report, self._at_end, self._last = report, at_end, 0.0
        self._nested: list[str] = []
        self._parts: set[Dispatcher] = set()
        self._total = 0

    def on_start(self, found: Any) -> None:
        dispatcher = found.data["dispatcher"]
        self._nested.append(_name(dispatcher))
        first = len(self._nested) == 1
        if first:
            self._parts = _parts(dispatcher)
            self._total = len(self._parts)
        if first or time.monotonic() - self._last >= _PAUSE:
            self._last = time.monotonic()
            missing = sum(not one.stats.cache_hits for one in self._parts)
            share = 1.0 - missing / self._total
            self._report(CompileProgress(self._nested[0], self._nested[-1], share))

    def on_end(self, found: Any) -> None:
        self._parts.discard(found.data["dispatcher"])
        self._nested.pop()
        if not self._nested:
            self._at_end()


def _name(dispatcher: Any) -> str:
    """Name of a kernel, preceded by the last part of the name of its module."""
    function = dispatcher.py_func
    return f"{function.__module__.rpartition('.')[2]}.{function.__name__}"


def _parts(dispatcher: Any) -> set[Any]:
    """A kernel and all kernels that it calls by name."""
    found, ahead = {dispatcher}, [dispatcher]
    while ahead:
        function = ahead.pop().py_func
        named = (function.__globals__.get(name) for name in function.__code__.co_names)
        new = {one for one in named if isinstance(one, Dispatcher)} - found
        found |= new
        ahead += new
    return found
