"""What the explorer answers, and whom."""

from __future__ import annotations

import asyncio
import base64
import contextlib
import http.client
import itertools
import json
import re
from urllib.parse import urlsplit

import panel as pn
import pytest
import wire
from tornado.httpclient import HTTPError, HTTPRequest
from tornado.websocket import WebSocketClosedError, websocket_connect

import wedgebrake as wb
import wedgebrake.explorer.ui.server as serving

KEY = base64.b64encode(b"sixteen bytes ok").decode()
UPGRADE = {
    "Upgrade": "websocket", "Connection": "Upgrade", "Sec-WebSocket-Key": KEY,
    "Sec-WebSocket-Version": "13",
}  # fmt: skip


@pytest.fixture
def url(server):
    return server.url


def ask(url, path, method="GET", *, leave=(), **headers):
    """The answer to a request, as (status, headers, text); its path and host as they are given."""
    place = urlsplit(url).netloc
    connection = http.client.HTTPConnection(place, timeout=60)
    try:
        connection.putrequest(method, path, skip_host=True, skip_accept_encoding=True)
        for name, value in {"Host": place, **headers}.items():
            if name not in leave:
                connection.putheader(name.replace("_", "-"), value)
        connection.endheaders()
        answer = connection.getresponse()
        text = "" if answer.status == 101 else answer.read().decode(errors="replace")
        return answer.status, answer.headers, text
    finally:
        connection.close()


# Every route that Panel and Bokeh register for the page, with paths below it; the ones that the
# page needs are answered with 200, all others with 404.
SCRIPT, STYLE = "/static/js/bokeh.min.js", "/static/extensions/panel/css/loading.css"
ANSWERED = {
    "/favicon.ico": ["/favicon.ico"],
    "/?": ["/"],
    "/static/(?!extensions/)(.*)": [SCRIPT],
    "/static/extensions/(.*)": [STYLE],
    "/static/(.*)": [],
}
CLOSED = [
    "/metadata", "/autoload.js", "/autoload.js?bokeh-autoload-element=1", "//", "/index.html",
    "/components/unittest.__main__/x/y/z", "/components/this/x/y/z", "/components/",
    "/components/panel.widgets/Button/_stylesheets/x.css", "/components/..%2f..", "/components/..",
    "/%63omponents/this/x/y/z", "/static/../components/this/x/y/z", "/static", "/static/",
    "/static/js/", "/static/js/../../../__init__.py", "/static/js/..%2f..%2f..%2f__init__.py",
    "/static/js/%2e%2e/%2e%2e/__init__.py", "/static/js/bokeh.json", "/static/extensions/",
    "/static/extensions/other/x.js", "/static/extensions/panel/..%2f..%2fconfig.py",
    "/static/extensions/panel/.hidden/x.js", "/static/js/bokeh.min.js%00", "/rest/session_info",
    "/liveness", "/admin", "/login", "http://127.0.0.1/components/this/x/y/z", "*",
]  # fmt: skip


def registered():
    """The patterns of all routes that a server of the page has, as Tornado keeps them."""

    async def listed():
        server, _ = serving.start_server(lambda: pn.pane.Markdown("nothing"))
        rules = server._tornado.wildcard_router.rules
        server.stop()
        return [rule.matcher.regex.pattern.rstrip("$") for rule in rules]

    return wire.run(listed())


def test_of_the_routes_that_there_are_those_the_page_needs_are_served(url):
    routes = registered()
    assert {"/ws", "/?", "/components/(.*)", "/autoload.js"} <= set(routes)
    for route in routes:
        if route == "/ws":
            continue
        paths = ANSWERED.get(route, [re.sub(r"\(.*\)", "this/x/y/z", route)])
        expected = 200 if route in ANSWERED else 404
        assert {path: ask(url, path)[0] for path in paths} == dict.fromkeys(paths, expected)


@pytest.mark.parametrize("path", CLOSED)
def test_all_else_is_not_found(url, path):
    for method in ("GET", "HEAD", "POST", "OPTIONS"):
        status, headers, _ = ask(url, path, method, Origin=url.rstrip("/"))
        assert status == 404, method
        assert not any(name.startswith("Access-Control") for name in headers), method


# Names by which somebody else could have this address called, and what is no name.
STRANGERS = [
    "evil.example.org", "evil.example.org:{port}", "127.0.0.1.evil.example.org:{port}",
    "127.0.0.1", "127.0.0.1:1", "localhost", "[::1]:{port}", "[::1]", "[::1", "::1:{port}",
    "0.0.0.0:{port}", "127.0.0.1:{port}, evil.example.org", "127.0.0.1:{port}:80",
    "x@127.0.0.1:{port}", "127.0.0.1:{port}/", "", ":{port}", "*", "*:{port}", "\xff:{port}",
]  # fmt: skip
PATHS = ["/", "/ws", "/favicon.ico", "/autoload.js?bokeh-autoload-element=1", SCRIPT, STYLE]


@pytest.mark.parametrize("name", STRANGERS)
def test_a_strange_name_opens_nothing(url, name):
    name = name.format(port=urlsplit(url).port)
    both = {"Host": name}, {"Host": name, "Origin": f"http://{name}"}
    for path, given in itertools.product(PATHS, both):
        more = UPGRADE if path == "/ws" else {}
        status, headers, text = ask(url, path, **{**more, **given})
        assert status in (400, 403), (path, given)  # a header that is none is refused by Tornado
        assert "token" not in text
        assert not any(one.startswith("Access-Control") for one in headers)


