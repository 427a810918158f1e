"""Filter of the server's requests, applied before any handler of Panel or Bokeh.

Panel and Bokeh register more routes than the page needs, one of which imports any module named in
the address, and take the host of a session from the token that the client sends.
"""

from __future__ import annotations

import asyncio
import re
import socket
from collections.abc import Callable, Iterable
from typing import Any
from urllib.parse import unquote, urlsplit

from bokeh.util.token import generate_jwt_token, generate_session_id
from panel.io.server import WSHandler
from tornado.httputil import HTTPServerRequest
from tornado.routing import Matcher, PathMatches, Rule
from tornado.web import ErrorHandler, RequestHandler

SERVED = ("/", "/ws", "/favicon.ico")
"""Paths that are served, in addition to the scripts and styles of Bokeh and Panel."""
# These two folders contain only files of the packages. Hidden folders are excluded.
_SCRIPTS = re.compile(r"/static/(js|extensions/panel)(/[\w@^-][\w@^.-]*)+\.(js|css)")
_STRANGER = (
    "The host name in the address of this page is not allowed. Start the explorer with this name:"
    " wedgebrake app --allow HOST:PORT."
)
_OTHER_SITE = (
    "Another site has asked for this page. Open it by its address, or by a link that is clicked."
)
_NO_SESSION = "The page gives every browser a session of its own. Open it by its address alone."
TOKEN = "TOKEN-OF-THE-SESSION"  # noqa: S105 - a placeholder
"""What stands in the text of the page where each browser receives its own token."""
_WEB_PORT = "80"
# Time for other work between the creation of two sessions [s].
_PAUSE = 0.05


class Names:
    """Host names, with ports, under which the server answers.

    admitted : "host" (port 80) or "host:port"; labels of a host and the port may be "*", and "*"
               alone matches any host and port
    """

    def __init__(self, admitted: Iterable[str]) -> None:
        self._admitted = [_split(one) for one in admitted]

    def allows(self, name: str) -> bool:
        """Return True if a name is allowed."""
        try:
            host, port = _split(name)
        except ValueError:
            return False
        return any(
            known_port in (port, "*") and _alike(host, known)
            for known, known_port in self._admitted
        )

    def allows_request(self, request: HTTPServerRequest) -> bool:
        """Return True if the host of a request, and its origin if present, are allowed."""
        hosts = request.headers.get_list("Host")
        origins = request.headers.get_list("Origin")
        return len(hosts) == 1 and all(
            self.allows(one) for one in (*hosts, *(_place(origin) for origin in origins))
        )


def own_names(address: str, port: int) -> list[str]:
    """Host names of a server on an address, as used by browsers on the same machine."""
    found = socket.getaddrinfo(
        address or None, port, type=socket.SOCK_STREAM, flags=socket.AI_PASSIVE
    )
    bound = {"localhost", "127.0.0.1", *(str(place[0]) for *_, place in found)}
    if "::" in bound:
        bound.add("::1")
    bound -= {"0.0.0.0", "::"}  # noqa: S104 - not names of a host
    return [f"[{one}]:{port}" if ":" in one else f"{one}:{port}" for one in sorted(bound)]


def install_filter(
    application: Any,
    names: Names,
    page: str,
    framed: bool,
    connected: Callable[[Any, bool], None] = lambda _document, _present: None,
) -> None:
    """Restrict a Bokeh application to the paths that the page needs, under allowed host names.

    page      : text of the page, with ``TOKEN``
    framed    : True if pages of other sites may show it in a frame
    connected : called with a document, and whether it has a browser, when that changes
    """
    kept = {
        "application_context": application.applications["/"],
        "bokeh_websocket_path": "/ws",
        "turn": asyncio.Lock(),
        "connected": connected,
    }
    strange = _Where(lambda request: not names.allows_request(request))
    needless = _Where(lambda request: not served(request.path))
    rules = [
        Rule(strange, _Refusal),
        Rule(needless, ErrorHandler, {"status_code": 404}),
        Rule(PathMatches("/ws"), _Socket, kept),
        Rule(PathMatches("/"), _Page, {"text": page, "framed": framed}),
    ]
    application.add_handlers(r".*", rules)


def served(path: str) -> bool:
    """Return True if the page needs a path, given as in the address."""
    return path in SERVED or _SCRIPTS.fullmatch(unquote(path)) is not None


class _Where(Matcher):
    def __init__(self, holds: Callable[[HTTPServerRequest], bool]) -> None:
        self._holds = holds

    def match(self, request: HTTPServerRequest) -> dict[str, Any] | None:
        return {} if self._holds(request) else None


