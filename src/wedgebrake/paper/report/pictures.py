"""Figures drawn, as the bytes of their files."""

from __future__ import annotations

from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Protocol

from wedgebrake.paper.figures import FIGURES, draw
from wedgebrake.paper.laboratory import Laboratory
from wedgebrake.paper.report.content import Illustration
from wedgebrake.plots.save import save

if TYPE_CHECKING:
    from matplotlib.figure import Figure


class Watch(Protocol):
    """Who hears of what is done, from any thread."""

    def part(self) -> None:
        """One more part is done."""

    def file(self, name: str, content: bytes) -> None:
        """A file is complete: its name, as "fig8.png", and what stands in it."""


def drawn(name: str, laboratory: Laboratory, kind: str, watch: Watch) -> tuple[Figure, bytes]:
    """One of the paper's figures, and what stands in its file.

    kind : of the file, "png", "svg" or "pdf"
    """
    figure = draw(name, laboratory)
    content = image(figure, kind)
    watch.file(f"{name}.{kind}", content)
    watch.part()
    return figure, content


def illustration(name: str, laboratory: Laboratory, kind: str, watch: Watch) -> Illustration:
    """One of the paper's figures for the page; its file may be of another kind."""
    figure, content = drawn(name, laboratory, kind, watch)
    png = content if kind == "png" else image(figure, "png")
    about = FIGURES[name]
    return Illustration(name, str(about.number), about.caption, png, figure.get_figwidth())


def image(figure: Figure, kind: str) -> bytes:
    """What stands in the file of a figure."""
    with TemporaryDirectory() as folder:
        return save(figure, Path(folder) / f"figure.{kind}").read_bytes()
