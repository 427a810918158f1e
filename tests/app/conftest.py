"""The explorer as a user meets it: the command started, its page in the real Chromium."""

import pytest
from browsing import CHROMIUM, FLAGS, PATIENCE, Browsing, Server


@pytest.fixture(scope="session")
def server():
    """One server for all tests of a worker; it lives until the end and complains of nothing."""
    running = Server()
    yield running
    running.stop()
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

    expect.set_options(timeout=PATIENCE / 2)
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=FLAGS)
        yield browser
        browser.close()


@pytest.fixture
def visit(chromium, request):
    """Open addresses, each in a browser of its own, as a ``Screen``."""
    browsing = Browsing(chromium)
    yield browsing.open
    browsing.keep(request.node.name)
    browsing.close()
    assert browsing.complaints == []


@pytest.fixture(scope="session")
def kept(chromium):
    """The page that the tests of a worker share, while nothing has failed on it."""
    pages = []
    yield pages
    for browsing, _ in pages:
        browsing.close()


@pytest.fixture
def screen(kept, chromium, server, request):
    """A page of 1440 x 900 pixels with the machine to begin with, after others' tests."""
    failures = request.session.testsfailed
    if not kept:
        browsing = Browsing(chromium)
        kept.append((browsing, browsing.open(server.url)))
    [(browsing, shown)] = kept
    shown.begin_again()
    yield shown
    browsing.keep(request.node.name)
    complaints = [*browsing.complaints]
    if complaints or request.session.testsfailed > failures:
        kept.clear()
        browsing.close()
    assert complaints == []
