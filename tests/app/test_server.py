"""The server under what browsers send that are no friends, and under many of them."""

from __future__ import annotations

import asyncio
import contextlib
import gc
import itertools
import json
import logging
import urllib.request
import weakref
from pathlib import Path

import numba
import pytest
import wire
from bokeh.model import Model
from bokeh.models import Plot
from browsing import Server
from wire import together

import wedgebrake.explorer.ui.server as serving
from wedgebrake.explorer.core.presets import preset
from wedgebrake.explorer.core.scheduler import Scheduler
from wedgebrake.explorer.ui import request_filter
from wedgebrake.explorer.ui.session import Explorer

PAPER = (Path(__file__).parents[2] / "examples" / "paper.toml").read_text()
# With little to compute: it is the server that is tested.
SMALL = (
    PAPER.replace("-24.0", "-6.0").replace("duration = 25.0", "periods = 20")
    + """
[sweep]
eta = { from = -8, to = -4, points = 20 }
"""
)
NAN = {"type": "number", "value": "nan"}
INFINITY = {"type": "number", "value": "+inf"}


def mapped(**values):
    """A dict as Bokeh sends it."""
    return {"type": "map", "entries": [[name, value] for name, value in values.items()]}


def nested(depth, value=0):
    for _ in range(depth):
        value = [value]
    return value


@contextlib.asynccontextmanager
async def clients(url, count=1):
    """Sessions whose first motion has come; they leave at the end."""
    opened = []
    try:
        for _ in range(count):
            opened.append(await wire.Client(url).open())  # noqa: PERF401 - to leave them too
        for one in opened:
            await one.until("motion", 1)
        yield opened
    finally:
        for one in opened:
            await one.leave()


_ETAS = itertools.count(6.0, 0.01)


async def answers(client):
    """The session does its work: an edit brings a verdict, and a wrong one a notice."""
    number = client.seen["motion"]
    await client.edit(eta=next(_ETAS))
    await client.until("motion", number + 1)
    await client.edit(inertia=-1.0)
    while "inertia" not in await client.hear("notice"):
        pass


@pytest.fixture(scope="module")
def bad_server(tmp_path_factory):
    """A server of its own, which may complain."""
    study = tmp_path_factory.mktemp("bad") / "small.toml"
    study.write_text(SMALL)
    running = Server(str(study))
    yield running
    running.stop()


# Inputs of the page, and values that none of them offers to its user.
PARTS = [
    ("input-eta", "value"), ("slider-eta", "value"), ("slider-eta", "value_throttled"),
    ("input-periods", "value"), ("input-brake", "value"), ("input-release", "active"),
    ("preset", "value"), ("law", "active"), ("comparison", "active"), ("tabs", "active"),
    ("across", "value"), ("across-from", "value"), ("quantity", "value"), ("load", "value"),
]  # fmt: skip
VALUES = [
    None, True, -7, 10**400, 1e308, NAN, INFINITY, "", "x", "nan", "1e999", "__class__",
    "9" * 100_000, "1 " * 100_000, [], ["a"], [[NAN]], mapped(a=1), nested(50),
]  # fmt: skip


def changes(client):
    """Messages of a client that knows the protocol, against the rest of the page."""
    machine, figure = client.parts.get("input-eta"), client.parts.get("explorer")

    def changed(name, value, model=machine):
        return {"kind": "ModelChanged", "model": {"id": model}, "attr": name, "new": value}

    def added(name, **attributes):
        model = {"type": "object", "name": name, "id": "p9", "attributes": attributes}
        return {"kind": "RootAdded", "model": model}

    def event(name, **values):
        data = {"type": "event", "name": name, **values}
        return {"kind": "MessageSent", "msg_type": "bokeh_event", "msg_data": data}

    nowhere = mapped(model={"id": figure}, sx=NAN, sy="a", x=None, y=[], modifiers=5)
    return {
        "a state of its own": [changed("css_classes", mapped(sections="x"))],
        "a script of its own": [changed("subscribed_events", ["x"])],
        "no such property": [changed("on_msg", 5)],
        "a private one": [changed("_callbacks", mapped())],
        "no such model": [changed("state", 1, "p999999")],
        "a model of a name": [added("Button", label="x")],
        "a model of no name": [added("os.system")],
        "all roots away": [{"kind": "RootRemoved", "model": {"id": figure}}],
        "a title": [{"kind": "TitleChanged", "title": "x" * 100_000}],
        "a kind of event": [{"kind": "Explosion"}],
        "no event": [5, None, "x", []],
        "a message to a script": [event("no_such_event", values=mapped(model={"id": machine}))],
        "an event without values": [event("data_event")],
        "deep": [changed("state", nested(500))],
        "a tap nowhere": [event("tap", values=nowhere)],
    }


