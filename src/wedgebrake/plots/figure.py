"""The figure that every picture is drawn on: it shows itself, and writes itself to files."""

from __future__ import annotations

import io
import os
from pathlib import Path
from typing import Any

import matplotlib as mpl
from matplotlib.figure import Figure

from wedgebrake.model.files import write
from wedgebrake.plots import style
from wedgebrake.plots.save import METADATA, paint

# In a notebook: pixels of an inch on the screen, and of the picture, sharp on fine screens too.
_SCREEN, _SHOWN = 100, 200


class Picture(Figure):
    """A Matplotlib figure that notebooks show, with or without Matplotlib's own backend for them.

    It keeps the style of wedgebrake's pictures whenever it is painted, whatever the settings of
    Matplotlib are by then. pyplot knows nothing of it.
    """

    def draw(self, renderer: Any) -> None:
        """Paint it, in its style."""
        with mpl.rc_context(style.PAINTED):
            super().draw(renderer)

    def savefig(self, fname: Any, *, transparent: bool | None = None, **options: Any) -> None:
        """Write it to a file, as Matplotlib's ``savefig`` does.

        The text of a PDF is set in TrueType fonts, that of an SVG is text. No file says when it
        was made, unless ``metadata`` does. The file is complete or, after an error, as it was
        before.

        fname       : path, or a file opened for writing in binary
        transparent : whether the paper of figure and axes is
        options     : ``dpi``, ``format`` and all others of Matplotlib's ``savefig``

        Raises ``OutputError`` where nothing can be written.
        """
        options["transparent"] = transparent
        path = _path(fname, options)
        kind = options.get("format")
        if METADATA.get(str(kind).lower()):
            given = options.get("metadata") or {}
            options["metadata"] = {**METADATA[str(kind).lower()], **given}
        # The fonts of a PDF follow the settings while it is painted and again while it is closed. A
        # book of pages (PdfPages) is closed later, by its owner.
        whole = path is not None or hasattr(fname, "write")
        with mpl.rc_context(style.WRITTEN if whole else style.PAINTED):
            if path is None:
                super().savefig(fname, **options)
                return
            content = io.BytesIO()
            super().savefig(content, **options)
        write(path, content.getvalue())

    def _repr_png_(self) -> tuple[bytes, dict[str, int]]:
        """Its pixels, and the width and height to show them at, for notebooks."""
        across, up = (round(_SCREEN * size) for size in self.get_size_inches())
        return paint(self, _SHOWN), {"width": across, "height": up}


def _path(fname: Any, options: dict[str, Any]) -> Path | None:
    """The file to be written or replaced as a whole, its format put into the options.

    None for what is no such file: an open one, a device, a pipe.
    """
    if not isinstance(fname, str | os.PathLike):
        return None
    path = Path(os.path.realpath(fname))
    if path.exists() and not path.is_file():
        return None
    kind = options.get("format") or Path(fname).suffix[1:]
    if not kind:  # as Matplotlib does
        kind = mpl.rcParams["savefig.format"]
        path = path.with_name(f"{path.name.rstrip('.')}.{kind}")
    options["format"] = kind
    return path
