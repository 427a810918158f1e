"""``wedgebrake example``: study files for who has no clone, and the messages that name it."""

from __future__ import annotations

from pathlib import Path

import pytest

import wedgebrake as wb
from wedgebrake.cli import examples

FOLDER = Path(__file__).parents[2] / "examples"
NAMES = sorted(path.stem for path in FOLDER.glob("*.toml"))


@pytest.mark.parametrize("name", NAMES)
def test_prints_the_file_and_nothing_else(name, run):
    text = (FOLDER / f"{name}.toml").read_text(encoding="utf-8")
    assert run("example", name) == (0, text, "")


def test_writes_a_new_file(run, tmp_path):
    status, output, message = run("example", "paper", "--out", "mine.toml")
    assert (status, output, message) == (0, f"Study: {tmp_path / 'mine.toml'}\n", "")
    assert wb.load_study("mine.toml") == wb.load_study(FOLDER / "paper.toml")


def test_lists_all_with_a_word_on_each(run):
    status, output, message = run("example")
    assert (status, message) == (0, "")
    rows = [line.split(maxsplit=1) for line in output.splitlines()[1:]]
    assert [name for name, _ in rows] == NAMES
    for name, about in rows:
        comment = (FOLDER / f"{name}.toml").read_text().replace("\n# ", " ")
        assert comment.startswith(f"# {about}.")


@pytest.mark.parametrize(
    ("arguments", "named"),
    [
        (["papr"], "error: example papr: not known. Did you mean 'paper'?\n"),
        (["paper", "--out", "m.txt"], "error: --out m.txt: "),
        (["paper", "--out", "no/m.toml"], "error: --out no/m.toml: "),
        (["../pyproject"], "error: example ../pyproject: "),
    ],
)
def test_wrong(arguments, named, run, tmp_path):
    status, output, message = run("example", *arguments)
    assert (status, output) == (2, "")
    assert message.startswith(named)
    assert list(tmp_path.iterdir()) == []


def test_leaves_alone_what_is_there(run, tmp_path):
    (tmp_path / "mine.toml").write_text("earlier work")
    status, output, message = run("example", "paper", "--out", "mine.toml")
    assert (status, output) == (2, "")
    assert message.startswith("error: --out mine.toml: ")
    assert (tmp_path / "mine.toml").read_text() == "earlier work"


def test_an_installed_package_has_them_inside(monkeypatch, tmp_path):
    """There is no clone around it; the wheel's own test says that they are in it."""
    (tmp_path / "paper.toml").write_text("# Inside: of the package.\n")
    monkeypatch.setattr("wedgebrake.model.studies.examples._FOLDERS", (tmp_path, FOLDER))
    assert examples.listing().splitlines()[1:] == ["  paper  Inside: of the package"]
