"""A browser without a screen: the messages of a page over its websocket, and nothing drawn.

As light as a client can be, so that many of them load the server and not themselves.
"""

from __future__ import annotations

import asyncio
import contextlib
import functools
import html
import itertools
import json
import re
import time
from base64 import b64encode
from concurrent.futures import ThreadPoolExecutor
from typing import Any
from urllib.request import Request, urlopen

from tornado.httpclient import HTTPRequest
from tornado.websocket import WebSocketClosedError, websocket_connect

PATIENCE = 60.0  # s: others may use the processors too


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
        """Identifiers of models by their CSS classes."""
        self.seen: dict[str, int] = {}
        """The number of the study that the motion and the plot show."""
        self._gone = False
        self.said: dict[str, str] = {}
        """The headline, the last notice and the last progress of compilation, if any."""

    async def open(self) -> Client:
        """Fetch the page, as a browser does, and take part in its session."""
        asked = Request(self.url, headers=self._headers)  # noqa: S310
        text = await asyncio.to_thread(lambda: urlopen(asked).read().decode())  # noqa: S310
        token = re.search(r'"token":"([^"]+)"', text)[1]
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
        self._notice(content)
        ready = {"type": "event", "name": "document_ready", "values": {"type": "map"}}
        message = {"kind": "MessageSent", "msg_type": "bokeh_event", "msg_data": ready}
        await self.patch(message)
        return self

    async def edit(self, **changes: object) -> None:
        """Type values into inputs, or choose kinds."""
        for name, value in changes.items():
            while f"input-{name}" not in self.parts:
                self._notice((await self._receive())[1])
            text = repr(value) if isinstance(value, float | int) else value
            await self.set(f"input-{name}", "value", text)

    async def load(self, name: str, content: bytes) -> None:
        model = {"kind": "ModelChanged", "model": {"id": self.parts["load"]}}
        values = {"value": b64encode(content).decode(), "mime_type": "", "filename": name}
        await self.patch(*({**model, "attr": attr, "new": new} for attr, new in values.items()))

    async def set(self, part: str, attr: str, value: object) -> None:
        """Change a property of a model, to anything at all."""
        await self.patch(
            {"kind": "ModelChanged", "model": {"id": self.parts[part]}, "attr": attr, "new": value}
        )

    async def until(self, what: str, number: int) -> float:
        """Wait until the motion, or the picture, shows that change; how long it took [s]."""
        begin = time.perf_counter()
        while self.seen.get(what, 0) < number:
            self._notice((await self._receive())[1])
        return time.perf_counter() - begin

    async def hear(self, what: str) -> Any:
        """Wait for the next headline or notice."""
        self.said.pop(what, None)
        while not self.said.get(what):
            self._notice((await self._receive())[1])
        return self.said[what]

    async def patch(self, *events: object) -> None:
        await self._send({"msgtype": "PATCH-DOC"}, {"events": list(events)})

    async def raw(self, text: str | bytes) -> None:
        """Anything at all, below the protocol."""
        await self._write(text)

    def close(self) -> None:
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
        self.parts.update(_parts(content))
        text = html.unescape(html.unescape(json.dumps(content, ensure_ascii=False)))
        for what, number in re.findall(r'data-(motion|picture)="(\d+)', text):
            self.seen[what] = max(self.seen.get(what, 0), int(number))
        pending = re.search(r'class="verdict \w+ pending', text)
        if (found := re.search(r'"headline">([^<]*)<', text)) and not pending:
            self.said["headline"] = found[1]
        if found := re.search(r"Compiling [^\"<]*", text):
            self.said["busy"] = found[0]
        if found := re.search(r'"message": "([^"]*)"', text):
            self.said["notice"] = found[1]


def _parts(value: object) -> dict[str, str]:
    """Identifiers of models by each of their CSS classes."""
    found: dict[str, str] = {}
    if isinstance(value, dict):
        attributes = value.get("attributes")
        if isinstance(attributes, dict) and "id" in value:
            for name in attributes.get("css_classes") or ():
                found.setdefault(str(name), value["id"])
    for one in value.values() if isinstance(value, dict) else value:
        if isinstance(one, dict | list):
            for name, known in _parts(one).items():
                found.setdefault(name, known)
    return found
