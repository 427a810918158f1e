"""Every example of the README and of the pages in docs runs."""

import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PAGES = ("README.md", "docs/orbits.md")
README, ORBITS = ((ROOT / page).read_text(encoding="utf-8") for page in PAGES)


def blocks(language):
    return re.findall(rf"```{language}\n(.*?)```", README + ORBITS, flags=re.DOTALL)


@pytest.mark.parametrize("code", blocks("python"))
def test_python_examples(code, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)  # they write files
    exec(compile(code, "README.md", "exec"), {"__name__": "readme"})  # noqa: S102 - our own text


@pytest.mark.parametrize(
    "line",
    dict.fromkeys(
        line
        for block in blocks("sh")
        for line in block.splitlines()
        if line.startswith("wedgebrake")
    ),
)
def test_commands(line, tmp_path):
    program = str(Path(sys.executable).with_name("wedgebrake"))
    words = line.split("#")[0].split()[1:]
    shutil.copytree(ROOT / "examples", tmp_path / "examples")
    result = subprocess.run([program, *words], cwd=tmp_path, capture_output=True, text=True)
    assert result.returncode == 0, result.stderr
    assert result.stdout
    assert (tmp_path / "run.png").exists() == ("run.png" in words)


def test_every_make_target_that_it_names_exists():
    makefile = (ROOT / "Makefile").read_text()
    for target in set(re.findall(r"make (\w+)", README)):
        assert re.search(rf"^{target}:", makefile, flags=re.MULTILINE)


@pytest.mark.parametrize("page", PAGES)
def test_every_file_that_it_links_exists(page):
    text = (ROOT / page).read_text(encoding="utf-8")
    for target in re.findall(r"\]\((?!http)([^)#]+)\)", text):
        assert ((ROOT / page).parent / target).exists(), target
