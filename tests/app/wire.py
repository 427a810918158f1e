"""A browser without a screen: the messages of a page over its websocket, and nothing drawn.

As light as a client can be, so that many of them load the server and not themselves.
"""

from __future__ import annotations

import asyncio
import contextlib
import functools
import itertools
import json
import re
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from typing import Any
from urllib.request import Request, urlopen

from tornado.httpclient import HTTPRequest
from tornado.websocket import WebSocketClosedError, websocket_connect

PATIENCE = 150.0  # s: others may use the processors too


def run(work: Any) -> Any:
    """The result of a coroutine, in an event loop of its own that does not wait for ever.

    In a thread of its own: the tests in the browser leave a loop in this one.
    """
    with ThreadPoolExecutor(1) as thread:
        return thread.submit(asyncio.run, asyncio.wait_for(work, PATIENCE)).result()


def together(test: Any) -> Any:
    """A test that is a coroutine, ``run``."""

    @functools.wraps(test)
    def wrapped(*arguments: Any, **names: Any) -> None:
        run(test(*arguments, **names))

    return wrapped


class Client:
    """One session of the explorer.

    headers : of its requests, beside the usual ones
    """

    def __init__(self, url: str, **headers: str) -> None:
        self.url, self._headers = url, headers
        self._numbers = itertools.count(1)
        self.parts: dict[str, str] = {}
        """Identifiers of the models of the page's parts, by their classes."""
        self.seen: dict[str, int] = {}
        """Which change of the desk the motion and the picture show."""
        self._gone = False
        self.said: dict[str, Any] = {}
        """What the page says: its headline; its last refusal (name, words) and notice, if any."""

    async def open(self) -> Client:
        """Fetch the page, as a browser does, and take part in its session."""
        asked = Request(self.url, headers=self._headers)  # noqa: S310
        html = await asyncio.to_thread(lambda: urlopen(asked).read().decode())  # noqa: S310
        token = re.search(r'"token":"([^"]+)"', html)[1]
        self._socket = await websocket_connect(
            HTTPRequest(self.url.replace("http", "ws") + "ws", headers=self._headers),
            subprotocols=["bokeh", token], max_message_size=2**26,
        )  # fmt: skip
        await self._receive()  # the server is ready for messages when it has said so
        await self._send({"msgtype": "PULL-DOC-REQ"}, {})
        while True:
            header, content = await self._receive()
            if header["msgtype"] == "PULL-DOC-REPLY":
                break
        self.document = content["doc"]
        self.parts = _parts(content["doc"])
        self._notice(content)
        await self._event({"name": "document_ready", "values": {"type": "map"}})
        return self

    async def edit(self, **changes: float) -> None:
        """Change the machine, as the slider does at its release."""
        entries = [["type", "edit"], ["changes", _map(changes)], ["seq", next(self._numbers)],
                   ["done", True]]  # fmt: skip
        data = {"type": "map", "entries": entries}
        await self.say(data)

    async def until(self, what: str, number: int) -> float:
        """Wait until the motion, or the picture, shows that change; how long it took [s]."""
        begin = time.perf_counter()
        while self.seen.get(what, 0) < number:
            _, content = await self._receive()
            self._notice(content)
        return time.perf_counter() - begin

    async def hear(self, what: str) -> Any:
        """Wait until the page says something anew: a headline, a refusal or a notice."""
        self.said.pop(what, None)
        while not self.said.get(what):
            _, content = await self._receive()
            self._notice(content)
        return self.said[what]

    async def answer(self, number: int) -> str:
        """Wait until a change is shown, or refused: the headline, or the words."""
        self.said.clear()
        while not (self.said.get("refusal") or self.said.get("notice")):
            if self.seen.get("motion", 0) >= number and self.said.get("headline"):
                return str(self.said["headline"])
            _, content = await self._receive()
            self._notice(content)
        return str(self.said)

    async def say(self, data: object, part: str = "Machine") -> None:
        """Anything at all, as an event of a part: what a hostile browser may send."""
        await self.event("data_event", [["model", {"id": self.parts[part]}], ["data", data]])

    async def event(self, name: object, entries: list[Any]) -> None:
        """Any event with its values, as Bokeh would send it."""
        await self._event({"name": name, "values": {"type": "map", "entries": entries}})

    async def patch(self, *events: object) -> None:
        """Any changes of the document."""
        await self._send({"msgtype": "PATCH-DOC"}, {"events": list(events)})

    async def raw(self, text: str | bytes) -> None:
        """Anything at all, below the protocol."""
        await self._write(text)

    def close(self) -> None:
        """Leave."""
        self._socket.close()

    def vanish(self) -> None:
        """Be gone without a word, as a browser that is killed."""
        self._socket.protocol.stream.close()
        self.close()

    async def leave(self) -> None:
        """Leave, and wait until that is so."""
        self.close()
        with contextlib.suppress(ConnectionError):
            while not self._gone:
                await self._read()

    async def _event(self, event: dict) -> None:
        message = {"kind": "MessageSent", "msg_type": "bokeh_event"}
        await self._send(
            {"msgtype": "PATCH-DOC"},
            {"events": [{**message, "msg_data": {"type": "event", **event}}]},
        )

    async def _send(self, header: dict, content: dict) -> None:
        header = {"msgid": f"m{next(self._numbers)}", **header}
        for part in (header, {}, content):
            await self._write(json.dumps(part))

    async def _write(self, text: str | bytes) -> None:
        try:
            await self._socket.write_message(text, binary=isinstance(text, bytes))
        except WebSocketClosedError:
            raise ConnectionError("the server has closed the connection") from None

    async def _receive(self) -> tuple[dict, dict]:
        """The next whole message, without its buffers of numbers."""
        header = json.loads(await self._read())
        await self._read()
        content = json.loads(await self._read())
        for _ in range(2 * int(header.get("num_buffers", 0))):
            await self._read()
        return header, content

    async def _read(self) -> str | bytes:
        message = await self._socket.read_message()
        if message is None:
            self._gone = True
            raise ConnectionError("the server has closed the connection")
        return message

    def _notice(self, content: dict) -> None:
        for found in re.finditer(r'\["(motion|picture)", (\d+)\]', json.dumps(content)):
            self.seen[found[1]] = max(self.seen.get(found[1], 0), int(found[2]))
        for state in _states(content):
            if state.get("verdict") and not state.get("pending"):
                self.said["headline"] = state["verdict"]["headline"]
            for name in ("refusal", "notice"):
                if state.get(name):
                    self.said[name] = state[name]


