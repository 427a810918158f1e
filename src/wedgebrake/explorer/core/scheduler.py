"""Threads shared by all pages, where the newest job of a page replaces older ones.

A job is an iterator whose steps give results to show; other jobs run between two of its steps.
Kernels do not hold Python's lock, so that a few threads keep all processors busy and the event
loop answers meanwhile. A thread within a kernel cannot be stopped: if a step takes long, another
thread is started in its place, and a step beyond the time limit is reported to its page.
"""

from __future__ import annotations

import itertools
import logging
import math
import threading
import time
from collections.abc import Callable, Generator, Iterator
from dataclasses import dataclass
from functools import cache, partial
from queue import PriorityQueue
from typing import Any

from wedgebrake.errors import WedgebrakeError
from wedgebrake.explorer.core.limits import LONGEST_EXPORT, LONGEST_STEP

Post = Callable[[Callable[[], None]], None]
"""Hands a function to the thread that owns a page: its event loop."""

_LOG = logging.getLogger("wedgebrake.explorer")
# Largest number of threads with long steps that are replaced.
_MOST_REPLACED = 16
# Longest time that a job waits for the first result of the previous job [s].
_LONGEST_WAIT = 0.4
# Time after which a step counts as long, for a display and for an export [s].
_PATIENCE, _PATIENCE_FOR_FILES = 2.0, 60.0
# The job whose step a thread computes.
_THREAD = threading.local()


@dataclass(eq=False)
class _Job:
    """One iterator, and where its results go.

    since    : start of the step in progress [s]; inf once it has been reported as too long
    replaced : True if another thread has taken the place of the one that computes the step
    shown    : True if its first result has been shown
    """

    slot: Slot
    steps: Iterator[Any]
    show: Callable[[Any], None]
    fail: Callable[[str], None]
    finished: Callable[[], None]
    later: int
    pause: float
    since: float = math.inf
    replaced: bool = False
    shown: bool = False


class Scheduler:
    """Threads that compute the jobs of many slots, a step at a time, the urgent ones first.

    threads  : number of threads; None: one for each processor
    patience : time in one step after which a thread is replaced by another [s]
    limit    : time limit of a step [s]
    """

    def __init__(
        self,
        threads: int | None = None,
        *,
        patience: float = _PATIENCE,
        limit: float = LONGEST_STEP,
    ) -> None:
        from wedgebrake.sweeps.executor import processors

        self._queue: PriorityQueue[tuple[int, int, _Job | None]] = PriorityQueue()
        self._numbers = itertools.count()
        self._patience, self._limit = patience, limit
        self._lock, self._closed = threading.Lock(), threading.Event()
        self._running: set[_Job] = set()
        for _ in range(threads or processors()):
            self._start_thread(self._compute)
        self._start_thread(self._watch)

    def _start_thread(self, work: Callable[[], None]) -> None:
        name = f"wedgebrake-{next(self._numbers)}"
        threading.Thread(target=work, name=name, daemon=True).start()

    def slot(self, post: Post) -> Slot:
        """A slot whose results are shown through ``post``."""
        return Slot(self, post)

    def close(self) -> None:
        """End all threads after their current steps."""
        self._closed.set()
        self._queue.put((-1, next(self._numbers), None))

    def enqueue(self, job: _Job, urgency: int) -> None:
        """Queue for a thread; jobs of equal urgency run in order of arrival."""
        self._queue.put((urgency, next(self._numbers), job))

    def _compute(self) -> None:
        while (job := self._queue.get()[2]) is not None:
            if job.slot.job is not job:
                if isinstance(job.steps, Generator):
                    job.steps.close()
                continue
            with self._lock:
                job.since = time.monotonic()
                self._running.add(job)
            _THREAD.job = job
            again = self._step(job)
            _THREAD.job = None
            with self._lock:
                self._running.discard(job)
                replaced, job.replaced = job.replaced, False
            if again and job.pause > 0.0:
                timer = threading.Timer(job.pause, self.enqueue, (job, job.later))
                timer.daemon = True
                timer.start()
                job.pause = 0.0
            elif again:
                self.enqueue(job, job.later)
            if replaced:
                return
        self.close()  # for the next thread

    def _step(self, job: _Job) -> bool:
        """Compute a step and hand its result to the page; return True if others may follow."""
        try:
            result = next(job.steps)
        except StopIteration:
            job.slot.end(job, job.finished)
        except WedgebrakeError as error:
            job.slot.end(job, partial(job.fail, str(error)))
        except Exception as error:
            _LOG.exception("a step failed")
            words = f"internal error: {type(error).__name__}: {error}. Please report it."
            job.slot.end(job, partial(job.fail, words))
        else:
            job.slot.offer(job, result)
            return True
        return False

    def _watch(self) -> None:
        """Replace threads whose steps are long, and report steps beyond the time limit."""
        while not self._closed.wait(0.5 * self._patience):
            now = time.monotonic()
            with self._lock:
                replaced = sum(job.replaced for job in self._running)
                for job in self._running:
                    long = now - job.since >= self._patience and not job.replaced
                    if long and replaced < _MOST_REPLACED:
                        job.replaced = True
                        replaced += 1
                        self._start_thread(self._compute)
                lost = [job for job in self._running if now - job.since >= self._limit]
            for job in lost:
                job.since = math.inf
                words = f"The computation exceeded the time limit of {self._limit:g} s."
                job.slot.end(job, partial(job.fail, words))


