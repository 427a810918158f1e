"""The command ``app``: what it says, what it refuses, whom it lets in, how it ends."""

from __future__ import annotations

import contextlib
import http.client
import importlib.util
import os
import re
import signal
import socket
import subprocess
import sys
import threading
from pathlib import Path

import pytest

from children import started
from printed import unwrapped

EXAMPLES = Path(__file__).parents[2] / "examples"
HANDSHAKE = {
    "Upgrade": "websocket",
    "Connection": "Upgrade",
    "Sec-WebSocket-Key": "dGhlIHNhbXBsZSBub25jZQ==",
    "Sec-WebSocket-Version": "13",
}


class Running:
    """The command, running in a process of its own."""

    def __init__(self, *arguments):
        self.process = started(
            [sys.executable, "-m", "wedgebrake", "app", "--no-browser", *map(str, arguments)],
            stderr=subprocess.PIPE, stdout=subprocess.PIPE, text=True,
        )  # fmt: skip
        self.lines = []
        self._told = threading.Event()
        self._listener = threading.Thread(target=self._listen, daemon=True)
        self._listener.start()
        assert self._told.wait(120), self.said
        found = re.search(r"http://(\S+):(\d+)/", self.said)
        assert found, self.said
        self.host, self.port = found[1], int(found[2])

    def _listen(self):
        for line in self.process.stderr:
            self.lines.append(line)
            if "http://" in line:
                self._told.set()
        self._told.set()

    @property
    def said(self):
        return "".join(self.lines)

    def end(self, how=signal.SIGINT):
        """The status and the standard output after a signal."""
        self.process.send_signal(how)
        try:
            status = self.process.wait(30)
        except subprocess.TimeoutExpired:
            self.process.kill()
            raise
        self._listener.join(10)
        return status, self.process.stdout.read()

    def get(self, path="/", **headers):
        """A request: its status and text."""
        connection = http.client.HTTPConnection("127.0.0.1", self.port, timeout=60)
        try:
            connection.request("GET", path, headers=headers)
            answer = connection.getresponse()
            return answer.status, "" if answer.status == 101 else answer.read().decode()
        finally:
            connection.close()

    def websocket(self, origin, host=None):
        """The status that a page of another origin is answered with."""
        named = {} if host is None else {"Host": host}
        return self.get("/ws", **HANDSHAKE, **named, Origin=origin)[0]


@contextlib.contextmanager
def running(*arguments):
    one = Running(*arguments)
    try:
        yield one
    finally:
        if one.process.poll() is None:
            one.process.kill()
        one.process.wait()
        one._listener.join(10)
        one.process.stderr.close()
        one.process.stdout.close()


class TestHelp:
    def test_says_what_it_does_and_takes(self, run):
        status, text, message = run("app", "--help")
        assert (status, message) == (0, "")
        assert text.startswith("Usage: wedgebrake app")
        for word in (
            "[STUDY.toml]", "--port N", "--address HOST", "--allow HOST:PORT", "--no-browser",
            "Ctrl-C", "Repeatable", "0.0.0.0", "Example:", "extra app",  # noqa: S104
        ):  # fmt: skip
            assert word in unwrapped(text), word

    def test_stands_in_the_list_of_commands(self, run):
        _, text, _ = run("--help")
        assert re.search(r"^\s+app\s+A page", text, re.MULTILINE)