def _states(value: object) -> Iterator[dict[str, Any]]:
    """States of parts: maps of Bokeh, and JSON inside the JSON."""
    if isinstance(value, str) and value.startswith("{"):
        value = json.loads(value)
        if isinstance(value, dict):
            yield value
    elif isinstance(value, dict) and value.get("type") == "map":
        yield _unmapped(value)
    elif isinstance(value, dict | list):
        for one in value.values() if isinstance(value, dict) else value:
            yield from _states(one)


def _unmapped(value: Any) -> Any:
    if isinstance(value, dict) and value.get("type") == "map":
        return {name: _unmapped(one) for name, one in value.get("entries", [])}
    return [_unmapped(one) for one in value] if isinstance(value, list) else value


def _map(values: dict[str, float]) -> dict[str, Any]:
    return {"type": "map", "entries": [[name, value] for name, value in values.items()]}


def _parts(document: object) -> dict[str, str]:
    """Identifiers of the models of the page's parts by the names of their classes."""
    found: dict[str, str] = {}

    def search(value: object) -> None:
        if isinstance(value, dict):
            if "attributes" in value and value["attributes"].get("class_name"):
                found[value["attributes"]["class_name"]] = value["id"]
            for one in value.values():
                search(one)
        elif isinstance(value, list):
            for one in value:
                search(one)

    search(document)
    return found
