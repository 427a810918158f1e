"""``wedgebrake paper``: listing, figures, verdicts, the report, files, Ctrl-C, and wrong input."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest

import wedgebrake as wb
from children import interrupted, started
from printed import names, strict_json, unwrapped
from wedgebrake.figures.matplotlib.figure import new_figure
from wedgebrake.paper.claims import Assertion, Statement
from wedgebrake.paper.figures import FIGURES

PROGRAM = Path(sys.executable).parent / "wedgebrake"
# Figures that need no run, drawn in a moment.
QUICK = ["fig2", "fig3"]


@pytest.fixture
def run(run):
    """The command paper."""
    return lambda *arguments: run("paper", *arguments)


@pytest.fixture
def few(monkeypatch):
    """Two statements instead of all, tested without a run."""

    def yes(*_):
        return [Assertion("one", True, "1"), Assertion("two", True, "2")]

    def no(*_):
        return [Assertion("one", True, "1"), Assertion("two", False, "3")]

    words = {"test": "by looking", "tolerance": "none"}
    statements = (
        Statement("S1", "2", "It holds.", check=yes, **words),
        Statement("K1", "–", "It does not. " * 30, check=no, **words),
    )
    monkeypatch.setattr("wedgebrake.paper.statements.STATEMENTS", statements)


class TestFigures:
    def test_with_the_method_and_threads_asked_for(self, run, monkeypatch):
        seen = {}
        from wedgebrake.paper import laboratory

        class Spy(laboratory.Laboratory):
            def __init__(self, method, **more):
                seen.update(method=method, threads=more["threads"])
                super().__init__(method, **more)

        monkeypatch.setattr("wedgebrake.cli.paper_command.Laboratory", Spy)
        assert run("fig2", "--method", "exact", "--threads", "1", "--out", "f")[0] == 0
        assert seen == {"method": "exact", "threads": 1}

    def test_as_json(self, run):
        status, text, _ = run("fig2", "--json", "--out", "f")
        assert status == 0
        answer = strict_json(text)
        assert answer["files"] == [str(Path("f/fig2.png").resolve())]
        assert (answer["report"], answer["findings"], answer["counts"]) == (None, None, None)
        assert (answer["wedgebrake"], answer["method"]) == (wb.__version__, "smooth")


@pytest.mark.usefixtures("few")
class TestClaims:
    def test_have_their_verdicts(self, run):
        status, text, _ = run("claims", "--out", "f")
        assert status == 0
        assert re.search(r"^S1 .* reproduced +2 of 2 ", text, re.MULTILINE)
        assert re.search(r"^K1 +contradicted +1 of 2 ", text, re.MULTILINE)
        assert str(Path("f/claims.json").resolve()) in text
        kept = strict_json(Path("f/claims.json").read_text())
        assert len(kept["findings"]) == 2
        assert kept["corrected"].startswith("c = 0.1 ")
        assert kept["as_printed"].startswith("c = 1 ")


@pytest.mark.usefixtures("few", "short")
class TestAll:
    @pytest.fixture
    def short(self, monkeypatch):
        """Two figures and two statements, with comparisons that take no time."""
        from wedgebrake.paper.report import gather

        chosen = {name: FIGURES[name] for name in QUICK}
        for module in ("wedgebrake.cli.paper_command", "wedgebrake.paper.report.gather"):
            monkeypatch.setattr(f"{module}.FIGURES", chosen)

        def figure(_):

            made = new_figure()
            made.add_subplot()
            return made

        class Found:
            open_questions = (("Why?", "Nobody knows.", False),)
            paragraphs = ("They agree.",)

            rows = ()

            def table(self):
                return [{"Case": "a", "Distance": "1"}]

        monkeypatch.setattr(gather, "identify", lambda _: Found())
        monkeypatch.setattr(gather, "compare", lambda _: Found())
        monkeypatch.setattr(gather.studies, "identification", figure)
        monkeypatch.setattr(gather.studies, "smoothing", figure)

    def test_writes_everything(self, run):
        status, text, _ = run("all", "--out", "r")
        assert status == 0
        assert names("r") == ["claims.json", "fig2.png", "fig3.png", "report.html"]
        assert str(Path("r/report.html").resolve()) in text
        page = Path("r/report.html").read_text()
        for word in ("It holds.", "It does not.", "Nobody knows.", "They agree.",
                     "wedgebrake paper all --method smooth --out r", wb.__version__):  # fmt: skip
            assert word in page, word
        assert page.count("data:image/png;base64,") == 4


class TestInterrupt:
    def test_ends_at_once(self, tmp_path):
        """While figures are drawn: what is complete stays, and no half of anything."""
        process = started(
            [PROGRAM, "paper", "fig2", "fig9", "fig12", "--method", "ode14x", "--out", "f"],
            cwd=tmp_path, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
        )  # fmt: skip
        text, message = interrupted(process, (tmp_path / "f" / "fig2.png").exists)
        assert (process.returncode, text) == (1, "")
        assert "Traceback" not in message
        assert names(tmp_path / "f") == ["fig2.png"]


WRONG = {
    "figure": (["fig88"], "fig88"),
    "method": (["fig2", "--method", "exakt"], "--method exakt"),
    "no parent": (["fig2", "--out", "no/f"], "--out no/f"),
    "a file": (["fig2", "--out", "taken"], "--out taken"),
}


class TestWrongInput:
    @pytest.mark.parametrize("case", WRONG)
    def test_is_named(self, case, run):
        Path("taken").write_text("mine")
        arguments, named = WRONG[case]
        status, text, message = run(*arguments)
        assert (status, text) == (2, "")
        assert named in unwrapped(message)
        assert "Traceback" not in message
        assert names() == ["taken"]
        assert Path("taken").read_text() == "mine"
