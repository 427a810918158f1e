"""The notebooks run, and print what they were committed with."""

from pathlib import Path

import pytest

nbformat = pytest.importorskip("nbformat")
nbclient = pytest.importorskip("nbclient")

NOTEBOOKS = sorted((Path(__file__).parents[2] / "examples/notebooks").glob("*.ipynb"))


def printed(notebook):
    """For each cell of code the text that it printed, and whether it showed a picture."""
    found = []
    for cell in notebook.cells:
        if cell.cell_type == "code":
            text = "".join(o.text for o in cell.outputs if o.output_type == "stream")
            pictures = [o for o in cell.outputs if "image/png" in o.get("data", {})]
            found.append((text, bool(pictures)))
    return found


@pytest.mark.parametrize("path", NOTEBOOKS, ids=[path.stem for path in NOTEBOOKS])
# Of Jupyter's own parts, which warn of each other.
@pytest.mark.filterwarnings("ignore::DeprecationWarning", "ignore::RuntimeWarning:zmq")
def test_a_notebook_prints_what_it_was_committed_with(path, tmp_path):
    committed = nbformat.read(path, as_version=4)
    notebook = nbformat.read(path, as_version=4)
    client = nbclient.NotebookClient(
        notebook, timeout=300, kernel_name="python3", resources={"metadata": {"path": tmp_path}}
    )
    client.execute()
    assert printed(notebook) == printed(committed)
    assert any(picture for _, picture in printed(notebook))


@pytest.mark.parametrize("path", NOTEBOOKS, ids=[path.stem for path in NOTEBOOKS])
def test_a_notebook_is_small_and_says_nothing_of_the_machine_it_ran_on(path):
    text = path.read_text(encoding="utf-8")
    assert len(text) < 300_000
    for word in ("/home", "/work", "/tmp", "/root", "Traceback"):  # noqa: S108
        assert word not in text


def test_there_are_three():
    assert [path.stem for path in NOTEBOOKS] == ["engineer", "researcher", "teacher"]
