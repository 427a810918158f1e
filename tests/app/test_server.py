"""The server under what browsers send that are no friends, and under many of them."""

from __future__ import annotations

import asyncio
import contextlib
import gc
import itertools
import logging
import weakref
from urllib.error import HTTPError

import pytest
import wire
from bokeh.model import Model
from command import Server
from wire import PATIENCE as _PATIENCE
from wire import together

import wedgebrake.explorer.ui.server as serving
from wedgebrake.explorer.core.limits import MOST_MESSAGE
from wedgebrake.explorer.core.presets import preset
from wedgebrake.explorer.core.scheduler import Scheduler
from wedgebrake.explorer.ui.session import Explorer

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
def bad_server():
    """A server of its own, which may complain."""
    running = Server()
    yield running
    assert running.process.poll() is None, running.said
    assert running.stop() == 0, running.said


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


@together
async def test_values_that_a_widget_does_not_offer(bad_server):
    """Whatever they do to that session, another one has its answers."""

    async def send(one, part):
        for value in VALUES:
            await one.set(*part, value)

    await harassed(bad_server.url, {part: lambda one, part=part: send(one, part) for part in PARTS})


def events(client):
    """Messages of a client that knows the protocol, against the rest of the page."""
    machine, figure = client.parts.get("input-eta"), client.parts.get("explorer")
    changed = {"kind": "ModelChanged", "model": {"id": machine}}
    yield "a state of its own", [{**changed, "attr": "css_classes", "new": mapped(sections="x")}]
    yield "a script of its own", [{**changed, "attr": "subscribed_events", "new": ["x"]}]
    yield "another kind of value", [{**changed, "attr": "state", "new": 5}]
    yield "no such property", [{**changed, "attr": "on_msg", "new": 5}]
    yield "a private one", [{**changed, "attr": "_callbacks", "new": mapped()}]
    yield (
        "another part",
        [{"kind": "ModelChanged", "model": {"id": figure}, "attr": "machine", "new": None}],
    )
    yield (
        "no such model",
        [{"kind": "ModelChanged", "model": {"id": "p999999"}, "attr": "state", "new": 1}],
    )
    yield "a model of a name", [{"kind": "RootAdded", "model": {
        "type": "object", "name": "Button", "id": "p9", "attributes": {"label": "x"}}}]  # fmt: skip
    yield "a model of no name", [{"kind": "RootAdded", "model": {
        "type": "object", "name": "os.system", "id": "p9", "attributes": {}}}]  # fmt: skip
    yield "all roots away", [{"kind": "RootRemoved", "model": {"id": figure}}]
    yield "a title", [{"kind": "TitleChanged", "title": "x" * 100_000}]
    yield "a kind of event", [{"kind": "Explosion"}]
    yield "no event", [5, None, "x", []]
    yield "a message to a script", [
        {"kind": "MessageSent", "msg_type": "bokeh_event", "msg_data": {"type": "event",
         "name": "no_such_event", "values": mapped(model={"id": machine})}}]  # fmt: skip
    yield "an event without values", [
        {"kind": "MessageSent", "msg_type": "bokeh_event", "msg_data": {"type": "event",
         "name": "data_event"}}]  # fmt: skip
    yield "deep", [{**changed, "attr": "state", "new": nested(500)}]
    yield "a tap nowhere", [
        {"kind": "MessageSent", "msg_type": "bokeh_event", "msg_data": {"type": "event",
         "name": "tap", "values": mapped(
             model={"id": figure}, sx=NAN, sy="a", x=None, y=[], modifiers=5)}}]  # fmt: skip


EVENTS = [name for name, _ in events(wire.Client(""))]


@together
async def test_changes_of_other_models_stay_in_their_session(bad_server):
    await harassed(bad_server.url, {
        name: lambda one, place=place: one.patch(*list(events(one))[place][1])
        for place, name in enumerate(EVENTS)
    })  # fmt: skip


RAW = [
    "", "x", "[]", "[" * 100_000, b"\x00\xff" * 100, '{"msgid": 5, "msgtype": ["ACK"]}',
    '{"msgid": "1", "msgtype": "PUSH-DOC"}',
    '{"msgid": "1", "msgtype": "PATCH-DOC", "num_buffers": 1000000000}',
]  # fmt: skip


