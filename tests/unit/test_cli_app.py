"""The command ``app``: what it says, what it refuses, whom it lets in, how it ends."""

from __future__ import annotations

import contextlib
import http.client
import re
import signal
import socket
import subprocess
import sys
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


class TestRefusals:
    @pytest.fixture
    def refused(self, run):
        """The words with which a command is refused."""

        def call(*arguments):
            status, text, message = run("app", "--no-browser", *arguments)
            assert (status, text) == (2, ""), message
            assert "internal" not in message
            return unwrapped(message)

        return call

    @pytest.mark.parametrize(
        ("options", "named"),
        [
            (["--port", "65536"], "--port 65536"),
            (["--port", "0", "--address", "nowhere.invalid"], "--address 'nowhere.invalid'"),
            (["missing.toml"], "missing.toml"),
            (["."], "directory"),
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


@pytest.fixture(scope="module")
def explorer():
    """The command in a process of its own, and the port that it serves."""
    options = [
        "--no-browser",
        "--port",
        "0",
        "--allow",
        "lab.example.org",
        "--allow",
        "proxy:81",
    ]
    with started(
        [sys.executable, "-m", "wedgebrake", "app", EXAMPLES / "band.toml", *options],
        stderr=subprocess.PIPE, stdout=subprocess.PIPE, text=True,
    ) as process:  # fmt: skip
        try:
            said = process.stderr.readline()
            while process.poll() is None and "http://" not in said:
                said = process.stderr.readline()
            [(host, port)] = re.findall(r"http://(\S+):(\d+)/", said)
            assert host == "127.0.0.1"
            yield process, int(port)
        finally:
            process.kill()


class TestServing:
    @staticmethod
    def get(port, path="/", **headers):
        """A request: its status and text."""
        with contextlib.closing(http.client.HTTPConnection("127.0.0.1", port, timeout=60)) as one:
            one.request("GET", path, headers=headers)
            answer = one.getresponse()
            return answer.status, "" if answer.status == 101 else answer.read().decode()

    def test_serves_pages_that_need_no_other_machine(self, explorer):
        _, port = explorer
        status, page = self.get(port)
        assert status == 200
        assert "wedgebrake explorer" in page
        for source in re.findall(r'(?:src|href)="([^"]+)"', page):
            assert not re.match(r"(https?:)?//", source), source
        assert self.get(port, "/nothing")[0] == 404

    def test_lets_in_its_own_pages_and_those_allowed(self, explorer):
        _, port = explorer
        for origin, status in {
            f"http://127.0.0.1:{port}": 101,
            f"http://localhost:{port}": 101,
            "http://lab.example.org": 101,
            "http://proxy:81": 101,
            "http://proxy:82": 403,
            "http://evil.example.org": 403,
            f"http://evil.example.org:{port}": 403,
            f"http://127.0.0.1.evil.example.org:{port}": 403,
            "null": 403,
            "": 403,
        }.items():
            assert self.get(port, "/ws", **HANDSHAKE, Origin=origin)[0] == status, origin
        # As a proxy passes it on, under the name that the browser knows.
        named = {"Host": "lab.example.org", "Origin": "http://lab.example.org"}
        assert self.get(port, "/ws", **HANDSHAKE, **named)[0] == 101

    def test_ends_with_ctrl_c_while_browsers_are_connected(self, explorer):
        process, port = explorer
        open_ = [socket.create_connection(("127.0.0.1", port)) for _ in range(3)]
        open_[0].sendall(b"GET / HTT")
        open_[1].sendall(b"GET / HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n")
        open_[1].recv(10)
        process.send_signal(signal.SIGINT)
        output, message = process.communicate(timeout=30)
        assert (process.returncode, output) == (0, "")
        assert "Traceback" not in message
        with socket.socket() as again:  # the port is free
            again.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            again.bind(("127.0.0.1", port))
        for one in open_:
            one.close()
