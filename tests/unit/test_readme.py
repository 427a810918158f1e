"""Every example of the README and of the pages in docs runs."""

import re
import shutil
import signal
import subprocess
import sys
from pathlib import Path
from urllib.request import urlopen

import pytest

ROOT = Path(__file__).parents[2]
PAGES = ("README.md", "docs/orbits.md", "docs/explorer.md")
TEXTS = {page: (ROOT / page).read_text(encoding="utf-8") for page in PAGES}
PROGRAM = str(Path(sys.executable).with_name("wedgebrake"))


def blocks(language):
    return re.findall(rf"```{language}\n(.*?)```", "\n".join(TEXTS.values()), flags=re.DOTALL)


LINES = dict.fromkeys(
    line for block in blocks("sh") for line in block.splitlines() if line.startswith("wedgebrake")
)
SERVERS = [line for line in LINES if line.startswith("wedgebrake app")]


@pytest.mark.parametrize("code", blocks("python"))
def test_python_examples(code, tmp_path, monkeypatch):
    shutil.copytree(ROOT / "examples", tmp_path / "examples")
    monkeypatch.chdir(tmp_path)  # they write files
    exec(compile(code, "README.md", "exec"), {"__name__": "readme"})  # noqa: S102 - our own text


@pytest.mark.parametrize("line", [line for line in LINES if line not in SERVERS])
def test_commands(line, tmp_path):
    shutil.copytree(ROOT / "examples", tmp_path / "examples")
    result = subprocess.run(
        [PROGRAM, *arguments(line)], cwd=tmp_path, capture_output=True, text=True
    )
    assert result.returncode == 0, result.stderr
    assert result.stdout
    assert (tmp_path / "run.png").exists() == ("run.png" in arguments(line))


@pytest.mark.parametrize("stop", [signal.SIGTERM, signal.SIGINT])
@pytest.mark.parametrize("line", SERVERS)
def test_servers(line, stop):
    command = [PROGRAM, *arguments(line), "--port", "0", "--no-browser"]
    with subprocess.Popen(command, cwd=ROOT, stderr=subprocess.PIPE, text=True) as served:
        try:
            said = served.stderr.readline()
            [url] = re.findall(r"http://\S+", said)
            with urlopen(url) as page:  # noqa: S310 - our own page
                assert "wedgebrake explorer" in page.read().decode()
        finally:
            served.send_signal(stop)
        assert served.wait(60) == 0, served.stderr.read()


def arguments(line):
    return line.split("#")[0].split()[1:]


def test_every_make_target_that_it_names_exists():
    makefile = (ROOT / "Makefile").read_text()
    for target in set(re.findall(r"make (\w+)", TEXTS["README.md"])):
        assert re.search(rf"^{target}:", makefile, flags=re.MULTILINE)


@pytest.mark.parametrize("page", PAGES)
def test_every_file_that_it_links_exists(page):
    for target in re.findall(r"\]\((?!http)([^)#]+)(?:#[^)]*)?\)", TEXTS[page]):
        assert ((ROOT / page).parent / target).exists(), target


@pytest.mark.parametrize("page", PAGES)
def test_every_heading_that_it_links_exists(page):
    headings = {
        re.sub(r"[^\w -]", "", heading).strip().lower().replace(" ", "-")
        for heading in re.findall(r"^#+ (.*)$", TEXTS[page], flags=re.MULTILINE)
    }
    assert set(re.findall(r"\]\(#([^)]+)\)", TEXTS[page])) <= headings
