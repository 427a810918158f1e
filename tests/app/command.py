"""The command ``wedgebrake app`` in a process of its own."""

from __future__ import annotations

import re
import subprocess
import sys
import threading

_START = 120.0  # s: compiles where nothing has been compiled before


class Server:
    """The command ``wedgebrake app``, running."""

    def __init__(self, *arguments):
        command = [sys.executable, "-m", "wedgebrake", "app", "--port", "0", "--no-browser"]
        self.process = subprocess.Popen(
            [*command, *arguments], stderr=subprocess.PIPE, stdout=subprocess.DEVNULL, text=True
        )
        self.lines: list[str] = []
        self._told = threading.Event()
        self._listener = threading.Thread(target=self._listen, daemon=True)
        self._listener.start()
        assert self._told.wait(_START), "".join(self.lines)
        self.url = re.search(r"http://\S+", "".join(self.lines))[0]

    def _listen(self):
        for line in self.process.stderr:
            self.lines.append(line)
            if "http://" in line:
                self._told.set()
        self._told.set()

    @property
    def said(self):
        """What it has written to standard error."""
        return "".join(self.lines)

    def stop(self):
        self.process.terminate()
        try:
            return self.process.wait(20)
        except subprocess.TimeoutExpired:
            self.process.kill()
            raise
        finally:
            self._listener.join(5)
            self.process.stderr.close()