RAW = [
    '{"msgid": 5, "msgtype": ["ACK"]}', '{"msgid": "1", "msgtype": "PUSH-DOC"}',
    '{"msgid": "1", "msgtype": "PATCH-DOC", "num_buffers": 1000000000}',
]  # fmt: skip


def attacks():
    """What is sent from a session, by name."""

    async def set_all(client, part):
        for value in VALUES:
            await client.set(*part, value)

    async def send(client, raw):
        for text in (raw, "{}", "{}"):
            await client.raw(text)

    for part in PARTS:
        yield part, lambda client, part=part: set_all(client, part)
    for name in changes(wire.Client("")):
        yield name, lambda client, name=name: client.patch(*changes(client)[name])
    for raw in RAW:
        yield raw, lambda client, raw=raw: send(client, raw)


@together
async def test_whatever_one_session_sends_another_one_has_its_answers(bad_server):
    one, names = None, []
    async with clients(bad_server.url) as (other,):
        for name, attack in attacks():
            names.append(name)
            try:
                one = one or await wire.Client(bad_server.url).open()
                await attack(one)
            except ConnectionError:
                await one.leave()
                one = None
            if len(names) % 4:
                continue
            try:
                await asyncio.wait_for(answers(other), 20.0)
            except (TimeoutError, ConnectionError) as error:
                raise AssertionError(f"the other session is silent after {names[-4:]}") from error
        await answers(other)
        if one is not None:
            await one.leave()