class _Refusal(RequestHandler):
    def prepare(self) -> None:
        _refuse(self, _STRANGER)


class _Page(RequestHandler):
    """The page, the same text for all browsers except for the token of a new session.

    Bokeh would create the session here. It is created when the page opens its websocket, which
    other sites cannot, so that a request that nothing follows costs nothing.
    """

    application: Any

    def initialize(self, text: str, framed: bool) -> None:
        self._text, self._framed = text, framed

    def get(self) -> None:
        """Send the page."""
        if not self._framed and _from_other_site(self.request):
            _refuse(self, _OTHER_SITE)
            return
        if {"bokeh-token", "bokeh-session-id"} & self.request.arguments.keys():
            _refuse(self, _NO_SESSION)
            return
        signature = {
            "secret_key": self.application.secret_key,
            "signed": self.application.sign_sessions,
        }
        arguments = {"headers": {}, "cookies": {}, "arguments": self.request.arguments}
        token = generate_jwt_token(
            generate_session_id(**signature), extra_payload=arguments,
            expiration=self.application.session_token_expiration, **signature,
        )  # fmt: skip
        self.set_header("Cache-Control", "no-store")
        if not self._framed:
            self.set_header("Content-Security-Policy", "frame-ancestors 'self'")
        self.finish(self._text.replace(TOKEN, token))


def _refuse(handler: RequestHandler, words: str) -> None:
    handler.set_status(403)
    handler.set_header("Content-Type", "text/plain; charset=utf-8")
    handler.finish(words)


def _from_other_site(request: HTTPServerRequest) -> bool:
    """Return True for a request of another site's page, except a link that the user clicked."""
    headers = request.headers
    clicked = headers.get("Sec-Fetch-User") == "?1" and headers.get("Sec-Fetch-Dest") == "document"
    return headers.get("Sec-Fetch-Site") == "cross-site" and not clicked


class _Socket(WSHandler):
    """A connection; sessions are created one after another, with pauses for the event loop.

    turn      : common to all connections; while many pages open, those already open still respond
    connected : called with a document, and whether it has a browser, when that changes
    """

    def initialize(
        self, turn: asyncio.Lock, connected: Callable[[Any, bool], None], **kept: Any
    ) -> None:
        super().initialize(**kept)
        self._turn, self._connected = turn, connected

    async def _async_open(self, token: str) -> None:
        """Create the session, unless its browser has disconnected while waiting."""
        async with self._turn:
            if self.ws_connection is not None:
                await super()._async_open(token)
                # It has none if the browser has disconnected since.
                session = getattr(self.connection, "_session", None)
                if session is not None:
                    self._connected(session.document, True)
                await asyncio.sleep(_PAUSE)

    def check_origin(self, origin: str) -> bool:  # noqa: ARG002
        """Accept any origin: it has been checked before."""
        return True

    def open(self, *args: str, **names: str) -> None:
        """Open the connection; close it if the token is missing or invalid."""
        try:
            super().open(*args, **names)
        except Exception as error:  # no client may cause an error of the server
            self._protocol_error(f"no valid token: {type(error).__name__}")

    def on_close(self) -> None:
        """Forget the connection, which may have been closed before it had a session."""
        session = getattr(self.connection, "_session", None)  # which the connection then forgets
        try:
            super().on_close()
        except AssertionError:
            self.application.client_lost(self.connection)
        if session is not None and not session.connection_count:
            self._connected(session.document, False)

    async def _receive(self, fragment: str | bytes) -> Any:
        """Return a complete message; close the connection if it is invalid."""
        try:
            return await super()._receive(fragment)
        except Exception as error:  # no client may cause an error of the server
            self._protocol_error(f"no valid message: {type(error).__name__}")
            return None


def _split(name: str) -> tuple[str, str]:
    """Host and port of "host:port", in lower case. Raises ``ValueError`` for other text."""
    found = re.fullmatch(r"(\[[0-9a-f:.]+\]|[\w.*-]+)(?::(\d{1,5}|\*))?", name.lower())
    if found is None:
        raise ValueError(name)
    return found[1], found[2] or ("*" if found[1] == "*" else _WEB_PORT)


def _place(origin: str) -> str:
    """Host and port of an origin; empty if it has none, as for "null"."""
    try:
        found = urlsplit(origin)
    except ValueError:
        return ""
    return found.netloc if found.scheme in ("http", "https") else ""


def _alike(host: str, known: str) -> bool:
    parts, wanted = host.split("."), known.split(".")
    return known == "*" or (
        len(parts) == len(wanted)
        and all(one in (part, "*") for part, one in zip(parts, wanted, strict=True))
    )
