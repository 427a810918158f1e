"""The documentation builds without a warning, is complete, and asks no other host."""

import html
import re
import subprocess
import sys
import zlib
from pathlib import Path

import pytest
from filelock import FileLock
from typer.main import get_command

import wedgebrake as wb
from wedgebrake.cli.commands import app

pytest.importorskip("sphinx", reason="needs the extra docs")

ROOT = Path(__file__).parents[2]
# Of a page: what the browser fetches without being asked.
FETCHED = re.compile(r'<(?:script|img|iframe|source)\b[^>]*\bsrc="(?!data:)([^"]+)"')
LINKED = re.compile(r'<link\b(?![^>]*rel="(?:search|index|next|prev)")[^>]*\bhref="([^"]+)"')


@pytest.fixture(scope="session")
def site(tmp_path_factory):
    """The built pages: made once, also where several processes test."""
    common = tmp_path_factory.getbasetemp()
    if common.name.startswith("popen-"):
        common = common.parent
    pages, done = common / "docs", common / "docs.txt"
    with FileLock(common / "docs.lock"):
        if not done.exists():
            command = [sys.executable, "-m", "sphinx", "-W", "--keep-going", "-q"]
            result = subprocess.run(
                [*command, ROOT / "docs", pages], capture_output=True, text=True
            )
            done.write_text(result.stdout + result.stderr)
            (common / "docs.rc").write_text(str(result.returncode))
    assert (common / "docs.rc").read_text() == "0", done.read_text()
    return pages


def text_of(page):
    """The words of a page, one space between them, also where only a tag stood."""
    words = re.sub(r"<[^>]+>", " ", page.read_text(encoding="utf-8"))
    return " ".join(html.unescape(words).split())


def test_every_public_name_is_on_its_pages(site):
    # Four lines of words, then a compressed line for each: name, kind, rank, address, title.
    content = (site / "objects.inv").read_bytes().split(b"\n", 4)[4]
    lines = zlib.decompress(content).decode().splitlines()
    described = {line.split()[0] for line in lines if line.split()[1].startswith("py:")}
    public = {
        f"wedgebrake.{name}" for name in set(wb.__all__) - {"__version__", "paper", "testing"}
    }
    public |= {f"wedgebrake.paper.{name}" for name in wb.paper.__all__}
    public |= {f"wedgebrake.testing.{name}" for name in wb.testing.__all__}
    assert public - described == set()


def test_every_command_and_option_is_on_its_page(site):
    page = text_of(site / "command_line.html")
    written = (ROOT / "docs/command_line.md").read_text()
    for name, command in get_command(app).commands.items():
        assert f"`wedgebrake {name}" in written, name
        section = page.partition(f"wedgebrake {name} [OPTIONS]")[2]
        section = section.partition("Show this message and exit.")[0]
        for one in command.params:
            assert one.param_type_name == "argument" or one.opts[0] in section, (name, one.opts)


def test_no_page_fetches_from_another_host(site):
    pages = [page for page in site.rglob("*.html") if page.name != "paper.html"]
    assert len(pages) > 15
    for page in pages:
        text = page.read_text(encoding="utf-8")
        fetched = FETCHED.findall(text) + LINKED.findall(text)
        assert fetched
        for address in fetched:
            assert not re.match(r"https?:|//", address), f"{page.name}: {address}"
