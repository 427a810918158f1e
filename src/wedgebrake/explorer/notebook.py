"""``wb.explore``: the explorer in a notebook cell."""

from __future__ import annotations

import asyncio
import os
import secrets
import threading
from concurrent.futures import Future
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

from wedgebrake.model.machine import Machine
from wedgebrake.model.studies.study import Study, load_study
from wedgebrake.model.system import BrakedDriveline
from wedgebrake.model.validation import check_installed, check_whole, wrong

if TYPE_CHECKING:
    from wedgebrake.explorer.core.state import PageState
    from wedgebrake.explorer.ui.session import Explorer

_LEAST_HEIGHT, _MOST_HEIGHT = 200, 5000
_UNKNOWN = "This page belongs to no cell of the notebook. Run the cell again."


class NotebookCell:
    """The explorer as a notebook cell shows it.

    url   : address of the page, for a separate window
    state : of the page opened last: study and view, immutable
    """

    def __init__(self, state: PageState, port: int, height: int) -> None:
        self._state, self._height = state, height
        self._explorer: Explorer | None = None
        # Other users of this computer must not be able to guess it.
        key = secrets.token_urlsafe(16)
        self.url = f"{_served(port)}?cell={key}"
        _CELLS[key] = self

    @property
    def state(self) -> PageState:
        """The study and its view as set on the page, immutable."""
        return self._state if self._explorer is None else self._explorer.state

    @property
    def study(self) -> Study:
        """The study as set on the page."""
        return self.state.study

    @property
    def system(self) -> BrakedDriveline | Machine:
        """The system as set on the page."""
        return self.study.system

    def page(self) -> Explorer:
        """A page for a browser; a second one begins with the state of the first."""
        import panel as pn

        from wedgebrake.explorer.ui.session import Explorer

        page = self._explorer = Explorer(self.state)
        pn.state.on_session_destroyed(lambda _: self._forget(page))
        return page

    def _forget(self, page: Explorer) -> None:
        """Release a page that has been closed, and keep its state."""
        if self._explorer is page:
            self._state, self._explorer = page.state, None

    def _repr_html_(self) -> str:
        return (
            f'<iframe src="{self.url}" title="wedgebrake explorer" width="100%"'
            f' height="{self._height}" style="border: 1px solid #DFE3E8; border-radius: 8px">'
            "</iframe>"
        )

    def __repr__(self) -> str:
        return f"The explorer is at {self.url} as long as this process lives."


_CELLS: dict[str, NotebookCell] = {}


def explore(
    subject: BrakedDriveline | Machine | Study | str | os.PathLike[str] | None = None,
    *,
    port: int = 0,
    height: int = 900,
) -> NotebookCell:
    """The explorer in a notebook cell: the page of ``wedgebrake app``, served by this process.

    subject : the system, a study, or the path of a study file; by default the brake of the
              source paper
    port    : port of this process, at 127.0.0.1 only; 0 takes any free port
    height  : of the page in the cell [px]

    The result's ``system`` and ``study`` are the system and the study as set on the
    page. The browser must run on the same computer as Python, or have ``port`` forwarded to
    it. Needs the extra ``app``.

    Raises ``InputError`` for another subject, a machine with a brake or friction law that has
    no name in study files, a port that is not available, or if the extra is not installed.
    """
    check_installed("explore", ("panel", "bokeh"), "app")
    check_whole("port", port, 0, 65535)
    check_whole("height", height, _LEAST_HEIGHT, _MOST_HEIGHT)
    return NotebookCell(_state_of(subject), port, height)


def _state_of(subject: Any) -> PageState:
    from wedgebrake.explorer.core.studies import opened

    if isinstance(subject, BrakedDriveline | Machine):
        subject = Study(subject)
    elif isinstance(subject, str | os.PathLike):
        subject = load_study(Path(subject))
    if not isinstance(subject, Study | None):
        allowed = "a BrakedDriveline, a Machine, a Study or the path of a study file"
        raise wrong("subject", subject, allowed)
    return opened(subject)


@cache
def _served(port: int) -> str:
    """The URL of this process's server, on an event loop and a thread of its own.

    The page therefore responds while a cell computes, and needs no comm of the notebook.
    """
    begun: Future[str] = Future()

    def listen() -> None:
        from tornado.ioloop import IOLoop

        from wedgebrake.explorer.ui.server import start_server

        asyncio.set_event_loop(asyncio.new_event_loop())
        loop = IOLoop.current()
        try:
            # The address of the notebook is not known. That of a cell's page is a secret.
            _, url = start_server(_page, port=port, framed=True)
        except BaseException as error:
            begun.set_exception(error)
            return
        begun.set_result(url)
        loop.start()

    threading.Thread(target=listen, name="wedgebrake-explorer", daemon=True).start()
    return begun.result()


def _page() -> Any:
    import panel as pn

    keys = pn.state.session_args.get("cell", [b""])
    cell = _CELLS.get(keys[0].decode("ascii", "replace"))
    return pn.pane.Alert(_UNKNOWN) if cell is None else cell.page()
