"""The real Chromium: where it is, and pages of the explorer in it."""

from __future__ import annotations

import os
import re
import shutil
from pathlib import Path

from screen import Screen

CHROMIUM = os.environ.get("WEDGEBRAKE_CHROMIUM") or next(
    (found for name in ("chromium", "chromium-browser", "google-chrome") if
     (found := shutil.which(name))), None
)  # fmt: skip
FLAGS = [
    "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run",
    "--disable-background-networking", "--disable-component-update", "--disable-sync",
]  # fmt: skip
SCREENSHOTS = Path("out/screenshots")
PATIENCE = 60_000  # ms: others may use the processors too


class Browsing:
    """Pages opened for a test, and what their consoles complain of."""

    def __init__(self, chromium, url):
        self._chromium, self._url = chromium, url
        self._contexts, self.complaints = [], []

    def open(self, width=1440, height=900, prepare=None):
        """Open the explorer in a browser of its own, and wait until it is ready.

        prepare : called with Playwright's page before it is sent there
        """
        context = self._chromium.new_context(viewport={"width": width, "height": height})
        self._contexts.append(context)
        page = context.new_page()
        page.set_default_timeout(PATIENCE)
        hear = self.complaints.append
        page.on("pageerror", lambda error: hear(str(error)))
        page.on("console", lambda said: said.type == "error" and hear(said.text))
        page.on("requestfailed", lambda sent: hear(f"{sent.url}: {sent.failure}"))
        if prepare is not None:
            prepare(page)
        page.goto(self._url)
        page.locator("[data-motion='1']").wait_for()
        return Screen(page)

    def keep(self, name):
        """Keep a picture of every page."""
        SCREENSHOTS.mkdir(parents=True, exist_ok=True)
        name = re.sub(r"[^\w-]+", "-", name).strip("-")
        for number, context in enumerate(self._contexts):
            context.pages[0].screenshot(path=SCREENSHOTS / f"{name}{number or ''}.png")

    def close(self):
        for context in self._contexts:
            context.close()
