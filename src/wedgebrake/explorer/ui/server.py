"""The server of the explorer: one process, one page of its own for every browser."""

from __future__ import annotations

import asyncio
import errno
import gc
import logging
import secrets
import signal
import socket
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import SimpleNamespace
from typing import Any

import panel as pn
from bokeh.application.handlers import FunctionHandler
from bokeh.document import Document
from bokeh.settings import settings
from panel.io.resources import LOCAL_DIST, Resources, patch_model_css
from panel.io.server import server_html_page_for_session
from panel.io.state import set_curdoc
from tornado.ioloop import IOLoop
from tornado.websocket import WebSocketClosedError

from wedgebrake.dynamics.compile_progress import report_always
from wedgebrake.errors import InputError
from wedgebrake.explorer.core.limits import MOST_MESSAGE, MOST_SESSIONS, MOST_TRACE
from wedgebrake.explorer.core.scheduler import Scheduler
from wedgebrake.explorer.core.snapshot import take_snapshot
from wedgebrake.explorer.core.state import PageState
from wedgebrake.explorer.ui.model_defaults import find_defaults_once
from wedgebrake.explorer.ui.request_filter import TOKEN, Names, install_filter, own_names
from wedgebrake.explorer.ui.session import Explorer
from wedgebrake.explorer.ui.widgets.controls import PageDesign, page_styles, style_sheet
from wedgebrake.model.validation import check_whole

_TITLE = "wedgebrake explorer"
_FULL = (
    f"This explorer already keeps {MOST_SESSIONS} pages open, which is its limit. Close another"
    " page, or try again in a minute."
)
_LOST = "The connection to the explorer is lost. Reload the page to start again."
# How often pages without a browser are searched for, and how long they are kept [ms].
_CHECK, _KEEP = 5_000, 15_000


def serve(
    state: PageState,
    *,
    address: str = "127.0.0.1",
    port: int = 5006,
    origins: tuple[str, ...] = (),
    ready: Callable[[str], None],
) -> None:
    """Serve the explorer until the event loop is stopped.

    state   : of a new page
    address : to listen on; port : 0 takes any free one
    origins : "host:port" of pages that may connect, beside the server's own
    ready   : called with the URL once browsers can connect

    Raises ``InputError`` for an address or port that cannot be listened on.
    """
    # The validation searches all models of each page for errors that the tests would have found.
    settings.perform_document_validation = False
    find_defaults_once()
    scheduler = Scheduler()
    server, url = start_server(
        lambda: Explorer(state, scheduler), address=address, port=port, origins=origins
    )
    loop = IOLoop.current()
    loop.add_callback(ready, url)
    # Compile the kernels of the first page before it is requested.
    slot = scheduler.slot(lambda call: call())
    slot.start((take_snapshot(one) for one in [state]), lambda _: None, lambda _: None)
    # The objects that exist now are permanent; the garbage collector need not scan them again.
    gc.collect()
    gc.freeze()
    try:
        with _stopped_by_signals(loop):
            loop.start()
    finally:
        scheduler.close()
        server.stop()


