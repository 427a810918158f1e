"""How the documentation is built: ``make docs``, or ``sphinx-build -W docs out/docs``."""

import sys
from pathlib import Path
from shutil import copy2

sys.path.insert(0, str(Path(__file__).parent / "_ext"))

from wedgebrake import __version__

project = "wedgebrake"
author = "The wedgebrake developers"
copyright = f"2026, {author}"  # noqa: A001 - the name that Sphinx reads
version = release = __version__

extensions = [
    "myst_nb",
    "sphinx.ext.autodoc",
    "plain_docstrings",
    "command_line",
    "sweep_results",
    "mathml",
]
exclude_patterns = ["_ext", "**/.ipynb_checkpoints"]
# The audit is a page of its own, made by `make paper`.
html_extra_path = ["paper.html"]

# Indented blocks are formulas and what a program prints, not code.
highlight_language = "none"
smartquotes = False  # -- begins an option, and θ'' is a derivative
myst_heading_anchors = 3
myst_enable_extensions = ["dollarmath"]
html_math_renderer = "mathml"
# Notebooks are shown as they were committed; a test runs them and compares.
nb_execution_mode = "off"
nb_merge_streams = True

autodoc_typehints = "none"  # docstrings give types, shapes and units in words
autodoc_member_order = "bysource"
autodoc_preserve_defaults = True
add_module_names = False
toc_object_entries_show_parents = "hide"

# What every part of the machine has from its base, and is said on the page once.
_INHERITED = {"kind", "kinds", "table"}
# The notebooks lie with the examples; pages must lie here to be built.
_NOTEBOOKS = "../examples/notebooks/"


def setup(app):
    """Bring the notebooks here, and leave out what no reader of the library calls."""
    here = Path(__file__).parent
    (here / "notebooks").mkdir(exist_ok=True)
    for path in sorted((here / _NOTEBOOKS).glob("*.ipynb")):
        copy2(path, here / "notebooks")

    def read(_app, _name, source):
        source[0] = source[0].replace(_NOTEBOOKS, "notebooks/")

    def skip(_app, _what, name, _subject, _skip, _options):
        return True if name.startswith("model_") or name in _INHERITED else None

    app.connect("source-read", read)
    app.connect("autodoc-skip-member", skip)


html_theme = "furo"
html_title = f"wedgebrake {version}"
html_static_path = ["_static"]
html_css_files = ["pages.css"]
html_copy_source = False
html_show_sphinx = False
