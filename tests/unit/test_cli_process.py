"""The command line as a process: streams that are closed, names that are no words, Ctrl-C."""

from __future__ import annotations

import os
import pty
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from children import started

PAPER = Path(__file__).parents[2] / "examples" / "paper.toml"
SHORT = ["--set", "periods=20"]
# Clears a terminal, colours it, goes back to the start of a line, rings; and the same in C1.
RUDE = "a\x1b[2J\x1b[31m\rb\x07\x9b31m"


def program(*arguments: object, closing: str, **options) -> subprocess.CompletedProcess[str]:
    """The command line in a process; ``closing`` is what a shell appends."""
    command = [sys.executable, "-P", "-m", "wedgebrake", *map(str, arguments)]
    return subprocess.run(
        ["sh", "-c", f'"$@" {closing}', "sh", *command], capture_output=True, text=True, **options
    )


class TestClosedStreams:
    @pytest.mark.parametrize("command", [["stability", PAPER], ["--version"], ["--help"]])
    def test_output_that_cannot_be_written_is_an_error(self, command, tmp_path):
        done = program(*command, closing=">&- <&-", cwd=tmp_path)
        assert done.returncode == 1
        assert done.stderr.splitlines()[-1].startswith("error: ")

    def test_no_file_takes_the_place_of_a_stream(self, run, tmp_path):
        order = ["simulate", PAPER, *SHORT, "--out"]
        assert run(*order, "wanted.nc")[0] == 0
        done = program(*order, "r.nc", closing=">&- 2>&- <&-", cwd=tmp_path)
        assert (done.returncode, done.stdout, done.stderr) == (1, "", "")
        assert Path("r.nc").read_bytes() == Path("wanted.nc").read_bytes()

    def test_messages_that_nobody_hears(self, tmp_path):
        done = program("--version", closing="2>&- <&-", cwd=tmp_path)
        assert (done.returncode, done.stdout[:10]) == (0, "wedgebrake")
        assert program("no such command", closing="2>&-", cwd=tmp_path).returncode == 2


class TestNames:
    """What a name holds never moves the cursor of a terminal."""

    @staticmethod
    def on_a_terminal(folder: Path, *arguments: str, **variables: str) -> bytes:
        """All that a terminal gets from a command."""
        ours, theirs = pty.openpty()
        with subprocess.Popen(
            [sys.executable, "-m", "wedgebrake", *arguments],
            cwd=folder, stdin=theirs, stdout=theirs, stderr=theirs, env=os.environ | variables,
        ):  # fmt: skip
            os.close(theirs)
            text = b""
            try:
                while part := os.read(ours, 65536):
                    text += part
            except OSError:  # so Linux says that the other end is closed
                pass
        os.close(ours)
        return text

    @pytest.mark.parametrize(
        ("encoding", "arguments"),
        [
            ("utf-8", ("sweep", f"{RUDE}.toml", "--over", "eta=1,2", "--periods", "12",
                       "--transient", "10", "--out", f"{RUDE}.nc")),
            ("ascii", ("stability", f"{RUDE}.no")),
            ("utf-8", (RUDE,)),
        ],
    )  # fmt: skip
    def test_is_written_as_escapes(self, encoding, arguments, tmp_path):
        (tmp_path / f"{RUDE}.toml").write_text(PAPER.read_text())
        text = self.on_a_terminal(tmp_path, *arguments, PYTHONIOENCODING=encoding)
        lines = text.replace(b"\r\n", b"\n")
        # The bar of a sweep has control characters of its own, and none of the names in it.
        assert b"[31m" in lines
        assert b"\\x1b" in lines
        for bad in (b"\x1b[2J", b"\x1b[31m", b"\rb", b"\x07", "\x9b".encode(), b"\x9b31m"):
            assert bad not in lines, lines

    def test_of_a_file_is_as_it_was(self, run, tmp_path):
        """Also a name that is no text."""
        name = os.fsdecode(f"{RUDE}.nc".encode() + b"\xff.nc")
        (tmp_path / f"{RUDE}.toml").write_text(PAPER.read_text())
        assert run("simulate", f"{RUDE}.toml", *SHORT, "--out", name)[0] == 0
        assert (tmp_path / name).is_file()


@pytest.mark.parametrize(
    "arguments",
    [
        ["sweep", PAPER, "--over", "eta=1,2", "--store", "r.zarr", "--resume"],
        ["simulate", PAPER, "--out", "r.nc"],
    ],
)
def test_a_working_directory_that_was_deleted_is_told(arguments, tmp_path):
    gone = tmp_path / "gone"
    gone.mkdir()
    done = subprocess.run(
        ["sh", "-c", 'rmdir "$0" && exec "$@"', gone, sys.executable, "-P", "-m", "wedgebrake",
         *arguments],
        cwd=gone, capture_output=True, text=True,
    )  # fmt: skip
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr.startswith("error: ")
    assert "Errno" not in done.stderr


# Sends Ctrl-C to its own process as it imports its NUMBERth module from one of ours on.
STRIKES = """
import os, signal, sys
left = None
def hear(event, arguments):
    global left
    if event != "import":
        return
    if left is None and arguments[0] == "wedgebrake.cli.interrupts":
        left = int(os.environ["NUMBER"])
    if left is not None:
        left -= 1
        if left == 0:
            os.kill(os.getpid(), signal.SIGINT)
sys.addaudithook(hear)
"""


def start(*arguments: object, **options) -> subprocess.Popen[str]:
    return started(
        [sys.executable, "-m", "wedgebrake", *map(str, arguments)],
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, **options,
    )  # fmt: skip


class TestInterrupt:
    @pytest.mark.parametrize("number", [1, 21, 377])
    def test_at_any_import(self, number, tmp_path):
        """From the first line of the program on; before that, Python itself is starting."""
        (tmp_path / "sitecustomize.py").write_text(STRIKES)
        path = os.pathsep.join([str(tmp_path), os.environ.get("PYTHONPATH", "")])
        process = start(
            "simulate", PAPER, "--set", "periods=100000",
            env=os.environ | {"NUMBER": str(number), "PYTHONPATH": path},
        )  # fmt: skip
        text, message = process.communicate(timeout=120)
        assert (process.returncode, text, message) == (1, "", "interrupted\n")

    @pytest.mark.parametrize("delay", [0.05, 0.4])
    def test_at_any_time(self, delay):
        """No traceback comes from ``main``; before it is called, Python itself is starting."""
        process = start("sweep", PAPER, "--over", "eta=-60:12:1000000")
        time.sleep(delay)
        process.send_signal(signal.SIGINT)
        text, message = process.communicate(timeout=120)
        assert process.returncode in (1, -signal.SIGINT)
        assert text == ""
        assert "cli/main.py" not in message
        assert "Exception ignored" not in message
