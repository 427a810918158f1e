"""The command ``app``: what it says, what it refuses, whom it lets in, how it ends."""

from __future__ import annotations

import contextlib
import http.client
import importlib.util
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

    @pytest.mark.parametrize(
        ("options", "named"),
        [
            (["--port", "65536"], "--port 65536"),
            (["--port", "-1"], "--port -1"),
            (["--port", "five"], "--port"),
            (["--port", "0", "--address", "nowhere.invalid"], "--address 'nowhere.invalid'"),
            (["--port", "0", "--address", "1.2.3.4"], "--address '1.2.3.4'"),
            (["--port", "0", "--address", "a b"], "--address 'a b'"),
            *(
                (["--allow", one], "--allow")
                for one in ("http://lab.example.org", "lab.example.org/", "lab:port", "", "*.*/x")
            ),
            (["missing.toml"], "missing.toml"),
            (["."], "directory"),
            ([EXAMPLES / "paper.toml", EXAMPLES / "band.toml"], "band.toml"),
        ],
    )
    def test_names_the_option(self, refused, options, named):
        assert named in refused(*options)

    def test_a_port_in_use(self, refused):
        with socket.socket() as taken:
            taken.bind(("127.0.0.1", 0))
            taken.listen()
            port = taken.getsockname()[1]
            assert f"--port {port}" in refused("--port", port)

    def test_without_the_extra(self, refused, monkeypatch):
        found = importlib.util.find_spec
        monkeypatch.setattr(
            "wedgebrake.cli.app_command.find_spec",
            lambda name: None if name in ("panel", "bokeh") else found(name),
        )
        assert "pip install 'wedgebrake[app]'" in refused()

    def test_a_broken_study(self, refused, tmp_path):
        path = tmp_path / "broken.toml"
        path.write_text((EXAMPLES / "paper.toml").read_text().replace("0.1 ", "-0.1 "))
        assert "driveline.damping = -0.1" in refused(path)


class TestServing:
    def test_serves_a_study_until_ctrl_c(self):
        with running(EXAMPLES / "band.toml", "--port", 0) as explorer:
            assert explorer.host == "127.0.0.1"
            status, page = explorer.get()
            assert status == 200
            assert "wedgebrake explorer" in page
            # Nothing comes from another machine.
            for source in re.findall(r'(?:src|href)="([^"]+)"', page):
                assert not re.match(r"(https?:)?//", source), source
            assert explorer.get("/nothing")[0] == 404
            status, output = explorer.end()
            assert (status, output) == (0, "")
            assert "Traceback" not in explorer.said
            with socket.socket() as again:  # the port is free
                again.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
                again.bind(("127.0.0.1", explorer.port))

    def test_ends_while_browsers_are_connected(self):
        with running("--port", 0) as explorer:
            open_ = [socket.create_connection(("127.0.0.1", explorer.port)) for _ in range(3)]
            open_[0].sendall(b"GET / HTT")
            open_[1].sendall(b"GET / HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n")
            open_[1].recv(10)
            assert explorer.end(signal.SIGTERM)[0] == 0
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
