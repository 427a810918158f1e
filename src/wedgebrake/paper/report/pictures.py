"""Figures drawn, as the bytes of their files."""

from __future__ import annotations

import io
from typing import TYPE_CHECKING, Protocol

from wedgebrake.figures.matplotlib.save import image
from wedgebrake.paper.figures import draw
from wedgebrake.paper.laboratory import Laboratory

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_COLOURS = 96


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


def small(png: bytes) -> bytes:
    """The same picture in few colours, a third of the size: drawings need no more."""
    from PIL import Image

    few = Image.open(io.BytesIO(png)).convert("RGB").quantize(_COLOURS, dither=Image.Dither.NONE)
    content = io.BytesIO()
    few.save(content, "PNG")
    return content.getvalue()