@together
async def test_a_message_above_the_limit_ends_that_connection_alone(monkeypatch):
    limit = 4_000_000
    monkeypatch.setattr(serving, "MOST_MESSAGE", limit)
    with small_pages() as (_, url, _):
        async with clients(url, 2) as (one, other):
            await one.load("large.toml", b"x" * (limit // 2))
            assert "large.toml" in await one.hear("notice")
            await answers(one)
            with contextlib.suppress(ConnectionError):  # at once, or when one listens
                await one.load("larger.toml", b"x" * limit)
            with pytest.raises(ConnectionError):
                await one.hear("notice")
            await answers(other)


@together
async def test_browsers_that_vanish_are_no_news(bad_server):
    for eta in range(2):
        one = await wire.Client(bad_server.url).open()
        await one.until("motion", 1)
        await one.edit(eta=eta)
        one.vanish()
        await asyncio.sleep(0.5)  # the answers find nobody
    async with clients(bad_server.url) as (one,):
        await answers(one)


# tests/unit/test_bad_input.py has more of them.
HOSTILE = {
    "picture.toml": bytes(range(256)) * 40,
    "large.toml": b"# " + b"x" * 1_000_000,
    "lists.toml": b"a = " + b"[" * 20_000,
    "keys.toml": b".".join([b"a"] * 50_000) + b" = 1",
    "unknown.toml": PAPER.encode() + b"\n[gearbox]\nratio = 2",
    "parts.toml": b"[[inertia]]\n" * 16_000,
}


@together
async def test_what_is_no_study_is_refused_in_words(server):
    async with clients(server.url) as (one,):
        for name, content in HOSTILE.items():
            await one.load(name, content)
            notice = await one.hear("notice")
            assert name in notice
            assert "internal" not in notice
        assert one.seen["motion"] == 1
        await answers(one)


def models():
    """How many models of Bokeh live in this process."""
    gc.collect()
    return sum(isinstance(one, Model) for one in gc.get_objects())


async def none_left(server):
    while server.get_sessions("/"):
        await asyncio.sleep(0.1)


@contextlib.contextmanager
def small_pages(noticed=lambda: None):
    """A server of pages with little to compute: the server, its URL and the pages made so far."""
    scheduler, made = Scheduler(1), []

    def new():
        noticed()
        made.append(Explorer(preset("start").state().edited(periods=20), scheduler))
        return made[-1]

    server, url = serving.start_server(new)
    try:
        yield server, url, made
    finally:
        server.stop()
        scheduler.close()


@together
async def test_requests_that_no_websocket_follows_make_no_session():
    """Two hundred of them cost less than one page, and a browser beside them has its answers."""
    with small_pages() as (server, url, made):

        def load():
            with urllib.request.urlopen(url) as answer:  # noqa: S310
                return answer.status

        loads = [asyncio.to_thread(load) for _ in range(200)]
        found, one = await asyncio.gather(asyncio.gather(*loads), wire.Client(url).open())
        assert set(found) == {200}
        await one.until("motion", 1)
        assert len(made) == len(server.get_sessions("/")) == 1
        # All that the page needs comes from this server.
        assert "cdn." not in json.dumps(one.document)
        await one.leave()


@together
async def test_a_load_builds_the_open_tab_alone():
    """Five charts and one plot; another plot is built when its tab is opened."""

    def plots():
        return sum(isinstance(one, Plot) for one in session.document.models)

    with small_pages() as (server, url, _):
        one = await wire.Client(url).open()
        [session] = server.get_sessions("/")
        assert plots() == json.dumps(one.document).count('"name": "Plot"') == 6
        await one.until("motion", 1)
        await one.set("tabs", "active", 2)
        while plots() == 6:
            await asyncio.sleep(0.05)
        assert plots() == 7
        await answers(one)
        await one.leave()


@together
async def test_between_two_new_pages_the_loop_is_free():
    """Four pages are asked for at once; the loop runs many times between any two of them."""
    rounds, at = itertools.count(), []

    async def count():
        while next(rounds) >= 0:
            await asyncio.sleep(0)

    with small_pages(lambda: at.append(next(rounds))) as (_, url, _):
        counting = asyncio.create_task(count())
        opened = await asyncio.gather(*(wire.Client(url).open() for _ in range(4)))
        counting.cancel()
        assert len(at) == 4
        assert all(later - earlier > 8 for earlier, later in itertools.pairwise(at))
        for one in opened:
            await one.leave()


@together
async def test_a_browser_that_leaves_before_its_turn_has_no_page(monkeypatch):
    turns = []

    class Turn(asyncio.Lock):
        def __init__(self):
            super().__init__()
            turns.append(self)

    monkeypatch.setattr(request_filter.asyncio, "Lock", Turn)
    with small_pages() as (server, url, made):
        monkeypatch.undo()
        [turn] = turns
        async with turn:
            one = wire.Client(url)
            opening = asyncio.create_task(one.open())
            while not turn._waiters:
                await asyncio.sleep(0.01)
            one.vanish()
            with pytest.raises(ConnectionError):
                await opening
            await asyncio.sleep(0.1)  # the server learns of it
        other = await wire.Client(url).open()
        assert len(made) == len(server.get_sessions("/")) == 1
        await other.leave()


@together
async def test_pages_that_are_left_are_forgotten_and_no_more_than_the_limit_opened(monkeypatch):
    """Round after round: sessions, documents and models do not become more."""
    monkeypatch.setattr(serving, "_CHECK", 200)
    monkeypatch.setattr(serving, "_KEEP", 500)
    monkeypatch.setattr(serving, "MOST_SESSIONS", 2)
    # What pytest keeps of the log keeps pages alive.
    monkeypatch.setattr(logging.root.manager, "disable", logging.CRITICAL)
    scheduler, alive = Scheduler(2), weakref.WeakSet()

    def new():
        # With little to compute: it is the pages that are counted.
        page = Explorer(preset("start").state().edited(periods=20, plot="stability"), scheduler)
        alive.add(page)
        return page

    server, url = serving.start_server(new)
    try:
        before = models()
        async with clients(url):
            each = models() - before
        await none_left(server)
        for _ in range(2):
            async with clients(url, 2) as (one, other):
                assert len(server.get_sessions("/")) == 2
                extra = await wire.Client(url).open()
                await extra.leave()
                assert "input-eta" not in extra.parts
                assert "pages open, which is its limit" in json.dumps(extra.document)
                for tab in (1, 3, 0, 2):
                    await one.set("tabs", "active", tab)
                await answers(one)
                await other.leave()
                while len(server.get_sessions("/")) > 1:
                    await asyncio.sleep(0.1)
                async with clients(url) as (other,):
                    await answers(other)
            await none_left(server)
        # Those in the hands of Panel and of each thread, with all four plots.
        allowed = 3 * 2.5 * each
        for _ in range(20):
            if models() - before <= allowed and len(alive) <= 3:
                break
            await asyncio.sleep(0.25)
        assert len(alive) <= 3
        assert models() - before <= allowed
    finally:
        server.stop()
        scheduler.close()


@together
async def test_a_page_that_is_closed_stops_its_computation_at_once():
    pages = []

    def new():
        # A fine map takes longer than the test.
        pages.append(Explorer(preset("start").state().edited(plot="regimes"), Scheduler(2)))
        return pages[-1]

    server, url = serving.start_server(new)
    try:
        one = await wire.Client(url).open()
        await one.until("motion", 1)
        (page,) = pages
        assert any(slot.busy for slot in page._slots)
        await one.leave()
        await asyncio.sleep(1.0)
        assert server.get_sessions("/")  # it is still kept
        assert not any(slot.busy for slot in page._slots)
    finally:
        server.stop()


@together
async def test_the_progress_of_compilation_is_shown():
    def double(x):
        return 2 * x

    server, url = serving.start_server(lambda: Explorer(preset("start").state().edited(periods=20)))
    try:
        one = await wire.Client(url).open()
        await one.until("motion", 1)
        while "Compiling" not in one.said.get("busy", ""):
            await asyncio.to_thread(numba.njit(double), 1.0)
            await one.hear("busy")
        assert "double, 0%" in one.said["busy"]
        await one.leave()
    finally:
        server.stop()
