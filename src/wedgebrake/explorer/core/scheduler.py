"""Work in turns: threads shared by all pages, where the newest wish of a page replaces the older.

Work is an iterator; each of its steps is one turn and gives a result to show. Between two turns
others have theirs, and work that nobody wants any more ends. Kernels do not hold Python's lock,
so that a few threads keep all processors busy and the event loop answers meanwhile.

A thread within a kernel cannot be stopped. If a turn takes long, another thread is therefore
started in addition, and a turn that exceeds the time limit is reported as an error to its page.
"""

from __future__ import annotations

import heapq
import itertools
import logging
import threading
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from functools import cache, partial
from typing import Any

from wedgebrake.errors import WedgebrakeError
from wedgebrake.explorer.core.limits import LONGEST_EXPORT, LONGEST_TURN

Post = Callable[[Callable[[], None]], None]
"""Hands a function to the thread that owns a page: its event loop."""

_LOG = logging.getLogger("wedgebrake.explorer")
# Largest number of threads with long turns that are replaced by additional threads.
_MOST_AWAY = 16
# Time after which a turn is long, of a display and of an export [s].
_PATIENCE, _PATIENCE_FOR_FILES = 2.0, 60.0


@dataclass(eq=False)
class _Task:
    """One iterator, and where its results go."""

    lane: Lane
    steps: Iterator[Any]
    show: Callable[[Any], None]
    fail: Callable[[str], None]
    finished: Callable[[], None]
    later: int
    pause: float

    @property
    def wanted(self) -> bool:
        return self.lane.task is self


@dataclass(order=True)
class _Place:
    """A place in the queue: first what is urgent, then who came first."""

    urgency: int
    number: int
    task: _Task = field(compare=False)


@dataclass(eq=False)
class _Turn:
    """A turn in progress.

    since : start time [s]
    away  : True if an additional thread has replaced the one that computes it
    over  : True if it has exceeded the time limit
    """

    task: _Task
    since: float
    away: bool = False
    over: bool = False


class Turns:
    """Threads that take turns at the work of many lanes.

    threads  : number of threads; None: one for each processor
    patience : time in one turn after which a thread is replaced by another [s]
    limit    : time limit of a turn [s]
    """

    def __init__(
        self,
        threads: int | None = None,
        *,
        patience: float = _PATIENCE,
        limit: float = LONGEST_TURN,
    ) -> None:
        from wedgebrake.sweeps.executor import processors

        self._ready: list[_Place] = []
        self._resting: list[tuple[float, int, _Place]] = []
        self._numbers = itertools.count()
        lock = threading.Lock()
        self._changed, self._begun = threading.Condition(lock), threading.Condition(lock)
        self._closed = False
        self._patience, self._limit = patience, limit
        self._turns: set[_Turn] = set()
        self._wanted, self._here = threads or processors(), 0
        with lock:
            for _ in range(self._wanted):
                self._start_thread()
        threading.Thread(target=self._watch, name="wedgebrake-watch", daemon=True).start()

    def _start_thread(self) -> None:
        self._here += 1
        name = f"wedgebrake-{next(self._numbers)}"
        threading.Thread(target=self._take_turns, name=name, daemon=True).start()

    def lane(self, post: Post) -> Lane:
        """A lane whose results are shown by way of ``post``."""
        return Lane(self, post)

    def close(self) -> None:
        """End all threads when their turns are over."""
        with self._changed:
            self._closed = True
            self._ready.clear()
            self._resting.clear()
            self._changed.notify_all()
            self._begun.notify_all()

    def enqueue(self, task: _Task, urgency: int, pause: float = 0.0) -> None:
        """Wait for a turn, from ``pause`` seconds on."""
        with self._changed:
            place = _Place(urgency, next(self._numbers), task)
            if pause > 0.0:
                heapq.heappush(self._resting, (time.monotonic() + pause, place.number, place))
            else:
                heapq.heappush(self._ready, place)
            self._changed.notify()

    def _next(self) -> _Turn | None:
        """Turn of the next task in the queue; None when closed."""
        with self._changed:
            while not self._closed:
                now = time.monotonic()
                while self._resting and self._resting[0][0] <= now:
                    heapq.heappush(self._ready, heapq.heappop(self._resting)[2])
                while self._ready:
                    task = heapq.heappop(self._ready).task
                    if task.wanted:
                        turn = _Turn(task, time.monotonic())
                        self._turns.add(turn)
                        self._begun.notify()
                        return turn
                    _close(task)
                self._changed.wait(self._resting[0][0] - now if self._resting else None)
        return None

    def _take_turns(self) -> None:
        while (turn := self._next()) is not None:
            self._take(turn.task)
            if not self._returned(turn):
                return

    def _take(self, task: _Task) -> None:
        try:
            result = next(task.steps)
        except StopIteration:
            task.lane.end(task, task.finished)
        except WedgebrakeError as error:
            task.lane.end(task, partial(task.fail, str(error)))
        except Exception as error:
            _LOG.exception("a turn failed")
            words = f"internal error: {type(error).__name__}: {error}. Please report it."
            task.lane.end(task, partial(task.fail, words))
        else:
            task.lane.offer(task, result)
            self.enqueue(task, task.later, task.pause)
            task.pause = 0.0

    def _returned(self, turn: _Turn) -> bool:
        """Remove a finished turn; return True if its thread is still needed."""
        with self._changed:
            self._turns.discard(turn)
            if not turn.away:
                return True
            if self._here >= self._wanted:
                return False
            self._here += 1
            return True

    def _watch(self) -> None:
        """Replace threads whose turns are long, and report turns that exceed the time limit."""
        while True:
            with self._begun:
                if self._closed:
                    return
                now = time.monotonic()
                self._replace(now)
                lost = [one for one in self._turns if one.since + self._limit <= now]
                lost = [one for one in lost if not one.over]
                if not lost:
                    self._begun.wait(self._rest(now))
            for turn in lost:
                turn.over = True
                words = f"The computation exceeded the time limit of {self._limit:g} s."
                turn.task.lane.end(turn.task, partial(turn.task.fail, words))

    def _replace(self, now: float) -> None:
        away = sum(turn.away for turn in self._turns)
        for turn in self._turns:
            if away < _MOST_AWAY and not turn.away and turn.since + self._patience <= now:
                turn.away = True
                away += 1
                self._here -= 1
                self._start_thread()

    def _rest(self, now: float) -> float | None:
        """Time until the next check [s]; None: when the next turn begins."""
        times = [turn.since + self._patience for turn in self._turns if not turn.away]
        times += [turn.since + self._limit for turn in self._turns if not turn.over]
        later = [one for one in times if one > now]
        return min(later) - now if later else None


