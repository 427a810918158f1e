"""Every example of the README and of the pages in docs runs."""

import re
import shutil
import signal
import subprocess
import sys
from pathlib import Path
from urllib.request import urlopen

import pytest

import wedgebrake as wb
from children import started

ROOT = Path(__file__).parents[2]
PAGES = (
    "README.md",
    *sorted(path.relative_to(ROOT).as_posix() for path in (ROOT / "docs").rglob("*.md")),
)
TEXTS = {page: (ROOT / page).read_text(encoding="utf-8") for page in PAGES}
PROGRAM = str(Path(sys.executable).with_name("wedgebrake"))


def blocks(page, language):
    """(first line, text) of the blocks of a page in a language."""
    found = re.finditer(rf"```{language}\n(.*?)```", TEXTS[page], flags=re.DOTALL)
    return [(TEXTS[page][: match.start(1)].count("\n") + 1, match[1]) for match in found]


def programs(page):
    """Its Python, as a reader would type it: a block without imports goes on with the last."""
    found = []
    for line, text in blocks(page, "python"):
        if not found or "import wedgebrake" in text:
            found.append([])
        found[-1].append((line, text))
    return found


def commands(page):
    lines = [line for _, block in blocks(page, "sh") for line in block.splitlines()]
    return dict.fromkeys(line for line in lines if line.startswith("wedgebrake"))


PROGRAMS = [(page, program) for page in PAGES for program in programs(page)]
COMMANDS = [(page, line) for page in PAGES for line in commands(page)]
SERVERS = [(page, line) for page, line in COMMANDS if line.startswith("wedgebrake app")]


@pytest.fixture(autouse=True)
def kinds():
    """Forget the brakes and friction laws that an example defines."""
    before = [(table, dict(table)) for table in (wb.Brake.kinds, wb.SmoothFriction.kinds)]
    yield
    for table, names in before:
        table.clear()
        table.update(names)


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """Enter a folder with the examples and the files that a page tells its reader to write."""

    def enter(page):
        shutil.copytree(ROOT / "examples", tmp_path / "examples")
        for _, text in blocks(page, "toml"):
            named = re.match(r"# (\S+\.toml)\n", text)
            if named:
                (tmp_path / named[1]).write_text(text, encoding="utf-8")
        monkeypatch.chdir(tmp_path)
        return tmp_path

    return enter


@pytest.mark.parametrize(
    ("page", "program"), PROGRAMS, ids=[f"{page}:{program[0][0]}" for page, program in PROGRAMS]
)
def test_python_examples(page, program, folder):
    folder(page)  # they write files
    names = {"__name__": "example"}
    for line, text in program:
        exec(compile("\n" * (line - 1) + text, page, "exec"), names)  # noqa: S102 - our own text


@pytest.mark.parametrize(("page", "line"), [one for one in COMMANDS if one not in SERVERS])
def test_commands(page, line, folder):
    here = folder(page)
    result = subprocess.run([PROGRAM, *arguments(line)], cwd=here, capture_output=True, text=True)
    assert result.returncode == 0, result.stderr
    assert result.stdout
    for option in ("--plot", "--out"):
        if option in arguments(line):
            assert (here / arguments(line)[arguments(line).index(option) + 1]).exists()


@pytest.mark.parametrize("line", sorted({line for _, line in SERVERS}))
def test_servers(line):
    command = [PROGRAM, *arguments(line), "--port", "0", "--no-browser"]
    with started(command, cwd=ROOT, stderr=subprocess.PIPE, text=True) as served:
        try:
            said = served.stderr.readline()
            [url] = re.findall(r"http://\S+", said)
            with urlopen(url) as page:  # noqa: S310 - our own page
                assert "wedgebrake explorer" in page.read().decode()
        finally:
            served.send_signal(signal.SIGINT)
        assert served.wait(60) == 0, served.stderr.read()


def arguments(line):
    return line.split("#")[0].split()[1:]


@pytest.mark.parametrize("page", PAGES)
def test_what_it_names_and_links_exists(page):
    makefile = (ROOT / "Makefile").read_text()
    for target in set(re.findall(r"(?:`|^)make ([\w-]+)", TEXTS[page], flags=re.MULTILINE)):
        assert re.search(rf"^{target}:", makefile, flags=re.MULTILINE), target
    for target in re.findall(r"\]\((?!http)([^)#]+)(?:#[^)]*)?\)", TEXTS[page]):
        assert ((ROOT / page).parent / target).exists(), target
    headings = {
        re.sub(r"[^\w -]", "", heading).strip().lower().replace(" ", "-")
        for heading in re.findall(r"^#+ (.*)$", TEXTS[page], flags=re.MULTILINE)
    }
    assert set(re.findall(r"\]\(#([^)]+)\)", TEXTS[page])) <= headings
