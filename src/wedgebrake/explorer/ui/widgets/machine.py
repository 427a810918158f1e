"""The machine's values, to be changed by slider, by number and by choice."""

from __future__ import annotations

from pathlib import Path
from typing import Any, ClassVar

import param
from panel.custom import JSComponent

from wedgebrake.explorer.core.fields import sections
from wedgebrake.explorer.core.state import Desk
from wedgebrake.explorer.ui.widgets.events import OnEvent, passing
from wedgebrake.explorer.ui.widgets.packing import packed
from wedgebrake.explorer.ui.widgets.sheets import sheets

_HERE = Path(__file__).parent


class Machine(JSComponent):
    """The left panel.

    on_event : called with {type: "edit", changes, seq, done}; ``done`` is false while a slider
               is dragged
    """

    state = param.String(default="{}", doc="sections, refusal, seq, as JSON")

    _esm = _HERE / "machine.js"
    _stylesheets: ClassVar[list[str]] = sheets("theme.css", "machine.css")

    def __init__(self, on_event: OnEvent, **params: Any) -> None:
        super().__init__(**{"sizing_mode": "stretch_width", **params})
        self.on_msg(passing(on_event, ("edit",)))

    def show(self, desk: Desk, refusal: tuple[str, str] | None = None, seq: int = 0) -> None:
        """Show the values on a desk.

        refusal : name and message of an edit that was refused; the desk is then the old one
        seq     : number of the edit that this answers, 0 for none
        """
        self.state = packed(
            {
                "sections": sections(desk),
                "refusal": None if refusal is None else list(refusal),
                "seq": seq,
            }
        )
