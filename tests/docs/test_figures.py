"""The figures of the pages can be drawn again, and each is shown."""

import re
import runpy
from pathlib import Path

import wedgebrake as wb

DOCS = Path(__file__).parents[2] / "docs"


def test_every_figure_is_drawn_by_the_script_and_shown_on_a_page(tmp_path):
    script = runpy.run_path(str(DOCS / "figures.py"))
    script["main"].__globals__["FIGURES"] = tmp_path
    script["main"]([])
    drawn = {path.name for path in tmp_path.iterdir()}
    pages = " ".join(path.read_text(encoding="utf-8") for path in DOCS.glob("*.md"))
    assert drawn == {path.name for path in (DOCS / "figures").iterdir()}
    assert drawn == set(re.findall(r"\(figures/([\w.]+)\)", pages))


def test_the_caption_of_the_adding_sliding_figure_says_where_it_is():
    script = runpy.run_path(str(DOCS / "figures.py"))
    start = wb.orbit(script["SYSTEM"].replace(eta=-36), order=2)
    branch = wb.continuation(start, eta=(-36, script["AFTER"]))
    kinds = {p.bifurcation.kind.value: p.value for p in branch if p.bifurcation}
    text = (DOCS / "numerics.md").read_text(encoding="utf-8")
    [caption] = re.findall(r"at \$\\eta = -([\d.]+)\$ it touches the end", text)
    assert f"{-kinds['adding-sliding']:.4f}" == caption
