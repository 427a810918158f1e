"""The door of the server: which requests it answers. All others end here, before any handler.

Panel and Bokeh register more routes than the page needs, one of which imports any module that
its address names, and take the host of a session from what the client's own token claims.
"""

from __future__ import annotations

import re
import socket
from collections.abc import Callable, Iterable
from typing import Any
from urllib.parse import unquote, urlsplit

from panel.io.server import WSHandler
from tornado.httputil import HTTPServerRequest
from tornado.routing import Matcher, PathMatches, Rule
from tornado.web import ErrorHandler, RequestHandler

SERVED = ("/", "/ws", "/favicon.ico")
"""Paths that are answered, beside scripts and styles of Bokeh and Panel."""
# Below these two folders lie files of the packages alone, in folders without a dot before them.
_SCRIPTS = re.compile(r"/static/(js|extensions/panel)(/[\w@^-][\w@^.-]*)+\.(js|css)")
_STRANGER = (
    "This explorer is not known by the name in your browser's address line. Whoever started it can"
    " admit the name: wedgebrake app --allow HOST:PORT."
)
_WEB_PORT = "80"


class Names:
    """The names, with their ports, by which a server may be called.

    admitted : "host", of port 80, or "host:port"; parts of a host and the port may be "*", and
               "*" alone is any host at any port
    """

    def __init__(self, admitted: Iterable[str]) -> None:
        self._admitted = [_split(one) for one in admitted]

    def admit(self, name: str) -> bool:
        """Whether a name is one of them."""
        try:
            host, port = _split(name)
        except ValueError:
            return False
        return any(
            known_port in (port, "*") and _alike(host, known)
            for known, known_port in self._admitted
        )

    def knows(self, request: HTTPServerRequest) -> bool:
        """Whether a request comes by one of them, and from a page that was served by one."""
        hosts = request.headers.get_list("Host")
        origins = request.headers.get_list("Origin")
        return len(hosts) == 1 and all(
            self.admit(one) for one in (*hosts, *(_place(origin) for origin in origins))
        )


def own_names(address: str, port: int) -> list[str]:
    """The names of a server that listens to an address, as browsers on its machine say them."""
    found = socket.getaddrinfo(
        address or None, port, type=socket.SOCK_STREAM, flags=socket.AI_PASSIVE
    )
    bound = {"localhost", "127.0.0.1", *(str(place[0]) for *_, place in found)}
    if "::" in bound:
        bound.add("::1")
    bound -= {"0.0.0.0", "::"}  # noqa: S104 - what nobody is called by
    return [f"[{one}]:{port}" if ":" in one else f"{one}:{port}" for one in sorted(bound)]


def guard(application: Any, names: Names) -> None:
    """Let the Bokeh application answer what it needs to, for those who call it by its names."""
    kept = {
        "application_context": application.applications["/"],
        "bokeh_websocket_path": "/ws",
    }
    strange = _Where(lambda request: not names.knows(request))
    needless = _Where(lambda request: not served(request.path))
    rules = [
        Rule(strange, _Refusal),
        Rule(needless, ErrorHandler, {"status_code": 404}),
        Rule(PathMatches("/ws"), _Socket, kept),
    ]
    application.add_handlers(r".*", rules)


def served(path: str) -> bool:
    """Whether a path, as it stands in the address, is one that the page needs."""
    return path in SERVED or _SCRIPTS.fullmatch(unquote(path)) is not None


class _Where(Matcher):
    """The requests for which something holds."""

    def __init__(self, holds: Callable[[HTTPServerRequest], bool]) -> None:
        self._holds = holds

    def match(self, request: HTTPServerRequest) -> dict[str, Any] | None:
        return {} if self._holds(request) else None


class _Refusal(RequestHandler):
    """The answer to those who call the server by another name."""

    def prepare(self) -> None:
        self.set_status(403)
        self.set_header("Content-Type", "text/plain; charset=utf-8")
        self.finish(_STRANGER)


class _Socket(WSHandler):
    """The websocket of a page."""

    def check_origin(self, origin: str) -> bool:  # noqa: ARG002
        """The door has looked at it."""
        return True

    def open(self, *args: str, **names: str) -> None:
        """Begin; without a token of this server, or with one that is none, the connection ends."""
        try:
            super().open(*args, **names)
        except Exception as error:  # whatever a client sends is no failure of the server
            self._protocol_error(f"no token: {type(error).__name__}")

    async def _receive(self, fragment: str | bytes) -> Any:
        """A message when it is whole; what is none ends the connection."""
        try:
            return await super()._receive(fragment)
        except Exception as error:  # whatever a client sends is no failure of the server
            self._protocol_error(f"no message: {type(error).__name__}")
            return None


def _split(name: str) -> tuple[str, str]:
    """Host and port of "host:port", in lower case. Raises ``ValueError`` for what is neither."""
    found = re.fullmatch(r"(\[[0-9a-f:.]+\]|[\w.*-]+)(?::(\d{1,5}|\*))?", name.lower())
    if found is None:
        raise ValueError(name)
    return found[1], found[2] or ("*" if found[1] == "*" else _WEB_PORT)


def _place(origin: str) -> str:
    """Host and port of an origin; empty for one without, such as null."""
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
