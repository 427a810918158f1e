"""A long computation, watched: progress on standard error, and an ear for Ctrl-C."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar

from wedgebrake.solvers.interrupts import interruptible
from wedgebrake.sweeps.progress import Bar, Progress

_Result = TypeVar("_Result")


def watched(work: Callable[[Callable[[Progress], None]], _Result]) -> _Result:
    """The result of ``work``, which is done in a thread and gets whom to tell its progress."""
    watch = Watch()
    with watch:
        return interruptible(lambda: work(watch.hear), watch.show)


class Watch:
    """Hears of the progress in the thread of the work, and shows it in the main one.

    So that nothing is drawn any more once that one has heard Ctrl-C.
    """

    def __init__(self) -> None:
        self.last: Progress | None = None
        self._shown: Progress | None = None
        self._bar = Bar()

    def hear(self, progress: Progress) -> None:
        """For the work."""
        self.last = progress

    def show(self) -> None:
        """Show new progress since the last call."""
        last = self.last
        if last is not None and last is not self._shown:
            self._shown = last
            self._bar(last)

    def __enter__(self) -> Watch:
        return self

    def __exit__(self, kind: object, *_: object) -> None:
        if kind is None:
            self.show()  # what came last, if nobody has looked since
        self._bar.close()
