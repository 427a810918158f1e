"""The notebooks run, and print what they were committed with."""

from functools import cache
from pathlib import Path

import pytest

nbformat = pytest.importorskip("nbformat")
nbclient = pytest.importorskip("nbclient")

NOTEBOOKS = sorted((Path(__file__).parents[2] / "examples/notebooks").glob("*.ipynb"))


def printed(cells):
    """For each cell of code the text that it printed, and whether it showed a picture."""
    found = []
    for cell in cells:
        if cell.cell_type == "code":
            lines = "".join(o.text for o in cell.outputs if o.output_type == "stream").splitlines()
            # What the first use of a function compiles depends on the runs before.
            text = "\n".join(one for one in lines if one.strip() and not one.startswith("Compiling"))
            pictures = [o for o in cell.outputs if "image/png" in o.get("data", {})]
            found.append((text, bool(pictures)))
    return found


# The pictures and results of a session, each the last line of a cell.
SHOWN = {
    "import wedgebrake as wb\nsystem = wb.paper.system(eta=-24)\n"
    "wb.plot(wb.simulate(system, periods=5))": "image/png",
    "from IPython.display import display\n"
    "display(wb.plot(wb.poincare(system, periods=5, transient=1)))": "image/png",
    "wb.motion(system)": "text/html",
    "wb.stability(system)": "text/html",
    "wb.orbit(system, order=1)": "text/html",
    "system": "text/html",
}
# In the kernel of this notebook they are shown after its own cells.
LAST = "teacher"


@cache
def executed(path):
    """The cells of a notebook as they were executed, and those that come after them."""
    notebook = nbformat.read(path, as_version=4)
    count = len(notebook.cells)
    if path.stem == LAST:
        sources = [*SHOWN, "import matplotlib.pyplot", *SHOWN]
        notebook.cells += map(nbformat.v4.new_code_cell, sources)
    # They read files of the examples, and write none.
    where = {"metadata": {"path": str(path.parent)}}
    nbclient.NotebookClient(notebook, timeout=300, kernel_name="python3", resources=where).execute()
    return notebook.cells[:count], notebook.cells[count:]


@pytest.mark.parametrize(
    "path",
    [
        pytest.param(path, id=path.stem, marks=[pytest.mark.slow] * (path.stem == "researcher"))
        for path in NOTEBOOKS
    ],
)
# Of Jupyter's own parts, which warn of each other.
@pytest.mark.filterwarnings("ignore::DeprecationWarning", "ignore::RuntimeWarning:zmq")
def test_a_notebook_prints_what_it_was_committed_with(path):
    cells, _ = executed(path)
    assert printed(cells) == printed(nbformat.read(path, as_version=4).cells)
    assert any(picture for _, picture in printed(cells))


@pytest.mark.parametrize("path", NOTEBOOKS, ids=[path.stem for path in NOTEBOOKS])
def test_a_notebook_is_small_and_says_nothing_of_the_machine_it_ran_on(path):
    text = path.read_text(encoding="utf-8")
    assert len(text) < 300_000
    for word in ("/home", "/work", "/tmp", "/root", "Traceback"):  # noqa: S108
        assert word not in text


@pytest.mark.filterwarnings("ignore::DeprecationWarning", "ignore::RuntimeWarning:zmq")
def test_pictures_and_results_show_themselves_once():
    """Also once pyplot is imported, which has its own way to show them."""
    _, cells = executed(next(path for path in NOTEBOOKS if path.stem == LAST))
    shown = [cell for cell in cells if cell.source in SHOWN]
    assert len(shown) == 2 * len(SHOWN)
    for cell in shown:
        kind = SHOWN[cell.source]
        [output] = cell.outputs
        assert kind in output.data
        assert len([one for one in output.data if one.startswith("image/")]) == (
            kind == "image/png"
        )
