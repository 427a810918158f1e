"""The directive ``commands``: every command and option, from the program itself."""

from __future__ import annotations

from typing import Any

import typer
from docutils import nodes
from sphinx.application import Sphinx
from sphinx.util.docutils import SphinxDirective

from wedgebrake.cli.commands import app as program


def setup(app: Sphinx) -> dict[str, bool]:
    """Register with Sphinx."""
    app.add_directive("commands", Commands)
    return {"parallel_read_safe": True}


class Commands(SphinxDirective):
    """A section for each command: how it is called, what it does, its options, an example."""

    def run(self) -> list[nodes.Node]:
        """The sections."""
        group: Any = typer.main.get_command(program)
        above = group.context_class(group, info_name="wedgebrake", **group.context_settings)
        return [self._section(name, one, above) for name, one in group.commands.items()]

    def _section(self, name: str, command: Any, above: Any) -> nodes.section:
        section = nodes.section(names=[name], ids=[f"wedgebrake-{name}"])
        self.state.document.note_explicit_target(section)
        section += nodes.title(text=f"wedgebrake {name}")
        context = command.context_class(command, info_name=name, parent=above)
        usage = " ".join([context.command_path, *command.collect_usage_pieces(context)])
        section += nodes.literal_block(text=usage, language="none")
        for paragraph in (command.help or command.short_help).split("\n\n"):
            section += nodes.paragraph(text=" ".join(paragraph.split()))
        records = [one.get_help_record(context) for one in command.get_params(context)]
        section += _options([record for record in records if record])
        if command.epilog:
            section += nodes.paragraph(text=command.epilog)
        return section


def _options(records: list[tuple[str, str]]) -> nodes.definition_list:
    listed = nodes.definition_list(classes=["simple"])
    for name, words in records:
        term = nodes.term("", "", nodes.literal(text=name))
        meaning = nodes.definition("", nodes.paragraph(text=words))
        listed += nodes.definition_list_item("", term, meaning)
    return listed
