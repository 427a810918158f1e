"""The bar at the top: presets, files, exact or smoothed friction, the ghost, help, notices."""

from __future__ import annotations

import base64
from pathlib import Path
from typing import Any, ClassVar, Literal, Protocol

import param
from panel.custom import JSComponent

from wedgebrake.explorer.core.limits import FINE_MAP, FINE_POINTS, MOST_PERIODS, MOST_UPLOAD
from wedgebrake.explorer.core.state import Desk
from wedgebrake.explorer.ui.widgets.events import OnEvent, passing
from wedgebrake.explorer.ui.widgets.sheets import sheets
from wedgebrake.model.brakes import ConventionalBrake
from wedgebrake.model.friction import CoulombFriction, SmoothedFriction

_HERE = Path(__file__).parent
_HEARD = ("preset", "upload", "export", "edit")
_LIMITS = (
    "One degree of freedom; the brake has neither mass nor elasticity. Linear stability takes"
    f" friction as constant over speed. A run here has at most {MOST_PERIODS} periods of the"
    f" torque, a diagram {FINE_POINTS} values, a map {FINE_MAP[0]} × {FINE_MAP[1]} cells; the"
    " Python library and the command line go further."
)


class Delivered(Protocol):
    """A file for the user: name, media type, content."""

    @property
    def name(self) -> str: ...  # noqa: D102
    @property
    def mime(self) -> str: ...  # noqa: D102
    @property
    def content(self) -> bytes: ...  # noqa: D102


class Header(JSComponent):
    """The bar at the top.

    on_event : called with {type: "preset", name}, {type: "upload", name, size, text},
               {type: "export", format} and {type: "edit", changes} of ghost and friction
    presets  : {name, title, group} of each, in order
    """

    state = param.Dict(default={}, doc="presets, limits, friction, ghost, busy, notice")

    _esm = _HERE / "header.js"
    _stylesheets: ClassVar[list[str]] = sheets("theme.css", "header.css")

    def __init__(self, on_event: OnEvent, presets: list[dict[str, str]], **params: Any) -> None:
        super().__init__(**{"sizing_mode": "stretch_width", "height": 48, **params})
        self.state = {
            "presets": presets, "most_upload": MOST_UPLOAD, "limits": _LIMITS, "busy": ""
        }  # fmt: skip
        self._notices = 0
        self.on_msg(passing(on_event, _HEARD))

    def show(self, desk: Desk) -> None:
        """Show what the desk says: the friction law and whether there is a ghost."""
        laws = [[CoulombFriction.kind, "Exact"], [SmoothedFriction.kind, "Smoothed"]]
        kind = desk.system.friction.kind
        if kind not in (law for law, _ in laws):
            laws.append([kind, "Table"])
        self._put(
            friction=kind,
            laws=laws,
            ghost=desk.view.ghost,
            conventional=isinstance(desk.system.brake, ConventionalBrake),
        )

    def choose(self, name: str) -> None:
        """Show which preset lies on the desk; an empty name: none of them any more."""
        self._put(preset=name)

    def notify(
        self, text: str, tone: Literal["good", "warn", "bad", "neutral"] = "neutral"
    ) -> None:
        """Show a message below the bar until it is dismissed; an empty one takes it away."""
        self._notices += 1
        self._put(notice={"text": text, "tone": tone, "number": self._notices})

    def busy(self, text: str | None) -> None:
        """Say what is going on; None: nothing."""
        self._put(busy=text or "")

    def deliver(self, file: Delivered) -> None:
        """Hand a file to the browser, which saves it."""
        content = base64.b64encode(file.content).decode("ascii")
        self._send_msg({"type": "file", "name": file.name, "mime": file.mime, "base64": content})

    def _put(self, **changes: Any) -> None:
        self.state = {**self.state, **changes}