class TestRefusals:
    @pytest.fixture
    def refused(self, run):
        """The words with which a command is refused."""

        def call(*arguments):
            status, text, message = run("app", "--no-browser", *arguments)
            assert status == 2, message
            assert text == ""
            assert "Traceback" not in message
            assert len(message) < 1000
            return unwrapped(message)

        return call

    @pytest.mark.parametrize("port", ["65536", "-1", "99999999999999999999"])
    def test_a_port_that_there_is_not(self, refused, port):
        words = refused("--port", port)
        assert f"--port {port}: must be 0 to 65535" in words

    @pytest.mark.parametrize("port", ["five", "80.5", ""])
    def test_a_port_that_is_no_number(self, refused, port):
        assert "--port" in refused("--port", port)

    def test_a_port_in_use(self, refused):
        with socket.socket() as taken:
            taken.bind(("127.0.0.1", 0))
            taken.listen()
            port = taken.getsockname()[1]
            words = refused("--port", port)
        assert f"--port {port}: is in use" in words
        assert "0 for any that is free" in words

    @pytest.mark.skipif(os.geteuid() == 0, reason="root may use any port")
    def test_a_port_of_the_system(self, refused):
        assert "Choose one above 1023" in refused("--port", 80)

    @pytest.mark.parametrize("address", ["nowhere.invalid", "1.2.3.4", "300.1.1.1", "a b"])
    def test_an_address_of_another_machine(self, refused, address):
        words = refused("--address", address, "--port", 0)
        assert f"--address '{address}': cannot be listened on" in words
        assert "127.0.0.1" in words

    @pytest.mark.parametrize(
        "origin",
        ["http://lab.example.org", "lab.example.org/", "lab:port", "", "a b", "*.*/x"],
    )
    def test_an_origin_that_is_none(self, refused, origin):
        words = refused("--allow", origin)
        assert "--allow" in words
        assert "HOST:PORT" in words

    def test_without_the_extra(self, refused, monkeypatch):
        found = importlib.util.find_spec
        monkeypatch.setattr(
            "wedgebrake.cli.app_command.find_spec",
            lambda name: None if name in ("panel", "bokeh") else found(name),
        )
        words = refused()
        assert "needs panel and bokeh" in words
        assert "pip install 'wedgebrake[app]'" in words

    def test_a_broken_study(self, refused, tmp_path):
        path = tmp_path / "broken.toml"
        path.write_text("[driveline\ninertia = 1")
        assert "broken.toml" in refused(path)
        path.write_text((EXAMPLES / "paper.toml").read_text().replace("0.1 ", "-0.1 "))
        words = refused(path)
        assert "driveline.damping = -0.1: must be at least 0" in words

    def test_a_study_that_is_not_there(self, refused, tmp_path):
        assert "missing.toml" in refused(tmp_path / "missing.toml")
        assert str(tmp_path.name) in refused(tmp_path)  # a folder

    def test_more_than_one_study(self, refused):
        refused(EXAMPLES / "paper.toml", EXAMPLES / "band.toml")


class TestServing:
    def test_serves_a_study_until_ctrl_c(self):
        with running(EXAMPLES / "band.toml", "--port", 0) as explorer:
            assert explorer.host == "127.0.0.1"
            assert "until Ctrl-C" in explorer.said
            assert "processors" not in explorer.said  # this machine alone
            status, page = explorer.get()
            assert status == 200
            assert "wedgebrake explorer" in page
            # Nothing comes from another machine.
            for source in re.findall(r'(?:src|href)="([^"]+)"', page):
                assert not re.match(r"(https?:)?//", source), source
            assert explorer.get("/nothing")[0] == 404
            status, output = explorer.end()
            assert (status, output) == (0, "")
            assert explorer.said.endswith("stopped\n")
            assert "Traceback" not in explorer.said
            with socket.socket() as again:  # the port is free
                again.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
                again.bind(("127.0.0.1", explorer.port))

    def test_a_polite_kill_ends_it_as_well(self):
        with running("--port", 0) as explorer:
            assert explorer.end(signal.SIGTERM)[0] == 0
            assert explorer.said.endswith("stopped\n")

    def test_ctrl_c_while_browsers_are_connected(self):
        with running("--port", 0) as explorer:
            open_ = [socket.create_connection(("127.0.0.1", explorer.port)) for _ in range(3)]
            open_[0].sendall(b"GET / HTT")
            open_[1].sendall(b"GET / HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n")
            open_[1].recv(10)
            assert explorer.end()[0] == 0
            for one in open_:
                one.close()
            assert "Traceback" not in explorer.said

    def test_lets_in_its_own_pages_and_those_allowed(self):
        with running("--port", 0, "--allow", "lab.example.org", "--allow", "proxy:81") as explorer:
            own = f"127.0.0.1:{explorer.port}"
            for origin, status in {
                f"http://{own}": 101,
                f"http://localhost:{explorer.port}": 101,
                "http://lab.example.org": 101,
                "http://proxy:81": 101,
                "http://proxy:82": 403,
                "http://evil.example.org": 403,
                f"http://evil.example.org:{explorer.port}": 403,
                f"http://127.0.0.1.evil.example.org:{explorer.port}": 403,
                "null": 403,
                "": 403,
            }.items():
                assert explorer.websocket(origin) == status, origin
            # As a proxy passes it on, under the name that the browser knows.
            assert explorer.websocket("http://lab.example.org", "lab.example.org") == 101
            assert explorer.end()[0] == 0

    def test_tells_who_can_reach_it(self):
        with running("--port", 0, "--address", "0.0.0.0") as explorer:  # noqa: S104
            assert explorer.host == "localhost"
            for _ in range(50):
                if "processors" in explorer.said:
                    break
                explorer.get()
            assert "can use this machine's processors" in explorer.said
            assert explorer.get()[0] == 200
