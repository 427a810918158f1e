"""The page: where each part stands."""

from __future__ import annotations

from pathlib import Path
from typing import ClassVar

from panel.custom import JSComponent
from panel.viewable import Child

from wedgebrake.explorer.ui.widgets.sheets import sheets

_HERE = Path(__file__).parent


class Page(JSComponent):
    """A grid with the parts in it; styles alone decide how it folds on a narrow screen."""

    header = Child()
    machine = Child()
    strip = Child()
    history = Child()
    phase = Child()
    stage = Child()
    spectrum = Child()
    section = Child()
    atlas = Child()

    _esm = _HERE / "page.js"
    _stylesheets: ClassVar[list[str]] = sheets("theme.css", "page.css")

    def seen(self, **numbers: int) -> None:
        """Say which change of the desk the motion, or the picture, now shows."""
        # By message: a parameter of a part with children is slow to set, as Panel then looks
        # through all models below it.
        self._send_msg(numbers)
