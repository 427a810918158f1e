"""The class of all figures: display in notebooks and output to files."""

from __future__ import annotations

import io
import os
from pathlib import Path
from typing import Any

import matplotlib as mpl
from matplotlib.figure import Figure

from wedgebrake.figures.matplotlib import style
from wedgebrake.figures.matplotlib.save import METADATA, paint
from wedgebrake.model.files import write

# Pixels per inch in a notebook: displayed, and in the image, for high-resolution screens.
_SCREEN, _SHOWN = 100, 200


class Picture(Figure):
    """A Matplotlib figure that notebooks display with or without Matplotlib's inline backend.

    It is always drawn in the style in which it was created, by default that of wedgebrake,
    regardless of the current Matplotlib settings. It is not registered with pyplot.
    """

    def __init__(self, *arguments: Any, **options: Any) -> None:
        super().__init__(*arguments, **options)
        self._written: Any = dict(style.look().settings)
        self._painted = style.look().painted

    def draw(self, renderer: Any) -> None:
        """Draw the figure in its style."""
        with mpl.rc_context(self._painted):
            super().draw(renderer)

    def savefig(self, fname: Any, *, transparent: bool | None = None, **options: Any) -> None:
        """Write the figure to a file, as Matplotlib's ``savefig`` does.

        PDF and EPS files embed TrueType fonts, and SVG files keep text as text. Files contain no
        creation date unless ``metadata`` states one. After an error an existing file is unchanged.

        fname       : path, or a file opened for writing in binary mode
        transparent : make the background of figure and axes transparent
        options     : ``dpi``, ``format`` and all other options of Matplotlib's ``savefig``

        Raises ``OutputError`` if the file cannot be written.
        """
        options["transparent"] = transparent
        path = _path(fname, options)
        kind = options.get("format")
        if METADATA.get(str(kind).lower()):
            given = options.get("metadata") or {}
            options["metadata"] = {**METADATA[str(kind).lower()], **given}
        # The fonts of a PDF depend on the settings while it is drawn and again while it is closed.
        # A PdfPages object is closed later, by the caller.
        whole = path is not None or hasattr(fname, "write")
        with mpl.rc_context(self._written if whole else self._painted):
            if path is None:
                super().savefig(fname, **options)
                return
            content = io.BytesIO()
            super().savefig(content, **options)
        write(path, content.getvalue())

    def _repr_png_(self) -> tuple[bytes, dict[str, int]]:
        """PNG image for notebooks, with the width and height of its display."""
        across, up = (round(_SCREEN * size) for size in self.get_size_inches())
        return paint(self, _SHOWN), {"width": across, "height": up}


def new_figure(width: float = style.COLUMN, height: float | None = None) -> Picture:
    """An empty figure of a width and height [inch], without pyplot."""
    figure = Picture(figsize=(width, 0.75 * width if height is None else height))
    figure.set_layout_engine("constrained", w_pad=0.06, h_pad=0.06, wspace=0.04, hspace=0.04)
    return figure


def _path(fname: Any, options: dict[str, Any]) -> Path | None:
    """Path of a regular file to be written; stores its format in the options.

    None for an open file, a device or a pipe.
    """
    if not isinstance(fname, str | os.PathLike):
        return None
    path = Path(os.path.realpath(fname))
    if path.exists() and not path.is_file():
        return None
    kind = options.get("format") or Path(fname).suffix[1:]
    if not kind:  # as in Matplotlib
        kind = mpl.rcParams["savefig.format"]
        path = path.with_name(f"{path.name.rstrip('.')}.{kind}")
    options["format"] = kind
    return path