def start_server(
    new: Callable[[], Any],
    *,
    address: str = "127.0.0.1",
    port: int = 0,
    origins: tuple[str, ...] = (),
    framed: bool = False,
) -> tuple[Any, str]:
    """Begin to listen on the event loop of this thread: the server, and its URL.

    new    : returns a new ``Explorer``, or another object to show, for every browser
    framed : True if pages of other sites, such as a notebook, may show it in a frame

    Raises ``InputError`` for an address or port that cannot be listened on.
    """
    pn.extension("notifications", disconnect_notification=_LOST)
    pages: set[Any] = set()
    number = _free_port(address, port)
    names = Names([*own_names(address, number), *origins])

    def page() -> Any:
        _design()
        pn.state.curdoc.title = _TITLE
        if len(pages) >= MOST_SESSIONS:
            return pn.pane.Alert(_FULL)
        opened = new()
        if isinstance(opened, Explorer):
            pages.add(opened)

            def gone(_: Any) -> None:
                pages.discard(opened)
                opened.close()

            pn.state.on_session_destroyed(gone)
        return opened

    def compiling(words: str) -> None:
        for one in tuple(pages):
            one.show_compiling(words)

    report_always(
        lambda progress: compiling(f"{progress}, needed only once"), lambda: compiling("")
    )

    def connected(document: Document, present: bool) -> None:
        """Stop the work of a page whose browser is gone; it goes on if the browser comes back."""
        for one in tuple(pages):
            if one.document is document:
                one.resume() if present else one.pause()

    # Disconnecting browsers are not worth a message.
    for name in ("tornado.access", "bokeh.server.views.ws"):
        logging.getLogger(name).setLevel(logging.ERROR)
    server = pn.serve(
        {"/": page}, port=number, address=address, sign_sessions=True,
        secret_key=secrets.token_bytes(32), show=False, start=False, title=_TITLE, verbose=False,
        websocket_max_message_size=MOST_MESSAGE,
        check_unused_sessions_milliseconds=_CHECK, unused_session_lifetime_milliseconds=_KEEP,
    )  # fmt: skip
    server._tornado.applications["/"].application.add(FunctionHandler(_serve_styles))
    install_filter(server._tornado, names, _page_text(server._tornado), framed, connected)
    server.start()
    IOLoop.current().asyncio_loop.set_exception_handler(_report)  # type: ignore[attr-defined]
    # The address as a browser on this machine uses it.
    local = address in ("0.0.0.0", "::", "")  # noqa: S104 - read, not bound
    host = "localhost" if local else f"[{address}]" if ":" in address else address
    return server, f"http://{host}:{number}/"


def _design() -> None:
    """Set the styles of the current document."""
    pn.config.raw_css, pn.config.design = page_styles(), PageDesign


def _serve_styles(document: Document) -> None:
    """Let the style sheets of a document come from this server, as Panel does for its own page."""
    for root in document.roots:
        patch_model_css(root, LOCAL_DIST)
    document.template_variables["dist_url"] = LOCAL_DIST


def _page_text(application: Any) -> str:
    """The text of the page, which is the same for all studies, with ``TOKEN``.

    BokehJS puts the parts of the document that it receives in the places of those of this one.
    """
    document = Document()
    with set_curdoc(document):
        _design()
        pn.Column().server_doc(document)
        session: Any = SimpleNamespace(document=document, token=TOKEN)
        text: str = server_html_page_for_session(
            session, Resources.from_bokeh(application.resources()), _TITLE,
            template=document.template, template_variables=document.template_variables,
        )  # fmt: skip
    script = style_sheet("files.js").replace("MOST", str(MOST_TRACE))
    return text.replace("</head>", f"<script>{script}</script></head>")


def _report(loop: asyncio.AbstractEventLoop, context: dict[str, Any]) -> None:
    """Report errors of the loop, except the disconnection of a browser."""
    if not isinstance(context.get("exception"), WebSocketClosedError):
        loop.default_exception_handler(context)


@contextmanager
def _stopped_by_signals(loop: IOLoop) -> Iterator[None]:
    """Inside, SIGINT and SIGTERM end the loop without interrupting its current callback."""
    signals = (signal.SIGINT, signal.SIGTERM)
    before = {one: signal.getsignal(one) for one in signals}
    for one in signals:
        signal.signal(one, lambda *_: loop.add_callback(loop.stop))
    try:
        yield
    finally:
        for one, handler in before.items():
            signal.signal(one, handler)


def _free_port(address: str, port: int) -> int:
    """The port, after a test that it is available; for 0 a free port."""
    check_whole("port", port, 0, 65535)
    try:
        found = socket.getaddrinfo(address, port, type=socket.SOCK_STREAM, flags=socket.AI_PASSIVE)
        family, kind, protocol, _, place = found[0]
        with socket.socket(family, kind, protocol) as trial:
            trial.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            trial.bind(place)
            return int(trial.getsockname()[1])
    except OSError as error:
        why = {
            errno.EADDRINUSE: "is in use, perhaps by another explorer. Choose another one, or 0 for"
            " any that is free.",
            errno.EACCES: "may not be used by this user. Choose one above 1023, or 0 for any that"
            " is free.",
        }
        if error.errno in why:
            raise InputError.of("port", port, why[error.errno]) from None
        raise InputError.of(
            "address", address,
            f"cannot be listened on ({error.strerror or error}). Give an address of this machine,"
            " for example 127.0.0.1.",
        ) from None  # fmt: skip