def _close(task: _Task) -> None:
    close = getattr(task.steps, "close", None)
    if close is not None:
        close()


class Lane:
    """One kind of work of one page, of which the newest is wanted.

    Results that the page has not shown yet are replaced by newer ones, so that a slow page is
    never behind by more than one.
    """

    def __init__(self, turns: Turns, post: Post) -> None:
        self._turns, self._post = turns, post
        self._lock = threading.Lock()
        self._offered: tuple[_Task, Any] | None = None
        self.task: _Task | None = None
        """The newest request."""

    def start(
        self,
        steps: Iterator[Any],
        show: Callable[[Any], None],
        fail: Callable[[str], None],
        *,
        finished: Callable[[], None] = lambda: None,
        urgency: int = 0,
        later: int = 9,
        pause: float = 0.0,
    ) -> None:
        """Begin work that replaces what the lane does now.

        steps    : each step gives a complete result
        show     : called with each result, where ``post`` brings it
        fail     : called with a sentence where a step raises
        finished : called after the last step
        urgency  : of the first step, 0 before all others; ``later`` : of those after it
        pause    : seconds between the first step and the second, so that it is not begun while
                   a slider still moves
        """
        task = _Task(self, steps, show, fail, finished, later, pause)
        with self._lock:
            self.task, self._offered = task, None
        self._turns.enqueue(task, urgency)

    def stop(self) -> None:
        """Want nothing more."""
        with self._lock:
            self.task = self._offered = None

    @property
    def busy(self) -> bool:
        """Return True while work continues."""
        return self.task is not None

    def offer(self, task: _Task, result: Any) -> None:
        """Show a result soon, unless a newer one comes before."""
        with self._lock:
            if self.task is not task:
                return
            waiting = self._offered is not None
            self._offered = (task, result)
        if not waiting:
            self._hand(self._show)

    def end(self, task: _Task, last: Callable[[], None]) -> None:
        """After the last step: what there is to say, if the work is still wanted."""

        def say() -> None:
            self._show()
            with self._lock:
                if self.task is not task:
                    return
                self.task = None
            last()

        if task.wanted:
            self._hand(say)

    def _hand(self, call: Callable[[], None]) -> None:
        """Hand a call to the page; one that has gone wants nothing more."""
        try:
            self._post(call)
        except Exception:
            _LOG.info("a page has gone while work was done for it")
            self.stop()

    def _show(self) -> None:
        with self._lock:
            offered, self._offered = self._offered, None
            if offered is None or self.task is not offered[0]:
                return
        task, result = offered
        task.show(result)


@cache
def common_turns() -> Turns:
    """The threads of all pages of this process."""
    return Turns()


@cache
def file_turns() -> Turns:
    """A thread apart for files: a fine picture may take minutes, and no motion waits for it."""
    return Turns(1, patience=_PATIENCE_FOR_FILES, limit=LONGEST_EXPORT)
