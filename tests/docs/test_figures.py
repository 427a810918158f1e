"""The figures of the pages can be drawn again, and each is shown."""

import re
import runpy
from pathlib import Path

DOCS = Path(__file__).parents[2] / "docs"


def test_every_figure_is_drawn_by_the_script_and_shown_on_a_page(tmp_path):
    script = runpy.run_path(str(DOCS / "figures.py"))
    script["main"].__globals__["FIGURES"] = tmp_path
    script["main"]([])
    drawn = {path.name for path in tmp_path.iterdir()}
    pages = " ".join(path.read_text(encoding="utf-8") for path in DOCS.glob("*.md"))
    assert drawn == {path.name for path in (DOCS / "figures").iterdir()}
    assert drawn == set(re.findall(r"\(figures/([\w.]+)\)", pages))


def test_the_readings_of_the_adding_sliding_figure_are_those_of_the_branch():
    script = runpy.run_path(str(DOCS / "figures.py"))
    before, after = script["BEFORE"], script["AFTER"]
    text = (DOCS / "theory.md").read_text(encoding="utf-8")
    [at] = re.findall(r"at η = −([\d.]+) it touches the end", text)
    assert before < -float(at) < after
