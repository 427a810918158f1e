"""Long computations: progress on standard error, and immediate reaction to Ctrl-C."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeVar

from wedgebrake.solvers.interrupts import interruptible
from wedgebrake.sweeps.progress import Bar, Progress

_Result = TypeVar("_Result")


@dataclass(frozen=True)
class Stage(Progress):
    """Progress with a text."""

    resumed: int = 0
    rate: float = 0.0
    words: str = ""

    def __str__(self) -> str:
        return self.words


class ProgressDisplay:
    """Receives progress in the thread of the work, and shows it in the main thread.

    After Ctrl-C in the main thread nothing more is drawn.
    """

    def __init__(self) -> None:
        self.last: Progress | None = None
        self._shown: Progress | None = None
        self._bar = Bar()

    def hear(self, progress: Progress) -> None:
        """Receive progress from the work."""
        self.last = progress

    def show(self) -> None:
        """Show new progress since the last call."""
        last = self.last
        if last is not None and last is not self._shown:
            self._shown = last
            self._bar(last)

    def wait(self, work: Callable[[], _Result]) -> _Result:
        """The result of ``work``, computed in a thread while progress is shown."""
        with self._bar:
            return interruptible(work, self.show)