def is_wanted() -> bool:
    """Return False if the step that this thread computes is no longer needed.

    The step was then replaced, discarded or reported as too long. A long step calls this
    repeatedly, and ends when it returns False. Returns True outside a step.
    """
    job = getattr(_THREAD, "job", None)
    return job is None or (job.slot.job is job and job.since < math.inf)


class Slot:
    """One kind of work of one page; only its newest job counts.

    Results that the page has not shown yet are replaced by newer ones, so that a slow page is
    never more than one result behind. A job waits briefly for the first result of the previous
    job: while a slider moves, the page shows intermediate values.
    """

    def __init__(self, scheduler: Scheduler, post: Post) -> None:
        self._scheduler, self._post = scheduler, post
        self._lock = threading.Lock()
        self._offered: list[Any] = []
        self.job: _Job | None = None
        """The job in progress."""
        self._next: tuple[_Job, int] | None = None

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
        """Begin work that replaces the current work of the slot.

        steps    : each step gives a complete result
        show     : called with each result, through ``post``
        fail     : called with a sentence if a step raises
        finished : called after the last step
        urgency  : of the first step, 0 is the most urgent; ``later`` : of the following steps
        pause    : seconds between the first step and the second, so that it is not begun while
                   a slider still moves
        """
        job = _Job(self, steps, show, fail, finished, later, pause)
        with self._lock:
            waits, self._next = self._next is not None, (job, urgency)
            first = self.job is not None and not self.job.shown
        if not first:
            self._begin_next()
        elif not waits:
            timer = threading.Timer(_LONGEST_WAIT, self._begin_next)
            timer.daemon = True
            timer.start()

    def _begin_next(self) -> None:
        with self._lock:
            if self._next is None:
                return
            (self.job, urgency), self._next, self._offered = self._next, None, []
            job = self.job
        self._scheduler.enqueue(job, urgency)

    def stop(self) -> None:
        """Discard the work."""
        with self._lock:
            self.job, self._next, self._offered = None, None, []

    @property
    def busy(self) -> bool:
        """Return True while work continues."""
        return self.job is not None or self._next is not None

    def offer(self, job: _Job, result: Any) -> None:
        """Show a result soon, unless a newer result replaces it."""
        with self._lock:
            if self.job is not job:
                return
            posted, self._offered = bool(self._offered), [result]
        if not posted:
            self._hand(partial(self._show, job))

    def end(self, job: _Job, last: Callable[[], None]) -> None:
        """Call ``last`` on the page after the last step, if the job is still the current one."""

        def say() -> None:
            self._show(job)
            with self._lock:
                if self.job is not job:
                    return
                self.job = None
            last()
            self._begin_next()

        if self.job is job:
            self._hand(say)

    def _hand(self, call: Callable[[], None]) -> None:
        """Pass a call to the page; ignore it if the page is closed."""
        try:
            self._post(call)
        except Exception:
            _LOG.info("a page was closed while its work was in progress")
            self.stop()

    def _show(self, job: _Job) -> None:
        with self._lock:
            results, self._offered = (self._offered, []) if self.job is job else ([], self._offered)
        for result in results:
            job.show(result)
            job.shown = True
            self._begin_next()


@cache
def common_scheduler() -> Scheduler:
    """The threads of all pages of this process."""
    return Scheduler()


@cache
def file_scheduler() -> Scheduler:
    """A separate thread for files: a fine picture may take minutes and must not delay motions."""
    return Scheduler(1, patience=_PATIENCE_FOR_FILES, limit=LONGEST_EXPORT)
