"""The command ``wedgebrake app`` in a process of its own, and its page in the real Chromium."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
import threading
from pathlib import Path
from urllib.parse import urlsplit

from screen import Screen

CHROMIUM = os.environ.get("WEDGEBRAKE_CHROMIUM") or next(
    filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None
)
FLAGS = [
    "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run",
    "--disable-background-networking", "--disable-component-update", "--disable-sync",
]  # fmt: skip
PATIENCE = 60_000  # ms: others may use the processors too
_START = 120.0  # s: compiles where nothing has been compiled before
_SCREENSHOTS = Path("out/screenshots")


# The command, with pictures that are not as fine at last.
QUICK = {"FINE_POINTS": 300, "FINE_MAP": (48, 32)}
_PROGRAM = f"""
from wedgebrake.cli import process_main
from wedgebrake.explorer.core import plots
vars(plots).update({QUICK})
process_main()
"""


class Server:
    """The command, running."""

    def __init__(self, *arguments):
        command = [sys.executable, "-c", _PROGRAM, "app", "--port", "0", "--no-browser"]
        self.process = subprocess.Popen(
            [*command, *arguments], stderr=subprocess.PIPE, stdout=subprocess.DEVNULL, text=True
        )
        self._lines: list[str] = []
        self._told = threading.Event()
        self._listener = threading.Thread(target=self._listen, daemon=True)
        self._listener.start()
        assert self._told.wait(_START), self.said
        self.url = re.search(r"http://\S+", self.said)[0]

    def _listen(self):
        for line in self.process.stderr:
            self._lines.append(line)
            if "http://" in line:
                self._told.set()
        self._told.set()

    @property
    def said(self):
        """What it has written to standard error."""
        return "".join(self._lines)

    def stop(self):
        """End it politely, which is to succeed."""
        assert self.process.poll() is None, self.said
        self.process.terminate()
        try:
            assert self.process.wait(20) == 0, self.said
        except subprocess.TimeoutExpired:
            self.process.kill()
            raise
        finally:
            self._listener.join(5)
            self.process.stderr.close()


class Browsing:
    """Pages opened for a test, and what their consoles complain of."""

    def __init__(self, chromium):
        self._chromium = chromium
        self._contexts, self.complaints = [], []

    def open(self, url, width=1440, height=900, ready="[data-motion='1']"):
        """Open an address in a browser of its own, and wait until it is ready."""
        context = self._chromium.new_context(viewport={"width": width, "height": height})
        self._contexts.append(context)
        page = context.new_page()
        page.set_default_timeout(PATIENCE)
        screen = Screen(page)
        hear = self.complaints.append
        page.on("pageerror", lambda error: hear(str(error)))
        page.on("console", lambda said: said.type == "error" and hear(said.text))
        page.on("requestfailed", lambda sent: hear(f"{sent.url}: {sent.failure}"))
        page.on("response", lambda got: screen.loaded.append((urlsplit(got.url), got.status)))

        def listen(socket):
            socket.on("framesent", lambda frame: screen.sent.append(frame))
            socket.on("framereceived", lambda frame: screen.heard.append(len(frame)))

        page.on("websocket", listen)
        page.goto(url)
        page.locator(ready).first.wait_for()
        return screen

    def keep(self, name):
        """Keep a picture of every page."""
        _SCREENSHOTS.mkdir(parents=True, exist_ok=True)
        name = re.sub(r"[^\w-]+", "-", name).strip("-")
        for number, context in enumerate(self._contexts):
            for page in context.pages:
                page.screenshot(path=_SCREENSHOTS / f"{name}{number or ''}.png")

    def close(self):
        for context in self._contexts:
            context.close()
