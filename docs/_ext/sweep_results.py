"""The directive ``sweep-results``: what a sweep tells of each point, from the library's table."""

from __future__ import annotations

from docutils import nodes
from sphinx.application import Sphinx
from sphinx.util.docutils import SphinxDirective

from wedgebrake.model.view import DRIVELINE
from wedgebrake.sweeps.results import Variable, variables


def setup(app: Sphinx) -> dict[str, bool]:
    """Register with Sphinx."""
    app.add_directive("sweep-results", SweepResults)
    return {"parallel_read_safe": True}


class SweepResults(SphinxDirective):
    """A list of names, units and meanings, and the words of a class."""

    def run(self) -> list[nodes.Node]:
        """The list."""
        listed = nodes.definition_list(classes=["simple"])
        for variable in variables(DRIVELINE):
            listed += _entry(variable)
        return [listed]


def _entry(variable: Variable) -> nodes.definition_list_item:
    term = nodes.term("", "", nodes.literal(text=variable.name))
    words = variable.meaning.replace("`", "")
    meaning = f"{words[0].upper()}{words[1:]} [{variable.unit}]."
    if variable.words is not None:
        names = (f"{int(one)} {one.name.lower().replace('_', ' ')}" for one in variable.words)
        meaning += f" {'; '.join(names)}."
    return nodes.definition_list_item("", term, nodes.definition("", nodes.paragraph(text=meaning)))
