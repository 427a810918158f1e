"""Files of figures with a given width in pixels, for the command line and the report."""

from __future__ import annotations

import io
import os
from pathlib import Path
from typing import TYPE_CHECKING, Any

from wedgebrake.figures.matplotlib import style
from wedgebrake.model.files import write
from wedgebrake.model.validation import check_whole, wrong

if TYPE_CHECKING:
    from matplotlib.figure import Figure

# Metadata by format, without a creation date: the same figure gives the same bytes.
METADATA: dict[str, dict[str, Any]] = {
    "png": {},
    "svg": {"Date": None},
    "pdf": {"CreationDate": None},
}


def save(figure: Figure, path: str | os.PathLike[str], *, width: int = 1600) -> Path:
    """Write a figure as PNG, SVG or PDF, by the suffix of the path.

    The file is complete or, after an error, unchanged.

    figure : matplotlib.figure.Figure
    path   : ends in .png, .svg or .pdf
    width  : of a PNG [pixels]; the height follows

    Returns the path.

    Raises ``InputError`` for another suffix or a width outside 16 to 20000, ``OutputError``
    if the file cannot be written.
    """
    target = Path(path)
    kind = target.suffix.lower().removeprefix(".")
    if kind not in METADATA:
        raise wrong("path", str(path), "a file whose name ends in .png, .svg or .pdf")
    write(target, image(figure, kind, width=width))
    return target


def image(figure: Figure, kind: str, *, width: int = 1600) -> bytes:
    """Content of a figure's file.

    kind  : "png", "svg" or "pdf"
    width : of a PNG [pixels]

    Raises ``InputError`` for a width outside 16 to 20000.
    """
    check_whole("width", width, 16, 20_000, "a whole number of pixels")
    # Slightly more, since the size in pixels is truncated to whole numbers.
    dpi = width / figure.get_figwidth() * (1.0 + 1e-9)
    with style.use():
        if kind == "png":
            return paint(figure, dpi)
        content = io.BytesIO()
        figure.savefig(content, format=kind, dpi=dpi, metadata=METADATA[kind])
    return content.getvalue()


def paint(figure: Figure, dpi: float) -> bytes:
    """PNG of a figure: the bytes of ``savefig``, drawn once instead of twice."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg

    content = io.BytesIO()
    canvas, usual = figure.canvas, figure.dpi
    try:
        painter: Any = FigureCanvasAgg(figure)  # in part without types
        figure.dpi = dpi
        painter.print_png(content, metadata=METADATA["png"])
    finally:
        figure.dpi = usual
        figure.set_canvas(canvas)
    return content.getvalue()
