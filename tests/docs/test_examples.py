"""Every example of the README and of the pages in docs runs."""

import re
import shlex
import shutil
import webbrowser
from pathlib import Path

import pytest
from typer.main import get_command

import wedgebrake as wb
from wedgebrake.cli.commands import app
from wedgebrake.explorer.ui import server
from wedgebrake.paper import statements

ROOT = Path(__file__).parents[2]
PAGES = (
    "README.md",
    *sorted(path.relative_to(ROOT).as_posix() for path in (ROOT / "docs").rglob("*.md")),
)
TEXTS = {page: (ROOT / page).read_text(encoding="utf-8") for page in PAGES}


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


def arguments(line):
    return line.split("#")[0].split()[1:]


def commands(page):
    lines = [line for _, block in blocks(page, "sh") for line in block.splitlines()]
    return dict.fromkeys(" ".join(arguments(one)) for one in lines if one.startswith("wedgebrake"))


# Shorter ranges and fewer values of the same kind: their numbers are tested elsewhere.
SHORTER = {
    r"eta=12:-60": "eta=12:0",
    r"eta=-10:-22": "eta=-15:-18",
    r"F0=0.0[23]:0.0[69]\b(?!:)": "F0=0.033:0.04",
    r"slope=0:-160": "slope=0:-20",
    r"frequency=5:40 --level amplitude=400,500,700": "frequency=8:9 --level amplitude=480",
    r"base_speed=0.5:3\b": "base_speed=1:1.2",
    r"8\.4:9 --level amplitude=480,500": "8.9:9 --level amplitude=500",
    r"levels=\[480, 500\], folds=True": "levels=[500]",
    r"eta=\(-10, -22\)": "eta=(-15, -18)",
    r"F0=\(0\.095, 0\.05\)": "F0=(0.095, 0.09)",
    r"--samples (256|1024)": "--samples 32",
    r"--out paper\.toml": "--out mine.toml",
    r":(\d\d+)(?=$|:log| )": ":4",
    r"fig8": "fig3",
    r"((?:lin|geom)space\([^()]*, )\d+\)": r"\g<1>4)",
}


def shorter(text):
    for long, short in SHORTER.items():
        text = re.sub(long, short, text)
    return text


PROGRAMS = [(page, program) for page in PAGES for program in programs(page)]
# Those of the help, whose files lie in the working directory; the README has those of ``paper``.
HELP = [
    example.strip().removeprefix("wedgebrake ")
    for name, command in get_command(app).commands.items()
    for example in (command.epilog or "").partition(": ")[2].split(";")
    if example and name != "paper"
]


def shown(line):
    """What a command computes, whatever the name of its picture."""
    return re.sub(r" --plot \S+", " --plot", shorter(line).replace("examples/", ""))


# Each where it first stands, unless a page's own study has its name.
COMMANDS = {line: page for page in reversed(PAGES) for line in commands(page)}
SHOWN = {shown(line) for line in COMMANDS}
COMMANDS |= dict.fromkeys([line for line in HELP if shown(line) not in SHOWN], "--help")


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
        monkeypatch.chdir(tmp_path)
        if page == "--help":
            return shutil.copytree(ROOT / "examples", tmp_path, dirs_exist_ok=True)
        shutil.copytree(ROOT / "examples", tmp_path / "examples")
        for _, text in blocks(page, "toml"):
            named = re.match(r"# (\S+\.toml)\n", text)
            if named:
                (tmp_path / named[1]).write_text(text, encoding="utf-8")
        return tmp_path

    return enter


@pytest.mark.parametrize(
    ("page", "program"), PROGRAMS, ids=[f"{page}:{program[0][0]}" for page, program in PROGRAMS]
)
def test_python_examples(page, program, folder):
    folder(page)  # they write files
    names = {"__name__": "example"}
    for line, text in program:
        code = compile("\n" * (line - 1) + shorter(text), page, "exec")
        exec(code, names)  # noqa: S102 - our own text


@pytest.mark.parametrize(("line", "page"), COMMANDS.items())
def test_commands(line, page, folder, run, monkeypatch):
    served = []
    monkeypatch.setattr(server, "serve", lambda *given, **_: served.extend(given))
    monkeypatch.setattr(webbrowser, "open", served.append)
    monkeypatch.setattr(statements, "STATEMENTS", statements.STATEMENTS[:2])
    folder(page)
    words = shlex.split(shorter(line))
    status, text, message = run(*words)
    assert status == 0, message
    assert text or served
    for option in ("--plot", "--out"):
        if option in words:
            assert Path(words[words.index(option) + 1]).exists()


@pytest.mark.parametrize("page", PAGES)
def test_what_it_names_and_links_exists(page):
    makefile = (ROOT / "Makefile").read_text()
    for target in set(re.findall(r"(?:`|^)make ([\w-]+)", TEXTS[page], flags=re.MULTILINE)):
        assert re.search(rf"^{target}:", makefile, flags=re.MULTILINE), target
    for target, anchor in re.findall(r"\]\((?!http)([^)#]*)(?:#([^)]*))?\)", TEXTS[page]):
        path = (ROOT / page).parent / target if target else ROOT / page
        assert path.exists(), target
        if anchor:
            anchors = {re.sub(r"[^\w -]", "", one).lower() for one in headings(path)}
            assert anchor in {one.replace(" ", "-") for one in anchors}, (target, anchor)


def headings(path):
    return re.findall(r"^#+ (.*)$", path.read_text(encoding="utf-8"), flags=re.MULTILINE)


def test_the_sections_that_sources_refer_to_exist():
    """A comment or a docstring says: docs/numerics.md, "Ties"."""
    found = 0
    for folder in ("src", "tests", "benchmarks"):
        for path in [*(ROOT / folder).rglob("*.py"), *(ROOT / folder).rglob("*.f90")]:
            text = re.sub(r"\n *[#!]?", " ", path.read_text(encoding="utf-8"))
            for page, section in re.findall(r"(docs/[\w/]+\.md)(?:, +\"([^\"]+)\")?", text):
                assert (ROOT / page).exists(), (path, page)
                heading = " ".join(section.split())
                assert not section or heading in headings(ROOT / page), (path, page, section)
                found += bool(section)
    assert found > 30