@pytest.mark.parametrize("path", PATHS)
def test_a_page_of_somebody_else_gets_nothing(url, path):
    more = UPGRADE if path == "/ws" else {}
    for origin in ("http://evil.example.org", "null", "file://", "", url.replace("http", "ftp")):
        assert ask(url, path, **more, Origin=origin)[0] == 403, origin
    assert ask(url, path, **more, Host="localhost:" + url.rsplit(":")[-1].strip("/"))[0] != 403


FETCHED = {"Sec-Fetch-Site": "cross-site", "Sec-Fetch-Mode": "no-cors", "Sec-Fetch-Dest": "image"}
CLICKED = {"Sec-Fetch-Mode": "navigate", "Sec-Fetch-Dest": "document", "Sec-Fetch-User": "?1"}


@pytest.mark.parametrize("dest", ["image", "iframe", "empty", "script", "document"])
def test_another_site_cannot_load_the_page_behind_the_user(url, dest):
    """Only a link that is clicked leads here from another site; and no frame shows the page."""
    status, _, text = ask(url, "/", **{**FETCHED, "Sec-Fetch-Dest": dest})
    assert status == 403
    assert "token" not in text
    for site in ("none", "same-origin", "cross-site"):
        status, headers, _ = ask(url, "/", **CLICKED, **{"Sec-Fetch-Site": site})
        assert status == 200
        assert "frame-ancestors 'self'" in headers["Content-Security-Policy"]


def test_a_notebook_of_any_address_may_show_its_cell():
    url = wb.explore().url
    path = f"/?{url.partition('?')[2]}"
    status, headers, _ = ask(url, path, **{**FETCHED, "Sec-Fetch-Dest": "iframe"})
    assert (status, headers["Content-Security-Policy"]) == (200, None)


def token_of(url):
    return re.search(r'"token":"([^"]+)"', ask(url, "/")[2])[1]


def claims(token):
    """What a token of a session says, without its signature."""
    return json.loads(base64.urlsafe_b64decode(token.split(".")[0] + "=="))


def forged(token, **changes):
    text = json.dumps({**claims(token), **changes}).encode()
    body = base64.urlsafe_b64encode(text).decode().rstrip("=")
    return [body, ".".join([body, *token.split(".")[1:]])]


async def websocket(url, token, **headers):
    """The websocket that a token is given, after its first message; or None."""
    request = HTTPRequest(url.replace("http", "ws") + "ws", headers=headers)
    try:
        socket = await websocket_connect(request, subprotocols=["bokeh", token])
    except HTTPError:
        return None
    if await asyncio.wait_for(socket.read_message(), 60) is None:
        socket.close()
        return None
    return socket


async def connected(url, token, **headers):
    """Whether a websocket with a token is given a session."""
    socket = await websocket(url, token, **headers)
    if socket is None:
        return False
    socket.close()
    while await socket.read_message() is not None:
        pass
    return True


@wire.together
async def test_a_name_in_a_token_counts_for_nothing(url):
    """The host is that of the handshake, whatever the token claims."""
    token = token_of(url)
    port = urlsplit(url).port
    evil = f"evil.example.org:{port}"
    assert not await connected(url, token, Host=evil, Origin=f"http://{evil}")
    assert not await connected(url, token, Origin=f"http://{evil}")
    assert not await connected(url, token, Host=evil)
    assert await connected(url, token)


def test_a_session_is_one_that_the_server_has_given(url):
    """A token is signed; nobody makes a session, or takes another one's, without it."""
    token = token_of(url)
    later = {"session_expiry": claims(token)["session_expiry"] + 1000}
    several = [*forged(token, session_id="mine"), *forged(token, **later)]
    for wrong in [*several, token[:-1] + "x", "x", "!"]:
        assert not wire.run(connected(url, wrong))
    for wrong in ("bokeh-session-id=mine", "bokeh-token=x", f"bokeh-token={token}"):
        assert ask(url, f"/?{wrong}")[0] == 403
    assert wire.run(connected(url, token))


FRAMES = ["[]", "", "x", "5", "null", "[" * 100_000, b"\x00\xff", b"\x00\xff" * 100, "{}" * 3]


@wire.together
async def test_a_frame_that_is_no_message_ends_the_connection(url):
    """And the server has no word of it: it says nothing that looks like a failure of its own."""
    token = token_of(url)
    for frame in FRAMES:
        socket = await websocket(url, token)
        for part in (frame, "{}", "{}"):
            with contextlib.suppress(WebSocketClosedError):
                await socket.write_message(part, binary=isinstance(part, bytes))
        while await asyncio.wait_for(socket.read_message(), 20) is not None:
            pass
        socket.close()


def test_its_names_are_those_of_what_it_listens_to(url):
    check_names(url, {"127.0.0.1": 200, "localhost": 200, "[::1]": 403, "127.0.0.2": 403})


@wire.together
async def test_its_names_are_those_of_another_address():
    try:
        server, url = serving.start_server(lambda: pn.pane.Markdown("nothing"), address="::1")
    except wb.InputError:
        pytest.skip("no IPv6 on this machine")
    names = {"[::1]": 200, "localhost": 200, "[::2]": 403, "127.0.0.2": 403}
    try:
        await asyncio.to_thread(check_names, url, names)
    finally:
        server.stop()


def check_names(url, names):
    port = urlsplit(url).port
    assert {name: ask(url, "/favicon.ico", Host=f"{name}:{port}")[0] for name in names} == names
