"""The explorer as a user meets it: the command started, its page in the real Chromium."""

import pytest
from browsing import CHROMIUM, FLAGS, PATIENCE, Browsing
from command import Server


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

    expect.set_options(timeout=PATIENCE / 2)
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=FLAGS)
        yield browser
        browser.close()


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
