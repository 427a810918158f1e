"""The base of the pages: notices, and computations in slots, shown on the event loop."""

from __future__ import annotations

import html
from collections.abc import Callable
from typing import Any

import panel as pn
from tornado.ioloop import IOLoop

from wedgebrake.explorer.core.scheduler import Scheduler, Slot, common_scheduler

# Durations of notices [ms].
_BRIEF, LASTING = 6000, 12_000


class Page(pn.viewable.Viewer):
    """A page of one browser, created within a session of the server, to whose document it belongs.

    scheduler : the threads that compute, by default those of all pages of this process
    """

    def __init__(self, scheduler: Scheduler | None) -> None:
        super().__init__()
        self._scheduler = common_scheduler() if scheduler is None else scheduler
        self._document, self._loop = pn.state.curdoc, IOLoop.current()
        self._notices = pn.state.notifications
        self._slots: list[Slot] = []
        self._closed = self._paused = False
        self._page: Any = None

    def __panel__(self) -> Any:
        return self._page

    def slot(self, scheduler: Scheduler | None = None) -> Slot:
        """Return a slot of a scheduler, by default that of the page, which shows its results."""
        slot = (self._scheduler if scheduler is None else scheduler).slot(self._post)
        self._slots.append(slot)
        return slot

    def refuse(self, words: str) -> None:
        """Show why an action is not possible."""
        self.notify(words, "error", LASTING)

    def notify(self, words: str, kind: str = "success", duration: int = _BRIEF) -> None:
        """Show a notice for the given duration [ms]."""
        if self._notices is not None:
            self._notices.send(html.escape(words), duration=duration, type=kind)

    @property
    def document(self) -> Any:
        """The document of Bokeh to which the page belongs."""
        return self._document

    def pause(self) -> None:
        """Discard all work while the page has no browser."""
        self._paused = True
        for slot in self._slots:
            slot.stop()

    def resume(self) -> None:
        """Do again what was discarded, after the browser has come back."""
        if self._paused:
            self._paused = False
            self._post(self.begin_again)

    def begin_again(self) -> None:
        """Compute everything that the page shows."""

    def show_compiling(self, words: str) -> None:
        """Show the progress of compilation, nothing for an empty text; called in any thread."""

    def close(self) -> None:
        """Discard all work after the page has been closed."""
        self._closed = True
        self.pause()

    def _post(self, call: Callable[[], None]) -> None:
        """Call on the event loop: Bokeh's documents may lose callbacks of other threads."""

        def add() -> None:
            if not self._closed:
                self._document.add_next_tick_callback(call)

        self._loop.add_callback(add)
