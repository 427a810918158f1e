"""The verdict above the pictures: a headline and its tiles."""

from __future__ import annotations

from pathlib import Path
from typing import Any, ClassVar

import param
from panel.custom import JSComponent

from wedgebrake.explorer.ui.widgets.sheets import sheets

_HERE = Path(__file__).parent


class VerdictStrip(JSComponent):
    """The verdict in words and colour."""

    state = param.Dict(default={}, doc="verdict, pending")

    _esm = _HERE / "verdict_strip.js"
    _stylesheets: ClassVar[list[str]] = sheets("theme.css", "verdict_strip.css")

    def __init__(self, **params: Any) -> None:
        super().__init__(**{"sizing_mode": "stretch_width", **params})

    def show(self, verdict: dict[str, Any]) -> None:
        """Show a verdict, as ``verdict.verdict`` gives it."""
        self.state = {"verdict": verdict, "pending": False}

    def pending(self) -> None:
        """Say that the next verdict is being computed; the last one stays."""
        self.state = {**self.state, "pending": True}
