"""A real sweep, killed at twenty random instants, ends with the same bytes."""

from __future__ import annotations

import contextlib
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from sweep_child import run

pytestmark = pytest.mark.skipif(not hasattr(os, "fork"), reason="no fork on this system")

PRIVATE = {"lock", "writer.json"}


def _files(store: Path) -> dict[str, bytes]:
    return {
        str(one.relative_to(store)): one.read_bytes()
        for one in sorted(store.rglob("*"))
        if one.is_file() and one.name not in PRIVATE
    }


class Server:
    """The process that forks."""

    def __init__(self, scratch: Path) -> None:
        script = Path(__file__).with_name("sweep_child.py")
        self.process = subprocess.Popen(
            [sys.executable, str(script), str(scratch)],
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True,
        )  # fmt: skip
        assert self.answer() == "ready"

    def answer(self) -> str:
        return self.process.stdout.readline().strip()

    def tell(self, text: str) -> None:
        self.process.stdin.write(text + "\n")
        self.process.stdin.flush()

    def killed_after(self, path: Path, seconds: float) -> bool:
        """Whether the run was killed; False: it had ended before."""
        self.tell(str(path))
        pid = int(self.answer())
        time.sleep(seconds)
        with contextlib.suppress(ProcessLookupError):
            os.kill(pid, signal.SIGKILL)
        self.tell("")
        code = int(self.answer().split()[1])
        assert code in (0, -signal.SIGKILL), code
        return code != 0


def test_twenty_kills(tmp_path) -> None:
    whole = tmp_path / "whole.zarr"
    run(whole)
    server = Server(tmp_path / "warm.zarr")
    rng = np.random.default_rng(20)
    kills, stores = 0, []
    try:
        while kills < 20 and len(stores) < 20:
            path = tmp_path / f"killed{len(stores)}.zarr"
            stores.append(path)
            # In all of its life: while it is created, computed, written and ended.
            while server.killed_after(path, rng.uniform(0.0, 0.15)):
                kills += 1
                if kills == 20:
                    break
        for path in stores:
            run(path)
    finally:
        server.process.kill()
        server.process.communicate()
    assert kills >= 20
    expected = _files(whole)
    for path in stores:
        assert _files(path) == expected
