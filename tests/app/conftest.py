"""The explorer as a user meets it: the command started, its page in the real Chromium."""

import os
import re
import shutil
import subprocess
import sys
import threading
from pathlib import Path

import pytest
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
_START = 120.0
_PATIENCE = 60_000  # ms: others may use the processors too


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


@pytest.fixture(scope="session")
def server():
    """One server for all tests of a worker; each test opens pages of its own."""
    running = Server()
    yield running
    assert running.process.poll() is None, running.said
    assert running.stop() == 0, running.said
    assert "Traceback" not in running.said, running.said


@pytest.fixture(scope="session")
def chromium():
    """The real Chromium, without a screen."""
    if CHROMIUM is None:
        pytest.skip(
            "no Chromium on this machine: the explorer's page is not tested (Debian: apt-get"
            " install chromium; or name one in WEDGEBRAKE_CHROMIUM)"
        )
    from playwright.sync_api import expect, sync_playwright

    expect.set_options(timeout=_PATIENCE / 2)
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=FLAGS)
        yield browser
        browser.close()


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
        page.set_default_timeout(_PATIENCE)
        hear = self.complaints.append
        page.on("pageerror", lambda error: hear(str(error)))
        page.on("console", lambda said: said.type == "error" and hear(said.text))
        page.on("requestfailed", lambda sent: hear(f"{sent.url}: {sent.failure}"))
        if prepare is not None:
            prepare(page)
        page.goto(self._url)
        page.locator(".explorer[data-motion]").wait_for()
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


@pytest.fixture
def visit(chromium, server, request):
    """Open fresh pages: a function that gives a ``Screen`` of a width and height."""
    browsing = Browsing(chromium, server.url)
    yield browsing.open
    browsing.keep(request.node.name)
    browsing.close()
    assert browsing.complaints == []


_FAILED = pytest.StashKey[bool]()


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(item, call):
    report = yield
    item.stash[_FAILED] = item.stash.get(_FAILED, False) or report.failed
    return report


@pytest.fixture(scope="session")
def kept(chromium):
    """The page that the tests of a worker share, while nothing has failed on it."""
    pages = {}
    yield pages
    for browsing, _ in pages.values():
        browsing.close()


@pytest.fixture
def screen(kept, chromium, server, request):
    """A page of 1440 x 900 pixels with the machine to begin with, after others' tests."""
    if "page" not in kept:
        browsing = Browsing(chromium, server.url)
        kept["page"] = browsing, browsing.open()
    else:
        kept["page"][1].begin_again()
    browsing, shown = kept["page"]
    yield shown
    browsing.keep(request.node.name)
    complaints = [*browsing.complaints]
    if complaints or request.node.stash.get(_FAILED, False):
        del kept["page"]
        browsing.close()
    assert complaints == []


@pytest.fixture
def page(screen):
    """The same, as Playwright knows it."""
    return screen.page
