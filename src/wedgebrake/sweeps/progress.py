"""Progress of a sweep: points, rate and time left."""

from __future__ import annotations

import math
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from wedgebrake.model.display import duration


@dataclass(frozen=True)
class Progress:
    """Progress of a sweep at one moment.

    done, total : number of points; ``resumed`` of the done ones were in the store before
    rate        : points per second since this run began
    later       : points per second after the first ones, which may include compilation; 0 if
                  not known yet, None if equal to ``rate``
    """

    done: int
    total: int
    resumed: int
    rate: float
    later: float | None = None

    @property
    def left(self) -> float:
        """Estimated seconds left; inf while the rate is not known."""
        rate = self.rate if self.later is None else self.later
        return (self.total - self.done) / rate if rate > 0.0 else float("inf")

    def __str__(self) -> str:
        text = f"{self.done} of {self.total} points"
        if self.rate > 0.0:
            text += f", {self.rate:.3g} points/s"
        if self.done < self.total and math.isfinite(self.left):
            text += f", {duration(self.left)} left"
        return text


# Seconds between two reports, and between two lines written to a file or a pipe.
_REPORT_PAUSE, _LINE_PAUSE = 0.1, 10.0

Report = Callable[[Progress], None]


class Meter:
    """Count the points of a run and report progress, at once and then ten times a second.

    done : number of points done
    """

    def __init__(self, total: int, resumed: int, report: Report | None) -> None:
        self._total, self._resumed, self.done = total, resumed, resumed
        self._report = report
        self._start = time.perf_counter()
        self._first: tuple[int, float] | None = None
        self._last = -_REPORT_PAUSE
        if report is not None:
            report(Progress(resumed, total, resumed, 0.0))

    def add(self, points: int) -> None:
        """Add points that are done."""
        self.done += points
        now = time.perf_counter() - self._start
        if self._report is None or (now - self._last < _REPORT_PAUSE and self.done < self._total):
            return
        self._last = now
        rate = (self.done - self._resumed) / now if now > 0.0 else 0.0
        later = 0.0
        if self._first is None:
            self._first = self.done, now
        elif now > self._first[1]:
            later = (self.done - self._first[0]) / (now - self._first[1])
        self._report(Progress(self.done, self._total, self._resumed, rate, later))


class Bar:
    """Show progress on standard error: a bar on a terminal, else a line every ten seconds."""

    def __init__(self) -> None:
        self._bar: Any = None
        self._last = time.perf_counter()

    def __call__(self, progress: Progress) -> None:
        """Show progress."""
        finished = progress.done >= progress.total
        if sys.stderr is None:
            return
        if sys.stderr.isatty():
            self._draw(progress, finished)
        elif finished or time.perf_counter() - self._last >= _LINE_PAUSE:
            self._last = time.perf_counter()
            sys.stderr.write(f"{progress}\n")
            sys.stderr.flush()

    def __enter__(self) -> Bar:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Restore the terminal."""
        if self._bar is not None:
            self._bar.stop()
            self._bar = None

    def _draw(self, progress: Progress, finished: bool) -> None:
        from rich.console import Console
        from rich.progress import BarColumn, TextColumn
        from rich.progress import Progress as Bars

        if self._bar is None:
            columns = (BarColumn(), TextColumn("{task.description}"))
            self._bar = Bars(*columns, console=Console(stderr=True), auto_refresh=False)
            self._bar.start()
            self._bar.add_task("", total=progress.total)
        self._bar.update(0, completed=progress.done, description=str(progress), refresh=True)
        if finished:
            self.close()