@together
async def test_what_is_no_message_ends_that_connection_alone(bad_server):
    async def send(one, raw):
        for text in (raw, "{}", "{}"):
            await one.raw(text)

    await harassed(
        bad_server.url, {repr(raw)[:40]: lambda one, raw=raw: send(one, raw) for raw in RAW}
    )


async def harassed(url, attacks):
    """From sessions that go on while they can; another one has its answers all the time."""
    async with clients(url) as (other,):
        one = None
        for name, attack in attacks.items():
            try:
                one = one or await wire.Client(url).open()
                await attack(one)
            except ConnectionError:
                await one.leave()
                one = None
            try:
                await asyncio.wait_for(answers(other), 10.0)
            except (TimeoutError, ConnectionError) as error:
                raise AssertionError(f"the other session fell silent after {name!r}") from error
        if one is not None:
            await one.leave()


@together
async def test_a_message_above_the_limit_ends_that_connection_alone(bad_server):
    async with clients(bad_server.url, 2) as (one, other):
        await one.load("large.toml", b"x" * (MOST_MESSAGE // 2))
        assert "large.toml" in await one.hear("notice")
        await answers(one)
        with contextlib.suppress(ConnectionError):  # at once, or when one listens
            await one.load("larger.toml", b"x" * MOST_MESSAGE)
        with pytest.raises(ConnectionError):
            await one.hear("notice")
        await answers(other)


@together
async def test_browsers_that_vanish_are_no_news(bad_server):
    for eta in range(4):
        one = await wire.Client(bad_server.url).open()
        await one.until("motion", 1)
        await one.edit(eta=eta)
        one.vanish()
        await asyncio.sleep(0.5)  # the answers find nobody
    async with clients(bad_server.url) as (one,):
        await answers(one)


@together
async def test_a_name_that_somebody_else_gave_this_address_opens_nothing(bad_server):
    """A page of theirs that has become "ours" by a change of their name service."""
    port = bad_server.url.rsplit(":", 1)[1].strip("/")
    for host in ("evil.example.org", f"evil.example.org:{port}"):
        one = wire.Client(bad_server.url, Host=host, Origin=f"http://{host}")
        with contextlib.suppress(HTTPError):
            await one.open()
            await one.leave()
        assert "input-eta" not in one.parts
    async with clients(bad_server.url) as (one,):
        await answers(one)


# Machines at the ends of what is allowed, each with what makes the others follow.
EXTREME = {
    "stiff": {"stiffness": 1e15},
    "soft": {"stiffness": 0.0, "inertia": 1e12},
    "light": {"inertia": 1e-9},
    "slow torque": {"frequency": 1e-9},
    "fast torque": {"frequency": 1e9},
    "steep": {"slope": -1e12},
    "steep upwards": {"slope": 1e12},
    "slippery": {"kinetic": 0.0},
    "rough": {"kinetic": 5.0},
    "strong": {"initial_force": 1e12},
    "torn": {"amplitude": 1e12},
    "still": {"amplitude": 0.0},
    "turning": {"drive_speed": 1e6},
    "damped": {"damping": 1e12},
    "thin": {"angle": 1e-9},
    "blunt": {"angle": 1.5707},
    "far": {"initial_angle": 1e12, "initial_velocity": -1e12},
    "long": {"periods": 2000, "shown": 100},
    "smoothed": {"friction": "smoothed", "periods": 2000},
    "smoothed and sharp": {"friction": "smoothed", "steepness": 1e9},
    "smoothed and stiff": {"friction": "smoothed", "stiffness": 1e12},
    "wound": {"brake": "band", "wrap_angle": 100.0},
}


@together
async def test_extreme_machines_are_answered_in_words(server):
    """And meanwhile another session has its answers."""
    wrong = {}
    async with clients(server.url, 2) as (one, other):
        for name, changes in EXTREME.items():
            number = one.seen["motion"] + 1
            await one.edit(**changes)
            await answers(other)
            words = await asyncio.wait_for(one.answer(number), _PATIENCE)
            if len(words) <= 10 or "internal" in words:
                wrong[name] = words[:200]
            # And the page goes back to an ordinary machine.
            await one.choose(preset("start").title)
            await one.hear("headline")
        await answers(one)
    assert wrong == {}


# Numbers so small that a solver may step without ever coming forward.
TINY = """
[driveline]
inertia = 1.0
damping = 0.1
stiffness = 10000.0
[brake]
kind = "wedge"
angle = 0.34
radius = 0.2
[friction]
kind = "smoothed"
kinetic = 0.3
[actuation]
initial_force = 0.0
slope = -40.0
[excitation]
amplitude = 1e-308
frequency = 10.0
[run]
periods = 3
max_steps = 1000
"""


@together
async def test_a_study_that_is_hard_to_compute_keeps_nobody_waiting(bad_server):
    """Whether it is answered, refused or hangs: more of them than there are threads."""
    async with clients(bad_server.url, 4) as (one, *hard):
        for _ in range(2):
            for other in hard:
                await other.load("tiny.toml", TINY.encode())
            await asyncio.sleep(2.0)
            await answers(one)
        for other in hard:
            await other.leave()
        await answers(one)


@pytest.fixture
def counted(monkeypatch):
    """A server in this process, that forgets pages soon: its URL, and the pages that live."""
    monkeypatch.setattr(serving, "_LOOK", 200)
    monkeypatch.setattr(serving, "_KEEP", 500)
    monkeypatch.setattr(serving, "MOST_SESSIONS", 5)
    # What pytest keeps of the log keeps pages alive.
    monkeypatch.setattr(logging.root.manager, "disable", logging.CRITICAL)
    scheduler, alive = Scheduler(2), weakref.WeakSet()

    def new():
        # With little to compute: it is the pages that are counted.
        page = Explorer(preset("start").state().edited(periods=20, plot="stability"), scheduler)
        alive.add(page)
        return page

    @contextlib.asynccontextmanager
    async def begun():
        server, url = serving.started(new)
        try:
            yield url, alive, server
        finally:
            server.stop()

    yield begun
    scheduler.close()


@together
async def test_pages_that_are_left_are_forgotten(counted):
    async with counted() as (url, alive, server):
        for _ in range(2):
            async with clients(url, 5) as opened:
                assert len(server.get_sessions("/")) == 5
                for one in opened:
                    await one.edit(eta=5.0)
                await opened[-1].until("motion", 2)
            while server.get_sessions("/"):
                await asyncio.sleep(0.1)
        for _ in range(40):
            gc.collect()
            if len(alive) <= 3:  # the last ones, in the hands of Panel and of each thread
                break
            await asyncio.sleep(0.25)
        assert len(alive) <= 3


def models():
    """How many models of Bokeh live in this process."""
    gc.collect()
    return sum(isinstance(one, Model) for one in gc.get_objects())


@together
async def test_what_pages_held_is_given_back(counted):
    """Round after round: sessions, documents and models do not become more."""
    async with counted() as (url, alive, server):
        before = models()
        async with clients(url):
            each = models() - before
        for _ in range(2):
            async with clients(url, 3) as opened:
                for one in opened:
                    for tab in (1, 3, 0, 2):
                        await one.set("tabs", "active", tab)
                    await answers(one)
            while server.get_sessions("/"):
                await asyncio.sleep(0.1)
        for _ in range(40):
            held = models() - before
            if len(alive) <= 3 and held <= 3 * 2.5 * each:
                break
            await asyncio.sleep(0.25)
        # Those in the hands of Panel and of each thread, with all four plots.
        assert len(alive) <= 3
        assert held <= 3 * 2.5 * each


@together
async def test_more_pages_than_the_limit_are_told_so(counted):
    async with counted() as (url, _, server), clients(url, 5) as opened:
        extra = wire.Client(url)
        await extra.open()
        await extra.leave()
        assert "input-eta" not in extra.parts
        await answers(opened[0])
        opened[0].close()
        while len(server.get_sessions("/")) > 4:
            await asyncio.sleep(0.1)
        async with clients(url) as (one,):
            await answers(one)
